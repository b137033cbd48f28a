"""The page of ``recon reconstruct --report``: what was done, how well, and the mesh to look at."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import pipeline
from ..contracts import DegenerateInput, InvalidInput, as_points, check_kind
from ..contracts import shown as short
from ..mesh import Mesh
from ..metrics import Metric, measure
from ..pipeline import Progress, Reconstruction
from ..proximity import FaceQueries, area_samples
from ..references import as_reference
from ..report import doubt, figures_table, shown
from .charts import histogram
from .document import document, resource, viewer
from .raster import as_url, picture
from .scene import Colour, Scene
from .view import colours_of

_SAMPLES = 50_000
_PLAIN, _DOUBTFUL = (200, 200, 200), (220, 30, 30)  # red, green, blue
_COMPARED = (
    "vertices", "faces", "euler", "components", "open_edges", "nonmanifold_edges", "self_intersections", "points_used",
    "to_reference_mean", "to_reference_max", "from_reference_max", "area", "volume",
)  # fmt: skip
_VIEWS = {"from the front": (0.5, 0.4, 1.0), "from behind": (-0.5, 0.4, -1.0)}
_FLAT_VIEWS = {"from the front": (0.45, -1.0, 0.75), "from behind": (-0.45, 1.0, 0.75)}


def report_page(
    result: Reconstruction,
    points: ArrayLike,
    *,
    title: str = "point cloud",
    options: Mapping[str, Any] | None = None,
    reference: Any = None,
    progress: Progress | None = None,
) -> str:
    """Write a page about a reconstruction: one file, for any browser, without network.

    The points are reconstructed again with the weights that were not asked for, adaptive or uniform, to compare.

    Parameters
    ----------
    result : Reconstruction
    points : (n, 3) array_like of float [L]
        What it was made from; the colours of a `PointCloud` are shown.
    title : str
        What was reconstructed.
    options : mapping, optional
        Of `recon.reconstruct`, but for weights and attributes: those that `result` was made with.
    reference : datasets_synthetic.Surface, Mesh or (m, 3) array_like of float [L], optional
        The truth to measure against; by default the input points.
    progress : callable (stage, fraction), optional

    Returns
    -------
    str
        HTML.

    Raises
    ------
    InvalidInput
        Malformed points, or something of another kind.
    """
    check_kind(result, "result", Reconstruction, "what recon.reconstruct gives")
    check_kind(title, "title", str, "text")
    check_kind(options, "options", (Mapping, type(None)), "names and values in a dict")
    if not (progress is None or callable(progress)):
        raise InvalidInput(f"progress: expected a function of stage and fraction, got {short(progress)}")
    said = progress if progress is not None else lambda stage, fraction: None
    located, mesh, kind = as_points(points, 3), result.mesh, str(result.report["weights"]["kind"])
    truth = located if reference is None else reference
    said("metrics", 0.0)
    measured = {kind: _measured(mesh, truth, located)}
    said("comparison", 0.3)
    others = {name: _again(located, name, options or {}) for name in ("adaptive", "uniform") if name != kind}
    for name, other in others.items():
        if isinstance(other, Reconstruction):
            measured[name] = _measured(other.mesh, truth, located)
    said("page", 0.8)
    body = "\n".join(
        [
            f"<header><h1>{escape(title)}</h1><p>{_lead(result)}</p></header>",
            _pictures(located, mesh),
            "<section><h2>To look at</h2>"
            "<p>Drag to turn, right drag to shift, wheel to come nearer; the keys are listed under ?.</p></section>",
            viewer(embedded=True),
            f"<section><h2>What was done</h2>{result.report.to_html()}</section>",
            _quality(measured[kind], mesh, located, truth, reference is not None),
            _comparison({kind: result, **others}, measured, located),
            "<footer><p>L is the unit of length of the input. Made by weighted-alpha-recon; the view uses three.js, MIT licence."
            "</p></footer>",
        ]
    )
    scene = Scene.of(located, mesh)
    colours = colours_of(scene, result.weights, mesh, reference, getattr(points, "attributes", {}))
    facts, arrays = scene.parts(colours + _doubtful(result, scene))
    facts["note"] = None if len(mesh.faces) else "The mesh has no faces."
    return document(title, f'<main class="report">{body}</main>', facts, arrays, resource("report.css"))


def _lead(result: Reconstruction) -> str:
    """Say the result in a sentence."""
    figures, mesh = result.report["input"], result.report["mesh"]
    pieces = "one piece" if mesh["components"] == 1 else f"{mesh['components']:,} pieces"
    if mesh["open_edges"]:
        rim = f"{mesh['boundary_loops']:,} boundary loop{'s' * (mesh['boundary_loops'] != 1)}"
    else:
        rim = "no open edge" + (f", genus {mesh['genus']:,}" if mesh["genus"] is not None else "")
    flaws = mesh["nonmanifold_edges"] + mesh["nonmanifold_vertices"]
    whole = "manifold" if not flaws else f"{flaws:,} non-manifold edges and vertices"
    named = {"complex": "The literal boundary of the complex", "open": "An open surface", "terrain": "A terrain"}
    kind = named.get(result.surface, f"A {result.surface} surface")
    number = len(result.thin_loops)
    thin = f" {doubt(number)}: colour by “doubtful handles” to see where." if number else ""
    return escape(
        f"{kind} of {mesh['faces']:,} triangles in {pieces} through {shown(100.0 * mesh['share_of_points_used'])} % of "
        f"{figures['points']:,} points: {rim}, {whole}.{thin}"
    )


def _doubtful(result: Reconstruction, scene: Scene) -> list[Colour]:
    """Give the samples around thin handles to colour by, if there are any."""
    if not result.thin_loops:
        return []
    colours = np.full((len(result.weights), 3), _PLAIN, np.uint8)
    colours[np.concatenate(result.thin_loops)] = _DOUBTFUL
    return [Colour("doubtful", "doubtful handles", "", "the samples around thin handles in red", scene.on_all(colours))]


def _measured(mesh: Mesh, truth: Any, points: NDArray[np.float64]) -> list[Metric]:
    return measure(mesh, truth, points=len(points), samples=_SAMPLES)


def _again(points: NDArray[np.float64], weights: str, options: Mapping[str, Any]) -> Reconstruction | str:
    """Reconstruct with other weights; or say why that gives nothing."""
    try:
        return pipeline.reconstruct(points, weights, **options)  # type: ignore[arg-type]
    except DegenerateInput as error:
        return str(error)


def _views(points: NDArray[np.float64]) -> tuple[dict[str, tuple[float, float, float]], tuple[float, float, float]]:
    """Give directions to look from, and what is up, as in scene.js: flat things lie, planes are seen from above."""
    extent = np.ptp(points, axis=0)
    if extent[2] < 1e-5 * extent.max():
        return {"from above": (0.0, 0.0, 1.0)}, (0.0, 1.0, 0.0)
    flat = extent[2] == extent.min() and extent[2] < 0.45 * extent.max()
    return (_FLAT_VIEWS, (0.0, 0.0, 1.0)) if flat else (_VIEWS, (0.0, 1.0, 0.0))


def _figure(png: bytes, caption: str) -> str:
    return (
        f'<figure><img src="{as_url(png)}" alt="{escape(caption)}"><figcaption>{escape(caption)}</figcaption></figure>'
    )


def _pictures(points: NDArray[np.float64], mesh: Mesh) -> str:
    views, up = _views(points)
    shots = [_figure(picture(points, None, next(iter(views.values())), up), "the points")]
    if len(mesh.faces):
        shots += [
            _figure(picture(mesh.vertices, mesh.faces, towards, up), f"the mesh, {name}")
            for name, towards in views.items()
        ]
    return f'<section class="pictures">{"".join(shots)}</section>'


def _value(metric: Metric) -> str:
    return "–" if metric.value is None else shown(metric.value)


def _quality(metrics: list[Metric], mesh: Mesh, points: NDArray[np.float64], truth: Any, known: bool) -> str:
    """Distances as histograms, and every metric."""
    against = "the reference" if known else "the input points, as no truth was given"
    rows = [(m.name.replace("_", " "), _value(m), "" if m.unit == "1" else m.unit, m.meaning) for m in metrics]
    charts = _histograms(mesh, points, truth, "the reference" if known else "the nearest input point")
    return f"<section><h2>How good it is</h2><p>Measured against {against}.</p>{charts}{figures_table(rows)}</section>"


def _histograms(mesh: Mesh, points: NDArray[np.float64], truth: Any, what: str) -> str:
    """How far the mesh is from the truth, and the points from the mesh."""
    samples = area_samples(mesh.vertices, mesh.faces, _SAMPLES, np.random.default_rng(0))[0]
    if not len(samples):
        return ""
    away = as_reference(truth).nearest(samples)[0]
    marks = {"mean": float(away.mean()), "95 %": float(np.percentile(away, 95))}
    to_mesh = FaceQueries(mesh.vertices, mesh.faces).nearest(points)[0]
    rest = to_mesh[to_mesh > 0]
    charts = histogram(away, f"distance of the mesh from {what} [L]", marks)
    charts += f"<p>{len(points) - len(rest):,} of {len(points):,} points lie on the mesh exactly.</p>"
    if len(rest):
        label = f"distance of the other {len(rest):,} from the mesh [L]"
        charts += histogram(rest, label, {"mean": float(rest.mean())})
    return charts


def _comparison(
    results: dict[str, Reconstruction | str], measured: dict[str, list[Metric]], points: NDArray[np.float64]
) -> str:
    """The same points with other weights, side by side; where there is nothing to measure, why."""
    views, up = _views(points)
    names = list(results)
    heads = [f"{name} weights{' (this mesh)' if name == names[0] else ''}" for name in names]
    shots = []
    for head, result in zip(heads, results.values()):
        if isinstance(result, str):
            shots.append(f"<figure><p>{escape(result)}</p><figcaption>{escape(head)}</figcaption></figure>")
        elif len(result.mesh.faces):
            shots.append(
                _figure(picture(result.mesh.vertices, result.mesh.faces, next(iter(views.values())), up), head)
            )
    table = {name: {m.name: m for m in metrics} for name, metrics in measured.items()}
    kinds = ("none" if isinstance(result, str) else result.surface for result in results.values())
    rows = [("surface", *kinds, "")]
    for key in _COMPARED:
        cells = [_value(table[name][key]) if name in table else "–" for name in names]
        unit = table[names[0]][key].unit
        rows.append((key.replace("_", " "), *cells, "" if unit == "1" else unit))
    head_row = "".join(f"<th>{escape(text)}</th>" for text in ("", *heads, "unit"))
    lines = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>\n" for row in rows)
    return (
        "<section><h2>Adaptive and uniform weights</h2><p>The same points and options, other weights: adaptive balls follow the "
        "local spacing, uniform ones are all alike.</p>"
        f'<div class="pictures">{"".join(shots)}</div><table class="compared"><tr>{head_row}</tr>\n{lines}</table></section>'
    )
