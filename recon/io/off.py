"""OFF with its prefixes for normals (N), colours (C) and texture coordinates (ST); ascii."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content, Polygons
from .files import write_rows
from .lines import Lines, is_number, shown

_KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF\b", re.IGNORECASE)


def read(data: bytes, name: str) -> Content:
    """Read the vertices and faces of an OFF file; colours of faces are not kept.

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
        Binary or of another dimension, counts that do not fit, words that are no numbers.
    """
    lines = Lines(data, name)
    line = lines.next("the keyword OFF")
    keyword = _KEYWORD.match(line)
    prefix = ""
    if keyword:
        prefix = keyword.group(0).upper()[:-3]
        if keyword.group(4) or keyword.group(5):
            raise lines.error(lines.used - 1, f"{keyword.group(0)} has points of another dimension than 3")
        line = line[keyword.end() :].strip() or lines.next("the counts of vertices, faces and edges")
    elif not is_number(line.split()[0]):
        raise lines.error(lines.used - 1, f"expected the keyword OFF, found {shown(line)}")
    if line.upper().startswith("BINARY"):
        raise InvalidInput(f"{name}: binary OFF is not read; convert it to PLY")
    counts = line.split()
    if len(counts) < 2 or not all(word.isdecimal() and len(word) < 19 for word in counts):
        raise lines.error(lines.used - 1, f"expected the counts of vertices, faces and edges, found {shown(line)}")
    n, f = int(counts[0]), int(counts[1])
    start = lines.used
    table = lines.table(n, None, "vertices")
    if n and table.shape[1] < 3:
        raise lines.error(start, f"expected x y z, found {table.shape[1]} columns")
    table = table.reshape(n, -1) if n else np.zeros((0, 3))
    first = lines.used
    groups = _faces(lines, lines.take(f, "faces"), first)
    if lines.take(None, ""):
        raise InvalidInput(f"{name}: goes on after the last of {f} faces; are the counts in its header wrong?")
    return Content(
        np.ascontiguousarray(table[:, :3]),
        _attributes(table, prefix),
        Polygons(groups),
        lambda row: lines.line_of(start + row),
    )


def write(
    file: BinaryIO, points: NDArray[np.float64], attributes: Mapping[str, NDArray], faces: NDArray[np.int32]
) -> None:
    """Write OFF with every digit of float64; normals and byte colours by the prefixes N and C."""
    columns: list[NDArray] = [points]
    pattern, prefix = "%r %r %r", ""
    if "normals" in attributes:
        columns.append(attributes["normals"].astype(np.float64))
        pattern, prefix = pattern + " %r %r %r", "N"
    if "colors" in attributes:
        colors = attributes["colors"]
        columns.append(colors if colors.shape[1] == 4 else np.insert(colors, 3, 255, axis=1))
        pattern, prefix = pattern + " %d %d %d %d", "C" + prefix
    file.write(f"{prefix}OFF\n{len(points)} {len(faces)} 0\n".encode())
    write_rows(file, pattern + "\n", *columns)
    write_rows(file, "3 %d %d %d\n", faces)


def _faces(lines: Lines, rows: list[str], first: int) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], ...]:
    """Group faces by their number of corners; what follows the corners is a colour."""
    groups = []
    for places, table in lines.ragged(rows, first):
        for sides in np.unique(table[:, 0]):
            chosen = np.flatnonzero(table[:, 0] == sides)
            if not 0 <= sides < table.shape[1] or sides != int(sides):
                raise lines.error(
                    first + int(places[chosen[0]]), f"a face of {sides:g} corners has {table.shape[1] - 1} numbers"
                )
            corners = table[chosen, 1 : 1 + int(sides)]
            whole = (corners == np.floor(corners)).all(axis=1)
            if not whole.all():
                raise lines.error(first + int(places[chosen[~whole][0]]), "a corner of a face is no whole number")
            groups.append((places[chosen], _as_index(corners)))
    return tuple(groups)


def _as_index(corners: NDArray[np.float64]) -> NDArray[np.int64]:
    """Give whole numbers as integers; what is far out of range stays so without overflow."""
    return np.clip(corners, -(2.0**62), 2.0**62).astype(np.int64)


def _attributes(table: NDArray[np.float64], prefix: str) -> dict[str, NDArray]:
    """Name the columns after x y z: normals, colours, texture coordinates, in this order."""
    attributes: dict[str, NDArray] = {}
    column = 3
    if "N" in prefix and table.shape[1] >= 6:
        attributes["normals"] = np.ascontiguousarray(table[:, 3:6])
        column = 6
    texture = 2 if "ST" in prefix else 0
    width = min(table.shape[1] - column - texture, 4)
    if "C" in prefix and width >= 3:
        colors = table[:, column : column + width]
        whole = len(colors) and ((colors >= 0) & (colors <= 255) & (colors == np.floor(colors))).all()
        attributes["colors"] = colors.astype(np.uint8) if whole else np.ascontiguousarray(colors)
        column += width
    if texture and table.shape[1] - column >= 2:
        attributes["texture"] = np.ascontiguousarray(table[:, column : column + 2])
    return attributes
