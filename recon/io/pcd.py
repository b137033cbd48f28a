"""PCD of the Point Cloud Library, version 0.6 and later: ascii, binary, binary_compressed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content
from .columns import assemble
from .lines import Lines, shown

_LZF_RATIO = 88  # a back reference of 3 bytes stands for 264 at most
_KINDS = {"F": "f", "I": "i", "U": "u"}
_KEYS = ("VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")


def read(data: bytes, name: str) -> Content:
    """Read the points of a PCD file with all their fields.

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
        A header that makes no sense, or less data than it promises.
    """
    header, offset, number = _header(data, name)
    names, types, repeats = _fields(header, name)
    count = _count(header, name)
    row = np.dtype([(f"f{i}", kind, (times,)) for i, (kind, times) in enumerate(zip(types, repeats))])
    encoding = header["DATA"][0].lower() if header["DATA"] else ""
    if encoding == "ascii":
        return _ascii(data[offset:], name, number + 1, count, names, types, repeats)
    if encoding == "binary":
        body = data[offset:]
    elif encoding == "binary_compressed":
        body = _unpacked(data, offset, count * row.itemsize, name)
    else:
        raise InvalidInput(f"{name}: DATA {shown(encoding)} is neither ascii, binary nor binary_compressed")
    if len(body) < count * row.itemsize:
        raise InvalidInput(
            f"{name}: promises {count} points of {row.itemsize} bytes but {len(body)} bytes follow the header; "
            "is the file truncated, or the count wrong?"
        )
    columns: dict[str, NDArray] = {}
    begin = 0
    table = np.frombuffer(body, row, count) if encoding == "binary" else None
    for index, (field, kind, times) in enumerate(zip(names, types, repeats)):
        if table is not None:
            values = table[f"f{index}"]
        else:  # one field after the other
            values = np.frombuffer(body, kind, count * times, begin).reshape(count, times)
            begin += values.nbytes
        _keep(columns, field, values.astype(kind.newbyteorder("=")))
    points, attributes = assemble(columns, name)
    return Content(points, attributes)


def _header(data: bytes, name: str) -> tuple[dict[str, list[str]], int, int]:
    """Parse the header: its entries, where the data begin, the number of lines."""
    entries: dict[str, list[str]] = {}
    offset = 0
    for number in range(1, 100):
        stop = data.find(b"\n", offset, offset + 100_000)
        if stop < 0:
            break
        line = data[offset:stop].decode("latin-1").strip()
        offset = stop + 1
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        key = words[0].upper()
        if key not in _KEYS:
            raise InvalidInput(f"{name}: line {number} of the PCD header makes no sense: {shown(line)}")
        entries["FIELDS" if key == "COLUMNS" else key] = words[1:]
        if key == "DATA":
            return entries, offset, number
    raise InvalidInput(f"{name}: the PCD header has no line DATA; is the file truncated?")


def _fields(header: dict[str, list[str]], name: str) -> tuple[list[str], list[np.dtype], list[int]]:
    names = header.get("FIELDS", [])
    sizes = header.get("SIZE", ["4"] * len(names))
    kinds = header.get("TYPE", ["F"] * len(names))
    counts = header.get("COUNT", ["1"] * len(names))
    if not names or not len(names) == len(sizes) == len(kinds) == len(counts):
        raise InvalidInput(f"{name}: FIELDS, SIZE, TYPE and COUNT of the PCD header do not go together")
    types = []
    for field, size, kind in zip(names, sizes, kinds):
        code = _KINDS.get(kind.upper(), "?") + size
        if code not in ("f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"):
            raise InvalidInput(f"{name}: field {shown(field)} has no type {shown(kind)} of size {shown(size)}")
        types.append(np.dtype("<" + code))
    for field, count in zip(names, counts):
        if not (count.isdecimal() and count.isascii() and 0 < len(count) < 7 and int(count) > 0):
            raise InvalidInput(f"{name}: field {shown(field)} has no count {shown(count)}")
    return names, types, [int(count) for count in counts]


def _count(header: dict[str, list[str]], name: str) -> int:
    numbers = {}
    for key in ("WIDTH", "HEIGHT", "POINTS"):
        if key in header:
            word = header[key][0] if header[key] else ""
            if not (word.isdecimal() and word.isascii() and len(word) < 19):
                raise InvalidInput(f"{name}: {key} {shown(word)} of the PCD header is no count")
            numbers[key] = int(word)
    area = numbers["WIDTH"] * numbers.get("HEIGHT", 1) if "WIDTH" in numbers else None
    count = numbers.get("POINTS", area)
    if count is None:
        raise InvalidInput(f"{name}: the PCD header has neither POINTS nor WIDTH")
    if area is not None and area != count:
        raise InvalidInput(f"{name}: POINTS is {count} but WIDTH times HEIGHT is {area}")
    return count


def _ascii(
    data: bytes, name: str, first_line: int, count: int, names: list[str], types: list[np.dtype], repeats: list[int]
) -> Content:
    lines = Lines(data, name, ("#",), first_line)
    table = lines.table(count, sum(repeats), "points")
    if lines.take(None, ""):
        raise InvalidInput(f"{name}: goes on after the last of {count} points; is the count in its header wrong?")
    columns: dict[str, NDArray] = {}
    begin = 0
    for field, kind, times in zip(names, types, repeats):
        values = table[:, begin : begin + times]
        begin += times
        if field in ("x", "y", "z"):
            columns[field] = values[:, 0]
            continue
        with np.errstate(invalid="ignore"):
            cast = values.astype(kind.newbyteorder("="))
        if kind.kind != "f" and (cast != values).any():
            wrong = values[cast != values][0]
            raise InvalidInput(f"{name}: field {shown(field)} is declared {kind.name} but holds {wrong:g}")
        _keep(columns, field, cast)
    points, attributes = assemble(columns, name)
    return Content(points, attributes, line_of=lines.line_of)


def _keep(columns: dict[str, NDArray], field: str, values: NDArray) -> None:
    """Add a field to the columns: padding left out, packed colours opened."""
    if field == "_" or field in columns:
        return
    if field in ("rgb", "rgba") and values.shape[1] == 1 and values.dtype.itemsize == 4:
        packed = np.ascontiguousarray(values[:, 0]).view(np.uint32)
        for channel, shift in (("red", 16), ("green", 8), ("blue", 0), ("alpha", 24))[: len(field)]:
            columns[channel] = (packed >> np.uint32(shift)).astype(np.uint8)
        return
    columns[field] = values[:, 0] if values.shape[1] == 1 else values


def _unpacked(data: bytes, offset: int, size: int, name: str) -> bytes:
    """Decompress the body; its two sizes are checked before memory is asked for."""
    packed_size = int.from_bytes(data[offset : offset + 4], "little")
    unpacked_size = int.from_bytes(data[offset + 4 : offset + 8], "little")
    packed = data[offset + 8 : offset + 8 + packed_size]
    if len(data) < offset + 8 or len(packed) < packed_size:
        raise InvalidInput(
            f"{name}: promises {packed_size} bytes of compressed data but has {len(packed)}; is the file truncated?"
        )
    if unpacked_size != size or unpacked_size > _LZF_RATIO * packed_size:
        raise InvalidInput(
            f"{name}: {packed_size} compressed bytes for {unpacked_size} do not fit points of {size} bytes"
        )
    from .lzf import decompress  # here, for it brings numba

    unpacked = decompress(packed, unpacked_size)
    if unpacked is None:
        raise InvalidInput(f"{name}: its compressed data are damaged")
    return unpacked
