"""The ellipse and the ellipsoid: the closest point is the one root of a monotone function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .parametric import principal
from .piece import Array, Foot, length, rejection


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid:
    """All points with sum (x_i / e_i)^2 = 1, for d = 2 or 3 semi-axes e [L].

    The foot of x is p_i = e_i^2 x_i / (s + e_i^2 - min(e)^2) with s >= 0 the root of |p_i / e_i| = 1, which is
    unique (Eberly, Distance from a point to an ellipsoid, 2013). Newton's method on 1 - 1 / |p / e|, started to the
    left of the root, climbs to it monotonically (Moré and Sorensen 1983): global, converged to rounding.
    """

    axes: tuple[float, ...]

    @property
    def bounds(self) -> Array:
        """Give the exact box, (2, d)."""
        return np.array([np.negative(self.axes), self.axes])

    def nearest(self, x: Array) -> Foot:
        """Find the root in the positive orthant, and mirror back."""
        axes = np.array(self.axes)
        small = int(axes.argmin())
        gap = (axes - axes[small]) * (axes + axes[small])  # exactly zero where axes tie
        scaled = np.abs(x) * axes
        # At s = 0 the terms of the smallest axes are missing; where those suffice, x lies on the inner axis or disc.
        others = np.where(gap > 0, scaled / np.where(gap > 0, gap, 1.0), 0.0)
        room = 1.0 - np.einsum("ij,ij->i", others, others)
        on_disc = (scaled[:, gap == 0] == 0).all(axis=1) & (room >= 0)
        ratio = others.copy()
        ratio[:, small] = np.sqrt(np.maximum(room, 0.0))
        rows = np.flatnonzero(~on_disc)
        ratio[rows] = self._roots(scaled[rows], gap)
        ratio /= length(ratio)[:, None]
        return self._foot(np.copysign(axes * ratio, x))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw directions, and keep them in proportion to how much the map stretches area there."""
        axes = np.array(self.axes)

        def propose(k: int) -> tuple[Foot, Array]:
            direction = rng.standard_normal((k, len(axes)))
            direction /= length(direction)[:, None]
            return self._foot(direction * axes), length(direction / axes) * axes.min()

        return rejection(n, propose, rng)

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give equal angles, and in space Gauss-Legendre heights, on the sphere that the ellipsoid is stretched from."""
        axes = np.array(self.axes)
        angles = 2.0 * np.pi * np.arange(2 * order) / (2 * order)
        circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        weights = np.full(len(angles), np.pi / order)
        if len(axes) == 3:
            z, heights = np.polynomial.legendre.leggauss(order)
            ring = np.sqrt(1.0 - z**2)[:, None, None] * circle
            circle = np.column_stack([ring.reshape(-1, 2), np.repeat(z, len(angles))])
            weights = np.outer(heights, weights).ravel()
        return self._foot(circle * axes), weights * axes.prod() * length(circle / axes)

    def _roots(self, scaled: Array, gap: Array) -> Array:
        """Give p / e at the root, (m, d)."""
        s = np.where(gap == 0, scaled, 0.0).max(axis=1)
        # Away from the smallest axes every single term also bounds the root from below, once it is positive.
        s = np.maximum(s, (scaled - gap).max(axis=1))
        for _ in range(100):
            below = s[:, None] + gap
            below = np.where(below > 0, below, 1.0)  # zero only under a term that is zero itself
            ratio = scaled / below
            norm_sq = np.einsum("ij,ij->i", ratio, ratio)
            step = norm_sq * (np.sqrt(norm_sq) - 1.0) / np.einsum("ij,ij->i", ratio, ratio / below)
            if ((step <= 4e-16 * s) | (norm_sq <= 1.0 + 1e-15)).all():
                return ratio
            s = s + np.maximum(step, 0.0)
        raise RuntimeError("the root of an ellipsoid did not converge: please report this")

    def _foot(self, points: Array) -> Foot:
        axes = np.array(self.axes)
        gradient = points / axes**2
        steep = length(gradient)
        normals = gradient / steep[:, None]
        if len(axes) == 2:
            return Foot(points, normals, (1.0 / (steep**3 * axes.prod() ** 2))[:, None])
        pole = np.eye(3)[np.abs(normals).argmin(axis=1)]
        e = np.cross(normals, pole)
        e /= length(e)[:, None]
        f = np.cross(normals, e)
        ee, ef, ff = (np.einsum("md,md->m", a / axes**2, b) / steep for a, b in ((e, e), (e, f), (f, f)))
        return Foot(points, normals, principal(ee, ef, ff))
