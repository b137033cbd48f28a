"""One step of closing weights: a linear program that opens what should be empty and closes what should be covered.

The unknowns are changes of weights. Every condition is linear in them, or made so at the present weights; conditions that
cannot all hold are broken as little as possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, eye_array, hstack

# Lengths and weights in local spacings and their squares.
STEP = 0.3  # greatest change of a weight in a step
STEEP = 0.9  # of the squared distance, what neighbouring weights may differ by: no neighbour hides another
NEAR = 1.5  # conditions that are met by no more than this factor are stated as well
PRICE = 100.0  # of breaking a condition, in changes of weight


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Conditions coefficients * (change of the weights of these points) >= bound.

    Attributes
    ----------
    points : (r, k) ndarray of int
    coefficients : (r, k) ndarray of float64
    bound : (r,) ndarray of float64 [L^2]
    """

    points: NDArray[np.integer]
    coefficients: NDArray[np.float64]
    bound: NDArray[np.float64]

    def only(self, chosen: NDArray[np.bool_]) -> Rows:
        """Those that are chosen, and that rounding has not spoilt."""
        good = chosen & np.isfinite(self.bound) & np.isfinite(self.coefficients).all(axis=1)
        return Rows(self.points[good], self.coefficients[good], self.bound[good])

    def touching(self, chosen: NDArray[np.bool_]) -> Rows:
        """Those with a chosen point."""
        return self.only(chosen[self.points].any(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Facing:
    """Facets as seen by a cell beside each, at given weights.

    Attributes
    ----------
    facets : (f, 3) ndarray of int
    apex : (f,) ndarray of int
        The fourth vertex of the cell.
    foot, center : (f, 3) ndarray of float64
        Barycentric coordinates of the foot of the apex and of the facet's orthocentre.
    height : (f,) ndarray of float64 [L]
    offset : (f,) ndarray of float64 [L^2]
        Twice the height times the distance of the cell's orthocentre from the facet, below 0 where it lies beyond: then the
        cell attaches the facet. Its derivative by the weights is `foot`, and -1 for the apex.
    rho : (f,) ndarray of float64 [L^2]
        Size of the facet; its derivative is minus `center`. That of the cell is rho + (offset / (2 height))^2.
    """

    facets: NDArray[np.integer]
    apex: NDArray[np.integer]
    foot: NDArray[np.float64]
    center: NDArray[np.float64]
    height: NDArray[np.float64]
    offset: NDArray[np.float64]
    rho: NDArray[np.float64]


def facing(
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
    facets: NDArray[np.integer],
    apex: NDArray[np.integer],
) -> Facing:
    """Measure facets and the cells beside them."""
    origin = points[facets[:, 0]]
    e1, e2, e = points[facets[:, 1]] - origin, points[facets[:, 2]] - origin, points[apex] - origin
    w = weights[facets]
    normal = np.cross(e1, e2)
    with np.errstate(all="ignore"):  # needles have no centres in float64
        doubled = _dot(normal, normal)
        a, b, c = _dot(e1, e1), _dot(e1, e2), _dot(e2, e2)
        foot1, foot2 = (c * _dot(e, e1) - b * _dot(e, e2)) / doubled, (a * _dot(e, e2) - b * _dot(e, e1)) / doubled
        right1, right2 = (a + w[:, 0] - w[:, 1]) / 2, (c + w[:, 0] - w[:, 2]) / 2
        center1, center2 = (c * right1 - b * right2) / doubled, (a * right2 - b * right1) / doubled
        return Facing(
            facets,
            apex,
            np.column_stack([1 - foot1 - foot2, foot1, foot2]),
            np.column_stack([1 - center1 - center2, center1, center2]),
            np.abs(_dot(e, normal)) / np.sqrt(doubled),
            _dot(e, e) + w[:, 0] - weights[apex] - 2 * foot1 * right1 - 2 * foot2 * right2,
            _dot(center1, right1) + _dot(center2, right2) - w[:, 0],
        )


def walls(seen: Facing, unit_sq: NDArray[np.float64], empty: NDArray[np.bool_], margin: float) -> list[Rows]:
    """Demand that facets be in K_0, and that the cells that see them be not, where `empty`.

    The orthocentre of the cell has to lie on the cell's side of the facet, so that it does not attach it, at a distance D
    with D^2 above what the facet's size is below 0.
    """
    unit = unit_sq[seen.facets].mean(axis=1)
    with np.errstate(all="ignore"):
        deep = empty & (seen.rho < 0)
        wanted = np.sqrt(np.where(deep, -seen.rho, 0.0) + margin * unit)
        slope = seen.foot - np.where(deep, seen.height / wanted, 0.0)[:, None] * seen.center
        goal = 2 * seen.height * wanted
        push = _with_apex(seen, slope, goal - seen.offset)
        close = Rows(seen.facets, seen.center, seen.rho + margin * unit)
        return [push.only(seen.offset < NEAR * goal), close.only(seen.rho > -0.5 * unit)]


def curtains(sides: tuple[Facing, Facing], unit_sq: NDArray[np.float64], margin: float) -> list[Rows]:
    """Demand that facets be not in K_0 when both cells are not: attached to one of them, or of a size above 0.

    Of the three, what takes the least change. An apex of -1 is at infinity, and attaches nothing.
    """
    unit = unit_sq[sides[0].facets].mean(axis=1)
    ways, needs = [], []
    with np.errstate(all="ignore"):
        for seen in sides:
            way = _with_apex(seen, -seen.foot, seen.offset + 2 * seen.height * np.sqrt(margin * unit))
            way.coefficients[:, 3] = 1.0
            way.bound[seen.apex < 0] = np.inf
            ways.append(way)
            needs.append(way.bound / np.sqrt((way.coefficients**2).sum(axis=1)))
        center = sides[0].center
        ways.append(Rows(sides[0].facets, -center, margin * unit - sides[0].rho))
        needs.append(ways[2].bound / np.sqrt((center**2).sum(axis=1)))
        need = np.array(needs)
        need[~np.isfinite(need)] = np.inf
        best = need.argmin(axis=0)
        tight = need.min(axis=0) > -(NEAR - 1) * margin * unit
    return [way.only(tight & (best == k)) for k, way in enumerate(ways)]


def _with_apex(seen: Facing, slope: NDArray[np.float64], bound: NDArray[np.float64]) -> Rows:
    """Conditions on the corners of facets, and on the apex with coefficient -1."""
    return Rows(
        np.column_stack([seen.facets, seen.apex]), np.column_stack([slope, np.full(len(slope), -1.0)]), bound.copy()
    )


def expelled(
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
    unit_sq: NDArray[np.float64],
    simplices: NDArray[np.integer],
    margin: float,
) -> Rows:
    """Demand that the sizes of simplices be above 0; a size is convex in the weights, so its tangent is safe."""
    edges = points[simplices[:, 1:]] - points[simplices[:, :1]]
    w = weights[simplices]
    right = ((edges**2).sum(axis=2) + w[:, :1] - w[:, 1:]) / 2
    with np.errstate(all="ignore"):
        gram = edges @ edges.transpose(0, 2, 1)
        size = np.trace(gram, axis1=1, axis2=2)[:, None, None]
        certain = np.linalg.det(gram / size) > 1e-14
        gram[~certain] = np.eye(gram.shape[1])
        share = np.linalg.solve(gram, right[:, :, None])[:, :, 0]
        rho = (share * right).sum(axis=1) - w[:, 0]
    center = np.column_stack([1 - share.sum(axis=1), share])
    bound = margin * unit_sq[simplices].mean(axis=1) - rho
    return Rows(simplices, -center, bound).only(certain)


def graded(points: NDArray[np.float64], weights: NDArray[np.float64], edges: NDArray[np.integer]) -> Rows:
    """Demand that no weight exceed its neighbour's by more than `STEEP` squared distances."""
    both = np.concatenate([edges, edges[:, ::-1]])
    room = STEEP * ((points[both[:, 0]] - points[both[:, 1]]) ** 2).sum(axis=1)
    rise = weights[both[:, 1]] - weights[both[:, 0]]
    tight = rise > 0.4 * room
    both = both[tight]
    return Rows(both, np.tile([1.0, -1.0], (len(both), 1)), (rise - room)[tight])


def step(rows: list[Rows], unit_sq: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Change of weights (n,) that breaks the conditions least, and among such the least; None if the solver gives up."""
    from scipy.optimize import linprog  # takes a while to load

    n = len(unit_sq)
    blocks, bounds, first = [], [], 0
    for part in rows:
        unit = unit_sq[part.points].mean(axis=1)
        values = part.coefficients * unit_sq[part.points] / unit[:, None]
        row = np.repeat(np.arange(first, first + len(unit)), part.points.shape[1])
        blocks.append((values.ravel(), row, part.points.ravel()))
        bounds.append(part.bound / unit)
        first += len(unit)
    if first == 0:
        return np.zeros(n)
    values, row, column = (np.concatenate(pieces) for pieces in zip(*blocks))
    matrix = csr_array(coo_array((values, (row, column)), shape=(first, n)))
    result = linprog(
        np.concatenate([np.ones(2 * n), np.full(first, PRICE)]),
        A_ub=hstack([-matrix, matrix, -eye_array(first)]).tocsr(),
        b_ub=-np.concatenate(bounds),
        bounds=np.column_stack([np.zeros(2 * n + first), np.r_[np.full(2 * n, STEP), np.full(first, np.inf)]]),
        method="highs",
    )
    if result.status != 0:
        return None
    return (result.x[:n] - result.x[n : 2 * n]) * unit_sq


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return (a * b).sum(axis=1) if a.ndim == 2 else a * b
