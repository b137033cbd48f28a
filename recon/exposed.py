"""The boundary of an alpha complex in space as a mesh: what a ball of one size touches from outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .alpha import EXTERIOR, AlphaComplex, alpha_complex
from .contracts import DegenerateInput, InvalidInput, as_number, as_points
from .mesh import Mesh, compact_mesh, turned


def alpha_shape(points: ArrayLike, radius: float) -> Mesh:
    """Take the boundary of the (unweighted) alpha shape: every facet that an empty ball of this radius exposes.

    Parameters
    ----------
    points : (n, 3) array_like of float [L]
    radius : float [L]
        alpha = radius^2.

    Returns
    -------
    Mesh
        Regular facets outward. Singular facets (exposed from both sides, no interior) agree with their neighbours, and
        outward where they close.

    Raises
    ------
    InvalidInput
        Malformed points, or a radius that is no number, negative or NaN.
    DegenerateInput
        All points on a line or in one spot. Points in one plane give the triangles of their alpha complex.

    Examples
    --------
    >>> alpha_shape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], radius=2.0)
    Mesh(4 vertices, 4 faces)
    """
    located = as_points(points, 3)
    radius = as_number(radius, "radius", "a non-negative length")
    if not radius >= 0:
        raise InvalidInput(f"radius: expected a non-negative length, got {radius}")
    return compact_mesh(located, exposed_faces(alpha_complex(located), min(radius, 1e154) ** 2))  # beyond: all of R


def exposed_faces(family: AlphaComplex, alpha: float) -> NDArray[np.int64]:
    """Give the triangles of the boundary of an alpha complex in space (f, 3), input rows.

    Regular ones outward; singular ones agree with their neighbours, outward where they close. In a plane all are singular,
    and face the same way.

    Parameters
    ----------
    family : AlphaComplex
        Of points in 3-D.
    alpha : float [L^2]

    Raises
    ------
    DegenerateInput
        All points on a line or in one spot.
    """
    points = family.triangulation.points
    if family.dimension < 2:
        where = ("in one spot", "on a line")[family.dimension]
        raise DegenerateInput(f"points: all lie {where}; a surface needs points that span a plane or more")
    if family.dimension == 2:
        faces = family.simplices(2)[family.classify(2, alpha) != EXTERIOR].astype(np.int64)
        a, b, c = np.moveaxis(points[faces], 1, 0)
        normals = np.cross(b - a, c - a)
        axis = np.argmax(np.abs(normals).sum(axis=0))
        return np.where(normals[:, axis, None] < 0, faces[:, ::-1], faces)
    boundary = family.boundary(alpha)
    faces = boundary.facets.astype(np.int64)
    faces[boundary.singular] = turned(points, faces[boundary.singular])
    return faces
