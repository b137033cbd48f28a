"""Loops over neighbour lists. Arrays in, arrays out; nothing is validated here."""

from __future__ import annotations

import numpy as np

from recon._kernels.compile import kernel


@kernel
def curve_keys(points, low, extent):
    """Interleave 21 bits of each of the first three coordinates: position along the Z-order curve (Morton 1966)."""
    n, d = points.shape
    keys = np.empty(n, np.int64)
    for i in range(n):
        key = np.int64(0)
        for j in range(min(d, 3)):
            bits = np.int64(min((points[i, j] - low[j]) / extent, 1.0) * 2097151.0)
            bits = (bits | (bits << 32)) & 0x1F00000000FFFF
            bits = (bits | (bits << 16)) & 0x1F0000FF0000FF
            bits = (bits | (bits << 8)) & 0x100F00F00F00F00F
            bits = (bits | (bits << 4)) & 0x10C30C30C30C30C3
            bits = (bits | (bits << 2)) & 0x1249249249249249
            key |= bits << j
        keys[i] = key
    return keys


@kernel
def smooth(values, index, k):
    """Mean over each point and its first k neighbours."""
    n = len(values)
    out = np.empty(n)
    for i in range(n):
        total = values[i]
        for j in range(k):
            total += values[index[i, j]]
        out[i] = total / (k + 1)
    return out


@kernel
def relax(values, index, distance, k, theta, order):
    """One sweep of w_i <- min(w_i, w_j + theta d_ij^2) and back over all neighbour pairs, in place; True where any fell."""
    changed = False
    for i in order:
        for j in range(k):
            other = index[i, j]
            step = theta * (distance[i, j] * distance[i, j])
            if values[i] + step < values[other]:
                values[other] = values[i] + step
                changed = True
            elif values[other] + step < values[i]:
                values[i] = values[other] + step
                changed = True
    return changed
