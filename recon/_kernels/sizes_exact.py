"""Where the floats of `sizes` are not enough: the same orthospheres in double-doubles, then in integers of any length.

Codes are those of `sizes`: bits 0-3 barycentric coordinate negative, 4-7 zero, 8-10 not settled.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .doubledouble import dd_add, dd_cross, dd_dot3, dd_mul, dd_sub, two_diff
from .exact import BITS, add_float, lowest_bit

UNDECIDED, INACCURATE, CLOSE = 1 << 8, 1 << 9, 1 << 10
ACCURACY = 2.0**-40  # of a size, in units of |rho| + max |w|
TINY, HUGE = 2.0**-450, 2.0**200  # within these nothing under- or overflows
_UU = 2.0**-106
_INTEGER = 2.0**100  # integers whose products stay below are computed without rounding


@kernel
def dd_triangle(p, q, r, integral):
    """Size and code of a triangle of rows x, y, z, w in double-doubles."""
    ax, ax_ = two_diff(q[0], p[0])
    ay, ay_ = two_diff(q[1], p[1])
    az, az_ = two_diff(q[2], p[2])
    bx, bx_ = two_diff(r[0], p[0])
    by, by_ = two_diff(r[1], p[1])
    bz, bz_ = two_diff(r[2], p[2])
    wa, wa_ = two_diff(p[3], q[3])
    wb, wb_ = two_diff(p[3], r[3])
    da, da_ = dd_dot3(ax, ax_, ay, ay_, az, az_, ax, ax_, ay, ay_, az, az_)
    db, db_ = dd_dot3(bx, bx_, by, by_, bz, bz_, bx, bx_, by, by_, bz, bz_)
    ha, ha_ = dd_add(da, da_, wa, wa_)
    hb, hb_ = dd_add(db, db_, wb, wb_)
    nx, nx_ = dd_cross(ay, ay_, az, az_, by, by_, bz, bz_)
    ny, ny_ = dd_cross(az, az_, ax, ax_, bz, bz_, bx, bx_)
    nz, nz_ = dd_cross(ax, ax_, ay, ay_, bx, bx_, by, by_)
    nn, nn_ = dd_dot3(nx, nx_, ny, ny_, nz, nz_, nx, nx_, ny, ny_, nz, nz_)
    vx, vx_ = dd_cross(ha, ha_, hb, hb_, ax, ax_, bx, bx_)
    vy, vy_ = dd_cross(ha, ha_, hb, hb_, ay, ay_, by, by_)
    vz, vz_ = dd_cross(ha, ha_, hb, hb_, az, az_, bz, bz_)
    vv, _ = dd_dot3(vx, vx_, vy, vy_, vz, vz_, vx, vx_, vy, vy_, vz, vz_)
    p1, p1_ = dd_dot3(vx, vx_, vy, vy_, vz, vz_, bx, bx_, by, by_, bz, bz_)
    p2, p2_ = dd_dot3(vx, vx_, vy, vy_, vz, vz_, -ax, -ax_, -ay, -ay_, -az, -az_)
    p0, p0_ = dd_add(p1, p1_, p2, p2_)
    p0, p0_ = dd_sub(2 * nn, 2 * nn_, p0, p0_)
    la, lb, n = math.sqrt(da), math.sqrt(db), math.sqrt(nn)
    bulk, area = (da + abs(wa)) * lb + (db + abs(wb)) * la, la * lb
    e1, e2 = 128 * _UU * bulk * lb, 128 * _UU * bulk * la
    e0 = e1 + e2 + 160 * _UU * area * (n + 2.0**-95 * area)
    if integral and bulk * (la + lb) + area * area < _INTEGER:
        e0, e1, e2 = 0.0, 0.0, 0.0
    largest = max(abs(p[3]), abs(q[3]), abs(r[3]))
    power = vv / (4 * nn)
    rho = power - p[3]
    if not (bulk * min(la, lb) > TINY and bulk < HUGE and area < HUGE and largest < HUGE):
        return rho, UNDECIDED | INACCURATE
    code = (p0 < -e0) | (p1 < -e1) << 1 | (p2 < -e2) << 2
    if abs(p0) <= e0 or abs(p1) <= e1 or abs(p2) <= e2:
        code |= UNDECIDED if e0 > 0.0 else (p0 == 0.0) << 4 | (p1 == 0.0) << 5 | (p2 == 0.0) << 6
    error = _UU * (48 * area * power * n + 48 * math.sqrt(vv) * bulk)
    if not (n > 2.0**-90 * area and error <= 0.5 * ACCURACY * (abs(rho) + largest) * nn):
        code |= INACCURATE
    return rho, code


@kernel
def dd_tetrahedron(p, q, r, s, integral):
    """Size and code of a tetrahedron of rows x, y, z, w in double-doubles."""
    ax, ax_ = two_diff(q[0], p[0])
    ay, ay_ = two_diff(q[1], p[1])
    az, az_ = two_diff(q[2], p[2])
    bx, bx_ = two_diff(r[0], p[0])
    by, by_ = two_diff(r[1], p[1])
    bz, bz_ = two_diff(r[2], p[2])
    cx, cx_ = two_diff(s[0], p[0])
    cy, cy_ = two_diff(s[1], p[1])
    cz, cz_ = two_diff(s[2], p[2])
    wa, wa_ = two_diff(p[3], q[3])
    wb, wb_ = two_diff(p[3], r[3])
    wc, wc_ = two_diff(p[3], s[3])
    da, da_ = dd_dot3(ax, ax_, ay, ay_, az, az_, ax, ax_, ay, ay_, az, az_)
    db, db_ = dd_dot3(bx, bx_, by, by_, bz, bz_, bx, bx_, by, by_, bz, bz_)
    dc, dc_ = dd_dot3(cx, cx_, cy, cy_, cz, cz_, cx, cx_, cy, cy_, cz, cz_)
    ha, ha_ = dd_add(da, da_, wa, wa_)
    hb, hb_ = dd_add(db, db_, wb, wb_)
    hc, hc_ = dd_add(dc, dc_, wc, wc_)
    ux, ux_ = dd_cross(by, by_, bz, bz_, cy, cy_, cz, cz_)
    uy, uy_ = dd_cross(bz, bz_, bx, bx_, cz, cz_, cx, cx_)
    uz, uz_ = dd_cross(bx, bx_, by, by_, cx, cx_, cy, cy_)
    vx, vx_ = dd_cross(cy, cy_, cz, cz_, ay, ay_, az, az_)
    vy, vy_ = dd_cross(cz, cz_, cx, cx_, az, az_, ax, ax_)
    vz, vz_ = dd_cross(cx, cx_, cy, cy_, ax, ax_, ay, ay_)
    wx, wx_ = dd_cross(ay, ay_, az, az_, by, by_, bz, bz_)
    wy, wy_ = dd_cross(az, az_, ax, ax_, bz, bz_, bx, bx_)
    wz, wz_ = dd_cross(ax, ax_, ay, ay_, bx, bx_, by, by_)
    det, det_ = dd_dot3(ax, ax_, ay, ay_, az, az_, ux, ux_, uy, uy_, uz, uz_)
    nx, nx_ = dd_dot3(ha, ha_, hb, hb_, hc, hc_, ux, ux_, vx, vx_, wx, wx_)
    ny, ny_ = dd_dot3(ha, ha_, hb, hb_, hc, hc_, uy, uy_, vy, vy_, wy, wy_)
    nz, nz_ = dd_dot3(ha, ha_, hb, hb_, hc, hc_, uz, uz_, vz, vz_, wz, wz_)
    nn, _ = dd_dot3(nx, nx_, ny, ny_, nz, nz_, nx, nx_, ny, ny_, nz, nz_)
    p1, p1_ = dd_dot3(nx, nx_, ny, ny_, nz, nz_, ux, ux_, uy, uy_, uz, uz_)
    p2, p2_ = dd_dot3(nx, nx_, ny, ny_, nz, nz_, vx, vx_, vy, vy_, vz, vz_)
    p3, p3_ = dd_dot3(nx, nx_, ny, ny_, nz, nz_, wx, wx_, wy, wy_, wz, wz_)
    dd, dd_ = dd_mul(det, det_, det, det_)
    p0, p0_ = dd_add(p1, p1_, p2, p2_)
    p0, p0_ = dd_add(p0, p0_, p3, p3_)
    p0, p0_ = dd_sub(2 * dd, 2 * dd_, p0, p0_)
    la, lb, lc = math.sqrt(da), math.sqrt(db), math.sqrt(dc)
    ma, mb, mc = lb * lc, lc * la, la * lb
    bulk, volume = (da + abs(wa)) * ma + (db + abs(wb)) * mb + (dc + abs(wc)) * mc, la * ma
    e1, e2, e3 = 128 * _UU * bulk * ma, 128 * _UU * bulk * mb, 128 * _UU * bulk * mc
    e0 = e1 + e2 + e3 + 160 * _UU * volume * (abs(det) + 2.0**-95 * volume)
    if integral and bulk * (ma + mb + mc) + volume * volume < _INTEGER:
        e0, e1, e2, e3 = 0.0, 0.0, 0.0, 0.0
    largest = max(max(abs(p[3]), abs(q[3])), max(abs(r[3]), abs(s[3])))
    power = nn / (4 * dd)
    rho = power - p[3]
    if not (bulk * min(ma, min(mb, mc)) > TINY and bulk < HUGE and volume < HUGE and largest < HUGE):
        return rho, UNDECIDED | INACCURATE
    code = (p0 < -e0) | (p1 < -e1) << 1 | (p2 < -e2) << 2 | (p3 < -e3) << 3
    if abs(p0) <= e0 or abs(p1) <= e1 or abs(p2) <= e2 or abs(p3) <= e3:
        code |= UNDECIDED if e0 > 0.0 else (p0 == 0.0) << 4 | (p1 == 0.0) << 5 | (p2 == 0.0) << 6 | (p3 == 0.0) << 7
    error = _UU * (64 * volume * power * abs(det) + 32 * math.sqrt(nn) * bulk)
    if not (abs(det) > 2.0**-90 * volume and error <= 0.5 * ACCURACY * (abs(rho) + largest) * dd):
        code |= INACCURATE
    return rho, code


@kernel
def exact_simplex(scaled, i0, i1, i2, i3):
    """Size, rounded once, and code of a simplex of 2 to 4 vertices (the last ones -1) by integers alone.

    With G the Gram matrix of the edges from vertex 0 and h_i = |e_i|^2 + w_0 - w_i the centre is sum x_i e_i / 2 where
    G x = h: by Cramer 2 det G lambda = adj G h, and 4 det G (rho + w_0) = h' adj G h. Missing edges are unit vectors.
    """
    k = 1 if i2 < 0 else (2 if i3 < 0 else 3)
    plus, minus = np.int64(1), np.int64(-1)  # typed, or numba compiles every callee once more for each literal
    weight, det, power = np.int64(34), np.int64(35), np.int64(36)
    unit, top = plus << 20, minus << 20
    for j in range(k + 1):
        i = i0 if j == 0 else (i1 if j == 1 else (i2 if j == 2 else i3))
        for c in range(3):
            unit, top = min(unit, lowest_bit(scaled[i, c])), max(top, math.frexp(scaled[i, c])[1])
        unit = min(unit, lowest_bit(scaled[i, 3]) // 2)
        top = max(top, (math.frexp(scaled[i, 3])[1] + 1) // 2)
    size = (top - unit + 2) // BITS + 2  # digits of a difference
    length = 8 * size + 8
    # Rows: e 0 to 8, G 9 to 17, h 18 to 20, adj G 21 to 29, shares 2 det G lambda 30 to 33, and the three above.
    x, used = np.zeros((37, length), np.int64), np.zeros(37, np.int64)
    add_float(x[weight], scaled[i0, 3], 2 * unit, plus)
    _carry(x, used, weight, 2 * size)
    for j in range(3):
        if j >= k:
            x[9 + 4 * j, 0], used[9 + 4 * j] = 1, 1
            continue
        i = i1 if j == 0 else (i2 if j == 1 else i3)
        for c in range(3):
            add_float(x[3 * j + c], scaled[i, c], unit, plus)
            add_float(x[3 * j + c], scaled[i0, c], unit, minus)
            _carry(x, used, 3 * j + c, size)
        add_float(x[18 + j], scaled[i0, 3], 2 * unit, plus)
        add_float(x[18 + j], scaled[i, 3], 2 * unit, minus)
    for j in range(k):
        for l in range(k):
            for c in range(3):
                _add_product(x, used, 9 + 3 * j + l, 3 * j + c, 3 * l + c, plus)
        for t in range(used[9 + 4 * j]):
            x[18 + j, t] += x[9 + 4 * j, t]
        _carry(x, used, 18 + j, 2 * size + 1)
    for j in range(3):
        a, b = 9 + 3 * ((j + 1) % 3), 9 + 3 * ((j + 2) % 3)
        for l in range(3):
            c, d = (l + 1) % 3, (l + 2) % 3
            for term in range(2):
                m = plus - 2 * term
                _add_product(x, used, 21 + 3 * j + l, a + (c if term == 0 else d), b + (d if term == 0 else c), m)
    for j in range(3):
        for l in range(3):
            _add_product(x, used, 31 + j, 21 + 3 * j + l, 18 + l, plus)
        _add_product(x, used, det, 9 + j, 21 + j, plus)
    for t in range(length):
        x[30, t] = 2 * x[det, t] - x[31, t] - x[32, t] - x[33, t]
    _carry(x, used, np.int64(30), length - 1)
    code = 0
    for j in range(k + 1):
        s = 0 if used[30 + j] == 0 else x[30 + j, used[30 + j] - 1]  # balanced digits: the first one has the sign
        code |= (1 << j if s < 0 else 0) | (16 << j if s == 0 else 0)
    for j in range(4):  # 4 det G rho
        a, b = (31 + j, 18 + j) if j < 3 else (det, weight)
        _add_product(x, used, power, a, b, plus if j < 3 else 4 * minus)
    upper, upper_exponent = _leading(x, used, power)
    lower, lower_exponent = _leading(x, used, det)
    return math.ldexp(upper / lower, int(upper_exponent - lower_exponent - 2 + 2 * unit)), code


@kernel
def _carry(x, used, row, touched):
    """Balance the digits of a row of which the first `touched` may be out of bounds; and count those in use."""
    end, i = max(touched, used[row]), 0
    over = np.int64(0)
    while i < end or over != 0:
        digit = x[row, i] + over
        over = (digit + (1 << (BITS - 1))) >> BITS
        x[row, i] = digit - (over << BITS)
        i += 1
    while i > 0 and x[row, i - 1] == 0:
        i -= 1
    used[row] = i


@kernel
def _add_product(x, used, target, a, b, factor):
    """Add a small factor times row a times row b to a row of digits; the product must fit."""
    for i in range(used[a]):
        digit = factor * x[a, i]
        for j in range(used[b]):
            x[target, i + j] += digit * x[b, j]
    _carry(x, used, target, used[a] + used[b])


@kernel
def _leading(x, used, row):
    """Give (y, e) with y * 2**e the value of a row of balanced digits, to 50 bits and more."""
    value = 0.0
    for i in range(max(0, used[row] - 4), used[row]):
        value = value * 2.0**-BITS + x[row, i]
    return value, BITS * (used[row] - 1)
