"""Error-free transformations and double-double arithmetic (Dekker 1971, Knuth; names from Shewchuk 1997).

A double-double (hi, lo) stands for the real number hi + lo, with |lo| <= ulp(hi) / 2. With u = 2**-53 the relative error
of `dd_mul` is at most 7 u**2 and the error of `dd_add` at most 3 u**2 (|a| + |b|) (Joldes, Muller, Popescu 2017), while
nothing under- or overflows. Where operands and result are integer multiples of one unit and stay below 2**104 of it, all
of these are exact: every rounded intermediate is then a multiple of the unit below 2**53 of its own last place.
"""

from __future__ import annotations

from .compile import kernel

_SPLITTER = 134217729.0  # 2**27 + 1


@kernel
def two_sum(a, b):
    """Give (s, t) with s = fl(a + b) and s + t = a + b exactly."""
    s = a + b
    b_virtual = s - a
    return s, (a - (s - b_virtual)) + (b - b_virtual)


@kernel
def two_diff(a, b):
    """Give (s, t) with s = fl(a - b) and s + t = a - b exactly."""
    s = a - b
    b_virtual = a - s
    return s, (a - (s + b_virtual)) + (b_virtual - b)


@kernel
def two_product(a, b):
    """Give (p, e) with p = fl(a b) and p + e = a b exactly, unless something under- or overflows."""
    p = a * b
    c = _SPLITTER * a
    a_hi = c - (c - a)
    a_lo = a - a_hi
    c = _SPLITTER * b
    b_hi = c - (c - b)
    b_lo = b - b_hi
    return p, a_lo * b_lo - (((p - a_hi * b_hi) - a_lo * b_hi) - a_hi * b_lo)


@kernel
def dd_add(a_hi, a_lo, b_hi, b_lo):
    """Add two double-doubles."""
    s, e = two_sum(a_hi, b_hi)
    t, f = two_sum(a_lo, b_lo)
    e += t
    r = s + e
    e = (e - (r - s)) + f
    hi = r + e
    return hi, e - (hi - r)


@kernel
def dd_sub(a_hi, a_lo, b_hi, b_lo):
    """Subtract two double-doubles."""
    return dd_add(a_hi, a_lo, -b_hi, -b_lo)


@kernel
def dd_mul(a_hi, a_lo, b_hi, b_lo):
    """Multiply two double-doubles."""
    p, e = two_product(a_hi, b_hi)
    e += a_hi * b_lo + a_lo * b_hi
    hi = p + e
    return hi, e - (hi - p)


@kernel
def dd_cross(a_hi, a_lo, b_hi, b_lo, c_hi, c_lo, d_hi, d_lo):
    """Give a d - b c."""
    p_hi, p_lo = dd_mul(a_hi, a_lo, d_hi, d_lo)
    q_hi, q_lo = dd_mul(b_hi, b_lo, c_hi, c_lo)
    return dd_add(p_hi, p_lo, -q_hi, -q_lo)


@kernel
def dd_dot3(a_hi, a_lo, b_hi, b_lo, c_hi, c_lo, x_hi, x_lo, y_hi, y_lo, z_hi, z_lo):
    """Give a x + b y + c z."""
    p_hi, p_lo = dd_mul(a_hi, a_lo, x_hi, x_lo)
    q_hi, q_lo = dd_mul(b_hi, b_lo, y_hi, y_lo)
    r_hi, r_lo = dd_mul(c_hi, c_lo, z_hi, z_lo)
    s_hi, s_lo = dd_add(p_hi, p_lo, q_hi, q_lo)
    return dd_add(s_hi, s_lo, r_hi, r_lo)
