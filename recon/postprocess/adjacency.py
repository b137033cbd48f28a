"""The vertices of a mesh as samples that know whom their edges lead to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import weighting
from weighting.projection import Linked

from ..mesh import Mesh


def linked(mesh: Mesh, threads: int | None = None) -> tuple[Linked, NDArray[np.int64]]:
    """Give the vertices in order along a space filling curve, linked by the edges; and the place of every vertex there.

    Parameters
    ----------
    mesh : Mesh
        With one face or more.
    threads : int, optional

    Returns
    -------
    cloud : Linked
    place : (v,) ndarray of int64
    """
    hood = weighting.neighbors(mesh.vertices, threads=threads)
    n = len(mesh.vertices)
    order = np.argsort(hood.inverse, kind="stable")
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    start, end = place[mesh.faces].ravel(), place[np.roll(mesh.faces, -1, axis=1)].ravel()
    key = np.unique(np.concatenate([start * n + end, end * n + start]))
    source, links = np.divmod(key, n)
    first = np.searchsorted(source, np.arange(n + 1))
    spacing, nobody = weighting.spacing(hood)[order], np.zeros(n, bool)
    return Linked(mesh.vertices[order], first, links, spacing, nobody, spacing, np.arange(n)), place
