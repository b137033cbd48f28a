"""Closest points of a curve or surface that is given by a formula: a converged root, found from many starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .jets import Jet, variables
from .piece import Array, interval_rule

_NEIGHBORS = 8  # seeds that a start must beat
_NEAREST = 24  # seeds asked of the tree before all of them are looked at
_BLOCK = 4_000_000  # entries of a distance table held at once
_STEPS = 200
_CONVERGED = 1e-13  # gradient per unit length, relative to the size of what is subtracted
_MARGIN = 1.2  # bounds taken on the grid, held against what lies between


@dataclass(frozen=True, eq=False)
class Formula:
    """A smooth map from a box of k parameters into d-space.

    The closest point is the least of the local minima that Newton's method reaches from seeds on a grid.
    Every seed is a start that is no farther than its neighbours among the seeds and could, by a second-order bound
    on the distance between grid nodes, be the node next to the global minimum. So the minimum is global as long as
    the grid resolves the surface; each root is converged to 1e-13 in its gradient, which leaves an error of
    second order, about 1e-26 / (1 - distance * curvature), and rounding, in the distance.

    Attributes
    ----------
    coordinates : callable
        k jets -> d jets [L].
    lower, upper : sequence of k floats
        The box of parameters.
    grid : sequence of k ints
        Seeds along each parameter, both ends included.
    clamped : sequence of k bools
        True where the piece ends at the ends of the parameter, false where it closes on itself.
    """

    coordinates: Callable[..., tuple[Jet, ...]]
    lower: Sequence[float]
    upper: Sequence[float]
    grid: Sequence[int]
    clamped: Sequence[bool]

    def at(self, parameters: Array) -> tuple[Array, Array, Array]:
        """Evaluate.

        Parameters
        ----------
        parameters : (m, k) ndarray of float64

        Returns
        -------
        (m, d), (m, k, d), (m, k, k, d) ndarrays of float64
            Points [L], first and second derivatives.
        """
        jets = self.coordinates(*variables(parameters))
        return (
            np.stack([jet.value for jet in jets], axis=1),
            np.moveaxis(np.stack([jet.first for jet in jets], axis=2), 0, 1),
            np.moveaxis(np.stack([jet.second for jet in jets], axis=3), 2, 0),
        )

    def nearest(self, x: Array) -> Array:
        """Give the parameters of the closest point, (m, d) -> (m, k)."""
        best = np.full(len(x), np.inf)
        parameters = np.empty((len(x), len(self.grid)))
        for start in range(0, len(x), _BLOCK // _NEAREST):
            rows, seeds = self._starts(x[start : start + _BLOCK // _NEAREST])
            rows += start
            reached, distance_sq = self._descend(x[rows], self._seeds[0][seeds])
            order = np.lexsort((distance_sq, rows))
            first = order[np.unique(rows[order], return_index=True)[1]]
            best[rows[first]] = distance_sq[first]
            parameters[rows[first]] = reached[first]
        if not np.isfinite(best).all():
            raise RuntimeError("a closest point was not found: please report this")
        return parameters

    @cached_property
    def bounds(self) -> Array:
        """Give a box around the image, (2, d), a grid error of second order too large at most."""
        _, points, _, _, _, bend = self._seeds
        return np.array([points.min(axis=0) - bend, points.max(axis=0) + bend])

    def nodes(self) -> Array:
        """Give the parameters of the grid, (m, k)."""
        axes = [np.linspace(low, high, n) for low, high, n in zip(self.lower, self.upper, self.grid)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    def rule(self, order: int) -> tuple[Array, Array]:
        """Give Gauss-Legendre nodes (m, k) and weights (m,) of the parameter box, in panels of about 64 seeds."""
        axes = [
            interval_rule(low, high, order, panels=max(1, (n - 1) // 64))
            for low, high, n in zip(self.lower, self.upper, self.grid)
        ]
        nodes = np.stack(np.meshgrid(*(axis[0] for axis in axes), indexing="ij"), axis=-1)
        weights = np.ones(())
        for _, axis_weights in axes:
            weights = np.multiply.outer(weights, axis_weights)
        return nodes.reshape(-1, len(axes)), weights.ravel()

    @cached_property
    def _seeds(self) -> tuple[Array, Array, cKDTree, NDArray[np.intp], float, float]:
        """Give parameters, points, tree and neighbours of the seeds, and the bounds A [L^2] and B [L] of `_starts`."""
        parameters = self.nodes()
        points, first, second = self.at(parameters)
        half = 0.5 * np.subtract(self.upper, self.lower) / np.subtract(self.grid, 1)
        reach = (half * np.linalg.norm(first, axis=2)).sum(axis=1).max()
        bend = (half[:, None] * half * np.linalg.norm(second, axis=3)).sum(axis=(1, 2)).max()
        tree = cKDTree(points)
        neighbors = tree.query(points, _NEIGHBORS + 1)[1]
        return parameters, points, tree, neighbors, _MARGIN * float(reach) ** 2, _MARGIN * float(bend)

    def _starts(self, x: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Give pairs (row of x, seed): at least one a row.

        Along the parameter segment from the minimum q to the seed s next to it, the squared distance has slope zero
        at q and second derivative at most 2 (A + B (|q - x| + sqrt A)); and |q - x| is at most the nearest seed's
        distance. So s is among the seeds whose squared distance is within `band` of the nearest one's.
        """
        _, points, tree, neighbors, reach_sq, bend = self._seeds
        near, seed = tree.query(x, min(_NEAREST, len(points)))
        band = reach_sq + bend * (near[:, 0] + np.sqrt(reach_sq))
        limit = np.sqrt(near[:, 0] ** 2 + band)
        complete = near[:, -1] > limit
        row, column = np.nonzero((near <= limit[:, None]) & complete[:, None])
        rows, seeds = [row], [seed[row, column]]
        rest = np.flatnonzero(~complete)
        norm_sq = _squared(points)
        block = max(1, _BLOCK // len(points))
        for chunk in (rest[i : i + block] for i in range(0, len(rest), block)):
            table = norm_sq - 2.0 * x[chunk] @ points.T  # squared distances but for |x|^2, exact from afar, too
            row, column = np.nonzero(table <= (table.min(axis=1) + band[chunk])[:, None])
            rows.append(chunk[row])
            seeds.append(column)
        row, seed = np.concatenate(rows), np.concatenate(seeds)
        for k in range(1, _NEIGHBORS + 1):
            ahead = _advantage(points[seed], points[neighbors[seed, k]], x[row]) >= 0
            row, seed = row[ahead], seed[ahead]
        return row, seed

    def _descend(self, x: Array, parameters: Array) -> tuple[Array, Array]:
        """Minimise the distance by safeguarded Newton steps; gives parameters (m, k) and squared distances (m,)."""
        parameters = parameters.copy()
        clamped = np.asarray(self.clamped)
        lower, upper = np.where(clamped, self.lower, -np.inf), np.where(clamped, self.upper, np.inf)
        longest = 0.25 * np.subtract(self.upper, self.lower)
        points, first, second = self.at(parameters)
        scale = np.abs(points).max(axis=1) + np.abs(x).max(axis=1)
        shrink = np.ones(len(x))
        active = np.arange(len(x))
        for _ in range(_STEPS):
            step, slope = self._newton(points[active] - x[active], first[active], second[active], parameters[active])
            # Close to a root the gain drowns in rounding: there Newton's step is trusted as it is.
            close = slope <= 1e-6 * scale[active]
            shorter = np.where(close, 1.0, shrink[active]) / np.maximum(1.0, (np.abs(step) / longest).max(axis=1))
            trial = np.clip(parameters[active] + shorter[:, None] * step, lower, upper)
            new_points, new_first, new_second = self.at(trial)
            better = (_advantage(new_points, points[active], x[active]) >= 0) | close
            rows = active[better]
            parameters[rows], points[rows] = trial[better], new_points[better]
            first[rows], second[rows] = new_first[better], new_second[better]
            shrink[active] = np.where(better, 1.0, 0.5 * shrink[active])
            active = active[slope > _CONVERGED * scale[active]]  # a converged root has just taken one more step
            if len(active) == 0:
                return parameters, _squared(points - x)
        raise RuntimeError(f"{len(active)} closest points did not converge: please report this")

    def _newton(self, gap: Array, first: Array, second: Array, parameters: Array) -> tuple[Array, Array]:
        """Give the step (m, k), and the slope of half the squared distance per unit length of the surface (m,) [L].

        Where the second derivative is not positive definite, its eigenvalues are taken absolute: downhill, and out of
        saddles. A parameter at its end that pushes outward is held.
        """
        speed = np.linalg.norm(first, axis=2)
        gradient = np.einsum("mkd,md->mk", first, gap) / speed
        hessian = np.einsum("mid,mjd->mij", first, first) + np.einsum("mijd,md->mij", second, gap)
        hessian /= speed[:, :, None] * speed[:, None, :]
        outward = ((parameters <= self.lower) & (gradient > 0)) | ((parameters >= self.upper) & (gradient < 0))
        held = np.asarray(self.clamped) & outward
        gradient[held] = 0.0
        hessian[held[:, :, None] | held[:, None, :]] = 0.0
        diagonal = np.einsum("mii->mi", hessian)
        diagonal[held] = 1.0
        bent = np.flatnonzero((diagonal[:, 0] <= 0) | (np.linalg.det(hessian) <= 0))
        values, vectors = np.linalg.eigh(hessian[bent])
        hessian[bent] = (vectors * np.maximum(np.abs(values), 1e-3)[:, None, :]) @ vectors.swapaxes(1, 2)
        step = -np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0] / speed
        return step, np.abs(gradient).max(axis=1)


def _squared(vectors: Array) -> Array:
    return np.einsum("ij,ij->i", vectors, vectors)


def _advantage(points: Array, others: Array, x: Array) -> Array:
    """Give how much nearer, in squared distance, `points` are to x than `others`: no cancellation."""
    return np.einsum("md,md->m", points - others, 2.0 * x - points - others)
