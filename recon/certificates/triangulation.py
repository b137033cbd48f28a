"""Is this the regular triangulation of these weighted points? Decided exactly, by local tests whose sum is global."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..contracts import CertificateError
from ..exact import Cloud, determinant
from ..regular import RegularTriangulation


def certify_triangulation(triangulation: RegularTriangulation) -> None:
    """Check that the cells are R(S), ties broken by index, and that `neighbors` and `hidden` tell the truth about them.

    Parameters
    ----------
    triangulation : RegularTriangulation

    Raises
    ------
    CertificateError
        Naming the first offender.

    Notes
    -----
    Why local tests suffice. Cells of positive volume, glued along facets with opposite orientation, map onto space with a
    degree that only the boundary facets can change. These are seen from a point inside as a star-shaped sphere, covered
    once (one ray leaves through one facet), and bend inwards at no ridge: they bound a convex body, which the cells
    therefore tile. A height function that is convex across every interior facet is convex on the whole of it, so no vertex
    conflicts with any cell; and no hidden point conflicts with the cell that contains it, so none is below the surface.
    Points that span less than their space: all lie in the affine hull of the first cell, exactly, and the rest is done
    along the first axes onto which it projects one to one; there all cells may have either orientation, the same for all.
    """
    cells, neighbors = triangulation.cells, triangulation.neighbors
    _arrays(triangulation)
    _every_row_once(triangulation)
    if cells.shape[1] == 1:
        _single_spot(triangulation)
        return
    cloud = flat_cloud(triangulation)
    cells, neighbors = _positive(cloud, cells, neighbors)
    _neighbors(cells, neighbors)
    _hull(cloud, cells, neighbors)
    _regularity(cloud, cells, neighbors)
    _hidden(cloud, cells, neighbors, triangulation.hidden)


def _arrays(triangulation: RegularTriangulation) -> None:
    """Shapes, types and ranges."""
    points, cells, neighbors = triangulation.points, triangulation.cells, triangulation.neighbors
    n, d = points.shape
    if cells.ndim != 2 or not 1 <= cells.shape[1] <= d + 1 or len(cells) == 0:
        raise CertificateError(f"cells: shape {cells.shape} for points in {d}-D")
    if neighbors.shape != cells.shape:
        raise CertificateError(f"neighbors: shape {neighbors.shape} where cells have {cells.shape}")
    if triangulation.weights.shape != (n,):
        raise CertificateError(f"weights: shape {triangulation.weights.shape} for {n} points")
    for name, array, low, high in (("cells", cells, 0, n), ("neighbors", neighbors, -1, len(cells))):
        if array.dtype != np.int32:
            raise CertificateError(f"{name}: dtype {array.dtype}, promised int32")
        bad = np.flatnonzero(((array < low) | (array >= high)).any(axis=1))
        if len(bad):
            raise CertificateError(f"{name}: row {bad[0]} is out of range: {array[bad[0]]}")


def _every_row_once(triangulation: RegularTriangulation) -> None:
    """Each input row is a vertex or hidden; hidden ones ascend."""
    n, hidden = len(triangulation.points), np.asarray(triangulation.hidden)
    if hidden.ndim != 1 or (np.diff(hidden) <= 0).any() or (len(hidden) and not 0 <= hidden[0] <= hidden[-1] < n):
        raise CertificateError("hidden: not ascending rows of the input")
    count = np.zeros(n, np.int64)
    count[triangulation.cells.ravel()] = 1
    count[hidden] += 1
    bad = np.flatnonzero(count != 1)
    if len(bad):
        what = "neither vertex nor hidden" if count[bad[0]] == 0 else "vertex and hidden at once"
        raise CertificateError(f"point {bad[0]} is {what}")


def _single_spot(triangulation: RegularTriangulation) -> None:
    """All points in one place: the heaviest, then the first, is the only cell."""
    points, weights, cells = triangulation.points, triangulation.weights, triangulation.cells
    bad = np.flatnonzero((points != points[0]).any(axis=1))
    if len(bad):
        raise CertificateError(f"a triangulation of dimension 0, but point {bad[0]} is not where point 0 is")
    if cells.tolist() != [[int(np.argmax(weights))]] or triangulation.neighbors.tolist() != [[-1]]:
        raise CertificateError(f"all points in one place: the one cell is [{np.argmax(weights)}], not {cells.tolist()}")


def flat_cloud(triangulation: RegularTriangulation) -> Cloud:
    """Give the points with exact signs along the first axes that the first cell projects onto one to one.

    Parameters
    ----------
    triangulation : RegularTriangulation
        Of dimension 1 or more.

    Returns
    -------
    Cloud

    Raises
    ------
    CertificateError
        A first cell without volume, or a point outside its affine hull.
    """
    points, cell = triangulation.points, triangulation.cells[0]
    d, k = points.shape[1], len(cell) - 1
    first = [np.array([i]) for i in cell]
    for axes in combinations(range(d), k):
        cloud = Cloud(points, triangulation.weights, axes)
        if cloud.sign(cloud.orient, *first)[0]:
            break
    else:
        raise CertificateError(f"cell 0 {cell} has no volume")
    rows = np.arange(len(points))
    corners = [np.full(len(points), i) for i in cell]
    for axis in set(range(d)) - set(axes):

        def off(base, *spots, columns=(*axes, axis)):
            return determinant([[s.x[a] - base.x[a] for a in columns] for s in spots])

        bad = np.flatnonzero(cloud.sign(off, *corners, rows))
        if len(bad):
            raise CertificateError(f"a triangulation of dimension {k}, but point {bad[0]} is outside that affine hull")
    return cloud


def _positive(
    cloud: Cloud, cells: NDArray[np.int32], neighbors: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Orientation of every cell; a flat triangulation that is negative along the axes is given back turned."""
    sign = cloud.sign(cloud.orient, *cells.T)
    turned = len(cloud.axes) < cloud.points.shape[1] and sign[0] < 0
    bad = np.flatnonzero(sign != (-1 if turned else 1))
    if len(bad):
        raise CertificateError(f"cell {bad[0]} {cells[bad[0]]} is not positively oriented")
    if turned:
        order = [1, 0, *range(2, cells.shape[1])]
        return cells[:, order], neighbors[:, order]
    return cells, neighbors


def _facet(cells: NDArray[np.int32], slot: int) -> NDArray[np.int32]:
    """The facet opposite one slot, its vertices in the cell's order."""
    return np.delete(cells, slot, axis=1)


def _odd(rows: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Does each row sort by an odd permutation?"""
    odd = np.zeros(len(rows), bool)
    for a, b in combinations(range(rows.shape[1]), 2):
        odd ^= rows[:, a] > rows[:, b]
    return odd


def _back_slot(neighbors: NDArray[np.int32], i: NDArray[np.integer], slot: int) -> NDArray[np.int64]:
    """The slot of the neighbour behind `slot` that points back."""
    back = neighbors[neighbors[i, slot]] == i[:, None]
    bad = np.flatnonzero(back.sum(axis=1) != 1)
    if len(bad):
        cell = i[bad[0]]
        raise CertificateError(
            f"neighbors of cell {cell}: cell {neighbors[cell, slot]} does not point back once "
            f"({neighbors[neighbors[cell, slot]]})"
        )
    return back.argmax(axis=1)


def _neighbors(cells: NDArray[np.int32], neighbors: NDArray[np.int32]) -> None:
    """Every link is returned, over the same facet with the opposite orientation."""
    width = cells.shape[1]
    for slot in range(width):
        i = np.flatnonzero(neighbors[:, slot] >= 0)
        back = _back_slot(neighbors, i, slot)
        mine = _facet(cells[i], slot)
        there = cells[neighbors[i, slot]]
        theirs = there[np.arange(width) != back[:, None]].reshape(len(i), width - 1)
        bad = np.flatnonzero((np.sort(mine, axis=1) != np.sort(theirs, axis=1)).any(axis=1))
        if len(bad):
            cell = i[bad[0]]
            raise CertificateError(
                f"cells {cell} {cells[cell]} and {neighbors[cell, slot]} {cells[neighbors[cell, slot]]} do not share "
                f"the facet opposite {cells[cell, slot]}"
            )
        bad = np.flatnonzero(_odd(mine) ^ (slot % 2 == 1) == _odd(theirs) ^ (back % 2 == 1))
        if len(bad):
            cell = i[bad[0]]
            raise CertificateError(f"cells {cell} and {neighbors[cell, slot]} fold over their common facet")


def _hull(cloud: Cloud, cells: NDArray[np.int32], neighbors: NDArray[np.int32]) -> None:
    """The facets without a neighbour bound a convex body, and the cells fill it once."""
    width = cells.shape[1]
    facets, outer = [], []
    for slot in range(width):
        i = np.flatnonzero(neighbors[:, slot] < 0)
        bad = np.flatnonzero(_side_of_center(cloud, cells, i, slot) <= 0)
        if len(bad):
            raise CertificateError(
                f"hull facet {_facet(cells[i[bad[:1]]], slot)[0]} of cell {i[bad[0]]} has the inside of cell 0 outside"
            )
        facets.append(_facet(cells[i], slot))
        outer.append(np.column_stack([i, np.full(len(i), slot)]))
    _covered_once(cloud, cells)
    _convex_ridges(cloud, cells, np.concatenate(facets), np.concatenate(outer))


def _side_of_center(cloud: Cloud, cells: NDArray[np.int32], i: NDArray[np.integer], slot: int) -> NDArray[np.int8]:
    """On which side of the facet opposite `slot` is the centroid of cell 0: +1 where the cell itself is."""
    width = cells.shape[1]

    def formula(*spots):
        corners, center = spots[: width - 1], spots[width - 1 :]
        base = corners[0]
        rows = [[c.x[a] - base.x[a] for a in cloud.axes] for c in corners[1:]]
        # The vector to the centroid, times width: a sum of edges, so that nothing is divided.
        sums = []
        for a in cloud.axes:
            total = center[0].x[a] - base.x[a]
            for vertex in center[1:]:
                total = total + (vertex.x[a] - base.x[a])
            sums.append(total)
        return determinant([*rows, sums])

    center = np.broadcast_to(cells[0], (len(i), width))
    sign = cloud.sign(formula, *_facet(cells[i], slot).T, *center.T)
    return sign if (width - 1 - slot) % 2 == 0 else -sign


def _covered_once(cloud: Cloud, cells: NDArray[np.int32]) -> None:
    """The centroid of cell 0 is in no other cell."""
    axes = list(cloud.axes)
    corners = cloud.points[:, axes][cells]
    center = corners[0].mean(axis=0)
    slack = 1e-12 * np.abs(corners).max()
    near = (corners.min(axis=1) <= center + slack) & (corners.max(axis=1) >= center - slack)
    i = np.flatnonzero(near.all(axis=1))
    i = i[i > 0]
    for slot in range(cells.shape[1]):
        i = i[_side_of_center(cloud, cells, i, slot) >= 0]
    if len(i):
        raise CertificateError(f"cells 0 {cells[0]} and {i[0]} {cells[i[0]]} overlap")


def _convex_ridges(cloud: Cloud, cells: NDArray[np.int32], facets: NDArray[np.int32], outer: NDArray[np.int64]) -> None:
    """Each ridge joins two hull facets, and the far vertex of one is not outside the other."""
    width = cells.shape[1]
    if width == 2:
        if len(facets) != 2:
            raise CertificateError(f"a chain of cells has 2 ends, not {len(facets)}")
        return
    ridges = np.concatenate([np.sort(_facet(facets, j), axis=1) for j in range(width - 1)])
    apex = np.concatenate([facets[:, j] for j in range(width - 1)])
    facet = np.tile(np.arange(len(facets)), width - 1)
    key = _row_keys(ridges, len(cloud.points))
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    bad = np.flatnonzero(np.diff(first, append=len(order)) != 2)
    if len(bad):
        raise CertificateError(f"the hull does not close at ridge {ridges[order[first[bad[0]]]]}")
    here, there = order[first], order[first + 1]
    cell, slot = outer[facet[here]].T
    replaced = cells[cell]
    replaced[np.arange(len(cell)), slot] = apex[there]
    bad = np.flatnonzero(cloud.sign(cloud.orient, *replaced.T) < 0)
    if len(bad):
        raise CertificateError(f"the hull bends inwards at ridge {ridges[here[bad[0]]]}: the cells do not fill it")


def _row_keys(rows: NDArray[np.int32], n: int) -> NDArray[np.int64]:
    """One number a row of indices below n, equal where the rows are."""
    key = rows[:, 0].astype(np.int64)
    for column in rows.T[1:]:
        key = np.unique(key, return_inverse=True)[1] * n + column
    return key


def _regularity(cloud: Cloud, cells: NDArray[np.int32], neighbors: NDArray[np.int32]) -> None:
    """Across every interior facet, the vertex beyond does not conflict with the cell on this side."""
    for slot in range(cells.shape[1]):
        i = np.flatnonzero(neighbors[:, slot] > np.arange(len(cells)))
        there = neighbors[i, slot]
        back = (neighbors[there] == i[:, None]).argmax(axis=1)
        beyond = cells[there, back]
        bad = np.flatnonzero(cloud.perturbed_power(cells[i], beyond) < 0)
        if len(bad):
            cell = i[bad[0]]
            raise CertificateError(f"point {beyond[bad[0]]} conflicts with cell {cell} {cells[cell]}")


def _hidden(cloud: Cloud, cells: NDArray[np.int32], neighbors: NDArray[np.int32], hidden: NDArray[np.integer]) -> None:
    """No hidden point conflicts with a cell that contains it."""
    if len(hidden) == 0:
        return
    cell = _locate(cloud, cells, neighbors, hidden)
    bad = np.flatnonzero(cloud.perturbed_power(cells[cell], hidden) < 0)
    if len(bad):
        i = cell[bad[0]]
        raise CertificateError(f"point {hidden[bad[0]]} is called hidden but conflicts with cell {i} {cells[i]}")


def _locate(
    cloud: Cloud, cells: NDArray[np.int32], neighbors: NDArray[np.int32], q: NDArray[np.integer]
) -> NDArray[np.int64]:
    """A cell that contains each point, by a walk from the nearest vertex; no walk in a regular triangulation cycles."""
    axes = list(cloud.axes)
    vertices = np.unique(cells)
    cell_of = np.zeros(len(cloud.points), np.int64)
    cell_of[cells.ravel()] = np.repeat(np.arange(len(cells)), cells.shape[1])
    flat = cloud.points[:, axes]
    # Only a place to start: a scale of one keeps the search finite whatever the unit.
    scale = max(np.abs(flat).max(), np.finfo(float).tiny)
    nearest = cKDTree(flat[vertices] / scale).query(flat[q] / scale)[1]
    at = cell_of[vertices[nearest]]
    walking = np.arange(len(q))
    for _ in range(len(cells) + 1):
        exit_slot = np.full(len(walking), -1)
        for slot in range(cells.shape[1]):
            open_rows = np.flatnonzero(exit_slot < 0)
            replaced = cells[at[walking[open_rows]]]
            replaced[:, slot] = q[walking[open_rows]]
            exit_slot[open_rows[cloud.sign(cloud.orient, *replaced.T) < 0]] = slot
        walking, exit_slot = walking[exit_slot >= 0], exit_slot[exit_slot >= 0]
        if len(walking) == 0:
            return at
        step = neighbors[at[walking], exit_slot]
        if (step < 0).any():
            raise CertificateError(f"hidden point {q[walking[step < 0][0]]} is outside every cell")
        at[walking] = step
    raise CertificateError(f"the walk to hidden point {q[walking[0]]} does not end")
