"""Covering radius: how large balls must be here so that the surface between the samples lies inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput, as_number, as_whole
from recon.threads import over_ranges

from ._star import gaps, stars
from .density import smooth_spacing
from .neighborhood import Neighborhood, neighbors

NEAR = 24  # neighbours: gaps of up to 1.4 spacings are seen whole, nine stars in ten even in a random sample
WIDE = 64  # neighbours for the other stars: 2.25 spacings
NORMAL = 12  # neighbours that give the tangent plane
WIDEST = 3.0  # spacings: a disc of this radius stays empty in a random sample with probability exp(-9 pi) = 5e-13


def covering(
    points: ArrayLike | Neighborhood, k: int = NEAR, *, widest: float = WIDEST, threads: int | None = None
) -> NDArray[np.float64]:
    """Estimate the least radii of balls around the samples that cover the surface between them.

    Every sample gets a star: the triangles around it that a Delaunay triangulation of the surface would have. Balls of
    these radii cover every triangle of every star but those that would need more than `widest` spacings: these span
    holes. So, where the stars close up to a surface, the union of the balls has no leak, whatever the density.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        d = 2 (curves: half the distance to the next sample on either side) or 3.
    k : int
        Neighbours. Where a farther one could matter, 64 are looked at.
    widest : float
        In spacings. Beyond 2.25 a gap is seen only where samples on its far side are among the 64 neighbours.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L]
        Never less than half the distance to the nearest neighbour. 0 where all points are one.

    Raises
    ------
    InvalidInput
        Malformed points, d other than 2 or 3, k < 1, widest not above 0.

    Notes
    -----
    The star: from the nearest neighbour, turn around the sample in the tangent plane of its 12 nearest; the next
    corner is the one that sees the last side under the largest angle, measured in space, so that neither curvature nor
    noise is neglected. Equal balls at the corners of a triangle cover it from its circumradius R on; where an angle is
    obtuse, already from max(a / (2 cos B), b / (2 cos A)) on, c being the longest side. The radius of a sample is the
    largest that any triangle with it asks for. O(n log n).

    Examples
    --------
    >>> square = [[x, y, 0] for x in range(9) for y in range(9)]
    >>> round(float(covering(square)[40] ** 2), 12)
    0.5
    """
    k, widest = as_whole(k, "k", 1), as_number(widest, "widest", "a number above 0")
    if not widest > 0.0:
        raise InvalidInput(f"widest: expected a number above 0, got {widest}")
    hood = neighbors(points, k, threads=threads)
    return np.sqrt(cover_sq(hood, coarse_spacing(hood, k), min(k, hood.k), widest, threads))[hood.inverse]


def coarse_spacing(hood: Neighborhood, k: int = NEAR) -> NDArray[np.float64]:
    """Spacing of distinct points by the 8th or by the k-th neighbour: on scan lines the 8th may not reach the next line."""
    return np.maximum(smooth_spacing(hood), smooth_spacing(hood, k))


def cover_sq(
    hood: Neighborhood, local: NDArray[np.float64], k: int, widest: float, threads: int | None
) -> NDArray[np.float64]:
    """Squared covering radii of distinct points, of which `local` is the spacing; where that is 0, nothing is asked for."""
    m, dimension = hood.points.shape
    rows = np.arange(m)
    if dimension not in (2, 3):
        raise InvalidInput(f"points: the covering radius needs d = 2 or 3, got {dimension}")
    if k == 0:
        return np.zeros(m)
    if dimension == 2:
        cover = np.zeros(m)
        gaps(hood.points, rows, hood.index, hood.distance, k, local, widest, cover)
        return cover
    final = k >= min(WIDE, m - 1)
    cover, certain = _grow(hood, rows, (hood.index, hood.distance), k, local, widest, final, threads)
    unsure = np.flatnonzero(~certain)
    if not final and len(unsure):
        wide = hood.wider(unsure, WIDE, threads)
        more, _ = _grow(hood, unsure, wide, wide[0].shape[1], local, widest, True, threads)
        np.maximum(cover, more, out=cover)
    return cover


def _grow(
    hood: Neighborhood,
    rows: NDArray[np.int64],
    around: tuple[NDArray[np.int32], NDArray[np.float64]],
    k: int,
    local: NDArray[np.float64],
    widest: float,
    final: bool,
    threads: int | None,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Squared radii, of all points, that the stars of some rows ask for; and which of the stars are certain."""
    index, distance = around
    certain = np.empty(len(rows), bool)

    def work(start: int, stop: int) -> NDArray[np.float64]:
        part, cover = slice(start, stop), np.zeros(len(hood.points))
        stars(
            hood.points, rows[part], index[part], distance[part], k, NORMAL, local, widest, final, cover, certain[part]
        )
        return cover

    return np.maximum.reduce(over_ranges(work, len(rows), threads)), certain
