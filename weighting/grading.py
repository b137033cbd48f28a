"""Grading: lower weights until no neighbour can hide another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput, as_weights

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
    between_0_and_1(theta)
    hood = neighbors(points, k)
    values = as_weights(weights, len(hood.inverse))
    lowest = values[hood.rows]
    if len(lowest) < len(values):
        np.minimum.at(lowest, hood.inverse, values)
    return lowered(hood, lowest, theta, min(k, hood.k))[hood.inverse]


def between_0_and_1(theta: float) -> None:
    """Refuse other slopes: from 1 on neighbours hide each other, below 0 there is no fixed point."""
    if not 0.0 < theta < 1.0:
        raise InvalidInput(f"theta: expected between 0 and 1, got {theta}")


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
