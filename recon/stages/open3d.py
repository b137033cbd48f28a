"""Weighted alpha shapes as a stage among Open3D's: its point clouds in, its triangle meshes out, legacy and tensor alike.

A tensor cloud keeps its device, the dtype of its positions, and all its attributes; a legacy cloud its colours and normals.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contracts import InvalidInput, ReconError, StageError, as_flag, as_number, as_points, require, shown
from ..mesh import Mesh
from .attributes import doubles, refuse_other, split_source, unit_colors


def create_from_point_cloud_weighted_alpha_shape(
    pcd: Any,
    weights: Literal["adaptive", "uniform"] | ArrayLike = "adaptive",
    *,
    alpha: float = 0.0,
    surface: Literal["auto", "closed", "open", "terrain", "complex"] = "auto",
    clean: bool = True,
    denoise: bool | None = None,
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Any:
    """Turn a point cloud into a triangle mesh; no normals and no parameter needed.

    Parameters
    ----------
    pcd : open3d.geometry.PointCloud or open3d.t.geometry.PointCloud
    weights, alpha, surface, clean, denoise, threads, progress
        As `recon.reconstruct` has them; alpha is a squared length.

    Returns
    -------
    open3d.geometry.TriangleMesh or open3d.t.geometry.TriangleMesh
        Of the kind that came in. A tensor mesh names the row of the cloud of each vertex in ``vertex["vertex_source"]``.

    Raises
    ------
    InvalidInput
        No point cloud, or what `recon.reconstruct` refuses.
    DegenerateInput
        The points carry no surface.
    MissingDependency
        Open3D is not installed.
    """
    from ..pipeline import reconstruct

    points, attributes = from_point_cloud(pcd)
    result = reconstruct(
        points,
        weights,
        alpha=alpha,
        surface=surface,
        attributes=attributes,
        clean=clean,
        denoise=denoise,
        threads=threads,
        progress=progress,
    )
    return _like(pcd, result.mesh)


def create_from_point_cloud_alpha_shape(pcd: Any, alpha: float, tetra_mesh: Any = None, pt_map: Any = None) -> Any:
    """Take the unweighted alpha shape, as Open3D's function of this name means to.

    Open3D keeps only facets of tetrahedra, so that a hollow shape vanishes: of 1,500 points on the unit sphere it
    gives nothing at alpha 0.5. This is the whole boundary of the alpha shape, singular facets too: 2,996 triangles.

    Parameters
    ----------
    pcd : open3d.geometry.PointCloud or open3d.t.geometry.PointCloud
    alpha : float [L]
        Radius of the ball, as in Open3D.
    tetra_mesh, pt_map : optional
        Taken so that calls need no change, and not looked at: the triangulation here is made from the points, exactly.

    Returns
    -------
    open3d.geometry.TriangleMesh or open3d.t.geometry.TriangleMesh
        Of the kind that came in, without unreferenced vertices. Regular facets face outward; singular ones agree with
        their neighbours. Empty where no ball of this radius exposes a triangle: a warning names the range that does.

    Raises
    ------
    InvalidInput
        No point cloud, malformed points, or a radius that is negative, NaN or no number.
    DegenerateInput
        All points on a line or in one spot.
    """
    from ..alpha import alpha_complex
    from ..exposed import exposed_faces
    from ..mesh import compact_mesh

    del tetra_mesh, pt_map
    radius = as_number(alpha, "alpha", "a non-negative radius")
    if not radius >= 0:
        raise InvalidInput(f"alpha: expected a non-negative radius, got {radius}")
    values, attributes = from_point_cloud(pcd)
    points = as_points(values, 3)
    complex_ = alpha_complex(points)
    facets = exposed_faces(complex_, radius * radius)  # infinite where it overflows: the convex hull
    if len(facets) == 0:
        least = float(np.sqrt(complex_.entry(2).min()))
        warnings.warn(f"no triangle at alpha = {radius:g}; the first one appears at {least:.4g}", stacklevel=2)
    return _like(pcd, compact_mesh(points, facets, attributes))


def show_alpha_shapes(pcd: Any, weights: Literal["adaptive"] | ArrayLike | None = None, *, steps: int = 200) -> None:
    """Open Open3D's viewer with a slider for alpha: see `recon.stages.open3d_slider.show_alpha_shapes`."""
    from .open3d_slider import show_alpha_shapes as show

    show(pcd, weights, steps=steps)


@dataclass(frozen=True, slots=True)
class WeightedAlphaShape:
    """The stage as a callable with its options fixed: ``WeightedAlphaShape(surface="open")(pcd)``.

    Attributes
    ----------
    weights, alpha, surface, clean, denoise, threads
        See `create_from_point_cloud_weighted_alpha_shape`.
    """

    weights: Any = "adaptive"
    alpha: float = 0.0
    surface: str = "auto"
    clean: bool = True
    denoise: bool | None = None
    threads: int | None = None

    def __call__(self, pcd: Any) -> Any:
        """Give the mesh of a point cloud."""
        options: dict[str, Any] = {name: getattr(self, name) for name in self.__slots__}
        return create_from_point_cloud_weighted_alpha_shape(pcd, **options)


class Step:
    """One of Open3D's own methods with its arguments fixed: ``Step("voxel_down_sample", voxel_size=0.01)``.

    Of a method that gives a geometry and something beside it (the outlier removals), the geometry goes on.
    """

    def __init__(self, method: str, *args: Any, **options: Any):
        if not isinstance(method, str):
            raise InvalidInput(f"method: expected the name of one of Open3D's, got {shown(method)}")
        self.method, self.args, self.options = method, args, options

    def __call__(self, geometry: Any) -> Any:
        """Call the method on a geometry."""
        function = getattr(geometry, self.method, None)
        if not callable(function):
            raise InvalidInput(f"{type(geometry).__module__}.{type(geometry).__name__} has no method {self.method!r}")
        result = function(*self.args, **self.options)
        return result[0] if isinstance(result, tuple) else result

    def __repr__(self) -> str:
        given = [shown(value) for value in self.args] + [f"{key}={shown(value)}" for key, value in self.options.items()]
        return f"Step({', '.join([repr(self.method), *given])})"


class Pipeline:
    """Callables one after the other, themselves one callable.

    Parameters
    ----------
    *steps : callable
        `Step`, `WeightedAlphaShape`, or any function of one geometry that returns the next.

    Examples
    --------
    >>> Pipeline(Step("voxel_down_sample", 0.01), WeightedAlphaShape(), Step("simplify_quadric_decimation", 5000))
    Pipeline(Step('voxel_down_sample', 0.01), WeightedAlphaShape(weights='adaptive', alpha=0.0, surface='auto', clean=True, denoise=None, threads=None), Step('simplify_quadric_decimation', 5000))
    """

    def __init__(self, *steps: Callable[[Any], Any]):
        for place, step in enumerate(steps):
            if not callable(step):
                raise InvalidInput(f"step {place}: expected a callable, got {shown(step)}")
        self.steps = steps

    def __call__(self, geometry: Any) -> Any:
        """Run all steps.

        Raises
        ------
        StageError
            A step of Open3D's failed; the message names it, the original error is chained. Our own errors come as they are.
        """
        for place, step in enumerate(self.steps):
            try:
                geometry = step(geometry)
            except ReconError:
                raise
            except Exception as error:
                raise StageError(f"step {place}, {step!r}: {_plain(error)}") from error
            if geometry is None:
                raise StageError(f"step {place}, {step!r}: gave nothing to go on with")
        return geometry

    def __repr__(self) -> str:
        return f"Pipeline({', '.join(map(repr, self.steps))})"


def from_point_cloud(pcd: Any) -> tuple[NDArray[np.float64], dict[str, NDArray]]:
    """Take points and attributes out of a point cloud.

    Parameters
    ----------
    pcd : open3d.geometry.PointCloud or open3d.t.geometry.PointCloud

    Returns
    -------
    points : (n, 3) ndarray of float64 [L]
    attributes : dict of str to (n, ...) ndarray
        In their own dtype; of a legacy cloud ``"colors"`` and ``"normals"``, where it has them.

    Raises
    ------
    InvalidInput
        No point cloud, or an attribute without a row for every point.
    """
    o3d = require("open3d", "open3d")
    if isinstance(pcd, o3d.geometry.PointCloud):
        held = {"colors": pcd.colors, "normals": pcd.normals}
        attributes = {name: np.array(values) for name, values in held.items() if len(values)}
        points = np.array(pcd.points)
    elif isinstance(pcd, o3d.t.geometry.PointCloud):
        attributes = {name: values.cpu().numpy().copy() for name, values in pcd.point.items()}
        if "positions" not in attributes:
            raise InvalidInput("pcd: an empty point cloud")
        points = attributes.pop("positions").astype(np.float64)
    else:
        kinds = "open3d.geometry or open3d.t.geometry"
        raise InvalidInput(f"pcd: expected a PointCloud of {kinds}, got {type(pcd).__name__}")
    for name, values in attributes.items():
        if values.shape[:1] != (len(points),):
            raise InvalidInput(f"attribute {name!r}: expected {len(points)} rows, got shape {values.shape}")
    return points, attributes


def to_open3d(mesh: Mesh, *, tensor: bool = False) -> Any:
    """Give a mesh to Open3D.

    Parameters
    ----------
    mesh : Mesh
    tensor : bool
        An ``open3d.t.geometry.TriangleMesh`` with all attributes and ``vertex_source``; else a legacy one, which can hold
        colours and normals and nothing more.

    Returns
    -------
    open3d.geometry.TriangleMesh or open3d.t.geometry.TriangleMesh
    """
    o3d = require("open3d", "open3d")
    refuse_other(mesh, Mesh, "recon.Mesh")
    if as_flag(tensor, "tensor"):
        return _tensor_mesh(o3d, mesh, o3d.core.float64, o3d.core.Device("CPU:0"))
    vector, corners = o3d.utility.Vector3dVector, o3d.utility.Vector3iVector
    legacy = o3d.geometry.TriangleMesh(vector(np.array(mesh.vertices)), corners(np.array(mesh.faces)))
    if "colors" in mesh.attributes:
        legacy.vertex_colors = vector(unit_colors(mesh.attributes["colors"], 3))
    if (normals := doubles(mesh, "normals", 3)) is not None:
        legacy.vertex_normals = vector(normals)
    return legacy


def from_open3d(mesh: Any) -> Mesh:
    """Take a mesh from Open3D.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh or open3d.t.geometry.TriangleMesh

    Returns
    -------
    Mesh
        With the attributes of the vertices.
    """
    o3d = require("open3d", "open3d")
    if isinstance(mesh, o3d.geometry.TriangleMesh):
        held = {"colors": mesh.vertex_colors, "normals": mesh.vertex_normals}
        attributes = {name: np.array(values) for name, values in held.items() if len(values)}
        return Mesh.from_arrays(np.array(mesh.vertices), np.array(mesh.triangles), None, attributes)
    if isinstance(mesh, o3d.t.geometry.TriangleMesh):
        attributes = {name: values.cpu().numpy() for name, values in mesh.vertex.items()}
        vertices = attributes.pop("positions", np.zeros((0, 3)))
        faces = mesh.triangle["indices"].cpu().numpy() if "indices" in mesh.triangle else np.zeros((0, 3), int)
        return Mesh.from_arrays(vertices, faces, split_source(attributes), attributes)
    raise InvalidInput(
        f"mesh: expected a TriangleMesh of open3d.geometry or open3d.t.geometry, got {type(mesh).__name__}"
    )


def _like(pcd: Any, mesh: Mesh) -> Any:
    """Give a mesh in the kind, dtype and device of a point cloud."""
    o3d = require("open3d", "open3d")
    if isinstance(pcd, o3d.geometry.PointCloud):
        return to_open3d(mesh)
    return _tensor_mesh(o3d, mesh, pcd.point["positions"].dtype, pcd.device)


def _tensor_mesh(o3d: Any, mesh: Mesh, dtype: Any, device: Any) -> Any:
    def tensor(values: NDArray) -> Any:
        return o3d.core.Tensor(np.array(values, order="C"), device=device)

    made = o3d.t.geometry.TriangleMesh(device)
    made.vertex["positions"] = tensor(mesh.vertices).to(dtype)
    made.triangle["indices"] = tensor(mesh.faces.astype(np.int64))
    for name, values in mesh.attributes.items():
        if values.dtype.kind not in "fiub":
            raise InvalidInput(f"attribute {name!r}: Open3D holds numbers, got {values.dtype}")
        made.vertex[name] = tensor(values)
    made.vertex["vertex_source"] = tensor(mesh.vertex_source[:, None])
    return made


def _plain(error: Exception) -> str:
    """Open3D's message in one line, without colour codes and the file it was compiled from."""
    import re

    text = " ".join(re.sub(r"\x1b\[[0-9;]*m", "", str(error)).split())
    found = re.match(r"\[Open3D Error\].*?\.cpp:\d+:\s*(.*)", text)
    return found[1] if found else f"{type(error).__name__}: {text.split(' Invoked with: ')[0]}"
