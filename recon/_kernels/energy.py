"""The energy that repair lowers, and how a flip of one node changes it.

Energy = BURIED for each sample with one side missing + PINCH for each umbrella beyond the first + TOPOLOGY for each
component and handle + WALL * radius^2 for each surface facet (radius in local spacings, capped); of a sheet,
where facets of wide gates are none, TOPOLOGY for each hole, and twice for each handle.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .umbrellas import umbrellas

BURIED = 1.0
PINCH = 1.0
TOPOLOGY = 0.5
WALL = 0.02
RADIUS_CAP = 5.0


@kernel
def narrow(links, gate, widest, x, k):
    """Whether gate k of node x, a cell or a ghost, is no wider than `widest`."""
    if widest == np.inf:
        return True
    y = links[x, k]
    if x < len(gate):
        return gate[x, k] <= widest
    if y >= len(gate):
        return False
    q = 0
    while links[y, q] != x:
        q += 1
    return gate[y, q] <= widest


@kernel(inline="always")
def onward(nodes, y, a, b, turn):
    """Around the edge (a, b): the facet of node y that does not have its vertex `turn`, and its vertex beside the edge."""
    t = 0
    while nodes[y, t] != turn:
        t += 1
    q = 0
    while nodes[y, q] == a or nodes[y, q] == b or q == t:
        q += 1
    return t, nodes[y, q]


@kernel
def edge_facets(nodes, links, gate, sides, widest, x, i, j):
    """Surface facets around the edge (i, j) of node x, and the sides of the two nodes next to x around it."""
    a, b = nodes[x, i], nodes[x, j]
    k = 0
    while k == i or k == j:
        k += 1
    l = 6 - i - j - k
    turn = nodes[x, l]
    y = links[x, k]
    first = sides[y]
    before, facets = sides[x], 0
    at, through = x, k
    while y != x:
        facets += sides[y] != before and narrow(links, gate, widest, at, through)
        before = sides[y]
        at = y
        through, turn = onward(nodes, at, a, b, turn)
        y = links[at, through]
    facets += before != sides[x] and narrow(links, gate, widest, at, through)
    return facets, first, before


@kernel
def wall(points, spacing, i, j, k):
    """Energy of one surface facet; none for one at infinity."""
    n = len(points)
    if i >= n or j >= n or k >= n:
        return 0.0
    ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    aa, bb = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
    cc = (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2
    h = (spacing[i] + spacing[j] + spacing[k]) / 3
    area = 4 * (nx * nx + ny * ny + nz * nz) * h * h
    square = RADIUS_CAP * RADIUS_CAP
    if aa * bb * cc < square * area:
        square = aa * bb * cc / area
    return WALL * square


@kernel
def flip(ground, scratch, widest, sides, x, excess, before):
    """Flip node x: the change of energy without topology, and of the surface's Euler number; `before` (4,) is for `flip_back`."""
    points, spacing, nodes, links, gate = ground[:5]
    n = len(points)
    energy, chi = 0.0, 0
    narrow_of, wall_of = 0, 0  # bit k: gate k of x is narrow; and the surface passes there
    for k in range(4):
        if gate[x, k] > widest:
            continue
        narrow_of |= 1 << k
        i, j, l = nodes[x, (k + 1) & 3], nodes[x, (k + 2) & 3], nodes[x, (k + 3) & 3]
        if sides[links[x, k]] == sides[x]:
            chi += 1
            energy += wall(points, spacing, i, j, l)
        else:
            wall_of |= 1 << k
            chi -= 1
            energy -= wall(points, spacing, i, j, l)
    around = 0  # two bits for each edge (i, j), i < j, at 4 i + j: surface facets there, up to 3
    for i in range(4):
        for j in range(i + 1, 4):
            facets, one, two = edge_facets(nodes, links, gate, sides, widest, x, i, j)
            around |= min(facets, 3) << 2 * (4 * i + j)
            k = 0
            while k == i or k == j:
                k += 1
            after = facets
            if gate[x, k] <= widest:
                after += 1 if one == sides[x] else -1
            if gate[x, 6 - i - j - k] <= widest:
                after += 1 if two == sides[x] else -1
            chi += (facets > 0) - (after > 0)
    sides[x] ^= 1
    for k in range(4):
        v = nodes[x, k]
        if v < n:
            before[k] = old = excess[v]
            if slides(narrow_of, wall_of, around, k):
                continue
            excess[v] = new = umbrellas(ground, scratch, widest, sides, v)
            energy += (BURIED if new < 0 else PINCH * new) - (BURIED if old < 0 else PINCH * old)
            chi += (new >= 0) - (old >= 0)
    return energy, chi


@kernel(inline="always")
def slides(narrow_of, wall_of, around, k):
    """Whether an umbrella at corner k of a node merely slides over it: onto one more edge that had no facets, or off one that had two."""
    if narrow_of | 1 << k != 15:
        return False
    walls, wall_at, gap_at = 0, k, k
    for j in range(4):
        if j != k and wall_of >> j & 1:
            walls, wall_at = walls + 1, j
        elif j != k:
            gap_at = j
    if walls == 0 or walls == 3:
        return False
    other = wall_at if walls == 1 else gap_at
    return around >> 2 * (4 * min(k, other) + max(k, other)) & 3 == (0 if walls == 1 else 2)


@kernel
def flip_back(nodes, sides, x, excess, before):
    """Take back the flip of node x, the latest of those that still stand."""
    sides[x] ^= 1
    for k in range(4):
        if nodes[x, k] < len(excess):
            excess[nodes[x, k]] = before[k]


@kernel
def topology(pieces, chi, widest):
    """Energy of `pieces` more components of nodes, and of a change `chi` of the surface's Euler number."""
    return TOPOLOGY * (2 * pieces - chi / 2) if widest == np.inf else -TOPOLOGY * chi
