"""``recon check``: does a mesh keep what it promises."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from .front import GUARANTEE, PATH, complain, print_table, shared

if TYPE_CHECKING:
    from ..mesh import Mesh

_PROMISES = {
    "closed": "every edge has faces on both sides",
    "manifold": "no edge has more than two faces, no vertex is pinched",
    "oriented": "neighbouring faces agree on what is outside",
    "outward": "the faces of each closed piece look outward",
    "intersection-free": "no two faces meet but in common vertices and edges",
    "non-degenerate": "every face has an area, none is there twice",
}
_USUAL = ("manifold", "oriented", "intersection-free", "non-degenerate")


@click.command(
    short_help="Check the promises of a mesh, or of a reconstruction.",
    epilog="\b\nExamples:\n  recon check mesh.ply\n  recon check mesh.ply --require closed --require manifold\n  recon check scan.xyz",
)
@click.argument("file", type=PATH)
@click.option(
    "--require",
    "required",
    multiple=True,
    type=click.Choice(list(_PROMISES)),
    help=f"What must hold; by default {', '.join(_USUAL)}.",
)
@shared("drop", "from", "threads", "quiet", "json")
def check(
    file: str,
    required: tuple[str, ...],
    drop_invalid: bool,
    source_format: str | None,
    threads: int | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """Check the mesh in FILE; of a point cloud, check the reconstruction, exactly.

    Exit code 5 if something that is required does not hold.
    """
    from ..io import read
    from ..mesh import Mesh
    from .work import Progress, mesh_and, note_memory

    content = read(file, format=source_format, drop_invalid=drop_invalid)
    if isinstance(content, Mesh):
        mesh = content
    else:
        from ..certificates import certify
        from ..contracts import ReconError
        from ..pipeline import reconstruct

        note_memory(file, len(content), quiet, "family")  # about as much, measured
        try:
            with Progress(quiet, mesh_and("certificates", 0.8)) as progress:
                result = reconstruct(content, threads=threads, progress=progress)
                progress("certificates", 0.2)
                certify(result.triangulation)
                certify(result.mesh)
        except ReconError as error:
            error.args = (f"{file}: {error}",)
            raise
        mesh = result.mesh
    with Progress(quiet, {}) as progress:
        progress("promises", 0.0)
        held = _promises_held(mesh)
    asked = required or _USUAL
    broken = [name for name in asked if not held[name]]
    if as_json:
        click.echo(json.dumps({"file": file, "holds": held, "required": list(asked), "ok": not broken}, indent=1))
    elif not quiet:
        words = {True: "yes", False: "no", None: "-"}
        rows = [(name, "NO" if name in broken else words[holds], _PROMISES[name]) for name, holds in held.items()]
        print_table(rows)
    if broken:
        complain(f"{file}: not {', not '.join(broken)}")
        click.get_current_context().exit(GUARANTEE)


def _promises_held(mesh: Mesh) -> dict[str, bool | None]:
    from ..metrics import measure

    found = {metric.name: metric.value for metric in measure(mesh)}
    return {
        "closed": bool(found["closed"]),
        "manifold": bool(found["manifold"]),
        "oriented": bool(found["oriented"]),
        "outward": None if found["outward"] is None else bool(found["outward"]),
        "intersection-free": found["self_intersections"] == 0,
        "non-degenerate": found["zero_area_faces"] == 0 and found["duplicate_faces"] == 0,
    }
