"""Incremental regular triangulation in 2-D: the twin of `regular3d`, one dimension lower (read that first).

Triangles live in x and y. The third coordinate counts in the heights only, so that points of a plane in space are
triangulated in their plane, with its own metric, through a projection that is one-to-one there.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .complex import DONE, FREE, FREE_COUNT, HINT, MORE_CAVITY, MORE_CELLS, NEXT, NONE, STAMP, USED
from .predicates import orient2d, orient2d_filter, power2d_filter, power2d_perturbed


@kernel
def insert2d(points, index, sequence, vertices, neighbors, mark, cavity, border, state):
    """Insert sequence[state.next:] into a triangulation; a full buffer returns what to grow, and the call is repeated.

    points: x, y, z, w of each vertex, flat, the infinite vertex last. index: the perturbation rank of each vertex.
    vertices, neighbors: three a cell, flat; a neighbour is the facet, 4 * cell + slot, seen from the other side.
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
        for slot in range(3):
            if vertices[3 * c + slot] == infinite:
                c = np.int64(neighbors[3 * c + slot] >> 2)
                break
        entry = 3
        while True:
            leave = 3
            for slot in range(3):
                if slot == entry:
                    continue
                vb, vc = vertices[3 * c + (slot + 1) % 3], vertices[3 * c + (slot + 2) % 3]
                bx, by = points[4 * vb], points[4 * vb + 1]
                cx, cy = points[4 * vc], points[4 * vc + 1]
                s = orient2d_filter(ex, ey, bx, by, cx, cy)
                if s == 0:
                    if vertices[3 * c] == infinite or vb == infinite or vc == infinite:
                        break
                    s = orient2d(ex, ey, bx, by, cx, cy)
                if s < 0:
                    leave = slot
                    break
            if leave == 3:
                break
            facet = neighbors[3 * c + leave]
            c = np.int64(facet >> 2)
            entry = np.int64(facet & 3)

        # Cavity: all cells in conflict with e, spreading from the one found. Cells are tested once (mark).
        stamp += 2
        count, borders, looked = 0, 0, 0
        d = np.uint32(c)
        facet = np.uint32(0)
        while True:
            t = d
            va, vb, vc = vertices[3 * t], vertices[3 * t + 1], vertices[3 * t + 2]
            ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
            bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
            cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
            s = power2d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew)
            if s == 0:
                behind = np.uint32(NONE)
                if va == infinite:
                    s = -orient2d(ex, ey, bx, by, cx, cy)
                    behind = neighbors[3 * t]
                elif vb == infinite:
                    s = -orient2d(ax, ay, ex, ey, cx, cy)
                    behind = neighbors[3 * t + 1]
                elif vc == infinite:
                    s = -orient2d(ax, ay, bx, by, ex, ey)
                    behind = neighbors[3 * t + 2]
                if s == 0:
                    if behind != NONE:
                        t = behind >> np.uint32(2)
                        va, vb, vc = vertices[3 * t], vertices[3 * t + 1], vertices[3 * t + 2]
                        ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
                        bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
                        cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
                    ia, ib, ic = index[va], index[vb], index[vc]
                    s = power2d_perturbed(
                        ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew, ia, ib, ic, index[e]
                    )
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
            while looked < 3 * count:
                c_next = cavity[looked // 3]
                slot = looked % 3
                looked += 1
                facet = 4 * c_next + np.uint32(slot)
                d = neighbors[3 * c_next + np.uint32(slot)] >> np.uint32(2)
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
            c = np.int64(border[i] >> 2)
            slot = np.int64(border[i] & 3)
            if free_count > 0:
                new = free
                free = np.int64(neighbors[3 * new])
                free_count -= 1
            else:
                new = used
                used += 1
            vertices[3 * new] = vertices[3 * c]
            vertices[3 * new + 1] = vertices[3 * c + 1]
            vertices[3 * new + 2] = vertices[3 * c + 2]
            vertices[3 * new + slot] = e
            outer = neighbors[3 * c + slot]
            neighbors[3 * new + slot] = outer
            neighbors[3 * (outer >> 2) + (outer & 3)] = 4 * new + slot
            hint = new
        # Glue new cells to each other: from each border facet turn around each of its vertices, inside the cavity, to
        # the other border facet at that vertex.
        for i in range(borders):
            c = np.int64(border[i] >> 2)
            apex = np.int64(border[i] & 3)
            outer = neighbors[3 * c + apex]
            new = np.int64(neighbors[3 * (outer >> 2) + (outer & 3)] >> 2)
            for slot in range(3):
                if slot == apex:
                    continue
                u = vertices[3 * c + 3 - slot - apex]
                cell, entry, leave = c, apex, slot
                while True:
                    outer = neighbors[3 * cell + leave]
                    d = outer >> np.uint32(2)
                    if mark[d] != stamp:
                        break
                    cell = np.int64(d)
                    entry = np.int64(outer & 3)
                    leave = (entry + 1) % 3
                    if vertices[3 * cell + leave] == u:
                        leave = (entry + 2) % 3
                other = np.int64(neighbors[3 * (outer >> 2) + (outer & 3)] >> 2)
                neighbors[3 * new + slot] = 4 * other + entry
        for i in range(count):
            d = cavity[i]
            vertices[3 * d] = NONE
            neighbors[3 * d] = free
            free = np.int64(d)
        free_count += count

    state[NEXT], state[HINT], state[FREE], state[FREE_COUNT] = step, hint, free, free_count
    state[USED], state[STAMP] = used, stamp
    return status
