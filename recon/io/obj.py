"""Wavefront OBJ: vertices with colours, normals where they belong to vertices, faces."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content, Polygons
from .files import write_rows
from .lines import Lines

Groups = tuple[tuple[NDArray[np.int64], NDArray[np.int64]], ...]
_SLASHED = re.compile(r"/\S*")
_NORMAL = re.compile(r"[^\s/]+/[^\s/]*/([^\s/]+)")


def read(data: bytes, name: str) -> Content:
    """Read the vertices and faces of an OBJ file; groups, materials and texture coordinates are not kept.

    Normals are kept where there is one a vertex and the faces, if any, give each vertex its own.

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
        No vertex, or a line of one of the three kinds that cannot be understood.
    """
    lines = Lines(re.sub(rb"\\\r?\n", b" ", data) if b"\\" in data else data, name)
    rows: dict[str, list[str]] = {"v": [], "vn": [], "f": []}
    at: dict[str, list[int]] = {"v": [], "vn": [], "f": []}
    before: list[tuple[int, int]] = []  # vertices and normals above each face
    for index, line in enumerate(lines.take(None, "lines")):
        word, _, rest = line.partition(" " if " " in line[:3] else "\t")
        if word in rows:
            rows[word].append(rest)
            at[word].append(index)
            if word == "f":
                before.append((len(rows["v"]), len(rows["vn"])))
    if not rows["v"]:
        raise InvalidInput(f"{name}: has no vertex, a line such as 'v 1 2 3'")
    table = lines.scattered(rows["v"], at["v"])
    if table.shape[1] < 3:
        raise lines.error(at["v"][0], f"expected x y z, found {table.shape[1]} numbers")
    attributes: dict[str, NDArray] = {}
    if table.shape[1] >= 6:
        attributes["colors"] = np.ascontiguousarray(table[:, -3:])
    above = np.array(before, np.int64).reshape(-1, 2)
    groups = _faces(lines, [_SLASHED.sub("", row) for row in rows["f"]], at["f"], above[:, 0])
    if len(rows["vn"]) == len(table) and _same_normals(lines, rows["f"], at["f"], above[:, 1], groups):
        attributes["normals"] = lines.scattered(rows["vn"], at["vn"], 3)
    xyz = np.ascontiguousarray(table[:, :3])
    return Content(xyz, attributes, Polygons(groups), lambda row: lines.line_of(at["v"][row]))


def write(
    file: BinaryIO, points: NDArray[np.float64], attributes: Mapping[str, NDArray], faces: NDArray[np.int32]
) -> None:
    """Write OBJ with every digit of float64; colours follow the coordinates, as 0 .. 1, and normals are ``vn``."""
    file.write(f"# {len(points)} vertices, {len(faces)} faces\n".encode())
    pattern, columns = "v %r %r %r", points
    if "colors" in attributes:
        colors = attributes["colors"][:, :3]
        scale = np.iinfo(colors.dtype).max if colors.dtype.kind in "iu" else 1
        columns = np.column_stack([points, colors / scale])
        pattern += " %.9g %.9g %.9g"
    write_rows(file, pattern + "\n", columns)
    corner = "%d"
    corners = faces.astype(np.int64) + 1
    if "normals" in attributes:
        write_rows(file, "vn %r %r %r\n", attributes["normals"].astype(np.float64))
        corner, corners = "%d//%d", np.repeat(corners, 2, axis=1)
    write_rows(file, f"f {corner} {corner} {corner}\n", corners)


def _faces(lines: Lines, rows: list[str], places: list[int], above: NDArray[np.int64]) -> Groups:
    """Group faces by their number of corners; a negative corner counts back from the last vertex above the face."""
    widths: dict[int, list[int]] = {}
    for face, row in enumerate(rows):
        widths.setdefault(len(row.split()), []).append(face)
    groups = []
    for _, members in sorted(widths.items()):
        chosen = np.asarray(members, np.int64)
        table = lines.scattered([rows[face] for face in members], [places[face] for face in members])
        wrong = ((table != np.floor(table)) | (table == 0) | (np.abs(table) > 2.0**53)).any(axis=1)
        if wrong.any():
            place = places[chosen[wrong][0]]
            raise lines.error(place, "a corner of a face must be a whole number, from 1 or negative")
        corners = table.astype(np.int64)
        groups.append((chosen, np.where(corners < 0, corners + above[chosen][:, None], corners - 1)))
    return tuple(groups)


def _same_normals(lines: Lines, rows: list[str], places: list[int], above: NDArray[np.int64], groups: Groups) -> bool:
    """Tell whether every corner v/t/n, if any has a normal, names the normal with the number of its vertex."""
    if not any("/" in row for row in rows):
        return True
    named = [_NORMAL.sub(r"\1", row) for row in rows]
    if any("/" in row for row in named):
        return False
    theirs = _faces(lines, named, places, above)
    return all(np.array_equal(a, b) for group, other in zip(groups, theirs) for a, b in zip(group, other))
