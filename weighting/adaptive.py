"""Weights for every sample, from its surroundings alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput

from .covering import NEAR, WIDEST, coarse_spacing, cover_sq
from .density import smooth_spacing
from .grading import THETA, lowered, raised
from .neighborhood import RING, Neighborhood, neighbors
from .stray import strays

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
    See `spacing`, `covering`, `graded` and `outliers` for the terms. An outlier (d = 2 or 3) gets no more than the
    spacing to be expected where it is, and asks for no covering.
    """
    if radius not in ("spacing", "covering"):
        raise InvalidInput(f"radius: expected 'spacing' or 'covering', got {radius!r}")
    hood = neighbors(points, RING if radius == "spacing" else NEAR, threads=threads)
    k = min(RING, hood.k)
    local = smooth_spacing(hood)
    stray = np.zeros(len(local), bool)
    if hood.points.shape[1] in (2, 3):
        stray, expected = strays(hood)
        local[stray] = np.minimum(local, expected)[stray]
    if radius == "spacing":
        return lowered(hood, local**2, theta, k)[hood.inverse]
    cover = cover_sq(hood, np.where(stray, 0.0, coarse_spacing(hood)), min(NEAR, hood.k), WIDEST, threads)
    return raised(hood, MARGIN * cover, theta, k)[hood.inverse]
