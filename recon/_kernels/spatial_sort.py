"""The order of insertion: a Hilbert curve for memory, rounds of growing density for the number of steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compile import kernel

BITS = 16  # a coordinate, so three make a key of 48
_CROWD = 64  # more points than this in one cell of the curve are sorted by a curve of their own
_BLOCK = 512
_FINER = 8  # each round inserts this many times the points of all rounds before it


def hilbert_order(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Order points along a Hilbert curve through their bounding box; where they crowd, through the box of the crowd.

    Parameters
    ----------
    points : (n, 3) ndarray of float64
        Pad lower dimensions with zeros.

    Returns
    -------
    (n,) ndarray of int64
        Rows, ties in input order.
    """
    low, extents = bounding_box(points)
    if extents.max() == 0.0:
        return np.arange(len(points))
    axes = np.argsort(
        -extents, kind="stable"
    )  # the longest side is halved first: where stretches of the curve meet is small
    order, keys = sort_keys(hilbert_keys(points, low, extents.max(), axes))
    for start, stop in crowds(keys):
        crowd = order[start:stop]
        order[start:stop] = crowd[hilbert_order(points[crowd])]
    return order


@kernel
def bounding_box(points):
    """Lower corner of the box of some points, and its sides."""
    low, extents = np.empty(points.shape[1]), np.empty(points.shape[1])
    for k in range(points.shape[1]):
        lowest, highest = points[0, k], points[0, k]
        for i in range(points.shape[0]):
            lowest, highest = min(lowest, points[i, k]), max(highest, points[i, k])
        low[k], extents[k] = lowest, highest - lowest
    return low, extents


@kernel
def crowds(keys):
    """Start and stop of the long runs of equal keys."""
    found = []
    start = 0
    for i in range(1, keys.size + 1):
        if i == keys.size or keys[i] != keys[start]:
            if i - start > _CROWD:
                found.append((start, i))
            start = i
    return found


@kernel(inline="always")
def spread(x):
    """Put two zero bits between the bits of x."""
    x = (x | (x << 16)) & 0x0000FF0000FF
    x = (x | (x << 8)) & 0x00F00F00F00F
    x = (x | (x << 4)) & 0x0C30C30C30C3
    return (x | (x << 2)) & 0x249249249249


@kernel
def hilbert_keys(points, low, extent, axes):
    """Distance along the curve, from three coordinates of BITS bits, in this order (Skilling 2004).

    Without branches, and bit by bit for many points, so that the compiler can use vectors.
    """
    n = points.shape[0]
    keys = np.empty(n, np.int64)
    x, y, z = np.empty(_BLOCK, np.int64), np.empty(_BLOCK, np.int64), np.empty(_BLOCK, np.int64)
    top = float((1 << BITS) - 1)
    a, b, c = axes[0], axes[1], axes[2]
    for start in range(0, n, _BLOCK):
        size = min(_BLOCK, n - start)
        for i in range(size):
            x[i] = np.int64((points[start + i, a] - low[a]) / extent * top)
            y[i] = np.int64((points[start + i, b] - low[b]) / extent * top)
            z[i] = np.int64((points[start + i, c] - low[c]) / extent * top)
        for bit in range(BITS - 1, 0, -1):
            lower = (1 << bit) - 1
            for i in range(size):
                u, v, w = x[i], y[i], z[i]
                u ^= lower & -((u >> bit) & 1)
                invert = -((v >> bit) & 1)
                exchange = (u ^ v) & lower & ~invert
                u ^= exchange | (lower & invert)
                v ^= exchange
                invert = -((w >> bit) & 1)
                exchange = (u ^ w) & lower & ~invert
                x[i] = u ^ (exchange | (lower & invert))
                y[i] = v
                z[i] = w ^ exchange
        for i in range(size):
            u = x[i]
            v = y[i] ^ u
            w = z[i] ^ v
            above = w ^ (w >> 1)  # parity of the bits of w from each bit on
            above ^= above >> 2
            above ^= above >> 4
            above = (above ^ (above >> 8)) >> 1
            keys[start + i] = (spread(u ^ above) << 2) | (spread(v ^ above) << 1) | spread(w ^ above)
    return keys


@kernel
def sort_keys(keys):
    """Stable order of keys that are not negative, and the keys in that order: radix sort, by 12 bits at a time."""
    n = keys.size
    order, other_order = np.arange(n), np.empty(n, np.int64)
    keys, other_keys = keys.copy(), np.empty(n, np.int64)
    start, shift, top = np.empty(4096, np.int64), 0, np.int64(0)
    for i in range(n):
        top = max(top, keys[i])
    while shift < 63 and top >> shift > 0:
        start[:] = 0
        for i in range(n):
            start[(keys[i] >> shift) & 4095] += 1
        total = 0
        for digit in range(4096):
            start[digit], total = total, total + start[digit]
        for i in range(n):
            digit = (keys[i] >> shift) & 4095
            place = start[digit]
            start[digit] = place + 1
            other_keys[place] = keys[i]
            other_order[place] = order[i]
        keys, other_keys = other_keys, keys
        order, other_order = other_order, order
        shift += 12
    return order, keys


def rounds(n: int, present: NDArray[np.int64]) -> list[NDArray[np.uint32]]:
    """Order of insertion of 0 .. n-1, which lie along a curve: every 8**k-th of them, then every 8**(k-1)-th, ...

    Without the few that are present already. Each round goes along the whole curve, so that a point is
    inserted near the one before it, into a triangulation that is everywhere about as fine; as biased randomised
    insertion does (Amenta, Choi, Rote 2003).
    """
    stride = 1
    while stride * _FINER < n:
        stride *= _FINER
    found, fresh = [], np.ones(n, bool)
    fresh[present] = False
    while stride >= 1:
        some = np.arange(0, n, stride, dtype=np.uint32)
        found.append(some[fresh[::stride]])
        fresh[::stride] = False
        stride //= _FINER
    return found
