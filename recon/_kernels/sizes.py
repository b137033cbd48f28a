"""Size and attachment of one simplex: the orthosphere y_T in barycentric coordinates (paper, appendix B.3 and B.4).

The centre of y_U, U = T + {q}, has a negative barycentric coordinate at q exactly where pi(q, y_T) < 0. So the signs of
the coordinates of U are the attachment tests (B.4) of all its facets at once, and a zero says y_U = y_T. Signs are
certain: floats with a proven bound, else double-doubles, else integers of as many digits as it takes. Sizes are float64
with an error below 2**-40 (|rho| + max |w|), and monotone (3.2) to the last bit: where a face comes closer than that, U
takes the larger size of the two, and where a coordinate is zero, that of the face. So a size depends on the simplex
alone, never on the complex around it.

Vertices come in ascending order of input rows. Rows are x, y, z, w, scaled so that all are integers or the extent
moderate. A code holds, by vertex: bits 0-3 coordinate negative, bits 4-7 coordinate zero; and what floats could not
settle in bits 8-10.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .sizes_exact import ACCURACY, CLOSE, HUGE, INACCURATE, TINY, UNDECIDED, dd_tetrahedron, dd_triangle, exact_simplex

_U = 2.0**-53
_GAP = 2.0**-36  # faces further below than this cannot be lifted above by rounding
BLOCK = 256  # simplices measured at a time
_UNSETTLED = UNDECIDED | INACCURATE | CLOSE
_INTEGER = 2.0**49  # integers whose products stay below are computed without rounding


@kernel(inline="late")
def _swap_bits(code, a):
    """Exchange vertex 0 and vertex a in a code."""
    kept = code & ~((17 << a) | 17)
    return (kept | (code & 17) << a | code >> a & 17) if a > 0 else code


@kernel(inline="late")
def edge(x0, y0, z0, w0, x1, y1, z1, w1, integral):
    """Size and code of an edge by floats alone."""
    ex, ey, ez = x1 - x0, y1 - y0, z1 - z0
    length = ex * ex + ey * ey + ez * ez
    difference = w0 - w1
    p1, p0 = length + difference, length - difference  # 2 length lambda
    bulk = length + abs(difference)
    error = 8 * _U * bulk
    error = 0.0 if integral & (bulk < _INTEGER) else error
    largest = max(abs(w0), abs(w1))
    rho = p1 * p1 / (4 * length) - w0
    ordinary = (length > TINY) & (bulk < HUGE)
    code = (p0 < -error) | (p1 < -error) << 1
    zero = (abs(p0) <= error) << 4 | (abs(p1) <= error) << 5
    code |= UNDECIDED if (zero > 0) & (error > 0.0) else zero
    least = min(abs(p0), abs(p1)) - error
    far = least * least > 4 * _GAP * length * (abs(rho) + largest)
    code |= 0 if far else CLOSE
    return rho, code if ordinary else _UNSETTLED


@kernel(inline="late")
def triangle(x0, y0, z0, w0, x1, y1, z1, w1, x2, y2, z2, w2, integral):
    """Size and code of a triangle by floats alone, from the corner opposite the longest edge."""
    d01 = (x1 - x0) ** 2 + (y1 - y0) ** 2 + (z1 - z0) ** 2
    d02 = (x2 - x0) ** 2 + (y2 - y0) ** 2 + (z2 - z0) ** 2
    d12 = (x2 - x1) ** 2 + (y2 - y1) ** 2 + (z2 - z1) ** 2
    origin = 0
    if (d02 > d12) & (d02 >= d01):
        origin = 1
        x0, y0, z0, w0, x1, y1, z1, w1 = x1, y1, z1, w1, x0, y0, z0, w0
        d02, d12 = d12, d02
    elif (d01 > d12) & (d01 > d02):
        origin = 2
        x0, y0, z0, w0, x2, y2, z2, w2 = x2, y2, z2, w2, x0, y0, z0, w0
        d01, d12 = d12, d01
    ax, ay, az = x1 - x0, y1 - y0, z1 - z0
    bx, by, bz = x2 - x0, y2 - y0, z2 - z0
    la, lb = math.sqrt(d01), math.sqrt(d02)
    ha, hb = d01 + (w0 - w1), d02 + (w0 - w2)
    bulk = (d01 + abs(w0 - w1)) * lb + (d02 + abs(w0 - w2)) * la
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    nn = nx * nx + ny * ny + nz * nz
    n, area = math.sqrt(nn), la * lb
    vx, vy, vz = ha * bx - hb * ax, ha * by - hb * ay, ha * bz - hb * az
    vv = vx * vx + vy * vy + vz * vz
    p1 = vx * bx + vy * by + vz * bz  # 2 nn lambda
    p2 = -(vx * ax + vy * ay + vz * az)
    p0 = 2 * nn - p1 - p2
    e1, e2 = 24 * _U * bulk * lb, 24 * _U * bulk * la
    e0 = e1 + e2 + 48 * _U * area * (n + 2.0**-50 * area)
    if integral & (bulk * (la + lb) + area * area < _INTEGER):
        e0, e1, e2 = 0.0, 0.0, 0.0
    largest = max(abs(w0), abs(w1), abs(w2))
    power = vv / (4 * nn)
    rho = power - w0
    ordinary = (bulk * min(la, lb) > TINY) & (bulk < HUGE) & (d12 < HUGE) & (largest < HUGE)
    code = (p0 < -e0) | (p1 < -e1) << 1 | (p2 < -e2) << 2
    zero = (abs(p0) <= e0) << 4 | (abs(p1) <= e1) << 5 | (abs(p2) <= e2) << 6
    code |= UNDECIDED if (zero > 0) & (e0 > 0.0) else zero
    size = abs(rho) + largest
    error = _U * (12 * area * power * n + 8 * math.sqrt(vv) * bulk)
    accurate = (n > 2.0**-40 * area) & (error <= 0.5 * ACCURACY * size * nn)
    code |= 0 if accurate else INACCURATE
    g0, g1, g2 = abs(p0) - e0, abs(p1) - e1, abs(p2) - e2
    near = 4 * _GAP * size * nn
    far = (g0 * g0 > near * d12) & (g1 * g1 > near * d02) & (g2 * g2 > near * d01)
    code |= 0 if far else CLOSE
    return rho, _swap_bits(code, origin) if ordinary else _UNSETTLED


@kernel(inline="late")
def tetrahedron(x0, y0, z0, w0, x1, y1, z1, w1, x2, y2, z2, w2, x3, y3, z3, w3, integral):
    """Size and code of a tetrahedron by floats alone, from the corner with the shortest edges."""
    d01 = (x1 - x0) ** 2 + (y1 - y0) ** 2 + (z1 - z0) ** 2
    d02 = (x2 - x0) ** 2 + (y2 - y0) ** 2 + (z2 - z0) ** 2
    d03 = (x3 - x0) ** 2 + (y3 - y0) ** 2 + (z3 - z0) ** 2
    d12 = (x2 - x1) ** 2 + (y2 - y1) ** 2 + (z2 - z1) ** 2
    d13 = (x3 - x1) ** 2 + (y3 - y1) ** 2 + (z3 - z1) ** 2
    d23 = (x3 - x2) ** 2 + (y3 - y2) ** 2 + (z3 - z2) ** 2
    origin, best = 0, d01 + d02 + d03
    if d01 + d12 + d13 < best:
        origin, best = 1, d01 + d12 + d13
    if d02 + d12 + d23 < best:
        origin, best = 2, d02 + d12 + d23
    if d03 + d13 + d23 < best:
        origin = 3
    if origin == 1:
        x0, y0, z0, w0, x1, y1, z1, w1 = x1, y1, z1, w1, x0, y0, z0, w0
        d02, d03 = d12, d13
    elif origin == 2:
        x0, y0, z0, w0, x2, y2, z2, w2 = x2, y2, z2, w2, x0, y0, z0, w0
        d01, d02, d03 = d12, d02, d23
    elif origin == 3:
        x0, y0, z0, w0, x3, y3, z3, w3 = x3, y3, z3, w3, x0, y0, z0, w0
        d01, d02, d03 = d13, d23, d03
    ax, ay, az = x1 - x0, y1 - y0, z1 - z0
    bx, by, bz = x2 - x0, y2 - y0, z2 - z0
    cx, cy, cz = x3 - x0, y3 - y0, z3 - z0
    la, lb, lc = math.sqrt(d01), math.sqrt(d02), math.sqrt(d03)
    ha, hb, hc = d01 + (w0 - w1), d02 + (w0 - w2), d03 + (w0 - w3)
    ma, mb, mc = lb * lc, lc * la, la * lb
    bulk = (d01 + abs(w0 - w1)) * ma + (d02 + abs(w0 - w2)) * mb + (d03 + abs(w0 - w3)) * mc
    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    tx, ty, tz = ux + vx + wx, uy + vy + wy, uz + vz + wz
    det, volume = ax * ux + ay * uy + az * uz, la * ma
    nx, ny, nz = ha * ux + hb * vx + hc * wx, ha * uy + hb * vy + hc * wy, ha * uz + hb * vz + hc * wz
    nn, dd = nx * nx + ny * ny + nz * nz, det * det
    p1 = nx * ux + ny * uy + nz * uz  # 2 dd lambda
    p2 = nx * vx + ny * vy + nz * vz
    p3 = nx * wx + ny * wy + nz * wz
    p0 = 2 * dd - p1 - p2 - p3
    e1, e2, e3 = 32 * _U * bulk * ma, 32 * _U * bulk * mb, 32 * _U * bulk * mc
    e0 = e1 + e2 + e3 + 48 * _U * volume * (abs(det) + 2.0**-50 * volume)
    if integral & (bulk * (ma + mb + mc) + volume * volume < _INTEGER):
        e0, e1, e2, e3 = 0.0, 0.0, 0.0, 0.0
    largest = max(max(abs(w0), abs(w1)), max(abs(w2), abs(w3)))
    power = nn / (4 * dd)
    rho = power - w0
    ordinary = (bulk * min(ma, min(mb, mc)) > TINY) & (bulk < HUGE) & (best < HUGE) & (largest < HUGE)
    code = (p0 < -e0) | (p1 < -e1) << 1 | (p2 < -e2) << 2 | (p3 < -e3) << 3
    zero = (abs(p0) <= e0) << 4 | (abs(p1) <= e1) << 5 | (abs(p2) <= e2) << 6 | (abs(p3) <= e3) << 7
    code |= UNDECIDED if (zero > 0) & (e0 > 0.0) else zero
    size = abs(rho) + largest
    error = _U * (20 * volume * power * abs(det) + 12 * math.sqrt(nn) * bulk)
    accurate = (abs(det) > 2.0**-40 * volume) & (error <= 0.5 * ACCURACY * size * dd)
    code |= 0 if accurate else INACCURATE
    g0, g1, g2, g3 = abs(p0) - e0, abs(p1) - e1, abs(p2) - e2, abs(p3) - e3
    near = 4 * _GAP * size * dd
    far = (
        (g0 * g0 > near * (tx * tx + ty * ty + tz * tz))
        & (g1 * g1 > near * (ux * ux + uy * uy + uz * uz))
        & (g2 * g2 > near * (vx * vx + vy * vy + vz * vz))
        & (g3 * g3 > near * (wx * wx + wy * wy + wz * wz))
    )
    code |= 0 if far else CLOSE
    return rho, _swap_bits(code, origin) if ordinary else _UNSETTLED


@kernel
def gather(scaled, rows, count, corners):
    """Fill in the corners (16, BLOCK) of the first `count` simplices of rows (s, 2 to 4), side by side by coordinate."""
    for i in range(count):
        for j in range(rows.shape[1]):
            v = rows[i, j]
            for c in range(4):
                corners[4 * j + c, i] = scaled[v, c]


@kernel
def measure(scaled, integral, rows, count, corners, rho, code):
    """Fill in sizes and codes of the first `count` simplices, at most BLOCK, of rows (s, 2 to 4), ascending in a row.

    A block at a time, since loops over corners side by side become vector instructions: five times as fast.
    """
    width, c = rows.shape[1], corners
    gather(scaled, rows, count, corners)
    if width == 2:
        for i in range(count):
            rho[i], code[i] = edge(c[0, i], c[1, i], c[2, i], c[3, i], c[4, i], c[5, i], c[6, i], c[7, i], integral)
    elif width == 3:
        for i in range(count):
            rho[i], code[i] = triangle(
                c[0, i], c[1, i], c[2, i], c[3, i], c[4, i], c[5, i], c[6, i], c[7, i],
                c[8, i], c[9, i], c[10, i], c[11, i], integral,
            )  # fmt: skip
    else:
        for i in range(count):
            rho[i], code[i] = tetrahedron(
                c[0, i], c[1, i], c[2, i], c[3, i], c[4, i], c[5, i], c[6, i], c[7, i],
                c[8, i], c[9, i], c[10, i], c[11, i], c[12, i], c[13, i], c[14, i], c[15, i], integral,
            )  # fmt: skip


@kernel
def settle(scaled, integral, rows, rho, code):
    """Settle, in place, the simplices that the floats left open: rows (s, 2 to 4) with all low bits of the code set.

    That pattern is impossible, since coordinates add up to one. A row may be in any order; bits are by column.
    """
    width = rows.shape[1]
    full = (1 << width) - 1
    keys, nobody = np.empty(4, np.int64), np.int64(-1)
    sizes = np.empty(16)  # of the faces, by bit set of vertices: subsets come before their supersets
    for i in range(len(rows)):
        if code[i] & full != full:
            continue
        for j in range(width):
            key, k = np.int64(rows[i, j]) << 2 | j, j
            while k > 0 and keys[k - 1] > key:
                keys[k] = keys[k - 1]
                k -= 1
            keys[k] = key
        signs = 0
        for step in range(full + 1):
            face = step if step > 0 else full  # by itself first, which mostly does; else after all of its faces
            a, b, c, d = nobody, nobody, nobody, nobody
            for j in range(width - 1, -1, -1):
                if face >> j & 1:
                    a, b, c, d = keys[j] >> 2, a, b, c
            p, q, r, s = scaled[a], scaled[b], scaled[c], scaled[d]
            if b < 0:
                sizes[face] = -p[3]
                continue
            if c < 0:
                size, signs = edge(p[0], p[1], p[2], p[3], q[0], q[1], q[2], q[3], integral)
                better, certain = size, signs
            elif d < 0:
                size, signs = triangle(p[0], p[1], p[2], p[3], q[0], q[1], q[2], q[3], r[0], r[1], r[2], r[3], integral)
                better, certain = size, signs
                if step > 0 and signs & (UNDECIDED | INACCURATE):
                    better, certain = dd_triangle(p, q, r, integral)
            else:
                size, signs = tetrahedron(
                    p[0], p[1], p[2], p[3], q[0], q[1], q[2], q[3], r[0], r[1], r[2], r[3], s[0], s[1], s[2], s[3],
                    integral,
                )  # fmt: skip
                better, certain = size, signs
                if step > 0 and signs & (UNDECIDED | INACCURATE):
                    better, certain = dd_tetrahedron(p, q, r, s, integral)
            if step == 0:
                if signs >> 4:
                    continue
                sizes[full] = size
                break
            if certain & (UNDECIDED | INACCURATE):
                better, certain = exact_simplex(scaled, a, b, c, d)
            size = better if signs & INACCURATE else size
            signs = certain & 15
            if certain >> 4 & 15:
                size = -math.inf  # y is that of a face, and so is the size
            for j in range(width):
                if face >> j & 1:
                    size = max(size, sizes[face & ~(1 << j)])
            sizes[face] = size
        bits = code[i] & (255 - full)
        for j in range(width):
            bits |= (signs >> j & 1) << (keys[j] & 3)
        rho[i], code[i] = sizes[full], bits
