"""How good is a mesh: every measure by name, unit and value. The definitions are in docs/metrics.md and in `MEANING`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contracts import InvalidInput, as_floats, as_points, as_whole, check_kind, shown
from .intersections import intersecting_chunks, zero_area
from .mesh import Mesh
from .proximity import FaceQueries, Frame, area_samples, area_vectors
from .references import Reference, as_reference, enclosed_volume
from .topology import Topology, patches, topology

THRESHOLDS = (0.001, 0.0025, 0.005, 0.01)
_MOST_SAMPLES = 10**9

MEANING = {
    "to_reference_mean": "mean distance from the mesh to the reference (accuracy)",
    "to_reference_rms": "root mean square distance from the mesh to the reference",
    "to_reference_p95": "95 % of the mesh is closer to the reference than this",
    "to_reference_p99": "99 % of the mesh is closer to the reference than this",
    "to_reference_max": "largest distance from the mesh to the reference, among the samples",
    "from_reference_mean": "mean distance from the reference to the mesh (completeness)",
    "from_reference_rms": "root mean square distance from the reference to the mesh",
    "from_reference_p95": "95 % of the reference is closer to the mesh than this",
    "from_reference_p99": "99 % of the reference is closer to the mesh than this",
    "from_reference_max": "largest distance from the reference to the mesh, among the samples",
    "chamfer": "mean of to_reference_mean and from_reference_mean",
    "hausdorff": "larger of to_reference_max and from_reference_max",
    "bias": "mean signed distance from the mesh to a closed reference, positive outside it",
    "normal_angle_mean": "mean angle between the normals of mesh and reference, sides ignored",
    "normal_angle_p95": "95 % of the angles between the normals are smaller than this",
    "normal_consistency": "mean of |cos| of that angle, over both directions",
    "normal_same_side": "share of the mesh whose normal is on the reference's side; if that is open, on the better of its sides",
    "precision": "share of the mesh closer to the reference than this share of its bounding box diagonal",
    "recall": "share of the reference closer to the mesh than this share of its bounding box diagonal",
    "f_score": "harmonic mean of precision and recall at this share of the reference's bounding box diagonal",
    "area": "area of the mesh",
    "area_error": "(area of the mesh - area of the reference) / area of the reference",
    "volume": "volume that the closed oriented mesh encloses",
    "volume_error": "(volume of the mesh - volume of the reference) / volume of the reference",
    "iou": "volume of the intersection of both solids over that of their union",
    "iou_standard_error": "standard error of iou, which is estimated from random points",
    "vertices": "vertices in use",
    "edges": "distinct edges",
    "faces": "faces, degenerate ones left out",
    "euler": "Euler characteristic: vertices - edges + faces",
    "euler_error": "euler - that of the reference",
    "genus": "handles, of a closed orientable manifold, summed over its components",
    "components": "connected pieces",
    "components_error": "components - those of the reference",
    "boundary_loops": "closed chains of open edges",
    "boundary_loops_error": "boundary_loops - those of the reference",
    "open_edges": "edges of one face",
    "nonmanifold_edges": "edges of three faces or more",
    "nonmanifold_vertices": "vertices whose faces form several umbrellas",
    "degenerate_faces": "faces that name a vertex twice",
    "duplicate_faces": "faces on the vertices of an earlier face",
    "zero_area_faces": "faces without area, degenerate ones included",
    "self_intersections": "pairs of faces that meet in more than a common vertex or edge",
    "closed": "every edge has an even number of faces",
    "manifold": "no non-manifold edge or vertex",
    "orientable": "the faces can be turned to agree along every edge of two faces",
    "oriented": "the faces agree along every edge of two faces",
    "outward": "each component of a closed oriented mesh has the outside in front of it and the inside behind",
    "points_used": "share of the input points that are vertices in use",
}


@dataclass(frozen=True, slots=True)
class Metric:
    """One measure.

    Attributes
    ----------
    name : str
        A key of `MEANING`; precision, recall and f_score carry their threshold: ``f_score@0.005``.
    unit : str
        "L", "L^2", "L^3" (of the input's unit of length), "deg", "1" (a share or ratio), "count" or "yes/no".
    value : float, int, bool or None
        None where the measure has no meaning: the volume of an open mesh, the normals of a cloud.
    """

    name: str
    unit: str
    value: float | int | bool | None

    @property
    def meaning(self) -> str:
        """One line that says what is measured."""
        return MEANING[self.name.partition("@")[0]]


def measure(
    mesh: Mesh,
    surface_or_reference: Any = None,
    *,
    points: int | ArrayLike | None = None,
    samples: int = 100_000,
    thresholds: Sequence[float] = THRESHOLDS,
    seed: int = 0,
) -> list[Metric]:
    """Measure a mesh, alone and against the truth.

    Distances are taken from points spread evenly over the area of the mesh (never from its vertices) and back from points
    spread evenly over the reference, to the faces of the mesh exactly.

    Parameters
    ----------
    mesh : Mesh
    surface_or_reference : datasets_synthetic.Surface, Mesh or (m, 3) array_like of float [L], optional
        Without it only what the mesh tells of itself.
    points : int or (n, d) array_like, optional
        The input points, or how many they were: for the share of them that is used.
    samples : int
        Points on the mesh, on the reference, and in space for the IoU.
    thresholds : sequence of float
        Shares of the diagonal of the reference's bounding box at which precision, recall and F-score are taken.
    seed : int
        Of the sampling: the same seed gives the same values.

    Returns
    -------
    list of Metric
        Always the same names in the same order for the same arguments; a value is None where it has no meaning.

    Raises
    ------
    InvalidInput
        Not a mesh, no reference of a known kind, or senseless numbers.

    Notes
    -----
    Definitions: Berger et al. (2013), Huang et al. (2022), Sulzer et al. (2023); see docs/metrics.md.

    Examples
    --------
    >>> import numpy as np, recon
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = recon.Mesh.from_arrays(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> value = {m.name: m.value for m in recon.measure(mesh)}
    >>> value["euler"], value["closed"], value["outward"], round(value["volume"], 6)
    (2, True, True, 0.166667)
    """
    check_kind(mesh, "mesh", Mesh, "a recon.Mesh")
    samples, seed = as_whole(samples, "samples", 1, _MOST_SAMPLES), as_whole(seed, "seed", 0)
    shares = as_floats(thresholds, "thresholds")
    if shares.ndim != 1 or not (shares > 0).all():
        raise InvalidInput(f"thresholds: expected positive shares of the diagonal, got {shown(thresholds)}")
    n = None if points is None else _count(points)
    reference = None if surface_or_reference is None else as_reference(surface_or_reference)
    own = _Measured(mesh)
    metrics = list(_alone(own, n))
    if reference is not None:
        metrics += _against(own, reference, samples, tuple(shares.tolist()), seed)
    return metrics


def _count(points: int | ArrayLike) -> int:
    """How many the input points are, given them or their number."""
    alone = not isinstance(points, (list, tuple)) and np.ndim(points) == 0
    return as_whole(points, "points", 1) if alone else len(as_points(points))


class _Measured:
    """The mesh, with what several measures need."""

    def __init__(self, mesh: Mesh):
        self.mesh = mesh
        self.shape: Topology = topology(mesh.faces)
        self.empty = len(mesh.faces) == 0
        self.solid = self.shape.closed and self.shape.oriented
        self.queries = None if self.empty else FaceQueries(mesh.vertices, mesh.faces)
        self.volume = enclosed_volume(mesh) if self.solid else None
        self.area, self.normals = 0.0, np.zeros((0, 3))
        if not self.empty:
            frame = Frame(mesh.vertices[mesh.faces.ravel()])
            self.vectors = area_vectors(frame.into(mesh.vertices), mesh.faces)
            length = np.linalg.norm(self.vectors, axis=1, keepdims=True)
            self.normals = np.divide(self.vectors, length, out=np.zeros_like(self.vectors), where=length > 0)
            self.area = float(length.sum()) * frame.scale(2)


def _alone(own: _Measured, n: int | None) -> Iterator[Metric]:
    """What a mesh tells of itself."""
    mesh, shape = own.mesh, own.shape
    yield Metric("area", "L^2", own.area)
    yield Metric("volume", "L^3", own.volume)
    for name in ("vertices", "edges", "faces", "euler", "genus", "components", "boundary_loops"):
        yield Metric(name, "count", getattr(shape, name))
    for name in ("open_edges", "nonmanifold_edges", "nonmanifold_vertices", "degenerate_faces", "duplicate_faces"):
        yield Metric(name, "count", getattr(shape, name))
    yield Metric("zero_area_faces", "count", int(zero_area(mesh.vertices, mesh.faces).sum()))
    yield Metric("self_intersections", "count", sum(map(len, intersecting_chunks(mesh.vertices, mesh.faces))))
    for name in ("closed", "manifold", "orientable", "oriented"):
        yield Metric(name, "yes/no", getattr(shape, name))
    yield Metric("outward", "yes/no", _outward(own))
    if n is not None:
        source = mesh.vertex_source[np.unique(mesh.faces)]
        used = np.unique(source[source >= 0])
        if len(used) and used[-1] >= n:
            raise InvalidInput(f"points: {n} input points, but a vertex comes from row {used[-1]}")
        yield Metric("points_used", "1", len(used) / n)


def _outward(own: _Measured) -> bool | None:
    """On each patch: winding number 0 in front of the face that looks most along x, 1 behind it."""
    if not own.solid or own.queries is None:
        return None
    mesh = own.mesh
    patch = patches(mesh.faces)
    along = np.abs(own.vectors[:, 0])
    order = np.lexsort((-along, patch))
    order = order[patch[order] >= 0]
    face = order[np.flatnonzero(np.diff(patch[order], prepend=-1))]
    if not (along[face] > 0).all():
        return False
    middle = mesh.vertices[mesh.faces[face]].mean(axis=1)
    beyond = own.queries.winding(middle, skip=face)
    # The ray along +x starts in front of a face that looks to +x, and behind one that looks to -x.
    front = beyond - (own.vectors[face, 0] < 0)
    return bool((front == 0).all())


def _against(
    own: _Measured, reference: Reference, samples: int, thresholds: tuple[float, ...], seed: int
) -> Iterator[Metric]:
    """What it takes a truth to tell."""
    rng = np.random.default_rng(seed)
    here, face = area_samples(own.mesh.vertices, own.mesh.faces, samples, rng)
    there, there_normals = reference.sample(samples, rng)
    # Without area there is nothing to sample: no distance, and nothing is found near anything.
    signed, normals = reference.nearest(here) if len(here) else (np.zeros(0), None)
    back, back_face = own.queries.nearest(there)[:2] if len(here) and own.queries else (np.zeros(0), np.zeros(0, int))
    to, back_normals = np.abs(signed), own.normals[back_face]
    yield from _distances("to_reference", to)
    yield from _distances("from_reference", back)
    known = len(to) > 0 and len(back) > 0
    yield Metric("chamfer", "L", float(0.5 * to.mean() + 0.5 * back.mean()) if known else None)
    yield Metric("hausdorff", "L", float(max(to.max(), back.max())) if known else None)
    yield Metric("bias", "L", float(signed.mean()) if known and reference.closed else None)
    yield from _normals(own.normals[face], normals, back_normals, there_normals, reference)
    diagonal = float(np.linalg.norm(reference.bounds[1] - reference.bounds[0]))
    for threshold in thresholds:
        precision = float((to <= threshold * diagonal).mean()) if known else 0.0
        recall = float((back <= threshold * diagonal).mean()) if known else 0.0
        total = precision + recall
        yield Metric(f"precision@{threshold:g}", "1", precision)
        yield Metric(f"recall@{threshold:g}", "1", recall)
        yield Metric(f"f_score@{threshold:g}", "1", 2 * precision * recall / total if total else 0.0)
    yield Metric("area_error", "1", _relative(own.area, reference.area))
    yield Metric("volume_error", "1", _relative(own.volume, reference.volume))
    yield from _iou(own, reference, samples, rng)
    for name in ("euler", "components", "boundary_loops"):
        truth = getattr(reference, name)
        yield Metric(f"{name}_error", "count", None if truth is None else getattr(own.shape, name) - truth)


def _distances(prefix: str, distance: NDArray[np.float64]) -> Iterator[Metric]:
    """Mean, RMS, percentiles and maximum of one direction."""
    if len(distance) == 0:
        values: list[float | None] = [None] * 5
    else:
        largest = float(distance.max())
        rms = largest * float(np.sqrt(np.mean((distance / largest) ** 2))) if largest > 0 else 0.0
        values = [float(distance.mean()), rms, *map(float, np.percentile(distance, (95, 99))), largest]
    for name, value in zip(("mean", "rms", "p95", "p99", "max"), values):
        yield Metric(f"{prefix}_{name}", "L", value)


def _normals(
    here: NDArray[np.float64],
    at_reference: NDArray[np.float64] | None,
    at_mesh: NDArray[np.float64],
    there: NDArray[np.float64] | None,
    reference: Reference,
) -> Iterator[Metric]:
    """Angles between normals: of mesh samples to the reference, and for the consistency back as well."""
    if at_reference is None or there is None or len(at_mesh) == 0:
        mean = p95 = consistency = same = None
    else:
        cosine = np.einsum("ij,ij->i", here, at_reference)
        sine = np.linalg.norm(np.cross(here, at_reference), axis=1)
        angle = np.degrees(np.arctan2(sine, np.abs(cosine)))
        mean, p95 = float(angle.mean()), float(np.percentile(angle, 95))
        back = np.einsum("ij,ij->i", at_mesh, there)
        consistency = float(0.5 * np.abs(cosine).mean() + 0.5 * np.abs(back).mean())
        same = float((cosine > 0).mean()) if reference.orientable else None
        if same is not None and not reference.closed:
            same = max(same, float((cosine < 0).mean()))
    yield Metric("normal_angle_mean", "deg", mean)
    yield Metric("normal_angle_p95", "deg", p95)
    yield Metric("normal_consistency", "1", consistency)
    yield Metric("normal_same_side", "1", same)


def _relative(value: float | None, truth: float | None) -> float | None:
    return None if value is None or not truth else (value - truth) / truth


def _iou(own: _Measured, reference: Reference, samples: int, rng: np.random.Generator) -> Iterator[Metric]:
    """Intersection over union of the solids, by random points in a box around both."""
    iou = error = None
    if own.solid and own.queries is not None and reference.closed:
        used = own.mesh.vertices[own.mesh.faces.ravel()]
        low = np.minimum(used.min(axis=0), reference.bounds[0])
        high = np.maximum(used.max(axis=0), reference.bounds[1])
        x = low + (high - low) * rng.random((samples, 3))
        mine, true = own.queries.winding(x) != 0, reference.contains(x)
        union = int((mine | true).sum())
        if union:
            iou = int((mine & true).sum()) / union
            error = float(np.sqrt(iou * (1 - iou) / union))
    yield Metric("iou", "1", iou)
    yield Metric("iou_standard_error", "1", error)
