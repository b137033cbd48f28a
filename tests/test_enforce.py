"""Enforced simplices: in the exact triangulation, or proved impossible in rational numbers."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle, rank

import recon
import weighting
from recon.contracts import DegenerateInput, InvalidInput

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
MOTHER = [[0, 0], [12, 0], [0, 12], [2, 2], [8, 2], [2, 8]]  # of all examples: two triangles, one inside the other
LEFT = [[3, 4, 5], [0, 1, 4], [0, 3, 4], [1, 2, 5], [1, 4, 5], [0, 2, 3], [2, 3, 5]]
RIGHT = [[3, 4, 5], [0, 1, 3], [1, 3, 4], [1, 2, 4], [2, 4, 5], [0, 2, 5], [0, 3, 5]]


def contradicts(points, contradiction):
    """The conditions of each simplex, and their sum: 0 > 0. Written from the definition, in Fractions."""
    total = {}
    gain = 0
    for simplex, y in zip(contradiction.simplices, contradiction.multipliers, strict=True):
        assert sum(y.values()) == 0
        for axis in range(len(points[0])):
            assert sum(value * Fraction(float(points[j][axis])) for j, value in y.items()) == 0
        outside = [value for j, value in y.items() if j not in simplex]
        assert all(value >= 0 for value in outside)
        gain += sum(outside)
        for j, value in y.items():
            total[j] = total.get(j, 0) + value
    return gain > 0 and not any(total.values())


def simplices_of(oracle):
    return {simplex for k in range(oracle.dimension + 1) for simplex in oracle.simplices(k)}


@st.composite
def clouds(draw, largest=8):
    d = draw(st.integers(1, 3))
    coordinate = st.integers(-3, 3)
    points = draw(st.lists(st.tuples(*[coordinate] * d), min_size=d + 1, max_size=largest))
    weights = draw(st.lists(st.integers(-4, 4), min_size=len(points), max_size=len(points)))
    return points, weights


@settings(deadline=None, max_examples=120)
@given(clouds(), st.data())
def test_weights_hold_every_simplex_or_a_proof_holds_that_none_do(cloud, data):
    points, weights = cloud
    n, d = len(points), len(points[0])
    row = st.lists(st.integers(0, n - 1), min_size=1, max_size=d + 1, unique=True)
    asked = data.draw(st.lists(row, min_size=1, max_size=4))
    edges = [[[b - a for a, b in zip(points[t[0]], points[i])] for i in t[1:]] for t in asked]
    if any(e and rank(e) < len(e) for e in edges):
        with pytest.raises(InvalidInput, match="dependent"):
            weighting.enforce(points, weights, asked)
        return
    try:
        found = weighting.enforce(points, weights, asked)
    except weighting.NotRegular as error:
        assert contradicts(points, error.contradiction)
        assert error.contradiction.holds(points)
        assert set(error.contradiction.simplices) <= {tuple(sorted(t)) for t in asked}
        return
    assert {tuple(sorted(t)) for t in asked} <= simplices_of(Oracle(points, found))


@settings(deadline=None, max_examples=80)
@given(clouds(), st.data())
def test_what_some_weights_hold_is_never_called_impossible(cloud, data):
    points, weights = cloud
    held = sorted(simplices_of(Oracle(points, weights)))
    asked = data.draw(st.lists(st.sampled_from(held), min_size=1, max_size=6, unique=True))
    found = weighting.enforce(points, None, asked)
    assert set(asked) <= simplices_of(Oracle(points, found))


@settings(deadline=None, max_examples=60)
@given(clouds(7), st.data())
def test_what_is_enforced_in_k0_is_in_the_alpha_complex_at_zero(cloud, data):
    points, weights = cloud
    held = sorted(simplices_of(Oracle(points, weights)))
    asked = data.draw(st.lists(st.sampled_from(held), min_size=1, max_size=4, unique=True))
    found = weighting.enforce(points, weights, asked, where="K_0")
    assert set(asked) <= Oracle(points, found).complex(0)


@settings(deadline=None, max_examples=40)
@given(clouds())
def test_weights_that_hold_the_simplices_come_back_as_they_are(cloud):
    points, weights = cloud
    held = Oracle(points, weights)
    assert weighting.enforce(points, weights, held.cells).tolist() == weights


def test_the_change_is_the_least_in_sum():
    # The middle point has to leave: its height rises over that of the chord.
    assert weighting.enforce([[0.0], [1.0], [2.0]], None, [[0, 2]]).tolist() == pytest.approx([0, -1, 0], abs=2e-6)
    # An edge of length 2: two balls that meet cost 1 + 1, and so does one of radius 2 with one of radius 0, at 4.
    found = weighting.enforce([[0.0], [2.0]], None, [[0, 1]], where="K_0")
    assert 2.0 <= found.sum() <= 2.0 * (1 + 1 / 8)
    assert found.min() > 0.7


def test_either_diagonal_of_a_square_can_be_had_and_not_both():
    for diagonal in ([0, 2], [1, 3]):
        found = weighting.enforce(SQUARE, None, [diagonal])
        assert tuple(diagonal) in simplices_of(Oracle(SQUARE, found))
        assert np.abs(found).sum() < 1e-5
    with pytest.raises(weighting.NotRegular, match=r"\(0, 2\) and \(1, 3\).*meet outside") as caught:
        weighting.enforce(SQUARE, None, [[1, 3], [2, 0]])
    assert contradicts(SQUARE, caught.value.contradiction)
    assert isinstance(caught.value, DegenerateInput)


@pytest.mark.parametrize("triangulation", [LEFT, RIGHT])
def test_the_mother_of_all_examples_is_not_regular(triangulation):
    with pytest.raises(weighting.NotRegular, match="3 in all") as caught:
        weighting.enforce(MOTHER, None, triangulation)
    assert contradicts(MOTHER, caught.value.contradiction)
    assert max(abs(value) for y in caught.value.contradiction.multipliers for value in y.values()) == 2


def test_the_mother_of_all_examples_is_regular_once_turned_one_way():
    c, s = np.cos(0.05), np.sin(0.05)
    center = np.full(2, 4.0)
    for turn, regular, other in ((-s, LEFT, RIGHT), (s, RIGHT, LEFT)):
        points = np.array(MOTHER, float)
        points[3:] = center + (points[3:] - center) @ np.array([[c, turn], [-turn, c]])
        with pytest.raises(weighting.NotRegular) as caught:
            weighting.enforce(points, None, other)
        assert contradicts(points, caught.value.contradiction)
        found = Oracle(points, weighting.enforce(points, None, regular))
        assert found.cells == sorted(tuple(sorted(t)) for t in regular)


def test_an_edge_through_a_triangle_is_refused_with_its_proof():
    points = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1]]
    with pytest.raises(weighting.NotRegular, match=r"\(0, 1, 2\) and \(3, 4\)|\(3, 4\) and \(0, 1, 2\)") as caught:
        weighting.enforce(points, None, [[0, 1, 2], [3, 4]])
    assert contradicts(points, caught.value.contradiction)
    for alone in ([[0, 1, 2]], [[3, 4]]):
        assert tuple(alone[0]) in simplices_of(Oracle(points, weighting.enforce(points, None, alone)))


def test_a_point_inside_a_triangle_is_hidden_for_it_and_cannot_be_kept():
    points = [[0, 0], [4, 0], [0, 4], [1, 1]]
    assert Oracle(points, weighting.enforce(points, None, [[0, 1, 2]])).hidden == [3]
    with pytest.raises(weighting.NotRegular):
        weighting.enforce(points, None, [[0, 1, 2], [3]])


def test_of_two_points_in_one_spot_either_can_be_had():
    points = [[0, 0], [1, 0], [0, 1], [1, 0]]
    for wanted, hidden in ((1, 3), (3, 1)):
        assert Oracle(points, weighting.enforce(points, None, [[0, wanted]])).hidden == [hidden]
    with pytest.raises(weighting.NotRegular, match=r"\(1,\) and \(3,\)|\(3,\) and \(1,\)"):
        weighting.enforce(points, None, [[1], [3]])


def test_points_in_one_plane_of_space_have_their_triangulation_there():
    points = np.array([[x, y, x + 2 * y] for x, y in SQUARE], float)
    assert Oracle(points, weighting.enforce(points, None, [[1, 3]])).cells == [(0, 1, 3), (1, 2, 3)]
    with pytest.raises(weighting.NotRegular):
        weighting.enforce(points, None, [[1, 3], [0, 2]])


def test_four_dimensions_serve_as_well():
    rng = np.random.default_rng(0)
    points = rng.uniform(size=(30, 4))
    there = {tuple(e) for e in recon.alpha_complex(points).simplices(1).tolist()}
    edge = next(e for e in combinations(range(30), 2) if e not in there)
    found = weighting.enforce(points, None, [edge])
    assert edge in {tuple(e) for e in recon.alpha_complex(points, found).simplices(1).tolist()}


def test_among_hundreds_of_crossing_edges_a_few_are_named_soon():
    rng = np.random.default_rng(3)
    points, edges = rng.uniform(size=(400, 2)), rng.integers(0, 400, (300, 2))
    with pytest.raises(weighting.NotRegular) as caught:
        weighting.enforce(points, None, edges[edges[:, 0] != edges[:, 1]])
    assert contradicts(points, caught.value.contradiction)
    assert len(caught.value.contradiction.simplices) < 10


def test_a_triangulation_of_a_thousand_points_is_got_back_from_its_cells_alone():
    rng = np.random.default_rng(1)
    points, weights = rng.uniform(size=(1000, 2)), rng.uniform(0, 1e-3, 1000)
    cells = np.sort(recon.regular_triangulation(points, weights).cells, axis=1)
    found = weighting.enforce(points, None, cells)
    assert set(map(tuple, np.sort(recon.regular_triangulation(points, found).cells, axis=1))) == set(map(tuple, cells))
    assert np.abs(found).sum() < weights.sum()


def test_long_edges_of_a_cloud_in_space_are_enforced_by_few_changes():
    points = np.random.default_rng(2).uniform(size=(2000, 3))
    near = weighting.neighbors(points, 24)
    asked = np.column_stack([near.rows[::200], near.rows[near.index[::200, -1]]])
    found = weighting.enforce(points, None, asked)
    recon.certify(recon.regular_triangulation(points, found))
    held = {tuple(e) for e in recon.alpha_complex(points, found).simplices(1).tolist()}
    assert {tuple(e) for e in np.sort(asked, axis=1).tolist()} <= held
    assert np.count_nonzero(found) < 60


@pytest.mark.parametrize("k", [-500, -40, 30, 300])
def test_scaling_by_a_power_of_two_scales_the_weights_by_its_square(k):
    points = np.random.default_rng(3).uniform(-1, 1, (12, 2)).round(3)
    plain = weighting.enforce(points, None, [[0, 1]])
    assert plain.any()
    scaled = weighting.enforce(np.ldexp(points, k), None, [[0, 1]])
    assert np.array_equal(scaled, np.ldexp(plain, 2 * k))


def test_large_coordinates_do_no_harm():
    points = np.random.default_rng(4).uniform(0, 10, (200, 3)).round(2) + [512_000.25, 5_403_000.5, 300.0]
    near = weighting.neighbors(points, 24)
    asked = np.column_stack([near.rows[:2], near.rows[near.index[:2, -1]]])  # two that are skew never contradict
    held = recon.alpha_complex(points, weighting.enforce(points, None, asked, where="K_0"))
    inside = held.simplices(1)[held.classify(1) != recon.EXTERIOR]
    assert {tuple(e) for e in np.sort(asked, axis=1).tolist()} <= {tuple(e) for e in inside.tolist()}


@pytest.mark.parametrize(
    ("simplices", "message"),
    [
        ([[0, 4]], "entry 0 is out of range 0 .. 3"),
        ([[0, 1], [-1, 2]], "entry 1 is out of range"),
        ([[0, 1, 1]], "entry 0 has a vertex twice"),
        ([[0.0, 1.0]], "entry 0 is no row of int"),
        ([[]], "entry 0 is no row of int"),
        ([0, 1], "entry 0 is no row of int"),
        (3, "expected rows of int"),
        ([[0, 1, 2, 3]], "dependent"),
        ([["a", "b"]], "entry 0 is no row of int"),
    ],
)
def test_bad_simplices_are_refused_in_one_line(simplices, message):
    with pytest.raises(InvalidInput, match=message) as caught:
        weighting.enforce(SQUARE, None, simplices)
    assert "\n" not in str(caught.value)


def test_bad_options_are_refused():
    with pytest.raises(InvalidInput, match="where: expected 'R' or 'K_0', got 'W'"):
        weighting.enforce(SQUARE, None, [[0, 2]], where="W")
    with pytest.raises(InvalidInput, match="weights"):
        weighting.enforce(SQUARE, [1.0], [[0, 2]])
    with pytest.raises(InvalidInput, match="points"):
        weighting.enforce([[np.nan, 0.0]], None, [[0]])


def test_nothing_asked_for_changes_nothing():
    assert weighting.enforce(SQUARE, [1, 2, 3, 4], []).tolist() == [1, 2, 3, 4]


def test_a_wrong_proof_does_not_hold():
    good = ((0, 2), (1, 3)), ({0: -1, 2: -1, 1: 1, 3: 1}, {0: 1, 2: 1, 1: -1, 3: -1})
    assert weighting.Contradiction(*good).holds(SQUARE)
    for bad in (
        (good[0], ({0: -1, 2: -1, 1: 1, 3: 1},)),  # the sum is not zero
        (good[0], ({}, {})),  # nothing is positive
        (good[0], ({0: -2, 2: -1, 1: 1, 3: 1}, {0: 2, 2: 1, 1: -1, 3: -1})),  # no affine dependence
        (((0, 2), (0, 2)), good[1]),  # negative outside
    ):
        assert not weighting.Contradiction(*bad).holds(SQUARE)
    assert not weighting.Contradiction(*good).holds([[0, 0], [1, 0], [1, 1], [0, 2]])
