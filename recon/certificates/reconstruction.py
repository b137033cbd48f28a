"""Does a reconstruction hold what it says: of its triangulation, of its surface, and in the figures of its report?"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..contracts import CertificateError
from ..exact import Cloud
from ..mesh import Mesh
from .complex import certify_complex
from .surface import certify_mesh, count_mesh
from .triangulation import certify_triangulation

if TYPE_CHECKING:
    from ..pipeline import Reconstruction

_CLOSED = {"closed": True, "open": False, "planar": False, "terrain": False, "complex": None}


def certify_reconstruction(result: Reconstruction) -> None:
    """Check the triangulation, the mesh and the report, each with code of its own.

    The triangulation is R(S) of the weights. Every vertex of the mesh is the input point it names, every face a simplex of R
    (so the mesh is embedded, which is checked as well). It is closed or open as it says, oriented, the outside in front
    where closed; oriented where the report says so; manifold where it counts nothing that is not. The counts of the report are those of the mesh. A
    literal boundary is that of the complex, which is then checked as well.

    Parameters
    ----------
    result : Reconstruction

    Raises
    ------
    CertificateError
        Naming the first offender.
    """
    triangulation, mesh, kind = result.triangulation, result.mesh, result.surface
    certify_triangulation(triangulation)
    if kind not in _CLOSED:
        raise CertificateError(f"surface: {kind!r} is none of {', '.join(map(repr, _CLOSED))}")
    if not np.array_equal(result.weights, triangulation.weights):
        raise CertificateError("weights: not those of the triangulation")
    if not 0 <= result.confidence <= 1:
        raise CertificateError(f"confidence: {result.confidence} is not between 0 and 1")
    _faces_of_triangulation(mesh.vertex_source[mesh.faces], triangulation.cells)
    if kind == "complex":
        _literal(result)
    told = result.report["mesh"]
    counts = count_mesh(mesh)
    for name, value in counts.items():
        if told.get(name) != value:
            raise CertificateError(f"report: {name} {told.get(name)}, but the mesh has {value}")
    if kind == "terrain":
        mesh = _plan(mesh)  # where that is embedded, so is what lies above it
    certify_mesh(
        mesh,
        closed=_CLOSED[kind],
        manifold=counts["nonmanifold_edges"] == counts["nonmanifold_vertices"] == 0,
        oriented=kind == "closed" or (kind != "complex" and told["oriented"]),
        points=triangulation.points,
    )


def _faces_of_triangulation(faces: NDArray[np.int64], cells: NDArray[np.int32]) -> None:
    """Each face, in input rows, is a triangle of R."""
    n = max(int(cells.max()), int(faces.max(initial=0))) + 1
    ascending = np.sort(cells, axis=1).astype(np.int64)
    known = [_key(ascending[:, list(corners)], n) for corners in combinations(range(cells.shape[1]), 3)]
    bad = np.flatnonzero(~np.isin(_key(np.sort(faces, axis=1), n), np.unique(np.concatenate(known))))
    if len(bad):
        raise CertificateError(f"face {bad[0]}, input rows {faces[bad[0]]}, is no triangle of the triangulation")


def _plan(mesh: Mesh) -> Mesh:
    """The mesh at height 0, every face of it seen from above."""
    plan = Cloud(mesh.vertices, axes=(0, 1))
    bad = np.flatnonzero(plan.sign(plan.orient, *mesh.faces.T) <= 0)
    if len(bad):
        raise CertificateError(f"face {bad[0]} {mesh.faces[bad[0]]} of a terrain is not seen from above")
    return replace(mesh, vertices=mesh.vertices * [1.0, 1.0, 0.0])


def _literal(result: Reconstruction) -> None:
    """The faces are the facets of the boundary of W_0, each once."""
    from ..alpha import alpha_complex

    whole = alpha_complex(result.triangulation)
    certify_complex(whole)
    expected = np.sort(whole.boundary(0.0).facets, axis=1)
    found = np.sort(result.mesh.vertex_source[result.mesh.faces], axis=1)
    found = found[np.lexsort(found.T[::-1])]
    if not np.array_equal(found, expected[np.lexsort(expected.T[::-1])]):
        raise CertificateError("the faces are not the facets of the boundary of W_0")


def _key(rows: NDArray[np.int64], n: int) -> NDArray[np.int64] | NDArray[np.void]:
    """One comparable number a row of three indices below n."""
    if n <= 1 << 21:
        return (rows[:, 0] << 42) | (rows[:, 1] << 21) | rows[:, 2]
    return np.ascontiguousarray(rows.astype(">i4")).view("V12").ravel()
