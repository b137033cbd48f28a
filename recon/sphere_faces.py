"""The faces of a union of balls: patches of spheres, arcs of circles, corners, and how they meet (paper, section 4.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .alpha import AlphaComplex
from .outside import OUTSIDE, Outside
from .regular import RegularTriangulation


@dataclass(frozen=True, slots=True, eq=False)
class SphereFaces:
    """The l-faces of F_alpha: patches of spheres (l = 2), arcs of circles (1), corners (0); in 2-D arcs and corners.

    An l-face is a connected piece of the boundary of F_alpha on the l-sphere K_T common to the spheres of T.

    Attributes
    ----------
    simplices : (f, d-l) ndarray of int32
        T: input rows, ascending in a row.
    centers : (f, d) ndarray of float64 [L]
        Of K_T.
    radii : (f,) ndarray of float64 [L]
        Of K_T.
    points : (f, d) ndarray of float64 [L] or None
        Where a corner is; None for l > 0.
    on : (f, d-l) ndarray of int64
        The faces of dimension l + 1 that it bounds: rows of `faces(l + 1)`, of T without its vertex of that column.
        No columns for l = d - 1.
    region : (f,) ndarray of int64
        The void that it borders, -1 for the outside.
    """

    simplices: NDArray[np.int32]
    centers: NDArray[np.float64]
    radii: NDArray[np.float64]
    points: NDArray[np.float64] | None
    on: NDArray[np.int64]
    region: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.simplices)


class Spheres:
    """The spheres of squared radii weight + alpha, in units of a power of two that brings all lengths below 1.

    Attributes
    ----------
    balls : (n, 4) ndarray of float64
        Centre and squared radius, not below zero.
    squares : (n,) ndarray of float64
        Squared radii, of empty balls negative.
    exponent : int
        Of the unit.
    """

    def __init__(self, triangulation: RegularTriangulation, alpha: float) -> None:
        points, weights = triangulation.points, triangulation.weights
        used = np.unique(triangulation.cells)
        extent = float(np.ptp(points[used], axis=0).max())
        radius = math.sqrt(max(float((weights[used] + alpha).max()), 0.0))
        self.dimension = points.shape[1]
        self.origin = points[triangulation.cells[0, 0]]
        self.exponent = math.frexp(max(extent, radius))[1]
        self.squares = np.ldexp(weights + alpha, -2 * self.exponent)
        self.balls = np.zeros((len(points), 4))
        self.balls[:, : self.dimension] = np.ldexp(points - self.origin, -self.exponent)
        self.balls[:, 3] = np.maximum(self.squares, 0.0)

    def unscaled(self, values: NDArray, power: int) -> NDArray[np.float64]:
        """Give lengths to a power in the unit of the points."""
        return np.ldexp(values, power * self.exponent)

    def in_common(self, rows: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Centres (s, d) and radii (s,) of the spheres K_T common to the spheres of simplices, in scaled units."""
        d = self.dimension
        first = self.balls[rows[:, 0]]
        if rows.shape[1] == 1:
            return first[:, :d].copy(), np.sqrt(first[:, 3])
        edges = self.balls[rows[:, 1:], :d] - first[:, None, :d]
        right = 0.5 * ((edges**2).sum(axis=2) + first[:, 3:] - self.balls[rows[:, 1:], 3])
        if len(rows) == 0:
            return np.empty((0, d)), np.empty(0)
        # Orthonormal axes of the edges (QR): edges = lower triangle times axes.
        axes, upper = np.linalg.qr(np.swapaxes(edges, 1, 2))
        offset = np.linalg.solve(np.swapaxes(upper, 1, 2), right[..., None])
        shift = (axes @ offset)[..., 0]
        return first[:, :d] + shift, np.sqrt(np.maximum(first[:, 3] - (offset[..., 0] ** 2).sum(axis=1), 0.0))


def faces_around(spheres: Spheres, outside: Outside, regions: NDArray[np.int64], k: int) -> SphereFaces:
    """Faces on the spheres common to k + 1 spheres, one a component of the complement of K_alpha around their simplex."""
    d = spheres.dimension
    if k > outside.family.triangulation.dimension:
        return _placed(
            spheres, np.empty((0, k + 1), np.int32), None, np.empty((0, k + 1), np.int64), np.empty(0, np.int64)
        )
    cell, place, _, corners = outside.faces_around(k)
    slots = np.array(corners)[place]
    rows = outside.cells[cell[:, None], slots]
    on = np.empty((len(cell), k + 1 if k else 0), np.int64)
    if k:
        _, _, below, lower_corners = outside.faces_around(k - 1)
        where = {kept: column for column, kept in enumerate(lower_corners)}
        for column in range(k + 1):
            lower = np.delete(slots, column, axis=1)
            columns = np.array([where[tuple(kept)] for kept in lower.tolist()], np.int64)
            on[:, column] = below[cell, columns]
    away = None if k < d - 1 else _away_from(spheres, outside, rows, cell, slots)
    return _placed(spheres, rows, away, on, regions[cell])


def faces_in_wide_space(spheres: Spheres, complex_: AlphaComplex, alpha: float, k: int) -> SphereFaces:
    """Faces where the centres span at least two dimensions less than the space: one a simplex of K_alpha."""
    if k > complex_.dimension:
        rows = np.empty((0, k + 1), np.int32)
        return _placed(spheres, rows, None, np.empty((0, k + 1), np.int64), np.empty(0, np.int64))
    kept = complex_.entry(k) <= alpha
    on = np.empty((np.count_nonzero(kept), 0), np.int64)
    if k:
        number = np.cumsum(complex_.entry(k - 1) <= alpha) - 1
        on = number[complex_._family.faces(k)[kept]]
    rows = complex_.simplices(k)[kept]
    return _placed(spheres, rows, None, on, np.full(len(rows), OUTSIDE))


def _placed(spheres: Spheres, rows: NDArray, away: NDArray | None, on: NDArray, region: NDArray) -> SphereFaces:
    """Place faces: `away` are the unit vectors from the centre of K_T to the corners."""
    centers, radii = spheres.in_common(rows)
    points = None
    if rows.shape[1] == spheres.dimension:
        points = centers if away is None else centers + radii[:, None] * away
        points = spheres.unscaled(points, 1) + spheres.origin
    arrays = rows, spheres.unscaled(centers, 1) + spheres.origin, spheres.unscaled(radii, 1), points, on, region
    for array in arrays:
        if array is not None:
            array.flags.writeable = False
    return SphereFaces(*arrays)


def _away_from(spheres: Spheres, outside: Outside, rows: NDArray, cell: NDArray, slots: NDArray) -> NDArray[np.float64]:
    """Unit normals (f, d) of facets of K_alpha, into the open cell."""
    d = spheres.dimension
    corners = spheres.balls[rows, :d]
    if d == 1:
        normal = np.ones((len(rows), 1))
    elif d == 2:
        edge = corners[:, 1] - corners[:, 0]
        normal = np.column_stack([-edge[:, 1], edge[:, 0]])
    else:
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    opposite = d * (d + 1) // 2 - slots.sum(axis=1)
    apex = outside.cells[cell, opposite]
    finite = apex >= 0
    sign = np.ones(len(rows))
    inner = apex.copy()
    if outside.finite:  # of an infinite cell the finite one behind it tells
        behind = outside.neighbors[cell, opposite]
        mirror = (outside.neighbors[behind] == cell[:, None]) & (
            outside.cells[behind][:, :, None] != rows[:, None, :]
        ).all(axis=2)
        inner = np.where(finite, apex, outside.cells[behind, mirror.argmax(axis=1)])
        side = ((spheres.balls[inner, :d] - corners[:, 0]) * normal).sum(axis=1)
        sign = np.where((side > 0) == finite, 1.0, -1.0)
    else:  # a flat triangulation: the first half of the cells is on one side of it, the others on the other
        sign = np.where(cell < len(outside.cells) // 2, 1.0, -1.0)
    return normal * sign[:, None]
