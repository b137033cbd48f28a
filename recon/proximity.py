"""Questions to a triangle mesh in space: how far, which face, inside or out, and points spread evenly over its area."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ._kernels import distance as kernels
from .boxes import box_tree, morton
from .contracts import DegenerateInput
from .threads import workers

_CHUNK = 1 << 14  # queries a task; fixed, so that the number of threads changes nothing


class FaceQueries:
    """Nearest faces and winding numbers of a mesh with one face or more, in double precision at any scale and offset.

    Parameters
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.integer]):
        self._frame = Frame(vertices[faces.ravel()])
        corners = self._frame.into(vertices)[faces]
        tree = box_tree(corners)
        self._order = tree.order
        self._place = np.argsort(tree.order)
        self._corners = np.ascontiguousarray(corners[tree.order].reshape(-1, 9))
        self._tree = (tree.start, tree.lower, tree.upper)

    def nearest(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
        """Find the closest point of the mesh to each point.

        Parameters
        ----------
        points : (m, 3) ndarray of float64 [L]

        Returns
        -------
        distance : (m,) ndarray of float64 [L]
        face : (m,) ndarray of int64
            A nearest face; of several one, always the same.
        foot : (m, 3) ndarray of float64 [L]
        """
        local = self._frame.into(points)
        place = np.empty(len(points), np.int64)
        squared = np.empty(len(points))
        step = np.empty((len(points), 3))

        def task(rows: NDArray[np.int64]) -> None:
            out = np.empty(len(rows), np.int64), np.empty(len(rows)), np.empty((len(rows), 3))
            kernels.nearest(local[rows], self._corners, *self._tree, *out)
            place[rows], squared[rows], step[rows] = out

        _run(task, local)
        return self._frame.length(np.sqrt(squared)), self._order[place], points + self._frame.length(step)

    def winding(self, points: NDArray[np.float64], skip: NDArray[np.integer] | None = None) -> NDArray[np.int64]:
        """Give the winding number of a closed oriented mesh around each point: 0 outside, 1 inside.

        Parameters
        ----------
        points : (m, 3) ndarray of float64 [L]
        skip : (m,) ndarray of int, optional
            A face for each point that is not there for it.

        Returns
        -------
        (m,) ndarray of int64
        """
        local = self._frame.into(points)
        result = np.empty(len(points), np.int64)
        absent = np.full(len(points), -1) if skip is None else self._place[skip]

        def task(rows: NDArray[np.int64]) -> None:
            out = np.empty(len(rows), np.int64)
            kernels.crossings(local[rows], absent[rows], self._corners, *self._tree, out)
            result[rows] = out

        _run(task, local)
        return result


class Frame:
    """Coordinates from the middle of the points, in units of a power of two near their extent: products stay in range."""

    def __init__(self, points: NDArray[np.float64]):
        low, high = points.min(axis=0), points.max(axis=0)
        self._middle = 0.5 * low + 0.5 * high
        self._exponent = int(np.frexp((high - low).max())[1])

    def into(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates [L] to this frame."""
        try:
            with np.errstate(over="raise"):
                return np.ldexp(points - self._middle, -self._exponent)
        except FloatingPointError as error:
            raise DegenerateInput("what is compared differs in size by more than 300 orders of magnitude") from error

    def length(self, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
        """Lengths in this frame to [L]."""
        return np.ldexp(lengths, self._exponent)

    def scale(self, power: int) -> float:
        """The unit of length, area (2) or volume (3) of this frame [L^power]."""
        return float(np.ldexp(1.0, power * self._exponent))


def area_vectors(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> NDArray[np.float64]:
    """Give the normal of each face, as long as its area.

    Parameters
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int

    Returns
    -------
    (f, 3) ndarray of float64 [L^2]
    """
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return 0.5 * np.cross(b - a, c - a)


def area_samples(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], n: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Spread points over a mesh, each standing for the same share of its area; none where it has no area.

    Parameters
    ----------
    vertices : (v, 3) ndarray of float64 [L]
    faces : (f, 3) ndarray of int
    n : int
    rng : numpy.random.Generator

    Returns
    -------
    points : (n, 3) ndarray of float64 [L]
    face : (n,) ndarray of int64
    """
    if len(faces) == 0:
        return np.zeros((0, 3)), np.zeros(0, np.int64)
    local = Frame(vertices[faces.ravel()]).into(vertices)
    area = np.linalg.norm(area_vectors(local, faces), axis=1)
    until = np.cumsum(area)
    if not until[-1] > 0:
        return np.zeros((0, 3)), np.zeros(0, np.int64)
    # Systematic: one point in each n-th of the area, so that no face gets more or less than its share by one point.
    at = (np.arange(n) + rng.random(n)) * (until[-1] / n)
    face = np.minimum(np.searchsorted(until, at, side="right"), np.flatnonzero(area)[-1])
    u, v = np.sqrt(rng.random(n)), rng.random(n)
    a, b, c = (vertices[faces[face, i]] for i in range(3))
    return a + (u * (1 - v))[:, None] * (b - a) + (u * v)[:, None] * (c - a), face


def _run(task: Callable[[NDArray[np.int64]], None], points: NDArray[np.float64]) -> None:
    """Do a task for all rows, in chunks of neighbours, on all processors."""
    if len(points) == 0:
        return
    order = np.argsort(morton(points), kind="stable")
    chunks = [order[i : i + _CHUNK] for i in range(0, len(order), _CHUNK)]
    if len(chunks) == 1:
        task(order)
        return
    with ThreadPoolExecutor(workers(None)) as pool:
        list(pool.map(task, chunks))
