"""The flat that points span."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .predicates import orient2d, orient3d


@kernel
def gather(points, weights, order):
    """Points and weights side by side, in order."""
    n = order.size
    vertices = np.empty((n, 4))
    for i in range(n):
        row = order[i]
        vertices[i, 0], vertices[i, 1], vertices[i, 2] = points[row, 0], points[row, 1], points[row, 2]
        vertices[i, 3] = weights[row]
    return vertices


@kernel
def span(points):
    """Dimension of the flat that points span, as many + 1 rows that make a positive cell in it, and the axes to use.

    The flat is mapped one-to-one to the first of these axes if it is a line, to the first two if it is a plane.
    """
    n = points.shape[0]
    simplex = np.zeros(4, np.int64)
    axes = np.arange(3)
    a, b = points[0], 1
    while b < n and a[0] == points[b, 0] and a[1] == points[b, 1] and a[2] == points[b, 2]:
        b += 1
    if b == n:
        return 0, simplex, axes
    p = points[b]
    simplex[1] = b
    u = 0
    while a[u] == p[u]:
        u += 1
    for k in range(3):
        axes[k] = (u + k) % 3

    s, c = 0, b
    while s == 0 and c + 1 < n:
        c += 1
        q = points[c]
        for t in (2, 1, 0):  # the axis to look along
            u, v = (0 if t > 0 else 1), (2 if t < 2 else 1)
            s = orient2d(a[u], a[v], p[u], p[v], q[u], q[v])
            if s != 0:
                axes[0], axes[1], axes[2] = u, v, t
                break
    if s == 0:
        return 1, simplex, axes
    simplex[0], simplex[1] = (0, b) if s > 0 else (b, 0)
    simplex[2] = c

    q = points[c]
    s, e = 0, c
    while s == 0 and e + 1 < n:
        e += 1
        s = orient3d(a[0], a[1], a[2], p[0], p[1], p[2], q[0], q[1], q[2], points[e, 0], points[e, 1], points[e, 2])
    if s == 0:
        return 2, simplex, axes
    simplex[0], simplex[1] = (0, b) if s > 0 else (b, 0)
    simplex[3] = e
    return 3, simplex, np.arange(3)
