"""LAS and LAZ of airborne and mobile lidar, through laspy (an extra)."""

from __future__ import annotations

import io
import struct

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput, require
from .cloud import Content
from .lines import one_line

_BLOCK = 1 << 20
_COLORS = ("red", "green", "blue")


def read(data: bytes, name: str) -> Content:
    """Read the points of a LAS or LAZ file with all their dimensions.

    Coordinates are the stored integers times the scale plus the offset, in double precision.

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
        Truncated or damaged.
    MissingDependency
        laspy is not installed.
    """
    _check_header(data, name)
    laspy = require("laspy", "las")
    parts: dict[str, list[NDArray]] = {}
    try:
        with laspy.open(io.BytesIO(data)) as reader:
            fields = [key for key in reader.header.point_format.dimension_names if key not in ("X", "Y", "Z")]
            for block in reader.chunk_iterator(_BLOCK):  # block by block: a lying count ends here, not in the allocator
                for key in ("x", "y", "z", *fields):
                    parts.setdefault(key, []).append(np.array(block[key]))
    except Exception as error:  # a damaged file makes laspy and its decompressor raise whatever comes
        raise InvalidInput(f"{name}: is no sound LAS or LAZ file ({one_line(error)})") from error
    if not parts:
        raise InvalidInput(f"{name}: holds no points")
    columns = {key: np.concatenate(blocks) for key, blocks in parts.items()}
    points = np.column_stack([columns.pop(axis).astype(np.float64) for axis in "xyz"])
    if all(key in columns for key in _COLORS):
        columns["colors"] = np.column_stack([columns.pop(key) for key in _COLORS])
    return Content(points, columns)


def _check_header(data: bytes, name: str) -> None:
    """See that the sizes in the header fit the file, before memory is asked for."""
    if data[:4] != b"LASF" or len(data) < 227:
        raise InvalidInput(f"{name}: has no LAS header; is the file truncated?")
    header_size, begin, records, kind, length, count = struct.unpack_from("<HIIBHI", data, 94)
    minor = data[25]
    if minor >= 4 and len(data) >= 375:
        (count,) = struct.unpack_from("<Q", data, 247)
    if not 227 <= header_size <= begin <= len(data) or records * 54 > begin - header_size:
        raise InvalidInput(f"{name}: the sizes in its LAS header do not fit a file of {len(data)} bytes")
    compressed = kind & 0xC0
    if not compressed and begin + count * length > len(data):
        raise InvalidInput(
            f"{name}: promises {count} points of {length} bytes but {len(data) - begin} bytes follow the header; "
            "is the file truncated?"
        )
    if compressed:
        _check_chunks(data, begin, name)


def _check_chunks(data: bytes, begin: int, name: str) -> None:
    """See that the table of compressed chunks lies in the file and is no longer than it can be."""
    here = int.from_bytes(data[begin : begin + 8], "little", signed=True)
    if here == -1:
        here = int.from_bytes(data[-8:], "little", signed=True)
    chunks = int.from_bytes(data[here + 4 : here + 8], "little")
    if not begin + 8 <= here <= len(data) - 8 or chunks > len(data):
        raise InvalidInput(f"{name}: its table of compressed chunks makes no sense; is the file truncated?")
