"""Handles too thin to be true: the short loops around them are found, they are cut where that costs nothing, and what is left is told."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .between import facets_between
from .regular import OUTWARD
from .topology import HalfEdges

THIN = 5 * np.pi  # longest loop around a thin handle: the circle around the widest facet of a sheet [local spacings]
EDGES = 16  # of such a loop, at most
SHALLOW = 2.0  # trust of the poles of its samples, at most


def cut_thin_handles(
    ground: tuple[NDArray, ...],
    sides: NDArray[np.int8],
    poles: tuple[NDArray, NDArray, NDArray],
    excess: NDArray[np.int32],
    threads: int | None,
) -> tuple[int, list[NDArray[np.int64]]]:
    """Cut the thin handles of a closed surface that cost nothing, in place.

    Parameters
    ----------
    ground : tuple of ndarray
        See `recon._kernels.repair.move`.
    sides : (N,) ndarray of int8
    poles : (n,) ndarrays of int32, int32, float32
    excess : (n,) ndarray of int32
        Kept up to date.
    threads : int or None

    Returns
    -------
    cut : int
        By how much the Euler number of the surface has grown: twice the number of handles cut.
    loops : list of (k,) ndarray of int64
        The samples of each loop around a thin handle that is left, or through it, in order; one of each homology class.
    """
    from ._kernels import components, forest, umbrellas  # numba takes a while to load
    from ._kernels.handles import cut_handle

    points, spacing, nodes, links, gate, starts, _ = ground
    n = len(points)
    pole, anti, trust = poles
    scratch, idle = umbrellas.rooms(starts), np.full(len(nodes), -1, np.int32)
    cut, turn = 0, 0
    tried: dict[bytes, int] = {}  # turn in which a loop was last tried,
    stirred = np.zeros(n, np.int64)  # and in which something was cut near a sample
    while True:
        turn += 1
        faces = forest.corners_of(nodes, facets_between(links, sides, len(gate), threads), OUTWARD)
        shallow = (trust < SHALLOW) | (sides[pole] == sides[anti])
        among = _beyond_disks(faces, shallow)
        if not among.any():
            return cut, []
        used = np.zeros(n, bool)
        used[faces.ravel()] = True
        if used.sum() - len(faces) // 2 == 2 * components.count_components(links, sides) - 2:
            return cut, []  # its Euler number without handles
        touched = np.zeros(n, bool)
        thin = [loop for loop in _loops(faces, among) if _length(points, loop) <= THIN * spacing[loop].mean()]
        for loop in thin:
            if tried.get(loop.tobytes(), -1) < stirred[loop].max():
                tried[loop.tobytes()] = turn
                cut += cut_handle(ground, scratch, sides, excess, loop, pole, anti, (idle, touched))
        if not touched.any():
            return cut, thin
        stirred[touched] = turn + 1


def _length(points: NDArray[np.float64], loop: NDArray[np.int64]) -> float:
    """Of a closed polygon through these points."""
    return float(np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).sum())


def _beyond_disks(faces: NDArray[np.integer], among: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of these vertices (n,) span no piece of the surface of Euler number 1? In such a piece no loop is around a handle."""
    from ._kernels.edges import components

    within = among[faces].sum(axis=1)
    edges = HalfEdges(faces[within >= 2].astype(np.int64), len(among))
    both = among[edges.low] & among[edges.high]
    vertices, ends = np.unique(np.r_[edges.low[both], edges.high[both]], return_inverse=True)
    low, high = np.split(ends, 2)
    pieces, piece = components(len(vertices), low, high)
    inner = np.searchsorted(vertices, faces[within == 3][:, 0])
    euler = sum(
        sign * np.bincount(piece[part], minlength=pieces) for sign, part in ((1, slice(None)), (-1, low), (1, inner))
    )
    beyond = np.zeros(len(among), bool)
    beyond[vertices[np.asarray(euler != 1)[piece]]] = True
    return beyond


def _loops(faces: NDArray[np.integer], among: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Loops of at most `EDGES` edges between these vertices (n,) that part no piece of a closed surface, fewest first: of those that are
    shortest through one of their vertices, one of each homology class.

    A loop is the boundary of a part of the surface, or not, whatever that looks like beyond the edges between these vertices: so
    all faces that those do not part are one side. A spanning tree of the vertices and one of the sides that crosses none of its
    edges leave some edges (Eppstein 2003). Each of these, closed in the tree of the sides, is a cocycle: a loop has the class
    of the cocycles that it crosses an odd number of times. They are told apart by words of 64 random bits, the same in every run. The
    shortest loop through a vertex comes of a breadth-first search from there, and each loop that counts has an edge on a
    cocycle.
    """
    from ._kernels.handles import class_words, loops_from, pieces_beyond

    inside = among[faces]
    near = np.flatnonzero(inside.sum(axis=1) >= 2)
    third = np.where(inside[near], 0, faces[near]).sum(axis=1)  # the one vertex that may be none of these
    side = np.where(inside[near].all(axis=1), len(among) + near, pieces_beyond(faces, among)[third])
    edges = HalfEdges(faces[near].astype(np.int64), len(among))
    beside = np.full((len(edges.count), 2), -1)
    beside[edges.count == 2] = np.stack(edges.pairs(), axis=1) // 3
    between = among[edges.low] & among[edges.high]
    two = between & (edges.count == 2)
    beside[two] = side[beside[two]]
    vertices, ends = np.unique(np.stack([edges.low, edges.high], axis=1)[between], return_inverse=True)
    names, sides = np.unique(beside[two], return_inverse=True)
    beside[two] = sides.reshape(-1, 2)
    ends = ends.reshape(-1, 2)
    words, around = class_words(len(vertices), ends, len(names), beside[between])
    counts, classes, found = loops_from(ends, *around, words, EDGES)
    order = np.argsort(counts, kind="stable")
    first = np.sort(np.unique(classes[order], return_index=True)[1])
    return [vertices[found[k, : counts[k]]] for k in order[first]]
