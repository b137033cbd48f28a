"""Pieces in space that planar pieces make in closed form: flat, swept along z, turned about z, moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .piece import Array, Foot, Piece, descending, interval_rule, rejection
from .planar import Region


@dataclass(frozen=True, slots=True, eq=False)
class Flat:
    """A planar region at the height `z` [L], its normal up (+1) or down (-1)."""

    region: Region
    z: float
    up: int

    @property
    def bounds(self) -> Array:
        """Give the exact box, (2, 3)."""
        return np.column_stack([self.region.bounds, [self.z, self.z]])

    def nearest(self, x: Array) -> Foot:
        """Drop onto the region, or go to its boundary."""
        flat = x[:, :2].copy()
        outside = np.flatnonzero(~self.region.contains(flat))
        flat[outside] = self.region.nearest(flat[outside]).points
        return self._foot(flat)

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by area."""
        return self._foot(self.region.draw(n, rng))

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give one node that carries the whole area."""
        corner = self.region.lines[0].rule(1)[0].points
        return self._foot(corner), np.array([self.region.area])

    def _foot(self, flat: Array) -> Foot:
        m = len(flat)
        points = np.column_stack([flat, np.full(m, self.z)])
        return Foot(points, np.tile([0.0, 0.0, float(self.up)], (m, 1)), np.zeros((m, 2)))


@dataclass(frozen=True, slots=True, eq=False)
class Wall:
    """A planar piece swept from `bottom` to `top` [L] along z."""

    line: Piece
    bottom: float
    top: float

    @property
    def bounds(self) -> Array:
        """Give the box, (2, 3)."""
        return np.column_stack([self.line.bounds, [self.bottom, self.top]])

    def nearest(self, x: Array) -> Foot:
        """Go to the nearest point in the plane, and clamp z."""
        return self._foot(self.line.nearest(x[:, :2]), np.clip(x[:, 2], self.bottom, self.top))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by area."""
        flat = self.line.draw(n, rng)
        return self._foot(flat, self.bottom + (self.top - self.bottom) * rng.random(n))

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give Gauss-Legendre nodes in z times those of the planar piece."""
        flat, weights = self.line.rule(order)
        z, heights = interval_rule(self.bottom, self.top, order)
        rows = np.repeat(np.arange(len(weights)), order)
        return self._foot(flat.take(rows), np.tile(z, len(weights))), np.outer(weights, heights).ravel()

    def _foot(self, flat: Foot, z: Array) -> Foot:
        zero = np.zeros(len(z))
        return Foot(
            np.column_stack([flat.points, z]),
            np.column_stack([flat.normals, zero]),
            descending(flat.curvatures[:, 0], zero),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Revolution:
    """A planar piece in the half-plane (distance from the axis, z) turned about the z axis.

    The nearest point lies in the half-plane of x, so it is the planar piece's own.
    """

    line: Piece

    @property
    def bounds(self) -> Array:
        """Give the box, (2, 3)."""
        (_, bottom), (widest, top) = self.line.bounds
        return np.array([[-widest, -widest, bottom], [widest, widest, top]])

    def nearest(self, x: Array) -> Foot:
        """Go to the nearest point in the half-plane; on the axis, that of the x axis."""
        r = np.hypot(x[:, 0], x[:, 1])
        zero = r == 0
        turn = np.where(zero[:, None], [1.0, 0.0], x[:, :2] / np.where(zero, 1.0, r)[:, None])
        return self._foot(self.line.nearest(np.column_stack([r, x[:, 2]])), turn)

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by area: along the planar piece in proportion to the distance from the axis."""
        widest = self.line.bounds[1, 0]

        def propose(k: int) -> tuple[Foot, Array]:
            line = self.line.draw(k, rng)
            return self._turned(line, 2.0 * np.pi * rng.random(k)), line.points[:, 0] / widest

        return rejection(n, propose, rng)

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give the nodes of the planar piece times equal angles."""
        line, weights = self.line.rule(order)
        rows = np.repeat(np.arange(len(weights)), order)
        angles = np.tile(2.0 * np.pi * np.arange(order) / order, len(weights))
        around = 2.0 * np.pi / order * line.points[:, 0]
        return self._turned(line.take(rows), angles), np.repeat(weights * around, order)

    def _turned(self, line: Foot, angles: Array) -> Foot:
        return self._foot(line, np.stack([np.cos(angles), np.sin(angles)], axis=1))

    def _foot(self, line: Foot, turn: Array) -> Foot:
        r, z = line.points.T
        outward, up = line.normals.T
        meridian = line.curvatures[:, 0]
        on_axis = r == 0  # where a smooth surface is round
        parallel = np.where(on_axis, meridian, outward / np.where(on_axis, 1.0, r))
        return Foot(
            np.column_stack([r[:, None] * turn, z]),
            np.column_stack([outward[:, None] * turn, up]),
            descending(meridian, parallel),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """A piece after a rigid motion: x -> rotation @ x + shift [L]."""

    piece: Piece
    rotation: Array
    shift: Array

    @property
    def bounds(self) -> Array:
        """Give the box around the moved box, (2, d)."""
        lower, upper = self.piece.bounds
        middle, half = (
            self.rotation @ (0.5 * (lower + upper)) + self.shift,
            np.abs(self.rotation) @ (0.5 * (upper - lower)),
        )
        return np.array([middle - half, middle + half])

    def nearest(self, x: Array) -> Foot:
        """Move x back, ask, move the answer."""
        return self._foot(self.piece.nearest((x - self.shift) @ self.rotation))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw from the piece, then move."""
        return self._foot(self.piece.draw(n, rng))

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Move the nodes."""
        foot, weights = self.piece.rule(order)
        return self._foot(foot), weights

    def _foot(self, foot: Foot) -> Foot:
        points = foot.points @ self.rotation.T + self.shift
        return Foot(points, foot.normals @ self.rotation.T, foot.curvatures)
