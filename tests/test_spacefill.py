"""The space filling diagram: closed forms, slices, Monte Carlo, degenerate balls, voids, pockets and faces by duality."""

from __future__ import annotations

import math
import os
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon import InvalidInput, alpha_complex, read_points, regular_triangulation, space_filling_diagram
from recon.io.molecules import ball_weights, read_molecule

CUBE = np.array(list(product((0.0, 2.0), repeat=3)))
GOLDEN = math.pi * (1 + math.sqrt(5))


def cloud(seed, n, d=3, spread=1.0):
    rng = np.random.default_rng(seed)
    return spread * rng.normal(size=(n, d)), 1.5 * rng.random(n)


def fibonacci(n):
    i = np.arange(n) + 0.5
    polar = np.arccos(1 - 2 * i / n)
    return np.c_[np.cos(GOLDEN * i) * np.sin(polar), np.sin(GOLDEN * i) * np.sin(polar), np.cos(polar)]


# --- an independent way to the same numbers: slices, in which balls are discs


def exposed_arcs(x, y, r):
    """Arcs (i, begin, end) of circles that no other disc covers."""
    for i in range(len(r)):
        cuts = [0.0, 2 * math.pi]
        for j in range(len(r)):
            gap = math.hypot(x[j] - x[i], y[j] - y[i])
            if j != i and abs(r[i] - r[j]) < gap < r[i] + r[j]:
                middle = math.atan2(y[j] - y[i], x[j] - x[i])
                cosine = (gap * gap + r[i] ** 2 - r[j] ** 2) / (2 * gap * r[i])
                half = math.acos(min(max(cosine, -1.0), 1.0))
                cuts += [(middle - half) % (2 * math.pi), (middle + half) % (2 * math.pi)]
        cuts.sort()
        for begin, end in zip(cuts, cuts[1:]):
            u, v = x[i] + r[i] * math.cos((begin + end) / 2), y[i] + r[i] * math.sin((begin + end) / 2)
            if all((u - x[j]) ** 2 + (v - y[j]) ** 2 > r[j] ** 2 for j in range(len(r)) if j != i):
                yield i, begin, end


def slice_through(z, points, weights):
    """Area of the union of discs at a height, and the exposed angle of each circle."""
    left = weights - (points[:, 2] - z) ** 2
    rows = np.flatnonzero(left > 0)
    x, y, r = points[rows, 0], points[rows, 1], np.sqrt(left[rows])
    area, angles = 0.0, np.zeros(len(points))
    for i, a, b in exposed_arcs(x, y, r):
        area += 0.5 * r[i] * (
            r[i] * (b - a) + x[i] * (math.sin(b) - math.sin(a)) - y[i] * (math.cos(b) - math.cos(a))
        )  # fmt: skip
        angles[rows[i]] += b - a
    return area, angles


def by_slices(points, weights):
    """Volume of the union and area of each sphere, to 1e-12: Gauss-like (tanh-sinh) between the heights of events."""
    events = [points[:, 2] - np.sqrt(weights), points[:, 2] + np.sqrt(weights)]
    for p, q in combinations(range(len(points)), 2):
        edge = points[q] - points[p]
        length = np.linalg.norm(edge)
        h = 0.5 * (length + (weights[p] - weights[q]) / length)
        if weights[p] > h * h:
            reach = math.sqrt(weights[p] - h * h) * math.hypot(edge[0], edge[1]) / length
            events.append(points[p, 2] + edge[2] / length * h + np.array([-reach, reach]))
    for rows in combinations(range(len(points)), 3):
        p, q, r = points[list(rows)]
        normal = np.cross(q - p, r - p)
        w = weights[list(rows)]
        right = [normal @ p, 0.5 * (q @ q - p @ p + w[0] - w[1]), 0.5 * (r @ r - p @ p + w[0] - w[2])]
        center = np.linalg.solve([normal, q - p, r - p], right)
        left = w[0] - (center - p) @ (center - p)
        if left > 0:
            reach = math.sqrt(left) * normal[2] / np.linalg.norm(normal)
            events.append(center[2] + np.array([-reach, reach]))
    cuts = np.sort(np.concatenate(events))
    t = np.arange(-3.2, 3.2001, 0.1)
    nodes, share = (
        np.tanh(0.5 * math.pi * np.sinh(t)),
        0.05 * math.pi * np.cosh(t) / np.cosh(0.5 * math.pi * np.sinh(t)) ** 2,
    )
    volume, areas = 0.0, np.zeros(len(points))
    for low, high in zip(cuts, cuts[1:]):
        for node, weight in zip(nodes, 0.5 * (high - low) * share):
            area, angles = slice_through(0.5 * (low + high) + 0.5 * (high - low) * node, points, weights)
            volume += weight * area
            areas += weight * angles * np.sqrt(weights)  # Archimedes: as much sphere as cylinder
    return volume, areas


@pytest.mark.parametrize("n", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("seed", range(3))
def test_volume_and_areas_agree_with_slices_to_1e_12(n, seed):
    points, weights = cloud(seed, n, spread=0.6)
    made = space_filling_diagram(points, weights)
    volume, areas = by_slices(points, weights)
    assert made.volume == pytest.approx(volume, rel=2e-12)
    assert made.ball_areas == pytest.approx(areas, rel=2e-11, abs=2e-11)


# --- closed forms


def test_one_ball():
    made = space_filling_diagram([[1, 2, 3]], [4])
    assert made.volume == pytest.approx(32 / 3 * math.pi, rel=1e-15)
    assert made.area == pytest.approx(16 * math.pi, rel=1e-15)
    assert made.euler == 2 and len(made.voids) == 0 and len(made.faces(2)) == 1


@pytest.mark.parametrize("gap", [0.1, 1.0, 1.9, 1.999999])
def test_two_balls(gap):
    made = space_filling_diagram([[0, 0, 0], [0, gap, 0]], [1, 1])
    lens = math.pi / 12 * (4 + gap) * (2 - gap) ** 2
    assert made.volume == pytest.approx(8 / 3 * math.pi - lens, rel=1e-14)
    assert made.ball_areas == pytest.approx([math.pi * (2 + gap)] * 2, rel=1e-14)
    assert made.faces(1).radii == pytest.approx([math.sqrt(1 - gap * gap / 4)], rel=1e-12)


def test_three_balls_that_meet_in_the_centre_of_one():
    """The bisecting planes pass through the centre of the small ball, at 60 degrees: it keeps a wedge of 120."""
    angle = math.pi / 3
    points = [[0, 0, 0], [1, 0, 0], [math.cos(angle), math.sin(angle), 0]]
    made = space_filling_diagram(points, [0.2, 1.2, 1.2])
    ball = 4 / 3 * math.pi * 0.2**1.5
    assert made.ball_volumes[0] == pytest.approx(ball * (math.pi - angle) / (2 * math.pi), rel=1e-13)
    assert made.ball_areas[0] == pytest.approx(4 * math.pi * 0.2 * (math.pi - angle) / (2 * math.pi), rel=1e-13)


def test_four_balls_that_meet_in_the_centre_of_one():
    """Three bisecting planes at right angles leave the small ball one octant."""
    made = space_filling_diagram([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [0.2, 1.2, 1.2, 1.2])
    assert made.ball_volumes[0] == pytest.approx(4 / 3 * math.pi * 0.2**1.5 / 8, rel=1e-12)
    assert made.ball_areas[0] == pytest.approx(4 * math.pi * 0.2 / 8, rel=1e-12)


def test_balls_of_a_grid_fill_its_cubes():
    points = np.argwhere(np.ones((4, 4, 4))).astype(float)
    inner = ((points > 0) & (points < 3)).all(axis=1)
    for scale in (1.0, 0.1, 1e-30, 2.0**40):
        made = space_filling_diagram(points * scale, np.full(64, 0.8 * scale**2))
        assert made.ball_volumes[inner] / scale**3 == pytest.approx([1.0] * 8, rel=1e-12)
        assert (made.ball_areas[inner] == 0).all()
    lone = space_filling_diagram(points, np.full(64, 0.2))
    assert lone.volume == pytest.approx(64 * 4 / 3 * math.pi * 0.2**1.5, rel=1e-13)


def test_discs():
    made = space_filling_diagram([[0, 0], [1, 0]], [1, 1])
    assert made.volume == pytest.approx(2 * math.pi - (2 * math.pi / 3 - math.sqrt(3) / 2), rel=1e-14)
    assert made.area == pytest.approx(8 / 3 * math.pi, rel=1e-14)
    points = np.argwhere(np.ones((4, 4))).astype(float)
    assert space_filling_diagram(points, np.full(16, 0.6)).ball_volumes[5] == pytest.approx(1.0, rel=1e-13)


def test_intervals():
    made = space_filling_diagram([[0.0], [1.0], [5.0]], [1, 1, 0.25])
    assert made.volume == pytest.approx(4.0) and made.area == 4 and made.euler == 4
    assert made.ball_volumes == pytest.approx([1.5, 1.5, 1.0])
    assert made.voids.volumes == pytest.approx([2.5])
    assert sorted(made.faces(0).points[:, 0].tolist()) == pytest.approx([-1, 2, 4.5, 5.5])


# --- degenerate balls


def test_hidden_nested_equal_and_empty_balls_have_nothing():
    points = [[0, 0, 0], [0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [7, 0, 0], [9, 0, 0]]
    made = space_filling_diagram(points, [1, 1, 0.01, -1, -2, 0])
    assert made.volume == pytest.approx(4 / 3 * math.pi, rel=1e-15)
    assert np.flatnonzero(made.ball_volumes).tolist() == [0] == np.flatnonzero(made.ball_areas).tolist()


def test_tangent_balls_touch():
    outside = space_filling_diagram([[0, 0, 0], [2, 0, 0]], [1, 1])
    assert outside.volume == pytest.approx(8 / 3 * math.pi, rel=1e-14) and outside.euler == 2
    inside = space_filling_diagram([[0, 0, 0], [1, 0, 0]], [4, 1])
    assert inside.volume == pytest.approx(32 / 3 * math.pi, rel=1e-14)
    corner = space_filling_diagram([[0, 0, 0], [2, 0, 0], [1, math.sqrt(3), 0]], [1, 1, 1])
    assert corner.volume == pytest.approx(4 * math.pi, rel=1e-14)


@settings(max_examples=80, deadline=None)
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3, st.integers(-1, 6)), min_size=1, max_size=12), st.integers(1, 3))
def test_measures_do_not_depend_on_names_and_splits(rows, d):
    """Degenerate on purpose: permuted, or with a ball more that another one holds, all measures are the same."""
    table = np.unique(np.array(rows, float), axis=0)
    points, weights = table[:, :d], table[:, 3]
    made = space_filling_diagram(points, weights)
    order = np.random.default_rng(0).permutation(len(points))
    other = space_filling_diagram(points[order], weights[order])
    assert other.volume == pytest.approx(made.volume, rel=1e-11, abs=1e-11)
    assert other.area == pytest.approx(made.area, rel=1e-11, abs=1e-11)
    assert other.voids.volumes.sum() == pytest.approx(made.voids.volumes.sum(), rel=1e-11, abs=1e-11)
    more = space_filling_diagram(np.r_[points, points[:1]], np.r_[weights, weights[0] - 0.5])
    assert more.volume == pytest.approx(made.volume, rel=1e-11, abs=1e-11)
    shifted = space_filling_diagram(points + 1024, weights - 3, alpha=3.0)
    assert shifted.volume == pytest.approx(made.volume, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("scale", [1.0, 0.1, 1 / 3])
@pytest.mark.parametrize("square", [0.3, 0.6, 0.9])
def test_slivers_of_a_jittered_grid_do_no_harm(d, scale, square):
    """Jitter at the last bits makes flat cells with corners anywhere; measures change as little as the points do."""
    grid = np.argwhere(np.ones((4,) * d)).astype(float)
    made = space_filling_diagram(grid, np.full(len(grid), square))
    for jitter in (0.0, 1e-16, 1e-15, 1e-12, 1e-8):
        moved = scale * grid * (1 + jitter * np.random.default_rng(1).normal(size=grid.shape)) + 0.1
        other = space_filling_diagram(moved, np.full(len(grid), square * scale**2))
        error = 1e-13 + 100 * max(jitter, 2e-16)
        assert np.abs(other.ball_volumes / scale**d - made.ball_volumes).max() < error
        assert np.abs(other.ball_areas / scale ** (d - 1) - made.ball_areas).max() < error


def test_a_ball_that_touches_another_from_within_leaves_its_turn():
    """A point-sized ball on two spheres: the circles on it have no size, but their angles must fit together."""
    made = space_filling_diagram([[0, 0, 0], [0, 0, -1], [0, 1, 1]], [1, 0, 5])
    assert made.volume == pytest.approx(space_filling_diagram([[0, 0, 0], [0, 1, 1]], [1, 5]).volume, rel=1e-13)


def test_a_flat_cloud_in_space_is_the_limit_of_thick_ones():
    points, weights = cloud(3, 12, d=2)
    flat = space_filling_diagram(np.c_[points, np.zeros(12)], weights)
    thick = space_filling_diagram(np.c_[points, 1e-13 * np.arange(12) ** 2], weights)
    assert flat.ball_volumes == pytest.approx(thick.ball_volumes, rel=1e-9, abs=1e-9)
    assert flat.ball_areas == pytest.approx(thick.ball_areas, rel=1e-9, abs=1e-9)
    corners = flat.faces(0)
    assert len(corners) == 2 * np.count_nonzero(flat.complex.entry(2) <= 0)
    assert (((corners.points[:, None] - corners.points) ** 2).sum(axis=2) + 9 * np.eye(len(corners)) > 1e-9).all()


# --- Monte Carlo


@pytest.mark.parametrize(("n", "d"), [(30, 3), (200, 3), (40, 2), (10, 1)])
def test_ball_volumes_agree_with_monte_carlo(n, d):
    points, weights = cloud(n, n, d, spread=1.5)
    made = space_filling_diagram(points, weights)
    rng = np.random.default_rng(0)
    low, high = points.min(axis=0) - 1.3, points.max(axis=0) + 1.3
    x = rng.uniform(low, high, (100_000, d))
    power = ((x[:, None] - points) ** 2).sum(axis=2) - weights
    hits = np.bincount(power.argmin(axis=1)[power.min(axis=1) <= 0], minlength=n)
    box = np.prod(high - low)
    error = 5 * box * np.sqrt(hits + 10) / len(x)
    assert (np.abs(hits / len(x) * box - made.ball_volumes) < error).all()


@pytest.mark.parametrize("n", [30, 100])
def test_ball_areas_agree_with_points_on_the_spheres(n):
    points, weights = cloud(n, n)
    made = space_filling_diagram(points, weights)
    directions = fibonacci(5000)
    for p in range(n):
        x = points[p] + math.sqrt(weights[p]) * directions
        free = (((x[:, None] - np.delete(points, p, 0)) ** 2).sum(axis=2) >= np.delete(weights, p)).all(axis=1)
        assert abs(free.mean() * 4 * math.pi * weights[p] - made.ball_areas[p]) < 0.005 * 4 * math.pi * weights[p]


# --- voids and pockets


@pytest.mark.parametrize("seed", range(4))
def test_a_ball_that_fills_a_void_adds_its_volume_and_takes_its_area(seed):
    rng = np.random.default_rng(seed)
    points = fibonacci(60) + 0.03 * rng.normal(size=(60, 3))
    weights = rng.uniform(0.12, 0.17, 60)
    hollow = space_filling_diagram(points, weights)
    filled = space_filling_diagram(np.r_[points, np.zeros((1, 3))], np.r_[weights, 0.95**2])
    assert hollow.euler == 4 and filled.euler == 2 and len(hollow.voids) == 1
    assert hollow.voids.volumes[0] == pytest.approx(filled.volume - hollow.volume, rel=1e-11)
    assert hollow.voids.areas[0] == pytest.approx(hollow.area - filled.area, rel=1e-11)


def test_a_void_of_discs():
    turn = np.arange(12) * math.pi / 6
    ring = np.c_[np.cos(turn), np.sin(turn)]
    hollow = space_filling_diagram(ring, np.full(12, 0.1))
    filled = space_filling_diagram(np.r_[ring, [[0, 0]]], np.r_[np.full(12, 0.1), 0.9])
    assert hollow.voids.volumes == pytest.approx([filled.volume - hollow.volume], rel=1e-12)
    assert hollow.voids.areas == pytest.approx([hollow.area - filled.area], rel=1e-12)
    assert hollow.euler == 0


def test_a_bowl_has_a_pocket_with_one_mouth():
    points = fibonacci(200)
    points = points[points[:, 2] < 0.6]
    made = space_filling_diagram(points, np.full(len(points), 0.03))
    assert len(made.voids) == 0 and len(made.pockets) == 1 and made.pockets.mouths[0] > 0
    cells = points[made.pockets.cells]
    x = np.random.default_rng(0).uniform(-1, 1, (40_000, 3))
    inside = np.zeros(len(x), bool)
    for cell in cells:
        share = np.linalg.solve((cell[1:] - cell[0]).T, (x - cell[0]).T)
        inside |= (share >= 0).all(axis=0) & (share.sum(axis=0) <= 1)
    empty = inside & (((x[:, None] - points) ** 2).sum(axis=2) > 0.03).all(axis=1)
    assert made.pockets.volumes[0] == pytest.approx(8 * empty.mean(), rel=0.03)


# --- faces


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_4_2_faces_are_dual_to_the_exposed_simplices(d, seed):
    points, weights = cloud(seed, 40, d, spread=1.6)
    made = space_filling_diagram(points, weights, alpha=0.05)
    for l in range(d):
        faces, k = made.faces(l), d - l - 1
        exposed = made.complex.simplices(k)[made.complex.exposed(k, 0.05)]
        assert set(map(tuple, faces.simplices.tolist())) == set(map(tuple, exposed.tolist()))
        assert ((faces.region >= -1) & (faces.region < len(made.voids))).all()
        for column in range(k + 1 if k else 0):  # a face bounds faces of its own spheres, in its own region
            above = made.faces(l + 1)
            on = faces.on[:, column]
            assert np.array_equal(above.simplices[on], np.delete(faces.simplices, column, axis=1))
            assert np.array_equal(above.region[on], faces.region)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_corners_lie_on_their_spheres_and_outside_all_other_balls(d, seed):
    points, weights = cloud(seed, 60, d, spread=1.6)
    corners = space_filling_diagram(points, weights).faces(0)
    assert len(corners)
    power = ((corners.points[:, None] - points) ** 2).sum(axis=2) - weights
    rows = np.arange(len(corners))[:, None]
    assert np.abs(power[rows, corners.simplices]).max() < 1e-9
    power[rows, corners.simplices] = 1
    assert power.min() > 0


@pytest.mark.parametrize("seed", range(4))
def test_every_arc_has_two_corners_or_none(seed):
    points, weights = cloud(seed, 60)
    made = space_filling_diagram(points, weights)
    ends = np.bincount(made.faces(0).on.ravel(), minlength=len(made.faces(1)))
    assert set(ends.tolist()) <= {0, 2} and (ends == 2).any()


@pytest.mark.parametrize("seed", range(4))
def test_gauss_bonnet_of_the_boundary(seed):
    """Patches, arcs and corners of one union turn by 2 pi times the Euler characteristic of its boundary."""
    points, weights = cloud(seed, 30, spread=1.2)
    made = space_filling_diagram(points, weights)
    shown = made.ball_areas > 0
    total = (made.ball_areas[shown] / weights[shown]).sum()
    arcs, corners = made.faces(1), made.faces(0)
    for i, (p, q) in enumerate(arcs.simplices):
        edge = points[q] - points[p]
        length = np.linalg.norm(edge)
        axis = edge / length
        x = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        x /= np.linalg.norm(x)
        y = np.cross(axis, x)
        mine = corners.points[(corners.on == i).any(axis=1)] - arcs.centers[i]
        angles = np.sort(np.arctan2(mine @ y, mine @ x))
        angle = 2 * math.pi
        if len(angles):
            middle = angles[0] + 1e-6
            there = arcs.centers[i] + arcs.radii[i] * (math.cos(middle) * x + math.sin(middle) * y)
            power = ((there - points) ** 2).sum(axis=1) - weights
            angle = angles[1] - angles[0]
            if np.delete(power, [p, q]).min() < 0:
                angle = 2 * math.pi - angle
        h = 0.5 * (length + (weights[p] - weights[q]) / length)
        total -= angle * (h / math.sqrt(weights[p]) + (length - h) / math.sqrt(weights[q]))
    for point, rows in zip(corners.points, corners.simplices):
        normals = (point - points[rows]) / np.sqrt(weights[rows])[:, None]
        a, b, c = normals
        total += 2 * math.atan2(abs(np.dot(a, np.cross(b, c))), 1 + a @ b + b @ c + c @ a)
    assert total / (2 * math.pi) == pytest.approx(made.euler, abs=1e-7)


def test_balls_on_a_line_meet_in_circles():
    made = space_filling_diagram([[0, 0, 0], [1, 1, 1], [2, 2, 2]], [1, 1, 1])
    assert [len(made.faces(l)) for l in range(3)] == [0, 2, 3]
    assert made.faces(1).on.tolist() == [[1, 0], [2, 1]]


def test_a_ring_of_balls_is_a_torus():
    turn = np.arange(10) * math.pi / 5
    made = space_filling_diagram(np.c_[np.cos(turn), np.sin(turn), 0.1 * np.cos(2 * turn)], np.full(10, 0.15))
    assert made.euler == 0 and len(made.voids) == 0


# --- conventions


def test_2_2_alpha_is_added_to_all_weights():
    points, weights = cloud(5, 50)
    made, same = space_filling_diagram(points, weights, alpha=-0.25), space_filling_diagram(points, weights - 0.25)
    assert made.ball_volumes == pytest.approx(same.ball_volumes, rel=1e-12, abs=1e-12)
    from_complex = space_filling_diagram(alpha_complex(points, weights), alpha=-0.25)
    assert np.array_equal(from_complex.ball_areas, made.ball_areas)
    from_triangulation = space_filling_diagram(regular_triangulation(points, weights), alpha=-0.25)
    assert np.array_equal(from_triangulation.ball_areas, made.ball_areas)


def test_powers_of_two_scale_exactly():
    points, weights = cloud(6, 50)
    made = space_filling_diagram(points, weights)
    for power in (-200, 7, 200):
        scaled = space_filling_diagram(np.ldexp(points, power), np.ldexp(weights, 2 * power))
        assert np.array_equal(scaled.ball_volumes, np.ldexp(made.ball_volumes, 3 * power))
        assert np.array_equal(scaled.voids.volumes, np.ldexp(made.voids.volumes, 3 * power))


def test_the_gate():
    for call in (
        lambda: space_filling_diagram(np.zeros((3, 4)), [1, 1, 1]),
        lambda: space_filling_diagram(CUBE, [1]),
        lambda: space_filling_diagram(alpha_complex(CUBE), np.ones(8)),
        lambda: space_filling_diagram(CUBE, np.ones(8), alpha=math.inf),
        lambda: space_filling_diagram(CUBE, np.ones(8), alpha="0"),
        lambda: space_filling_diagram(CUBE, np.ones(8)).faces(3),
    ):
        with pytest.raises(InvalidInput):
            call()


# --- molecules

PDB = """\
MODEL        1
ATOM      1  N   THR A   1      17.047  14.099   3.625  1.00 13.79           N
ATOM      2  CA AALA A   2      16.967  12.784   4.338  0.50 10.80           C
ATOM      3  CA BALA A   2      16.900  12.700   4.300  0.50 10.80           C
ATOM      4 CA    CA A   3       1.000   2.000   3.000  1.00 10.80
HETATM    5 ZN    ZN A   4       0.000   0.000   0.000  1.00  1.00          ZN
ENDMDL
ATOM      6  N   THR A   1      17.047  14.099   3.625  1.00 13.79           N
"""


def test_atoms_of_the_first_model_and_the_first_place(tmp_path):
    (tmp_path / "a.pdb").write_text(PDB.replace("CA    CA", " CA   AL"))
    atoms = read_molecule(tmp_path / "a.pdb", hetero=True)
    assert atoms.attributes["element"].tolist() == [7, 6, 6, 30]
    assert atoms.attributes["radius"].tolist() == [1.55, 1.70, 1.70, 1.39]
    assert atoms.points[0].tolist() == [17.047, 14.099, 3.625]
    assert len(read_molecule(tmp_path / "a.pdb")) == 3
    assert len(read_points(tmp_path / "a.pdb")) == 4
    assert read_molecule(tmp_path / "a.pdb", radii={"n": 2.0}).attributes["radius"][0] == 2.0
    assert ball_weights(np.array([1.0, 2.0]), 0.5).tolist() == [2.25, 6.25]


def test_molecules_that_cannot_be_read_say_why(tmp_path):
    path = tmp_path / "a.pdb"
    for text, said in (
        ("", "is empty"),
        ("HEADER\n", "no points"),
        (PDB, "line 5: no van der Waals radius for element 'CA'"),
        (PDB.replace("17.047", "  oops"), "line 2: columns 31 to 54"),
        ("\n".join(PDB.splitlines()[5:6]), "hetero=True"),
    ):
        path.write_text(text)
        with pytest.raises(InvalidInput, match=said):
            read_molecule(path)
    with pytest.raises(InvalidInput, match="probe"):
        ball_weights(np.ones(2), -1.0)
    with pytest.raises(InvalidInput, match="entry 1"):
        ball_weights(np.array([1.0, -1.0]))


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "atoms", "accessible"), [("1crn.pdb", 327, 2970), ("1ubq.pdb", 602, 4870), ("1A8O.xyzr", 644, 5400)]
)
def test_accessible_surfaces_of_proteins(name, atoms, accessible):
    if "RECON_DATA" not in os.environ:
        pytest.skip("RECON_DATA is not set")
    molecule = read_molecule(Path(os.environ["RECON_DATA"]) / "molecules" / name)
    assert len(molecule) == atoms
    made = space_filling_diagram(molecule.points, ball_weights(molecule.attributes["radius"], 1.4))
    assert made.area == pytest.approx(accessible, rel=0.003)
