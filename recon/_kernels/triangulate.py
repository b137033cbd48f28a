"""From points to cells in 1-D, 2-D and 3-D: order, span, kernel, hand over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compile import kernel
from .complex import DONE, MORE_CELLS, finish, first_cells, grown
from .predicates import orient2d, orient3d
from .regular1d import lower_chain
from .regular2d import insert2d
from .regular3d import insert3d
from .spatial_sort import hilbert_order, rounds

Cells = tuple[NDArray[np.int32], NDArray[np.int32]]
_INSERT = {2: insert2d, 3: insert3d}


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
    located = np.zeros((n, 3))
    located[:, :d] = points
    order = hilbert_order(located)
    vertices = np.empty((n, 4))
    vertices[:, :3] = located[order]
    vertices[:, 3] = weights[order]
    index = order.astype(np.uint32)
    dimension, simplex, axes = span(vertices)
    vertices[:, :3] = vertices[:, axes]
    if dimension == 0:
        best = np.lexsort((index, -vertices[:, 3]))[0]
        return index[[[best]]].astype(np.int32), np.full((1, 1), -1, np.int32)
    if dimension == 1:
        return _segments(vertices, index)
    return _grow(dimension, vertices, index, simplex[: dimension + 1])


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
    axes[:] = (np.arange(3) + u) % 3

    s, c = 0, b
    while s == 0 and c + 1 < n:
        c += 1
        q = points[c]
        for t in (2, 1, 0):  # the axis to look along
            u, v = (0 if t > 0 else 1), (2 if t < 2 else 1)
            s = orient2d(a[u], a[v], p[u], p[v], q[u], q[v])
            if s != 0:
                axes[:] = np.array((u, v, t))
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
    sequence = rounds(n)
    sequence = sequence[~np.isin(sequence, simplex)]
    capacity = (2, 8)[d - 2] * n + 1000
    vertices = np.empty((d + 1) * capacity, np.uint32)
    neighbors = np.empty((d + 1) * capacity, np.uint32)
    mark = np.zeros(capacity, np.int32)
    cells, links = first_cells(d)
    vertices[: cells.size] = np.append(simplex, n)[cells].ravel()
    neighbors[: links.size] = links.ravel()
    cavity = np.empty(1024, np.uint32)
    border = np.empty(2 * cavity.size + 4, np.uint32)
    state = np.array([0, 0, 0, 0, len(cells), 0], np.int64)
    insert = _INSERT[d]
    while (status := insert(points, index, sequence, vertices, neighbors, mark, cavity, border, state)) != DONE:
        if status == MORE_CELLS:
            vertices, neighbors, mark = (grown(array) for array in (vertices, neighbors, mark))
        else:
            cavity, border = np.empty(2 * cavity.size, np.uint32), np.empty(4 * cavity.size + 4, np.uint32)
    size = finish(vertices, neighbors, d + 1, state[4], index) * (d + 1)
    return vertices[:size].view(np.int32).reshape(-1, d + 1), neighbors[:size].view(np.int32).reshape(-1, d + 1)
