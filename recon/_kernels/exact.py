"""Exact signs for any finite float64 input: integers of as many digits as it takes.

A number is a run of int64 digits, x = sum(digit[i] * 2**(BITS * i)) in units of a power of two that all numbers of one
determinant share. Digits are signed and balanced, |digit| <= 2**(BITS - 1), so that the sign of a number is the sign of
its first digit from the top, and 2**12 products can be summed before a carry is due. No exponent is out of range:
denormals against 1e100 merely take more digits. This is the slow last resort behind the filters in `predicates`.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel

BITS = 26
_HALF = 1 << (BITS - 1)
_LOW = (1 << BITS) - 1
_FRACTION = (1 << 52) - 1
_EXPONENT = 0x7FF << 52
_FAR = 1 << 20  # beyond all exponents


@kernel
def fraction(bits):
    """Take the 53 bits of a finite float64 apart: its magnitude is this integer times 2**exponent(bits)."""
    return (bits & _FRACTION) | (np.int64((bits & _EXPONENT) != 0) << 52)


@kernel
def exponent(bits):
    """Exponent of the last of the 53 bits."""
    return max((bits & _EXPONENT) >> 52, 1) - 1075


@kernel
def lowest_bit(x):
    """Exponent of the lowest set bit of a finite float64; a large number for zero."""
    bits = np.float64(x).view(np.int64)
    whole = fraction(bits)
    if whole == 0:
        return _FAR
    power = np.float64(whole & -whole).view(np.int64)
    return exponent(bits) + (power >> 52) - 1023


@kernel
def add_float(digits, x, unit, factor):
    """Add factor (1 or -1) times x / 2**unit, an integer, to a number; carry is left to the caller."""
    bits = np.float64(x).view(np.int64)
    whole = fraction(bits)
    if whole == 0:
        return
    shift = exponent(bits) - unit
    if shift < 0:  # the low bits are zero: x is a multiple of the unit
        whole >>= -shift
        shift = 0
    if bits < 0:
        factor = -factor
    place = shift // BITS
    shift -= place * BITS
    digits[place] += factor * ((whole & _LOW) << shift)
    digits[place + 1] += factor * ((whole >> BITS) << shift)


@kernel
def carry(digits, at, length):
    """Balance the digits of a number; the last one takes what is left. Give the number of digits in use."""
    used = 0
    for i in range(at, at + length - 1):
        over = (digits[i] + _HALF) >> BITS
        digits[i] -= over << BITS
        digits[i + 1] += over
        if digits[i] != 0:
            used = i - at + 1
    return length if digits[at + length - 1] != 0 else used


@kernel
def add_product(digits, at, a, a_length, b, b_length, factor):
    """Add factor (1 or -1) times the product of the numbers at a and b to the one at `at`; the caller carries."""
    for i in range(a_length):
        x = factor * digits[a + i]
        if x != 0:
            for j in range(b_length):
                digits[at + i + j] += x * digits[b + j]


@kernel
def determinant_sign(points, lifted):
    """Sign of the n x n determinant of the differences of n points from one, the last column replaced if `lifted` (1).

    points: x, y, z, w of the n points and of the one, flat. The height, which replaces the last column, is
    |difference|**2 - (difference of the weights), over x, y and z. By Laplace expansion over subsets of rows.
    """
    n = points.size // 4 - 1
    columns = 3 if lifted else n
    unit, top = _FAR, -_FAR
    for i in range(n + 1):
        for c in range(columns):
            x = points[4 * i + c]
            if x != 0.0:
                unit, top = min(unit, lowest_bit(x)), max(top, exponent(np.float64(x).view(np.int64)) + 53)
        x = points[4 * i + 3]
        if lifted and x != 0.0:  # weights count in units of 2**(2 unit), as squares do
            unit, top = min(unit, lowest_bit(x) // 2), max(top, (exponent(np.float64(x).view(np.int64)) + 54) // 2)
    if top < unit:
        return 0  # nothing but zeros

    size = (top - unit) // BITS + 3  # digits of a difference
    height = 2 * size + 1
    minor = (n - 1) * size + (height if lifted else size) + n
    minors = n * n * height
    difference = minors + (1 << n) * minor
    digits = np.zeros(difference + size, np.int64)
    length = np.zeros(8, np.int64)  # digits in use: of the entries of each column; then of the minors of each order
    for i in range(n):
        last = (n * i + n - 1) * height
        for c in range(columns):
            digits[difference : difference + size] = 0
            add_float(digits[difference:], points[4 * i + c], unit, 1)
            add_float(digits[difference:], points[4 * n + c], unit, -1)
            used = carry(digits, difference, size)
            if lifted:
                add_product(digits, last, difference, used, difference, used, 1)
            if c < n - 1 or not lifted:
                length[c] = max(length[c], used)
                for k in range(used):
                    digits[(n * i + c) * height + k] = digits[difference + k]
        if lifted:
            add_float(digits[last:], points[4 * i + 3], 2 * unit, -1)
            add_float(digits[last:], points[4 * n + 3], 2 * unit, 1)
            length[n - 1] = max(length[n - 1], carry(digits, last, height))

    # The minor of a set of rows, its bits, is over as many columns, from the first on.
    digits[minors] = 1
    length[4] = 1
    for rows in range(1, 1 << n):
        order = 0
        for i in range(n):
            order += (rows >> i) & 1
        here = minors + rows * minor
        cofactor = 1 if order % 2 == 1 else -1
        for i in range(n):
            if (rows >> i) & 1:
                smaller, entry = minors + (rows ^ (1 << i)) * minor, (n * i + order - 1) * height
                add_product(digits, here, smaller, length[3 + order], entry, length[order - 1], cofactor)
                cofactor = -cofactor
        used = carry(digits, here, length[3 + order] + length[order - 1] + 1)
        if order < n:
            length[4 + order] = max(length[4 + order], used)
    for k in range(difference - 1, difference - minor - 1, -1):
        if digits[k] != 0:
            return 1 if digits[k] > 0 else -1
    return 0
