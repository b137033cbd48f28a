"""Nearest triangle and ray crossings over a tree of boxes (recon.boxes: node i has children 2 i and 2 i + 1)."""

from __future__ import annotations

import numpy as np

from .compile import kernel

_DEPTH = 64  # more than the depth of any tree of int32 faces


@kernel(inline="always")
def segment_closest(ax, ay, az, ux, uy, uz):
    """Closest point to the origin on the segment from a along u: squared distance and the point."""
    length_sq = ux * ux + uy * uy + uz * uz
    t = 0.0
    if length_sq > 0.0:
        t = -(ax * ux + ay * uy + az * uz) / length_sq
        t = min(max(t, 0.0), 1.0)
    x, y, z = ax + t * ux, ay + t * uy, az + t * uz
    return x * x + y * y + z * z, x, y, z


@kernel
def triangle_closest(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Closest point to the origin on a triangle, flat or not: squared distance and the point.

    The least over the three edges, and the foot on the plane where that is inside; safe for slivers.
    """
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - ax, cy - ay, cz - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    normal_sq = nx * nx + ny * ny + nz * nz
    if normal_sq > 0.0:
        # Barycentric coordinates of the foot, times normal_sq.
        p = (by * cz - bz * cy) * nx + (bz * cx - bx * cz) * ny + (bx * cy - by * cx) * nz
        q = (cy * az - cz * ay) * nx + (cz * ax - cx * az) * ny + (cx * ay - cy * ax) * nz
        r = (ay * bz - az * by) * nx + (az * bx - ax * bz) * ny + (ax * by - ay * bx) * nz
        if p > 0.0 and q > 0.0 and r > 0.0:
            height = (ax * nx + ay * ny + az * nz) / normal_sq
            return height * height * normal_sq, height * nx, height * ny, height * nz
    best, x, y, z = segment_closest(ax, ay, az, ux, uy, uz)
    d, i, j, k = segment_closest(ax, ay, az, vx, vy, vz)
    if d < best:
        best, x, y, z = d, i, j, k
    d, i, j, k = segment_closest(bx, by, bz, cx - bx, cy - by, cz - bz)
    if d < best:
        best, x, y, z = d, i, j, k
    return best, x, y, z


@kernel(inline="always")
def axis_gap(x, low, high):
    """Distance from a number to an interval."""
    return max(low - x, x - high, 0.0)


@kernel
def nearest(points, corners, start, lower, upper, out_face, out_sq, out_foot):
    """Nearest triangle of each point: its place in `corners`, squared distance, and the foot relative to the point.

    points (m, 3), corners (f, 9) in leaf order, f >= 1; neighbouring points should be near each other (a warm start).
    """
    leaves = len(start) - 1
    stack = np.empty(_DEPTH, np.int64)
    gaps = np.empty(_DEPTH)
    last = 0
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        best_face = last
        best, fx, fy, fz = triangle_closest(
            corners[last, 0] - px, corners[last, 1] - py, corners[last, 2] - pz,
            corners[last, 3] - px, corners[last, 4] - py, corners[last, 5] - pz,
            corners[last, 6] - px, corners[last, 7] - py, corners[last, 8] - pz,
        )  # fmt: skip
        stack[0], gaps[0] = 1, 0.0
        top = 1
        while top > 0:
            top -= 1
            if gaps[top] >= best:
                continue
            node = stack[top]
            if node >= leaves:
                for k in range(start[node - leaves], start[node - leaves + 1]):
                    d, x, y, z = triangle_closest(
                        corners[k, 0] - px, corners[k, 1] - py, corners[k, 2] - pz,
                        corners[k, 3] - px, corners[k, 4] - py, corners[k, 5] - pz,
                        corners[k, 6] - px, corners[k, 7] - py, corners[k, 8] - pz,
                    )  # fmt: skip
                    if d < best:
                        best, fx, fy, fz, best_face = d, x, y, z, k
                continue
            a = 2 * node
            b = a + 1
            dx = axis_gap(px, lower[a, 0], upper[a, 0])
            dy = axis_gap(py, lower[a, 1], upper[a, 1])
            dz = axis_gap(pz, lower[a, 2], upper[a, 2])
            gap_a = dx * dx + dy * dy + dz * dz
            dx = axis_gap(px, lower[b, 0], upper[b, 0])
            dy = axis_gap(py, lower[b, 1], upper[b, 1])
            dz = axis_gap(pz, lower[b, 2], upper[b, 2])
            gap_b = dx * dx + dy * dy + dz * dz
            if gap_a < gap_b:
                a, b, gap_a, gap_b = b, a, gap_b, gap_a
            if gap_a < best:
                stack[top], gaps[top] = a, gap_a
                top += 1
            if gap_b < best:
                stack[top], gaps[top] = b, gap_b
                top += 1
        out_face[i] = best_face
        out_sq[i] = best
        out_foot[i, 0], out_foot[i, 1], out_foot[i, 2] = fx, fy, fz
        last = best_face


@kernel
def edge_side(ay, az, by, bz, py, pz):
    """Side of p on the line from a to b in the (y, z) plane, +1 or -1; p is moved by (eps, eps^2) off a tie.

    The rounding is the same for both faces of an edge: the lower end comes first.
    """
    turned = 1
    if ay > by or (ay == by and az > bz):
        ay, az, by, bz = by, bz, ay, az
        turned = -1
    s = (by - ay) * (pz - az) - (bz - az) * (py - ay)
    if s > 0.0:
        return turned
    if s < 0.0:
        return -turned
    if bz - az != 0.0:
        return -turned if bz > az else turned
    return turned if by > ay else (-turned if by < ay else 0)


@kernel
def crossings(points, skip, corners, start, lower, upper, out):
    """Signed crossings of the ray from each point along +x: +1 where it leaves through a face, -1 where it enters.

    The winding number of a closed oriented mesh around the point. skip (m,) is a place in `corners` that does not count.
    """
    leaves = len(start) - 1
    stack = np.empty(_DEPTH, np.int64)
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        total = 0
        stack[0] = 1
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            if (
                py < lower[node, 1] or py > upper[node, 1]
                or pz < lower[node, 2] or pz > upper[node, 2]
                or px > upper[node, 0]
            ):  # fmt: skip
                continue
            if node < leaves:
                stack[top], stack[top + 1] = 2 * node, 2 * node + 1
                top += 2
                continue
            for k in range(start[node - leaves], start[node - leaves + 1]):
                if k == skip[i]:
                    continue
                ax, ay, az = corners[k, 0] - px, corners[k, 1] - py, corners[k, 2] - pz
                bx, by, bz = corners[k, 3] - px, corners[k, 4] - py, corners[k, 5] - pz
                cx, cy, cz = corners[k, 6] - px, corners[k, 7] - py, corners[k, 8] - pz
                side = edge_side(ay, az, by, bz, 0.0, 0.0)
                if (
                    side == 0
                    or side != edge_side(by, bz, cy, cz, 0.0, 0.0)
                    or side != edge_side(cy, cz, ay, az, 0.0, 0.0)
                ):
                    continue
                # The normal's x has the sign of `side`; the point is behind the face where the volume has it too.
                volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
                if (volume > 0.0 and side > 0) or (volume < 0.0 and side < 0):
                    total += side
        out[i] = total
