"""Neighbours, spacing, grading, adaptive weights: closed forms on lattices, slow twins, symmetries, bad input."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.distance import cdist

import datasets_synthetic
import recon
import weighting

crowds = hnp.arrays(
    np.int64, st.tuples(st.integers(1, 40), st.sampled_from([1, 2, 3, 4])), elements=st.integers(-3, 3)
).map(lambda a: a.astype(float))
solid_crowds = hnp.arrays(
    np.int64, st.tuples(st.integers(1, 40), st.sampled_from([2, 3])), elements=st.integers(-3, 3)
).map(lambda a: a.astype(float))


def torus(n=1500, **how):
    return datasets_synthetic.surface("torus").sample(n, rng=7, **how).points


def square_lattice(side=24):
    x, y = np.meshgrid(np.arange(float(side)), np.arange(float(side)), indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(side * side)])


def middle(side, margin):
    inner = np.zeros((side, side), bool)
    inner[margin:-margin, margin:-margin] = True
    return inner.ravel()


TERMS = {
    "spacing": weighting.spacing,
    "covering": weighting.covering,
    "noise": weighting.noise,
    "thickness": weighting.thickness,
    "adaptive": weighting.adaptive_weights,
    "adaptive covering": lambda p: weighting.adaptive_weights(p, radius="covering"),
    "curvature": lambda p: np.abs(weighting.curvature(p).principal),
    "curvature error": lambda p: weighting.curvature(p).error,
    "outliers": weighting.outliers,
}
DIMENSION = {"spacing": 1, "covering": 1, "noise": 1, "thickness": 1, "adaptive": 2, "adaptive covering": 2}
DIMENSION |= {"curvature": -1, "curvature error": -1, "outliers": 0}


# --- neighbours ---------------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(crowds, st.integers(1, 12))
def test_neighbours_are_the_nearest_distinct_points(points, k):
    hood = weighting.neighbors(points, k)
    assert np.array_equal(np.unique(hood.points, axis=0), np.unique(points, axis=0))
    assert len(hood.points) == len(np.unique(points, axis=0))
    assert hood.k == min(k, len(hood.points) - 1)
    distances = cdist(hood.points, hood.points)
    np.fill_diagonal(distances, np.inf)
    assert np.allclose(hood.distance, np.sort(distances, axis=1)[:, : hood.k], rtol=1e-15)
    rows = np.arange(len(hood.points))[:, None]
    assert np.allclose(distances[rows, hood.index], hood.distance, rtol=1e-15)
    assert all(len(set(row)) == hood.k for row in hood.index.tolist())


@settings(deadline=None)
@given(crowds)
def test_every_row_finds_its_point_and_every_point_its_first_row(points):
    hood = weighting.neighbors(points, 1)
    assert np.array_equal(hood.points[hood.inverse], points)
    assert np.array_equal(points[hood.rows], hood.points)
    first = [min(np.flatnonzero(hood.inverse == i)) for i in range(len(hood.points))]
    assert hood.rows.tolist() == first


def test_negative_zero_is_zero():
    assert len(weighting.neighbors([[0.0, -0.0], [-0.0, 0.0], [1.0, 1.0]], 1).points) == 2


@settings(deadline=None)
@given(crowds, st.randoms(use_true_random=False))
def test_the_neighbourhood_does_not_depend_on_the_order_of_the_rows(points, random):
    order = list(range(len(points)))
    random.shuffle(order)
    one, other = weighting.neighbors(points, 3), weighting.neighbors(points[order], 3)
    for name in ("points", "index", "distance"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


def test_distances_that_underflow_are_no_reason_to_be_ones_own_neighbour():
    hood = weighting.neighbors([[1.0, 1e-200 * i, 0.0] for i in range(6)], 5)
    assert (hood.index != np.arange(6)[:, None]).all()
    assert weighting.adaptive_weights(hood).tolist() == [0.0] * 6


def test_a_neighbourhood_is_used_as_it_is_or_refused():
    points = torus(300)
    hood = weighting.neighbors(points, 24)
    assert weighting.neighbors(hood, 8) is hood
    for term in TERMS.values():
        assert np.array_equal(term(hood), term(points))
    with pytest.raises(recon.InvalidInput, match="24 are needed"):
        weighting.covering(weighting.neighbors(points, 8))


# --- spacing ------------------------------------------------------------------------------------------------------


def test_plain_spacing_of_the_square_lattice():
    # the 8th neighbour is at sqrt(2), the 4th at 1, the 12th at 2
    inner = middle(24, 3)
    for k, reach in ((4, 1.0), (8, math.sqrt(2)), (12, 2.0)):
        found = weighting.spacing(square_lattice(), k=k, rounds=0)[inner]
        assert np.allclose(found, math.sqrt(math.pi / k) * reach, rtol=1e-14)


def test_plain_spacing_of_an_even_curve_is_its_step():
    turn = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    assert np.allclose(weighting.spacing(circle), 2 * np.pi / 400, rtol=1e-3)


def test_smoothing_is_the_mean_logarithm_over_the_point_and_its_neighbours():
    points = torus(300)
    hood = weighting.neighbors(points, 8)
    logs = np.log(weighting.spacing(hood, rounds=0)[hood.rows])
    slow = np.array([np.mean(logs[[i, *hood.index[i]]]) for i in range(len(logs))])
    assert np.allclose(weighting.spacing(hood, rounds=1), np.exp(slow)[hood.inverse], rtol=1e-13)


def test_spacing_follows_the_density_of_random_samples():
    # one sample owns spacing^2 of the area, but neighbours crowd: a tenth less in the mean; sd of the plain estimate 0.18
    surface = datasets_synthetic.surface("sphere")
    points = surface.sample(20000, rng=1).points
    found = np.log(weighting.spacing(points) / math.sqrt(surface.area / 20000))
    assert -0.12 < found.mean() < 0.0
    assert found.std() < 0.13 < 0.17 < np.log(weighting.spacing(points, rounds=0)).std() < 0.19


def test_spacing_of_scan_lines_is_right_while_the_neighbours_reach_the_next_line():
    lines = square_lattice(60) * [1.0, 0.2, 1.0]
    inner = middle(60, 12)
    assert np.allclose(weighting.spacing(lines, k=24)[inner], math.sqrt(0.2), rtol=0.1)


def test_quantised_and_repeated_samples_count_once():
    points = np.round(torus(2000, spacing="blue") / 0.01) * 0.01
    twice = np.concatenate([points, points[::3], points[::5]])
    assert np.array_equal(weighting.spacing(twice)[: len(points)], weighting.spacing(points))


# --- grading ------------------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(crowds, st.integers(0, 2**32 - 1), st.sampled_from([0.25, 0.5, 0.75]))
def test_grading_is_the_shortest_path_from_all_samples_at_once(points, seed, theta):
    hood = weighting.neighbors(points, 4)
    weights = np.random.default_rng(seed).normal(size=len(points)) * 5
    found = weighting.graded(hood, weights, theta, 4)
    m = len(hood.points)
    start = np.array([weights[hood.inverse == i].min() for i in range(m)])
    rows = np.concatenate([np.repeat(np.arange(m), hood.k), np.full(m, m)])
    columns = np.concatenate([hood.index.ravel(), np.arange(m)])
    lengths = np.concatenate([theta * hood.distance.ravel() ** 2, start - start.min() + 1.0])
    graph = coo_matrix((lengths, (rows, columns)), shape=(m + 1, m + 1)).tocsr()
    graph = graph.maximum(graph.T)
    slow = dijkstra(graph, directed=False, indices=m)[:m] + start.min() - 1.0
    assert np.allclose(found, slow[hood.inverse], atol=1e-12)


@settings(deadline=None)
@given(solid_crowds, st.sampled_from(["spacing", "covering"]))
def test_no_neighbour_hides_another(points, radius):
    hood = weighting.neighbors(points, 24)
    weights = weighting.adaptive_weights(hood, radius=radius)[hood.rows]
    k = min(8, hood.k)
    step = weights[hood.index[:, :k]] - weights[:, None]
    assert (np.abs(step) <= 0.5 * hood.distance[:, :k] ** 2 * (1 + 1e-12)).all()


def test_grading_lowers_and_keeps_what_is_graded():
    points = torus(400)
    graded = weighting.graded(points, np.random.default_rng(0).random(400))
    assert np.array_equal(weighting.graded(points, graded), graded)
    assert (graded <= 1).all() and (graded >= 0).all()


# --- adaptive weights ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("density", [1, 10, 50])
@pytest.mark.parametrize("spacing", ["random", "blue"])
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_every_sample_is_a_vertex_of_the_triangulation(density, spacing, noise):
    points = torus(1500, density=density, spacing=spacing, noise=noise)
    for radius in ("spacing", "covering"):
        weights = weighting.adaptive_weights(points, radius=radius)
        assert len(recon.regular_triangulation(points, weights).hidden) == 0


@pytest.mark.data
@pytest.mark.skipif("RECON_DATA" not in os.environ, reason="RECON_DATA is not set")
@pytest.mark.parametrize(
    "name", ["points/kitten.xyz", "points/horse.ply", "points/bunny_5000", "points/oni.pwn", "points/urban.las"]
)
def test_every_scanned_point_is_a_vertex_of_the_triangulation(name):
    if name.endswith(".las"):
        pytest.importorskip("laspy")
    points = np.unique(recon.read_points(Path(os.environ["RECON_DATA"]) / name).points, axis=0)
    for radius in ("spacing", "covering"):
        weights = weighting.adaptive_weights(points, radius=radius)
        assert len(recon.regular_triangulation(points, weights).hidden) == 0


@pytest.mark.parametrize("radius", ["spacing", "covering"])
def test_a_cap_holds_balls_below_the_radius_of_curvature(radius):
    points = datasets_synthetic.surface("sphere").sample(400, rng=0, spacing="blue").points  # spacing 0.18
    free = weighting.adaptive_weights(points, radius=radius)
    capped = weighting.adaptive_weights(points, radius=radius, cap=0.1)
    assert np.sqrt(free).min() > 0.105
    assert np.allclose(np.sqrt(capped), 0.1, rtol=0.1)
    assert np.array_equal(weighting.adaptive_weights(points, radius=radius, cap=1.0), free)


@settings(max_examples=200, deadline=None)
@given(solid_crowds, st.sampled_from(["spacing", "covering"]), st.sampled_from([1.0, 2.0**-300, 2.0**300]))
def test_weights_are_finite_whatever_the_points(points, radius, scale):
    weights = weighting.adaptive_weights(points * scale, radius=radius)
    assert np.isfinite(weights).all() and (weights >= 0).all()
    assert weights.any() == (len(np.unique(points, axis=0)) > 1)


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_weights_come_in_any_dimension(dimension):
    points = np.random.default_rng(0).random((60, dimension))
    assert (weighting.adaptive_weights(points) > 0).all()


def test_a_cloud_far_away_from_a_lone_point_is_weighed_as_if_alone():
    points = torus(1000)
    far = np.concatenate([points, [[1e12, 0.0, 0.0]]])
    for radius in ("spacing", "covering"):
        alone = weighting.adaptive_weights(points, radius=radius)
        assert np.allclose(weighting.adaptive_weights(far, radius=radius)[:-1], alone, rtol=1e-9)


# --- symmetries of every term -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TERMS)
def test_terms_do_not_depend_on_the_order_of_the_samples(name):
    points = np.round(torus(600, noise=0.01, outliers=0.02) * 64) / 64  # with ties
    order = np.random.default_rng(3).permutation(len(points))
    assert np.array_equal(TERMS[name](points)[order], TERMS[name](points[order]), equal_nan=True)


@pytest.mark.parametrize("name", TERMS)
@pytest.mark.parametrize("power", [-40, 3, 200])
def test_terms_scale_exactly_with_powers_of_two(name, power):
    points = torus(600, noise=0.01, outliers=0.02)
    found = TERMS[name](points * 2.0**power)
    assert np.array_equal(found, TERMS[name](points) * 2.0 ** (power * DIMENSION[name]))


@pytest.mark.parametrize("name", [name for name in TERMS if name != "thickness"])
def test_terms_do_not_change_under_an_exact_translation(name):
    points = np.round(torus(600, noise=0.01, outliers=0.02) * 2**20) / 2**20
    assert np.array_equal(TERMS[name](points), TERMS[name](points + [2.0**19, -(2.0**22), 12.0]))


@pytest.mark.parametrize("name", TERMS)
def test_terms_do_not_depend_on_threads(name):
    points = torus(9000)
    calls = {
        "adaptive covering": lambda t: weighting.adaptive_weights(points, radius="covering", threads=t),
        "adaptive": lambda t: weighting.adaptive_weights(points, threads=t),
        "curvature": lambda t: weighting.curvature(points, threads=t).principal,
        "curvature error": lambda t: weighting.curvature(points, threads=t).error,
    }
    call = calls.get(name, lambda t: TERMS[name](points, threads=t))
    assert np.array_equal(call(1), call(3))


# --- bad input ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TERMS)
@pytest.mark.parametrize("points", [[], [[np.nan, 0, 0]], [1.0, 2.0], [["a", "b", "c"]], [[1e200, 0, 0]]])
def test_terms_refuse_malformed_points(name, points):
    with pytest.raises(recon.InvalidInput):
        TERMS[name](points)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda p: weighting.neighbors(p, 0), "k: expected a whole number, at least 1, got 0"),
        (lambda p: weighting.neighbors(p, threads=0), "threads"),
        (lambda p: weighting.spacing(p, rounds=-1), "rounds"),
        (lambda p: weighting.adaptive_weights(p, radius="huge"), "radius"),
        (lambda p: weighting.curvature(p, k=5), "at least 6"),
        (lambda p: weighting.noise(p, k=5), "at least 6"),
        (lambda p: weighting.outliers(p, excess=1.0), "excess"),
        (lambda p: weighting.graded(p, [1.0]), "weights"),
        (lambda p: weighting.graded(p, np.ones(50), theta=-0.1), "theta"),
        (lambda p: weighting.graded(p, np.ones(50), theta=1.0), "theta"),
        (lambda p: weighting.adaptive_weights(p, theta=float("nan")), "theta"),
        (lambda p: weighting.adaptive_weights(p, cap=0.0), "cap"),
        (lambda p: weighting.adaptive_weights(p[:, :2], cap=0.5), "d = 3"),
        (lambda p: weighting.covering(p, widest=0.0), "widest"),
        (lambda p: weighting.curvature(p[:, :2]), "d = 3"),
        (lambda p: weighting.covering(np.pad(p, ((0, 0), (0, 1)))), "d = 2 or 3"),
        (lambda p: weighting.outliers(p[:, :1]), "d = 2 or 3"),
    ],
)
def test_bad_options_are_named(call, message):
    with pytest.raises(recon.InvalidInput, match=message):
        call(torus(50))
