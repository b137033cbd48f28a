"""Connected components of nodes of one side, kept while nodes are flipped."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .union import root


@kernel
def flood(links, component, x, old, new, queue):
    """Give the component `old` around x the number `new`; returns how many nodes."""
    queue[0] = x
    component[x] = new
    head, tail = 0, 1
    while head < tail:
        x = queue[head]
        head += 1
        for k in range(4):
            y = links[x, k]
            if component[y] == old:
                component[y] = new
                queue[tail] = y
                tail += 1
    return tail


@kernel
def number_components(links, sides, component, size):
    """Number the components of nodes of one side from 0, (N,), and count their nodes, (N + 1,); returns how many."""
    N, parent = len(links), component
    for x in range(N):
        parent[x] = x
        for k in range(4):
            y = links[x, k]
            if y < x and sides[y] == sides[x]:
                a, b = root(parent, np.int64(x)), root(parent, np.int64(y))
                parent[max(a, b)] = min(a, b)
    count = 0
    for x in range(N):
        if parent[x] == x:
            component[x], size[count] = count, 1
            count += 1
        else:  # no parent is higher than its child: it has its number
            component[x] = component[parent[x]]
            size[component[x]] += 1
    return count


@kernel
def count_components(links, sides):
    """How many components of nodes of one side there are."""
    N = len(links)
    return number_components(links, sides, np.empty(N, np.int32), np.empty(N + 1, np.int64))


@kernel
def cut_off(links, component, ours, chain, length, queue, after, label, seen, stamp):
    """Pieces that a component falls into when the chain leaves it, less one; -1 when nothing is left.

    Searches from all its nodes next to the chain at once, in turn, so that the cost is that of the smaller pieces.
    The pieces cut off are the nodes of queue[:tail] whose final label is negative. Returns (pieces, tail, classes).
    """
    tail = 0
    for i in range(length):
        seen[chain[i]] = stamp
        label[chain[i]] = -1
    for i in range(length):
        for k in range(4):
            y = links[chain[i], k]
            if component[y] == ours and seen[y] != stamp:
                seen[y] = stamp
                queue[tail] = y
                label[y] = tail
                tail += 1
    fronts = tail
    root = np.arange(fronts)
    head = np.arange(fronts)  # next node to expand, by class, as a linked list through `after`
    last = np.arange(fronts)
    for i in range(fronts):
        after[i] = -1
    alive = fronts
    done = np.zeros(fronts, np.bool_)
    pieces = -1 if fronts == 0 else 0
    while alive > 1:
        for f in range(fronts):
            if root[f] != f or done[f] or alive <= 1:
                continue
            i = head[f]
            if i < 0:
                done[f] = True
                alive -= 1
                pieces += 1
                continue
            x = queue[i]
            mine = f
            for k in range(4):
                y = links[x, k]
                if component[y] != ours:
                    continue
                if seen[y] != stamp:
                    seen[y] = stamp
                    queue[tail] = y
                    label[y] = mine
                    after[tail] = -1
                    after[last[mine]] = tail
                    last[mine] = tail
                    tail += 1
                elif label[y] >= 0:
                    g = label[y]
                    while root[g] != g:
                        root[g] = root[root[g]]
                        g = root[g]
                    if g != mine:
                        # two fronts meet: one list
                        if head[mine] >= 0 and head[g] >= 0:
                            after[last[mine]] = head[g]
                            last[mine] = last[g]
                        elif head[g] >= 0:
                            head[mine] = head[g]
                            last[mine] = last[g]
                        root[g] = mine
                        alive -= 1
            head[f] = after[i]
    for i in range(tail):
        g = label[queue[i]]
        while root[g] != g:
            g = root[g]
        label[queue[i]] = -1 if done[g] else g
    return pieces, tail
