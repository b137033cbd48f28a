"""Scan lines: samples that lie closer to each other along a line than the next line is."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.threads import over_ranges

from ._kernels import beside_a_line
from .density import plain_spacing, smoothed
from .neighborhood import RING, Neighborhood, neighbors

MOST = 128  # neighbours, which reach lines 64 times as far apart as samples along them
LOOKED_AT = 256  # samples that tell of all
EVEN = 1.6  # on lines 4 times as far apart as samples along them, 8 neighbours do not reach the next; of every other sample they do
AT_ONCE = 1 << 18  # samples whose neighbours are looked for at a time


def line_spacing(points: ArrayLike | Neighborhood, *, threads: int | None = None) -> NDArray[np.float64]:
    """Estimate how far samples of a surface are apart where they are widest apart: across scan lines, if they lie on such.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        With at least 8 neighbours.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L]
        `spacing`, where samples lie on no lines, or on lines more than 64 times as far apart as samples along them, or d is not 3.

    Raises
    ------
    InvalidInput
        Malformed points.

    Notes
    -----
    As `spacing`, but where 8 neighbours lie on a line with the sample, the distance is that of the first that is off the line: what the eighth
    would have if samples along the lines were thinned out until they are even. A line: the second moments of the offsets have one
    large eigenvalue and two small ones, (l1 l2 + l2 l3 + l3 l1) < (l1 + l2 + l3)^2 / 30, and so for most of the neighbours. Off it:
    as far from all nearer samples as from this one, but for a factor of sqrt(2). So a line that bends is a line.

    Examples
    --------
    >>> import weighting
    >>> lines = [[x, 10.0 * y, 0.0] for x in range(90) for y in range(9)]
    >>> middle = lines.index([45.0, 40.0, 0.0])
    >>> float(weighting.spacing(lines)[middle].round(1)), float(line_spacing(lines)[middle].round(1))
    (2.5, 6.3)
    """
    hood = neighbors(points, RING, threads=threads)
    return smoothed(across(hood, threads), hood)[hood.inverse]


def across(hood: Neighborhood, threads: int | None) -> NDArray[np.float64]:
    """Line spacing of distinct points, not smoothed."""
    k = min(RING, hood.k)
    own = plain_spacing(hood, k)
    if k < RING or hood.points.shape[1] != 3 or not own.any():
        return own
    on_line = _enough(hood.points, np.arange(len(own)), hood.index, hood.distance, threads) == 0
    if not on_line.any():
        return own
    on_line &= on_line[hood.index[:, :k]].sum(axis=1) > k // 2
    for some in np.array_split(np.flatnonzero(on_line), 1 + np.count_nonzero(on_line) // AT_ONCE):
        width = k
        while len(some) and width < min(MOST, len(own) - 1):
            width *= 2
            index, distance = hood.wider(some, width, threads)
            enough = _enough(hood.points, some, index, distance, threads)
            found = enough > 0
            own[some[found]] *= distance[found, enough[found] - 1] / hood.distance[some[found], k - 1]
            some = some[~found]
    return own


def _enough(
    points: NDArray[np.float64], rows: NDArray, index: NDArray, distance: NDArray, threads: int | None
) -> NDArray[np.int64]:
    """How many neighbours it takes, 8 or more, until they lie on no line with a point; 0 where all do."""
    out = np.empty(len(rows), np.int64)

    def work(a: int, b: int) -> None:
        beside_a_line(points, rows[a:b], index[a:b], distance[a:b], RING, out[a:b])

    over_ranges(work, len(rows), threads)
    return out


def thinning(hood: Neighborhood, threads: int | None) -> int:
    """One in how many samples lies evenly: 1, unless a quarter of the samples or more lie on lines, noisy ones too.

    Noise takes samples off their line, but along the normal; so the offsets are looked at in the plane of 128 neighbours.
    """
    k, n = min(RING, hood.k), len(hood.points)
    rows = np.arange(0, n, max(1, n // LOOKED_AT))
    if k < RING or hood.points.shape[1] != 3:
        return 1
    index, distance = hood.wider(rows, MOST, threads)
    unit = distance[:, k - 1]
    if not unit.all():
        return 1
    offset = (hood.points[index] - hood.points[rows, None]) / unit[:, None, None]
    centered = offset - offset.mean(axis=1, keepdims=True)
    frame = np.linalg.eigh(np.einsum("nki,nkj->nij", centered, centered))[1][:, :, 1:]  # of the plane
    flat = np.einsum("nki,nij->nkj", offset, frame)
    own, others = np.arange(len(rows)), np.arange(index.size).reshape(index.shape)
    shadows = np.concatenate([flat.reshape(-1, 2), np.zeros((len(rows), 2))])
    enough = _enough(shadows, index.size + own, others, np.linalg.norm(flat, axis=2), threads)
    reached = np.quantile(np.where(enough > 0, distance[own, enough - 1], unit) / unit, 0.75)
    return math.ceil(EVEN * float(reached)) if reached > 1.0 else 1
