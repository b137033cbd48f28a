"""Thickness, and how large balls may and must be."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import as_floats
from recon.threads import workers

from .neighborhood import Neighborhood, neighbors
from .shape import fit, pooled

CLOSE = 12  # neighbours of the quadric: fewer, so that they come from one side of a thin part
PRECISION = 0.01  # of a radius; so the tree need not look at all of a sphere from its centre
_DEVIATIONS = 3.0  # standard deviations of noise that a sample may lie inside a ball


def thickness(points: ArrayLike | Neighborhood, k: int = CLOSE, *, threads: int | None = None) -> NDArray[np.float64]:
    """Measure how thick the solid, or the gap between two parts of the surface, is at every sample: the thinner of both.

    Parameters
    ----------
    points : (n, 3) array_like of float [L], or Neighborhood
    k : int
        Neighbours that give normal and noise, 6 or more.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L]
        Diameter of the smaller of the two greatest balls that touch the surface at the sample, one on either side, and
        contain no other sample. Infinite where both would be larger than the whole cloud. Half of it bounds the local
        feature size from above.

    Raises
    ------
    InvalidInput
        Malformed points, d other than 3, k < 6.

    Notes
    -----
    Shrinking balls (Ma, Bae & Choi 2012), from the normals of `curvature`, to 1 %. Samples inside by no more than three
    standard deviations of `noise` are no obstacle, so what is thinner than six of them is not resolved,
    nor what is thinner than the reach of the k neighbours. This is the costly term: half a minute for a million points.

    Examples
    --------
    >>> import datasets_synthetic
    >>> ball = datasets_synthetic.surface("sphere").sample(2000, rng=0).points
    >>> float(np.median(thickness(ball)).round(2))
    2.0
    """
    hood = neighbors(points, k, threads=threads)
    found = fit(hood, k, threads)
    slack = _DEVIATIONS * np.nan_to_num(pooled(hood, *found[3:]))
    size = float(np.linalg.norm(np.ptp(hood.points, axis=0)))
    both = [_touching(hood, sense * found[0], slack, size, threads) for sense in (1.0, -1.0)]
    return 2.0 * np.minimum(*both)[hood.inverse]


def _touching(
    hood: Neighborhood, normal: NDArray[np.float64], slack: NDArray[np.float64], size: float, threads: int | None
) -> NDArray[np.float64]:
    """Radii of the greatest balls that touch the samples on the side of the normals and contain no sample."""
    radius = np.full(len(hood.points), size)
    active = np.flatnonzero(radius)
    while len(active):
        p, n, r, within = hood.points[active], normal[active], radius[active], slack[active]
        center = (p + r[:, None] * n) * hood.scale
        near = hood.tree.query(center, eps=PRECISION, workers=workers(threads))[1]
        away = hood.points[near] - p
        height = np.einsum("ij,ij->i", away, n) - within
        square = np.einsum("ij,ij->i", away, away) - within**2
        shrunk = np.divide(square, 2.0 * height, out=np.full(len(r), np.inf), where=(height > 0) & (square > 0))
        smaller = shrunk < (1.0 - PRECISION) * r
        active = active[smaller]
        radius[active] = shrunk[smaller]
    radius[radius >= size] = np.inf
    return radius


def sufficient_weight(
    covering: ArrayLike, feature: ArrayLike, noise: ArrayLike = 0.0, largest: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Give the weight from which on the balls are sure to have the topology of the surface.

    Parameters
    ----------
    covering : array_like of float [L]
        Covering radius e: no point of the surface is farther than this from a sample, along the surface.
    feature : array_like of float [L]
        Local feature size l.
    noise : array_like of float [L]
        Greatest distance D of a sample from the surface.
    largest : array_like of float [L], default: `covering`
        Radius R of the largest ball nearby.

    Returns
    -------
    ndarray of float64 [L^2]
        e^2 (1 + t / l) + 2 D t + t^2, where t = R^2 / l + 2 D.

    Raises
    ------
    InvalidInput
        What is not numeric.

    Notes
    -----
    Every ball nearby meets a normal of the surface in an interval whose middle is at most R^2 / (2 l) + D = t / 2 from
    the surface. A ball of this weight, within e of the foot of the normal, contains all these middles. So each normal
    meets the union of the balls in one interval, and the union shrinks onto the surface along the normals. Only the
    over-coverage R / e matters: weights may vary freely in space.

    Examples
    --------
    >>> float(sufficient_weight(0.1, 1.0).round(6))
    0.0102
    """
    e, l, d = as_floats(covering, "covering"), as_floats(feature, "feature"), as_floats(noise, "noise")
    t = (e if largest is None else as_floats(largest, "largest")) ** 2 / l + 2.0 * d
    return e**2 * (1.0 + t / l) + 2.0 * d * t + t**2
