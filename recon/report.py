"""What a reconstruction did, in numbers: for people, for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

# Unit and meaning of every figure, by section and name; units as in `recon.metrics.Metric`, "s" for seconds.
MEANING = {
    "input.points": ("count", "rows read"),
    "input.duplicates": ("count", "rows that repeat an earlier one; they count once"),
    "samples.removed_outliers": ("count", "points that are certainly no samples of a surface; left out"),
    "samples.denoised": ("", "whether the samples were moved to the local surface"),
    "samples.noise": ("L", "standard deviation of the samples from a smooth surface, median"),
    "samples.noise_in_spacings": ("1", "the same in local spacings"),
    "samples.noisy_share": ("1", "share of the cloud where that is noise, not shape"),
    "samples.layered_share": ("1", "share of the cloud that looks as noisy, but lies in two sheets a spacing apart"),
    "samples.moved_points": ("count", "samples that were moved"),
    "samples.mean_move": ("L", "how far, in the mean"),
    "samples.greatest_move": ("L", "how far at most"),
    "weights.kind": ("", "adaptive: from the local spacing; uniform: the same for all; given: by the caller"),
    "weights.least": ("L^2", "least weight: squared radius of the smallest ball"),
    "weights.greatest": ("L^2", "greatest weight"),
    "weights.median_spacing": ("L", "median local distance between samples"),
    "triangulation.cells": ("count", "tetrahedra of the regular triangulation"),
    "triangulation.hidden_points": ("count", "points that are no vertex of it, as heavier ones hide them"),
    "surface.kind": ("", "how the cloud was read: closed, open, planar, terrain, or the literal complex"),
    "surface.confidence": ("1", "of the choice between closed, open and terrain; 1 where the caller made it"),
    "surface.because": ("", "why it was read so"),
    "surface.facets_of_W0": ("count", "facets that are faces of W_0, the weighted alpha shape"),
    "surface.bridged": ("count", "facets of positive size: they bridge a leak of W_0, or an edge was flipped there"),
    "surface.leaks": ("count", "facets that bridged a leak of W_0 before edges were flipped"),
    "surface.flipped_edges": ("count", "edges flipped so that the surface bends less"),
    "surface.buried_points": ("count", "vertices of the triangulation that are not on the surface"),
    "surface.walls": (
        "",
        "share of the area of the closed surface in walls, facets wider than those of a sheet: no samples vouch for them",
    ),
    "surface.thin_loops": (
        "count",
        "loops of at most 5 pi spacings around handles or through them: narrow bores, or gaps between samples",
    ),
    "mesh.vertices": ("count", "vertices in use"),
    "mesh.faces": ("count", "triangles"),
    "mesh.chi": ("count", "Euler characteristic: vertices - edges + faces"),
    "mesh.genus": ("count", "handles, where the mesh is closed"),
    "mesh.components": ("count", "connected pieces"),
    "mesh.open_edges": ("count", "edges of one face; 0 means closed"),
    "mesh.boundary_loops": ("count", "closed chains of open edges"),
    "mesh.nonmanifold_edges": ("count", "edges of three faces or more"),
    "mesh.nonmanifold_vertices": ("count", "vertices whose faces form several umbrellas"),
    "mesh.oriented": ("", "whether neighbouring faces agree on their front; a sheet with one side only cannot"),
    "mesh.split_vertices": ("count", "copies made where the surface touched itself"),
    "mesh.removed_islands": ("count", "pieces no deeper than their faces are wide; left out"),
    "mesh.share_of_points_used": ("1", "share of the distinct points that are vertices of the mesh"),
    "refined.inserted_vertices": ("count", "vertices on the local fit, inserted where the surface is curved"),
    "refined.faces": ("count", "triangles after that"),
    "seconds.samples": ("s", "time for neighbours, outliers and noise"),
    "seconds.weights": ("s", "time for spacing and weights"),
    "seconds.triangulation": ("s", "time for the regular triangulation"),
    "seconds.surface": ("s", "time for the sides and the facets between them"),
    "seconds.clean": ("s", "time for splitting and compacting"),
    "seconds.report": ("s", "time for these figures"),
    "seconds.total": ("s", "time for all of it"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """Figures of one reconstruction, by section.

    Attributes
    ----------
    sections : dict of str to dict of str to value
        "input", "weights", "triangulation", "surface", "mesh", "seconds"; squared lengths say so in their name.
    """

    sections: Mapping[str, Mapping[str, Any]]

    def __getitem__(self, section: str) -> Mapping[str, Any]:
        return self.sections[section]

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Give plain dictionaries."""
        return {name: dict(section) for name, section in self.sections.items()}

    def to_json(self) -> str:
        """Give JSON text, numbers in full."""
        return json.dumps(self.to_dict(), indent=2)

    def to_html(self) -> str:
        """Give tables for a page, a section each: name, value, unit and meaning of every figure."""
        return "\n".join(
            f"<h3>{escape(name)}</h3>\n{figures_table([_row(name, *item) for item in section.items()])}"
            for name, section in self.sections.items()
        )

    def __str__(self) -> str:
        width = max(len(key) for section in self.sections.values() for key in section)
        lines = []
        for name, section in self.sections.items():
            lines.append(name)
            lines += [f"  {key.replace('_', ' '):<{width}}  {shown(value)}" for key, value in section.items()]
        return "\n".join(lines)


def doubt(loops: int) -> str:
    """Say what so many thin loops mean."""
    number = "1 loop goes" if loops == 1 else f"{loops:,} loops go"
    return f"{number} around handles so thin that they may be gaps between samples"


def shown(value: Any) -> str:
    """Write a value for people: four digits for a float, thousands apart for a count."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return " ".join(shown(item) for item in value)
    return str(value)


def _row(section: str, key: str, value: Any) -> tuple[str, ...]:
    unit, meaning = MEANING.get(f"{section}.{key}", ("", ""))
    return key.replace("_", " "), shown(value), unit, meaning


def figures_table(rows: Sequence[tuple[str, ...]]) -> str:
    """Give markup of rows of name, value, unit and meaning."""
    kinds = ("name", "value", "unit", "meaning")
    body = "\n".join(
        "<tr>" + "".join(f'<td class="{kind}">{escape(cell)}</td>' for kind, cell in zip(kinds, row)) + "</tr>"
        for row in rows
    )
    return f'<table class="figures">\n{body}\n</table>'
