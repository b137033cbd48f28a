"""Holes of a sheet too small to be true: loops of its boundary that facets of the triangulation fill."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .topology import HalfEdges

EDGES = 16  # around a pinhole, at most
ISLAND = 32  # samples; the boundary of a smaller piece is no hole

Triple = tuple[int, int, int]


def pinholes(
    cloud: tuple[NDArray, NDArray], walls: tuple[NDArray, ...], faces: NDArray[np.int64], longest: float
) -> NDArray[np.int64]:
    """Find the facets that fill the pinholes of a sheet, each with the least area.

    Parameters
    ----------
    cloud : points (n, 3) and spacing (n,)
    walls : nodes (N, 4), gates (m, 4), and the nodes around each sample, starts (n + 1,) and star
        See `recon._kernels.sides` and `umbrellas`.
    faces : (f, 3) ndarray of int64
        Of the sheet.
    longest : float [local spacings]
        Way around a pinhole.

    Returns
    -------
    ndarray of int64
        4 * cell + corner. No edge of theirs gets more than two faces.
    """
    points, spacing = cloud
    edges = HalfEdges(faces, len(points))
    once = edges.count == 1
    low, high = edges.low[once], edges.high[once]
    length = np.linalg.norm(points[low] - points[high], axis=1) * 2 / (spacing[low] + spacing[high])
    loops = _short_loops(low, high, length, longest)
    if not loops:
        return np.zeros(0, np.int64)
    piece, size = _pieces(edges, len(points))
    near = np.zeros(len(points), bool)
    near[np.concatenate(loops)] = True
    known = set(map(tuple, np.sort(faces[near[faces].all(axis=1)], axis=1).tolist()))
    inner = near[edges.low] & near[edges.high]
    joined = set(zip(edges.low[inner].tolist(), edges.high[inner].tolist()))
    found: list[int] = []
    for loop in loops:
        if size[piece[loop[0]]] >= ISLAND:
            found += _filling(loop, points, _facets(walls, loop, known), joined)
    return np.array(found, np.int64)


def _short_loops(
    low: NDArray[np.int64], high: NDArray[np.int64], length: NDArray[np.float64], longest: float
) -> list[NDArray[np.int64]]:
    """Simple loops of few and short edges, vertex after vertex."""
    corners, ends = np.unique(np.r_[low, high], return_inverse=True)
    a, b = np.split(ends, 2)
    count, label = connected_components(
        coo_matrix((np.ones(len(a), bool), (a, b)), (len(corners),) * 2), directed=False
    )
    forked = np.bincount(label, np.bincount(ends, minlength=len(corners)) != 2, count) > 0
    few = np.bincount(label[a], minlength=count) <= EDGES
    short = ~forked & few & (np.bincount(label[a], length, count) <= longest)
    beside: dict[int, list[int]] = {}
    for i, j in zip(low[short[label[a]]].tolist(), high[short[label[a]]].tolist()):
        beside.setdefault(i, []).append(j)
        beside.setdefault(j, []).append(i)
    loops = []
    while beside:
        loop = [min(beside)]
        while loop[-1] in beside:
            following = beside.pop(loop[-1])
            loop.append(following[0] if following[0] in beside else following[1])
        loops.append(np.array(loop[:-1]))
    return loops


def _pieces(edges: HalfEdges, n: int) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Piece of the surface that each vertex (n,) is in, and how many vertices each has."""
    from ._kernels.edges import components

    piece = components(n, edges.low, edges.high)[1]
    return piece, np.bincount(piece)


def _facets(walls: tuple[NDArray, ...], loop: NDArray[np.int64], known: set[Triple]) -> dict[Triple, int]:
    """The facets between vertices of a loop that are no faces, as 4 * cell + corner."""
    nodes, gate, starts, star = walls
    around = np.unique(np.concatenate([star[starts[v] : starts[v + 1]] for v in loop]))
    around = around[around < len(gate)]
    on = np.isin(nodes[around], loop)
    found: dict[Triple, int] = {}
    for x in around[on.sum(axis=1) >= 3].tolist():
        for k in range(4):
            i, j, l = sorted(np.delete(nodes[x], k).tolist())
            if {i, j, l} <= set(loop.tolist()) and (i, j, l) not in known:
                found.setdefault((i, j, l), 4 * x + k)
    return found


def _filling(
    loop: NDArray[np.int64], points: NDArray[np.float64], facets: dict[Triple, int], joined: set[tuple[int, int]]
) -> list[int]:
    """The disk of these facets with the least area that a loop bounds and none of whose inner edges is taken; or none."""
    k, at = len(loop), loop.tolist()
    best: dict[tuple[int, int], tuple[float, list[int]]] = {(i, i + 1): (0.0, []) for i in range(k - 1)}
    for width in range(2, k):
        for i in range(k - width):
            j = i + width
            if width < k - 1 and (min(at[i], at[j]), max(at[i], at[j])) in joined:
                continue
            ways = []
            for middle in range(i + 1, j):
                a, b, c = sorted((at[i], at[middle], at[j]))
                if (a, b, c) in facets and (i, middle) in best and (middle, j) in best:
                    area = float(np.linalg.norm(np.cross(points[b] - points[a], points[c] - points[a])))
                    (one, left), (two, right) = best[i, middle], best[middle, j]
                    ways.append((one + two + area, [*left, *right, facets[a, b, c]]))
            if ways:
                best[i, j] = min(ways)
    return best.get((0, k - 1), (0.0, []))[1]
