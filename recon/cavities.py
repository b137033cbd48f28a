"""Voids and pockets of the space filling diagram, and how cells share out the balls at their corners (paper, section 4)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Cavities:
    """Voids or pockets: regions of the complement of F_alpha, numbered by their lowest cell.

    Attributes
    ----------
    volumes : (v,) ndarray of float64 [L^d]
        Of the empty space.
    areas : (v,) ndarray of float64 [L^(d-1)]
        Of the part of the boundary of F_alpha around it; of a pocket without its mouths.
    cells : (c, d+1) ndarray of int32
        The cells of R that cover them: input rows, in lexicographic order. Their vertices line the cavity.
    number : (c,) ndarray of int64
        Which cavity each cell belongs to.
    mouths : (v,) ndarray of int64
        Facets of R through which it opens to the outside: 0 for a void.
    """

    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    cells: NDArray[np.int32]
    number: NDArray[np.int64]
    mouths: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.volumes)


def contents(corners: NDArray[np.float64], d: int) -> NDArray[np.float64]:
    """Volumes (c,) of cells of corners (c, d+1, 3)."""
    edges = (corners[:, 1:] - corners[:, :1])[..., :d]
    return np.abs(np.linalg.det(edges)) / math.factorial(d)


def shares(corners: NDArray[np.float64], d: int, k: int) -> Iterator[tuple[tuple[int, ...], NDArray[np.float64]]]:
    """Yield for each k-face of a cell its slots and which part (c,) of its surroundings the cell takes: its angle."""
    if k == d - 1:
        for slot in range(d + 1):
            yield tuple(i for i in range(d + 1) if i != slot), np.full(len(corners), 0.5)
    elif k == d - 2:
        for kept in combinations(range(d + 1), k + 1):
            i, j = (s for s in range(d + 1) if s not in kept)
            u, v = corners[:, i] - corners[:, kept[0]], corners[:, j] - corners[:, kept[0]]
            if d == 3:
                axis = corners[:, kept[1]] - corners[:, kept[0]]
                u, v = np.cross(axis, u), np.cross(axis, v)
            yield kept, _angle(u, v) / (2 * math.pi)
    else:
        for slot in range(4):
            a, b, c = (corners[:, s] - corners[:, slot] for s in range(4) if s != slot)
            a, b, c = (v / np.linalg.norm(v, axis=1)[:, None] for v in (a, b, c))
            span = np.abs((np.cross(a, b) * c).sum(axis=1))
            rest = 1 + (a * b).sum(axis=1) + (b * c).sum(axis=1) + (c * a).sum(axis=1)
            yield (slot,), 2 * np.arctan2(span, rest) / (4 * math.pi)


def _angle(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles (c,) between vectors (c, 3)."""
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
