"""What the contenders of `evidence.py` are given: surfaces of the catalogue in many conditions, and files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from peers import nearest

import datasets_synthetic
import recon
import weighting
from recon.topology import topology

Array = NDArray[np.float64]
SURFACES, CLOSED = datasets_synthetic.surfaces(3), datasets_synthetic.surfaces(3, closed=True)
POINTS = 3000
DENSITIES = (1.0, 10.0, 50.0)  # greatest to least, along the longest side
NOISES = (0.0, 0.1, 0.5)  # standard deviation along the normal, in median local spacings (area of the surface a sample)
OUTLIERS = (0.0, 0.1)  # share of the points, uniform in a box larger than the surface
LINES = (5.0, 12.0)  # scan lines, so many times as far apart as points along them
HOLE = 3.0  # radius of the ball that a hole is cut out by, in mean spacings; at most that of the solid there
SUFFIXES = (".off", ".obj", ".ply", ".xyz", ".pwn", ".pcd", ".las", ".pdb", ".xyzr", "")


class Case(NamedTuple):
    """A cloud by name: of a surface of the catalogue, or of a file."""

    source: str
    density: float = 1.0
    noise: float = 0.0
    outliers: float = 0.0
    hole: bool = False
    lines: float = 1.0

    @property
    def condition(self) -> str:
        """What was done to the samples."""
        if "/" in self.source:
            return "file"
        parts = [f"density {self.density:g}"] * (self.density != 1) + [f"noise {self.noise:g}"] * (self.noise != 0)
        parts += [f"{self.outliers:.0%} outliers"] * (self.outliers != 0) + ["hole"] * self.hole
        parts = [f"lines {self.lines:g}"] * (self.lines != 1) + parts
        return ", ".join(parts) or "plain"

    @property
    def name(self) -> str:
        return self.source if "/" in self.source else f"{self.source}, {self.condition}"

    @property
    def single(self) -> bool:
        """At most one thing is done to the samples."""
        return (self.density != 1) + (self.noise != 0) + (self.outliers != 0) + self.hole + (self.lines != 1) <= 1


class Cloud(NamedTuple):
    """Points and the truth about them.

    Attributes
    ----------
    points : (n, 3) ndarray of float64 [L]
    genuine : (n,) ndarray of bool
        Samples of the surface, no outliers.
    near : float [L]
        d1.
    truth : Surface, Mesh or None
    topologies : tuple of (int, int)
        Euler characteristic and boundary loops that are right.
    """

    points: Array
    genuine: NDArray[np.bool_]
    near: float
    truth: Any
    topologies: tuple[tuple[int, int], ...]


def synthetic() -> Iterator[Case]:
    """Every surface in every condition; holes only in closed ones, where they are none of the surface."""
    for name in SURFACES:
        for density in DENSITIES:
            for noise in NOISES:
                for outliers in OUTLIERS:
                    for hole in (False, True) if name in CLOSED else (False,):
                        yield Case(name, density, noise, outliers, hole)
    for name in SURFACES:
        for lines in LINES:
            for noise in NOISES:
                yield Case(name, noise=noise, lines=lines)


def files(folder: Path) -> Iterator[Case]:
    """Every file of points or of a mesh below a folder."""
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.parent != folder and path.suffix.lower() in SUFFIXES:
            yield Case(path.relative_to(folder).as_posix())


def cloud_of(case: Case, folder: Path | None) -> Cloud:
    """Make or read the points."""
    if "/" in case.source:
        if folder is None:
            raise FileNotFoundError(f"{case.source}: no folder of data is given")
        return _from_file(folder / case.source)
    surface = datasets_synthetic.surface(case.source)
    options: dict[str, Any] = {"density": case.density, "outliers": case.outliers, "lines": case.lines}
    if case.hole:
        options["holes"] = [_ball(surface)]
    clean = surface.sample(POINTS, rng=0, **options)
    true = clean.points[~clean.is_outlier]
    noise = case.noise * float(np.median(weighting.spacing(true)))
    sample = surface.sample(POINTS, rng=0, noise=noise, **options)
    right = (surface.euler, surface.boundary_loops)
    either = (right, (surface.euler - 1, 1)) if case.hole else (right,)
    return Cloud(np.array(sample.points), ~sample.is_outlier, nearest(true), surface, either)


def _ball(surface: datasets_synthetic.Surface) -> tuple[Array, float]:
    """Centre on the surface and radius of a ball that cuts a disk out of it, and nothing from another side: the best of ten."""
    foot = surface.sample(10, rng=1)
    radii = np.linspace(0.0, HOLE * np.sqrt(surface.area / POINTS), 100)
    inward = foot.points[:, None] - radii[:, None] * foot.normals[:, None]
    depth = -surface.distance(inward.reshape(-1, 3)).reshape(10, -1)
    largest = np.where(depth >= (1 - 1e-6) * radii, radii, 0.0).max(axis=1)
    best = int(largest.argmax())
    return foot.points[best], float(largest[best])


def _from_file(path: Path) -> Cloud:
    """The points of a file; where it is a mesh below a folder of that name, its distinct vertices in use, and it is the truth."""
    if path.parent.name != "meshes":
        points = np.array(recon.read_points(path).points)
        return Cloud(points, np.ones(len(points), bool), nearest(np.unique(points, axis=0)), None, ())
    truth = welded(recon.read_mesh(path))
    found = topology(truth.faces)
    right = ((found.euler, found.boundary_loops),)
    return Cloud(np.array(truth.vertices), np.ones(len(truth.vertices), bool), nearest(truth.vertices), truth, right)


def welded(mesh: recon.Mesh) -> recon.Mesh:
    """The same with one vertex for each place in use, and no face that names one twice."""
    corners, faces = np.unique(mesh.vertices[mesh.faces.ravel()], axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    return recon.Mesh.from_arrays(corners, faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)])
