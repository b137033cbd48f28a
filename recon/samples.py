"""What becomes of the points before they are meshed: outliers removed, noise taken out, all of it counted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import weighting
from weighting import projection

from .threads import together


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Points to be meshed, row by row those of the input.

    Attributes
    ----------
    points : (n, 3) ndarray of float64 [L]
        A removed point stands where the nearest one that was kept does: it is a duplicate, which the triangulation hides.
    hood : Neighborhood
        Of these points.
    removed : (n,) ndarray of int64
        Rows of the removed points.
    nearest : ndarray of int64
        For each of them the row of the kept point.
    duplicates : int
        Rows of the input that repeat another one.
    figures : dict of str to value
        For the report.
    """

    points: NDArray[np.float64]
    hood: weighting.Neighborhood
    removed: NDArray[np.int64]
    nearest: NDArray[np.int64]
    duplicates: int
    figures: dict[str, Any]

    def below_others(self, w: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights with those of the removed points so low that the point which they stand on hides them [L^2]."""
        if len(self.removed):
            w = w.copy()
            w[self.removed] = np.nextafter(w[self.nearest], -np.inf)
        return w


def clean_samples(points: NDArray[np.float64], denoise: bool | None, threads: int | None) -> Samples:
    """Remove what is certainly no sample of a surface, and denoise: where there is noise (None), everywhere (True), neither (False).

    Parameters
    ----------
    points : (n, 3) ndarray of float64 [L]
    denoise : bool or None
    threads : int or None

    Returns
    -------
    Samples
    """
    hood = weighting.neighbors(points, threads=threads)
    duplicates = len(points) - len(hood.rows)
    nobody = np.zeros(0, np.int64)
    figures: dict[str, Any] = {"removed_outliers": 0, "denoised": False}
    if denoise is False or len(hood.points) < 2:
        return Samples(points, hood, nobody, nobody, duplicates, figures)
    located, removed, nearest = points, nobody, nobody
    stray, linked = together(
        threads,
        lambda: weighting.certain_outliers(hood, threads=threads),
        lambda: projection.Linked.of(hood, threads),
    )
    if stray.any():
        removed, kept = np.flatnonzero(stray), np.flatnonzero(~stray)
        rest = weighting.neighbors(points[kept], threads=threads)
        nearest = kept[rest.rows[rest.tree.query(points[removed] * rest.scale)[1]]]
        located = points.copy()
        located[removed] = points[nearest]
        hood = weighting.neighbors(located, threads=threads)
        linked = projection.Linked.of(hood, threads)
        figures["removed_outliers"] = len(removed)
    cloud, noise = projection.resolved(linked, threads)
    figures["noise"] = float(np.median(noise.sigma))
    figures["noise_in_spacings"] = noise.relative
    figures["noisy_share"], figures["layered_share"] = noise.noisy, noise.layered
    if not denoise:
        noise = replace(noise, sigma=np.where(noise.where, noise.sigma, 0.0))
    if noise.sigma.any():
        from .postprocess.denoise import moved

        before, located = located, moved(hood, cloud, noise, threads)
        distance = np.linalg.norm(located - before, axis=1)
        hood = weighting.neighbors(located, threads=threads)
        figures["denoised"] = True
        figures["moved_points"] = int((distance > 0).sum())
        figures["mean_move"], figures["greatest_move"] = float(distance.mean()), float(distance.max())
    return Samples(located, hood, removed, nearest, duplicates, figures)
