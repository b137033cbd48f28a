"""Grading: lower weights until no neighbour can hide another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import as_weights

from ._kernels import relax
from .neighborhood import DEFAULT_K, Neighborhood, neighbors

THETA = 0.5


def graded(
    points: ArrayLike | Neighborhood, weights: ArrayLike, theta: float = THETA, k: int = DEFAULT_K
) -> NDArray[np.float64]:
    """Lower weights until they differ by at most theta |p_i - p_j|^2 between neighbours: the greatest such weights.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
    weights : (n,) array_like of float [L^2]
        Duplicates take the lowest weight at their place.
    theta : float
        Below 1, or neighbours hide each other.
    k : int
        Neighbours; a pair counts where either is a neighbour of the other.

    Returns
    -------
    (n,) ndarray of float64 [L^2]
        w_i = min_j (w_j + theta |p_i - p_j|^2), to a fixed point.

    Notes
    -----
    A point j is hidden by i alone where w_i > w_j + |p_i - p_j|^2. The fixed point is unique, whatever the order.
    """
    hood = neighbors(points, k)
    values = as_weights(weights, len(hood.points) if hood.inverse is None else len(hood.inverse)).copy()
    if hood.inverse is not None:
        lowest = np.full(len(hood.points), np.inf)
        np.minimum.at(lowest, hood.inverse, values)
        values = lowest
    k = min(k, hood.k)
    if k:
        order = np.argsort(values, kind="stable")
        while relax(values, hood.index, hood.distance, k, theta, order):
            pass
    return hood.per_input_row(values)
