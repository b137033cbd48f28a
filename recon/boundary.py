"""The facets of one weighted alpha shape W_alpha, oriented (paper, section 2), without the intervals of all others."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._kernels import alpha as levels
from ._kernels import boundary as kernels
from ._kernels.sizes import settle
from .intervals import Family, unscaled


@dataclass(frozen=True, slots=True, eq=False)
class Boundary:
    """Facets of W_alpha: its exposed simplices of one dimension less than R, and nothing else.

    Attributes
    ----------
    facets : (f, d) ndarray of int32
        Input rows, in the lexicographic order of the sorted facets. A regular facet is oriented outward: in 3-D
        counter-clockwise seen from outside, the lowest row first; in 2-D with the inside on its left. A singular facet
        ascends.
    singular : (f,) ndarray of bool
        Exposed from both sides, so bounding no interior.
    """

    facets: NDArray[np.int32]
    singular: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.facets)

    def __repr__(self) -> str:
        count = np.count_nonzero(self.singular)
        return f"Boundary({len(self) - count} regular and {count} singular facets)"


def boundary_at(family: Family, alpha: float) -> Boundary:
    """Give the facets of W_alpha."""
    d = family.triangulation.dimension
    if d == 0:
        return _frozen(np.empty((0, 0), np.int32), np.empty(0, bool))
    if d == 3 and family.by_kernels and not family.has(2):
        return _boundary_alone(family, alpha)
    return _boundary_of_levels(family, alpha)


def _boundary_of_levels(family: Family, alpha: float) -> Boundary:
    """Read the facets off the intervals."""
    triangulation, d = family.triangulation, family.triangulation.dimension
    level = family.level(d - 1)
    regular = (level.mu_lower <= alpha) & (level.on_hull | (alpha < level.mu_upper))
    singular = ~level.attached & (level.rho <= alpha) & (alpha < level.mu_lower)
    found = np.flatnonzero(regular | singular)
    owner = family.owners()[found]
    # The facets of a positive cell, in the order of its vertices, face outward for an even slot, else inward.
    cell, slot = np.divmod(owner, d + 1)
    corners = triangulation.cells[cell]
    corners = corners[np.arange(d + 1) != slot[:, None]].reshape(len(found), d)
    odd = (slot + _parity(corners) + (family.cell_sizes[cell] > alpha)) % 2 == 1
    facets, singular = level.simplices[found].copy(), singular[found]
    if d > 1:
        turn = odd & ~singular
        facets[turn, -2:] = facets[turn, -2:][:, ::-1]
    return _frozen(facets, singular)


def _boundary_alone(family: Family, alpha: float) -> Boundary:
    """Compare the sizes of tetrahedra with alpha, and measure only the few facets that may be singular."""
    cells, neighbors = family.triangulation.cells, family.triangulation.neighbors
    points, exponent, _ = family.scaled
    with np.errstate(over="ignore"):  # infinite where the points are that small
        bound = float(np.ldexp(alpha, -2 * exponent))
    verdict = np.empty(len(cells), np.uint8)
    if math.isinf(alpha):
        verdict[:] = alpha > 0
    else:
        kernels.cells_in(points, cells, bound, verdict)
        close = np.flatnonzero(verdict == 2)
        verdict[close] = _sizes(family, cells[close])[0] <= alpha
    marks = np.empty(len(cells), np.uint8)
    regular_count, singular_count = kernels.facets_between(points, cells, neighbors, verdict, bound, marks)
    regular, singular = np.empty(regular_count, np.int32), np.empty(singular_count, np.int32)
    kernels.list_facets(marks, 0, regular)
    kernels.list_facets(marks, 4, singular)
    singular = _singular(family, singular, alpha)

    found = np.concatenate([regular, singular])
    starts, facets = np.empty(len(points) + 2, np.int64), np.empty((len(found), 3), np.int32)
    position, inward = np.empty(len(found), np.int32), np.empty(len(found), np.uint8)
    kernels.bucket_facets(cells, found, starts, facets, position, inward)
    levels.sort_buckets(starts[:-1], facets, position, inward, np.empty((0, len(found))))
    is_singular = position >= len(regular)
    turn = (inward == 1) & ~is_singular
    facets[turn, 1:] = facets[turn, :0:-1]
    return _frozen(facets, is_singular)


def _singular(family: Family, facets: NDArray[np.int32], alpha: float) -> NDArray[np.int32]:
    """Choose from facets (4 cell + slot) between outer cells those that are unattached and of size at most alpha."""
    cells, neighbors = family.triangulation.cells, family.triangulation.neighbors
    corners = cells[facets >> 2][np.arange(4) != (facets & 3)[:, None]].reshape(-1, 3)
    facets = facets[_sizes(family, corners)[0] <= alpha]
    cell, slot = facets >> 2, facets & 3
    other = neighbors[cell, slot]
    beside = np.unique(np.concatenate([cell, other[other >= 0]]))
    conflict = np.zeros(len(cells) + 1, np.uint8)  # the last one stands for the outside, -1
    conflict[beside] = _sizes(family, cells[beside])[1]
    mirror = (neighbors[other] == cell[:, None]).argmax(axis=1)
    return facets[(conflict[cell] >> slot & 1 == 0) & (conflict[other] >> mirror & 1 == 0)]


def _sizes(family: Family, simplices: NDArray[np.int32]) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Sizes of a few triangles or tetrahedra, and bits of the negative coordinates of their orthocentres."""
    points, exponent, integral = family.scaled
    rho, code = np.empty(len(simplices)), np.full(len(simplices), (1 << simplices.shape[1]) - 1, np.uint8)
    settle(points, integral, simplices, rho, code)
    return unscaled(rho, exponent), code


def _parity(rows: NDArray[np.int32]) -> NDArray[np.int64]:
    """Number of inversions (s,) of each row (s, d)."""
    first, second = np.triu_indices(rows.shape[1], 1)
    return (rows[:, first] > rows[:, second]).sum(axis=1)


def _frozen(facets: NDArray[np.int32], singular: NDArray[np.bool_]) -> Boundary:
    facets.flags.writeable = singular.flags.writeable = False
    return Boundary(facets, singular)
