"""Sizes, attachment and interval bounds in any dimension, by arrays: the plain twin of the kernels (paper, section 5).

Floats decide where a bound proves that they can: the system G x = h for the orthocentre (G the Gram matrix of the edges
from the first vertex, h_i = |e_i|^2 + w_0 - w_i) is solved with a verified enclosure. The rest goes to fractions.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._kernels.alpha import ATTACHED, HULL
from .regular import RegularTriangulation

if TYPE_CHECKING:
    from .intervals import Level

_U = 2.0**-53
_ACCURACY = 2.0**-40  # of a size, in units of |rho| + max |w|


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
    k, d = simplices.shape[1] - 1, points.shape[1]
    edges = points[simplices[:, 1:]] - points[simplices[:, :1]]
    w = weights[simplices]
    difference = w[:, :1] - w[:, 1:]
    # Exact scaling by powers of two: each edge to a length near 1, all heights by the largest.
    length = np.linalg.norm(edges, axis=2)
    with np.errstate(all="ignore"):  # what over- or underflows, or is singular, fails the test below
        scale = np.exp2(np.round(np.log2(length)))
        unit = edges / scale[:, :, None]
        gram = unit @ unit.transpose(0, 2, 1)
        height = np.einsum("sid,sid->si", unit, unit) * scale + difference / scale
        size_of_height = length**2 / scale + np.abs(difference) / scale
        u = 4 * (d + 4) * _U
        inverse = _inverse(gram)
        x = np.einsum("sij,sj->si", inverse, height)
        product = np.abs(gram) @ np.abs(x)[:, :, None]
        residual = np.abs(height - np.einsum("sij,sj->si", gram, x))
        residual += u * (size_of_height + product[:, :, 0] + np.abs(x) @ np.ones((k, k)))
        defect = np.abs(np.eye(k) - inverse @ gram) + u * (np.abs(inverse) @ (np.abs(gram) + 1))
        beta = defect.sum(axis=2).max(axis=1)
        error = np.einsum("sij,sj->si", np.abs(inverse), residual).max(axis=1) / (1 - beta) * (1 + u)
        x_error = (error[:, None] + u * np.abs(x)) / scale  # of 2 lambda
        x = x / scale
        shares = np.concatenate([2 - x.sum(axis=1, keepdims=True), x], axis=1)
        first = x_error.sum(axis=1, keepdims=True) + u * (2 + np.abs(x).sum(axis=1, keepdims=True))
        x_error = np.concatenate([first, x_error], axis=1)
        power = np.einsum("si,si->s", height * scale, x) / 4
        rho = power - w[:, 0]
        height_size = size_of_height * scale
        power_error = np.einsum("si,si->s", height_size, x_error[:, 1:] + 4 * u * np.abs(x))
        tame = (scale > 2.0**-400).all(axis=1) & (scale < 2.0**400).all(axis=1) & (np.abs(w) < 2.0**800).all(axis=1)
        certain = tame & (beta < 0.5) & (np.abs(shares) > x_error).all(axis=1)
        accurate = tame & (beta < 0.5) & (power_error <= _ACCURACY * (np.abs(rho) + np.abs(w).max(axis=1)))
        signs = np.nan_to_num(np.sign(shares)).astype(np.int8)
    for i in np.flatnonzero(~(certain & accurate)):
        exact_rho, exact_shares = exact_simplex(points[simplices[i]].tolist(), w[i].tolist())
        if not accurate[i]:
            rho[i] = _to_float(exact_rho)
        signs[i] = [(share > 0) - (share < 0) for share in exact_shares]
    return rho, signs


def exact_simplex(points: list[list[float]], weights: list[float]) -> tuple[Fraction, list[Fraction]]:
    """Give the size of one independent simplex, and the barycentric coordinates of its orthocentre, as fractions."""
    origin = [Fraction(x) for x in points[0]]
    w = [Fraction(x) for x in weights]
    edges = [[Fraction(x) - o for x, o in zip(point, origin)] for point in points[1:]]
    rows = [[sum((a * b for a, b in zip(e, f)), Fraction(0)) for f in edges] for e in edges]
    heights = [rows[i][i] + w[0] - w[i + 1] for i in range(len(edges))]
    rows = [[*row, height] for row, height in zip(rows, heights)]
    for i in range(len(rows)):  # a Gram matrix of independent edges is positive definite: no pivoting
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for j in range(len(rows)):
            if j != i and rows[j][i]:
                rows[j] = [a - rows[j][i] * b for a, b in zip(rows[j], rows[i])]
    x = [row[-1] for row in rows]
    return sum((h * y for h, y in zip(heights, x)), Fraction(0)) / 4 - w[0], [
        1 - sum(x, Fraction(0)) / 2,
        *(y / 2 for y in x),
    ]


def _to_float(value: Fraction) -> float:
    """Nearest float64, infinite beyond the range."""
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


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
