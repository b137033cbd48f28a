"""Voids and pockets of the space filling diagram, and what the union of balls has of the cells there (paper, section 4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._kernels import cavities as kernels
from .threads import over_ranges


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


def balls_within(
    balls: NDArray[np.float64], cells: NDArray[np.int32], starts: NDArray[np.int64], beside: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Volume and area (c, 2) that a union of balls has within cells: power cell by power cell, in closed form.

    Parameters
    ----------
    balls : (n, 4) ndarray of float64
        x, y, z and the squared radius, empty where negative.
    cells : (c, d+1) ndarray of int32
    starts : (n+1,) ndarray of int64
    beside : (e,) ndarray of int64
        Whose power cells share a facet with that of p: beside[starts[p]:starts[p+1]].
    """
    if cells.shape[1] == 2:
        return _intervals_within(balls, cells)
    result = np.empty((len(cells), 2))

    def work(done: int, stop: int) -> None:
        room = 256
        while done < stop:
            done += kernels.balls_within(balls, cells[done:stop], starts, beside, room, result[done:stop])
            room *= 4

    over_ranges(work, len(cells), None)
    return result


def _intervals_within(balls: NDArray[np.float64], cells: NDArray[np.int32]) -> NDArray[np.float64]:
    """Length and number of ends that a union of intervals has within others."""
    there = balls[balls[:, 3] >= 0]
    reach = np.sqrt(there[:, 3])
    order = np.argsort(there[:, 0] - reach)
    low, high = (there[:, 0] - reach)[order], np.maximum.accumulate((there[:, 0] + reach)[order])
    first = np.append(True, low[1:] > high[:-1])[: len(low)]  # of each interval of the union
    low, high = low[first], np.append(high[:-1][first[1:]], high[-1:])
    start, stop = np.sort(balls[cells, 0], axis=1).T[:, :, None]
    length = np.maximum(np.minimum(stop, high) - np.maximum(start, low), 0.0).sum(axis=1)
    ends = [((start <= end) & (end < stop)).sum(axis=1) for end in (low, high)]
    return np.column_stack([length, ends[0] + ends[1]])
