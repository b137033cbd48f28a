"""What a union of balls has of single cells, and so the volumes and areas of voids and pockets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon import alpha_complex, space_filling_diagram
from recon.cavities import balls_within, contents
from recon.power import adjacency


def within(points, weights, cells=None):
    """Volume and area that the union of balls has within cells of R, all of them by default."""
    complex_ = alpha_complex(points, weights)
    n, d = complex_.triangulation.points.shape
    balls = np.zeros((n, 4))
    balls[:, :d], balls[:, 3] = complex_.triangulation.points, complex_.triangulation.weights
    cells = complex_.simplices(d) if cells is None else np.array(cells, np.int32)
    return balls_within(balls, cells, *adjacency(complex_))


@pytest.mark.parametrize("square", [0.2, 1 / 3, 0.4, 0.5])
def test_a_ball_that_bulges_out_of_the_corner_of_a_cube(square):
    """An octant, less the cap beyond the plane of the three other corners where the ball reaches it."""
    r, plane = math.sqrt(square), 1 / math.sqrt(3)
    cap = max(r - plane, 0.0)
    volume = math.pi * r**3 / 6 - math.pi / 3 * cap**2 * (3 * r - cap)
    area = math.pi * square / 2 - 2 * math.pi * r * cap
    found = within([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [square, -0.1, -0.1, -0.1])
    assert found[0] == pytest.approx([volume, area], rel=1e-14)


def test_a_disc_that_bulges_out_of_a_right_angle():
    found = within([[0.0, 0], [1, 0], [0, 1]], [0.6, -0.1, -0.1])
    angle = math.acos(math.sqrt(0.5 / 0.6))
    area = 0.5 * 0.6 * (math.pi / 2 - 2 * angle) + math.sqrt(0.5) * math.sqrt(0.1)
    assert found[0] == pytest.approx([area, math.sqrt(0.6) * (math.pi / 2 - 2 * angle)], rel=1e-14)


def test_intervals():
    """Ends within [0, 1], [1, 3], [3, 9]: of [-1/2, 1/2], [2, 4] and [7/2, 13/2]; the ball at 9 is empty."""
    found = within([[0.0], [1], [3], [5], [9]], [0.25, -1, 1, 2.25, -1], [[0, 1], [1, 2], [2, 4]])
    assert found.tolist() == [[0.5, 1.0], [1.0, 1.0], [3.5, 1.0]]
    assert within([[0.0], [1]], [-1.0, -1.0]).tolist() == [[0.0, 0.0]]


def in_a_box(points, weights, d):
    """The same balls, with empty ones at the corners of a box around all of them."""
    corners = 9.0 * (2 * (np.arange(2**d)[:, None] >> np.arange(d) & 1) - 1)
    return np.vstack([corners, points]), np.concatenate([np.full(2**d, -1.0), weights])


def clouds(d):
    rng = np.random.default_rng(d)
    grid = np.stack(np.meshgrid(*[np.arange(3.0)] * d), -1).reshape(-1, d)
    yield "random", rng.normal(size=(60, d)), rng.uniform(-0.1, 0.6, 60)
    yield "grid", grid, np.full(len(grid), 0.4)
    yield "jittered grid", grid + 1e-15 * rng.normal(size=grid.shape), np.full(len(grid), 0.6)
    yield "nearly flat", np.c_[rng.normal(size=(30, d - 1)), 1e-14 * rng.normal(size=30)], rng.uniform(0, 0.5, 30)
    yield "needles", np.c_[np.arange(20) / 5, 1e-9 * rng.normal(size=(20, d - 1))], rng.uniform(0, 0.5, 20)
    yield "one large", rng.normal(size=(40, d)), np.append(rng.uniform(0, 0.01, 39), 9.0)
    yield "nested and equal", np.repeat(rng.normal(size=(5, d)), 4, axis=0), rng.uniform(0, 1, 20)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize(
    "name", ["random", "grid", "jittered grid", "nearly flat", "needles", "one large", "nested and equal"]
)
def test_the_parts_of_all_cells_add_up_to_the_union(name, d):
    points, weights = next((p, w) for n, p, w in clouds(d) if n == name)
    points, weights = in_a_box(points, weights, d)
    union = space_filling_diagram(points, weights)
    assert within(points, weights).sum(axis=0) == pytest.approx([union.volume, union.area], rel=1e-10)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3, st.integers(-1, 6)), min_size=1, max_size=10), st.integers(1, 3))
def test_the_parts_of_all_cells_add_up_however_degenerate(rows, d):
    rows = np.array(rows, float)
    points, weights = in_a_box(rows[:, :d], rows[:, 3], d)
    union = space_filling_diagram(points, weights)
    found = within(points, weights).sum(axis=0)
    assert found == pytest.approx([union.volume, union.area], rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(("d", "n", "top"), [(3, 60, 1.0), (3, 150, 0.6), (2, 60, 0.4)])
def test_cavities_agree_with_monte_carlo(d, n, top):
    rng = np.random.default_rng(n)
    points, weights = rng.uniform(0, 4, (n, d)), rng.uniform(0.05, top, n)
    union = space_filling_diagram(points, weights)
    assert len(union.pockets) > 0
    for cavities in filter(len, (union.voids, union.pockets)):
        corners = points[cavities.cells]
        size = contents(corners, d)
        drawn = rng.choice(len(size), 30_000, p=size / size.sum())
        x = np.einsum("nk,nkd->nd", rng.dirichlet(np.ones(d + 1), len(drawn)), corners[drawn])
        empty = (((x[:, None] - points) ** 2).sum(axis=2) > weights).all(axis=1)
        hits = np.bincount(cavities.number[drawn[empty]], minlength=len(cavities))
        unit = size.sum() / len(drawn)
        assert (np.abs(hits * unit - cavities.volumes) < 5 * unit * np.sqrt(hits + 10)).all()


def test_areas_are_how_volumes_change():
    """Raising all radii by little takes area times little of each cavity: of cells that stay the same, to first order."""
    rng = np.random.default_rng(1)
    points = rng.uniform(0, 4, (60, 3))
    pockets = space_filling_diagram(points, np.full(60, 0.3)).pockets
    step = 1e-6
    before, after = (within(points, np.full(60, (math.sqrt(0.3) + s) ** 2), pockets.cells) for s in (-step, step))
    change = np.bincount(pockets.number, (after - before)[:, 0], len(pockets)) / (2 * step)
    assert change == pytest.approx(pockets.areas, rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3, st.integers(-1, 6)), min_size=1, max_size=9), st.integers(1, 3))
def test_redundant_balls_are_those_that_leave_the_union_as_it_is(rows, d):
    """Integers for centres, weights in general position: power cells have volumes, and nothing touches from within."""
    rows, alpha = np.array(rows, float), 0.3717
    points, weights = rows[:, :d], rows[:, 3] + 0.1 * np.sqrt(np.arange(2, 2 + len(rows)))
    union = space_filling_diagram(points, weights, alpha)
    assert np.abs(union.complex.spectrum() - alpha).min() > 1e-6
    for p, redundant in enumerate(union.redundant):
        if len(rows) == 1:
            assert redundant == (weights[0] + alpha < 0)
        else:
            rest = space_filling_diagram(np.delete(points, p, axis=0), np.delete(weights, p), alpha)
            assert redundant == (abs(rest.volume - union.volume) < 1e-9)


@pytest.mark.parametrize("d", [2, 3])
def test_redundant_balls_of_a_crowd(d):
    rng = np.random.default_rng(d)
    points, weights = rng.normal(size=(50, d)), rng.uniform(0.2, 0.9, 50)
    union = space_filling_diagram(points, weights)
    assert 0 < union.redundant.sum() < 50
    for p in range(50):
        rest = space_filling_diagram(np.delete(points, p, axis=0), np.delete(weights, p))
        assert union.redundant[p] == (union.volume - rest.volume < 1e-11)


def test_of_equal_balls_each_is_redundant_by_itself():
    union = space_filling_diagram([[0, 0], [0, 0], [5, 0], [5, 0]], [1, 1, 2, 1])
    assert union.redundant.tolist() == [True, True, False, True]
