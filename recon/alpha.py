"""The weighted alpha complex K_alpha for all alpha at once (paper, sections 2, 3 and 5)."""

from __future__ import annotations

from collections.abc import Iterable
from operator import index
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .boundary import Boundary, boundary_at
from .choice import Choice, choices
from .contracts import InvalidInput, as_alpha, as_alphas, as_points, require, shown
from .intervals import Family
from .location import find_simplices
from .orthocenters import orthocenters
from .persistence import Pairs, Voids
from .regular import RegularTriangulation, regular_triangulation

if TYPE_CHECKING:
    import gudhi  # type: ignore[import-untyped]
    import networkx  # type: ignore[import-untyped]
    import pyvista  # type: ignore[import-not-found]
    import scipy.sparse  # type: ignore[import-untyped]

EXTERIOR, SINGULAR, REGULAR, INTERIOR = np.int8(0), np.int8(1), np.int8(2), np.int8(3)


class AlphaComplex:
    """All simplices of R with the alphas at which each is singular, regular and interior (paper, table 5.1).

    Nothing is computed before it is asked for; what was, is kept. Simplices are given one dimension k at a time:
    input rows, ascending in a row, in lexicographic order; every other array of dimension k follows them. Arrays are
    frozen. See `alpha_complex` for conventions.
    """

    def __init__(self, triangulation: RegularTriangulation) -> None:
        self._family = Family(triangulation)
        self._pairs = Pairs(self._family)
        self._entries: dict[int, NDArray[np.float64]] = {}

    @property
    def triangulation(self) -> RegularTriangulation:
        """The regular triangulation R that the complexes are part of."""
        return self._family.triangulation

    @property
    def dimension(self) -> int:
        """Dimension d of R: that of the affine hull of the points."""
        return self.triangulation.dimension

    def __repr__(self) -> str:
        n, d = self.triangulation.points.shape
        cells = len(self.triangulation.cells)
        return f"AlphaComplex({n} points in {d}-D, {cells} cells of dimension {self.dimension})"

    # --- section 5: one array entry a simplex

    def simplices(self, k: int) -> NDArray[np.int32]:
        """Give all k-simplices of R (s, k+1)."""
        return self._family.level(self._dimension(k)).simplices

    def rho(self, k: int) -> NDArray[np.float64]:
        """Give the size of every k-simplex [L^2] (s,): the weight of y_T, the smallest sphere orthogonal to it."""
        return self._family.level(self._dimension(k)).rho

    def centers(self, k: int) -> NDArray[np.float64]:
        """Give the location of y_T, of which `rho` is the weight, for every k-simplex [L] (s, d)."""
        triangulation, rows = self.triangulation, self.simplices(k)
        origin = np.zeros(triangulation.points.shape[1])
        return orthocenters(triangulation.points, triangulation.weights, rows, origin)

    def attached(self, k: int) -> NDArray[np.bool_]:
        """Tell of every k-simplex whether y_T has a conflict (s,); such a one is never principal (5.2)."""
        return self._family.level(self._dimension(k)).attached

    def on_hull(self, k: int) -> NDArray[np.bool_]:
        """Tell of every k-simplex whether it lies in the boundary of the convex hull (s,)."""
        return self._family.level(self._dimension(k)).on_hull

    def mu_lower(self, k: int) -> NDArray[np.float64]:
        """Give the least size of an unattached proper coface [L^2] (s,), from where on a simplex is not singular."""
        return self._family.level(self._dimension(k)).mu_lower

    def mu_upper(self, k: int) -> NDArray[np.float64]:
        """Give the greatest size of a coface [L^2] (s,), from where on a simplex is interior; inf on the hull."""
        return self._family.level(self._dimension(k)).mu_upper

    def entry(self, k: int) -> NDArray[np.float64]:
        """Give the least alpha at which each k-simplex is in K_alpha [L^2] (s,): rho, or mu_lower where attached."""
        return self._family.level(self._dimension(k)).entry

    def classify(self, k: int, alpha: float = 0.0) -> NDArray[np.int8]:
        """Classify every k-simplex at alpha [L^2] by table 5.1 (s,): EXTERIOR, SINGULAR, REGULAR or INTERIOR."""
        level, alpha = self._family.level(self._dimension(k)), as_alpha(alpha)
        classes = np.full(len(level.rho), EXTERIOR)
        if k == self.dimension:
            classes[level.rho <= alpha] = INTERIOR
            return classes
        classes[~level.attached & (level.rho <= alpha)] = SINGULAR
        classes[level.mu_lower <= alpha] = REGULAR
        classes[~level.on_hull & (level.mu_upper <= alpha)] = INTERIOR
        return classes

    def exposed(self, k: int, alpha: float = 0.0) -> NDArray[np.bool_]:
        """Tell of every k-simplex whether it is alpha-exposed, a face of W_alpha: singular or regular (s,)."""
        classes = self.classify(k, alpha)
        return (classes == SINGULAR) | (classes == REGULAR)

    def classify_locations(self, x: ArrayLike, alpha: float = 0.0) -> NDArray[np.int8]:
        """Tell where locations are: the class at alpha of the simplex of R that has each in its relative interior.

        EXTERIOR is outside W_alpha, INTERIOR in its interior, SINGULAR and REGULAR on its boundary. Exact for x as given.

        Parameters
        ----------
        x : (q, d) array_like of float [L]
        alpha : float [L^2]

        Returns
        -------
        (q,) ndarray of int8

        Examples
        --------
        >>> alpha_complex([[0, 0], [2, 0], [0, 2], [9, 0]]).classify_locations([[0.5, 0.5], [1, 0], [3, 0]], 3).tolist()
        [3, 2, 0]
        """
        located = as_points(x, self.triangulation.points.shape[1], "x")
        corners = find_simplices(self.triangulation, located)
        classes, width = np.full(len(corners), EXTERIOR), (corners >= 0).sum(axis=1)
        for k in range(self.dimension + 1):
            asked = np.flatnonzero(width == k + 1)
            if len(asked):
                both = np.concatenate([self.simplices(k), corners[asked, -k - 1 :]])
                _, first, number = np.unique(both, axis=0, return_index=True, return_inverse=True)
                classes[asked] = self.classify(k, alpha)[first[number.ravel()[-len(asked) :]]]
        return classes

    def link(self, simplex: Iterable[int], alpha: float = 0.0) -> tuple[NDArray[np.int32], ...]:
        """Give the link of a simplex in K_alpha: the simplices apart from it that together with it make one of K_alpha.

        Its topology tells the class of the simplex (5.1): a sphere for interior, nothing for singular.

        Parameters
        ----------
        simplex : k+1 ints
            Input rows, in any order.
        alpha : float [L^2]

        Returns
        -------
        tuple of (s, j+1) ndarray of int32
            The j-simplices of the link, j = 0 .. d-k-1, in lexicographic order.

        Raises
        ------
        InvalidInput
            No simplex of R.

        Examples
        --------
        >>> [part.tolist() for part in alpha_complex([[0, 0], [2, 0], [2, 2], [0, 2]]).link([0, 2], 2)]
        [[[1], [3]]]
        """
        try:
            vertices = sorted({index(row) for row in simplex})
        except TypeError as error:
            raise InvalidInput(f"simplex: expected input rows, got {shown(simplex)}") from error
        k, alpha = len(vertices) - 1, as_alpha(alpha)
        if not 0 <= k <= self.dimension:
            raise InvalidInput(f"simplex: expected 1 to {self.dimension + 1} input rows, got {shown(simplex)}")
        if not (self.simplices(k) == vertices).all(axis=1).any():
            raise InvalidInput(f"simplex: {vertices} is none of the triangulation")
        found = []
        for up in range(k + 1, self.dimension + 1):
            rows = self.simplices(up)[self.entry(up) <= alpha]
            shared = np.isin(rows, vertices)
            around = shared.sum(axis=1) == k + 1
            found.append(rows[around][~shared[around]].reshape(-1, up - k))
        return tuple(found)

    def boundary(self, alpha: float = 0.0) -> Boundary:
        """Give the facets of W_alpha: the regular ones, which bound its interior, and the singular ones, which do not.

        For one alpha of 3-D points this costs a fraction of all intervals, and computes none.

        Parameters
        ----------
        alpha : float [L^2]

        Returns
        -------
        Boundary
        """
        return boundary_at(self._family, as_alpha(alpha))

    # --- all alphas at once

    def spectrum(self) -> NDArray[np.float64]:
        """Give the alphas [L^2] at which K_alpha changes, ascending, each once: the sizes of unattached simplices."""
        levels = [self._family.level(k) for k in range(self.dimension + 1)]
        return np.unique(np.concatenate([level.rho[~level.attached] for level in levels]))

    def f_vector(self, alpha: ArrayLike = 0.0) -> NDArray[np.int64]:
        """Count the simplices of K_alpha of each dimension 0 .. d: (d+1,), or (a, d+1) for a alphas [L^2]."""
        alphas = as_alphas(alpha)
        counts = [np.searchsorted(self._sorted_entries(k), alphas, side="right") for k in range(self.dimension + 1)]
        return np.stack(counts, axis=-1)

    def euler(self, alpha: ArrayLike = 0.0) -> NDArray[np.int64]:
        """Give the Euler characteristic of K_alpha: a number, or (a,) for a alphas [L^2]."""
        counts = self.f_vector(alpha)
        return counts[..., ::2].sum(axis=-1) - counts[..., 1::2].sum(axis=-1)

    def betti(self, alpha: ArrayLike = 0.0) -> NDArray[np.int64]:
        """Count the holes of K_alpha: components, tunnels, voids, that is Betti numbers 0 .. d-1.

        All alphas at once in near-linear time up to d = 3: the last number is that of the first two union-finds and of
        the Euler characteristic.

        Parameters
        ----------
        alpha : float or (a,) array_like of float [L^2]

        Returns
        -------
        (d,) or (a, d) ndarray of int64
        """
        alphas, d = as_alphas(alpha), self.dimension
        numbers = np.zeros((*alphas.shape, max(1, d)), np.int64)
        for k in range(max(1, d)):
            if not (d == 3 and k == 1):
                births, deaths = self._pairs.barcode(k).T
                numbers[..., k] = np.searchsorted(np.sort(births), alphas, side="right")
                numbers[..., k] -= np.searchsorted(np.sort(deaths[np.isfinite(deaths)]), alphas, side="right")
        if d == 3:
            numbers[..., 1] = numbers[..., 0] + numbers[..., 2] - self.euler(alphas)
        return numbers

    def persistence(self, k: int) -> NDArray[np.float64]:
        """Give birth and death [L^2] of every class of dimension k that lasts: components 0, tunnels 1, voids d-1.

        Parameters
        ----------
        k : int

        Returns
        -------
        (p, 2) ndarray of float64
            Ascending. A class is there for birth <= alpha < death; one component never dies.
        """
        return self._pairs.barcode(k)

    def voids(self) -> Voids:
        """Give the voids of all K_alpha: births, deaths, where they are and what they were split from."""
        return self._pairs.voids()

    def choices(self) -> tuple[Choice, ...]:
        """Choose alpha: the recommended value first, then the alternatives, each with its reason.

        Recommended is the void that lasts longest, where its death is at least 4 times its birth, both taken from the
        alpha at which the first point appears (so twice the radius, for weights of zero): then there is an inside, and
        alpha is where the Betti numbers stay longest within the life of that void. Else it is the least alpha at which
        every point is a corner of a cell, in one piece. The other candidates: the longest range of one topology, the
        least alpha in one piece.

        Returns
        -------
        tuple of Choice
            Each with `alpha`, `criterion`, `why`, and the range `start` to `stop` in which the reason holds.

        Examples
        --------
        >>> ring = [[x, y] for x in range(5) for y in range(5) if x in (0, 4) or y in (0, 4)]
        >>> [(choice.criterion, choice.start, choice.stop) for choice in alpha_complex(ring).choices()[:2]]
        [('void', 0.25, 4.0), ('solid', 2.5, inf)]
        """
        return choices(self)

    # --- for other programs

    def boundary_matrix(self, k: int) -> scipy.sparse.csc_array:
        """Give the boundary operator from k-simplices to (k-1)-simplices, entries 1 and -1, k >= 1."""
        import scipy.sparse

        if self._dimension(k) == 0:
            raise InvalidInput("k: expected at least 1, as vertices have no boundary")
        faces = self._family.faces(k)
        signs = np.tile(np.where(np.arange(k + 1) % 2, -1, 1).astype(np.int8), len(faces))
        starts = np.arange(0, faces.size + 1, k + 1)
        shape = len(self.simplices(k - 1)), len(faces)
        return scipy.sparse.csc_array((signs, faces.ravel(), starts), shape=shape)

    def to_gudhi_simplex_tree(self) -> gudhi.SimplexTree:
        """Give R as a simplex tree of GUDHI; the filtration value of a simplex is its `entry`."""
        tree = require("gudhi", "peers").SimplexTree()
        for k in range(self.dimension + 1):
            tree.insert_batch(self.simplices(k).T.copy(), self.entry(k))  # it minds the strides of a view
        return tree

    def to_networkx(self, alpha: float = 0.0) -> networkx.Graph:
        """Give the vertices and edges of K_alpha as a graph; nodes are input rows, and all have their `entry`."""
        graph = require("networkx", "peers").Graph()
        there = [self.entry(k) <= alpha for k in range(min(1, self.dimension) + 1)]
        for row, entry in zip(self.simplices(0)[there[0], 0].tolist(), self.entry(0)[there[0]].tolist()):
            graph.add_node(row, entry=entry)
        if self.dimension:
            for (a, b), entry in zip(self.simplices(1)[there[1]].tolist(), self.entry(1)[there[1]].tolist()):
                graph.add_edge(a, b, entry=entry)
        return graph

    def to_pyvista(self, alpha: float = 0.0) -> pyvista.UnstructuredGrid:
        """Give K_alpha as a grid of its simplices of dimension 0 to 3, with cell data `rho` and `class`."""
        vista = require("pyvista", "view")
        if self.triangulation.points.shape[1] > 3:
            raise InvalidInput("to_pyvista: expected points in up to 3-D")
        points = np.zeros((len(self.triangulation.points), 3))
        points[:, : self.triangulation.points.shape[1]] = self.triangulation.points
        kinds = (vista.CellType.VERTEX, vista.CellType.LINE, vista.CellType.TRIANGLE, vista.CellType.TETRA)
        cells, types, rho, classes = [], [], [], []
        for k in range(self.dimension + 1):
            which = self.classify(k, alpha)
            there = which != EXTERIOR
            rows = self.simplices(k)[there]
            cells.append(np.column_stack([np.full(len(rows), k + 1), rows]).ravel())
            types.append(np.full(len(rows), kinds[k], np.uint8))
            rho.append(self.rho(k)[there])
            classes.append(which[there])
        grid = vista.UnstructuredGrid(np.concatenate(cells), np.concatenate(types), points)
        grid.cell_data["rho"], grid.cell_data["class"] = np.concatenate(rho), np.concatenate(classes)
        return grid

    def _dimension(self, k: int) -> int:
        """Let a dimension of simplices through."""
        if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or not 0 <= k <= self.dimension:
            raise InvalidInput(f"k: expected an integer from 0 to {self.dimension}, got {shown(k)}")
        return int(k)

    def _sorted_entries(self, k: int) -> NDArray[np.float64]:
        if k not in self._entries:
            self._entries[k] = np.sort(self.entry(k))
        return self._entries[k]


def alpha_complex(
    points_or_triangulation: ArrayLike | RegularTriangulation, weights: ArrayLike | None = None
) -> AlphaComplex:
    """Give the weighted alpha complex of points, or of their regular triangulation, for all alpha at once.

    Parameters
    ----------
    points_or_triangulation : (n, d) array_like of float [L], or RegularTriangulation
    weights : (n,) array_like of float [L^2], default: all zero
        With points only: a triangulation has its weights.

    Returns
    -------
    AlphaComplex

    Raises
    ------
    InvalidInput
        As `regular_triangulation`; or weights given with a triangulation.

    Notes
    -----
    K_alpha holds the unattached simplices of size rho <= alpha and their faces: equality is in, as in CGAL and GUDHI.
    Alpha may be negative, and infinite: nothing at -inf, all of R at +inf. Attachment is exact for the input as given.
    A simplex whose orthosphere merely meets another point has no conflict there: it is unattached, and the coface that
    it makes with that point has the same size, so that it is never singular for a range of alpha.

    Sizes are within 2**-40 (|rho| + max |w|) of the truth, |w| over the vertices, and monotone (3.2) to the last bit,
    so that every K_alpha is a complex. A size depends on its simplex alone, not on what other points there are. Points
    that span less than their space have their complex in their affine hull, of dimension `dimension`.

    Edelsbrunner (1992), sections 3 and 5: conditions C1 and C2, rule 5.3, table 5.1.

    Examples
    --------
    >>> square = alpha_complex([[0, 0], [2, 0], [2, 2], [0, 2]])
    >>> square.simplices(1).tolist()
    [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    >>> square.rho(1).tolist(), square.attached(1).tolist()
    ([1.0, 2.0, 1.0, 1.0, 1.0], [False, False, False, False, False])
    >>> square.spectrum().tolist(), square.betti(1.5).tolist()
    ([0.0, 1.0, 2.0], [1, 1])
    """
    if isinstance(points_or_triangulation, RegularTriangulation):
        if weights is not None:
            raise InvalidInput("weights: given twice, as the triangulation has its own")
        return AlphaComplex(points_or_triangulation)
    return AlphaComplex(regular_triangulation(points_or_triangulation, weights))
