"""Outliers: samples too far from the others to lie on the same surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput

from ._kernels import off_surface, smooth
from .density import plain_spacing
from .grading import lowered
from .neighborhood import RING, Neighborhood, neighbors

EXCESS = 3.0  # times the spacing to be expected: a ninth of the density
SLOPE = 0.05  # growth of spacing with distance that is to be expected: it doubles within 20 spacings
OFF = 0.2  # of the reach of the neighbours: noise of 0.3 spacings stays below


def outliers(
    points: ArrayLike | Neighborhood, excess: float = EXCESS, *, threads: int | None = None
) -> NDArray[np.bool_]:
    """Recognise samples that are lonely for where they are, and off any surface through their neighbours.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        d = 2 or 3.
    excess : float
        Times the expected spacing.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of bool

    Raises
    ------
    InvalidInput
        Malformed points, d other than 2 or 3, excess not above 1.

    Notes
    -----
    Let s_i be the plain spacing, from the 8th neighbour. A sample is an outlier where s_i > excess times

    - the geometric mean of s_j over its neighbours j: a local outlier factor (Breunig et al. 2000), for single ones; or
    - what is to be expected, min_j (s_j + 0.05 |p_i - p_j|) over all paths through neighbours, for clouds of them,
      each other's neighbours; and the sample and its neighbours lie off their common plane by 0.2 of the 8th distance
      (rms), for a sparse part of a surface is no outlier.

    So a few close together, or as near to the surface as its own samples are to each other, pass unseen.

    Examples
    --------
    >>> import datasets_synthetic
    >>> cloud = datasets_synthetic.surface("torus").sample(5000, outliers=0.01, rng=0)
    >>> found = outliers(cloud.points)
    >>> bool(found[cloud.is_outlier].mean() > 0.85), int(found[~cloud.is_outlier].sum())
    (True, 0)
    """
    hood = neighbors(points, RING, threads=threads)
    return strays(hood, excess)[0][hood.inverse]


def strays(hood: Neighborhood, excess: float = EXCESS) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Outliers among the distinct points, and the spacing to be expected at each."""
    m, d = hood.points.shape
    if d not in (2, 3):
        raise InvalidInput(f"points: outliers need d = 2 or 3, got {d}")
    if not excess > 1.0:
        raise InvalidInput(f"excess: expected above 1, got {excess}")
    k = min(RING, hood.k)
    own = plain_spacing(hood, k)
    if k == 0:
        return np.zeros(m, bool), own
    expected = lowered(hood, own.copy(), SLOPE, k, power=1)
    off = np.empty(m)
    off_surface(hood.points, hood.index, hood.distance, k, off)
    logs = np.log(np.maximum(own, np.finfo(float).tiny))
    around = (smooth(logs, hood.index, k) * (k + 1) - logs) / k
    lonely = logs - around > np.log(excess)
    return lonely | ((own > excess * expected) & (off > OFF)), expected
