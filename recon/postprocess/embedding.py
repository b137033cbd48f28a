"""Keeping a mesh from running into itself while its vertices move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..intersections import intersecting_faces
from ..mesh import Mesh


def give_way(mesh: Mesh, before: NDArray[np.float64], after: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put vertices back where they came from until the mesh runs into itself nowhere that it did not before.

    Parameters
    ----------
    mesh : Mesh
        Its faces alone matter.
    before, after : (v, 3) ndarray of float64 [L]

    Returns
    -------
    (v, 3) ndarray of float64 [L]
        Row by row either `after` or, at the faces that would meet and as far around as it takes, `before`.
    """
    faces, current = mesh.faces, np.array(after)
    while True:
        meeting = intersecting_faces(current, faces)
        meeting = meeting[~_met(before, faces, meeting)]
        rows = np.unique(faces[meeting.ravel()])
        back = rows[(current[rows] != before[rows]).any(axis=1)]
        if len(back) == 0:
            current.setflags(write=False)
            return current
        current[back] = before[back]


def _met(points: NDArray[np.float64], faces: NDArray[np.integer], pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which pairs of faces meet at these positions."""
    some = np.unique(pairs)
    known = some[intersecting_faces(points, faces[some])]
    return np.isin(pairs[:, 0] * len(faces) + pairs[:, 1], known[:, 0] * len(faces) + known[:, 1])
