"""Exact signs of polynomials over many rows at once: one formula, two arithmetics.

A formula is run on `Rounded` numbers first, which carry a rigorous bound of their rounding error; the rows whose sign that
leaves open are run again on Python integers (object arrays), to which the coordinates are brought by one power of two.
The checkers stand on this module alone, and nothing that builds a result does.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

_EPS = 2.0**-52  # twice the unit roundoff: covers the rounding of the bound's own last term
_GROW = 1.0 + 2.0**-49  # covers the rounding of the bound's other terms
_TINY = 1e-321  # covers underflow, in the product and in its bound
_WHOLE = 2.0**53  # whole numbers below this are exact
_CHUNK = 1 << 17  # rows at a time: the scratch arrays stay near the processor

Formula = Callable[..., Any]


class Rounded:
    """Float64 numbers with a bound of their absolute error (running error analysis).

    Where the numbers that all comes from are `whole`, results below 2^53 have no error at all; nor has a product with zero.
    """

    __slots__ = ("error", "value", "whole")

    def __init__(self, value: NDArray[np.float64], error: NDArray[np.float64] | float = 0.0, whole: bool = False):
        self.value = value
        self.error = error
        self.whole = whole

    def __add__(self, other: Rounded) -> Rounded:
        return self._sum(self.value + other.value, other)

    def __sub__(self, other: Rounded) -> Rounded:
        return self._sum(self.value - other.value, other)

    def __mul__(self, other: Rounded) -> Rounded:
        value = self.value * other.value
        here, there = np.abs(self.value), np.abs(other.value)
        error = (here * other.error + there * self.error + self.error * other.error) * _GROW
        zero = (here + self.error == 0.0) | (there + other.error == 0.0)
        return self._rounded(value, np.where(zero, 0.0, error + _TINY), other)

    def __neg__(self) -> Rounded:
        return Rounded(-self.value, self.error, self.whole)

    def sign(self) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
        """The signs, and where they are certain; infinite and NaN are not."""
        size = np.abs(self.value)
        certain = (size > self.error) | ((size == 0.0) & (self.error == 0.0))
        return np.sign(np.where(certain, self.value, 0.0)).astype(np.int8), certain

    def _sum(self, value: NDArray[np.float64], other: Rounded) -> Rounded:
        return self._rounded(value, (self.error + other.error) * _GROW, other)

    def _rounded(self, value: NDArray[np.float64], error: NDArray[np.float64] | float, other: Rounded) -> Rounded:
        size = np.abs(value)
        total = error + _EPS * size
        if not (self.whole and other.whole):
            return Rounded(value, total)
        exact = (size < _WHOLE) & (self.error == 0.0) & (other.error == 0.0)
        return Rounded(value, np.where(exact, 0.0, total), True)


def determinant(matrix: list[list[Any]]) -> Any:
    """Determinant by minors of the leading rows; needs only +, - and *, so any arithmetic will do.

    n 2^(n-1) products for n rows: meant for n up to 7.
    """
    n = len(matrix)
    minors: dict[tuple[int, ...], Any] = {(j,): matrix[0][j] for j in range(n)}
    for row in range(1, n):
        grown = {}
        for columns in combinations(range(n), row + 1):
            total = matrix[row][columns[row]] * minors[columns[:row]]
            for place in range(row - 1, -1, -1):
                term = matrix[row][columns[place]] * minors[columns[:place] + columns[place + 1 :]]
                total = total + term if (row - place) % 2 == 0 else total - term
            grown[columns] = total
        minors = grown
    return minors[tuple(range(n))]


def dot(a: list[Any], b: list[Any]) -> Any:
    """Sum of products."""
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:]):
        total = total + x * y
    return total


class Spot:
    """One weighted point a row: a list of coordinate columns and a weight column, in whatever arithmetic."""

    __slots__ = ("weight", "x")

    def __init__(self, x: list[Any], weight: Any):
        self.x = x
        self.weight = weight

    def edge(self, other: Spot) -> list[Any]:
        """Vector to another spot."""
        return [b - a for a, b in zip(self.x, other.x)]

    def lift(self, edge: list[Any], other: Spot) -> Any:
        """Power of another spot, at the end of `edge`, over this one with its weight: |edge|^2 - w_other + w_self."""
        return dot(edge, edge) - (other.weight - self.weight)


class Cloud:
    """Weighted points whose formulas have exact signs.

    Parameters
    ----------
    points : (n, d) ndarray of float64 [L]
    weights : (n,) ndarray of float64 [L^2], optional
    axes : sequence of int, optional
        The coordinates along which `orient` is taken, where the points span less than d dimensions.
    """

    def __init__(
        self,
        points: NDArray[np.float64],
        weights: NDArray[np.float64] | None = None,
        axes: tuple[int, ...] | None = None,
    ):
        self.points = points
        self.weights = np.zeros(len(points)) if weights is None else weights
        self.axes = tuple(range(points.shape[1])) if axes is None else axes
        self._exponent = min(_lowest_bit(self.points), _lowest_bit(self.weights) // 2)
        span = np.ldexp(np.abs(self.points).max(initial=0.0), -max(self._exponent, -1000))
        self._whole = bool(span < _WHOLE) and self._exponent > -1000

    def sign(self, formula: Formula, *rows: NDArray[np.integer]) -> NDArray[np.int8]:
        """Give the exact sign of a homogeneous formula of spots.

        Parameters
        ----------
        formula : callable
            Takes one `Spot` an array of rows; weights must count as squared lengths in it.
        rows : (m,) ndarrays of int
            Which points the spots are.

        Returns
        -------
        (m,) ndarray of int8
        """
        result = np.empty(len(rows[0]), np.int8)
        for start in range(0, len(result), _CHUNK):
            part = [r[start : start + _CHUNK] for r in rows]
            with np.errstate(all="ignore"):
                sign, certain = formula(*(self._rounded(r) for r in part)).sign()
            open_rows = np.flatnonzero(~certain)
            if len(open_rows):
                value = formula(*(self._integer(r[open_rows]) for r in part))
                sign[open_rows] = (value > 0).astype(np.int8) - (value < 0).astype(np.int8)
            result[start : start + _CHUNK] = sign
        return result

    def sign_of_sum(self, formula: Formula, *rows: NDArray[np.integer]) -> int:
        """Give the exact sign of the sum of a homogeneous formula over all rows, by integers alone."""
        total = int(np.sum(formula(*(self._integer(r) for r in rows))))
        return (total > 0) - (total < 0)

    def orient(self, *corners: Spot) -> Any:
        """Orientation of d+1 spots along the axes: positive for a positive cell."""
        first, *others = corners
        return determinant([[c.x[a] - first.x[a] for a in self.axes] for c in others])

    def power(self, *spots: Spot) -> Any:
        """Power of the last spot over the orthosphere of the others (d+1 of them), up to a positive factor.

        The others must be a positive cell along the axes.
        """
        *corners, q = spots
        edges = [q.edge(c) for c in corners]
        rows = [[e[a] for a in self.axes] + [q.lift(e, c)] for e, c in zip(edges, corners)]
        return determinant(rows) if len(self.axes) % 2 else -determinant(rows)

    @staticmethod
    def attachment(*spots: Spot) -> Any:
        """Power of the last spot over the smallest orthosphere of the others, up to a positive factor.

        A bordered Gram determinant (any number of affinely independent corners, any d): equivalent to B.4 of the paper.
        """
        first, *others, q = spots
        edges = [first.edge(c) for c in others]
        gap = first.edge(q)
        rows = [[dot(a, b) for b in edges] + [first.lift(a, c)] for a, c in zip(edges, others)]
        return determinant([*rows, [dot(gap, b) for b in edges] + [first.lift(gap, q)]])

    def perturbed_power(self, cells: NDArray[np.integer], q: NDArray[np.integer]) -> NDArray[np.int8]:
        """Give the sign of the power of points over positive cells, ties broken by index; never 0 for q not in the cell.

        With weights w_i + eps_i, eps_0 >> eps_1 >> ..., a vanishing power is -eps_q + sum(lambda_j eps_j), lambda_j the
        barycentric coordinates of q: the lowest index whose coefficient does not vanish decides.
        """
        sign = self.sign(self.power, *cells.T, q)
        tied = np.flatnonzero(sign == 0)
        order = np.argsort(np.column_stack([cells[tied], q[tied]]), axis=1)
        last = cells.shape[1]
        for rank in range(last + 1):
            corner = order[:, rank]
            replaced = cells[tied]
            inside = np.flatnonzero(corner < last)
            replaced[inside, corner[inside]] = q[tied[inside]]
            coefficient = np.full(len(tied), -1, np.int8)
            coefficient[inside] = self.sign(self.orient, *replaced[inside].T)
            sign[tied] = coefficient
            tied, order = tied[coefficient == 0], order[coefficient == 0]
        return sign

    def _rounded(self, rows: NDArray[np.integer]) -> Spot:
        points, weights = self.points[rows], self.weights[rows]
        if self._whole:
            points, weights = np.ldexp(points, -self._exponent), np.ldexp(weights, -2 * self._exponent)
        return Spot([Rounded(x, 0.0, self._whole) for x in points.T], Rounded(weights, 0.0, self._whole))

    def _integer(self, rows: NDArray[np.integer]) -> Spot:
        return Spot(
            [_integers(column, self._exponent) for column in self.points[rows].T],
            _integers(self.weights[rows], 2 * self._exponent),
        )


def _lowest_bit(values: NDArray[np.float64]) -> int:
    """The largest exponent e such that every value is an integer times 2^e; 0 where all are zero."""
    mantissa, power = np.frexp(values[values != 0])
    if mantissa.size == 0:
        return 0
    whole = (mantissa * 2.0**53).astype(np.int64)
    zeros = np.frexp((whole & -whole).astype(np.float64))[1] - 1
    return int((power - 53 + zeros).min())


def _integers(values: NDArray[np.float64], exponent: int) -> NDArray[np.object_]:
    """The values over 2^exponent, as Python integers."""
    mantissa, power = np.frexp(values)
    shift = power.astype(np.int64) - 53 - exponent
    whole = (mantissa * 2.0**53).astype(np.int64)
    # A mantissa ends in as many zeros as a negative shift takes away.
    whole >>= np.minimum(np.maximum(-shift, 0), 63)
    return whole.astype(object) << np.where(values == 0, 0, np.maximum(shift, 0)).astype(object)
