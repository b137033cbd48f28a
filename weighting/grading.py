"""Grading: lower weights until no neighbour can hide another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput, as_number, as_weights, as_whole

from ._kernels import relax
from .neighborhood import RING, Neighborhood, neighbors

THETA = 0.5


def graded(
    points: ArrayLike | Neighborhood, weights: ArrayLike, theta: float = THETA, k: int = RING
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

    Raises
    ------
    InvalidInput
        Malformed points or weights, theta not between 0 and 1, k < 1.

    Notes
    -----
    A point j is hidden by i alone where w_i > w_j + |p_i - p_j|^2. The fixed point is unique, whatever the order.
    """
    theta, k = between_0_and_1(theta), as_whole(k, "k", 1)
    hood = neighbors(points, k)
    values = as_weights(weights, len(hood.inverse))
    lowest = values[hood.rows]
    if len(lowest) < len(values):
        np.minimum.at(lowest, hood.inverse, values)
    return lowered(hood, lowest, theta, min(k, hood.k))[hood.inverse]


def between_0_and_1(theta: float) -> float:
    """Refuse other slopes: from 1 on neighbours hide each other, below 0 there is no fixed point."""
    slope = as_number(theta, "theta", "a number between 0 and 1")
    if not 0.0 < slope < 1.0:
        raise InvalidInput(f"theta: expected a number between 0 and 1, got {slope}")
    return slope


def lowered(
    hood: Neighborhood, values: NDArray[np.float64], factor: float, k: int, power: int = 2
) -> NDArray[np.float64]:
    """Lower values of distinct points to v_i = min_j (v_j + factor |p_i - p_j|^power), in place."""
    backward = False
    while relax(values, hood.index, hood.distance, k, factor, power, backward):
        backward = not backward
    return values


def raised(hood: Neighborhood, values: NDArray[np.float64], theta: float, k: int) -> NDArray[np.float64]:
    """Raise weights of distinct points to w_i = max_j (w_j - theta |p_i - p_j|^2): the least such weights."""
    return -lowered(hood, -values, theta, k)
