"""Sides of some nodes between which the walls are least: a minimum cut (Greig, Porteous and Seheult 1989), exact.

By shortest augmenting paths (Edmonds and Karp 1972): nodes are few, and most of what flows takes two steps.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .energy import wall

SOURCE, UNSEEN = 4, -1  # of nodes that flow comes to straight from side 1, and of nodes that it does not come to


@kernel
def least_walls(ground, sides, number, near, held):
    """Those of the nodes `near` to flip so that the facets between the sides have the least energy, all other nodes as they are.

    number (N,): places of nodes in `near`, -1 of all others; held (len(near),): nodes that stay as they are.
    """
    points, spacing, nodes, links = ground[:4]
    K = len(near)
    room, back = np.zeros((K, 4)), np.zeros((K, 4), np.int64)  # for more flow out by each facet; its number from beyond
    supply, demand = np.zeros(K), np.zeros(K)  # flow that may still come from side 1 itself, and go to side 0
    for i in range(K):
        x = near[i]
        if held[i]:
            supply[i], demand[i] = (np.inf, 0.0) if sides[x] == 1 else (0.0, np.inf)
        for k in range(4):
            y = links[x, k]
            room[i, k] = wall(points, spacing, nodes[x, (k + 1) & 3], nodes[x, (k + 2) & 3], nodes[x, (k + 3) & 3])
            if number[y] >= 0:
                while links[y, back[i, k]] != x:
                    back[i, k] += 1
            elif sides[y] == 1:
                supply[i] += room[i, k]
            else:
                demand[i] += room[i, k]
    queue, via = np.empty(K, np.int64), np.empty(K, np.int64)
    while True:
        last = shortest_path(links, number, near, room, back, supply, demand, queue, via)
        if last < 0:
            return [near[i] for i in range(K) if (via[i] != UNSEEN) != (sides[near[i]] == 1)]
        flow, i = demand[last], last
        while via[i] != SOURCE:
            j = number[links[near[i], via[i]]]
            flow, i = min(flow, room[j, back[i, via[i]]]), j
        flow, i = min(flow, supply[i]), last
        demand[last] -= flow
        while via[i] != SOURCE:
            j = number[links[near[i], via[i]]]
            room[j, back[i, via[i]]] -= flow
            room[i, via[i]] += flow
            i = j
        supply[i] -= flow


@kernel
def shortest_path(links, number, near, room, back, supply, demand, queue, via):
    """The last node of a shortest path with room from side 1 to side 0, -1 if there is none; via: facets by which nodes were reached."""
    head, tail = 0, 0
    for i in range(len(near)):
        via[i] = UNSEEN
        if supply[i] > 0:
            via[i], queue[tail] = SOURCE, i
            tail += 1
    while head < tail:
        i = queue[head]
        head += 1
        if demand[i] > 0:
            return i
        for k in range(4):
            j = number[links[near[i], k]]
            if j >= 0 and via[j] == UNSEEN and room[i, k] > 0:
                via[j], queue[tail] = back[i, k], j
                tail += 1
    return -1
