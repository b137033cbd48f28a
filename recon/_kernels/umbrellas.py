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
def rooms(starts):
    """Room for the link graph of one sample: number of every sample, -1; corner, parent and degree by number."""
    n, longest = len(starts) - 1, 4
    for v in range(n):
        longest = max(longest, starts[v + 1] - starts[v])
    size = 6 * longest
    return np.full(n + 1, -1, np.int32), np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size, np.int32)


@kernel(inline="always")
def _join(number, corner, parent, degree, count, one, two):
    """Put an edge into the link graph of a sample; its vertices so far."""
    first = np.int32(-1)
    for u in (one, two):
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
    return count


@kernel(inline="always")
def _excess(number, corner, parent, degree, count):
    """Umbrellas beyond the first by the link graph of a sample, which is cleared.

    As many as the graph has components, and (degree - 1) // 2 more at each of its vertices.
    """
    excess = -1
    for i in range(count):
        excess += (parent[i] == i) + (degree[i] - 1) // 2
        number[corner[i]] = -1
    return excess


@kernel
def umbrellas(ground, scratch, widest, sides, v):
    """Umbrellas of sample v beyond the first, -1 where it has no facet; facets of wider gate than `widest` are none."""
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
            j = 0
            while j == k or nodes[x, j] == v:
                j += 1
            l = j + 1
            while l == k or nodes[x, l] == v:
                l += 1
            count = _join(number, corner, parent, degree, count, nodes[x, j], nodes[x, l])
    return _excess(number, corner, parent, degree, count)


@kernel
def excesses(nodes, facets, starts, first, last, excess):
    """`umbrellas` of a range of samples into excess (n,), 0 of those in no cell: from a list of the facets of the surface."""
    number, corner, parent, degree = rooms(starts)
    place = np.zeros(last - first + 2, np.int64)
    pairs = np.empty((0, 2), np.int32)
    for turn in range(2):
        for f in range(len(facets)):
            x, k = facets[f] >> 2, facets[f] & 3
            for j in range(4):
                v = nodes[x, j] - first
                if j == k or v < 0 or v >= last - first:
                    continue
                if turn == 0:
                    place[v + 2] += 1
                else:
                    at = place[v + 1]
                    place[v + 1] += 1
                    i = 0
                    while i == j or i == k:
                        i += 1
                    pairs[at, 0], pairs[at, 1] = nodes[x, i], nodes[x, 6 - i - j - k]
        if turn == 0:
            for v in range(last - first):
                place[v + 2] += place[v + 1]
            pairs = np.empty((place[last - first + 1], 2), np.int32)
    for v in range(first, last):
        if starts[v + 1] > starts[v]:
            count = 0
            for i in range(place[v - first], place[v - first + 1]):
                count = _join(number, corner, parent, degree, count, pairs[i, 0], pairs[i, 1])
            excess[v] = _excess(number, corner, parent, degree, count)
