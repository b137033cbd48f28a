"""The regular triangulation R(S) of weighted points (paper, section 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from .contracts import as_points, as_weights


@dataclass(frozen=True, slots=True, eq=False)
class RegularTriangulation:
    """The cells of R(S), who is next to whom, and who is no vertex.

    Attributes
    ----------
    points : (n, d) ndarray of float64 [L]
    weights : (n,) ndarray of float64 [L^2]
    cells : (m, k+1) ndarray of int32
        Input rows; positively oriented. k is the dimension of the affine hull of the points: d, or less where they
        span less.
    neighbors : (m, k+1) ndarray of int32
        `neighbors[i, j]` shares the facet opposite `cells[i, j]`; -1 on the hull.
    hidden : (h,) ndarray of int64
        Input rows that are no vertex of R, ascending: duplicates of a heavier or earlier point, and points whose power
        cell is empty.
    """

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    cells: NDArray[np.int32]
    neighbors: NDArray[np.int32]
    hidden: NDArray[np.int64]

    @property
    def dimension(self) -> int:
        """Dimension of the affine hull of the points."""
        return self.cells.shape[1] - 1

    def __repr__(self) -> str:
        n, d = self.points.shape
        return f"RegularTriangulation({n} points in {d}-D, {len(self.cells)} cells, {len(self.hidden)} hidden)"


def regular_triangulation(points: ArrayLike, weights: ArrayLike | None = None) -> RegularTriangulation:
    """Triangulate weighted points regularly.

    Parameters
    ----------
    points : (n, d) array_like of float [L]
    weights : (n,) array_like of float [L^2], default: all zero

    Returns
    -------
    RegularTriangulation
    """
    locations = as_points(points)
    w = as_weights(weights, len(locations))
    return _lower_hull(locations, w)


def _lower_hull(points: NDArray, weights: NDArray) -> RegularTriangulation:
    """Lower convex hull of the lifted points by Qhull."""
    n, d = points.shape
    centered = points - points.mean(axis=0)
    lifted = np.column_stack([centered, (centered**2).sum(axis=1) - weights])
    hull = ConvexHull(lifted, qhull_options="Qt")
    keep = np.flatnonzero(hull.equations[:, d] < 0)
    new = np.full(len(hull.simplices), -1, np.int32)
    new[keep] = np.arange(len(keep))
    cells = hull.simplices[keep].astype(np.int32)
    neighbors = new[hull.neighbors[keep]]
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    flip = np.linalg.det(edges) < 0
    cells[flip, :2] = cells[flip, 1::-1]
    neighbors[flip, :2] = neighbors[flip, 1::-1]
    hidden = np.setdiff1d(np.arange(n), cells)
    return RegularTriangulation(points, weights, cells, neighbors, hidden)
