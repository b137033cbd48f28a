"""The option ``--weights``: a name, or a file with one number a point."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..contracts import InvalidInput

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..io import PointCloud

NAMES = ("adaptive", "uniform")


def from_option(text: str, cloud: PointCloud, source: str) -> str | NDArray[np.float64]:
    """Give the name itself where it is for `recon.reconstruct` to resolve, or the weights [L^2] of the points that were kept."""
    if text in NAMES:
        return text
    if text == "radius":
        from ..io.files import display_name
        from ..io.molecules import ball_weights

        if "radius" not in cloud.attributes:
            raise InvalidInput(f"{display_name(source)}: --weights radius: it has no radii, as PDB and XYZR files do")
        return ball_weights(cloud.attributes["radius"])
    from ..io import read_weights

    return read_weights(text, len(cloud) + cloud.dropped)[cloud.rows]


def resolve(
    weights: str | NDArray[np.float64], cloud: PointCloud, threads: int | None = None
) -> NDArray[np.float64] | None:
    """Give the weights [L^2] that a name stands for, too; None is all zero, as alpha adds the same to all."""
    if not isinstance(weights, str):
        return weights
    if weights == "uniform":
        return None
    import weighting

    return weighting.adaptive_weights(cloud.points, threads=threads)
