"""Repair of few samples: several searches, of which the best is kept, place by place."""

import itertools

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon import repair
from recon._kernels import components, crossover
from recon._kernels import energy as terms
from recon._kernels.umbrellas import rooms
from recon.surface import _Evidence
from recon.topology import topology


def shape_of(evidence: _Evidence, sides: np.ndarray, widest: float) -> tuple[float, int, np.ndarray]:
    """Energy without topology, Euler number, and excess of every sample."""
    facets = evidence.between(sides)
    facets = facets[evidence.gate.ravel()[facets] <= widest]
    faces = evidence.faces(facets)
    excess = repair.excesses(evidence.ground, facets, widest, 1)
    walls = sum(terms.wall(evidence.points, evidence.spacing, *face) for face in faces)
    return (
        walls + terms.BURIED * (excess < 0).sum() + terms.PINCH * excess[excess > 0].sum(),
        topology(faces).euler,
        excess,
    )


def energy_of(evidence: _Evidence, sides: np.ndarray) -> float:
    """All of it, of a closed surface."""
    energy, euler, _ = shape_of(evidence, sides, np.inf)
    return energy + terms.TOPOLOGY * (2 * components.count_components(evidence.links, sides) - euler / 2)


def evidence_of(points: np.ndarray, threads: int = 1) -> tuple[_Evidence, np.ndarray]:
    """What is known of the points, and sides before repair."""
    spacing = weighting.spacing(points)
    evidence = _Evidence(recon.regular_triangulation(points, spacing**2), spacing, True, threads)
    return evidence, evidence.closed_sides()[0]


def mended(points: np.ndarray, threads: int = 1) -> tuple[float, np.ndarray]:
    """Energy and sides."""
    evidence, sides = evidence_of(points, threads)
    excess = evidence.repair(sides, evidence.between(sides), evidence.pieces(sides), np.inf)
    np.testing.assert_array_equal(excess, repair.excesses(evidence.ground, evidence.between(sides), np.inf, 1))
    return energy_of(evidence, sides), sides


@pytest.fixture(scope="module")
def part() -> np.ndarray:
    """A few places to mend."""
    return datasets_synthetic.surface("csg_part").sample(1200, rng=1).points


def test_the_outcome_is_no_worse_than_that_of_any_search(monkeypatch):
    clouds = [datasets_synthetic.surface("csg_part").sample(1200, rng=seed).points for seed in range(4)]
    several = np.array([mended(points)[0] for points in clouds])
    search = repair._search
    monkeypatch.setattr(repair, "TURNS", 1)
    single = []
    for turn in range(4):
        monkeypatch.setattr(repair, "_search", lambda *given, turn=turn: search(*given[:7], turn, *given[8:]))
        single.append([mended(points)[0] for points in clouds])
    assert (several <= np.min(single, axis=0) + 1e-9).all()
    assert (several < np.min(single, axis=0) - 1e-9).any()


@pytest.mark.parametrize("widest", [np.inf, 1.5])
@pytest.mark.parametrize("seed", range(3))
def test_a_flip_changes_the_energy_by_what_it_says_and_can_be_taken_back(seed, widest):
    rng = np.random.default_rng(seed)
    evidence, sides = evidence_of(datasets_synthetic.surface("torus").sample(150, rng=seed).points)
    ground, scratch, before = evidence.ground, rooms(evidence.stars[0]), np.empty(4, np.int32)
    energy, euler, excess = shape_of(evidence, sides, widest)
    for _ in range(150):
        beside = np.flatnonzero(
            (sides[evidence.links[: len(evidence.cells)]] != sides[: len(evidence.cells), None]).any(axis=1)
        )
        x = int(rng.choice(beside) if rng.random() < 0.8 else rng.integers(len(evidence.cells)))
        was, held = sides.copy(), excess.copy()
        change, turned = terms.flip(ground, scratch, np.float32(widest), sides, x, excess, before)
        after, chi, found = shape_of(evidence, sides, widest)
        np.testing.assert_array_equal(excess, found)
        assert (change, turned) == (pytest.approx(after - energy, abs=1e-6), chi - euler)
        if rng.random() < 0.3:
            terms.flip_back(evidence.nodes, sides, x, excess, before)
            np.testing.assert_array_equal(sides, was)
            np.testing.assert_array_equal(excess, held)
        else:
            energy, euler = after, chi


@pytest.mark.parametrize("seed", range(4))
def test_every_place_is_taken_from_the_better_outcome(seed):
    """Against all ways to choose, where no place changes the number of components."""
    rng = np.random.default_rng(seed)
    evidence, sides = evidence_of(datasets_synthetic.surface("torus").sample(400, rng=seed).points)
    m, n = len(evidence.cells), len(evidence.points)
    others, used = sides.copy(), np.zeros(n, bool)
    for x in rng.permutation(m):
        beside = [y for y in evidence.links[x] if y < m and sides[y] != sides[x]]
        pair = [x, *beside[:1]]
        if beside and not used[evidence.nodes[pair]].any() and np.count_nonzero(sides != others) < 12:
            others[pair] ^= 1
            used[evidence.nodes[pair]] = True
    apart, first = crossover.places(evidence.nodes, n, sides, others)
    np.testing.assert_array_equal(np.sort(apart), np.flatnonzero(sides != others))
    places = [apart[a:b] for a, b in zip(first[:-1], first[1:])]
    corners = [set(evidence.nodes[place].ravel()) for place in places]
    assert len(places) == 6 and not any(one & two for one, two in itertools.combinations(corners, 2))
    ways = []
    for chosen in itertools.product([False, True], repeat=len(places)):
        way = sides.copy()
        for place in itertools.compress(places, chosen):
            way[place] ^= 1
        ways.append(energy_of(evidence, way))
    excess = repair.excesses(evidence.ground, evidence.between(sides), np.inf, 1)
    crossover.take_better(evidence.ground, np.float32(np.inf), sides, others, excess)
    assert energy_of(evidence, sides) == pytest.approx(min(ways), abs=1e-9)
    np.testing.assert_array_equal(excess, repair.excesses(evidence.ground, evidence.between(sides), np.inf, 1))


def test_many_samples_are_searched_once(part, monkeypatch):
    turns = []
    search = repair._search
    monkeypatch.setattr(repair, "_search", lambda *given: turns.append(given[7]) or search(*given))
    mended(part)
    assert turns[0] == turns[-1] == 0 and sorted(turns[1:-1]) == list(range(1, repair.TURNS))
    turns.clear()
    monkeypatch.setattr(repair, "SMALL", len(part) - 1)
    mended(part)
    assert turns == [0]


def test_threads_do_not_change_the_outcome(part):
    alone, together = mended(part, 1), mended(part, 3)
    np.testing.assert_array_equal(alone[1], together[1])


def test_what_needs_no_mending_is_searched_once(monkeypatch):
    turns = []
    search = repair._search
    monkeypatch.setattr(repair, "_search", lambda *given: turns.append(given[7]) or search(*given))
    mended(datasets_synthetic.surface("sphere").sample(1500, rng=0).points)
    assert turns == [0]
