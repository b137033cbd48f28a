"""The power diagram P(S), dual of the regular triangulation (paper, section 3 and 3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from .alpha import AlphaComplex
from .contracts import InvalidInput, as_points
from .orthocenters import orthocenters
from .regular import RegularTriangulation


@dataclass(frozen=True, slots=True, eq=False)
class PowerFaces:
    """The l-dimensional faces Z_T of a power diagram, one a simplex of R.

    Attributes
    ----------
    simplices : (s, k+1) ndarray of int32
        T, the generators whose cells meet in the face: input rows, in the order of `AlphaComplex.simplices(k)`.
    starts : (s+1,) ndarray of int64
    corners : (c,) ndarray of int32
        Rows of `PowerDiagram.vertices`: those of face i are corners[starts[i]:starts[i+1]], ascending. In general
        position they are distinct points; of cospherical points several may coincide.
    bounded : (s,) ndarray of bool
        An unbounded face has rays besides.
    measures : (s,) ndarray of float64 [L^l]
        Length, area, volume; inf where unbounded, 1 for vertices.
    """

    simplices: NDArray[np.int32]
    starts: NDArray[np.int64]
    corners: NDArray[np.int32]
    bounded: NDArray[np.bool_]
    measures: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.simplices)

    def corners_of(self, i: int) -> NDArray[np.int32]:
        """Rows of `PowerDiagram.vertices` that span face i."""
        return self.corners[self.starts[i] : self.starts[i + 1]]


class PowerDiagram:
    """The cells Z_p = {x : pi(p, x) <= pi(q, x) for all q} and their faces; see `power_diagram`."""

    def __init__(self, triangulation: RegularTriangulation) -> None:
        self.triangulation = triangulation
        self._complex = AlphaComplex(triangulation)
        self._centers: dict[int, NDArray[np.float64]] = {}
        self._measured: dict[int, NDArray[np.float64]] = {}

    def __repr__(self) -> str:
        n, d = self.triangulation.points.shape
        return f"PowerDiagram({n} generators in {d}-D, {len(self.vertices)} vertices)"

    @property
    def dimension(self) -> int:
        """Dimension of the affine hull of the generators."""
        return self.triangulation.dimension

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """The orthocentres of the cells of R, in their order (m, d) [L]."""
        level = self._complex._family.level(self.dimension)
        result = np.empty((len(level.rho), self.triangulation.points.shape[1]))
        result[self._owner] = self._centers_of(self.dimension) + self._origin
        result.flags.writeable = False
        return result

    @cached_property
    def rays(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """The unbounded edges, one a hull facet of R: the vertex that each starts from (h,), its unit direction (h, d)."""
        cell, slot = np.nonzero(self.triangulation.neighbors < 0)
        if self.dimension == 0:
            return np.empty(0, np.int32), np.empty((0, self.triangulation.points.shape[1]))
        corners = self.triangulation.points[self.triangulation.cells[cell]]
        apex = corners[np.arange(len(cell)), slot]
        facet = corners[np.arange(self.dimension + 1) != slot[:, None]].reshape(len(cell), self.dimension, -1)
        inward = apex - facet[:, 0]
        inward /= np.linalg.norm(inward, axis=1)[:, None]
        if self.dimension > 1:
            edges = facet[:, 1:] - facet[:, :1]
            edges /= np.linalg.norm(edges, axis=2)[..., None]
            axes = np.linalg.qr(np.swapaxes(edges, 1, 2))[0]
            for _ in range(2):  # twice is enough
                inward -= (axes @ (np.swapaxes(axes, 1, 2) @ inward[..., None]))[..., 0]
                inward /= np.linalg.norm(inward, axis=1)[:, None]
        return cell.astype(np.int32), -inward

    @property
    def volumes(self) -> NDArray[np.float64]:
        """Volume of the cell of every input point (n,) [L^d]: inf where unbounded, 0 for hidden points."""
        n, d = self.triangulation.points.shape
        volumes = np.zeros(n)
        rows = self._complex.simplices(0)[:, 0]
        volumes[rows] = self._measures(0) if self.dimension == d else np.inf
        return volumes

    def faces(self, l: int) -> PowerFaces:
        """Give the faces of dimension l, from vertices (0) to cells (d), duals of the (d-l)-simplices of R (3.1).

        Parameters
        ----------
        l : int
            Where the generators span less than their space, the dimension within their affine hull: the diagram is the
            product of that with the rest of the space.

        Returns
        -------
        PowerFaces
        """
        d = self.dimension
        if isinstance(l, bool) or not isinstance(l, (int, np.integer)) or not 0 <= l <= d:
            raise InvalidInput(f"l: expected an integer from 0 to {d}, got {l!r}")
        k, family = d - int(l), self._complex._family
        count = len(self._complex.simplices(d))
        ids = []
        for kept in combinations(range(d + 1), k + 1):
            row = np.arange(count)
            for width, slot in zip(range(d, k, -1), sorted(set(range(d + 1)) - set(kept), reverse=True)):
                row = family.faces(width)[row, slot]
            ids.append(row)
        face, cell = np.concatenate(ids), np.tile(self._owner, len(ids))
        order = np.lexsort((cell, face))
        simplices = self._complex.simplices(k)
        starts = np.concatenate([[0], np.cumsum(np.bincount(face, minlength=len(simplices)))])
        bounded = ~self._complex.on_hull(k) if k < d else np.ones(len(simplices), bool)
        arrays = simplices, starts, cell[order].astype(np.int32), bounded, self._measures(k)
        for array in arrays:
            array.flags.writeable = False
        return PowerFaces(*arrays)

    def neighbors(self, p: int) -> NDArray[np.int64]:
        """Input rows of the generators whose cells share a facet with that of row p, ascending; none if p is hidden."""
        starts, rows = self._adjacency
        if not 0 <= p < len(starts) - 1:
            raise InvalidInput(f"p: expected a row from 0 to {len(starts) - 2}, got {p!r}")
        return rows[starts[p] : starts[p + 1]]

    def locate(self, x: ArrayLike) -> NDArray[np.int64]:
        """Tell in whose cell each location lies: the generator of least power distance, in float64.

        Parameters
        ----------
        x : (q, d) array_like of float [L]

        Returns
        -------
        (q,) ndarray of int64
            Input rows.
        """
        points, weights = self.triangulation.points, self.triangulation.weights
        located = as_points(x, points.shape[1], "x")
        rows, tree, top = self._lifted
        found = rows[tree.query(np.column_stack([located, np.zeros(len(located))]))[1]]
        starts, beside = self._adjacency
        active = np.arange(len(located))
        while len(active):  # the lift rounds: walk to the neighbour that is nearer, as long as there is one
            here = found[active]
            degree = starts[here + 1] - starts[here]
            asked = np.repeat(active, degree)
            offset = np.arange(len(asked)) - np.repeat(np.cumsum(degree) - degree, degree)
            other = beside[np.repeat(starts[here], degree) + offset]
            gap = self._gap(located[asked], found[asked], other, points, weights)
            better = np.flatnonzero(gap < 0)
            best = better[np.lexsort((other[better], gap[better], asked[better]))]
            moved, first = np.unique(asked[best], return_index=True)
            found[moved], active = other[best[first]], moved
        return found

    @staticmethod
    def _gap(x: NDArray, p: NDArray, q: NDArray, points: NDArray, weights: NDArray) -> NDArray[np.float64]:
        """Sign of pi(q, x) - pi(p, x), free of loops: twice the signed distance from the bisector times |pq|."""
        edge = points[q] - points[p]
        return ((edge - 2 * (x - points[p])) * edge).sum(axis=1) + weights[p] - weights[q]

    @cached_property
    def _owner(self) -> NDArray[np.int64]:
        """Row of the triangulation of each cell of the top level."""
        cells = np.sort(self.triangulation.cells, axis=1)
        return np.lexsort(cells.T[::-1])

    @property
    def _origin(self) -> NDArray[np.float64]:
        return self.triangulation.points[self.triangulation.cells[0, 0]]

    @cached_property
    def _adjacency(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return adjacency(self._complex)

    @cached_property
    def _lifted(self) -> tuple[NDArray[np.int64], cKDTree, float]:
        """Generators lifted so that Euclidean distance orders like power distance."""
        rows = self._complex.simplices(0)[:, 0].astype(np.int64)
        weights = self.triangulation.weights[rows]
        top = float(weights.max())
        return rows, cKDTree(np.column_stack([self.triangulation.points[rows], np.sqrt(top - weights)])), top

    def _centers_of(self, k: int) -> NDArray[np.float64]:
        """Centres y'_T of k-simplices (s, d), from the origin of the diagram."""
        if k not in self._centers:
            triangulation, rows = self.triangulation, self._complex.simplices(k)
            self._centers[k] = orthocenters(triangulation.points, triangulation.weights, rows, self._origin)
        return self._centers[k]

    def _measures(self, k: int) -> NDArray[np.float64]:
        """Measures of the duals of k-simplices: pyramids over the faces of one dimension less, from y_T, signed."""
        if k in self._measured:
            return self._measured[k]
        d, rows = self.dimension, self._complex.simplices(k)
        if k == d:
            return np.ones(len(rows))
        above, faces = self._complex.simplices(k + 1), self._complex._family.faces(k + 1)
        base, apex, center = self._measures(k + 1), self._centers_of(k), self._centers_of(k + 1)
        points, weights = self.triangulation.points - self._origin, self.triangulation.weights
        total = np.zeros(len(rows))
        with np.errstate(invalid="ignore"):
            for slot in range(k + 2):
                face, added = faces[:, slot], above[:, slot]
                start = apex[face]
                height = np.linalg.norm(center - start, axis=1)
                first = rows[face, 0]
                edge = points[added] - points[first]
                gap = ((edge - 2 * (start - points[first])) * edge).sum(axis=1) + weights[first] - weights[added]
                np.add.at(total, face, np.where(gap < 0, -height, height) * base / (d - k))
        total = np.where(self._complex.on_hull(k), np.inf, np.maximum(total, 0.0))
        self._measured[k] = total
        return total


def power_diagram(triangulation: RegularTriangulation) -> PowerDiagram:
    """Give the power diagram of the points of a regular triangulation, by duality.

    Parameters
    ----------
    triangulation : RegularTriangulation

    Returns
    -------
    PowerDiagram

    Raises
    ------
    InvalidInput
        Anything but a triangulation.

    Notes
    -----
    Paper, 3.1: Z_T is not empty exactly where T spans a simplex of R. The combinatorics are those of R and exact, and
    so are the vertices of slender cells up to one rounding. Measures are sums of signed pyramids, from the vertices up.

    Examples
    --------
    >>> from recon import regular_triangulation
    >>> plus = power_diagram(regular_triangulation([[0, 0], [2, 0], [0, 2], [-2, 0], [0, -2]]))
    >>> plus.volumes.tolist(), plus.neighbors(0).tolist()
    ([4.0, inf, inf, inf, inf], [1, 2, 3, 4])
    >>> plus.locate([[0.9, 0], [5, 1]]).tolist()
    [0, 1]
    """
    if not isinstance(triangulation, RegularTriangulation):
        raise InvalidInput(f"triangulation: expected a RegularTriangulation, got {type(triangulation).__name__}")
    return PowerDiagram(triangulation)


def adjacency(complex_: AlphaComplex) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Whose power cells share a facet: of input row p rows[starts[p]:starts[p+1]], ascending; starts (n+1,)."""
    n = len(complex_.triangulation.points)
    edges = complex_.simplices(1).astype(np.int64) if complex_.dimension else np.empty((0, 2), np.int64)
    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[np.lexsort(both.T[::-1])]
    return np.concatenate([[0], np.cumsum(np.bincount(both[:, 0], minlength=n))]), both[:, 1].copy()
