"""What a point cloud is like: extent, spacing, noise, outliers, and whether its surface looks closed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

_NEAR = 8  # neighbours for spacing
_AROUND = 24  # neighbours for a local quadric
_SAMPLE = 50_000  # points looked at closely
_GAP = np.deg2rad(150.0)  # an empty sector wider than this is a rim
_FAR = 4.0  # an outlier is this many times farther from its neighbours than the densest of them is from its own
_NOISY = 0.35  # spacings of noise beyond which a rim cannot be seen
_CLOSED, _OPEN = (
    0.5,
    1.45,
)  # rim points over the square root of all; seen: at most 0.35 on closed clouds, 1.5 and up on open
_ROUNDS = 1 << 12


@dataclass(frozen=True, slots=True)
class Survey:
    """Figures of a cloud; None where there are too few points to tell.

    Attributes
    ----------
    points, duplicates : int
        Rows, and rows that repeat an earlier one.
    span : int
        Dimension of the affine hull, to rounding.
    lower, upper : (d,) ndarray of float64 [L]
    diagonal : float [L]
    spacing, spacing_p5, spacing_p95 : float or None [L]
        Median, 5 % and 95 % of the distance to the nearest other place.
    density_ratio : float or None
        99 % over 1 % of the distance to the 8th neighbour.
    noise : float or None [L]
        Median over the points of the standard deviation from a quadric through 24 neighbours.
    outliers : float or None
        Share of points four times as far from their neighbours as one of those is from its own.
    rim : float or None
        Share of points with an empty sector of 150 degrees around them, in the tangent plane.
    surface : str
        "closed", "open", "planar", or "unclear".
    """

    points: int
    duplicates: int
    span: int
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    diagonal: float
    spacing: float | None = None
    spacing_p5: float | None = None
    spacing_p95: float | None = None
    density_ratio: float | None = None
    noise: float | None = None
    outliers: float | None = None
    rim: float | None = None
    surface: str = "unclear"


def survey(points: NDArray[np.float64], threads: int | None = None) -> Survey:
    """Look a cloud over; large ones at 50,000 points, always the same.

    Parameters
    ----------
    points : (n, d) ndarray of float64 [L]
    threads : int, optional

    Returns
    -------
    Survey
    """
    lower, upper = points.min(axis=0), points.max(axis=0)
    distinct = _distinct(points)
    unit = float(np.ldexp(1.0, np.frexp((upper - lower).max())[1]))  # a power of two: squares stay in range
    places = (distinct - (lower / 2 + upper / 2)) / unit
    extent = float(np.linalg.norm((upper - lower) / unit))
    known: dict[str, Any] = {
        "points": len(points),
        "duplicates": len(points) - len(distinct),
        "span": _span(places, extent, float(np.abs(points / unit).max())),
        "lower": lower,
        "upper": upper,
        "diagonal": extent * unit,
    }
    if len(distinct) < 2 * _AROUND:
        return Survey(**known)
    tree = cKDTree(places)
    chosen = np.arange(len(places))
    if len(places) > _SAMPLE:
        chosen = np.sort(np.random.default_rng(0).choice(len(places), _SAMPLE, replace=False))
    distances, near = tree.query(places[chosen], _AROUND + 1, workers=threads or 1)
    far = distances[:, _NEAR]
    around, back = np.unique(near[:, 1:], return_inverse=True)
    theirs = tree.query(places[around], [_NEAR + 1], workers=threads or 1)[0][back.reshape(-1, _AROUND), 0]
    lonely = far > _FAR * theirs.min(axis=1)
    first = distances[:, 1]
    residual = rim = None
    surface = "unclear"
    if places.shape[1] == 3 and known["span"] == 3:
        sigma, gap = _local(places, chosen[~lonely], near[~lonely])
        residual = float(np.median(sigma))
        smooth = sigma <= np.maximum(2 * residual, 0.1 * first[~lonely])  # not at a crease: that looks like a rim
        rim = float(np.mean(gap[smooth] > _GAP))
        if residual < _NOISY * np.median(first):
            # The points on a rim grow like the square root of all points.
            length = rim * np.sqrt(len(places))
            surface = "closed" if length < _CLOSED else "open" if length > _OPEN else "unclear"
    elif known["span"] == 2:
        surface = "planar"
    return Survey(
        **known,
        spacing=float(np.median(first)) * unit,
        spacing_p5=float(np.quantile(first, 0.05)) * unit,
        spacing_p95=float(np.quantile(first, 0.95)) * unit,
        density_ratio=float(np.quantile(far, 0.99) / np.quantile(far, 0.01)),
        noise=None if residual is None else residual * unit,
        outliers=float(lonely.mean()),
        rim=rim,
        surface=surface,
    )


def _distinct(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give every place once; by sorts that let other threads run, which ``np.unique`` of rows does not."""
    located = points[np.lexsort(points.T)]
    fresh = np.ones(len(located), bool)
    fresh[1:] = (located[1:] != located[:-1]).any(axis=1)
    return located[fresh]


def _span(places: NDArray[np.float64], diagonal: float, magnitude: float) -> int:
    """Dimension of the affine hull: directions in which the points spread more than rounding does."""
    if diagonal == 0.0:
        return 0
    centered = (places - places.mean(axis=0)) / diagonal
    spread = np.linalg.svd(centered, compute_uv=False)
    rounding = 8 * np.finfo(np.float64).eps * max(1.0, magnitude / diagonal)
    return int(np.count_nonzero(spread / np.sqrt(len(places)) > 1e3 * rounding))


def _local(
    places: NDArray[np.float64], chosen: NDArray[np.int64], near: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Standard deviation from a local quadric, and the widest empty sector, at each chosen point."""
    sigma = np.empty(len(chosen))
    gap = np.empty(len(chosen))
    for begin in range(0, len(chosen), _ROUNDS):
        part = slice(begin, begin + _ROUNDS)
        vectors = places[near[part, 1:]] - places[chosen[part], None]
        vectors = vectors / np.linalg.norm(vectors, axis=2).max(axis=1)[:, None, None]
        _, frames = np.linalg.eigh(np.einsum("nki,nkj->nij", vectors, vectors))
        height, x, y = np.moveaxis(np.einsum("nki,nij->nkj", vectors, frames), 2, 0)
        design = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2)
        fit = np.einsum("nkj,nj->nk", design, np.einsum("njk,nk->nj", np.linalg.pinv(design), height))
        scale = np.linalg.norm(places[near[part, -1]] - places[chosen[part]], axis=1)
        sigma[part] = np.sqrt(((height - fit) ** 2).sum(axis=1) / (_AROUND - 6)) * scale
        angle = np.sort(np.arctan2(y, x), axis=1)
        gap[part] = np.diff(angle, axis=1, append=angle[:, :1] + 2 * np.pi).max(axis=1)
    return sigma, gap
