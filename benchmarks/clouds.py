"""The clouds that are timed: seeded, made in a second, no file needed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Cloud = tuple[NDArray[np.float64], NDArray[np.float64]]


def torus(n: int, ratio: float = 10.0, noise: float = 1e-3) -> Cloud:
    """Torus of radii 1 and 0.4, its density varying by `ratio` around the axis; weights (1.5 d_8)**2."""
    rng = np.random.default_rng(1)
    kept: list[NDArray] = []
    while sum(map(len, kept)) < n:
        u, v = rng.uniform(0, 2 * np.pi, (2, 4 * n))
        density = (1 + 0.4 * np.cos(v)) / 1.4 * ratio ** ((np.cos(u) - 1) / 2)
        chosen = rng.uniform(size=len(u)) < density
        u, v = u[chosen], v[chosen]
        ring = 1 + 0.4 * np.cos(v)
        kept.append(np.column_stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)]))
    points = np.concatenate(kept)[:n]
    points += rng.normal(size=points.shape) * noise
    spacing = cKDTree(points).query(points, 9, workers=-1)[0][:, 8]
    return points, (1.5 * spacing) ** 2


def cube(n: int) -> Cloud:
    """Uniform in the unit cube, no weights."""
    return np.random.default_rng(2).uniform(size=(n, 3)), np.zeros(n)


def sphere(n: int) -> Cloud:
    """On the unit sphere, as exactly as float64 has it: the filters fail."""
    points = np.random.default_rng(3).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None], np.zeros(n)


def grid(n: int) -> Cloud:
    """A cube of integers: every cell is cospherical with its neighbours."""
    side = np.arange(round(n ** (1 / 3)), dtype=float)
    points = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.zeros(len(points))


def tenths(n: int) -> Cloud:
    """The same at a spacing that binary does not have."""
    points, weights = grid(n)
    return points / 10, weights


CLOUDS = {f.__name__: f for f in (torus, cube, sphere, grid, tenths)}
