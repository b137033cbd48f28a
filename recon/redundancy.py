"""Balls that a union can do without: the redundant points of section 4 of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .alpha import INTERIOR, AlphaComplex, alpha_complex
from .location import find_simplices
from .power import adjacency


def redundant_points(complex_: AlphaComplex, alpha: float) -> NDArray[np.bool_]:
    """Tell of every point p whether the union of balls at alpha is the same without it (n,): F(S) = F(S - {p}).

    Hidden points and those outside K_alpha are: their balls have nothing in their power cells. Those on the boundary of
    W_alpha are not, but for duplicates. The ball of an interior one covers all of its power cell; without it the star of p
    is triangulated by its neighbours, and by the points that it hides: to be covered, all these cells must be in.
    """
    t = complex_.triangulation
    redundant = np.ones(len(t.points), bool)
    rows, kind = complex_.simplices(0)[:, 0], complex_.classify(0, alpha)
    redundant[rows[kind > 0]] = False
    everything = np.column_stack([t.points, t.weights]) + 0.0
    _, name, copies = np.unique(everything, axis=0, return_inverse=True, return_counts=True)
    redundant |= copies[name.ravel()] > 1
    d = complex_.dimension
    if d < t.points.shape[1]:  # every ball that shows in the flat of the centres shows beside it
        return redundant
    starts, beside = adjacency(complex_)
    carriers = find_simplices(t, t.points[t.hidden]) if len(t.hidden) else np.empty((0, 1), np.int32)
    for p in rows[(kind == INTERIOR) & ~redundant[rows]].tolist():
        under = t.hidden[(carriers == p).any(axis=1)]
        around = np.sort(np.concatenate([beside[starts[p] : starts[p + 1]], under]))
        without = alpha_complex(t.points[around], t.weights[around])
        place = int(np.searchsorted(around, p))
        also = np.insert(around, place, p)
        with_p = alpha_complex(t.points[also], t.weights[also])
        kept = set(map(tuple, also[with_p.simplices(d)].tolist()))
        hole = [cell not in kept for cell in map(tuple, around[without.simplices(d)].tolist())]
        redundant[p] = without.dimension == d and bool((without.rho(d)[hole] <= alpha).all())
    return redundant
