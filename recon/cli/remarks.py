"""What to say of a mesh that is hardly what was wanted: why, and what would help."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..report import doubt

if TYPE_CHECKING:
    from ..pipeline import Reconstruction

_USED = 0.9  # share of the points
_BRIDGED = 0.5  # share of the faces
_TOSS_UP = 0.2  # confidence
_WALLS = 0.05  # share of the area of a closed surface
_SHOWN = 3  # loops


def remarks(result: Reconstruction, asked: str, alpha: float) -> list[str]:
    """Look for what is odd about a reconstruction.

    Parameters
    ----------
    result : Reconstruction
    asked : str
        The option ``--surface``.
    alpha : float [L^2]
        The option ``--alpha``.

    Returns
    -------
    list of str
        A line each, none for most.
    """
    surface, mesh = result.report["surface"], result.report["mesh"]
    found = []
    used = mesh["share_of_points_used"]
    if used < _USED and asked == "complex":
        found.append(f"only {used:.1%} of the points lie on the mesh; {useful(result, alpha)}")
    elif used < _USED and result.surface == "terrain":
        found.append(
            f"only {used:.1%} of the points lie on the mesh; the others have one above them at the same x and y"
        )
    elif used < _USED:
        found.append(f"only {used:.1%} of the points lie on the mesh; recon info tells of noise and outliers")
    faces = surface["facets_of_W0"] + surface["bridged"]
    if asked != "complex" and surface["leaks"] > _BRIDGED * faces:
        share = surface["leaks"] / faces
        found.append(f"{share:.0%} of the faces bridge leaks, as the weights are small; {useful(result, alpha)}")
    if result.thin_loops:
        found.append(f"doubtful: {_thin(result)}")
    if asked == "auto" and result.surface == "closed" and surface["walls"] > _WALLS:
        share = f"{surface['walls']:.0%}"
        found.append(f"{share} of the surface closes openings, where no samples are; --surface open leaves them open")
    elif asked == "auto" and surface["confidence"] < _TOSS_UP:
        found.append(f"{result.surface} or not is a toss-up here; --surface closed, open or terrain decides")
    return found


def _thin(result: Reconstruction) -> str:
    """Where handles are so thin that they may be gaps between samples: the middles of the loops around them."""
    middles = [result.triangulation.points[loop].mean(axis=0) for loop in result.thin_loops[:_SHOWN]]
    places = ["(" + ", ".join(f"{x:.4g}" for x in middle) + ")" for middle in middles]
    number = len(result.thin_loops)
    more = " ..." if number > _SHOWN else ""
    return f"{doubt(number)}, at {' '.join(places)}{more}"


def useful(result: Reconstruction, alpha: float) -> str:
    """Name the alphas that make sense for the points and weights of a reconstruction."""
    from ..alpha import alpha_complex

    best = alpha_complex(result.triangulation).choices()[0]
    return f"useful: --alpha from {alpha + best.start:.4g} to {alpha + best.stop:.4g}, say {alpha + best.alpha:.4g}"
