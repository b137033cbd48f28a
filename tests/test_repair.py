"""Repair: several searches, of which the best is kept, place by place."""

import itertools

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon import repair
from recon._kernels import components, crossover, least_walls, relabel
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
    before = evidence.excesses(evidence.between(sides), np.inf)
    excess, _ = evidence.repair(sides, before, evidence.pieces(sides), np.inf)
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
    monkeypatch.setattr(repair, "ROUGH", 1.0)
    single = []
    for turn in range(repair.FIRST):
        monkeypatch.setattr(repair, "_search", lambda *given, turn=turn: search(*given[:6], turn, *given[7:]))
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


@pytest.mark.parametrize("seed", range(3))
def test_components_are_counted_by_their_atoms(seed):
    """Whatever is taken of places, some of which cut components or join them."""
    rng = np.random.default_rng(seed)
    evidence, sides = evidence_of(datasets_synthetic.surface("torus").sample(300, rng=seed).points)
    sides[rng.permutation(len(sides))[:60]] ^= 1
    others = sides.copy()
    others[rng.permutation(len(evidence.cells))[:25]] ^= 1
    apart, first = crossover.places(evidence.nodes, len(evidence.points), sides, others)
    where, side, size, pairs = crossover.atoms(evidence.links, sides, apart, first)
    assert len(first) > 5 and size.sum() == len(sides)
    way, taken, seen, alone = sides.copy(), side.copy(), set(), 0
    pieces = evidence.pieces(way)[0]
    for _ in range(40):
        i = rng.integers(len(first) - 1)
        own = np.flatnonzero(where == i), pairs[where[pairs[:, 0]] == i]
        for body in (2, 30, 300):
            loose = crossover.count_loose(taken, size, *own, body)
            way[apart[first[i] : first[i + 1]]] ^= 1
            taken[own[0]] ^= 1
            count, _, sizes, _ = evidence.pieces(way)
            assert crossover.count_pieces(taken, size, pairs, body) == (count, (sizes[:count] >= body).sum())
            if loose >= 0:
                assert crossover.count_loose(taken, size, *own, body) - loose == count - pieces
                alone += 1
            pieces = count
            seen.add(pieces)
    assert len(seen) > 3 and alone > 10


def test_relabelling_lowers_walls_and_ties_and_keeps_what_is_far(part):
    evidence, sides = evidence_of(part)
    rough = np.flatnonzero(repair.excesses(evidence.ground, evidence.between(sides), np.inf, 1))
    fresh = sides.copy()
    relabel.relabel(evidence.ground, fresh, *evidence.poles[:2], rough)
    near, corners = least_walls.cells_near(evidence.ground, rough, relabel.RINGS, np.full(len(sides), -1, np.int32))
    flipped = np.flatnonzero(fresh != sides)
    assert len(flipped) > 0 and np.isin(flipped, near).all()
    walls = [
        sum(terms.wall(evidence.points, evidence.spacing, *face) for face in evidence.faces(evidence.between(labels)))
        for labels in (sides, fresh)
    ]
    assert walls[1] < walls[0]
    pole, anti, _ = (part[corners] for part in evidence.poles)
    broken = sum(
        (sides[one] != sides[other]) & (fresh[one] != sides[one]) for one, other in ((pole, anti), (anti, pole))
    )
    assert walls[1] + relabel.TIE * broken.sum() <= walls[0] + 1e-9


def test_searches_are_repeated_where_more_than_a_few_samples_want_mending(part, monkeypatch):
    turns = []
    search = repair._search
    monkeypatch.setattr(repair, "_search", lambda *given: turns.append(given[6]) or search(*given))
    mended(part)
    assert sorted(turns) == list(range(repair.LAST + 1))
    turns.clear()
    monkeypatch.setattr(repair, "ROUGH", 0.5)
    mended(part)
    assert turns == [0]


def test_samples_of_an_island_that_is_absorbed_are_reached_again():
    points = datasets_synthetic.surface("trefoil").sample(400, rng=1).points  # too few for all of the knot
    report = recon.reconstruct(points, surface="closed", denoise=False).report
    assert report["surface"]["buried_points"] == 0


def test_threads_do_not_change_the_outcome(part):
    alone, together = mended(part, 1), mended(part, 3)
    np.testing.assert_array_equal(alone[1], together[1])


def test_what_needs_no_mending_is_searched_once(monkeypatch):
    turns = []
    search = repair._search
    monkeypatch.setattr(repair, "_search", lambda *given: turns.append(given[6]) or search(*given))
    mended(datasets_synthetic.surface("sphere").sample(1500, rng=0).points)
    assert turns == [0]
