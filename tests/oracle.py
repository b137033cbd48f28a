"""The exact, slow, obvious twin of the whole theory: rational numbers, any dimension, nothing shared with `recon`.

Every float is taken as the rational number it is. Ties are broken as the library promises: height h_i becomes
h_i - eps_i with eps_0 >> eps_1 >> ... > 0, so among equals the lower index is the lower point and wins. Simplices are
ascending tuples of input rows.

    oracle = Oracle(points, weights)
    oracle.cells, oracle.hidden, oracle.dimension, oracle.oriented(cell)
    for simplex in oracle.simplices(k):
        oracle.rho(simplex), oracle.attached(simplex), oracle.mu_lower(simplex), oracle.mu_upper(simplex)
        oracle.on_hull(simplex), oracle.classify(simplex, alpha), oracle.exposed(simplex, alpha)

Brute force over all subsets serves up to about 10 points in 3-D, wrapping (the default beyond) about 40.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from functools import cache
from itertools import combinations

Simplex = tuple[int, ...]


def exact(values) -> tuple:
    """Nested sequences of numbers (or a numpy array) as nested tuples of Fraction."""
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, (list, tuple)):
        return tuple(exact(value) for value in values)
    return Fraction(values)


def solve(matrix, right) -> list[Fraction] | None:
    """The x with matrix @ x = right, by Gauss and Jordan; None where the matrix is singular."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    n = len(rows)
    for i in range(n):
        pivot = next((k for k in range(i, n) if rows[k][i] != 0), None)
        if pivot is None:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for k in range(n):
            if k != i and rows[k][i] != 0:
                rows[k] = [a - rows[k][i] * b for a, b in zip(rows[k], rows[i], strict=True)]
    return [row[n] for row in rows]


def determinant(matrix) -> Fraction:
    """The determinant, by elimination."""
    rows, result = [list(row) for row in matrix], Fraction(1)
    n = len(rows)
    for i in range(n):
        pivot = next((k for k in range(i, n) if rows[k][i] != 0), None)
        if pivot is None:
            return Fraction(0)
        if pivot != i:
            rows[i], rows[pivot], result = rows[pivot], rows[i], -result
        result *= rows[i][i]
        for k in range(i + 1, n):
            factor = Fraction(rows[k][i]) / rows[i][i]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i], strict=True)]
    return result


def rank(matrix) -> int:
    """The rank, by elimination."""
    rows = [list(map(Fraction, row)) for row in matrix]
    found = 0
    for column in range(len(rows[0]) if rows else 0):
        pivot = next((k for k in range(found, len(rows)) if rows[k][column] != 0), None)
        if pivot is None:
            continue
        rows[found], rows[pivot] = rows[pivot], rows[found]
        for k in range(found + 1, len(rows)):
            factor = rows[k][column] / rows[found][column]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[found], strict=True)]
        found += 1
    return found


def dot(a, b) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def minus(a, b) -> tuple[Fraction, ...]:
    return tuple(x - y for x, y in zip(a, b, strict=True))


def sign(value) -> int:
    return (value > 0) - (value < 0)


def orient(*points) -> int:
    """Sign of the determinant of the edge vectors from the first of d+1 points in d-space."""
    points = exact(points)
    return sign(determinant([minus(p, points[0]) for p in points[1:]]))


def volume(*points) -> Fraction:
    """Signed volume of the simplex of d+1 points in d-space."""
    points = exact(points)
    return determinant([minus(p, points[0]) for p in points[1:]]) / math.factorial(len(points) - 1)


def barycentric(corners, point) -> list[Fraction] | None:
    """Coefficients, summing to one, of a point of k-space over k+1 corners; None where these are dependent."""
    matrix = [[Fraction(1)] * len(corners), *([c[i] for c in corners] for i in range(len(point)))]
    return solve(matrix, [Fraction(1), *point])


def power_sign(points, heights, cell: Simplex, q: int) -> int:
    """Sign of the perturbed power of point q over the orthosphere of an independent cell; never zero for q not in it.

    pi(q, y) is the height of q above the hyperplane through the lifted corners: h_q - sum(lambda_j h_j). Its
    perturbation is -eps_q + sum(lambda_j eps_j): the lowest index with a coefficient decides a tie.
    """
    coefficients = barycentric([points[i] for i in cell], points[q])
    value = heights[q] - dot(coefficients, [heights[i] for i in cell])
    if value != 0:
        return sign(value)
    epsilon = dict(zip(cell, coefficients, strict=True)) | {q: Fraction(-1)}
    return next(sign(epsilon[i]) for i in sorted(epsilon) if epsilon[i] != 0)


def betti_numbers(simplices, dimension: int) -> list[int]:
    """Betti numbers 0 .. dimension of a simplicial complex, by ranks of boundary matrices over the rationals."""
    by_dimension = [sorted(s for s in simplices if len(s) == k + 1) for k in range(dimension + 2)]
    ranks = [0]
    for k in range(1, dimension + 2):
        row = {simplex: i for i, simplex in enumerate(by_dimension[k - 1])}
        columns = []
        for simplex in by_dimension[k]:
            column = [0] * len(row)
            for j in range(k + 1):
                column[row[simplex[:j] + simplex[j + 1 :]]] = (-1) ** j
            columns.append(column)
        ranks.append(rank(columns) if columns else 0)
    return [len(by_dimension[k]) - ranks[k] - ranks[k + 1] for k in range(dimension + 1)]


class Oracle:
    """The regular triangulation and the weighted alpha complex of a small set of weighted points, by definition."""

    def __init__(self, points, weights=None, method: str = "auto"):
        self.points = exact(points)
        self.weights = exact(weights) if weights is not None else (Fraction(0),) * len(self.points)
        self.heights = tuple(dot(p, p) - w for p, w in zip(self.points, self.weights, strict=True))
        n = len(self.points)
        edges = [minus(p, self.points[0]) for p in self.points]
        self.dimension = rank(edges)
        # Barycentric coordinates survive a projection that is injective on the affine hull: the first such set of axes.
        self.axes = next(
            axes
            for axes in combinations(range(len(self.points[0])), self.dimension)
            if rank([[e[i] for i in axes] for e in edges]) == self.dimension
        )
        self.flat = tuple(tuple(p[i] for i in self.axes) for p in self.points)
        brute = method == "brute" or (method == "auto" and math.comb(n, self.dimension + 1) <= 250)
        self.cells: list[Simplex] = sorted(self._cells_by_definition() if brute else self._cells_by_wrapping())
        self.hidden = sorted(set(range(n)) - {i for cell in self.cells for i in cell})
        self._simplices = [
            sorted({face for cell in self.cells for face in combinations(cell, k + 1)})
            for k in range(self.dimension + 1)
        ]
        for name in ("orthosphere", "attached", "cofaces", "on_hull"):
            setattr(self, name, cache(getattr(self, name)))

    # --- the regular triangulation, section 3

    def conflict(self, cell: Simplex, q: int) -> bool:
        """Does q conflict with the orthosphere of an independent cell, ties broken?"""
        return power_sign(self.flat, self.heights, cell, q) < 0

    def independent(self, cell: Simplex) -> bool:
        return orient(*(self.flat[i] for i in cell)) != 0

    def regular(self, cell: Simplex) -> bool:
        """Is this a cell of R: independent, and no other point in conflict?"""
        others = (q for q in range(len(self.points)) if q not in cell)
        return self.independent(cell) and not any(self.conflict(cell, q) for q in others)

    def oriented(self, cell: Simplex) -> int:
        """Orientation of a cell in the order given, along `axes` where the points span less than their space."""
        return orient(*(self.flat[i] for i in cell))

    def _cells_by_definition(self) -> list[Simplex]:
        return [cell for cell in combinations(range(len(self.points)), self.dimension + 1) if self.regular(cell)]

    def _cells_by_wrapping(self) -> set[Simplex]:
        start = self._cell_somewhere()
        found, queue = {start}, [start]
        while queue:
            cell = queue.pop()
            for apex in cell:
                facet = tuple(i for i in cell if i != apex)
                side = self.oriented((*facet, apex))
                best = None
                for q in range(len(self.points)):
                    if self.oriented((*facet, q)) == -side and (best is None or self.conflict((*facet, best), q)):
                        best = q
                if best is not None:
                    neighbor = tuple(sorted((*facet, best)))
                    if neighbor not in found:
                        found.add(neighbor)
                        queue.append(neighbor)
        return found

    def _cell_somewhere(self) -> Simplex:
        """The cell over a generic location, by the simplex method: pivot while any point conflicts."""
        cell: Simplex = ()
        for i in range(len(self.points)):
            edges = [minus(self.flat[j], self.flat[(*cell, i)[0]]) for j in (*cell, i)[1:]]
            if not edges or rank(edges) == len(edges):
                cell = (*cell, i)
        rng = random.Random(0)
        shares = [Fraction(rng.randrange(10**6, 10**7)) for _ in cell]
        corners = [self.flat[i] for i in cell]
        place = tuple(dot(shares, [c[a] for c in corners]) / sum(shares) for a in range(self.dimension))
        while True:
            q = next((q for q in range(len(self.points)) if q not in cell and self.conflict(cell, q)), None)
            if q is None:
                return tuple(sorted(cell))
            exchanges = (tuple(sorted({*cell, q} - {out})) for out in cell)
            cell = next(t for t in exchanges if self.independent(t) and self._over(t, place))

    def _over(self, cell: Simplex, place) -> bool:
        coefficients = barycentric([self.flat[i] for i in cell], place)
        if 0 in coefficients and min(coefficients) == 0:
            raise RuntimeError("the generic location is not generic: choose another seed")
        return min(coefficients) > 0

    # --- sizes and attachment, sections 3 and 5

    def simplices(self, k: int) -> list[Simplex]:
        """All k-simplices of R, ascending."""
        return self._simplices[k]

    def orthosphere(self, simplex: Simplex) -> tuple[tuple[Fraction, ...], Fraction]:
        """Centre and weight of y_T: the smallest sphere orthogonal to every vertex."""
        p0, w0 = self.points[simplex[0]], self.weights[simplex[0]]
        edges = [minus(self.points[i], p0) for i in simplex[1:]]
        right = [(dot(e, e) - self.weights[i] + w0) / 2 for e, i in zip(edges, simplex[1:], strict=True)]
        shares = solve([[dot(a, b) for b in edges] for a in edges], right)
        step = tuple(dot(shares, [e[a] for e in edges]) for a in range(len(p0)))
        return tuple(x + s for x, s in zip(p0, step, strict=True)), dot(step, step) - w0

    def rho(self, simplex: Simplex) -> Fraction:
        """Size of a simplex."""
        return self.orthosphere(simplex)[1]

    def power(self, q: int, simplex: Simplex) -> Fraction:
        """pi(q, y_T), not perturbed."""
        center, rho = self.orthosphere(simplex)
        gap = minus(self.points[q], center)
        return dot(gap, gap) - self.weights[q] - rho

    def attached(self, simplex: Simplex) -> bool:
        """Has y_T a conflict? Of the numbers as given: a point exactly on the orthosphere is none."""
        return any(self.power(q, simplex) < 0 for q in range(len(self.points)))

    def cofaces(self, simplex: Simplex) -> tuple[Simplex, ...]:
        """up(T): the simplices of R that have T as a proper face."""
        inside = set(simplex).issubset
        return tuple(u for k in range(len(simplex), self.dimension + 1) for u in self._simplices[k] if inside(u))

    def on_hull(self, simplex: Simplex) -> bool:
        """Does the simplex lie in the boundary of the convex hull?"""
        if len(simplex) == self.dimension + 1:
            return False
        facets = (f for f in self._simplices[self.dimension - 1] if set(simplex).issubset(f))
        return any(len(self.cofaces(f)) == 1 for f in facets)

    def mu_lower(self, simplex: Simplex) -> Fraction:
        """The smallest size of an unattached proper coface; of a cell its own size."""
        if len(simplex) == self.dimension + 1:
            return self.rho(simplex)
        return min(self.rho(u) for u in self.cofaces(simplex) if not self.attached(u))

    def mu_upper(self, simplex: Simplex) -> Fraction | float:
        """The largest size of a coface, infinite on the hull; of a cell its own size."""
        if len(simplex) == self.dimension + 1:
            return self.rho(simplex)
        return math.inf if self.on_hull(simplex) else max(self.rho(u) for u in self.cofaces(simplex))

    # --- the alpha complex and its shape

    def complex(self, alpha) -> set[Simplex]:
        """K_alpha by conditions C1 and C2, with equality in: rho <= alpha and conflict-free, or a face of such."""
        alpha = Fraction(alpha)
        first = (t for level in self._simplices for t in level if self.rho(t) <= alpha and not self.attached(t))
        return {face for t in first for k in range(len(t)) for face in combinations(t, k + 1)}

    def classify(self, simplex: Simplex, alpha) -> str:
        """Class by table 5.1, with equality in: 'exterior', 'singular', 'regular' or 'interior'."""
        alpha = Fraction(alpha)
        if self.mu_upper(simplex) <= alpha:
            return "interior"
        if self.mu_lower(simplex) <= alpha:
            return "regular"
        if not self.attached(simplex) and self.rho(simplex) <= alpha:
            return "singular" if len(simplex) <= self.dimension else "interior"
        return "exterior"

    def exposed(self, simplex: Simplex, alpha) -> bool:
        """Is the simplex alpha-exposed by the definition of section 2? From the points alone, not from R.

        The x' with (x', alpha) orthogonal to T form a sphere around y'_T in the flat chi_T, of squared radius
        alpha - rho_T; one of them must be strictly inside the power cell Z_T. That is convex, so this asks whether alpha
        lies strictly between the least and the greatest weight of the orthogonal points over Z_T. The least one is some
        y_U, T in U, without conflict; the greatest too, unless Z_T is unbounded: T in a face of the hull.
        """
        alpha = Fraction(alpha)
        if len(simplex) > self.dimension:
            return False
        sizes, full = [], []
        rest = [q for q in range(len(self.points)) if q not in simplex]
        for more in range(self.dimension + 2 - len(simplex)):
            for extra in combinations(rest, more):
                face = (*simplex, *extra)
                edges = [minus(self.flat[i], self.flat[face[0]]) for i in face[1:]]
                if rank(edges) == len(edges) and not self.attached(tuple(sorted(face))):
                    sizes.append(self.rho(tuple(sorted(face))))
                    if len(face) == self.dimension + 1:
                        full.append(sizes[-1])
        if not full:
            return False
        return min(sizes) < alpha < (math.inf if self._in_face_of_hull(simplex) else max(full))

    def _in_face_of_hull(self, simplex: Simplex) -> bool:
        rest = [q for q in range(len(self.points)) if q not in simplex]
        for extra in combinations(rest, self.dimension - len(simplex)):
            facet = (*simplex, *extra)
            edges = [minus(self.flat[i], self.flat[facet[0]]) for i in facet[1:]]
            if rank(edges) == len(edges) and len({self.oriented((*facet, q)) for q in rest} - {0}) == 1:
                return True
        return False

    def spectrum(self) -> list[Fraction]:
        """The alphas at which K_alpha changes: the sizes of the unattached simplices, ascending."""
        return sorted({self.rho(t) for level in self._simplices for t in level if not self.attached(t)})

    def betti(self, alpha) -> list[int]:
        """Betti numbers of K_alpha, one a dimension 0 .. d of the affine hull."""
        return betti_numbers(self.complex(alpha), self.dimension)
