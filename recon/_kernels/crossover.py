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
def atoms(links, sides, apart, first):
    """What the components of nodes are made of, whatever is taken of each place: nodes of one side within one place, or outside all.

    Returns for each atom its place, -1 outside, its side, and its number of nodes; and the pairs of atoms (e, 2) that touch and
    may be of one side.
    """
    N = len(sides)
    label, place = np.empty(N, np.int32), np.full(N, -1, np.int32)
    for i in range(len(first) - 1):
        place[apart[first[i] : first[i + 1]]] = i
    for x in range(N):
        label[x] = 2 * place[x] + sides[x]
    atom, size = np.empty(N, np.int32), np.empty(N + 1, np.int64)
    count = number_components(links, label, atom, size)
    where, side = np.full(count, -1, np.int32), np.empty(count, np.int8)
    for x in range(N):
        where[atom[x]], side[atom[x]] = place[x], sides[x]
    touching = [np.int64(0) for _ in range(0)]
    for x in apart:
        for y in links[x]:
            if place[y] != place[x]:
                touching.append(np.int64(atom[x]) * count + atom[y])
    pairs = np.unique(np.array(touching))
    return where, side, size[:count], np.stack((pairs // count, pairs % count), axis=1)


@kernel
def count_pieces(side, size, pairs, body):
    """Components of these atoms, by their sides (a,), sizes (a,) and pairs (e, 2), and how many have `body` nodes or more."""
    parent, nodes = np.arange(len(side)), size.copy()
    pieces = len(side)
    for a, b in pairs:
        if side[a] == side[b]:
            a, b = root(parent, a), root(parent, b)
            if a != b:
                parent[b] = a
                nodes[a] += nodes[b]
                nodes[b] = 0
                pieces -= 1
    return pieces, (nodes >= body).sum()


@kernel
def count_loose(side, size, members, pairs, body):
    """Components that are members of one place alone, by its pairs; -1 where more than one body of a side, or less, is around it."""
    around = np.full(2, -1)
    for _, b in pairs:
        if size[b] < body or (around[side[b]] >= 0 and around[side[b]] != b):
            return -1
        around[side[b]] = b
    loose = len(members)
    for a in members:
        if size[a] >= body:
            return -1
        for c, b in pairs:
            if c == a and side[b] == side[a]:
                loose -= 1
                break
    return loose


@kernel
def take_better(ground, widest, sides, others, excess):
    """Take from `others`, in place, each place that lowers the energy."""
    _, _, nodes, links, _, starts, _ = ground
    scratch, body = rooms(starts), min(ISLAND, BODY * len(nodes))
    apart, first = places(nodes, len(starts) - 1, sides, others)
    if len(apart) == 0:
        return
    where, side, size, pairs = atoms(links, sides, apart, first)
    pieces, bodies = count_pieces(side, size, pairs, body)
    members = np.argsort(where, kind="mergesort")
    pairs = pairs[np.argsort(where[pairs[:, 0]], kind="mergesort")]
    numbers = np.arange(len(first))
    member, pair = np.searchsorted(where[members], numbers), np.searchsorted(where[pairs[:, 0]], numbers)
    for i in range(len(first) - 1):
        place = apart[first[i] : first[i + 1]]
        within, touching = members[member[i] : member[i + 1]], pairs[pair[i] : pair[i + 1]]
        before = np.empty((len(place), 4), np.int32)
        energy, chi = 0.0, 0
        for j, x in enumerate(place):
            change, turned = flip(ground, scratch, widest, sides, x, excess, before[j])
            energy += change
            chi += turned
        count, large = pieces, bodies
        if widest == np.inf:
            loose = count_loose(side, size, within, touching, body)
            side[within] ^= 1
            if loose >= 0:
                count += count_loose(side, size, within, touching, body) - loose
            else:
                count, large = count_pieces(side, size, pairs, body)
        # two bodies that become one are nothing gained
        if energy + topology(count - pieces + max(bodies - large, 0), chi, widest) < -1e-9:
            pieces, bodies = count, large
        else:
            side[within] ^= 1
            for j in range(len(place) - 1, -1, -1):
                flip_back(nodes, sides, place[j], excess, before[j])
