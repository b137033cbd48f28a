"""``recon view``: a page on which alpha sweeps through all shapes of a cloud."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import click

from .front import PATH, Alpha, shared

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..io import PointCloud
    from ..mesh import Mesh
    from .work import Progress

_EXAMPLES = """
\b
Examples:
  recon view scan.ply -o view.html
  recon view scan.ply -o view.html --against truth.obj
  recon view torus.xyz -o view.html --against torus
  recon view atoms.pdb -o view.html --weights radius
"""


@click.command(short_help="Make a page to look at a cloud and all its shapes.", epilog=_EXAMPLES)
@click.argument("cloud", type=PATH)
@click.option(
    "-o", "--out", required=True, metavar="FILE", type=PATH, help="The page to write, HTML; - for standard output."
)
@shared("against", "weights")
@click.option("--alpha", type=Alpha(), help="Where to begin; by default at the alpha that is recommended.")
@shared("drop", "from", "threads", "quiet")
def view(
    cloud: str,
    out: str,
    against: str | None,
    weights: str,
    alpha: float | None,
    drop_invalid: bool,
    source_format: str | None,
    threads: int | None,
    quiet: bool,
) -> None:
    """Make a page to look at CLOUD and the whole family of its alpha shapes: one file, for any browser, without network.

    A slider sweeps alpha; facets are coloured by what they are to the shape. The mesh of the cloud can be shown as
    well: that of `recon reconstruct`, or that of the file if it has faces.
    """
    from ..io import check_writable
    from ..io.files import whole_file
    from ..page import view_page
    from .measure import truth_of
    from .weights import from_option, resolve
    from .work import Progress, mesh_and, note_memory

    check_writable(out)
    truth = None if against is None else truth_of(against)
    content, mesh = _read(cloud, source_format, drop_invalid)
    note_memory(cloud, len(content), quiet, "page")
    given = from_option(weights, content, cloud)
    shown, reason = mesh, None
    wanted = mesh is None and weights != "radius" and content.points.shape[1] == 3  # atoms are no samples of a surface
    with Progress(quiet, mesh_and("all alphas", 0.7) if wanted else {}) as progress:
        if wanted:
            shown, reason = _reconstructed(content, given, threads, progress)
        progress("all alphas", 0.0)
        page = view_page(
            content.points,
            resolve(given, content, threads),
            mesh=shown,
            reference=truth,
            alpha=alpha,
            attributes=content.attributes,
            title=_title(cloud),
            note=reason,
        ).encode()
    with whole_file(out) as file:
        file.write(page)
    if not quiet and out != "-":
        click.echo(f"{out}: {len(content):,} points, {len(page) / 1e6:.1f} MB; open it in a browser")


def _title(path: str) -> str:
    return "standard input" if path == "-" else os.path.basename(path)


def _read(path: str, source_format: str | None, drop_invalid: bool) -> tuple[PointCloud, Mesh | None]:
    """Read points, and the mesh on them where the file has faces."""
    from dataclasses import replace

    import numpy as np

    from ..io import PointCloud, read
    from ..mesh import Mesh

    content = read(path, format=source_format, drop_invalid=drop_invalid)
    if not isinstance(content, Mesh):
        return content, None
    rows = np.arange(len(content.vertices))
    return PointCloud(content.vertices, content.attributes, rows), replace(content, vertex_source=rows)


def _reconstructed(
    cloud: PointCloud, weights: str | NDArray[np.float64], threads: int | None, progress: Progress
) -> tuple[Mesh | None, str | None]:
    """Make the mesh of a cloud that may have one; or say why there is none."""
    from ..contracts import DegenerateInput
    from ..pipeline import reconstruct

    try:
        result = reconstruct(cloud.points, weights, threads=threads, progress=progress)
    except DegenerateInput as error:
        return None, f"There is no mesh to show. {error}"
    return result.mesh, None
