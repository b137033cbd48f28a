"""Loops over neighbour lists. Arrays in, arrays out; nothing is validated here."""

from __future__ import annotations

import numpy as np

from recon._kernels.compile import kernel


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
