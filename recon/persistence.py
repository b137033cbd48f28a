"""When components, tunnels and voids of K_alpha come and go, for all alpha at once.

Components by union-find over edges, voids by union-find over cells through the facets that are not yet in (Delfinado
and Edelsbrunner 1995). The holes in between by reducing boundary matrices over GF(2), without the columns that are
known to begin a class (Chen and Kerber 2011). A feature is there for birth <= alpha < death.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._kernels import voids as kernels
from .intervals import Family


@dataclass(frozen=True, slots=True, eq=False)
class Voids:
    """Bounded components of the complement of |K_alpha|, over all alpha, the deepest first.

    A void is there for birth <= alpha < death. It is sealed off at its birth by a facet that enters K_alpha, from an
    elder void or from the outside, and ends with its largest cell.

    Attributes
    ----------
    birth, death : (v,) ndarray of float64 [L^2]
    cell : (v,) ndarray of int32
        The cell that enters last: a row of the triangulation.
    facet : (v,) ndarray of int32
        The facet that seals it: a row of `simplices(d - 1)`.
    parent : (v,) ndarray of int32
        The void it is split from, which is deeper; -1 for the outside.
    """

    birth: NDArray[np.float64]
    death: NDArray[np.float64]
    cell: NDArray[np.int32]
    facet: NDArray[np.int32]
    parent: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.birth)


class Pairs:
    """Which simplex of a family ends what another one begins."""

    def __init__(self, family: Family) -> None:
        self.family = family
        self.dimension = family.triangulation.dimension
        self._paired: dict[int, tuple[NDArray[np.int32], NDArray[np.int32]]] = {}
        self._tree: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None

    def barcode(self, k: int) -> NDArray[np.float64]:
        """Births and deaths (p, 2) of the classes of dimension k that last, ascending; inf for what never ends."""
        if not 0 <= k < max(1, self.dimension):
            return np.empty((0, 2))
        entry = self.family.level(k).entry
        if self.dimension == 0:
            return np.column_stack([entry, np.full(len(entry), np.inf)])
        begin, end = self.pairs(k)
        if k == self.dimension - 1:
            deaths = self.family.cell_sizes[end]
        else:
            deaths = self.family.level(k + 1).entry[end]
        bars = np.column_stack([entry[begin], deaths])
        bars = bars[bars[:, 0] < bars[:, 1]]
        if k == 0:
            bars = np.concatenate([bars, [[entry.min(), np.inf]]])
        return bars[np.lexsort(bars.T[::-1])]

    def pairs(self, k: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Rows of k-simplices that begin a class, and of the (k+1)-simplices that end it (cells: as triangulated)."""
        if k not in self._paired:
            if k == self.dimension - 1:
                link, _ = self.void_tree()
                cells = np.arange(len(link) - 1, dtype=np.int32)
                self._paired[k] = link[:-1], cells
            elif k == 0:
                vertices, edges = self.family.level(0), self.family.level(1)
                first, second = np.searchsorted(vertices.simplices[:, 0], edges.simplices.T).astype(np.int32)
                link, into = np.empty((2, len(vertices.rho)), np.int32)
                kernels.merge_tree(_order(edges.entry), first, second, vertices.entry, link, into)
                ended = np.flatnonzero(link >= 0).astype(np.int32)
                self._paired[k] = ended, link[ended]
            else:
                self._paired[k] = self._reduce(k)
        return self._paired[k]

    def void_tree(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """By cell of the triangulation: the facet that seals off the void that it ends, and the cell of the elder void.

        Cell m of m is the outside, which nothing ends.
        """
        if self._tree is None:
            first, second = self.family.sides()
            facets = self.family.level(self.dimension - 1)
            age = np.append(-self.family.cell_sizes, -np.inf)
            link, into = np.empty((2, len(age)), np.int32)
            order = _order(facets.entry)[::-1].copy()
            kernels.merge_tree(order, first, np.where(second < 0, len(age) - 1, second), age, link, into)
            self._tree = link, into
        return self._tree

    def voids(self) -> Voids:
        """All voids that last."""
        sizes = self.family.cell_sizes
        outside = len(sizes)
        if self.dimension == 0:
            link, into, birth = np.full(2, -1, np.int32), np.full(2, -1, np.int32), sizes
        else:
            link, into = self.void_tree()
            birth = self.family.level(self.dimension - 1).entry[link[:-1]]
        cell = np.flatnonzero(birth < sizes).astype(np.int32)
        cell = cell[np.lexsort((cell, -sizes[cell]))]
        number = np.full(outside + 1, -1, np.int32)
        number[cell] = np.arange(len(cell))
        arrays = birth[cell], sizes[cell], cell, link[cell], number[into[cell]]
        for array in arrays:
            array.flags.writeable = False
        return Voids(*arrays)

    def _reduce(self, k: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Pair k-simplices with (k+1)-simplices, 0 < k < d - 1: those that begin a class themselves end none."""
        below, above = self.family.level(k), self.family.level(k + 1)
        order = _order(below.entry)
        place = np.empty(len(order), np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        boundary = place[self.family.faces(k + 1)]
        begins = np.zeros(len(above.rho), bool)
        begins[self.pairs(k + 1)[0]] = True
        columns = _order(above.entry)
        columns = columns[~begins[columns]]
        owner = np.full(len(order), -1, np.int32)
        where, size = np.zeros(len(boundary), np.int64), np.zeros(len(boundary), np.int32)
        pool, position, used = np.empty(max(1 << 16, 4 * len(columns)), np.int32), 0, 0
        while position < len(columns):
            position, used = kernels.reduce_columns(columns, boundary, owner, pool, where, size, position, used)
            if position < len(columns):
                pool = np.concatenate([pool, np.empty_like(pool)])
        begin = np.flatnonzero(owner >= 0)
        return order[begin], owner[begin]


def _order(values: NDArray[np.float64]) -> NDArray[np.int32]:
    """Positions (s,) that sort float64 ascending, equal values by position."""
    keys = (values + 0.0).view(np.int64)  # minus zero becomes zero
    keys = np.where(keys < 0, ~keys, keys ^ np.int64(-(2**63))).view(np.uint64)
    order, spare = np.empty((2, len(keys)), np.int32)
    kernels.stable_order(keys, order, np.empty_like(keys), spare)
    return order
