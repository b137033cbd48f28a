"""Shape of the surface around every sample: normal, curvature, noise; each with how far it can be trusted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput, as_whole
from recon.threads import over_ranges

from ._kernels import smooth
from ._quadric import TERMS, fit_quadrics
from .neighborhood import RING, Neighborhood, neighbors

FIT = 24  # neighbours of a quadric: four for each of its six coefficients
POOLED = 2  # rings over which the noise level is taken together


@dataclass(frozen=True, slots=True, eq=False)
class Curvature:
    """Principal curvatures, with their uncertainty.

    Attributes
    ----------
    normal : (n, 3) ndarray of float64
        Unit, of either sense: neighbours may disagree.
    principal : (n, 2) ndarray of float64 [1/L]
        The larger magnitude first; positive where the surface bends towards `normal`.
    error : (n, 2) ndarray of float64 [1/L]
        Standard error of each, from how well the quadric fits; infinite where the neighbours do not determine it.
    """

    normal: NDArray[np.float64]
    principal: NDArray[np.float64]
    error: NDArray[np.float64]


def curvature(points: ArrayLike | Neighborhood, k: int = FIT, *, threads: int | None = None) -> Curvature:
    """Estimate the principal curvatures at every sample, and how uncertain they are.

    Parameters
    ----------
    points : (n, 3) array_like of float [L], or Neighborhood
    k : int
        Neighbours, 6 or more. More of them mean less scatter from noise, and more bias where curvature changes.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    Curvature

    Raises
    ------
    InvalidInput
        Malformed points, d other than 3, k < 6.

    Notes
    -----
    A quadric over the tangent plane of the k neighbours, by least squares with weights 1 - (d / d_k)^2; its fundamental
    forms at the sample (Cazals & Pouget 2005, degree 2). The error is that of weighted least squares, with the variance
    from the misfit, and, added in squares, |kappa| (kappa_1 d_k)^2 / 5: the bias on a sphere, where
    h = kappa r^2 / 2 + kappa^3 r^4 / 8 and the regression of r^4 on r^2 under these weights is 4/5 d_k^2. O(n k).

    Examples
    --------
    >>> import datasets_synthetic
    >>> ball = datasets_synthetic.surface("sphere").sample(2000, rng=0).points
    >>> np.abs(curvature(ball).principal).mean(axis=0).round(1).tolist()
    [1.0, 1.0]
    """
    hood = neighbors(points, k, threads=threads)
    found = fit(hood, k, threads)
    return Curvature(*(array[hood.inverse] for array in found[:3]))


def noise(points: ArrayLike | Neighborhood, k: int = FIT, *, threads: int | None = None) -> NDArray[np.float64]:
    """Estimate the standard deviation of the samples from a smooth surface, along its normal.

    Parameters
    ----------
    points : (n, 3) array_like of float [L], or Neighborhood
    k : int
        Neighbours, 6 or more.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L]
        Compare it with `spacing`. NaN where there are too few points to say.

    Raises
    ------
    InvalidInput
        Malformed points, d other than 3, k < 6.

    Notes
    -----
    sum of w r^2 over degrees of freedom, r the residuals of the quadric of `curvature`, both pooled over two rings of
    neighbours. The degrees of freedom, tr W - tr((X'WX)^-1 X'W^2 X), make the variance unbiased where the noise is even.
    Creases and features finer than the neighbourhood count as noise, here and only here.

    Examples
    --------
    >>> import datasets_synthetic
    >>> ball = datasets_synthetic.surface("sphere").sample(2000, noise=0.01, rng=0).points
    >>> float(np.median(noise(ball)).round(3))
    0.01
    """
    hood = neighbors(points, k, threads=threads)
    return pooled(hood, *fit(hood, k, threads)[3:])[hood.inverse]


def pooled(hood: Neighborhood, misfit: NDArray[np.float64], freedom: NDArray[np.float64]) -> NDArray[np.float64]:
    """Root of misfit over degrees of freedom, both averaged over neighbours; NaN where there is no freedom."""
    for _ in range(POOLED):
        misfit = smooth(misfit, hood.index, min(RING, hood.k))
        freedom = smooth(freedom, hood.index, min(RING, hood.k))
    return np.sqrt(np.divide(misfit, freedom, out=np.full(len(misfit), np.nan), where=freedom > 0))


def fit(hood: Neighborhood, k: int, threads: int | None) -> tuple[NDArray[np.float64], ...]:
    """Normals, curvatures, errors, misfits and degrees of freedom of distinct points."""
    m, d = hood.points.shape
    if d != 3:
        raise InvalidInput(f"points: a quadric needs d = 3, got {d}")
    k = as_whole(k, "k", TERMS)
    found = np.empty((m, 3)), np.empty((m, 2)), np.empty((m, 2)), np.empty(m), np.empty(m)

    def work(start: int, stop: int) -> None:
        fit_quadrics(hood.points, start, stop, hood.index, hood.distance, min(k, hood.k), *found)

    over_ranges(work, m, threads)
    return found
