"""Is this mesh what it is said to be: closed, oriented, manifold, embedded, and made of the points it names?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..contracts import CertificateError
from ..exact import Cloud, determinant
from ..intersections import intersecting_chunks, zero_area
from ..mesh import Mesh


def certify_mesh(
    mesh: Mesh,
    *,
    closed: bool | None = None,
    manifold: bool = True,
    oriented: bool = True,
    embedded: bool = True,
    points: NDArray[np.float64] | None = None,
) -> None:
    """Check a triangle mesh, exactly.

    Always: arrays as promised, vertices finite, faces with area, no face twice.

    Parameters
    ----------
    mesh : Mesh
    closed : bool, optional
        True: no edge of one face. False: some edge of one face. None: either.
    manifold : bool
        No edge of three faces or more, and the faces at each vertex form one umbrella.
    oriented : bool
        Edges of several faces are walked as often one way as the other. Where no edge is open and the mesh is embedded, every
        component has the outside in front of it: it encloses a positive volume, or a negative one as the wall of a cavity.
    embedded : bool
        No two faces meet in more than a common vertex or edge.
    points : (n, 3) ndarray of float64 [L], optional
        The input: a vertex that names a row of it has its coordinates.

    Raises
    ------
    CertificateError
        Naming the first offender.
    """
    _arrays(mesh)
    vertices, faces = mesh.vertices, mesh.faces
    bad = np.flatnonzero(zero_area(vertices, faces))
    if len(bad):
        raise CertificateError(f"face {bad[0]} {faces[bad[0]]} has no area")
    _no_face_twice(faces)
    edges = _Edges(faces)
    _open_edges(edges, closed)
    if manifold:
        _manifold(faces, edges)
    if oriented:
        _oriented(edges)
    if embedded:
        for pairs in intersecting_chunks(vertices, faces):
            a, b = pairs[0]
            raise CertificateError(f"faces {a} {faces[a]} and {b} {faces[b]} intersect")
    if oriented and embedded and len(faces) and not (edges.count == 1).any():
        _outward(vertices, faces, edges)
    if points is not None:
        _sources(mesh, points)


def count_mesh(mesh: Mesh) -> dict[str, int]:
    """Count what a report tells of a mesh: vertices in use, faces, chi, open and non-manifold edges, pinched vertices.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    dict of str to int
    """
    edges = _Edges(mesh.faces)
    used = len(np.unique(mesh.faces))
    return {
        "vertices": used,
        "faces": len(mesh.faces),
        "chi": used - len(edges.rows) + len(mesh.faces),
        "open_edges": int((edges.count == 1).sum()),
        "nonmanifold_edges": int((edges.count > 2).sum()),
        "nonmanifold_vertices": len(_pinched(mesh.faces, edges)),
    }


def _arrays(mesh: Mesh) -> None:
    """Shapes, types, ranges."""
    v, f = len(mesh.vertices), len(mesh.faces)
    for name, array, shape, dtype in (
        ("vertices", mesh.vertices, (v, 3), np.float64),
        ("faces", mesh.faces, (f, 3), np.int32),
        ("vertex_source", mesh.vertex_source, (v,), np.int64),
    ):
        if array.shape != shape or array.dtype != dtype:
            raise CertificateError(f"{name}: {array.dtype} {array.shape}, promised {np.dtype(dtype)} {shape}")
    for name, array in mesh.attributes.items():
        if len(array) != v:
            raise CertificateError(f"attribute {name!r}: {len(array)} rows for {v} vertices")
    bad = np.flatnonzero(~np.isfinite(mesh.vertices).all(axis=1))
    if len(bad):
        raise CertificateError(f"vertex {bad[0]} is not finite: {mesh.vertices[bad[0]]}")
    bad = np.flatnonzero(((mesh.faces < 0) | (mesh.faces >= v)).any(axis=1))
    if len(bad):
        raise CertificateError(f"face {bad[0]} names a vertex that is not there: {mesh.faces[bad[0]]}")


def _no_face_twice(faces: NDArray[np.int32]) -> None:
    """No two faces on the same three vertices."""
    rows = np.sort(faces, axis=1)
    order = np.lexsort(rows.T)
    same = np.flatnonzero((np.diff(rows[order], axis=0) == 0).all(axis=1))
    if len(same):
        a, b = sorted(order[same[0] : same[0] + 2])
        raise CertificateError(f"faces {a} {faces[a]} and {b} {faces[b]} are on the same vertices")


class _Edges:
    """The undirected edges: `rows` (e, 2), how many faces each has, how often more it is walked upwards than downwards.

    `side` (3 f,) is the edge of each half-edge (face, j), from corner j to the next; `links` the pairs of half-edges that
    follow each other around an edge.
    """

    def __init__(self, faces: NDArray[np.int32]):
        ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2).astype(np.int64)
        key = ends.min(axis=1) << 32 | ends.max(axis=1)
        keys, self.side, self.count = np.unique(key, return_inverse=True, return_counts=True)
        self.rows = np.column_stack([keys >> 32, keys & 0xFFFFFFFF])
        self.walked = np.bincount(self.side, np.where(ends[:, 0] < ends[:, 1], 1, -1), minlength=len(keys))
        self.ends = ends
        order = np.argsort(self.side, kind="stable")
        together = np.diff(self.side[order]) == 0
        self.links = order[:-1][together], order[1:][together]


def _open_edges(edges: _Edges, closed: bool | None) -> None:
    """Closed or open, as claimed."""
    lonely = np.flatnonzero(edges.count == 1)
    if closed and len(lonely):
        raise CertificateError(
            f"called closed, but edge {edges.rows[lonely[0]]} has one face, {len(lonely)} such edge(s)"
        )
    if closed is not None and len(edges.rows) == 0:
        raise CertificateError(f"called {'closed' if closed else 'open'}, but has no face")
    if closed is False and len(lonely) == 0:
        raise CertificateError("called open, but no edge is open")


def _manifold(faces: NDArray[np.int32], edges: _Edges) -> None:
    """At most two faces an edge, and one umbrella a vertex."""
    bad = np.flatnonzero(edges.count > 2)
    if len(bad):
        raise CertificateError(f"not manifold: edge {edges.rows[bad[0]]} has {edges.count[bad[0]]} faces")
    pinched = _pinched(faces, edges)
    if len(pinched):
        raise CertificateError(f"not manifold: the faces at vertex {pinched[0]} form several umbrellas")


def _pinched(faces: NDArray[np.int32], edges: _Edges) -> NDArray[np.integer]:
    """Vertices whose faces form several umbrellas: corners are joined where two faces share an edge."""
    a, b = edges.links
    corner_a, corner_b = [], []
    for end in range(2):
        vertex = edges.ends[a, end]
        corner_a.append(_corner(a, end))
        corner_b.append(np.where(edges.ends[b, 0] == vertex, _corner(b, 0), _corner(b, 1)))
    label = _components(3 * len(faces), np.concatenate(corner_a), np.concatenate(corner_b))
    umbrellas = np.unique(faces.ravel().astype(np.int64) * (3 * len(faces)) + label) // (
        3 * len(faces)
    )  # their vertices
    return np.unique(umbrellas[1:][np.diff(umbrellas) == 0])


def _corner(half_edge: NDArray[np.int64], end: int) -> NDArray[np.int64]:
    """The corner, numbered 3 face + place, at an end of a half-edge."""
    face, place = np.divmod(half_edge, 3)
    return 3 * face + (place + end) % 3


def _components(n: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int32]:
    """Label n nodes under links a - b."""
    return connected_components(coo_array((np.ones(len(a), np.int8), (a, b)), shape=(n, n)), directed=False)[1]


def _oriented(edges: _Edges) -> None:
    """Edges of several faces are walked as often one way as the other, but for one where the number is odd."""
    bad = np.flatnonzero((edges.count > 1) & (np.abs(edges.walked) > edges.count % 2))
    if len(bad):
        raise CertificateError(f"not oriented: edge {edges.rows[bad[0]]} is walked the same way by its faces")


def _outward(vertices: NDArray[np.float64], faces: NDArray[np.int32], edges: _Edges) -> None:
    """Each component encloses a positive volume, or a negative one inside an odd number of others."""
    a, b = edges.links
    component = _components(len(faces), a // 3, b // 3)
    if component.max() == 0:
        depth = np.zeros(1, np.int64)
    else:
        depth = _depths(vertices, faces, component)
    volume = _volume_signs(vertices, faces, component)
    bad = np.flatnonzero(volume != np.where(depth % 2, -1, 1))
    if len(bad):
        face = np.argmax(component == bad[0])
        where = f"inside {depth[bad[0]]} other component(s)" if depth[bad[0]] else "outermost"
        raise CertificateError(f"the component of face {face} {faces[face]}, {where}, does not face outwards")


def _volume_signs(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], component: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Sign of the volume that each component encloses: by floats where their error cannot matter, else by integers."""
    middle = 0.5 * vertices[faces.ravel()].min(axis=0) + 0.5 * vertices[faces.ravel()].max(axis=0)
    shift = -int(np.frexp(np.abs(vertices[faces.ravel()] - middle).max())[1])
    a, b, c = (np.ldexp(vertices[faces[:, i]] - middle, shift) for i in range(3))
    term = np.einsum("ij,ij->i", a, np.cross(b, c))
    total = np.bincount(component, term)
    # Coordinates are at most 1 and rounded by 2^-53: 2^-47 a term covers that and its products; then the summation.
    count = np.bincount(component)
    certain = np.abs(total) > count * (2.0**-47 + 2.0**-52 * np.bincount(component, np.abs(term)))
    sign = np.sign(total).astype(np.int64)
    exact = Cloud(vertices)
    for k in np.flatnonzero(~certain):
        sign[k] = exact.sign_of_sum(_volume, *faces[component == k].T)
    return sign


def _volume(a, b, c):
    """Six times the volume of a tetrahedron with the origin."""
    return determinant([a.x, b.x, c.x])


def _depths(vertices: NDArray[np.float64], faces: NDArray[np.int32], component: NDArray[np.int32]) -> NDArray[np.int64]:
    """Inside how many of the others is each component: by the ray along +x from the middle of one of its faces."""
    count = int(component.max()) + 1
    corners = vertices[faces]
    slack = 1e-12 * np.abs(corners).max()
    low, high = corners.min(axis=1) - slack, corners.max(axis=1) + slack
    depth = np.zeros(count, np.int64)
    for k, face in enumerate(np.unique(component, return_index=True)[1]):
        x = corners[face].mean(axis=0)
        near = (component != k) & (high[:, 0] >= x[0]) & ((low[:, 1:] <= x[1:]) & (high[:, 1:] >= x[1:])).all(axis=1)
        hit = np.flatnonzero(near)
        hit = hit[_crossed(vertices, faces[hit], faces[face])]
        depth[k] = (np.bincount(component[hit], minlength=count) % 2).sum()
    return depth


def _crossed(vertices: NDArray[np.float64], faces: NDArray[np.int32], start: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which faces the ray along +x from the middle of `start` runs through.

    The ray is moved by (eps, eps^2) in y and z, so that it meets no edge.
    """
    cloud = Cloud(vertices)
    middle = [np.full(len(faces), i) for i in start]

    def to_middle(base, spots, axis):
        # Three times as long as it is, so that nothing is divided.
        a, b, c = (s.x[axis] - base.x[axis] for s in spots)
        return a + b + c

    def turn_plane(a, b, *spots):
        y, z = (b.x[axis] - a.x[axis] for axis in (1, 2))
        return y * to_middle(a, spots, 2) - z * to_middle(a, spots, 1)

    def turn_space(a, b, c, *spots):
        rows = [[s.x[axis] - a.x[axis] for axis in range(3)] for s in (b, c)]
        return determinant([*rows, [to_middle(a, spots, axis) for axis in range(3)]])

    turns = []
    for i in range(3):
        a, b = faces[:, i], faces[:, (i + 1) % 3]
        turn = cloud.sign(turn_plane, a, b, *middle)
        y, z = (np.sign(vertices[b, axis] - vertices[a, axis]).astype(np.int8) for axis in (1, 2))
        turns.append(np.where(turn != 0, turn, np.where(z != 0, -z, y)))
    inside = (turns[0] == turns[1]) & (turns[1] == turns[2]) & (turns[0] != 0)
    # The normal's x has the sign of the turns; the ray starts before the face where it is on the other side of it.
    return inside & (cloud.sign(turn_space, *faces.T, *middle) == -turns[0])


def _sources(mesh: Mesh, points: NDArray[np.float64]) -> None:
    """Vertices that name an input row are at its place."""
    source = mesh.vertex_source
    bad = np.flatnonzero((source < -1) | (source >= len(points)))
    if len(bad):
        raise CertificateError(f"vertex {bad[0]} comes from row {source[bad[0]]} of {len(points)}")
    named = np.flatnonzero(source >= 0)
    bad = named[(mesh.vertices[named] != points[source[named]]).any(axis=1)]
    if len(bad):
        raise CertificateError(f"vertex {bad[0]} is not where input row {source[bad[0]]} is")
