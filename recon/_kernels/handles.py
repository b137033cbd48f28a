"""Short loops around handles, by homology; and the search that cuts a handle."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .repair import TOPOLOGY, WALL, flip

STEPS = 120  # flips from a plug on, at most,
HOPELESS = 12.0  # and energy above the best at which it is given up
PLUG = 2  # corners on the loop of the nodes that are flipped first


@kernel
def word(x):
    """64 bits that look random, of a number from 0 on (splitmix64)."""
    z = np.uint64(x + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def class_words(n, ends, face_edges, beside):
    """A word of each edge: those of a loop, joined by exclusive or, give 0 where it is the boundary of a part of the surface.

    ends (e, 2): vertices of edges; face_edges (f, 3); beside (e, 2): faces at an edge, -1 unless it has two. Returns the
    words and (starts, around): the edges of vertex v are around[starts[v] : starts[v + 1]], ascending.
    """
    e, f = len(ends), len(face_edges)
    starts, around = np.zeros(n + 2, np.int64), np.empty(2 * e, np.int64)
    for edge in range(e):
        starts[ends[edge, 0] + 2] += 1
        starts[ends[edge, 1] + 2] += 1
    for v in range(n):
        starts[v + 2] += starts[v + 1]
    for edge in range(e):
        for v in ends[edge]:
            around[starts[v + 1]] = edge
            starts[v + 1] += 1
    starts = starts[:-1]
    tree, reached, queue = np.zeros(e, np.bool_), np.zeros(n, np.bool_), np.empty(n, np.int64)
    for v in range(n):
        if reached[v]:
            continue
        reached[v] = True
        queue[0], head, tail = v, 0, 1
        while head < tail:
            u = queue[head]
            head += 1
            for i in range(starts[u], starts[u + 1]):
                w = ends[around[i], 0] + ends[around[i], 1] - u
                if not reached[w]:
                    reached[w] = tree[around[i]] = True
                    queue[tail] = w
                    tail += 1
    parent, way, order, tail = np.full(f, -1), np.full(f, -1), np.empty(f, np.int64), 0
    for first in range(f):
        if parent[first] >= 0:
            continue
        parent[first], head, order[tail] = first, tail, first
        tail += 1
        while head < tail:
            x = order[head]
            head += 1
            for edge in face_edges[x]:
                y = beside[edge, 0] + beside[edge, 1] - x
                if not tree[edge] and beside[edge, 1] >= 0 and parent[y] < 0:
                    parent[y], way[y], order[tail] = x, edge, y
                    tail += 1
    words, passing = np.zeros(e, np.uint64), np.zeros(f, np.uint64)
    for edge in range(e):
        x, y = beside[edge]
        if not tree[edge] and y >= 0 and way[x] != edge and way[y] != edge:
            words[edge] = word(edge)
            passing[x] ^= words[edge]
            passing[y] ^= words[edge]
    for i in range(f - 1, -1, -1):
        x = order[i]
        if way[x] >= 0:
            words[way[x]] ^= passing[x]
            passing[parent[x]] ^= passing[x]
    return words, (starts, around)


@kernel
def loops_from(ends, starts, around, words, longest):
    """The shortest loop of a word other than 0 through each vertex on a cocycle: lengths, words, vertices (-1 beyond)."""
    n = len(starts) - 1
    root = np.zeros(n, np.bool_)
    for edge in range(len(ends)):
        if words[edge] != 0:
            root[ends[edge, 0]] = root[ends[edge, 1]] = True
    room = root.sum()
    lengths, classes, vertices = np.empty(room, np.int64), np.empty(room, np.uint64), np.full((room, longest), -1)
    far, sum_, via, queue = np.full(n, -1, np.int32), np.zeros(n, np.uint64), np.full(n, -1), np.empty(n, np.int64)
    count = 0
    for v in range(n):
        if not root[v]:
            continue
        far[v], sum_[v], via[v] = 0, 0, -1
        queue[0], head, tail = v, 0, 1
        best, last, found = longest + 1, -1, np.uint64(0)
        while head < tail and 2 * far[queue[head]] < best - 1:
            u = queue[head]
            head += 1
            for i in range(starts[u], starts[u + 1]):
                edge = around[i]
                w = ends[edge, 0] + ends[edge, 1] - u
                if far[w] < 0:
                    far[w], sum_[w], via[w] = far[u] + 1, sum_[u] ^ words[edge], edge
                    queue[tail] = w
                    tail += 1
                elif sum_[u] ^ sum_[w] ^ words[edge] != 0 and far[u] + far[w] + 1 < best:
                    best, last, found = far[u] + far[w] + 1, edge, sum_[u] ^ sum_[w] ^ words[edge]
        if last >= 0:
            lengths[count], classes[count] = best, found
            at = 0
            u = ends[last, 0]
            while u != v:
                vertices[count, at] = u
                at += 1
                u = ends[via[u], 0] + ends[via[u], 1] - u
            vertices[count, at] = v
            at = best - 1
            u = ends[last, 1]
            while u != v:
                vertices[count, at] = u
                at -= 1
                u = ends[via[u], 0] + ends[via[u], 1] - u
            count += 1
        for i in range(tail):
            far[queue[i]] = -1
    return lengths[:count], classes[:count], vertices[:count]


@kernel
def cut_handle(ground, scratch, sides, excess, loop, side, work):
    """Cut the handle within a loop, or the one around it, if that costs nothing; returns the change of the Euler number.

    The nodes of one side at the loop are flipped, whatever it costs: a plug. From there on the best flip next to the
    surface is taken, each node once, and of all states that have fewer handles the one of least energy is kept. It must
    bury or pinch no sample more than before, cut off no island, and add no more wall than one facet with a radius of one
    spacing for each handle. work: number (N,) of each node in the search, -1; `touched` (n,): samples at cuts made.
    """
    nodes, links, gate, starts, star = ground[2:]
    number, touched = work
    n, m, widest = len(starts) - 1, len(gate), np.float32(np.inf)
    near = [np.int64(0) for _ in range(0)]  # nodes at the loop, then their neighbours
    for v in loop:
        if touched[v]:
            return 0
    for ring in range(2):
        if ring == 0:
            samples = loop.copy()
        else:
            at_loop = len(near)
            samples = np.unique(nodes[np.array(near)].ravel()).astype(np.int64)
        for v in samples:
            for i in range(starts[v] if v < n else 0, starts[v + 1] if v < n else 0):
                if star[i] < m and number[star[i]] < 0:
                    number[star[i]] = len(near)
                    near.append(np.int64(star[i]))
    before = islands(links, sides, number, near)
    chain = [np.int64(0) for _ in range(0)]
    energy, chi = 0.0, 0
    for x in near[:at_loop]:
        corners = 0
        for k in range(4):
            corners += (loop == nodes[x, k]).any()
        if sides[x] == side and corners >= PLUG:
            change, turned = flip(ground, scratch, widest, sides, x, excess)
            energy += change
            chi += turned
            chain.append(x)
    gain, fresh, free = np.zeros(len(near)), np.ones(len(near), np.bool_), np.ones(len(near), np.bool_)
    best, length, handles = 0.0, 0, 0
    for _ in range(STEPS):
        total = energy - TOPOLOGY * chi / 2
        if chi > 0 and total < best and energy <= WALL * chi / 2:
            best, length, handles = total, len(chain), chi
        pick = -1
        for i in range(len(near)):
            if not free[i]:
                continue
            x = near[i]
            walls = 0
            for k in range(4):
                walls += sides[links[x, k]] != sides[x]
            if walls == 0:
                continue
            if fresh[i]:
                change, turned = flip(ground, scratch, widest, sides, x, excess)
                flip(ground, scratch, widest, sides, x, excess)
                gain[i], fresh[i] = change - TOPOLOGY * turned / 2, False
            if pick < 0 or gain[i] < gain[pick]:
                pick = i
        if pick < 0 or total > best + HOPELESS:
            break
        x = near[pick]
        change, turned = flip(ground, scratch, widest, sides, x, excess)
        energy += change
        chi += turned
        chain.append(x)
        free[pick] = False
        for k in range(4):
            v = nodes[x, k]
            for i in range(starts[v] if v < n else 0, starts[v + 1] if v < n else 0):
                if number[star[i]] >= 0:
                    fresh[number[star[i]]] = True
    for i in range(len(chain) - 1, length - 1, -1):
        flip(ground, scratch, widest, sides, chain[i], excess)
    if handles > 0 and islands(links, sides, number, near) > before:
        for i in range(length - 1, -1, -1):
            flip(ground, scratch, widest, sides, chain[i], excess)
        handles = 0
    for x in near:
        if handles > 0:
            for k in range(4):
                if nodes[x, k] < n:
                    touched[nodes[x, k]] = True
        number[x] = -1
    return handles


@kernel
def islands(links, sides, number, near):
    """Components of these nodes by side that end among them."""
    seen, count = np.zeros(len(near), np.bool_), 0
    for first in range(len(near)):
        if seen[first]:
            continue
        seen[first], ends, stack = True, True, [near[first]]
        while len(stack) > 0:
            x = stack.pop()
            for k in range(4):
                y = links[x, k]
                if sides[y] != sides[x]:
                    continue
                if number[y] < 0:
                    ends = False
                elif not seen[number[y]]:
                    seen[number[y]] = True
                    stack.append(np.int64(y))
        count += ends
    return count
