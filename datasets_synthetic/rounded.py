"""The Minkowski sum of a flat prism and a ball: plates with round rims, rounded boxes, pretzels of any genus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .piece import Array, Foot, Piece, descending, interval_rule, length, rejection
from .planar import Arc, Region, Segment
from .solid_pieces import Flat, Wall


@dataclass(frozen=True, slots=True, eq=False)
class Rounded:
    """The boundary of K + ball, with K = region x [-half_height, half_height].

    Closed form, and exact: outside K the distance to the surface is |distance to K - radius|, inside K it is the
    depth plus the radius. That holds while the reach of K exceeds the radius: holes wider than the ball.

    Attributes
    ----------
    region : Region
        Corners (arcs of radius zero) become parts of a sphere.
    half_height : float [L]
        May be zero.
    radius : float [L]
    """

    region: Region
    half_height: float
    radius: float

    @property
    def bounds(self) -> Array:
        """Give the exact box, (2, 3)."""
        out = np.array([[-self.radius], [self.radius]])
        z = self.half_height + self.radius
        return np.column_stack([self.region.bounds + out, [-z, z]])

    def nearest(self, x: Array) -> Foot:
        """Go from the nearest point of K, or of its boundary where x is inside, one radius outward."""
        line = self.region.nearest(x[:, :2])
        inside = self.region.contains(x[:, :2])
        away = x[:, :2] - line.points
        beside = np.where(inside, -1.0, 1.0) * length(away)
        above = np.abs(x[:, 2]) - self.half_height
        up = np.where(x[:, 2] < 0, -1.0, 1.0)
        # Outside K: the foot on K is given by the two excesses; inside, by the nearer of wall and lid.
        out, over = np.maximum(beside, 0.0), np.maximum(above, 0.0)
        to_wall = (beside > above) & (above <= 0)
        to_lid = (above >= beside) & (beside <= 0)
        norm = np.hypot(out, over)
        sine = np.where(to_lid, 1.0, np.where(to_wall, 0.0, over / np.where(norm > 0, norm, 1.0)))
        cosine = np.where(to_lid, 0.0, np.where(to_wall, 1.0, out / np.where(norm > 0, norm, 1.0)))
        # A corner's normal is the direction to x, a line's its own: they differ by rounding only, where both exist.
        foot = np.where(to_lid[:, None], x[:, :2], line.points)
        z = np.where(to_wall, x[:, 2], up * self.half_height)
        normals = np.column_stack([cosine[:, None] * line.normals, up * sine])
        points = np.column_stack([foot, z]) + self.radius * normals
        inner = line.curvatures[:, 0]
        corner = np.isinf(inner)
        inner = np.where(corner, 0.0, inner)
        bend = np.where(corner, 1.0 / self.radius, inner / (1.0 + self.radius * inner))
        rim = ~to_lid & (~to_wall | (self.half_height == 0))
        return Foot(points, normals, self._curvatures(bend, cosine, rim))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw the lids, walls and rims in proportion to their areas."""
        lids, walls, rims = self._lids(), self._walls(), self._lines()
        area = [self.region.area] * 2 + [float(wall.rule(8)[1].sum()) for wall in walls]
        area += [float(self._rim(line, 16)[1].sum()) for line in rims]
        counts = rng.multinomial(n, np.array(area) / np.sum(area))
        flat: tuple[Piece, ...] = (*lids, *walls)
        parts = [piece.draw(k, rng) for piece, k in zip(flat, counts)]
        parts += [self._draw_rim(line, k, rng) for line, k in zip(rims, counts[len(parts) :])]
        return Foot.joined(parts).take(rng.permutation(n))

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give the rules of lids, walls and rims together."""
        flat: tuple[Piece, ...] = (*self._lids(), *self._walls())
        parts = [piece.rule(order) for piece in flat]
        parts += [self._rim(line, order) for line in self._lines()]
        return Foot.joined([foot for foot, _ in parts]), np.concatenate([weights for _, weights in parts])

    def _lids(self) -> tuple[Flat, Flat]:
        z = self.half_height + self.radius
        return Flat(self.region, z, 1), Flat(self.region, -z, -1)

    def _walls(self) -> tuple[Wall, ...]:
        if self.half_height == 0:
            return ()
        return tuple(Wall(line, -self.half_height, self.half_height) for line in self._lines())

    def _lines(self) -> tuple[Segment | Arc, ...]:
        """Give the outline at mid-height: the region's boundary one radius farther out, corners now arcs."""
        return tuple(piece.offset(self.radius) for piece in self.region.pieces)

    def _rim(self, line: Segment | Arc, order: int) -> tuple[Foot, Array]:
        """Give nodes on both rims along one piece of the outline."""
        flat, along = line.rule(order)
        angles, around = interval_rule(0.0, 0.5 * np.pi, order)
        rows, angles = np.repeat(np.arange(order), order), np.tile(angles, order)
        weights = np.outer(along, around).ravel()
        parts = [self._on_rim(flat.take(rows), angles, up) for up in (1.0, -1.0)]
        return (
            Foot.joined([foot for foot, _ in parts]),
            np.concatenate([weights * self.radius * stretch for _, stretch in parts]),
        )

    def _draw_rim(self, line: Segment | Arc, n: int, rng: np.random.Generator) -> Foot:
        def propose(k: int) -> tuple[Foot, Array]:
            flat = line.draw(k, rng)
            foot, stretch = self._on_rim(flat, 0.5 * np.pi * rng.random(k), rng.choice(np.array([-1.0, 1.0]), k))
            widest = np.maximum(1.0, 1.0 - self.radius * flat.curvatures[:, 0])
            return foot, stretch / widest

        return rejection(n, propose, rng)

    def _on_rim(self, flat: Foot, angles: Array, up: Array | float) -> tuple[Foot, Array]:
        """Give the points at an elevation from the outline, and the element of area per outline length and angle."""
        cosine, sine = np.cos(angles), np.sin(angles)
        points = flat.points - self.radius * (1.0 - cosine)[:, None] * flat.normals
        z = up * (self.half_height + self.radius * sine)
        bend = flat.curvatures[:, 0]
        foot = Foot(
            np.column_stack([points, z]),
            np.column_stack([cosine[:, None] * flat.normals, up * sine]),
            self._curvatures(bend, cosine, rim=np.ones(len(angles), dtype=bool)),
        )
        return foot, 1.0 - self.radius * bend * (1.0 - cosine)

    def _curvatures(self, bend: Array, cosine: Array, rim: NDArray[np.bool_]) -> Array:
        """Give principal curvatures where the outline has curvature `bend` and the normal an elevation."""
        shrunk = 1.0 - self.radius * bend * (1.0 - cosine)  # zero only above a corner, on the lid
        lengthwise = bend * cosine / np.where(shrunk > 0, shrunk, 1.0)
        return descending(np.where(rim, 1.0 / self.radius, 0.0), lengthwise)
