"""STL, ascii and binary: triangles whose equal corners are made one vertex again."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content, Polygons
from .files import write_rows
from .lines import Lines

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(data: bytes, name: str) -> Content:
    """Read the triangles of an STL file.

    Corners with equal coordinates become one vertex, in the order of their first use.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call the file.

    Returns
    -------
    Content

    Raises
    ------
    InvalidInput
        Truncated, a wrong count of triangles, or text that is no STL.
    """
    if is_binary(data):
        corners = np.frombuffer(data, _RECORD, offset=_HEADER)["corners"].reshape(-1, 3).astype(np.float64)
    elif data.lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        corners = _ascii(data, name)
    elif len(data) >= _HEADER:
        count = int.from_bytes(data[80:84], "little")
        raise InvalidInput(
            f"{name}: promises {count} triangles, {_HEADER + 50 * count} bytes, but has {len(data)} bytes; "
            "is the file truncated, or no STL?"
        )
    else:
        raise InvalidInput(f"{name}: is too short for an STL file; is it truncated?")
    return _merged(corners)


def is_binary(data: bytes) -> bool:
    """Tell whether the size fits the count of triangles of a binary STL exactly."""
    return len(data) >= _HEADER and len(data) == _HEADER + 50 * int.from_bytes(data[80:84], "little")


def write(file: BinaryIO, points: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
    """Write STL: binary where float32 holds every coordinate exactly, else ascii with every digit of float64."""
    corners = points[faces]
    with np.errstate(over="ignore"):
        exact = bool((points.astype(np.float32) == points).all())
    normals = _normals(corners)
    if exact:
        block = np.zeros(len(faces), _RECORD)
        block["normal"], block["corners"] = normals, corners
        file.write(b"binary STL".ljust(80, b" ") + len(faces).to_bytes(4, "little") + block.tobytes())
        return
    vertices = np.array([f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in zip(*points.T.tolist())], object)
    file.write(b"solid recon\n")
    pattern = "facet normal %.6g %.6g %.6g\nouter loop\n%s%s%sendloop\nendfacet\n"
    write_rows(file, pattern, normals, vertices[faces])
    file.write(b"endsolid recon\n")


def _ascii(data: bytes, name: str) -> NDArray[np.float64]:
    if b"endsolid" not in data.lower():
        raise InvalidInput(f"{name}: has no line 'endsolid'; is the file truncated?")
    lines = Lines(data, name, ())
    rows, places = [], []
    for index, line in enumerate(lines.take(None, "lines")):
        if line[:6].lower() == "vertex":
            rows.append(line[6:])
            places.append(index)
    table = lines.scattered(rows, places, 3)
    if len(table) % 3:
        raise InvalidInput(f"{name}: {len(table)} corners are no whole number of triangles; is the file truncated?")
    return table


def _merged(corners: NDArray[np.float64]) -> Content:
    keys = np.ascontiguousarray(corners + 0.0).view(np.dtype((np.void, 24)))[:, 0]  # + 0.0: -0 and 0 are one
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    order = np.argsort(first)
    rank[order] = np.arange(len(first))
    faces = rank[inverse].reshape(-1, 3)
    return Content(corners[first[order]], {}, Polygons(((np.arange(len(faces)), faces),)))


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals of triangles, zero where the area is."""
    edges = corners[:, 1:] - corners[:, :1]
    scale = np.abs(edges).max(axis=(1, 2), keepdims=True, initial=0.0)
    edges = edges / np.where(scale > 0, scale, 1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1)
