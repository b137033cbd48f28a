"""From the triangulation to a surface: which side each cell lies on, and the facets between the sides.

Two kinds of evidence say it. A facet whose gate (the depth at which it closes, in local spacings) is wide has one side: its two
cells lie together. A sample lies on the surface: its two poles, the deepest cells on either hand, lie apart. An open sheet has no
sides to begin with; there each sample says which facets around it cross its tangent plane (`_kernels.tangents`). A body with an
opening is a closed surface less its walls. All evidence is taken strongest first into a signed spanning forest; what contradicts
stronger evidence is passed over. Then a local search gives every sample exactly one umbrella of facets. At the end edges are
flipped where the surface bends less by that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .between import facets_between
from .contracts import DegenerateInput, InvalidInput
from .mesh import turned, turned_by_majority
from .pinholes import pinholes
from .regular import OUTWARD, RegularTriangulation
from .repair import excesses, flip_edges, repair
from .terrain import RUGGED, seen_from_above
from .threads import over_ranges, together
from .topology import topology

Kind = Literal["auto", "closed", "open", "sheets"]
Pieces = tuple[int, NDArray[np.int32], NDArray[np.int64], NDArray[np.int32]]
OPEN_GATE = 2.5  # widest facet of an open sheet [local spacings]; the rest closes it over its boundary
PINHOLE = 2 * np.pi * OPEN_GATE  # longest way around a hole no larger than such a facet's circle [local spacings]
# A closed surface has less than this share of its area in walls, facets wider than those of a sheet: no samples vouch for them.
WALLS = 1 / 4
BUBBLE = 32  # samples for each piece of it, or more: a flat and noisy sheet falls into bubbles of some twenty


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Facets of R between the two sides.

    Attributes
    ----------
    faces : (f, 3) ndarray of int32
        Input rows, counter-clockwise seen from outside (of an open sheet: from one side of it).
    bridged : (f,) ndarray of bool
        Facets of positive size: no faces of W_0, they close its leaks, or an edge was flipped there.
    kind : {"closed", "open", "planar", "terrain"}
        What came out: "open" has a boundary. A terrain has no facets in space; `reconstruct` triangulates its plan.
    confidence : float
        0 (a toss-up) to 1, of the choice between closed and open; 1 where the caller made it.
    reason : str
        Why this kind, in one line.
    buried, pinched : int
        Vertices of R with no facet of the surface, and with more than one umbrella of them.
    passed_over : int
        Samples whose two poles stronger evidence holds together.
    leaks : int
        Bridged facets before edges were flipped.
    flipped_edges : int
        Edges flipped so that the surface bends less.
    walls : float or None
        Share of the area of the closed surface in facets wider than those of a sheet: they close openings, and no samples vouch for
        them. None of sheets, and of what is no surface in space.
    thin_loops : tuple of (k,) ndarray of int64
        Of a closed surface the loops of at most 5 pi spacings around a handle, or through it, one of each homology class, fewest
        edges first, as input rows in order: a bore as narrow as that, or a gap between samples. They are looked for where the
        poles of samples are not deep, or not apart.
    """

    faces: NDArray[np.int32]
    bridged: NDArray[np.bool_]
    kind: str
    confidence: float
    reason: str
    buried: int
    pinched: int
    passed_over: int
    leaks: int = 0
    flipped_edges: int = 0
    walls: float | None = None
    thin_loops: tuple[NDArray[np.int64], ...] = ()


def label_surface(
    triangulation: RegularTriangulation,
    spacing: NDArray[np.float64],
    kind: Kind = "auto",
    *,
    apart: NDArray[np.float64] | None = None,
    flips: bool = True,
    threads: int | None = None,
) -> Surface:
    """Find the surface that the vertices of a triangulation sample.

    Parameters
    ----------
    triangulation : RegularTriangulation
        Of points in 3-D. Points in one plane give the planar region they cover.
    spacing : (n,) ndarray of float64 [L]
        Local distance between samples.
    kind : {"auto", "closed", "open", "sheets"}
        Closed: the boundary of a solid, leaks closed by the smallest facets. Sheets: what the samples show from either side.
        Auto: closed, unless a quarter of the area of that would be walls, facets wider than those of a sheet, or it falls into bubbles
        of less than 32 samples; and none of both, but a terrain, where more than a sixteenth of the samples would have no single
        umbrella of facets to begin with, and they are spread more evenly in the plan than in space. Open: where auto is
        closed, the same without its walls, like a bust that is open at its base; sheets elsewhere.
    apart : (n,) ndarray of float64 [L], optional
        Distance between samples where they are widest apart, `weighting.line_spacing`: what facets of a sheet, and walls, are
        measured by. The spacing by default.
    flips : bool
        At the end flip edges where the surface bends less by that. The facets are wider for it, and fewer are in W_0.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    Surface

    Raises
    ------
    InvalidInput
        Points that are not in 3-D, or an unknown kind.
    DegenerateInput
        All points on a line or in one spot.

    Notes
    -----
    O(m log m) for m cells. The forest is that of Kruskal's algorithm with parities. Where no evidence is passed over, the closed surface
    separates the cells as lexicographically minimal cuts do (Cohen-Steiner, Lieutier & Vuillamy 2020): its widest gate is
    the narrowest possible, and so on down.
    """
    apart = spacing if apart is None else apart
    if triangulation.points.shape[1] != 3:
        raise InvalidInput(f"points: a surface needs 3-D points, got {triangulation.points.shape[1]} columns")
    if kind not in ("auto", "closed", "open", "sheets"):
        raise InvalidInput(f"surface: expected 'auto', 'closed', 'open' or 'sheets', got {kind!r}")
    if triangulation.dimension < 2:
        where = ("in one spot", "on a line")[triangulation.dimension]
        raise DegenerateInput(f"points: all lie {where}; a surface needs points that span a plane or more")
    if triangulation.dimension == 2:
        return _planar(triangulation, apart, threads)
    if kind == "sheets":
        return _Evidence(triangulation, apart, flips, threads).sheets("asked for", 1.0, kind)
    evidence = _Evidence(triangulation, spacing, flips, threads)

    def by_lines() -> _Evidence:
        return evidence if np.array_equal(apart, spacing) else _Evidence(triangulation, apart, flips, threads)

    def sheets(reason: str, confidence: float) -> Surface:
        known = (reason, confidence) if kind == "auto" else ("asked for", 1.0)
        return by_lines().sheets(*known, kind)

    def walled(walls: float) -> Surface:
        sure = min((walls - WALLS) / (0.5 - WALLS), 1.0)  # a flat sheet that is closed over is half walls
        return sheets(f"{walls:.0%} of the closed surface would be walls, facets wider than a sheet's", sure)

    sides, passed = evidence.closed_sides()
    facets = evidence.between(sides)
    pieces, walls = together(
        threads,
        lambda: evidence.pieces(sides),
        lambda: evidence.walls(facets, apart) if kind != "closed" else 0.0,
    )
    bubbles = pieces[0] - 2 if kind != "closed" else 0
    if bubbles * BUBBLE > len(spacing):
        sure = min(bubbles * BUBBLE / len(spacing) - 1, 1.0)
        return sheets(f"the closed surface would fall into {bubbles} bubbles", sure)
    if walls >= WALLS:
        return walled(walls)
    excess = evidence.excesses(facets, np.inf)
    if terrain := evidence.terrain(excess, kind):
        return terrain
    repaired = evidence.repair(sides, excess, pieces, np.inf)
    facets = evidence.between(sides)
    walls = evidence.walls(facets, apart)
    if kind != "closed" and walls >= WALLS:
        return walled(walls)
    if kind == "open":
        return replace(by_lines().without_walls(sides, passed), walls=walls)
    found = replace(evidence.closed(sides, facets, *repaired, passed), walls=walls)
    if kind == "closed":
        return found
    reason = f"only {walls:.1%} of the closed surface is walls, facets wider than a sheet's"
    return replace(found, reason=reason, confidence=1 - walls / WALLS)


class _Evidence:
    """Nodes (cells and ghosts), gates and poles of one triangulation, shared by the closed and the open reading.

    Points are numbered along a curve through space, so that what is near in space is near in memory; `order` gives their rows.
    """

    def __init__(
        self, triangulation: RegularTriangulation, spacing: NDArray[np.float64], flips: bool, threads: int | None
    ):
        from ._kernels import sides, spatial_sort, umbrellas  # numba takes a while to load

        self.order = order = spatial_sort.hilbert_order(triangulation.points)
        rank = np.empty(len(order), np.int32)
        rank[order] = np.arange(len(order), dtype=np.int32)
        self.unit = unit = _unit(triangulation.points)
        self.points, self.weights = triangulation.points[order] * unit, triangulation.weights[order] * unit * unit
        self.spacing = spacing = spacing[order] * unit
        m = len(triangulation.cells)
        nodes, links = np.empty((2, m + np.count_nonzero(triangulation.neighbors < 0), 4), np.int32)
        cells = triangulation.cells, triangulation.neighbors, rank
        over_ranges(lambda *part: sides.number_nodes(*cells, *part, nodes, links), m, threads)
        sides.close_hull(nodes, links, m, len(order))
        over_ranges(lambda *part: sides.link_ghosts(nodes, links, m, len(order), *part), len(nodes) - m, threads)
        self.nodes, self.links, self.cells = nodes, links, nodes[:m]
        centers, rho, depth = np.empty((m, 3)), np.empty(m), np.empty(m, np.float32)
        cloud = self.points, self.weights, spacing
        over_ranges(lambda *part: sides.spheres(*cloud, self.cells, *part, centers, rho, depth), m, threads)
        self.gate, self.leak = np.empty((m, 4), np.float32), np.empty((m, 4), np.bool_)
        ground = *cloud, self.nodes, self.links, rho
        over_ranges(lambda *part: sides.facet_sizes(*ground, *part, self.gate, self.leak), m, threads)
        found, self.stars = together(
            threads,
            lambda: sides.poles(self.points, self.nodes, self.links, centers, rho, depth, m),
            lambda: umbrellas.star_lists(self.nodes, len(order)),
        )
        *self.poles, self.normals = found
        self.flips, self.threads = flips, threads
        self.centers = centers

    def closed_sides(self) -> tuple[NDArray[np.int8], int]:
        """Side of every node, 0 outside; and the samples passed over."""
        from ._kernels import forest

        parent = forest.first_trees(self.links, self.gate, *self.poles)
        evidence = forest.facet_evidence(self.links, self.gate, parent)
        return forest.signed_forest(self.links, len(self.cells), *evidence, *self.poles, parent)

    def open_sides(self) -> tuple[NDArray[np.int8], int]:
        """Side of every node as its corners see it; and the facets of a sheet that were passed over."""
        from ._kernels.forest import signed_forest
        from ._kernels.tangents import axes, heights, sheet_evidence

        m = len(self.cells)
        axis, sure, tensor = axes(self.points, self.spacing, self.nodes, self.centers, *self.poles, m)
        doubtful = sure < 1
        axis[doubtful] = np.linalg.eigh(tensor[doubtful])[1][:, :, 2]
        height = heights(self.points, self.spacing, self.cells, self.centers, axis)
        evidence = sheet_evidence(self.nodes, self.links, self.gate, axis, self.normals, height, np.float32(OPEN_GATE))
        alone = 2 * np.arange(len(self.nodes), dtype=np.int32)
        return signed_forest(self.links, m, *evidence, *(part[:0] for part in self.poles), alone)

    @property
    def ground(self) -> tuple[NDArray, ...]:
        """What sides are mended on."""
        return self.points, self.spacing, self.nodes, self.links, self.gate, *self.stars

    def excesses(self, facets: NDArray[np.int64], widest: float) -> NDArray[np.int32]:
        """The excess umbrellas of every sample, -1 where it is buried."""
        return excesses(self.ground, facets, widest, self.threads)

    @cached_property
    def seen_from_above(self) -> bool:
        """Whether the samples are spread as a scanner above does, asked before either reading is repaired."""
        return seen_from_above(self.points, self.threads)

    def terrain(self, excess: NDArray[np.int32], asked: Kind) -> Surface | None:
        """That it is a terrain: where the samples are rugged and seen from above, and the caller did not choose."""
        rugged = np.count_nonzero(excess) / len(excess)
        if asked != "auto" or rugged <= RUGGED or not self.seen_from_above:
            return None
        reason = (
            f"{rugged:.0%} of the samples lie on no sheet, and they are spread more evenly in the plan than in space"
        )
        none = np.zeros((0, 3), np.int32)
        confidence = float(min(rugged / RUGGED - 1, 1.0))
        return Surface(none, none[:, 0] > 0, "terrain", confidence, reason, 0, 0, 0)

    def repair(
        self, sides: NDArray[np.int8], excess: NDArray[np.int32], pieces: Pieces, widest: float
    ) -> tuple[NDArray[np.int32], list[NDArray[np.int64]]]:
        """Mend `sides` in place; their excess umbrellas afterwards, and thin handles."""
        return repair(self.ground, sides, self.poles, excess, pieces, widest, self.threads)

    def flip_edges(
        self, sides: NDArray[np.int8], facets: NDArray[np.int64], excess: NDArray[np.int32], widest: float
    ) -> tuple[NDArray[np.int64], int, int]:
        """Make the surface bend less, in place; its facets, how many bridged a leak before, and how many edges were flipped."""
        leaks = int(np.count_nonzero(self.leak.ravel()[facets] & (self.gate.ravel()[facets] <= widest)))
        flips = flip_edges(self.ground, sides, excess, widest, self.threads) if self.flips else 0
        return self.between(sides) if flips else facets, leaks, flips

    def between(self, sides: NDArray[np.int8]) -> NDArray[np.int64]:
        """All facets between the sides, as 4 * cell + corner, seen from side 1 where it is a cell."""
        return facets_between(self.links, sides, len(self.cells), self.threads)

    def faces(self, facets: NDArray[np.int64]) -> NDArray[np.int32]:
        """Vertices of facets, outward."""
        from ._kernels.forest import corners_of

        return corners_of(self.cells, facets, OUTWARD)

    def closed(
        self,
        sides: NDArray[np.int8],
        facets: NDArray[np.int64],
        excess: NDArray[np.int32],
        thin: list[NDArray[np.int64]],
        passed: int,
    ) -> Surface:
        """All facets between inside and outside, once `sides` are mended."""
        facets, leaks, flipped = self.flip_edges(sides, facets, excess, np.inf)
        faces, bridged = self.rows(self.faces(facets)), self.leak.ravel()[facets]
        buried, pinched = int((excess < 0).sum()), int((excess > 0).sum())
        loops = tuple(self.order[loop] for loop in thin)
        told = buried, pinched, passed, leaks, flipped
        return Surface(faces, bridged, "closed", 1.0, "asked for", *told, thin_loops=loops)

    def pieces(self, sides: NDArray[np.int8]) -> Pieces:
        """Components of nodes of one side: their number, that of each node, and their sizes; and room for `repair`."""
        from ._kernels.components import number_components

        N = len(sides)
        parts = np.empty(N, np.int32), np.empty(N + 1, np.int64), np.empty(N, np.int32)
        return number_components(self.links, sides, *parts[:2]), *parts

    def walls(self, facets: NDArray[np.int64], apart: NDArray[np.float64]) -> float:
        """Share of the area in facets whose circumradius is above that of a sheet's, by a spacing in rows of the input."""
        from ._kernels.forest import areas

        faces = self.faces(facets)
        wide, whole = areas(self.points, apart[self.order] * self.unit, faces, OPEN_GATE)
        return wide / whole if whole > 0 else 1.0

    def rows(self, faces: NDArray[np.int32]) -> NDArray[np.int32]:
        """Faces in rows of the input."""
        return self.order.astype(np.int32)[faces]

    def sheets(self, reason: str, confidence: float, asked: Kind) -> Surface:
        """The facets between one hand and the other that are no wider than a sheet's."""
        sides, passed = self.open_sides()
        excess = self.excesses(self.between(sides), OPEN_GATE)
        if terrain := self.terrain(excess, asked):
            return terrain
        return self.sheet(sides, excess, passed, lambda faces: turned(self.points, faces), reason, confidence)

    def without_walls(self, sides: NDArray[np.int8], passed: int) -> Surface:
        """The facets between inside and outside that are no wider than a sheet's."""
        excess = self.excesses(self.between(sides), OPEN_GATE)
        return self.sheet(
            sides, excess, passed, turned_by_majority, "asked for: the closed surface without its walls", 1.0
        )

    def sheet(
        self,
        sides: NDArray[np.int8],
        excess: NDArray[np.int32],
        passed: int,
        turn: Callable[[NDArray[np.int64]], NDArray[np.int64]],
        reason: str,
        confidence: float,
    ) -> Surface:
        """All facets between `sides` that are no wider than a sheet's, once these are mended, and those that close pinholes."""
        from ._kernels.complex import used_vertices

        excess, _ = self.repair(sides, excess, self.pieces(sides), OPEN_GATE)
        facets, leaks, flipped = self.flip_edges(sides, self.between(sides), excess, OPEN_GATE)
        facets = facets[self.gate.ravel()[facets] <= OPEN_GATE]
        cloud, walls = (self.points, self.spacing), (self.nodes, self.gate, *self.stars)
        facets = np.append(facets, pinholes(cloud, walls, self.faces(facets).astype(np.int64), PINHOLE))
        faces = turn(self.faces(facets).astype(np.int64)).astype(np.int32)
        n = len(self.points)
        buried = int((used_vertices(self.cells, n) & ~used_vertices(faces, n)).sum())
        kind = "closed" if topology(faces).closed else "open"
        bridged = self.leak.ravel()[facets]
        faces, pinched = self.rows(faces), int((excess > 0).sum())
        return Surface(faces, bridged, kind, confidence, reason, buried, pinched, passed, leaks, flipped)


def _unit(points: NDArray[np.float64]) -> float:
    """A power of two that keeps the sixth powers of lengths in range, and changes nothing else [1/L]."""
    return 2.0 ** min(1023.0, -float(np.frexp(np.ptp(points, axis=0).max())[1]))


def _planar(triangulation: RegularTriangulation, spacing: NDArray[np.float64], threads: int | None) -> Surface:
    """The triangles no wider than a sheet's, all facing the same way."""
    from ._kernels.complex import used_vertices
    from ._kernels.forest import narrow_faces

    points, cells, beside = triangulation.points, triangulation.cells, triangulation.neighbors
    unit, m = _unit(points), len(cells)
    radius, keep, short = np.empty(m), np.empty(m, np.bool_), np.empty(m, np.bool_)
    ground = points * unit, spacing * unit, cells, OPEN_GATE, PINHOLE
    over_ranges(lambda *part: narrow_faces(*ground, *part, radius, keep, short), m, threads)
    among = np.append(keep, False)  # beyond the hull, -1
    keep = keep | (short & among[beside[:, 0]] & among[beside[:, 1]] & among[beside[:, 2]])
    faces = cells[keep]
    bridged = radius[keep] ** 2 > triangulation.weights[faces].mean(axis=1) * unit * unit
    used = int(np.count_nonzero(used_vertices(faces, len(points))))
    buried = len(points) - len(triangulation.hidden) - used
    return Surface(faces, bridged, "planar", 1.0, "all points lie in one plane", buried, 0, 0, int(bridged.sum()))
