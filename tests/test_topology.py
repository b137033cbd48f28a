"""Meshes made by hand, whose topology a person can count."""

from itertools import pairwise

import numpy as np
import pytest

from recon import InvalidInput
from recon.topology import topology

CUBE = np.array(
    [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]
)  # fmt: skip


def strip(n, twisted):
    """A band of 2 n triangles around n rungs; Möbius where twisted."""
    rungs = [(2 * i, 2 * i + 1) for i in range(n)]
    rungs.append(rungs[0][::-1] if twisted else rungs[0])
    return np.array([t for (a, b), (c, d) in pairwise(rungs) for t in ((a, c, b), (b, c, d))])


def grid_torus(n, m):
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, ((i + 1) % n) * m + j
    c, d = i * m + (j + 1) % m, ((i + 1) % n) * m + (j + 1) % m
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])


def glue(first, second, same):
    """Two meshes as one, `same` mapping vertices of the second onto vertices of the first."""
    number = np.arange(second.max() + 1) + first.max() + 1
    number[list(same)] = list(same.values())
    return np.concatenate([first, number[second]])


def test_a_cube_is_a_sphere():
    t = topology(CUBE)
    assert (t.vertices, t.edges, t.faces, t.euler, t.components, t.genus) == (8, 18, 12, 2, 1, 0)
    assert t.closed and t.manifold and t.oriented and t.orientable
    assert t.open_edges == t.boundary_loops == t.nonmanifold_edges == t.nonmanifold_vertices == 0


def test_a_torus_has_one_handle():
    t = topology(grid_torus(7, 5))
    assert (t.euler, t.genus, t.components, t.closed, t.manifold, t.oriented) == (0, 1, 1, True, True, True)


def test_components_add_up():
    t = topology(glue(grid_torus(4, 4), CUBE, {}))
    assert (t.euler, t.genus, t.components) == (2, 1, 2)


def test_two_cubes_sharing_an_edge():
    t = topology(glue(CUBE, CUBE, {0: 0, 1: 1}))
    assert (t.nonmanifold_edges, t.nonmanifold_vertices, t.open_edges, t.components) == (1, 0, 0, 1)
    assert t.closed and not t.manifold and t.genus is None and t.oriented


def test_two_cubes_sharing_a_vertex():
    t = topology(glue(CUBE, CUBE, {0: 0}))
    assert (t.nonmanifold_edges, t.nonmanifold_vertices, t.euler, t.components) == (0, 1, 3, 1)
    assert t.closed and not t.manifold and t.genus is None and t.oriented


def test_two_cubes_sharing_two_vertices_apart():
    t = topology(glue(CUBE, CUBE, {0: 0, 7: 7}))
    assert (t.nonmanifold_edges, t.nonmanifold_vertices, t.euler) == (0, 2, 2)


def test_a_flipped_face_is_not_oriented_but_orientable():
    faces = CUBE.copy()
    faces[3] = faces[3, ::-1]
    t = topology(faces)
    assert not t.oriented and t.orientable and t.closed and t.manifold and t.genus == 0


def test_open_cylinder_has_two_loops():
    t = topology(strip(6, twisted=False))
    assert (t.euler, t.boundary_loops, t.open_edges, t.genus) == (0, 2, 12, None)
    assert t.manifold and t.oriented and not t.closed


@pytest.mark.parametrize("n", [3, 5, 8])
def test_moebius_band_has_one_loop_and_no_orientation(n):
    t = topology(strip(n, twisted=True))
    assert (t.euler, t.boundary_loops, t.open_edges, t.orientable) == (0, 1, 2 * n, False)
    assert t.manifold and not t.oriented and not t.closed and t.genus is None


def test_klein_bottle_is_closed_without_genus():
    n, m = 6, 5
    rows = [[i * m + j for j in range(m)] for i in range(n)]
    rows.append(rows[0][:1] + rows[0][:0:-1])
    quads = [
        (rows[i][j], rows[i + 1][j], rows[i][(j + 1) % m], rows[i + 1][(j + 1) % m]) for i in range(n) for j in range(m)
    ]
    t = topology([f for a, b, c, d in quads for f in ((a, b, c), (b, d, c))])
    assert (t.euler, t.closed, t.manifold, t.orientable, t.genus) == (0, True, True, False, None)


def test_loops_that_touch_in_a_vertex_stay_apart():
    t = topology([[0, 1, 2], [0, 3, 4]])
    assert (t.boundary_loops, t.open_edges, t.nonmanifold_vertices, t.components) == (2, 6, 1, 1)


def test_three_faces_on_an_edge():
    t = topology([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert (t.nonmanifold_edges, t.open_edges, t.nonmanifold_vertices, t.closed) == (1, 6, 0, False)


def test_a_wall_inside_is_not_closed():
    """Two tetrahedra with their common facet kept: no open edge, but three faces on each edge of the wall."""
    t = topology([[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4], [0, 1, 2]])
    assert (t.open_edges, t.nonmanifold_edges, t.closed) == (0, 3, False)


def test_degenerate_and_duplicate_faces_are_counted():
    t = topology([*CUBE, [0, 0, 1], CUBE[4], CUBE[4, ::-1]])
    assert (t.degenerate_faces, t.duplicate_faces, t.faces) == (1, 2, 14)


def test_duplicates_are_found_among_many_vertices():
    far = 3_000_000
    t = topology([[0, 1, far], [1, 2, far], [far, 0, 1], [far - 1, 1, 0]])
    assert (t.vertices, t.duplicate_faces) == (5, 1)


def test_no_face_is_nothing():
    t = topology(np.zeros((0, 3), np.int32))
    assert (t.vertices, t.edges, t.faces, t.components, t.genus, t.closed) == (0, 0, 0, 0, None, False)


def test_numbering_order_and_rotation_change_nothing():
    rng = np.random.default_rng(3)
    faces = glue(grid_torus(6, 5), strip(5, twisted=True), {0: 3})
    relabel = rng.permutation(500)[: faces.max() + 1]
    shuffled = np.array([np.roll(f, rng.integers(3)) for f in relabel[rng.permutation(faces)]])
    assert topology(shuffled) == topology(faces)


@pytest.mark.parametrize("faces", [[[0, 1]], [[0.0, 1, 2]], [[0, -1, 2]], [0, 1, 2]])
def test_what_is_no_list_of_faces_is_refused(faces):
    with pytest.raises(InvalidInput, match="faces"):
        topology(faces)
