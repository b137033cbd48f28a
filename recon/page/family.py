"""All alphas at once, in the form that a page can sweep: simplices, and the ranks of their intervals.

A simplex changes its class at critical values alone. With these sorted, once, as float64, an interval is three whole
numbers: the ranks of its bounds. A page compares alpha with the critical values in double precision, by bisection, and
whole numbers thereafter; so it draws what `AlphaComplex.classify` says, for every alpha.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..alpha import AlphaComplex
from ..regular import RegularTriangulation

_NAMES = {
    "void": "inside enclosed",
    "solid": "every point on a solid",
    "stable": "lasting longest",
    "connected": "in one piece",
}


def family_arrays(family: AlphaComplex) -> dict[str, NDArray]:
    """Give what a page needs to draw the boundary of W_alpha for any alpha.

    Parameters
    ----------
    family : AlphaComplex
        Of points in up to 3-D.

    Returns
    -------
    dict of str to ndarray
        ``critical`` (c,) float64 [L^2], ascending; ``betti`` (c, max(1, d)) int32, from each of them on;
        ``facets`` (f, d) int32, oriented as `Boundary.facets`; ``intervals`` (f, 3) int32, ranks in ``critical`` of the
        values from where on a facet is in K_alpha, not singular, and interior (c for never);
        ``cells`` (m, d+1) int32 and ``entries`` (m,) int32, the ranks of their sizes, where d is 1 or 2: what is drawn
        as the inside.
    """
    d, critical = family.dimension, family.spectrum()
    arrays: dict[str, NDArray] = {"critical": critical, "betti": family.betti(critical).astype(np.int32)}
    if d == 0:
        return {**arrays, "facets": np.zeros((0, 1), np.int32), "intervals": np.zeros((0, 3), np.int32)}
    bounds = (family.entry(d - 1), family.mu_lower(d - 1), family.mu_upper(d - 1))
    arrays["facets"] = _outward(family)
    arrays["intervals"] = np.column_stack([_ranks(critical, bound) for bound in bounds])
    if d < 3:
        arrays["cells"], arrays["entries"] = family.simplices(d), _ranks(critical, family.rho(d))
    return arrays


def marks(family: AlphaComplex) -> list[dict[str, Any]]:
    """Give the alphas that `AlphaComplex.choices` recommends, the first one first, each once; and 0 between weights."""
    chosen: dict[float, dict[str, Any]] = {}
    for choice in family.choices():
        chosen.setdefault(choice.alpha, {"alpha": choice.alpha, "name": _NAMES[choice.criterion], "why": choice.why})
    if family.triangulation.weights.any():
        chosen.setdefault(0.0, {"alpha": 0.0, "name": "0", "why": "the weights as they are"})
    return [mark for alpha, mark in chosen.items() if math.isfinite(alpha)]  # sizes may overflow


def _ranks(critical: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.int32]:
    return np.searchsorted(critical, values).astype(np.int32)


def _outward(family: AlphaComplex) -> NDArray[np.int32]:
    """Facets (f, d), turned as they are wherever they are regular: with the cell that enters first behind them."""
    d, triangulation = family.dimension, family.triangulation
    facets = family.simplices(d - 1).copy()
    if d == 1:
        return facets
    sizes = np.empty(len(triangulation.cells))
    sizes[np.lexsort(np.sort(triangulation.cells, axis=1).T[::-1])] = family.rho(d)
    cells = triangulation.cells[np.argsort(-sizes)]  # so that of two cells the one that enters first writes last
    corners = np.stack([np.delete(cells, slot, axis=1) for slot in range(d + 1)], axis=1)
    rows = _find(np.sort(corners, axis=2), facets, triangulation)
    # The facets of a positive cell, in the order of its vertices, face outward for an even slot, else inward.
    turned = np.zeros(len(facets), bool)
    turned[rows] = (np.arange(d + 1) + _inversions(corners)) % 2 == 1
    facets[turned, -2:] = facets[turned, :-3:-1]
    return facets


def _find(simplices: NDArray[np.int32], among: NDArray[np.int32], triangulation: RegularTriangulation) -> NDArray:
    """Rows of simplices (..., d <= 3) among others, which are in lexicographic order."""
    n = len(triangulation.points)  # n**3 is far from 2**63 for all n that a page can show
    scale = np.int64(n) ** np.arange(among.shape[1] - 1, -1, -1)
    return np.searchsorted(among @ scale, simplices @ scale)


def _inversions(rows: NDArray[np.int32]) -> NDArray[np.int64]:
    """Pairs out of order in each row (..., d)."""
    first, second = np.triu_indices(rows.shape[-1], 1)
    return (rows[..., first] > rows[..., second]).sum(axis=-1)
