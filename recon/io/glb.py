"""GLB, the binary form of glTF 2.0, written only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

_FLOAT, _UBYTE, _UINT = 5126, 5121, 5125
_VERTICES, _INDICES = 34962, 34963


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
