"""PLY: ascii and both binary byte orders, any properties, lists among them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content, Polygons
from .columns import assemble, flatten
from .lines import Lines, shown

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_NAMES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float", "f8": "double",
}  # fmt: skip
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
_FACE_LISTS = ("vertex_indices", "vertex_index")
_HEADER_LINES = 10_000

Lists = list[tuple[NDArray[np.int64], NDArray]]  # (rows, (m, k) values) for every length k


@dataclass(frozen=True, slots=True)
class _Property:
    name: str
    type: np.dtype
    length: np.dtype | None  # type of the count before a list; None for a single number


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


def read(data: bytes, name: str) -> Content:
    """Read the vertices of a PLY file with all their properties, and its faces.

    Coordinates of an ascii file are read in double precision whatever type the header declares.

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
        A header that makes no sense, or a body that has more or less than the header promises.
    """
    elements, order, offset, header_lines = _header(data, name)
    if not any(element.name == "vertex" for element in elements):
        raise InvalidInput(f"{name}: has no element called vertex")
    lines = Lines(data[offset:], name, (), header_lines + 1) if order == "=" else None
    columns: dict[str, NDArray] = {}
    first = 0
    polygons = Polygons(())
    for element in elements:
        if lines is not None:
            first = lines.used if element.name == "vertex" else first
            values = _ascii(lines, element)
        else:
            values, offset = _binary(data, offset, element, name)
        if element.name == "vertex":
            columns = {key: value for key, value in values.items() if isinstance(value, np.ndarray)}
            columns |= {key: value[0][1] for key, value in values.items() if _is_regular(value, element.count)}
        elif element.name == "face":
            found = next((values[key] for key in _FACE_LISTS if isinstance(values.get(key), list)), None)
            if found is not None:
                polygons = Polygons(tuple((rows, _indices(corners, name)) for rows, corners in found))
    left = len(lines.take(None, "")) if lines is not None else len(data[offset : offset + 4096].strip(b"\r\n\t \0\x1a"))
    if left:
        raise InvalidInput(f"{name}: goes on after the last {elements[-1].name}; are the counts in its header wrong?")
    points, attributes = assemble(columns, name)
    return Content(points, attributes, polygons, (lambda row: lines.line_of(first + row)) if lines else None)


def write(
    file: BinaryIO,
    points: NDArray[np.float64],
    attributes: Mapping[str, NDArray],
    faces: NDArray[np.int32] | None,
) -> None:
    """Write binary little-endian PLY: coordinates in double precision, every attribute by its own type.

    PLY has no 64-bit integers: they become 32-bit ones where they fit, else doubles. Booleans become uchar.
    """
    count, dimension = points.shape
    columns = {axis: points[:, index] for index, axis in zip(range(dimension), "xyz")}
    columns |= {key: _storable(value) for key, value in flatten(attributes).items()}
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [f"property {_NAMES[value.dtype.str[1:]]} {key}" for key, value in columns.items()]
    if faces is not None:
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    file.write("\n".join([*header, "end_header\n"]).encode())
    row = np.dtype([(f"f{index}", value.dtype.newbyteorder("<")) for index, value in enumerate(columns.values())])
    step = 1 << 18
    for begin in range(0, count, step):
        block = np.empty(min(step, count - begin), row)
        for field, value in zip(row.names or (), columns.values()):
            block[field] = value[begin : begin + step]
        file.write(block.tobytes())
    for begin in range(0, 0 if faces is None else len(faces), step):
        part = faces[begin : begin + step]  # type: ignore[index]
        block = np.empty(len(part), [("length", "u1"), ("corners", "<i4", 3)])
        block["length"], block["corners"] = 3, part
        file.write(block.tobytes())


def _header(data: bytes, name: str) -> tuple[list[_Element], str, int, int]:
    """Parse the header: the elements, the byte order, where the body begins, the number of lines."""
    end = b"\r\n" if data[3:5] == b"\r\n" else data[3:4]
    if data[:3] != b"ply" or end not in (b"\n", b"\r", b"\r\n"):
        raise InvalidInput(f"{name}: does not begin with the line 'ply'")
    elements: list[_Element] = []
    order = ""
    offset = 3 + len(end)
    for number in range(2, _HEADER_LINES):
        stop = data.find(end, offset, offset + 10_000)
        if stop < 0:
            break
        line = data[offset:stop].decode("utf-8", "replace")
        offset = stop + len(end)
        words = line.split()
        match words:
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", kind, _] if kind in _BYTE_ORDERS:
                order = _BYTE_ORDERS[kind]
            case ["element", label, count] if count.isdecimal() and count.isascii() and len(count) < 19:
                if any(element.name == label for element in elements):
                    raise InvalidInput(f"{name}: line {number}: a second element called {shown(label)}")
                elements.append(_Element(label, int(count), []))
            case ["property", "list", length, kind, label] if (
                elements and kind in _TYPES and _TYPES.get(length, "f")[0] != "f"
            ):
                _add(elements[-1], _Property(label, _type(kind, order), _type(length, order)), name, number)
            case ["property", kind, label] if elements and kind in _TYPES:
                _add(elements[-1], _Property(label, _type(kind, order), None), name, number)
            case ["end_header"] if order and elements:
                return elements, order, offset, number
            case _:
                raise InvalidInput(f"{name}: line {number} of the PLY header makes no sense: {shown(line)}")
    raise InvalidInput(f"{name}: the PLY header has no end; is the file truncated?")


def _type(kind: str, order: str) -> np.dtype:
    return np.dtype((order or "=") + _TYPES[kind])


def _add(element: _Element, found: _Property, name: str, number: int) -> None:
    if any(known.name == found.name for known in element.properties):
        raise InvalidInput(f"{name}: line {number}: a second property called {shown(found.name)}")
    element.properties.append(found)


def _ascii(lines: Lines, element: _Element) -> dict[str, NDArray | Lists]:
    """Read one element of an ascii file: a line a row."""
    first, what, properties = lines.used, f"rows of element {element.name}", element.properties
    if not any(item.length for item in properties):
        table = lines.table(element.count, len(properties), what)
        return {item.name: _declared(table[:, i], item, lines.name) for i, item in enumerate(properties)}
    rows = lines.take(element.count, what)
    values = _empty(element, len(rows))
    for places, table in lines.ragged(rows, first):
        while len(places):  # the rows whose lists are as long as those of the first row left, at once
            alike = np.ones(len(places), bool)
            column = 0
            parts: list[NDArray] = []
            for item in properties:
                width = 1
                if item.length and column < table.shape[1]:
                    alike &= table[:, column] == table[0, column]
                    width = table[0, column]
                    column += 1
                if not 0 <= width <= table.shape[1] - column or width != int(width):
                    raise lines.error(first + int(places[0]), f"too short for the list or number {shown(item.name)}")
                parts.append(table[:, column : column + int(width)])
                column += int(width)
            if column != table.shape[1]:
                raise lines.error(first + int(places[0]), f"{table.shape[1]} columns, expected {column}")
            for item, part in zip(properties, parts):
                _put(values[item.name], places[alike], _declared(part[alike], item, lines.name))
            places, table = places[~alike], table[~alike]
    return values


def _binary(data: bytes, offset: int, element: _Element, name: str) -> tuple[dict[str, NDArray | Lists], int]:
    """Read one element of a binary file: its values, and where the next one begins."""
    properties = element.properties
    has_lists = any(item.length for item in properties)
    short = InvalidInput(
        f"{name}: promises {element.count} rows of element {element.name} but ends before the last; "
        "is the file truncated, or the count wrong?"
    )
    lengths = _list_lengths(data, offset, properties, short) if has_lists and element.count else ()
    row = _row_type(properties, lengths)
    stop = offset + element.count * row.itemsize
    if not has_lists or (stop <= len(data) and element.count):
        if stop > len(data):
            raise short
        table = np.frombuffer(data, row, element.count, offset) if row.itemsize else np.zeros(0, row)
        if all((table[f"n{i}"] == length).all() for i, length in enumerate(lengths)):
            values = _empty(element, element.count if row.itemsize else 0)
            _put_rows(values, properties, np.arange(len(table)), table)
            return values, stop
    groups: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for index in range(element.count):
        lengths = _list_lengths(data, offset, properties, short)
        groups.setdefault(lengths, []).append((index, offset))
        offset += _row_size(properties, lengths)
        if offset > len(data):
            raise short
    values = _empty(element, element.count)
    raw = np.frombuffer(data, np.uint8)
    for lengths, members in groups.items():
        places, begins = np.array(members, np.int64).T
        row = _row_type(properties, lengths)
        table = raw[begins[:, None] + np.arange(row.itemsize)].view(row)[:, 0]
        _put_rows(values, properties, places, table)
    return values, offset


def _list_lengths(data: bytes, offset: int, properties: list[_Property], short: InvalidInput) -> tuple[int, ...]:
    """Give the length of every list of the row at `offset`."""
    lengths = []
    for item in properties:
        if item.length is None:
            offset += item.type.itemsize
            continue
        begin, offset = offset, offset + item.length.itemsize
        if offset > len(data):
            raise short
        length = int(np.frombuffer(data, item.length, 1, begin)[0])
        offset += length * item.type.itemsize
        if length < 0 or offset > len(data):
            raise short
        lengths.append(length)
    return tuple(lengths)


def _row_type(properties: list[_Property], lengths: tuple[int, ...]) -> np.dtype:
    """Give the layout of a row: fields v0, v1, … a property, n0, n1, … before a list."""
    fields: list[tuple] = []
    left = iter(enumerate(lengths))
    for index, item in enumerate(properties):
        if item.length is None:
            fields.append((f"v{index}", item.type))
        else:
            which, length = next(left, (0, 0))
            fields += [(f"n{which}", item.length), (f"v{index}", item.type, (length,))]
    return np.dtype(fields)


def _row_size(properties: list[_Property], lengths: tuple[int, ...]) -> int:
    left = iter(lengths)
    return sum(
        item.type.itemsize if item.length is None else item.length.itemsize + next(left) * item.type.itemsize
        for item in properties
    )


def _empty(element: _Element, count: int) -> dict[str, NDArray | Lists]:
    return {
        item.name: [] if item.length else np.zeros(count, item.type.newbyteorder("=")) for item in element.properties
    }


def _put_rows(
    values: dict[str, NDArray | Lists], properties: list[_Property], places: NDArray[np.int64], table: NDArray
) -> None:
    for index, item in enumerate(properties):
        part = table[f"v{index}"]
        _put(values[item.name], places, part.astype(item.type.newbyteorder("=")))


def _put(value: NDArray | Lists, places: NDArray[np.int64], part: NDArray) -> None:
    if isinstance(value, list):
        value.append((places, part))
    else:
        value[places] = part.reshape(len(places))


def _declared(values: NDArray[np.float64], item: _Property, name: str) -> NDArray:
    """Give ascii numbers the type that the header declares, where they have it; coordinates stay float64."""
    if item.type.kind == "f":
        return values if item.name in ("x", "y", "z") else values.astype(item.type)
    with np.errstate(invalid="ignore"):
        cast = values.astype(item.type)
    wrong = values[cast != values]
    if wrong.size:
        raise InvalidInput(
            f"{name}: property {shown(item.name)} is declared {item.type.name} but holds {wrong.flat[0]:g}"
        )
    return cast


def _is_regular(value: NDArray | Lists, count: int) -> bool:
    """Tell whether a list property has the same length in all rows, so that it is an attribute."""
    return isinstance(value, list) and len(value) == 1 and len(value[0][0]) == count


def _indices(corners: NDArray, name: str) -> NDArray[np.int64]:
    if corners.dtype.kind == "f":
        raise InvalidInput(f"{name}: the corners of its faces are not declared as integers")
    return corners.astype(np.int64)


def _storable(values: NDArray) -> NDArray:
    """Give values a type that PLY has."""
    kind = values.dtype.kind
    if values.dtype.str[1:] in _NAMES:
        return values
    if kind == "b":
        return values.astype(np.uint8)
    if values.dtype == np.float16:
        return values.astype(np.float32)
    if kind in "iu":
        for narrow in (np.int32, np.uint32):
            if not len(values) or (values.min() >= np.iinfo(narrow).min and values.max() <= np.iinfo(narrow).max):
                return values.astype(narrow)
    return values.astype(np.float64)
