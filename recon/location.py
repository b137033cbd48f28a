"""Which simplex of R holds a location, in its relative interior: exactly, in any dimension."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ._kernels import hull as kernels
from .hull import Exact, float_table, scratch
from .regular import RegularTriangulation


def find_simplices(triangulation: RegularTriangulation, x: NDArray[np.float64]) -> NDArray[np.int32]:
    """Find the simplices of R that hold locations in their relative interiors, by walks from the nearest vertices.

    Parameters
    ----------
    triangulation : RegularTriangulation
    x : (q, d) ndarray of float64 [L]

    Returns
    -------
    (q, k+1) ndarray of int32
        Input rows, ascending, after as many -1 as there are fewer vertices than those of a cell.
    """
    n, cells, k = len(triangulation.points), triangulation.cells, triangulation.dimension
    points = np.concatenate([triangulation.points, x])
    vertices = np.unique(cells)
    cell_of = np.empty(n, np.int64)
    cell_of[cells] = np.arange(len(cells))[:, None]
    here = cell_of[vertices[cKDTree(points[vertices]).query(x)[1]]]
    if k < x.shape[1]:
        here[[not _beside(points[cells[0]], location)[0].in_flat(k + 1) for location in x]] = -1
    signs = np.ones((len(x), k + 1), np.int64)
    i = 0 if k else len(x)
    table, trust = float_table(points, np.zeros(len(points)), _beside(points[cells[0]], x[:1])[1])
    matrix, minors = scratch(k)
    while i < len(x):
        i = kernels.find_cells(table, cells, triangulation.neighbors, n, i, here, signs, trust, matrix, minors)
        if i < len(x):  # a sign that float64 leaves open
            exact, _ = _beside(points[cells[here[i]]], x[i])
            signs[i] = [exact.side(list(range(k + 1)), slot, k + 1) for slot in range(k + 1)]
            if -1 in signs[i]:
                here[i] = triangulation.neighbors[here[i], signs[i].tolist().index(-1)]
            else:
                i += 1
    return np.sort(np.where((signs > 0) & (here >= 0)[:, None], cells[here], -1), axis=1)


def _beside(corners: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[Exact, list[int]]:
    """The corners of a cell and, after them, a location; the axes along which the cells are seen."""
    points = np.vstack([corners, x])
    exact = Exact(points, np.zeros(len(points)))
    return exact, exact.span(np.arange(len(corners)))[1]
