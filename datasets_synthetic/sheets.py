"""The open surfaces of the catalogue, with their boundary curves. Diameter about 2; distances are unsigned."""

from __future__ import annotations

import numpy as np

from .curves import archimedean
from .formula import Formula
from .gate import at_most, below, positive
from .jets import Jet, cos, sin
from .parametric import Parametric
from .planar import Arc, Segment
from .solid_pieces import Revolution, Wall
from .surface import Surface


def hemisphere(radius: float = 1.0) -> Surface:
    """Make the upper half of a sphere, without its disk; the normal points away from the centre. Closed form."""
    positive(radius=radius)
    arc = Arc((0.0, 0.0), radius, 0.0, 0.5 * np.pi)
    return Surface("hemisphere", (Revolution(arc),), euler=1, boundary_loops=1)


def disk(radius: float = 1.0) -> Surface:
    """Make a flat disk in the plane z = 0; the normal points up. Closed form."""
    positive(radius=radius)
    return Surface("disk", (Revolution(Segment((radius, 0.0), (0.0, 0.0))),), euler=1, boundary_loops=1)


def paraboloid(radius: float = 1.0, height: float = 0.8) -> Surface:
    """Make the patch z = height * (r / radius)^2 for r <= radius; the normal points up, into the bowl.

    The distance is a converged root in the half-plane of x: see `Formula`.
    """
    positive(radius=radius, height=height)

    def profile(t: Jet) -> tuple[Jet, ...]:
        return radius * t, height * t * t

    line = Parametric(Formula(profile, (0.0,), (1.0,), (129,), (True,)), side=-1)
    return Surface("paraboloid", (Revolution(line),), euler=1, boundary_loops=1)


def swiss_roll(turns: float = 1.5, width: float = 1.0, start: float = 0.75) -> Surface:
    """Make a rolled-up rectangle: the spiral r = angle / (2 pi (start + turns)), after `start` turns, swept along z.

    The distance to the spiral is a converged root: see `Formula`. The normal points away from the axis.
    """
    positive(turns=turns, width=width, start=start)
    wall = Wall(archimedean(turns, start), -0.5 * width, 0.5 * width)
    return Surface("swiss_roll", (wall,), euler=1, boundary_loops=1)


def wavy_sheet(amplitude: float = 0.12, frequency: float = 5.0, hole: float = 0.3) -> Surface:
    """Make the sheet z = amplitude * cos(frequency * x) * cos(frequency * y) over the annulus hole <= r <= 1.

    The distance is a converged root: see `Formula`. The normal points up.
    """
    at_most(1.0, amplitude=amplitude)
    at_most(30.0, frequency=frequency)
    at_most(1.5, **{"amplitude * frequency": amplitude * frequency})
    positive(hole=hole)
    below(hole=(hole, 1.0))

    def coordinates(r: Jet, angle: Jet) -> tuple[Jet, ...]:
        x, y = r * cos(angle), r * sin(angle)
        return x, y, amplitude * (cos(frequency * x) * cos(frequency * y))

    finer = max(1, int(np.ceil(frequency / 5.0)))
    formula = Formula(coordinates, (hole, 0.0), (1.0, 2.0 * np.pi), (1 + 32 * finer, 1 + 160 * finer), (True, False))
    return Surface("wavy_sheet", (Parametric(formula),), euler=0, boundary_loops=2)


def mobius_band(radius: float = 0.7, half_width: float = 0.25) -> Surface:
    """Make a band of straight rungs that turns by half a turn on its way around: one side, one boundary curve.

    The distance is a converged root: see `Formula`. The normal flips at the rung through the positive x axis.
    """
    positive(radius=radius, half_width=half_width)
    below(half_width=(half_width, radius))

    def coordinates(u: Jet, v: Jet) -> tuple[Jet, ...]:
        half = 0.5 * u
        r = radius + v * cos(half)
        return r * cos(u), r * sin(u), v * sin(half)

    formula = Formula(coordinates, (0.0, -half_width), (2.0 * np.pi, half_width), (193, 25), (False, True))
    return Surface("mobius_band", (Parametric(formula),), euler=0, genus=1, boundary_loops=1, orientable=False)
