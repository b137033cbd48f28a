"""The triangle mesh that every stage after the complex takes and returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contracts import InvalidInput, as_points, check_kind, shown
from .topology import agreeing, patches

if TYPE_CHECKING:
    import meshio  # type: ignore[import-untyped]
    import open3d  # type: ignore[import-untyped]
    import pymeshlab  # type: ignore[import-untyped]
    import pyvista
    import trimesh


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles over vertices, with the input row that each vertex came from.

    Goes to other libraries and comes back by one method each way, `to_trimesh` and `from_trimesh` and so on for pyvista,
    meshio, open3d and pymeshlab; each needs the library it names, and nothing else does.

    Attributes
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int32
        Rows of `vertices`, counter-clockwise seen from outside.
    vertex_source : (v,) ndarray of int64
        Input row of each vertex, -1 where a stage made the vertex.
    attributes : dict of str to (v, ...) ndarray
        One row a vertex: colours, normals, anything else the input carried.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = Mesh.from_arrays(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], None, {"label": [7, 7, 7, 9]})
    >>> mesh
    Mesh(4 vertices, 4 faces, attributes: label)
    >>> mesh.vertices.dtype, mesh.faces.dtype, mesh.vertex_source.tolist(), mesh.attributes["label"].tolist()
    (dtype('float64'), dtype('int32'), [0, 1, 2, 3], [7, 7, 7, 9])
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    vertex_source: NDArray[np.int64]
    attributes: Mapping[str, NDArray] = field(default_factory=dict)

    @classmethod
    def from_arrays(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        vertex_source: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
    ) -> Mesh:
        """Validate arrays and freeze them into a mesh.

        Parameters
        ----------
        vertices : (v, 3) array_like of float [L]
        faces : (f, 3) array_like of int
        vertex_source : (v,) array_like of int, default: 0 .. v-1
        attributes : mapping of str to (v, ...) array_like, optional

        Returns
        -------
        Mesh

        Raises
        ------
        InvalidInput
            Wrong shapes, or a face that names a vertex that is not there.
        """
        points = np.zeros((0, 3)) if np.size(vertices) == 0 else as_points(vertices, 3, "vertices")
        triangles = np.asarray(faces)
        if triangles.size == 0:
            triangles = np.zeros((0, 3), np.int32)
        if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
            raise InvalidInput(f"faces: expected integers of shape (f, 3), got {triangles.dtype} {triangles.shape}")
        if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(points)):
            row = int(np.flatnonzero(((triangles < 0) | (triangles >= len(points))).any(axis=1))[0])
            raise InvalidInput(f"faces: row {row} names a vertex that is not there: {triangles[row]} of {len(points)}")
        source = np.arange(len(points)) if vertex_source is None else np.asarray(vertex_source)
        if source.shape != (len(points),):
            raise InvalidInput(f"vertex_source: expected shape ({len(points)},), got {source.shape}")
        if source.dtype.kind not in "iuf" or not ((np.abs(source) < 2**62) & (source == np.trunc(source))).all():
            raise InvalidInput(f"vertex_source: expected row numbers, got {shown(source)}")
        check_kind(attributes, "attributes", (Mapping, type(None)), "names and arrays in a dict")
        kept = {key: np.array(value) for key, value in (attributes or {}).items()}
        for key, value in kept.items():
            check_kind(key, "attributes", str, "text as name")
            if value.shape[:1] != (len(points),):
                raise InvalidInput(f"attribute {key!r}: expected {len(points)} rows, got shape {value.shape}")
        located = np.array(points)
        corners = np.array(triangles, dtype=np.int32, order="C")
        rows = np.array(source, dtype=np.int64)
        arrays: list[NDArray] = [located, corners, rows, *kept.values()]
        for array in arrays:
            array.setflags(write=False)
        return cls(located, corners, rows, kept)

    def __repr__(self) -> str:
        carried = f", attributes: {', '.join(sorted(self.attributes))}" if self.attributes else ""
        return f"Mesh({len(self.vertices):,} vertices, {len(self.faces):,} faces{carried})"

    def _repr_html_(self) -> str:
        from .notebook import mesh_html

        return mesh_html(self)

    def to_trimesh(self) -> trimesh.Trimesh:
        """Give a ``trimesh.Trimesh``: colours as RGBA bytes, all else in ``vertex_attributes``. Extra: convert."""
        from .stages import convert

        return convert.to_trimesh(self)

    @classmethod
    def from_trimesh(cls, mesh: trimesh.Trimesh) -> Mesh:
        """Take a ``trimesh.Trimesh``; normals are left behind, as trimesh computes them."""
        from .stages import convert

        return convert.from_trimesh(mesh)

    def to_pyvista(self) -> pyvista.PolyData:
        """Give a ``pyvista.PolyData`` with all attributes in ``point_data``. Extra: view."""
        from .stages import convert

        return convert.to_pyvista(self)

    @classmethod
    def from_pyvista(cls, mesh: pyvista.PolyData) -> Mesh:
        """Take a ``pyvista.PolyData`` of triangles."""
        from .stages import convert

        return convert.from_pyvista(mesh)

    def to_meshio(self) -> meshio.Mesh:
        """Give a ``meshio.Mesh`` with all attributes in ``point_data``. Extra: convert."""
        from .stages import convert

        return convert.to_meshio(self)

    @classmethod
    def from_meshio(cls, mesh: meshio.Mesh) -> Mesh:
        """Take the triangles of a ``meshio.Mesh``."""
        from .stages import convert

        return convert.from_meshio(mesh)

    def to_open3d(self, *, tensor: bool = False) -> open3d.geometry.TriangleMesh | open3d.t.geometry.TriangleMesh:
        """Give an Open3D mesh: legacy, with colours and normals, or a tensor one with all attributes. Extra: open3d."""
        from .stages import convert

        return convert.to_open3d(self, tensor=tensor)

    @classmethod
    def from_open3d(cls, mesh: open3d.geometry.TriangleMesh | open3d.t.geometry.TriangleMesh) -> Mesh:
        """Take an Open3D mesh, legacy or tensor."""
        from .stages import convert

        return convert.from_open3d(mesh)

    def to_pymeshlab(self) -> pymeshlab.Mesh:
        """Give a ``pymeshlab.Mesh``: colours, ``"quality"`` as its scalar, all else as custom attributes. Extra: meshlab."""
        from .stages import convert

        return convert.to_pymeshlab(self)

    @classmethod
    def from_pymeshlab(cls, mesh: pymeshlab.Mesh, attributes: tuple[str, ...] = ()) -> Mesh:
        """Take a ``pymeshlab.Mesh``, with the custom attributes that are named: PyMeshLab cannot list them."""
        from .stages import convert

        return convert.from_pymeshlab(mesh, attributes)


def compact_mesh(points: NDArray[np.float64], faces: NDArray, attributes: dict[str, NDArray] | None = None) -> Mesh:
    """Keep the points that faces use, in input order; `vertex_source` says which they were.

    Parameters
    ----------
    points : (n, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int
        Rows of `points`.
    attributes : dict of str to (n, ...) ndarray, optional
    """
    used = np.zeros(len(points), bool)
    used[faces.ravel()] = True
    source = np.flatnonzero(used)
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    carried = {key: np.asarray(value)[source] for key, value in (attributes or {}).items()}
    return Mesh.from_arrays(points[source], number[faces], source, carried)


def turned(points: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces turned to agree with their neighbours, patches of positive volume."""
    faces = agreeing(faces)
    a, b, c = np.moveaxis((points - points.mean(axis=0))[faces], 1, 0)
    return _by_vote(faces, np.einsum("ij,ij->i", a, np.cross(b, c)))


def turned_by_majority(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces turned to agree with their neighbours, patches the way that most of their faces were."""
    agreed = agreeing(faces)
    return _by_vote(agreed, np.where((agreed == faces).all(axis=1), 1.0, -1.0))


def _by_vote(faces: NDArray[np.int64], vote: NDArray[np.float64]) -> NDArray[np.int64]:
    """Patches of agreeing faces, turned where their votes are against them."""
    patch = patches(faces)
    return np.where(np.bincount(patch, vote)[patch][:, None] < 0, faces[:, ::-1], faces)
