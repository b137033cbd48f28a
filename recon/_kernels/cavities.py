"""What a union of balls leaves of a simplex, exactly: its parts within the power cells, each less one ball.

A part is a convex polytope, kept as directed edges, counter-clockwise around their faces as seen from outside: rows 0 to 2
of an array are where they start, rows 3 to 5 where they stop. What a ball has of it is a signed sum over the cones from the
centre to its faces, and in these over the triangles from the foot of the centre to their edges: directions in which the
face is within the ball, or beyond it. All in closed form, whichever way the ball and the polytope lie.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .spacefill import TOUCH

_TWICE = 4  # crossings of one face by one plane that rounding may make
_OWN = 4  # faces of the simplex, before those of the neighbours


@kernel
def fan(start, stop, height, distance, r, d):
    """Angle at the foot of the centre under a piece of a line, and directions of the ball that miss the triangle there.

    The line is at `distance` from the foot, which is at `height`; the piece lies beyond the ball. Angles from their
    tangents, two at a time.
    """
    angle = math.atan2(distance * (stop - start), distance * distance + start * stop)
    if d == 2:
        return angle, angle
    base = height * height + distance * distance
    a, b = distance * math.sqrt(base + start * start), distance * math.sqrt(base + stop * stop)
    tilt = math.atan2(height * (stop * a - start * b), a * b + height * height * start * stop)
    return angle, angle * min(height / r, 1.0) - tilt


@kernel
def sector(start, stop, height, distance, r, d):
    """Volume and area of a ball over a triangle: a corner at the foot of the centre, opposite a piece of a line."""
    if distance == 0.0:
        return 0.0, 0.0
    reach = math.sqrt(max(r - height, 0.0) * (r + height))  # of the ball in the face's plane
    slack = reach - distance
    half = math.sqrt(slack * (reach + distance)) if slack > TOUCH * r else 0.0  # of its chord
    low, high = min(max(start, -half), half), min(max(stop, -half), half)
    angle, outer = 0.0, 0.0
    if low == high:
        angle, outer = fan(start, stop, height, distance, r, d)
    else:
        if start < low:
            angle, outer = fan(start, low, height, distance, r, d)
        if high < stop:
            more, further = fan(high, stop, height, distance, r, d)
            angle, outer = angle + more, outer + further
    flat = 0.5 * distance * (high - low) + 0.5 * reach * reach * angle
    if d == 2:
        return flat, r * angle
    return height * flat / 3 + r * r * r * outer / 3, r * r * outer


@kernel
def ball_within(edges, owner, normals, count, r, d):
    """Volume and area that a ball of radius r at the origin has within a polytope."""
    volume, area = 0.0, 0.0
    for i in range(count):
        nx, ny, nz = normals[owner[i], 0], normals[owner[i], 1], normals[owner[i], 2]
        ax, ay, az = edges[0, i], edges[1, i], edges[2, i]
        ux, uy, uz = edges[3, i] - ax, edges[4, i] - ay, edges[5, i] - az
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        if length == 0.0 or (nx == 0.0 and ny == 0.0 and nz == 0.0):
            continue
        ux, uy, uz = ux / length, uy / length, uz / length
        height = ax * nx + ay * ny + az * nz if d == 3 else 0.0
        # Out of the face's plane by the foot of the centre: the edge's side is n x u turned round.
        distance = ax * (uy * nz - uz * ny) + ay * (uz * nx - ux * nz) + az * (ux * ny - uy * nx)
        start = ax * ux + ay * uy + az * uz
        more, wider = sector(start, start + length, abs(height), abs(distance), r, d)
        turn = (1.0 if distance > 0 else -1.0) * (1.0 if height >= 0 or d == 2 else -1.0)
        volume += turn * more
        area += turn * wider
    return volume, area


@kernel
def edges_of(balls, cell, edges, owner, normals):
    """Fill in the directed edges of a simplex, seen from its first corner, and the normals of its faces."""
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
        normals[slot] = 0.0
        if length != 0.0:
            normals[slot, 0], normals[slot, 1], normals[slot, 2] = nx / length, ny / length, nz / length
        for start, stop in ((i, j), (j, k), (k, i)):
            owner[count] = slot
            for c in range(3):
                edges[c, count], edges[3 + c, count] = x[start, c], x[stop, c]
            count += 1


@kernel
def cut(edges, owner, count, e, limit, face, d, scratch):
    """Keep of a polytope what has <e, x> <= limit, with a new face. Returns the number of edges, or -1: no room.

    All crossings of one face are on one line, so that it does not matter which of them are paired. `scratch` is room for
    the values where edges start and stop, and for faces that are crossed, how often each way, and where.
    """
    value, faces, found, ends = scratch
    ex, ey, ez = e[0], e[1], e[2]
    outside = 0
    for i in range(count):
        value[0, i] = edges[0, i] * ex + edges[1, i] * ey + edges[2, i] * ez - limit
        outside += value[0, i] > 0.0
    if outside == 0:
        return count
    if outside == count:
        return 0
    for i in range(count):
        value[1, i] = edges[3, i] * ex + edges[4, i] * ey + edges[5, i] * ez - limit
    kept, known = 0, 0
    for i in range(count):
        out = value[0, i] > 0.0, value[1, i] > 0.0
        if out[0] and out[1]:
            continue
        if out[0] != out[1]:
            f = 0
            while f < known and faces[f] != owner[i]:
                f += 1
            if f == known:
                faces[f], found[f, 0], found[f, 1] = owner[i], 0, 0
                known += 1
            outer = 0 if out[0] else 1  # where the edge is outside: it comes back, or leaves
            side = 1 - outer
            share, place = value[side, i] / (value[side, i] - value[outer, i]), min(found[f, side], _TWICE - 1)
            for c in range(3):
                inner = edges[3 * side + c, i]
                edges[3 * outer + c, i] = ends[f, side, place, c] = inner + share * (edges[3 * outer + c, i] - inner)
            found[f, side] = place + 1
        if kept != i:
            owner[kept] = owner[i]
            for c in range(6):
                edges[c, kept] = edges[c, i]
        kept += 1
    for f in range(known):
        for i in range(min(found[f, 0], found[f, 1])):
            if kept + 2 > owner.size:
                return -1
            owner[kept], owner[kept + 1] = faces[f], face
            for c in range(3):
                edges[c, kept] = edges[3 + c, kept + 1] = ends[f, 0, i, c]
                edges[3 + c, kept] = edges[c, kept + 1] = ends[f, 1, i, c]
            kept += 2 if d == 3 else 1
    return kept


@kernel
def balls_within(balls, cells, starts, beside, room, result):
    """Fill in volume and area (c, 2) that the union of all balls has within simplices; the number done, fewer for no room.

    `balls` are x, y, z and the squared radius, maybe negative; `beside[starts[p]:starts[p + 1]]` are the generators
    whose power cells share a facet with that of p.
    """
    n, d = len(balls), cells.shape[1] - 1
    edges, owner = np.empty((6, room)), np.empty(room, np.int64)
    faces, found, ends = np.empty(room, np.int64), np.empty((room, 2), np.int64), np.empty((room, 2, _TWICE, 3))
    scratch = np.empty((2, room)), faces, found, ends
    most = 0
    for p in range(n):
        most = max(most, starts[p + 1] - starts[p])
    normals, e, middle = np.zeros((_OWN + most, 3)), np.empty(3), np.empty(3)
    sides = 12 if d == 3 else 3
    first, bounds = np.empty((6, sides)), np.empty(sides, np.int64)
    seen, queue = np.full(n, -1, np.int32), np.empty(n, np.int32)
    for t in range(len(cells)):
        cell = cells[t]
        edges_of(balls, cell, first, bounds, normals)
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
            count = sides
            for i in range(sides):
                owner[i] = bounds[i]
                for c in range(3):
                    shift = balls[cell[0], c] - balls[p, c]
                    edges[c, i], edges[3 + c, i] = first[c, i] + shift, first[3 + c, i] + shift
            for i in range(starts[p], starts[p + 1]):
                q, face = beside[i], _OWN + i - starts[p]
                for c in range(3):
                    e[c] = balls[q, c] - balls[p, c]
                away_sq = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
                for c in range(3):
                    normals[face, c] = e[c] / math.sqrt(away_sq)
                limit = 0.5 * (away_sq + balls[p, 3] - balls[q, 3])
                count = cut(edges, owner, count, e, limit, face, d, scratch)
                if count <= 0:
                    break
            if count < 0:
                return t
            if d == 3:
                for i in range(count):
                    if owner[i] >= _OWN and seen[beside[starts[p] + owner[i] - _OWN]] != t:
                        q = beside[starts[p] + owner[i] - _OWN]
                        seen[q] = t
                        queue[tail] = q
                        tail += 1
            elif count > 0:  # in the plane edges of all neighbours have one face: ask all of them
                for i in range(starts[p], starts[p + 1]):
                    if seen[beside[i]] != t:
                        seen[beside[i]] = t
                        queue[tail] = beside[i]
                        tail += 1
            if count > 0 and balls[p, 3] > 0:
                volume, area = ball_within(edges, owner, normals, count, math.sqrt(balls[p, 3]), d)
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
