"""Repair of few samples: several searches, of which the best is kept."""

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon import repair
from recon.surface import _Evidence


def mended(points: np.ndarray, threads: int = 1) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Energy, excess, sides, and the faces between them."""
    spacing = weighting.spacing(points)
    evidence = _Evidence(recon.regular_triangulation(points, spacing**2), spacing, True, threads)
    sides, _ = evidence.closed_sides()
    excess = evidence.repair(sides, evidence.between(sides), evidence.pieces(sides), np.inf)
    facets = evidence.between(sides)
    np.testing.assert_array_equal(excess, repair.excesses(evidence.ground, facets, np.inf, 1))
    return repair._energy(evidence.ground, sides, excess), excess, sides, evidence.faces(facets)


@pytest.fixture(scope="module")
def part() -> np.ndarray:
    """A few places to mend."""
    return datasets_synthetic.surface("csg_part").sample(1200, rng=1).points


def test_the_outcome_of_least_energy_is_kept(monkeypatch):
    clouds = [datasets_synthetic.surface("csg_part").sample(1200, rng=seed).points for seed in range(4)]
    several = np.array([mended(points)[0] for points in clouds])
    monkeypatch.setattr(repair, "TURNS", 1)
    once = np.array([mended(points)[0] for points in clouds])
    assert (several <= once).all()
    assert (several < once).any()


def test_many_samples_are_searched_once(part, monkeypatch):
    turns = []
    search = repair._search
    monkeypatch.setattr(repair, "_search", lambda *given: turns.append(given[7]) or search(*given))
    mended(part)
    assert sorted(turns) == list(range(repair.TURNS))
    turns.clear()
    monkeypatch.setattr(repair, "SMALL", len(part) - 1)
    mended(part)
    assert turns == [0]


def test_threads_do_not_change_the_outcome(part):
    alone, together = mended(part, 1), mended(part, 3)
    np.testing.assert_array_equal(alone[2], together[2])


@pytest.mark.parametrize("name", ["sphere", "thin_plate"])
def test_what_needs_no_mending_or_too_much_is_searched_once(name, monkeypatch):
    """A plate as thick as its samples are apart: half of them are mended."""
    turns = []
    search = repair._search
    monkeypatch.setattr(repair, "_search", lambda *given: turns.append(given[7]) or search(*given))
    mended(datasets_synthetic.surface(name).sample(1500, rng=0).points)
    assert turns == [0]
