"""How many times the surface passes through a sample: its umbrellas of facets."""

from __future__ import annotations

import numpy as np

from .compile import kernel


@kernel
def star_lists(nodes, n):
    """The nodes around each sample: star[starts[v] : starts[v + 1]], ascending."""
    starts = np.zeros(n + 1, np.int64)
    for x in range(len(nodes)):
        for k in range(4):
            if nodes[x, k] < n:
                starts[nodes[x, k] + 1] += 1
    for v in range(n):
        starts[v + 1] += starts[v]
    place = starts[:-1].copy()
    star = np.empty(starts[n], np.int32)
    for x in range(len(nodes)):
        for k in range(4):
            v = nodes[x, k]
            if v < n:
                star[place[v]] = x
                place[v] += 1
    return starts, star


@kernel
def umbrellas(ground, scratch, widest, sides, v):
    """Umbrellas of sample v beyond the first, -1 where it has no facet; facets of wider gate than `widest` are none.

    The link of v in the surface is a graph: as many umbrellas as it has components, and (degree - 1) // 2 more at each
    of its vertices.
    """
    _, _, nodes, links, gate, starts, star = ground
    number, corner, parent, degree = scratch
    m = len(gate)
    count = 0
    for i in range(starts[v], starts[v + 1]):
        x = star[i]
        if x >= m:
            continue
        for k in range(4):
            y = links[x, k]
            if (y < x and y < m) or sides[y] == sides[x] or nodes[x, k] == v or gate[x, k] > widest:
                continue
            first = np.int32(-1)
            for j in range(4):
                u = nodes[x, j]
                if j == k or u == v:
                    continue
                at = number[u]
                if at < 0:
                    at = np.int32(count)
                    number[u] = at
                    corner[at], parent[at], degree[at] = u, at, 0
                    count += 1
                degree[at] += 1
                while parent[at] != at:
                    at = parent[at]
                if first >= 0:
                    parent[at] = first
                first = at
    excess = -1
    for i in range(count):
        excess += (parent[i] == i) + (degree[i] - 1) // 2
        number[corner[i]] = -1
    return excess


@kernel
def excesses(ground, scratch, widest, sides, excess):
    """`umbrellas` of every sample into `excess` (n,)."""
    starts = ground[5]
    for v in range(len(excess)):
        if starts[v + 1] > starts[v]:
            excess[v] = umbrellas(ground, scratch, widest, sides, v)
