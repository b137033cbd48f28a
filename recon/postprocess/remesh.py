"""Other faces over the same surface, by MeshLab's filters (extra: meshlab)."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput, StageError, require
from ..mesh import Mesh
from .attributes import transfer

SHARP = 30.0  # degrees between faces at an edge that is kept
ITERATIONS = 5


def remesh(mesh: Mesh, edge: float | None = None) -> tuple[Mesh, int]:
    """Remesh isotropically: faces near to equilateral, edges near to one length. Sharp edges stay.

    Parameters
    ----------
    mesh : Mesh
    edge : float [L], optional
        Length of the edges; by default the median of what there is.

    Returns
    -------
    mesh : Mesh
        Attributes are transferred; `vertex_source` is -1 but where a vertex is bit for bit where one was.
    new : int
        Vertices that were not there before.

    Raises
    ------
    InvalidInput
        A length not above 0.
    MissingDependency
        Without pymeshlab.
    StageError
        MeshLab failed.

    Notes
    -----
    Botsch & Kobbelt (2004): split, collapse, flip, relax, project, five times. Topology is MeshLab's affair: certify after.
    """
    if edge is not None and not edge > 0:
        raise InvalidInput(f"edge: expected a length above 0, got {edge}")
    if len(mesh.faces) == 0:
        return mesh, 0
    corners = mesh.vertices[mesh.faces]
    length = edge or float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))
    lab = require("pymeshlab", "meshlab")
    meshes, middle, size = _loaded(lab, mesh)
    wanted = {
        "targetlen": lab.PureValue(length / size),
        "featuredeg": SHARP,
        "iterations": ITERATIONS,
        "checksurfdist": False,
    }
    _apply(meshes, "meshing_isotropic_explicit_remeshing", wanted)
    found = meshes.current_mesh()
    fresh = Mesh.from_arrays(found.vertex_matrix() * size + middle, found.face_matrix())
    return transfer(mesh, fresh)


def flip_edges(mesh: Mesh) -> tuple[Mesh, int]:
    """Flip edges of near-flat pairs of faces where that makes the faces less thin; vertices stay.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    mesh : Mesh
    changed : int
        Faces that were not there before.

    Raises
    ------
    MissingDependency
        Without pymeshlab.
    StageError
        MeshLab failed.
    """
    if len(mesh.faces) == 0:
        return mesh, 0
    lab = require("pymeshlab", "meshlab")
    meshes, _, _ = _loaded(lab, mesh)
    _apply(meshes, "meshing_edge_flip_by_planar_optimization", {"iterations": ITERATIONS})
    faces = meshes.current_mesh().face_matrix().astype(np.int32)
    if meshes.current_mesh().vertex_number() != len(mesh.vertices):
        raise StageError("MeshLab's edge flips changed the number of vertices")
    changed = len(faces) - int(np.isin(_keys(faces, len(mesh.vertices)), _keys(mesh.faces, len(mesh.vertices))).sum())
    if changed == 0:
        return mesh, 0
    faces.setflags(write=False)
    return replace(mesh, faces=faces), changed


def _keys(faces: NDArray[np.integer], n: int) -> NDArray[np.void]:
    """One comparable value a face, whichever corner it begins with."""
    rows = np.ascontiguousarray(np.sort(faces, axis=1).astype(">i8"))
    return rows.view("V24").ravel()


def _loaded(lab: ModuleType, mesh: Mesh) -> tuple[Any, NDArray[np.float64], float]:
    """MeshLab with the mesh, moved to the middle and brought to unit size; the middle, and the size."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, size = 0.5 * low + 0.5 * high, float((high - low).max()) or 1.0
    meshes = lab.MeshSet(verbose=False)
    meshes.add_mesh(lab.Mesh(vertex_matrix=(mesh.vertices - middle) / size, face_matrix=np.array(mesh.faces)))
    return meshes, middle, size


def _apply(meshes: Any, name: str, parameters: dict[str, Any]) -> None:
    """Run one filter."""
    from pymeshlab import PyMeshLabException

    try:
        meshes.apply_filter(name, **parameters)
    except PyMeshLabException as error:
        raise StageError(f"MeshLab's {name} failed: {error}") from error
