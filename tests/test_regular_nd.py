"""The regular triangulation in four dimensions and more, against its definition and against the kernels of 2-D and 3-D."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle, determinant, dot, exact, orient, power_sign
from test_regular import cell_set, check_against_definition, hard_clouds

from recon import certify, hull, regular_triangulation


def grid(reach: int, d: int) -> np.ndarray:
    return np.array(list(product(range(reach), repeat=d)), float)


def cross(d: int) -> np.ndarray:
    """Cross polytope with its centre: 2d points of one sphere, and the centre of all of them."""
    return np.vstack([np.eye(d), -np.eye(d), np.zeros((1, d))])


@pytest.mark.parametrize("d", [4, 5])
@pytest.mark.parametrize("reach", [1, 3])
@pytest.mark.parametrize("unit", [1.0, 0.1])
def test_small_degenerate_sets_give_the_cells_of_the_definition(d, reach, unit):
    """Integers, whose signs floats know, and tenths, whose signs take integers."""
    rng = np.random.default_rng([d, reach])
    for _ in range(15):
        n = rng.integers(1, d + 5)
        points = rng.integers(-reach, reach + 1, (n, d)) * unit
        check_against_definition(points, rng.integers(-reach, reach + 1, n) * float(rng.integers(0, 2)) * unit**2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_thousands_of_small_degenerate_sets(seed):
    rng = np.random.default_rng([2025, seed])
    for _ in range(600):
        d, n, reach = rng.integers(4, 6), rng.integers(1, 10), rng.integers(1, 4)
        points = rng.integers(-reach, reach + 1, (n, d)) * rng.choice([1.0, 0.1])
        scale = 2.0 ** rng.integers(-100, 100)
        check_against_definition(points * scale, rng.integers(-reach, reach + 1, n) * scale**2 * rng.integers(0, 2))


coordinate = st.one_of(st.integers(-2, 2).map(float), st.sampled_from([0.1, 1 / 3, 1e-30, 1e30, 5e-324]))
weight = st.one_of(st.integers(-4, 4).map(float), st.sampled_from([1e-300, 1e150, -1e150, 1e-17, 0.1]))


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_whatever_hypothesis_finds(data):
    d = data.draw(st.integers(4, 6))
    points = data.draw(st.lists(st.lists(coordinate, min_size=d, max_size=d), min_size=1, max_size=8))
    check_against_definition(points, data.draw(st.lists(weight, min_size=len(points), max_size=len(points))))


@pytest.mark.parametrize("d", [4, 5, 6])
def test_the_cube_is_pulled_from_its_lowest_vertices(d):
    """All on one sphere, so that infinitesimals alone decide; no cell is flat, and volumes add up to one, exactly."""
    points = grid(2, d)[np.random.default_rng(d).permutation(2**d)]
    t = regular_triangulation(points)
    certify(t)
    assert (t.cells == 0).any(axis=1).all()
    corners = points[t.cells].astype(int)
    volumes = [determinant((c[1:] - c[0]).tolist()) for c in corners]
    assert min(volumes) >= 1 and sum(volumes) == np.prod(np.arange(1, d + 1))


@pytest.mark.parametrize("d", [4, 5])
@pytest.mark.parametrize("centre", [-3.0, 0.0, 0.5])
def test_cross_polytopes(d, centre):
    t = check_against_definition(cross(d), [0.0] * (2 * d) + [centre])
    assert (2 * d in t.hidden) == (centre < -1)


@pytest.mark.parametrize("d", [4, 5])
def test_simplices_with_duplicates(d):
    rng = np.random.default_rng(20)
    corners = np.vstack([np.zeros((1, d)), np.eye(d)])
    for _ in range(10):
        points = np.repeat(corners, 3, axis=0)[rng.permutation(3 * d + 3)]
        t = check_against_definition(points, rng.integers(0, 3, len(points)).astype(float))
        assert len(t.cells) == 1 and len(t.hidden) == 2 * d + 2


@pytest.mark.parametrize("span", [0, 1, 2, 3, 4])
def test_flats_in_wider_spaces(span):
    """Points of a spot, a line, a plane, a space, off the origin; whole numbers and rounded ones."""
    rng = np.random.default_rng([21, span])
    for _ in range(6):
        d = rng.integers(max(4, span), 6)
        points = 0.5 + rng.integers(-2, 3, (8, span)) @ rng.integers(-2, 3, (span, d)).astype(float)
        weights = rng.integers(-3, 4, 8) * float(rng.integers(0, 2))
        assert check_against_definition(points, weights).dimension <= span
        check_against_definition(points / 3, weights / 9)


def test_a_plane_in_four_dimensions_is_triangulated_as_in_the_plane():
    flat, weights = np.random.default_rng(22).normal(size=(200, 2)), np.random.default_rng(23).uniform(0, 0.01, 200)
    points = np.full((200, 4), 0.3)
    points[:, [1, 3]] = flat
    assert cell_set(regular_triangulation(points, weights)) == cell_set(regular_triangulation(flat, weights))


def test_as_many_dimensions_as_points():
    """Beyond ten dimensions all signs are taken from integers."""
    rng = np.random.default_rng(24)
    for d in (9, 10, 12):
        points = exact(rng.integers(-1, 2, (d + 3, d)))
        cells = regular_triangulation(np.array(points, float)).cells.tolist()
        heights = [dot(p, p) for p in points]
        assert len(cells[0]) == d + 1 and all(orient(*(points[i] for i in cell)) == 1 for cell in cells)
        assert all(power_sign(points, heights, cell, q) > 0 for cell in cells for q in {*range(d + 3)} - {*cell})
    assert regular_triangulation(rng.normal(size=(40, 60))).cells.shape == (1, 40)


def test_ulp_grids_and_any_exponent():
    rng = np.random.default_rng(25)
    for base in ([1 / 3, 24.0, 0.1, 7.0], [1e-3, 5e5, 5.4e6, 200.0]):
        points = np.array(base) + rng.integers(-2, 3, (8, 4)) * np.spacing(np.array(base))
        check_against_definition(points)
    for _ in range(2):
        small = rng.integers(-2, 3, (8, 4)).astype(float)
        check_against_definition(small * 5e-324)
        check_against_definition(small * 2.0**330, rng.integers(-2, 3, 8) * 2.0**660)
        check_against_definition(np.ldexp(small, rng.integers(-1074, 330, small.shape)), rng.choice([0, 1e200], 8))


# --- twins -------------------------------------------------------------------------------------------------------------


CLOUDS = [pytest.param(p, w, id=name) for name, p, w in hard_clouds()]


@pytest.mark.parametrize(("points", "weights"), CLOUDS)
def test_the_kernels_of_space_find_the_same_cells(points, weights):
    """Two implementations that share nothing but the promise, on the clouds that others fail on."""
    points, weights = points[:200], None if weights is None else weights[:200]
    expected = regular_triangulation(points, weights)
    cells, _ = hull.lower_hull(expected.points, expected.weights)
    assert sorted(map(tuple, np.sort(cells, axis=1).tolist())) == cell_set(expected)


def test_floats_and_integers_decide_alike(monkeypatch):
    rng = np.random.default_rng(26)
    clouds = [
        (grid(3, 4), np.zeros(81)),
        (rng.normal(size=(40, 4)), rng.uniform(0, 1, 40)),
        (grid(2, 4) / 3, np.zeros(16)),
    ]
    expected = [regular_triangulation(*cloud) for cloud in clouds]
    scaled = hull.float_table

    def doubtful(points, weights, axes):
        return scaled(points, weights, axes)[0], np.array([np.inf, np.inf, np.inf, 0.0])

    monkeypatch.setattr(hull, "float_table", doubtful)
    for cloud, before in zip(clouds, expected):
        after = regular_triangulation(*cloud)
        assert (
            after.cells.tobytes() == before.cells.tobytes() and after.neighbors.tobytes() == before.neighbors.tobytes()
        )


# --- metamorphic -------------------------------------------------------------------------------------------------------


def degenerate_cloud(rng, n):
    points = rng.integers(-3, 4, (n, 4)).astype(float)
    points[: n // 4] = points[n // 4 : 2 * (n // 4)]
    return points, rng.integers(0, 6, n) * 0.5


def test_the_order_of_insertion_does_not_matter(monkeypatch):
    rng = np.random.default_rng(27)
    cloud = degenerate_cloud(rng, 150)
    expected = regular_triangulation(*cloud)
    certify(expected)
    for _ in range(4):
        monkeypatch.setattr(hull, "_order", lambda rows, points: rng.permutation(rows))
        assert cell_set(regular_triangulation(*cloud)) == cell_set(expected)


@pytest.mark.parametrize("d", [4, 5])
def test_the_order_of_the_input_only_renames(d):
    rng = np.random.default_rng(28)
    points, weights = rng.normal(size=(80, d)), rng.uniform(0, 0.3, 80)
    expected = cell_set(regular_triangulation(points, weights))
    for _ in range(3):
        order = rng.permutation(80)
        t = regular_triangulation(points[order], weights[order])
        assert sorted(tuple(sorted(cell)) for cell in order[t.cells].tolist()) == expected


def test_exact_transformations_change_nothing():
    points, weights = degenerate_cloud(np.random.default_rng(29), 150)
    expected = cell_set(regular_triangulation(points, weights))
    for k in (-300, -40, 5, 300):
        assert cell_set(regular_triangulation(points * 2.0**k, weights * 4.0**k)) == expected
    assert cell_set(regular_triangulation(points + [5e5, 5.4e6, 200.0, -0.5], weights)) == expected
    for constant in (-1024.0, 2.0**30):
        assert cell_set(regular_triangulation(points, weights + constant)) == expected
    assert cell_set(regular_triangulation(points * [-1, 1, 1, 1], weights)) == expected
    assert cell_set(regular_triangulation(points[:, [2, 0, 3, 1]], weights)) == expected


@pytest.mark.parametrize(
    "points",
    [
        pytest.param(grid(4, 4), id="grid"),
        pytest.param(grid(3, 4) / 10, id="tenths"),
        pytest.param(np.vstack([grid(3, 4), grid(2, 4) + 0.5]), id="body-centred grid"),
        pytest.param(np.random.default_rng(30).normal(size=(500, 4)), id="random"),
        pytest.param(np.random.default_rng(31).normal(size=(80, 5)), id="random in 5-D"),
        pytest.param(np.random.default_rng(32).normal(size=(40, 6)), id="random in 6-D"),
        pytest.param((s := np.random.default_rng(33).normal(size=(60, 4))) / np.linalg.norm(s, axis=1)[:, None], id="sphere"),
        pytest.param(np.random.default_rng(34).normal(size=(80, 2)) @ [[0.3, 1, 2, 7], [5, 0.7, 1, 3]], id="rounded plane"),
        pytest.param(np.vstack([np.random.default_rng(35).normal(size=(60, 4)), [[1e90, 0, 0, 0]]]), id="outlier"),
    ],
)  # fmt: skip
def test_larger_clouds_are_certified(points):
    certify(regular_triangulation(points))
    certify(regular_triangulation(points, np.random.default_rng(36).integers(0, 3, len(points)) * 0.25))


def test_a_heavy_point_that_comes_last_sweeps_all_away(monkeypatch):
    points = np.vstack([grid(2, 4) * 20 - 10, np.random.default_rng(37).normal(size=(400, 4)), np.zeros((1, 4))])
    monkeypatch.setattr(hull, "_order", lambda rows, points: rows)
    t = regular_triangulation(points, np.append(np.zeros(416), 300.0))
    certify(t)
    assert len(t.hidden) == 400 and 416 in t.cells
    assert Oracle(points[[*range(16), 416]], [0] * 16 + [300]).cells == [
        tuple(16 if i == 416 else i for i in cell) for cell in cell_set(t)
    ]
