"""The facets between two sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .threads import over_ranges


def facets_between(
    links: NDArray[np.int32], sides: NDArray[np.int8], cells: int, threads: int | None
) -> NDArray[np.int64]:
    """All facets between the sides, as 4 * cell + corner, seen from side 1 where it is a cell.

    Parameters
    ----------
    links : (N, 4) ndarray of int32
        Neighbours of nodes, the cells first, see `recon._kernels.sides`.
    sides : (N,) ndarray of int8
    cells : int
    threads : int or None
    """
    from ._kernels import forest  # numba takes a while to load

    return np.concatenate(over_ranges(lambda *part: forest.facets_between(links, sides, cells, *part), cells, threads))
