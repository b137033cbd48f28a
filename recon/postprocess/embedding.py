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
    faces = mesh.faces
    known: set[tuple[int, int]] | None = None
    current = np.array(after)
    while True:
        meeting = intersecting_faces(current, faces)
        if len(meeting) and known is None:
            known = {(int(a), int(b)) for a, b in intersecting_faces(before, faces)}
        fresh = [pair for pair in meeting if known is not None and (int(pair[0]), int(pair[1])) not in known]
        rows = np.unique(faces[np.array(fresh, dtype=np.int64).ravel()])
        back = rows[(current[rows] != before[rows]).any(axis=1)]
        if len(back) == 0:
            current.setflags(write=False)
            return current
        current[back] = before[back]
