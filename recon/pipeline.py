"""The main job, top to bottom: points -> samples -> weights -> triangulation -> surface -> clean -> report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

import weighting

from .contracts import (
    MAX_WEIGHT,
    DegenerateInput,
    InvalidInput,
    as_flag,
    as_number,
    as_points,
    as_weights,
    check_kind,
    shown,
)
from .mesh import Mesh, compact_mesh
from .postprocess import remove_islands, split_pinches
from .regular import RegularTriangulation, regular_triangulation
from .report import Report
from .samples import Samples, clean_samples
from .surface import Surface, label_surface
from .terrain import from_above, upward
from .threads import workers
from .topology import Topology, topology

if TYPE_CHECKING:
    import meshio  # type: ignore[import-untyped]
    import open3d  # type: ignore[import-untyped]
    import pymeshlab  # type: ignore[import-untyped]
    import pyvista
    import trimesh

Progress = Callable[[str, float], None]
BESIDE = 1 / 8  # share of the samples beside a closed surface from which on it is read as a sheet


@dataclass(frozen=True, slots=True, eq=False)
class Reconstruction:
    """A mesh and everything it was made from; the mesh goes to other libraries from here too.

    Attributes
    ----------
    mesh : Mesh
        `mesh.vertex_source` names the input row of every vertex.
    weights : (n,) ndarray of float64 [L^2]
        alpha included: the surface is that of W_0.
    triangulation : RegularTriangulation
        Of a terrain that of its plan, all heights 0.
    surface : {"closed", "open", "planar", "terrain", "complex"}
    confidence : float
        Of the choice between closed, open and terrain, 0 to 1; 1 where the caller made it.
    report : Report
    thin_loops : tuple of (k,) ndarray of int64
        Where the topology of a closed surface is doubtful, as input rows: `recon.surface.Surface`.
    """

    mesh: Mesh
    weights: NDArray[np.float64]
    triangulation: RegularTriangulation
    surface: str
    confidence: float
    report: Report
    thin_loops: tuple[NDArray[np.int64], ...] = ()

    def __repr__(self) -> str:
        used = f"{self.report['mesh']['share_of_points_used']:.2%} of {self.report['input']['points']:,} points used"
        return f"Reconstruction({self.surface}, chi {self.report['mesh']['chi']}, {used}, {self.mesh!r})"

    def _repr_html_(self) -> str:
        from .notebook import reconstruction_html

        return reconstruction_html(self)

    def to_trimesh(self) -> trimesh.Trimesh:
        """Give the mesh as `Mesh.to_trimesh` does."""
        return self.mesh.to_trimesh()

    def to_pyvista(self) -> pyvista.PolyData:
        """Give the mesh as `Mesh.to_pyvista` does."""
        return self.mesh.to_pyvista()

    def to_meshio(self) -> meshio.Mesh:
        """Give the mesh as `Mesh.to_meshio` does."""
        return self.mesh.to_meshio()

    def to_open3d(self, *, tensor: bool = False) -> open3d.geometry.TriangleMesh | open3d.t.geometry.TriangleMesh:
        """Give the mesh as `Mesh.to_open3d` does."""
        return self.mesh.to_open3d(tensor=tensor)

    def to_pymeshlab(self) -> pymeshlab.Mesh:
        """Give the mesh as `Mesh.to_pymeshlab` does."""
        return self.mesh.to_pymeshlab()


def reconstruct(
    points: ArrayLike,
    weights: Literal["adaptive", "uniform"] | ArrayLike = "adaptive",
    *,
    alpha: float = 0.0,
    surface: Literal["auto", "closed", "open", "terrain", "complex"] = "auto",
    attributes: Mapping[str, ArrayLike] | None = None,
    clean: bool = True,
    denoise: bool | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Reconstruction:
    """Turn a raw point cloud into a triangle mesh.

    Parameters
    ----------
    points : (n, 3) array_like of float [L]
        No normals needed. Duplicates count once.
    weights : "adaptive", "uniform" or (n,) array_like of float [L^2]
        Adaptive: squared local spacing. Uniform: the squared median of it, the same for all.
    alpha : float [L^2]
        Added to all weights: W_alpha(S) = W_0(S + alpha) (paper, 2.2).
    surface : {"auto", "closed", "open", "terrain", "complex"}
        See `recon.surface.label_surface`; "open" leaves openings open: the walls that close them, which no samples vouch for, are
        no part of the surface; "terrain" triangulates the plan (x, y) and lifts it to the heights z; "complex" is the literal
        boundary of W_alpha, regular and singular facets. Auto and open give sheets, too, where more than an eighth of the
        samples would lie beside the closed surface, once it is clean.
    attributes : mapping of str to (n, ...) array_like, optional
        Carried over to the vertices of the mesh; those of a `PointCloud` by default.
    clean : bool
        Split vertices and edges where the surface touches itself, so that it is a manifold; remove pieces no deeper than
        their faces are wide, `recon.postprocess.remove_islands`.
    denoise : bool, optional
        Move the samples to the local surface first: `recon.postprocess.denoise`. By default where they are noisy, by a
        twentieth of the spacing or more: `weighting.scatter`. Samples that are certainly none of the surface are
        removed, `weighting.certain_outliers`, unless False. The report says what was moved and removed.
    threads : int, optional
        All by default. The result does not depend on it.
    progress : callable (stage, fraction), optional
        Called at the start of every stage; what it raises stops the work.

    Returns
    -------
    Reconstruction

    Raises
    ------
    InvalidInput
        Malformed points, weights or attributes, or an unknown option.
    DegenerateInput
        Fewer than 4 points, all in one spot, or all on a line; or nothing of the surface is left.

    Examples
    --------
    >>> import datasets_synthetic
    >>> cloud = datasets_synthetic.surface("torus").sample(2000, rng=0)
    >>> result = reconstruct(cloud.points)
    >>> result.surface, result.report["mesh"]["chi"], result.report["mesh"]["open_edges"]
    ('closed', 0, 0)
    """
    if denoise is not None:
        denoise = as_flag(denoise, "denoise", "None (where there is noise), True or False")
    clean = as_flag(clean, "clean")
    if not isinstance(surface, str) or surface not in ("auto", "closed", "open", "terrain", "complex"):
        raise InvalidInput(f"surface: expected 'auto', 'closed', 'open', 'terrain' or 'complex', got {shown(surface)}")
    alpha = as_number(alpha, "alpha", "a finite number [L^2]")
    if not abs(alpha) <= MAX_WEIGHT:
        raise InvalidInput(f"alpha: expected a finite number [L^2], up to {MAX_WEIGHT:g}, got {alpha}")
    if progress is not None and not callable(progress):
        raise InvalidInput(f"progress: expected a function of stage and fraction, got {shown(progress)}")
    workers(threads)  # refuses what is no number of threads
    clock = _Clock(progress)

    clock.start("samples")
    given = as_points(points, 3)
    if len(given) < 4:
        raise DegenerateInput(f"points: a surface needs at least 4, got {len(given)}")
    carried = _as_attributes(getattr(points, "attributes", None) if attributes is None else attributes, len(given))
    samples = clean_samples(given, denoise, threads)
    located = samples.points
    ground = from_above(samples, threads) if surface == "terrain" else samples

    clock.start("weights")
    spacing, w = _weighed(ground, weights, alpha)

    clock.start("triangulation")
    triangulation = regular_triangulation(ground.points, w, threads=threads)

    clock.start("surface")
    if surface == "complex":
        found = _literal(triangulation)
    elif surface == "terrain":
        found = _lifted(triangulation, spacing, "asked for", 1.0, threads)
    else:
        apart = weighting.line_spacing(ground.hood, threads=threads)
        found = label_surface(triangulation, spacing, surface, apart=apart, threads=threads)
        if found.kind == "terrain":
            ground = from_above(samples, threads)
            spacing, w = _weighed(ground, weights, alpha)
            triangulation = regular_triangulation(ground.points, w, threads=threads)
            found = _lifted(triangulation, spacing, found.reason, found.confidence, threads)
    if len(found.faces) == 0:
        raise DegenerateInput(_nothing_left(found, triangulation, alpha))

    clock.start("clean")
    mesh, shape, copies, islands = _cleaned(located, found, carried, clean, threads)
    beside = 1 - np.count_nonzero(np.bincount(mesh.vertex_source)) / len(samples.hood.points)
    if surface in ("auto", "open") and found.walls is not None and beside > BESIDE:
        found = label_surface(triangulation, spacing, "sheets", apart=apart, threads=threads)
        if surface == "auto":
            reason = f"{beside:.0%} of the samples would lie beside the closed surface"
            found = replace(found, reason=reason, confidence=min((beside - BESIDE) / (0.5 - BESIDE), 1.0))
        mesh, shape, copies, islands = _cleaned(located, found, carried, clean, threads)
    if found.kind == "open" and shape.closed:  # the pieces with a boundary were removed
        found = replace(found, kind="closed")

    clock.start("report")
    sections = _figures(samples, spacing, w, weights, triangulation, found, mesh, shape, copies, islands)
    seconds = clock.stop()
    report = Report({**sections, "seconds": seconds})
    return Reconstruction(mesh, w, triangulation, found.kind, found.confidence, report, found.thin_loops)


def _cleaned(
    located: NDArray[np.float64], found: Surface, carried: dict[str, NDArray], clean: bool, threads: int | None
) -> tuple[Mesh, Topology, int, int]:
    """The mesh of a surface, what it is, and how many vertices were copied and pieces removed."""
    mesh = compact_mesh(located, found.faces, carried)
    shape, copies, islands = topology(mesh.faces, threads=threads), 0, 0
    if clean and not shape.manifold:
        mesh, copies = split_pinches(mesh)
    if clean and found.kind != "complex" and (copies or shape.components > 1):
        mesh, islands = remove_islands(mesh)
    if copies or islands:
        shape = topology(mesh.faces, threads=threads)
    return mesh, shape, copies, islands


def _weighed(samples: Samples, weights: Any, alpha: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Local spacing and weights."""
    spacing = weighting.spacing(samples.hood)
    if not spacing.any():
        raise DegenerateInput("points: all lie in one spot; a surface needs points that span a plane or more")
    return spacing, samples.below_others(_weigh(weights, samples.hood, spacing) + alpha)


def _weigh(weights: Any, hood: weighting.Neighborhood, spacing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights by name or as given."""
    if isinstance(weights, str):
        if weights == "adaptive":
            return weighting.adaptive_weights(hood)
        if weights == "uniform":
            return np.full(len(spacing), np.median(spacing) ** 2)
        raise InvalidInput(f"weights: expected 'adaptive', 'uniform' or one number a point, got {weights!r}")
    return as_weights(weights, len(spacing))


def _as_attributes(attributes: Mapping[str, ArrayLike] | None, n: int) -> dict[str, NDArray]:
    """One row a point."""
    check_kind(attributes, "attributes", (Mapping, type(None)), "names and arrays in a dict")
    carried = {name: np.asarray(value) for name, value in (attributes or {}).items()}
    for name, value in carried.items():
        if value.shape[:1] != (n,):
            raise InvalidInput(f"attribute {name!r}: expected {n} rows, got shape {value.shape}")
    return carried


def _literal(triangulation: RegularTriangulation) -> Surface:
    """The boundary of W_0: regular and singular facets, nothing else."""
    from .alpha import alpha_complex

    if triangulation.dimension < 3:
        raise DegenerateInput("surface='complex': the points span less than 3 dimensions; use 'auto'")
    boundary = alpha_complex(triangulation).boundary(0.0)
    bridged = np.zeros(len(boundary.facets), bool)
    used = len(np.unique(boundary.facets))
    buried = len(triangulation.points) - len(triangulation.hidden) - used
    return Surface(boundary.facets, bridged, "complex", 1.0, "asked for", buried, 0, 0)


def _lifted(
    plan: RegularTriangulation, spacing: NDArray[np.float64], reason: str, confidence: float, threads: int | None
) -> Surface:
    """The region that a plan covers, seen from above."""
    if plan.dimension < 2:
        raise DegenerateInput("surface='terrain': seen from above all points lie on a line; z must point up")
    # Where flights overlap samples are dense, and gaps as wide as elsewhere.
    found = label_surface(plan, np.maximum(spacing, np.median(spacing)), threads=threads)
    return replace(found, faces=upward(plan.points, found.faces), kind="terrain", reason=reason, confidence=confidence)


def _nothing_left(found: Surface, triangulation: RegularTriangulation, alpha: float) -> str:
    """Why the surface is empty, and what would help."""
    if found.kind == "complex":
        from .alpha import alpha_complex

        family = alpha_complex(triangulation)
        first, best = alpha + family.entry(2).min(), family.choices()[0]
        return (
            f"the boundary of W_alpha has no facet at alpha = {alpha:g}: the first one appears at {first:.4g}; useful are "
            f"{alpha + best.start:.4g} to {alpha + best.stop:.4g}, say {alpha + best.alpha:.4g}; or use surface='auto'"
        )
    return f"no facet between two sides was found ({found.reason}); are these points samples of a surface?"


def _figures(
    samples: Samples,
    spacing: NDArray[np.float64],
    w: NDArray[np.float64],
    asked: Any,
    triangulation: RegularTriangulation,
    found: Surface,
    mesh: Mesh,
    t: Topology,
    copies: int,
    islands: int,
) -> dict[str, dict[str, Any]]:
    """All counts of the report but the times."""
    duplicates = samples.duplicates
    kept = len(samples.hood.rows)
    used = np.zeros(len(samples.points), bool)
    used[mesh.vertex_source] = True
    return {
        "input": {"points": len(samples.points), "duplicates": duplicates},
        "samples": samples.figures,
        "weights": {
            "kind": asked if isinstance(asked, str) else "given",
            "least": float(w.min()),
            "greatest": float(w.max()),
            "median_spacing": float(np.median(spacing)),
        },
        "triangulation": {
            "cells": len(triangulation.cells),
            "hidden_points": len(triangulation.hidden) - (len(samples.points) - kept),
        },
        "surface": {
            "kind": found.kind,
            "confidence": found.confidence,
            "because": found.reason,
            "facets_of_W0": int((~found.bridged).sum()),
            "bridged": int(found.bridged.sum()),
            "buried_points": found.buried,
            "walls": found.walls,
            "thin_loops": len(found.thin_loops),
            "leaks": found.leaks,
            "flipped_edges": found.flipped_edges,
        },
        "mesh": {
            "vertices": t.vertices,
            "faces": t.faces,
            "chi": t.euler,
            "genus": t.genus,
            "components": t.components,
            "open_edges": t.open_edges,
            "boundary_loops": t.boundary_loops,
            "nonmanifold_edges": t.nonmanifold_edges,
            "nonmanifold_vertices": t.nonmanifold_vertices,
            "oriented": t.oriented,
            "split_vertices": copies,
            "removed_islands": islands,
            "share_of_points_used": int(used.sum()) / kept,
        },
    }


class _Clock:
    """Seconds of every stage, and the caller's progress."""

    def __init__(self, progress: Progress | None):
        self.progress = progress
        self.stages = ["samples", "weights", "triangulation", "surface", "clean", "report"]
        self.at: list[tuple[str, float]] = []

    def start(self, stage: str) -> None:
        self.at.append((stage, time.perf_counter()))
        if self.progress is not None:
            self.progress(stage, self.stages.index(stage) / len(self.stages))

    def stop(self) -> dict[str, float]:
        end = time.perf_counter()
        if self.progress is not None:
            self.progress("done", 1.0)
        times = [*self.at, ("", end)]
        seconds = {stage: times[i + 1][1] - at for i, (stage, at) in enumerate(self.at)}
        return {**seconds, "total": end - self.at[0][1]}
