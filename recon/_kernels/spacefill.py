"""The pieces that inclusion-exclusion over the dual complex K sums (Edelsbrunner 1995): a ball cut by 1, 2 or 3 planes.

The piece of ball p in a simplex T is the part of B_p that is nearer, in power, to every other vertex of T than to p. The
pieces of a simplex tile the intersection of its balls; signed and summed over K they leave of B_p what lies in its power
cell. Precondition: sizes of T and its faces at most zero, that is, the bisecting planes meet in the ball. Then each
piece is bounded by one spherical polygon without holes: its area is an angle sum (Gauss and Bonnet), its volume follows
(divergence). Where rounding moves a meeting point out of the ball it is put back on its boundary, the limit case.

Rows of `balls` are x, y, z and the squared radius. A piece is (volume, area of its spherical part).
"""

from __future__ import annotations

import math

from .compile import kernel

TOUCH = 2.0**-49  # what rounding may make of tangency, in radii: a chord of its root would spoil the areas


@kernel
def chord(reach, distance):
    """Half the chord that a line at a distance cuts from a circle of radius `reach`, and the distance, put in range."""
    if distance != distance:  # 0 / 0: the planes coincide
        distance = 0.0
    if abs(distance) >= reach * (1.0 - TOUCH):
        return 0.0, math.copysign(reach, distance)
    return math.sqrt((reach - distance) * (reach + distance)), distance


@kernel
def meet(hi, hj, r, cosine, sine):
    """Where planes at distances hi, hj from the centre meet in a ball of radius r, their normals at an angle.

    Gives half the common chord; its distance from the centres of discs i and j; half the arcs of the two circles beyond
    it; the turn of the circles at its ends. The turn comes from the arcs and the excess of the spherical triangle of
    both normals and one end, so that it fits them where a disc is hardly more than a point. A normal that points away
    from the end by more than a right angle is turned round, which leaves no 0 / 0.
    """
    reach, hi = chord(r, hi)
    half, di = chord(reach, (hj - hi * cosine) / sine)
    dj = hi * sine - di * cosine
    arc_i, arc_j = math.atan2(half, di), math.atan2(half, dj)
    across = -cosine if (hi < 0) != (hj < 0) else cosine
    excess = 2 * math.atan2(half * sine, r + r * across + abs(hi) + abs(hj))
    if hi < 0 and hj < 0:
        excess += 2 * (arc_i + arc_j - math.pi)
    elif hi < 0:
        excess = 2 * arc_i - excess
    elif hj < 0:
        excess = 2 * arc_j - excess
    return half, di, dj, arc_i, arc_j, math.pi - arc_i - arc_j + excess


@kernel
def corner(ix, iy, iz, jx, jy, jz, kx, ky, kz, hi, hk, half, di, cosine, sine):
    """Where three planes meet in a ball: on the line of planes i and j, no further from its middle than half the chord.

    Normals i, j, k; distances from the centre of planes i and k; the chord, its distance in disc i, angle of i and j.
    """
    a, b = hi - di * cosine / sine, di / sine
    x, y, z = a * ix + b * jx, a * iy + b * jy, a * iz + b * jz
    ux, uy, uz = (iy * jz - iz * jy) / sine, (iz * jx - ix * jz) / sine, (ix * jy - iy * jx) / sine
    along = (hk - x * kx - y * ky - z * kz) / (ux * kx + uy * ky + uz * kz)
    if along != along:  # 0 / 0: the three planes share the line, any point of it will do
        along = 0.0
    along = min(max(along, -half), half)
    return x + along * ux, y + along * uy, z + along * uz


@kernel
def beyond(half, x, y, z, ux, uy, uz, sine):
    """Length of a chord beyond the corner, in the direction u / sine."""
    return half - min(max((x * ux + y * uy + z * uz) / sine, -half), half)


@kernel
def caps(balls, edges, pieces):
    """Fill in the pieces (s, 2, 2) of edges: caps."""
    for e in range(len(edges)):
        for a in range(2):
            p, q = edges[e, a], edges[e, 1 - a]
            x, y, z = balls[q, 0] - balls[p, 0], balls[q, 1] - balls[p, 1], balls[q, 2] - balls[p, 2]
            length = math.sqrt(x * x + y * y + z * z)
            r = math.sqrt(balls[p, 3])
            h = 0.5 * (length + (balls[p, 3] - balls[q, 3]) / length)
            height = min(max(r - h, 0.0), 2 * r)
            pieces[e, a, 0] = math.pi / 3 * height * height * (3 * r - height)
            pieces[e, a, 1] = 2 * math.pi * r * height


@kernel
def double_caps(balls, triangles, pieces):
    """Fill in the pieces (s, 3, 2) of triangles: a ball beyond two planes."""
    for t in range(len(triangles)):
        for a in range(3):
            p, i, j = triangles[t, a], triangles[t, (a + 1) % 3], triangles[t, (a + 2) % 3]
            px, py, pz, wp = balls[p, 0], balls[p, 1], balls[p, 2], balls[p, 3]
            ix, iy, iz = balls[i, 0] - px, balls[i, 1] - py, balls[i, 2] - pz
            jx, jy, jz = balls[j, 0] - px, balls[j, 1] - py, balls[j, 2] - pz
            li, lj = math.sqrt(ix * ix + iy * iy + iz * iz), math.sqrt(jx * jx + jy * jy + jz * jz)
            cx, cy, cz = iy * jz - iz * jy, iz * jx - ix * jz, ix * jy - iy * jx
            cosine = (ix * jx + iy * jy + iz * jz) / (li * lj)
            sine = math.sqrt(cx * cx + cy * cy + cz * cz) / (li * lj)
            r = math.sqrt(wp)
            hi, hj = 0.5 * (li + (wp - balls[i, 3]) / li), 0.5 * (lj + (wp - balls[j, 3]) / lj)
            half, di, dj, arc_i, arc_j, turn = meet(hi, hj, r, cosine, sine)
            angle_i, angle_j = 2 * arc_i, 2 * arc_j
            area = r * (r * (2 * math.pi - 2 * turn) - angle_i * hi - angle_j * hj)
            disc_i = 0.5 * (r - hi) * (r + hi) * angle_i - di * half
            disc_j = 0.5 * (r - hj) * (r + hj) * angle_j - dj * half
            pieces[t, a, 0] = (r * area - hi * disc_i - hj * disc_j) / 3
            pieces[t, a, 1] = area


@kernel
def triple_caps(balls, tetrahedra, pieces):
    """Fill in the pieces (s, 4, 2) of tetrahedra: a ball beyond three planes that meet in it."""
    for t in range(len(tetrahedra)):
        for a in range(4):
            p = tetrahedra[t, a]
            i, j, k = tetrahedra[t, (a + 1) & 3], tetrahedra[t, (a + 2) & 3], tetrahedra[t, (a + 3) & 3]
            px, py, pz, wp = balls[p, 0], balls[p, 1], balls[p, 2], balls[p, 3]
            ix, iy, iz = balls[i, 0] - px, balls[i, 1] - py, balls[i, 2] - pz
            jx, jy, jz = balls[j, 0] - px, balls[j, 1] - py, balls[j, 2] - pz
            kx, ky, kz = balls[k, 0] - px, balls[k, 1] - py, balls[k, 2] - pz
            li, lj = math.sqrt(ix * ix + iy * iy + iz * iz), math.sqrt(jx * jx + jy * jy + jz * jz)
            lk = math.sqrt(kx * kx + ky * ky + kz * kz)
            ix, iy, iz, jx, jy, jz, kx, ky, kz = (
                ix / li, iy / li, iz / li, jx / lj, jy / lj, jz / lj, kx / lk, ky / lk, kz / lk,
            )  # fmt: skip
            r = math.sqrt(wp)
            hi, hj, hk = (
                0.5 * (li + (wp - balls[i, 3]) / li),
                0.5 * (lj + (wp - balls[j, 3]) / lj),
                0.5 * (lk + (wp - balls[k, 3]) / lk),
            )
            # Cosines and sines of the angles between the normals; the volume that the normals span.
            cij, cjk, cki = ix * jx + iy * jy + iz * jz, jx * kx + jy * ky + jz * kz, kx * ix + ky * iy + kz * iz
            ux, uy, uz = iy * jz - iz * jy, iz * jx - ix * jz, ix * jy - iy * jx
            vx, vy, vz = jy * kz - jz * ky, jz * kx - jx * kz, jx * ky - jy * kx
            wx, wy, wz = ky * iz - kz * iy, kz * ix - kx * iz, kx * iy - ky * ix
            sij = math.sqrt(ux * ux + uy * uy + uz * uz)
            sjk = math.sqrt(vx * vx + vy * vy + vz * vz)
            ski = math.sqrt(wx * wx + wy * wy + wz * wz)
            span = ux * kx + uy * ky + uz * kz
            side = 1.0 if span >= 0 else -1.0
            span = abs(span)
            # Twos of planes: half chords, distances of the chord in disc i and j, half arcs of both, turns.
            tij, dij, dji, aij, aji, turn_ij = meet(hi, hj, r, cij, sij)
            tjk, djk, dkj, ajk, akj, turn_jk = meet(hj, hk, r, cjk, sjk)
            tki, dki, dik, aki, aik, turn_ki = meet(hk, hi, r, cki, ski)
            # Arcs: what two half-discs at an angle (that of the tetrahedron at the edge) have in common.
            gi, gj, gk = cjk - cij * cki, cki - cij * cjk, cij - cki * cjk
            arc_i = aij + aik - math.atan2(span, gi)
            arc_j = aji + ajk - math.atan2(span, gj)
            arc_k = aki + akj - math.atan2(span, gk)
            area = r * (r * (2 * math.pi - turn_ij - turn_jk - turn_ki) - arc_i * hi - arc_j * hj - arc_k * hk)
            # One corner for all three chords, found on the line that is best known, so that they fit in flat cells too.
            if sij >= sjk and sij >= ski:
                x, y, z = corner(ix, iy, iz, jx, jy, jz, kx, ky, kz, hi, hk, tij, dij, cij, sij)
            elif sjk >= ski:
                x, y, z = corner(jx, jy, jz, kx, ky, kz, ix, iy, iz, hj, hi, tjk, djk, cjk, sjk)
            else:
                x, y, z = corner(kx, ky, kz, ix, iy, iz, jx, jy, jz, hk, hj, tki, dki, cki, ski)
            eij = beyond(tij, x, y, z, side * ux, side * uy, side * uz, sij)
            ejk = beyond(tjk, x, y, z, side * vx, side * vy, side * vz, sjk)
            eki = beyond(tki, x, y, z, side * wx, side * wy, side * wz, ski)
            disc_i = (r - hi) * (r + hi) * arc_i - dij * eij - dik * eki
            disc_j = (r - hj) * (r + hj) * arc_j - dji * eij - djk * ejk
            disc_k = (r - hk) * (r + hk) * arc_k - dki * eki - dkj * ejk
            pieces[t, a, 0] = (r * area - 0.5 * (hi * disc_i + hj * disc_j + hk * disc_k)) / 3
            pieces[t, a, 1] = area


@kernel
def segments(balls, edges, pieces):
    """Fill in the pieces (s, 2, 2) of edges in the plane: segments of discs, and their arcs."""
    for e in range(len(edges)):
        for a in range(2):
            p, q = edges[e, a], edges[e, 1 - a]
            length = math.hypot(balls[q, 0] - balls[p, 0], balls[q, 1] - balls[p, 1])
            r = math.sqrt(balls[p, 3])
            half, h = chord(r, 0.5 * (length + (balls[p, 3] - balls[q, 3]) / length))
            angle = math.atan2(half, h)
            pieces[e, a, 0] = r * r * angle - h * half
            pieces[e, a, 1] = 2 * r * angle


@kernel
def double_segments(balls, triangles, pieces):
    """Fill in the pieces (s, 3, 2) of triangles in the plane: a disc beyond two lines that meet in it."""
    for t in range(len(triangles)):
        for a in range(3):
            p, i, j = triangles[t, a], triangles[t, (a + 1) % 3], triangles[t, (a + 2) % 3]
            px, py, wp = balls[p, 0], balls[p, 1], balls[p, 3]
            ix, iy, jx, jy = balls[i, 0] - px, balls[i, 1] - py, balls[j, 0] - px, balls[j, 1] - py
            li, lj = math.hypot(ix, iy), math.hypot(jx, jy)
            r = math.sqrt(wp)
            ti, hi = chord(r, 0.5 * (li + (wp - balls[i, 3]) / li))
            tj, hj = chord(r, 0.5 * (lj + (wp - balls[j, 3]) / lj))
            cosine, sine = (ix * jx + iy * jy) / (li * lj), abs(ix * jy - iy * jx) / (li * lj)
            arc = math.atan2(ti, hi) + math.atan2(tj, hj) - math.atan2(sine, cosine)
            _, di = chord(ti, (hj - hi * cosine) / sine)
            _, dj = chord(tj, hi * sine - di * cosine)
            ei, ej = ti - di, tj - dj
            pieces[t, a, 0] = 0.5 * (r * r * arc - hi * ei - hj * ej)
            pieces[t, a, 1] = r * arc


@kernel
def accumulate(rows, pieces, sign, total):
    """Add pieces (s, k+1, 2) times a sign to the totals (n, 2) of the vertices."""
    for s in range(len(rows)):
        for a in range(rows.shape[1]):
            total[rows[s, a], 0] += sign * pieces[s, a, 0]
            total[rows[s, a], 1] += sign * pieces[s, a, 1]
