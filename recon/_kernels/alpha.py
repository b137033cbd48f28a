"""The weighted alpha complex over arrays: sizes, attachment and interval bounds by decreasing dimension (paper, 5.3).

One level a dimension. A level is `rows` (s, k+1) int32 ascending in a row; `rho`, `lower`, `upper` (s,) float64; `code`
(s,) uint8: bit j set where the barycentric coordinate of the orthocentre at vertex j is negative, that is where the
facet opposite j is attached; bit 3 + j of a triangle where its edge opposite j is on the hull; ATTACHED; HULL.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .sizes import edge, tetrahedron, triangle

ATTACHED, HULL = 64, 128


@kernel(inline="always")
def _sorted_slots(cells, i):
    """Vertices of a tetrahedron as (vertex << 2 | slot), ascending."""
    a, b = np.int64(cells[i, 0]) << 2, np.int64(cells[i, 1]) << 2 | 1
    c, d = np.int64(cells[i, 2]) << 2 | 2, np.int64(cells[i, 3]) << 2 | 3
    a, b, c, d = min(a, b), max(a, b), min(c, d), max(c, d)
    a, c, b, d = min(a, c), max(a, c), min(b, d), max(b, d)
    return a, min(b, c), max(b, c), d


@kernel
def measure_tetrahedra(scaled, integral, cells, rho, conflict):
    """Fill in, by cell, its size, and bits by slot: is the facet opposite attached for this cell's sake?"""
    for i in range(len(cells)):
        a, b, c, d = _sorted_slots(cells, i)
        p, q, r, s = a >> 2, b >> 2, c >> 2, d >> 2
        rho[i], code = tetrahedron(
            scaled[p, 0], scaled[p, 1], scaled[p, 2], scaled[p, 3], scaled[q, 0], scaled[q, 1], scaled[q, 2],
            scaled[q, 3], scaled[r, 0], scaled[r, 1], scaled[r, 2], scaled[r, 3], scaled[s, 0], scaled[s, 1],
            scaled[s, 2], scaled[s, 3], integral,
        )  # fmt: skip
        if code >> 4:
            conflict[i] = 15  # impossible, as coordinates add up to one: to be settled
        else:
            conflict[i] = (
                (code & 1) << (a & 3) | (code >> 1 & 1) << (b & 3) | (code >> 2 & 1) << (c & 3) | (code >> 3) << (d & 3)
            )


@kernel
def count_facets(cells, neighbors, starts):
    """Fill in (n+1,) where the facets of each first vertex start, in a level of triangles."""
    starts[:] = 0
    for i in range(len(cells)):
        a, b, c, d = _sorted_slots(cells, i)
        for j in range(4):
            slot = (a if j == 0 else (b if j == 1 else (c if j == 2 else d))) & 3
            if not 0 <= neighbors[i, slot] < i:
                starts[((b if j == 0 else a) >> 2) + 1] += 1
    for v in range(len(starts) - 1):
        starts[v + 1] += starts[v]


@kernel
def facets_of_tetrahedra(scaled, integral, cells, neighbors, cell_rho, conflict, starts, rows, owner, code, reals):
    """Fill in facets, bucket by bucket of first vertex: vertices, 4 cell + slot opposite, code; rho, lower, upper."""
    place = np.empty(len(starts) - 1, np.int64)
    for v in range(len(place)):
        place[v] = starts[v]
    for i in range(len(cells)):
        a, b, c, d = _sorted_slots(cells, i)
        for j in range(4):
            slot = (a if j == 0 else (b if j == 1 else (c if j == 2 else d))) & 3
            other = np.int64(neighbors[i, slot])
            if 0 <= other < i:
                continue
            p, q, r = (b if j == 0 else a) >> 2, (b if j > 1 else c) >> 2, (c if j > 2 else d) >> 2
            rho, signs = triangle(
                scaled[p, 0], scaled[p, 1], scaled[p, 2], scaled[p, 3], scaled[q, 0], scaled[q, 1], scaled[q, 2],
                scaled[q, 3], scaled[r, 0], scaled[r, 1], scaled[r, 2], scaled[r, 3], integral,
            )  # fmt: skip
            signs = 7 if signs >> 4 else signs
            attached = conflict[i] >> slot & 1
            lower, upper = cell_rho[i], math.inf
            if other < 0:
                signs |= HULL | 56
            else:
                lower, upper = min(lower, cell_rho[other]), max(lower, cell_rho[other])
                for s in range(4):
                    if neighbors[other, s] == i:
                        attached |= conflict[other] >> s & 1
            f = place[p]
            place[p] += 1
            rows[f, 0], rows[f, 1], rows[f, 2], owner[f], code[f] = p, q, r, 4 * i + slot, signs | attached * ATTACHED
            reals[0, f], reals[1, f], reals[2, f] = rho, lower, upper


@kernel
def count_cells(cells, starts):
    """Fill in (n+1,) where the simplices of each first vertex start, in a level of cells."""
    starts[:] = 0
    for i in range(len(cells)):
        first = cells[i, 0]
        for s in range(1, cells.shape[1]):
            first = min(first, cells[i, s])
        starts[first + 1] += 1
    for v in range(len(starts) - 1):
        starts[v + 1] += starts[v]


@kernel
def bucket_cells(cells, cell_rho, starts, rows, owner, reals):
    """Fill in tetrahedra that are cells, bucket by bucket of first vertex: vertices, the cell; its size."""
    place = np.empty(len(starts) - 1, np.int64)
    for v in range(len(place)):
        place[v] = starts[v]
    for i in range(len(cells)):
        a, b, c, d = _sorted_slots(cells, i)
        f = place[a >> 2]
        place[a >> 2] += 1
        rows[f, 0], rows[f, 1], rows[f, 2], rows[f, 3], owner[f] = a >> 2, b >> 2, c >> 2, d >> 2, i
        reals[0, f] = cell_rho[i]


@kernel
def sort_buckets(starts, rows, owner, code, reals):
    """Make rows lexicographic within each bucket of first vertex, in place, and take what else a simplex has along."""
    width = rows.shape[1]
    longest = 0
    for v in range(len(starts) - 1):
        longest = max(longest, starts[v + 1] - starts[v])
    major, minor, index = np.empty(longest, np.int64), np.empty(longest, np.int64), np.empty(longest, np.int64)
    number, real = np.empty(longest, np.int64), np.empty(longest)
    for v in range(len(starts) - 1):
        start, size = starts[v], starts[v + 1] - starts[v]
        for j in range(size):
            index[j] = start + j
            major[j] = np.int64(rows[start + j, 1]) << 32 | rows[start + j, 2]
            minor[j] = rows[start + j, 3] if width > 3 else 0
            number[j] = np.int64(owner[start + j]) << 8 | code[start + j]
        gap = 1
        while gap < size // 3:
            gap = 3 * gap + 1
        while gap > 0:  # Shell's sort: a handful of rows nearly always, millions around a hub
            for j in range(gap, size):
                x, y, z, k = major[j], minor[j], index[j], j
                while k >= gap and (major[k - gap] > x or (major[k - gap] == x and minor[k - gap] > y)):
                    major[k], minor[k], index[k] = major[k - gap], minor[k - gap], index[k - gap]
                    k -= gap
                major[k], minor[k], index[k] = x, y, z
            gap //= 3
        for j in range(size):
            rows[start + j, 1], rows[start + j, 2] = major[j] >> 32, major[j] & 0xFFFFFFFF
            if width > 3:
                rows[start + j, 3] = minor[j]
            packed = number[index[j] - start]
            owner[start + j], code[start + j] = packed >> 8, packed & 255
        for c in range(len(reals)):
            for j in range(size):
                real[j] = reals[c, index[j]]
            for j in range(size):
                reals[c, start + j] = real[j]


@kernel
def measure_triangles(scaled, integral, cells, neighbors, starts, rows, owner, code, reals):
    """Fill in triangles that are cells, bucket by bucket of first vertex: vertices, the cell, code; size."""
    place = np.empty(len(starts) - 1, np.int64)
    for v in range(len(place)):
        place[v] = starts[v]
    for i in range(len(cells)):
        a, b = np.int64(cells[i, 0]) << 2, np.int64(cells[i, 1]) << 2 | 1
        c = np.int64(cells[i, 2]) << 2 | 2
        a, b = min(a, b), max(a, b)
        b, c = min(b, c), max(b, c)
        a, b = min(a, b), max(a, b)
        p, q, r = a >> 2, b >> 2, c >> 2
        rho, signs = triangle(
            scaled[p, 0], scaled[p, 1], scaled[p, 2], scaled[p, 3], scaled[q, 0], scaled[q, 1], scaled[q, 2],
            scaled[q, 3], scaled[r, 0], scaled[r, 1], scaled[r, 2], scaled[r, 3], integral,
        )  # fmt: skip
        hull = (neighbors[i, a & 3] < 0) << 3 | (neighbors[i, b & 3] < 0) << 4 | (neighbors[i, c & 3] < 0) << 5
        f = place[p]
        place[p] += 1
        rows[f, 0], rows[f, 1], rows[f, 2], owner[f], code[f] = p, q, r, i, (7 if signs >> 4 else signs) | hull
        reals[0, f] = rho


@kernel
def edges_of_triangles(
    scaled, integral, rows, starts, rho, lower, upper, code, middle, records, edges, edge_starts, edge_code, reals
):
    """Fill in the level of edges, lexicographic, from that of triangles; status 1 where their number does not fit.

    Reals are rho, lower, upper. Scratch: `middle` (n+2,); `records` (s, 3), triangles by middle vertex: last vertex and
    code, entry, upper bound.
    """
    n = len(starts) - 1
    middle[:] = 0
    for f in range(len(rows)):
        middle[rows[f, 1] + 2] += 1
    longest = 0
    for v in range(n):
        longest = max(longest, 2 * (starts[v + 1] - starts[v]) + middle[v + 2])
        middle[v + 2] += middle[v + 1]
    for f in range(len(rows)):
        v = rows[f, 1]
        k = middle[v + 1]
        middle[v + 1] += 1
        records[k, 0] = rows[f, 2] * 256.0 + code[f]
        records[k, 1], records[k, 2] = lower[f] if code[f] & ATTACHED else rho[f], upper[f]

    slot = np.empty(n, np.int32)
    for v in range(n):
        slot[v] = -1
    ends, least, most = np.empty(longest, np.int32), np.empty(longest), np.empty(longest)
    flags = np.empty(longest, np.uint8)
    e = 0
    for v in range(n):
        edge_starts[v] = e
        size = 0
        own = 2 * (starts[v + 1] - starts[v])  # visits: to triangles it is first in, for both edges; then middle in
        for t in range(own + middle[v + 1] - middle[v]):
            if t < own:
                f, j = starts[v] + (t >> 1), 2 - (t & 1)
                u, bits, entry, bound = np.int64(rows[f, 3 - j]), np.int64(code[f]), rho[f], upper[f]
                if bits & ATTACHED:
                    entry = lower[f]
            else:
                f, j = middle[v] + t - own, 0
                bits, entry, bound = np.int64(records[f, 0]), records[f, 1], records[f, 2]
                u, bits = bits >> 8, bits & 255
            k = slot[u]
            if k < 0:
                k = size
                slot[u] = k
                ends[k], least[k], most[k], flags[k] = u, math.inf, -math.inf, 0
                size += 1
            least[k], most[k] = min(least[k], entry), max(most[k], bound)
            flags[k] |= (bits >> j & 1) * ATTACHED | (bits >> (3 + j) & 1) * HULL
        if e + size > len(edges):
            return 1
        for k in range(size):
            slot[ends[k]] = -1
        gap = 1
        while gap < size // 3:
            gap = 3 * gap + 1
        while gap > 0:
            for j in range(gap, size):
                u, x, y, z, k = ends[j], least[j], most[j], flags[j], j
                while k >= gap and ends[k - gap] > u:
                    ends[k], least[k], most[k], flags[k] = ends[k - gap], least[k - gap], most[k - gap], flags[k - gap]
                    k -= gap
                ends[k], least[k], most[k], flags[k] = u, x, y, z
            gap //= 3
        for k in range(size):
            u, bits = ends[k], flags[k]
            reals[0, e], signs = edge(
                scaled[v, 0], scaled[v, 1], scaled[v, 2], scaled[v, 3],
                scaled[u, 0], scaled[u, 1], scaled[u, 2], scaled[u, 3], integral,
            )  # fmt: skip
            edges[e, 0], edges[e, 1] = v, u
            reals[1, e], reals[2, e] = least[k], math.inf if bits & HULL else most[k]
            edge_code[e] = bits | (3 if signs >> 4 else signs)
            e += 1
    edge_starts[n] = e
    return 0 if e == len(edges) else 1


@kernel
def vertices_of_edges(n, rows, rho, lower, upper, code):
    """Bounds and code of every point from the level of edges; a lower bound of inf where it is no vertex of an edge."""
    v_lower, v_upper, v_code = np.full(n, math.inf), np.full(n, -math.inf), np.zeros(n, np.uint8)
    for e in range(len(rows)):
        value = lower[e] if code[e] & ATTACHED else rho[e]
        for j in range(2):  # the facet opposite the other end
            v = rows[e, 1 - j]
            v_lower[v], v_upper[v] = min(v_lower[v], value), max(v_upper[v], upper[e])
            v_code[v] |= (code[e] >> j & 1) * ATTACHED | code[e] & HULL
    return v_lower, v_upper, v_code
