"""Quadrics over a sample's surroundings at several scales at once, and their blend."""

from __future__ import annotations

import math

import numpy as np

from recon._kernels.compile import kernel

from ._frame import plane_normal, tangents_of

TERMS = 6  # h = a0 + a1 u + a2 v + a3 u^2 + a4 uv + a5 v^2
FRAME = 12  # normal of its plane, coefficients, direction in that in which the fit is longer, square of how many times
MOMENTS = 22  # 15 of u, v up to degree 4; 6 of h times the terms; h^2
LEAST = 9  # samples of a fit
CROWD = 320  # samples that one fit sees at most
WIDER = 1  # more levels where noise is strong
RINGS = 3  # of neighbours that are asked for a fit
DISCOUNT = 9.0  # heights up to three sigma do not count as distance: in a plain ball, noise would flatten the rim
# What noise explains of the quadratic terms: 3 sigma^2 on average, 5 by chance more. They shrink by 1 - (BENT sigma^2 / theirs)^2,
# and are none below: a plane through the same samples is twice as accurate (Stein 1956).
BENT = 5.0
SINGULAR = 1e-9  # of its square, what the other terms leave of a term for it to have a coefficient
GRAM = np.array(  # which moment each entry of the normal matrix is; order 1 u v uu uv vv uuu uuv uvv vvv u4 u3v u2v2 uv3 v4
    [
        [0, 1, 2, 3, 4, 5],
        [1, 3, 4, 6, 7, 8],
        [2, 4, 5, 7, 8, 9],
        [3, 6, 7, 10, 11, 12],
        [4, 7, 8, 11, 12, 13],
        [5, 8, 9, 12, 13, 14],
    ]
)


@kernel(inline="always")
def add(moment, level, u, v, h):
    """Add a sample to the moments of a level. (A row of an array, handed over, is counted: too slow here.)"""
    uu, uv, vv = u * u, u * v, v * v
    moment[level, 0] += 1.0
    moment[level, 1] += u
    moment[level, 2] += v
    moment[level, 3] += uu
    moment[level, 4] += uv
    moment[level, 5] += vv
    moment[level, 6] += uu * u
    moment[level, 7] += uu * v
    moment[level, 8] += u * vv
    moment[level, 9] += vv * v
    moment[level, 10] += uu * uu
    moment[level, 11] += uu * uv
    moment[level, 12] += uu * vv
    moment[level, 13] += uv * vv
    moment[level, 14] += vv * vv
    moment[level, 15] += h
    moment[level, 16] += u * h
    moment[level, 17] += v * h
    moment[level, 18] += uu * h
    moment[level, 19] += uv * h
    moment[level, 20] += vv * h
    moment[level, 21] += h * h


@kernel
def fit(moment, level, factor, half):
    """Variance of the distance to the quadric by the moments of a level, by Cholesky; -1 where they do not determine it."""
    if moment[level, 0] < LEAST:
        return -1.0
    explained = 0.0
    for a in range(TERMS):
        for b in range(a + 1):
            value = moment[level, GRAM[a, b]]
            for c in range(b):
                value -= factor[a, c] * factor[b, c]
            if b < a:
                factor[a, b] = value / factor[b, b]
            elif value > SINGULAR * moment[level, GRAM[a, a]]:
                factor[a, a] = math.sqrt(value)
            else:
                return -1.0
        value = moment[level, 15 + a]
        for c in range(a):
            value -= factor[a, c] * half[c]
        half[a] = value / factor[a, a]
        explained += half[a] * half[a]
    return max(moment[level, 21] - explained, 0.0) / (moment[level, 0] - TERMS)


@kernel(inline="always")
def within(left, count, most, slack):
    """Whether the misfit of so many samples is no more than `most`, by so many standard deviations."""
    return left <= most * (1.0 + slack * math.sqrt(2.0 / (count - TERMS)))


@kernel
def coefficients(factor, half, noise_sq, solution):
    """Of the quadric that `fit` found, with what noise explains of it taken out."""
    bent = half[3] * half[3] + half[4] * half[4] + half[5] * half[5]
    chance = min(BENT * noise_sq / bent, 1.0) if bent > 0.0 else 0.0
    for a in range(TERMS - 1, -1, -1):
        value = half[a] * (1.0 - chance * chance) if a > 2 else half[a]
        for c in range(a + 1, TERMS):
            value -= factor[c, a] * solution[c]
        solution[a] = value / factor[a, a]
    # samples outside a bend are thinner spread, and weigh less
    solution[0] -= noise_sq * (solution[3] + solution[5])


@kernel
def gather(points, first, links, skip, i, unit, reach, seen, near, distance, local):
    """Samples within sqrt(reach) units of sample i that links lead to, itself first: their squared distances and offsets; how many?"""
    near[0], distance[0], seen[i] = i, 0.0, i
    local[0, 0] = local[0, 1] = local[0, 2] = 0.0
    size, head = 1, 0
    while head < size:
        a = near[head]
        head += 1
        for e in range(first[a], first[a + 1]):
            q = links[e]
            if seen[q] == i or skip[q]:
                continue
            seen[q] = i
            x = (points[q, 0] - points[i, 0]) / unit
            y = (points[q, 1] - points[i, 1]) / unit
            z = (points[q, 2] - points[i, 2]) / unit
            square = x * x + y * y + z * z
            if square <= reach and size < CROWD:
                near[size], distance[size] = q, square
                local[size, 0], local[size, 1], local[size, 2] = x, y, z
                size += 1
    return size


@kernel
def plane(local, distance, size, limit):
    """Normal of the plane of the offsets whose squared distance is within the limit."""
    total = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    for j in range(size):
        if distance[j] > limit:
            continue
        x, y, z = local[j, 0], local[j, 1], local[j, 2]
        total += 1.0
        sx, sy, sz = sx + x, sy + y, sz + z
        xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
    return plane_normal(total, sx, sy, sz, xx, xy, xz, yy, yz, zz)


@kernel
def turn(local, size, normal):
    """Offsets in coordinates of the plane and the height above it, in place."""
    nx, ny, nz = normal
    ux, uy, uz, vx, vy, vz = tangents_of(nx, ny, nz)
    for j in range(size):
        x, y, z = local[j, 0], local[j, 1], local[j, 2]
        u, v, h = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz, x * nx + y * ny + z * nz
        local[j, 0], local[j, 1], local[j, 2] = u, v, h


@kernel
def add_rings(local, size, near_sq, noise_sq, depth, moment):
    """Moments of each level: of the samples within sqrt(near_sq 2^level), but not within the level below."""
    moment[:depth] = 0.0
    for j in range(size):
        u, v, h = local[j, 0], local[j, 1], local[j, 2]
        level, limit = 0, near_sq
        square = u * u + v * v + max(h * h - DISCOUNT * noise_sq, 0.0)
        while level < depth and square > limit:
            level, limit = level + 1, 2.0 * limit
        if level < depth:
            add(moment, level, u, v, h)


@kernel
def add_ellipse(local, size, cos, sin, longer_sq, limit, noise_sq, moment):
    """Moments, as level 0, of the samples within sqrt(limit), and sqrt(longer_sq) times that along a direction."""
    moment[0] = 0.0
    for j in range(size):
        u, v, h = local[j, 0], local[j, 1], local[j, 2]
        along, across = u * cos + v * sin, v * cos - u * sin
        square = along * along / longer_sq + across * across
        if square + max(h * h - DISCOUNT * noise_sq, 0.0) <= limit:
            add(moment, 0, u, v, h)


@kernel
def straightest(quadric):
    """Direction (cos, sin) in which a quadric bends least; (0, 0) where it bends alike all around."""
    fall, twist = quadric[3] - quadric[5], quadric[4]
    if fall == 0.0 and twist == 0.0:
        return 0.0, 0.0
    angle = 0.5 * math.atan2(twist, fall)  # of the greatest second derivative
    if quadric[3] + quadric[5] > 0.0:
        angle += 0.5 * math.pi
    return math.cos(angle), math.sin(angle)


@kernel
def fit_scales(
    points,
    first,
    links,
    spacing,
    skip,
    sigma,
    bound,
    rows,
    near_sq,
    levels,
    strong,
    slack,
    variance,
    chosen,
    frame,
):
    """Fit the samples within sqrt(near_sq 2^l) spacings of each row, reached along links, for every level l below `levels`; where `strong`,
    below `levels` + `WIDER`, all of them over the plane of level 1.

    variance: of the distance to the quadric at each level [L^2], NaN where it is not determined. chosen: the widest level
    whose variance is below bound^2 (1 + slack sqrt(2 / freedom)), -1 where there is none. The next one, which is too wide, shows
    which way the surface bends least: that way the fit is made sqrt(2), 2, ... times as long, within the same bound. frame: of that fit
    `FRAME` numbers, in units of the spacing.
    """
    n = len(points)
    seen = np.full(n, -1, np.int64)
    near, distance, local = np.empty(CROWD, np.int64), np.empty(CROWD), np.zeros((CROWD, 3))
    moment = np.empty((levels + WIDER, MOMENTS))
    factor, half = np.empty((TERMS, TERMS)), np.empty(TERMS)
    solution, beyond = np.empty(TERMS), np.empty(TERMS)
    for row in range(len(rows)):
        i = rows[row]
        chosen[i] = -1
        depth = levels + WIDER if strong[i] else levels
        widest = near_sq * 2.0 ** (depth - 1)
        for level in range(depth):
            variance[row, level] = np.nan
        unit = spacing[i]
        if unit == 0.0 or skip[i]:
            continue
        noise_sq, most = (sigma[i] / unit) ** 2, (bound[i] / unit) ** 2
        reach = widest + (9.0 * noise_sq + 0.25 * widest)
        size = gather(points, first, links, skip, i, unit, reach, seen, near, distance, local)
        normal = plane(local, distance, size, 2.0 * near_sq if strong[i] else near_sq)
        turn(local, size, normal)
        add_rings(local, size, near_sq, noise_sq, depth, moment)
        frame[i, 0], frame[i, 1], frame[i, 2] = normal
        beyond[:] = 0.0
        for level in range(depth):
            if level > 0:
                for a in range(MOMENTS):
                    moment[level, a] += moment[level - 1, a]
            left = fit(moment, level, factor, half)
            if not left >= 0.0:
                continue
            variance[row, level] = left * unit * unit
            if within(left, moment[level, 0], most, slack):
                chosen[i] = level
                coefficients(factor, half, noise_sq, solution)
                beyond[:] = 0.0
            elif level == chosen[i] + 1:
                coefficients(factor, half, noise_sq, beyond)
        frame[i, 9], frame[i, 10], frame[i, 11] = 1.0, 0.0, 1.0
        if chosen[i] < 0:
            continue
        # longer where it bends least
        cos, sin = straightest(beyond)
        limit, longer_sq = near_sq * 2.0 ** chosen[i], 2.0
        while (cos != 0.0 or sin != 0.0) and limit * longer_sq <= widest:
            add_ellipse(local, size, cos, sin, longer_sq, limit, noise_sq, moment)
            left = fit(moment, 0, factor, half)
            if not (left >= 0.0 and within(left, moment[0, 0], most, slack)):
                break
            frame[i, 9], frame[i, 10], frame[i, 11] = cos, sin, longer_sq
            coefficients(factor, half, noise_sq, solution)
            longer_sq *= 2.0
        for a in range(TERMS):
            frame[i, 3 + a] = solution[a]


@kernel
def blend(points, first, links, spacing, skip, sigma, rows, near_sq, most, chosen, frame, move):
    """Where each row lies on the fits around it: the mean of their feet, near and wide fits counting more; displacements [L].

    A row asks itself, its neighbours and theirs, and those of these if nobody has a fit within `most` sigma: other fits are
    those of another sheet, or of what is beyond an edge. NaN where there is none within `RINGS`.
    """
    n = len(points)
    seen = np.full(n, -1, np.int64)
    queue = np.empty(CROWD, np.int64)
    for row in range(len(rows)):
        i = rows[row]
        move[row, 0] = move[row, 1] = move[row, 2] = np.nan
        if spacing[i] == 0.0 or skip[i]:
            continue
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        widest = (most * sigma[i]) ** 2
        queue[0], seen[i] = i, i
        start, stop = 0, 1
        total = mx = my = mz = 0.0
        for ring in range(RINGS):
            size = stop
            for at in range(start, stop):
                j = queue[at]
                for e in range(first[j], first[j + 1]):
                    q = links[e]
                    if seen[q] != i and not skip[q] and size < CROWD:
                        seen[q] = i
                        queue[size] = q
                        size += 1
            for at in range(0 if ring == 0 else stop, size):
                j = queue[at]
                if chosen[j] < 0:
                    continue
                unit = spacing[j]
                x, y, z = (px - points[j, 0]) / unit, (py - points[j, 1]) / unit, (pz - points[j, 2]) / unit
                nx, ny, nz = frame[j, 0], frame[j, 1], frame[j, 2]
                ux, uy, uz, vx, vy, vz = tangents_of(nx, ny, nz)
                u, v, h = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz, x * nx + y * ny + z * nz
                gu = frame[j, 4] + 2.0 * frame[j, 6] * u + frame[j, 7] * v
                gv = frame[j, 5] + frame[j, 7] * u + 2.0 * frame[j, 8] * v
                value = frame[j, 3] + frame[j, 4] * u + frame[j, 5] * v
                value += frame[j, 6] * u * u + frame[j, 7] * u * v + frame[j, 8] * v * v
                slope = 1.0 + gu * gu + gv * gv
                t = (value - h) / slope * unit
                off = t * t * slope / widest
                if not off < 1.0:
                    continue
                along, across = u * frame[j, 9] + v * frame[j, 10], v * frame[j, 9] - u * frame[j, 10]
                square, size_sq = along * along / frame[j, 11] + across * across, near_sq * 2.0 ** chosen[j]
                out = 4.0 * square / size_sq  # 1 halfway to the rim of the fit
                share = size_sq * math.sqrt(frame[j, 11]) / (1.0 + out * out) * (1.0 - off) ** 2
                total += share
                mx += share * t * (nx - gu * ux - gv * vx)
                my += share * t * (ny - gu * uy - gv * vy)
                mz += share * t * (nz - gu * uz - gv * vz)
            if total > 0.0 and ring > 0:
                move[row, 0], move[row, 1], move[row, 2] = mx / total, my / total, mz / total
                break
            start, stop = stop, size


@kernel
def normals_of(chosen, frame, normal):
    """Unit normals of fits at their samples; 0 where there is none."""
    for i in range(len(chosen)):
        normal[i, 0] = normal[i, 1] = normal[i, 2] = 0.0
        if chosen[i] < 0:
            continue
        nx, ny, nz = frame[i, 0], frame[i, 1], frame[i, 2]
        ux, uy, uz, vx, vy, vz = tangents_of(nx, ny, nz)
        g1, g2 = frame[i, 4], frame[i, 5]
        root = math.sqrt(1.0 + g1 * g1 + g2 * g2)
        normal[i, 0] = (nx - g1 * ux - g2 * vx) / root
        normal[i, 1] = (ny - g1 * uy - g2 * vy) / root
        normal[i, 2] = (nz - g1 * uz - g2 * vz) / root
