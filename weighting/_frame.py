"""The normal of a small cloud, by scalars alone."""

from __future__ import annotations

import math

from recon._kernels.compile import kernel


@kernel
def normal_of(xx, xy, xz, yy, yz, zz):
    """Unit eigenvector of the smallest eigenvalue of a symmetric 3 x 3 matrix; any such where it is not unique.

    Closed form of the eigenvalue (Smith 1961), eigenvector by the largest cross product of two rows (Eberly 2014).
    """
    mean = (xx + yy + zz) / 3.0
    ax, ay, az = xx - mean, yy - mean, zz - mean
    off = xy * xy + xz * xz + yz * yz
    p = math.sqrt((ax * ax + ay * ay + az * az + 2.0 * off) / 6.0)
    if p == 0.0:
        return 0.0, 0.0, 1.0
    det = ax * (ay * az - yz * yz) - xy * (xy * az - yz * xz) + xz * (xy * yz - ay * xz)
    half = min(max(0.5 * det / (p * p * p), -1.0), 1.0)
    smallest = mean + 2.0 * p * math.cos(math.acos(half) / 3.0 + 2.0 * math.pi / 3.0)
    ax, ay, az = xx - smallest, yy - smallest, zz - smallest
    nx, ny, nz = xy * yz - xz * ay, xz * xy - ax * yz, ax * ay - xy * xy  # rows 0 x 1
    best = nx * nx + ny * ny + nz * nz
    x, y, z = xy * az - xz * yz, xz * xz - ax * az, ax * yz - xy * xz  # rows 0 x 2
    size = x * x + y * y + z * z
    if size > best:
        nx, ny, nz, best = x, y, z, size
    x, y, z = ay * az - yz * yz, yz * xz - xy * az, xy * yz - ay * xz  # rows 1 x 2
    size = x * x + y * y + z * z
    if size > best:
        nx, ny, nz, best = x, y, z, size
    if best <= 1e-24 * p * p * p * p:  # two eigenvalues agree: the points lie on a line, or the cloud is round
        x, y, z = ax, xy, xz  # the row that is longest lies along the line
        if abs(xy) + abs(ay) + abs(yz) > abs(x) + abs(y) + abs(z):
            x, y, z = xy, ay, yz
        if abs(xz) + abs(yz) + abs(az) > abs(x) + abs(y) + abs(z):
            x, y, z = xz, yz, az
        if abs(x) <= abs(y):
            nx, ny, nz = 0.0, z, -y
        else:
            nx, ny, nz = -z, 0.0, x
        best = nx * nx + ny * ny + nz * nz
        if best == 0.0:
            return 0.0, 0.0, 1.0
    length = math.sqrt(best)
    return nx / length, ny / length, nz / length


@kernel
def plane_normal(total, sx, sy, sz, xx, xy, xz, yy, yz, zz):
    """Normal of the plane of points, by their number and the sums of their coordinates and of the products of these."""
    return normal_of(
        xx - sx * sx / total,
        xy - sx * sy / total,
        xz - sx * sz / total,
        yy - sy * sy / total,
        yz - sy * sz / total,
        zz - sz * sz / total,
    )


@kernel
def tangents_of(nx, ny, nz):
    """Two unit vectors that make a right-handed frame with a unit normal (Duff et al. 2017)."""
    sign = math.copysign(1.0, nz)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    return 1.0 + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny
