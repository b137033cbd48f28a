"""Of two outcomes of the search the better part, place by place (partition crossover: Whitley, Hains and Howe 2009).

Where two outcomes differ falls into places that share no sample, so each changes the energy by itself; but for the number of components.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .components import number_components
from .energy import flip, flip_back, topology
from .repair import BODY, ISLAND
from .umbrellas import rooms
from .union import root


@kernel
def places(nodes, n, sides, others):
    """Nodes whose sides differ, place by place; and where in that each place begins, and the last one ends."""
    parent = np.arange(n)
    apart = np.flatnonzero(sides != others)
    for x in apart:
        a = root(parent, np.int64(nodes[x].min()))
        for v in nodes[x]:
            if v < n:
                b = root(parent, np.int64(v))
                parent[max(a, b)] = a = min(a, b)
    place = np.empty(len(apart), np.int64)
    for i, x in enumerate(apart):
        place[i] = root(parent, np.int64(nodes[x].min()))
    order = np.argsort(place, kind="mergesort")
    place = place[order]
    first = np.flatnonzero(place[1:] != place[:-1]) + 1
    return apart[order], np.concatenate((np.zeros(1, np.int64), first, np.full(1, len(apart))))


@kernel
def take_better(ground, widest, sides, others, excess):
    """Take from `others`, in place, each place that lowers the energy."""
    _, _, nodes, links, _, starts, _ = ground
    n, N = len(starts) - 1, len(nodes)
    scratch = rooms(starts)
    component, size, body = np.empty(N, np.int32), np.empty(N + 1, np.int64), min(ISLAND, BODY * N)
    pieces = bodies = count = large = 0
    if widest == np.inf:
        pieces = number_components(links, sides, component, size)
        bodies = (size[:pieces] >= body).sum()
    apart, first = places(nodes, n, sides, others)
    for i in range(len(first) - 1):
        place = apart[first[i] : first[i + 1]]
        before = np.empty((len(place), 4), np.int32)
        energy, chi = 0.0, 0
        for j, x in enumerate(place):
            change, turned = flip(ground, scratch, widest, sides, x, excess, before[j])
            energy += change
            chi += turned
        if widest == np.inf:
            count = number_components(links, sides, component, size)
            large = (size[:count] >= body).sum()
        # two bodies that become one are nothing gained
        if energy + topology(count - pieces + max(bodies - large, 0), chi, widest) < -1e-9:
            pieces, bodies = count, large
        else:
            for j in range(len(place) - 1, -1, -1):
                flip_back(nodes, sides, place[j], excess, before[j])
