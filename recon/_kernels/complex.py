"""The array in which a triangulation grows, in 2-D and 3-D: how it begins, and how it is handed over.

A cell is eight words in a row, so that whoever looks at it touches one cache line: its d + 1 vertices from word 0 on, its
d + 1 neighbours from word 4 on. A facet is named by 8 * cell + slot of the opposite vertex, which is the place of that
vertex; a neighbour is the facet that is shared, as seen from the other side. Vertex n of n is the infinite one; ghost
cells, which have it, close the hull. The two upper bits of the first vertex are the marks of one insertion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compile import kernel

NONE = np.uint32(0xFFFFFFFF)  # first vertex of a deleted cell, whose first neighbour is the next deleted one
VERTEX = np.uint32(0x3FFFFFFF)  # what remains of a first vertex without the marks
CELL = np.uint32(0xFFFFFFF8)  # what remains of a facet without the slot
CELLS_MAX = 1 << 29
_BLOCK = 256  # cells at a time
_HUB = 32  # cells that have the same lowest vertex: more are sorted another way
DONE, MORE_CELLS, MORE_CAVITY = range(3)  # what an insertion kernel returns
# Its state, which outlives a return for more room: position in the sequence, cell to walk from, first deleted cell and
# their number; next unused cell, end of those, and how many would do; insertions so far; vertices left for later.
STATE = 9
NEXT, HINT, FREE, FREE_COUNT, USED, LIMIT, WANTED, STAMP, LATER = range(STATE)


def first_cells(d: int, simplex: NDArray[np.int64], infinite: int) -> NDArray[np.uint32]:
    """Give one positive cell and its ghosts.

    A ghost has the infinite vertex in the slot of the vertex that it mirrors, and two others swapped, to be positive.
    """
    cells = np.tile(simplex, (d + 2, 1))
    for slot in range(d + 1):
        i, j = [k for k in range(d + 1) if k != slot][:2]
        cells[slot + 1, slot] = infinite
        cells[slot + 1, [i, j]] = simplex[[j, i]]
    words = np.zeros((d + 2, 8), np.uint32)
    words[:, : d + 1] = cells
    sides: dict[frozenset, tuple[int, int]] = {}
    for c, cell in enumerate(cells.tolist()):
        for slot, vertex in enumerate(cell):
            other, place = sides.setdefault(frozenset(cell) - {vertex}, (c, slot))
            words[c, 4 + slot], words[other, 4 + place] = 8 * other + place, 8 * c + slot
    return words.ravel()


@kernel
def put_aside(words, state):
    """Delete the cells that are left of a thread's share, so that it can take another one."""
    for c in range(state[USED], state[LIMIT]):
        words[8 * c] = NONE
        words[8 * c + 4] = state[FREE]
        state[FREE] = 8 * c
        state[FREE_COUNT] += 1
    state[USED] = state[LIMIT]


@kernel
def start_in(words, taken, points, slab, vertex):
    """A cell to walk from: one with a vertex of the slab that is next to another along the curve; -1 where there is none."""
    axis, low, high = slab
    apart, start = np.int64(len(points)), np.int64(-1)
    for c in range(taken):
        if words[8 * c] != NONE:
            for k in range(4):
                v = np.int64(words[8 * c + k])
                if abs(v - vertex) < apart and points[4 * v + axis] >= low and points[4 * v + axis] < high:
                    apart, start = abs(v - vertex), np.int64(8 * c)
    return start


@kernel
def room(m, width):
    """Arrays (m, width) for vertices and neighbours of cells. Made here, their memory comes page by page as it is used."""
    return np.empty((m, width), np.uint32), np.empty((m, width), np.uint32)


@kernel
def by_lowest(words, taken, width, infinite):
    """All finite cells `at` by their lowest vertex: those of vertex v are at[starts[v] : starts[v + 1]]."""
    lowest, starts = np.empty(taken, np.uint32), np.zeros(infinite + 2, np.int64)
    for c in range(taken):
        lowest[c] = NONE
        if words[8 * c] == NONE:
            continue
        least, most = words[8 * c], words[8 * c]
        for k in range(1, width):
            least, most = min(least, words[8 * c + k]), max(most, words[8 * c + k])
        if most != infinite:
            lowest[c] = least
            starts[least + 2] += 1
    for v in range(infinite):
        starts[v + 2] += starts[v + 1]
    at = np.empty(starts[infinite + 1], np.uint32)
    for c in range(taken):
        if lowest[c] != NONE:
            at[starts[lowest[c] + 1]] = c
            starts[lowest[c] + 1] += 1
    return starts[:-1], at


@kernel
def in_order(words, width, starts, at, index, first, last, place, cells, neighbors):
    """Fill in the cells of a range of lowest vertices, sorted by their vertices, and their places; `neighbors` as they are in `words`.

    Vertices, by input row, ascend along the curve, but the last two change places where that would turn a cell inside out.
    """
    size = np.int64(_BLOCK)
    for v in range(first, last):
        size = max(size, starts[v + 1] - starts[v])
    corner, beside = np.empty((4, size), np.uint32), np.empty((4, size), np.uint32)
    row, keys, rank = np.empty((4, size), np.uint64), np.empty(size, np.int64), np.empty(size, np.int64)
    upper, lower, last_of_all = np.uint64(32), np.uint64(0xFFFFFFFF), np.uint64(0xFFFFFFFFFFFFFFFF)
    stop = first
    while stop < last:
        v, start = stop, starts[stop]
        while stop < last and starts[stop + 1] - start <= size:
            stop += 1
        count = starts[stop] - start
        for i in range(count):  # all at once: memory answers many questions as fast as one
            x = 8 * np.int64(at[start + i])
            for k in range(4):
                corner[k, i], beside[k, i] = words[x + k], words[x + 4 + k]
        for i in range(count):
            a = np.uint64(corner[0, i]) << upper | np.uint64(beside[0, i])
            b = np.uint64(corner[1, i]) << upper | np.uint64(beside[1, i])
            c = np.uint64(corner[2, i]) << upper | np.uint64(beside[2, i])
            d = np.uint64(corner[3, i]) << upper | np.uint64(beside[3, i])
            if width == 3:
                d = last_of_all
            odd = (a > b) ^ (c > d)
            a, b, c, d = min(a, b), max(a, b), min(c, d), max(c, d)
            odd ^= (a > c) ^ (b > d)
            a, c, b, d = min(a, c), max(a, c), min(b, d), max(b, d)
            odd ^= b > c
            b, c = min(b, c), max(b, c)
            # two cells that share their three lowest vertices lie on either hand of these
            keys[i] = np.int64(b >> upper) << 32 | np.int64(c >> upper) << 1 | odd
            if odd:
                b, c, d = (c, b, d) if width == 3 else (b, d, c)
            row[0, i], row[1, i], row[2, i], row[3, i] = a, b, c, d
        for u in range(v, stop):
            low, high = starts[u] - start, starts[u + 1] - start
            if high - low > _HUB:
                order = np.argsort(keys[low:high])
                for i in range(high - low):
                    rank[low + order[i]] = low + i
                continue
            for i in range(low, high):
                key, below = keys[i], low
                for other in range(low, high):  # without a branch, which nobody could predict
                    below += keys[other] < key
                rank[i] = below
        for i in range(count):
            x = start + rank[i]
            place[at[start + i]] = x
            for k in range(4):
                if k < width:
                    cells[x, k] = index[row[k, i] >> upper]
                    neighbors[x, k] = row[k, i] & lower


@kernel
def name_cells(place, neighbors, first, last):
    """Give for the neighbours of a range of cells their places, NONE on the hull."""
    for c in range(first, last):
        for k in range(neighbors.shape[1]):
            neighbors[c, k] = place[neighbors[c, k] >> np.uint32(3)]


@kernel
def used_vertices(simplices, n):
    """Which of n vertices are corners of simplices (n,)?"""
    found = np.zeros(n, np.bool_)
    for i in range(simplices.shape[0]):
        for k in range(simplices.shape[1]):
            found[simplices[i, k]] = True
    return found
