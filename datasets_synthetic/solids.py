"""The closed surfaces of the catalogue. Unless said otherwise: closed form, centred at the origin, diameter about 2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .ellipsoid import Ellipsoid
from .formula import Formula
from .gate import at_most, below, positive
from .jets import Jet, cos, sin, sqrt
from .parametric import Parametric, Tube
from .piece import Array, Piece
from .planar import Arc, Region, Segment, disc, rectangle
from .rounded import Rounded
from .solid_pieces import Flat, Moved, Revolution, Wall
from .surface import Surface

# Of the trefoil before scaling: half the least distance of its strands (the least radius of curvature is 1.287).
_TREFOIL_REACH = 0.607


def sphere(radius: float = 1.0) -> Surface:
    """Make a sphere."""
    positive(radius=radius)
    return Surface("sphere", (Revolution(_half_circle(radius)),), euler=2)


def ellipsoid(axes: tuple[float, float, float] = (1.0, 0.75, 0.5)) -> Surface:
    """Make an ellipsoid with three semi-axes; the distance is a converged root, and global."""
    return Surface("ellipsoid", (Ellipsoid(_axes(axes, 3)),), euler=2)


def torus(major: float = 0.7, minor: float = 0.3) -> Surface:
    """Make a torus about the z axis."""
    positive(major=major, minor=minor)
    below(minor=(minor, major))
    return Surface("torus", (Revolution(Arc((major, 0.0), minor)),), euler=0, genus=1)


def capsule(radius: float = 0.4, length: float = 2.0) -> Surface:
    """Make a cylinder along z with hemispheres as ends; `length` includes them."""
    positive(radius=radius, length=length)
    below(radius=(radius, 0.5 * length))
    h = 0.5 * length - radius
    pieces = (
        Revolution(Arc((0.0, -h), radius, -0.5 * np.pi, 0.5 * np.pi)),
        Revolution(Segment((radius, -h), (radius, h))),
        Revolution(Arc((0.0, h), radius, 0.0, 0.5 * np.pi)),
    )
    return Surface("capsule", pieces, euler=2)


def box(size: tuple[float, float, float] = (1.2, 1.0, 0.8)) -> Surface:
    """Make a box with sharp edges."""
    return _box("box", size)


def thin_plate(thickness: float = 0.04, width: float = 1.6, depth: float = 1.2) -> Surface:
    """Make a plate whose two sheets lie closer than samples do: sharp edges."""
    positive(thickness=thickness)
    return _box("thin_plate", (width, depth, thickness))


def rounded_box(size: tuple[float, float, float] = (1.4, 1.1, 0.8), radius: float = 0.15) -> Surface:
    """Make a box whose edges and corners are rounded; `size` includes the rounding. Smooth, curvature jumps."""
    width, depth, height = _axes(size, 3)
    positive(radius=radius)
    below(radius=(radius, 0.5 * min(size)))
    core = rectangle(width - 2.0 * radius, depth - 2.0 * radius)
    return Surface("rounded_box", (Rounded(core, 0.5 * height - radius, radius),), euler=2)


def cylinder(radius: float = 0.6, height: float = 1.4) -> Surface:
    """Make a cylinder along z with flat ends: sharp edges."""
    positive(radius=radius, height=height)
    return _frustum("cylinder", radius, radius, height)


def cone_frustum(bottom: float = 0.8, top: float = 0.35, height: float = 1.2) -> Surface:
    """Make a cone along z cut off at the top, by two radii: sharp edges."""
    positive(bottom=bottom, top=top, height=height)
    return _frustum("cone_frustum", bottom, top, height)


def bumpy_sphere(radius: float = 0.88, amplitude: float = 0.12, frequency: float = 6.0) -> Surface:
    """Make a star-shaped surface r = radius * (1 + amplitude * mean of sin(frequency * x_i + i)) over directions x.

    The distance is a converged root: see `Formula`.
    """
    positive(radius=radius)
    at_most(1.0 / 3.0, amplitude=amplitude)
    at_most(30.0, frequency=frequency)
    at_most(4.0, **{"amplitude * frequency": amplitude * frequency})
    pieces = tuple(_bumpy_face(radius, amplitude, frequency, face) for face in range(6))
    return Surface("bumpy_sphere", pieces, euler=2)


def genus_2(radius: float = 0.15, hole: float = 0.27) -> Surface:
    """Make a pretzel with two holes: a stadium with holes of radius `hole`, swollen by a ball. Smooth, curvature jumps."""
    positive(radius=radius, hole=hole)
    below(radius=(radius, hole), hole=(hole, 0.4))
    left, right = disc(hole, (-0.4, 0.0)), disc(hole, (0.4, 0.0))
    core = rectangle(1.7, 0.9, 0.45).minus(left, right)
    return Surface("genus_2", (Rounded(core, 0.0, radius),), euler=-2, genus=2)


def genus_3(radius: float = 0.13, hole: float = 0.24) -> Surface:
    """Make a disc with three holes of radius `hole`, swollen by a ball. Smooth, curvature jumps."""
    positive(radius=radius, hole=hole)
    below(radius=(radius, hole), hole=(hole, 0.4))
    angles = np.pi / 2 + 2.0 * np.pi * np.arange(3) / 3
    holes = [disc(hole, (0.47 * float(np.cos(angle)), 0.47 * float(np.sin(angle)))) for angle in angles]
    return Surface("genus_3", (Rounded(disc(0.87).minus(*holes), 0.0, radius),), euler=-4, genus=3)


def trefoil(radius: float = 0.11, scale: float = 0.32) -> Surface:
    """Make a tube around the trefoil knot `scale` * (sin t + 2 sin 2t, cos t - 2 cos 2t, -sin 3t).

    The distance to the knot is a converged root (see `Formula`), the rest closed form.
    """
    positive(radius=radius, scale=scale)
    below(radius=(radius, _TREFOIL_REACH * scale))

    def knot(t: Jet) -> tuple[Jet, ...]:
        double = 2.0 * t
        return (
            scale * (sin(t) + 2.0 * sin(double)),
            scale * (cos(t) - 2.0 * cos(double)),
            -scale * sin(3.0 * t),
        )

    formula = Formula(knot, (0.0,), (2.0 * np.pi,), (513,), (False,))
    return Surface("trefoil", (Tube(formula, radius),), euler=0, genus=1)


def linked_tori(major: float = 0.55, minor: float = 0.18) -> Surface:
    """Make two tori, each through the middle of the other."""
    positive(major=major, minor=minor)
    below(minor=(minor, 0.5 * major))
    ring = Revolution(Arc((major, 0.0), minor))
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    pieces = (
        Moved(ring, np.eye(3), np.array([-0.5 * major, 0.0, 0.0])),
        Moved(ring, upright, np.array([0.5 * major, 0.0, 0.0])),
    )
    return Surface("linked_tori", pieces, euler=0, genus=2, components=2)


def nested_spheres(outer: float = 1.0, inner: float = 0.6) -> Surface:
    """Make a thick shell: the solid between two concentric spheres, so the inner one faces inward."""
    positive(outer=outer, inner=inner)
    below(inner=(inner, outer))
    pieces = (Revolution(_half_circle(outer)), Revolution(_half_circle(inner).reversed()))
    return Surface("nested_spheres", pieces, euler=4, components=2)


def csg_part() -> Surface:
    """Make a block with two drilled holes, and on it a boss with a blind bore: sharp edges, convex and concave."""
    block, bottom, middle, top = rectangle(1.9, 1.1), -0.3, 0.1, 0.45
    holes = (disc(0.17, (-0.65, 0.27)), disc(0.17, (-0.65, -0.27)))
    boss, bore, floor = disc(0.38, (0.35, 0.0)), disc(0.2, (0.35, 0.0)), -0.1
    drilled = block.minus(*holes)
    pieces: tuple[Piece, ...] = (
        Flat(drilled, bottom, -1),
        Flat(drilled.minus(boss), middle, 1),
        Flat(boss.minus(bore), top, 1),
        Flat(bore, floor, 1),
        *(Wall(line, bottom, middle) for line in drilled.lines),
        *(Wall(line, middle, top) for line in boss.lines),
        *(Wall(line.reversed(), floor, top) for line in bore.lines),
    )

    def inside(x: Array) -> NDArray[np.bool_]:
        plan, z = x[:, :2], x[:, 2]
        solid = drilled.contains(plan) & (bottom < z) & (z < middle)
        solid |= boss.contains(plan) & (middle <= z) & (z < top)
        return solid & ~(bore.contains(plan) & (z > floor))

    return Surface("csg_part", pieces, euler=-2, genus=2, sharp=True, inside=inside)


def _axes(values: tuple[float, ...], d: int) -> tuple[float, ...]:
    """Check a tuple of d lengths."""
    if np.shape(values) != (d,):
        raise ValueError(f"expected {d} lengths, got {values!r}")
    for value in values:
        positive(length=value)
    return tuple(float(value) for value in values)


def _half_circle(radius: float) -> Arc:
    return Arc((0.0, 0.0), radius, -0.5 * np.pi, np.pi)


def _prism(name: str, region: Region, bottom: float, top: float) -> Surface:
    """Make what stands on a region without holes, between two heights."""
    pieces: tuple[Piece, ...] = (
        Flat(region, bottom, -1),
        Flat(region, top, 1),
        *(Wall(line, bottom, top) for line in region.lines),
    )

    def inside(x: Array) -> NDArray[np.bool_]:
        return region.contains(x[:, :2]) & (bottom < x[:, 2]) & (x[:, 2] < top)

    return Surface(name, pieces, euler=2, sharp=True, inside=inside)


def _box(name: str, size: tuple[float, float, float]) -> Surface:
    width, depth, height = _axes(size, 3)
    return _prism(name, rectangle(width, depth), -0.5 * height, 0.5 * height)


def _frustum(name: str, bottom: float, top: float, height: float) -> Surface:
    h = 0.5 * height
    profile = (
        Segment((0.0, -h), (bottom, -h)),
        Segment((bottom, -h), (top, h)),
        Segment((top, h), (0.0, h)),
    )

    def inside(x: Array) -> NDArray[np.bool_]:
        widest = bottom + (top - bottom) * (x[:, 2] + h) / height
        return (np.abs(x[:, 2]) < h) & (np.hypot(x[:, 0], x[:, 1]) < widest)

    return Surface(name, tuple(Revolution(line) for line in profile), euler=2, sharp=True, inside=inside)


def _bumpy_face(radius: float, amplitude: float, frequency: float, face: int) -> Parametric:
    """Make the part of the bumpy sphere that one face of a cube around it projects to."""
    axis, sign = face % 3, 1.0 if face < 3 else -1.0

    def coordinates(u: Jet, v: Jet) -> tuple[Jet, ...]:
        stretch = 1.0 / sqrt(u * u + v * v + 1.0)
        # (axis, u, v) is right-handed, and u is mirrored along with the axis: the normal stays outward.
        direction = [stretch * sign, stretch * u * sign, stretch * v]
        x, y, z = (direction[(i - axis) % 3] for i in range(3))
        wave = sin(frequency * x) + sin(frequency * y + 1.0) + sin(frequency * z + 2.0)
        r = radius * (1.0 + amplitude / 3.0 * wave)
        return r * x, r * y, r * z

    seeds = 1 + 32 * max(1, int(np.ceil(frequency / 6.0)))
    return Parametric(Formula(coordinates, (-1.0, -1.0), (1.0, 1.0), (seeds, seeds), (True, True)))
