"""More than piecewise linear: vertices inserted where the surface is curved."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from weighting import projection

from ..contracts import InvalidInput
from ..mesh import Mesh
from .adjacency import linked
from .embedding import give_way

TURN = 5.0  # degrees; a chord then lies a hundredth of its length off the surface
ROUNDS = 5  # of halving edges


def refine(mesh: Mesh, turn: float = TURN, *, threads: int | None = None) -> tuple[Mesh, int]:
    """Insert vertices on the local fit until the surface turns by no more than `turn` along any edge.

    The vertices there are stay. So do topology and orientation; the mesh runs into itself nowhere that it did not before.
    Sharp edges, and whatever else quadrics do not fit, stay as they are.

    Parameters
    ----------
    mesh : Mesh
    turn : float [degrees]
        Above 0.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    mesh : Mesh
        Inserted vertices come last, with source -1; attributes are those of the ends of the edge, averaged where they are
        floats or bytes, of the first end otherwise.
    inserted : int
        How many.

    Raises
    ------
    InvalidInput
        turn not above 0.

    Notes
    -----
    The normal at a vertex is that of a quadric through some 19 vertices that edges reach. An edge bulges by the
    cubic that leaves its ends at right angles to the normals (Vlachos et al. 2001). The ends each say a bulge of their own; of these
    the harmonic mean is taken, none where they disagree on the side (van Leer 1974), and of each only what stands out from the
    misfit of its quadric (as in the estimator of James & Stein 1961). So noise and creases bulge nothing. Edges are split in the middle,
    all their faces with them, and again, up to five times.

    Examples
    --------
    >>> import datasets_synthetic, recon
    >>> ball = datasets_synthetic.surface("sphere")
    >>> mesh = recon.reconstruct(ball.sample(1000, rng=0).points).mesh
    >>> fine, inserted = refine(mesh)
    >>> one, two = (np.abs(ball.distance(m.vertices[m.faces].mean(axis=1))).mean() for m in (mesh, fine))
    >>> inserted > 500, bool(two < one / 2)
    (True, True)
    """
    if not turn > 0:
        raise InvalidInput(f"turn: expected an angle above 0 degrees, got {turn}")
    if len(mesh.faces) == 0:
        return mesh, 0
    cloud, place = linked(mesh, threads)
    normal, misfit = (values[place] for values in projection.normals(cloud, threads))
    state = _State(mesh.vertices, mesh.vertices, normal, np.nan_to_num(misfit), mesh.faces.astype(np.int64))
    parents = []
    for _ in range(ROUNDS):
        state, ends = _halved(state, math.radians(turn))
        if len(ends) == 0:
            break
        parents.append(ends)
    inserted = len(state.after) - len(mesh.vertices)
    if inserted == 0:
        return mesh, 0
    attributes = dict(mesh.attributes)
    for ends in parents:
        attributes = {name: np.concatenate([values, _between(values[ends])]) for name, values in attributes.items()}
    source = np.concatenate([mesh.vertex_source, np.full(inserted, -1)])
    fine = Mesh.from_arrays(state.after, state.faces, source, attributes)
    return replace(fine, vertices=give_way(fine, state.before, state.after)), inserted


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """A mesh on its way: every vertex where it would lie on the flat faces, and where it lies on the fit."""

    before: NDArray[np.float64]
    after: NDArray[np.float64]
    normal: NDArray[np.float64]
    misfit: NDArray[np.float64]
    faces: NDArray[np.int64]


def _halved(state: _State, turn: float) -> tuple[_State, NDArray[np.int64]]:
    """Split the edges that turn too much; and the ends of those edges."""
    n, faces = len(state.after), state.faces
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key, edge = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_inverse=True)
    ends = np.stack(np.divmod(key, n), axis=1)
    a, b = state.after[ends[:, 0]], state.after[ends[:, 1]]
    chord = b - a
    length = np.linalg.norm(chord, axis=1)
    bulge = _bulge(state, ends, chord)
    split = np.linalg.norm(bulge, axis=1) > turn / 8.0 * length  # an arc that turns by t bulges by t / 8 of its chord
    number = np.full(len(key), -1)
    number[split] = n + np.arange(split.sum())
    ends, chord, bulge = ends[split], chord[split], bulge[split]
    if len(ends) == 0:
        return state, ends
    one, two = state.normal[ends[:, 0]], state.normal[ends[:, 1]]
    both = one + np.where((one * two).sum(axis=1) < 0, -1.0, 1.0)[:, None] * two
    both -= ((both * chord).sum(axis=1) / (chord * chord).sum(axis=1))[:, None] * chord  # across the arc's middle
    size = np.linalg.norm(both, axis=1, keepdims=True)
    after = np.concatenate([state.after, state.after[ends].mean(axis=1) + bulge])
    fresh = _State(
        np.concatenate([state.before, state.before[ends].mean(axis=1)]),
        after,
        np.concatenate([state.normal, np.divide(both, size, out=np.zeros_like(both), where=size > 0)]),
        np.concatenate([state.misfit, state.misfit[ends].mean(axis=1)]) / 4.0,  # as bulges do when edges are halved
        _split(faces, number[edge].reshape(-1, 3), after),
    )
    return fresh, ends


def _bulge(state: _State, ends: NDArray[np.int64], chord: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far the middle of each edge lies off its chord [L]."""
    said = []
    for side, sense in ((0, -1.0), (1, 1.0)):
        normal = state.normal[ends[:, side]]
        height = sense * (normal * chord).sum(axis=1) / 4.0
        known = np.divide(state.misfit[ends[:, side]], height, out=np.ones(len(ends)), where=height != 0) ** 2
        said.append((height * np.maximum(1.0 - known, 0.0))[:, None] * normal)
    one, two = said
    size_one, size_two = (np.linalg.norm(s, axis=1, keepdims=True) for s in said)
    both = size_one + size_two  # two that point apart cancel out
    return np.divide(one * size_two + two * size_one, both, out=np.zeros_like(one), where=both > 0)


def _split(faces: NDArray[np.int64], middle: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Faces cut at the middles of their edges k to k + 1, -1 where there is none: in two, three or four."""
    count = (middle >= 0).sum(axis=1)
    parts = [faces[count == 0]]
    # turned so that edge 0 is the split one of one, and edge 2 the whole one of two
    turn = np.where(count == 1, np.argmax(middle >= 0, axis=1), (np.argmax(middle < 0, axis=1) + 1) % 3)
    columns = (turn[:, None] + np.arange(3)) % 3
    (a, b, c), (m, p, q) = (np.take_along_axis(rows, columns, axis=1).T for rows in (faces, middle))
    for corners in ((a, m, c), (m, b, c)):
        parts.append(np.stack(corners, axis=1)[count == 1])
    across = np.linalg.norm(points[a] - points[p], axis=1) < np.linalg.norm(points[m] - points[c], axis=1)
    parts.append(np.stack((m, b, p), axis=1)[count == 2])
    for corners, which in (((a, m, p), across), ((a, p, c), across), ((a, m, c), ~across), ((m, p, c), ~across)):
        parts.append(np.stack(corners, axis=1)[(count == 2) & which])
    for corners in ((a, m, q), (m, b, p), (q, p, c), (m, p, q)):
        parts.append(np.stack(corners, axis=1)[count == 3])
    return np.concatenate(parts)


def _between(pairs: NDArray) -> NDArray:
    """Attributes halfway between two rows each, (m, 2, ...)."""
    if pairs.dtype.kind == "f":
        return pairs.mean(axis=1, dtype=pairs.dtype)
    if pairs.dtype == np.uint8:
        return np.round(pairs.mean(axis=1)).astype(np.uint8)
    return pairs[:, 0]
