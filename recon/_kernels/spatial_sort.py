"""The order of insertion: a Hilbert curve for memory, rounds of growing density for the number of steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compile import kernel

BITS = 16  # a coordinate, so three make a key of 48
_CROWD = 64  # more points than this in one cell of the curve are sorted by a curve of their own
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
    low, high = points.min(axis=0), points.max(axis=0)
    extent = (high - low).max()
    if extent == 0.0:
        return np.arange(len(points))
    keys = _hilbert_keys(points, low, extent)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    start = np.flatnonzero(np.diff(keys, prepend=~keys[0]))
    length = np.diff(start, append=len(keys))
    for i in np.flatnonzero(length > _CROWD):
        crowd = order[start[i] : start[i] + length[i]]
        order[start[i] : start[i] + length[i]] = crowd[hilbert_order(points[crowd])]
    return order


@kernel
def _hilbert_keys(points, low, extent):
    """Distance along the curve, three coordinates of BITS bits (Skilling 2004)."""
    n = points.shape[0]
    keys = np.empty(n, np.int64)
    top = float((1 << BITS) - 1)
    for i in range(n):
        x = np.int64((points[i, 0] - low[0]) / extent * top)
        y = np.int64((points[i, 1] - low[1]) / extent * top)
        z = np.int64((points[i, 2] - low[2]) / extent * top)
        q = 1 << (BITS - 1)
        while q > 1:
            p = q - 1
            if x & q:
                x ^= p
            if y & q:
                x ^= p
            else:
                t = (x ^ y) & p
                x ^= t
                y ^= t
            if z & q:
                x ^= p
            else:
                t = (x ^ z) & p
                x ^= t
                z ^= t
            q >>= 1
        y ^= x
        z ^= y
        t = 0
        q = 1 << (BITS - 1)
        while q > 1:
            if z & q:
                t ^= q - 1
            q >>= 1
        keys[i] = (_spread(x ^ t) << 2) | (_spread(y ^ t) << 1) | _spread(z ^ t)
    return keys


@kernel
def _spread(x):
    """Put two zero bits between the bits of x."""
    x = (x | (x << 16)) & 0x0000FF0000FF
    x = (x | (x << 8)) & 0x00F00F00F00F
    x = (x | (x << 4)) & 0x0C30C30C30C3
    return (x | (x << 2)) & 0x249249249249


@kernel
def rounds(n):
    """Order of insertion of 0 .. n-1, which lie along a curve: every 8**k-th of them, then every 8**(k-1)-th, ...

    Each round goes along the whole curve, so that a point is inserted near the one before it, into a triangulation
    that is everywhere as fine as the next; as biased randomised insertion does (Amenta, Choi, Rote 2003).
    """
    sequence = np.empty(n, np.uint32)
    stride = 1
    while stride * _FINER < n:
        stride *= _FINER
    count = 0
    first = True
    while stride >= 1:
        for i in range(0, n, stride):
            if first or i % (stride * _FINER) != 0:
                sequence[count] = i
                count += 1
        first = False
        stride //= _FINER
    return sequence
