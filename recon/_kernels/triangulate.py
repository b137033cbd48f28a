"""From points to cells in 1-D, 2-D and 3-D: order, span, kernel, hand over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compile import kernel
from .complex import CELLS_MAX, DONE, MORE_CAVITY, USED, finish, first_cells
from .predicates import orient2d, orient3d
from .regular1d import lower_chain
from .regular2d import insert2d
from .regular3d import insert3d
from .spatial_sort import hilbert_order, rounds

Cells = tuple[NDArray[np.int32], NDArray[np.int32]]


def triangulate(points: NDArray[np.float64], weights: NDArray[np.float64]) -> Cells:
    """Triangulate weighted points regularly, in the flat that they span.

    Parameters
    ----------
    points : (n, d) ndarray of float64, d <= 3
    weights : (n,) ndarray of float64

    Returns
    -------
    cells, neighbors : (m, k+1) ndarray of int32
        k is the dimension of the flat. Cells are positive, in a flat as seen along a coordinate axis (k = 2), or by
        ascending coordinate (k = 1). -1 stands for no neighbour.
    """
    n, d = points.shape
    if d < 3:
        located = np.zeros((n, 3))
        located[:, :d] = points
        points = located
    order = hilbert_order(points)
    vertices = gather(points, weights, order)
    index = order.astype(np.uint32)
    dimension, simplex, axes = span(vertices)
    if dimension < 3 and (axes != np.arange(3)).any():
        vertices[:, :3] = vertices[:, axes]
    if dimension == 0:
        best = np.lexsort((index, -vertices[:, 3]))[0]
        return index[[[best]]].astype(np.int32), np.full((1, 1), -1, np.int32)
    if dimension == 1:
        return _segments(vertices, index)
    return _grow(dimension, vertices, index, simplex[: dimension + 1])


@kernel
def gather(points, weights, order):
    """Points and weights side by side, in order."""
    n = order.size
    vertices = np.empty((n, 4))
    for i in range(n):
        row = order[i]
        vertices[i, 0], vertices[i, 1], vertices[i, 2] = points[row, 0], points[row, 1], points[row, 2]
        vertices[i, 3] = weights[row]
    return vertices


@kernel
def span(points):
    """Dimension of the flat that points span, as many + 1 rows that make a positive cell in it, and the axes to use.

    The flat is mapped one-to-one to the first of these axes if it is a line, to the first two if it is a plane.
    """
    n = points.shape[0]
    simplex = np.zeros(4, np.int64)
    axes = np.arange(3)
    a, b = points[0], 1
    while b < n and a[0] == points[b, 0] and a[1] == points[b, 1] and a[2] == points[b, 2]:
        b += 1
    if b == n:
        return 0, simplex, axes
    p = points[b]
    simplex[1] = b
    u = 0
    while a[u] == p[u]:
        u += 1
    for k in range(3):
        axes[k] = (u + k) % 3

    s, c = 0, b
    while s == 0 and c + 1 < n:
        c += 1
        q = points[c]
        for t in (2, 1, 0):  # the axis to look along
            u, v = (0 if t > 0 else 1), (2 if t < 2 else 1)
            s = orient2d(a[u], a[v], p[u], p[v], q[u], q[v])
            if s != 0:
                axes[0], axes[1], axes[2] = u, v, t
                break
    if s == 0:
        return 1, simplex, axes
    simplex[0], simplex[1] = (0, b) if s > 0 else (b, 0)
    simplex[2] = c

    q = points[c]
    s, e = 0, c
    while s == 0 and e + 1 < n:
        e += 1
        s = orient3d(a[0], a[1], a[2], p[0], p[1], p[2], q[0], q[1], q[2], points[e, 0], points[e, 1], points[e, 2])
    if s == 0:
        return 2, simplex, axes
    simplex[0], simplex[1] = (0, b) if s > 0 else (b, 0)
    simplex[3] = e
    return 3, simplex, np.arange(3)


def _segments(points: NDArray, index: NDArray) -> Cells:
    """Triangulate points of a line, along their first coordinate."""
    order = np.lexsort((index, -points[:, 3], points[:, 0]))
    points, index = points[order], index[order]
    first = np.append(True, np.diff(points[:, 0]) != 0.0)  # of each location: the heaviest, then the lowest row
    points, index = points[first], index[first]
    chain = index[lower_chain(points, index)].astype(np.int32)
    cells = np.column_stack([chain[:-1], chain[1:]])
    here = np.arange(len(cells), dtype=np.int32)
    neighbors = np.column_stack([here + 1, here - 1])
    neighbors[-1, 0] = -1
    return cells, neighbors


def _grow(d: int, points: NDArray, index: NDArray, simplex: NDArray) -> Cells:
    """Insert vertex after vertex (they lie along a curve) into the cell `simplex` and its ghosts."""
    n = len(index)
    points = np.append(points.ravel(), np.full(4, np.nan))
    sequence = rounds(n, np.sort(simplex))
    words = np.empty(8 * ((3, 8)[d - 2] * n + 1000), np.uint32)
    first = first_cells(d, simplex, n)
    words[: first.size] = first
    state = np.zeros(6, np.int64)
    state[USED] = first.size // 8
    buffers = scratch(d, n, 256)
    insert = (insert2d, insert3d)[d - 2]
    while (status := insert(points, index, sequence, words, *buffers, state)) != DONE:
        if status == MORE_CAVITY:
            buffers = scratch(d, n, 2 * buffers[0].size)
            continue
        if words.size >= 8 * CELLS_MAX:
            raise MemoryError(f"more than {CELLS_MAX} cells")
        larger = np.empty(min(words.size // 16 * 24, 8 * CELLS_MAX), np.uint32)
        larger[: words.size] = words
        words = larger
    cells, neighbors = finish(words, state[USED], d + 1, index)
    return cells.view(np.int32), neighbors.view(np.int32)


def scratch(d: int, n: int, size: int) -> tuple[NDArray, ...]:
    """Room for a cavity of `size` cells, and so of less than 2 * size + 4 border facets, of four words."""
    cavity, border = np.empty(size, np.uint32), np.empty(8 * size + 16, np.uint32)
    if d == 2:
        return cavity, border, np.empty(n + 1, np.uint32)
    return cavity, border, np.empty(32 * size, np.uint64), np.zeros(32 * size, np.uint64)
