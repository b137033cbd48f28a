"""Meshes to and from the classes of other libraries, one function each way.

Coordinates stay in double precision where the other class can hold it. Attributes of the vertices go along; what a class has
no place for is said with the function.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput, require
from ..mesh import Mesh
from .attributes import byte_colors, doubles, others, refuse_other, split_source
from .meshlab import from_pymeshlab, to_pymeshlab
from .open3d import from_open3d, to_open3d

__all__ = [
    "from_meshio",
    "from_open3d",
    "from_pymeshlab",
    "from_pyvista",
    "from_trimesh",
    "to_meshio",
    "to_open3d",
    "to_pymeshlab",
    "to_pyvista",
    "to_trimesh",
]


def to_trimesh(mesh: Mesh) -> Any:
    """Give a ``trimesh.Trimesh``; colours as RGBA bytes, the other attributes and `vertex_source` in ``vertex_attributes``."""
    trimesh = require("trimesh", "convert")
    refuse_other(mesh, Mesh, "recon.Mesh")
    colors = mesh.attributes.get("colors")
    made = trimesh.Trimesh(
        vertices=np.array(mesh.vertices),
        faces=np.array(mesh.faces),
        vertex_normals=doubles(mesh, "normals", 3),
        vertex_colors=None if colors is None else byte_colors(colors),
        process=False,
    )
    for name, values in others(mesh.attributes, "colors", "normals").items():
        made.vertex_attributes[name] = np.array(values)
    made.vertex_attributes["vertex_source"] = np.array(mesh.vertex_source)
    return made


def from_trimesh(mesh: Any) -> Mesh:
    """Take a ``trimesh.Trimesh``; normals are left behind, as trimesh computes them."""
    refuse_other(mesh, require("trimesh", "convert").Trimesh, "trimesh.Trimesh")
    attributes = {name: np.asarray(values) for name, values in mesh.vertex_attributes.items()}
    if mesh.visual.kind == "vertex":
        attributes["colors"] = np.asarray(mesh.visual.vertex_colors)
    return Mesh.from_arrays(mesh.vertices, mesh.faces, split_source(attributes), attributes)


def to_pyvista(mesh: Mesh) -> Any:
    """Give a ``pyvista.PolyData``; all attributes and `vertex_source` in ``point_data``."""
    vista = require("pyvista", "view")
    refuse_other(mesh, Mesh, "recon.Mesh")
    made = vista.PolyData.from_regular_faces(np.array(mesh.vertices), np.array(mesh.faces))
    for name, values in {**mesh.attributes, "vertex_source": mesh.vertex_source}.items():
        made.point_data[name] = _columns(name, values)
    return made


def from_pyvista(mesh: Any) -> Mesh:
    """Take the triangles of a ``pyvista.PolyData``; other faces are an error, vertices and lines are left behind."""
    refuse_other(mesh, require("pyvista", "view").PolyData, "pyvista.PolyData")
    counted = np.asarray(mesh.faces)  # each after the number of its corners
    if mesh.n_strips or len(counted) % 4 or (counted[::4] != 3).any():
        raise InvalidInput("mesh: has faces other than triangles; triangulate() makes them so")
    attributes = {name: np.asarray(mesh.point_data[name]) for name in mesh.point_data}
    return Mesh.from_arrays(mesh.points, counted.reshape(-1, 4)[:, 1:], split_source(attributes), attributes)


def to_meshio(mesh: Mesh) -> Any:
    """Give a ``meshio.Mesh``; all attributes and `vertex_source` in ``point_data``."""
    meshio = require("meshio", "convert")
    refuse_other(mesh, Mesh, "recon.Mesh")
    data = {name: np.array(values) for name, values in mesh.attributes.items()}
    data["vertex_source"] = np.array(mesh.vertex_source)
    return meshio.Mesh(np.array(mesh.vertices), [("triangle", np.array(mesh.faces))], point_data=data)


def from_meshio(mesh: Any) -> Mesh:
    """Take the triangles of a ``meshio.Mesh``; cells of other kinds are an error, but for vertices and lines."""
    refuse_other(mesh, require("meshio", "convert").Mesh, "meshio.Mesh")
    kinds = {block.type for block in mesh.cells}
    if not kinds <= {"triangle", "vertex", "line"}:
        raise InvalidInput(f"mesh: expected triangles, got cells of kind {', '.join(sorted(kinds - {'triangle'}))}")
    faces = [block.data for block in mesh.cells if block.type == "triangle"]
    points = np.asarray(mesh.points)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    attributes = {name: np.asarray(values) for name, values in mesh.point_data.items()}
    triangles = np.concatenate(faces) if faces else np.zeros((0, 3), np.int32)
    return Mesh.from_arrays(points, triangles, split_source(attributes), attributes)


def _columns(name: str, values: NDArray) -> NDArray:
    """One number, text or one row of them a vertex, which is what VTK holds."""
    if values.ndim > 2 or 0 in values.shape[1:]:
        raise InvalidInput(f"attribute {name!r}: VTK holds numbers or rows of them, got shape {values.shape}")
    if values.dtype.kind not in "fiubcUS" or (values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8)):
        raise InvalidInput(f"attribute {name!r}: VTK holds no {values.dtype}")
    return np.array(values)
