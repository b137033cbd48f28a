"""Closing small holes with the triangles of least area over their rim."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from ..intersections import intersecting_faces
from ..mesh import Mesh

EDGES = 12  # of the longest rim that is closed


def fill_holes(mesh: Mesh, edges: int = EDGES) -> tuple[Mesh, int]:
    """Close boundary loops of up to so many edges, without new vertices.

    A hole stays open where its rim touches itself, where closing it would give an edge three faces, or where the new faces would
    meet others. A piece that is a single loop of faces, such as a disk, is one hole seen from outside: its own rim is closed
    only by faces that differ from its own.

    Parameters
    ----------
    mesh : Mesh
        Oriented along its boundary.
    edges : int
        3 or more.

    Returns
    -------
    mesh : Mesh
        New faces last, oriented like those around them.
    filled : int
        Holes closed.

    Raises
    ------
    InvalidInput
        edges below 3.

    Notes
    -----
    The triangulation of least area of each rim, by dynamic programming (Klincsek 1980; Barequet & Sharir 1995): O(k^3) for k edges.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> fill_holes(Mesh.from_arrays(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3]]))
    (Mesh(4 vertices, 4 faces), 1)
    """
    if edges < 3:
        raise InvalidInput(f"edges: a hole has at least 3, got {edges}")
    taken, rims = _rims(mesh.faces)
    patches: list[NDArray[np.int64]] = []
    for rim in rims:
        if len(rim) <= edges:
            patch = _least_area(mesh.vertices, rim, taken)
            if patch is not None:
                patches.append(patch)
                taken.update(_edge(a, b) for face in patch for a, b in itertools.combinations(face.tolist(), 2))
    patches = _apart(mesh, patches)
    if not patches:
        return mesh, 0
    faces = np.concatenate([mesh.faces, *patches]).astype(np.int32)
    faces.setflags(write=False)
    return replace(mesh, faces=faces), len(patches)


def _edge(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def _rims(faces: NDArray[np.integer]) -> tuple[set[tuple[int, int]], list[list[int]]]:
    """All edges; and the simple boundary loops, in the sense in which new faces walk them."""
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    n = int(faces.max(initial=0)) + 1
    key = np.minimum(start, end) * n + np.maximum(start, end)
    distinct, which, count = np.unique(key, return_inverse=True, return_counts=True)
    single = count[which] == 1
    leaving = dict(zip(end[single].tolist(), start[single].tolist()))  # against the face that is there
    visits = np.bincount(np.concatenate([start[single], end[single]]), minlength=1)
    rims, seen = [], set()
    for first in sorted(leaving):
        rim, at = [], first
        while at in leaving and at not in seen and visits[at] == 2:
            seen.add(at)
            rim.append(at)
            at = leaving[at]
        if len(rim) > 2 and at == first:
            rims.append(rim)
    return set(zip(*(side.tolist() for side in np.divmod(distinct, n)))), rims


def _least_area(points: NDArray[np.float64], rim: list[int], taken: set[tuple[int, int]]) -> NDArray[np.int64] | None:
    """Faces over a rim, with no edge that is taken but those of the rim; None where there are none."""
    k = len(rim)
    around = {_edge(rim[i], rim[(i + 1) % k]) for i in range(k)}
    area = np.full((k, k), np.inf)
    apex = np.full((k, k), -1)
    for i in range(k - 1):
        area[i, i + 1] = 0.0
    for gap in range(2, k):
        for i in range(k - gap):
            j = i + gap
            edge = _edge(rim[i], rim[j])
            if edge in taken and edge not in around:
                continue
            a, b = points[rim[i]], points[rim[j]]
            middles = points[rim[i + 1 : j]]
            cost = 0.5 * np.linalg.norm(np.cross(b - a, middles - a), axis=1) + area[i, i + 1 : j] + area[i + 1 : j, j]
            best = int(np.argmin(cost))
            area[i, j], apex[i, j] = cost[best], i + 1 + best
    if not np.isfinite(area[0, k - 1]):
        return None
    faces, open_ = [], [(0, k - 1)]
    while open_:
        i, j = open_.pop()
        m = int(apex[i, j])
        faces.append((rim[i], rim[m], rim[j]))
        open_ += [pair for pair in ((i, m), (m, j)) if pair[1] - pair[0] > 1]
    return np.array(faces, dtype=np.int64)


def _apart(mesh: Mesh, patches: list[NDArray[np.int64]]) -> list[NDArray[np.int64]]:
    """The patches that meet no face of the mesh, nor of a patch before."""
    while patches:
        owner = np.repeat(np.arange(len(patches)), [len(patch) for patch in patches])
        f = len(mesh.faces)
        pairs = intersecting_faces(mesh.vertices, np.concatenate([mesh.faces, *patches]))
        pairs = pairs[pairs[:, 1] >= f]
        if len(pairs) == 0:
            break
        bad = set(owner[pairs[:, 1] - f].tolist())
        patches = [patch for i, patch in enumerate(patches) if i not in bad]
    return patches
