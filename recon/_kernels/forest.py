"""Which side of the surface each node lies on: evidence weighed by a signed spanning forest, and the facets between the sides.

Nodes and their links, gates and poles are those of `sides`.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel


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
def signed_forest(links, m, facets, keys, pole, anti, trust, parent):
    """Unite nodes across facets (on the same side) and poles of samples (on opposite ones), strongest evidence first.

    Facets: 4 * node + corner, or ~(4 * node + corner) where it is between opposite sides. Evidence that contradicts stronger
    evidence is passed over; where it is as strong, facets come first, and lower numbers. `parent` (N,) has the trees there are: twice the
    root of each node, which is its own, plus the parity. Returns sides (N,) int8, 0 where the first ghost is, and how much
    of the evidence for opposite sides was passed over.

    The strongest evidence that leads out of a tree is in the forest (Boruvka 1926), so all trees grow at once: round by round there
    are half as many or fewer, and what lies within one is dropped. Nothing is sorted.
    """
    N = len(links)
    number, trees = np.empty(N, np.int32), 0
    for x in range(N):
        if parent[x] >> 1 == x:
            number[x] = trees
            trees += 1
    size = len(facets) + len(trust)
    one, two, key = np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size, np.float32)
    odd, count = np.empty(size, np.int8), 0
    for f in range(len(facets)):
        at = max(facets[f], ~facets[f])
        x, y = parent[at >> 2], parent[links[at >> 2, at & 3]]
        one[count], two[count], key[count] = number[x >> 1], number[y >> 1], keys[f]
        odd[count] = (x ^ y) & 1 ^ (facets[f] < 0)
        count += one[count] != two[count]
    for v in range(len(trust)):
        if anti[v] >= 0:
            x, y = parent[pole[v]], parent[anti[v]]
            one[count], two[count], key[count] = number[x >> 1], number[y >> 1], trust[v]
            odd[count] = (x ^ y) & 1 ^ 1
            count += one[count] != two[count]
    # the tree that each of the first ones is in now, and its parity there
    into, turned = np.arange(trees), np.zeros(trees, np.int8)
    best, up, name = np.empty(trees, np.int32), np.empty(trees, np.int32), np.empty(trees, np.int32)
    while count > 0:
        for t in range(trees):
            best[t], up[t] = -1, 2 * t
        for e in range(count):
            a, b = one[e], two[e]
            if best[a] < 0 or key[e] > key[best[a]]:
                best[a] = e
            if best[b] < 0 or key[e] > key[best[b]]:
                best[b] = e
        for t in range(trees):
            if best[t] >= 0:
                a, p = _root(up, np.int64(one[best[t]]))
                b, q = _root(up, np.int64(two[best[t]]))
                if a != b:
                    up[max(a, b)] = 2 * min(a, b) + (odd[best[t]] ^ p ^ q)
        fewer = 0
        for t in range(trees):
            a, p = _root(up, np.int64(t))
            up[t] = 2 * a + p
            if a == t:
                name[t] = fewer
                fewer += 1
        for t in range(len(into)):
            at = up[into[t]]
            into[t] = name[at >> 1]
            turned[t] ^= at & 1
        left = 0
        for e in range(count):
            a, b = up[one[e]], up[two[e]]
            one[left], two[left], key[left], odd[left] = name[a >> 1], name[b >> 1], key[e], odd[e] ^ (a ^ b) & 1
            left += a >> 1 != b >> 1
        trees, count = fewer, left
    sides = np.empty(N, np.int8)
    for x in range(N):
        sides[x] = parent[x] & 1 ^ turned[number[parent[x] >> 1]]
    outside = sides[m]
    for x in range(N):
        sides[x] ^= outside
    passed = 0
    for v in range(len(trust)):
        passed += anti[v] >= 0 and sides[pole[v]] == sides[anti[v]]
    for facet in facets:
        if facet < 0:
            passed += sides[~facet >> 2] == sides[links[~facet >> 2, ~facet & 3]]
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
def lengths(points, i, j, k):
    """Twice the area of a triangle, and its three lengths."""
    ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    aa, bb = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
    cc = (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2
    return np.sqrt(nx * nx + ny * ny + nz * nz), np.sqrt(aa), np.sqrt(bb), np.sqrt(cc)


@kernel
def areas(points, spacing, faces, widest):
    """Twice the area of the faces with a circumradius above `widest` local spacings, and twice that of all."""
    wide, whole = 0.0, 0.0
    for f in range(len(faces)):
        i, j, k = faces[f]
        double, a, b, c = lengths(points, i, j, k)
        whole += double
        if a * b * c > 2 * double * widest * (spacing[i] + spacing[j] + spacing[k]) / 3:
            wide += double
    return wide, whole


@kernel
def narrow_faces(points, spacing, faces, widest, longest, first, last, radius, narrow, short):
    """Of faces (f, 3) first to last the circumradius (f,), whether it is at most `widest`, and the length around at most `longest` local spacings."""
    for f in range(first, last):
        i, j, k = faces[f]
        double, a, b, c = lengths(points, i, j, k)
        h = (spacing[i] + spacing[j] + spacing[k]) / 3
        radius[f] = a * b * c / (2 * double) if double > 0 else np.inf
        narrow[f] = radius[f] <= widest * h
        short[f] = a + b + c <= longest * h
