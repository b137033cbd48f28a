"""Incremental regular triangulation in 3-D: walk, cavity, star (Bowyer 1981, Watson 1981), exact and perturbed.

The infinite vertex has NaN for coordinates: no floating-point filter ever passes for a ghost cell, so ghosts cost the
fast path nothing. A ghost conflicts with a point strictly outside its finite facet; a point coplanar with that facet is
decided by the cell behind it. Together with the perturbation of the heights this makes the cavity the exact set of lower
facets that the lifted point sees: star-shaped, so that no new cell is ever flat, whatever the input.

Helpers get scalars only: an array passed to a function that is called for each cell would be reference-counted there.
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
    LATER,
    LIMIT,
    MORE_CAVITY,
    MORE_CELLS,
    NEXT,
    NONE,
    STAMP,
    USED,
    VERTEX,
    WANTED,
)
from .predicates import orient3d, orient3d_filter, power3d_filter, power3d_perturbed

_HASH = np.uint64(0x9E3779B97F4A7C15)  # 2**64 over the golden ratio


@kernel
def insert3d(points, index, sequence, words, slab, cavity, border, edge_key, edge_value, state):
    """Insert sequence[state.next:] into a triangulation; a full buffer returns what to grow, and the call is repeated.

    points: x, y, z, w of each vertex, flat, the infinite vertex last. index: the input row of each, which breaks ties.
    words: see `complex`. cavity, border, edge_key, edge_value: room for one insertion (`recon.insertion._scratch`). slab: an axis
    and limits. Cells with a vertex below the lower one, or from the upper one on, are left as they are: vertices in conflict with one
    are moved to the front of the sequence, state.later of them.
    """
    infinite = np.uint32(index.size)
    hint, free, free_count = np.uint32(state[HINT]), np.uint32(state[FREE]), state[FREE_COUNT]
    used, limit, stamp = state[USED], state[LIMIT], np.uint64(state[STAMP])
    axis, low, high = slab
    bounded = low > -np.inf or high < np.inf
    status = DONE
    step, later = state[NEXT], state[LATER]
    while step < sequence.size:
        e = sequence[step]
        ex, ey, ez, ew = points[4 * e], points[4 * e + 1], points[4 * e + 2], points[4 * e + 3]

        # Walk to a cell that holds e, or to a ghost that e sees: every step strictly lowers the power of e, so it ends.
        cell = hint
        for slot in range(4):
            if words[cell + slot] == infinite:
                cell = words[cell + 4 + slot] & CELL
                break
        entry = 4
        while True:
            va, vb, vc, vd = words[cell], words[cell + 1], words[cell + 2], words[cell + 3]
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
            if bounded:
                foreign = True  # what lies beyond may have no vertex of ours
                for slot in range(4):
                    if slot != leave:
                        x = points[4 * words[cell + slot] + axis]
                        foreign = foreign and not (x >= low and x < high)
                if foreign:
                    break
            facet = words[cell + 4 + leave]
            cell = facet & CELL
            entry = np.int64(facet & 3)

        # Cavity: all cells in conflict with e, spreading from the one found. `cavity` has the facets by which its cells
        # were entered, `border` those that lead out of it, from inside. Each cell is tested once: the marks in its first
        # vertex say 1 for "free of e", 2 for "in conflict". Both lists are appended to without a branch, which nobody
        # could predict.
        count, borders, i, k = 0, 0, 0, -1
        facet = np.uint32(0)
        outer = cell
        first = words[cell]
        blocked = leave < 4
        while not blocked:
            va, vb, vc, vd = first, words[cell + 1], words[cell + 2], words[cell + 3]
            shared = False
            if bounded:  # no comparison holds for the infinite vertex
                xa, xb, xc, xd = (
                    points[4 * va + axis],
                    points[4 * vb + axis],
                    points[4 * vc + axis],
                    points[4 * vd + axis],
                )
                shared = (xa < low) | (xb < low) | (xc < low) | (xd < low)
                shared |= (xa >= high) | (xb >= high) | (xc >= high) | (xd >= high)
            ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
            bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
            cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
            dx, dy, dz, dw = points[4 * vd], points[4 * vd + 1], points[4 * vd + 2], points[4 * vd + 3]
            s = power3d_filter(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew)
            if s == 0:
                behind = NONE
                if va == infinite:
                    s = -orient3d(ex, ey, ez, bx, by, bz, cx, cy, cz, dx, dy, dz)
                    behind = words[cell + 4]
                elif vb == infinite:
                    s = -orient3d(ax, ay, az, ex, ey, ez, cx, cy, cz, dx, dy, dz)
                    behind = words[cell + 5]
                elif vc == infinite:
                    s = -orient3d(ax, ay, az, bx, by, bz, ex, ey, ez, dx, dy, dz)
                    behind = words[cell + 6]
                elif vd == infinite:
                    s = -orient3d(ax, ay, az, bx, by, bz, cx, cy, cz, ex, ey, ez)
                    behind = words[cell + 7]
                if s == 0:
                    if behind != NONE:
                        cell = behind & CELL
                        va, vb, vc, vd = words[cell] & VERTEX, words[cell + 1], words[cell + 2], words[cell + 3]
                        ax, ay, az, aw = points[4 * va], points[4 * va + 1], points[4 * va + 2], points[4 * va + 3]
                        bx, by, bz, bw = points[4 * vb], points[4 * vb + 1], points[4 * vb + 2], points[4 * vb + 3]
                        cx, cy, cz, cw = points[4 * vc], points[4 * vc + 1], points[4 * vc + 2], points[4 * vc + 3]
                        dx, dy, dz, dw = points[4 * vd], points[4 * vd + 1], points[4 * vd + 2], points[4 * vd + 3]
                    s = power3d_perturbed(
                        ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw, ex, ey, ez, ew,
                        index[va], index[vb], index[vc], index[vd], index[e],
                    )  # fmt: skip
            is_free = 1 if s > 0 else 0
            if not shared:  # else it has no marks, and is tested as often as it is met
                words[outer & CELL] = first | (np.uint32(2 - is_free) << np.uint32(30))
            elif is_free == 0:
                blocked = True
                break
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
                if k == 4:
                    i, k = i + 1, 1
                if i >= count:
                    break
                facet = (cavity[i] & CELL) | ((cavity[i] + np.uint32(k)) & np.uint32(3))
                outer = words[facet + 4]
                cell = outer & CELL
                first = words[cell]
                mark = first >> np.uint32(30)
                border[borders] = facet
                borders += np.int64(mark & 1)
            if i >= count:
                break
        if count == 0 and not blocked:  # e lies above the lower hull: hidden
            words[outer & CELL] &= VERTEX
            hint = cell
            step += 1
            continue
        if status == DONE and not blocked and used + borders - count - free_count > limit:
            status = MORE_CELLS
            state[WANTED] = borders
        if status != DONE or blocked:  # leave no mark behind
            for i in range(count):
                words[cavity[i] & CELL] &= VERTEX
            for i in range(borders):
                words[words[border[i] + 4] & CELL] &= VERTEX
            if status != DONE:
                break
            sequence[later] = e
            later += 1
            step += 1
            continue
        step += 1

        # Star: e and a border facet make a new cell, in the place of an old one while there are any. So the facets are
        # copied first: the neighbour outside, then the vertices, which e in front makes a positive cell.
        for i in range(borders - 1, -1, -1):
            facet = border[i]
            base = facet & CELL
            turn = (facet & np.uint32(3)) << np.uint32(1)
            border[4 * i] = words[facet + 4]
            border[4 * i + 1] = words[base + ((np.uint32(0b00000001) >> turn) & np.uint32(3))] & VERTEX
            border[4 * i + 2] = words[base + ((np.uint32(0b10011110) >> turn) & np.uint32(3))] & VERTEX
            border[4 * i + 3] = words[base + ((np.uint32(0b01111011) >> turn) & np.uint32(3))] & VERTEX
        # A facet between two new cells is found by its edge away from e, which they run through in opposite directions.
        stamp += np.uint64(1)
        mask = 255
        while mask < 12 * borders:
            mask = 2 * mask + 1
        for i in range(borders):
            outer, va, vb, vc = border[4 * i], border[4 * i + 1], border[4 * i + 2], border[4 * i + 3]
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
            words[place + 3] = vc
            words[place + 4] = outer
            words[outer + 4] = place
            words[outer & CELL] &= VERTEX
            for slot in range(1, 4):
                key = (np.uint64(vb) << np.uint64(32)) | np.uint64(vc)
                h = np.int64((key * _HASH) >> np.uint64(40)) & mask
                while edge_value[h] >> np.uint64(32) == stamp:
                    h = (h + 1) & mask
                edge_key[h] = key
                edge_value[h] = (stamp << np.uint64(32)) | np.uint64(place + slot)
                va, vb, vc = vb, vc, va
        for i in range(borders):
            place, va, vb, vc = border[4 * i], border[4 * i + 1], border[4 * i + 2], border[4 * i + 3]
            for slot in range(1, 4):
                key = (np.uint64(vc) << np.uint64(32)) | np.uint64(vb)
                h = np.int64((key * _HASH) >> np.uint64(40)) & mask
                while edge_key[h] != key:
                    h = (h + 1) & mask
                words[place + 4 + slot] = edge_value[h]
                va, vb, vc = vb, vc, va
        for i in range(borders, count):
            place = cavity[i] & CELL
            words[place] = NONE
            words[place + 4] = free
            free = place
            free_count += 1
        hint = border[4 * borders - 4]

    state[NEXT], state[HINT], state[FREE], state[FREE_COUNT] = step, hint, free, free_count
    state[USED], state[STAMP], state[LATER] = used, stamp, later
    return status
