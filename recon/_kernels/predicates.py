"""Exact signs of the orientation and power tests in 2-D and 3-D, for any float64 input in the admitted range.

Each test has three stages, and each stage answers only where it is certain:
(A) plain floating point against a bound on its own error;
(B) double-double against a bound, or, where the differences lie on a coarse grid, exact as it stands (`predicates_dd`);
(C) integers of as many digits as it takes (`exact`).

Sign convention (paper, appendix B): `orient` is the sign of the determinant of the edge vectors from the first vertex.
`power` is the sign of M(a, .., e) = (-1)**(d+1) det[(p - e), |p - e|**2 - (w_p - w_e)], rows p = a, .., which for a
positive cell is the sign of pi(e, y): negative means that e conflicts with the orthosphere of the cell. Differences are
taken from e, so the height |p|**2 - w is never formed, and never rounded.

Error bound of stage A. Let u = 2**-53, let mx, my, mz bound the computed differences, mh = mx**2 + my**2 + mz**2 + mw
the terms of the heights. Each of the 3! or 4! products of the determinant is at most P = mx my mz (mh), and at most k
rounded operations stand above any of its factors together: for orient3d 3 differences, 2 + 3 for the Laplace levels,
k = 8; for power3d 3 differences, 6 for the height, 2 + 3 + 4 for the levels, k = 18; for orient2d 2 + 2, k = 4; for
power2d 2 + 6 + 2 + 3, k = 13. The error is at most (number of products) k u (1 + tiny) P, and the constants below exceed
that by a few per cent for the rounding of the bound itself. A product that underflows adds at most 2**-1075, multiplied on
its way up by no more than 200 (1 + mx) (1 + my) (1 + mz) (1 + mh): the term with _TINY = 2**-1000 is more than that. What
overflows makes the determinant infinite or NaN, which never passes.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .exact import determinant_sign
from .predicates_dd import UNDECIDED, max3, max4, orient2d_dd, orient3d_dd, power2d_dd, power3d_dd

_U = 2.0**-53
_ORIENT2D = 2 * 4 * 1.1 * _U
_ORIENT3D = 6 * 8 * 1.1 * _U
_POWER2D = 6 * 13 * 1.1 * _U
_POWER3D = 24 * 18 * 1.1 * _U
_TINY = 2.0**-1000
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
    mx, my = max(abs(px), abs(qx)), max(abs(py), abs(qy))
    return certain(px * qy - py * qx, _ORIENT2D * (mx * my) + _TINY * ((1.0 + mx) * (1.0 + my)))


@kernel(inline="always")
def orient3d_filter(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Orientation of a tetrahedron where floating point is certain of it, else 0."""
    px, py, pz = bx - ax, by - ay, bz - az
    qx, qy, qz = cx - ax, cy - ay, cz - az
    rx, ry, rz = dx - ax, dy - ay, dz - az
    determinant = (px * qy - py * qx) * rz + (py * qz - pz * qy) * rx + (pz * qx - px * qz) * ry
    mx, my, mz = max3(px, qx, rx), max3(py, qy, ry), max3(pz, qz, rz)
    return certain(determinant, _ORIENT3D * ((mx * my) * mz) + _TINY * (((1.0 + mx) * (1.0 + my)) * (1.0 + mz)))


@kernel(inline="always")
def power2d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew):
    """Power test against a triangle where floating point is certain of it, else 0."""
    ax, ay, az, aw = ax - ex, ay - ey, az - ez, aw - ew
    bx, by, bz, bw = bx - ex, by - ey, bz - ez, bw - ew
    cx, cy, cz, cw = cx - ex, cy - ey, cz - ez, cw - ew
    ah = ax * ax + ay * ay + az * az - aw
    bh = bx * bx + by * by + bz * bz - bw
    ch = cx * cx + cy * cy + cz * cz - cw
    determinant = (ay * bx - ax * by) * ch + (by * cx - bx * cy) * ah + (cy * ax - cx * ay) * bh
    mx, my, mz = max3(ax, bx, cx), max3(ay, by, cy), max3(az, bz, cz)
    mh = mx * mx + my * my + mz * mz + max3(aw, bw, cw)
    return certain(determinant, _POWER2D * ((mx * my) * mh) + _TINY * (((1.0 + mx) * (1.0 + my)) * (1.0 + mh)))


@kernel(inline="always")
def power3d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew):
    """Power test against a tetrahedron where floating point is certain of it, else 0."""
    ax, ay, az, aw = ax - ex, ay - ey, az - ez, aw - ew
    bx, by, bz, bw = bx - ex, by - ey, bz - ez, bw - ew
    cx, cy, cz, cw = cx - ex, cy - ey, cz - ez, cw - ew
    dx, dy, dz, dw = dx - ex, dy - ey, dz - ez, dw - ew
    ah = ax * ax + ay * ay + az * az - aw
    bh = bx * bx + by * by + bz * bz - bw
    ch = cx * cx + cy * cy + cz * cz - cw
    dh = dx * dx + dy * dy + dz * dz - dw
    ab, bc, cd = ax * by - ay * bx, bx * cy - by * cx, cx * dy - cy * dx
    da, ac, bd = dx * ay - dy * ax, ax * cy - ay * cx, bx * dy - by * dx
    abc, bcd = az * bc - bz * ac + cz * ab, bz * cd - cz * bd + dz * bc
    cda, dab = cz * da + dz * ac + az * cd, dz * ab + az * bd + bz * da
    determinant = (abc * dh - bcd * ah) + (cda * bh - dab * ch)
    mx, my, mz = max4(ax, bx, cx, dx), max4(ay, by, cy, dy), max4(az, bz, cz, dz)
    mh = mx * mx + my * my + mz * mz + max4(aw, bw, cw, dw)
    return certain(
        determinant,
        _POWER3D * ((mx * my) * (mz * mh)) + _TINY * (((1.0 + mx) * (1.0 + my)) * ((1.0 + mz) * (1.0 + mh))),
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
    rows = np.array([[bx, by], [cx, cy]])
    return determinant_sign(rows, np.array([ax, ay]), np.zeros(2), 0.0, 2, False)


@kernel
def orient3d(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Sign of det[b - a, c - a, d - a]: +1 for a positive cell, 0 for coplanar points."""
    s = orient3d_filter(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz)
    if s != 0:
        return s
    s = orient3d_dd(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz)
    if s != UNDECIDED:
        return s
    rows = np.array([[bx, by, bz], [cx, cy, cz], [dx, dy, dz]])
    return determinant_sign(rows, np.array([ax, ay, az]), np.zeros(3), 0.0, 3, False)


@kernel
def power1d(ax, ay, az, aw, bx, by, bz, bw, ex, ey, ez, ew):
    """Sign of M(a, b, e), by integers alone: x is the axis, y and z count in the heights."""
    rows = np.array([[ax, ay, az], [bx, by, bz]])
    return determinant_sign(rows, np.array([ex, ey, ez]), np.array([aw, bw]), ew, 2, True)


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
    rows = np.array([[ax, ay, az], [bx, by, bz], [cx, cy, cz]])
    return -determinant_sign(rows, np.array([ex, ey, ez]), np.array([aw, bw, cw]), ew, 3, True)


@kernel
def power3d(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew):
    """Sign of M(a, b, c, d, e): negative where e conflicts with a positive cell, 0 where it is orthogonal."""
    s = power3d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
    if s != 0:
        return s
    s = power3d_dd(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
    if s != UNDECIDED:
        return s
    rows = np.array([[ax, ay, az], [bx, by, bz], [cx, cy, cz], [dx, dy, dz]])
    return determinant_sign(rows, np.array([ex, ey, ez]), np.array([aw, bw, cw, dw]), ew, 4, True)


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
    ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew, ia, ib, ic, id, ie
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
