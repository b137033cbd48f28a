"""Points as lines of numbers: XYZ, ASC, PTS, PWN, TXT, CSV and the like."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content
from .columns import assemble, flatten, guess, has_axes
from .lines import Lines, count_of, is_number, shown

_COMMENTS = ("#", "//", "%", "!")
_FIXED: dict[str, dict[int, tuple[str, ...]]] = {  # what the extension says of the columns after x, y, z
    "xyzn": {6: ("nx", "ny", "nz")},
    "xyzrgb": {6: ("red", "green", "blue")},
    "xyzr": {4: ("radius",)},
    "pwn": {6: ("nx", "ny", "nz")},
}


def read(data: bytes, name: str, extension: str) -> Content:
    """Read points from text, one a line.

    Columns are parted by white space, commas, semicolons (then a decimal comma is understood) or tabs. Comment lines,
    one line of column names (commented or not) and a first line that holds the number of points may be there. Without
    names two columns are x y, three or more x y z and what `columns.guess` makes of the rest.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call the file.
    extension : str
        Of the file, lower case, without the dot; it may say what columns 4 to 6 are.

    Returns
    -------
    Content

    Raises
    ------
    InvalidInput
        No rows, another number of rows than the first line says, another number of columns in some line, words.
    """
    lines = Lines(data, name, _COMMENTS)
    line = lines.next("the first point")
    promised: int | None = None
    header: list[str] | None = None
    if line.isdecimal() and line.isascii():
        promised = int(line[:19])
        line = lines.next(f"the first of {count_of(promised, 'point')}")
        if len(_split(line)[0]) == 1 and is_number(line):
            raise lines.error(lines.used - 1, "one number where a point, x y z, was expected")
    words, delimiter = _split(line)
    if not any(_is_value(word, delimiter) for word in words):
        header = words
        line = lines.next("the first point, after the line of column names,")
        words, delimiter = _split(line)
    else:
        named = [part for part in map(_names, lines.remarks) if len(part) == len(words) and has_axes(part)]
        header = named[-1] if named else None
    if len(words) < 2:
        raise lines.error(lines.used - 1, f"expected at least two columns, x y or x y z, found {shown(line)}")
    if header is not None and len(header) != len(words):
        raise lines.error(
            lines.used - 1,
            f"{count_of(len(words), 'column')}, but the line above names {len(header)}: {shown(' '.join(header))}",
        )
    lines.put_back(line)
    first = lines.used
    table = lines.table(None, len(words), "points", delimiter, decimal_comma=delimiter == ";")
    if promised is not None and promised != len(table):
        raise InvalidInput(
            f"{name}: the first line promises {count_of(promised, 'point')} but {len(table):,} follow; "
            "is the file truncated, or the count wrong?"
        )
    points, attributes = _name_columns(table, header, name, extension)
    return Content(points, attributes, line_of=lambda row: lines.line_of(first + row))


def write(file: BinaryIO, points: NDArray[np.float64], attributes: dict[str, NDArray], delimiter: str) -> None:
    """Write one line a point, with every digit that float64 needs.

    Booleans are 0 and 1. The columns are named in a first line for CSV, in a comment where there are attributes, and else not at all.
    """
    columns = {axis: points[:, index] for index, axis in zip(range(points.shape[1]), "xyz")}
    columns |= {key: column * 1 if column.dtype == bool else column for key, column in flatten(attributes).items()}
    names = delimiter.join(columns)
    if delimiter == ",":
        file.write(f"{names}\n".encode())
    elif attributes:
        file.write(f"# {names}\n".encode())
    pattern = delimiter.join(["%r"] * len(columns)) + "\n"
    step = 1 << 16
    for begin in range(0, len(points), step):
        values = [column[begin : begin + step].tolist() for column in columns.values()]
        file.write("".join([pattern % row for row in zip(*values)]).encode())


def read_column(data: bytes, name: str) -> NDArray[np.float64]:
    """Read one number a line, such as a weight a point."""
    return Lines(data, name, _COMMENTS).table(None, 1, "numbers")[:, 0]


def _name_columns(
    table: NDArray[np.float64], header: list[str] | None, name: str, extension: str
) -> tuple[NDArray[np.float64], dict[str, NDArray]]:
    dimension = min(table.shape[1], 3)
    fixed = _FIXED.get(extension, {}).get(table.shape[1])
    if header is None and fixed is None:
        return np.ascontiguousarray(table[:, :dimension]), guess(table, dimension, extension == "pts")
    names = [word or f"column_{place}" for place, word in enumerate(header or ["x", "y", "z", *(fixed or ())], 1)]
    if not has_axes(names):
        names[:dimension] = "xyz"[:dimension]
    twice = sorted({word for word in names if names.count(word) > 1})
    if twice:
        raise InvalidInput(f"{name}: two columns are called {shown(twice[0])}")
    points, attributes = assemble(dict(zip(names, table.T)), name)
    return points, _whole_colors(attributes)


def _whole_colors(attributes: dict[str, NDArray]) -> dict[str, NDArray]:
    """Give colours that are whole numbers in 0 .. 255 as bytes."""
    colors = attributes.get("colors")
    if (
        colors is not None
        and ((colors >= 0) & (colors <= 255) & (colors == np.floor(colors))).all()
        and colors.max() > 1
    ):
        attributes["colors"] = colors.astype(np.uint8)
    return attributes


def _split(line: str) -> tuple[list[str], str | None]:
    """Split a line at what parts its columns: the words, and the delimiter (None is white space)."""
    delimiter = next((mark for mark in ";," if mark in line), None)
    if delimiter is None and "\t" in line.strip() and not all(is_number(word) for word in line.split()):
        delimiter = "\t"
    text = line.rstrip(f"{delimiter} \t") if delimiter else line
    return [word.strip() for word in text.split(delimiter)], delimiter


def _names(remark: str) -> list[str]:
    return _split(remark)[0] if remark else []


def _is_value(word: str, delimiter: str | None) -> bool:
    return is_number(word.replace(",", ".") if delimiter == ";" else word)
