"""Which module reads and writes which format, and how a format is recognised."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput, shown
from . import arrays, glb, las, molecules, obj, off, pcd, ply, stl, text
from .cloud import Content
from .files import STREAM, as_path, check_writable, display_name

_TEXT = ("xyz", "asc", "pts", "pwn", "txt", "csv", "tsv", "xyzn", "xyzrgb", "xyzr")
_READ_BY_EXTENSION = {
    **dict.fromkeys(_TEXT, "text"),
    **{kind: kind for kind in ("ply", "off", "obj", "stl", "glb", "pcd", "npy", "npz", "las", "pdb")},
    **dict.fromkeys(("coff", "noff", "cnoff", "stoff"), "off"),
    "laz": "las",
    "ent": "pdb",
}
READERS = (*_TEXT, "ply", "off", "obj", "stl", "glb", "pcd", "npy", "npz", "las", "laz", "pdb", "ent")
MESH_WRITERS = {"ply": "ply", "obj": "obj", "off": "off", "stl": "stl", "glb": "glb"}
POINT_WRITERS = {
    "ply": "ply", "xyz": "xyz", "txt": "xyz", "asc": "xyz", "csv": "csv", "npy": "npy", "npz": "npz",
}  # fmt: skip
_MAGIC = (
    (b"ply\n", "ply"),
    (b"ply\r", "ply"),
    (b"# .PCD", "pcd"),
    (b"\x93NUMPY", "npy"),
    (b"PK\x03\x04", "npz"),
    (b"LASF", "las"),
    (b"glTF", "glb"),
)
_FOREIGN = {
    b"\x1f\x8b": "compressed with gzip: unpack it first",
    b"BZh": "compressed with bzip2: unpack it first",
    b"\xfd7zXZ": "compressed with xz: unpack it first",
    b"\x28\xb5\x2f\xfd": "compressed with zstd: unpack it first",
    b"ASTM-E57": "an E57 file: convert it to LAS, PLY or PCD",
    b"%PDF": "a PDF document",
    b"\x89PNG": "a picture",
    b"\xff\xd8\xff": "a picture",
    b"\x89HDF": "an HDF5 file: convert it to PLY or NPY",
}
_KEPT = {"obj": ("normals", "colors"), "off": ("normals", "colors"), "stl": (), "glb": ("normals", "colors"), "npy": ()}


def read(data: bytes, name: str, extension: str, format: str | None) -> Content:
    """Read a file by the format that is asked for, else by its first bytes, else by its extension.

    Raises
    ------
    InvalidInput
        Unknown, or malformed.
    """
    if format is not None:
        if not isinstance(format, str) or format not in READERS:
            raise InvalidInput(f"format: {shown(format)} is no format that can be read; there are {', '.join(READERS)}")
        kind, extension = _READ_BY_EXTENSION[format], format
    else:
        kind = recognise(data, name, extension)
    match kind:
        case "text":
            return text.read(data, name, extension)
        case "npy":
            return arrays.read_npy(data, name)
        case "npz":
            return arrays.read_npz(data, name)
    module = {"ply": ply, "off": off, "obj": obj, "stl": stl, "glb": glb, "pcd": pcd, "las": las, "pdb": molecules}[
        kind
    ]
    return module.read(data, name)


def read_numbers(data: bytes, name: str) -> NDArray[np.float64]:
    """Read a list of numbers, one a line or as an NPY file."""
    if not data.startswith(b"\x93NUMPY"):
        return text.read_column(data, name)
    array = arrays.parse_npy(data, name)
    if array.ndim != 1 or array.dtype.kind not in "fiub":
        raise InvalidInput(f"{name}: expected a list of numbers, got {array.dtype} {array.shape}")
    return array.astype(np.float64)


def writer_for(path: str | os.PathLike[str], format: str | None, writers: Mapping[str, str]) -> str:
    """Give the format to write, once it is sure that the file can be written.

    Raises
    ------
    InvalidInput
        Unknown format or extension; see also `files.check_writable`.
    """
    name = as_path(path)
    known = ", ".join(writers)
    if format is not None:
        if not isinstance(format, str) or format not in writers:
            raise InvalidInput(f"format: {shown(format)} is no format that can be written here; there are {known}")
    elif name == STREAM:
        format = "ply"
    else:
        format = os.path.splitext(name)[1][1:].lower()
        if format not in writers:
            name = display_name(path)
            said = f"extension {os.path.splitext(name)[1].lower()} is unknown" if format else "no extension"
            raise InvalidInput(f"{name}: {said}, so the format is too; use one of {known}")
    check_writable(path)
    return writers[format]


def kept(kind: str, attributes: Mapping[str, NDArray]) -> list[str]:
    """Give the attributes that a format can hold: all that are numbers, NPZ words too, others by their names."""
    if kind not in _KEPT:
        return [
            key for key, value in attributes.items() if value.dtype.kind in ("fiubcUSmM" if kind == "npz" else "fiub")
        ]
    return [key for key in _KEPT[kind] if key in attributes and _is_drawable(key, attributes[key], kind)]


def write_mesh(
    file: BinaryIO, kind: str, points: NDArray[np.float64], attributes: dict[str, NDArray], faces: NDArray[np.int32]
) -> None:
    """Write a mesh in one of `MESH_WRITERS`."""
    match kind:
        case "ply":
            ply.write(file, points, attributes, faces)
        case "obj":
            obj.write(file, points, attributes, faces)
        case "off":
            off.write(file, points, attributes, faces)
        case "stl":
            stl.write(file, points, faces)
        case "glb":
            glb.write(file, points, attributes, faces)


def write_points(file: BinaryIO, kind: str, points: NDArray[np.float64], attributes: dict[str, NDArray]) -> None:
    """Write points in one of `POINT_WRITERS`."""
    match kind:
        case "ply":
            ply.write(file, points, attributes, None)
        case "xyz":
            text.write(file, points, attributes, " ")
        case "csv":
            text.write(file, points, attributes, ",")
        case "npy":
            arrays.write_npy(file, points)
        case "npz":
            arrays.write_npz(file, points, attributes)


def recognise(data: bytes, name: str, extension: str) -> str:
    """Tell the format of a file by its first bytes, else by its extension, else by what its first lines look like."""
    for magic, kind in _MAGIC:
        if data.startswith(magic):
            return kind
    for magic, what in _FOREIGN.items():
        if data.startswith(magic):
            raise InvalidInput(f"{name}: is {what}")
    if extension in _READ_BY_EXTENSION:
        return _READ_BY_EXTENSION[extension]
    head = data[:4096].lstrip()
    first = head.split(None, 1)[0].upper() if head else b""
    if first in (b"OFF", b"COFF", b"NOFF", b"CNOFF", b"STOFF"):
        return "off"
    if stl.is_binary(data) or (first == b"SOLID" and b"facet" in head.lower()):
        return "stl"
    if any(line[:2] in (b"v ", b"v\t") for line in head.splitlines()[:50]):
        return "obj"
    if b"\0" not in head or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "text"
    raise InvalidInput(f"{name}: its format is not known; name it (--from), one of {', '.join(READERS)}")


def _is_drawable(key: str, value: NDArray, kind: str) -> bool:
    """Tell whether an attribute really is what its name says, in a type that the format has."""
    if key == "normals":
        return value.ndim == 2 and value.shape[1] == 3 and value.dtype.kind == "f"
    widths_ok = value.ndim == 2 and value.shape[1] in (3, 4)
    return widths_ok and (value.dtype == np.uint8 or (kind == "obj" and value.dtype.kind in "fu"))
