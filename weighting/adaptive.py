"""Weights for every sample, from its surroundings alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput

from .covering import NEAR, WIDEST, cover_sq
from .density import spacing
from .grading import THETA, lowered, raised
from .neighborhood import RING, Neighborhood, neighbors

MARGIN = 1.1  # of the weight, 5 % of the radius: what neighbouring stars may disagree


def adaptive_weights(
    points: ArrayLike | Neighborhood,
    *,
    radius: str = "spacing",
    theta: float = THETA,
    threads: int | None = None,
) -> NDArray[np.float64]:
    """Weigh every point by its surroundings, graded so that no neighbour hides another.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        With at least 8 neighbours for "spacing", 24 for "covering".
    radius : {"spacing", "covering"}
        "spacing": the local distance between samples, lowered where needed. Small balls, for the void labels.
        "covering": 1.1 times the square of the least radius that covers the surface between the samples, raised where
        needed, so that W_0 itself has no leak. d = 2 or 3.
    theta : float
        See `graded`.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L^2]
        Squared radii. 0 where all points are one.

    Raises
    ------
    InvalidInput
        Malformed points, an unknown radius, d other than 2 or 3 for "covering".

    Notes
    -----
    See `spacing`, `covering` and `graded` for the terms.
    """
    if radius == "spacing":
        hood = neighbors(points, RING, threads=threads)
        return lowered(hood, spacing(hood)[hood.rows] ** 2, theta, min(RING, hood.k))[hood.inverse]
    if radius != "covering":
        raise InvalidInput(f"radius: expected 'spacing' or 'covering', got {radius!r}")
    hood = neighbors(points, NEAR, threads=threads)
    if hood.k == 0:
        return np.zeros(len(hood.inverse))
    cover = cover_sq(hood, spacing(hood)[hood.rows], min(NEAR, hood.k), WIDEST, threads)
    return raised(hood, MARGIN * cover, theta, min(RING, hood.k))[hood.inverse]
