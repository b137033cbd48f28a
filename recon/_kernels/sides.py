"""Evidence of which side of the surface each cell lies on: how wide its facets stand open, and what its samples see.

A *node* is a cell of R or a ghost cell (one a hull facet, its fourth vertex the point at infinity, row n): with ghosts every
node has four neighbours. All sizes here are in units of the local spacing.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel

_BLOCK = 128  # facets at a time
ROUNDING = 2.0**-50  # error of a determinant of order 3, in units of the sum of the sizes of its terms


@kernel
def number_nodes(cells, neighbors, rank, first, last, nodes, links):
    """Fill in nodes (N, 4), vertices by rank (n,), and links (N, 4) for a range of the m cells; -1 on the hull."""
    for c in range(first, last):
        for k in range(4):
            nodes[c, k], links[c, k] = rank[cells[c, k]], neighbors[c, k]


@kernel
def close_hull(nodes, links, m, n):
    """Fill in a ghost for each facet of the hull, linked to its cell."""
    g = m
    for c in range(m):
        for k in range(4):
            if links[c, k] < 0:
                links[c, k] = g
                for j in range(4):
                    nodes[g, j] = nodes[c, j]
                nodes[g, k], links[g, k] = n, c
                g += 1


@kernel
def link_ghosts(nodes, links, m, n, first, last):
    """Fill in the links of a range of the ghosts to each other."""
    for g in range(m + first, m + last):
        k = 0
        while nodes[g, k] != n:
            k += 1
        for j in range(4):
            if j == k:
                continue
            # turn about the hull edge that faces (g, j) share, from the cell behind g to the next hull facet
            a, b = np.int32(-1), np.int32(-1)
            for i in range(4):
                if i != j and i != k:
                    if a < 0:
                        a = nodes[g, i]
                    else:
                        b = nodes[g, i]
            c = links[g, k]
            turn = nodes[g, j]
            while c < m:
                x = np.int32(0)
                while nodes[c, x] != turn:
                    x += 1
                for i in range(4):
                    v = nodes[c, i]
                    if v != a and v != b and v != turn:
                        fresh = v
                turn = fresh
                c = links[c, x]
            links[g, j] = c


@kernel
def spheres(points, weights, spacing, cells, first, last, centers, rho, depth):
    """Fill in orthocentres (m, 3), sizes rho (m,) [L^2] and depths (m,) of a range of cells.

    depth = sqrt(rho + mean w) / mean spacing.
    """
    for c in range(first, last):
        i, j, k, l = cells[c, 0], cells[c, 1], cells[c, 2], cells[c, 3]
        ox, oy, oz, ow = points[i, 0], points[i, 1], points[i, 2], weights[i]
        ax, ay, az = points[j, 0] - ox, points[j, 1] - oy, points[j, 2] - oz
        bx, by, bz = points[k, 0] - ox, points[k, 1] - oy, points[k, 2] - oz
        cx, cy, cz = points[l, 0] - ox, points[l, 1] - oy, points[l, 2] - oz
        ha = ax * ax + ay * ay + az * az - (weights[j] - ow)
        hb = bx * bx + by * by + bz * bz - (weights[k] - ow)
        hc = cx * cx + cy * cy + cz * cz - (weights[l] - ow)
        ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
        wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        rounding = abs(ax) * (abs(by * cz) + abs(bz * cy))
        rounding += abs(ay) * (abs(bz * cx) + abs(bx * cz)) + abs(az) * (abs(bx * cy) + abs(by * cx))
        # R says that the volume is positive: where that is lost in rounding, it still tells on what hand the centre is
        volume = max(ax * ux + ay * uy + az * uz, ROUNDING * rounding)
        half = 0.5 / volume
        x = (ha * ux + hb * vx + hc * wx) * half
        y = (ha * uy + hb * vy + hc * wy) * half
        z = (ha * uz + hb * vz + hc * wz) * half
        size = x * x + y * y + z * z - ow
        if not (size < 1e300):  # flat to the last bit: as good as a hull facet
            x, y, z, size = 0.0, 0.0, 0.0, 1e300
        centers[c, 0], centers[c, 1], centers[c, 2] = ox + x, oy + y, oz + z
        rho[c] = size
        h = (spacing[i] + spacing[j] + spacing[k] + spacing[l]) / 4
        mean = (weights[i] + weights[j] + weights[k] + weights[l]) / 4
        depth[c] = min(np.sqrt(max(size + mean, 0.0)) / h, 1e30)


@kernel(inline="late")
def _entry(ox, oy, oz, ow, ax, ay, az, aw, bx, by, bz, bw, px, py, pz, pw, qx, qy, qz, qw, smaller):
    """Size at which the facet (o, a, b) enters K_alpha: its own where p and q are no conflict, else its smaller cell's."""
    ax, ay, az, bx, by, bz = ax - ox, ay - oy, az - oz, bx - ox, by - oy, bz - oz
    ha = ax * ax + ay * ay + az * az - (aw - ow)
    hb = bx * bx + by * by + bz * bz - (bw - ow)
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    dx, dy, dz = ha * bx - hb * ax, ha * by - hb * ay, ha * bz - hb * az
    half = 0.5 / (nx * nx + ny * ny + nz * nz)
    x, y, z = (dy * nz - dz * ny) * half, (dz * nx - dx * nz) * half, (dx * ny - dy * nx) * half
    size = x * x + y * y + z * z - ow
    px, py, pz, qx, qy, qz = px - ox - x, py - oy - y, pz - oz - z, qx - ox - x, qy - oy - y, qz - oz - z
    attached = (px * px + py * py + pz * pz - pw < size) | (qx * qx + qy * qy + qz * qz - qw < size)
    return size if (size < smaller) & (not attached) else smaller


@kernel
def facet_sizes(points, weights, spacing, nodes, links, rho, first, last, gate, leak):
    """Fill in, for every (cell, k), `gate` (m, 4), the depth at which the facet opposite k closes, and `leak` (m, 4), closes above 0.

    A facet enters K_alpha at its own size where it is unattached, else with the smaller of its cells. Done are the facets
    whose lower cell is in the range, a block at a time, which become vector instructions.
    """
    m = len(gate)
    facets, beyond = np.empty(_BLOCK, np.int64), np.empty(_BLOCK, np.int64)
    corner, smaller, size = np.empty((20, _BLOCK)), np.empty(_BLOCK), np.empty(_BLOCK)
    mean, h = np.empty(_BLOCK), np.empty(_BLOCK)
    for start in range(first, last, _BLOCK // 4):
        count = 0
        for c in range(start, min(start + _BLOCK // 4, last)):
            for q in range(4):
                o = np.int64(links[c, q])
                if o < c:
                    continue
                facets[count], beyond[count], smaller[count] = 4 * c + q, -1, rho[c]
                for j in range(4):
                    v = nodes[c, (q + 1 + j) & 3]
                    corner[4 * j, count], corner[4 * j + 1, count] = points[v, 0], points[v, 1]
                    corner[4 * j + 2, count], corner[4 * j + 3, count] = points[v, 2], weights[v]
                i, j, k = nodes[c, (q + 1) & 3], nodes[c, (q + 2) & 3], nodes[c, (q + 3) & 3]
                h[count] = (spacing[i] + spacing[j] + spacing[k]) / 3
                mean[count] = (weights[i] + weights[j] + weights[k]) / 3
                if o < m:
                    s = 0
                    while links[o, s] != c:
                        s += 1
                    v = nodes[o, s]
                    beyond[count], smaller[count] = 4 * o + s, min(rho[c], rho[o])
                    corner[16, count], corner[17, count] = points[v, 0], points[v, 1]
                    corner[18, count], corner[19, count] = points[v, 2], weights[v]
                else:
                    for a in range(16, 20):  # nobody there: the corner on this side once more
                        corner[a, count] = corner[a - 4, count]
                count += 1
        x = corner
        for f in range(count):
            size[f] = _entry(
                x[0, f], x[1, f], x[2, f], x[3, f], x[4, f], x[5, f], x[6, f], x[7, f], x[8, f], x[9, f],
                x[10, f], x[11, f], x[12, f], x[13, f], x[14, f], x[15, f], x[16, f], x[17, f], x[18, f], x[19, f],
                smaller[f],
            )  # fmt: skip
        for f in range(count):
            width = np.float32(min(np.sqrt(max(size[f] + mean[f], 0.0)) / h[f], 1e30))
            gate[facets[f] >> 2, facets[f] & 3], leak[facets[f] >> 2, facets[f] & 3] = width, size[f] > 0
            if beyond[f] >= 0:
                gate[beyond[f] >> 2, beyond[f] & 3], leak[beyond[f] >> 2, beyond[f] & 3] = width, size[f] > 0


@kernel
def poles(points, nodes, links, centers, rho, depth, m):
    """For every sample the deepest node around it, the deepest on the opposite side (-1: none), and how sure that is.

    `trust` (n,) is the depth of the shallower of the two, times the cosine between the two directions.
    """
    n = len(points)
    N = len(nodes)
    outward = np.zeros((n, 3))
    bent = np.zeros(n, np.bool_)
    pole = np.full(n, -1, np.int32)
    anti = np.full(n, -1, np.int32)
    trust = np.zeros(n, np.float32)
    normals = np.empty((N - m, 3))
    for g in range(m, N):
        s = 0
        while links[g, s] >= m:
            s += 1
        c, t = links[g, s], 0
        while links[c, t] != g:
            t += 1
        i, j, k = nodes[c, (t + 1) & 3], nodes[c, (t + 2) & 3], nodes[c, (t + 3) & 3]
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        norm = np.sqrt(nx * nx + ny * ny + nz * nz)
        norm = -norm if t & 1 else norm  # cells are positive: in this order every other facet faces outward
        nx, ny, nz = nx / norm, ny / norm, nz / norm
        normals[g - m, 0], normals[g - m, 1], normals[g - m, 2] = nx, ny, nz
        for v in (i, j, k):
            outward[v, 0] += nx
            outward[v, 1] += ny
            outward[v, 2] += nz
            pole[v] = g
    for c in range(m):
        for q in range(4):
            v = nodes[c, q]
            if pole[v] < 0 or (pole[v] < m and rho[c] > rho[pole[v]]):
                pole[v] = c
    for g in range(m, N):
        for q in range(4):
            v = nodes[g, q]
            if v < n:
                ox, oy, oz, best = outward[v, 0], outward[v, 1], outward[v, 2], pole[v] - m
                along = normals[g - m, 0] * ox + normals[g - m, 1] * oy + normals[g - m, 2] * oz
                if along <= 0:
                    bent[v] = True  # the rim of a sheet: the hull turns back, both sides are outside
                if along > normals[best, 0] * ox + normals[best, 1] * oy + normals[best, 2] * oz:
                    pole[v] = g
    for v in range(n):
        if pole[v] >= 0 and pole[v] < m:
            for a in range(3):
                outward[v, a] = centers[pole[v], a] - points[v, a]
        norm = np.sqrt(outward[v, 0] ** 2 + outward[v, 1] ** 2 + outward[v, 2] ** 2)
        if norm > 0:
            for a in range(3):
                outward[v, a] /= norm
    for c in range(m):
        for q in range(4):
            v = nodes[c, q]
            if bent[v] or pole[v] == c:
                continue
            along = 0.0
            for a in range(3):
                along -= (centers[c, a] - points[v, a]) * outward[v, a]
            if along > trust[v]:
                trust[v] = along
                anti[v] = c
    for v in range(n):
        c = anti[v]
        if c >= 0:
            away = np.sqrt(
                (centers[c, 0] - points[v, 0]) ** 2
                + (centers[c, 1] - points[v, 1]) ** 2
                + (centers[c, 2] - points[v, 2]) ** 2
            )
            shallow = depth[c]
            if pole[v] < m:
                shallow = min(shallow, depth[pole[v]])
            trust[v] *= shallow / away
    return pole, anti, trust, normals
