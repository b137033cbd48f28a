"""The regular triangulation in any dimension, exactly: the lower convex hull of the lifted points (paper, section 3).

Points are inserted one by one into `_kernels.hull`; the signs that float64 leaves open are settled here by integers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._kernels import hull as kernels
from ._kernels.hull import ASK_CONFLICTS, ASK_SIDES, DONE, MORE_ROOM

_MINORS_UP_TO = 10  # beyond this order determinants by minors cost more than by elimination in integers
_U = 2.0**-53

Arrays = tuple[NDArray[np.int32], NDArray[np.int32]]


def lower_hull(points: NDArray[np.float64], weights: NDArray[np.float64]) -> Arrays:
    """Triangulate weighted points regularly, in the flat that they span.

    Parameters
    ----------
    points : (n, d) ndarray of float64
    weights : (n,) ndarray of float64

    Returns
    -------
    cells, neighbors : (m, k+1) ndarray of int32
        k is the dimension of the flat. Cells are positive, in a flat as seen along the first k coordinate axes in
        lexicographic order that tell its points apart. -1 stands for no neighbour.

    Notes
    -----
    Ties are broken as `regular_triangulation` says. Of the order of (d+1) 2^d operations a cell and sign; some
    microseconds, times the cube of d, for each sign that needs integers.
    """
    rows = _heaviest_of_each_place(points, weights)
    exact = Exact(points, weights)
    simplex, axes = exact.span(rows)
    k = len(axes)
    if k == 0:
        return rows[:1, None].astype(np.int32), np.full((1, 1), -1, np.int32)
    table, trust = float_table(points, weights, axes)
    order = _order(np.setdiff1d(rows, simplex), table[:, :k])
    n, width = len(points), k + 1
    cells, neighbors = _first_cells(simplex, n)
    lists = np.full((5, len(cells)), -1, np.int64)
    state = np.zeros(kernels.STATE, np.int64)
    state[kernels.USED] = len(cells)
    answers = np.zeros(width, np.int64)
    matrix, minors = scratch(k)
    while True:
        status = kernels.insert(
            points=table,
            order=order,
            cells=cells,
            neighbors=neighbors,
            lists=lists,
            answers=answers,
            state=state,
            trust=trust,
            matrix=matrix,
            minors=minors,
        )
        if status == DONE:
            break
        q = int(order[state[kernels.NEXT]])
        if status == MORE_ROOM:
            more = len(cells) // 2 + 64 * width
            cells, neighbors = (np.concatenate([a, np.full((more, width), -1, np.int32)]) for a in (cells, neighbors))
            lists = np.concatenate([lists, np.full((5, more), -1, np.int64)], axis=1)
        elif status == ASK_SIDES:
            cell = cells[state[kernels.HERE]].tolist()
            answers[:] = [exact.side(cell, slot, q) for slot in range(width)]
            state[kernels.PHASE] = kernels.LOCATE_TOLD
        elif status == ASK_CONFLICTS:
            open_ = lists[kernels.OPEN, : state[kernels.OPEN_COUNT]]
            behind = neighbors[open_, np.argmax(cells[open_], axis=1)]
            stamp = 2 * int(state[kernels.NEXT]) + 2
            for c, cell, inner in zip(open_.tolist(), cells[open_].tolist(), cells[behind].tolist()):
                lists[kernels.MARK, c] = stamp + exact.conflict(cell, inner, q)
    return _finished(cells[: state[kernels.USED]], neighbors, lists[kernels.FREE, : state[kernels.FREE_COUNT]], n)


class Exact:
    """Signs of weighted points as the rational numbers that they are, brought to integers by one power of two."""

    def __init__(self, points: NDArray[np.float64], weights: NDArray[np.float64]):
        unit = common_unit(points, weights)
        located = integers(points, unit)
        self._points: list[list[int]] = located.tolist()
        self._heights: list[int] = ((located * located).sum(axis=1) - integers(weights, 2 * unit)).tolist()
        self._axes: list[int] = []

    def span(self, rows: NDArray[np.int64]) -> tuple[list[int], list[int]]:
        """Rows of a positive simplex of the flat that some points span, the earliest; the axes to see it along."""
        first, d = self._points[rows[0]], len(self._points[0])
        simplex = [int(rows[0])]
        basis: list[tuple[int, list[int]]] = []
        for i in rows[1:].tolist():
            edge, last = [a - b for a, b in zip(self._points[i], first)], 1
            for axis, vector in basis:
                edge, last = _eliminated(edge, vector, axis, last), vector[axis]
            axis = next((axis for axis in range(d) if edge[axis]), d)
            if axis < d:
                simplex.append(i)
                basis.append((axis, edge))
                if len(basis) == d:
                    break
        self._axes = _leading([[a - b for a, b in zip(self._points[i], first)] for i in simplex[1:]])
        if basis and self.side(simplex, 0, simplex[0]) < 0:
            simplex[:2] = simplex[1::-1]
        return simplex, self._axes

    def in_flat(self, q: int) -> bool:
        """Is q in the flat of the points before it, which are independent?"""
        edges = [[a - b for a, b in zip(point, self._points[0])] for point in self._points[1 : q + 1]]
        return len(_leading(edges)) < q

    def side(self, cell: list[int], slot: int, q: int) -> int:
        """Orientation of a cell with its vertex at a slot replaced by q."""
        sign = _sign_of_determinant([self._edge(q, i) for s, i in enumerate(cell) if s != slot])
        return -sign if slot % 2 else sign

    def conflict(self, cell: list[int], behind: list[int], q: int) -> bool:
        """Is q below the hyperplane through a lifted cell, ties broken? `behind`: the cell behind a ghost cell."""
        infinity = len(self._points)
        if infinity in cell:
            sign = self.side(cell, cell.index(infinity), q)
            if sign:
                return sign > 0
            cell = behind
        sign = _sign_of_determinant([[*self._edge(q, i), self._heights[i] - self._heights[q]] for i in cell])
        if sign:
            return (sign > 0) == (len(cell) % 2 == 1)
        for i in sorted([*cell, q]):
            if i == q:
                break
            sign = self.side(cell, cell.index(i), q)
            if sign:
                return sign < 0
        return True

    def _edge(self, q: int, i: int) -> list[int]:
        here, there = self._points[q], self._points[i]
        return [there[axis] - here[axis] for axis in self._axes]


def scratch(k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Room for the kernel's determinants of order up to k + 1."""
    return np.empty((2, k + 1, k + 1)), np.empty((2, 1 << k + 1 if k + 1 <= _MINORS_UP_TO else 1))


def _heaviest_of_each_place(points: NDArray, weights: NDArray) -> NDArray[np.int64]:
    """Rows without duplicates (r,), ascending: of each place the heaviest, then the lowest."""
    located = points + 0.0  # minus zero becomes zero
    order = np.lexsort((-weights, *located.T))
    first = np.append(True, (np.diff(located[order], axis=0) != 0.0).any(axis=1))
    return np.sort(order[first])


def float_table(points: NDArray, weights: NDArray, axes: list[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The table of points and how far the kernel may trust its determinants: see there."""
    d, k = points.shape[1], len(axes)
    others = [axis for axis in range(d) if axis not in axes]
    table = np.column_stack([points[:, [*axes, *others]], weights])
    trust = np.full(4, np.inf)
    trust[3] = 0.0
    if k + 1 > _MINORS_UP_TO:
        return table, trust
    unit = common_unit(points, weights)
    whole = int(np.frexp(np.abs(points).max())[1]) - unit <= 26
    exponent = unit if whole else int(np.frexp(np.ptp(points, axis=0).max())[1])
    powers = np.append(np.full(d, exponent), 2 * exponent)
    with np.errstate(over="ignore", under="ignore"):
        scaled = np.ldexp(table, -powers)
        if not (np.ldexp(scaled, powers) == table).all():
            return table, trust  # beyond the range of float64: by integers alone
    for order in (k, k + 1):
        # Roundings a term: an entry has 1, or d + 4 in the last column; n - 1 products; at most n sums a row.
        trust[order % 2] = 2 * _U * ((order + 2) ** 2 + d + 10)
    trust[2] = 1e-290 * max(1.0, float(np.abs(scaled[:, d]).max()))  # covers underflow
    trust[3] = whole
    return np.ascontiguousarray(scaled), trust


def common_unit(points: NDArray, weights: NDArray) -> int:
    """The exponent e for which all coordinates are multiples of 2^e, and all weights of 4^e; as large as may be."""
    found = []
    for values in points, weights:
        mantissa, power = np.frexp(values[values != 0])
        whole = (mantissa * 2.0**53).astype(np.int64)
        zeros = np.frexp((whole & -whole).astype(np.float64))[1] - 1
        found.append(int((power - 53 + zeros).min(initial=2000)))
    return min(found[0], found[1] // 2)


def integers(values: NDArray[np.float64], exponent: int) -> NDArray[np.object_]:
    """Multiples of 2^exponent, divided by it: Python integers."""
    mantissa, power = np.frexp(values)
    whole = (mantissa * 2.0**53).astype(np.int64)
    shift = power.astype(np.int64) - 53 - exponent
    whole >>= np.clip(-shift, 0, 63)  # a mantissa ends in as many zeros
    return whole.astype(object) << np.where(whole == 0, 0, np.maximum(shift, 0)).astype(object)


def _sign_of_determinant(rows: list[list[int]]) -> int:
    """Sign of the determinant of integers, by elimination without fractions (Bareiss 1968); changes the rows."""
    sign, last = 1, 1
    for i in range(len(rows) - 1):
        pivot = next((r for r in range(i, len(rows)) if rows[r][i]), None)
        if pivot is None:
            return 0
        if pivot != i:
            rows[i], rows[pivot], sign = rows[pivot], rows[i], -sign
        rows[i + 1 :] = [_eliminated(row, rows[i], i, last) for row in rows[i + 1 :]]
        last = rows[i][i]
    return sign * ((rows[-1][-1] > 0) - (rows[-1][-1] < 0))


def _leading(vectors: list[list[int]]) -> list[int]:
    """The first columns in lexicographic order that tell apart what independent vectors span."""
    rest, columns, last = vectors, [], 1
    for column in range(len(vectors[0]) if vectors else 0):
        pivot = next((v for v in rest if v[column]), None)
        if pivot is not None:
            columns.append(column)
            rest = [_eliminated(v, pivot, column, last) for v in rest if v is not pivot]
            last = pivot[column]
    return columns


def _eliminated(row: list[int], pivot: list[int], column: int, last: int) -> list[int]:
    """A row without its entry in a column, where `pivot` has one, over the pivot before: all are minors, so integers."""
    head, factor = pivot[column], row[column]
    return [(a * head - b * factor) // last for a, b in zip(row, pivot)]


def _order(rows: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Order of insertion: random rounds, each as long as all before it, along a Morton curve, for short walks."""
    rows = np.random.default_rng(0).permutation(rows)
    k = points.shape[1]
    bits = max(1, 60 // k)
    located = points[rows]
    low = located.min(axis=0, initial=np.inf)
    extent = np.ptp(points, axis=0).max()
    step = ((located - low) * ((2.0**bits - 1) / extent)).astype(np.int64)
    key = np.zeros(len(rows), np.int64)
    for bit in range(bits - 1, -1, -1):
        for axis in range(min(k, 60)):
            key = 2 * key + (step[:, axis] >> bit & 1)
    return rows[np.lexsort((key, np.frexp(np.arange(len(rows)) + 1.0)[1]))]


def _first_cells(simplex: list[int], n: int) -> Arrays:
    """A positive simplex (the first row) and the ghost cells on its facets."""
    width = len(simplex)
    cells = np.tile(np.array(simplex, np.int32), (width + 1, 1))
    neighbors = np.tile(np.arange(1, width + 1, dtype=np.int32), (width + 1, 1))
    slots = np.arange(width)
    cells[slots + 1, slots], neighbors[slots + 1, slots] = n, 0
    for table in cells, neighbors:
        table[1:, :2] = table[1:, 1::-1]
    return cells, neighbors


def _finished(cells: NDArray, neighbors: NDArray, free: NDArray, n: int) -> Arrays:
    """Only the finite cells, in lexicographic order."""
    kept = (cells != n).all(axis=1)
    kept[free] = False
    rows = np.flatnonzero(kept)
    rows = rows[np.lexsort(cells[rows].T[::-1])]
    new = np.full(len(cells), -1, np.int32)
    new[rows] = np.arange(len(rows))
    return np.ascontiguousarray(cells[rows]), new[neighbors[rows]]
