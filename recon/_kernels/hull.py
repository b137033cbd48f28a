"""Insertion of weighted points into a regular triangulation of any dimension k >= 1 (Bowyer and Watson).

The convex hull is closed by ghost cells, which have the vertex n (at infinity), one on each hull facet. Signs come from
float64 with an error bound; where that leaves one open, the kernel returns and asks the caller for it.

Tables of M rows, M > 0 free ones included: `cells`, `neighbors` (M, k+1) int32, positive cells, the vertex at infinity on
the outer side; `lists` (5, M) int64, one list a row: MARK (2 t + 2 for no conflict with the t-th point inserted, 2 t + 3
for a conflict), FREE cells, CAVITY, BORDER (k+1) * cell + slot, and the OPEN cells that the caller is asked for.
`points` (n, d+1): the k coordinates that tell points of the flat apart, the others, the weight. `trust`: relative error of
a determinant of order k and k+1; absolute error; whole (1: all numbers are integers). No trust at all where inf.
"""

from __future__ import annotations

import numpy as np

from .compile import kernel

MARK, FREE, CAVITY, BORDER, OPEN = range(5)
# Status words: the next point, what to do with it, at which cell, the lengths of the lists, rows in use, cells searched.
NEXT, PHASE, HERE, FREE_COUNT, CAVITY_COUNT, OPEN_COUNT, USED, SEARCHED, STATE = range(9)
LOCATE, LOCATE_TOLD, GROW = range(3)
DONE, PAUSE, MORE_ROOM, ASK_SIDES, ASK_CONFLICTS = range(5)
UNKNOWN = -2
_WHOLE = 2.0**52  # determinants whose terms add up to less are exact in whole numbers
_PAUSE = 256  # points between two looks at the keyboard


@kernel
def determinant_sign(matrix, minors, order, trust):
    """Sign of the determinant of matrix[0], or UNKNOWN; matrix[1] bounds its entries.

    By minors of the leading rows, `minors[0]`, one a set of columns; beside them the sums of the sizes of their terms.
    """
    if trust[order & 1] == np.inf:
        return UNKNOWN
    minors[0, 0], minors[1, 0] = 1.0, 1.0
    for chosen in range(1, 1 << order):
        row, rest = -1, chosen
        while rest:
            row, rest = row + 1, rest & (rest - 1)
        value, size = 0.0, 0.0
        odd = row & 1
        for column in range(order):
            bit = 1 << column
            if chosen & bit:
                term = matrix[0, row, column] * minors[0, chosen ^ bit]
                value += -term if odd else term
                size += matrix[1, row, column] * minors[1, chosen ^ bit]
                odd ^= 1
        minors[0, chosen], minors[1, chosen] = value, size
    value, size = minors[0, chosen], minors[1, chosen]
    if trust[3] > 0 and size < _WHOLE:
        return int(value > 0) - int(value < 0)
    if abs(value) > trust[order & 1] * size + trust[2]:
        return 1 if value > 0 else -1
    return UNKNOWN


@kernel
def side(points, cell, slot, q, trust, matrix, minors):
    """Orientation of a cell with its vertex at a slot replaced by q, or UNKNOWN."""
    k = cell.size - 1
    row = 0
    for i in range(k + 1):
        if i != slot:
            for c in range(k):
                matrix[0, row, c] = points[cell[i], c] - points[q, c]
                matrix[1, row, c] = abs(matrix[0, row, c])
            row += 1
    sign = determinant_sign(matrix, minors, k, trust)
    return -sign if slot & 1 and sign != UNKNOWN else sign


@kernel
def conflict(points, cells, neighbors, c, q, trust, matrix, minors):
    """Is q below the hyperplane through the lifted cell c, ties broken by row? 1, 0 or UNKNOWN."""
    n, d = points.shape[0], points.shape[1] - 1
    k = cells.shape[1] - 1
    for i in range(k + 1):
        if cells[c, i] == n:
            sign = side(points, cells[c], i, q, trust, matrix, minors)
            if sign != 0:
                return sign if sign == UNKNOWN else int(sign > 0)
            c = neighbors[c, i]  # q is in the plane of the hull facet: the cell behind decides
            break
    cell = cells[c]
    for i in range(k + 1):
        lift = 0.0
        for a in range(d):
            gap = points[cell[i], a] - points[q, a]
            lift += gap * gap
            if a < k:
                matrix[0, i, a], matrix[1, i, a] = gap, abs(gap)
        gap = points[cell[i], d] - points[q, d]
        matrix[0, i, k], matrix[1, i, k] = lift - gap, lift + abs(gap)
    sign = determinant_sign(matrix, minors, k + 1, trust)
    if sign != 0:
        return sign if sign == UNKNOWN else int((sign > 0) == (k % 2 == 0))
    last = -1  # on the hyperplane: the lowest row decides whose infinitesimal counts there
    for _ in range(k + 2):
        lowest, at = n, -1
        if last < q:
            lowest = q
        for i in range(k + 1):
            if last < cell[i] < lowest:
                lowest, at = cell[i], i
        if at < 0:
            return 1
        sign = side(points, cell, at, q, trust, matrix, minors)
        if sign != 0:
            return sign if sign == UNKNOWN else int(sign < 0)
        last = lowest
    return UNKNOWN


@kernel
def locate(points, cells, neighbors, q, answers, state, trust, matrix, minors):
    """Walk from the finite cell HERE to one that holds q, or to a ghost cell in conflict; False where a sign is open."""
    n, k = points.shape[0], cells.shape[1] - 1
    while True:
        here, out, open_ = state[HERE], -1, False
        for slot in range(k + 1):
            if state[PHASE] == LOCATE_TOLD:
                sign = answers[slot]
            else:
                sign = side(points, cells[here], slot, q, trust, matrix, minors)
            if sign == -1:
                out = slot
                break
            open_ = open_ or sign == UNKNOWN
        if out < 0:
            return not open_
        state[PHASE] = LOCATE
        state[HERE] = neighbors[here, out]
        for i in range(k + 1):
            if cells[state[HERE], i] == n:
                return True


@kernel
def grow(points, cells, neighbors, lists, q, stamp, state, trust, matrix, minors):
    """Spread the cavity over all cells in conflict; those whose conflict is open are listed."""
    for i in range(state[OPEN_COUNT]):
        if lists[MARK, lists[OPEN, i]] == stamp + 1:
            lists[CAVITY, state[CAVITY_COUNT]] = lists[OPEN, i]
            state[CAVITY_COUNT] += 1
    state[OPEN_COUNT] = 0
    while state[SEARCHED] < state[CAVITY_COUNT]:
        c = lists[CAVITY, state[SEARCHED]]
        state[SEARCHED] += 1
        for slot in range(cells.shape[1]):
            other = neighbors[c, slot]
            if lists[MARK, other] < stamp:
                test(points, cells, neighbors, lists, other, q, stamp, state, trust, matrix, minors)


@kernel
def test(points, cells, neighbors, lists, c, q, stamp, state, trust, matrix, minors):
    """Mark a cell, and list it with the cavity, or as open."""
    answer = conflict(points, cells, neighbors, c, q, trust, matrix, minors)
    lists[MARK, c] = stamp + (answer == 1)
    if answer == 1:
        lists[CAVITY, state[CAVITY_COUNT]] = c
        state[CAVITY_COUNT] += 1
    elif answer == UNKNOWN:
        lists[OPEN, state[OPEN_COUNT]] = c
        state[OPEN_COUNT] += 1


@kernel
def find_border(neighbors, lists, stamp, state):
    """List the facets between the cavity and the rest; their number, or -1 where there is no room for a cell on each."""
    width, count = neighbors.shape[1], 0
    room = state[FREE_COUNT] + lists.shape[1] - state[USED]
    for i in range(state[CAVITY_COUNT]):
        c = lists[CAVITY, i]
        for slot in range(width):
            if lists[MARK, neighbors[c, slot]] != stamp + 1:
                if count == room:
                    return -1
                lists[BORDER, count] = width * c + slot
                count += 1
    return count


@kernel
def carve(n, cells, neighbors, lists, count, q, stamp, state):
    """Replace the cavity by one cell from q to each facet of its border."""
    width = cells.shape[1]
    for i in range(count):
        c, slot = divmod(lists[BORDER, i], width)
        if state[FREE_COUNT] > 0:
            state[FREE_COUNT] -= 1
            new = lists[FREE, state[FREE_COUNT]]
        else:
            new = state[USED]
            state[USED] += 1
        beyond = neighbors[c, slot]
        cells[new], neighbors[new] = cells[c], -1
        cells[new, slot], neighbors[new, slot] = q, beyond
        for j in range(width):
            if neighbors[beyond, j] == c:
                neighbors[beyond, j] = new
        neighbors[c, slot] = ~new  # where to find it from inside the cavity
        lists[MARK, new] = stamp
    for i in range(count):
        c, slot = divmod(lists[BORDER, i], width)
        new = ~neighbors[c, slot]
        for j in range(width):
            if neighbors[new, j] >= 0:
                continue
            here, kept, out = c, slot, j  # turn around the ridge without the vertices at `kept` and `out`
            while neighbors[here, out] >= 0:
                after, vertex = neighbors[here, out], cells[here, kept]
                for s in range(width):
                    if neighbors[after, s] == here:
                        kept = s
                    if cells[after, s] == vertex:
                        out = s
                here = after
            other = ~neighbors[here, out]
            neighbors[new, j], neighbors[other, kept] = other, new
    finite = -1
    for i in range(count):
        c, slot = divmod(lists[BORDER, i], width)
        finite = ~neighbors[c, slot]
        for j in range(width):
            if cells[finite, j] == n:
                finite = -1
                break
        if finite >= 0:
            break
    state[HERE] = finite
    for i in range(state[CAVITY_COUNT]):
        lists[FREE, state[FREE_COUNT]] = lists[CAVITY, i]
        lists[MARK, lists[CAVITY, i]] = -1
        state[FREE_COUNT] += 1


@kernel
def insert(points, order, cells, neighbors, lists, answers, state, trust, matrix, minors):
    """Insert the points `order` from state[NEXT] on. Returns why it stops.

    ASK_SIDES wants `answers` (k+1,) for cell HERE: orientations with each vertex replaced by the point; then phase
    LOCATE_TOLD. ASK_CONFLICTS wants the marks of the OPEN cells; MORE_ROOM longer tables.
    """
    n = points.shape[0]
    done = 0
    while state[NEXT] < order.size:
        q = order[state[NEXT]]
        stamp = 2 * state[NEXT] + 2
        if state[PHASE] != GROW:
            if not locate(points, cells, neighbors, q, answers, state, trust, matrix, minors):
                return ASK_SIDES
            start = state[HERE]
            for i in range(cells.shape[1]):
                if cells[start, i] == n:
                    state[HERE] = neighbors[start, i]
            state[PHASE], state[SEARCHED], state[CAVITY_COUNT], state[OPEN_COUNT] = GROW, 0, 0, 0
            test(points, cells, neighbors, lists, start, q, stamp, state, trust, matrix, minors)
            if state[OPEN_COUNT] > 0:
                return ASK_CONFLICTS
        grow(points, cells, neighbors, lists, q, stamp, state, trust, matrix, minors)
        if state[OPEN_COUNT] > 0:
            return ASK_CONFLICTS
        if state[CAVITY_COUNT] > 0:
            count = find_border(neighbors, lists, stamp, state)
            if count < 0:
                return MORE_ROOM
            carve(n, cells, neighbors, lists, count, q, stamp, state)
        state[NEXT] += 1
        state[PHASE] = LOCATE
        done += 1
        if done == _PAUSE:
            return PAUSE
    return DONE


@kernel
def find_cells(points, cells, neighbors, first, start, here, signs, trust, matrix, minors):
    """Walk from the cell here[i] to the one that holds point first + i, for all i from `start` on.

    Fills in the cell, -1 where there is none, and the signs of the coordinates of the point in it. No ghost cells: beyond
    the hull is -1. Returns the first i for which it takes a sign that is open, in the cell here[i].
    """
    for i in range(start, here.size):
        slot = 0
        while here[i] >= 0 and slot < cells.shape[1]:
            signs[i, slot] = side(points, cells[here[i]], slot, first + i, trust, matrix, minors)
            if signs[i, slot] == -1:
                here[i] = neighbors[here[i], slot]
                slot = -1
            slot += 1
        if here[i] >= 0:
            for slot in range(cells.shape[1]):
                if signs[i, slot] == UNKNOWN:
                    return i
    return here.size
