"""Cleaning that never opens a hole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh
from ..topology import HalfEdges, corner_forest


def split_pinches(mesh: Mesh) -> tuple[Mesh, int]:
    """Give each umbrella of faces a vertex of its own, so that no vertex or edge is pinched.

    Around an edge of more than two faces, each face is joined to the one that it shares a side of the surface with: the
    next one that walks the edge the other way. Faces without sides, as of a Moebius band, may meet walking their edge the
    same way; where more than two faces at an edge are left by that, such edges are cut too, and then those that are left.

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
    edges = HalfEdges(mesh.faces.astype(np.int64), len(mesh.vertices))
    one, two = _mates(mesh, edges)
    split, copies = _split(mesh, one, two)
    if edges.count.max() <= 2:
        return split, copies
    edge = np.empty(len(edges.order), np.int64)
    edge[edges.order] = np.repeat(np.arange(len(edges.count)), edges.count)
    while len(crowd := _crowd(split)):
        cut = edges.forward[one] == edges.forward[two]
        if not cut.any():
            cut = np.isin(edge[one], edge[crowd])
        one, two = one[~cut], two[~cut]
        split, copies = _split(mesh, one, two)
    return split, copies


def _crowd(mesh: Mesh) -> NDArray[np.int64]:
    """Half-edges of edges of more than two faces."""
    edges = HalfEdges(mesh.faces.astype(np.int64), len(mesh.vertices))
    return edges.order[np.repeat(edges.count > 2, edges.count)]


def _mates(mesh: Mesh, edges: HalfEdges) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of half-edges whose faces are joined."""
    ahead, order, first, count = edges.forward, edges.order.copy(), edges.first, edges.count
    crowded = np.flatnonzero(np.repeat(count > 2, count))
    if len(crowded):
        half_edges, edge = order[crowded], np.repeat(np.arange(len(count)), count)[crowded]
        order[crowded] = half_edges[np.lexsort((_angle(mesh, ahead, half_edges), edge))]
    pair = first[count == 2]
    left, right = [order[pair]], [order[pair + 1]]
    for at, size in zip(first[count > 2], count[count > 2]):
        ring = order[at : at + size]
        after = np.roll(ring, -1)
        inside = ahead[after] & ~ahead[ring]  # what lies between
        left.append(ring[inside])
        right.append(after[inside])
    return np.concatenate(left), np.concatenate(right)


def _split(mesh: Mesh, one: NDArray[np.int64], two: NDArray[np.int64]) -> tuple[Mesh, int]:
    """Split into umbrellas of faces joined across these pairs of half-edges."""
    from .._kernels.edges import corners_joined, labelled  # numba takes a while to load

    faces = mesh.faces.astype(np.int64)
    f = len(faces)
    same = faces.ravel()[one] == faces.ravel()[two]  # start to start, where both walk the edge the same way
    forest = corner_forest(f)
    corners_joined(forest, one, two, same)
    pieces, number = labelled(forest)
    used = np.zeros(len(mesh.vertices), bool)
    used[faces] = True
    if pieces == np.count_nonzero(used):
        return mesh, 0
    lead = np.empty(pieces, np.int64)
    lead[number[::-1]] = np.arange(3 * f)[::-1]  # the first corner of each
    vertex = faces.ravel()[lead]
    original = np.empty(len(mesh.vertices), np.int64)
    original[vertex[::-1]] = np.arange(pieces)[::-1]
    fresh = original[vertex] != np.arange(pieces)
    copies = int(fresh.sum())
    target = vertex.copy()
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


def _angle(mesh: Mesh, ahead: NDArray, half_edges: NDArray) -> NDArray:
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
