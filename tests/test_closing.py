"""Closed surfaces by weights: what is claimed is true of the exact complex, and how far the search gets."""

from __future__ import annotations

import os
from collections import Counter
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle

import datasets_synthetic
import recon
import weighting
from recon.contracts import DegenerateInput, InvalidInput
from weighting.closing import _size

# Six corners, eight equilateral triangles of size 2/3 - w, and a long diagonal of size 1 - w within.
OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
HOLLOW = 0.8


def is_closed_surface(simplices):
    """Pure of dimension 2, two triangles an edge, one ring of triangles a vertex: slowly, by definition."""
    faces = [s for s in simplices if len(s) == 3]
    if not faces or simplices != {t for f in faces for k in (1, 2, 3) for t in combinations(f, k)}:
        return False
    if set(Counter(e for f in faces for e in combinations(f, 2)).values()) != {2}:
        return False
    for vertex in {v for f in faces for v in f}:
        ring = [tuple(v for v in f if v != vertex) for f in faces if vertex in f]
        reached = set(ring[0])
        while more := {v for e in ring if reached & set(e) for v in e} - reached:
            reached |= more
        if reached != {v for e in ring for v in e}:
            return False
    return True


def level_by_definition(oracle):
    """Level 1 from table 5.1, level 2 by flooding cells from outside; both on rational numbers."""
    everything = [t for k in range(3) for t in oracle.simplices(k)]
    if is_closed_surface({t for t in everything if oracle.classify(t, 0) in ("singular", "regular")}):
        return 1
    inside = oracle.complex(0)
    open_cells = [c for c in oracle.cells if c not in inside]
    facets = Counter(f for c in oracle.cells for f in combinations(c, 3))
    hull = {f for f, count in facets.items() if count == 1}
    reached = {c for c in open_cells if any(f in hull and f not in inside for f in combinations(c, 3))}
    while more := {
        c for c in open_cells if c not in reached and any(len(set(c) & set(r)) == 3 and
        tuple(sorted(set(c) & set(r))) not in inside for r in reached)
    }:  # fmt: skip
        reached |= more
    touched = {t for c in reached for k in (1, 2, 3) for t in combinations(c, k)}
    touched |= {t for f in hull for k in (1, 2, 3) for t in combinations(f, k)}
    return 2 if is_closed_surface(touched & inside) else 0


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3, st.integers(-2, 8)), min_size=4, max_size=8))
def test_the_level_is_that_of_the_definition_on_rational_numbers(rows):
    points, weights = [row[:3] for row in rows], [row[3] for row in rows]
    oracle = Oracle(points, weights)
    if oracle.dimension < 3:
        with pytest.raises(DegenerateInput, match="one plane"):
            weighting.closure(points, weights)
        return
    found = weighting.closure(points, weights)
    assert found.level == level_by_definition(oracle)
    assert found.cells == sum(cell in oracle.complex(0) for cell in oracle.cells)
    assert found.undecided == 0


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(*[st.integers(-3, 3)] * 3, st.integers(-3, 3)), min_size=4, max_size=8))
def test_sizes_near_zero_are_decided_as_rational_numbers(rows):
    points, weights = np.array([row[:3] for row in rows], float), np.array([row[3] for row in rows], float)
    oracle = Oracle(points, weights)
    for k in range(oracle.dimension + 1):
        for simplex in oracle.simplices(k):
            assert _size(points[list(simplex)], weights[list(simplex)]) == oracle.rho(simplex)


def test_a_hollow_octahedron_is_itself_the_closed_surface():
    found = weighting.closure(OCTAHEDRON, [HOLLOW] * 6)
    assert (found.level, found.euler, found.cells, len(found.faces), found.share) == (1, 2, 0, 8, 1.0)


def test_a_filled_octahedron_bounds_by_a_closed_surface():
    found = weighting.closure(OCTAHEDRON, [1.1] * 6)
    assert (found.level, found.euler, found.cells, len(found.faces)) == (1, 2, 4, 8)


def test_a_point_inside_leaves_the_outer_boundary_closed():
    found = weighting.closure([*OCTAHEDRON, [0, 0, 0]], [HOLLOW] * 6 + [0.01])
    assert (found.level, found.euler, len(found.faces)) == (2, 2, 8)
    assert found.share == 6 / 7


def test_a_point_outside_is_a_fault():
    found = weighting.closure([*OCTAHEDRON, [5, 0, 0]], [HOLLOW] * 6 + [0.01])
    assert (found.level, found.loose) == (0, 1)


def test_a_missing_triangle_is_a_fault():
    # The ball at (1, 0, 0) shrinks until the four triangles there are uncovered.
    found = weighting.closure(OCTAHEDRON, [0.3] + [HOLLOW] * 5)
    assert (found.level, found.open_edges) == (0, 4)


def test_two_octahedra_apart_are_a_closed_surface_and_two_that_touch_are_not():
    for shift, level, pinched in ((5.0, 1, 0), (2.0, 0, 1)):
        points = np.unique(np.concatenate([OCTAHEDRON, OCTAHEDRON + [shift, 0, 0]]), axis=0)
        found = weighting.closure(points, np.full(len(points), HOLLOW))
        assert (found.level, found.nonmanifold_vertices) == (level, pinched)
        assert found.components == 2 - pinched


@pytest.mark.parametrize(
    ("name", "spacing", "n"),
    [
        ("torus", "blue", 1500),
        ("torus", "random", 2000),
        ("genus_3", "blue", 2000),
        ("nested_spheres", "random", 1000),
    ],
)
def test_w0_itself_becomes_the_closed_surface(name, spacing, n):
    surface = datasets_synthetic.surface(name)
    points = surface.sample(n, spacing=spacing, rng=0).points
    found = weighting.closing_weights(points)
    assert (found.level, found.euler, found.cells) == (1, surface.euler, 0)
    assert found.share > 0.99
    # What the library says of K_0 by other means: a closed surface and nothing else.
    shape = recon.alpha_complex(points, found.weights)
    vertices, edges, faces, cells = shape.f_vector(0.0).tolist()
    components, tunnels, voids = shape.betti(0.0).tolist()
    assert (2 * edges, cells) == (3 * faces, 0)
    assert (components, voids) == (found.components, found.components)
    assert components - tunnels + voids == surface.euler == vertices - edges + faces
    assert not np.diff(shape.f_vector([-1e-9 * found.weights.max(), 0.0]), axis=0).any()  # no size is at the edge


def test_sharp_edges_get_a_closed_outer_boundary():
    points = datasets_synthetic.surface("box").sample(3000, rng=0).points
    start = weighting.closure(points, weighting.adaptive_weights(points, radius="covering"))
    found = weighting.closing_weights(points, rounds=4)
    assert (start.level, found.level, found.euler) == (0, 2, 2)
    assert found.share > 0.99


def test_small_balls_are_raised_until_nothing_leaks():
    points = datasets_synthetic.surface("torus").sample(1000, spacing="blue", rng=1).points
    small = 0.36 * weighting.spacing(points) ** 2
    assert weighting.closure(points, small).level == 0
    found = weighting.closing_weights(points, small)
    assert (found.level, found.euler) == (1, 0)
    assert (found.weights > small).mean() > 0.5


def test_what_is_claimed_holds_of_the_weights_that_come_back():
    points = datasets_synthetic.surface("trefoil").sample(800, rng=0).points
    found = weighting.closing_weights(points, rounds=2)
    again = weighting.closure(points, found.weights)
    for name in ("level", "euler", "components", "cells", "share", "loose", "open_edges", "nonmanifold_edges"):
        assert getattr(again, name) == getattr(found, name), name
    assert np.array_equal(again.faces, found.faces)


def test_the_order_of_points_and_duplicates_change_no_weight():
    points = datasets_synthetic.surface("torus").sample(600, spacing="blue", rng=2).points
    plain = weighting.closing_weights(points)
    order = np.random.default_rng(0).permutation(len(points))
    assert np.array_equal(weighting.closing_weights(points[order]).weights, plain.weights[order])
    twice = weighting.closing_weights(np.concatenate([points, points[:50]]))
    assert np.array_equal(twice.weights, np.concatenate([plain.weights, plain.weights[:50]]))
    assert (twice.level, twice.euler, twice.share) == (1, 0, 1.0)


@pytest.mark.parametrize("k", [-60, 40])
def test_scaling_by_a_power_of_two_changes_nothing_but_the_scale(k):
    points = datasets_synthetic.surface("sphere").sample(500, rng=3).points
    plain, scaled = weighting.closing_weights(points), weighting.closing_weights(np.ldexp(points, k))
    assert np.array_equal(scaled.weights, np.ldexp(plain.weights, 2 * k))
    assert np.array_equal(scaled.faces, plain.faces)


def test_a_cloud_without_a_surface_is_not_called_closed_unless_it_is():
    points = np.random.default_rng(0).uniform(size=(200, 3))
    found = weighting.closing_weights(points, rounds=2)
    assert found.level == weighting.closure(points, found.weights).level
    assert "closed" in repr(found)


def test_bad_input_is_refused_in_one_line():
    grid = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    for bad in (grid, grid[:3], np.zeros((9, 3))):
        with pytest.raises(DegenerateInput, match="one plane"):
            weighting.closing_weights(bad)
    with pytest.raises(InvalidInput, match="rounds: expected a whole number, 1 to 10,000, got 0"):
        weighting.closing_weights(OCTAHEDRON, rounds=0)
    with pytest.raises(InvalidInput, match="weights: expected shape"):
        weighting.closing_weights(OCTAHEDRON, [1.0])
    with pytest.raises(InvalidInput, match="points: expected 3 columns"):
        weighting.closing_weights(OCTAHEDRON[:, :2])
    with pytest.raises(InvalidInput, match="3-D points"):
        weighting.closing_weights(weighting.neighbors(np.random.default_rng(0).uniform(size=(40, 2)), 24))
    with pytest.raises(InvalidInput, match="points: expected 3 columns"):
        weighting.closure(OCTAHEDRON[:, :2])


@pytest.mark.data
@pytest.mark.skipif("RECON_DATA" not in os.environ, reason="RECON_DATA is not set")
@pytest.mark.parametrize(("name", "euler"), [("knot1.off", 0), ("goathead.obj", 2)])
def test_real_models_close(name, euler):
    points = recon.read_mesh(Path(os.environ["RECON_DATA"]) / "meshes" / name).vertices
    found = weighting.closing_weights(points, rounds=2)
    assert found.level in (1, 2)
    assert found.euler == euler
    assert found.share > 0.99
