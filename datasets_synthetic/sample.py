"""A point cloud whose truth is known, and what goes wrong with point clouds: noise, outliers, a scan that slipped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .gate import Seed, as_generator, count, not_negative
from .piece import Array, Foot, length

NOISE_KINDS = ("normal", "isotropic", "quantized")


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Points with the truth about them; `numpy.asarray(sample)` is `sample.points`.

    Attributes
    ----------
    points : (n, d) ndarray of float64 [L]
        What a scanner would give.
    normals : (n, d) ndarray of float64
        Unit, outward, of the surface at `clean`; zero for outliers.
    clean : (n, d) ndarray of float64 [L]
        Where on the surface the point was taken, before noise and motion; an outlier's own position.
    is_outlier : (n,) ndarray of bool
    scan : (n,) ndarray of int64
        Which scan the point belongs to: the viewpoint's index, or the order of joining; 0 otherwise.
    """

    points: Array
    normals: Array
    clean: Array
    is_outlier: NDArray[np.bool_]
    scan: NDArray[np.int64]

    def __post_init__(self) -> None:
        for field in fields(self):
            array = np.array(getattr(self, field.name))
            array.flags.writeable = False
            object.__setattr__(self, field.name, array)

    @staticmethod
    def of(foot: Foot, scan: ArrayLike = 0) -> Sample:
        """Take points of a surface as they are."""
        n = len(foot.points)
        scans = np.broadcast_to(np.asarray(scan, dtype=np.int64), n)
        return Sample(foot.points, foot.normals, foot.points, np.zeros(n, dtype=bool), scans)

    def __len__(self) -> int:
        return len(self.points)

    def __array__(self, dtype: type | None = None, copy: bool | None = None) -> Array:
        return np.array(self.points, dtype=dtype) if copy else np.asarray(self.points, dtype=dtype)

    def __repr__(self) -> str:
        n, d = self.points.shape
        return (
            f"Sample({n} points in {d}-D, {int(self.is_outlier.sum())} outliers, {len(np.unique(self.scan))} scan(s))"
        )

    def where(self, rows: ArrayLike) -> Sample:
        """Keep some of the rows.

        Parameters
        ----------
        rows : (n,) array_like of bool, or array_like of int

        Returns
        -------
        Sample
        """
        chosen = self._rows(rows)
        return Sample(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def joined(self, other: Sample) -> Sample:
        """Append another sample as further scans.

        Parameters
        ----------
        other : Sample
            Of the same dimension; its scan numbers go on after those here.

        Returns
        -------
        Sample
        """
        if self.points.shape[1] != other.points.shape[1]:
            raise ValueError(f"joined: a sample in {self.points.shape[1]}-D and one in {other.points.shape[1]}-D")
        next_scan = 1 + int(self.scan.max(initial=-1))
        later = replace(other, scan=other.scan + next_scan)
        pairs = ((getattr(self, field.name), getattr(later, field.name)) for field in fields(self))
        return Sample(*(np.concatenate(pair) for pair in pairs))

    def noisy(self, noise: float, kind: str = "normal", *, rng: Seed) -> Sample:
        """Disturb every point but the outliers.

        Parameters
        ----------
        noise : float [L]
            Standard deviation, or the step of the grid where `kind` is "quantized".
        kind : {"normal", "isotropic", "quantized"}
            Gaussian along the true normal; Gaussian in every coordinate; rounded to multiples of `noise` (outliers too).
        rng : numpy.random.Generator or int

        Returns
        -------
        Sample

        Raises
        ------
        ValueError
            Negative noise, an unknown kind.
        """
        not_negative(noise=noise)
        if kind not in NOISE_KINDS:
            raise ValueError(f"noise_kind: expected one of {', '.join(NOISE_KINDS)}, got {kind!r}")
        generator = as_generator(rng)
        if noise == 0:
            return self
        if kind == "quantized":
            return replace(self, points=noise * np.round(self.points / noise))
        if kind == "normal":
            shift = generator.normal(0.0, noise, (len(self), 1)) * self.normals
        else:
            shift = generator.normal(0.0, noise, self.points.shape) * ~self.is_outlier[:, None]
        return replace(self, points=self.points + shift)

    def with_outliers(self, number: int, *, rng: Seed) -> Sample:
        """Append outliers, uniform in the box of the points enlarged by a quarter of its diagonal on every side.

        Parameters
        ----------
        number : int
        rng : numpy.random.Generator or int

        Returns
        -------
        Sample
        """
        number = count(number, "number of outliers", least=0)
        if len(self) == 0:
            raise ValueError("with_outliers: the sample is empty, so it has no box")
        generator = as_generator(rng)
        lower, upper = self.points.min(axis=0), self.points.max(axis=0)
        margin = 0.25 * np.linalg.norm(upper - lower)
        stray = generator.uniform(lower - margin, upper + margin, (number, self.points.shape[1]))
        scans = generator.choice(self.scan, number)
        outliers = Sample(stray, np.zeros_like(stray), stray, np.ones(number, dtype=bool), scans)
        pairs = ((getattr(self, field.name), getattr(outliers, field.name)) for field in fields(self))
        return Sample(*(np.concatenate(pair) for pair in pairs))

    def moved(self, rows: ArrayLike, *, angle: float = 0.0, shift: float = 0.0, rng: Seed) -> Sample:
        """Move a part rigidly, as a scan that was registered badly: `points` move, `clean` stays, normals turn.

        Parameters
        ----------
        rows : (n,) array_like of bool, or array_like of int
            The part, such as ``sample.scan == 1`` or ``sample.points[:, 0] > 0``.
        angle : float [rad]
            Turn about the centroid of the part; in space about a random axis.
        shift : float [L]
            Length of the translation, in a random direction.
        rng : numpy.random.Generator or int

        Returns
        -------
        Sample
        """
        not_negative(shift=shift, angle=abs(angle))
        chosen = self._rows(rows)
        generator = as_generator(rng)
        d = self.points.shape[1]
        translation = _direction(generator, d) * shift
        turn = _rotation(angle, _direction(generator, 3)) if d == 3 else _planar_rotation(angle)
        points, normals = self.points.copy(), self.normals.copy()
        middle = points[chosen].mean(axis=0) if len(points[chosen]) else np.zeros(d)
        points[chosen] = (points[chosen] - middle) @ turn.T + middle + translation
        normals[chosen] = normals[chosen] @ turn.T
        return replace(self, points=points, normals=normals)

    def _rows(self, rows: ArrayLike) -> NDArray:
        chosen = np.asarray(rows)
        if chosen.dtype == bool and chosen.shape == (len(self),):
            return np.flatnonzero(chosen)
        integers = chosen.dtype.kind in "iu" or chosen.size == 0
        if not integers or chosen.ndim != 1 or (len(chosen) and not (0 <= chosen.min() <= chosen.max() < len(self))):
            raise ValueError(
                f"rows: expected a mask of {len(self)} rows or row numbers, got {chosen.dtype} {chosen.shape}"
            )
        return chosen.astype(np.intp)


def _direction(rng: np.random.Generator, d: int) -> Array:
    vector = rng.standard_normal((1, d))
    return (vector / length(vector))[0]


def _rotation(angle: float, axis: Sequence[float] | Array) -> Array:
    """Turn about a unit axis (Rodrigues), (3, 3)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def _planar_rotation(angle: float) -> Array:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
