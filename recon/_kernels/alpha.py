"""The weighted alpha complex over arrays: sizes, attachment and interval bounds by decreasing dimension (paper, 5.3).

One level a dimension. A level is `rows` (s, k+1) int32 ascending in a row; `rho`, `lower`, `upper` (s,) float64; `code`
(s,) uint8: bit j set where the barycentric coordinate of the orthocentre at vertex j is negative, that is where the
facet opposite j is attached; bit 3 + j of a triangle where its edge opposite j is on the hull; ATTACHED; HULL.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .sizes import BLOCK, measure

ATTACHED, HULL = 64, 128


@kernel
def room(n, count, width, reals):
    """Memory for a level: starts, rows, owner, code (all zero), reals.

    Made here and not by numpy, which asks for huge pages: a virtual machine may have to get these from its host first, which
    takes longer than all of the work.
    """
    rows, owner = np.empty((count, width), np.int32), np.empty(count, np.int32)
    return np.empty(n + 1, np.int64), rows, owner, np.zeros(count, np.uint8), np.empty((reals, count))


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
    rows, slots = np.empty((BLOCK, 4), np.int32), np.empty(BLOCK, np.uint8)
    corners, signs = np.empty((16, BLOCK)), np.empty(BLOCK, np.int64)
    for first in range(0, len(cells), BLOCK):
        count = min(BLOCK, len(cells) - first)
        for k in range(count):
            a, b, c, d = _sorted_slots(cells, first + k)
            rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = a >> 2, b >> 2, c >> 2, d >> 2
            slots[k] = (a & 3) | (b & 3) << 2 | (c & 3) << 4 | (d & 3) << 6
        measure(scaled, integral, rows, count, corners, rho[first:], signs)
        for k in range(count):
            code, slot = signs[k], slots[k]
            bits = 15  # impossible, as coordinates add up to one: to be settled
            if code >> 4 == 0:
                bits = (code & 1) << (slot & 3) | (code >> 1 & 1) << (slot >> 2 & 3)
                bits |= (code >> 2 & 1) << (slot >> 4 & 3) | (code >> 3) << (slot >> 6)
            conflict[first + k] = bits


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
    place = starts[:-1].copy()
    triangles, sides = np.empty((BLOCK, 3), np.int32), np.empty(BLOCK, np.int64)
    corners, rho, signs = np.empty((16, BLOCK)), np.empty(BLOCK), np.empty(BLOCK, np.int64)
    for first in range(0, len(cells), BLOCK // 4):
        count = 0
        for i in range(first, min(first + BLOCK // 4, len(cells))):
            a, b, c, d = _sorted_slots(cells, i)
            for j in range(4):
                slot = (a if j == 0 else (b if j == 1 else (c if j == 2 else d))) & 3
                if not 0 <= neighbors[i, slot] < i:
                    triangles[count, 0] = (b if j == 0 else a) >> 2
                    triangles[count, 1], triangles[count, 2] = (b if j > 1 else c) >> 2, (c if j > 2 else d) >> 2
                    sides[count] = 4 * i + slot
                    count += 1
        measure(scaled, integral, triangles, count, corners, rho, signs)
        for k in range(count):
            i, slot = sides[k] >> 2, sides[k] & 3
            other = np.int64(neighbors[i, slot])
            bits = 7 if signs[k] >> 4 else signs[k]
            attached = conflict[i] >> slot & 1
            lower, upper = cell_rho[i], math.inf
            if other < 0:
                bits |= HULL | 56
            else:
                lower, upper = min(lower, cell_rho[other]), max(lower, cell_rho[other])
                for s in range(4):
                    if neighbors[other, s] == i:
                        attached |= conflict[other] >> s & 1
            f = place[triangles[k, 0]]
            place[triangles[k, 0]] += 1
            for j in range(3):
                rows[f, j] = triangles[k, j]
            owner[f], code[f] = sides[k], bits | attached * ATTACHED
            reals[0, f], reals[1, f], reals[2, f] = rho[k], lower, upper


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
    place = starts[:-1].copy()
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
    place = starts[:-1].copy()
    triangles, slots = np.empty((BLOCK, 3), np.int32), np.empty((BLOCK, 3), np.int32)
    corners, rho, signs = np.empty((16, BLOCK)), np.empty(BLOCK), np.empty(BLOCK, np.int64)
    for first in range(0, len(cells), BLOCK):
        count = min(BLOCK, len(cells) - first)
        for k in range(count):
            a, b = np.int64(cells[first + k, 0]) << 2, np.int64(cells[first + k, 1]) << 2 | 1
            c = np.int64(cells[first + k, 2]) << 2 | 2
            a, b = min(a, b), max(a, b)
            b, c = min(b, c), max(b, c)
            a, b = min(a, b), max(a, b)
            triangles[k, 0], triangles[k, 1], triangles[k, 2] = a >> 2, b >> 2, c >> 2
            slots[k, 0], slots[k, 1], slots[k, 2] = a & 3, b & 3, c & 3
        measure(scaled, integral, triangles, count, corners, rho, signs)
        for k in range(count):
            bits = 7 if signs[k] >> 4 else signs[k]
            f = place[triangles[k, 0]]
            place[triangles[k, 0]] += 1
            for j in range(3):
                rows[f, j] = triangles[k, j]
                bits |= (neighbors[first + k, slots[k, j]] < 0) << (3 + j)
            owner[f], code[f], reals[0, f] = first + k, bits, rho[k]


@kernel
def edges_of_triangles(scaled, integral, rows, starts, rho, lower, upper, code, edges, edge_starts, edge_code, reals):
    """Fill in the level of edges, lexicographic, from that of triangles; status 1 where their number does not fit.

    Reals are rho, lower, upper. Triangles are looked at from their first vertex, in order, and from their middle one: for
    that, block by block of middle vertices, they are put into records: last vertex and code, entry, upper bound.
    """
    n = len(starts) - 1
    middle = np.zeros(n + 2, np.int64)
    for f in range(len(rows)):
        middle[rows[f, 1] + 2] += 1
    longest, room = 0, len(rows) // 8 + 1
    for v in range(n):
        longest, room = max(longest, 2 * (starts[v + 1] - starts[v]) + middle[v + 2]), max(room, middle[v + 2])
        middle[v + 2] += middle[v + 1]

    slot = np.full(n, -1, np.int32)
    ends, least, most = np.empty(longest, np.int32), np.empty(longest), np.empty(longest)
    flags, records = np.empty(longest, np.uint8), np.empty((room, 3))
    e, done = 0, 0  # edges; vertices whose triangles are in the records, or were
    base = 0
    for v in range(n):
        if v == done:
            base = middle[v + 1]
            while done < n and middle[done + 2] - base <= room:
                done += 1
            for f in range(starts[done]):
                if v <= rows[f, 1] < done:
                    k = middle[rows[f, 1] + 1]
                    middle[rows[f, 1] + 1] += 1
                    records[k - base, 0] = rows[f, 2] * 256.0 + code[f]
                    records[k - base, 1], records[k - base, 2] = lower[f] if code[f] & ATTACHED else rho[f], upper[f]
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
                f, j = middle[v] + t - own - base, 0
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
            edges[e, 0], edges[e, 1], edge_code[e] = v, ends[k], flags[k]
            reals[1, e], reals[2, e] = least[k], math.inf if flags[k] & HULL else most[k]
            e += 1
    edge_starts[n] = e
    if e < len(edges):
        return 1
    corners, signs = np.empty((16, BLOCK)), np.empty(BLOCK, np.int64)
    for first in range(0, e, BLOCK):
        count = min(BLOCK, e - first)
        measure(scaled, integral, edges[first:], count, corners, reals[0, first:], signs)
        for k in range(count):
            edge_code[first + k] |= 3 if signs[k] >> 4 else signs[k]
    return 0


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
