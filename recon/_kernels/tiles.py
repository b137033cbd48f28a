"""Who is needed to decide what happens in a box, and how the answers of several boxes go together."""

from __future__ import annotations

import numpy as np

from .compile import kernel

_MARGIN = 1.0 + 2.0**-40  # more than the rounding of the distances; one point more changes nothing


@kernel
def within_reach(points, radii, low, high, reach, extra):
    """Rows, ascending, of the points whose ball comes within `reach` of a box, and the rows in `extra`.

    radii: of the balls; negative where there is none.
    """
    n = points.shape[0]
    rows = np.empty(n, np.int64)
    count, e = 0, 0
    for i in range(n):
        gap_sq = 0.0
        for c in range(points.shape[1]):
            gap = max(max(low[c] - points[i, c], points[i, c] - high[c]), 0.0)
            gap_sq += gap * gap
        limit = (radii[i] + reach) * _MARGIN
        wanted = e < extra.size and extra[e] == i
        e += 1 if wanted else 0
        rows[count] = i
        count += 1 if wanted or (radii[i] >= 0.0 and gap_sq <= limit * limit * _MARGIN) else 0
    return rows[:count].copy()


@kernel
def extent(points, radii, tile_of, tile):
    """Lowest and highest corner of the points of a tile, and the largest of their radii, negative if it has no point."""
    d = points.shape[1]
    low, high, largest = np.full(d, np.inf), np.full(d, -np.inf), -1.0
    for i in range(points.shape[0]):
        if tile_of[i] == tile:
            largest = max(largest, radii[i])
            for c in range(d):
                low[c], high[c] = min(low[c], points[i, c]), max(high[c], points[i, c])
    return low, high, largest


@kernel
def divide(points, axis, limit, lower, upper, tile_of):
    """Give to a tile `upper` the points of the tile `lower` that are not below a limit."""
    for i in range(points.shape[0]):
        if tile_of[i] == lower and points[i, axis] >= limit:
            tile_of[i] = upper


@kernel
def count_by_row(rows, first):
    """Add to first[r + 1] the number of times that r occurs."""
    for i in range(rows.size):
        first[rows[i] + 1] += 1


@kernel
def deal(rows, next_place, place):
    """Give each of several things its place: after those of the same row before it."""
    for i in range(rows.size):
        place[i] = next_place[rows[i]]
        next_place[rows[i]] += 1
