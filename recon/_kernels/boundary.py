"""One weighted alpha shape: which tetrahedra are in, and the facets between in and out, without sizes of the rest."""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .sizes import BLOCK, gather

_U = 2.0**-53


@kernel(inline="late")
def _verdict(x, y, z, w, ax, ay, az, wa, bx, by, bz, wb, cx, cy, cz, wc, alpha):
    """Verdict on one cell, as in `cells_in`: compared are |N|^2 and 4 det^2 (w_0 + alpha) of `sizes.tetrahedron`."""
    ax, ay, az, bx, by, bz, cx, cy, cz = ax - x, ay - y, az - z, bx - x, by - y, bz - z, cx - x, cy - y, cz - z
    da, db, dc = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
    ha, hb, hc = da + (w - wa), db + (w - wb), dc + (w - wc)
    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    tx, ty, tz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    nx, ny, nz = ha * ux + hb * vx + hc * tx, ha * uy + hb * vy + hc * ty, ha * uz + hb * vz + hc * tz
    det = ax * ux + ay * uy + az * uz
    nn, dd = nx * nx + ny * ny + nz * nz, det * det
    ba, bb, bc = da + abs(w - wa), db + abs(w - wb), dc + abs(w - wc)
    ma, mb, mc = db * dc, dc * da, da * db
    bulk, volume = 3 * (ba * ba * ma + bb * bb * mb + bc * bc * mc), da * ma  # squares of those in `sizes`
    power = w + alpha
    largest = max(max(abs(w), abs(wa)), max(abs(wb), abs(wc)))
    gap = nn - 4 * dd * power
    error = (
        64
        * _U
        * (math.sqrt(nn * bulk) + 2.0**-48 * bulk + 4 * abs(power) * (math.sqrt(dd * volume) + 2.0**-48 * volume))
    )
    error += 2.0**-30 * dd * (abs(alpha) + largest)  # the error of sizes, with room
    p1, p2, p3 = nx * ux + ny * uy + nz * uz, nx * vx + ny * vy + nz * vz, nx * tx + ny * ty + nz * tz
    p0 = 2 * dd - p1 - p2 - p3
    e1, e2, e3 = bulk * ma, bulk * mb, bulk * mc
    e0 = 8 * (e1 + e2 + e3 + volume * (dd + 2.0**-90 * volume))
    small = (64 * _U) ** 2
    outer = ((p0 < 0) & (p0 * p0 > small * e0)) << 4 | ((p1 < 0) & (p1 * p1 > small * e1)) << 5
    outer |= ((p2 < 0) & (p2 * p2 > small * e2)) << 6 | ((p3 < 0) & (p3 * p3 > small * e3)) << 7
    certain = (abs(gap) > error) & (2.0**-400 < bulk) & (bulk < 2.0**400) & (volume > 2.0**-400)
    return (1 if gap < 0 else outer) if certain else 2


@kernel
def cells_in(scaled, cells, alpha, verdict):
    """Fill in (m,): is the size of the cell at most alpha (1), greater (0), or too close to tell (2)?

    Of outer cells, bit 4 + slot is set where the facet opposite is certainly attached for the cell's sake.
    """
    c = np.empty((16, BLOCK))
    for first in range(0, len(cells), BLOCK):
        count = min(BLOCK, len(cells) - first)
        gather(scaled, cells[first:], count, c)
        for i in range(count):
            verdict[first + i] = _verdict(
                c[0, i], c[1, i], c[2, i], c[3, i], c[4, i], c[5, i], c[6, i], c[7, i],
                c[8, i], c[9, i], c[10, i], c[11, i], c[12, i], c[13, i], c[14, i], c[15, i], alpha,
            )  # fmt: skip


@kernel
def facets_between(scaled, cells, neighbors, verdict, alpha, marks):
    """Mark facets by slot of a cell, and count: bit s regular, on its inner cell; bit 4 + s perhaps singular.

    A facet between two outer cells may be singular unless attached, or one of its edges too long: the ends are
    orthogonal to y_T, so its square is at most 2 (w_0 + w_1 + 2 rho).
    """
    regular, singular = 0, 0
    for i in range(len(cells)):
        mark = 0
        for s in range(4):
            other = neighbors[i, s]
            if verdict[i] == 1:
                if other < 0 or verdict[other] != 1:
                    mark |= 1 << s
                    regular += 1
            elif verdict[i] >> 4 >> s & 1 == 0 and (other < 0 or (other > i and verdict[other] != 1)):
                if other >= 0 and verdict[other]:
                    t = 0
                    while neighbors[other, t] != i:
                        t += 1
                    if verdict[other] >> 4 >> t & 1:
                        continue
                p, q, r = cells[i, 1 if s == 0 else 0], cells[i, 2 if s < 2 else 1], cells[i, 3 if s < 3 else 2]
                pw, qw, rw = scaled[p, 3], scaled[q, 3], scaled[r, 3]
                room = 4 * alpha + 2.0**-30 * (abs(alpha) + max(abs(pw), max(abs(qw), abs(rw))))
                ax, ay, az = scaled[p, 0] - scaled[q, 0], scaled[p, 1] - scaled[q, 1], scaled[p, 2] - scaled[q, 2]
                bx, by, bz = scaled[q, 0] - scaled[r, 0], scaled[q, 1] - scaled[r, 1], scaled[q, 2] - scaled[r, 2]
                cx, cy, cz = scaled[r, 0] - scaled[p, 0], scaled[r, 1] - scaled[p, 1], scaled[r, 2] - scaled[p, 2]
                if (
                    ax * ax + ay * ay + az * az <= 2 * (pw + qw) + room
                    and bx * bx + by * by + bz * bz <= 2 * (qw + rw) + room
                    and cx * cx + cy * cy + cz * cz <= 2 * (rw + pw) + room
                ):
                    mark |= 16 << s
                    singular += 1
        marks[i] = mark
    return regular, singular


@kernel
def list_facets(marks, shift, found):
    """Fill in (f,) the marked facets as 4 cell + slot: regular ones for a shift of 0, singular candidates for 4."""
    f = 0
    for i in range(len(marks)):
        for s in range(4):
            if marks[i] >> (shift + s) & 1:
                found[f] = 4 * i + s
                f += 1


@kernel
def bucket_facets(cells, found, starts, rows, position, inward):
    """Fill in facets (4 cell + slot), by first vertex: vertices, position in `found`, is ascending order inward?"""
    starts[:] = 0
    for turn in range(2):
        for f in range(len(found)):
            i, s = found[f] >> 2, found[f] & 3
            p, q, r = cells[i, 1 if s == 0 else 0], cells[i, 2 if s < 2 else 1], cells[i, 3 if s < 3 else 2]
            odd = s & 1  # seen from outside a positive cell, (p, q, r) turns to the left for slots 0 and 2
            if p > q:
                p, q, odd = q, p, 1 - odd
            if q > r:
                q, r, odd = r, q, 1 - odd
            if p > q:
                p, q, odd = q, p, 1 - odd
            if turn == 0:
                starts[p + 2] += 1
            else:
                k = starts[p + 1]
                starts[p + 1] += 1
                rows[k, 0], rows[k, 1], rows[k, 2], position[k], inward[k] = p, q, r, f, odd
        if turn == 0:
            for v in range(len(starts) - 2):
                starts[v + 2] += starts[v + 1]
