"""Stage B of the predicates: double-double, certain of its sign or saying that it is not.

The differences from one point are exact as double-doubles, weights included. What follows errs, relative to the product P
of the largest entries of each column (see `predicates`), by at most 8 u**2 an operation: heights 32, Laplace levels
16 + 24 + 32 u**2, so 6 * 40 u**2 < 2**-98 for orientations and 24 * 104 u**2 < 2**-94 for power tests. That holds for
differences up to 2**60 and P above 2**-700: nothing overflows, and what underflow can add (2**-1072 a product, multiplied
on its way up by less than 2**250) stays far below the bound. Outside of that range nothing is claimed.

A determinant that is zero, as on integer grids or in quantised scans, is never beyond a bound. But where all differences
are multiples of some g = 2**e, those of weights of g**2, and the sum of all products is below 2**53 or 2**104 times the
power of g that belongs to it, then everything was computed exactly, in plain floating point or in double-double (see
`doubledouble`), and zero means zero. One bit of each is left for the rounding of P.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .determinants import (
    max3,
    max4,
    orient3d_plain,
    power2d_plain,
    power3d_plain,
    sign_of,
)
from .doubledouble import dd_add, dd_cross, dd_dot3, dd_mul, dd_sub, two_diff

ORIENT_DD = 2.0**-98
POWER_DD = 2.0**-94
DD_MAX = 2.0**60
DD_MIN = 2.0**-700
UNDECIDED = 2


@kernel
def grid(product, bits, degree):
    """Smallest g = 2**e with product < 2**bits g**degree, and 1 / g."""
    e = -((bits - math.frexp(product)[1]) // degree)
    return math.ldexp(1.0, e), math.ldexp(1.0, -e)


@kernel
def on_grid(x, y, z, w, g, scale):
    """Whether x, y and z are multiples of g, and w of g**2; scale = 1 / g. What underflows is not."""
    return (
        np.floor(x * scale) * g == x
        and np.floor(y * scale) * g == y
        and np.floor(z * scale) * g == z
        and np.floor(w * scale * scale) * g * g == w
    )


@kernel
def dd_height(x, xl, y, yl, z, zl, w, wl):
    """Height x**2 + y**2 + z**2 - w of a difference."""
    h, hl = dd_dot3(x, xl, y, yl, z, zl, x, xl, y, yl, z, zl)
    return dd_sub(h, hl, w, wl)


@kernel
def orient2d_dd(ax, ay, bx, by, cx, cy):
    """Orientation of a triangle in double-double: certain sign (0 included), or UNDECIDED."""
    px, pxl = two_diff(bx, ax)
    py, pyl = two_diff(by, ay)
    qx, qxl = two_diff(cx, ax)
    qy, qyl = two_diff(cy, ay)
    mx, my = max(abs(px), abs(qx)), max(abs(py), abs(qy))
    if mx == 0.0 or my == 0.0:
        return 0
    product = mx * my
    if not (mx <= DD_MAX and my <= DD_MAX and product >= DD_MIN):
        return UNDECIDED
    determinant, _ = dd_cross(px, pxl, py, pyl, qx, qxl, qy, qyl)
    if abs(determinant) > ORIENT_DD * product:
        return sign_of(determinant)
    g, scale = grid(2.0 * product, 103, 2)
    if (
        on_grid(px, py, pxl, 0.0, g, scale)
        and on_grid(qx, qy, qxl, 0.0, g, scale)
        and on_grid(pyl, qyl, 0.0, 0.0, g, scale)
    ):
        return sign_of(determinant)
    return UNDECIDED


@kernel
def orient3d_dd(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Orientation of a tetrahedron in double-double: certain sign (0 included), or UNDECIDED."""
    px, pxl = two_diff(bx, ax)
    py, pyl = two_diff(by, ay)
    pz, pzl = two_diff(bz, az)
    qx, qxl = two_diff(cx, ax)
    qy, qyl = two_diff(cy, ay)
    qz, qzl = two_diff(cz, az)
    rx, rxl = two_diff(dx, ax)
    ry, ryl = two_diff(dy, ay)
    rz, rzl = two_diff(dz, az)
    mx, my, mz = max3(px, qx, rx), max3(py, qy, ry), max3(pz, qz, rz)
    if mx == 0.0 or my == 0.0 or mz == 0.0:
        return 0
    product = mx * my * mz
    if not (mx <= DD_MAX and my <= DD_MAX and mz <= DD_MAX and product >= DD_MIN):
        return UNDECIDED
    exact = pxl == pyl == pzl == qxl == qyl == qzl == rxl == ryl == rzl == 0.0
    g, scale = grid(6.0 * product, 52, 3)
    if (
        exact
        and on_grid(px, py, pz, 0.0, g, scale)
        and on_grid(qx, qy, qz, 0.0, g, scale)
        and on_grid(rx, ry, rz, 0.0, g, scale)
    ):
        return sign_of(orient3d_plain(px, py, pz, qx, qy, qz, rx, ry, rz))
    xy, xyl = dd_cross(px, pxl, py, pyl, qx, qxl, qy, qyl)
    yz, yzl = dd_cross(py, pyl, pz, pzl, qy, qyl, qz, qzl)
    zx, zxl = dd_cross(pz, pzl, px, pxl, qz, qzl, qx, qxl)
    determinant, _ = dd_dot3(xy, xyl, yz, yzl, zx, zxl, rz, rzl, rx, rxl, ry, ryl)
    if abs(determinant) > ORIENT_DD * product:
        return sign_of(determinant)
    g, scale = grid(6.0 * product, 103, 3)
    if (
        on_grid(px, py, pz, 0.0, g, scale)
        and on_grid(qx, qy, qz, 0.0, g, scale)
        and on_grid(rx, ry, rz, 0.0, g, scale)
        and on_grid(pxl, pyl, pzl, 0.0, g, scale)
        and on_grid(qxl, qyl, qzl, 0.0, g, scale)
        and on_grid(rxl, ryl, rzl, 0.0, g, scale)
    ):
        return sign_of(determinant)
    return UNDECIDED


@kernel
def power2d_dd(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew):
    """Power test against a triangle in double-double: certain sign (0 included), or UNDECIDED."""
    ax, axl = two_diff(ax, ex)
    ay, ayl = two_diff(ay, ey)
    az, azl = two_diff(az, ez)
    aw, awl = two_diff(aw, ew)
    bx, bxl = two_diff(bx, ex)
    by, byl = two_diff(by, ey)
    bz, bzl = two_diff(bz, ez)
    bw, bwl = two_diff(bw, ew)
    cx, cxl = two_diff(cx, ex)
    cy, cyl = two_diff(cy, ey)
    cz, czl = two_diff(cz, ez)
    cw, cwl = two_diff(cw, ew)
    mx, my, mz = max3(ax, bx, cx), max3(ay, by, cy), max3(az, bz, cz)
    if mx == 0.0 or my == 0.0:
        return 0
    mw = max3(aw, bw, cw)
    mh = mx * mx + my * my + mz * mz + mw
    product = mx * my * mh
    if not (mx <= DD_MAX and my <= DD_MAX and mz <= DD_MAX and mw <= DD_MAX * DD_MAX and product >= DD_MIN):
        return UNDECIDED

    exact = axl == ayl == azl == awl == bxl == byl == bzl == bwl == cxl == cyl == czl == cwl == 0.0
    g, scale = grid(6.0 * product, 52, 4)
    if (
        exact
        and on_grid(ax, ay, az, aw, g, scale)
        and on_grid(bx, by, bz, bw, g, scale)
        and on_grid(cx, cy, cz, cw, g, scale)
    ):
        return sign_of(power2d_plain(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw)[0])

    ah, ahl = dd_height(ax, axl, ay, ayl, az, azl, aw, awl)
    bh, bhl = dd_height(bx, bxl, by, byl, bz, bzl, bw, bwl)
    ch, chl = dd_height(cx, cxl, cy, cyl, cz, czl, cw, cwl)
    ab, abl = dd_cross(ay, ayl, ax, axl, by, byl, bx, bxl)
    bc, bcl = dd_cross(by, byl, bx, bxl, cy, cyl, cx, cxl)
    ca, cal = dd_cross(cy, cyl, cx, cxl, ay, ayl, ax, axl)
    determinant, _ = dd_dot3(ab, abl, bc, bcl, ca, cal, ch, chl, ah, ahl, bh, bhl)
    if abs(determinant) > POWER_DD * product:
        return sign_of(determinant)
    g, scale = grid(6.0 * product, 103, 4)
    if (
        on_grid(ax, ay, az, aw, g, scale)
        and on_grid(bx, by, bz, bw, g, scale)
        and on_grid(cx, cy, cz, cw, g, scale)
        and on_grid(axl, ayl, azl, awl, g, scale)
        and on_grid(bxl, byl, bzl, bwl, g, scale)
        and on_grid(cxl, cyl, czl, cwl, g, scale)
    ):
        return sign_of(determinant)
    return UNDECIDED


@kernel
def power3d_dd(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew):
    """Power test against a tetrahedron in double-double: certain sign (0 included), or UNDECIDED."""
    ax, axl = two_diff(ax, ex)
    ay, ayl = two_diff(ay, ey)
    az, azl = two_diff(az, ez)
    aw, awl = two_diff(aw, ew)
    bx, bxl = two_diff(bx, ex)
    by, byl = two_diff(by, ey)
    bz, bzl = two_diff(bz, ez)
    bw, bwl = two_diff(bw, ew)
    cx, cxl = two_diff(cx, ex)
    cy, cyl = two_diff(cy, ey)
    cz, czl = two_diff(cz, ez)
    cw, cwl = two_diff(cw, ew)
    dx, dxl = two_diff(dx, ex)
    dy, dyl = two_diff(dy, ey)
    dz, dzl = two_diff(dz, ez)
    dw, dwl = two_diff(dw, ew)
    mx, my, mz = max4(ax, bx, cx, dx), max4(ay, by, cy, dy), max4(az, bz, cz, dz)
    if mx == 0.0 or my == 0.0 or mz == 0.0:
        return 0
    mw = max4(aw, bw, cw, dw)
    mh = mx * mx + my * my + mz * mz + mw
    product = mx * my * mz * mh
    if not (mx <= DD_MAX and my <= DD_MAX and mz <= DD_MAX and mw <= DD_MAX * DD_MAX and product >= DD_MIN):
        return UNDECIDED

    exact = axl == ayl == azl == awl == bxl == byl == bzl == bwl == 0.0
    exact = exact and cxl == cyl == czl == cwl == dxl == dyl == dzl == dwl == 0.0
    g, scale = grid(24.0 * product, 52, 5)
    if (
        exact
        and on_grid(ax, ay, az, aw, g, scale)
        and on_grid(bx, by, bz, bw, g, scale)
        and on_grid(cx, cy, cz, cw, g, scale)
        and on_grid(dx, dy, dz, dw, g, scale)
    ):
        return sign_of(power3d_plain(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw)[0])

    ah, ahl = dd_height(ax, axl, ay, ayl, az, azl, aw, awl)
    bh, bhl = dd_height(bx, bxl, by, byl, bz, bzl, bw, bwl)
    ch, chl = dd_height(cx, cxl, cy, cyl, cz, czl, cw, cwl)
    dh, dhl = dd_height(dx, dxl, dy, dyl, dz, dzl, dw, dwl)
    ab, abl = dd_cross(ax, axl, ay, ayl, bx, bxl, by, byl)
    bc, bcl = dd_cross(bx, bxl, by, byl, cx, cxl, cy, cyl)
    cd, cdl = dd_cross(cx, cxl, cy, cyl, dx, dxl, dy, dyl)
    da, dal = dd_cross(dx, dxl, dy, dyl, ax, axl, ay, ayl)
    ac, acl = dd_cross(ax, axl, ay, ayl, cx, cxl, cy, cyl)
    bd, bdl = dd_cross(bx, bxl, by, byl, dx, dxl, dy, dyl)
    abc, abcl = dd_dot3(az, azl, bz, bzl, cz, czl, bc, bcl, -ac, -acl, ab, abl)
    bcd, bcdl = dd_dot3(bz, bzl, cz, czl, dz, dzl, cd, cdl, -bd, -bdl, bc, bcl)
    cda, cdal = dd_dot3(cz, czl, dz, dzl, az, azl, da, dal, ac, acl, cd, cdl)
    dab, dabl = dd_dot3(dz, dzl, az, azl, bz, bzl, ab, abl, bd, bdl, da, dal)
    s, sl = dd_dot3(abc, abcl, -bcd, -bcdl, cda, cdal, dh, dhl, ah, ahl, bh, bhl)
    t, tl = dd_mul(dab, dabl, ch, chl)
    determinant, _ = dd_add(s, sl, -t, -tl)
    if abs(determinant) > POWER_DD * product:
        return sign_of(determinant)
    g, scale = grid(24.0 * product, 103, 5)
    if (
        on_grid(ax, ay, az, aw, g, scale)
        and on_grid(bx, by, bz, bw, g, scale)
        and on_grid(cx, cy, cz, cw, g, scale)
        and on_grid(dx, dy, dz, dw, g, scale)
        and on_grid(axl, ayl, azl, awl, g, scale)
        and on_grid(bxl, byl, bzl, bwl, g, scale)
        and on_grid(cxl, cyl, czl, cwl, g, scale)
        and on_grid(dxl, dyl, dzl, dwl, g, scale)
    ):
        return sign_of(determinant)
    return UNDECIDED
