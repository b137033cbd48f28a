"""Cleaning that never opens a hole."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..mesh import Mesh


def split_pinches(mesh: Mesh) -> tuple[Mesh, int]:
    """Give each umbrella of faces a vertex of its own, so that no vertex or edge is pinched.

    Around an edge of more than two faces, each face is joined to the one that it shares a side of the surface with: the
    next one that walks the edge the other way. Two faces that walk their edge the same way are cut apart.

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
    faces = mesh.faces
    f = len(faces)
    if f == 0:
        return mesh, 0
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    key = np.minimum(start, end) * len(mesh.vertices) + np.maximum(start, end)
    ahead = start < end
    turn = np.where(
        np.unique(key, return_counts=True)[1][np.unique(key, return_inverse=True)[1]] > 2, _angle(mesh, ahead), 0.0
    )
    order = np.lexsort((turn, key))
    group = key[order]
    first = np.flatnonzero(np.diff(group, prepend=-1))
    count = np.diff(first, append=len(group))
    left, right = [], []
    pair = first[count == 2]
    pair = pair[ahead[order[pair]] != ahead[order[pair + 1]]]  # two that walk it the same way are cut apart
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


def _angle(mesh: Mesh, ahead: np.ndarray) -> np.ndarray:
    """Angle of each half-edge's face around its edge, walked from the lower to the higher vertex."""
    faces = mesh.faces
    a = mesh.vertices[faces.ravel()]
    b = mesh.vertices[np.roll(faces, -1, axis=1).ravel()]
    c = mesh.vertices[np.roll(faces, -2, axis=1).ravel()]
    low, high = np.where(ahead[:, None], a, b), np.where(ahead[:, None], b, a)
    axis = high - low
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1), np.finfo(float).tiny)[:, None]
    side = np.zeros_like(axis)
    side[np.arange(len(axis)), np.abs(axis).argmin(axis=1)] = 1.0
    u = np.cross(axis, side)
    v = np.cross(axis, u)
    out = c - low
    return np.arctan2((out * v).sum(axis=1), (out * u).sum(axis=1))
