"""Where on a surface the points go: by area or by a density, at random or evenly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from .gate import as_positions, not_negative
from .piece import Array, Foot, length, rejection

if TYPE_CHECKING:
    from .surface import Surface

Density = str | float | Callable[[Array], ArrayLike]
Ball = tuple[ArrayLike, float]

SPACINGS = ("random", "blue")
LARGEST_RATIO = 50.0  # of the curvature-proportional density
_CANDIDATES = 4  # blue noise: candidates per point that stays
_PATIENCE = 30  # blue noise: one candidate in so many goes in a round, so that the crowded go first
_NEIGHBORS = 24  # blue noise: neighbours that are held against each candidate
_ACROSS = 1.0, 0.5, 0.3  # scan lines: direction, from the longest side of the bounds to the shortest
_FARTHEST = 1000.0  # scan lines: times as far apart as points along them
_PROBES = 2000  # scan lines: points that the mean slope is taken from
_STEPS = 6  # scan lines: moves of each candidate onto its line
_FLATTEST = 0.1  # scan lines: least sine of the angle between the surface and the planes


def sample_surface(
    surface: Surface,
    n: int,
    density: Density,
    spacing: str,
    lines: float,
    holes: Sequence[Ball],
    rng: np.random.Generator,
) -> Foot:
    """Draw n points of a surface.

    Parameters
    ----------
    surface : Surface
    n : int
    density : "area", "curvature", float >= 1 or callable
        See `Surface.sample`.
    spacing : {"random", "blue"}
    lines : float
        Above 1: scan lines, see `Surface.sample`.
    holes : sequence of (center (d,) [L], radius [L])
        Balls that no point is taken from.
    rng : numpy.random.Generator

    Returns
    -------
    Foot

    Raises
    ------
    ValueError
        A density, spacing, line or hole that cannot be meant; a density that leaves nothing.
    """
    if spacing not in SPACINGS:
        raise ValueError(f"spacing: expected one of {', '.join(SPACINGS)}, got {spacing!r}")
    not_negative(lines=lines)
    if not 1 <= lines <= _FARTHEST or (lines > 1 and surface.dimension != 3):
        raise ValueError(
            f"lines: how many times as far apart as points along them, 1 to 1000, and in space; got {lines!r}"
        )
    relative = relative_density(surface, density)
    balls = [_ball(ball, surface.dimension) for ball in holes]

    tally = np.zeros(2)

    def propose(k: int) -> tuple[Foot, Array]:
        foot = surface.draw(k, rng)
        kept = relative(foot)
        for center, radius in balls:
            kept = np.where(length(foot.points - center) < radius, 0.0, kept)
        tally[:] += kept.sum(), k
        return foot, kept

    if n == 0:
        return surface.draw(0, rng)
    if spacing == "random" and lines == 1:
        return rejection(n, propose, rng)
    if lines > 1:
        rule = Lines.of(surface, float(np.sqrt(surface.area / n * lines)), rng)

        def propose_on_lines(k: int) -> tuple[Foot, Array]:
            foot, kept = propose(k)
            foot, along = rule.move(surface, foot)
            return foot, kept * along

    candidates = rejection(_CANDIDATES * n, propose if lines == 1 else propose_on_lines, rng)
    share = surface.area * tally[0] / tally[1] / n / relative(candidates)
    if lines > 1:
        share *= np.sqrt(3.0) / 2.0 / lines  # one in a row, not one in an even packing
    return candidates.take(thin(candidates, share, n, two_sided=surface.orientable))


@dataclass(frozen=True, slots=True)
class Lines:
    """A pile of parallel planes in space, `gap` apart [L], the first one `phase` from the origin [L]."""

    across: Array
    gap: float
    phase: float

    @classmethod
    def of(cls, surface: Surface, gap: float, rng: np.random.Generator) -> Lines:
        """Planes mostly across the longest side of a surface, and to no side parallel; the mean distance along the surface is `gap`."""
        across = np.empty(3)
        across[np.argsort(surface.bounds[0] - surface.bounds[1], kind="stable")] = _ACROSS
        across /= np.linalg.norm(across)
        normals = surface.draw(_PROBES, rng).normals
        gap *= float(np.sqrt(1.0 - (normals @ across) ** 2).mean())
        return cls(across, gap, gap * float(rng.uniform()))

    def move(self, surface: Surface, foot: Foot) -> tuple[Foot, Array]:
        """Move points along a surface to the nearest plane each; which share of them (m,) makes them as many a length everywhere.

        None of those that reach no plane: where the surface is next to parallel to them, or ends.
        """
        height = (foot.points @ self.across - self.phase) / self.gap
        height = np.round(height) * self.gap + self.phase
        for step in range(_STEPS + 1):
            uphill = self.across - (foot.normals @ self.across)[:, None] * foot.normals
            steep = length(uphill)
            missing = height - foot.points @ self.across
            if step < _STEPS:
                move = (missing / np.maximum(steep, _FLATTEST) ** 2)[:, None] * uphill
                foot = surface.nearest(foot.points + move)
        reached = (np.abs(missing) < 1e-3 * self.gap) & (steep > _FLATTEST)
        return foot, np.where(reached, steep, 0.0)


def relative_density(surface: Surface, density: Density) -> Callable[[Foot], Array]:
    """Turn what the caller asked for into a density between 0 and 1.

    Parameters
    ----------
    surface : Surface
    density : "area", "curvature", float >= 1 or callable

    Returns
    -------
    callable
        Foot -> (m,) ndarray of float64, relative to its largest.
    """
    lower, upper = surface.bounds
    if isinstance(density, str):
        if density == "area":
            return lambda foot: np.ones(len(foot.points))
        if density == "curvature":
            least = 1.0 / float(np.linalg.norm(upper - lower))
            most = LARGEST_RATIO * least
            return lambda foot: np.clip(np.abs(foot.curvatures).max(axis=1), least, most) / most
        raise ValueError(f"density: expected 'area', 'curvature', a ratio or a function, got {density!r}")
    if callable(density):
        return lambda foot: _checked(density(foot.points), len(foot.points))
    not_negative(density=density)
    if density < 1:
        raise ValueError(f"density: the ratio of the largest to the smallest is at least 1, got {density!r}")
    axis = int((upper - lower).argmax())
    return lambda foot: density ** (np.clip((foot.points[:, axis] - lower[axis]) / (upper - lower)[axis], 0, 1) - 1)


def thin(candidates: Foot, share: Array, n: int, two_sided: bool = True) -> NDArray[np.intp]:
    """Choose n of the candidates so that they keep apart: sample elimination after Yuksel (2015), in parallel.

    Every candidate is crowded by its neighbours, by (1 - distance / D)^8 each, with D the distance in the tightest
    packing. In rounds, whoever is more crowded than all its neighbours goes. Neighbours on the other side of a thin
    wall, whose normals are opposed, do not count.

    Parameters
    ----------
    candidates : Foot
    share : (m,) ndarray of float64 [L^(d-1)]
        How much of the surface a point that stays there is to have.
    n : int
        At most m.
    two_sided : bool
        False where normals do not tell the sides of a wall: on a surface that has one side only.

    Returns
    -------
    (n,) ndarray of intp
        Ascending rows of `candidates`.

    Notes
    -----
    Deterministic. O(m log m), up to 24 pairs a candidate in memory.
    """
    m, d = candidates.points.shape
    order = cKDTree(candidates.points).indices  # neighbours in space are neighbours in memory: three times as fast
    points, normals = candidates.points[order], candidates.normals[order]
    apart = share[order] if d == 2 else np.sqrt(2.0 / np.sqrt(3.0) * share[order])
    distance, j = cKDTree(points).query(points, min(_NEIGHBORS + 1, m))
    i = np.repeat(np.arange(m), distance.shape[1])
    j, distance = j.ravel(), distance.ravel()
    spread = 0.5 * (apart[i] + apart[j])
    close = np.flatnonzero((i != j) & (distance < spread))
    i, j, push = i[close], j[close], (1.0 - distance[close] / spread[close]) ** 8
    once = np.unique(np.minimum(i, j) * m + np.maximum(i, j), return_index=True)[1]
    if two_sided:
        once = once[np.einsum("md,md->m", normals[i[once]], normals[j[once]]) > 0]
    i, j, push = i[once], j[once], push[once]
    alive = np.ones(m, dtype=bool)
    crowd = np.bincount(i, push, m) + np.bincount(j, push, m)
    excess = m - n
    while excess > 0:
        # Ties go against the lower row, so that among equals there is always one to go.
        i_goes = crowd[i] >= crowd[j]
        stays = ~alive
        stays[np.where(i_goes, j, i)] = True
        goes = np.flatnonzero(~stays)
        goes = goes[np.argsort(-crowd[goes], kind="stable")][: min(excess, 1 + (n + excess) // _PATIENCE)]
        if len(i):  # the lonely go last
            goes = goes[crowd[goes] > 0]
        alive[goes] = False
        excess -= len(goes)
        kept = alive[i] & alive[j]
        i, j, push = i[kept], j[kept], push[kept]
        crowd = np.bincount(i, push, m) + np.bincount(j, push, m)
    return np.sort(order[alive])


def _checked(values: ArrayLike, m: int) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (m,) or not ((array >= 0) & (array <= 1)).all():
        raise ValueError(f"density: the function must give {m} values between 0 and 1, got shape {array.shape}")
    return array


def _ball(ball: Ball, dimension: int) -> tuple[Array, float]:
    try:
        center, radius = ball
    except (TypeError, ValueError) as error:
        raise ValueError(f"holes: expected pairs (center, radius), got {ball!r}") from error
    not_negative(radius=radius)
    return as_positions(np.atleast_2d(center), dimension, "center of a hole")[0], float(radius)
