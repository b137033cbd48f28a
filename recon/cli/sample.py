"""``recon sample``: points on an analytic surface, with the defects of real scans."""

from __future__ import annotations

from typing import Any

import click

from .front import PATH, complain, print_table, shared, surface_names


@click.command(
    short_help="Make a point cloud of an analytic surface.",
    epilog="\b\nExamples:\n  recon sample --list\n  recon sample torus torus.xyz -n 10000 --noise 0.002 --outliers 0.01\n  recon sample sphere:radius=2 - -n 500 --to xyz",
)
@click.argument("surface", required=False, shell_complete=surface_names)
@click.argument("out", required=False, type=PATH)
@click.option(
    "-n", "count", type=click.IntRange(1, 10**9), default=10_000, show_default=True, help="Points, outliers included."
)
@click.option(
    "--density",
    default="area",
    show_default=True,
    metavar="area|curvature|RATIO",
    help="Even, denser where curved, or changing by this ratio along the surface.",
)
@click.option(
    "--spacing",
    type=click.Choice(["random", "blue"]),
    default="random",
    show_default=True,
    help="Independent or evenly spaced points.",
)
@click.option(
    "--lines",
    type=float,
    default=1.0,
    show_default=True,
    metavar="RATIO",
    help="Scan lines, so many times as far apart as points along them.",
)
@click.option(
    "--noise", type=float, default=0.0, show_default=True, help="Standard deviation of the noise, in units of length."
)
@click.option(
    "--noise-kind", type=click.Choice(["normal", "isotropic", "quantized"]), default="normal", show_default=True
)
@click.option("--outliers", type=float, default=0.0, show_default=True, help="Share of points that lie anywhere.")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed gives the same points."
)
@click.option("--truth", is_flag=True, help="Write true normals and which points are outliers, too.")
@click.option("--list", "listed", is_flag=True, help="List the surfaces and stop.")
@shared("to", "quiet")
def sample(
    surface: str | None,
    out: str | None,
    count: int,
    density: str,
    spacing: str,
    lines: float,
    noise: float,
    noise_kind: str,
    outliers: float,
    seed: int,
    truth: bool,
    listed: bool,
    target_format: str | None,
    quiet: bool,
) -> None:
    """Sample points of SURFACE into OUT.

    SURFACE is a name of the catalogue, with sizes if need be: torus:minor=0.2.
    """
    if listed:
        _list()
        return
    if surface is None or out is None:
        raise click.UsageError("name a surface and an output file; recon sample --list lists the surfaces")
    import numpy as np

    from ..contracts import InvalidInput
    from ..io import formats, write_points

    formats.writer_for(out, target_format, formats.POINT_WRITERS)
    shape = named_surface(surface)
    how: Any = density if density in ("area", "curvature") else _ratio(density)
    try:
        cloud = shape.sample(
            count,
            density=how,
            spacing=spacing,
            lines=lines,
            noise=noise,
            noise_kind=noise_kind,
            outliers=outliers,
            rng=seed,
        )
    except ValueError as error:
        raise InvalidInput(f"{surface}: {error}") from error
    attributes = {"normals": cloud.normals, "outlier": cloud.is_outlier.astype(np.uint8)} if truth else {}
    lost = write_points(cloud.points, out, attributes=attributes, format=target_format)
    if lost:
        complain(f"{out}: this format cannot hold {', '.join(lost)}")
    if not quiet and out != "-":
        click.echo(f"{out}: {count:,} points of {surface}")


def named_surface(text: str) -> Any:
    """Make the surface that ``name`` or ``name:size=1,other=2`` stands for.

    Raises
    ------
    InvalidInput
        There is no such surface, or it has no such sizes.
    """
    import datasets_synthetic

    from ..contracts import InvalidInput

    name, _, rest = text.partition(":")
    sizes: dict[str, Any] = {}
    for part in filter(None, rest.split(",")):
        key, _, value = part.partition("=")
        try:
            numbers = tuple(float(number) for number in value.split("x"))
        except ValueError as error:
            raise InvalidInput(f"{text!r}: {part!r} is not of the form size=1.5") from error
        sizes[key.strip()] = numbers[0] if len(numbers) == 1 else numbers
    try:
        return datasets_synthetic.surface(name, **sizes)
    except KeyError as error:
        raise InvalidInput(str(error.args[0])) from error
    except (ValueError, TypeError) as error:
        raise InvalidInput(f"{text!r}: {error}") from error


def _list() -> None:
    import datasets_synthetic

    rows: list[tuple[str, ...]] = [("surface", "", "chi", "area", "volume")]
    for name in datasets_synthetic.surfaces():
        shape = datasets_synthetic.surface(name)
        kind = ("curve" if shape.dimension == 2 else "surface") if shape.closed else "open"
        volume = f"{shape.volume:.6g}" if shape.closed else "-"
        rows.append((name, kind, str(shape.euler), f"{shape.area:.6g}", volume))
    print_table(rows)


def _ratio(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r} is neither area, curvature nor a ratio", param_hint="--density") from error
