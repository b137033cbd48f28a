"""The k nearest neighbours of every sample: one query, shared by every term."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from recon._kernels import spatial_sort
from recon.contracts import InvalidInput, as_points, as_whole, shown
from recon.threads import workers

from ._kernels import curve_keys

RING = 8  # neighbours: one ring around a sample of a surface
LEAF = 24  # points a leaf of the k-d tree: fastest for some ten neighbours


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Neighborhood:
    """Distinct points, along a space filling curve, and the nearest neighbours of each.

    The order depends on the positions alone, not on that of the input, and so does everything computed from it.

    Attributes
    ----------
    points : (m, d) ndarray of float64 [L]
    index : (m, k) ndarray of int32
        Rows of `points`, nearest first, never the point itself.
    distance : (m, k) ndarray of float64 [L]
    rows : (m,) ndarray of int64
        The first input row of each point.
    inverse : (n,) ndarray of int64
        The row of `points` that each input row is.
    tree : cKDTree
        Of `points` times `scale`.
    scale : float [1/L]
        A power of two that keeps squares in range.
    """

    points: NDArray[np.float64]
    index: NDArray[np.int32]
    distance: NDArray[np.float64]
    rows: NDArray[np.int64]
    inverse: NDArray[np.int64]
    tree: cKDTree
    scale: float

    @property
    def k(self) -> int:
        """Number of neighbours of every point: what was asked for, or all the others where there are fewer."""
        return self.index.shape[1]

    def wider(self, rows: NDArray, k: int, threads: int | None = None) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Find k neighbours of some points: rows and distances, each (len(rows), k) or as many as there are."""
        k = min(k, len(self.points) - 1)
        if k == 0:
            return np.empty((len(rows), 0), np.int32), np.empty((len(rows), 0))
        others = np.arange(2, k + 2)  # the nearest is the point itself
        distance, index = self.tree.query(self.tree.data[rows], others, workers=workers(threads))
        if distance[:, 0].min() == 0.0:  # unless squares underflow
            distance, index = self.tree.query(self.tree.data[rows], k + 1)
            own = index == rows[:, None]
            own[~own.any(axis=1), -1] = True
            distance, index = distance[~own].reshape(-1, k), index[~own].reshape(-1, k)
        distance /= self.scale
        return index.astype(np.int32), distance

    def __repr__(self) -> str:
        (m, d), n = self.points.shape, len(self.inverse)
        return f"Neighborhood({n} points in {d}-D, {m} of them distinct, k={self.k})"


def neighbors(points: ArrayLike | Neighborhood, k: int = RING, *, threads: int | None = None) -> Neighborhood:
    """Find the k nearest neighbours of every point among the distinct points.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        A neighbourhood of at least k neighbours is handed back as it is.
    k : int
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    Neighborhood

    Raises
    ------
    InvalidInput
        k < 1; malformed points; a neighbourhood that has fewer than k neighbours.

    Notes
    -----
    k-d tree, O(n log n). Which of equally distant neighbours comes first, or in at all, depends on nothing but positions.

    Examples
    --------
    >>> hood = neighbors([[0.0, 0.0], [3.0, 0.0], [1.0, 0.0], [3.0, 0.0]], k=1)
    >>> hood
    Neighborhood(4 points in 2-D, 3 of them distinct, k=1)
    >>> hood.distance[hood.inverse, 0].tolist(), hood.points[hood.index[hood.inverse, 0]].tolist()
    ([1.0, 2.0, 1.0, 2.0], [[1.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    """
    k = as_whole(k, "k", 1)
    if isinstance(points, Neighborhood):
        if points.k < min(k, len(points.points) - 1):
            raise InvalidInput(f"points: a neighbourhood of {points.k} neighbours, but {shown(k)} are needed")
        return points
    distinct, rows, inverse = _distinct(as_points(points) + 0.0)  # -0.0 is 0.0
    scale = 2.0 ** min(1023.0, -float(np.frexp(np.abs(distinct).max())[1]))  # exact
    tree = cKDTree(distinct * scale, LEAF, balanced_tree=False)  # a median split is slow on quantised coordinates
    empty = Neighborhood(distinct, np.empty((0, 0), np.int32), np.empty((0, 0)), rows, inverse, tree, scale)
    index, distance = empty.wider(np.arange(len(distinct)), k, threads)
    return replace(empty, index=index, distance=distance)


def _distinct(points: NDArray) -> tuple[NDArray, NDArray[np.int64], NDArray[np.int64]]:
    """Distinct points along the curve, then by coordinates; the first row of each; which of them each row is."""
    low, extents = spatial_sort.bounding_box(points)
    order, keys = spatial_sort.sort_keys(curve_keys(points, low, extents.max() or 1.0))
    located = points[order]
    tied = keys[1:] == keys[:-1]
    if not tied.any():
        inverse = np.empty(len(points), np.int64)
        inverse[order] = np.arange(len(points))
        return located, order, inverse
    crowd = np.flatnonzero(np.append(tied, False) | np.append(False, tied))
    by_position = np.lexsort((*located[crowd].T[::-1], keys[crowd]))  # stable: rows of equal points ascend
    order[crowd] = order[crowd][by_position]
    located[crowd] = located[crowd][by_position]
    fresh = np.ones(len(points), bool)
    fresh[1:] = (located[1:] != located[:-1]).any(axis=1)
    inverse = np.empty(len(points), np.int64)
    inverse[order] = np.cumsum(fresh) - 1
    return located[fresh], order[fresh], inverse
