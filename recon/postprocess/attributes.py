"""Values at vertices: normals from the faces, anything else from another mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from ..mesh import Mesh
from ..proximity import FaceQueries, Frame


def with_normals(mesh: Mesh) -> Mesh:
    """Give every vertex a unit normal, the attribute "normals": of its faces, by the angles that they have there.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    Mesh
        0 where the faces have no area, or cancel out.

    Notes
    -----
    Independent of how the surface is cut into faces (Thuermer & Wuethrich 1998).

    Examples
    --------
    >>> with_normals(Mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).attributes["normals"].tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    """
    total = np.zeros((len(mesh.vertices), 3))
    if len(mesh.faces):
        points = Frame(mesh.vertices[mesh.faces.ravel()]).into(mesh.vertices)
        for corner in range(3):
            a, b, c = (points[mesh.faces[:, (corner + i) % 3]] for i in range(3))
            one, two = b - a, c - a
            across = np.cross(one, two)
            size = np.linalg.norm(across, axis=1)
            angle = np.arctan2(size, np.einsum("ij,ij->i", one, two))
            share = np.divide(angle, size, out=np.zeros(len(size)), where=size > 0)
            np.add.at(total, mesh.faces[:, corner], share[:, None] * across)
    size = np.linalg.norm(total, axis=1, keepdims=True)
    normals = np.divide(total, size, out=np.zeros_like(total), where=size > 0)
    normals.setflags(write=False)
    return replace(mesh, attributes={**mesh.attributes, "normals": normals})


def transfer(source: Mesh, target: Mesh) -> tuple[Mesh, int]:
    """Give the vertices of a mesh the attributes of another one that lies where it does.

    Parameters
    ----------
    source : Mesh
        With one face or more.
    target : Mesh

    Returns
    -------
    mesh : Mesh
        The target. A vertex at the place of one of the source's has its values and `vertex_source`. Others have -1, and
        floats and bytes interpolated over the nearest face, everything else from its nearest corner.
    transferred : int
        Vertices whose values are interpolated.

    Raises
    ------
    InvalidInput
        A source without faces.
    """
    if len(source.faces) == 0:
        raise InvalidInput("source: has no faces to take values from")
    if len(target.vertices) == 0:
        return target, 0
    _, face, foot = FaceQueries(source.vertices, source.faces).nearest(target.vertices)
    corners = source.faces[face]
    share = _barycentric(source.vertices[corners], foot)
    nearest = np.take_along_axis(corners, np.argmax(share, axis=1)[:, None], axis=1)[:, 0]
    same = (source.vertices[nearest] == target.vertices).all(axis=1)
    attributes = {}
    for name, values in source.attributes.items():
        taken = values[nearest]
        if values.dtype.kind == "f" or values.dtype == np.uint8:
            mixed = np.einsum("ij,ij...->i...", share[~same], values[corners[~same]].astype(np.float64))
            taken[~same] = (np.round(mixed) if values.dtype == np.uint8 else mixed).astype(values.dtype)
        attributes[name] = taken
    rows = np.where(same, source.vertex_source[nearest], -1)
    return Mesh.from_arrays(target.vertices, target.faces, rows, attributes), int((~same).sum())


def _barycentric(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of the corners (m, 3, 3) at points in their faces; of a face without area, by the distances along it."""
    a, b, c = (corners[:, i] for i in range(3))
    normal = np.cross(b - a, c - a)
    shares = [np.einsum("ij,ij->i", np.cross(q - points, r - points), normal) for q, r in ((b, c), (c, a), (a, b))]
    weights = np.maximum(np.stack(shares, axis=1), 0.0)
    total = weights.sum(axis=1, keepdims=True)
    near = np.linalg.norm(corners - points[:, None], axis=2)
    only = (near == near.min(axis=1, keepdims=True)).astype(np.float64)
    only /= only.sum(axis=1, keepdims=True)
    return np.divide(weights, total, out=only, where=total > 0)
