"""The option ``--weights``: a name, or a file with one number a point."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..io import PointCloud

NAMES = ("adaptive", "uniform")


def from_option(text: str, cloud: PointCloud) -> str | NDArray[np.float64]:
    """Give the name itself, or the weights [L^2] of the points that were kept."""
    if text in NAMES:
        return text
    from ..io import read_weights

    return read_weights(text, len(cloud) + cloud.dropped)[cloud.rows]


def resolve(text: str, cloud: PointCloud, threads: int | None = None) -> NDArray[np.float64] | None:
    """Give the weights [L^2] that the option stands for; None is all zero."""
    weights = from_option(text, cloud)
    if not isinstance(weights, str):
        return weights
    if weights == "uniform":
        return None
    import weighting

    return weighting.adaptive_weights(cloud.points, threads=threads)
