"""Pieces that a formula gives: curves of the plane, surfaces in space, and tubes around space curves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .formula import Formula
from .piece import Array, Foot, descending, length, rejection, unit

_AROUND = 16  # nodes around a tube


@dataclass(frozen=True, eq=False)
class Parametric:
    """The image of a formula, one dimension below its space.

    Distances are roots converged to 1e-12 and better, from many starts: see `Formula`.

    Attributes
    ----------
    formula : Formula
        One parameter in the plane, two in space; regular, no two parameters of the box give one point.
    side : int
        +1: the normal is to the right of the curve, or (first x second tangent); -1: the other one.
    """

    formula: Formula
    side: int = 1

    @property
    def bounds(self) -> Array:
        """Give a box around the piece, (2, d)."""
        return self.formula.bounds

    def nearest(self, x: Array) -> Foot:
        """Give the closest point by Newton's method from many starts."""
        return self._foot(self.formula.nearest(x))[0]

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by length or area: rejection against the largest element on a grid, and 5 % more."""
        lower, upper = np.array(self.formula.lower), np.array(self.formula.upper)

        def propose(k: int) -> tuple[Foot, Array]:
            foot, element = self._foot(lower + (upper - lower) * rng.random((k, len(lower))))
            return foot, element / self._largest_element

        return rejection(n, propose, rng)

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give Gauss-Legendre nodes in the parameters."""
        parameters, weights = self.formula.rule(order)
        foot, element = self._foot(parameters)
        return foot, weights * element

    @cached_property
    def _largest_element(self) -> float:
        return 1.05 * float(self._foot(self.formula.nodes())[1].max())

    def _foot(self, parameters: Array) -> tuple[Foot, Array]:
        """Give points with normals and curvatures, and the element of length or area there (m,)."""
        points, first, second = self.formula.at(parameters)
        if first.shape[1] == 1:
            along, speed = first[:, 0], length(first[:, 0])
            normals = self.side * np.stack([along[:, 1], -along[:, 0]], axis=1) / speed[:, None]
            bend = -np.einsum("md,md->m", second[:, 0, 0], normals)
            return Foot(points, normals, (bend / speed**2)[:, None]), speed
        u, v = first[:, 0], first[:, 1]
        normals = self.side * np.cross(u, v)
        element = length(normals)
        normals /= element[:, None]
        # Shape operator in the orthonormal basis that Gram-Schmidt makes of the tangents: u = a e, v = b e + c f.
        form = -np.einsum("mijd,md->mij", second, normals)
        a = length(u)
        b = np.einsum("md,md->m", u, v) / a
        c = element / a
        ee = form[:, 0, 0] / a**2
        ef = (form[:, 0, 1] / a - b * ee) / c
        ff = (form[:, 1, 1] - b**2 * ee - 2.0 * b * c * ef) / c**2
        return Foot(points, normals, principal(ee, ef, ff)), element


@dataclass(frozen=True, eq=False)
class Tube:
    """All points at the distance `radius` [L] from a closed space curve, whose reach must be larger.

    The curve's closest point is a converged root, see `Formula`; the rest is closed form.
    """

    formula: Formula
    radius: float

    @property
    def bounds(self) -> Array:
        """Give a box around the tube, (2, 3)."""
        return self.formula.bounds + np.array([[-self.radius], [self.radius]])

    def nearest(self, x: Array) -> Foot:
        """Go from the curve's closest point towards x; of a point on the curve itself, along the curve's normal."""
        center, tangent, bend = self._curve(self.formula.nearest(x))
        away = x - center
        away -= np.einsum("md,md->m", away, tangent)[:, None] * tangent
        return self._foot(center, unit(away, instead=unit(bend, instead=_across(tangent))), bend)

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw uniformly by area: rejection against the largest element on a grid, and 5 % more."""
        lower, upper = np.array(self.formula.lower), np.array(self.formula.upper)
        fastest, most_bent = self._largest

        def propose(k: int) -> tuple[Foot, Array]:
            parameters = lower + (upper - lower) * rng.random((k, 1))
            center, tangent, bend = self._curve(parameters)
            outward = _around(tangent, 2.0 * np.pi * rng.random(k))
            speed = length(self.formula.at(parameters)[1][:, 0])
            element = speed * (1.0 - self.radius * np.einsum("md,md->m", bend, outward))
            return self._foot(center, outward, bend), element / (fastest * (1.0 + self.radius * most_bent))

        return rejection(n, propose, rng)

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give Gauss-Legendre nodes along the curve times equal angles around it, where all is a short Fourier series."""
        parameters, weights = self.formula.rule(order)
        angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
        center, tangent, bend = (np.repeat(array, _AROUND, axis=0) for array in self._curve(parameters))
        outward = _around(tangent, np.tile(angles, len(parameters)))
        speed = length(self.formula.at(parameters)[1][:, 0])
        around = (2.0 * np.pi / _AROUND) * self.radius * (1.0 - self.radius * np.einsum("md,md->m", bend, outward))
        return self._foot(center, outward, bend), np.repeat(weights * speed, _AROUND) * around

    @cached_property
    def _largest(self) -> tuple[float, float]:
        """Give bounds of the curve's speed [L] and curvature [1/L]."""
        grid = self.formula.nodes()
        speed = length(self.formula.at(grid)[1][:, 0])
        return 1.05 * float(speed.max()), 1.05 * float(length(self._curve(grid)[2]).max())

    def _curve(self, parameters: Array) -> tuple[Array, Array, Array]:
        """Give points, unit tangents and curvature vectors [1/L] of the curve, (m, 3) each."""
        points, first, second = self.formula.at(parameters)
        speed = length(first[:, 0])[:, None]
        tangent = first[:, 0] / speed
        along = np.einsum("md,md->m", second[:, 0, 0], tangent)[:, None]
        return points, tangent, (second[:, 0, 0] - along * tangent) / speed**2

    def _foot(self, center: Array, outward: Array, bend: Array) -> Foot:
        towards = np.einsum("md,md->m", bend, outward)
        lengthwise = -towards / (1.0 - self.radius * towards)
        around = np.full(len(center), 1.0 / self.radius)
        return Foot(center + self.radius * outward, outward, descending(around, lengthwise))


def principal(ee: Array, ef: Array, ff: Array) -> Array:
    """Give the eigenvalues of symmetric 2 x 2 matrices, descending, (m,) each -> (m, 2)."""
    mean, spread = 0.5 * (ee + ff), np.hypot(0.5 * (ee - ff), ef)
    return np.stack([mean + spread, mean - spread], axis=1)


def _across(tangent: Array) -> Array:
    """Give some unit vector across each unit tangent."""
    axis = np.eye(3)[np.abs(tangent).argmin(axis=1)]
    return unit(np.cross(tangent, axis), instead=axis)


def _around(tangent: Array, angles: Array) -> Array:
    """Turn by the angles around each tangent."""
    across = _across(tangent)
    return np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * np.cross(tangent, across)
