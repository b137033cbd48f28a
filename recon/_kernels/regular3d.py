"""Incremental regular triangulation in 3-D: walk, cavity, star (Bowyer 1981, Watson 1981), exact and perturbed.

Cells are four vertices each, positively oriented; a facet is named by 4 * cell + the slot of the vertex opposite to it.
The hull is closed by ghost cells, which have the infinite vertex (the last one, whose coordinates are NaN: no
floating-point filter ever passes for a ghost, so they cost the fast path nothing).

A ghost conflicts with a point strictly outside its finite facet; a point coplanar with that facet is decided by the cell
behind it. Together with the perturbation of the heights this makes the cavity the exact set of lower facets below the
new point: star-shaped, so that no new cell is ever flat, whatever the input.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .complex import DONE, FREE, FREE_COUNT, HINT, MORE_CAVITY, MORE_CELLS, NEXT, NONE, STAMP, USED
from .predicates import orient3d, orient3d_filter, power3d_filter, power3d_perturbed


@kernel
def insert3d(points, index, sequence, vertices, neighbors, mark, cavity, border, state):
    """Insert sequence[state.next:] into a triangulation; a full buffer returns what to grow, and the call is repeated.

    points: x, y, z, w of each vertex, flat, the infinite vertex last. index: the perturbation rank of each vertex.
    vertices, neighbors: four a cell, flat; a neighbour is the facet seen from the other side.
    """
    infinite = np.uint32(index.size)
    hint, free, free_count = state[HINT], state[FREE], state[FREE_COUNT]
    used, stamp = state[USED], state[STAMP]
    capacity, cavity_capacity = mark.size, cavity.size
    status = DONE
    step = state[NEXT]
    while step < sequence.size:
        e = sequence[step]
        ex, ey, ez, ew = points[4 * e], points[4 * e + 1], points[4 * e + 2], points[4 * e + 3]

        # Walk to a cell that holds e, or to a ghost that e sees: every step strictly lowers the power of e, so it ends.
        c = hint
        for slot in range(4):
            if vertices[4 * c + slot] == infinite:
                c = np.int64(neighbors[4 * c + slot] >> 2)
                break
        entry = 4
        while True:
            va, vb, vc, vd = vertices[4 * c], vertices[4 * c + 1], vertices[4 * c + 2], vertices[4 * c + 3]
            ax, ay, az = points[4 * va], points[4 * va + 1], points[4 * va + 2]
            bx, by, bz = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2]
            cx, cy, cz = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2]
            dx, dy, dz = points[4 * vd], points[4 * vd + 1], points[4 * vd + 2]
            leave = 4
            for slot in range(4):
                if slot == entry:
                    continue
                if slot == 0:
                    s = orient3d_filter(ex, ey, ez, bx, by, bz, cx, cy, cz, dx, dy, dz)
                elif slot == 1:
                    s = -orient3d_filter(ex, ey, ez, ax, ay, az, cx, cy, cz, dx, dy, dz)
                elif slot == 2:
                    s = orient3d_filter(ex, ey, ez, ax, ay, az, bx, by, bz, dx, dy, dz)
                else:
                    s = -orient3d_filter(ex, ey, ez, ax, ay, az, bx, by, bz, cx, cy, cz)
                if s == 0:
                    if va == infinite or vb == infinite or vc == infinite or vd == infinite:
                        break
                    if slot == 0:
                        s = orient3d(ex, ey, ez, bx, by, bz, cx, cy, cz, dx, dy, dz)
                    elif slot == 1:
                        s = orient3d(ax, ay, az, ex, ey, ez, cx, cy, cz, dx, dy, dz)
                    elif slot == 2:
                        s = orient3d(ax, ay, az, bx, by, bz, ex, ey, ez, dx, dy, dz)
                    else:
                        s = orient3d(ax, ay, az, bx, by, bz, cx, cy, cz, ex, ey, ez)
                if s < 0:
                    leave = slot
                    break
            if leave == 4:
                break
            facet = neighbors[4 * c + leave]
            c = np.int64(facet >> 2)
            entry = np.int64(facet & 3)

        # Cavity: all cells in conflict with e, spreading from the one found. Cells are tested once (mark).
        stamp += 2
        count, borders, looked = 0, 0, 0
        d = np.uint32(c)
        facet = np.uint32(0)
        while True:
            t = d
            va, vb, vc, vd = vertices[4 * t], vertices[4 * t + 1], vertices[4 * t + 2], vertices[4 * t + 3]
            ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
            bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
            cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
            dx, dy, dz, dw = points[4 * vd], points[4 * vd + 1], points[4 * vd + 2], points[4 * vd + 3]
            s = power3d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
            if s == 0:
                behind = np.uint32(NONE)
                if va == infinite:
                    s = -orient3d(ex, ey, ez, bx, by, bz, cx, cy, cz, dx, dy, dz)
                    behind = neighbors[4 * t]
                elif vb == infinite:
                    s = -orient3d(ax, ay, az, ex, ey, ez, cx, cy, cz, dx, dy, dz)
                    behind = neighbors[4 * t + 1]
                elif vc == infinite:
                    s = -orient3d(ax, ay, az, bx, by, bz, ex, ey, ez, dx, dy, dz)
                    behind = neighbors[4 * t + 2]
                elif vd == infinite:
                    s = -orient3d(ax, ay, az, bx, by, bz, cx, cy, cz, ex, ey, ez)
                    behind = neighbors[4 * t + 3]
                if s == 0:
                    if behind != NONE:
                        t = behind >> 2
                        va, vb, vc, vd = vertices[4 * t], vertices[4 * t + 1], vertices[4 * t + 2], vertices[4 * t + 3]
                        ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
                        bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
                        cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
                        dx, dy, dz, dw = points[4 * vd], points[4 * vd + 1], points[4 * vd + 2], points[4 * vd + 3]
                    ia, ib, ic, id = index[va], index[vb], index[vc], index[vd]
                    s = power3d_perturbed(
                        ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew, ia, ib, ic, id, index[e]
                    )  # fmt: skip
            if s < 0:
                mark[d] = stamp
                cavity[count] = d
                count += 1
                if count == cavity_capacity:
                    status = MORE_CAVITY
                    break
            else:
                mark[d] = stamp + 1
                border[borders] = facet
                borders += 1
            unknown = False
            while looked < 4 * count:
                facet = 4 * cavity[looked >> 2] + np.uint32(looked & 3)
                looked += 1
                d = neighbors[facet] >> np.uint32(2)
                seen = mark[d]
                if seen == stamp:
                    continue
                if seen == stamp + 1:
                    border[borders] = facet
                    borders += 1
                    continue
                unknown = True
                break
            if not unknown:
                break
        if status == DONE and used + borders - free_count > capacity:
            status = MORE_CELLS
        if status != DONE:
            break
        step += 1
        if count == 0:
            hint = c
            continue  # e lies above the lower hull: hidden

        # Star: one new cell for each border facet; they share its slots with the cell they replace.
        for i in range(borders):
            facet = border[i]
            c = np.int64(facet >> 2)
            slot = np.int64(facet & 3)
            if free_count > 0:
                new = free
                free = np.int64(neighbors[4 * new])
                free_count -= 1
            else:
                new = used
                used += 1
            vertices[4 * new] = vertices[4 * c]
            vertices[4 * new + 1] = vertices[4 * c + 1]
            vertices[4 * new + 2] = vertices[4 * c + 2]
            vertices[4 * new + 3] = vertices[4 * c + 3]
            vertices[4 * new + slot] = e
            outer = neighbors[facet]
            neighbors[4 * new] = NONE
            neighbors[4 * new + 1] = NONE
            neighbors[4 * new + 2] = NONE
            neighbors[4 * new + 3] = NONE
            neighbors[4 * new + slot] = outer
            neighbors[outer] = 4 * new + slot
            hint = new
        # Glue new cells to each other: from each border facet turn around each of its edges, inside the cavity, to the
        # other border facet at that edge.
        for i in range(borders):
            facet = border[i]
            c = np.int64(facet >> 2)
            apex = np.int64(facet & 3)
            mine = neighbors[neighbors[facet]]
            new = np.int64(mine >> 2)
            for slot in range(4):
                if slot == apex or neighbors[4 * new + slot] != NONE:
                    continue
                third = 6 - slot - apex
                first = 0
                while first == slot or first == apex:
                    first += 1
                u = vertices[4 * c + first]
                v = vertices[4 * c + third - first]
                cell, entry, leave = c, apex, slot
                while True:
                    outer = neighbors[4 * cell + leave]
                    d = outer >> np.uint32(2)
                    if mark[d] != stamp:
                        break
                    cell = np.int64(d)
                    entry = np.int64(outer & 3)
                    leave = (entry + 1) & 3
                    x = vertices[4 * cell + leave]
                    if x == u or x == v:
                        leave = (entry + 2) & 3
                        x = vertices[4 * cell + leave]
                        if x == u or x == v:
                            leave = (entry + 3) & 3
                other = np.int64(neighbors[outer] >> 2)
                neighbors[4 * new + slot] = 4 * other + entry
                neighbors[4 * other + entry] = 4 * new + slot
        for i in range(count):
            d = cavity[i]
            vertices[4 * d] = NONE
            neighbors[4 * d] = free
            free = np.int64(d)
        free_count += count

    state[NEXT], state[HINT], state[FREE], state[FREE_COUNT] = step, hint, free, free_count
    state[USED], state[STAMP] = used, stamp
    return status
