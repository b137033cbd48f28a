"""The topology of a triangle mesh, from its faces alone: no coordinate is looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contracts import InvalidInput
from .threads import together


@dataclass(frozen=True, slots=True)
class Topology:
    """What the faces of a mesh are, counted.

    Attributes
    ----------
    vertices, edges, faces : int
        Vertices in use, distinct edges, and faces; degenerate faces are left out of everything but their own count.
    euler : int
        chi = vertices - edges + faces.
    components : int
        Connected pieces; two pieces that touch in one vertex are one.
    genus : int or None
        Number of handles, summed over the components; None where the mesh is not closed, manifold and orientable.
    boundary_loops : int
        Closed chains of open edges. At a vertex where several umbrellas meet, a loop stays with its umbrella.
    open_edges : int
        Edges of exactly one face.
    nonmanifold_edges : int
        Edges of three faces or more.
    nonmanifold_vertices : int
        Vertices whose faces fall into several umbrellas: faces that share an edge there are in the same one.
    degenerate_faces : int
        Faces that name a vertex twice.
    duplicate_faces : int
        Faces on the same three vertices as an earlier face, whatever their orientation.
    orientable : bool
        The faces can be turned so that each edge of two faces is walked once each way.
    oriented : bool
        They are so already.
    closed : bool
        There are faces, and every edge has an even number of them.
    manifold : bool
        No non-manifold edge or vertex; a boundary is allowed.
    """

    vertices: int
    edges: int
    faces: int
    euler: int
    components: int
    genus: int | None
    boundary_loops: int
    open_edges: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    degenerate_faces: int
    duplicate_faces: int
    orientable: bool
    oriented: bool
    closed: bool
    manifold: bool


def topology(faces: ArrayLike, *, threads: int | None = None) -> Topology:
    """Count what the faces of a mesh are.

    Parameters
    ----------
    faces : (f, 3) array_like of int
    threads : int, optional
        All by default; two are of use.

    Returns
    -------
    Topology

    Raises
    ------
    InvalidInput
        Not integers of shape (f, 3), or negative.

    Notes
    -----
    One linear sort of the 3 f half-edges and three passes of connected components.

    Examples
    --------
    >>> tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> t = topology(tetrahedron)
    >>> t.euler, t.genus, t.closed, t.manifold, t.oriented
    (2, 0, True, True, True)
    >>> t = topology(tetrahedron[1:])
    >>> t.euler, t.genus, t.open_edges, t.boundary_loops
    (1, None, 3, 1)
    """
    triangles = _as_triangles(faces)
    given = len(triangles)
    triangles = triangles[_whole(triangles)]
    n, triangles = _compact(triangles)
    f = len(triangles)
    edges = HalfEdges(triangles, n)
    pairs = edges.pairs()

    def of_faces() -> tuple[bool, bool, int, int]:
        oriented = bool((edges.forward[pairs[0]] != edges.forward[pairs[1]]).all())
        orientable = oriented or _orientable(f, pairs, edges.forward)
        return oriented, orientable, _count_components(n, edges.low, edges.high), _duplicates(triangles, edges)

    (forest, per_vertex), (oriented, orientable, components, duplicates) = together(
        threads, lambda: _umbrellas(triangles, n, edges), of_faces
    )
    nonmanifold_edges = int((edges.count > 2).sum())
    nonmanifold_vertices = int((per_vertex > 1).sum())
    closed = f > 0 and not (edges.count % 2).any()
    manifold = nonmanifold_edges == 0 and nonmanifold_vertices == 0
    euler = n - len(edges.count) + f
    return Topology(
        vertices=n,
        edges=len(edges.count),
        faces=f,
        euler=euler,
        components=components,
        genus=components - euler // 2 if closed and manifold and orientable else None,
        boundary_loops=_boundary_loops(edges, forest),
        open_edges=int((edges.count == 1).sum()),
        nonmanifold_edges=nonmanifold_edges,
        nonmanifold_vertices=nonmanifold_vertices,
        degenerate_faces=given - f,
        duplicate_faces=duplicates,
        orientable=orientable,
        oriented=oriented,
        closed=closed,
        manifold=manifold,
    )


def patches(faces: ArrayLike) -> NDArray[np.int64]:
    """Label faces by patch: faces are in the same one where a chain of edges of exactly two faces joins them.

    Within a patch, and nowhere else, the orientation of one face decides that of all.

    Parameters
    ----------
    faces : (f, 3) array_like of int

    Returns
    -------
    (f,) ndarray of int64
        0, 1, ... in the order of their first faces; -1 for degenerate faces.

    Examples
    --------
    >>> patches([[0, 1, 2], [5, 6, 7], [2, 1, 3], [4, 4, 0]]).tolist()
    [0, 1, 0, -1]
    """
    triangles = _as_triangles(faces)
    whole = _whole(triangles)
    n, compact = _compact(triangles[whole])
    a, b = HalfEdges(compact, n).pairs()
    result = np.full(len(triangles), -1)
    result[whole] = _labels(len(compact), a // 3, b // 3)[1]
    return result


def agreeing(faces: ArrayLike) -> NDArray[np.int64]:
    """Turn faces so that all of a patch agree with its first face, wherever the patch is orientable.

    Parameters
    ----------
    faces : (f, 3) array_like of int
        None degenerate.

    Returns
    -------
    (f, 3) ndarray of int64
        Patches that cannot be oriented stay as they are.

    Examples
    --------
    >>> agreeing([[0, 1, 2], [1, 2, 3], [3, 2, 4]]).tolist()
    [[0, 1, 2], [1, 3, 2], [3, 4, 2]]
    """
    triangles = _as_triangles(faces)
    f = len(triangles)
    n, compact = _compact(triangles)
    edges = HalfEdges(compact, n)
    _, label = _double_cover(f, edges.pairs(), edges.forward)
    two_sided = label[:f] != label[f:]
    lowest = np.minimum(label[:f], label[f:])
    _, first = np.unique(lowest, return_index=True)
    sheet = np.zeros(2 * f, np.int64)
    sheet[lowest[first]] = label[first]
    turned = two_sided & (label[:f] != sheet[lowest])
    return np.where(turned[:, None], triangles[:, [0, 2, 1]], triangles)


def _as_triangles(faces: ArrayLike) -> NDArray[np.int64]:
    """Give faces as (f, 3) int64, or say what they are."""
    triangles = np.asarray(faces)
    if triangles.size == 0:
        return np.zeros((0, 3), np.int64)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise InvalidInput(f"faces: expected integers of shape (f, 3), got {triangles.dtype} {triangles.shape}")
    if triangles.min() < 0:
        row = int(np.flatnonzero((triangles < 0).any(axis=1))[0])
        raise InvalidInput(f"faces: row {row} is negative: {triangles[row]}")
    return triangles.astype(np.int64)


def _whole(triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which faces name no vertex twice?"""
    a, b, c = triangles.T
    return (a != b) & (b != c) & (c != a)


def _compact(triangles: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Number the vertices in use 0 .. n-1."""
    from ._kernels.edges import number_vertices

    if len(triangles) == 0:
        return 0, triangles
    numbered, count = number_vertices(triangles, triangles.max())
    return count, numbered


class HalfEdges:
    """The half-edges of a mesh sorted by undirected edge: `count` of each edge, `first` into `order`."""

    def __init__(self, triangles: NDArray[np.int64], n: int):
        from ._kernels.edges import by_edge  # numba takes a while to load

        # Half-edge h = 3 * face + j runs from corner j to corner j + 1.
        self.forward = (triangles < triangles[:, [1, 2, 0]]).ravel()
        self.order, self.first, self.low, self.high = by_edge(triangles, n)
        self.count = np.diff(self.first, append=len(self.order))

    def pairs(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The two half-edges of each edge that has two."""
        at = self.first[self.count == 2]
        return self.order[at], self.order[at + 1]

    def chains(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Half-edges that are next to each other in the list of the same edge."""
        inside = np.ones(len(self.order), bool)
        inside[self.first] = False
        at = np.flatnonzero(inside)
        return self.order[at - 1], self.order[at]


def _head(half_edge: NDArray[np.int64]) -> NDArray[np.int64]:
    """The corner that a half-edge runs to; the one it comes from has the half-edge's own number."""
    return half_edge + np.where(half_edge % 3 == 2, -2, 1)


def _labels(n: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> tuple[int, NDArray[np.int32]]:
    """Connected components of n nodes under links a - b."""
    from ._kernels.edges import components

    return components(n, a, b)


def _count_components(n: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> int:
    return int(_labels(n, a, b)[0])


def _orientable(f: int, pairs: tuple[NDArray[np.int64], NDArray[np.int64]], forward: NDArray[np.bool_]) -> bool:
    """No face is joined to its own reverse in the double cover."""
    _, label = _double_cover(f, pairs, forward)
    return bool((label[:f] != label[f:]).all())


def _double_cover(
    f: int, pairs: tuple[NDArray[np.int64], NDArray[np.int64]], forward: NDArray[np.bool_]
) -> tuple[int, NDArray[np.int32]]:
    """Components of faces (0 .. f-1) and their reverses (f .. 2f-1), joined across edges of two faces where they agree."""
    a, b = pairs
    agree = forward[a] != forward[b]
    a, b = a // 3, b // 3
    return _labels(2 * f, np.r_[a, a + f], np.r_[np.where(agree, b, b + f), np.where(agree, b + f, b)])


def _umbrellas(triangles: NDArray[np.int64], n: int, edges: HalfEdges) -> tuple[NDArray[np.integer], NDArray[np.int64]]:
    """Forest of the corners of each umbrella, and how many umbrellas each vertex has."""
    from ._kernels.edges import corners_joined, umbrellas_at

    a, b = edges.chains()
    forest = corner_forest(len(triangles))
    corners_joined(forest, a, b, edges.forward[a] == edges.forward[b])
    return forest, umbrellas_at(forest, triangles, n)


def corner_forest(f: int) -> NDArray[np.integer]:
    """Every corner of f faces on its own."""
    return np.arange(3 * f, dtype=np.int32 if 3 * f <= np.iinfo(np.int32).max else np.int64)


def _boundary_loops(edges: HalfEdges, forest: NDArray[np.integer]) -> int:
    """Components of the open edges, linked within umbrellas."""
    from ._kernels.edges import roots

    half_edge = edges.order[edges.first[edges.count == 1]]
    nodes, ends = np.unique(roots(forest, np.r_[half_edge, _head(half_edge)]), return_inverse=True)
    return _count_components(len(nodes), *np.split(ends, 2))


def _duplicates(triangles: NDArray[np.int64], edges: HalfEdges) -> int:
    """Faces on the vertices of an earlier face."""
    from ._kernels.edges import repeated

    return int(repeated(triangles, edges.order, edges.first, edges.high))
