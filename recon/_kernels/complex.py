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
DONE, MORE_CELLS, MORE_CAVITY = range(3)  # what an insertion kernel returns
# Its state, which outlives a return for more room: position in the sequence, cell to walk from, first deleted cell and
# their number, cells ever used, insertions so far.
NEXT, HINT, FREE, FREE_COUNT, USED, STAMP = range(6)


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
def finish(words, used, width, index):
    """Give vertices, by input row, and neighbours, by cell or NONE on the hull, of all finite cells."""
    infinite = np.uint32(index.size)
    place = np.empty(used, np.uint32)
    count = 0
    for c in range(used):
        finite = words[8 * c] != NONE
        for k in range(width):
            finite = finite and words[8 * c + k] != infinite
        place[c] = count if finite else NONE
        count += 1 if finite else 0
    cells = np.empty((count, width), np.uint32)
    neighbors = np.empty((count, width), np.uint32)
    for c in range(used):
        new = place[c]
        if new != NONE:
            for k in range(width):
                cells[new, k] = index[words[8 * c + k]]
                neighbors[new, k] = place[words[8 * c + 4 + k] >> np.uint32(3)]
    return cells, neighbors


@kernel
def corners_of(simplices, n):
    """Which of n vertices are corners of simplices (n,)?"""
    found = np.zeros(n, np.bool_)
    for i in range(simplices.shape[0]):
        for k in range(simplices.shape[1]):
            found[simplices[i, k]] = True
    return found
