"""Which facets the samples of a sheet see as part of it: those whose dual edge crosses the tangent plane.

The power cell of a sample cuts a convex polygon out of its tangent plane. The corners of the polygon are dual to facets of R, and
these go around the sample once: one umbrella. (Restricted to tangent planes: Boissonnat & Ghosh 2014, tangential
complexes.) A facet is part of a sheet where its corners agree. Nothing global is decided here, so sheets may have boundaries,
meet space on one side only, or have no sides at all, as a Moebius band. All heights are in local spacings.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .forest import each_facet

NEAR = 2.5  # neighbours of a sample on its sheet are nearer than this [local spacings]
FLAT = 0.5  # cells whose centre is closer to the tangent plane are on the side where their other corners see it
FAR = np.float32(5)  # trust and heights beyond are as good as this


@kernel
def axes(points, spacing, nodes, centers, pole, anti, trust, m):
    """Normal of each sample, up to sign: from the poles (n, 3); trust in it (n,); and the tensor (n, 3, 3) of its neighbours'."""
    n = len(points)
    axis, sure, tensor = np.zeros((n, 3)), np.zeros(n), np.zeros((n, 3, 3))
    for v in range(n):
        c = pole[v] if pole[v] < m else anti[v]
        if c < 0:
            continue
        length = 0.0
        for a in range(3):
            axis[v, a] = centers[c, a] - points[v, a]
            length += axis[v, a] ** 2
        if length > 0:
            length = np.sqrt(length)
            for a in range(3):
                axis[v, a] /= length
            sure[v] = 1e-3 + min(trust[v], FAR)
    for c in range(m):
        for i in range(4):
            v = nodes[c, i]
            for j in range(4):
                u = nodes[c, j]
                apart = 0.0
                for a in range(3):
                    apart += (points[u, a] - points[v, a]) ** 2
                if apart <= (NEAR * spacing[v]) ** 2:
                    for a in range(3):
                        for b in range(3):
                            tensor[v, a, b] += sure[u] * axis[u, a] * axis[u, b]
    return axis, sure, tensor


@kernel
def heights(points, spacing, cells, centers, axis):
    """Height of each cell's centre above the tangent planes of its corners (m, 4): positive on the side of the axis.

    Near a tangent plane the corners vote: the mean of their heights, each turned as its axis to that of the corner.
    """
    m = len(cells)
    height = np.empty((m, 4), np.float32)
    own, vote = np.empty(4), np.empty(4)
    for c in range(m):
        for i in range(4):
            v = cells[c, i]
            own[i] = 0.0
            for a in range(3):
                own[i] += (centers[c, a] - points[v, a]) * axis[v, a]
            own[i] = min(max(own[i] / spacing[v], -FAR), FAR)
            vote[i] = min(max(own[i], -1.0), 1.0)
        for i in range(4):
            v = cells[c, i]
            if abs(own[i]) >= FLAT:
                height[c, i] = own[i]
                continue
            total = 0.0
            for j in range(4):
                u = cells[c, j]
                cosine = axis[v, 0] * axis[u, 0] + axis[v, 1] * axis[u, 1] + axis[v, 2] * axis[u, 2]
                total += cosine * vote[j]
            height[c, i] = total
    return height


@kernel
def sheet_evidence(nodes, links, gate, axis, normals, height, widest):
    """All facets once, as 4 * node + corner, or ~(4 * node + corner) where they lie between opposite sides; and how sure that is.

    Facets that all corners agree on come first, then those in doubt, and last those too wide for a sheet: where no side is
    consistent, as around a boundary, it is out there that the sides meet.
    """
    m = len(height)
    facets = each_facet(links, m)
    keys = np.empty(len(facets), np.float32)
    for f in range(len(facets)):
        c, k = np.int64(facets[f] >> 2), facets[f] & 3
        o = np.int64(links[c, k])
        votes, margin = 0, FAR
        for i in range(4):
            v = nodes[c, i]
            if i == k:
                continue
            here, there = height[c, i], np.float32(0)
            if o < m:
                j = 0
                while nodes[o, j] != v:
                    j += 1
                there = height[o, j]
            else:
                for a in range(3):
                    there += FAR * normals[o - m, a] * axis[v, a]
            votes += (here > 0) != (there > 0)
            margin = min(margin, min(abs(here), abs(there)))
        if gate[c, k] > widest:
            keys[f] = np.float32(1e-6) / gate[c, k]
        elif votes == 0 or votes == 3:
            keys[f] = np.float32(1) + margin
        else:
            keys[f] = np.float32(1e-3) * margin
        if votes >= 2:
            facets[f] = ~facets[f]
    return facets, keys
