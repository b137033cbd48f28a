"""``recon reconstruct``: the main job, from a point cloud to a mesh."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

from .front import BUG, PATH, Alpha, complain, exit_code, expanded, shared

if TYPE_CHECKING:
    from ..io import PointCloud
    from ..report import Report

_EXAMPLES = """
\b
Examples:
  recon reconstruct scan.xyz mesh.ply
  recon reconstruct flight.las terrain.ply --surface terrain --report report.json
  recon reconstruct torus.xyz torus.ply --against torus --report report.html
  recon reconstruct protein.pdb mesh.ply --surface complex --weights radius
  recon reconstruct scans/*.ply meshes/ --to obj
  zcat scan.xyz.gz | recon reconstruct - - --to stl > mesh.stl
"""


@click.command(short_help="Make a mesh from points.", epilog=_EXAMPLES)
@click.argument("inputs", nargs=-1, required=True, metavar="IN...", type=PATH)
@click.argument("out", type=PATH)
@click.option(
    "--surface", type=click.Choice(["auto", "closed", "open", "terrain", "complex"]), default="auto", show_default=True,
    help="What the mesh is to be; open: openings are left open; terrain: heights z over x and y; complex: the literal boundary of the weighted alpha complex.",
)  # fmt: skip
@shared("weights")
@click.option("--alpha", type=Alpha(), default=0.0, show_default=True, help="Added to every weight: a squared length.")
@click.option(
    "--denoise/--no-denoise", default=None,
    help="Move the points to the local surface first, or never; by default where they are noisy.",
)  # fmt: skip
@click.option("--refine", is_flag=True, help="Insert vertices on the local fit where the surface is curved.")
@click.option("--no-clean", is_flag=True, help="Leave the mesh as the complex gives it.")
@shared("drop")
@click.option(
    "--report", metavar="FILE", type=PATH, help="Write the report, too: FILE.json, or FILE.html, a page to look at."
)
@shared("against", "threads", "from", "to", "quiet", "json")
def reconstruct(
    inputs: tuple[str, ...],
    out: str,
    report: str | None,
    against: str | None,
    source_format: str | None,
    target_format: str | None,
    quiet: bool,
    as_json: bool,
    drop_invalid: bool,
    **options: Any,
) -> None:
    """Make a mesh OUT from the points of IN.

    IN may be PLY, XYZ, CSV, PTS, PWN, OFF, OBJ, STL, GLB, PCD, NPY, NPZ or LAS; of a mesh the vertices are taken. OUT is
    PLY (everything kept, double precision), OBJ, OFF, STL or GLB. With several inputs OUT is a folder.
    """
    from ..contracts import ReconError
    from ..io import formats
    from .measure import truth_of

    pairs = _pairs(expanded(inputs), out, target_format)
    for source, target in pairs:
        formats.writer_for(target, target_format, formats.MESH_WRITERS)
        _refuse_same(source, target)
    if report is not None:
        _check_report(report, len(pairs))
    truth = None if against is None else truth_of(against)
    failed = 0
    for source, target in pairs:
        try:
            result, told, cloud = _run(
                source, target, source_format, target_format, drop_invalid, truth, quiet, options
            )
        except ReconError as error:
            if len(pairs) == 1:
                raise
            complain(str(error))  # the other files are none the worse for it
            failed = failed or exit_code(error) or BUG
            continue
        if report is not None:
            _write_report(report, result, told, cloud, source, truth, options, quiet)
        if not quiet and len(pairs) > 1 and not as_json:
            click.echo(f"{source} -> {target}")
        if as_json or not quiet:
            click.echo(told.to_json() if as_json else str(told), err=target == "-")
    if failed:
        click.get_current_context().exit(failed)


def _run(
    source: str,
    target: str,
    source_format: str | None,
    target_format: str | None,
    drop_invalid: bool,
    truth: Any,
    quiet: bool,
    options: dict[str, Any],
) -> tuple[Any, Report, PointCloud]:
    """Read, reconstruct, write; give what to tell of it, too."""
    from dataclasses import replace

    from ..contracts import InvalidInput, ReconError
    from ..io import read_points, write_mesh
    from ..pipeline import reconstruct as reconstruct_surface
    from .remarks import remarks
    from .weights import from_option
    from .work import Progress, note_memory

    cloud = read_points(source, format=source_format, drop_invalid=drop_invalid)
    if cloud.dropped and not quiet:
        complain(f"{source}: dropped {cloud.dropped:,} of {len(cloud) + cloud.dropped:,} rows: NaN or infinite")
    if len(cloud) and cloud.points.shape[1] == 2:
        raise InvalidInput(f"{source}: has points x y without z; a surface needs x y z")
    note_memory(source, len(cloud), quiet)
    weights = from_option(options["weights"], cloud, source)
    try:
        with Progress(quiet) as progress:
            result = reconstruct_surface(
                cloud.points,
                weights,
                alpha=options["alpha"],
                surface=options["surface"],
                attributes=cloud.attributes,
                clean=not options["no_clean"],
                denoise=options["denoise"],
                threads=options["threads"],
                progress=progress,
            )
            if options["refine"]:
                progress("refine", 0.95)
                result = _refined(result, options["threads"])
            told = result.report
            if truth is not None:
                progress("metrics", 0.97)
                told = _compared(result, truth, len(cloud))
    except ReconError as error:
        error.args = (f"{source}: {error}",)
        raise
    mesh = result.mesh
    if not quiet:
        for remark in remarks(result, options["surface"], options["alpha"]):
            complain(f"{source}: {remark}")
    if cloud.dropped:  # back to the rows of the file
        rows = mesh.vertex_source
        mesh = replace(mesh, vertex_source=_file_rows(rows, cloud))
    lost = write_mesh(mesh, target, format=target_format)
    if lost and not quiet:
        complain(f"{target}: this format cannot hold {', '.join(lost)}; PLY can")
    return result, told, cloud


def _refined(result: Any, threads: int | None) -> Any:
    """The same with a finer mesh, and that said in its report."""
    from dataclasses import replace

    from ..postprocess import refine
    from ..report import Report

    mesh, inserted = refine(result.mesh, threads=threads)
    told = {"inserted_vertices": inserted, "faces": len(mesh.faces)}
    return replace(result, mesh=mesh, report=Report({**result.report.sections, "refined": told}))


def _compared(result: Any, truth: Any, points: int) -> Report:
    """The report with every metric against the truth."""
    from ..metrics import measure
    from ..report import Report

    measured = {metric.name: metric.value for metric in measure(result.mesh, truth, points=points)}
    return Report({**result.report.sections, "measured": measured})


def _file_rows(rows: Any, cloud: PointCloud) -> Any:
    import numpy as np

    return np.where(rows >= 0, cloud.rows[np.maximum(rows, 0)], rows)


def _pairs(inputs: list[str], out: str, target_format: str | None) -> list[tuple[str, str]]:
    """Give each input its output: the file named, or one of the same name in the folder named."""
    is_folder = out != "-" and (os.path.isdir(out) or out.endswith(("/", os.sep)))
    if not is_folder:
        if len(inputs) > 1:
            raise click.UsageError(
                f"{len(inputs)} inputs need a folder to write to; {out} is none (end it with / to make one)"
            )
        return [(inputs[0], out)]
    extension = target_format or "ply"
    stems = ["stdin" if path == "-" else os.path.splitext(os.path.basename(path))[0] for path in inputs]
    twice = sorted({stem for stem in stems if stems.count(stem) > 1})
    if twice:
        raise click.UsageError(f"two inputs would both be written to {os.path.join(out, twice[0])}.{extension}")
    os.makedirs(out, exist_ok=True)
    return [(path, os.path.join(out, f"{stem}.{extension}")) for path, stem in zip(inputs, stems)]


def _refuse_same(source: str, target: str) -> None:
    if (
        "-" not in (source, target)
        and os.path.exists(source)
        and os.path.exists(target)
        and os.path.samefile(source, target)
    ):
        raise click.UsageError(f"{target}: is the input; name another output")


def _check_report(report: str, count: int) -> None:
    """Refuse a report that could not be written, before the work."""
    from ..io import check_writable

    if count > 1:
        raise click.UsageError("--report takes one input")
    if os.path.splitext(report)[1].lower() not in (".json", ".html"):
        raise click.UsageError(f"--report: {report} should end in .json or .html")
    check_writable(report)


def _write_report(
    path: str,
    result: Any,
    told: Report,
    cloud: PointCloud,
    source: str,
    truth: Any,
    options: dict[str, Any],
    quiet: bool,
) -> None:
    from ..io.files import whole_file
    from .work import Progress

    text = told.to_json() + "\n"
    if path.lower().endswith(".html"):
        from ..page import report_page

        kept = {key: value for key, value in options.items() if key not in ("weights", "no_clean", "refine")}
        kept |= {"clean": not options["no_clean"], "denoise": options["denoise"]}
        title = "standard input" if source == "-" else os.path.basename(source)
        with Progress(quiet) as progress:
            text = report_page(result, cloud, title=title, options=kept, reference=truth, progress=progress)
    with whole_file(path) as file:
        file.write(text.encode())
