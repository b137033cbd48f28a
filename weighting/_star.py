"""Stars: the ring of triangles around a sample, in the order in which they lie around it."""

from __future__ import annotations

import math

import numpy as np

from recon._kernels.compile import kernel

from ._frame import plane_normal, tangents_of

STEEP = 9.0  # squared slope: a neighbour above 72 degrees has no direction around the sample


@kernel
def triangle_cover(aa, bb, cc):
    """Least squared radius of equal balls at the corners that cover a triangle, from its squared sides.

    The circumradius where no angle is obtuse; else the balls meet last on the longest side, at the end of the shorter one.
    """
    if aa > cc:
        aa, cc = cc, aa
    if bb > cc:
        bb, cc = cc, bb
    if aa + bb <= cc:
        if aa == 0.0:
            return 0.25 * cc
        reach = max(aa / (aa + cc - bb), bb / (bb + cc - aa))  # a / (2 c cos B), b / (2 c cos A)
        return cc * reach * reach
    return aa * bb * cc / (2.0 * (aa * bb + bb * cc + cc * aa) - aa * aa - bb * bb - cc * cc)


@kernel
def stars(points, rows, index, distance, k, k_normal, spacing, widest, final, cover, certain):
    """Raise `cover` (m,) [L^2] at the corners of each row's star to what its triangles need; leave out gaps.

    A triangle needing more than `widest` spacings is a gap; spacing 0 asks for nothing. `certain[r]` tells that no
    neighbour beyond the k can change the star; uncertain stars count only where `final`. `index`, `distance` are of the
    rows, `spacing` of all points.
    Source: gift wrapping by the largest angle (Delaunay 1934), measured in space, ordered in the tangent plane.
    """
    u, v, h, s = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    corner = np.empty(k, np.int64)
    first, second, needs = np.empty(2 * k, np.int64), np.empty(2 * k, np.int64), np.empty(2 * k)
    for r in range(len(rows)):
        i = rows[r]
        unit = distance[r, k - 1]
        certain[r] = True
        if unit == 0.0:
            continue
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
        for j in range(min(k, k_normal)):
            q = index[r, j]
            x, y, z = (points[q, 0] - px) / unit, (points[q, 1] - py) / unit, (points[q, 2] - pz) / unit
            sx, sy, sz = sx + x, sy + y, sz + z
            xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
        count = min(k, k_normal) + 1.0
        nx, ny, nz = plane_normal(count, sx, sy, sz, xx, xy, xz, yy, yz, zz)
        ux, uy, uz, vx, vy, vz = tangents_of(nx, ny, nz)
        count = 0
        for j in range(k):
            q = index[r, j]
            x, y, z = (points[q, 0] - px) / unit, (points[q, 1] - py) / unit, (points[q, 2] - pz) / unit
            along_u, along_v, along_n = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz, x * nx + y * ny + z * nz
            if along_n * along_n <= STEEP * (along_u * along_u + along_v * along_v):
                u[count], v[count], h[count], s[count] = along_u, along_v, along_n, x * x + y * y + z * z
                corner[count] = q
                count += 1
        limit = widest * spacing[i] / unit
        limit *= limit
        largest = 0.25 * s[0] if count else 0.25
        need = min(largest, limit)  # reach the nearest neighbour, at least
        sides = turned = 0
        for sense in (1.0, -1.0):  # from the nearest neighbour around, and back where the ring is open
            last = 0
            closed = False
            for _ in range(count):
                flattest = np.inf
                following = -1
                for j in range(count):
                    side = sense * (u[last] * v[j] - v[last] * u[j])
                    if side > 0.0:
                        p, q = v[last] * h[j] - h[last] * v[j], h[last] * u[j] - u[last] * h[j]
                        dot = u[last] * u[j] + v[last] * v[j] + h[last] * h[j]
                        cotangent = (s[j] - dot) / math.sqrt(side * side + p * p + q * q)
                        if cotangent < flattest:
                            flattest, following = cotangent, j
                if following < 0:
                    break
                du, dv, dh = u[last] - u[following], v[last] - v[following], h[last] - h[following]
                across = du * du + dv * dv + dh * dh
                circle = 0.25 * s[last] * (1.0 + flattest * flattest)
                largest = max(largest, circle)
                needed = triangle_cover(s[last], s[following], across)
                if needed <= limit:
                    first[sides], second[sides], needs[sides] = corner[last], corner[following], needed
                    sides += 1
                last = following
                if last == 0:
                    closed = True
                    break
            if closed:
                break
            turned += 1
        seen = 0.25  # squared radius of the circles that lie within the farthest neighbour
        certain[r] = limit == 0.0 or (turned == 0 and largest <= seen)
        if certain[r] or final:
            for j in range(sides):
                need = max(need, needs[j])
                needed = needs[j] * unit * unit
                cover[first[j]] = max(cover[first[j]], needed)
                cover[second[j]] = max(cover[second[j]], needed)
            cover[i] = max(cover[i], need * unit * unit)


@kernel
def gaps(points, rows, index, distance, k, spacing, widest, cover):
    """Raise `cover` (m,) [L^2] at both ends of the gap to the nearest neighbour on either side, in the plane."""
    for r in range(len(rows)):
        i = rows[r]
        px, py = points[i, 0], points[i, 1]
        unit = distance[r, k - 1]
        if unit == 0.0:
            continue
        sx = sy = xx = xy = yy = 0.0
        for j in range(k):
            x, y = (points[index[r, j], 0] - px) / unit, (points[index[r, j], 1] - py) / unit
            sx, sy = sx + x, sy + y
            xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        xx, xy, yy = xx - sx * sx / (k + 1), xy - sx * sy / (k + 1), yy - sy * sy / (k + 1)
        angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
        tx, ty = math.cos(angle), math.sin(angle)
        for sense in (1.0, -1.0):
            for j in range(k):
                q = index[r, j]
                if sense * ((points[q, 0] - px) * tx + (points[q, 1] - py) * ty) > 0.0:
                    half = 0.5 * distance[r, j]
                    if half <= widest * spacing[i]:
                        cover[i] = max(cover[i], half * half)
                        cover[q] = max(cover[q], half * half)
                    break
