"""A fresh start for the search: sides of least walls around what it had to mend."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .least_walls import cells_near, least_walls, tied

RINGS = 3  # of cells around samples, as many as a thin wall and what is beyond
TIE = 0.1  # energy of a tie: five facets with a radius of one spacing. Samples may be buried: the search reaches for them anew


@kernel
def relabel(ground, sides, pole, anti, samples):
    """Give the cells near `samples` (k,) the sides (N,) between which walls are least, in place, but for what samples tie.

    Each ties its poles (n,), if they lie apart, else the nodes of either side around it that have the widest gates.
    """
    _, _, _, _, gate, starts, star = ground
    number = np.full(len(sides), -1, np.int32)
    near, corners = cells_near(ground, samples, RINGS, number)
    one, other = pole[corners], anti[corners]
    for i, v in enumerate(corners):
        if other[i] < 0 or sides[one[i]] == sides[other[i]]:
            around = star[starts[v] : starts[v + 1]]
            one[i], other[i] = widest_of(gate, sides, around, 0), widest_of(gate, sides, around, 1)
    for x in least_walls(ground, sides, number, near, tied(sides, one, other, number, near, TIE)):
        sides[x] ^= 1


@kernel
def widest_of(gate, sides, around, side):
    """Of these nodes the one of a side that has the widest gate, -1 if there is none; ghosts have the widest."""
    best, found = np.float32(-1), np.int32(-1)
    for x in around:
        if sides[x] == side:
            width = gate[x].max() if x < len(gate) else np.float32(np.inf)
            if width > best:
                best, found = width, x
    return found
