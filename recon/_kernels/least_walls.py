"""Sides of some nodes between which the walls are least: a minimum cut (Greig, Porteous and Seheult 1989), exact.

By blocking flows (Dinic 1970), from side 1 to side 0. Most of what flows takes two steps.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .energy import wall

UNSEEN = -1  # of nodes that no flow comes to


@kernel
def least_walls(ground, sides, number, near, ties):
    """Those of the nodes `near` to flip so that walls and broken ties have the least energy, all other nodes as they are.

    number (N,): places of nodes in `near`, -1 of all others; ties (len(near),): energy of flipping each of them.
    """
    points, spacing, nodes, links = ground[:4]
    K = len(near)
    room, back = np.zeros((K, 4)), np.zeros((K, 4), np.int8)  # for more flow out by each facet; its number from beyond
    beyond = np.full((K, 4), -1, np.int32)  # the node there, as a place in `near`
    supply, demand = np.zeros(K), np.zeros(K)  # flow that may still come from side 1 itself, and go to side 0
    for i in range(K):
        x = near[i]
        if sides[x] == 1:
            supply[i] = ties[i]
        else:
            demand[i] = ties[i]
        for k in range(4):
            y = links[x, k]
            room[i, k] = wall(points, spacing, nodes[x, (k + 1) & 3], nodes[x, (k + 2) & 3], nodes[x, (k + 3) & 3])
            if number[y] >= 0:
                beyond[i, k] = number[y]
                while links[y, back[i, k]] != x:
                    back[i, k] += 1
            elif sides[y] == 1:
                supply[i] += room[i, k]
            else:
                demand[i] += room[i, k]
        through = min(supply[i], demand[i])
        supply[i] -= through
        demand[i] -= through
    level, queue, at = np.empty(K, np.int32), np.empty(K, np.int32), np.empty(K, np.int8)
    while steps(beyond, room, supply, demand, level, queue):
        at[:] = 0
        for i in range(K):
            if level[i] == 0:
                drain(i, beyond, back, room, supply, demand, level, queue, at)
    return [near[i] for i in range(K) if (level[i] != UNSEEN) != (sides[near[i]] == 1)]


@kernel
def steps(beyond, room, supply, demand, level, queue):
    """Fill in how many steps flow takes to each node, -1 where it does not come to; does it come to side 0?"""
    tail, arrives = 0, False
    for i in range(len(level)):
        level[i] = UNSEEN
        if supply[i] > 0:
            level[i], queue[tail] = 0, i
            tail += 1
    head = 0
    while head < tail:
        i = queue[head]
        head += 1
        arrives |= demand[i] > 0
        for k in range(4):
            j = beyond[i, k]
            if j >= 0 and level[j] == UNSEEN and room[i, k] > 0:
                level[j], queue[tail] = level[i] + 1, j
                tail += 1
    return arrives


@kernel
def drain(source, beyond, back, room, supply, demand, level, path, at):
    """All that can flow from this node, each step to the next level; `at` (K,): the facets by which flow was not tried in vain."""
    length = 1
    path[0] = source
    while length > 0 and supply[source] > 0:
        i = path[length - 1]
        if demand[i] > 0:
            flow = min(supply[source], demand[i])
            for j in path[: length - 1]:
                flow = min(flow, room[j, at[j]])
            supply[source] -= flow
            demand[i] -= flow
            for t in range(length - 2, -1, -1):
                j = path[t]
                k = at[j]
                room[j, k] -= flow
                room[beyond[j, k], back[j, k]] += flow
                if room[j, k] <= 0:
                    length = t + 1
            continue
        while at[i] < 4:
            j = beyond[i, at[i]]
            if j >= 0 and level[j] == level[i] + 1 and room[i, at[i]] > 0:
                break
            at[i] += 1
        if at[i] < 4:
            path[length] = beyond[i, at[i]]
            length += 1
        else:
            length -= 1
            if length > 0:
                at[path[length - 1]] += 1


@kernel
def cells_near(ground, samples, rings, number):
    """The cells around samples, those around their corners, and so on; and all corners. number (N,), -1, gets the place of each cell."""
    nodes, _, gate, starts, star = ground[2:]
    near = [np.int64(0) for _ in range(0)]
    for _ in range(rings):
        for v in samples:
            for i in range(starts[v], starts[v + 1]):
                if star[i] < len(gate) and number[star[i]] < 0:
                    number[star[i]] = len(near)
                    near.append(np.int64(star[i]))
        samples = np.unique(nodes[np.array(near)].ravel()).astype(np.int64)
    return near, samples


@kernel
def tied(sides, one, other, number, near, tie):
    """Energy of flipping each of the nodes `near`, where each pair of nodes (one[i], other[i]) on different sides is tied; -1 is none."""
    ties = np.zeros(len(near))
    for i in range(len(one)):
        if one[i] >= 0 and other[i] >= 0 and sides[one[i]] != sides[other[i]]:
            for x in (one[i], other[i]):
                if number[x] >= 0:
                    ties[number[x]] += tie
    return ties
