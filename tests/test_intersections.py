"""Self-intersections against clipping in rational numbers, and meshes that a person can see through."""

from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import dot, exact, minus, rank

from recon.intersections import intersecting_faces, zero_area


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def clip(polygon, normal, base, closed_both=False):
    """The part of a convex polygon (its corners, in order) where (x - base) . normal >= 0, or == 0."""
    height = [dot(minus(p, base), normal) for p in polygon]
    kept = []
    for i, (p, h) in enumerate(zip(polygon, height)):
        q, g = polygon[i - 1], height[i - 1]
        if h * g < 0:
            kept.append(tuple(a + (b - a) * (g / (g - h)) for a, b in zip(q, p)))
        if h == 0 or (h > 0 and not closed_both):
            kept.append(p)
    return kept


def common(a, b):
    """Corners of the intersection of two triangles with area."""
    normal = cross(minus(b[1], b[0]), minus(b[2], b[0]))
    polygon = clip(list(a), normal, b[0], closed_both=True)
    for i in range(3):
        edge = minus(b[(i + 1) % 3], b[i])
        polygon = clip(polygon, cross(normal, edge), b[i])
    return set(polygon)


def improper(a, b):
    shared = set(a) & set(b)
    if len(shared) == 3:
        return True
    points = common(a, b)
    if len(shared) < 2:
        return not points <= shared
    e0, e1 = shared
    return any(rank([minus(p, e0), minus(e1, e0)]) > 1 for p in points)


def brute(vertices, faces):
    spots = exact(vertices)
    solid = [
        i for i, f in enumerate(faces) if rank([minus(spots[f[1]], spots[f[0]]), minus(spots[f[2]], spots[f[0]])]) == 2
    ]
    return [
        [i, j]
        for i, j in combinations(solid, 2)
        if improper([spots[k] for k in faces[i]], [spots[k] for k in faces[j]])
    ]


corner = st.tuples(*[st.integers(-2, 2)] * 3)


@given(
    st.lists(corner, min_size=6, max_size=6),
    st.sampled_from([(0, 1, 2, 3, 4, 5), (0, 1, 2, 0, 3, 4), (0, 1, 2, 1, 0, 3), (0, 1, 2, 2, 1, 0)]),
    st.sampled_from([1.0, 0.1, 2.0**-600, 1e90]),
)
@settings(max_examples=400, deadline=None)
def test_pairs_on_a_lattice_are_those_of_rational_clipping(spots, six, scale):
    vertices = np.array(spots, float) * scale
    faces = np.array(six).reshape(2, 3)
    assert intersecting_faces(vertices, faces).tolist() == brute(vertices, faces.tolist())


@pytest.mark.parametrize("seed", range(4))
def test_soups_are_those_of_rational_clipping(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(24, 3))
    if seed % 2:
        vertices = np.round(2 * vertices) / 2 + 5e5
    faces = rng.permuted(np.tile(np.arange(24), (40, 1)), axis=1)[:, :3]
    assert intersecting_faces(vertices, faces).tolist() == brute(vertices, faces.tolist())


def test_one_ulp_decides():
    flat = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0], [1, 2, 3], [2, 1, 3]], float)
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    assert intersecting_faces(flat, faces).tolist() == [[0, 1]]
    flat[3, 2] = np.nextafter(0, 1)
    assert len(intersecting_faces(flat, faces)) == 0
    flat[3, 2] = np.nextafter(0, -1)
    assert intersecting_faces(flat, faces).tolist() == [[0, 1]]


def grid(n, height=0.0):
    xy = np.array(list(product(range(n), range(n))), float)
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = (at[i : n - 1 + i, j : n - 1 + j].ravel() for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)))
    return np.column_stack([xy, np.full(n * n, height)]), np.concatenate([np.c_[a, b, c], np.c_[b, d, c]])


def test_a_flat_mesh_does_not_meet_itself():
    assert len(intersecting_faces(*grid(40))) == 0


def test_two_sheets_that_touch_meet():
    vertices, faces = grid(3)
    both = np.concatenate([vertices, vertices + np.array([0.25, 0.25, 0])]), np.concatenate([faces, faces + 9])
    assert intersecting_faces(*both).tolist() == brute(both[0], both[1].tolist())
    lifted = both[0].copy()
    lifted[9:, 2] += 1e-300
    assert len(intersecting_faces(lifted, both[1])) == 0


def test_vertices_at_the_same_place_count_as_one():
    """Two faces that share an edge by place only, as after splitting vertices."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [0, -1, 0.0]])
    vertices[3] = -0.0
    assert len(intersecting_faces(vertices, np.array([[0, 1, 2], [3, 5, 4]]))) == 0
    assert intersecting_faces(vertices, np.array([[0, 1, 2], [3, 2, 4]])).tolist() == [[0, 1]]


def test_a_folded_edge_is_found():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    assert intersecting_faces(vertices, np.array([[0, 1, 2], [1, 0, 3]])).tolist() == [[0, 1]]


def test_faces_without_area_are_known_and_left_out():
    vertices = np.array([[0, 0, 0], [0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [1, 0, 0], [0, 0, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 0, 3], [0, 4, 3]])
    line = rank([minus(*exact(vertices[[1, 0]])), minus(*exact(vertices[[2, 0]]))]) == 1
    assert zero_area(vertices, faces).tolist() == [line, False, True, True]
    assert Fraction(vertices[2, 2]) == 2 * Fraction(vertices[1, 2])
    assert len(intersecting_faces(vertices, faces[[0, 2, 3]])) == 0


def test_nothing_meets_nothing():
    assert intersecting_faces(np.zeros((0, 3)), np.zeros((0, 3), int)).shape == (0, 2)
