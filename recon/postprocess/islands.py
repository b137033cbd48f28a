"""Pieces too shallow to be pieces of a surface: what is left where outliers crowd."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from ..mesh import Mesh
from ..proximity import Frame, area_vectors
from ..topology import agreeing

STANDING = 1.0  # gates that a piece must be deep


def remove_islands(mesh: Mesh, standing: float = STANDING) -> tuple[Mesh, int]:
    """Remove connected pieces that do not stand: no deeper than their faces are wide. Their absolute size does not matter.

    Parameters
    ----------
    mesh : Mesh
    standing : float
        0 keeps all.

    Returns
    -------
    mesh : Mesh
        The other pieces, and the one with the greatest area in any case; vertices in the same order.
    removed : int
        Pieces removed.

    Raises
    ------
    InvalidInput
        standing negative or NaN.

    Notes
    -----
    Depth over gate, the persistence of the void (of a sheet: of the disk) that a piece makes, as a ratio. Depth is 3 V / A, of a ball
    its radius; of a piece with a boundary 2 A / L, of a disk its radius. The gate is the circumradius of an even face, the
    root of the mean squared edge over 3. A tetrahedron has 0.35, an octahedron 0.71, an icosahedron 1.3; a triangle 0.5, a ring of
    six 1.5; a plate t spacings thick 2.6 t. Pieces are joined by common vertices.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = Mesh.from_arrays([*corners, [9, 9, 9], [9, 9, 8], [9, 8, 8]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [4, 5, 6]])
    >>> remove_islands(mesh)
    (Mesh(4 vertices, 4 faces), 1)
    """
    if not standing >= 0:
        raise InvalidInput(f"standing: expected 0 or more, got {standing}")
    if len(mesh.faces) == 0:
        return mesh, 0
    piece = _pieces(mesh.faces, len(mesh.vertices))
    if not piece.any():  # one piece
        return mesh, 0
    area, ratio = _standing(mesh, piece)
    gone = ratio < standing
    gone[np.argmax(area)] = False
    if not gone.any():
        return mesh, 0
    return _without(mesh, gone[piece]), int(gone.sum())


def _pieces(faces: NDArray[np.integer], n: int) -> NDArray[np.int64]:
    """Piece of every face: 0, 1, ..."""
    from .._kernels.edges import components  # numba takes a while to load

    links = np.concatenate([faces[:, :2], faces[:, 1:]]).astype(np.int64)
    count, label = components(n, links[:, 0].copy(), links[:, 1].copy())
    used = np.zeros(count, bool)
    used[label[faces[:, 0]]] = True
    return (np.cumsum(used) - 1)[label[faces[:, 0]]]


def _standing(mesh: Mesh, piece: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Area of every piece, in its own unit, and its depth over its gate."""
    points = Frame(mesh.vertices[mesh.faces.ravel()]).into(mesh.vertices)
    faces = agreeing(mesh.faces)
    vectors = area_vectors(points, faces)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge = np.linalg.norm(points[end] - points[start], axis=1)
    key = np.minimum(start, end) * len(points) + np.maximum(start, end)
    _, which, count = np.unique(key, return_inverse=True, return_counts=True)
    rim = np.where(count[which] == 1, edge, 0.0)
    each = np.repeat(piece, 3)
    area: NDArray[np.float64] = np.bincount(piece, np.linalg.norm(vectors, axis=1)).astype(np.float64)
    middle = np.stack([np.bincount(each, points[start, i]) for i in range(3)], axis=1) / np.bincount(each)[:, None]
    volume = np.abs(np.bincount(piece, np.einsum("ij,ij->i", points[faces[:, 0]] - middle[piece], vectors))) / 3.0
    length = np.bincount(each, rim)
    gate = np.sqrt(np.bincount(each, edge**2) / np.bincount(each) / 3.0)
    twice = np.where(length > 0, 2.0 * area, 3.0 * volume)
    depth = np.divide(twice, np.where(length > 0, length, area), out=np.zeros_like(area), where=area > 0)
    return area, np.divide(depth, gate, out=np.zeros_like(area), where=gate > 0)


def _without(mesh: Mesh, gone: NDArray[np.bool_]) -> Mesh:
    """The other faces, and the vertices that they use."""
    faces = mesh.faces[~gone]
    used = np.unique(faces)
    number = np.zeros(len(mesh.vertices), np.int32)
    number[used] = np.arange(len(used))
    kept = {name: values[used] for name, values in mesh.attributes.items()}
    return Mesh.from_arrays(mesh.vertices[used], number[faces], mesh.vertex_source[used], kept)
