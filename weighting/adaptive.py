"""Weights for every sample, from its surroundings alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput, as_number, shown

from .covering import NEAR, WIDEST, coarse_spacing, cover_sq
from .density import smooth_spacing
from .grading import THETA, between_0_and_1, lowered, raised
from .neighborhood import RING, Neighborhood, neighbors
from .shape import fit
from .stray import strays

MARGIN = 1.1  # of the weight, 5 % of the radius: what neighbouring stars may disagree


def adaptive_weights(
    points: ArrayLike | Neighborhood,
    *,
    radius: str = "spacing",
    cap: float | None = None,
    theta: float = THETA,
    threads: int | None = None,
) -> NDArray[np.float64]:
    """Weigh every point by its surroundings, graded so that no neighbour hides another.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
        With at least 8 neighbours for "spacing", 24 for "covering" or with a cap.
    radius : {"spacing", "covering"}
        "spacing": the local distance between samples, lowered where needed. Small balls, for the void labels.
        "covering": 1.1 times the square of the least radius that covers the surface between the samples, raised where
        needed, so that W_0 itself has no leak. d = 2 or 3.
    cap : float, optional
        Greatest radius of a ball before grading, in radii of curvature, where the curvature is more than twice its
        error: balls larger than that fill creases and swallow thin parts. d = 3.
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
        Malformed points, an unknown radius, cap not above 0, theta not between 0 and 1, d other than 2 or 3 for "covering",
        other than 3 with a cap.

    Notes
    -----
    See `spacing`, `covering`, `curvature`, `graded` and `outliers` for the terms. An outlier (d = 2 or 3) gets no more than the
    spacing to be expected where it is, and asks for no covering.
    """
    if not isinstance(radius, str) or radius not in ("spacing", "covering"):
        raise InvalidInput(f"radius: expected 'spacing' or 'covering', got {shown(radius)}")
    cap = None if cap is None else as_number(cap, "cap", "a number above 0")
    if cap is not None and not cap > 0.0:
        raise InvalidInput(f"cap: expected a number above 0, got {cap}")
    theta = between_0_and_1(theta)
    hood = neighbors(points, RING if radius == "spacing" and cap is None else NEAR, threads=threads)
    k = min(RING, hood.k)
    local = smooth_spacing(hood)
    stray = np.zeros(len(local), bool)
    if hood.points.shape[1] in (2, 3):
        stray, expected = strays(hood)
        local[stray] = np.minimum(local, expected)[stray]
    if radius == "spacing":
        weights = local**2
    else:
        asking = np.where(stray, 0.0, coarse_spacing(hood))
        weights = MARGIN * cover_sq(hood, asking, min(NEAR, hood.k), WIDEST, threads)
    if cap is not None:
        weights = np.minimum(weights, (cap * _bend(hood, threads)) ** 2)
    graded = lowered if radius == "spacing" else raised
    return graded(hood, weights, theta, k)[hood.inverse]


def _bend(hood: Neighborhood, threads: int | None) -> NDArray[np.float64]:
    """Smallest radius of curvature of distinct points [L]; infinite where the curvature is no more than twice its error."""
    _, principal, error, *_ = fit(hood, NEAR, threads)
    largest = np.abs(principal[:, 0])
    return np.divide(1.0, largest, out=np.full(len(largest), np.inf), where=largest > 2.0 * error[:, 0])
