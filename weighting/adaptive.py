"""The default weights."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .density import ROUNDS, spacing
from .grading import THETA, graded
from .neighborhood import RING, Neighborhood, neighbors


def adaptive_weights(
    points: ArrayLike | Neighborhood,
    *,
    k: int = RING,
    rounds: int = ROUNDS,
    theta: float = THETA,
    threads: int | None = None,
) -> NDArray[np.float64]:
    """Weigh every point by its local spacing, graded so that neighbours hide nobody.

    Parameters
    ----------
    points : (n, d) array_like of float [L], or Neighborhood
    k, rounds
        See `spacing`.
    theta : float
        See `graded`.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n,) ndarray of float64 [L^2]
        Squared radii.
    """
    hood = neighbors(points, k, threads=threads)
    return graded(hood, spacing(hood, k, rounds) ** 2, theta, k)
