"""Terrain: samples seen from above, triangulated in the plan and lifted to their heights.

A laser that flies over trees samples no surface that its points are dense enough for: next to each other in the plan, some lie on a
crown and some on the ground. But from above it sees one height at each place. The graph of a piecewise linear function over a
triangulated plan is called a terrain; it cannot cross itself, and has a handle nowhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import weighting

from .contracts import DegenerateInput
from .samples import Samples

# More than this share of the samples wants mending: of all clouds known, but for lidar over trees and solids full of points, at most a twentieth.
RUGGED = 1 / 16
# A scanner above spaces its samples evenly in the plan, and in space as unevenly as the heights are. Spread of the local spacing about its
# local mean, in the plan over that in space: 0 to 0.7 for lidar over trees, 0.8 and more for all else, outliers and noise included.
EVEN = 3 / 4


def from_above(samples: Samples, threads: int | None) -> Samples:
    """The plan: heights are 0, and of samples at one place the highest counts, the lower row of equal ones.

    Parameters
    ----------
    samples : Samples
    threads : int or None

    Returns
    -------
    Samples
        Lower ones are among those removed.

    Raises
    ------
    DegenerateInput
        All at one place of the plan.
    """
    plan = _plan(samples.points)
    hood = weighting.neighbors(plan, threads=threads)
    if len(hood.points) == 1:
        raise DegenerateInput("surface='terrain': seen from above all points lie in one spot; z must point up")
    kept = np.ones(len(plan), bool)
    kept[samples.removed] = False
    # Place by place, removed ones last, the highest first.
    order = np.lexsort((-samples.points[:, 2], ~kept, hood.inverse))
    top = order[np.append(True, np.diff(hood.inverse[order]) > 0)]
    nearest = top[hood.inverse]
    removed = np.flatnonzero(nearest != np.arange(len(plan)))
    return replace(samples, points=plan, hood=hood, removed=removed, nearest=nearest[removed])


def seen_from_above(points: NDArray[np.float64], threads: int | None) -> bool:
    """Have most samples a place of their own in the plan, and is their spacing more even there than in space?

    Parameters
    ----------
    points : (n, 3) ndarray of float64 [L]
    threads : int or None

    Returns
    -------
    bool
    """
    space = weighting.neighbors(points, threads=threads)
    plan = weighting.neighbors(_plan(points), threads=threads)
    return 2 * len(plan.points) > len(space.points) and _unevenness(plan) < EVEN * _unevenness(space)


def upward(plan: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Faces of a plan that are all seen from the same side, (f, 3), counter-clockwise seen from above."""
    a, b, c = (plan[corners, :2] for corners in faces.T)
    u, v = b - a, c - a
    return faces if (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum() >= 0 else faces[:, ::-1]


def _plan(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same points at height 0."""
    return points * [1.0, 1.0, 0.0]


def _unevenness(hood: weighting.Neighborhood) -> float:
    """Spread, nine tenths to one, of the logarithm of a sample's spacing less the mean of those around it: gradual changes do not count."""
    size = np.log(hood.distance[:, -1])
    return float(np.subtract(*np.quantile(size - size[hood.index].mean(axis=1), [0.9, 0.1])))
