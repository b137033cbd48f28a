"""Noise, told from shape by how it grows with scale; and where the samples would lie without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recon.contracts import InvalidInput
from recon.threads import over_ranges, workers

from ._scales import FRAME, WIDER, blend, fit_scales, normals_of
from .density import smooth_spacing
from .lines import thinning
from .neighborhood import RING, Neighborhood, neighbors
from .stray import strays

NEAR_SQ = 4.0  # squared radius of the smallest fit [spacings^2]: some 12 samples; each level has twice as many
LEVELS = 4
WITHOUT_NOISE_SQ = 6.0  # squared radius of the fits that give normals [spacings^2]: some 19 samples
EVERY = 8  # one sample in so many has a fit of its own where the fits are wide, elsewhere every one
SLACK = 3.0  # standard deviations by which the misfit of a fit may exceed the noise
MOST = 5.0  # standard deviations of noise from a fit that a sample may be moved
STRONG = 0.25  # noise [spacings] from which on planes need more samples
LOOKED_AT = 4096  # samples from which the noise level is taken
STRETCH = 256  # of those, next to each other, that a level is taken from
CENTERS = 4  # one of those in so many is the middle of a stretch
HEAVY = 256  # fits that are worth a thread
# The lower quartile of chi^2 over its degrees of freedom, for the 12 - 6 and the 25 - 6 of the two smallest fits. The
# quartile, and not the median, so that up to three quarters of a stretch may lie on edges.
QUARTILES = 0.576, 0.766
# A stretch is noisy when its level is above LEAST spacings; the same in half of it, the median of the misfits at most
# SPREAD times the quartile (1.25 for noise, 1.6 and more for shape); and the same at twice the area, up to GROWTH (0.9 to 1.3
# for noise, 1.6 at creases, 2 and more where the surface is smooth).
LEAST, SPREAD, GROWTH = 0.05, 1.5, 1.5
# It is the core of a noisy region where MOSTLY of the stretches around are noisy; and noise reaches from there as far as it can
# explain the misfits: chi^2 over its 6 degrees of freedom is less than EXPLAINED for 2 samples in 100 alone.
MOSTLY, EXPLAINED = 0.5, 0.2
# And no stretch is noisy that is layered. Kurtosis of the distances from fits to some 50 samples, each in the misfit of its fit, so that
# it does not matter how far apart the sheets are; fits better than LEAST, to clean faces beside them, do not count. Noise has
# 3, no distribution with one peak, and symmetric, less than 1.8, two sheets 1; and the fits, which every sample pulls by
# a twelfth, leave (11/12)^2 of what is missing to 3. This is halfway between what they make of the latter two, 2.0 and 1.3.
LAYERED, LAYERS_SQ = 1.65, 4 * NEAR_SQ
# Fits to 12 samples see no more than 0.7 spacings of noise, of however much there is, and 0.43 of half a spacing. So above
# RESOLVED they do not see all of it, and fewer samples, wider apart, are looked at; but no fewer than ENOUGH.
RESOLVED, ENOUGH = 0.5, 100


@dataclass(frozen=True, slots=True, eq=False)
class Scatter:
    """How noisy a cloud is.

    Attributes
    ----------
    sigma : (n,) ndarray of float64 [L]
        Standard deviation from a smooth surface, along its normal. Only an upper bound where it is not noise.
        0 where there are too few samples to say.
    where : (n,) ndarray of bool
        It is noise, and at least a twentieth of the spacing: not shape finer than the samples show.
    relative : float
        Median of sigma, in local spacings.
    noisy : float
        Share of the cloud where it is noise.
    layered : float
        Share that would count as noisy, but lies in two sheets, too close together for fits to keep them apart.
    """

    sigma: NDArray[np.float64]
    where: NDArray[np.bool_]
    relative: float
    noisy: float
    layered: float


@dataclass(frozen=True, slots=True, eq=False)
class Linked:
    """Samples that know their neighbours, those next to each other in space being so in the arrays.

    Attributes
    ----------
    points : (m, 3) ndarray of float64 [L]
    first : (m + 1,) ndarray of int64
        The neighbours of i are links[first[i]:first[i + 1]].
    links : ndarray of int
    spacing : (m,) ndarray of float64 [L]
    skip : (m,) ndarray of bool
        Samples that are none of the surface.
    near : (m,) ndarray of float64 [L]
        Spacing of all of them, where `spacing` is that of the fitted ones.
    fitted : ndarray of int64
        The samples that fits are made to, ascending: all, or so many that noise is less than their spacing.
    """

    points: NDArray[np.float64]
    first: NDArray[np.int64]
    links: NDArray[np.integer]
    spacing: NDArray[np.float64]
    skip: NDArray[np.bool_]
    near: NDArray[np.float64]
    fitted: NDArray[np.int64]

    @property
    def asking(self) -> NDArray[np.int64]:
        """Whose neighbour each of the links is."""
        return np.repeat(np.arange(len(self.points)), np.diff(self.first))

    @classmethod
    def of(cls, hood: Neighborhood, threads: int | None) -> Linked:
        """The distinct points of a neighbourhood, outliers left out; on scan lines linked to so few that the next lines are reached."""
        k, n = min(RING, hood.k), len(hood.points)
        links = np.ascontiguousarray(hood.index[:, :k]).ravel()
        spacing, every = smooth_spacing(hood), np.arange(n, dtype=np.int64)
        cloud = cls(hood.points, np.arange(n + 1) * k, links, spacing, strays(hood)[0], spacing, every)
        step = thinning(hood, threads)
        return cloud if step == 1 else cloud.thinned(step, threads)

    def thinned(self, step: int, threads: int | None) -> Linked:
        """The same samples linked to one in `step` of them, and with the spacing of those."""
        some = np.flatnonzero(~self.skip)[::step]
        few = neighbors(self.points[some], RING, threads=threads)
        fitted = some[few.rows]
        k = min(RING + 1, len(fitted))
        far, nearest = few.tree.query(self.points * few.scale, np.arange(1, k + 1), workers=workers(threads))
        first = np.arange(len(self.points) + 1) * k
        spacing = smooth_spacing(few)[nearest[:, 0]]
        skip = self.skip & (far[:, 0] > np.sqrt(NEAR_SQ) * few.scale * spacing)  # beyond the smallest fit
        return Linked(self.points, first, fitted[nearest].ravel(), spacing, skip, self.near, np.sort(fitted))


def scatter(points: ArrayLike | Neighborhood, *, threads: int | None = None) -> Scatter:
    """Tell how noisy a cloud is, and whether it is noise.

    Parameters
    ----------
    points : (n, 3) array_like of float [L], or Neighborhood
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    Scatter

    Raises
    ------
    InvalidInput
        Malformed points, d other than 3.

    Notes
    -----
    Quadrics through some 12 and some 25 samples around each of at most 4,096. Their misfit, by degrees of freedom, is the
    variance of the noise whatever the scale, where the surface is smooth; the misfit of a shape that no quadric has grows with the scale: as
    the third power of the radius where it is smooth, in proportion at a crease. And noise is everywhere, shape here and there:
    256 of these samples, next to each other, must agree. So the level may vary over the cloud, and part of it be clean.
    Two clean sheets closer than the neighbourhoods are wide look like it, but that nothing lies between them: noise is densest in
    the middle. (Distributions with one peak, symmetric, are mixtures of uniform ones, Khinchine 1938; so their kurtosis is 1.8 or more.)
    Where that says more than half a spacing, it saw only part of the noise, and looks again at every second sample, every
    fourth, and so on, down to 100 of them.

    Examples
    --------
    >>> import datasets_synthetic
    >>> ball = datasets_synthetic.surface("sphere")
    >>> found = scatter(ball.sample(2000, noise=0.01, rng=0).points)
    >>> float(np.median(found.sigma).round(3)), found.noisy
    (0.01, 1.0)
    >>> scatter(ball.sample(2000, rng=0).points).noisy
    0.0
    """
    hood = neighbors(points, RING, threads=threads)
    found = resolved(_three_dimensional(hood, threads), threads)[1]
    return Scatter(found.sigma[hood.inverse], found.where[hood.inverse], found.relative, found.noisy, found.layered)


def resolved(cloud: Linked, threads: int | None) -> tuple[Linked, Scatter]:
    """Noise of linked samples, and these linked as widely as it takes to see that: of each other, or of every second, fourth ...

    Where no width resolves it, as in what is no surface, there is no noise; what the samples as given say is an upper bound.
    """
    noise = level(cloud, threads)
    wide, seen, step = cloud, noise, 1
    samples = np.count_nonzero(~cloud.skip)
    while seen.relative > RESOLVED and seen.layered <= 0.5 and samples >= 2 * step * ENOUGH:
        step *= 2
        wide = cloud.thinned(step, threads)
        seen = level(wide, threads)
    if step > 1 and (seen.relative > RESOLVED or seen.layered > 0.5):
        wide, seen = cloud, replace(noise, where=np.zeros_like(noise.where), noisy=0.0)
    ratio = np.divide(seen.sigma, cloud.near, out=np.zeros(len(seen.sigma)), where=cloud.near > 0)
    return wide, replace(seen, relative=float(np.median(ratio)))


def level(cloud: Linked, threads: int | None) -> Scatter:
    """Noise of linked samples."""
    n = len(cloud.points)
    rows = cloud.fitted[:: max(1, len(cloud.fitted) // LOOKED_AT)]
    variance = _fit(cloud, np.zeros(n), rows, 2, (np.empty(n, np.int8), np.empty((n, FRAME))), threads)
    known = np.asarray(np.isfinite(variance).all(axis=1))
    rows, variance = rows[known], variance[known]
    if len(rows) < STRETCH // 32:
        return Scatter(np.zeros(n), np.zeros(n, bool), 0.0, 0.0, 0.0)
    centers = np.arange(0, len(rows), CENTERS)
    hood = neighbors(cloud.points[rows], 1, threads=threads)
    near = hood.rows[hood.wider(hood.inverse[centers], STRETCH, threads)[0]]
    (low, middle), wide = (
        np.quantile(variance[near, 0], [0.25, 0.5], axis=1),
        np.quantile(variance[near, 1], 0.25, axis=1),
    )
    sigma, wider = np.sqrt(low / QUARTILES[0]), np.sqrt(wide / QUARTILES[1])
    even = (middle <= SPREAD**2 * low) & (wider <= GROWTH * sigma) & (sigma > LEAST * cloud.near[rows[centers]])
    sheets = even & _layered(cloud, rows, near, threads) if even.any() else even

    value = np.zeros(len(rows))
    value[centers] = 1.0
    count = value[near].sum(axis=1) + 1.0

    def around(values: NDArray) -> NDArray[np.float64]:
        """Mean over the centres in every stretch."""
        value[centers] = values
        return np.asarray((value[near].sum(axis=1) + values) / count)

    core = around(even & ~sheets) > MOSTLY
    share = around(core)
    beside = np.divide(around(core * sigma), share, out=sigma.copy(), where=share > 0)  # noise of the core in a stretch
    of = np.arange(len(rows)) // CENTERS  # whose stretch counts for a fit: the one before, which is near
    noise = core[of] | ((share[of] > 0) & (variance[:, 0] > EXPLAINED * beside[of] ** 2))
    sigma = np.where(noise & ~even[of], beside[of], sigma[of])
    before = np.maximum(np.searchsorted(rows, np.arange(n), "right") - 1, 0)  # which fit counts for a sample
    sigma, noise, layered = sigma[before], noise[before], (around(sheets) > MOSTLY)[of][before]
    if 0 < np.count_nonzero(noise) < n:  # neighbours too, for fits are few, and a clean sample is not moved by much
        asking = cloud.asking
        rim = noise[cloud.links] & ~noise[asking]
        sigma[asking[rim]] = 0.0
        np.maximum.at(sigma, asking[rim], sigma[cloud.links[rim]])
        noise[asking[rim]] = True
    relative = np.divide(sigma, cloud.spacing, out=np.zeros(n), where=cloud.spacing > 0)
    return Scatter(sigma, noise, float(np.median(relative)), float(np.mean(noise)), float(np.mean(layered)))


def _layered(cloud: Linked, rows: NDArray[np.int64], near: NDArray[np.int64], threads: int | None) -> NDArray[np.bool_]:
    """Do the samples around each lie on either side of what is fitted to them, rather than on it?"""
    n = len(cloud.points)
    chosen, frame = np.full(n, -1, np.int8), np.empty((n, FRAME))
    misfit = _fit(cloud, np.zeros(n), rows, 1, (chosen, frame), threads, np.full(n, np.inf), LAYERS_SQ)[:, 0]
    counts = misfit > (LEAST * cloud.near[rows]) ** 2
    off_sq = np.divide(frame[rows, 3] ** 2, misfit, out=np.zeros(len(rows)), where=counts)[near]
    return np.asarray(counts[near].sum(axis=1) * (off_sq**2).sum(axis=1) < LAYERED * off_sq.sum(axis=1) ** 2)


def onto_surface(cloud: Linked, sigma: NDArray[np.float64], threads: int | None) -> NDArray[np.float64]:
    """Displacement of every linked sample to the local surface [L]; NaN where none is found within the noise.

    Notes
    -----
    One sample in eight, and every one where fits are narrow, is given a quadric, through the largest of four nested neighbourhoods (12 to 100 samples; 200 above a quarter of
    a spacing) whose misfit the noise explains: wide where the surface is smooth, narrow where it bends, none across a crease, a corner or two sheets.
    Where a wider one does not fit, that one is made longer the way the surface bends least: along a tube or a crease.
    What noise explains of its bend is taken out, as is the shift by sigma^2 times the mean curvature that isotropic noise gives to a surface.
    Every sample then moves to the mean of its feet on the quadrics of its neighbours that it lies within five
    standard deviations of. Near creases these are the fits on its own side of it; those of the other side are too far.
    Linear cost. Sources: local regression with the neighbourhood chosen from the residuals (Cleveland & Loader 1996);
    the blend is a partition of unity (Ohtake et al. 2003), the limit that of robust moving least squares (Fleishman et al. 2005).
    """
    n = len(cloud.points)
    fits = np.full(n, -1, np.int8), np.empty((n, FRAME))
    rows, few = np.arange(n), cloud.fitted[::EVERY]
    _fit(cloud, sigma, few, LEVELS, fits, threads)
    served, asking = fits[0] >= LEVELS - 1, cloud.asking
    for _ in range(2):
        served[asking[served[cloud.links]]] = True
    served[few] = True
    _fit(cloud, sigma, cloud.fitted[~served[cloud.fitted]], LEVELS, fits, threads)
    move = np.empty((n, 3))

    def work(start: int, stop: int) -> None:
        blend(
            cloud.points, cloud.first, cloud.links, cloud.spacing, cloud.skip, sigma,
            rows[start:stop], NEAR_SQ, MOST, *fits, move[start:stop],
        )  # fmt: skip

    over_ranges(work, n, threads)
    return move


def normals(cloud: Linked, threads: int | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit normals of fits to some 19 samples, of either sense, and how far the samples around lie off them (rms) [L]; 0 and NaN without fit."""
    n = len(cloud.points)
    nothing, chosen, frame = np.zeros(n), np.full(n, -1, np.int8), np.empty((n, FRAME))
    variance = _fit(cloud, nothing, np.arange(n), 1, (chosen, frame), threads, nothing + np.inf, WITHOUT_NOISE_SQ)[:, 0]
    normal = np.empty((n, 3))
    normals_of(chosen, frame, normal)
    return normal, np.sqrt(variance)


def _fit(
    cloud: Linked,
    sigma: NDArray[np.float64],
    rows: NDArray[np.int64],
    levels: int,
    fits: tuple[NDArray[np.int8], NDArray[np.float64]],
    threads: int | None,
    bound: NDArray[np.float64] | None = None,
    near_sq: float = NEAR_SQ,
) -> NDArray[np.float64]:
    """Misfit of each row at each level; the widest level of a misfit within `bound` (sigma by default) and the quadric there go to `fits`."""
    allowed = sigma if bound is None else bound
    variance = np.empty((len(rows), levels + WIDER))
    strong = sigma > STRONG * cloud.spacing

    def work(start: int, stop: int) -> None:
        fit_scales(
            cloud.points, cloud.first, cloud.links, cloud.spacing, cloud.skip, sigma, allowed,
            rows[start:stop], near_sq, levels, strong, SLACK, variance[start:stop], *fits,
        )  # fmt: skip

    over_ranges(work, len(rows), threads, HEAVY)
    return variance[:, :levels]


def _three_dimensional(hood: Neighborhood, threads: int | None) -> Linked:
    if hood.points.shape[1] != 3:
        raise InvalidInput(f"points: a quadric needs d = 3, got {hood.points.shape[1]}")
    return Linked.of(hood, threads)
