"""Loops over neighbour lists. Arrays in, arrays out; nothing is validated here."""

from __future__ import annotations

import math

import numpy as np

from recon._kernels.compile import kernel

from ._frame import normal_of

LINE = 30.0  # l1 / l2 of samples on a line, about
OFF_LINE = 0.5  # squared distance to the samples of a line, over that to the one asking: 1 straight beside it


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
def beside_a_line(points, rows, index, distance, least, out):
    """How many neighbours it takes until they lie on no line with each of some points, or 0: `least`, unless those do lie on one.

    More where those do: up to the first that is off the line, its distance to all nearer ones not much less than to the point.
    Second moments of the offsets: (l1 l2 + l2 l3 + l3 l1) / (l1 + l2 + l3)^2 is 0 on a line, 1/4 for an even disk.
    """
    d = points.shape[1]
    offset, moment = np.empty(d), np.empty((d, d))
    for row in range(len(rows)):
        i = rows[row]
        unit = distance[row, least - 1]
        out[row] = 0
        if unit == 0.0:
            continue
        moment[:] = 0.0
        for j in range(least):
            for a in range(d):
                offset[a] = (points[index[row, j], a] - points[i, a]) / unit
            for a in range(d):
                for b in range(d):
                    moment[a, b] += offset[a] * offset[b]
        trace = square = 0.0
        for a in range(d):
            trace += moment[a, a]
            for b in range(d):
                square += moment[a, b] * moment[a, b]
        if LINE * (trace * trace - square) >= 2.0 * trace * trace:
            out[row] = least
            continue
        for j in range(least, index.shape[1]):
            nearest = np.inf
            for k in range(j):
                apart = 0.0
                for a in range(d):
                    apart += ((points[index[row, j], a] - points[index[row, k], a]) / distance[row, j]) ** 2
                nearest = min(nearest, apart)
            if nearest >= OFF_LINE:
                out[row] = j + 1
                break


@kernel
def relax(values, index, distance, k, factor, power, backward):
    """One sweep of v_i <- min(v_i, v_j + factor d_ij^power) and back over all neighbour pairs, in place; True where any fell."""
    changed = False
    n = len(values)
    for row in range(n):
        i = n - 1 - row if backward else row
        for j in range(k):
            other = index[i, j]
            step = distance[i, j]
            if power == 2:
                step *= step
            step *= factor
            if values[i] + step < values[other]:
                values[other] = values[i] + step
                changed = True
            elif values[other] + step < values[i]:
                values[i] = values[other] + step
                changed = True
    return changed


@kernel
def off_surface(points, rows, index, distance, k, out):
    """Distance of some points and of their neighbours from the neighbours' plane (line, in the plane): rms, over d_k."""
    d = points.shape[1]
    for row in range(len(rows)):
        i = rows[row]
        unit = distance[i, k - 1]
        out[row] = 0.0
        if unit == 0.0:
            continue
        sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
        for j in range(k):
            q = index[i, j]
            x, y = (points[q, 0] - points[i, 0]) / unit, (points[q, 1] - points[i, 1]) / unit
            z = (points[q, 2] - points[i, 2]) / unit if d == 3 else 0.0
            sx, sy, sz = sx + x, sy + y, sz + z
            xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
        xx, xy, xz = xx - sx * sx / k, xy - sx * sy / k, xz - sx * sz / k
        yy, yz, zz = yy - sy * sy / k, yz - sy * sz / k, zz - sz * sz / k
        if d == 3:
            nx, ny, nz = normal_of(xx, xy, xz, yy, yz, zz)
        else:
            angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
            nx, ny, nz = -math.sin(angle), math.cos(angle), 0.0
        own = (nx * sx + ny * sy + nz * sz) / k
        square = nx * nx * xx + ny * ny * yy + nz * nz * zz + 2.0 * (nx * ny * xy + nx * nz * xz + ny * nz * yz)
        out[row] = math.sqrt(own * own + max(square, 0.0) / max(k - d, 1))
