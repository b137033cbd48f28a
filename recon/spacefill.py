"""The space filling diagram F_alpha, a union of balls: measured exactly, with its faces (paper, section 4)."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels import spacefill as kernels
from ._kernels.sizes import settle
from .alpha import AlphaComplex, alpha_complex
from .cavities import Cavities, balls_within, contents
from .contracts import InvalidInput, as_number, as_points, shown
from .intervals import Family
from .outside import FILLED, OUTSIDE, Outside
from .power import adjacency
from .redundancy import redundant_points
from .regular import RegularTriangulation
from .sphere_faces import SphereFaces, Spheres, faces_around, faces_in_wide_space

_CHUNK = 1 << 17  # simplices at a time
_PIECES = {
    (3, 1): kernels.caps, (3, 2): kernels.double_caps, (3, 3): kernels.triple_caps,
    (2, 1): kernels.segments, (2, 2): kernels.double_segments,
}  # fmt: skip


class SpaceFillingDiagram:
    """The union of the balls of squared radii weight + alpha; see `space_filling_diagram`."""

    def __init__(self, complex_: AlphaComplex, alpha: float) -> None:
        self.complex, self.alpha = complex_, alpha
        triangulation = complex_.triangulation
        self.dimension = triangulation.points.shape[1]
        self._family: Family = complex_._family
        self._spheres = Spheres(triangulation, alpha)

    def __repr__(self) -> str:
        n = len(self.ball_volumes)
        return f"SpaceFillingDiagram({n} balls in {self.dimension}-D, volume {self.volume:g}, area {self.area:g})"

    @property
    def volume(self) -> float:
        """Volume of the union [L^d]."""
        return float(self.ball_volumes.sum())

    @property
    def area(self) -> float:
        """Area of the whole boundary, that of the voids included [L^(d-1)]; in 1-D the number of ends."""
        return float(self.ball_areas.sum())

    @property
    def ball_volumes(self) -> NDArray[np.float64]:
        """Volume of each ball within its power cell (n,) [L^d]; hidden points have none."""
        return self._measures[0]

    @property
    def ball_areas(self) -> NDArray[np.float64]:
        """Area of each sphere within its power cell (n,) [L^(d-1)]: its part of the boundary."""
        return self._measures[1]

    @property
    def euler(self) -> int:
        """Euler characteristic of the boundary, through that of K_alpha, which is homotopy equivalent to F_alpha."""
        return 2 * int(self.complex.euler(self.alpha)) if self.dimension % 2 else 0

    @cached_property
    def redundant(self) -> NDArray[np.bool_]:
        """Of every point, is the union the same without it? (n,): each by itself, so of two equal balls both are.

        In general position: where a ball touches another from within, or power cells are flat, a redundant one may count
        as needed.
        Combinatorial, by local triangulations: about a millisecond for every ball that is wholly inside.
        """
        redundant = redundant_points(self.complex, self.alpha)
        redundant.flags.writeable = False
        return redundant

    @cached_property
    def voids(self) -> Cavities:
        """The bounded components of the complement of F_alpha."""
        if not self._fills_space:
            return self._cavities(None, None)
        return self._cavities(self._outside, self._regions)

    @cached_property
    def pockets(self) -> Cavities:
        """The parts of the unbounded component that narrow towards the outside, and the mouths through which they open.

        Cells that do not flow to infinity: a cell flows through a facet that its orthocentre lies beyond (Edelsbrunner,
        Facello and Liang 1998). Voids are not counted. A mouth is flat: a facet of R, whose part in F_alpha is no
        opening. Volumes and areas are those of the empty space within the cells, exactly, balls that bulge through a
        mouth included; programs that share out balls by angles differ there, by some percent for small pockets.
        """
        if not self._fills_space:
            return self._cavities(None, None)
        outside = self._outside
        open_ = ~outside.filled & ~self._flows_out
        region = outside.regions_among(open_)
        proper = np.flatnonzero(open_ & (self._regions == OUTSIDE) & (region >= 0))  # voids are such regions too
        number = np.full(len(region), FILLED)
        number[proper] = np.unique(region[proper], return_inverse=True)[1].ravel()
        return self._cavities(outside, number)

    def faces(self, l: int) -> SphereFaces:
        """Give the l-faces of the diagram, 0 <= l < d, and how they meet.

        Parameters
        ----------
        l : int

        Returns
        -------
        SphereFaces

        Notes
        -----
        Paper, 4.2: K_T has an l-face exactly where the simplex of T, of dimension d - l - 1, is a face of W_alpha. A
        circle with an arc that has no corners is an arc too.
        """
        d = self.dimension
        if isinstance(l, bool) or not isinstance(l, (int, np.integer)) or not 0 <= l < d:
            raise InvalidInput(f"l: expected an integer from 0 to {d - 1}, got {shown(l)}")
        k = d - int(l) - 1
        if self.complex.dimension < d - 1:
            return faces_in_wide_space(self._spheres, self.complex, self.alpha, k)
        return faces_around(self._spheres, self._outside, self._regions, k)

    # --- measures

    @cached_property
    def _measures(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Volumes and areas of all balls: inclusion-exclusion over K_alpha."""
        d, n = self.dimension, len(self._spheres.balls)
        total = np.zeros((n, 2))
        level = self._family.level(0)
        kept = level.entry <= self.alpha
        own = level.simplices[kept, 0]
        total[own] = self._whole(own)
        for k in range(1, self.complex.dimension + 1):
            rows = self.complex.simplices(k)[self.complex.entry(k) <= self.alpha]
            for begin in range(0, len(rows), _CHUNK):
                part = rows[begin : begin + _CHUNK]
                kernels.accumulate(part, self._pieces(part), -1.0 if k % 2 else 1.0, total)
        buried = kept & ~level.on_hull & (level.mu_upper <= self.alpha)
        if self.complex.dimension == d:
            total[level.simplices[buried, 0], 1] = 0.0
        np.maximum(total, 0.0, out=total)  # a ball that barely shows may round to less than nothing
        volumes, areas = self._spheres.unscaled(total[:, 0], d), self._spheres.unscaled(total[:, 1], d - 1)
        volumes.flags.writeable = areas.flags.writeable = False
        return volumes, areas

    def _whole(self, rows: NDArray) -> NDArray[np.float64]:
        """Volumes and areas (s, 2) of whole balls."""
        square = self._spheres.balls[rows, 3]
        radius = np.sqrt(square)
        if self.dimension == 3:
            return np.column_stack([4 / 3 * math.pi * square * radius, 4 * math.pi * square])
        if self.dimension == 2:
            return np.column_stack([math.pi * square, 2 * math.pi * radius])
        return np.column_stack([2 * radius, np.full(len(rows), 2.0)])

    def _pieces(self, rows: NDArray[np.int32]) -> NDArray[np.float64]:
        """Pieces (s, k+1, 2) of k-simplices, k > 0, in scaled units."""
        pieces = np.empty((*rows.shape, 2))
        if self.dimension > 1:
            _PIECES[self.dimension, rows.shape[1] - 1](self._spheres.balls, rows, pieces)
            return pieces
        ends, square = self._spheres.balls[rows, 0], self._spheres.balls[rows, 3]
        length = np.abs(ends[:, :1] - ends[:, 1:])
        pieces[..., 0] = np.sqrt(square) - 0.5 * (length + (square - square[:, ::-1]) / length)
        pieces[..., 1] = 1.0
        return pieces

    # --- the complement

    @property
    def _fills_space(self) -> bool:
        return self.complex.dimension == self.dimension

    @cached_property
    def _outside(self) -> Outside:
        return Outside(self._family, self.alpha)

    @cached_property
    def _regions(self) -> NDArray[np.int64]:
        return self._outside.regions()

    @cached_property
    def _flows_out(self) -> NDArray[np.bool_]:
        """Of every cell, does it flow to infinity? (m,)."""
        outside, d = self._outside, self.dimension
        flows = np.arange(len(outside.cells)) >= outside.finite
        through = np.zeros(outside.cells.shape, bool)
        if d > 1:
            points, _, integral = self._family.scaled
            rows = np.ascontiguousarray(outside.cells[: outside.finite])
            code = np.full(len(rows), (1 << (d + 1)) - 1, np.uint8)
            settle(points, integral, rows, np.empty(len(rows)), code)
            through[: outside.finite] = (code[:, None] >> np.arange(d + 1) & 1).astype(bool)
        else:
            from .intervals_nd import measure

            _, signs = measure(
                self.complex.triangulation.points, self.complex.triangulation.weights, outside.cells[: outside.finite]
            )
            through[: outside.finite] = signs < 0
        front = np.flatnonzero(flows)
        while len(front):
            before = outside.neighbors[front].ravel()
            back = (outside.neighbors[before] == np.repeat(front, d + 1)[:, None]) & through[before]
            reached = before[back.any(axis=1) & ~flows[before]]
            front = np.unique(reached)
            flows[front] = True
        return flows

    def _cavities(self, outside: Outside | None, region: NDArray[np.int64] | None) -> Cavities:
        """Measure regions of finite cells: what the cells have, less what the balls have of these."""
        d = self.dimension
        if outside is None or region is None:
            nothing = np.empty(0)
            return Cavities(
                nothing, nothing, np.empty((0, d + 1), np.int32), np.empty(0, np.int64), np.empty(0, np.int64)
            )
        found = np.flatnonzero(region >= 0)
        number, cells = region[found], outside.cells[found]
        count = int(number.max(initial=-1)) + 1
        balls = np.column_stack([self._spheres.balls[:, :3], self._spheres.squares])
        local = (self._spheres.balls[cells] - self._spheres.balls[cells[:, :1]])[..., :3]
        measure = balls_within(balls, cells, *adjacency(self.complex))
        measure[:, 0] = contents(local, d) - measure[:, 0]
        volumes = self._spheres.unscaled(np.bincount(number, measure[:, 0], count), d)
        areas = self._spheres.unscaled(np.bincount(number, measure[:, 1], count), d - 1)
        gates = (~outside.walls[found] & (region[outside.neighbors[found]] != number[:, None])).sum(axis=1)
        mouths = np.bincount(number, gates, count).astype(np.int64)
        arrays = np.maximum(volumes, 0.0), np.maximum(areas, 0.0), cells, number, mouths
        for array in arrays:
            array.flags.writeable = False
        return Cavities(*arrays)


def space_filling_diagram(
    points_or_complex: ArrayLike | RegularTriangulation | AlphaComplex,
    weights: ArrayLike | None = None,
    alpha: float = 0.0,
) -> SpaceFillingDiagram:
    """Give the union of balls around points, measured exactly: volume, area, voids, and the faces of its boundary.

    Parameters
    ----------
    points_or_complex : (n, d) array_like of float [L], d = 1 to 3; or RegularTriangulation; or AlphaComplex
    weights : (n,) array_like of float [L^2]
        Squared radii; with points only, default all zero. A ball of negative weight + alpha is empty.
    alpha : float [L^2]
        Added to all squared radii.

    Returns
    -------
    SpaceFillingDiagram

    Raises
    ------
    InvalidInput
        As `regular_triangulation`; more than three dimensions; weights given twice; an alpha that is not finite.

    Notes
    -----
    Inclusion-exclusion over K_alpha, so with at most d + 1 balls at a time (Edelsbrunner 1995, "The union of balls and
    its dual shape"): no sampling, errors of a few roundings of the largest ball nearby. A ball counts what lies in its
    power cell, so that balls that are hidden or swallowed have nothing, and of equal balls the first has all.

    Edelsbrunner (1992), section 4: 4.1 and 4.2.

    Examples
    --------
    >>> import math
    >>> two = space_filling_diagram([[0, 0, 0], [1, 0, 0]], [1, 1])
    >>> round(two.volume / math.pi, 12), round(two.area / math.pi, 12), two.euler
    (2.25, 6.0, 2)
    """
    given = points_or_complex
    if isinstance(given, AlphaComplex):
        if weights is not None:
            raise InvalidInput("weights: given twice, as the complex has its own")
        given = given.triangulation
    located = given.points if isinstance(given, RegularTriangulation) else as_points(given)
    if located.shape[1] > 3:
        raise InvalidInput(f"points: measured in up to 3-D, got {located.shape[1]} columns")
    alpha = as_number(alpha, "alpha", "one finite number")
    if not math.isfinite(alpha):
        raise InvalidInput(f"alpha: expected one finite number, got {alpha}")
    if isinstance(points_or_complex, AlphaComplex):
        return SpaceFillingDiagram(points_or_complex, alpha)
    return SpaceFillingDiagram(alpha_complex(points_or_complex, weights), alpha)
