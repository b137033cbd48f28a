"""Local spacing: how far samples are from each other here."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import as_whole

from ._kernels import smooth
from .neighborhood import RING, Neighborhood, neighbors

ROUNDS = 4
MOST_ROUNDS = 10_000  # averages over a hundred rings; and comes to an end


def spacing(
    points: ArrayLike | Neighborhood, k: int = RING, rounds: int = ROUNDS, *, threads: int | None = None
) -> NDArray[np.float64]:
    """Estimate the local distance between samples of a surface, such that one sample owns spacing^2 of its area.

    Smooth from sample to sample. Duplicates count once and share the value of their place; where all points are one,
    it is 0.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
    k : int
        Neighbours. 8 is one ring around an even sample. On scan lines farther apart than samples along them the estimate
        is right while k neighbours reach the next lines: up to three times as far for 8, ten for 24. See `line_spacing`.
    rounds : int
        Of smoothing. Each round averages over one more ring; 0 gives the plain estimate.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L]

    Raises
    ------
    InvalidInput
        Malformed points, k < 1, rounds < 0 or more than 10,000.

    Notes
    -----
    k neighbours within d_k on an m-dimensional surface, m = d - 1, have a density of k / (V_m d_k^m), V_m the volume of
    the unit ball (Loftsgaarden & Quesenberry 1965), so spacing = (V_m / k)^(1/m) d_k: for surfaces sqrt(pi / k) d_k,
    for curves 2 d_k / k. Its logarithm is then averaged over the point and its neighbours, `rounds` times: the plain
    estimate scatters by 1 / sqrt(k), and a scatter of weights hides points.

    Examples
    --------
    >>> square = [[x, y, 0] for x in range(20) for y in range(20)]
    >>> float(spacing(square).reshape(20, 20)[8:12, 8:12].mean().round(2))
    0.89
    """
    k, rounds = as_whole(k, "k", 1), as_whole(rounds, "rounds", 0, MOST_ROUNDS)
    hood = neighbors(points, k, threads=threads)
    return smooth_spacing(hood, min(k, hood.k), rounds)[hood.inverse]


def plain_spacing(hood: Neighborhood, k: int) -> NDArray[np.float64]:
    """Spacing of distinct points from their k-th neighbour alone; 0 where there is none."""
    m, d = hood.points.shape
    if k == 0:
        return np.zeros(m)
    d = max(d - 1, 1)
    ball = math.pi ** (d / 2) / math.gamma(d / 2 + 1)
    return (ball / k) ** (1 / d) * hood.distance[:, k - 1]


def smooth_spacing(hood: Neighborhood, k: int = RING, rounds: int = ROUNDS) -> NDArray[np.float64]:
    """Spacing of distinct points, its logarithm averaged over neighbours."""
    k = min(k, hood.k)
    return smoothed(plain_spacing(hood, k), hood, k, rounds)


def smoothed(own: NDArray[np.float64], hood: Neighborhood, k: int = RING, rounds: int = ROUNDS) -> NDArray[np.float64]:
    """The logarithm of a spacing averaged over neighbours."""
    k = min(k, hood.k)
    if k == 0 or not own.any():
        return own
    unit = 2.0 ** float(np.frexp(own.max())[1])  # so that scaling by a power of two is exact
    logs = np.log(np.maximum(own / unit, np.finfo(float).tiny))
    for _ in range(rounds):
        logs = smooth(logs, hood.index, k)
    return np.exp(logs) * unit
