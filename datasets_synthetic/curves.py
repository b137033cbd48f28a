"""The planar curves of the catalogue: the same questions in 2-D. Diameter about 2."""

from __future__ import annotations

import numpy as np

from .ellipsoid import Ellipsoid
from .formula import Formula
from .gate import below, positive
from .jets import Jet, cos, sin, sqrt
from .parametric import Parametric
from .planar import disc, rectangle
from .surface import Surface


def circle(radius: float = 1.0) -> Surface:
    """Make a circle. Closed form."""
    positive(radius=radius)
    return Surface("circle", disc(radius).lines, euler=0)


def ellipse(axes: tuple[float, float] = (1.0, 0.5)) -> Surface:
    """Make an ellipse with two semi-axes; the distance is a converged root, and global."""
    if np.shape(axes) != (2,):
        raise ValueError(f"axes: expected 2 lengths, got {axes!r}")
    positive(first=axes[0], second=axes[1])
    return Surface("ellipse", (Ellipsoid((float(axes[0]), float(axes[1]))),), euler=0)


def annulus(outer: float = 1.0, inner: float = 0.5) -> Surface:
    """Make the two circles around an annulus. Closed form."""
    positive(outer=outer, inner=inner)
    below(inner=(inner, outer))
    return Surface("annulus", disc(outer).minus(disc(inner)).lines, euler=0, components=2)


def square(side: float = 1.4) -> Surface:
    """Make a square with sharp corners. Closed form."""
    positive(side=side)
    region = rectangle(side, side)
    return Surface("square", region.lines, euler=0, sharp=True, inside=region.contains)


def neck(waist: float = 0.2) -> Surface:
    """Make an oval of Cassini, two lobes that a neck of half-width `waist` joins; half-length 1.

    r^2 = a^2 cos 2t + sqrt(b^4 - a^4 sin^2 2t) with a^2 = (1 - waist^2) / 2, b^2 = (1 + waist^2) / 2. The distance is
    a converged root: see `Formula`.
    """
    positive(waist=waist)
    below(waist=(waist, 1.0))
    if waist < 0.02:
        raise ValueError(f"waist: expected at least 0.02, got {waist!r}")
    a_sq, b_sq = 0.5 * (1.0 - waist**2), 0.5 * (1.0 + waist**2)

    def coordinates(t: Jet) -> tuple[Jet, ...]:
        across = a_sq * sin(2.0 * t)
        r = sqrt(a_sq * cos(2.0 * t) + sqrt(b_sq**2 - across * across))
        return r * cos(t), r * sin(t)

    seeds = 1 + 4 * int(np.ceil(64 / min(waist, 0.5)))
    formula = Formula(coordinates, (0.0,), (2.0 * np.pi,), (seeds,), (False,))
    return Surface("neck", (Parametric(formula),), euler=0)


def spiral(turns: float = 1.5, start: float = 0.75) -> Surface:
    """Make an open spiral, the section of the swiss roll; the normal points away from the centre."""
    positive(turns=turns, start=start)
    return Surface("spiral", (archimedean(turns, start),), euler=1, boundary_loops=2)


def archimedean(turns: float, start: float) -> Parametric:
    """Make the piece behind the spiral: after `start` turns, for `turns` more, ending at the distance 1."""
    end = 2.0 * np.pi * (start + turns)

    def coordinates(angle: Jet) -> tuple[Jet, ...]:
        r = angle / end
        return r * cos(angle), r * sin(angle)

    seeds = 1 + 2 * int(np.ceil(128 * turns))
    return Parametric(Formula(coordinates, (2.0 * np.pi * start,), (end,), (seeds,), (True,)))
