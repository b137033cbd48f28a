"""Proofs that simplices are in no regular triangulation together: multipliers that sum their conditions to 0 > 0."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import DegenerateInput, as_points

Simplex = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Why some simplices are in no regular triangulation together, whatever the weights: checked in rational numbers.

    The lifted image of a point j has a height h_j. A simplex T is in R just where some hyperplane goes through its lifted
    corners and below all others. So sum_j y_j h_j > 0 for every affine dependence y of the points (sum y_j = 0,
    sum y_j p_j = 0) that is nowhere negative outside T, and positive somewhere there. Here is one such y for each T, and
    their sum is zero: 0 > 0.

    Attributes
    ----------
    simplices : tuple of tuple of int
    multipliers : tuple of dict of int to int
        The y of each simplex, by input row; zeros left out.
    """

    simplices: tuple[Simplex, ...]
    multipliers: tuple[dict[int, int], ...]

    def holds(self, points: ArrayLike) -> bool:
        """Check every condition in rational numbers, for points (n, d)."""
        rows = [[Fraction(x) for x in row] for row in as_points(points).tolist()]
        total: dict[int, int] = {}
        positive = False
        for simplex, y in zip(self.simplices, self.multipliers):
            if sum(y.values()) != 0:
                return False
            if any(sum(value * rows[j][axis] for j, value in y.items()) != 0 for axis in range(len(rows[0]))):
                return False
            if any(value < 0 for j, value in y.items() if j not in simplex):
                return False
            positive |= any(value > 0 for j, value in y.items() if j not in simplex)
            for j, value in y.items():
                total[j] = total.get(j, 0) + value
        return positive and not any(total.values())


class NotRegular(DegenerateInput):
    """No weights put the simplices into R together; `contradiction` proves it."""

    def __init__(self, contradiction: Contradiction) -> None:
        self.contradiction = contradiction
        names = [str(simplex) for simplex in contradiction.simplices]
        if len(names) == 2:
            which, why = " and ".join(names), "they meet outside of a common face"
        else:
            which = f"{', '.join(names[:3])}{', …' if len(names) > 3 else ''} ({len(names)} in all)"
            why = "their conditions contradict each other"
        super().__init__(f"simplices: no weights put {which} into R together, as {why}; leave one of them out")


def contradiction(points: NDArray[np.float64], parts: list[tuple[Simplex, dict[int, float]]]) -> Contradiction | None:
    """Make the multipliers that a linear program has found rational, so that they hold exactly.

    Parameters
    ----------
    points : (n, d) ndarray of float64
    parts : list of (simplex, multipliers)
        Multipliers by row, of points outside the simplex only, each above 0 and about right.

    Returns
    -------
    Contradiction or None
        None where no exact solution is near.
    """
    columns = [(part, j) for part, (_, y) in enumerate(parts) for j in y]  # what is given first,
    guess = [Fraction(value) for _, y in parts for value in y.values()]
    corners = [(part, i) for part, (simplex, _) in enumerate(parts) for i in simplex]  # then what follows from it
    values = _solve(_equations(points, columns + corners), guess, len(columns) + len(corners))
    unit = Fraction(gcd(*(x.numerator for x in values)) or 1, lcm(*(x.denominator for x in values)))
    multipliers: list[dict[int, int]] = [{} for _ in parts]
    for (part, j), value in zip(columns + corners, values):
        if value:
            multipliers[part][j] = int(value / unit)
    kept = sorted((part for part, y in enumerate(multipliers) if y), key=lambda part: parts[part][0])
    found = Contradiction(tuple(parts[part][0] for part in kept), tuple(multipliers[part] for part in kept))
    return found if found.holds(points) else None


def _equations(points: NDArray[np.float64], columns: list[tuple[int, int]]) -> list[dict[int, int]]:
    """Sum zero and moments zero of every part, sum zero at every point: integer coefficients by column."""
    used = sorted({j for _, j in columns})
    rows = [[Fraction(x) for x in points[j].tolist()] for j in used]
    unit = max((x.denominator for row in rows for x in row), default=1)  # powers of two: the largest serves all
    spot = {j: [int(x * unit) for x in row] for j, row in zip(used, rows)}
    origin: dict[int, list[int]] = {}
    equations: dict[tuple[int, int], dict[int, int]] = {}
    for column, (part, j) in enumerate(columns):
        here = origin.setdefault(part, spot[j])
        equations.setdefault((part, -1), {})[column] = 1
        equations.setdefault((-1, j), {})[column] = 1
        for axis, x in enumerate(spot[j]):
            if x != here[axis]:
                equations.setdefault((part, axis), {})[column] = x - here[axis]
    return list(equations.values())


def _solve(equations: list[dict[int, int]], guess: list[Fraction], columns: int) -> list[Fraction]:
    """The solution of homogeneous equations with those of the guessed values that are free to be chosen.

    Gaussian elimination from the last column back, so that the first ones are free.
    """
    left = [{column: Fraction(value) for column, value in row.items()} for row in equations]
    pivots: list[tuple[int, dict[int, Fraction]]] = []
    for column in range(columns - 1, -1, -1):
        having = [row for row in left if column in row]
        if not having:
            continue
        pivot = min(having, key=len)
        scale = pivot[column]
        solved = {other: value / scale for other, value in pivot.items() if other != column}
        pivots.append((column, solved))
        left = [row for row in left if row is not pivot]
        for row in left:
            factor = row.pop(column, None)
            if factor is not None:
                for other, value in solved.items():
                    rest = row.get(other, Fraction(0)) - factor * value
                    if rest:
                        row[other] = rest
                    else:
                        row.pop(other, None)
    values = guess + [Fraction(0)] * (columns - len(guess))
    for column, solved in reversed(pivots):
        values[column] = -sum((value * values[other] for other, value in solved.items()), Fraction(0))
    return values
