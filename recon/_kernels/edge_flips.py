"""Edge flips of the surface: along which diagonal each cell on it is folded.

A cell with two facets on the surface is a quadrilateral folded along one diagonal; where the cell is flipped, it is folded along
the other. Neither topology nor vertices change. Energy = `bend` of each edge + `wall` of each facet: the total absolute mean
curvature of the mesh (Dyn, Hormann, Kim & Levin 2001), so that edges run along creases and not across them; where all is flat,
facets are small and round.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .energy import WALL, edge_facets, narrow, onward, wall

SLIGHT = WALL  # gain that is none: what the wall of one facet with a radius of one spacing costs
LIKELY = 1 / 3  # share of what the facets of a cell are turned by that a flip may gain at the edges around: seldom more
DEPTH = 3  # flips that may be worth it only together,
BENT = 0.6  # tried where the five edges bend more than this in all: a smooth surface well sampled bends less


@kernel(inline="always")
def normal(points, nodes, x, k, out):
    """Unit normal of facet k of cell x, out of the cell (inward for all cells if not); 0 where it has no area."""
    a, b, c = nodes[x, (k + 1) & 3], nodes[x, (k + 2) & 3], nodes[x, (k + 3) & 3]
    px, py, pz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    qx, qy, qz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    nx, ny, nz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    scale = (-1.0 if k & 1 else 1.0) / size if size > 0 else 0.0
    out[0], out[1], out[2] = scale * nx, scale * ny, scale * nz


@kernel(inline="always")
def bend(length, one, two, sign):
    """Length of an edge times the distance between unit normals, `two` of them times sign."""
    apart = 1.0 - sign * (one[0] * two[0] + one[1] * two[1] + one[2] * two[2])
    return length * math.sqrt(2 * max(apart, 0.0))


@kernel(inline="always")
def length(points, spacing, a, b):
    """Of the edge (a, b), in spacings."""
    x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
    return 2 * math.sqrt(x * x + y * y + z * z) / (spacing[a] + spacing[b])


@kernel(inline="always")
def on_surface(links, sides, x):
    """How many facets of node x are on the surface."""
    count = 0
    for k in range(4):
        count += sides[links[x, k]] != sides[x]
    return count


@kernel
def beyond(nodes, links, gate, sides, widest, x, i, j, k):
    """The surface facet met first around the edge (i, j) of node x, leaving x through facet k: nodes before and behind, its number.

    Behind it is x itself at a boundary: then it is the one facet there, of x.
    """
    a, b, turn = nodes[x, i], nodes[x, j], nodes[x, 6 - i - j - k]
    at, through = np.int64(x), k
    y = links[at, through]
    while sides[y] == sides[at] or not narrow(links, gate, widest, at, through):
        at = np.int64(y)
        through, turn = onward(nodes, at, a, b, turn)
        y = links[at, through]
    return at, np.int64(y), through


@kernel
def change(ground, widest, sides, excess, x, around, normals):
    """What an edge flip in node x, with two facets on the surface, changes of the energy; and what the five edges bend now.

    inf where the flip cannot be, or gains nothing by all likelihood. Fills in the nodes `around` (12,) in which other flips change by it;
    `normals` (5, 3) is room.
    """
    points, spacing, nodes, links, gate = ground[:5]
    n, m, one, two = len(points), len(gate), -1, -1
    for k in range(4):
        if sides[links[x, k]] != sides[x]:
            one, two = two, k
    i = 0
    while i == one or i == two:
        i += 1
    j = 6 - i - one - two
    a, b, p, q = nodes[x, i], nodes[x, j], nodes[x, one], nodes[x, two]
    for v in (a, b, p, q):
        if v == n or excess[v] != 0:
            return np.inf, 0.0
    energy = 0.0
    for k, v in ((one, p), (two, q)):
        if not narrow(links, gate, widest, x, k):
            return np.inf, 0.0
        energy -= wall(points, spacing, a, b, v)
    for v in (a, b):
        new = wall(points, spacing, p, q, v)
        if new > WALL * widest * widest:
            return np.inf, 0.0
        energy += new
    for k in range(4):
        normal(points, nodes, x, k, normals[k])
    bent = bend(length(points, spacing, a, b), normals[one], normals[two], 1.0)
    energy += bend(length(points, spacing, p, q), normals[i], normals[j], 1.0) - bent
    turned = 0.0
    for this, other in ((i, j), (j, i)):
        for near, far in ((one, two), (two, one)):
            along = length(points, spacing, nodes[x, this], nodes[x, near])
            turned += bend(along, normals[far], normals[other], -1.0)
    if energy - LIKELY * turned > -SLIGHT and turned < BENT:
        return np.inf, 0.0
    for this, other in ((i, j), (j, i)):
        for near, far in ((one, two), (two, one)):
            before, behind, k = beyond(nodes, links, gate, sides, widest, x, this, near, other)
            at = 4 * (this == j) + 2 * (near == two)
            around[at], around[at + 1] = before, behind
            if behind == x:
                continue
            sign = 1.0
            if before >= m:  # behind the hull
                if behind >= m:
                    return np.inf, 0.0
                sign, k = -1.0, 0
                while links[behind, k] != before:
                    k += 1
                before = behind
            normal(points, nodes, before, k, normals[4])
            along = length(points, spacing, nodes[x, this], nodes[x, near])
            now = bend(along, normals[4], normals[far], sign)
            bent += now
            energy += bend(along, normals[4], normals[other], -sign) - now
    for k in range(4):
        around[8 + k] = links[x, k]
    if edge_facets(nodes, links, gate, sides, widest, x, one, two)[0] > 0:
        return np.inf, 0.0
    return energy, bent


@kernel
def fold(links, gate, widest, sides, x):
    """Flip node x, and let none of its facets be too wide: of a sheet, `change` has looked at their radii."""
    sides[x] ^= 1
    if widest == np.inf:
        return
    for k in range(4):
        y = links[x, k]
        gate[x, k] = min(gate[x, k], widest)
        for q in range(4):
            if y < len(gate) and links[y, q] == x:
                gate[y, q] = gate[x, k]


@kernel(inline="always")
def worth_trying(energy, bent):
    """Whether a flip lowers the energy, or may do so together with others."""
    return energy < -SLIGHT or (bent > BENT and energy < bent)


@kernel
def promising(ground, widest, sides, excess, first, last, hot):
    """Mark the nodes of a range in which flips may lower the energy, (m,) bool."""
    around, normals, links = np.empty(12, np.int64), np.empty((5, 3)), ground[3]
    for x in range(first, last):
        if on_surface(links, sides, x) != 2:
            continue
        energy, bent = change(ground, widest, sides, excess, x, around, normals)
        hot[x] = worth_trying(energy, bent)


@kernel
def flip_edges(ground, widest, sides, excess, hot):
    """Flip edges as long as that lowers the energy, up to DEPTH at a time; returns how many were.

    It ends: each time the energy is lower by SLIGHT or more.
    """
    links, gate = ground[3:5]
    m, flips, normals = len(gate), 0, np.empty((5, 3))
    around, room, chain = np.empty((DEPTH, 12), np.int64), np.empty(12, np.int64), np.empty(DEPTH, np.int64)
    queue, first, waiting = np.empty(m, np.int32), 0, 0  # a ring of the hot nodes
    for x in range(m):
        if hot[x]:
            queue[waiting] = x
            waiting += 1
    while waiting > 0:
        x = np.int64(queue[first])
        first, waiting = (first + 1) % m, waiting - 1
        hot[x] = False
        if on_surface(links, sides, x) != 2:
            continue
        total, bent = change(ground, widest, sides, excess, x, around[0], normals)
        if not worth_trying(total, bent):
            continue
        fold(links, gate, widest, sides, x)
        chain[0], count = x, 1
        while total >= -SLIGHT and count < DEPTH:
            least, best = np.inf, np.int64(-1)
            for y in around[count - 1]:
                if y < m and y != chain[0] and y != chain[count - 1] and on_surface(links, sides, y) == 2:
                    energy = change(ground, widest, sides, excess, y, room, normals)[0]
                    if energy < least:
                        least, best = energy, y
                        around[count] = room
            if best < 0:
                break
            fold(links, gate, widest, sides, best)
            chain[count] = best
            count += 1
            total += least
        if total >= -SLIGHT:
            for y in chain[:count]:
                sides[y] ^= 1
            continue
        flips += count
        for y in around[:count].ravel():
            if y < m and not hot[y]:
                hot[y] = True
                queue[(first + waiting) % m] = y
                waiting += 1
    return flips
