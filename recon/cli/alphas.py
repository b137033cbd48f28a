"""``recon alphas``: at which alpha the shape of a cloud changes, and what it is between."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import click

from .front import print_table, shared

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

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
    help="How many voids to list, the most lasting first.",
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
    there from its birth, where it is sealed off, to its death, where it is filled: the inside of a solid shows as
    a void that lasts longer than the others.
    """
    from ..io import read_points
    from .weights import resolve
    from .work import interruptible

    cloud = read_points(file, format=source_format, drop_invalid=drop_invalid)
    found = interruptible(lambda: _describe(cloud.points, resolve(weights, cloud), chosen, steps, shown))
    if as_json:
        click.echo(json.dumps({"file": file, **found}, indent=1))
        return
    size = f"{len(cloud):,} points, {found['critical_values']:,} critical values"
    click.echo(f"{file}: {size}, {found['lowest']:.6g} .. {found['highest']:.6g}\n")
    _print_states(found["states"], cloud.points.shape[1], weights == "uniform")
    if found["lasting"]:
        click.echo()
        head = ("void", "birth", "death", "lasts")
        print_table([head, *(_void(number, void) for number, void in enumerate(found["lasting"], 1))])


def _describe(
    points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    chosen: tuple[float, ...],
    steps: int,
    shown: int,
) -> dict[str, Any]:
    """Collect all figures, as JSON takes them."""
    from ..alpha import alpha_complex

    family = alpha_complex(points, weights)
    critical = family.spectrum() + 0.0  # no -0
    at = list(chosen) if chosen else _steps(critical, steps)
    voids = family.voids()
    lasting = (voids.birth - voids.death).argsort(kind="stable")[:shown].tolist()
    return {
        "points": len(points),
        "critical_values": len(critical),
        "lowest": float(critical[0]),
        "highest": float(critical[-1]),
        "states": [
            {"alpha": alpha, "betti": family.betti(alpha).tolist(), "facets": len(family.boundary(alpha).facets)}
            for alpha in at
        ],
        "voids": len(voids),
        "lasting": [{"birth": float(voids.birth[void]), "death": float(voids.death[void])} for void in lasting],
    }


def _steps(critical: NDArray[np.float64], steps: int) -> list[float]:
    """Critical values at even ranks, the first and the last included; and 0, where `recon reconstruct` stands."""
    last = len(critical) - 1
    chosen = {float(critical[round(last * step / (steps - 1))]) for step in range(steps)}
    return sorted(chosen | ({0.0} if critical[0] <= 0.0 <= critical[-1] else set()))


def _print_states(states: list[dict[str, Any]], dimension: int, as_radius: bool) -> None:
    names = ("components", "tunnels", "voids") if dimension == 3 else ("components", "holes")
    rows: list[tuple[str, ...]] = [("alpha", *(("radius",) if as_radius else ()), *names, "facets")]
    for state in states:
        alpha = state["alpha"]
        radius = (f"{math.sqrt(alpha):.5g}" if alpha >= 0 else "-",) if as_radius else ()
        betti = [*state["betti"], 0, 0, 0][: len(names)]
        rows.append((f"{alpha:.6g}", *radius, *(f"{number:,}" for number in betti), f"{state['facets']:,}"))
    print_table(rows)


def _void(number: int, void: dict[str, float]) -> tuple[str, ...]:
    birth, death = void["birth"], void["death"]
    return str(number), f"{birth:.6g}", f"{death:.6g}", f"{death - birth:.3g}"
