"""The regular triangulation R(S) of weighted points (paper, section 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contracts import as_points, as_weights
from .threads import workers

# In 3-D, the facet opposite corner k of a positive cell: counter-clockwise seen from outside the cell.
OUTWARD = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


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


def regular_triangulation(
    points: ArrayLike, weights: ArrayLike | None = None, *, threads: int | None = None
) -> RegularTriangulation:
    """Triangulate weighted points regularly: the lower convex hull of their lifted images, dual to the power diagram.

    Exact for the float64 input as given, whatever its position. Ties are broken by raising the weights by
    infinitesimals, more for lower rows: among points of one orthosphere, and among equal points, the lower row wins. So
    the result does not depend on any order of computation. Points that span less than d dimensions are triangulated in
    their affine hull.

    Parameters
    ----------
    points : (n, d) array_like of float [L]
    weights : (n,) array_like of float [L^2], default: all zero
    threads : int, optional
        All by default; of use in 3-D. The result does not depend on it.

    Returns
    -------
    RegularTriangulation

    Raises
    ------
    InvalidInput
        Where the arrays are malformed, not finite, or beyond the admitted range.

    Notes
    -----
    Paper, section 3 and appendix B. Incremental insertion; up to d = 3 in expected time near O(n log n) for points that
    sample a surface or a volume. Beyond, the number of cells decides: 30 a random point in 4-D, 150 in 5-D, 500 and more
    in 6-D, some 10 microseconds each; on input whose signs float64 leaves open (nearly cospherical), up to some ten times that.

    Examples
    --------
    >>> triangulation = regular_triangulation([[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 0.1]], [0, 0, 0, 0, -1])
    >>> sorted(sorted(cell) for cell in triangulation.cells.tolist()), triangulation.hidden.tolist()
    ([[0, 1, 3], [0, 2, 3]], [4])
    """
    located = as_points(points)
    w = as_weights(weights, len(located))
    workers(threads)  # refuses what is no number of threads
    from ._kernels.complex import used_vertices  # imported here, as numba takes a while to load

    if located.shape[1] <= 3:
        from .insertion import triangulate

        cells, neighbors = triangulate(located, w, threads)
    else:
        from .hull import lower_hull

        cells, neighbors = lower_hull(located, w)
    return RegularTriangulation(located, w, cells, neighbors, np.flatnonzero(~used_vertices(cells, len(located))))
