"""Size, attachment and interval bounds of all simplices of R, one level a dimension (paper, section 5 and rule 5.3).

The kernels serve cells of dimension 2 and 3 in up to three coordinates, `intervals_nd` all others, by the same rules.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import intervals_nd
from ._kernels import alpha as kernels
from ._kernels import voids
from ._kernels.alpha import ATTACHED, HULL
from ._kernels.sizes import settle
from .contracts import InvalidInput
from .regular import RegularTriangulation


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """All k-simplices of R in lexicographic order, and what section 5 says of each.

    Attributes
    ----------
    simplices : (s, k+1) ndarray of int32
        Input rows, ascending in a row.
    starts : (n+1,) ndarray of int64
        The simplices of first vertex v are starts[v] .. starts[v+1] - 1.
    rho, mu_lower, mu_upper : (s,) ndarray of float64 [L^2]
    code : (s,) ndarray of uint8
        ATTACHED, HULL, and what the next level down needs.
    owner : (s,) ndarray of int32 or None
        Where known: of a facet (k+1) * cell + slot opposite, of a cell its row in the triangulation.
    """

    simplices: NDArray[np.int32]
    starts: NDArray[np.int64]
    rho: NDArray[np.float64]
    mu_lower: NDArray[np.float64]
    mu_upper: NDArray[np.float64]
    code: NDArray[np.uint8]
    owner: NDArray[np.int32] | None = None

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if getattr(self, name) is not None:
                getattr(self, name).flags.writeable = False

    @property
    def attached(self) -> NDArray[np.bool_]:
        """Has y_T a conflict? (s,)."""
        return (self.code & ATTACHED) > 0

    @property
    def on_hull(self) -> NDArray[np.bool_]:
        """Does the simplex lie in the boundary of the convex hull? (s,)."""
        return (self.code & HULL) > 0

    @property
    def entry(self) -> NDArray[np.float64]:
        """The least alpha at which the simplex is in K_alpha (s,)."""
        return np.where(self.attached, self.mu_lower, self.rho)


class Family:
    """The levels of a triangulation, each computed when first asked for, with those above it, and kept."""

    def __init__(self, triangulation: RegularTriangulation) -> None:
        self.triangulation = triangulation
        self._levels: dict[int, Level] = {}
        self._cells: tuple[NDArray[np.float64], NDArray[np.uint8]] | None = None
        self._scaled: tuple[NDArray[np.float64], int, bool] | None = None

    @property
    def by_kernels(self) -> bool:
        """Do the kernels serve this triangulation?"""
        return self.triangulation.dimension in (2, 3) and self.triangulation.points.shape[1] <= 3

    @property
    def scaled(self) -> tuple[NDArray[np.float64], int, bool]:
        """Rows x, y, z, w over powers of 2**exponent; the exponent; are all of them integers? See `scale`."""
        if self._scaled is None:
            self._scaled = scale(self.triangulation.points, self.triangulation.weights)
        return self._scaled

    def level(self, k: int) -> Level:
        """All k-simplices."""
        if k not in self._levels:
            d = self.triangulation.dimension
            if not self.by_kernels:
                self._levels = intervals_nd.levels(self.triangulation, Level)
            elif k == 0:
                self._levels[k] = self._vertices()
            elif k == 1:
                self._levels[k] = self._edges()
            elif d == 2:
                self._levels[k] = self._triangles()
            elif k == 2:
                self._levels[k] = self._facets()
            else:
                self._levels[k] = self._tetrahedra()
        return self._levels[k]

    def has(self, k: int) -> bool:
        """Is this level there already?"""
        return k in self._levels

    @property
    def cell_sizes(self) -> NDArray[np.float64]:
        """Size of every cell, in the order of the triangulation (m,)."""
        if self.by_kernels and self.triangulation.dimension == 3:
            return self._measured_cells()[0]
        cells = self.level(self.triangulation.dimension)
        sizes = np.empty(len(cells.rho))
        sizes[cells.owner] = cells.rho
        return sizes

    def faces(self, k: int) -> NDArray[np.int32]:
        """Rows (s, k+1) in `level(k - 1)` of the facet opposite each vertex of each k-simplex, k >= 1."""
        above, below = self.level(k).simplices, self.level(k - 1)
        faces = np.empty(above.shape, np.int32)
        voids.find_faces(above, below.simplices, below.starts, faces)
        return faces

    def owners(self) -> NDArray[np.int32]:
        """One side of each facet (s,): (d+1) * cell + slot opposite, in the triangulation."""
        d = self.triangulation.dimension
        owner = self.level(d - 1).owner
        if owner is None:
            cell = self.level(d).owner[:, None]  # type: ignore[index]
            slot = np.argsort(self.triangulation.cells[cell[:, 0]], axis=1)
            owner = np.empty(len(self.level(d - 1).rho), np.int32)
            owner[self.faces(d)] = (d + 1) * cell + slot
        return owner

    def sides(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The two cells at each facet, rows of the triangulation (s,); the second is -1 on the hull."""
        cell, slot = np.divmod(self.owners(), self.triangulation.dimension + 1)
        return cell, self.triangulation.neighbors[cell, slot]

    def _measured_cells(self) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        """Sizes and conflict bits of tetrahedra, in the order of the triangulation."""
        if self._cells is None:
            cells = self.triangulation.cells
            rho, conflict = np.empty(len(cells)), np.empty(len(cells), np.uint8)
            points, exponent, integral = self.scaled
            kernels.measure_tetrahedra(points, integral, cells, rho, conflict)
            settle(points, integral, cells, rho, conflict)
            self._cells = unscaled(rho, exponent), conflict
        return self._cells

    def _tetrahedra(self) -> Level:
        cells = self.triangulation.cells
        starts, rows, owner, code, reals = self._arrays(len(cells), 4, 1)
        kernels.count_cells(cells, starts)
        kernels.bucket_cells(cells, self._measured_cells()[0], starts, rows, owner, reals)
        kernels.sort_buckets(starts, rows, owner, code, reals)
        return Level(rows, starts, reals[0], reals[0], reals[0], code, owner)

    def _facets(self) -> Level:
        cells, neighbors = self.triangulation.cells, self.triangulation.neighbors
        points, exponent, integral = self.scaled
        measured = self._measured_cells()
        count = int(neighbors.size + np.count_nonzero(neighbors < 0)) // 2
        starts, rows, owner, code, reals = self._arrays(count, 3, 3)
        kernels.count_facets(cells, neighbors, starts)
        kernels.facets_of_tetrahedra(points, integral, cells, neighbors, *measured, starts, rows, owner, code, reals)
        kernels.sort_buckets(starts, rows, owner, code, reals)
        rho, lower, upper = reals
        settle(points, integral, rows, rho, code)
        return Level(rows, starts, unscaled(rho, exponent), lower, upper, code, owner)

    def _triangles(self) -> Level:
        cells, neighbors = self.triangulation.cells, self.triangulation.neighbors
        points, exponent, integral = self.scaled
        starts, rows, owner, code, reals = self._arrays(len(cells), 3, 1)
        kernels.count_cells(cells, starts)
        kernels.measure_triangles(points, integral, cells, neighbors, starts, rows, owner, code, reals)
        kernels.sort_buckets(starts, rows, owner, code, reals)
        settle(points, integral, rows, reals[0], code)
        rho = unscaled(reals[0], exponent)
        return Level(rows, starts, rho, rho, rho, code, owner)

    def _edges(self) -> Level:
        triangulation, faces = self.triangulation, self.level(2)
        points, exponent, integral = self.scaled
        n = len(triangulation.points)
        # Euler: R triangulates a ball, so that vertices - edges + triangles - tetrahedra = 1.
        cells = len(triangulation.cells) if triangulation.dimension == 3 else 0
        count = n - len(triangulation.hidden) + len(faces.rho) - cells - 1
        starts, rows, _, code, reals = self._arrays(count, 2, 3)
        level = faces.simplices, faces.starts, faces.rho, faces.mu_lower, faces.mu_upper, faces.code
        status = kernels.edges_of_triangles(points, integral, *level, rows, starts, code, reals)
        if status:
            raise InvalidInput("triangulation: not of a ball, as its Euler characteristic is not 1")
        rho, lower, upper = reals
        settle(points, integral, rows, rho, code)
        return Level(rows, starts, unscaled(rho, exponent), lower, upper, code)

    def _vertices(self) -> Level:
        edges, weights = self.level(1), self.triangulation.weights
        n = len(weights)
        bounds = kernels.vertices_of_edges(n, edges.simplices, edges.rho, edges.mu_lower, edges.mu_upper, edges.code)
        there = np.ones(n, bool)
        there[self.triangulation.hidden] = False
        lower, upper, code = (values[there] for values in bounds)
        rows = np.flatnonzero(there).astype(np.int32)[:, None]
        starts = np.concatenate([[0], np.cumsum(there)])
        return Level(rows, starts, 0.0 - weights[there], lower, upper, code)

    def _arrays(
        self, count: int, width: int, reals: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int32], NDArray[np.uint8], NDArray[np.float64]]:
        """Room for a level: starts, rows, owner, code (all zero), and that many arrays of reals."""
        return kernels.room(len(self.triangulation.points), count, width, reals)


def scale(points: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], int, bool]:
    """Give rows x, y, z, w divided by powers of 2**exponent, exactly; that exponent; and whether all are integers.

    Integers, where all coordinates are multiples of one unit and the weights of its square, so that the kernels know
    zeros; else the extent is brought near 1, unless it is moderate already.
    """
    n, d = points.shape
    extent = math.frexp(float(np.ptp(points, axis=0).max()))[1]
    top = math.frexp(float(np.abs(points).max()))[1]
    integral = False
    for part in slice(0, 64), slice(None):
        unit = min(_lowest_bit(points[part]), _lowest_bit(weights[part]) // 2)
        integral = abs(unit) < 400 and top - unit <= 45
        if not integral:
            break
    exponent = unit if integral else (extent if abs(extent) > 40 else 0)
    scaled = np.zeros((n, 4))
    scaled[:, :d], scaled[:, 3] = points, weights
    if exponent:
        with np.errstate(over="ignore", under="ignore"):
            scaled[:, :d], scaled[:, 3] = np.ldexp(points, -exponent), np.ldexp(weights, -2 * exponent)
            back = np.ldexp(scaled[:, :d], exponent), np.ldexp(scaled[:, 3], 2 * exponent)
        if not ((back[0] == points).all() and (back[1] == weights).all()):  # beyond the range of float64
            scaled[:, :d], scaled[:, 3], exponent, integral = points, weights, 0, False
    return scaled, exponent, integral


def _lowest_bit(values: NDArray[np.float64]) -> int:
    """Exponent of the lowest bit that is set in any value; a large one where all are zero."""
    fraction, exponent = np.frexp(values[values != 0])
    mantissa = np.ldexp(np.abs(fraction), 53).astype(np.int64)
    low = np.frexp((mantissa & -mantissa).astype(np.float64))[1] - 1
    return int((exponent - 53 + low).min(initial=1 << 20))


def unscaled(rho: NDArray[np.float64], exponent: int) -> NDArray[np.float64]:
    """Sizes in the units of the input; those too small for float64 keep their signs."""
    if not exponent:
        return rho
    sizes = np.ldexp(rho, 2 * exponent)
    if exponent < -400:
        lost = (sizes == 0) & (rho != 0)
        sizes[lost] = np.copysign(np.nextafter(0.0, 1.0), rho[lost])
    return sizes
