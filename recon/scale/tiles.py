"""The facets of W_alpha from tiles, on several threads: the identical result, facet by facet.

Why that is so. A simplex of K_alpha is certified by a sphere of weight at most alpha, orthogonal to its vertices: its
centre y is within sqrt(w_p + alpha) of each vertex p, and a point q in conflict with it, or on it, is within
sqrt(w_q + alpha) of y. So whatever is decided about the simplices of K_alpha at a vertex of a tile, its cells, its facets
and on which sides they are exposed, is decided by the points with

    dist(q, box of the tile) <= sqrt(w_q + alpha) + max over the tile of sqrt(w_p + alpha),

and any more points change nothing. A tile answers for the facets whose lowest row is its own.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels import tiles as kernels
from .._kernels.span import span
from ..alpha import AlphaComplex
from ..boundary import Boundary
from ..contracts import InvalidInput, as_points, as_weights
from ..regular import regular_triangulation


def tiled_boundary(
    points: ArrayLike,
    weights: ArrayLike | None = None,
    alpha: float = 0.0,
    *,
    threads: int = 2,
    tiles: int | None = None,
) -> Boundary:
    """Give the facets of W_alpha: what `alpha_complex(points, weights).boundary(alpha)` gives, from tiles.

    Parameters
    ----------
    points : (n, d) array_like of float [L]
    weights : (n,) array_like of float [L^2], default: all zero
    alpha : float [L^2]
    threads : int
    tiles : int, optional
        Two a thread by default, so that a thread that is done early has something to do. The result does not depend on it.

    Returns
    -------
    Boundary

    Raises
    ------
    InvalidInput
        As `alpha_complex`; or less than one thread or tile.

    Notes
    -----
    Tiles are for points that span three dimensions; others are done in one piece. Worth it where the balls are small
    against the cloud: each tile works on its own points and on a margin of up to twice the largest ball around it.
    """
    located = as_points(points)
    n, d = located.shape
    w = as_weights(weights, n)
    tiles = (2 * threads if threads > 1 else 1) if tiles is None else tiles
    if threads < 1 or tiles < 1:
        raise InvalidInput(f"threads, tiles: expected at least 1, got {threads}, {tiles}")
    if np.isnan(alpha):
        raise InvalidInput("alpha: expected a number, got NaN")
    spanned = span(located) if d == 3 and tiles > 1 else None
    if spanned is None or spanned[0] < 3:
        return AlphaComplex(regular_triangulation(located, w, threads=threads)).boundary(alpha)
    extra = np.sort(spanned[1])  # in every tile: else its points might span less, and be triangulated in their flat
    squares = w + alpha
    radii = np.where(squares >= 0.0, np.sqrt(np.maximum(squares, 0.0)), -1.0)
    tile_of = _cut(located, radii >= 0.0, tiles)

    def work(tile: int) -> Boundary:
        low, high, largest = kernels.extent(located, radii, tile_of, tile)
        if largest < 0.0:
            return Boundary(np.empty((0, d), np.int32), np.empty(0, bool))
        rows = kernels.within_reach(located, radii, low, high, largest, extra)
        found = AlphaComplex(regular_triangulation(located[rows], w[rows], threads=1)).boundary(alpha)
        facets = rows.astype(np.int32)[found.facets]
        ours = tile_of[facets[:, 0]] == tile
        return Boundary(facets[ours], found.singular[ours])

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(work, range(tiles)))
    return _together(parts, n)


def _cut(points: NDArray[np.float64], chosen: NDArray[np.bool_], tiles: int) -> NDArray[np.int32]:
    """Cut boxes across their longest side, into parts of about even numbers; -1 for points that are in none."""
    tile_of = np.where(chosen, np.int32(0), np.int32(-1))
    some = np.flatnonzero(chosen)[:: len(points) // (1024 * tiles) + 1]
    parts = [(some, 0, tiles)]
    while parts:
        some, first, count = parts.pop()
        if count == 1 or len(some) == 0:
            continue
        sample = points[some]
        axis, half = np.argmax(np.ptp(sample, axis=0)), count // 2
        limit = np.quantile(sample[:, axis], half / count)
        kernels.divide(points, axis, limit, first, first + half, tile_of)
        lower = sample[:, axis] < limit
        parts += [(some[lower], first, half), (some[~lower], first + half, count - half)]
    return tile_of


def _together(parts: list[Boundary], n: int) -> Boundary:
    """Merge facets by their lowest rows, which no two parts share."""
    starts = np.zeros(n + 1, np.int64)
    for part in parts:
        kernels.count_by_row(part.facets[:, 0], starts)
    starts = np.cumsum(starts)
    facets = np.empty((starts[-1], parts[0].facets.shape[1]), np.int32)
    singular = np.empty(starts[-1], bool)
    for part in parts:
        place = np.empty(len(part), np.int64)
        kernels.deal(part.facets[:, 0], starts, place)
        facets[place], singular[place] = part.facets, part.singular
    facets.flags.writeable = singular.flags.writeable = False
    return Boundary(facets, singular)
