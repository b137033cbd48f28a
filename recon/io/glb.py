"""GLB, the binary form of glTF 2.0: all its meshes as one, each where its nodes put it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content, Polygons

_FLOAT, _UBYTE, _UINT = 5126, 5121, 5125
_VERTICES, _INDICES = 34962, 34963
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6
_HARMLESS = ("KHR_materials", "KHR_texture", "EXT_texture", "KHR_lights", "KHR_mesh_quantization")  # no other geometry


def read(data: bytes, name: str) -> Content:
    """Read all points and triangles of the scene, in double precision, moved as their nodes say.

    Of attributes those are kept that every part has: normals, the first colours, and those of an application, whose
    names begin with ``_``, without it. Materials, textures, skins and animations are not.

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
        Malformed, of another version, compressed (Draco, meshopt), or with its numbers in another file.
    """
    document, body = _chunks(data, name)
    try:
        needed = [word for word in document.get("extensionsRequired", []) if not str(word).startswith(_HARMLESS)]
        if needed:
            raise InvalidInput(f"{name}: needs the glTF extension {needed[0]!r}, not understood here: export without")
        with np.errstate(all="ignore"):  # what is not finite is refused later, by its place
            placed = list(_placed(document, name))
            parts = [part for matrix, mesh in placed for part in _parts(document, body, mesh, matrix, name)]
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name}: its JSON is no glTF 2.0 ({type(error).__name__}: {error})") from error
    if not parts:
        raise InvalidInput(f"{name}: holds no points and no triangles")
    starts = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    faces = np.concatenate([corners + start for start, (_, corners, _) in zip(starts, parts)])
    kinds = [{key: (value.shape[1:], value.dtype) for key, value in attributes.items()} for _, _, attributes in parts]
    shared = [key for key, kind in kinds[0].items() if all(other.get(key) == kind for other in kinds)]
    return Content(
        np.concatenate([points for points, _, _ in parts]),
        {key: np.concatenate([attributes[key] for _, _, attributes in parts]) for key in shared},
        Polygons(((np.arange(len(faces)), faces),) if len(faces) else ()),
    )


def write(
    file: BinaryIO, points: NDArray[np.float64], attributes: Mapping[str, NDArray], faces: NDArray[np.int32]
) -> None:
    """Write one mesh in one node.

    glTF knows float32 only. So that large coordinates survive as well as they can, positions are stored from the middle
    of the mesh and the middle, in double precision, is the translation of the node: the error is below 1e-7 of the size
    of the mesh, not of its coordinates. Colours of bytes and normals are kept.

    Parameters
    ----------
    file : binary file
    points : (v, 3) ndarray of float64 [L]
    attributes : mapping of str to (v, ...) ndarray
    faces : (f, 3) ndarray of int32
    """
    middle = (points.min(axis=0) / 2 + points.max(axis=0) / 2) if len(points) else np.zeros(3)
    positions = (points - middle).astype("<f4")
    buffers: list[bytes] = []
    accessors: list[dict] = []
    views: list[dict] = []

    def add(array: NDArray, component: int, kind: str, target: int, **more: object) -> int:
        body = array.tobytes()
        views.append({"buffer": 0, "byteOffset": sum(map(len, buffers)), "byteLength": len(body), "target": target})
        buffers.append(body + b"\0" * (-len(body) % 4))
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind, **more}
        )
        return len(accessors) - 1

    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()} if len(points) else {}
    primitive: dict = {"attributes": {}, "mode": 4}
    if len(points) and len(faces):
        primitive["attributes"]["POSITION"] = add(positions, _FLOAT, "VEC3", _VERTICES, **bounds)
        if "normals" in attributes:
            normals = attributes["normals"].astype(np.float64)
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            unit = np.where(length > 0, normals / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
            primitive["attributes"]["NORMAL"] = add(unit.astype("<f4"), _FLOAT, "VEC3", _VERTICES)
        if "colors" in attributes:
            colors = attributes["colors"]
            rgba = colors if colors.shape[1] == 4 else np.insert(colors, 3, 255, axis=1)
            primitive["attributes"]["COLOR_0"] = add(
                np.ascontiguousarray(rgba, np.uint8), _UBYTE, "VEC4", _VERTICES, normalized=True
            )
        primitive["indices"] = add(faces.astype("<u4").reshape(-1), _UINT, "SCALAR", _INDICES)
    document: dict = {"asset": {"version": "2.0", "generator": "recon"}, "scene": 0, "scenes": [{"nodes": []}]}
    if accessors:
        document["scenes"] = [{"nodes": [0]}]
        document["nodes"] = [{"mesh": 0, "translation": middle.tolist()}]
        document["meshes"] = [{"primitives": [primitive]}]
        document["accessors"], document["bufferViews"] = accessors, views
        document["buffers"] = [{"byteLength": sum(map(len, buffers))}]
    text = json.dumps(document, separators=(",", ":")).encode()
    chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
    if buffers:
        chunks.append((b"BIN\0", b"".join(buffers)))
    total = 12 + sum(8 + len(body) for _, body in chunks)
    file.write(b"glTF" + (2).to_bytes(4, "little") + total.to_bytes(4, "little"))
    for kind, body in chunks:
        file.write(len(body).to_bytes(4, "little") + kind + body)


def _chunks(data: bytes, name: str) -> tuple[dict[str, Any], bytes]:
    """Part a file into its JSON and its binary chunk."""
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if not data.startswith(b"glTF") or len(data) < 20 or version != 2:
        raise InvalidInput(f"{name}: is no GLB of version 2")
    if length > len(data):
        raise InvalidInput(f"{name}: promises {length:,} bytes but has {len(data):,}; is the file truncated?")
    found: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size = int.from_bytes(data[at : at + 4], "little")
        if at + 8 + size > length:
            raise InvalidInput(f"{name}: a chunk goes on after the end; is the file truncated?")
        found.setdefault(data[at + 4 : at + 8], data[at + 8 : at + 8 + size])
        at += 8 + size
    try:
        document = json.loads(found.get(b"JSON", b""))
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{name}: its JSON cannot be read ({type(error).__name__})") from error
    if not isinstance(document, dict):
        raise InvalidInput(f"{name}: its JSON is no glTF 2.0")
    return document, found.get(b"BIN\0", b"")


def _placed(document: dict[str, Any], name: str) -> Iterator[tuple[NDArray[np.float64], dict[str, Any]]]:
    """Give every mesh of the scene with the matrix that moves it; without nodes, every mesh as it is."""
    meshes, nodes = document.get("meshes", []), document.get("nodes", [])
    if not nodes:
        yield from ((np.eye(4), mesh) for mesh in meshes)
        return
    scenes = document.get("scenes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    roots = scenes[document.get("scene", 0)].get("nodes", []) if scenes else [*({*range(len(nodes))} - children)]
    waiting = [(_index(root), np.eye(4)) for root in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        place, above = waiting.pop()
        if place in seen:
            raise InvalidInput(f"{name}: node {place} is in two places; nodes must form a tree")
        seen.add(place)
        matrix = above @ _matrix(nodes[place])
        if "mesh" in nodes[place]:
            yield matrix, meshes[_index(nodes[place]["mesh"])]
        waiting += [(_index(child), matrix) for child in reversed(nodes[place].get("children", []))]


def _matrix(node: dict[str, Any]) -> NDArray[np.float64]:
    """Give how a node moves what is in it: a matrix, or scale, then rotation (a quaternion x y z w), then translation."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64).reshape(4)
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    made = np.eye(4)
    made[:3, :3] = np.array(turn) * np.array(node.get("scale", (1, 1, 1)), np.float64).reshape(3)
    made[:3, 3] = np.array(node.get("translation", (0, 0, 0)), np.float64).reshape(3)
    return made


def _parts(
    document: dict[str, Any], body: bytes, mesh: dict[str, Any], matrix: NDArray[np.float64], name: str
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.int64], dict[str, NDArray]]]:
    """Give points, triangles and attributes of each primitive of a mesh that has any."""
    for primitive in mesh["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_POINTS, _TRIANGLES, _STRIP, _FAN):
            continue  # lines
        held = {key: _accessor(document, body, place, name) for key, place in primitive["attributes"].items()}
        points = held.pop("POSITION").astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        if points.ndim != 2 or any(len(values) != len(points) for values in held.values()):
            raise InvalidInput(f"{name}: the attributes of a mesh are of different lengths")
        order = np.arange(len(points)) if "indices" not in primitive else None
        if order is None:
            order = _accessor(document, body, primitive["indices"], name).astype(np.int64).reshape(-1)
        faces = _triangles(order, mode, name)
        if len(faces) and faces.max() >= len(points):
            raise InvalidInput(f"{name}: a triangle names vertex {faces.max()} of {len(points):,}")
        if len(faces) and np.linalg.det(matrix[:3, :3]) < 0:
            faces = faces[:, ::-1]  # a mirror turns the faces
        attributes = {key[1:]: values for key, values in held.items() if key.startswith("_") and len(key) > 1}
        if "NORMAL" in held:
            normals = held["NORMAL"]
            if not np.array_equal(matrix[:3, :3], np.eye(3)):
                normals = normals @ np.linalg.pinv(matrix[:3, :3])
                length = np.linalg.norm(normals, axis=1, keepdims=True)
                normals /= np.where(length > 0, length, 1.0)
            attributes["normals"] = normals
        if "COLOR_0" in held:
            attributes["colors"] = held["COLOR_0"]
        yield points, faces, attributes


def _triangles(order: NDArray[np.int64], mode: int, name: str) -> NDArray[np.int64]:
    """Give the corners of triangles: three by three, of a strip, or of a fan."""
    if mode == _POINTS:
        return np.zeros((0, 3), np.int64)
    if mode == _TRIANGLES:
        if len(order) % 3:
            raise InvalidInput(f"{name}: {len(order)} corners are no whole number of triangles")
        return order.reshape(-1, 3)
    if mode == _FAN:
        return np.column_stack([np.full(max(len(order) - 2, 0), order[0] if len(order) else 0), order[1:-1], order[2:]])
    faces = np.column_stack([order[:-2], order[1:-1], order[2:]])
    faces[1::2] = faces[1::2, [1, 0, 2]]
    return faces


def _accessor(document: dict[str, Any], body: bytes, place: int, name: str) -> NDArray:
    """Give the array that an accessor stands for."""
    accessor = document["accessors"][_index(place)]
    if "bufferView" not in accessor or "sparse" in accessor:
        raise InvalidInput(f"{name}: accessor {place} is sparse, which is not understood here")
    view = document["bufferViews"][_index(accessor["bufferView"])]
    if view.get("buffer", 0) != 0 or "uri" in document["buffers"][0]:
        raise InvalidInput(f"{name}: has its numbers in another file; convert it to a GLB that holds them")
    kind, width, count = (
        np.dtype(_TYPES[accessor["componentType"]]),
        _WIDTHS[accessor["type"]],
        _index(accessor["count"]),
    )
    stride = _index(view.get("byteStride", kind.itemsize * width))
    begin, room = _index(view.get("byteOffset", 0)), _index(view["byteLength"])
    offset = _index(accessor.get("byteOffset", 0))
    needed = offset + (stride * (count - 1) + kind.itemsize * width if count else 0)
    if needed > room or begin + room > len(body) or stride < kind.itemsize * width:
        raise InvalidInput(f"{name}: accessor {place} goes beyond its {room:,} bytes; is the file truncated?")
    array = np.ndarray((count, width), kind, body, begin + offset, (stride, kind.itemsize)).copy()
    if accessor.get("normalized") and kind.kind == "i":
        return np.maximum(array / np.iinfo(kind).max, -1.0)
    return array[:, 0] if width == 1 else array


def _index(value: Any) -> int:
    """Let a whole number from 0 through."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"expected a whole number, got {value!r}")
    return value
