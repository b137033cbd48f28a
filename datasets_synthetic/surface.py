"""The surface whose truth is known: exact distance, normal, curvature, area, volume, topology; and clouds taken from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .gate import Seed, as_generator, as_positions, count, not_negative
from .piece import Array, Foot, Piece, bounds_of, length, nearest_of
from .sample import NOISE_KINDS, Sample
from .sampling import Ball, Density, sample_surface
from .scanner import scan_surface

_ORDER = 96  # of the quadrature behind area and volume


@dataclass(frozen=True, eq=False, repr=False)
class Surface:
    """A surface in space, or a curve in the plane, about which everything is known.

    Made by `datasets_synthetic.surface`. In the plane read curve for surface, length for area, area for volume.

    Attributes
    ----------
    name : str
    pieces : tuple of Piece
        What the surface is made of; they meet along edges only.
    euler : int
        Euler characteristic.
    genus : int
        Sum over the components; of a non-orientable surface the number of its crosscaps.
    components : int
    boundary_loops : int
        Boundary curves; in the plane, end points.
    orientable : bool
    sharp : bool
        Whether there are edges, where the normal jumps.
    inside : callable or None
        (m, d) -> (m,) bool, independent of the distance; None where the normal of a smooth surface tells the side.
    """

    name: str
    pieces: tuple[Piece, ...]
    euler: int
    genus: int = 0
    components: int = 1
    boundary_loops: int = 0
    orientable: bool = True
    sharp: bool = False
    inside: Callable[[Array], NDArray[np.bool_]] | None = None

    def __repr__(self) -> str:
        kind = "closed" if self.closed else f"open, {self.boundary_loops} boundary"
        return f"Surface({self.name!r}, {self.dimension}-D, {kind}, euler {self.euler}, area {self.area:.6g})"

    @property
    def closed(self) -> bool:
        """Tell whether the surface bounds a solid: only then are distances signed."""
        return self.boundary_loops == 0

    @property
    def dimension(self) -> int:
        """Give the d of the space around: 3, or 2 for a planar curve."""
        return self.bounds.shape[1]

    @cached_property
    def bounds(self) -> Array:
        """Give an axis-aligned box that contains the surface, (2, d): lower and upper corner [L]."""
        box = bounds_of(self.pieces)
        box.flags.writeable = False
        return box

    @cached_property
    def area(self) -> float:
        """Give the area [L^2], or the length of a planar curve [L], to 1e-10 relative or better: spectral quadrature."""
        return float(self._piece_areas.sum())

    @cached_property
    def volume(self) -> float:
        """Give the volume [L^3] that a closed surface bounds, or area [L^2] in the plane; nan for an open one.

        To 1e-10 relative or better, by the divergence theorem and the same quadrature.
        """
        if not self.closed:
            return float("nan")
        total = 0.0
        for piece in self.pieces:
            foot, weights = piece.rule(_ORDER)
            total += float(weights @ np.einsum("md,md->m", foot.points, foot.normals))
        return total / self.dimension

    @cached_property
    def _piece_areas(self) -> Array:
        return np.array([float(piece.rule(_ORDER)[1].sum()) for piece in self.pieces])

    def distance(self, x: ArrayLike) -> Array:
        """Give the exact distance to the surface, negative inside; of an open surface unsigned.

        Parameters
        ----------
        x : (m, d) array_like of float [L]

        Returns
        -------
        (m,) ndarray of float64 [L]

        Raises
        ------
        ValueError
            Not finite numbers of this shape.
        """
        positions = as_positions(x, self.dimension)
        foot = nearest_of(self.pieces, positions)
        gap = positions - foot.points
        distance = length(gap)
        if not self.closed:
            return distance
        if self.inside is not None:
            inside = self.inside(positions)
        else:
            # From beyond all precision the front and the back are equally far: the box decides.
            inside = ((positions > self.bounds[0]) & (positions < self.bounds[1])).all(axis=1)
            inside &= np.einsum("md,md->m", gap, foot.normals) < 0
        return np.where(inside, -distance, distance)

    def project(self, x: ArrayLike) -> Array:
        """Give the nearest surface point of each row; where several tie, one of them.

        Parameters
        ----------
        x : (m, d) array_like of float [L]

        Returns
        -------
        (m, d) ndarray of float64 [L]
        """
        return self.nearest(x).points

    def normal(self, x: ArrayLike) -> Array:
        """Give the unit normal at the nearest surface point: outward; of an open surface, on one consistent side.

        At a sharp edge it is that of one of the faces there. A non-orientable surface has a seam where it flips.

        Parameters
        ----------
        x : (m, d) array_like of float [L]

        Returns
        -------
        (m, d) ndarray of float64
        """
        return self.nearest(x).normals

    def curvature(self, x: ArrayLike) -> Array:
        """Give the principal curvatures at the nearest surface point, descending; positive on a sphere.

        Parameters
        ----------
        x : (m, d) array_like of float [L]

        Returns
        -------
        (m, d - 1) ndarray of float64 [1/L]
        """
        return self.nearest(x).curvatures

    def nearest(self, x: ArrayLike) -> Foot:
        """Give nearest points, normals and curvatures at once.

        Parameters
        ----------
        x : (m, d) array_like of float [L]

        Returns
        -------
        Foot
        """
        return nearest_of(self.pieces, as_positions(x, self.dimension))

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw n points, independent and uniform by area, with their normals and curvatures."""
        counts = rng.multinomial(n, self._piece_areas / self.area)
        parts = [piece.draw(int(k), rng) for piece, k in zip(self.pieces, counts)]
        return Foot.joined(parts).take(rng.permutation(n))

    def sample(
        self,
        n: int,
        *,
        density: Density = "area",
        spacing: str = "random",
        lines: float = 1.0,
        noise: float = 0.0,
        noise_kind: str = "normal",
        outliers: float = 0.0,
        holes: Sequence[Ball] = (),
        rng: Seed,
    ) -> Sample:
        """Take a point cloud of exactly n points, outliers included (they come last).

        Parameters
        ----------
        n : int
        density : "area", "curvature", float >= 1 or callable, default "area"
            Uniform by area; in proportion to the largest principal curvature, within a factor of 50 of the inverse
            of the diagonal of the bounds; growing exponentially along the longest side of the bounds, by this ratio
            in all; or a function of positions (m, d) that gives relative densities (m,) between 0 and 1.
        spacing : {"random", "blue"}
            Independent points, or evenly spaced ones of the same density (blue noise).
        lines : float, 1 to 1000, default 1
            Above 1 the points lie on scan lines, where parallel planes cut the surface, mostly across the longest side of the bounds:
            on the mean so many times as far apart as the points along them, which are even. Where the surface is inclined
            to the planes by less than a tenth there are none. d = 3.
        noise : float [L]
        noise_kind : {"normal", "isotropic", "quantized"}
            See `Sample.noisy`.
        outliers : float
            Share of the n points, below 1; see `Sample.with_outliers`.
        holes : sequence of (center (d,), radius) [L]
            Balls from which no point is taken.
        rng : numpy.random.Generator or int

        Returns
        -------
        Sample

        Raises
        ------
        ValueError
            An argument that cannot be meant, or a density that leaves nothing to sample.

        Examples
        --------
        >>> import datasets_synthetic
        >>> cloud = datasets_synthetic.surface("torus").sample(1000, density=10, noise=0.001, outliers=0.1, rng=1)
        >>> cloud
        Sample(1000 points in 3-D, 100 outliers, 1 scan(s))
        """
        n = count(n, "n", least=0)
        generator = as_generator(rng)
        not_negative(outliers=outliers, noise=noise)
        if outliers >= 1:
            raise ValueError(f"outliers: a share of the points, below 1, got {outliers!r}")
        if noise_kind not in NOISE_KINDS:
            raise ValueError(f"noise_kind: expected one of {', '.join(NOISE_KINDS)}, got {noise_kind!r}")
        stray = round(outliers * n)
        foot = sample_surface(self, n - stray, density, spacing, lines, holes, generator)
        sample = Sample.of(foot)
        if stray:
            sample = sample.with_outliers(stray, rng=generator)
        return sample.noisy(noise, noise_kind, rng=generator)

    def scan(self, viewpoints: ArrayLike, resolution: int | tuple[int, int] = 200, *, grazing: float = 80.0) -> Sample:
        """Take what a scanner sees from given viewpoints: the first hits of rays on a regular grid of angles.

        Nearer parts are denser, hidden ones missing. Noise comes after: ``surface.scan(...).noisy(0.002, rng=1)``.

        Parameters
        ----------
        viewpoints : (v, d) array_like of float [L]
            Off the surface; inside it is as good as outside.
        resolution : int or (rows, columns)
            Rays; few rows of many columns are scan lines. A planar curve takes one number.
        grazing : float [degrees]
            Rays that meet the surface at a larger angle to its normal give no point.

        Returns
        -------
        Sample
            Points exactly on the surface, within 1e-7 of its size from their rays; `scan` is the viewpoint's index.
            A wall or a corner less than 0.4 % of the size thick along the ray may be missed.
            On an open surface seen from behind, normals stay those of the surface.
        """
        return scan_surface(self, viewpoints, resolution, grazing)
