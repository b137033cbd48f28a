"""Union-find over links in the order in which they appear: components of K_alpha, and voids of its complement.

Elder rule: where two components meet, the younger one ends. For the holes in between: faces of simplices, found by
bisection, and the reduction of boundary matrices over GF(2).
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .union import root

_BUCKETS = 1 << 16


@kernel
def stable_order(keys, order, spare_keys, spare):
    """Fill in the order (s,) int32 that sorts uint64 keys, equal ones by position; keys and spares are lost."""
    n = len(keys)
    for i in range(n):
        order[i] = i
    count = np.empty(_BUCKETS + 1, np.int64)
    for digit in range(4):
        shift = np.uint64(16 * digit)
        count[:] = 0
        for i in range(n):
            count[((keys[i] >> shift) & np.uint64(_BUCKETS - 1)) + np.uint64(1)] += 1
        for b in range(_BUCKETS):
            count[b + 1] += count[b]
        for i in range(n):
            b = (keys[i] >> shift) & np.uint64(_BUCKETS - 1)
            spare_keys[count[b]], spare[count[b]] = keys[i], order[i]
            count[b] += 1
        keys, spare_keys, order, spare = spare_keys, keys, spare, order


@kernel
def merge_tree(order, first, second, age, link, into):
    """Unite nodes along links; fill in, by node, the link that ended it (-1: none did) and the elder node it went into.

    `order` lists links, each between nodes first and second; of two components the one whose eldest node has the least
    `age`, or the least index, stays. Every node stands for the component that it is the eldest of.
    """
    n = len(age)
    parent, eldest = np.empty(n, np.int32), np.empty(n, np.int32)
    weight = np.empty(n, np.int32)
    for i in range(n):
        parent[i], eldest[i], weight[i], link[i], into[i] = i, i, 1, -1, -1
    for t in range(len(order)):
        f = order[t]
        a, b = root(parent, np.int64(first[f])), root(parent, np.int64(second[f]))
        if a == b:
            continue
        old, young = eldest[a], eldest[b]
        if age[young] < age[old] or (age[young] == age[old] and young < old):
            old, young = young, old
        link[young], into[young] = f, old
        if weight[a] < weight[b]:
            a, b = b, a
        parent[b], eldest[a] = a, old
        weight[a] += weight[b]


@kernel
def find_faces(rows, below, starts, faces):
    """Fill in faces (s, k+1): the row in `below`, lexicographic and complete, of the face opposite each vertex."""
    width = rows.shape[1]
    for i in range(len(rows)):
        for j in range(width):
            first = rows[i, 0 if j > 0 else 1]
            low, high = starts[first], starts[first + 1]
            while low < high:
                middle = (low + high) >> 1
                less = False
                for c in range(1, width - 1):
                    wanted = rows[i, c if c < j else c + 1]
                    if below[middle, c] != wanted:
                        less = below[middle, c] < wanted
                        break
                if less:
                    low = middle + 1
                else:
                    high = middle
            faces[i, j] = low


@kernel
def reduce_columns(columns, boundary, owner, pool, where, size, begin, used):
    """Reduce columns of a boundary matrix over GF(2), left to right: (position, room used), early where it ran out.

    `boundary[c]` are the rows of column c, in any order; columns[begin:] are taken in turn. `owner` (rows,) tells which
    column has a pivot, -1 for none. A column c that was changed is kept, descending, in pool[where[c]:][:size[c]].
    """
    width = boundary.shape[1]
    room = len(pool)
    for t in range(begin, len(columns)):
        c = columns[t]
        if room - used < 2 * width:
            return t, used
        start, length = used, width  # the working column, descending; its successor goes behind it
        for j in range(width):
            row, k = boundary[c, j], start + j
            while k > start and pool[k - 1] < row:
                pool[k] = pool[k - 1]
                k -= 1
            pool[k] = row
        changed = False
        while length > 0 and owner[pool[start]] >= 0:
            other = owner[pool[start]]
            if size[other] == 0:  # never changed: sort it in, behind the working column
                source, source_length = start + length, width
                if room - source < width:
                    return t, used
                for j in range(width):
                    row, k = boundary[other, j], source + j
                    while k > source and pool[k - 1] < row:
                        pool[k] = pool[k - 1]
                        k -= 1
                    pool[k] = row
                target = source + width
            else:
                source, source_length, target = where[other], size[other], start + length
            if room - target < length + source_length:
                return t, used
            a, b, k = start, source, target
            while a < start + length or b < source + source_length:
                if b == source + source_length or (a < start + length and pool[a] > pool[b]):
                    pool[k] = pool[a]
                    a, k = a + 1, k + 1
                elif a == start + length or pool[b] > pool[a]:
                    pool[k] = pool[b]
                    b, k = b + 1, k + 1
                else:
                    a, b = a + 1, b + 1
            length = k - target
            for j in range(length):
                pool[start + j] = pool[target + j]
            changed = True
        if length > 0:
            owner[pool[start]] = c
            if changed:
                where[c], size[c] = start, length
                used = start + length
    return len(columns), used
