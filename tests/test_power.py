"""The power diagram: duality 3.1 against the definition, measures against hulls, Monte Carlo and closed forms."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle, exact
from scipy.spatial import ConvexHull

from recon import InvalidInput, power_diagram, regular_triangulation

rng = np.random.default_rng(1)
CLOUDS = {
    "line": (rng.random((20, 1)), 0.001 * rng.random(20)),
    "plane": (rng.random((60, 2)), 0.02 * rng.random(60)),
    "space": (rng.random((80, 3)), 0.03 * rng.random(80)),
    "negative": (rng.random((60, 3)), -rng.random(60) * 0.05),
    "four": (rng.random((60, 4)), 0.02 * rng.random(60)),
    "grid": (np.argwhere(np.ones((4, 4, 4))).astype(float), None),
    "decimal grid": (np.argwhere(np.ones((4, 4, 4))) * 0.1, None),
    "far away": (rng.random((60, 3)) + [5e5, 5.4e6, 100], None),
    "duplicates": (rng.integers(0, 3, (60, 3)).astype(float), rng.integers(0, 2, 60).astype(float)),
    "tiny": (1e-60 * rng.random((60, 3)), None),
    "huge": (1e60 * rng.random((60, 3)), None),
}
CLOUD = pytest.mark.parametrize("name", CLOUDS)


def diagram(name):
    return power_diagram(regular_triangulation(*CLOUDS[name]))


def power(x, points, weights):
    return ((x[:, None] - points) ** 2).sum(axis=2) - weights


def small_clouds(d: int):
    point = st.tuples(*[st.integers(-2, 2)] * d, st.integers(-2, 2))
    return st.lists(point, min_size=1, max_size=8).map(
        lambda rows: (np.array(rows)[:, :d] * 1.0, np.array(rows)[:, d] * 1.0)
    )


@CLOUD
def test_3_1_corners_of_a_face_are_nearest_to_its_generators_and_no_one_is_nearer(name):
    made = diagram(name)
    points, weights = made.triangulation.points, made.triangulation.weights
    scale = np.abs(points).max() ** 2
    for l in range(made.dimension + 1):
        faces = made.faces(l)
        for i in range(len(faces)):
            corners = made.vertices[faces.corners_of(i)]
            distance = power(corners, points, weights)
            least = distance.min(axis=1)
            assert (distance[:, faces.simplices[i]] <= least[:, None] + 1e-9 * scale).all()


@settings(max_examples=60, deadline=None)
@given(small_clouds(2))
def test_3_1_vertices_are_the_orthocentres_of_the_cells_in_fractions(cloud):
    made = power_diagram(regular_triangulation(*cloud))
    if made.dimension < 2:
        return
    oracle = Oracle(*cloud)
    for cell, vertex in zip(made.triangulation.cells.tolist(), made.vertices):
        center, _ = oracle.orthosphere(tuple(sorted(cell)))
        assert np.allclose(vertex, [float(value) for value in center], rtol=1e-14, atol=1e-14)


@CLOUD
def test_faces_meet_as_the_simplices_of_R_do(name):
    made = diagram(name)
    d = made.dimension
    counts = [len(made.faces(l)) for l in range(d + 1)]
    assert counts[0] == len(made.triangulation.cells)
    assert counts[d] == len(made.triangulation.points) - len(made.triangulation.hidden)
    assert sum((-1) ** (d - l) * count for l, count in enumerate(counts)) == 1
    edges = made.faces(1)
    assert (np.diff(edges.starts) == np.where(edges.bounded, 2, 1)).all()
    assert np.count_nonzero(~edges.bounded) == len(made.rays[0])


@CLOUD
def test_measures_of_bounded_cells_are_those_of_the_hulls_of_their_corners(name):
    made = diagram(name)
    d = made.triangulation.points.shape[1]
    cells, checked = made.faces(made.dimension), 0
    unit = np.ptp(made.triangulation.points)
    for i in np.flatnonzero(cells.bounded):
        corners = (made.vertices[cells.corners_of(i)] - made.triangulation.points[cells.simplices[i, 0]]) / unit
        volume = np.ptp(corners) if d == 1 else ConvexHull(corners, qhull_options="QJ" if d == 4 else "Qt").volume
        assert cells.measures[i] / unit**d == pytest.approx(volume, rel=1e-6 if name in ("four", "far away") else 1e-9)
        checked += 1
    assert checked > 0 or name == "duplicates"
    assert np.isinf(cells.measures[~cells.bounded]).all()
    volumes = made.volumes
    assert (volumes[made.triangulation.hidden] == 0).all()
    assert np.array_equal(volumes[cells.simplices[:, 0]], cells.measures)


def test_polygons_of_a_space_diagram_have_the_areas_of_their_hulls():
    made = diagram("space")
    faces = made.faces(2)
    for i in np.flatnonzero(faces.bounded):
        corners = made.vertices[faces.corners_of(i)]
        centered = corners - corners.mean(axis=0)
        plane = np.linalg.svd(centered)[2][:2]
        assert faces.measures[i] == pytest.approx(ConvexHull(centered @ plane.T).volume, rel=1e-9, abs=1e-12)


def test_cells_of_a_fenced_cloud_fill_the_box():
    """Mirror images of all points make the walls of the box bisectors."""
    points, weights = rng.random((40, 3)), 0.01 * rng.random(40)
    clouds, all_weights = [points], [weights]
    for axis in range(3):
        for wall in (0.0, 1.0):
            image = points.copy()
            image[:, axis] = 2 * wall - image[:, axis]
            clouds.append(image)
            all_weights.append(weights)
    made = power_diagram(regular_triangulation(np.concatenate(clouds), np.concatenate(all_weights)))
    volumes = made.volumes[:40]
    assert volumes.sum() == pytest.approx(1.0, rel=1e-12)
    x = rng.random((100_000, 3))
    share = np.bincount(power(x, points, weights).argmin(axis=1), minlength=40) / len(x)
    assert (np.abs(share - volumes) < 5 * np.sqrt(volumes / len(x)) + 1e-5).all()


@CLOUD
def test_locate_finds_a_generator_of_least_power_distance(name):
    made = diagram(name)
    points, weights = made.triangulation.points, made.triangulation.weights
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    x = low + extent * rng.uniform(-0.5, 1.5, (2000, points.shape[1]))
    found = made.locate(x)
    assert not np.isin(found, made.triangulation.hidden).any()
    distance = power(x, points, weights)
    assert (distance[np.arange(len(x)), found] <= distance.min(axis=1) + 1e-12 * (np.ptp(points) ** 2)).all()
    assert np.array_equal(made.locate(made.triangulation.points[found]), made.locate(points[found]))


@settings(max_examples=60, deadline=None)
@given(small_clouds(3), st.tuples(*[st.integers(-5, 5)] * 3))
def test_locate_is_exact_on_integers(cloud, x):
    made = power_diagram(regular_triangulation(*cloud))
    p = made.locate([x])[0]
    distance = power(np.array([x]), *cloud)[0]
    assert distance[p] == distance.min()


@CLOUD
def test_rays_point_away_from_the_hull(name):
    made = diagram(name)
    points = made.triangulation.points
    starts, directions = made.rays
    cell, slot = np.nonzero(made.triangulation.neighbors < 0)
    assert np.array_equal(cell, starts)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    scale = np.ptp(points)
    for i in range(len(starts)):
        heights = (points - points[0]) @ directions[i] / scale
        facet = np.delete(made.triangulation.cells[cell[i]], slot[i])
        assert (heights[facet] >= heights.max() - 1e-9).all()


def test_neighbors_share_a_facet():
    made = diagram("space")
    edges = set(map(tuple, made.faces(2).simplices.tolist()))
    for p, q in combinations(range(80), 2):
        assert ((p, q) in edges) == (q in made.neighbors(p)) == (p in made.neighbors(q))


def test_a_flat_cloud_has_prisms_for_cells():
    flat = power_diagram(regular_triangulation(np.c_[CLOUDS["plane"][0], np.zeros(60)], CLOUDS["plane"][1]))
    plane = diagram("plane")
    assert np.allclose(flat.vertices[:, :2], plane.vertices) and (flat.vertices[:, 2] == 0).all()
    assert np.isinf(flat.volumes[np.unique(flat.triangulation.cells)]).all()
    assert np.allclose(flat.faces(2).measures, plane.faces(2).measures)


def test_one_point_has_all_of_space():
    made = power_diagram(regular_triangulation([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]], [1, 2]))
    assert made.volumes.tolist() == [0, np.inf]
    assert made.locate([[9, 9, 9]]).tolist() == [1] and made.neighbors(1).tolist() == []


def test_vertices_of_slivers_are_right_to_the_last_bits():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 2.0**-50]])
    made = power_diagram(regular_triangulation(points, [0, 0, 0.25, 0]))
    (center, _) = Oracle(points, [0, 0, 0.25, 0]).orthosphere((0, 1, 2, 3))
    assert made.vertices[0].tolist() == [float(value) for value in center]
    assert exact(points)[3][2] == Fraction(1, 2**50)


def test_the_gate():
    made = diagram("space")
    for call in (
        lambda: power_diagram([[0, 0]]),
        lambda: made.faces(4),
        lambda: made.faces(True),
        lambda: made.neighbors(80),
        lambda: made.locate([[0, 0]]),
        lambda: made.locate([[0, 0, np.nan]]),
    ):
        with pytest.raises(InvalidInput):
            call()
