"""Half-edges by undirected edge, and connected components, in linear time."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .union import root


@kernel
def by_edge(faces, n):
    """Half-edges (3 f,) by lower vertex, then upper one, then number. Half-edge 3 i + j runs from corner j of face i to the next."""
    place = np.zeros(n + 1, np.int64)
    for i in range(len(faces)):
        for j in range(3):
            place[min(faces[i, j], faces[i, 0 if j == 2 else j + 1]) + 1] += 1
    for v in range(n):
        place[v + 1] += place[v]
    bits = 0
    while 3 * len(faces) >> bits > 0:
        bits += 1
    keys = np.empty(3 * len(faces), np.int64)  # the upper vertex, then the number
    for i in range(len(faces)):
        for j in range(3):
            a, b = faces[i, j], faces[i, 0 if j == 2 else j + 1]
            keys[place[min(a, b)]] = max(a, b) << bits | (3 * i + j)
            place[min(a, b)] += 1
    start = 0
    for v in range(n):
        gap = 1
        while gap < (place[v] - start) // 3:
            gap = 3 * gap + 1
        while gap > 0:  # Shell's sort: a handful nearly always, millions around a hub
            for at in range(start + gap, place[v]):
                key, k = keys[at], at
                while k >= start + gap and keys[k - gap] > key:
                    keys[k] = keys[k - gap]
                    k -= gap
                keys[k] = key
            gap //= 3
        start = place[v]
    return keys & ((1 << bits) - 1)


@kernel
def components(n, a, b):
    """Number of connected components of n nodes under links a - b, and the label of each node (n,), in order of first nodes."""
    parent = np.arange(n)
    for i in range(len(a)):
        x, y = root(parent, np.int64(a[i])), root(parent, np.int64(b[i]))
        parent[max(x, y)] = min(x, y)
    return labelled(parent)


@kernel
def corners_joined(f, one, two, same):
    """As `components`, of the 3 f corners of faces that meet across pairs of half-edges: those at the same ends are linked.

    Half-edge h runs from corner h to the next corner of its face; `same` (p,): both of a pair start at the same vertex.
    """
    parent = np.arange(3 * f)
    for i in range(len(one)):
        a, b = np.int64(one[i]), np.int64(two[i])
        after_a, after_b = a - 2 if a % 3 == 2 else a + 1, b - 2 if b % 3 == 2 else b + 1
        start, stop = (b, after_b) if same[i] else (after_b, b)
        x, y = root(parent, a), root(parent, start)
        parent[max(x, y)] = min(x, y)
        x, y = root(parent, after_a), root(parent, stop)
        parent[max(x, y)] = min(x, y)
    return labelled(parent)


@kernel
def labelled(parent):
    """Number of roots, and of each node the number of its root; no parent is higher than its child."""
    label = np.empty(len(parent), np.int32)
    count = 0
    for x in range(len(parent)):
        if parent[x] == x:
            label[x] = count
            count += 1
        else:
            label[x] = label[parent[x]]
    return count, label
