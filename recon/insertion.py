"""From points to cells in 1-D, 2-D and 3-D, vertex by vertex, on several threads: who inserts what, and where there is room.

Each thread inserts the vertices of one slab of space. It changes only cells all of whose vertices lie there; a cell of several slabs
stays as it is, and a vertex in conflict with one is left for the next turn, when slabs are across another axis, and in
the end for one thread alone. So no two threads ever write the same word, none waits for another, and R, which is
unique, comes out the same, cell by cell.
"""

from __future__ import annotations

import threading
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ._kernels.complex import (
    CELLS_MAX,
    DONE,
    HINT,
    LATER,
    LIMIT,
    MORE_CAVITY,
    NEXT,
    NONE,
    STATE,
    USED,
    WANTED,
    by_lowest,
    first_cells,
    in_order,
    name_cells,
    put_aside,
    room,
    start_in,
)
from ._kernels.regular1d import lower_chain
from ._kernels.regular2d import insert2d
from ._kernels.regular3d import insert3d
from ._kernels.span import gather, span
from ._kernels.spatial_sort import hilbert_order, rounds
from .threads import over_ranges, together, workers

Cells = tuple[NDArray[np.int32], NDArray[np.int32]]
Slab = tuple[np.int64, float, float]  # an axis and limits
CELLS_PER_VERTEX = {2: 3, 3: 12}  # room to begin with: samples of a surface in space take up to ten
SHARE = 4096  # cells that a thread takes at a time
WORTH = 4096  # vertices that are worth a thread
SLABS = 8  # at most: the thinner they are, the more cells lie in several


def triangulate(points: NDArray[np.float64], weights: NDArray[np.float64], threads: int | None) -> Cells:
    """Triangulate weighted points regularly, in the flat that they span.

    Parameters
    ----------
    points : (n, d) ndarray of float64, d <= 3
    weights : (n,) ndarray of float64
    threads : int or None
        Of use in space. The result does not depend on it.

    Returns
    -------
    cells, neighbors : (m, k+1) ndarray of int32
        k is the dimension of the flat. Cells are positive, in a flat as seen along a coordinate axis (k = 2), or by
        ascending coordinate (k = 1). -1 stands for no neighbour.
    """
    n, d = points.shape
    if d < 3:
        located = np.zeros((n, 3))
        located[:, :d] = points
        points = located
    order = hilbert_order(points)
    vertices = gather(points, weights, order)
    index = order.astype(np.uint32)
    dimension, simplex, axes = span(vertices)
    if dimension < 3 and (axes != np.arange(3)).any():
        vertices[:, :3] = vertices[:, axes]
    if dimension == 0:
        best = np.lexsort((index, -vertices[:, 3]))[0]
        return index[[[best]]].astype(np.int32), np.full((1, 1), -1, np.int32)
    if dimension == 1:
        return _segments(vertices, index)
    return _grow(dimension, vertices, index, simplex[: dimension + 1], threads)


def _segments(points: NDArray, index: NDArray) -> Cells:
    """Triangulate points of a line, along their first coordinate."""
    order = np.lexsort((index, -points[:, 3], points[:, 0]))
    points, index = points[order], index[order]
    first = np.append(True, np.diff(points[:, 0]) != 0.0)  # of each location: the heaviest, then the lowest row
    points, index = points[first], index[first]
    chain = index[lower_chain(points, index)].astype(np.int32)
    cells = np.column_stack([chain[:-1], chain[1:]])
    here = np.arange(len(cells), dtype=np.int32)
    neighbors = np.column_stack([here + 1, here - 1])
    neighbors[-1, 0] = -1
    return cells, neighbors


def _grow(d: int, points: NDArray, index: NDArray, simplex: NDArray, threads: int | None) -> Cells:
    """Insert vertex after vertex (they lie along a curve) into the cell `simplex` and its ghosts.

    Returns
    -------
    cells, neighbors : (m, d+1) ndarray of int32
        In an order that depends on the cells alone.
    """
    job = _Insertion(d, points, index, simplex)
    most = min(workers(threads), SLABS) if d == 3 else 1
    axes = np.argsort(-np.ptp(points[:, :3], axis=0), kind="stable")
    for sequence in rounds(len(index), np.sort(simplex)):
        for axis in axes:
            slabs = min(most, len(sequence) // WORTH)
            if slabs > 1:
                sequence = job.insert_by_slabs(sequence, axis, slabs)
        job.insert_alone(sequence)
    return job.finished(threads)


class _Hand:
    """What a thread needs to insert vertices: its state, and room for one insertion."""

    def __init__(self, d: int, n: int):
        self.state = np.zeros(STATE, np.int64)
        self.room = _scratch(d, n, 256)


class _Insertion:
    """The cells, and who inserts vertices into them."""

    def __init__(self, d: int, points: NDArray, index: NDArray, simplex: NDArray):
        self.d, self.n, self.index = d, len(index), index
        self.points = np.append(points.ravel(), np.full(4, np.nan))
        self.words = np.empty(8 * (CELLS_PER_VERTEX[d] * self.n + SHARE), np.uint32)
        first = first_cells(d, simplex, self.n)
        self.words[: first.size] = first
        self.taken = first.size // 8
        self.taking = threading.Lock()
        self.hands = [_Hand(d, self.n)]

    def insert_by_slabs(self, sequence: NDArray[np.uint32], axis: np.int64, slabs: int) -> NDArray[np.uint32]:
        """Insert vertices, ascending, on as many threads as slabs of as many vertices each; those that are left for later."""
        x = self.points[4 * sequence.astype(np.int64) + axis]
        limits = np.partition(x, [len(x) * i // slabs for i in range(1, slabs)])
        limits = np.array([-np.inf, *(limits[len(x) * i // slabs] for i in range(1, slabs)), np.inf])
        slab = np.searchsorted(limits[1:-1], x, side="right")
        while len(self.hands) < slabs:
            self.hands.append(_Hand(self.d, self.n))
        works = []
        for i, hand in enumerate(self.hands[:slabs]):
            part, bounds = sequence[slab == i], (axis, limits[i], limits[i + 1])
            if self._placed(hand, part, bounds):
                works.append(partial(self._insert, part, bounds, hand))
            else:
                works.append(partial(np.copy, part))
        return np.sort(np.concatenate(together(slabs, *works)))

    def insert_alone(self, sequence: NDArray[np.uint32]) -> None:
        """Insert vertices, ascending."""
        hand, everywhere = self.hands[0], (np.int64(0), -np.inf, np.inf)
        while self._placed(hand, sequence, everywhere) and len(sequence := self._insert(sequence, everywhere, hand)):
            if self.words.size >= 8 * CELLS_MAX:
                raise MemoryError(f"more than {CELLS_MAX} cells")
            size = max(self.words.size // 16 * 24, 8 * (self.taken + int(hand.state[WANTED])))
            larger = np.empty(min(size, 8 * CELLS_MAX), np.uint32)
            larger[: 8 * self.taken] = self.words[: 8 * self.taken]
            self.words = larger

    def _placed(self, hand: _Hand, sequence: NDArray[np.uint32], slab: Slab) -> bool:
        """Put a thread next to the first vertex of a sequence, if there is one, and a cell to walk from in its slab."""
        if len(sequence):
            hand.state[HINT] = start_in(self.words, self.taken, self.points, slab, np.int64(sequence[0]))
        return len(sequence) > 0 and hand.state[HINT] >= 0

    def _insert(self, sequence: NDArray[np.uint32], slab: Slab, hand: _Hand) -> NDArray[np.uint32]:
        """Insert vertices of one slab; those in conflict with cells of others, and those that there is no room for."""
        state = hand.state
        state[NEXT] = state[LATER] = 0
        while True:
            if self.d == 2:
                status = insert2d(self.points, self.index, sequence, self.words, *hand.room, state)
            else:
                status = insert3d(self.points, self.index, sequence, self.words, slab, *hand.room, state)
            if status == DONE:
                return sequence[: state[LATER]]
            if status == MORE_CAVITY:
                hand.room = _scratch(self.d, self.n, 2 * hand.room[0].size)
            elif not self._more(state):
                return np.append(sequence[: state[LATER]], sequence[state[NEXT] :])

    def _more(self, state: NDArray) -> bool:
        """Give a thread more cells, if there are any."""
        put_aside(self.words, state)
        size = max(SHARE, int(state[WANTED]))
        with self.taking:
            if 8 * (self.taken + size) > self.words.size:
                return False
            state[USED], state[LIMIT] = self.taken, self.taken + size
            self.taken += size
        self.words[8 * state[USED] : 8 * state[LIMIT] : 8] = NONE
        return True

    def finished(self, threads: int | None) -> Cells:
        """Cells by input row, and their neighbours."""
        for hand in self.hands:
            put_aside(self.words, hand.state)
        width = self.d + 1
        starts, at = by_lowest(self.words, self.taken, width, self.n)
        place, (cells, neighbors) = np.full(self.taken, NONE), room(len(at), width)
        ground = self.words, width, starts, at, self.index
        over_ranges(lambda *part: in_order(*ground, *part, place, cells, neighbors), self.n, threads)
        over_ranges(lambda *part: name_cells(place, neighbors, *part), len(at), threads)
        return cells.view(np.int32), neighbors.view(np.int32)


def _scratch(d: int, n: int, size: int) -> tuple[NDArray, ...]:
    """Room for a cavity of `size` cells, and so of less than 2 * size + 4 border facets, of four words."""
    cavity, border = np.empty(size, np.uint32), np.empty(8 * size + 16, np.uint32)
    if d == 2:
        return cavity, border, np.empty(n + 1, np.uint32)
    return cavity, border, np.empty(32 * size, np.uint64), np.zeros(32 * size, np.uint64)
