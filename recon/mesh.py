"""The triangle mesh that every stage after the complex takes and returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contracts import InvalidInput, as_points


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles over vertices, with the input row that each vertex came from.

    Attributes
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int32
        Rows of `vertices`, counter-clockwise seen from outside.
    vertex_source : (v,) ndarray of int64
        Input row of each vertex, -1 where a stage made the vertex.
    attributes : dict of str to (v, ...) ndarray
        One row a vertex: colours, normals, anything else the input carried.
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
        kept = {key: np.array(value) for key, value in (attributes or {}).items()}
        for key, value in kept.items():
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
        carried = f", attributes {sorted(self.attributes)}" if self.attributes else ""
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces{carried})"
