"""Local search on the sides of nodes until every sample has exactly one umbrella of surface facets.

A move flips a growing set of nodes of one side, in a stated order, and keeps the prefix of lowest energy (`energy`). Bodies may
be parted and islands joined to them, but two bodies that become one gain nothing by that: a neck is not worth it.
"""

from __future__ import annotations

import heapq

import numpy as np

from .chance import word
from .compile import kernel
from .components import cut_off, flood, number_components
from .energy import TOPOLOGY, edge_facets, flip, flip_back, topology
from .umbrellas import rooms

REACH_BURIED = 300  # nodes a move may flip to reach a buried sample or an island,
REACH_PINCH = 30  # to mend a pinched one,
REACH_HANDLE = 15  # to cut a handle
CROWDED = 500  # nodes around a sample above which they are not tried one by one, and moves are shorter: that takes their square
HOPELESS = 4.0  # energy above the best at which a move is given up,
HOPELESS_BURIED = 100.0  # and one that reaches for a buried sample or an island
ISLAND = 2000  # nodes; larger components are bodies, and so are those with
BODY = 0.05  # this share of all nodes
WIDEST, STEEPEST, NARROWEST = -1.0, 0.0, 1.0  # order in which a move takes nodes: by gate, or by the change of energy


@kernel
def beside_surface(links, gate, sides, x):
    """Whether the surface passes by node x, and no gate to a node of its side is wide."""
    beside = False
    for k in range(4):
        if sides[links[x, k]] != sides[x]:
            beside = True
        elif gate[x, k] > 2:
            return False
    return beside


@kernel
def bridges(nodes, links, gate, sides, x):
    """Whether flipping node x would join two places of the surface that no edge of its joins: where a handle may be thin."""
    count, one = 0, 0
    for k in range(4):
        if sides[links[x, k]] != sides[x]:
            count += 1
            one += k
    if count == 1:
        joined = 0
        for i in range(4):
            for j in range(i + 1, 4):
                if i == one or j == one:
                    joined += edge_facets(nodes, links, gate, sides, np.inf, x, i, j)[0] > 0
        return joined == 0
    if count == 2:
        i = 0
        while sides[links[x, i]] == sides[x]:
            i += 1
        return edge_facets(nodes, links, gate, sides, np.inf, x, i, one - i)[0] > 0
    return False


@kernel
def move(ground, scratch, widest, sides, work, seed, reach, hopeless, order):
    """Grow from a seed and keep the prefix of lowest energy, if below the present; returns the energy gained (<= 0).

    ground: points, spacing, nodes, links, gate, and the stars of samples (`star_lists`), which stay as they are. work: what the
    search keeps (`repair`); its state = [last stamp, next component number, clock of accepted moves].
    """
    _, _, nodes, links, gate, starts, _ = ground
    state, excess, stirred, component, size, chain, before, mark, queue, after, label, seen = work
    n, m = len(starts) - 1, len(gate)
    stamp = state[0] + 1
    first = stamp
    side, ours = sides[seed], component[seed]
    heap = [(0.0, np.int64(seed))]
    mark[seed] = first
    touched, bodies, body = [np.int32(-1)], 0, min(ISLAND, BODY * len(nodes))
    energy, chi, length = 0.0, 0, 0
    best, best_length, best_energy, best_chi, best_touched, best_bodies = -1e-9, 0, 0.0, 0, 0, 0
    low, low_length = 0.0, 0
    while len(heap) > 0 and length < reach:
        x = heapq.heappop(heap)[1]
        if mark[x] == -first:
            continue
        for k in range(4):
            y = links[x, k]
            if mark[y] != -first and sides[y] != side and component[y] not in touched:
                touched.append(component[y])
                bodies += size[component[y]] >= body
        change, turned = flip(ground, scratch, widest, sides, x, excess, before[length])
        energy += change
        chi += turned
        mark[x] = -first
        chain[length] = x
        length += 1
        # one more component where it touches none, one less for each further one it joins or when it used up its own;
        # but two bodies that become one are nothing gained
        pieces = 2 - len(touched) - (length == size[ours]) + max(bodies - 1, 0)
        total = energy + topology(pieces, chi, widest)
        if total < best:
            best, best_length, best_energy, best_chi = total, length, energy, chi
            best_touched, best_bodies = len(touched), bodies
        if total < low or length == 1:
            low, low_length = total, length
        if total > best + hopeless or (order == STEEPEST and length > low_length + 1):
            break
        for k in range(4):
            y = links[x, k]
            if y < m and mark[y] != -first and sides[y] == side:
                if order == STEEPEST:
                    change, turned = flip(ground, scratch, widest, sides, np.int64(y), excess, before[length])
                    flip_back(nodes, sides, y, excess, before[length])
                    heapq.heappush(heap, (change - TOPOLOGY * turned / 2, np.int64(y)))
                elif mark[y] != first:
                    mark[y] = first
                    heapq.heappush(heap, (order * np.float64(gate[x, k]), np.int64(y)))
    for i in range(length - 1, best_length - 1, -1):
        flip_back(nodes, sides, chain[i], excess, before[i])
    best = 0.0
    if best_length > 0:
        stamp += 1
        cut, tail = cut_off(links, component, ours, chain, best_length, queue, after, label, seen, stamp)
        pieces = 2 - best_touched + cut + max(best_bodies - 1, 0)
        best = best_energy + topology(pieces, best_chi, widest)
        if best > -1e-9:
            best = 0.0
            for i in range(best_length - 1, -1, -1):
                flip_back(nodes, sides, chain[i], excess, before[i])
        else:
            state[2] += 1
            size[ours] -= best_length
            if cut > 0:
                for i in range(tail):
                    if label[queue[i]] < 0:
                        component[queue[i]] = -9
                cut_nodes = queue[:tail].copy()
                for x in cut_nodes:
                    if component[x] == -9:
                        new = np.int32(state[1])
                        size[new] = flood(links, component, x, np.int32(-9), new, queue)
                        size[ours] -= size[new]
                        state[1] += 1
            target = np.int32(state[1])
            if best_touched > 1:
                target = touched[1]
                for i in range(2, best_touched):
                    if size[touched[i]] > size[target]:
                        target = touched[i]
            else:
                size[target] = 0
                state[1] += 1
            size[target] += best_length
            for i in range(best_length):
                component[chain[i]] = target
            for i in range(best_length):
                for k in range(4):
                    y = links[chain[i], k]
                    if sides[y] != side and component[y] != target:
                        size[target] += flood(links, component, y, component[y], target, queue)
                    v = nodes[chain[i], k]
                    if v < n:
                        stirred[v] = state[2]
    state[0] = stamp
    return best


@kernel
def thin_spots(nodes, links, gate, sides, first, last, thin):
    """Fill in where a range of nodes may be the inside of a thin handle (m,)."""
    for x in range(first, last):
        thin[x] = beside_surface(links, gate, sides, x) and bridges(nodes, links, gate, sides, x)


@kernel
def another(turn, v):
    """A number that looks random, the same in every run; 0 at turn 0."""
    return np.int64(word(v * 64 + turn) >> np.uint64(2)) if turn > 0 else np.int64(0)


@kernel
def search(ground, sides, pole, anti, widest, rounds, turn, thin, blank, excess, component, size, queue, count):
    """Improve `sides` in place, move by move.

    What is tried first is kept, so each `turn` goes another way: 0 along the curve, odd ones back, around each sample and through the
    cells from another one on.

    `ground` is what stays as it is, see `move`; `excess`, `component` and `size` are kept up to date (`umbrellas`, `components`),
    `thin` (m,) is what `thin_spots` says of the sides as they were, `blank` (3, N) int64 all zero: pages never touched cost nothing.
    `widest`: where facets of wider gates are none (an open surface) only pinched and buried samples are mended: there is
    no telling a handle or an island from what walls of such facets cut up.
    """
    _, _, nodes, links, gate, starts, star = ground
    n, m, N = len(starts) - 1, len(gate), len(nodes)
    scratch = rooms(starts)
    sealed = widest == np.inf
    stirred = np.zeros(n, np.int64)  # clock of the last accepted move next to a sample,
    tried = np.full(n, -1, np.int64)  # and of the last attempt to mend it,
    tried_from, mark, seen = blank  # or, plus 1, to cut a handle or reach an island from a node
    state = np.zeros(3, np.int64)
    state[1] = count
    chain, before = np.empty(REACH_BURIED, np.int64), np.empty((REACH_BURIED + 1, 4), np.int32)
    after, label = np.empty(N, np.int32), np.empty(N, np.int32)
    work = state, excess, stirred, component, size, chain, before, mark, queue, after, label, seen
    for _ in range(rounds):
        if state[1] > N // 2:  # numbers of components that are no more
            state[1] = number_components(links, sides, component, size)
        gained = 0.0
        for j in range(n):
            v = n - 1 - j if turn & 1 else j
            if starts[v] == starts[v + 1] or excess[v] == 0 or tried[v] >= stirred[v]:
                continue
            reach = np.int64(REACH_BURIED * min(1.0, (CROWDED / (starts[v + 1] - starts[v])) ** 2))
            for seed in (anti[v], pole[v]):
                if excess[v] < 0 and 0 <= seed < m and state[1] < N - 64:
                    gained += move(
                        ground, scratch, widest, sides, work, np.int64(seed), reach, HOPELESS_BURIED, WIDEST
                    )  # fmt: skip
            if excess[v] != 0 and starts[v + 1] - starts[v] <= CROWDED:
                for i in range(starts[v + 1] - starts[v]):
                    x = star[starts[v] + (i + another(turn, v)) % (starts[v + 1] - starts[v])]
                    if excess[v] != 0 and x < m and state[1] < N - 64:
                        gained += move(
                            ground, scratch, widest, sides, work, np.int64(x), np.int64(REACH_PINCH), HOPELESS, WIDEST
                        )  # fmt: skip
            tried[v] = state[2]
        for j in range(m if sealed else 0):
            x = (m - 1 - j if turn & 1 else j) + another(turn, 0) % m
            x = x - m if x >= m else x
            # a handle is cut through facets no wider than those of the surface
            latest = np.int64(0)
            for k in range(4):
                latest = max(latest, stirred[nodes[x, k]])
            if tried_from[x] > latest or state[1] >= N - 64:
                continue
            if (latest == 0 and thin[x]) or (latest > 0 and beside_surface(links, gate, sides, x)):
                gained += move(
                    ground, scratch, widest, sides, work, np.int64(x), np.int64(REACH_HANDLE), HOPELESS, STEEPEST
                )
                tried_from[x] = state[2] + 1
        # islands: leave each by its widest gate that was not tried before
        way = np.zeros(state[1], np.float32)
        bridge = np.full(state[1], -1, np.int32)
        for x in range(m if sealed else 0):
            c = component[x]
            if size[c] < min(ISLAND, BODY * N):
                for k in range(4):
                    y = links[x, k]
                    if y < m and sides[y] != sides[x] and gate[x, k] > way[c] and tried_from[y] == 0:
                        way[c], bridge[c] = gate[x, k], y
        for c in range(len(bridge)):
            y = bridge[c]
            if y >= 0 and state[1] < N - 64:
                tried_from[y] = state[2] + 1
                gained += move(
                    ground, scratch, widest, sides, work, np.int64(y), np.int64(REACH_BURIED), HOPELESS_BURIED, NARROWEST
                )  # fmt: skip
        if gained > -1e-9:
            break


@kernel
def absorb(nodes, links, gate, m, sides, component, size, count):
    """Flip the islands that are no voids: no gate inside is wider than the widest one of the wall around. How many nodes?"""
    N = len(nodes)
    inner = np.zeros(count, np.float32)
    outer = np.zeros(count, np.float32)
    for x in range(m):
        c = component[x]
        for k in range(4):
            if component[links[x, k]] == c:
                inner[c] = max(inner[c], gate[x, k])
            else:
                outer[c] = max(outer[c], gate[x, k])
    flipped = 0
    for x in range(m):
        c = component[x]
        if size[c] < min(ISLAND, BODY * N) and inner[c] <= outer[c]:
            sides[x] ^= 1
            flipped += 1
    return flipped
