"""Local search on the sides of nodes until every sample has exactly one umbrella of surface facets, and no handle is thin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .handles import cut_thin_handles
from .threads import together

ROUNDS = 6  # of moves; it mostly ends after 3


def repair(
    cloud: tuple[NDArray, NDArray],
    walls: tuple[NDArray, NDArray, NDArray],
    sides: NDArray[np.int8],
    poles: tuple[NDArray, NDArray, NDArray],
    widest: float,
    threads: int | None,
) -> tuple[NDArray[np.int32], int]:
    """Improve the sides of nodes in place.

    Parameters
    ----------
    cloud : points (n, 3) and spacing (n,)
    walls : nodes (N, 4), links (N, 4) and gates (m, 4)
        See `recon._kernels.sides`.
    sides : (N,) ndarray of int8
    poles : (n,) ndarrays of int32, int32, float32
        The deepest node around every sample, the deepest opposite to it, and how sure that is.
    widest : float
        Facets of wider gates are none; infinite for a closed surface.
    threads : int or None

    Returns
    -------
    excess : (n,) ndarray of int32
        Of every sample 0 for one umbrella, -1 where it is buried, more where it is pinched.
    moves : int
    """
    from ._kernels import components, umbrellas  # numba takes a while to load
    from ._kernels.repair import absorb, search

    nodes, links, gate = walls
    n, count = len(cloud[0]), len(nodes)
    limit = np.float32(widest)
    parts = np.empty(count, np.int32), np.empty(count + 1, np.int64), np.empty(count, np.int32)

    def around() -> tuple[NDArray, NDArray, NDArray[np.int32]]:
        starts, star = umbrellas.star_lists(nodes, n)
        return starts, star, umbrellas.excesses(nodes, links, gate, starts, limit, sides)

    (starts, star, excess), number = together(
        threads, around, lambda: components.number_components(links, sides, *parts)
    )
    ground = *cloud, *walls, starts, star
    moves, number = search(ground, sides, *poles[:2], limit, ROUNDS, excess, *parts, number)
    if widest < np.inf:
        return excess, moves
    if cut_thin_handles(ground, sides, poles, excess):
        number = components.number_components(links, sides, *parts)
    if absorb(nodes, links, gate, len(gate), sides, *parts[:2], number):
        excess = umbrellas.excesses(nodes, links, gate, starts, limit, sides)
    return excess, moves
