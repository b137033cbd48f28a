"""Least squares quadrics: h = a0 + a1 u + a2 v + a3 u^2/2 + a4 uv + a5 v^2/2 over the tangent plane of every sample."""

from __future__ import annotations

import math

import numpy as np

from recon._kernels.compile import kernel

from ._frame import plane_normal, tangents_of

TERMS = 6
SOFT = 1.0  # how much less the farthest neighbour counts
SINGULAR = 1e-9  # a term that the others explain up to this share of it has no coefficient of its own


@kernel
def fit_quadrics(points, start, stop, index, distance, k, normal, principal, error, misfit, freedom):
    """Fit the k neighbours of samples start..stop: unit normals, principal curvatures, their standard errors.

    `misfit` / `freedom` is the unbiased variance of the distance to the quadric. Larger curvature (by magnitude) first.
    Source: weighted least squares, sandwich covariance (White 1980); the normal curvature is stationary, so only the
    second derivatives carry its error.
    """
    basis, gram, gram_sq = np.empty(TERMS), np.empty((TERMS, TERMS)), np.empty((TERMS, TERMS))
    factor, inverse = np.empty((TERMS, TERMS)), np.empty((TERMS, TERMS))
    moment, solution, kept = np.empty(TERMS), np.empty(TERMS), np.empty(TERMS, np.bool_)
    second, spread = np.empty((3, TERMS)), np.empty((3, 3))
    for i in range(start, stop):
        normal[i, 0], normal[i, 1], normal[i, 2] = 0.0, 0.0, 1.0
        principal[i, 0] = principal[i, 1] = 0.0
        error[i, 0] = error[i, 1] = np.inf
        misfit[i] = freedom[i] = 0.0
        unit = distance[i, k - 1] if k > 0 else 0.0
        if unit == 0.0:
            continue
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        # tangent plane
        total = 1.0
        sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
        for j in range(k):
            q = index[i, j]
            x, y, z = (points[q, 0] - px) / unit, (points[q, 1] - py) / unit, (points[q, 2] - pz) / unit
            share = 1.0 - SOFT * (x * x + y * y + z * z)
            total += share
            sx, sy, sz = sx + share * x, sy + share * y, sz + share * z
            xx, xy, xz = xx + share * x * x, xy + share * x * y, xz + share * x * z
            yy, yz, zz = yy + share * y * y, yz + share * y * z, zz + share * z * z
        nx, ny, nz = plane_normal(total, sx, sy, sz, xx, xy, xz, yy, yz, zz)
        ux, uy, uz, vx, vy, vz = tangents_of(nx, ny, nz)
        # normal equations
        for a in range(TERMS):
            moment[a] = 0.0
            for b in range(a + 1):
                gram[a, b] = gram_sq[a, b] = 0.0
        gram[0, 0] = gram_sq[0, 0] = total = 1.0  # the sample itself
        square = 0.0
        for j in range(k):
            q = index[i, j]
            x, y, z = (points[q, 0] - px) / unit, (points[q, 1] - py) / unit, (points[q, 2] - pz) / unit
            u, v, h = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz, x * nx + y * ny + z * nz
            share = 1.0 - SOFT * (x * x + y * y + z * z)
            total += share
            square += share * h * h
            basis[0], basis[1], basis[2] = 1.0, u, v
            basis[3], basis[4], basis[5] = 0.5 * u * u, u * v, 0.5 * v * v
            for a in range(TERMS):
                scaled = share * basis[a]
                moment[a] += scaled * h
                for b in range(a + 1):
                    gram[a, b] += scaled * basis[b]
                    gram_sq[a, b] += share * scaled * basis[b]
        # Cholesky; terms without an own direction are left out
        for a in range(TERMS):
            kept[a] = True
            for b in range(a + 1):
                value = gram[a, b]
                for c in range(b):
                    value -= factor[a, c] * factor[b, c]
                if b < a:
                    factor[a, b] = value / factor[b, b] if kept[b] else 0.0
                elif value > SINGULAR * gram[a, a]:
                    factor[a, a] = math.sqrt(value)
                else:
                    kept[a] = False
                    for c in range(a):
                        factor[a, c] = 0.0
        for column in range(TERMS):  # inverse of the factor, lower triangle
            for a in range(TERMS):
                value = 1.0 if a == column else 0.0
                for c in range(column, a):
                    value -= factor[a, c] * inverse[c, column]
                inverse[a, column] = value / factor[a, a] if kept[a] and kept[column] and a >= column else 0.0
        explained = 0.0
        for a in range(TERMS):
            value = 0.0
            for b in range(a + 1):
                value += inverse[a, b] * moment[b]
            basis[a] = value
            explained += value * value
        used = 0.0  # trace of gram^-1 gram_sq
        for a in range(TERMS):
            value = 0.0
            for b in range(a, TERMS):
                value += inverse[b, a] * basis[b]
            solution[a] = value
            for b in range(a + 1):
                for c in range(b + 1):
                    twice = 1.0 if b == c else 2.0
                    used += twice * inverse[a, b] * inverse[a, c] * gram_sq[b, c]
        misfit[i] = max(square - explained, 0.0) * unit * unit
        freedom[i] = total - used
        # covariance of the second derivatives: gram^-1 gram_sq gram^-1, rows and columns 3..5
        variance = misfit[i] / freedom[i] / (unit * unit) if freedom[i] > SINGULAR * total else np.inf
        known = kept[3] and kept[4] and kept[5] and variance < np.inf
        for a in range(3):
            for b in range(TERMS):
                value = 0.0
                for c in range(max(a + 3, b), TERMS):
                    value += inverse[c, a + 3] * inverse[c, b]
                second[a, b] = value  # row a + 3 of gram^-1
        for a in range(3):
            for b in range(a + 1):
                value = 0.0
                for c in range(TERMS):
                    for d in range(TERMS):
                        value += second[a, c] * second[b, d] * gram_sq[max(c, d), min(c, d)]
                spread[a, b] = spread[b, a] = value
        if freedom[i] <= SINGULAR * total:
            freedom[i] = misfit[i] = 0.0
        # fundamental forms at the sample
        g1, g2 = solution[1], solution[2]
        slope = 1.0 + g1 * g1 + g2 * g2
        root = math.sqrt(slope)
        e1, e2, e3 = 1.0 + g1 * g1, g1 * g2, 1.0 + g2 * g2
        f1, f2, f3 = solution[3] / root, solution[4] / root, solution[5] / root
        mean = 0.5 * (e1 * f3 - 2.0 * e2 * f2 + e3 * f1) / slope
        gauss = (f1 * f3 - f2 * f2) / slope
        split = math.sqrt(max(mean * mean - gauss, 0.0))
        larger = mean + math.copysign(split, mean)
        smaller = 2.0 * mean - larger
        for which in range(2):
            value = larger if which == 0 else smaller
            a, b, c = f1 - value * e1, f2 - value * e2, f3 - value * e3  # its null vector is the direction
            t1, t2 = (-b, a) if abs(a) + abs(b) >= abs(b) + abs(c) else (c, -b)
            if t1 == 0.0 and t2 == 0.0:
                t1, t2 = (1.0, 0.0) if which == 0 else (0.0, 1.0)
            size = (e1 * t1 * t1 + 2.0 * e2 * t1 * t2 + e3 * t2 * t2) * root
            w0, w1, w2 = t1 * t1 / size, 2.0 * t1 * t2 / size, t2 * t2 / size
            form = (
                w0 * w0 * spread[0, 0]
                + w1 * w1 * spread[1, 1]
                + w2 * w2 * spread[2, 2]
                + 2.0 * (w0 * w1 * spread[0, 1] + w0 * w2 * spread[0, 2] + w1 * w2 * spread[1, 2])
            )
            principal[i, which] = value / unit
            bias = 0.2 * abs(value) * larger * larger  # a sphere's fourth order, seen through these weights
            error[i, which] = math.sqrt(variance * max(form, 0.0) + bias * bias) / unit if known else np.inf
        normal[i, 0] = (nx - g1 * ux - g2 * vx) / root
        normal[i, 1] = (ny - g1 * uy - g2 * vy) / root
        normal[i, 2] = (nz - g1 * uz - g2 * vz) / root
