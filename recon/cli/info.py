"""``recon info``: what a file holds."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from .front import BUG, PATH, complain, exit_code, expanded, print_table, shared

if TYPE_CHECKING:
    from ..io import PointCloud
    from ..mesh import Mesh
    from .survey import Survey

_SURFACES = {
    "closed": "looks closed",
    "open": "looks open: it has a rim",
    "planar": "planar: all points lie in one plane",
    "unclear": "cannot be told",
}


@click.command(
    short_help="Say what a file holds.",
    epilog="\b\nExamples:\n  recon info scan.ply\n  recon info scan.xyz mesh.obj --json",
)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=PATH)
@shared("drop", "from", "threads", "quiet", "json")
def info(
    files: tuple[str, ...],
    drop_invalid: bool,
    source_format: str | None,
    threads: int | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """Say what each FILE holds: size, bounds, spacing, noise, outliers, duplicates, likely closed or open."""
    from ..contracts import ReconError
    from ..io import read
    from ..io.files import display_name
    from ..mesh import Mesh
    from .survey import survey
    from .work import Progress

    names, found, failed = expanded(files), [], 0
    for number, file in enumerate(names):
        try:
            content = read(file, format=source_format, drop_invalid=drop_invalid)
        except ReconError as error:
            if len(names) == 1:
                raise
            complain(str(error))  # the other files are none the worse for it
            failed = failed or exit_code(error) or BUG
            continue
        points = content.vertices if isinstance(content, Mesh) else content.points
        with Progress(quiet, {}) as progress:
            progress(display_name(file), 0.0)
            figures = survey(points, threads)
        if as_json:
            found.append(_as_json(file, content, figures))
            continue
        if number:
            click.echo()
        print_table(_as_text(file, content, figures))
    if as_json:
        click.echo(json.dumps(found[0] if len(names) == 1 else found, indent=1))
    if failed:
        click.get_current_context().exit(failed)


def _as_text(file: str, content: Mesh | PointCloud, figures: Survey) -> list[tuple[str, ...]]:
    carried = ", ".join(f"{key} ({value.dtype.name}{_width(value)})" for key, value in content.attributes.items())
    faces, dropped = len(getattr(content, "faces", ())), getattr(content, "dropped", 0)
    rows: list[tuple[str, ...]] = [
        ("file", file),
        ("points", f"{figures.points:,} in {len(figures.lower)}-D" + (f", {faces:,} faces" if faces else "")),
        ("attributes", carried or "none"),
    ]
    if dropped:
        rows.append(("dropped", f"{dropped:,} rows with NaN or infinite coordinates"))
    rows += [
        (axis, f"{low:.10g} .. {high:.10g}  ({high - low:.4g})")
        for axis, low, high in zip("xyz", figures.lower.tolist(), figures.upper.tolist())
    ]
    rows += [("diagonal", f"{figures.diagonal:.6g}"), ("duplicates", f"{figures.duplicates:,}")]
    if figures.spacing is None or figures.spacing_p5 is None or figures.spacing_p95 is None:
        return [*rows, ("spacing", "too few distinct points to tell"), *_span(figures)]
    rows += [
        ("spacing", f"{figures.spacing:.4g}  (90 % between {figures.spacing_p5:.4g} and {figures.spacing_p95:.4g})"),
        ("density", f"spacing varies {figures.density_ratio:.3g}-fold"),
        ("outliers", f"{figures.outliers:.2%} of the points"),
    ]
    if figures.noise is not None:
        rows.append(("noise", f"{figures.noise:.3g}  ({figures.noise / figures.spacing:.2g} spacings)"))
    rows += [("surface", _SURFACES[figures.surface]), *_span(figures)]
    return [row for row in rows if row[1]]


def _span(figures: Survey) -> list[tuple[str, ...]]:
    flat = {0: "all points are equal", 1: "all points lie on a line"}
    return [("degenerate", flat[figures.span])] if figures.span in flat else []


def _as_json(file: str, content: Mesh | PointCloud, figures: Survey) -> dict[str, Any]:
    from dataclasses import asdict

    values = {key: value.tolist() if hasattr(value, "tolist") else value for key, value in asdict(figures).items()}
    attributes = {key: value.dtype.name + _width(value) for key, value in content.attributes.items()}
    return {
        "file": file,
        "dimension": len(figures.lower),
        "faces": len(getattr(content, "faces", ())),
        "attributes": attributes,
        "dropped": getattr(content, "dropped", 0),
        **values,
    }


def _width(value: Any) -> str:
    return "".join(f" x {n}" for n in value.shape[1:])
