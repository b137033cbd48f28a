"""What a union of balls leaves of a simplex, exactly: its parts within the power cells, each less one ball.

A part is a convex polytope, kept as directed edges, each with the face that it bounds, counter-clockwise seen from
outside. What a ball has of it is a signed sum over the cones from the centre to its faces, and in these over the
triangles from the foot of the centre to their edges: directions in which the face is within the ball, or beyond it.
All in closed form, whichever way the ball and the polytope lie.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel

_TWICE = 4  # crossings of one face by one plane that rounding may make


@kernel
def beyond(angle, height, distance, r):
    """Directions (solid angle) through a triangle up to an angle, less those within the disc of a ball of radius r.

    The triangle has its corner at the foot of the centre, which is `height` away; its far side is a line at `distance`.
    """
    away = math.hypot(height, distance)
    sine = math.sin(angle) * height / away if away > 0.0 else 0.0
    return angle * min(height / r, 1.0) - math.asin(min(max(sine, -1.0), 1.0))


@kernel
def sector(along, height, distance, r, d):
    """Volume and area of a ball over a right triangle: its corner at the foot of the centre, sides `distance`, `along`."""
    angle = math.atan2(along, distance)
    reach = math.sqrt(max(r - height, 0.0) * (r + height))
    edge = math.acos(distance / reach) if distance < reach else 0.0  # up to here the triangle is within the ball
    inner = min(max(angle, -edge), edge)
    flat = 0.5 * distance * (along if inner == angle else distance * math.tan(inner))
    flat += 0.5 * reach * reach * (angle - inner)
    if d == 2:
        return flat, r * (angle - inner)
    outer = beyond(angle, height, distance, r) - beyond(inner, height, distance, r)
    return height * flat / 3 + r * r * r * outer / 3, r * r * outer


@kernel
def ball_within(edges, face, count, r, d):
    """Volume and area that a ball of radius r at the origin has within a polytope."""
    volume, area, far = 0.0, 0.0, 0.0
    for e in range(count):
        far = max(far, edges[e, 0, 0] ** 2 + edges[e, 0, 1] ** 2 + edges[e, 0, 2] ** 2)
    for e in range(count):
        ax, ay, az = edges[e, 0, 0], edges[e, 0, 1], edges[e, 0, 2]
        ux, uy, uz = edges[e, 1, 0] - ax, edges[e, 1, 1] - ay, edges[e, 1, 2] - az
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        if length == 0.0 or (face[e, 0] == 0.0 and face[e, 1] == 0.0 and face[e, 2] == 0.0):
            continue
        ux, uy, uz = ux / length, uy / length, uz / length
        nx, ny, nz = face[e, 0], face[e, 1], face[e, 2]
        height = ax * nx + ay * ny + az * nz if d == 3 else 0.0
        # Out of the face's plane by the foot of the centre: the edge's side is n x u turned round.
        distance = ax * (uy * nz - uz * ny) + ay * (uz * nx - ux * nz) + az * (ux * ny - uy * nx)
        if far <= r * r:  # all of it
            volume += 0.5 * distance * length * (height / 3 if d == 3 else 1.0)
            continue
        start = ax * ux + ay * uy + az * uz
        far_volume, far_area = sector(start + length, abs(height), abs(distance), r, d)
        near_volume, near_area = sector(start, abs(height), abs(distance), r, d)
        turn = (1.0 if distance > 0 else -1.0) * (1.0 if height >= 0 or d == 2 else -1.0)
        volume += turn * (far_volume - near_volume)
        area += turn * (far_area - near_area)
    return volume, area


@kernel
def edges_of(balls, cell, edges, face):
    """Fill in the directed edges of a simplex, seen from its first corner, and the normals of their faces."""
    d, count = cell.size - 1, 0
    x = np.zeros((4, 3))
    for i in range(d + 1):
        for c in range(3):
            x[i, c] = balls[cell[i], c] - balls[cell[0], c]
    positive = False
    for slot in range(4 if d == 3 else 1):
        i, j, k = ((slot + 1) & 3, (slot + 2) & 3, (slot + 3) & 3) if d == 3 else (0, 1, 2)
        ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        vx, vy, vz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        if slot == 0:  # asked once, so that the faces of flat cells agree
            positive = nx * (x[0, 0] - x[i, 0]) + ny * (x[0, 1] - x[i, 1]) + nz * (x[0, 2] - x[i, 2]) > 0
            if d == 2:
                positive = nz < 0
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if positive != (slot & 1 == 1):
            j, k, length = k, j, -length
        for start, end in ((i, j), (j, k), (k, i)):
            edges[count, 0], edges[count, 1], face[count] = x[start], x[end], 0.0
            if length != 0.0:
                face[count, 0], face[count, 1], face[count, 2] = nx / length, ny / length, nz / length
            count += 1


@kernel
def cut(edges, face, owner, value, count, e, limit, q, d):
    """Keep of a polytope what has <e, x> <= limit; the new face is that of q. Returns the number of edges, or -1: no room.

    All crossings of one face are on one line, so that it does not matter which of them are paired.
    """
    ex, ey, ez = e[0], e[1], e[2]
    outside = 0
    for i in range(count):
        for k in range(2):
            value[i, k] = edges[i, k, 0] * ex + edges[i, k, 1] * ey + edges[i, k, 2] * ez - limit
            outside += value[i, k] > 0
    if outside == 0:
        return count
    if outside == 2 * count:
        return 0
    kept, known = 0, 0
    faces, ends, found = np.empty(count, np.int64), np.empty((count, 2, _TWICE, 3)), np.zeros((count, 2), np.int64)
    normals = np.empty((count, 3))
    for i in range(count):
        out0, out1 = value[i, 0] > 0, value[i, 1] > 0
        if out0 and out1:
            continue
        if out0 != out1:
            f = 0
            while f < known and faces[f] != owner[i]:
                f += 1
            if f == known:
                faces[f] = owner[i]
                for c in range(3):
                    normals[f, c] = face[i, c]
                known += 1
            outer = 0 if out0 else 1  # where the edge is outside: it comes back, or leaves
            share = value[i, 1 - outer] / (value[i, 1 - outer] - value[i, outer])
            side, place = 1 - outer, min(found[f, 1 - outer], _TWICE - 1)
            for c in range(3):
                inner = edges[i, 1 - outer, c]
                edges[i, outer, c] = ends[f, side, place, c] = inner + share * (edges[i, outer, c] - inner)
            found[f, side] = place + 1
        owner[kept] = owner[i]
        for c in range(3):
            edges[kept, 0, c], edges[kept, 1, c], face[kept, c] = edges[i, 0, c], edges[i, 1, c], face[i, c]
        kept += 1
    away = math.sqrt(ex * ex + ey * ey + ez * ez)
    for f in range(known):
        for i in range(min(found[f, 0], found[f, 1])):
            if kept + 2 > len(edges):
                return -1
            owner[kept], owner[kept + 1] = faces[f], q
            for c in range(3):
                edges[kept, 0, c], edges[kept, 1, c] = ends[f, 0, i, c], ends[f, 1, i, c]
                edges[kept + 1, 0, c], edges[kept + 1, 1, c] = ends[f, 1, i, c], ends[f, 0, i, c]
                face[kept, c], face[kept + 1, c] = normals[f, c], e[c] / away
            kept += 2 if d == 3 else 1
    return kept


@kernel
def balls_within(balls, cells, starts, beside, room, result):
    """Fill in volume and area (c, 2) that the union of all balls has within simplices; the number done, fewer for no room.

    `balls` are x, y, z and the squared radius, maybe negative; `beside[starts[p]:starts[p + 1]]` are the generators
    whose power cells share a facet with that of p.
    """
    n, d = len(balls), cells.shape[1] - 1
    edges, face, owner = np.empty((room, 2, 3)), np.empty((room, 3)), np.empty(room, np.int64)
    value, e, middle = np.empty((room, 2)), np.empty(3), np.empty(3)
    first, normal = np.empty((3 * (d + 1) if d == 3 else 3, 2, 3)), np.empty((3 * (d + 1) if d == 3 else 3, 3))
    seen, queue = np.full(n, -1), np.empty(n, np.int64)
    for t in range(len(cells)):
        cell = cells[t]
        edges_of(balls, cell, first, normal)
        for c in range(3):
            middle[c] = 0.0
            for i in range(d + 1):
                middle[c] += balls[cell[i], c] / (d + 1)
        p = nearest(balls, starts, beside, cell[0], middle)
        queue[0], seen[p] = p, t
        head, tail = 0, 1
        result[t] = 0.0
        while head < tail:
            p = queue[head]
            head += 1
            count = len(first)
            for i in range(count):
                owner[i] = -1 - i // 3
                for c in range(3):
                    shift = balls[cell[0], c] - balls[p, c]
                    edges[i, 0, c], edges[i, 1, c] = first[i, 0, c] + shift, first[i, 1, c] + shift
                    face[i, c] = normal[i, c]
            for i in range(starts[p], starts[p + 1]):
                q = beside[i]
                for c in range(3):
                    e[c] = balls[q, c] - balls[p, c]
                limit = 0.5 * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + balls[p, 3] - balls[q, 3])
                count = cut(edges, face, owner, value, count, e, limit, i, d)
                if count <= 0:
                    break
            if count < 0:
                return t
            if d == 3:
                for i in range(count):
                    if owner[i] >= 0 and seen[beside[owner[i]]] != t:
                        seen[beside[owner[i]]] = t
                        queue[tail] = beside[owner[i]]
                        tail += 1
            elif count > 0:  # in the plane edges of all neighbours have one face: ask all of them
                for i in range(starts[p], starts[p + 1]):
                    if seen[beside[i]] != t:
                        seen[beside[i]] = t
                        queue[tail] = beside[i]
                        tail += 1
            if count > 0 and balls[p, 3] > 0:
                volume, area = ball_within(edges, face, count, math.sqrt(balls[p, 3]), d)
                result[t, 0] += volume
                result[t, 1] += area
    return len(cells)


@kernel
def nearest(balls, starts, beside, p, x):
    """Walk to the generator of least power distance."""
    while True:
        better = p
        for i in range(starts[p], starts[p + 1]):
            q = beside[i]
            gap = balls[p, 3] - balls[q, 3]  # twice the power of p over that of q
            for c in range(3):
                gap -= (2 * x[c] - balls[p, c] - balls[q, c]) * (balls[q, c] - balls[p, c])
            if gap < 0:
                better = q
                break
        if better == p:
            return p
        p = better
