"""``recon alphas``: at which alpha the shape of a cloud changes, and what it is between."""

from __future__ import annotations

import json
import math
from itertools import count
from typing import TYPE_CHECKING, Any

import click

from .front import PATH, Alpha, print_table, shared

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..alpha import AlphaComplex

_EXAMPLES = """
\b
Examples:
  recon alphas scan.xyz
  recon alphas scan.xyz --weights uniform --voids 5
  recon alphas scan.xyz --at 0.0004 --at 0.01
  recon alphas scan.xyz --all | sort -k 5 -n
"""
_NAMES = {2: ("pieces", "holes", "edges"), 3: ("pieces", "tunnels", "voids", "facets")}


@click.command(short_help="List the critical values of alpha, and the shape between them.", epilog=_EXAMPLES)
@click.argument("file", type=PATH)
@shared("weights")
@click.option(
    "--at",
    "chosen",
    type=Alpha(),
    multiple=True,
    metavar="ALPHA",
    help="Describe the shape at this alpha; may be repeated.",
)
@click.option("--all", "everything", is_flag=True, help="Every range between two critical values, and nothing else.")
@click.option(
    "--ranges",
    type=click.IntRange(min=1),
    default=12,
    show_default=True,
    help="How many ranges to list: half are those in which the shape keeps its topology longest.",
)
@click.option(
    "--voids",
    "shown",
    type=click.IntRange(min=0),
    default=8,
    show_default=True,
    help="How many voids to list, the most lasting first.",
)
@shared("drop", "from", "threads", "quiet", "json")
def alphas(
    file: str,
    weights: str,
    chosen: tuple[float, ...],
    everything: bool,
    ranges: int,
    shown: int,
    drop_invalid: bool,
    source_format: str | None,
    threads: int | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """List at which values of alpha the shape of the points in FILE changes, and what it is between them.

    Alpha is a squared length; with uniform weights its root is the radius that other programs call alpha. A void is
    there from its birth, where it is sealed off, to its death, where it is filled: the inside of a solid shows as
    a void that lasts longer than the others.
    """
    from ..alpha import alpha_complex
    from ..io import read_points
    from .weights import from_option, resolve
    from .work import Progress, note_memory

    cloud = read_points(file, format=source_format, drop_invalid=drop_invalid)
    note_memory(file, len(cloud), quiet, "family")

    with Progress(quiet, {"intervals": 0.5, "topology": 0.5}) as progress:
        progress("intervals", 0.0)
        family = alpha_complex(cloud.points, resolve(from_option(weights, cloud, file), cloud, threads))
        dimension = family.dimension
        progress("topology", 0.5)
        found = _describe(family, chosen, None if everything else ranges, shown)
    if as_json:
        click.echo(json.dumps({"file": file, **found}, indent=1))
    elif everything:
        print_table(_states(found["states"], dimension, weights == "uniform"))
    else:
        _print(file, found, dimension, weights == "uniform")


def _print(file: str, found: dict[str, Any], dimension: int, as_radius: bool) -> None:
    lowest, highest = found["lowest"], found["highest"]
    size = f"{found['points']:,} points, {found['critical_values']:,} critical values"
    click.echo(f"{file}: {size}, {lowest:.6g} .. {highest:.6g}")
    click.echo("below the first there is nothing, from the last on the convex hull\n")
    print_table(_states(found["states"], dimension, as_radius))
    if found["choices"]:
        click.echo()
        head = ("choose", "alpha", "of", "to", "because")
        rows = [
            (str(place), f"{c['alpha']:.6g}", f"{c['start']:.6g}", _until(c["stop"]), c["why"])
            for place, c in enumerate(found["choices"], 1)
        ]
        print_table([head, *rows])
    if found["lasting"]:
        click.echo()
        print_table([("void", "birth", "death", "lasts"), *map(_void, count(1), found["lasting"])])


def _describe(family: AlphaComplex, chosen: tuple[float, ...], ranges: int | None, shown: int) -> dict[str, Any]:
    """Collect all figures, as JSON takes them."""
    import numpy as np

    critical = family.spectrum() + 0.0  # no -0
    if chosen:
        starts = np.array(chosen)
        after = np.searchsorted(critical, starts, side="right")
        stops = np.append(critical, math.inf)[after]
    else:
        starts, stops = _ranges(family, critical, ranges)
    voids = family.voids() if family.dimension > 1 else None
    lives = [] if voids is None else np.column_stack([voids.birth, voids.death]).tolist()
    lives.sort(key=lambda life: life[0] - life[1])
    numbers, facets = family.betti(starts), _facets(family, starts)
    return {
        "points": len(family.triangulation.points),
        "critical_values": len(critical),
        "lowest": float(critical[0]),
        "highest": float(critical[-1]),
        "states": [
            {"alpha": alpha, "until": until if until < math.inf else None, "betti": betti, "facets": exposed}
            for alpha, until, betti, exposed in zip(starts.tolist(), stops.tolist(), numbers.tolist(), facets.tolist())
        ],
        "choices": [
            {"alpha": c.alpha, "start": c.start, "stop": c.stop if c.stop < math.inf else None, "why": c.why}
            for c in (family.choices() if family.dimension and ranges is not None else ())
        ],
        "voids": len(lives),
        "lasting": [{"birth": birth, "death": death} for birth, death in lives[:shown]],
    }


def _ranges(
    family: AlphaComplex, critical: NDArray[np.float64], number: int | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ranges of alpha, ascending: all between critical values, or `number` of those in which Betti numbers stay.

    Half of these are the longest, by the ratio of their ends, taken from where the family begins, which does not depend on
    the unit of length; before half of the points are there, none counts as long. The other half lie at even ranks, so
    that they show how the shape comes to be. The range at 0, where `recon reconstruct` stands, is always among them.
    """
    import numpy as np

    if number is None:
        return critical, np.append(critical[1:], math.inf)
    numbers = family.betti(critical)
    changes = np.append(True, np.zeros(len(critical) - 1, bool))
    for column in numbers.T:
        changes[1:] |= column[1:] != column[:-1]
    first = np.flatnonzero(changes)
    starts, stops = critical[first], np.append(critical[first[1:]], math.inf)
    settled = starts >= np.median(family.entry(0))
    ratio = np.zeros(len(starts))
    np.divide(stops - critical[0], starts - critical[0], out=ratio, where=settled & (starts > critical[0]))
    ratio[(starts <= 0.0) & (stops > 0.0)] = math.inf
    longest = np.argsort(-ratio, kind="stable")[: (number + 1) // 2]
    others = np.delete(np.arange(len(starts)), longest)
    even = (
        others[np.unique(np.linspace(0, len(others) - 1, number // 2).round().astype(int))] if len(others) else others
    )
    kept = np.union1d(longest, even)
    return starts[kept], stops[kept]


def _facets(family: AlphaComplex, alphas: NDArray[np.float64]) -> NDArray[np.int64]:
    """Count the facets of W_alpha at each alpha: in, and not yet interior."""
    import numpy as np

    if family.dimension == 0:
        return np.zeros(len(alphas), np.int64)
    k = family.dimension - 1
    there = np.searchsorted(np.sort(family.entry(k)), alphas, side="right")
    buried = family.mu_upper(k)[~family.on_hull(k)]
    return there - np.searchsorted(np.sort(buried), alphas, side="right")


def _states(states: list[dict[str, Any]], dimension: int, as_radius: bool) -> list[tuple[str, ...]]:
    """Rows of a table; the radius is that of the ball, where it is the same for all points."""
    names = _NAMES.get(dimension, ("pieces", "facets"))
    rows: list[tuple[str, ...]] = [("alpha from", "to", *(("radius",) if as_radius else ()), *names)]
    for state in states:
        alpha = state["alpha"]
        radius = (f"{math.sqrt(alpha):.5g}" if alpha >= 0 else "-",) if as_radius else ()
        numbers = [*state["betti"][: len(names) - 1], state["facets"]]
        rows.append((f"{alpha:.6g}", _until(state["until"]), *radius, *(f"{number:,}" for number in numbers)))
    return rows


def _until(alpha: float | None) -> str:
    return "inf" if alpha is None else f"{alpha:.6g}"


def _void(number: int, void: dict[str, float]) -> tuple[str, ...]:
    birth, death = void["birth"], void["death"]
    return str(number), f"{birth:.6g}", f"{death:.6g}", f"{death - birth:.3g}"
