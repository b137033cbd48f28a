"""NumPy files: NPY and NPZ, never pickles."""

from __future__ import annotations

import io
import warnings
import zipfile
import zlib
from tokenize import TokenError
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content
from .columns import assemble, guess
from .lines import one_line

_POINTS = ("points", "xyz", "vertices", "positions", "coords", "arr_0")
_MAX_DEFLATE = 1040  # deflate expands no more than this


def read_npy(data: bytes, name: str) -> Content:
    """Read an (n, k) array of points, or a structured array with fields x, y and z."""
    return _content(parse_npy(data, name), name)


def read_npz(data: bytes, name: str) -> Content:
    """Read points, and the other arrays of as many rows as attributes.

    The points are the array called ``points``, ``xyz``, ``vertices``, ``positions``, ``coords`` or ``arr_0``, or the
    only one there is.
    """
    arrays = _members(data, name)
    found = next((key for key in _POINTS if key in arrays), next(iter(arrays)) if len(arrays) == 1 else None)
    if found is None:
        raise InvalidInput(
            f"{name}: which array has the points? call it 'points'; there are {', '.join(map(repr, arrays))}"
        )
    content = _content(arrays.pop(found), f"{name}: array {found!r}")
    n = len(content.points)
    others = {key: value for key, value in arrays.items() if value.shape[:1] == (n,) and value.dtype.kind != "V"}
    return Content(content.points, content.attributes | others)


def write_npy(file: BinaryIO, points: NDArray[np.float64]) -> None:
    """Write the coordinates alone."""
    np.lib.format.write_array(file, np.ascontiguousarray(points), allow_pickle=False)


def write_npz(file: BinaryIO, points: NDArray[np.float64], attributes: dict[str, NDArray]) -> None:
    """Write the array ``points`` and one array an attribute."""
    with zipfile.ZipFile(file, "w") as archive:
        for key, value in {**attributes, "points": points}.items():
            with archive.open(f"{key}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.ascontiguousarray(value), allow_pickle=False)


def parse_npy(data: bytes, name: str) -> NDArray:
    """Parse the bytes of an NPY file; no more memory than they have is ever asked for."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        parse = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's advice on files written by Python 2
            shape, by_columns, kind = parse(stream)
    except (ValueError, TypeError, SyntaxError, KeyError, RecursionError, MemoryError, TokenError) as error:
        raise InvalidInput(f"{name}: has no NPY header ({type(error).__name__})") from error
    if kind.hasobject:
        raise InvalidInput(f"{name}: holds Python objects, numbers were expected")
    count = 1
    for length in shape:
        count *= length
    body = data[stream.tell() :]
    if any(length < 0 for length in shape) or len(body) < count * kind.itemsize or kind.itemsize == 0:
        raise InvalidInput(
            f"{name}: promises an array {shape} of {kind} but has {len(body)} bytes; is the file truncated?"
        )
    if len(shape) > 32:
        raise InvalidInput(f"{name}: an array of {len(shape)} dimensions is no list of points")
    array = np.frombuffer(body, kind, count)
    return array.reshape(shape, order="F" if by_columns else "C")


def _members(data: bytes, name: str) -> dict[str, NDArray]:
    arrays: dict[str, NDArray] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist():
                if not entry.filename.endswith(".npy"):
                    continue
                if entry.file_size > _MAX_DEFLATE * min(entry.compress_size, len(data)) + 1000:
                    raise InvalidInput(f"{name}: the sizes of {entry.filename!r} make no sense")
                with archive.open(entry) as member:
                    content = member.read(entry.file_size + 1)
                arrays[entry.filename[:-4]] = parse_npy(content, f"{name}: {entry.filename}")
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name}: is no sound NPZ file ({one_line(error)})") from error
    if not arrays:
        raise InvalidInput(f"{name}: has no arrays in it")
    return arrays


def _content(array: NDArray, name: str) -> Content:
    if array.dtype.names:
        if array.ndim != 1:
            raise InvalidInput(f"{name}: expected a one-dimensional structured array, got shape {array.shape}")
        points, attributes = assemble({field: np.ascontiguousarray(array[field]) for field in array.dtype.names}, name)
        return Content(points, attributes)
    if array.ndim != 2 or array.shape[1] < 2 or array.dtype.kind not in "fiub":
        raise InvalidInput(
            f"{name}: expected numbers of shape (n, 2), (n, 3) or more columns, got {array.dtype} {array.shape}"
        )
    table = array.astype(np.float64)
    dimension = min(table.shape[1], 3)
    attributes = guess(table, dimension, False)
    return Content(
        np.ascontiguousarray(table[:, :dimension]), {k: np.ascontiguousarray(v) for k, v in attributes.items()}
    )
