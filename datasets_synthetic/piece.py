"""What a surface is made of: pieces with an exact closest point, and the points they answer with.

A piece is a bounded curve in the plane or surface in space. It knows three things: the nearest of its
points, how to draw points uniformly, and a quadrature rule. Distances, areas, volumes and samples of
every surface follow from these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Foot:
    """Points of a surface (feet of perpendiculars, samples or nodes) and how the surface lies there.

    Attributes
    ----------
    points : (m, d) ndarray of float64 [L]
    normals : (m, d) ndarray of float64
        Unit, outward.
    curvatures : (m, d - 1) ndarray of float64 [1/L]
        Principal curvatures, descending; positive where the surface bends away from the normal (a sphere: 1/R).
    """

    points: Array
    normals: Array
    curvatures: Array

    def take(self, rows: NDArray) -> Foot:
        """Give some of the rows."""
        return Foot(self.points[rows], self.normals[rows], self.curvatures[rows])

    @staticmethod
    def joined(feet: Sequence[Foot]) -> Foot:
        """Stack several into one."""
        return Foot(
            np.concatenate([foot.points for foot in feet]),
            np.concatenate([foot.normals for foot in feet]),
            np.concatenate([foot.curvatures for foot in feet]),
        )

    def reversed(self) -> Foot:
        """Give the same points seen from the other side."""
        return Foot(self.points, -self.normals, -self.curvatures[:, ::-1])


class Piece(Protocol):
    """A bounded curve in the plane or surface in space, with an exact closest point."""

    @property
    def bounds(self) -> Array:
        """Give a box that contains the piece, (2, d): lower and upper corner [L]."""

    def nearest(self, x: Array) -> Foot:
        """Give the nearest point of the piece for each row of x, (m, d)."""

    def draw(self, n: int, rng: np.random.Generator) -> Foot:
        """Draw n points, independent and uniform by length or area."""

    def rule(self, order: int) -> tuple[Foot, Array]:
        """Give nodes and weights: the sum of weights * f(nodes) is the integral of f over the piece.

        Converges spectrally in `order`. Flat parts may answer with a single node: they are exact for what is
        constant there (1, the curvatures, the support function n·p), and for nothing else.
        """


def nearest_of(pieces: Sequence[Piece], x: Array) -> Foot:
    """Give the nearest point of the union; where two pieces tie, the first of them has it.

    Each row asks the piece with the nearest box first, then only those whose boxes are no farther than what it found.
    """
    if len(pieces) == 1:
        return pieces[0].nearest(x)
    m, d = x.shape
    gap = np.empty((len(pieces), m))
    for k, piece in enumerate(pieces):
        lower, upper = piece.bounds
        gap[k] = length(np.maximum(np.maximum(lower - x, x - upper), 0.0))
    first = gap.argmin(axis=0)
    best, owner = np.full(m, np.inf), np.full(m, len(pieces))
    found = Foot(np.empty((m, d)), np.empty((m, d)), np.empty((m, d - 1)))
    for later in (False, True):
        for k, piece in enumerate(pieces):
            rows = np.flatnonzero((first != k) & (gap[k] <= best) if later else first == k)
            if len(rows) == 0:
                continue
            foot = piece.nearest(x[rows])
            distance = length(x[rows] - foot.points)
            better = (distance < best[rows]) | ((distance == best[rows]) & (k < owner[rows]))
            rows = rows[better]
            best[rows], owner[rows] = distance[better], k
            found.points[rows] = foot.points[better]
            found.normals[rows] = foot.normals[better]
            found.curvatures[rows] = foot.curvatures[better]
    return found


def bounds_of(pieces: Sequence[Piece]) -> Array:
    """Give the box around several pieces, (2, d)."""
    boxes = np.array([piece.bounds for piece in pieces])
    return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def rejection(
    n: int,
    propose: Callable[[int], tuple[Foot, Array]],
    rng: np.random.Generator,
    tries: int = 500_000,
) -> Foot:
    """Draw exactly n points by rejection.

    Parameters
    ----------
    n : int
    propose : callable
        Number of candidates -> candidates and the probability with which each is kept.
    rng : numpy.random.Generator
    tries : int
        After this many candidates without a single one kept, give up.

    Returns
    -------
    Foot

    Raises
    ------
    ValueError
        Nothing is ever kept.
    """
    kept: list[Foot] = []
    have = tried = 0
    batch = 2 * n + 16
    while have < n or not kept:
        candidates, probability = propose(batch)
        rows = np.flatnonzero(rng.random(batch) < probability)
        kept.append(candidates.take(rows))
        have, tried = have + len(rows), tried + batch
        if have == 0 and tried >= tries:
            raise ValueError(f"the density leaves nothing to sample: none of {tried} candidates was kept")
        batch = int(np.clip(1.2 * (n - have) * tried / max(have, 1), 16, 1_000_000))
    return Foot.joined(kept).take(np.arange(n))


def length(vectors: Array) -> Array:
    """Give the Euclidean lengths of the rows, (m, d) -> (m,)."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def unit(vectors: Array, instead: Array) -> Array:
    """Scale the rows to length one; rows that are zero become those of `instead`."""
    norm = length(vectors)
    zero = norm == 0
    with np.errstate(invalid="ignore"):
        return np.where(zero[:, None], instead, vectors / np.where(zero, 1.0, norm)[:, None])


def descending(first: Array, second: Array) -> Array:
    """Pair two principal curvatures, the larger one first, (m,), (m,) -> (m, 2)."""
    return np.stack([np.maximum(first, second), np.minimum(first, second)], axis=1)


def interval_rule(lower: float, upper: float, order: int, panels: int = 1) -> tuple[Array, Array]:
    """Give the Gauss-Legendre nodes and weights of an interval, or of equal panels that it is cut into."""
    nodes, weights = _gauss(order)
    half = 0.5 * (upper - lower) / panels
    middles = lower + half * (2.0 * np.arange(panels) + 1.0)
    return (middles[:, None] + half * nodes).ravel(), np.tile(half * weights, panels)


@cache
def _gauss(order: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(order)
