"""Exact signs of the orientation and power tests in 2-D and 3-D, for any float64 input in the admitted range.

Each test has three stages, and each stage answers only where it is certain:
(A) plain floating point against a bound on its own error;
(B) where the differences lie on a coarse grid, exact as it stands; double-double against a bound (`predicates_dd`);
(C) integers of as many digits as it takes (`exact`).

Sign convention (paper, appendix B): `orient` is the sign of the determinant of the edge vectors from the first vertex.
`power` is the sign of M(a, .., e) = (-1)**(d+1) det[(p - e), |p - e|**2 - (w_p - w_e)], rows p = a, .., which for a
positive cell is the sign of pi(e, y): negative means that e conflicts with the orthosphere of the cell. Differences are
taken from e, so the height |p|**2 - w is never formed, and never rounded.

Error bound of stage A. Let u = 2**-53, let r2 bound the squared length of the computed differences and m their
coordinates, and H = r2 + max |w_p - w_e| the terms of the heights. Each of the d! or (d+1)! products of the determinant is
at most P = m**d or r2**(d/2) H, and at most k rounded operations stand above all of its factors together: for orient2d
2 differences and 2 for the minor, k = 4; orient3d 3 differences, 2 + 3 for the Laplace levels, k = 8; power1d 1 + 6 for
the height + 2, k = 9; power2d 2 + 6 + 2 + 3, k = 13; power3d 3 + 6, 2 + 3 + 4, k = 18. So the error is at most (number of products) k u P, and a
tenth more covers the second order and the rounding of the bound itself. A product that underflows adds at most 2**-1075,
multiplied on its way up by less than 2**12 (1 + m)**d (1 + H): multiplying out (C r2**(d/2) + t) (H + t) with t = 2**-500
gives more than that, also where r2 itself has underflowed. What overflows makes the determinant infinite or NaN, which
never passes.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .determinants import max3, max4, orient3d_plain, power2d_plain, power3d_plain
from .exact import determinant_sign
from .predicates_dd import UNDECIDED, orient2d_dd, orient3d_dd, power2d_dd, power3d_dd

_U = 2.0**-53
_ORIENT2D = 2 * 4 * 1.1 * _U
_ORIENT3D = 6 * 8 * 1.1 * _U
_POWER1D = 2 * 9 * 1.1 * _U
_POWER2D = 6 * 13 * 1.1 * _U
_POWER3D = 24 * 18 * 1.1 * _U
_SMALL = 2.0**-500
_PLAIN, _LIFTED = np.int64(0), np.int64(1)
LAST = 1 << 62  # an index behind all others


# --- stage A: certain sign, or 0 for "look closer" ------------------------------------------------------------------


@kernel(inline="always")
def certain(determinant, bound):
    """Sign of a determinant beyond doubt, else 0; false for NaN and infinity."""
    return (1 if determinant > 0.0 else -1) if bound < abs(determinant) < np.inf else 0


@kernel(inline="always")
def orient2d_filter(ax, ay, bx, by, cx, cy):
    """Orientation of a triangle where floating point is certain of it, else 0."""
    px, py, qx, qy = bx - ax, by - ay, cx - ax, cy - ay
    m = max4(px, py, qx, qy)
    return certain(px * qy - py * qx, (_ORIENT2D * m + _SMALL) * (m + _SMALL))


@kernel(inline="always")
def orient3d_filter(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Orientation of a tetrahedron where floating point is certain of it, else 0."""
    px, py, pz = bx - ax, by - ay, bz - az
    qx, qy, qz = cx - ax, cy - ay, cz - az
    rx, ry, rz = dx - ax, dy - ay, dz - az
    m = max(max(max3(px, qx, rx), max3(py, qy, ry)), max3(pz, qz, rz))
    determinant = orient3d_plain(px, py, pz, qx, qy, qz, rx, ry, rz)
    return certain(determinant, (_ORIENT3D * (m * m) + _SMALL) * (m + _SMALL))


@kernel(inline="always")
def power2d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew):
    """Power test against a triangle where floating point is certain of it, else 0."""
    ax, ay, az, aw = ax - ex, ay - ey, az - ez, aw - ew
    bx, by, bz, bw = bx - ex, by - ey, bz - ez, bw - ew
    cx, cy, cz, cw = cx - ex, cy - ey, cz - ez, cw - ew
    determinant, r2 = power2d_plain(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw)
    return certain(determinant, (_POWER2D * r2 + _SMALL) * (r2 + max3(aw, bw, cw) + _SMALL))


@kernel(inline="always")
def power3d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew):
    """Power test against a tetrahedron where floating point is certain of it, else 0."""
    ax, ay, az, aw = ax - ex, ay - ey, az - ez, aw - ew
    bx, by, bz, bw = bx - ex, by - ey, bz - ez, bw - ew
    cx, cy, cz, cw = cx - ex, cy - ey, cz - ez, cw - ew
    dx, dy, dz, dw = dx - ex, dy - ey, dz - ez, dw - ew
    determinant, r2 = power3d_plain(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw)
    return certain(
        determinant,
        (_POWER3D * (r2 * math.sqrt(r2)) + _SMALL) * (r2 + max4(aw, bw, cw, dw) + _SMALL),
    )


# --- all stages ------------------------------------------------------------------------------------------------------


@kernel
def orient2d(ax, ay, bx, by, cx, cy):
    """Sign of det[b - a, c - a]: +1 for a counterclockwise triangle, 0 for collinear points."""
    s = orient2d_filter(ax, ay, bx, by, cx, cy)
    if s != 0:
        return s
    s = orient2d_dd(ax, ay, bx, by, cx, cy)
    if s != UNDECIDED:
        return s
    return determinant_sign(np.array((bx, by, 0.0, 0.0, cx, cy, 0.0, 0.0, ax, ay, 0.0, 0.0)), _PLAIN)


@kernel
def orient3d(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Sign of det[b - a, c - a, d - a]: +1 for a positive cell, 0 for coplanar points."""
    s = orient3d_filter(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz)
    if s != 0:
        return s
    s = orient3d_dd(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz)
    if s != UNDECIDED:
        return s
    rows = np.array((bx, by, bz, 0.0, cx, cy, cz, 0.0, dx, dy, dz, 0.0, ax, ay, az, 0.0))
    return determinant_sign(rows, _PLAIN)


@kernel
def power1d(ax, ay, az, aw, bx, by, bz, bw, ex, ey, ez, ew):
    """Sign of M(a, b, e): negative where e conflicts with a segment in ascending x; y and z count in the heights only."""
    px, py, pz, pw = ax - ex, ay - ey, az - ez, aw - ew
    qx, qy, qz, qw = bx - ex, by - ey, bz - ez, bw - ew
    pr, qr = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
    r2 = max(pr, qr)
    bound = (_POWER1D * math.sqrt(r2) + _SMALL) * (r2 + max(abs(pw), abs(qw)) + _SMALL)
    s = certain(px * (qr - qw) - qx * (pr - pw), bound)
    if s != 0:
        return s
    return determinant_sign(np.array((ax, ay, az, aw, bx, by, bz, bw, ex, ey, ez, ew)), _LIFTED)


@kernel
def power2d(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew):
    """Sign of M(a, b, c, e): negative where e conflicts with a positive triangle, 0 where it is orthogonal.

    Triangles live in x and y; z, a function of them (the plane that holds all points), counts in the heights only.
    """
    s = power2d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew)
    if s != 0:
        return s
    s = power2d_dd(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew)
    if s != UNDECIDED:
        return s
    rows = np.array((ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew))
    return -determinant_sign(rows, _LIFTED)


@kernel
def power3d(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew):
    """Sign of M(a, b, c, d, e): negative where e conflicts with a positive cell, 0 where it is orthogonal."""
    s = power3d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
    if s != 0:
        return s
    s = power3d_dd(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
    if s != UNDECIDED:
        return s
    rows = np.array((ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew))
    return determinant_sign(rows, _LIFTED)


# --- ties: heights h_i - eps_i with eps_0 >> eps_1 >> ..., by point index ---------------------------------------------
# With e = sum(l_i v_i), sum(l_i) = 1, the perturbed power of e is h_e - sum(l_i h_i) - eps_e + sum(l_i eps_i). Where the
# unperturbed part vanishes, the most significant eps with a coefficient decides: -1 for e itself, l_i for vertex i,
# whose sign is the orientation of the cell with e in the place of that vertex.


@kernel
def power2d_perturbed(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew, ia, ib, ic, ie):
    """Perturbed sign of `power2d` for a positive triangle; never 0. `ia` .. `ie` are the point indices."""
    s = power2d(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew)
    while s == 0:
        first = min(ia, ib, ic, ie)
        if first == ie:
            return -1
        if first == ia:
            s, ia = orient2d(ex, ey, bx, by, cx, cy), LAST
        elif first == ib:
            s, ib = orient2d(ax, ay, ex, ey, cx, cy), LAST
        else:
            s, ic = orient2d(ax, ay, bx, by, ex, ey), LAST
    return s


@kernel
def power3d_perturbed(
    ax,
    ay,
    az,
    aw,
    bx,
    by,
    bz,
    bw,
    cx,
    cy,
    cz,
    cw,
    dx,
    dy,
    dz,
    dw,
    ex,
    ey,
    ez,
    ew,
    ia,
    ib,
    ic,
    id,
    ie,
):
    """Perturbed sign of `power3d` for a positive cell; never 0. `ia` .. `ie` are the point indices."""
    s = power3d(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
    while s == 0:
        first = min(ia, ib, ic, id, ie)
        if first == ie:
            return -1
        if first == ia:
            s, ia = orient3d(ex, ey, ez, bx, by, bz, cx, cy, cz, dx, dy, dz), LAST
        elif first == ib:
            s, ib = orient3d(ax, ay, az, ex, ey, ez, cx, cy, cz, dx, dy, dz), LAST
        elif first == ic:
            s, ic = orient3d(ax, ay, az, bx, by, bz, ex, ey, ez, dx, dy, dz), LAST
        else:
            s, id = orient3d(ax, ay, az, bx, by, bz, cx, cy, cz, ex, ey, ez), LAST
    return s
