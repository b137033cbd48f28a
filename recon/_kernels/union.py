"""Disjoint sets: a forest of parents, a root its own parent."""

from __future__ import annotations

import numpy as np

from .compile import kernel


@kernel(inline="always")
def root(parent, x):
    """Root of x, the way there halved."""
    while parent[x] != x:
        parent[x] = parent[parent[x]]
        x = np.int64(parent[x])
    return x
