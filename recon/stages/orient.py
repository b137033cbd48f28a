"""Turn the singular facets of an alpha shape, which have no outside, so that neighbours agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def orient_singular(points: NDArray[np.float64], facets: NDArray[np.int32], singular: NDArray[np.bool_]) -> NDArray:
    """Orient each sheet of singular facets by itself.

    Neighbours across an edge of exactly two facets agree; a closed sheet faces outward, an open one as its first facet
    does; one that cannot be oriented (a Möbius band) is left as it is. Regular facets keep their side.

    Parameters
    ----------
    points : (n, 3) ndarray of float64 [L]
    facets : (f, 3) ndarray of int32
    singular : (f,) ndarray of bool

    Returns
    -------
    (f, 3) ndarray of int32

    Notes
    -----
    Connected components of the oriented double cover: each facet is there once with either side up.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    which = np.flatnonzero(singular)
    if len(which) == 0:
        return facets
    first, second, agree, is_closed = _neighbours(facets, which)
    m = len(which)
    over = np.where(agree, 0, m)
    a, b = np.concatenate([first, first + m]), np.concatenate([second + over, (second + m + over) % (2 * m)])
    _, side = connected_components(coo_matrix((np.ones(len(a), bool), (a, b)), shape=(2 * m, 2 * m)), directed=False)
    up, down = side[:m], side[m:]
    sheet = np.minimum(up, down)
    turn = up > down  # within one sheet all facets that are not turned agree

    x = points[facets[which]] - points[facets[which]].mean(axis=(0, 1))
    volume = np.einsum("ij,ij->i", x[:, 0], np.cross(x[:, 1], x[:, 2]))
    total = np.bincount(sheet, np.where(turn, -volume, volume))
    open_sheet = np.bincount(sheet, ~is_closed) > 0
    inward = (total < 0) & ~open_sheet
    turn ^= inward[sheet]
    turn &= up != down
    turned = facets.copy()
    turned[which[turn], 1:] = facets[which[turn], :0:-1]
    return turned


def _neighbours(
    facets: NDArray[np.int32], which: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
    """Pairs of facets (numbered within `which`) across edges of two facets, whether they agree; facets with three such edges."""
    tail = facets[:, [0, 1, 2]].ravel().astype(np.int64)
    head = facets[:, [1, 2, 0]].ravel().astype(np.int64)
    n = int(max(tail.max(), head.max())) + 1
    _, edge, count = np.unique(
        np.minimum(tail, head) * n + np.maximum(tail, head), return_inverse=True, return_counts=True
    )
    number = np.full(len(facets), -1)
    number[which] = np.arange(len(which))
    owner = number[np.arange(len(tail)) // 3]
    paired = (count[edge] == 2) & (owner >= 0)
    order = np.flatnonzero(paired)
    order = order[np.argsort(edge[order], kind="stable")]
    # An edge of two facets has two singular or two regular ones: balls around it are crossed in and out.
    first, second = order[0::2], order[1::2]
    is_closed = (paired.reshape(-1, 3).all(axis=1))[which]
    return owner[first], owner[second], tail[first] != tail[second], is_closed
