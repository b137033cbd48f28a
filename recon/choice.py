"""Which alpha? The candidates for one shape of a family, each with its reason and the range in which that holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .alpha import AlphaComplex

# A void counts as the inside of something from this ratio of death to birth on, both taken from where the family
# begins: without weights, when the largest empty ball inside has twice the radius of the largest leak.
LASTING = 4.0


@dataclass(frozen=True, slots=True)
class Choice:
    """One candidate for alpha.

    Attributes
    ----------
    alpha : float [L^2]
    criterion : str
        "void", "solid", "stable" or "connected".
    why : str
        The reason, in a sentence.
    start, stop : float [L^2]
        The reason holds for start <= alpha < stop.
    """

    alpha: float
    criterion: str
    why: str
    start: float
    stop: float


def choices(family: AlphaComplex) -> tuple[Choice, ...]:
    """Give the candidates, the recommended one first: see `AlphaComplex.choices`."""
    begin = float(min(family.entry(0)))
    void = _void(family, begin)
    lasting = void is not None and void.stop - begin >= LASTING * (void.start - begin)
    others = [_solid(family), _stable(family, begin), _connected(family)]
    ordered = [void, *others] if lasting else [*others, void]
    return tuple(choice for choice in ordered if choice is not None)


def _void(family: AlphaComplex, begin: float) -> Choice | None:
    if family.dimension < 2 or not len(family.voids()):
        return None
    voids = family.voids()
    k = int(np.argmax(voids.death - voids.birth))
    start, stop = float(voids.birth[k]), float(voids.death[k])
    a, b, betti = _longest(family, begin, start, stop)
    why = f"encloses the void that lasts longest, of {len(voids)}; there, Betti numbers {betti} last longest"
    return Choice(_between(a, b, begin), "void", why, start, stop)


def _solid(family: AlphaComplex) -> Choice | None:
    d = family.dimension
    if d == 0:
        return None
    least = np.full(len(family.triangulation.points), np.inf)
    np.minimum.at(least, family.simplices(d), family.rho(d)[:, None])
    joined = _connected(family).start
    start = max(joined, float(least[family.simplices(0)].max()))
    return Choice(start, "solid", "the least at which every point is a corner of a cell, in one piece", start, math.inf)


def _stable(family: AlphaComplex, begin: float) -> Choice | None:
    start, critical = _connected(family).start, family.spectrum()
    changes = np.flatnonzero((np.diff(family.betti(critical), axis=0) != 0).any(axis=1))
    if not len(changes) or critical[changes[-1] + 1] <= start:  # nothing but the solid that stays
        return None
    a, b, betti = _longest(family, begin, start, float(critical[changes[-1] + 1]))
    return Choice(_between(a, b, begin), "stable", f"one piece, and there Betti numbers {betti} last longest", a, b)


def _longest(family: AlphaComplex, begin: float, start: float, stop: float) -> tuple[float, float, list[int]]:
    """Give the range within start <= alpha < stop in which the Betti numbers stay longest, by the ratio of its ends."""
    critical = family.spectrum()
    critical = critical[(critical >= start) & (critical < stop)]
    numbers = family.betti(critical)
    first = np.flatnonzero(np.append(True, (np.diff(numbers, axis=0) != 0).any(axis=1)))
    ends = np.append(critical[first], stop) - begin
    k = int(np.argmax(ends[1:] / np.maximum(ends[:-1], 1e-300)))
    return float(ends[k] + begin), float(ends[k + 1] + begin), numbers[first[k]].tolist()


def _connected(family: AlphaComplex) -> Choice:
    bars = family.persistence(0)
    ends = bars[np.isfinite(bars[:, 1]), 1]
    start = float(max(ends.max(initial=-np.inf), bars[:, 0].max()))
    return Choice(start, "connected", "the least at which all points are there, in one piece", start, math.inf)


def _between(start: float, stop: float, begin: float) -> float:
    """Geometric mean, taken from where the family begins: so that raising all weights lowers it by as much."""
    return begin + math.sqrt(start - begin) * math.sqrt(stop - begin)
