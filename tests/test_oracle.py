"""The oracle itself: against Qhull, against its second method, and against the theorems of the paper."""

import math
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle, betti_numbers, determinant, minus, orient, power_sign, rank, volume
from scipy.spatial import ConvexHull, Delaunay


def lattice(d, n=8, low=-2, high=2):
    """Small integers: cospherical, collinear and duplicate most of the time."""
    spot = st.tuples(*[st.integers(low, high)] * d)
    return st.lists(st.tuples(spot, st.integers(-3, 3)), min_size=1, max_size=n)


def split(cloud):
    return [p for p, _ in cloud], [w for _, w in cloud]


def hull_facets(oracle):
    return [f for f in oracle.simplices(oracle.dimension - 1) if len(oracle.cofaces(f)) == 1]


@pytest.mark.parametrize("d", [2, 3, 4])
def test_delaunay_in_general_position_is_qhulls(d):
    points = np.random.default_rng(d).normal(size=(4 + 2 * d, d))
    expected = sorted(tuple(sorted(cell)) for cell in Delaunay(points).simplices.tolist())
    assert Oracle(points, method="brute").cells == Oracle(points, method="wrap").cells == expected


@pytest.mark.parametrize("d", [1, 2, 3])
def test_weighted_cells_in_general_position_are_the_lower_hull(d):
    rng = np.random.default_rng(d)
    points, weights = rng.normal(size=(14, d)), rng.normal(size=14)
    hull = ConvexHull(np.column_stack([points, (points**2).sum(axis=1) - weights]))
    lower = hull.simplices[hull.equations[:, d] < 0]
    oracle = Oracle(points, weights)
    assert oracle.cells == sorted(tuple(sorted(cell)) for cell in lower.tolist())
    assert oracle.hidden


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_both_methods_agree_on_degenerate_input(d, data):
    points, weights = split(data.draw(lattice(d)))
    brute, wrap = Oracle(points, weights, "brute"), Oracle(points, weights, "wrap")
    assert brute.cells == wrap.cells


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_cells_tile_the_hull(d, data):
    """Volumes add up to that of the hull, and each facet lies between two cells or has all points on one side."""
    oracle = Oracle(*split(data.draw(lattice(d))))
    k = oracle.dimension
    if k == 0:
        assert len(oracle.cells) == 1
        return
    facets = hull_facets(oracle)
    for facet in facets:
        sides = {oracle.oriented((*facet, q)) for q in range(len(oracle.points))}
        assert len(sides - {0}) == 1
    apex = oracle.flat[0]
    total = sum(abs(volume(*(oracle.flat[i] for i in cell))) for cell in oracle.cells)
    assert total == sum(abs(volume(apex, *(oracle.flat[i] for i in facet))) for facet in facets)
    assert all(len(oracle.cofaces(f)) in (1, 2) for f in oracle.simplices(k - 1))


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_classes_of_table_5_1_are_those_of_the_complex(d, data):
    oracle = Oracle(*split(data.draw(lattice(d, n=7))))
    spectrum = oracle.spectrum()
    for alpha in [spectrum[0] - 1, *spectrum[:: max(1, len(spectrum) // 4)], spectrum[-1]]:
        inside = oracle.complex(alpha)
        for k in range(oracle.dimension + 1):
            for simplex in oracle.simplices(k):
                kind = oracle.classify(simplex, alpha)
                principal = simplex in inside and not any(u in inside for u in oracle.cofaces(simplex))
                assert (simplex in inside) == (kind != "exterior")
                assert (principal and k < oracle.dimension) == (kind == "singular")


@pytest.mark.parametrize("d", [2, 3])
def test_exposed_by_section_2_is_singular_or_regular(d):
    """Theorem 3.3 in general position, for every subset of the points: what is exposed is a simplex of R."""
    rng = np.random.default_rng(d)
    points, weights = rng.normal(size=(7, d)), rng.normal(size=7) / 4
    oracle = Oracle(points, weights)
    for alpha in (-0.5, 0.0, 0.2, 0.7, 2.0, 50.0):
        for k in range(d):
            known = set(oracle.simplices(k))
            for simplex in combinations(range(7), k + 1):
                shape = simplex in known and oracle.classify(simplex, alpha) in ("singular", "regular")
                assert oracle.exposed(simplex, alpha) == shape


@pytest.mark.parametrize("d", [2, 3])
def test_sizes_are_monotone(d):
    """Theorem 3.2."""
    rng = np.random.default_rng(d)
    oracle = Oracle(rng.normal(size=(9, d)), rng.normal(size=9))
    for k in range(d):
        for simplex in oracle.simplices(k):
            assert all(oracle.rho(simplex) < oracle.rho(u) for u in oracle.cofaces(simplex))


def test_perturbed_sign_is_that_of_a_tiny_perturbation():
    """The symbolic rule against a numeric one: weights raised by 10^-50, 10^-100, ... decide alike."""
    grid = [(Fraction(x), Fraction(y), Fraction(z)) for x in range(2) for y in range(2) for z in range(2)]
    plain = [sum(c * c for c in p) for p in grid]
    tiny = [h - Fraction(1, 10 ** (50 * (i + 1))) for i, h in enumerate(plain)]
    for cell in combinations(range(8), 4):
        if orient(*(grid[i] for i in cell)):
            for q in set(range(8)) - set(cell):
                assert power_sign(grid, plain, cell, q) == power_sign(grid, tiny, cell, q)


def test_of_equals_the_lower_index_wins():
    square = [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert (0, 3) in Oracle(square).simplices(1)
    assert (0, 3) in Oracle([square[i] for i in (1, 0, 3, 2)]).simplices(1)
    middle = [(0, 0), (1, 0), (2, 0)]
    assert Oracle(middle, [0, -1, 0]).cells == [(0, 2)]
    assert Oracle([middle[i] for i in (1, 0, 2)], [-1, 0, 0]).cells == [(0, 1), (0, 2)]


def test_of_duplicates_the_heaviest_then_the_first_survives():
    assert Oracle([(0, 0)] * 4, [1, 2, 2, 0]).cells == [(1,)]
    assert Oracle([(0, 0), (1, 0), (0, 1), (0, 0)], [0, 0, 0, 1]).hidden == [0]
    assert Oracle([(0, 0), (1, 0), (0, 1), (0, 0)]).hidden == [3]


def test_flat_input_lives_in_its_affine_hull():
    tilted = [(0, 0, 0), (1, 1, 0), (0, 1, 1), (1, 2, 1), (2, 2, 0)]
    assert Oracle(tilted).dimension == 2
    line = Oracle([(3, 3, 3), (1, 1, 1), (2, 2, 2)])
    assert (line.dimension, line.cells) == (1, [(0, 2), (1, 2)])
    assert line.rho((0, 2)) == Fraction(3, 4)


def test_size_of_known_simplices():
    triangle = Oracle([(0, 0), (4, 0), (0, 3)])
    assert triangle.rho((0, 1, 2)) == Fraction(25, 4)
    assert triangle.rho((1, 2)) == Fraction(25, 4) and not triangle.attached((1, 2))
    obtuse = Oracle([(0, 0), (4, 0), (2, 1)])
    assert obtuse.attached((0, 1)) and obtuse.mu_lower((0, 1)) == obtuse.rho((0, 1, 2))
    assert obtuse.mu_upper((0, 1)) == math.inf
    assert Oracle([(0, 0), (4, 0)], [1, 9]).orthosphere((0, 1)) == ((1, 0), 0)


def test_betti_numbers_of_known_complexes():
    faces = {f for t in combinations(range(4), 3) for k in (1, 2, 3) for f in combinations(t, k)}
    assert betti_numbers(faces, 3) == [1, 0, 1, 0]
    ring = {(i,) for i in range(5)} | {tuple(sorted((i, (i + 1) % 5))) for i in range(5)} | {(9,)}
    assert betti_numbers(ring, 2) == [2, 1, 0]


@given(st.lists(st.lists(st.integers(-3, 3), min_size=4, max_size=4), min_size=4, max_size=4))
@settings(max_examples=50, deadline=None)
def test_determinant_by_elimination_is_leibniz(matrix):
    from itertools import permutations

    leibniz = 0
    for order in permutations(range(4)):
        inversions = sum(order[i] > order[j] for i, j in combinations(range(4), 2))
        leibniz += (-1) ** inversions * math.prod(matrix[i][j] for i, j in enumerate(order))
    assert determinant(matrix) == leibniz
    assert (rank(matrix) == 4) == (leibniz != 0)


def test_orientation_convention():
    assert orient((0, 0), (1, 0), (0, 1)) == 1
    assert orient((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)) == 1
    assert volume((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)) == Fraction(1, 6)
    assert minus((3, 2), (1, 1)) == (2, 1)
