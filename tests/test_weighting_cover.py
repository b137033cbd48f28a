"""Covering radius and W_0: triangles, gaps, stars, no leak; the sufficient weight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import datasets_synthetic
import recon
import weighting
from weighting._star import triangle_cover

SURFACE = datasets_synthetic.surface("torus")
coordinate = st.floats(-1, 1, allow_nan=False).map(lambda x: round(x, 3))
corners = st.tuples(*[st.tuples(coordinate, coordinate)] * 3).map(np.array)


def covered(x, points, weights):
    """Is each x in a ball? (slow, by definition)"""
    square = ((x[:, None, :] - points[None]) ** 2).sum(axis=2)
    return (square <= weights).any(axis=1)


def sides_sq(t):
    return [((t[(i + 1) % 3] - t[i]) ** 2).sum() for i in range(3)]


@settings(deadline=None)
@given(corners)
def test_equal_balls_of_this_radius_cover_the_triangle_and_smaller_ones_do_not(t):
    sides = sides_sq(t)
    if min(sides) == 0.0:
        return
    need = triangle_cover(*sides)
    a, b = np.meshgrid(np.linspace(0, 1, 81), np.linspace(0, 1, 81))
    inside = a + b <= 1
    x = t[0] + a[inside][:, None] * (t[1] - t[0]) + b[inside][:, None] * (t[2] - t[0])
    nearest = ((x[:, None, :] - t) ** 2).sum(axis=2).min(axis=1).max()
    step = math.sqrt(max(sides)) / 80
    assert nearest <= need * (1 + 1e-9)
    assert math.sqrt(need) <= math.sqrt(nearest) + step


@settings(deadline=None)
@given(corners)
def test_a_triangle_needs_the_circumradius_just_where_no_angle_is_obtuse(t):
    a, b, c = np.sqrt(sides_sq(t))
    area = 0.5 * abs(np.linalg.det(t[1:] - t[0]))
    if area < 1e-3:
        return
    circumradius = a * b * c / (4 * area)
    need = math.sqrt(triangle_cover(a * a, b * b, c * c))
    obtuse = 2 * max(a, b, c) ** 2 > a * a + b * b + c * c
    assert need <= circumradius * (1 + 1e-9)
    assert obtuse or math.isclose(need, circumradius, rel_tol=1e-9)


def test_covering_of_lattices():
    i, j = (a.ravel() for a in np.meshgrid(np.arange(15.0), np.arange(15.0)))
    inner = (np.abs(i - 7) < 5) & (np.abs(j - 7) < 5)
    square = np.column_stack([i, j, 0 * i])
    triangular = np.column_stack([i + 0.5 * j, math.sqrt(0.75) * j, 0 * i])
    lines = np.column_stack([i, 4 * j, 0 * i])
    assert np.allclose(weighting.covering(square)[inner], math.sqrt(0.5), rtol=1e-12)
    assert np.allclose(weighting.covering(triangular)[inner], math.sqrt(1 / 3), rtol=1e-12)
    assert np.allclose(weighting.covering(lines)[inner], math.sqrt(4.25), rtol=1e-12)


def test_covering_of_a_curve_is_half_the_wider_gap_beside_the_sample():
    x = np.cumsum([0, 1, 1, 2, 1, 3, 1, 1, 2, 2, 1.0])
    found = weighting.covering(np.column_stack([x, 0 * x]), widest=10.0)
    gaps = np.diff(x)
    assert np.allclose(found, 0.5 * np.maximum(np.append(gaps, 0), np.insert(gaps, 0, 0)))


def test_a_hole_wider_than_asked_for_is_left_open():
    i, j = (a.ravel() for a in np.meshgrid(np.arange(41.0), np.arange(41.0)))
    away = np.hypot(i - 20, j - 20)
    holed = np.column_stack([i, j, 0 * i])[away > 1.8]
    assert weighting.covering(holed, widest=1.5).max() < 1.5
    assert weighting.covering(holed, widest=3.0).max() == pytest.approx(2.0)


@pytest.mark.parametrize("density", [1, 10, 50])
@pytest.mark.parametrize("spacing", ["random", "blue"])
@pytest.mark.parametrize("seed", range(3))
def test_the_balls_cover_the_whole_surface(density, spacing, seed):
    points = SURFACE.sample(2000, density=density, spacing=spacing, rng=seed).points
    x = SURFACE.sample(8000, rng=100 + seed).points
    share = covered(x, points, weighting.adaptive_weights(points, radius="covering")).mean()
    assert share == 1.0 if spacing == "blue" else share > 0.999  # the widest chords lie inside the curved surface


def leaks(points, weights):
    """Whether one can get from the outside to the core of the torus around the balls: through facets not in K_0."""
    shape = recon.alpha_complex(points, weights)
    inside = shape.classify(3) == recon.INTERIOR
    cells, triangles = shape.simplices(3), shape.simplices(2)
    present = {tuple(t) for t in np.sort(triangles[shape.classify(2) != recon.EXTERIOR], axis=1).tolist()}
    sides: dict[tuple[int, ...], list[int]] = {}
    for i, cell in enumerate(np.sort(cells, axis=1).tolist()):
        for j in range(4):
            sides.setdefault(tuple(cell[:j] + cell[j + 1 :]), []).append(i)
    reached, queue = np.zeros(len(cells), bool), []
    for side, owners in sides.items():
        if len(owners) == 1 and side not in present and not inside[owners[0]] and not reached[owners[0]]:
            reached[owners[0]] = True
            queue.append(owners[0])
    beside: dict[int, list[int]] = {}
    for side, owners in sides.items():
        if len(owners) == 2 and side not in present:
            beside.setdefault(owners[0], []).append(owners[1])
            beside.setdefault(owners[1], []).append(owners[0])
    while queue:
        for other in beside.get(queue.pop(), []):
            if not inside[other] and not reached[other]:
                reached[other] = True
                queue.append(other)
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    core = 0.7 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    assert (SURFACE.distance(core) < -0.29).all()
    p = points[cells]
    for x in core:  # the cell around x
        b = np.linalg.solve((p[:, 1:] - p[:, :1]).transpose(0, 2, 1), (x - p[:, 0])[:, :, None])[:, :, 0]
        around = (b >= 0).all(axis=1) & (b.sum(axis=1) <= 1)
        if reached[around].any():
            return True
    return False


@pytest.mark.parametrize("density", [1, 50])
@pytest.mark.parametrize("spacing", ["random", "blue"])
@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_the_outside_of_w0_does_not_leak_in(density, spacing, noise):
    points = SURFACE.sample(2500, density=density, spacing=spacing, noise=noise, rng=5).points
    assert not leaks(points, weighting.adaptive_weights(points, radius="covering"))


def test_equal_balls_of_the_mean_size_leak_where_samples_are_few():
    points = SURFACE.sample(2500, density=50, spacing="blue", rng=5).points
    mean = weighting.adaptive_weights(points, radius="covering").mean()
    assert leaks(points, np.full(2500, mean))


def test_two_scans_that_overlap_are_covered_as_one():
    one, other = (SURFACE.sample(2000, spacing="blue", rng=seed).points for seed in (0, 1))
    points = np.concatenate([one[one[:, 0] < 0.3], other[other[:, 0] > -0.3] + [0.004, 0, 0]])
    assert not leaks(points, weighting.adaptive_weights(points, radius="covering"))


def test_an_abrupt_change_of_density_is_covered():
    dense, sparse = (SURFACE.sample(n, spacing="blue", rng=n).points for n in (8000, 800))
    points = np.concatenate([dense[dense[:, 0] < 0], sparse[sparse[:, 0] > 0]])
    assert covered(
        SURFACE.sample(8000, rng=0).points, points, weighting.adaptive_weights(points, radius="covering")
    ).all()


@pytest.mark.parametrize("ratio", [1, 5, 20])
def test_scan_lines_are_covered_up_to_twenty_times_as_far_apart_as_samples_along_them(ratio):
    along = math.sqrt(4 * math.pi**2 * 0.7 * 0.3 / 6000 / ratio)
    rows = []
    for v in np.arange(0, 2 * math.pi, along * ratio / 0.3):
        radius = 0.7 + 0.3 * math.cos(v)
        u = np.arange(0, 2 * math.pi, along / radius) + v
        rows.append(np.column_stack([radius * np.cos(u), radius * np.sin(u), np.full(len(u), 0.3 * math.sin(v))]))
    weights = weighting.adaptive_weights(np.concatenate(rows), radius="covering")
    height = (along * ratio) ** 2 / (8 * 0.3)  # what a surface through the lines misses
    x = SURFACE.sample(4000, rng=0).points
    assert covered(x, np.concatenate(rows), (np.sqrt(weights) + height) ** 2).all()


@settings(deadline=None, max_examples=30)
@given(st.floats(0.02, 0.2), st.floats(0.0, 0.01), st.floats(1.0, 1.5))
def test_balls_of_the_sufficient_weight_meet_every_normal_of_the_sphere_in_one_interval(cover, noise, excess):
    largest = cover * excess
    weight = float(weighting.sufficient_weight(cover, 1.0, noise, largest))
    if weight > largest**2:  # no such balls
        return
    rng = np.random.default_rng(0)
    # samples within `cover` of the pole, one of them at its edge: the worst; others as far as balls reach
    angle = np.concatenate([[cover], rng.uniform(0, largest * 1.2, 300)])
    height = 1.0 + rng.uniform(-noise, noise, 301)
    radius = np.concatenate([[math.sqrt(weight)], rng.uniform(math.sqrt(weight), largest, 300)])
    off, up = height * np.sin(angle), height * np.cos(angle)
    meets = off < radius
    half = np.sqrt(radius[meets] ** 2 - off[meets] ** 2)
    low, high = (up[meets] - half), (up[meets] + half)
    order = np.argsort(low)
    reach = np.maximum.accumulate(high[order])
    assert (low[order][1:] <= reach[:-1]).all()
    assert low.min() < 1.0 < high.max()


def test_sufficient_weight_of_a_plane_is_the_covering_radius():
    assert weighting.sufficient_weight(0.3, np.inf).item() == pytest.approx(0.09)
    assert weighting.sufficient_weight(0.0, np.inf, 0.1).item() == pytest.approx(8 * 0.1**2)
