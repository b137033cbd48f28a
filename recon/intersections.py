"""Which faces of a triangle mesh run into each other: decided exactly."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .boxes import box_tree, overlapping_pairs
from .exact import Cloud

_PLANES = ((1, 2), (2, 0), (0, 1))  # projections that keep the orientation of a face turned towards the dropped axis


def zero_area(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Say which faces have no area: a vertex twice, or all on a line, exactly.

    Parameters
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int

    Returns
    -------
    (f,) ndarray of bool
    """
    flat = np.ones(len(faces), bool)
    for axes in _PLANES:
        open_rows = np.flatnonzero(flat)
        cloud = Cloud(vertices, axes=axes)
        flat[open_rows] = cloud.sign(cloud.orient, *faces[open_rows].T) == 0
    return flat


def intersecting_faces(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> NDArray[np.int64]:
    """Find the pairs of faces that meet in more than a common vertex or edge.

    Vertices at the same place count as one. Faces without area are left out: see `zero_area`.

    Parameters
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int

    Returns
    -------
    (k, 2) ndarray of int64
        Rows of `faces`, each pair ascending, in lexicographic order.

    Notes
    -----
    Touching counts: a mesh without such pairs is a simplicial complex, embedded in space. Candidates come from a tree of
    boxes, signs from `recon.exact`; about 10 microseconds a face.
    """
    chunks = list(intersecting_chunks(vertices, faces))
    result = np.concatenate(chunks) if chunks else np.zeros((0, 2), np.int64)
    return result[np.lexsort(result.T[::-1])]


def intersecting_chunks(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> Iterator[NDArray[np.int64]]:
    """Find the same pairs bit by bit, in no order: for who only counts them, or stops at the first.

    Parameters
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int

    Yields
    ------
    (k, 2) ndarrays of int64
        With one row or more.
    """
    kept = np.flatnonzero(~zero_area(vertices, faces))
    if len(kept) < 2:
        return
    triangles = _welded(vertices)[faces[kept]]
    corners = vertices[triangles]
    pairs = _Pairs(vertices, triangles)
    low, high = corners.min(axis=1), corners.max(axis=1)
    for chunk in overlapping_pairs(box_tree(corners), low, high):
        found = chunk[pairs.improper(chunk)]
        if len(found):
            yield np.sort(kept[found], axis=1)


def _welded(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """For each vertex the first one at the same place."""
    order = np.lexsort(vertices.T)
    there = vertices[order]
    new = np.ones(len(order), bool)
    new[1:] = (there[1:] != there[:-1]).any(axis=1)
    first = np.minimum.reduceat(order, np.flatnonzero(new))
    result = np.empty(len(order), np.int64)
    result[order] = first[np.cumsum(new) - 1]
    return result


class _Pairs:
    """Exact tests of pairs of triangles with area."""

    def __init__(self, vertices: NDArray[np.float64], triangles: NDArray[np.int64]):
        self.vertices = vertices
        self.triangles = triangles
        self.space = Cloud(vertices)
        self.planes = [Cloud(vertices, axes=axes) for axes in _PLANES]

    def improper(self, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which pairs meet in more than what they share."""
        a, b = self.triangles[pairs[:, 0]], self.triangles[pairs[:, 1]]
        same = a[:, :, None] == b[:, None, :]
        shared = same.any(axis=2).sum(axis=1)
        result = shared == 3
        for count, test in ((0, self._apart), (1, self._at_vertex), (2, self._at_edge)):
            rows = np.flatnonzero(shared == count)
            if len(rows):
                result[rows] = test(
                    _common_first(a[rows], same[rows]), _common_first(b[rows], same[rows].swapaxes(1, 2))
                )
        return result

    def _apart(self, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        meet = self._may_meet(a, b, 0)
        for first, second in ((a, b), (b, a)):
            for i in range(3):
                rows = np.flatnonzero(meet < 0)
                hit = self._segment(first[rows, i], first[rows, (i + 1) % 3], second[rows])
                meet[rows[hit]] = 1
        return meet > 0

    def _at_vertex(self, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        # What the two share is convex and holds the common vertex: if more, it reaches an edge opposite to that.
        meet = self._may_meet(a, b, 1)
        for first, second in ((a, b), (b, a)):
            rows = np.flatnonzero(meet < 0)
            hit = self._segment(first[rows, 1], first[rows, 2], second[rows])
            meet[rows[hit]] = 1
        return meet > 0

    def _at_edge(self, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        # Only in one plane, and then on the same side of the edge, do they overlap.
        folded = self.space.sign(self.space.orient, *a.T, b[:, 2]) == 0
        rows = np.flatnonzero(folded)
        plane = self._plane(a[rows])
        here = self._turn(plane, a[rows, 0], a[rows, 1], a[rows, 2])
        folded[rows] = here == self._turn(plane, a[rows, 0], a[rows, 1], b[rows, 2])
        return folded

    def _may_meet(self, a: NDArray[np.int64], b: NDArray[np.int64], shared: int) -> NDArray[np.int8]:
        """0 where the corners of one, but for the first `shared`, are strictly on one side of the other, else -1."""
        open_ = np.full(len(a), -1, np.int8)
        for first, second in ((a, b), (b, a)):
            rows = np.flatnonzero(open_)
            total = np.zeros(len(rows), np.int8)
            for i in range(shared, 3):
                total += self.space.sign(self.space.orient, *first[rows].T, second[rows, i])
            open_[rows[np.abs(total) == 3 - shared]] = 0
        return open_

    def _segment(self, p: NDArray[np.int64], q: NDArray[np.int64], t: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Does the closed segment meet the closed triangle?"""
        orient = self.space.orient
        side_p, side_q = self.space.sign(orient, *t.T, p), self.space.sign(orient, *t.T, q)
        hit = side_p != side_q
        for sign in (side_p, side_q):
            hit |= sign == 0
        flat = np.flatnonzero((side_p == 0) & (side_q == 0))
        rows = np.flatnonzero(hit)
        sides = [self.space.sign(orient, p[rows], q[rows], t[rows, i], t[rows, (i + 1) % 3]) for i in range(3)]
        hit[rows] = (np.max(sides, axis=0) <= 0) | (np.min(sides, axis=0) >= 0)
        hit[flat] = self._segment_in_plane(p[flat], q[flat], t[flat])
        return hit

    def _segment_in_plane(self, p: NDArray[np.int64], q: NDArray[np.int64], t: NDArray[np.int64]) -> NDArray[np.bool_]:
        """The same, all in the triangle's plane: an end is inside, or an edge is crossed."""
        plane = self._plane(t)
        of_p = np.array([self._turn(plane, t[:, i], t[:, (i + 1) % 3], p) for i in range(3)])
        of_q = np.array([self._turn(plane, t[:, i], t[:, (i + 1) % 3], q) for i in range(3)])
        of_t = np.array([self._turn(plane, p, q, t[:, i]) for i in range(3)])
        hit = np.zeros(len(p), bool)
        for end in (of_p, of_q):
            hit |= (end.max(axis=0) <= 0) | (end.min(axis=0) >= 0)
        for i in range(3):
            # Both ends outside, so a segment along the line of an edge that meets it meets another one as well.
            across = of_t[i] * of_t[(i + 1) % 3] <= 0
            hit |= across & (of_p[i] * of_q[i] < 0)
        return hit

    def _plane(self, t: NDArray[np.int64]) -> NDArray[np.int64]:
        """A projection that keeps the area of each triangle."""
        plane = np.full(len(t), -1)
        for k, cloud in enumerate(self.planes):
            rows = np.flatnonzero(plane < 0)
            plane[rows[cloud.sign(cloud.orient, *t[rows].T) != 0]] = k
        return plane

    def _turn(self, plane: NDArray[np.int64], *corners: NDArray[np.int64]) -> NDArray[np.int8]:
        """Orientation of three spots, each row in its own projection."""
        result = np.zeros(len(plane), np.int8)
        for k, cloud in enumerate(self.planes):
            rows = np.flatnonzero(plane == k)
            result[rows] = cloud.sign(cloud.orient, *(c[rows] for c in corners))
        return result


def _common_first(triangles: NDArray[np.int64], same: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The corners of each triangle, those shared with the other one first and in the same order in both."""
    common = same.any(axis=2)
    key = np.where(common, triangles, np.iinfo(np.int64).max)
    return np.take_along_axis(triangles, np.argsort(key, axis=1, kind="stable"), axis=1)
