"""The complement of |K_alpha|, cell by cell: the faces of the space filling diagram are dual to it (paper, section 4).

What lies outside the convex hull is cut into infinite cells, which have one vertex at infinity, so that the cells around
any simplex fill its whole neighbourhood. An l-face of F_alpha is then a component of the cells outside K_alpha around a
simplex of K_alpha, linked through facets that contain it and are outside too: 4.1 and 4.2, face by face.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .intervals import Family

INFINITE = -1  # the vertex at infinity
OUTSIDE, FILLED = -1, -2  # regions that are no void: the unbounded one, and K_alpha itself


class Outside:
    """The cells that fill the space of the points, and which of them and of their facets are in K_alpha.

    Attributes
    ----------
    cells : (m, d+1) ndarray of int32
        Input rows, ascending in a row; in the infinite cells the last is INFINITE. The finite cells come first, in
        lexicographic order.
    neighbors : (m, d+1) ndarray of int64
        The cell beyond the facet opposite each vertex.
    filled : (m,) ndarray of bool
        Cells in K_alpha.
    walls : (m, d+1) ndarray of bool
        Facets in K_alpha, opposite each vertex.
    finite : int
        The number of finite cells.
    """

    def __init__(self, family: Family, alpha: float) -> None:
        self.family, self.alpha = family, alpha
        self._faces: dict[int, NDArray[np.int32]] = {}
        self._around: dict[int, tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], tuple]] = {}
        self.dimension = family.triangulation.points.shape[1]
        span = family.triangulation.dimension
        if span == self.dimension:
            self._fill_space(span)
        elif span == self.dimension - 1:
            self._two_sides(span)
        else:
            raise ValueError("cells fill no neighbourhood in codimension two")

    def _fill_space(self, d: int) -> None:
        """Finite cells, and one infinite cell on each hull facet."""
        top = self.family.level(d)
        facets = self._faces_of(d)
        m = self.finite = len(top.rho)
        other = _paired(facets.ravel())
        hull = np.flatnonzero(other < 0)
        cell, slot = np.divmod(hull, d + 1)
        corners = top.simplices[cell][np.arange(d + 1) != slot[:, None]].reshape(-1, d)
        if d > 1:
            ridges = np.stack([np.delete(corners, j, axis=1) for j in range(d)], axis=1).reshape(-1, d - 1)
            ridge = np.unique(ridges, axis=0, return_inverse=True)[1].ravel()
        else:  # the two ends of a line share the empty ridge
            ridge = np.zeros(len(hull), np.int64)
        beside = _paired(ridge) // d + m
        ghosts = np.column_stack([corners, np.full(len(hull), INFINITE)])
        self.cells = np.concatenate([top.simplices, ghosts]).astype(np.int32)
        neighbors = other // (d + 1)
        neighbors[hull] = m + np.arange(len(hull))
        self.neighbors = np.concatenate([neighbors.reshape(-1, d + 1), np.column_stack([beside.reshape(-1, d), cell])])
        self.filled = np.zeros(len(self.cells), bool)
        self.filled[:m] = top.rho <= self.alpha
        self.walls = np.zeros(self.cells.shape, bool)
        entered = self.family.level(d - 1).entry <= self.alpha
        self.walls[:m] = entered[facets]
        self._base = np.concatenate([np.full(m, -1), facets.ravel()[hull]])
        self.walls[m:, d] = entered[self._base[m:]]

    def _two_sides(self, d: int) -> None:
        """No finite cells: two infinite ones on each cell of the flat triangulation, one a side."""
        top = self.family.level(d)
        count = len(top.rho)
        self.finite = 0
        other = _paired(self._faces_of(d).ravel()) if d > 0 else np.full(1, -1)
        other = (other // (d + 1)).reshape(-1, d + 1)
        rows = np.arange(count)[:, None]
        up, down = np.where(other < 0, rows + count, other), np.where(other < 0, rows, other + count)
        self.neighbors = np.concatenate([np.column_stack([up, rows + count]), np.column_stack([down, rows])])
        ghosts = np.column_stack([top.simplices, np.full(count, INFINITE)])
        self.cells = np.concatenate([ghosts, ghosts]).astype(np.int32)
        self.filled = np.zeros(2 * count, bool)
        self.walls = np.zeros(self.cells.shape, bool)
        self.walls[:, -1] = np.tile(top.rho <= self.alpha, 2)
        self._base = np.tile(np.arange(count), 2)

    def regions(self) -> NDArray[np.int64]:
        """Region of every cell (m,): FILLED, OUTSIDE, or the number of its void, by lowest cell."""
        return self.regions_among(~self.filled)

    def regions_among(self, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Region of every cell when only the chosen ones are open."""
        m = len(self.cells)
        cell, slot = np.nonzero(chosen[:, None] & ~self.walls)
        other = self.neighbors[cell, slot]
        open_ = chosen[other]
        cell, other = cell[open_], other[open_]
        label = connected_components(coo_array((np.ones(len(cell), np.int8), (cell, other)), (m, m)), directed=False)[1]
        region = np.full(m, FILLED, np.int64)
        infinite = np.zeros(label.max() + 1, bool)
        infinite[label[self.finite :][chosen[self.finite :]]] = True
        region[chosen] = OUTSIDE
        bounded = np.flatnonzero(chosen & ~infinite[label])
        _, first, number = np.unique(label[bounded], return_index=True, return_inverse=True)
        rank = np.empty(len(first), np.int64)
        rank[np.argsort(first)] = np.arange(len(first))
        region[bounded] = rank[number.ravel()]
        return region

    def faces_around(self, k: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], tuple]:
        """Components of open cells around the k-simplices of K_alpha.

        Returns
        -------
        cell, place : (f,) ndarray of int64
            One cell of each component, the lowest, and which k-face of it: an index into `corners`.
        label : (m, c) ndarray of int64
            The component of each k-face of each cell, -1 where there is none. Numbered as the above.
        corners : tuple of tuple of int
            The slots of each of the c k-faces of a cell.
        """
        if k not in self._around:
            self._around[k] = self._components_around(k)
        return self._around[k]

    def _components_around(self, k: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], tuple]:
        """Link the open cells around each simplex through its facets that are open too."""
        d, m = self.dimension, len(self.cells)
        corners = tuple(combinations(range(d + 1), k + 1))
        exists = np.zeros((m, len(corners)), bool)
        for place, kept in enumerate(corners):
            exists[:, place] = ~self.filled & self.entered(kept)
        starts, ends = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        index = np.arange(m * len(corners)).reshape(m, -1)
        where = {kept: place for place, kept in enumerate(corners)}
        for place, kept in enumerate(corners):
            for apex in set(range(d + 1)) - set(kept):
                here = np.flatnonzero(exists[:, place] & ~self.walls[:, apex])
                other = self.neighbors[here, apex]
                target = np.full(len(here), -1)
                wanted = self.cells[here][:, kept]
                for candidate in where:
                    target[(self.cells[other][:, candidate] == wanted).all(axis=1)] = where[candidate]
                starts.append(index[here, place])
                ends.append(index[other, target])
        first, second = np.concatenate(starts), np.concatenate(ends)
        graph = coo_array((np.ones(len(first), np.int8), (first, second)), (index.size, index.size))
        component = connected_components(graph, directed=False)[1]
        nodes = np.flatnonzero(exists.ravel())
        _, lowest, number = np.unique(component[nodes], return_index=True, return_inverse=True)
        order = np.argsort(nodes[lowest])
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        label = np.full(index.size, -1, np.int64)
        label[nodes] = rank[number.ravel()]
        cell, slot = np.divmod(nodes[lowest][order], len(corners))
        return cell.astype(np.int64), slot.astype(np.int64), label.reshape(m, -1), corners

    def _faces_of(self, k: int) -> NDArray[np.int32]:
        if k not in self._faces:
            self._faces[k] = self.family.faces(k)
        return self._faces[k]

    def entered(self, kept: tuple[int, ...]) -> NDArray[np.bool_]:
        """Tell of every cell whether its face of these slots is in K_alpha; no face at infinity is (m,)."""
        d, m, faces = self.dimension, len(self.cells), self._faces_of
        entered = self.family.level(len(kept) - 1).entry <= self.alpha
        result = np.zeros(m, bool)
        if self.finite:
            ids = np.arange(self.finite)
            for left, slot in zip(range(d, 0, -1), sorted(set(range(d + 1)) - set(kept), reverse=True)):
                ids = faces(left)[ids, slot]
            result[: self.finite] = entered[ids]
        if d not in kept:
            ids = self._base[self.finite :]
            for left, slot in zip(range(d - 1, 0, -1), sorted(set(range(d)) - set(kept), reverse=True)):
                ids = faces(left)[ids, slot]
            result[self.finite :] = entered[ids]
        return result


def _paired(keys: NDArray) -> NDArray[np.int64]:
    """Give for every position the other one of equal key, -1 where there is none; no key comes three times."""
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    other = np.full(len(keys), -1, np.int64)
    other[order[same]], other[order[same + 1]] = order[same + 1], order[same]
    return other
