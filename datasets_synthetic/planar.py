"""Straight and circular pieces of the plane, and the regions that they bound: everything in closed form.

A boundary runs counter-clockwise around its region, so that the normal on its right points outward.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .piece import Array, Foot, bounds_of, interval_rule, nearest_of, rejection


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """The straight piece from `start` to `end` [L]; its normal points to the right."""

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def bounds(self) -> Array:
        """Give the exact box, (2, 2)."""
        ends = np.array([self.start, self.end])
        return np.array([ends.min(axis=0), ends.max(axis=0)])

    def reversed(self) -> Segment:
        """Give the same segment with its normal on the other side."""
        return Segment(self.end, self.start)

    def offset(self, by: float) -> Segment:
        """Give the segment moved along its normal."""
        shift = by * self._normal()
        return Segment(tuple(self.start + shift), tuple(self.end + shift))

    def nearest(self, x: Array) -> Foot:
        """Clamp the orthogonal projection."""
        start, along = np.array(self.start), np.subtract(self.end, self.start)
        return self._at(np.clip((x - start) @ along / (along @ along), 0.0, 1.0))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by length."""
        return self._at(rng.random(n))

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give Gauss-Legendre nodes."""
        t, weights = interval_rule(0.0, 1.0, order)
        return self._at(t), weights * float(np.hypot(*np.subtract(self.end, self.start)))

    def _normal(self) -> Array:
        along = np.subtract(self.end, self.start)
        return np.array([along[1], -along[0]]) / np.hypot(*along)

    def _at(self, t: Array) -> Foot:
        points = np.outer(1.0 - t, self.start) + np.outer(t, self.end)  # hits both ends exactly
        return Foot(points, np.tile(self._normal(), (len(t), 1)), np.zeros((len(t), 1)))


@dataclass(frozen=True, slots=True, eq=False)
class Arc:
    """The circular piece around `center` [L] from the angle `start` over `sweep` > 0 [rad].

    `side` is +1 where the normal points away from the centre, -1 where it points towards it. Radius zero is a
    corner: one point with a fan of normals.
    """

    center: tuple[float, float]
    radius: float
    start: float = 0.0
    sweep: float = 2.0 * np.pi
    side: int = 1

    @property
    def bounds(self) -> Array:
        """Give the exact box, (2, 2)."""
        quarters = np.arange(np.ceil(2 * self.start / np.pi), np.floor(2 * (self.start + self.sweep) / np.pi) + 1)
        angles = np.concatenate([[self.start, self.start + self.sweep], quarters * np.pi / 2])
        points = self._at(angles).points
        return np.array([points.min(axis=0), points.max(axis=0)])

    def reversed(self) -> Arc:
        """Give the same arc with its normal on the other side."""
        return replace(self, side=-self.side)

    def offset(self, by: float) -> Arc:
        """Give the concentric arc, moved along the normal."""
        return replace(self, radius=self.radius + self.side * by)

    def nearest(self, x: Array) -> Foot:
        """Clamp the angle; of the centre itself, every point is the nearest, and the start of the arc is given."""
        middle = self.start + 0.5 * self.sweep
        angle = np.arctan2(x[:, 1] - self.center[1], x[:, 0] - self.center[0])
        off = np.remainder(angle - middle + np.pi, 2.0 * np.pi) - np.pi
        return self._at(middle + np.clip(off, -0.5 * self.sweep, 0.5 * self.sweep))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by length."""
        return self._at(self.start + self.sweep * rng.random(n))

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give Gauss-Legendre nodes in the angle."""
        angles, weights = interval_rule(self.start, self.start + self.sweep, order)
        return self._at(angles), self.radius * weights

    def _at(self, angles: Array) -> Foot:
        outward = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        curvature = self.side / self.radius if self.radius > 0 else self.side * np.inf
        points = np.array(self.center) + self.radius * outward
        return Foot(points, self.side * outward, np.full((len(angles), 1), curvature))


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A bounded part of the plane: its boundary pieces, and an independent test of what lies inside.

    Attributes
    ----------
    pieces : tuple of Segment and Arc
        Loops that neither touch nor cross; corners (arcs of radius zero) before their segments.
    contains : callable
        (m, 2) positions -> (m,) bool, true inside.
    """

    pieces: tuple[Segment | Arc, ...]
    contains: Callable[[Array], NDArray[np.bool_]]

    @property
    def bounds(self) -> Array:
        """Give the exact box, (2, 2)."""
        return bounds_of(self.pieces)

    @property
    def area(self) -> float:
        """Give the area [L^2], by the divergence theorem over the boundary."""
        total = 0.0
        for piece in self.pieces:
            foot, weights = piece.rule(16)
            total += 0.5 * float(weights @ np.einsum("ij,ij->i", foot.points, foot.normals))
        return total

    @property
    def lines(self) -> tuple[Segment | Arc, ...]:
        """Give the boundary pieces without the corners: those that have a length."""
        return tuple(piece for piece in self.pieces if not (isinstance(piece, Arc) and piece.radius == 0))

    def minus(self, *holes: Region) -> Region:
        """Cut holes that lie strictly inside and apart from each other."""
        pieces = self.pieces + tuple(piece.reversed() for hole in holes for piece in hole.pieces)

        def contains(x: Array) -> NDArray[np.bool_]:
            inside = self.contains(x)
            for hole in holes:
                inside &= ~hole.contains(x)
            return inside

        return Region(pieces, contains)

    def nearest(self, x: Array) -> Foot:
        """Give the nearest boundary point."""
        return nearest_of(self.pieces, x)

    def draw(self, n: int, rng: np.random.Generator) -> Array:
        """Draw n positions inside, uniform by area, (n, 2)."""
        lower, upper = self.bounds

        def propose(k: int) -> tuple[Foot, Array]:
            x = lower + (upper - lower) * rng.random((k, 2))
            return Foot(x, x, x[:, :1]), self.contains(x).astype(float)

        return rejection(n, propose, rng).points


def disc(radius: float, center: tuple[float, float] = (0.0, 0.0)) -> Region:
    """Make a disc."""
    return Region((Arc(center, radius),), lambda x: np.hypot(x[:, 0] - center[0], x[:, 1] - center[1]) < radius)


def rectangle(width: float, height: float, corner: float = 0.0) -> Region:
    """Make a rectangle around the origin with corners of radius `corner`, which may be zero."""
    a, b = 0.5 * width - corner, 0.5 * height - corner
    turns = ((a, b), (-a, b), (-a, -b), (a, -b))
    corners = [Arc(center, corner, 0.5 * np.pi * k, 0.5 * np.pi) for k, center in enumerate(turns)]
    sides = []
    if a > 0:
        sides += [Segment((a, b + corner), (-a, b + corner)), Segment((-a, -b - corner), (a, -b - corner))]
    if b > 0:
        sides += [Segment((-a - corner, b), (-a - corner, -b)), Segment((a + corner, -b), (a + corner, b))]

    def contains(x: Array) -> NDArray[np.bool_]:
        q = np.abs(x) - (a, b)
        outside = np.maximum(q, 0.0)
        return np.hypot(outside[:, 0], outside[:, 1]) + np.minimum(q.max(axis=1), 0.0) < corner

    return Region((*corners, *sides), contains)
