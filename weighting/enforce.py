"""Weights under which given simplices are in the regular triangulation (paper, introduction (iii) and section 6 (ii))."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array, hstack, vstack
from scipy.spatial import cKDTree

from recon.contracts import DegenerateInput, InvalidInput, as_points, as_weights, shown
from recon.regular import RegularTriangulation, regular_triangulation

from .contradiction import Contradiction, NotRegular, Simplex, contradiction

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

MARGINS = (
    1e-6,
    1e-3,
    1.0,
)  # by which conditions are to hold, in squared lengths of what they are about: first that does
INSIDE = 2.0**-7  # the size of a simplex of K_0 is to be below 0 by this, in squared distances to the nearest point
FEW = 16  # simplices that are tried first, then 4 times as many, and so on
MOST = 8  # conditions that a simplex gets in a round
DEPENDENT = 1e-9  # relative singular value from which vertices are certainly independent
ZERO = 1e-9  # multipliers that count as nothing


def enforce(
    points: ArrayLike,
    weights: ArrayLike | None,
    simplices: Iterable[Sequence[int]] | ArrayLike,
    *,
    where: Literal["R", "K_0"] = "R",
) -> NDArray[np.float64]:
    """Change weights as little as possible so that given simplices are in the regular triangulation, or prove it impossible.

    The result is checked: the exact triangulation under the weights as returned holds every simplex. Weights that do so
    already come back as they are.

    Parameters
    ----------
    points : (n, d) array_like of float [L]
        Any d. Duplicates are welcome; of several in one spot one at most can be a vertex.
    weights : (n,) array_like of float [L^2], or None for all zero
    simplices : (s, k+1) array_like of int, or iterable of sequences of int
        Vertices, edges, triangles, ... as input rows in any order, k from 0 to d, mixed if need be.
    where : {"R", "K_0"}
        The regular triangulation, or the alpha complex at alpha = 0: then W_0 contains the simplices.

    Returns
    -------
    (n,) ndarray of float64 [L^2]
        The sum of |change| is the least possible, but for margins: a power that has to be positive is at least 1e-6
        of the squared distance (1e-3 or 1 where float64 needs it), a size in K_0 at most -1/128 of the squared distance to
        the nearest point. So few weights change.

    Raises
    ------
    InvalidInput
        Malformed points, weights or simplices; a simplex with a row that is out of range or there twice, or with affinely
        dependent vertices.
    NotRegular
        No weights whatever do it: the error has a `contradiction`, verified in rational numbers. It is a DegenerateInput.
    DegenerateInput
        Neither weights nor a proof in the precision of float64.

    Notes
    -----
    T is in R just where a sphere is orthogonal to its vertices and farther than that from all other points (3.1): linear
    in the weights and in the position of the sphere, once for every other point. Only points that are found to conflict,
    by triangulating again, enter the linear program (HiGHS). What is in R can be brought into K_0: by raising all weights
    alike, if by nothing less (2.2); its size is convex, and is met by its tangents.

    Examples
    --------
    >>> enforce([[0.0], [1.0], [2.0]], None, [[0, 2]]).round(3).tolist()  # the middle point has to leave
    [0.0, -1.0, 0.0]
    >>> square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> enforce(square, None, [[0, 2], [1, 3]])
    Traceback (most recent call last):
    weighting.contradiction.NotRegular: simplices: no weights put (0, 2) and (1, 3) into R together, as they meet \
outside of a common face; leave one of them out
    """
    located = as_points(points)
    w = as_weights(weights, len(located))
    if not isinstance(where, str) or where not in ("R", "K_0"):
        raise InvalidInput(f"where: expected 'R' or 'K_0', got {shown(where)}")
    asked = _as_simplices(simplices, len(located))
    _refuse_dependent(located, asked)
    if not _missing(regular_triangulation(located, w), asked, where):
        return w.copy()
    exponent = int(np.frexp(np.ptp(located, axis=0).max())[1])  # lengths near 1: squares stay in range
    scaled = np.ldexp(located, -exponent), np.ldexp(w, -2 * exponent)
    count = FEW
    while count < len(asked):  # where many simplices contradict each other, few of them show it, and much sooner
        _Program(*scaled, asked[:count], "R", MARGINS[0]).solve()
        count *= 4
    for margin in MARGINS:
        found = _Program(*scaled, asked, where, margin).solve()
        if found is not None:
            w = np.ldexp(found, 2 * exponent)
            if not _missing(regular_triangulation(located, w), asked, where):
                return w
    raise DegenerateInput(
        f"simplices: found neither weights for these {len(asked)} nor a proof that there are none, in the precision of "
        "float64; leave out the flattest of them"
    )


class _Program:
    """The linear program, as far as its conditions are known: more of them in each round.

    Of a simplex with first vertex a and edges e_i = p_i - a the unknown is the sphere's centre u, from a; its weight is
    |u|^2 - w_a. The power of a point q over it is |e_q|^2 - 2 e_q u + w_a - w_q: zero for the other vertices, to be
    positive for all other points.
    """

    def __init__(
        self, points: NDArray[np.float64], weights: NDArray[np.float64], asked: list[Simplex], where: str, margin: float
    ) -> None:
        self.points, self.weights, self.asked, self.where, self.margin = points, weights, asked, where, margin
        self.unit = _nearest(points)
        self.others: dict[int, list[int]] = {}  # of each simplex that was missing once: the points with a condition
        self.tangents: dict[int, list[NDArray[np.float64]]] = {}  # and where its size has tangents

    def solve(self) -> NDArray[np.float64] | None:
        """Weights, or None where rounding is in the way."""
        w, center = self.weights, dict[int, NDArray[np.float64]]()
        while missing := _missing(regular_triangulation(self.points, w), self.asked, self.where):
            grown = False
            for t in missing:
                grown |= self._grow(t, w, center[t] if t in center else self._orthocenter(t, w))
            if not grown:
                return None
            solved = self._optimum()
            if solved is None:
                return None
            w, center = solved
        return w

    def _grow(self, t: int, w: NDArray[np.float64], u: NDArray[np.float64]) -> bool:
        """Add the points that come too near a sphere, and a tangent where it is too large; False where none are new."""
        simplex, known = self.asked[t], self.others.setdefault(t, [])
        e, scale = self._edges(t)
        power = ((e**2).sum(axis=1) - 2 * (e @ u) + w[simplex[0]] - w) / scale
        power[list(simplex)] = power[known] = np.inf
        worst = np.argsort(power, kind="stable")[:MOST]
        worst = worst[power[worst] < self.margin / 2]
        known.extend(worst.tolist())
        a = simplex[0]
        large = self.where == "K_0" and u @ u - w[a] > -INSIDE / 2 * self.unit[a] ** 2
        if large:
            tangents = self.tangents.setdefault(t, [])
            large = not any(np.array_equal(u, other) for other in tangents)
            tangents.append(u)
        return bool(large or len(worst))

    def _edges(self, t: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Edges from the first vertex of a simplex to all points (n, d), and the squared lengths to judge powers by."""
        a = self.asked[t][0]
        e = self.points - self.points[a]
        return e, np.maximum((e**2).sum(axis=1), self.unit[a] ** 2)

    def _orthocenter(self, t: int, w: NDArray[np.float64]) -> NDArray[np.float64]:
        """Centre of the smallest sphere that is orthogonal to the vertices, from the first."""
        a, rest = self.asked[t][0], list(self.asked[t][1:])
        e = self.points[rest] - self.points[a]
        return np.linalg.lstsq(2 * e, (e**2).sum(axis=1) + w[a] - w[rest], rcond=None)[0]

    def _optimum(self) -> tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]] | None:
        """Weights of least change under all conditions so far, and the centres that go with them."""
        rows = _Rows(self.points.shape[1], len(self.points), list(self.others))
        for t, others in self.others.items():
            e, scale = self._edges(t)
            a, w, unit = self.asked[t][0], self.weights, self.unit
            for j, equal in [*((i, True) for i in self.asked[t][1:]), *((q, False) for q in others)]:
                rate = 1 / scale[j]
                bound = ((e[j] ** 2).sum() + w[a] - w[j]) * rate - (0.0 if equal else self.margin)
                change = {j: unit[j] ** 2 * rate, a: -(unit[a] ** 2) * rate}
                rows.add(equal, t, 2 * rate * unit[a] * e[j], change, bound, j)
            for u in self.tangents.get(t, ()):
                rate = 1 / max(u @ u, unit[a] ** 2)
                bound = (u @ u + w[a] - INSIDE * unit[a] ** 2) * rate
                rows.add(False, t, 2 * rate * unit[a] * u, {a: -(unit[a] ** 2) * rate}, bound, -1)
        result = rows.least(self.unit**2)
        if result.status == 2:
            found = self._contradiction(rows)
            if found is not None:
                raise NotRegular(found)
            return None
        if result.status != 0:
            return None
        changes, centers = rows.split(result.x)
        return self.weights + changes * self.unit**2, {
            t: centers[k] * self.unit[self.asked[t][0]] for k, t in enumerate(self.others)
        }

    def _contradiction(self, rows: _Rows) -> Contradiction | None:
        """Multipliers that sum the conditions to nothing, from the dual program, made exact."""
        multipliers = rows.multipliers()
        if multipliers is None:
            return None
        parts: dict[int, dict[int, float]] = {}
        for (t, j), value in zip(rows.strict, multipliers):
            if value > ZERO:
                parts.setdefault(t, {})[j] = float(value / self._edges(t)[1][j])
        return contradiction(self.points, [(self.asked[t], y) for t, y in parts.items()])


class _Rows:
    """Conditions of a linear program, row by row: change of weights (n) and centres (one a simplex) are the unknowns."""

    def __init__(self, dimension: int, n: int, simplices: list[int]) -> None:
        self.dimension, self.n = dimension, n
        self.first = {t: n + dimension * k for k, t in enumerate(simplices)}
        self.count = n + dimension * len(simplices)
        self.entries: tuple[list, list] = ([], [])
        self.bounds: tuple[list[float], list[float]] = ([], [])
        self.strict: list[tuple[int, int]] = []  # simplex and point of each inequality; -1 for a tangent

    def add(
        self, equal: bool, t: int, slope: NDArray[np.float64], change: dict[int, float], bound: float, j: int
    ) -> None:
        """Demand slope * centre + change * weights <= bound, or equality."""
        row = len(self.bounds[equal])
        self.entries[equal].extend((row, column, value) for column, value in change.items())
        self.entries[equal].extend((row, self.first[t] + axis, value) for axis, value in enumerate(slope))
        self.bounds[equal].append(bound)
        if not equal:
            self.strict.append((t, j))

    def _matrix(self, equal: bool) -> csr_array:
        rows, columns, values = zip(*self.entries[equal]) if self.entries[equal] else ((), (), ())
        shape = len(self.bounds[equal]), self.count
        return csr_array((np.array(values, float), (np.array(rows, int), np.array(columns, int))), shape=shape)

    def _used(self) -> NDArray[np.int64]:
        """Points whose weight is in any condition."""
        columns = {column for entries in self.entries for _, column, _ in entries if column < self.n}
        return np.array(sorted(columns))

    def least(self, cost: NDArray[np.float64]) -> OptimizeResult:
        """Minimise the cost of |change|."""
        from scipy.optimize import linprog  # takes a while to load

        used = self._used()
        split = np.concatenate([used, np.arange(self.n, self.count)])
        above, equal = self._matrix(False)[:, split], self._matrix(True)[:, split]
        m = len(used)
        cost = cost[used] / cost[used].mean()
        result = linprog(
            np.concatenate([cost, np.zeros(self.count - self.n), cost]),
            A_ub=_beside(above, m),
            b_ub=self.bounds[0],
            A_eq=_beside(equal, m) if equal.shape[0] else None,
            b_eq=self.bounds[1] if equal.shape[0] else None,
            bounds=[(0, None)] * m + [(None, None)] * (self.count - self.n) + [(0, None)] * m,
            method="highs",
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        if result.status == 0:
            x = np.zeros(self.count)
            x[split] = result.x[: len(split)]
            x[used] -= result.x[len(split) :]
            result.x = x
        return result

    def split(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Change of weights (n,) and centres (s, d)."""
        return x[: self.n], x[self.n :].reshape(-1, self.dimension)

    def multipliers(self) -> NDArray[np.float64] | None:
        """Of the inequalities but tangents: 0 or more, in all 1, and with some of the equalities they sum to nothing."""
        from scipy.optimize import linprog

        used = self._used()
        split = np.concatenate([used, np.arange(self.n, self.count)])
        strict = np.array([j >= 0 for _, j in self.strict])
        above, equal = self._matrix(False)[:, split][strict], self._matrix(True)[:, split]
        a, b = above.shape[0], equal.shape[0]
        balance = vstack([hstack([above.T, equal.T]), csr_array(np.concatenate([np.ones(a), np.zeros(b)])[None])])
        result = linprog(
            np.zeros(a + b),
            A_eq=balance.tocsr(),
            b_eq=np.append(np.zeros(len(split)), 1.0),
            bounds=[(0, None)] * a + [(None, None)] * b,
            method="highs-ds",
        )
        if result.status != 0:
            return None
        values = np.zeros(len(strict))
        values[strict] = result.x[:a]
        return values


def _beside(matrix: csr_array, m: int) -> csr_array:
    """The first m columns once more, negative, at the end."""
    return hstack([matrix, -matrix[:, :m]]).tocsr()


def _as_simplices(simplices: Iterable[Sequence[int]] | ArrayLike, n: int) -> list[Simplex]:
    """Rows ascending, each simplex once, faces of others left out."""
    found: dict[Simplex, None] = {}
    try:
        listed = [np.asarray(row) for row in simplices]  # type: ignore[union-attr]
    except (TypeError, ValueError) as error:  # ValueError: a row of rows of several lengths
        raise InvalidInput(f"simplices: expected rows of int, got {shown(simplices)}") from error
    for place, row in enumerate(listed):
        if row.ndim != 1 or row.dtype.kind not in "iu" or len(row) == 0:
            raise InvalidInput(f"simplices: entry {place} is no row of int: {shown(row.tolist())}")
        if row.min() < 0 or row.max() >= n:
            raise InvalidInput(f"simplices: entry {place} is out of range 0 .. {n - 1}: {row.tolist()}")
        simplex = tuple(sorted(row.tolist()))
        if len(set(simplex)) < len(simplex):
            raise InvalidInput(f"simplices: entry {place} has a vertex twice: {row.tolist()}")
        found[simplex] = None
    below = {face for simplex in found for k in range(1, len(simplex)) for face in combinations(simplex, k)}
    return [simplex for simplex in found if simplex not in below]


def _refuse_dependent(points: NDArray[np.float64], asked: list[Simplex]) -> None:
    """Refuse simplices that are flat: decided in rational numbers where singular values leave it open."""
    for simplex in asked:
        e = points[list(simplex[1:])] - points[simplex[0]]
        if len(e) == 0:
            continue
        singular = np.linalg.svd(e / (np.abs(e).max() or 1.0), compute_uv=False)
        if len(e) <= e.shape[1] and singular[-1] > DEPENDENT * singular[0]:
            continue
        if _rank(points[list(simplex)]) < len(e):
            raise InvalidInput(
                f"simplices: the vertices of {simplex} are affinely dependent, so it is in no triangulation; leave it out"
            )


def _rank(points: NDArray[np.float64]) -> int:
    """Dimension of the affine hull, exactly."""
    from fractions import Fraction

    exact = [[Fraction(x) for x in row] for row in points.tolist()]
    rows = [[x - y for x, y in zip(row, exact[0])] for row in exact[1:]]
    rank = 0
    for axis in range(points.shape[1]):
        pivot = next((row for row in rows[rank:] if row[axis]), None)
        if pivot is None:
            continue
        rows.remove(pivot)
        rows.insert(rank, pivot)
        for k in range(rank + 1, len(rows)):
            factor = rows[k][axis] / pivot[axis]
            rows[k] = [x - factor * y for x, y in zip(rows[k], pivot)]
        rank += 1
    return rank


def _missing(triangulation: RegularTriangulation, asked: list[Simplex], where: str) -> list[int]:
    """Which of the simplices are not in R, or not certainly in K_0."""
    if where == "R":
        return [t for t, there in enumerate(_in_triangulation(triangulation, asked)) if not there]
    from recon.alpha import alpha_complex  # its kernels take a while to load

    family, w = alpha_complex(triangulation), np.abs(triangulation.weights).max()
    missing = list(range(len(asked)))
    for k in sorted({len(simplex) - 1 for simplex in asked if len(simplex) <= family.dimension + 1}):
        entry = family.entry(k)
        certain = entry + 2.0**-39 * (np.abs(entry) + w) <= 0  # sizes are within half of that
        present = set(map(tuple, family.simplices(k)[certain].tolist()))
        missing = [t for t in missing if asked[t] not in present]
    return missing


def _in_triangulation(triangulation: RegularTriangulation, asked: list[Simplex]) -> list[bool]:
    """Is each of the simplices a face of some cell?"""
    around: dict[int, set[int]] = {vertex: set() for simplex in asked for vertex in simplex}
    wanted = np.isin(triangulation.cells, list(around))
    for cell, slot in zip(*(axis.tolist() for axis in np.nonzero(wanted))):
        around[int(triangulation.cells[cell, slot])].add(cell)
    return [bool(set.intersection(*(around[vertex] for vertex in simplex))) for simplex in asked]


def _nearest(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of every point to the nearest other spot; 1 where there is none."""
    spots, inverse = np.unique(points, axis=0, return_inverse=True)
    if len(spots) == 1:
        return np.ones(len(points))
    return cKDTree(spots).query(spots, 2)[0][:, 1][inverse.ravel()]
