"""Local search on the sides of nodes: one umbrella of facets for every sample, no thin handle, and no needless bend."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from .between import facets_between
from .handles import cut_thin_handles
from .threads import over_ranges

ROUNDS = 6  # of moves; a search mostly ends after 3
# A search keeps what it finds first. So where more than ROUGH of the samples want mending it is made in several orders, and of the
# outcomes the best is kept, place by place: the FIRST times from the sides as they were, then, for a closed surface, AGAIN from
# those of least walls, and a LAST time from the best. (For a sheet, where walls of wide facets are none, those of least walls have rents.)
ROUGH, FIRST, AGAIN = 1e-3, 4, 2
LAST = FIRST + AGAIN  # turn


def repair(
    ground: tuple[NDArray, ...],
    sides: NDArray[np.int8],
    poles: tuple[NDArray, NDArray, NDArray],
    excess: NDArray[np.int32],
    pieces: tuple[int, NDArray, NDArray, NDArray],
    widest: float,
    threads: int | None,
) -> tuple[NDArray[np.int32], list[NDArray[np.int64]]]:
    """Improve the sides of nodes in place by local searches; then thin handles of a closed surface are cut.

    Parameters
    ----------
    ground : tuple of ndarray
        Points (n, 3), spacing (n,), nodes (N, 4), links (N, 4) and gates (m, 4), see `recon._kernels.sides`; the nodes around each
        sample, see `recon._kernels.umbrellas.star_lists`.
    sides : (N,) ndarray of int8
    poles : (n,) ndarrays of int32, int32, float32
        The deepest node around every sample, the deepest opposite to it, and how sure that is.
    excess : (n,) ndarray of int32
        Umbrellas of these sides, see `excesses`. Of no more use after that.
    pieces : number of components, component (N,), size (N + 1,), queue (N,)
        Of these sides, see `recon._kernels.components.number_components`. Of no more use after that.
    widest : float
        Facets of wider gates are none; infinite for a closed surface.
    threads : int or None

    Returns
    -------
    excess : (n,) ndarray of int32
        Of every sample 0 for one umbrella, -1 where it is buried, more where it is pinched.
    thin : list of (k,) ndarray of int64
        Loops around thin handles of a closed surface that are left, `recon.handles.cut_thin_handles`.
    """
    from ._kernels import components  # numba takes a while to load
    from ._kernels.crossover import take_better
    from ._kernels.relabel import relabel

    links, m, n = ground[3], len(ground[4]), len(ground[0])
    rough = np.flatnonzero(excess)
    number, component, size, queue = pieces

    def attempt(turn: int) -> tuple[NDArray[np.int8], NDArray[np.int32]]:
        others, found, own = sides.copy(), excess.copy(), (number, component.copy(), size.copy(), queue.copy())
        _search(ground, others, poles, found, own, widest, turn, 1)
        return others, found

    def attempts(first: int, count: int) -> list[tuple[NDArray[np.int8], NDArray[np.int32]]]:
        parts = over_ranges(lambda a, b: [attempt(first + i) for i in range(a, b)], count, threads, 1)
        return list(itertools.chain.from_iterable(parts))

    def search_once_more() -> None:
        number = components.number_components(links, sides, component, size)
        _search(ground, sides, poles, excess, (number, component, size, queue), widest, LAST, threads)

    if len(rough) <= ROUGH * n:
        _search(ground, sides, poles, excess, pieces, widest, 0, threads)
    else:
        (best, found), *rest = attempts(0, FIRST)
        for others, _ in rest:
            take_better(ground, np.float32(widest), best, others, found)
        if widest == np.inf:
            sides[:] = best
            relabel(ground, sides, *poles[:2], rough)
            excess = excesses(ground, facets_between(links, sides, m, threads), widest, threads)
            number = components.number_components(links, sides, component, size)
            for others, _ in attempts(FIRST, AGAIN):
                take_better(ground, np.float32(widest), best, others, found)
        sides[:], excess = best, found
        search_once_more()
    if widest < np.inf:
        return excess, []
    cut, thin = cut_thin_handles(ground, sides, poles, excess, threads)
    if cut and _absorb(ground, sides, excess, component, size, threads):
        search_once_more()
        cut, thin = cut_thin_handles(ground, sides, poles, excess, threads)
    return excess, thin


def _search(
    ground: tuple[NDArray, ...],
    sides: NDArray[np.int8],
    poles: tuple[NDArray, NDArray, NDArray],
    excess: NDArray[np.int32],
    pieces: tuple[int, NDArray, NDArray, NDArray],
    widest: float,
    turn: int,
    threads: int | None,
) -> None:
    """One local search, in place, and of a closed surface small islands absorbed; where that buries samples, one more."""
    from ._kernels.components import number_components
    from ._kernels.repair import search, thin_spots

    number, component, size, queue = pieces
    m = len(ground[4])
    thin = np.zeros(m, np.bool_)
    if widest == np.inf:
        over_ranges(lambda *part: thin_spots(*ground[2:5], sides, *part, thin), m, threads)
    known = ground, sides, *poles[:2], np.float32(widest), ROUNDS, turn, thin
    for _ in range(2):
        search(*known, np.zeros((3, len(sides)), np.int64), excess, component, size, queue, number)
        if widest < np.inf or not _absorb(ground, sides, excess, component, size, threads):
            break
        number = number_components(ground[3], sides, component, size)


def _absorb(
    ground: tuple[NDArray, ...],
    sides: NDArray[np.int8],
    excess: NDArray[np.int32],
    component: NDArray[np.int32],
    size: NDArray[np.int64],
    threads: int | None,
) -> bool:
    """Give small pieces that are no voids to the other side, in place; does that bury samples?"""
    from ._kernels import components, repair

    nodes, links, gate = ground[2:5]
    number = components.number_components(links, sides, component, size)
    if not repair.absorb(nodes, links, gate, len(gate), sides, component, size, number):
        return False
    buried = np.count_nonzero(excess < 0)
    excess[:] = excesses(ground, facets_between(links, sides, len(gate), threads), np.inf, threads)
    return bool(np.count_nonzero(excess < 0) > buried)


def flip_edges(
    ground: tuple[NDArray, ...],
    sides: NDArray[np.int8],
    excess: NDArray[np.int32],
    widest: float,
    threads: int | None,
) -> int:
    """Flip edges of the surface, in place, so that it bends less; how many? Topology and vertices stay.

    Parameters
    ----------
    ground, sides, widest, threads
        See `repair`. Gates of a sheet's facets that are wider than its own become `widest`.
    excess : (n,) ndarray of int32
        What `repair` gives; at samples where it is not 0 edges stay.
    """
    from ._kernels import edge_flips as kernels  # numba takes a while to load

    m = len(ground[4])
    hot = np.zeros(m, np.bool_)
    state = ground, np.float32(widest), sides, excess
    over_ranges(lambda *part: kernels.promising(*state, *part, hot), m, threads)
    return kernels.flip_edges(*state, hot)


def excesses(
    ground: tuple[NDArray, ...], facets: NDArray[np.int64], widest: float, threads: int | None
) -> NDArray[np.int32]:
    """Umbrellas of every sample beyond the first, -1 of a buried one, 0 of those in no cell (n,), by the facets between the sides."""
    from ._kernels import umbrellas

    points, _, nodes, _, gate, starts, _ = ground
    if widest < np.inf:
        facets = facets[gate.ravel()[facets] <= widest]
    excess = np.zeros(len(points), np.int32)
    over_ranges(lambda *part: umbrellas.excesses(nodes, facets, starts, *part, excess), len(points), threads)
    return excess
