"""A virtual scanner: rays from a viewpoint, traced by the exact distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .gate import as_positions, count, not_negative
from .piece import Array, Foot, length, nearest_of
from .sample import Sample

if TYPE_CHECKING:
    from .surface import Surface

_HIT = 1e-7  # of the size: a ray this near has hit
_STEP = 4e-3  # of the size: the least step along a ray


def scan_surface(surface: Surface, viewpoints: ArrayLike, resolution: int | tuple[int, int], grazing: float) -> Sample:
    """Trace the rays of every viewpoint; see `Surface.scan`."""
    eyes = as_positions(viewpoints, surface.dimension, "viewpoints")
    shape = _resolution(resolution, surface.dimension)
    not_negative(grazing=grazing)
    lower, upper = surface.bounds
    center, radius = 0.5 * (lower + upper), 0.5 * float(np.linalg.norm(upper - lower))
    feet, scans = [surface.draw(0, np.random.default_rng(0))], [np.zeros(0, dtype=np.int64)]
    for index, eye in enumerate(eyes):
        if length(eye[None] - surface.project(eye[None]))[0] <= _HIT * radius:
            raise ValueError(f"viewpoints: row {index} lies on the surface: {eye}")
        rays = _rays(eye, center, radius, shape)
        foot = _trace(surface, eye, rays, center, radius, np.cos(np.radians(grazing)))
        feet.append(foot)
        scans.append(np.full(len(foot.points), index))
    return Sample.of(Foot.joined(feet), np.concatenate(scans))


def _trace(surface: Surface, eye: Array, rays: Array, center: Array, radius: float, least_cosine: float) -> Foot:
    """Walk each ray by its distance to the surface, never less than a small step, and refine where it has crossed."""
    # Enter and leave the ball around the bounds.
    middle = rays @ (center - eye)
    half_sq = radius**2 - (length(eye[None] - center)[0] ** 2 - middle**2)
    rays, middle, half = rays[half_sq > 0], middle[half_sq > 0], np.sqrt(half_sq[half_sq > 0])
    end = middle + half
    least_step = _STEP * radius
    near, far, before = np.zeros(len(rays)), np.maximum(middle - half, 0.0), np.zeros(len(rays))
    hits: list[Foot] = []
    walking = np.flatnonzero(far <= end)
    while len(walking):
        crossed: list[NDArray[np.intp]] = []
        while len(walking):
            height = _height(surface, eye + far[walking, None] * rays[walking])[0]
            # Only the least step leads through the surface, and from close by to close by; not around a rim.
            through = np.maximum(np.abs(before[walking]), np.abs(height)) <= least_step
            through &= before[walking] * height < 0
            crossed.append(walking[through])
            walking, height = walking[~through], height[~through]
            before[walking], near[walking] = height, far[walking]
            far[walking] += np.maximum(np.abs(height), least_step)
            walking = walking[near[walking] <= end[walking]]
        rows = np.concatenate(crossed)
        travelled = _refine(surface, eye, rays[rows], near[rows], far[rows], before[rows])
        height, foot = _height(surface, eye + travelled[:, None] * rays[rows])
        hit = np.abs(height) <= _HIT * radius
        steep = np.abs(np.einsum("md,md->m", foot.normals, rays[rows])) >= least_cosine
        hits.append(foot.take(np.flatnonzero(hit & steep)))
        walking = rows[~hit]  # past a rim, or the seam of a one-sided surface: on they go
        before[walking] = 0.0
    return Foot.joined([surface.draw(0, np.random.default_rng(0)), *hits])


def _height(surface: Surface, x: Array) -> tuple[Array, Foot]:
    """Give the distance, negative behind the nearest surface point (on an open surface too), and that point."""
    foot = nearest_of(surface.pieces, x)
    gap = x - foot.points
    return np.copysign(length(gap), np.einsum("md,md->m", gap, foot.normals)), foot


def _refine(surface: Surface, eye: Array, rays: Array, near: Array, far: Array, before: Array) -> Array:
    """Find where the height changes sign between `near` and `far`: regula falsi, Illinois variant, then halving.

    Around the rim of an open surface the height jumps instead: such rays end at the jump, off the surface.
    """
    low, high = near.copy(), far.copy()
    at_low = before.copy()
    at_high = _height(surface, eye + high[:, None] * rays)[0]
    side = np.zeros(len(rays))
    active = np.flatnonzero(high > low)
    for step in range(80):
        if len(active) == 0:
            break
        a, b = low[active], high[active]
        share = at_low[active] / (at_low[active] - at_high[active]) if step < 20 else 0.5
        middle = a + share * (b - a)
        height = _height(surface, eye + middle[:, None] * rays[active])[0]
        same = np.sign(height) == np.sign(before[active])
        again = side[active] == np.where(same, 1.0, -1.0)
        low[active] = np.where(same, middle, a)
        high[active] = np.where(same, b, middle)
        # Illinois: an end that stays a second time loses half of its weight.
        at_low[active] = np.where(same, height, np.where(again, 0.5, 1.0) * at_low[active])
        at_high[active] = np.where(same, np.where(again, 0.5, 1.0) * at_high[active], height)
        side[active] = np.where(same, 1.0, -1.0)
        # There, or the surface is farther than the bracket is long.
        done = (np.abs(height) <= 1e-12 * (1.0 + np.abs(middle))) | (np.abs(height) > b - a)
        low[active[done]] = high[active[done]] = middle[done]
        active = active[~done]
    return 0.5 * (low + high)


def _rays(eye: Array, center: Array, radius: float, shape: tuple[int, int]) -> Array:
    """Give unit directions on a grid of two angles (one in the plane) that covers the ball, or all around from inside."""
    d = len(eye)
    away = float(np.linalg.norm(center - eye))
    outside = away > radius
    forward = (center - eye) / away if outside else np.eye(d)[0]
    azimuth = np.arcsin(radius / away) if outside else np.pi
    elevation = min(azimuth, 0.5 * np.pi)
    rows, columns = shape
    a = azimuth * (2.0 * (np.arange(columns) + 0.5) / columns - 1.0)
    if d == 2:
        right = np.array([forward[1], -forward[0]])
        return np.outer(np.cos(a), forward) + np.outer(np.sin(a), right)
    e = np.repeat(elevation * (2.0 * (np.arange(rows) + 0.5) / rows - 1.0), columns)
    a = np.tile(a, rows)
    pole = np.eye(3)[2 if abs(forward[2]) < 0.9 else 0]
    right = np.cross(forward, pole)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    return np.outer(np.cos(e) * np.cos(a), forward) + np.outer(np.cos(e) * np.sin(a), right) + np.outer(np.sin(e), up)


def _resolution(resolution: int | tuple[int, int], dimension: int) -> tuple[int, int]:
    if dimension == 2:
        return 1, count(resolution, "resolution in the plane")  # type: ignore[arg-type]
    if not isinstance(resolution, tuple):
        resolution = (resolution, resolution)
    if len(resolution) != 2:
        raise ValueError(f"resolution: expected one number or (rows, columns), got {resolution!r}")
    return count(resolution[0], "rows of the resolution"), count(resolution[1], "columns of the resolution")
