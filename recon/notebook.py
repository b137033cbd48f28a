"""What a notebook shows of a mesh and of a reconstruction: a small picture beside the figures that matter, no script."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING

from .page.raster import as_url, picture
from .topology import topology

if TYPE_CHECKING:
    from .mesh import Mesh
    from .pipeline import Reconstruction

_DRAWN = 500_000  # faces; more are not drawn, as that would take seconds


def mesh_html(mesh: Mesh) -> str:
    """Give the markup of a mesh."""
    return _card(mesh, {"vertices": f"{len(mesh.vertices):,}", "faces": f"{len(mesh.faces):,}", **_kind(mesh)})


def reconstruction_html(result: Reconstruction) -> str:
    """Give the markup of a reconstruction."""
    mesh, report = result.mesh, result.report
    return _card(
        mesh,
        {
            "surface": f"{result.surface}, because {report['surface']['because']}",
            "points used": f"{report['mesh']['share_of_points_used']:.2%} of {report['input']['points']:,}",
            "faces": f"{len(mesh.faces):,}",
            **_kind(mesh),
            "seconds": f"{report['seconds']['total']:.3g}",
        },
    )


def _kind(mesh: Mesh) -> dict[str, str]:
    """Topology and attributes in words."""
    found = topology(mesh.faces)
    closed = "closed" if found.closed else f"{found.boundary_loops:,} boundary loops"
    manifold = "manifold" if found.manifold else "not manifold"
    pieces = f"{found.components:,} " + ("piece" if found.components == 1 else "pieces")
    return {
        "topology": f"{closed}, {manifold}, {pieces}, χ {found.euler:,}",
        "attributes": ", ".join(sorted(mesh.attributes)) or "none",
    }


def _card(mesh: Mesh, rows: Mapping[str, str]) -> str:
    cells = "".join(
        f'<tr><td style="text-align:left;opacity:.65">{escape(name)}</td><td style="text-align:left">{escape(text)}</td></tr>'
        for name, text in rows.items()
    )
    image = ""
    if 0 < len(mesh.faces) <= _DRAWN:
        url = as_url(picture(mesh.vertices, mesh.faces, (2.0, -3.0, 2.0), (0.0, 0.0, 1.0), (240, 180)))
        image = f'<img src="{url}" width="240" height="180" alt="">'
    return f'<div style="display:flex;gap:1em;align-items:center">{image}<table>{cells}</table></div>'
