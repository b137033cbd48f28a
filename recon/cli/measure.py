"""``recon measure``: a mesh against the truth, every metric with its unit and meaning."""

from __future__ import annotations

import json
import os
from typing import Any

import click

from .front import PATH, print_table, shared, surface_names


@click.command(
    short_help="Measure a mesh, alone or against the truth.",
    epilog="\b\nExamples:\n  recon measure mesh.ply\n  recon measure mesh.ply torus\n  recon measure mesh.ply truth.obj --json",
)
@click.argument("mesh", type=PATH)
@click.argument("reference", required=False, shell_complete=surface_names)
@click.option("--points", metavar="FILE", type=PATH, help="The input points: for the share of them that the mesh uses.")
@click.option(
    "--samples",
    type=click.IntRange(1, 10**9),
    default=100_000,
    show_default=True,
    help="Points taken on the mesh and on the reference.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@shared("from", "quiet", "json")
def measure(
    mesh: str,
    reference: str | None,
    points: str | None,
    samples: int,
    seed: int,
    source_format: str | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """Measure MESH: what it is and, with a REFERENCE, how far it is off.

    REFERENCE is the file of a mesh or of points, or an analytic surface of `recon sample --list`.
    """
    from ..io import read_mesh, read_points
    from ..metrics import measure as measure_mesh
    from .work import Progress

    measured = read_mesh(mesh, format=source_format)
    truth = None if reference is None else truth_of(reference)
    cloud = None if points is None else read_points(points)
    count = None if cloud is None else len(cloud)
    with Progress(quiet, {}) as progress:
        progress("metrics", 0.0)
        metrics = measure_mesh(measured, truth, points=count, samples=samples, seed=seed)
    print_metrics(metrics, as_json)


def print_metrics(metrics: list[Any], as_json: bool) -> None:
    """Print metrics as a table, or as a JSON list of name, unit and value."""
    if as_json:
        click.echo(json.dumps([{"name": m.name, "unit": m.unit, "value": m.value} for m in metrics], indent=1))
        return
    print_table([(m.name, _shown(m.value, m.unit), m.meaning) for m in metrics])


def truth_of(reference: str) -> Any:
    """Read a reference: a file where there is one, else an analytic surface."""
    from ..contracts import InvalidInput
    from ..io import read
    from ..mesh import Mesh
    from .sample import named_surface

    if reference != "-" and not os.path.exists(reference):
        if "/" in reference or "." in reference.partition(":")[0]:
            raise InvalidInput(f"{reference}: no such file")
        return named_surface(reference)
    content = read(reference)
    return content if isinstance(content, Mesh) else content.points


def _shown(value: float | int | bool | None, unit: str) -> str:
    if value is None:
        return "-"
    if unit == "yes/no":
        return "yes" if value else "no"
    if unit == "count":
        return f"{value:,}"
    return f"{value:.6g}" + ("" if unit == "1" else f" {unit}")
