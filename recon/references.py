"""What a mesh is measured against, in one shape: an analytic surface, another mesh, or a cloud."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from .contracts import InvalidInput, as_points
from .mesh import Mesh
from .proximity import FaceQueries, Frame, area_samples, area_vectors
from .topology import topology

Array = NDArray[np.float64]


class Reference(Protocol):
    """The truth, or what stands for it; None where it does not know.

    Attributes
    ----------
    bounds : (2, 3) ndarray of float64 [L]
    area, volume : float or None [L^2], [L^3]
    euler, components, boundary_loops : int or None
    closed : bool
        `contains` has an answer, and distances have a sign.
    orientable : bool
    """

    bounds: Array
    area: float | None
    volume: float | None
    euler: int | None
    components: int | None
    boundary_loops: int | None
    closed: bool
    orientable: bool

    def sample(self, n: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
        """Points spread evenly by area, at most n, and their unit normals."""
        ...

    def nearest(self, x: Array) -> tuple[Array, Array | None]:
        """Distances [L], negative inside where `closed`; unit normals at the nearest points."""
        ...

    def contains(self, x: Array) -> NDArray[np.bool_]:
        """Inside or not; asked only where `closed`."""
        ...


def as_reference(reference: Any) -> Reference:
    """Take what `recon.measure` was given.

    Parameters
    ----------
    reference : Mesh, (m, 3) array_like of float [L], or an object like datasets_synthetic.Surface

    Returns
    -------
    Reference

    Raises
    ------
    InvalidInput
        None of these, or empty.
    """
    if isinstance(reference, Mesh):
        return _MeshReference(reference)
    if hasattr(reference, "distance") and hasattr(reference, "normal") and hasattr(reference, "sample"):
        return _SurfaceReference(reference)
    return _CloudReference(reference)


class _SurfaceReference:
    """An analytic surface: exact signed distance and normal, true area, volume and topology."""

    def __init__(self, surface: Any):
        self._surface = surface
        self.area: float | None = float(surface.area)
        self.euler: int | None = int(surface.euler)
        self.components: int | None = getattr(surface, "components", None)
        self.boundary_loops: int | None = getattr(surface, "boundary_loops", None)
        self.orientable = bool(getattr(surface, "orientable", True))
        self.closed = bool(getattr(surface, "closed", self.boundary_loops == 0))
        self.volume: float | None = float(surface.volume) if self.closed else None
        bounds = getattr(surface, "bounds", None)
        if bounds is None:
            points = self.sample(10_000, np.random.default_rng(0))[0]
            bounds = [points.min(axis=0), points.max(axis=0)]
        self.bounds = np.asarray(bounds, dtype=np.float64)
        if self.bounds.shape != (2, 3):
            raise InvalidInput(f"reference: a surface in 3-D is needed, {surface!r} is not")

    def sample(self, n: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
        sample = self._surface.sample(n, rng=rng)
        points = np.asarray(getattr(sample, "points", sample), dtype=np.float64)
        normals = getattr(sample, "normals", None)
        return points, self._surface.normal(points) if normals is None else np.asarray(normals)

    def nearest(self, x: Array) -> tuple[Array, Array | None]:
        return self._surface.distance(x), self._surface.normal(x)

    def contains(self, x: Array) -> NDArray[np.bool_]:
        return self._surface.distance(x) < 0


class _MeshReference:
    """A mesh: distances to its faces, normals of its faces."""

    def __init__(self, mesh: Mesh):
        if len(mesh.faces) == 0:
            raise InvalidInput("reference: a mesh without faces")
        self._mesh = mesh
        self._queries = FaceQueries(mesh.vertices, mesh.faces)
        used = mesh.vertices[mesh.faces.ravel()]
        self.bounds = np.array([used.min(axis=0), used.max(axis=0)])
        self._frame = Frame(used)
        local = self._frame.into(mesh.vertices)
        vectors = area_vectors(local, mesh.faces)
        length = np.linalg.norm(vectors, axis=1, keepdims=True)
        self._normals = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
        shape = topology(mesh.faces)
        self.area: float | None = float(length.sum()) * self._frame.scale(2)
        self.closed = shape.closed and shape.oriented
        self.volume: float | None = enclosed_volume(mesh) if self.closed else None
        self.euler: int | None = shape.euler
        self.components: int | None = shape.components
        self.boundary_loops: int | None = shape.boundary_loops
        self.orientable = shape.orientable

    def sample(self, n: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
        points, face = area_samples(self._mesh.vertices, self._mesh.faces, n, rng)
        return points, self._normals[face]

    def nearest(self, x: Array) -> tuple[Array, Array | None]:
        distance, face, _ = self._queries.nearest(x)
        if self.closed:
            distance = np.where(self.contains(x), -distance, distance)
        return distance, self._normals[face]

    def contains(self, x: Array) -> NDArray[np.bool_]:
        return self._queries.winding(x) != 0


class _CloudReference:
    """Points alone: distances to the nearest one, which are no shorter than its distance from the next."""

    area: float | None = None
    volume: float | None = None
    euler: int | None = None
    components: int | None = None
    boundary_loops: int | None = None
    closed = False
    orientable = True

    def __init__(self, points: ArrayLike):
        self._points = as_points(points, 3, "reference")
        self.bounds = np.array([self._points.min(axis=0), self._points.max(axis=0)])
        self._frame = Frame(self._points)
        self._tree = cKDTree(self._frame.into(self._points))

    def sample(self, n: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
        if len(self._points) <= n:
            return self._points, None
        return self._points[np.sort(rng.choice(len(self._points), n, replace=False))], None

    def nearest(self, x: Array) -> tuple[Array, Array | None]:
        return self._frame.length(self._tree.query(self._frame.into(x))[0]), None

    def contains(self, x: Array) -> NDArray[np.bool_]:
        raise NotImplementedError("a cloud has no inside")


def enclosed_volume(mesh: Mesh) -> float:
    """Give the volume that the faces of a closed oriented mesh enclose, positive where they face outwards.

    Parameters
    ----------
    mesh : Mesh
        With a face or more.

    Returns
    -------
    float [L^3]
    """
    frame = Frame(mesh.vertices[mesh.faces.ravel()])
    a, b, c = (frame.into(mesh.vertices)[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0 * frame.scale(3)
