"""The point cloud that the readers give: coordinates, whatever else the file carries, and the file's row of each point."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import DTypeLike, NDArray


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points as they stand in a file; usable wherever an array of points is.

    Attributes
    ----------
    points : (n, 2) or (n, 3) ndarray of float64 [L]
        Two columns only where the file has no third.
    attributes : mapping of str to (n, ...) ndarray
        Everything else the file says of a point, in the file's own type: ``"normals"`` (n, 3), ``"colors"`` (n, 3) or
        (n, 4), and the rest by its name.
    rows : (n,) ndarray of int64
        The file's row of each point, from 0; it differs from 0 .. n-1 only where invalid rows were dropped.
    dropped : int
        How many rows were dropped because a coordinate was NaN or infinite.
    """

    points: NDArray[np.float64]
    attributes: Mapping[str, NDArray] = field(default_factory=dict)
    rows: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    dropped: int = 0

    def __len__(self) -> int:
        return len(self.points)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray:
        if copy:
            return np.array(self.points, dtype=dtype)
        return np.asarray(self.points, dtype=dtype)

    def __repr__(self) -> str:
        n, d = self.points.shape
        carried = f", attributes {sorted(self.attributes)}" if self.attributes else ""
        dropped = f", {self.dropped} invalid rows dropped" if self.dropped else ""
        return f"PointCloud({n} points in {d}-D{carried}{dropped})"


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """Faces with any number of corners, grouped by that number.

    Attributes
    ----------
    groups : tuple of ((m,) ndarray of int64, (m, k) ndarray of int64)
        Place of each face in the file, and its corners.
    """

    groups: tuple[tuple[NDArray[np.int64], NDArray[np.int64]], ...]

    def __len__(self) -> int:
        return sum(len(places) for places, _ in self.groups)


@dataclass(frozen=True, slots=True, eq=False)
class Content:
    """What a format module read: not yet checked for NaN, not yet frozen.

    Attributes
    ----------
    points : (n, 2) or (n, 3) ndarray of float64 [L]
    attributes : dict of str to (n, ...) ndarray
    polygons : Polygons or None
        None where the format has no faces at all.
    line_of : callable or None
        Gives the line of a point, from 1, for messages; None where the file is not text.
    """

    points: NDArray[np.float64]
    attributes: dict[str, NDArray]
    polygons: Polygons | None = None
    line_of: Callable[[int], int] | None = None
