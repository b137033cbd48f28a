"""Named columns of a file <-> coordinates and attributes: one table of names for every format."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput

_AXES = {
    "x": ("x", "easting", "points:0"),
    "y": ("y", "northing", "points:1"),
    "z": ("z", "elevation", "height", "altitude", "points:2"),
}
_NORMALS = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"), ("normalx", "normaly", "normalz"))
_COLORS = (
    ("red", "green", "blue", "alpha"),
    ("r", "g", "b", "a"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
)
_UNIT = re.compile(r"\s*[\[(].*[\])]$")  # "X [m]", "X(m)"


def assemble(columns: Mapping[str, NDArray], name: str) -> tuple[NDArray[np.float64], dict[str, NDArray]]:
    """Gather x, y, z into points, normals and colours into one attribute each, ``a_0 a_1 …`` into ``a``.

    Parameters
    ----------
    columns : mapping of str to (n,) or (n, k) ndarray
        In the order of the file.
    name : str
        What messages call the file.

    Returns
    -------
    points : (n, 2) or (n, 3) ndarray of float64 [L]
    attributes : dict of str to (n, ...) ndarray

    Raises
    ------
    InvalidInput
        No x or no y among the columns, or they are not numbers.
    """
    left = dict(columns)
    names = {_plain(key): key for key in reversed(list(columns))}  # the first of two alike wins
    axes = _axes(names)
    if axes is None:
        raise InvalidInput(f"{name}: no columns named x and y among {', '.join(map(repr, columns)) or 'none at all'}")
    for axis in axes:
        if left[axis].dtype.kind not in "fiub" or left[axis].ndim != 1:
            raise InvalidInput(f"{name}: column {axis!r} is not one number a point")
    points = np.column_stack([left.pop(axis).astype(np.float64) for axis in axes])
    attributes: dict[str, NDArray] = {}
    for target, choices in (("normals", _NORMALS), ("colors", _COLORS)):
        for choice in choices:
            if all(names.get(part) in left for part in choice[:3]):
                parts = [names[part] for part in choice if names.get(part) in left]
                attributes[target] = np.column_stack([left.pop(part) for part in parts])
                break
    attributes.update(_regroup(left))
    return points, attributes


def has_axes(names: Iterable[str]) -> bool:
    """Tell whether some of the column names are those of coordinates."""
    return _axes({_plain(name): name for name in names}) is not None


def flatten(attributes: Mapping[str, NDArray], taken: tuple[str, ...] = ("x", "y", "z")) -> dict[str, NDArray]:
    """Spread attributes over named one-dimensional columns, so that `assemble` finds them again.

    Parameters
    ----------
    attributes : mapping of str to (n, ...) ndarray
    taken : tuple of str
        Names that are in use already.

    Returns
    -------
    dict of str to (n,) ndarray

    Raises
    ------
    InvalidInput
        An attribute that is not numeric.
    """
    columns: dict[str, NDArray] = {}
    for key, value in attributes.items():
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise InvalidInput(f"attribute {key!r}: numbers can be written, {array.dtype} cannot")
        parts = array.reshape(len(array), int(np.prod(array.shape[1:], dtype=np.int64)))
        stem = re.sub(r"\s+", "_", key.strip()) or "attribute"
        width = parts.shape[1]
        if key == "normals" and width == 3:
            names = list(_NORMALS[0])
        elif key == "colors" and width in (3, 4):
            names = list(_COLORS[0][:width])
        elif width == 1:
            names = [stem]
        else:
            names = [f"{stem}_{index}" for index in range(width)]
        for column, part in zip(names, parts.T):
            unique, again = column, 2
            while unique in columns or unique in taken:
                unique, again = f"{column}_again{again}", again + 1
            columns[unique] = part
    return columns


def guess(table: NDArray[np.float64], first: int, intensity_first: bool) -> dict[str, NDArray]:
    """Name the columns after the coordinates of a text file that names none.

    Three columns in a row that are unit vectors are normals, three that are whole numbers in 0 .. 255 are colours, the
    rest is called by its place: ``column_4`` is the fourth column of the file.

    Parameters
    ----------
    table : (n, k) ndarray of float64
    first : int
        Where the coordinates end.
    intensity_first : bool
        Whether the fourth of seven columns is an intensity (files of laser scanners, .pts).

    Returns
    -------
    dict of str to (n,) or (n, 3) ndarray
    """
    found: dict[str, NDArray] = {}
    column = first
    while column < table.shape[1]:
        triple = table[:, column : column + 3]
        if intensity_first and column == 3 and table.shape[1] in (4, 7):
            found["intensity"] = table[:, 3]
            column += 1
        elif "normals" not in found and triple.shape[1] == 3 and _are_normals(triple):
            found["normals"] = triple
            column += 3
        elif "colors" not in found and triple.shape[1] == 3 and _are_colors(triple):
            found["colors"] = triple.astype(np.uint8)
            column += 3
        else:
            found[f"column_{column + 1}"] = table[:, column]
            column += 1
    return found


def _axes(names: Mapping[str, str]) -> list[str] | None:
    """Find the columns of x, y and, where there is one, z."""
    found = [next((names[alias] for alias in aliases if alias in names), None) for aliases in _AXES.values()]
    if found[0] is None or found[1] is None:
        return None
    return [axis for axis in found if axis is not None]


def _plain(name: str) -> str:
    return _UNIT.sub("", name.strip().strip("\"'")).strip().lower()


def _are_normals(triple: NDArray[np.float64]) -> bool:
    """Unit length to 1 %, as printed with few digits; a missing normal may be zero."""
    square = (triple**2).sum(axis=1)
    unit = np.abs(square - 1.0) < 0.02
    return bool(unit.any() and (unit | (square == 0.0)).all())


def _are_colors(triple: NDArray[np.float64]) -> bool:
    return bool(len(triple) and ((triple >= 0) & (triple <= 255) & (triple == np.floor(triple))).all())


def _regroup(columns: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """Join ``a_0, a_1, …`` of one type into ``a``."""
    result: dict[str, NDArray] = {}
    joined: set[str] = set()
    for key, column in columns.items():
        if key in joined:
            continue
        stem = key[:-2]
        if key.endswith("_0") and stem and stem not in columns and f"{stem}_1" in columns:
            parts = [key]
            while f"{stem}_{len(parts)}" in columns:
                parts.append(f"{stem}_{len(parts)}")
            arrays = [columns[part] for part in parts]
            if all(array.ndim == 1 and array.dtype == column.dtype for array in arrays):
                result[stem] = np.column_stack(arrays)
                joined.update(parts)
                continue
        result[key] = column
    return result
