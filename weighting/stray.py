"""Outliers: samples too far from the others to lie on the same surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput, as_number

from ._kernels import off_surface, smooth
from .density import plain_spacing
from .grading import lowered
from .neighborhood import RING, Neighborhood, neighbors

EXCESS = 3.0  # times the spacing to be expected: a ninth of the density
SLOPE = 0.05  # growth of spacing with distance that is to be expected: it doubles within 20 spacings
OFF = 0.2  # of the reach of the neighbours: noise of 0.3 spacings stays below
STEEP = 0.02  # growth of spacing for outliers that are to be removed
APART = 1.5  # times as far and times as many: what makes a cloud of outliers of its own
CLEAR = 4.0  # times as far off the plane of its neighbours as they are: an outlier beside the surface


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
    excess = as_number(excess, "excess", "a number above 1")
    hood = neighbors(points, RING, threads=threads)
    return strays(hood, excess)[0][hood.inverse]


def strays(hood: Neighborhood, excess: float = EXCESS) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Outliers among the distinct points, and the spacing to be expected at each."""
    lonely, ratio, expected = _isolation(hood, excess, SLOPE)
    return lonely | (ratio > excess), expected


def certain_outliers(points: ArrayLike | Neighborhood, *, threads: int | None = None) -> NDArray[np.bool_]:
    """Recognise outliers that can be removed: those of clouds where outliers are a kind of their own.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        d = 2 or 3.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of bool

    Raises
    ------
    InvalidInput
        Malformed points, d other than 2 or 3.

    Notes
    -----
    As `outliers`, with a spacing that is expected to grow by 0.02 of the distance alone, so that outliers are seen among
    each other too. In return none is removed unless they stand apart: half as many again lie beyond 4.5 times the expected spacing as between
    3 and 4.5 times. On sparse parts of a surface, and the more the sparser, it is the other way round.

    Where they do, those beside the surface are outliers as well: samples with no more than one other within the spacing
    there, by more than that off the plane of their neighbours (all eight but the one farthest from it), by four times
    as much as any of these, and as is usual among such samples. Repeated without those removed, until no more are
    found. An outlier within one spacing of the surface, or four times its noise, passes for a sample.

    Examples
    --------
    >>> import datasets_synthetic
    >>> cloud = datasets_synthetic.surface("torus").sample(5000, outliers=0.1, rng=0)
    >>> found = certain_outliers(cloud.points)
    >>> bool(found[cloud.is_outlier].mean() > 0.9), int(found[~cloud.is_outlier].sum())
    (True, 0)
    """
    hood = neighbors(points, RING, threads=threads)
    kept, here = np.arange(len(hood.points)), hood
    while True:
        lonely, ratio, _ = _isolation(here, EXCESS, STEEP)
        sparse, far = ratio > EXCESS, ratio > APART * EXCESS
        if here is hood and far.sum() <= APART * (sparse & ~far).sum():
            break  # they do not stand apart
        found = lonely | sparse if here is hood else lonely | sparse | _beside(here)
        if not found.any():
            break
        here = neighbors(here.points[~found], RING, threads=threads)
        kept = kept[~found][here.rows]
    removed = np.ones(len(hood.points), bool)
    removed[kept] = False
    return removed[hood.inverse]


def _isolation(
    hood: Neighborhood, excess: float, slope: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]:
    """Which distinct points are lonely; spacing over the expected one, 0 where that is an excess but they lie in their neighbours' plane; and that."""
    m, d = hood.points.shape
    if d not in (2, 3):
        raise InvalidInput(f"points: outliers need d = 2 or 3, got {d}")
    if not excess > 1.0:
        raise InvalidInput(f"excess: expected above 1, got {excess}")
    k = min(RING, hood.k)
    own = plain_spacing(hood, k)
    if k == 0:
        return np.zeros(m, bool), np.zeros(m), own
    expected = lowered(hood, own.copy(), slope, k, power=1)
    logs = np.log(np.maximum(own, np.finfo(float).tiny))
    lonely = logs - _around(logs, hood, k) > np.log(excess)
    ratio = np.divide(own, expected, out=np.zeros(m), where=expected > 0)
    sparse = np.flatnonzero(ratio > excess)
    off = np.empty(len(sparse))
    off_surface(hood.points, sparse, hood.index, hood.distance, k, off)
    ratio[sparse[off <= OFF]] = 0.0
    return lonely, ratio, expected


def _beside(hood: Neighborhood) -> NDArray[np.bool_]:
    """Distinct points that stand alone, or nearly, off the plane of their neighbours."""
    m, d = hood.points.shape
    found = np.zeros(m, bool)
    if hood.k < RING:
        return found
    spacing = np.exp(_around(np.log(np.maximum(plain_spacing(hood, RING), np.finfo(float).tiny)), hood, RING))
    alone = np.flatnonzero(hood.distance[:, 1] > spacing)
    ring = (hood.points[hood.index[alone, :RING]] - hood.points[alone, None]) / spacing[alone, None, None]
    _, off = _planes(ring)
    others = np.arange(RING) != off.argmax(axis=1)[:, None]
    height, off = _planes(ring[others].reshape(-1, RING - 1, d))
    usual = np.median(height) if len(alone) else 0.0
    found[alone] = (height > max(1.0, CLEAR * usual)) & (height > CLEAR * off.max(axis=1, initial=0.0))
    return found


def _planes(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances from the planes that fit sets of points (m, k, d) best: of the origin (m,), and of the points (m, k)."""
    middle = corners.mean(axis=1, keepdims=True)
    centred = corners - middle
    normal = np.linalg.eigh(centred.transpose(0, 2, 1) @ centred)[1][:, :, :1]
    return np.abs(middle @ normal)[:, 0, 0], np.abs(centred @ normal)[:, :, 0]


def _around(values: NDArray[np.float64], hood: Neighborhood, k: int) -> NDArray[np.float64]:
    """Mean over the neighbours of each point, without itself."""
    return (smooth(values, hood.index, k) * (k + 1) - values) / k
