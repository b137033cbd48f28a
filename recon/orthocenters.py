"""Where y_T is: the centre of the smallest sphere orthogonal to all vertices of a simplex (paper, section 3)."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

_SLENDER = 2.0**-17  # simplices flatter than this get their orthocentres from fractions


def orthocenters(points: NDArray, weights: NDArray, rows: NDArray, origin: NDArray) -> NDArray[np.float64]:
    """Give the centres (s, d) of the smallest spheres orthogonal to simplices (s, k+1) of weighted points, minus the origin.

    In float64, which serves but for slender simplices: theirs are rounded once.
    """
    first = points[rows[:, 0]]
    if rows.shape[1] == 1:
        return first - origin
    edges = points[rows[:, 1:]] - first[:, None]
    lengths = np.linalg.norm(edges, axis=2)
    right = 0.5 * (lengths + (weights[rows[:, :1]] - weights[rows[:, 1:]]) / lengths)
    axes, upper = np.linalg.qr(np.swapaxes(edges / lengths[..., None], 1, 2))
    steep = np.abs(np.diagonal(upper, axis1=1, axis2=2)).min(axis=1)
    slender = ~(steep > _SLENDER)
    upper[slender] = np.eye(rows.shape[1] - 1)
    offset = np.linalg.solve(np.swapaxes(upper, 1, 2), right[..., None])
    centers = first - origin + (axes @ offset)[..., 0]
    for i in np.flatnonzero(slender):
        centers[i] = _exact_orthocenter(points[rows[i]], weights[rows[i]], origin)
    return centers


def _exact_orthocenter(points: NDArray, weights: NDArray, origin: NDArray) -> list[float]:
    """Centre of one simplex, rounded once: the Gram system of its edges in fractions."""
    p = [[Fraction(value) for value in row] for row in points.tolist()]
    w = [Fraction(value) for value in weights.tolist()]
    edges = [[a - b for a, b in zip(row, p[0])] for row in p[1:]]
    size = len(edges)

    def dot(u: list[Fraction], v: list[Fraction]) -> Fraction:
        return sum((a * b for a, b in zip(u, v)), Fraction(0))

    system = [[dot(u, v) for v in edges] + [(dot(u, u) + w[0] - w[i + 1]) / 2] for i, u in enumerate(edges)]
    for column in range(size):  # positive definite: pivots are never zero
        for row in range(size):
            if row != column:
                factor = system[row][column] / system[column][column]
                system[row] = [a - factor * b for a, b in zip(system[row], system[column])]
    along = [system[i][size] / system[i][i] for i in range(size)]
    shift = [dot(along, [edge[axis] for edge in edges]) for axis in range(len(origin))]
    return [_rounded(p[0][axis] - Fraction(o) + shift[axis]) for axis, o in enumerate(origin.tolist())]


def _rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:  # beyond float64: that far out
        return math.copysign(math.inf, value)
