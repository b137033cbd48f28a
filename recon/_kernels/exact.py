"""Exact signs for any finite float64 input: integers of as many digits as it takes.

A number is a row of int64 digits, x = sum(digit[i] * 2**(BITS * i)) in units of a power of two that all numbers of one
determinant share. Digits are signed and balanced, |digit| <= 2**(BITS-1), so that the sign of a number is the sign of
its first digit from the top, and 2**12 products can be summed before a carry is due. No exponent is out of range:
denormals against 1e100 merely take more digits. This is the slow last resort behind the filters in `predicates`.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel

BITS = 26
_BASE = 1 << BITS
_HALF = 1 << (BITS - 1)
_NO_BIT = 1 << 20  # "exponent" of the lowest bit of zero: above all others


@kernel
def lowest_bit(x):
    """Exponent of the lowest set bit of a finite float64; a large number for zero."""
    if x == 0.0:
        return _NO_BIT
    fraction, exponent = math.frexp(x)
    mantissa = np.int64(math.ldexp(fraction, 53))
    exponent -= 53
    while mantissa & 1 == 0:
        mantissa >>= 1
        exponent += 1
    return exponent


@kernel
def highest_bit(x):
    """Smallest e with abs(x) < 2**e; a very negative number for zero."""
    return math.frexp(x)[1] if x != 0.0 else -_NO_BIT


@kernel
def carry(digits, length):
    """Balance the digits of a number, in place; the last one must have room for what is left."""
    for i in range(length - 1):
        over = (digits[i] + _HALF) >> BITS
        digits[i] -= over << BITS
        digits[i + 1] += over


@kernel
def sign(digits, length):
    """Sign of a number with balanced digits."""
    for i in range(length - 1, -1, -1):
        if digits[i] != 0:
            return 1 if digits[i] > 0 else -1
    return 0


@kernel
def add_float(digits, x, unit, factor):
    """Add factor (1 or -1) times x / 2**unit, an integer, to a number; carry is left to the caller."""
    if x == 0.0:
        return
    fraction, exponent = math.frexp(x)
    mantissa = factor * np.int64(math.ldexp(fraction, 53))
    shift = exponent - 53 - unit
    if shift < 0:  # the low bits are zero: x is a multiple of the unit
        mantissa >>= -shift
        shift = 0
    place = shift // BITS
    shift -= place * BITS
    while mantissa != 0:  # one signed digit at a time, so that nothing leaves 63 bits
        digit = ((mantissa + _HALF) & (_BASE - 1)) - _HALF
        mantissa = (mantissa - digit) >> BITS
        piece = digit << shift
        over = (piece + _HALF) >> BITS
        digits[place] += piece - (over << BITS)
        digits[place + 1] += over
        place += 1


@kernel
def add_product(digits, a, a_length, b, b_length, factor):
    """Add factor (1 or -1) times a b to a number; carry is left to the caller."""
    for i in range(a_length):
        x = factor * a[i]
        if x != 0:
            for j in range(b_length):
                digits[i + j] += x * b[j]


@kernel
def determinant_sign(rows, origin, weights, origin_weight, n, lifted):
    """Sign of the n x n determinant of rows[i] - origin, the last column replaced by the height if `lifted`.

    The height of row i is |rows[i] - origin|**2 - (weights[i] - origin_weight), over all columns of `rows`; it stands
    behind the first n - 1 columns. By Laplace expansion over subsets of rows.
    """
    columns = rows.shape[1]
    unit, top = _NO_BIT, -_NO_BIT
    for i in range(n + 1):
        for c in range(columns):
            x = rows[i, c] if i < n else origin[c]
            unit, top = min(unit, lowest_bit(x)), max(top, highest_bit(x))
        if lifted:  # weights are integers in units of 2**(2 unit), as squares are
            x = weights[i] if i < n else origin_weight
            unit, top = min(unit, lowest_bit(x) // 2), max(top, (highest_bit(x) + 1) // 2)
    if top < unit:
        return 0  # nothing but zeros

    size = (top - unit + 2) // BITS + 2  # digits of a difference
    entries = np.zeros((n, n, 2 * size + 2), np.int64)
    difference = np.zeros(size, np.int64)
    length = np.zeros(n, np.int64)  # digits in use, by column
    for i in range(n):
        for c in range(columns):
            difference[:] = 0
            add_float(difference, rows[i, c], unit, 1)
            add_float(difference, origin[c], unit, -1)
            carry(difference, size)
            used = size
            while used > 0 and difference[used - 1] == 0:
                used -= 1
            if lifted:
                add_product(entries[i, n - 1], difference, used, difference, used, 1)
            if c < n - 1 or (not lifted and c < n):
                entries[i, c, :used] = difference[:used]
                length[c] = max(length[c], used)
        if lifted:
            add_float(entries[i, n - 1], weights[i], 2 * unit, -1)
            add_float(entries[i, n - 1], origin_weight, 2 * unit, 1)
            carry(entries[i, n - 1], 2 * size + 2)
    for i in range(n):
        used = entries.shape[2]
        while used > length[n - 1] and entries[i, n - 1, used - 1] == 0:
            used -= 1
        length[n - 1] = max(length[n - 1], used)

    # minors[s]: determinant of the rows in the bit set s over the first |s| columns.
    widths = np.zeros(n + 1, np.int64)
    for c in range(n):
        widths[c + 1] = widths[c] + length[c] + 1
    minors = np.zeros((1 << n, widths[n] + 1), np.int64)
    minors[0, 0] = 1
    widths[0] = 1
    for s in range(1, 1 << n):
        order = 0
        for i in range(n):
            order += (s >> i) & 1
        factor = 1 if order % 2 == 1 else -1  # cofactor signs along the last column
        for i in range(n):
            if (s >> i) & 1:
                add_product(
                    minors[s], minors[s ^ (1 << i)], widths[order - 1], entries[i, order - 1], length[order - 1], factor
                )
                factor = -factor
        carry(minors[s], minors.shape[1])
    return sign(minors[(1 << n) - 1], minors.shape[1])
