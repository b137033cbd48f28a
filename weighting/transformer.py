"""Weights as a transformer of scikit-learn's, for its pipelines and unions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_array, check_is_fitted

from recon.contracts import InvalidInput, check_kind

from .adaptive import adaptive_weights
from .covering import NEAR
from .grading import THETA, between_0_and_1
from .neighborhood import RING, Neighborhood, neighbors


class AdaptiveWeights(TransformerMixin, BaseEstimator):
    """Learn the weights of a cloud; give them, or what they come to at other places, as a column.

    Parameters
    ----------
    radius, cap, theta, threads
        See `adaptive_weights`.

    Attributes
    ----------
    weights_ : (n,) ndarray of float64 [L^2]
        Of the points that it was fitted to.
    n_features_in_ : int
        Dimension d of these points.

    Notes
    -----
    At another place x the weight is min_j (w_j + theta |x - p_j|^2) over the neighbours p_j of x: the greatest that does not
    hide them, as `graded` has it. At the points of the cloud itself that is their own weight.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.pipeline import make_union
    >>> from sklearn.preprocessing import FunctionTransformer
    >>> square = np.array([[x, y, 0.0] for x in range(9) for y in range(9)])
    >>> make_union(FunctionTransformer(), AdaptiveWeights()).fit_transform(square).shape  # x y z weight
    (81, 4)
    """

    def __init__(
        self, *, radius: str = "spacing", cap: float | None = None, theta: float = THETA, threads: int | None = None
    ) -> None:
        self.radius, self.cap, self.theta, self.threads = radius, cap, theta, threads

    def fit(self, X: ArrayLike, y: object = None) -> AdaptiveWeights:
        """Learn the weights of points (n, d) [L]."""
        points = check_array(X, dtype=np.float64)
        check_kind(self.radius, "radius", str, "'spacing' or 'covering'")
        k = RING if self.radius == "spacing" and self.cap is None else NEAR
        self._hood: Neighborhood = neighbors(points, k, threads=self.threads)
        self.weights_: NDArray[np.float64] = adaptive_weights(
            self._hood, radius=self.radius, cap=self.cap, theta=self.theta, threads=self.threads
        )
        self.n_features_in_: int = points.shape[1]
        return self

    def transform(self, X: ArrayLike) -> NDArray[np.float64]:
        """Give the weight [L^2] at each of some places (m, d) [L], as a column (m, 1)."""
        check_is_fitted(self)
        places = check_array(X, dtype=np.float64)
        if places.shape[1] != self.n_features_in_:
            raise InvalidInput(
                f"X has {places.shape[1]} features, but AdaptiveWeights is expecting {self.n_features_in_} features as input"
            )
        hood = self._hood
        known = self.weights_[hood.rows]
        count = min(RING + 1, len(known))
        distance, index = hood.tree.query(places * hood.scale, range(1, count + 1))
        bound = (known[index] + between_0_and_1(self.theta) * (distance / hood.scale) ** 2).min(axis=1)
        return np.where(distance[:, 0] == 0.0, known[index[:, 0]], bound)[
            :, None
        ]  # not rounded at the points themselves

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[np.object_]:
        """Name the column."""
        return np.array(["weight"], dtype=object)
