"""Weights under which W_0 is a closed surface, or has one as its outer boundary (paper, section 6 (i))."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from recon.contracts import DegenerateInput, InvalidInput, as_points, as_weights, as_whole
from recon.regular import OUTWARD, RegularTriangulation, regular_triangulation

from ._closing_program import Rows, curtains, expelled, facing, graded, step, walls
from .adaptive import adaptive_weights
from .covering import NEAR
from .density import MOST_ROUNDS, spacing
from .neighborhood import RING, Neighborhood, neighbors

if TYPE_CHECKING:
    from recon.alpha import AlphaComplex

RINGS = 3  # how far from a fault weights are changed: 0, 1 and 2 rings of neighbours in turn
ROUNDS = 25  # steps for each of the two aims; most clouds need 3 to 10
# Margins of the sizes, in squared local spacings: wide at first, as conditions are linear only nearby, then less and less.
MARGIN, EASE, LEAST = 0.02, 0.85, 1e-4
FAIR = 0.9  # share of the points that a closed surface must have to count for more than one that is not closed


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """What weights reach: read off the exact triangulation and the classes at alpha = 0, nothing else.

    Attributes
    ----------
    weights : (n,) ndarray of float64 [L^2]
    level : {0, 1, 2}
        1: the whole boundary of W_0 is a closed surface, or several that are disjoint: a 2-manifold without boundary, and
        no exposed simplex beside it. Where `cells` is 0, W_0 itself is that surface. 2: this holds of what can be
        reached of W_0 from outside. 0: neither, or undecided.
    faces : (f, 3) ndarray of int32
        Input rows, ascending: all exposed facets at level 1, else those reached from outside.
    euler, components : int
        Of these faces.
    open_edges, nonmanifold_edges, nonmanifold_vertices : int
        Edges of one face, of three or more; vertices of several umbrellas.
    loose : int
        Edges and vertices that belong to the boundary (level 1: to all of it, else as reached from outside) but to no face.
    cells : int
        Tetrahedra of K_0.
    share : float
        Of the distinct points, those that are vertices of the faces.
    undecided : int
        Simplices whose size is rounded to the wrong side of 0: none, or the level is 0.
    rounds : int
        Triangulations tried before these weights, and theirs.
    """

    weights: NDArray[np.float64]
    level: int
    faces: NDArray[np.int32]
    euler: int
    components: int
    open_edges: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    loose: int
    cells: int
    share: float
    undecided: int
    rounds: int

    def __repr__(self) -> str:
        what = ("not closed", "closed", "closed outside")[self.level]
        return f"Closure({what}, {len(self.faces)} faces, euler {self.euler}, {self.share:.1%} of the points)"


def closing_weights(
    points: ArrayLike | Neighborhood,
    weights: ArrayLike | None = None,
    *,
    rounds: int = ROUNDS,
    threads: int | None = None,
) -> Closure:
    """Find weights under which W_0 is a closed surface, or at least has one as its outer boundary, and say what was reached.

    A heuristic: it may fail where such weights exist. What it claims is certain: `Closure` is read off the exact
    triangulation under the weights that it returns.

    Parameters
    ----------
    points : (n, 3) array_like of float [L], or Neighborhood of at least 24 neighbours
        Samples of closed surfaces. Duplicates share their weight.
    weights : (n,) array_like of float [L^2], optional
        Where to start: covering weights by default (`adaptive_weights`).
    rounds : int
        At most, for each of the two aims.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    Closure
        The best seen: level 1 before 2 before 0, and then the fewest faults.

    Raises
    ------
    InvalidInput
        Malformed points or weights, points not in 3-D, rounds < 1 or more than 10,000.
    DegenerateInput
        Points that lie in one plane.

    Notes
    -----
    Each round triangulates, parts the cells by `recon.surface.label_surface` into inside and outside, and solves a linear
    program for the least change of weights under which the facets between the sides are in K_0 (weights are raised at
    leaks), and nothing else is (they are moved to lift the orthocentres of slivers off the surface). First all that is
    no such facet is to leave K_0; where that is not reached, only what is outside.

    Examples
    --------
    >>> import datasets_synthetic
    >>> cloud = datasets_synthetic.surface("torus").sample(1000, spacing="blue", rng=0)
    >>> closing_weights(cloud.points)
    Closure(closed, 2000 faces, euler 0, 100.0% of the points)
    """
    rounds = as_whole(rounds, "rounds", 1, MOST_ROUNDS)
    if not isinstance(points, Neighborhood):
        points = as_points(points, 3)
    hood = neighbors(points, NEAR, threads=threads)
    if hood.points.shape[1] != 3:
        raise InvalidInput(f"points: a closed surface needs 3-D points, got {hood.points.shape[1]} columns")
    given = None if weights is None else as_weights(weights, len(hood.inverse))
    start = adaptive_weights(hood, radius="covering", threads=threads) if given is None else given
    local, start = spacing(hood)[hood.rows], start[hood.rows]
    best = state = _judge(regular_triangulation(hood.points, start), 1)
    for turn in range(rounds):  # first all that is not the surface is to leave K_0
        if best.rank[0] == 1:
            break
        change = step(_conditions(state.triangulation, local, _margin(turn), everywhere=True), local**2)
        if change is None or not change.any():
            break
        state = _judge(regular_triangulation(hood.points, state.triangulation.weights + change), turn + 2)
        best = min(best, state, key=lambda one: one.rank)
    for turn in range(rounds):  # then only what is outside, and only near the faults of the best so far
        if best.rank[0] <= 2:
            break
        near = np.zeros(len(local), bool)
        near[best.faulty] = True
        for _ in range(turn % RINGS):
            near[hood.index[near, :RING]] = True
        rows = _conditions(best.triangulation, local, _margin(turn), everywhere=False)
        change = step([part.touching(near) for part in rows], local**2)
        if change is not None and change.any():
            state = _judge(regular_triangulation(hood.points, best.triangulation.weights + change), rounds + turn + 2)
            best = min(best, state, key=lambda one: one.rank)
    # The order of the rows breaks ties: what counts is what the caller gets.
    located, w = hood.points[hood.inverse], best.triangulation.weights[hood.inverse]
    return _judge(regular_triangulation(located, w), best.reached.rounds).reached


def closure(points: ArrayLike, weights: ArrayLike | None = None) -> Closure:
    """Say whether the boundary of W_0 is a closed surface under given weights: all of it, or its outer part.

    Parameters
    ----------
    points : (n, 3) array_like of float [L]
    weights : (n,) array_like of float [L^2], default: all zero

    Returns
    -------
    Closure

    Raises
    ------
    InvalidInput
        Malformed points or weights, points not in 3-D.
    DegenerateInput
        Points that lie in one plane.

    Examples
    --------
    >>> corners = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]
    >>> closure(corners, [3.1] * 4)  # the balls fill the tetrahedron
    Closure(closed, 4 faces, euler 2, 100.0% of the points)
    >>> closure(corners, [2.5] * 4)  # the smallest of the four triangles is not covered yet
    Closure(not closed, 3 faces, euler 1, 100.0% of the points)
    """
    located = as_points(points, 3)
    triangulation = regular_triangulation(located, as_weights(weights, len(located)))
    return _judge(triangulation, 1).reached


def _margin(turn: int) -> float:
    """Margin of the sizes in a round."""
    return max(MARGIN * EASE**turn, LEAST)


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Weights tried: the triangulation, what they reach, the vertices where a fault is."""

    triangulation: RegularTriangulation
    reached: Closure
    faulty: NDArray[np.integer]

    @property
    def rank(self) -> tuple[int, int, float]:
        """The lower, the better."""
        found = self.reached
        level = found.level if found.level and found.share >= FAIR else 3
        faults = found.open_edges + found.nonmanifold_edges + found.nonmanifold_vertices + found.loose
        return level, faults if level == 3 else 0, -found.share


def _judge(triangulation: RegularTriangulation, rounds: int) -> _State:
    """Level 1 from the exposed simplices; level 2 from those of K_0 at cells that can be reached from outside."""
    from recon.alpha import EXTERIOR, alpha_complex  # its kernels take a while to load
    from recon.intervals import Family
    from recon.outside import OUTSIDE, Outside
    from recon.topology import topology

    if triangulation.dimension < 3:
        raise DegenerateInput("points: they lie in one plane, so no closed surface goes through them")
    shape = alpha_complex(triangulation)
    undecided = sum(_undecided(shape, k) for k in range(4))
    cells = int((shape.classify(3) != EXTERIOR).sum())
    distinct = len(np.unique(triangulation.points, axis=0))

    seen = [shape.simplices(k)[shape.exposed(k)] for k in range(3)]
    found = topology(seen[2])
    loose = len(seen[1]) - found.edges + len(seen[0]) - found.vertices
    level = 1 if found.closed and found.manifold and loose == 0 else 0
    if not level:
        outside = Outside(Family(triangulation), 0.0)
        reached = outside.regions() == OUTSIDE
        seen = []
        for k in range(3):
            kept = list(combinations(range(4), k + 1))
            rows = [outside.cells[reached & outside.entered(corners)][:, corners] for corners in kept]
            seen.append(np.unique(np.concatenate(rows), axis=0).astype(np.int32))
        found = topology(seen[2])
        loose = len(seen[1]) - found.edges + len(seen[0]) - found.vertices
        level = 2 if found.closed and found.manifold and loose == 0 else 0
    closure = Closure(
        weights=triangulation.weights,
        level=0 if undecided else level,
        faces=seen[2],
        euler=found.euler,
        components=found.components,
        open_edges=found.open_edges,
        nonmanifold_edges=found.nonmanifold_edges,
        nonmanifold_vertices=found.nonmanifold_vertices,
        loose=loose,
        cells=cells,
        share=found.vertices / distinct,
        undecided=undecided,
        rounds=rounds,
    )
    return _State(triangulation, closure, np.empty(0, np.int64) if level else _faulty(*seen))


def _faulty(
    vertices: NDArray[np.integer], edges: NDArray[np.integer], faces: NDArray[np.integer]
) -> NDArray[np.integer]:
    """Vertices of edges that have not two faces, of vertices that have none, and of vertices of several umbrellas."""
    corners = np.arange(faces.size).reshape(faces.shape)
    sides = [[0, 1], [0, 2], [1, 2]]
    pairs, at = faces[:, sides].reshape(-1, 2), corners[:, sides].reshape(-1, 2)
    order = np.lexsort(pairs.T[::-1])
    pairs, at = pairs[order], at[order]
    same = (pairs[1:] == pairs[:-1]).all(axis=1)  # faces that share an edge belong to one umbrella at either end
    links = np.concatenate([np.column_stack([at[:-1][same][:, k], at[1:][same][:, k]]) for k in range(2)])
    graph = coo_array((np.ones(len(links), np.int8), (links[:, 0], links[:, 1])), shape=(faces.size, faces.size))
    umbrella = connected_components(graph, directed=False)[1]
    vertex = np.zeros(umbrella.max(initial=-1) + 1, np.int64)
    vertex[umbrella] = faces.ravel()
    distinct, umbrellas = np.unique(vertex, return_counts=True)
    named, count = np.unique(pairs, axis=0, return_counts=True)
    loose = edges[~_rows_in(edges, named)]
    alone = vertices[~np.isin(vertices, faces)]
    return np.unique(np.concatenate([x.ravel() for x in (named[count != 2], loose, alone, distinct[umbrellas > 1])]))


def _undecided(shape: AlphaComplex, k: int) -> int:
    """Number of k-simplices of which a rational number says otherwise than a float that they are of size at most 0."""
    rho, w = shape.rho(k), np.abs(shape.triangulation.weights)[shape.simplices(k)].max(axis=1)
    near = ~shape.attached(k) & (np.abs(rho) <= 2.0**-39 * (np.abs(rho) + w))  # sizes are within half of that
    points, weights = shape.triangulation.points, shape.triangulation.weights
    exact = [_size(points[row], weights[row]) <= 0 for row in shape.simplices(k)[near]]
    return int((np.array(exact, bool) != (rho[near] <= 0)).sum())


def _size(points: NDArray[np.float64], weights: NDArray[np.float64]) -> Fraction:
    """Size of a simplex as a rational number: of the smallest sphere orthogonal to its vertices."""
    corners = [[Fraction(x) for x in row] for row in points.tolist()]
    w = [Fraction(x) for x in weights.tolist()]
    edges = [[x - y for x, y in zip(row, corners[0])] for row in corners[1:]]
    gram = [[sum((x * y for x, y in zip(a, b)), Fraction(0)) for b in edges] for a in edges]
    right = [(gram[i][i] + w[0] - w[i + 1]) / 2 for i in range(len(edges))]
    rows = [[*row, r] for row, r in zip(gram, right)]
    for i, row in enumerate(rows):  # the Gram matrix is definite: pivots are positive
        row[:] = [x / row[i] for x in row]
        for j, other in enumerate(rows):
            if j != i:
                rows[j] = [x - other[i] * y for x, y in zip(other, row)]
    return sum((row[-1] * r for row, r in zip(rows, right)), -w[0])


def _conditions(
    triangulation: RegularTriangulation, local: NDArray[np.float64], margin: float, *, everywhere: bool
) -> list[Rows]:
    """What has to change so that K_0 is the surface between the sides everywhere, or only as far as outside."""
    from recon.alpha import SINGULAR, alpha_complex
    from recon.surface import label_surface

    points, w, cells = triangulation.points, triangulation.weights, triangulation.cells
    m, unit_sq = len(cells), local**2
    surface = np.sort(label_surface(triangulation, local, "closed", flips=False).faces, axis=1)
    shape = alpha_complex(triangulation)

    facets = np.sort(cells[:, OUTWARD], axis=2)
    on = _rows_in(facets.reshape(-1, 3), surface).reshape(m, 4)
    beside = np.where(triangulation.neighbors < 0, m, triangulation.neighbors)
    cell, slot = np.nonzero(~on)
    graph = coo_array((np.ones(len(cell), np.int8), (cell, beside[cell, slot])), shape=(m + 1, m + 1))
    label = connected_components(graph, directed=False)[1]
    outside = label == label[m]
    emptied = everywhere | outside[:m]

    filled = _rows_in(np.sort(cells, axis=1), shape.simplices(3)[shape.rho(3) <= 0])
    cell, slot = np.nonzero(on & (emptied | ~filled)[:, None])  # a cell that may stay brings its facets along
    seen = facing(points, w, np.take_along_axis(cells[cell], OUTWARD[slot], axis=1), cells[cell, slot])
    rows = walls(seen, unit_sq, emptied[cell], margin)

    apart = np.append(emptied, True)
    cell, slot = np.nonzero(~on & emptied[:, None] & apart[beside] & (np.arange(m)[:, None] < beside))
    other = beside[cell, slot]
    apex = np.append(cells, np.full((1, 4), -1), axis=0)[other]
    mirror = (np.append(triangulation.neighbors, np.full((1, 4), -1), axis=0)[other] == cell[:, None]).argmax(axis=1)
    corners = np.take_along_axis(cells[cell], OUTWARD[slot], axis=1)
    here = facing(points, w, corners, cells[cell, slot])
    there = facing(points, w, corners, np.take_along_axis(apex, mirror[:, None], axis=1)[:, 0])
    rows += curtains((here, there), unit_sq, margin)

    rows.append(expelled(points, w, unit_sq, cells[emptied & filled & ~on.any(axis=1)], margin))
    thin = shape.simplices(1)[shape.classify(1) == SINGULAR]
    thin = thin[~_rows_in(thin, surface[:, [[0, 1], [0, 2], [1, 2]]].reshape(-1, 2))]
    if not everywhere:
        own = np.sort(cells[outside[:m]], axis=1)[:, list(combinations(range(4), 2))].reshape(-1, 2)
        thin = thin[_rows_in(thin, own)]
    rows.append(expelled(points, w, unit_sq, thin, margin))
    rows.append(graded(points, w, shape.simplices(1)))
    return rows


def _rows_in(rows: NDArray[np.integer], others: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which rows are among the others."""
    both = np.concatenate([rows, others]).astype(np.int64)
    order = np.lexsort(both.T[::-1])
    fresh = np.append(True, (both[order][1:] != both[order][:-1]).any(axis=1))[: len(order)]
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(fresh) - 1
    there = np.zeros(len(order), bool)
    there[number[len(rows) :]] = True
    return there[number[: len(rows)]]
