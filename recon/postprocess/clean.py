"""Cleaning that never opens a hole."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..mesh import Mesh


def split_pinches(mesh: Mesh) -> tuple[Mesh, int]:
    """Give each umbrella of faces a vertex of its own, so that no vertex or edge is pinched.

    Around an edge of more than two faces, each face is joined to the one that it shares a side of the surface with: the
    next one that walks the edge the other way. Faces without sides, as of a Moebius band, may meet walking their edge the
    same way; where more than two faces at an edge are left by that, such edges are cut too.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    mesh : Mesh
        The same faces; copies of split vertices come last, with the same source and attributes.
    copies : int
        How many vertices were added.

    Notes
    -----
    Faces stay where they are: the surface touches itself at the split vertices, but is a manifold.
    """
    if len(mesh.faces) == 0:
        return mesh, 0
    split, copies = _split(mesh, sided=False)
    low, high = np.sort(split.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1).T
    key = np.sort(low * len(split.vertices) + high)
    if (key[2:] == key[:-2]).any():
        return _split(mesh, sided=True)
    return split, copies


def _split(mesh: Mesh, sided: bool) -> tuple[Mesh, int]:
    """Split into umbrellas; where `sided`, two faces that walk their edge the same way are cut apart."""
    faces = mesh.faces
    f = len(faces)
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    key = np.minimum(start, end) * len(mesh.vertices) + np.maximum(start, end)
    ahead = start < end
    order = np.argsort(key, kind="stable")
    group = key[order]
    crowded = np.zeros(len(key), bool)
    middle = np.flatnonzero(group[2:] == group[:-2]) + 1  # of three half-edges of one edge, or more
    for shift in (-1, 0, 1):
        crowded[order[middle + shift]] = True
    if crowded.any():
        turn = np.zeros(len(key))
        turn[crowded] = _angle(mesh, ahead, np.flatnonzero(crowded))
        order = np.lexsort((turn, key))
    first = np.flatnonzero(np.diff(group, prepend=-1))
    count = np.diff(first, append=len(group))
    left, right = [], []
    pair = first[count == 2]
    if sided:
        pair = pair[ahead[order[pair]] != ahead[order[pair + 1]]]
    left.append(order[pair])
    right.append(order[pair + 1])
    for at, size in zip(first[count > 2], count[count > 2]):
        ring = order[at : at + size]
        for i in range(size):
            a, b = ring[i], ring[(i + 1) % size]
            if ahead[b] and not ahead[a]:  # what lies between is inside
                left.append([a])
                right.append([b])
    one, two = np.concatenate(left), np.concatenate(right)
    # half-edge h starts at corner h and ends at the next corner of its face
    after = np.arange(3 * f).reshape(f, 3)[:, [1, 2, 0]].ravel()
    corners = np.concatenate([one, after[one]])
    matched = np.concatenate([after[two], two])
    umbrella = connected_components(
        coo_array((np.ones(len(corners), np.int8), (corners, matched)), shape=(3 * f, 3 * f)), directed=False
    )[1]
    _, lead, number = np.unique(umbrella, return_index=True, return_inverse=True)
    vertex = faces.ravel()[lead]
    by_vertex = np.lexsort((lead, vertex))
    fresh = np.empty(len(lead), bool)
    fresh[by_vertex] = np.diff(vertex[by_vertex], prepend=-1) == 0
    copies = int(fresh.sum())
    if copies == 0:
        return mesh, 0
    target = vertex.astype(np.int64)
    target[fresh] = len(mesh.vertices) + np.arange(copies)
    rows = np.concatenate([np.arange(len(mesh.vertices)), vertex[fresh]])
    return (
        Mesh.from_arrays(
            mesh.vertices[rows],
            target[number].reshape(f, 3).astype(np.int32),
            mesh.vertex_source[rows],
            {name: value[rows] for name, value in mesh.attributes.items()},
        ),
        copies,
    )


def _angle(mesh: Mesh, ahead: np.ndarray, half_edges: np.ndarray) -> np.ndarray:
    """Angle of each half-edge's face around its edge, walked from the lower to the higher vertex."""
    face, corner = np.divmod(half_edges, 3)
    a, b, c = (mesh.vertices[mesh.faces[face, (corner + j) % 3]] for j in range(3))
    forward = ahead[half_edges, None]
    low, high = np.where(forward, a, b), np.where(forward, b, a)
    axis = high - low
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1), np.finfo(float).tiny)[:, None]
    side = np.zeros_like(axis)
    side[np.arange(len(axis)), np.abs(axis).argmin(axis=1)] = 1.0
    u = np.cross(axis, side)
    v = np.cross(axis, u)
    out = c - low
    return np.arctan2((out * v).sum(axis=1), (out * u).sum(axis=1))
