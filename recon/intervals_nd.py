"""Sizes, attachment and interval bounds in any dimension, by arrays: the plain twin of the kernels (paper, section 5).

Floats decide where a bound proves that they can: the system G x = h for the orthocentre (G the Gram matrix of the edges
from the first vertex, h_i = |e_i|^2 + w_0 - w_i) is solved and its error enclosed. The rest goes to integers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._kernels.alpha import ATTACHED, HULL
from .hull import common_unit, integers
from .regular import RegularTriangulation

if TYPE_CHECKING:
    from .intervals import Level

Pair = tuple[Any, Any]  # a double-double: two arrays, the second the rounding error of the first

_U = 2.0**-53
_ACCURACY = 2.0**-40  # of a size, in units of |rho| + max |w|
_BLOCK = 1 << 14  # simplices at a time


def levels(triangulation: RegularTriangulation, level: type[Level]) -> dict[int, Level]:
    """Give all levels of a triangulation, by dimension."""
    points, weights = triangulation.points, triangulation.weights
    d, n = triangulation.dimension, len(points)
    order = np.lexsort(np.sort(triangulation.cells, axis=1).T[::-1])
    rows = {d: np.sort(triangulation.cells, axis=1)[order]}
    faces: dict[int, NDArray[np.int64]] = {}  # faces[k][i, j]: row of the facet opposite vertex j of simplex i
    for k in range(d, 0, -1):
        all_faces = np.stack([np.delete(rows[k], j, axis=1) for j in range(k + 1)], axis=1).reshape(-1, k)
        rows[k - 1], inverse = np.unique(all_faces, axis=0, return_inverse=True)
        faces[k] = inverse.reshape(-1, k + 1)

    rho = {0: 0.0 - weights[rows[0][:, 0]]}
    conflict = {}
    for k in range(1, d + 1):
        raw, signs = measure(points, weights, rows[k])
        raw[(signs == 0).any(axis=1)] = -np.inf  # y is that of a face, and so is the size
        rho[k], conflict[k] = np.maximum(raw, rho[k - 1][faces[k]].max(axis=1)), signs < 0

    cells = level(
        rows[d], _starts(rows[d], n), rho[d], rho[d], rho[d], np.zeros(len(order), np.uint8), order.astype(np.int32)
    )
    result = {d: cells}
    for k in range(d - 1, -1, -1):
        above, face = result[k + 1], faces[k + 1].ravel()
        count = len(rows[k])
        attached, hull = np.zeros(count, bool), np.zeros(count, bool)
        lower, upper = np.full(count, np.inf), np.full(count, -np.inf)
        attached[face[conflict[k + 1].ravel()]] = True
        np.minimum.at(lower, face, np.repeat(above.entry, k + 2))
        np.maximum.at(upper, face, np.repeat(above.mu_upper, k + 2))
        if k == d - 1:
            hull = np.bincount(face, minlength=count) == 1
        else:
            hull[face[np.repeat(above.on_hull, k + 2)]] = True
        upper[hull] = np.inf
        code = attached * np.uint8(ATTACHED) | hull * np.uint8(HULL)
        result[k] = level(rows[k], _starts(rows[k], n), rho[k], lower, upper, code)
    return result


def measure(
    points: NDArray[np.float64], weights: NDArray[np.float64], simplices: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Give the size (s,) of simplices (s, k+1), k >= 1, and the signs (s, k+1) of their orthocentres' coordinates.

    Signs are certain, and sizes off by less than 2**-40 (|rho| + max |w|).
    """
    rho, signs = np.empty(len(simplices)), np.empty(simplices.shape, np.int8)
    for start in range(0, len(simplices), _BLOCK):
        block = slice(start, start + _BLOCK)
        p, w = points[simplices[block]], weights[simplices[block]]
        with np.errstate(all="ignore"):  # what over- or underflows, or is singular, fails every test
            rho[block], signs[block], certain, accurate = _enclose(p, w)
        open_ = np.flatnonzero(~(certain & accurate))
        if len(open_):
            exact_rho, signs[start + open_] = _exactly(p[open_], w[open_])
            rho[start + open_] = np.where(accurate[open_], rho[start + open_], exact_rho)
    return rho, signs


def _enclose(
    p: NDArray[np.float64], w: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int8], NDArray[np.bool_], NDArray[np.bool_]]:
    """Give sizes and signs of simplices p (s, k+1, d), w (s, k+1), and which signs and which sizes are proven.

    Newton's correction with residuals in double-doubles, and Rump's bound: where |I - R G| <= beta < 1 for an approximate
    inverse R, the error of x is at most |R r| / (1 - beta), r the residual.
    """
    k, d = p.shape[1] - 1, p.shape[2]
    u = 4 * (d + 4) * _U
    edges = _two_sum(p[:, 1:], -p[:, :1])
    difference = _two_sum(w[:, :1], -w[:, 1:])
    # Each equation and unknown is scaled by a power of two, so that edges have lengths near 1.
    length = np.linalg.norm(edges[0], axis=2)
    scale = np.exp2(np.round(np.log2(length)))
    unit = edges[0] / scale[:, :, None], edges[1] / scale[:, :, None]
    gram = unit[0] @ unit[0].transpose(0, 2, 1)
    inverse = _inverse(gram)
    bulk = length**2 / scale + np.abs(difference[0]) / scale

    x = np.zeros(w[:, 1:].shape)
    for _ in range(4):
        step = difference[0] / scale, difference[1] / scale
        for c in range(d):
            rest = edges[0][:, :, c], edges[1][:, :, c]  # of an edge, beyond x
            for j in range(k):
                part = _product((x[:, j, None], 0.0), (unit[0][:, j, None, c], unit[1][:, j, None, c]))
                rest = _sum(rest, (-part[0], -part[1]))
            step = _sum(step, _product((unit[0][:, :, c], unit[1][:, :, c]), rest))
        residual = step[0]
        correction = np.einsum("sij,sj->si", inverse, residual)
        x = x + correction
    x = x - correction  # the residual is that of this x
    spread = np.abs(x).sum(axis=1, keepdims=True)
    doubt = (k + d) * 2.0**-96 * (bulk + 2 * spread) + u * np.abs(residual)
    defect = np.abs(np.eye(k) - inverse @ gram) + u * (np.abs(inverse) @ (np.abs(gram) + 1))
    beta = defect.sum(axis=2).max(axis=1)
    error = np.abs(correction) + np.einsum("sij,sj->si", np.abs(inverse), doubt)
    error = error.max(axis=1) / (1 - beta) * (1 + u)

    x_error = (error[:, None] + u * np.abs(x)) / scale
    x = x / scale  # 2 lambda
    shares = np.concatenate([2 - x.sum(axis=1, keepdims=True), x], axis=1)
    first = x_error.sum(axis=1, keepdims=True) + u * (2 + np.abs(x).sum(axis=1, keepdims=True))
    height = difference
    for c in range(d):
        height = _sum(height, _product((edges[0][:, :, c], edges[1][:, :, c]), (edges[0][:, :, c], edges[1][:, :, c])))
    rho = -w[:, 0], 0.0
    for j in range(k):
        better = 0.25 * x[:, j], 0.25 * (correction / scale)[:, j]
        rho = _sum(rho, _product((height[0][:, j], height[1][:, j]), better))
    rho_error = np.einsum("si,si->s", bulk * scale, x_error + 4 * u * np.abs(x))
    proven = (scale > 2.0**-400).all(axis=1) & (scale < 2.0**400).all(axis=1) & (np.abs(w) < 2.0**800).all(axis=1)
    proven &= beta < 0.5
    certain = proven & (np.abs(shares) > np.concatenate([first, x_error], axis=1)).all(axis=1)
    accurate = proven & (rho_error <= _ACCURACY * (np.abs(rho[0]) + np.abs(w).max(axis=1)))
    return rho[0], np.nan_to_num(np.sign(shares)).astype(np.int8), certain, accurate


def _two_sum(a: NDArray, b: NDArray) -> Pair:
    """Sum and its rounding error."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _sum(a: Pair, b: Pair) -> Pair:
    """Sum of two double-doubles."""
    s, e = _two_sum(a[0], b[0])
    t, f = _two_sum(a[1], b[1])
    s, e = _two_sum(s, e + t)
    return _two_sum(s, e + f)


def _product(a: Pair, b: Pair) -> Pair:
    """Product of two double-doubles, by Dekker's splitting."""
    x, y = a[0], b[0]
    p = x * y
    c = 134217729.0 * x
    x_high = c - (c - x)
    c = 134217729.0 * y
    y_high = c - (c - y)
    x_low, y_low = x - x_high, y - y_high
    e = x_low * y_low - (((p - x_high * y_high) - x_low * y_high) - x_high * y_low)
    return _two_sum(p, e + (x * b[1] + a[1] * y))


def _exactly(p: NDArray[np.float64], w: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Give sizes, rounded once, and signs of independent simplices, by elimination of integers (Bareiss 1968)."""
    k, unit = p.shape[1] - 1, common_unit(p, w)
    located, weight = integers(p, unit), integers(w, 2 * unit)
    edges = located[:, 1:] - located[:, :1]
    gram = (edges[:, :, None] * edges[:, None]).sum(axis=3)
    height = np.einsum("sii->si", gram) + weight[:, :1] - weight[:, 1:]
    rows, last = np.concatenate([gram, height[:, :, None]], axis=2), np.ones((len(p), 1), object)
    for i in range(k):  # a Gram matrix of independent edges is positive definite: no pivoting
        head = rows[:, i, i, None].copy()
        for j in range(k):
            if j != i:
                rows[:, j] = (rows[:, j] * head - rows[:, j, i, None] * rows[:, i]) // last
        last = head
    x, determinant = rows[:, :, k], last[:, 0]
    shares = np.column_stack([2 * determinant - x.sum(axis=1), x])
    size = (height * x).sum(axis=1) - 4 * determinant * weight[:, 0]
    over, under = size << max(2 * unit, 0), 4 * determinant << max(-2 * unit, 0)
    rho = np.array([_quotient(a, b) for a, b in zip(over, under)])
    return rho, (shares > 0).astype(np.int8) - (shares < 0).astype(np.int8)


def _quotient(over: int, under: int) -> float:
    """Nearest float64, infinite beyond the range."""
    try:
        return over / under
    except OverflowError:
        return np.inf if over > 0 else -np.inf


def _inverse(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Approximate inverses; NaN for the whole stack's singular ones, which no test passes."""
    try:
        return np.linalg.inv(matrices).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        singular = ~(np.abs(np.linalg.det(matrices)) > 0)
        result = np.full(matrices.shape, np.nan)
        result[~singular] = np.linalg.inv(matrices[~singular])
        return result


def _starts(rows: NDArray[np.int32], n: int) -> NDArray[np.int64]:
    """Where each first vertex starts in lexicographic rows (n+1,)."""
    return np.searchsorted(rows[:, 0], np.arange(n + 1))
