"""Incremental regular triangulation in 2-D: the twin of `regular3d`, one dimension lower (read that first).

Triangles live in x and y. The third coordinate counts in the heights only, so that points of a plane in space are
triangulated in their plane, with its own metric, through a projection that is one-to-one there.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .complex import (
    CELL,
    DONE,
    FREE,
    FREE_COUNT,
    HINT,
    LIMIT,
    MORE_CAVITY,
    MORE_CELLS,
    NEXT,
    NONE,
    USED,
    VERTEX,
    WANTED,
)
from .predicates import orient2d, orient2d_filter, power2d_filter, power2d_perturbed


@kernel
def insert2d(points, index, sequence, words, cavity, border, starting, state):
    """Insert sequence[state.next:] into a triangulation; a full buffer returns what to grow, and the call is repeated.

    points: x, y, z, w of each vertex, flat, the infinite vertex last. index: the input row of each, which breaks ties.
    words: see `complex`. cavity, border: room for one insertion. starting: one word a vertex.
    """
    infinite = np.uint32(index.size)
    hint, free, free_count = np.uint32(state[HINT]), np.uint32(state[FREE]), state[FREE_COUNT]
    used = state[USED]
    status = DONE
    step = state[NEXT]
    while step < sequence.size:
        e = sequence[step]
        ex, ey, ez, ew = points[4 * e], points[4 * e + 1], points[4 * e + 2], points[4 * e + 3]

        # Walk to a cell that holds e, or to a ghost that e sees: every step strictly lowers the power of e, so it ends.
        cell = hint
        for slot in range(3):
            if words[cell + slot] == infinite:
                cell = words[cell + 4 + slot] & CELL
                break
        entry = 3
        while True:
            va, vb, vc = words[cell], words[cell + 1], words[cell + 2]
            ax, ay = points[4 * va], points[4 * va + 1]
            bx, by = points[4 * vb], points[4 * vb + 1]
            cx, cy = points[4 * vc], points[4 * vc + 1]
            leave = 3
            for slot in range(3):
                if slot == entry:
                    continue
                if slot == 0:
                    s = orient2d_filter(ex, ey, bx, by, cx, cy)
                elif slot == 1:
                    s = -orient2d_filter(ex, ey, ax, ay, cx, cy)
                else:
                    s = orient2d_filter(ex, ey, ax, ay, bx, by)
                if s == 0:
                    if va == infinite or vb == infinite or vc == infinite:
                        break
                    if slot == 0:
                        s = orient2d(ex, ey, bx, by, cx, cy)
                    elif slot == 1:
                        s = orient2d(ax, ay, ex, ey, cx, cy)
                    else:
                        s = orient2d(ax, ay, bx, by, ex, ey)
                if s < 0:
                    leave = slot
                    break
            if leave == 3:
                break
            facet = words[cell + 4 + leave]
            cell = facet & CELL
            entry = np.int64(facet & 3)

        # Cavity: all cells in conflict with e, spreading from the one found.
        count, borders, i, k = 0, 0, 0, -1
        facet = np.uint32(0)
        outer = cell
        first = words[cell]
        while True:
            va, vb, vc = first, words[cell + 1], words[cell + 2]
            ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
            bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
            cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
            s = power2d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew)
            if s == 0:
                behind = NONE
                if va == infinite:
                    s = -orient2d(ex, ey, bx, by, cx, cy)
                    behind = words[cell + 4]
                elif vb == infinite:
                    s = -orient2d(ax, ay, ex, ey, cx, cy)
                    behind = words[cell + 5]
                elif vc == infinite:
                    s = -orient2d(ax, ay, bx, by, ex, ey)
                    behind = words[cell + 6]
                if s == 0:
                    if behind != NONE:
                        cell = behind & CELL
                        va, vb, vc = words[cell] & VERTEX, words[cell + 1], words[cell + 2]
                        ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
                        bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
                        cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
                    s = power2d_perturbed(
                        ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, ex, ey, ez, ew,
                        index[va], index[vb], index[vc], index[e],
                    )  # fmt: skip
            is_free = 1 if s > 0 else 0
            words[outer & CELL] = first | (np.uint32(2 - is_free) << np.uint32(30))
            cavity[count] = outer
            count += 1 - is_free
            border[borders] = facet
            borders += is_free
            if count == cavity.size:
                status = MORE_CAVITY
                break
            mark = np.uint32(1)
            while mark != 0:  # the next facet of the cavity that leads to a cell not tested yet
                k += 1
                if k == 3:
                    i, k = i + 1, 1
                if i >= count:
                    break
                slot = np.int64(cavity[i] & 3) + k
                facet = (cavity[i] & CELL) + np.uint32(slot if slot < 3 else slot - 3)
                outer = words[facet + 4]
                cell = outer & CELL
                first = words[cell]
                mark = first >> np.uint32(30)
                border[borders] = facet
                borders += np.int64(mark & 1)
            if i >= count:
                break
        if count == 0:  # e lies above the lower hull: hidden
            words[outer & CELL] &= VERTEX
            hint = cell
            step += 1
            continue
        if status == DONE and used + borders - count - free_count > state[LIMIT]:
            status = MORE_CELLS
            state[WANTED] = borders
        if status != DONE:  # leave no mark behind
            for i in range(count):
                words[cavity[i] & CELL] &= VERTEX
            for i in range(borders):
                words[words[border[i] + 4] & CELL] &= VERTEX
            break
        step += 1

        # Star: e and a border facet make a new cell, in the place of an old one while there are any. So the facets are
        # copied first: the neighbour outside, then the vertices, which e in front makes a positive cell.
        for i in range(borders - 1, -1, -1):
            facet = border[i]
            slot = np.int64(facet & 3)
            border[4 * i] = words[facet + 4]
            border[4 * i + 1] = words[(facet & CELL) + (slot + 1 if slot < 2 else 0)] & VERTEX
            border[4 * i + 2] = words[(facet & CELL) + (slot + 2 if slot < 1 else slot - 1)] & VERTEX
        # They follow each other around e: `starting` has the one that starts at a vertex.
        for i in range(borders):
            outer, va, vb = border[4 * i], border[4 * i + 1], border[4 * i + 2]
            if i < count:
                place = cavity[i] & CELL
            elif free_count > 0:
                place = free
                free = words[place + 4]
                free_count -= 1
            else:
                place = np.uint32(8 * used)
                used += 1
            border[4 * i] = place
            words[place] = e
            words[place + 1] = va
            words[place + 2] = vb
            words[place + 4] = outer
            words[outer + 4] = place
            words[outer & CELL] &= VERTEX
            starting[va] = place
        for i in range(borders):
            place = border[4 * i]
            following = starting[border[4 * i + 2]]
            words[place + 5] = following + 2
            words[following + 6] = place + 1
        for i in range(borders, count):
            place = cavity[i] & CELL
            words[place] = NONE
            words[place + 4] = free
            free = place
            free_count += 1
        hint = border[4 * borders - 4]

    state[NEXT], state[HINT], state[FREE], state[FREE_COUNT], state[USED] = step, hint, free, free_count, used
    return status
