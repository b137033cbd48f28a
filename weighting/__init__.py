"""Weights for weighted alpha shapes, from the local spacing of the samples.

>>> import numpy as np, weighting
>>> grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0), [0.0]), axis=-1).reshape(-1, 3)
>>> hood = weighting.neighbors(grid)                     # one query serves every term
>>> weights = weighting.adaptive_weights(hood)
>>> weights.shape, bool(0.5 < weights[40] < 1.5)
((81,), True)
"""

from .adaptive import adaptive_weights
from .closing import Closure, closing_weights, closure
from .contradiction import Contradiction, NotRegular
from .covering import covering
from .density import spacing
from .enforce import enforce
from .grading import graded
from .lines import line_spacing
from .neighborhood import Neighborhood, neighbors
from .projection import Scatter, scatter
from .shape import Curvature, curvature, noise
from .stray import certain_outliers, outliers
from .thickness import sufficient_weight, thickness

__all__ = [
    "AdaptiveWeights",
    "Closure",
    "Contradiction",
    "Curvature",
    "Neighborhood",
    "Scatter",
    "NotRegular",
    "adaptive_weights",
    "certain_outliers",
    "closing_weights",
    "closure",
    "covering",
    "curvature",
    "enforce",
    "graded",
    "line_spacing",
    "neighbors",
    "noise",
    "outliers",
    "scatter",
    "spacing",
    "sufficient_weight",
    "thickness",
]


def __getattr__(name: str) -> object:
    if name == "AdaptiveWeights":  # on first use: scikit-learn takes its time
        from .transformer import AdaptiveWeights

        return AdaptiveWeights
    raise AttributeError(f"module 'weighting' has no attribute {name!r}")
