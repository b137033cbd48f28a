"""Which side of the surface each node lies on: evidence weighed by a signed spanning forest, and the facets between the sides.

Nodes and their links, gates and poles are those of `sides`.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel

_BLOCK = 128  # facets at a time


@kernel
def descending(keys, values):
    """Sort non-negative float32 keys, largest first, and int32 values along with them, both stably: a radix sort in place."""
    n = len(keys)
    bits, other_bits, other = keys.view(np.uint32), np.empty(n, np.uint32), np.empty(n, np.int32)
    count = np.zeros((4, 257), np.int64)
    for i in range(n):
        for b in range(4):
            count[b, 256 - ((bits[i] >> np.uint32(8 * b)) & np.uint32(255))] += 1
    for b in range(4):
        for digit in range(256):
            count[b, digit + 1] += count[b, digit]
        for i in range(n):
            digit = 255 - ((bits[i] >> np.uint32(8 * b)) & np.uint32(255))
            at = count[b, digit]
            count[b, digit] += 1
            other_bits[at], other[at] = bits[i], values[i]
        bits, other_bits, values, other = other_bits, bits, other, values


@kernel(inline="always")
def _root(parent, x):
    """Root of x and the parity on the way there, path halved; `parent` holds 2 * parent + parity."""
    odd = 0
    while parent[x] >> 1 != x:
        up = parent[x] >> 1
        top = parent[up]
        parent[x] = top ^ (parent[x] & 1) if top >> 1 != up else parent[x]
        odd ^= parent[x] & 1
        x = parent[x] >> 1
    return x, odd


@kernel
def each_facet(links, m):
    """All facets once, as 4 * node + corner."""
    count = 0
    for c in range(m):
        for k in range(4):
            count += links[c, k] > c
    facets = np.empty(count, np.int32)
    count = 0
    for c in range(m):
        for k in range(4):
            if links[c, k] > c:
                facets[count] = 4 * c + k
                count += 1
    return facets


@kernel
def first_trees(links, gate, pole, anti, trust):
    """Root of every node (N,), times 2: cells united across the widest gate of each, where no pole speaks louder; all ghosts.

    That gate is the strongest evidence there is of a cell, so the forest has it (Boruvka 1926): most need no sorting.
    """
    N, m = len(links), len(gate)
    loudest = np.zeros(N, np.float32)
    for v in range(len(trust)):
        if anti[v] >= 0:
            loudest[pole[v]] = max(loudest[pole[v]], trust[v])
            loudest[anti[v]] = max(loudest[anti[v]], trust[v])
    parent = np.empty(N, np.int32)
    for x in range(N):
        parent[x] = 2 * min(x, m)
    for x in range(m):
        widest, lower, across = np.float32(-1), np.int64(x), np.int64(x)
        for k in range(4):
            y = np.int64(links[x, k])
            if gate[x, k] > widest or (gate[x, k] == widest and min(x, y) < lower):  # the order of `facet_evidence`
                widest, lower, across = gate[x, k], min(x, y), y
        if loudest[x] <= widest:
            a, b = _root(parent, np.int64(x))[0], _root(parent, across)[0]
            parent[max(a, b)] = 2 * min(a, b)
    for x in range(N):
        parent[x] = parent[parent[x] >> 1]
    return parent


@kernel
def facet_evidence(links, gate, parent):
    """The facets between different trees, as 4 * node + corner, and their gates."""
    m = len(gate)
    facets, keys, count = np.empty(4 * m, np.int32), np.empty(4 * m, np.float32), 0
    for c in range(m):
        for k in range(4):
            facets[count], keys[count] = 4 * c + k, gate[c, k]
            count += (links[c, k] > c) & (parent[links[c, k]] != parent[c])
    return facets[:count], keys[:count]


@kernel
def _unite(links, facets, keys, poles, s, until, parent):
    """Unite nodes across facets, widest first, and those of poles that speak louder, from the s-th on, in the end all louder than `until`.

    Returns the pole to go on with, and how much of the evidence for opposite sides was passed over.
    """
    pole, anti, strength, by_trust = poles
    count, passed = len(facets), 0
    one, two = np.empty(_BLOCK, np.int64), np.empty(_BLOCK, np.int64)
    for f in range(count + 1):
        while s < len(by_trust) and strength[s] > (keys[f] if f < count else until):
            v = by_trust[s]
            s += 1
            if anti[v] < 0:
                continue
            a, p = _root(parent, np.int64(pole[v]))
            b, q = _root(parent, np.int64(anti[v]))
            if a == b:
                passed += p == q
            else:
                parent[max(a, b)] = 2 * min(a, b) + (1 ^ p ^ q)
        if f < count:
            if f % _BLOCK == 0:  # ahead of time, all at once: memory answers many questions as fast as one
                for i in range(f, min(f + _BLOCK, count)):
                    facet = max(facets[i], ~facets[i])
                    one[i - f], two[i - f] = parent[facet >> 2], parent[links[facet >> 2, facet & 3]]
            a, p = _root(parent, one[f % _BLOCK] >> 1)
            b, q = _root(parent, two[f % _BLOCK] >> 1)
            opposite = np.int64(facets[f] < 0)
            odd = (one[f % _BLOCK] ^ two[f % _BLOCK]) & 1 ^ p ^ q
            if a != b:
                parent[max(a, b)] = 2 * min(a, b) + (opposite ^ odd)
            else:
                passed += opposite == 1 and odd == 0
    return s, passed


@kernel
def signed_forest(links, m, facets, keys, pole, anti, trust, parent):
    """Unite nodes across facets (on the same side) and poles of samples (on opposite ones), strongest evidence first.

    Facets: 4 * node + corner, or ~(4 * node + corner) where it is between opposite sides. Evidence that contradicts stronger
    evidence is passed over. `parent` (N,), 2 * parent + parity, has the trees there are, and grows. Returns sides (N,) int8, 0 where
    the first ghost is, and how much of the evidence for opposite sides was passed over. The weaker half of the facets is sorted
    when the other is done with, and most of them are within one tree by then (Filter-Kruskal: Osipov, Sanders & Singler 2009).
    """
    N = len(links)
    strength, by_trust = trust.copy(), np.arange(len(trust)).astype(np.int32)
    descending(strength, by_trust)
    poles = pole, anti, strength, by_trust
    middle = np.sort(keys[:: 1 + len(keys) // 1024])
    strong = keys >= (middle[len(middle) // 2] if len(middle) > 0 else np.float32(0))
    order, width = facets[strong], keys[strong]
    descending(width, order)
    s, passed = _unite(links, order, width, poles, 0, np.inf, parent)
    order, width, count = np.empty(len(facets), np.int32), np.empty(len(facets), np.float32), 0
    for f in range(len(facets)):
        if not strong[f]:
            facet = max(facets[f], ~facets[f])
            a, p = _root(parent, np.int64(facet >> 2))
            b, q = _root(parent, np.int64(links[facet >> 2, facet & 3]))
            order[count], width[count] = facets[f], keys[f]
            count += a != b
            passed += (a == b) & (facets[f] < 0) & (p == q)
    order, width = order[:count], width[:count]
    descending(width, order)
    passed += _unite(links, order, width, poles, s, -1.0, parent)[1]
    sides = np.empty(N, np.int8)
    for x in range(N):
        sides[x] = _root(parent, np.int64(x))[1]
    outside = sides[m]
    for x in range(N):
        sides[x] ^= outside
    return sides, passed


@kernel
def facets_between(links, sides, m, first, last):
    """Of a range of the m cells, the facets between side 1 and side 0, as 4 * cell + corner, seen from side 1 where it is a cell's."""
    facets, count = np.empty(4 * (last - first), np.int64), 0
    for c in range(first, last):
        for k in range(4):
            o = links[c, k]
            if sides[o] != sides[c] and (sides[c] == 1 or o >= m):
                facets[count] = 4 * np.int64(c) + k
                count += 1
    return facets[:count].copy()


@kernel
def corners_of(cells, facets, opposite):
    """Vertices (f, 3) of facets, as 4 * cell + corner; `opposite` (4, 3): the slots of the facet opposite each corner."""
    faces = np.empty((len(facets), 3), np.int32)
    for f in range(len(facets)):
        for j in range(3):
            faces[f, j] = cells[facets[f] >> 2, opposite[facets[f] & 3, j]]
    return faces


@kernel
def areas(points, spacing, faces, widest):
    """Twice the area of the faces with a circumradius above `widest` local spacings, and twice that of all."""
    wide, whole = 0.0, 0.0
    for f in range(len(faces)):
        i, j, k = faces[f]
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        aa, bb = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
        cc = (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2
        double = np.sqrt(nx * nx + ny * ny + nz * nz)
        whole += double
        if np.sqrt(aa) * np.sqrt(bb) * np.sqrt(cc) > 2 * double * widest * (spacing[i] + spacing[j] + spacing[k]) / 3:
            wide += double
    return wide, whole
