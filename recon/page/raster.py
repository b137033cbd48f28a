"""Pictures of points and meshes without a display: orthographic, flat shading, a depth buffer, written as PNG."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FINE = 2  # samples a pixel and direction
_AT_ONCE = 1 << 21  # pixel and face pairs looked at together
_FRONT, _BACK, _POINT = np.array([(148, 172, 192), (168, 140, 118), (104, 150, 186)], dtype=np.float64)
_NONE = np.uint64(2**64 - 1)


def picture(
    points: Array, faces: NDArray[np.integer] | None, towards: tuple[float, float, float], up: tuple[float, float, float],
    size: tuple[int, int] = (480, 360),
) -> bytes:  # fmt: skip
    """Draw a mesh, or points alone, all of it in view.

    Parameters
    ----------
    points : (n, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int, optional
        Seen from behind they are of another colour. Without them the points are drawn.
    towards : tuple of float
        Direction from the middle to the eye.
    up : tuple of float
    size : tuple of int
        Width and height in pixels.

    Returns
    -------
    bytes
        PNG with a transparent background.
    """
    width, height = size[0] * _FINE, size[1] * _FINE
    placed = _project(points, towards, up, width, height)
    buffer = np.full(width * height, _NONE)
    if faces is None:
        _draw_points(buffer, placed, width, height)
        depth = placed[:, 2]
        tone = 0.55 + 0.45 * (1 - (depth - depth.min()) / (np.ptp(depth) or 1.0))
        colours = tone[:, None] * _POINT
    else:
        _draw_faces(buffer, placed, faces, width, height)
        colours = _shaded(placed, faces)
    seen = buffer != _NONE
    image = np.zeros((width * height, 4))
    image[seen, :3] = colours[(buffer[seen] & np.uint64(0xFFFFFFFF)).astype(np.int64)]
    image[seen, 3] = 255
    return _png(_coarser(image.reshape(height, width, 4)))


def as_url(png: bytes) -> str:
    """Give a picture as the text of a link."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def _project(points: Array, towards: tuple[float, ...], up: tuple[float, ...], width: int, height: int) -> Array:
    """Columns and rows in pixels, and depth in [0, 1], larger farther (n, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    local = (points - (low / 2 + high / 2)) / (float((high - low).max()) or 1.0)
    eye = np.array(towards) / np.linalg.norm(towards)
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    seen = local @ np.column_stack([right, -np.cross(eye, right), -eye])
    extent = np.ptp(seen, axis=0)
    scale = 0.94 / max(extent[0] / width, extent[1] / height, 1e-9)
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    placed = (seen - middle) * scale
    placed[:, 0] += width / 2
    placed[:, 1] += height / 2
    placed[:, 2] = (seen[:, 2] - seen[:, 2].min()) / (extent[2] or 1.0)
    return placed


def _keys(depth: Array, number: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Depth in [0, 1] in the high half, the number of what is seen in the low half."""
    return (np.clip(depth, 0, 1) * (2**32 - 2)).astype(np.uint64) << np.uint64(32) | number.astype(np.uint64)


def _draw_points(buffer: NDArray[np.uint64], placed: Array, width: int, height: int) -> None:
    radius = int(np.clip(np.sqrt(width * height / (60 * len(placed))), 1, 6))
    keys = _keys(placed[:, 2], np.arange(len(placed)))
    column, row = np.floor(placed[:, :2]).astype(np.int64).T
    for dx in range(-radius, radius + 1):
        for dy in range(-radius, radius + 1):
            x, y = column + dx, row + dy
            if dx * dx + dy * dy <= radius * radius:
                there = (x >= 0) & (x < width) & (y >= 0) & (y < height)
                np.minimum.at(buffer, (y * width + x)[there], keys[there])


def _draw_faces(buffer: NDArray[np.uint64], placed: Array, faces: NDArray, width: int, height: int) -> None:
    """Look at the pixels in the box around each face."""
    corners = placed[faces]
    low = np.clip(np.ceil(corners[:, :, :2].min(axis=1) - 0.5), 0, (width, height)).astype(np.int64)
    high = np.clip(np.floor(corners[:, :, :2].max(axis=1) - 0.5), -1, (width - 1, height - 1)).astype(np.int64)
    wide = np.maximum(high - low + 1, 0)
    pixels = wide[:, 0] * wide[:, 1]
    until = np.cumsum(pixels)
    begin = 0
    while begin < len(faces):
        done = until[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(until, done + _AT_ONCE, side="right")))
        face = np.repeat(np.arange(begin, end), pixels[begin:end])
        place = np.arange(len(face)) - np.repeat(until[begin:end] - pixels[begin:end] - done, pixels[begin:end])
        x = low[face, 0] + place % np.maximum(wide[face, 0], 1)
        y = low[face, 1] + place // np.maximum(wide[face, 0], 1)
        a, b, c = (corners[face, k] for k in range(3))
        u, v = b - a, c - a
        px, py = x + 0.5 - a[:, 0], y + 0.5 - a[:, 1]
        area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        safe = np.where(area == 0, 1, area)
        s, t = (px * v[:, 1] - py * v[:, 0]) / safe, (py * u[:, 0] - px * u[:, 1]) / safe
        inside = (area != 0) & (s >= 0) & (t >= 0) & (s + t <= 1)
        depth = (a[:, 2] + s * u[:, 2] + t * v[:, 2])[inside]
        np.minimum.at(buffer, (y * width + x)[inside], _keys(depth, face[inside]))
        begin = end


def _shaded(placed: Array, faces: NDArray) -> Array:
    """Colours (f, 3) of faces, lit from the upper left of the eye."""
    stretched = placed * (1, 1, max(np.ptp(placed[:, 0]), np.ptp(placed[:, 1])))
    a, b, c = (stretched[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    # The row axis points down and depth away from the eye: a counter-clockwise face looks towards negative depth.
    front = normal[:, 2] < 0
    light = np.array([-0.35, -0.5, -0.8])
    lit = np.abs(normal @ (light / np.linalg.norm(light)))
    return np.where(front[:, None], _FRONT, _BACK) * (0.45 + 0.65 * lit)[:, None]


def _coarser(image: Array) -> NDArray[np.uint8]:
    """Average over the samples of each pixel; colours over those that show something."""
    height, width = image.shape[0] // _FINE, image.shape[1] // _FINE
    total = image.reshape(height, _FINE, width, _FINE, 4).sum(axis=(1, 3))
    count = np.maximum(total[:, :, 3:] / 255, 1)
    total[:, :, :3] /= count
    total[:, :, 3] /= _FINE * _FINE
    return np.clip(np.round(total), 0, 255).astype(np.uint8)


def _png(image: NDArray[np.uint8]) -> bytes:
    """Write (height, width, 4) as PNG, without filters."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    height, width = image.shape[:2]
    lines = np.column_stack([np.zeros(height, np.uint8), image.reshape(height, -1)]).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines, 9)) + chunk(b"IEND", b"")
