"""Short loops around handles, by homology; and the search that cuts a handle."""

from __future__ import annotations

import numpy as np

from .chance import word
from .compile import kernel
from .energy import TOPOLOGY, WALL, flip, flip_back
from .least_walls import cells_near, least_walls, tied
from .union import root

STEPS = 120  # flips from the least walls on, at most,
HOPELESS = 12.0  # and energy above the best at which it is given up


@kernel
def pieces_beyond(faces, among):
    """A number for each vertex (n,), the same for those that edges join without passing one of `among` (n,)."""
    parent = np.arange(len(among))
    for i in range(len(faces)):
        for j in range(3):
            a, b = faces[i, j], faces[i, 0 if j == 2 else j + 1]
            if not among[a] and not among[b]:
                x, y = root(parent, np.int64(a)), root(parent, np.int64(b))
                parent[max(x, y)] = min(x, y)
    for x in range(len(parent)):
        parent[x] = parent[parent[x]]
    return parent


@kernel
def incident(n, ends):
    """The edges at each of n nodes, ascending: around[starts[v] : starts[v + 1]]; none of edges that have no ends (-1)."""
    starts = np.zeros(n + 2, np.int64)
    for a, b in ends:
        if a >= 0 and b >= 0:
            starts[a + 2] += 1
            starts[b + 2] += 1
    for v in range(n):
        starts[v + 2] += starts[v + 1]
    around = np.empty(starts[n + 1], np.int64)
    for edge in range(len(ends)):
        if ends[edge, 0] >= 0 and ends[edge, 1] >= 0:
            for v in ends[edge]:
                around[starts[v + 1]] = edge
                starts[v + 1] += 1
    return starts[:-1], around


@kernel
def spanning_trees(ends, starts, around, barred):
    """Spanning trees by breadth-first search: all nodes in that order, the edge by which each was reached, -1 at the first of a tree."""
    n = len(starts) - 1
    order, way, tail = np.empty(n, np.int64), np.full(n, -2), 0
    for first in range(n):
        if way[first] != -2:
            continue
        way[first], order[tail], head = -1, first, tail
        tail += 1
        while head < tail:
            x = order[head]
            head += 1
            for i in range(starts[x], starts[x + 1]):
                y = ends[around[i], 0] + ends[around[i], 1] - x
                if not barred[around[i]] and way[y] == -2:
                    way[y], order[tail] = around[i], y
                    tail += 1
    return order, way


@kernel
def class_words(vertices, ends, sides, beside):
    """A word of each edge: those of a loop, joined by exclusive or, give 0 where it is the boundary of a part of the surface.

    ends (e, 2): the edges, as numbers of vertices; beside (e, 2): the parts of the surface on their two sides, as numbers, -1 where
    there are not two. Returns the words, and the edges at each vertex (`incident`).
    """
    e = len(ends)
    tree, barred = np.zeros(e, np.bool_), np.zeros(e, np.bool_)
    starts, around = incident(vertices, ends)
    for edge in spanning_trees(ends, starts, around, barred)[1]:
        if edge >= 0:
            tree[edge] = True
    order, way = spanning_trees(beside, *incident(sides, beside), tree)
    words, passing, crossed = np.zeros(e, np.uint64), np.zeros(sides, np.uint64), tree.copy()
    for edge in way:
        if edge >= 0:
            crossed[edge] = True
    for edge in range(e):
        if not crossed[edge] and beside[edge, 1] >= 0:
            words[edge] = word(edge)
            passing[beside[edge, 0]] ^= words[edge]
            passing[beside[edge, 1]] ^= words[edge]
    for i in range(sides - 1, -1, -1):
        x = order[i]
        if way[x] >= 0:
            words[way[x]] ^= passing[x]
            passing[beside[way[x], 0] + beside[way[x], 1] - x] ^= passing[x]
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
def cut_handle(ground, scratch, sides, excess, loop, pole, anti, work):
    """Cut the handle within a loop, or the one around it, if that costs nothing; returns the change of the Euler number.

    The cells near the loop get the sides between which walls are least, poles as they are. Where that leaves fewer handles,
    the best flip next to the surface is taken, again and again, each node once, and of all states that have fewer handles the
    one of least energy is kept. It must bury or pinch no sample more than before, cut off no island, and add no more wall than
    one facet with a radius of one spacing for each handle. work: number (N,) of each node in the search, -1; `touched` (n,): samples at cuts made.
    """
    nodes, links, gate, starts, star = ground[2:]
    number, touched = work
    n, widest = len(starts) - 1, np.float32(np.inf)
    for v in loop:
        if touched[v]:
            return 0
    near, corners = cells_near(ground, loop, 2, number)
    ended = islands(links, sides, number, near)
    chain = [np.int64(0) for _ in range(0)]
    before = np.empty((len(near) + STEPS + 1, 4), np.int32)
    energy, chi = 0.0, 0
    ties = tied(sides, pole[corners], anti[corners], number, near, np.inf)
    for x in least_walls(ground, sides, number, near, ties):
        change, turned = flip(ground, scratch, widest, sides, x, excess, before[len(chain)])
        energy += change
        chi += turned
        chain.append(x)
    gain, fresh, free = np.zeros(len(near)), np.ones(len(near), np.bool_), np.ones(len(near), np.bool_)
    best, length, handles = 0.0, 0, 0
    for _ in range(STEPS if chi > 0 else 0):
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
                change, turned = flip(ground, scratch, widest, sides, x, excess, before[len(chain)])
                flip_back(nodes, sides, x, excess, before[len(chain)])
                gain[i], fresh[i] = change - TOPOLOGY * turned / 2, False
            if pick < 0 or gain[i] < gain[pick]:
                pick = i
        if pick < 0 or total > best + HOPELESS:
            break
        x = near[pick]
        change, turned = flip(ground, scratch, widest, sides, x, excess, before[len(chain)])
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
        flip_back(nodes, sides, chain[i], excess, before[i])
    if handles > 0 and islands(links, sides, number, near) > ended:
        for i in range(length - 1, -1, -1):
            flip_back(nodes, sides, chain[i], excess, before[i])
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
