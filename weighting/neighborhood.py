"""The k nearest neighbours of every sample: one query, shared by every term."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from recon.contracts import InvalidInput, as_points

DEFAULT_K = 8


@dataclass(frozen=True, slots=True, eq=False)
class Neighborhood:
    """Distinct points and their nearest neighbours.

    Attributes
    ----------
    points : (m, d) ndarray of float64 [L]
        The distinct points, in the order of their first input row.
    index : (m, k) ndarray of int32
        Rows of `points`, nearest first, never the point itself.
    distance : (m, k) ndarray of float64 [L]
    inverse : (n,) ndarray of int64, or None
        The row of `points` that each input row is; None where the input had no duplicates.
    """

    points: NDArray[np.float64]
    index: NDArray[np.int32]
    distance: NDArray[np.float64]
    inverse: NDArray[np.int64] | None

    @property
    def k(self) -> int:
        """Number of neighbours of every point: what was asked for, or all the others where there are fewer."""
        return self.index.shape[1]

    def per_input_row(self, values: NDArray) -> NDArray:
        """Hand the values of distinct points to the input rows."""
        return values if self.inverse is None else values[self.inverse]

    def __repr__(self) -> str:
        m, d = self.points.shape
        return f"Neighborhood({m} distinct points in {d}-D, k={self.k})"


def neighbors(points: ArrayLike | Neighborhood, k: int = DEFAULT_K, *, threads: int | None = None) -> Neighborhood:
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
    k-d tree, O(n log n). Which of several equally distant points comes first is unspecified but always the same.
    """
    if k < 1:
        raise InvalidInput(f"k: expected at least 1 neighbour, got {k}")
    if isinstance(points, Neighborhood):
        if points.k < min(k, len(points.points) - 1):
            raise InvalidInput(f"points: a neighbourhood of {points.k} neighbours, but {k} are needed")
        return points
    located = as_points(points)
    distinct, inverse = _distinct(located)
    k = min(k, len(distinct) - 1)
    if k == 0:
        return Neighborhood(distinct, np.empty((len(distinct), 0), np.int32), np.empty((len(distinct), 0)), inverse)
    scale = np.exp2(-np.ceil(np.log2(np.abs(distinct).max())))  # exact; keeps squares in range
    tree = cKDTree(distinct * scale, balanced_tree=False)  # a median split is quadratic on quantised coordinates
    distance, index = tree.query(tree.data, k + 1, workers=-1 if threads is None else threads)
    return Neighborhood(distinct, *_without_self(index, distance / scale), inverse)


def _without_self(index: NDArray, distance: NDArray) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Drop the point itself from its neighbours: first, but where distances underflow."""
    rows = np.arange(len(index))
    late = np.flatnonzero(index[:, 0] != rows)
    for i in late:
        own = np.flatnonzero(index[i] == i)
        at = own[0] if len(own) else -1
        index[i, 1 : at + 1 or None] = index[i, : at or None] if at > 0 else index[i, :-1]
    return np.ascontiguousarray(index[:, 1:], dtype=np.int32), np.ascontiguousarray(distance[:, 1:])


def _distinct(points: NDArray) -> tuple[NDArray, NDArray[np.int64] | None]:
    """Distinct points by first row, and which of them each row is; no inverse where all are distinct."""
    points = points + 0.0  # -0.0 is 0.0
    keys = _hash(points)
    keys.sort()
    if len(keys) < 2 or (keys[1:] != keys[:-1]).all():
        return points, None
    order = np.lexsort(points.T[::-1])
    fresh = np.ones(len(points), bool)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    group = np.cumsum(fresh) - 1
    first = np.minimum.reduceat(order, np.flatnonzero(fresh))
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    inverse = np.empty(len(points), np.int64)
    inverse[order] = rank[group]
    return points[np.sort(first)], inverse


def _hash(points: NDArray) -> NDArray[np.uint64]:
    """Mix the bits of each row; equal rows have equal keys."""
    key = np.zeros(len(points), np.uint64)
    for column in points.T:
        key ^= np.ascontiguousarray(column).view(np.uint64)
        key *= np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    return key
