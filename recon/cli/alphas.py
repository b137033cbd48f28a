"""``recon alphas``: at which alpha the shape of a cloud changes, and what it is between."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import click

from .front import print_table, shared

if TYPE_CHECKING:
    from ..alpha import AlphaComplex

_EXAMPLES = """
\b
Examples:
  recon alphas scan.xyz
  recon alphas scan.xyz --weights adaptive --voids 5
  recon alphas scan.xyz --at 0.0004 --at 0.01
"""


@click.command(short_help="List the critical values of alpha, and the shape between them.", epilog=_EXAMPLES)
@click.argument("file")
@shared("weights")
@click.option(
    "--at",
    "chosen",
    type=float,
    multiple=True,
    metavar="ALPHA",
    help="Describe the shape at this alpha; may be repeated.",
)
@click.option(
    "--steps", type=click.IntRange(min=2), default=12, show_default=True, help="Describe it at this many, without --at."
)
@click.option(
    "--voids",
    "shown",
    type=click.IntRange(min=0),
    default=8,
    show_default=True,
    help="How many voids to list, deepest first.",
)
@shared("drop", "from", "json")
def alphas(
    file: str,
    weights: str,
    chosen: tuple[float, ...],
    steps: int,
    shown: int,
    drop_invalid: bool,
    source_format: str | None,
    as_json: bool,
) -> None:
    """List at which values of alpha the shape of the points in FILE changes, and what it is between them.

    Alpha is a squared length; with uniform weights its root is the radius that other programs call alpha. A void is
    there from its birth, where it is sealed off, to its death, where it is filled: a surface worth having shows as a
    void with a death far above its birth.
    """
    from ..alpha import alpha_complex
    from ..io import read_points
    from .weights import resolve
    from .work import interruptible

    cloud = read_points(file, format=source_format, drop_invalid=drop_invalid)
    family = interruptible(lambda: alpha_complex(cloud.points, resolve(weights, cloud)))
    critical = family.spectrum()
    at = list(chosen) if chosen else _steps(critical, steps)
    states = [{"alpha": alpha, "betti": list(family.betti(alpha)), "facets": _facets(family, alpha)} for alpha in at]
    voids = family.voids()
    deepest = [{"birth": float(b), "death": float(d)} for b, d in zip(voids.birth[:shown], voids.death[:shown])]
    if as_json:
        found = {
            "file": file,
            "critical_values": len(critical),
            "voids": len(voids),
            "states": states,
            "deepest": deepest,
        }
        click.echo(json.dumps({**found, "lowest": float(critical[0]), "highest": float(critical[-1])}, indent=1))
        return
    click.echo(
        f"{file}: {len(cloud):,} points, {len(critical):,} critical values, {critical[0]:.6g} .. {critical[-1]:.6g}"
    )
    click.echo()
    _print_states(states, cloud.points.shape[1], weights == "uniform")
    if deepest:
        click.echo()
        print_table(
            [
                ("void", "birth", "death", "death/birth"),
                *(_void(number, void) for number, void in enumerate(deepest, 1)),
            ]
        )


def _steps(critical: Any, steps: int) -> list[float]:
    """Critical values at even ranks: each step lets in the same number of them, the first and the last included."""
    last = len(critical) - 1
    ranks = sorted({round(last * step / (steps - 1)) for step in range(steps)})
    return [float(critical[rank]) for rank in ranks]


def _facets(family: AlphaComplex, alpha: float) -> int:
    return len(family.boundary(alpha).facets)


def _print_states(states: list[dict[str, Any]], dimension: int, as_radius: bool) -> None:
    names = ("components", "tunnels", "voids") if dimension == 3 else ("components", "holes")
    head = ["alpha", *(["radius"] if as_radius else []), *names, "facets"]
    rows = [tuple(head)]
    for state in states:
        alpha = state["alpha"]
        radius = [f"{math.sqrt(alpha):.5g}" if alpha >= 0 else "-"] if as_radius else []
        betti = [*state["betti"], *[0] * len(names)][: len(names)]
        rows.append((f"{alpha:.6g}", *radius, *(f"{number:,}" for number in betti), f"{state['facets']:,}"))
    print_table(rows)


def _void(number: int, void: dict[str, float]) -> tuple[str, ...]:
    birth, death = void["birth"], void["death"]
    return str(number), f"{birth:.6g}", f"{death:.6g}", f"{death / birth:.3g}" if birth > 0 else "-"
