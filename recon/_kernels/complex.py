"""The arrays in which a triangulation grows, in any dimension d: how it begins, and how it is handed over.

Cell c has d + 1 vertices, vertices[(d + 1) * c + slot], and as many neighbours, each named by the facet they share as
seen from the other side: 4 * cell + slot. Vertex n of n is the infinite one; ghost cells, which have it, close the hull.
A deleted cell has first vertex NONE and its first neighbour is the next deleted one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compile import kernel

NONE = 0xFFFFFFFF
DONE, MORE_CELLS, MORE_CAVITY = range(3)  # what an insertion kernel returns
# Its state, which outlives a return for more room: position in the sequence, cell to walk from, first deleted cell and
# their number, cells ever used, last mark given.
NEXT, HINT, FREE, FREE_COUNT, USED, STAMP = range(6)


def first_cells(d: int) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Give vertices and neighbours of one positive cell 0 .. d and its ghosts, the infinite vertex being d + 1.

    A ghost has the infinite vertex in the slot of the vertex that it mirrors, and two others swapped, to be positive.
    """
    cells = np.tile(np.arange(d + 1, dtype=np.uint32), (d + 2, 1))
    for slot in range(d + 1):
        ghost = cells[slot + 1]
        ghost[slot] = d + 1
        i, j = [k for k in range(d + 1) if k != slot][:2]
        ghost[[i, j]] = ghost[[j, i]]
    sides: dict[frozenset, tuple[int, int]] = {}
    links = np.empty_like(cells)
    for c, cell in enumerate(cells.tolist()):
        for slot, vertex in enumerate(cell):
            c_other, slot_other = sides.setdefault(frozenset(cell) - {vertex}, (c, slot))
            links[c, slot], links[c_other, slot_other] = 4 * c_other + slot_other, 4 * c + slot
    return cells, links


@kernel
def finish(vertices, neighbors, width, used, index):
    """Pack the finite cells in front, in place, and name their vertices by input row; give their number.

    Neighbours become cell numbers, NONE on the hull.
    """
    infinite = np.uint32(index.size)
    place = np.empty(used, np.uint32)
    count = 0
    for c in range(used):
        finite = vertices[width * c] != NONE
        for k in range(width):
            finite = finite and vertices[width * c + k] != infinite
        place[c] = count if finite else NONE
        count += 1 if finite else 0
    for c in range(used):
        new = np.int64(place[c])
        if new != NONE:
            for k in range(width):
                vertices[width * new + k] = index[vertices[width * c + k]]
                neighbors[width * new + k] = place[neighbors[width * c + k] >> np.uint32(2)]
    return count


def grown(array: NDArray) -> NDArray:
    """Copy with half as much room again, zeros at the end."""
    larger = np.zeros(array.size + array.size // 2, array.dtype)
    larger[: array.size] = array
    return larger
