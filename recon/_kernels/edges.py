"""Half-edges by undirected edge, and connected components, in linear time."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .union import root


@kernel
def number_vertices(faces, highest):
    """Faces (f, 3) with their vertices numbered from 0 in the order in which they are met, so that what is near stays near; how many?"""
    number, count = np.full(highest + 1, -1, np.int64), 0
    numbered = np.empty(faces.shape, np.int64)
    for i in range(len(faces)):
        for j in range(3):
            v = faces[i, j]
            if number[v] < 0:
                number[v] = count
                count += 1
            numbered[i, j] = number[v]
    return numbered, count


@kernel
def by_edge(faces, n):
    """Half-edges (3 f,) by lower vertex, then upper one, then number; and of each edge the first of them, and its two vertices.

    Half-edge 3 i + j runs from corner j of face i to the next.
    """
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
    start, count = 0, 0
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
        before = np.int64(-1)
        for at in range(start, place[v]):
            count += keys[at] >> bits != before
            before = keys[at] >> bits
        start = place[v]
    first, low, high = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    start, count = 0, 0
    for v in range(n):
        before = np.int64(-1)
        for at in range(start, place[v]):
            upper = keys[at] >> bits
            if upper != before:
                first[count], low[count], high[count] = at, v, upper
                count += 1
            before = upper
            keys[at] &= (1 << bits) - 1
        start = place[v]
    return keys, first, low, high


@kernel
def repeated(faces, order, first, high):
    """How many faces lie on the vertices of an earlier one? They have the edge of their two lower vertices in common."""
    count = 0
    tops = np.empty(0, np.int64)
    for e in range(len(first)):
        start, stop = first[e], first[e + 1] if e + 1 < len(first) else len(order)
        if stop - start < 2:
            continue
        if stop - start > len(tops):
            tops = np.empty(2 * (stop - start), np.int64)
        found = 0
        for at in range(start, stop):
            face, corner = order[at] // 3, order[at] % 3
            tops[found] = faces[face, corner - 1 if corner > 0 else 2]
            found += tops[found] > high[e]
        if found > 1:
            tops[:found].sort()
            for i in range(1, found):
                count += tops[i] == tops[i - 1]
    return count


@kernel
def umbrellas_at(parent, faces, n):
    """How many umbrellas of faces are at each vertex (n,)? `parent`: a forest of the corners of each."""
    count = np.zeros(n, np.int64)
    for i in range(len(faces)):
        for j in range(3):
            count[faces[i, j]] += parent[3 * i + j] == 3 * i + j
    return count


@kernel
def components(n, a, b):
    """Number of connected components of n nodes under links a - b, and the label of each node (n,), in order of first nodes."""
    parent = np.arange(n)
    for i in range(len(a)):
        x, y = root(parent, np.int64(a[i])), root(parent, np.int64(b[i]))
        parent[max(x, y)] = min(x, y)
    return labelled(parent)


@kernel
def corners_joined(parent, one, two, same):
    """Unite the corners of faces that meet across pairs of half-edges: those at the same ends. `parent` (3 f,): 0, 1, 2 ... at first.

    Half-edge h runs from corner h to the next corner of its face; `same` (p,): both of a pair start at the same vertex.
    """
    for i in range(len(one)):
        a, b = np.int64(one[i]), np.int64(two[i])
        after_a, after_b = a - 2 if a % 3 == 2 else a + 1, b - 2 if b % 3 == 2 else b + 1
        start, stop = (b, after_b) if same[i] else (after_b, b)
        x, y = root(parent, a), root(parent, start)
        parent[max(x, y)] = min(x, y)
        x, y = root(parent, after_a), root(parent, stop)
        parent[max(x, y)] = min(x, y)


@kernel
def roots(parent, corners):
    """Root of each of some corners."""
    found = np.empty(len(corners), np.int64)
    for i in range(len(corners)):
        found[i] = root(parent, np.int64(corners[i]))
    return found


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
