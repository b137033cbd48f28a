"""Point clouds and meshes from files and into files, in double precision, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contracts import MAX_COORDINATE, InvalidInput, as_flag, as_points, as_whole, check_kind
from ..mesh import Mesh
from . import formats
from .cloud import Content, PointCloud
from .files import STREAM, check_writable, display_name, read_bytes, whole_file
from .lines import count_of

__all__ = [
    "PointCloud",
    "check_writable",
    "read",
    "read_mesh",
    "read_points",
    "read_weights",
    "write_mesh",
    "write_points",
]

Path = str | os.PathLike[str]


def read_points(path: Path, *, format: str | None = None, drop_invalid: bool = False) -> PointCloud:
    """Read the points of a file, with all else it says of them.

    Of a file with faces these are the vertices. Nothing is merged, sorted or rounded.

    Parameters
    ----------
    path : path, or ``"-"`` for standard input
    format : str, optional
        One of `formats.READERS`; by default the first bytes of the file tell, and else its extension.
    drop_invalid : bool
        Leave out rows with a coordinate that is NaN or infinite, instead of complaining.

    Returns
    -------
    PointCloud
        Can be passed on wherever an array of points is expected.

    Raises
    ------
    InvalidInput
        Missing, empty, truncated or otherwise malformed; the message names the file and the place.
    MissingDependency
        The format needs an extra.

    Examples
    --------
    >>> import tempfile, os
    >>> path = os.path.join(tempfile.mkdtemp(), "two.xyz")
    >>> with open(path, "w") as file:
    ...     _ = file.write("500000.123 4649776.25 1\\n0 0 0\\n")
    >>> read_points(path).points.tolist()[0]
    [500000.123, 4649776.25, 1.0]
    """
    name, drop_invalid = display_name(path), as_flag(drop_invalid, "drop_invalid")
    content = formats.read(read_bytes(path), name, _extension(path), format)
    return _checked(content, name, drop_invalid)


def read_mesh(path: Path, *, format: str | None = None) -> Mesh:
    """Read a triangle mesh; polygons with more corners are cut into fans.

    Parameters
    ----------
    path : path, or ``"-"`` for standard input
    format : str, optional
        As in `read_points`.

    Returns
    -------
    Mesh

    Raises
    ------
    InvalidInput
        As in `read_points`; no faces, a face of fewer than three corners, or one that names a vertex that is not there.
    """
    name = display_name(path)
    content = formats.read(read_bytes(path), name, _extension(path), format)
    if not _has_faces(content):
        raise InvalidInput(f"{name}: has no faces, a mesh was expected; recon reconstruct makes one from points")
    return _mesh(content, name)


def read(path: Path, *, format: str | None = None, drop_invalid: bool = False) -> Mesh | PointCloud:
    """Read a file as a mesh if it has faces, else as points; see `read_mesh` and `read_points`.

    Parameters
    ----------
    path : path, or ``"-"`` for standard input
    format : str, optional
    drop_invalid : bool
        For points only.

    Returns
    -------
    Mesh or PointCloud
    """
    name, drop_invalid = display_name(path), as_flag(drop_invalid, "drop_invalid")
    content = formats.read(read_bytes(path), name, _extension(path), format)
    return _mesh(content, name) if _has_faces(content) else _checked(content, name, drop_invalid)


def read_weights(path: Path, n: int) -> NDArray[np.float64]:
    """Read one weight [L^2] a point: a text file with one number a line, or an NPY file.

    Parameters
    ----------
    path : path
    n : int
        The number of points.

    Returns
    -------
    (n,) ndarray of float64

    Raises
    ------
    InvalidInput
        Malformed, or another number of weights.
    """
    name = display_name(path)
    n = as_whole(n, "n", 0)
    weights = formats.read_numbers(read_bytes(path), name)
    if len(weights) != n:
        raise InvalidInput(f"{name}: has {count_of(len(weights), 'weight')} for {count_of(n, 'point')}")
    return weights


def write_mesh(mesh: Mesh, path: Path, *, format: str | None = None) -> tuple[str, ...]:
    """Write a mesh; the file appears whole or not at all.

    PLY keeps everything: coordinates in double precision, each attribute in its own type, `vertex_source` where it is
    not 0 .. v-1. OBJ and OFF are text with every digit; they keep normals and colours. STL keeps the triangles alone,
    binary where float32 is exact and else as text. GLB can hold only float32: see `glb.write`.

    Parameters
    ----------
    mesh : Mesh
    path : path, or ``"-"`` for standard output
    format : {"ply", "obj", "off", "stl", "glb"}, optional
        By default the extension of the path.

    Returns
    -------
    tuple of str
        The attributes that the format cannot hold, which are not in the file.

    Raises
    ------
    InvalidInput
        Unknown format, or the file cannot be written.
    """
    check_kind(mesh, "mesh", Mesh, "a recon.Mesh")
    kind = formats.writer_for(path, format, formats.MESH_WRITERS)
    attributes = dict(mesh.attributes)
    if not np.array_equal(mesh.vertex_source, np.arange(len(mesh.vertices))):
        attributes["vertex_source"] = mesh.vertex_source
    kept = formats.kept(kind, attributes)
    with whole_file(path) as file:
        formats.write_mesh(file, kind, mesh.vertices, {key: attributes[key] for key in kept}, mesh.faces)
    return tuple(key for key in mesh.attributes if key not in kept)


def write_points(
    points: ArrayLike | PointCloud,
    path: Path,
    *,
    attributes: Mapping[str, ArrayLike] | None = None,
    format: str | None = None,
) -> tuple[str, ...]:
    """Write points with their attributes; the file appears whole or not at all.

    Parameters
    ----------
    points : (n, 2) or (n, 3) array_like of float [L], or PointCloud
    path : path, or ``"-"`` for standard output
    attributes : mapping of str to (n, ...) array_like, default: those of the PointCloud
    format : {"ply", "xyz", "csv", "npy", "npz"}, optional
        By default the extension of the path.

    Returns
    -------
    tuple of str
        The attributes that the format cannot hold, which are not in the file.

    Raises
    ------
    InvalidInput
        Unknown format, wrong shapes, or the file cannot be written.
    """
    kind = formats.writer_for(path, format, formats.POINT_WRITERS)
    array = as_points(points)
    if array.shape[1] not in (2, 3):
        raise InvalidInput(f"points: expected 2 or 3 columns, got {array.shape[1]}")
    if attributes is None and isinstance(points, PointCloud):
        attributes = points.attributes
    check_kind(attributes, "attributes", (Mapping, type(None)), "names and arrays in a dict")
    carried = {key: np.asarray(value) for key, value in (attributes or {}).items()}
    for key, value in carried.items():
        check_kind(key, "attributes", str, "text as name")
        if value.shape[:1] != (len(array),):
            raise InvalidInput(f"attribute {key!r}: expected {len(array)} rows, got shape {value.shape}")
    kept = formats.kept(kind, carried)
    with whole_file(path) as file:
        formats.write_points(file, kind, array, {key: carried[key] for key in kept})
    return tuple(key for key in carried if key not in kept)


def _has_faces(content: Content) -> bool:
    return content.polygons is not None and len(content.polygons) > 0


def _mesh(content: Content, name: str) -> Mesh:
    if content.points.shape[1] != 3:
        raise InvalidInput(f"{name}: a mesh needs vertices x y z, there is no z")
    cloud = _checked(content, name, False)
    faces = _triangles(content, name)
    attributes = dict(cloud.attributes)
    source = attributes.pop("vertex_source", None)
    if source is not None and source.shape != (len(cloud),):
        raise InvalidInput(f"{name}: vertex_source is not one number a vertex")
    return Mesh.from_arrays(cloud.points, faces, source, attributes)


def _extension(path: Path) -> str:
    text = os.fspath(path)
    return "" if text == STREAM else os.path.splitext(text)[1][1:].lower()


def _checked(content: Content, name: str, drop_invalid: bool) -> PointCloud:
    """Refuse or drop rows that are no points, and freeze the rest."""
    points, attributes = content.points, content.attributes
    rows = np.arange(len(points))
    if len(points) == 0:
        raise InvalidInput(f"{name}: holds no points")
    with np.errstate(invalid="ignore"):
        valid = (np.abs(points) <= MAX_COORDINATE).all(axis=1)
    dropped = len(points) - int(np.count_nonzero(valid))
    if dropped and not drop_invalid:
        row = int(np.argmin(valid))
        place = f"line {content.line_of(row)}" if content.line_of else f"point {row} (counted from 0)"
        values = " ".join(f"{value:g}" for value in points[row])
        raise InvalidInput(
            f"{name}: {place} is no point: {values} ({count_of(dropped, 'such row')} of {len(points):,}); "
            "--drop-invalid or drop_invalid=True leaves them out"
        )
    if dropped:
        if dropped == len(points):
            raise InvalidInput(f"{name}: none of its {count_of(dropped, 'point')} has finite coordinates")
        points, rows = points[valid], rows[valid]
        attributes = {key: value[valid] for key, value in attributes.items()}
    points = np.ascontiguousarray(points)
    for array in (points, rows, *attributes.values()):
        array.flags.writeable = False
    return PointCloud(points, attributes, rows, dropped)


def _triangles(content: Content, name: str) -> NDArray[np.int64]:
    """Cut polygons into triangles, in the order of the file."""
    n = len(content.points)
    parts, places = [], []
    for place, corners in content.polygons.groups if content.polygons else ():
        wrong = np.flatnonzero(((corners < 0) | (corners >= n)).any(axis=1))
        if corners.shape[1] < 3 and len(corners):
            raise InvalidInput(
                f"{name}: face {place[0]} (counted from 0) has only {count_of(corners.shape[1], 'corner')}"
            )
        if len(wrong):
            raise InvalidInput(
                f"{name}: face {place[wrong[0]]} (counted from 0) names a vertex that is not there: "
                f"{corners[wrong[0]].tolist()} of {n:,}"
            )
        for second in range(1, corners.shape[1] - 1):
            parts.append(corners[:, [0, second, second + 1]])
            places.append(place)
    order = np.argsort(np.concatenate(places), kind="stable")
    return np.concatenate(parts)[order]
