"""A tree of bounding boxes over the faces of a mesh, as flat arrays: for distances, rays and candidate pairs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_LEAF = 4  # faces a leaf, about
_PAIRS = 1 << 16  # pairs of nodes at a time


@dataclass(frozen=True, slots=True, eq=False)
class BoxTree:
    """A complete binary tree: node 1 is the root, nodes 2 i and 2 i + 1 the children of i, the last `leaves` are leaves.

    Attributes
    ----------
    order : (f,) ndarray of int64
        Faces in the order of the leaves.
    start : (leaves + 1,) ndarray of int64
        Leaf i, which is node leaves + i, holds order[start[i] : start[i + 1]].
    lower, upper : (2 leaves, 3) ndarray of float64 [L]
        Corners of the box of each node; node 0 is not used.
    """

    order: NDArray[np.int64]
    start: NDArray[np.int64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    @property
    def leaves(self) -> int:
        """Number of leaves, a power of two."""
        return len(self.start) - 1


def box_tree(corners: NDArray[np.float64]) -> BoxTree:
    """Build the tree over one face or more.

    Parameters
    ----------
    corners : (f, 3, 3) ndarray of float64 [L]

    Returns
    -------
    BoxTree
    """
    f = len(corners)
    low, high = corners.min(axis=1), corners.max(axis=1)
    order = np.argsort(morton(0.5 * low + 0.5 * high), kind="stable")
    leaves = 1 << max(0, (f - 1) // _LEAF).bit_length()
    start = np.arange(leaves + 1) * f // leaves
    lower, upper = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    # Even shares of f >= leaves / 2 faces: a leaf may be empty, and then stays the empty box.
    full = np.flatnonzero(np.diff(start))
    lower[leaves + full] = np.minimum.reduceat(low[order], start[full])
    upper[leaves + full] = np.maximum.reduceat(high[order], start[full])
    level = leaves
    while level > 1:
        lower[level // 2 : level] = lower[level : 2 * level].reshape(-1, 2, 3).min(axis=1)
        upper[level // 2 : level] = upper[level : 2 * level].reshape(-1, 2, 3).max(axis=1)
        level //= 2
    return BoxTree(order, start, lower, upper)


def morton(points: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Give each point its place along a Z-curve through the bounding box, 21 bits an axis.

    Parameters
    ----------
    points : (m, 3) ndarray of float64 [L]

    Returns
    -------
    (m,) ndarray of uint64
    """
    low = points.min(axis=0)
    extent = (points - low).max()
    cells = np.minimum((points - low) * ((1 << 21) / extent) if extent > 0 else points - low, (1 << 21) - 1)
    code = np.zeros(len(points), np.uint64)
    for axis in range(3):
        bits = cells[:, axis].astype(np.uint64)
        for shift, mask in (
            (32, 0x1F00000000FFFF),
            (16, 0x1F0000FF0000FF),
            (8, 0x100F00F00F00F00F),
            (4, 0x10C30C30C30C30C3),
            (2, 0x1249249249249249),
        ):
            bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
        code |= bits << np.uint64(2 - axis)
    return code


def overlapping_pairs(
    tree: BoxTree, low: NDArray[np.float64], high: NDArray[np.float64]
) -> Iterator[NDArray[np.int64]]:
    """Give the pairs of faces whose closed boxes meet, in chunks.

    Parameters
    ----------
    tree : BoxTree
    low, high : (f, 3) ndarrays of float64 [L]
        The boxes of the faces, from which the tree was built.

    Yields
    ------
    (m, 2) ndarrays of int64
        Faces a != b; each pair once in all chunks together.
    """
    stack = [np.array([[1, 1]])]
    while stack:
        pairs = stack.pop()
        if len(pairs) > _PAIRS:
            stack += [pairs[_PAIRS:], pairs[:_PAIRS]]
            continue
        a, b = pairs.T
        meet = (tree.lower[a] <= tree.upper[b]).all(axis=1) & (tree.lower[b] <= tree.upper[a]).all(axis=1)
        pairs = pairs[meet]
        if len(pairs) == 0:
            continue
        if pairs[0, 0] >= tree.leaves:
            yield _face_pairs(tree, low, high, pairs - tree.leaves)
            continue
        a, b = 2 * pairs.T
        same = a == b
        stack.append(
            np.concatenate(
                [
                    np.column_stack([a, b]),
                    np.column_stack([a, b + 1]),
                    np.column_stack([a + 1, b + 1]),
                    np.column_stack([a + 1, b])[~same],
                ]
            )
        )


def _face_pairs(
    tree: BoxTree, low: NDArray[np.float64], high: NDArray[np.float64], leaves: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Pairs of faces with overlapping boxes, of pairs of leaves."""
    begin, count = tree.start[leaves], np.diff(tree.start)[leaves]
    found = []
    for i in range(int(count[:, 0].max(initial=0))):
        for j in range(int(count[:, 1].max(initial=0))):
            rows = (i < count[:, 0]) & (j < count[:, 1]) & ((leaves[:, 0] != leaves[:, 1]) | (i < j))
            a, b = tree.order[begin[rows, 0] + i], tree.order[begin[rows, 1] + j]
            meet = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
            found.append(np.column_stack([a[meet], b[meet]]))
    return np.concatenate(found) if found else np.zeros((0, 2), np.int64)
