"""Cleaning opens no hole and moves no face."""

import numpy as np
import pytest

import recon
from recon.postprocess import split_pinches
from recon.topology import topology

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)


def two_tetrahedra(shared: int) -> recon.Mesh:
    """The tetrahedron and its image under the map that fixes its first `shared` corners, facing outward both."""
    other = CORNERS.copy()
    other[shared:] = [[-1, -1, -1], [-2, -1, 0], [-1, -3, 0], [-1, -1, -4]][: 4 - shared]
    name = np.array([k if k < shared else 4 + k - shared for k in range(4)])
    points = np.concatenate([CORNERS, other[shared:]])
    faces = name[TETRAHEDRON]
    a, b, c, d = points[name]
    if np.linalg.det([b - a, c - a, d - a]) < 0:
        faces = faces[:, ::-1]
    return recon.Mesh.from_arrays(
        points, np.concatenate([TETRAHEDRON, faces]), attributes={"id": np.arange(len(points))}
    )


def test_a_pinched_vertex_is_split():
    mesh = two_tetrahedra(1)
    assert topology(mesh.faces).nonmanifold_vertices == 1
    split, copies = split_pinches(mesh)
    t = topology(split.faces)
    assert (copies, t.manifold, t.closed, t.components) == (1, True, True, 2)


def test_a_pinched_edge_is_split():
    mesh = two_tetrahedra(2)
    assert topology(mesh.faces).nonmanifold_edges == 1
    split, copies = split_pinches(mesh)
    t = topology(split.faces)
    assert (copies, t.manifold, t.closed, t.oriented, t.components) == (2, True, True, True, 2)


def test_faces_stay_where_they_are_and_copies_keep_source_and_attributes():
    mesh = two_tetrahedra(2)
    split, _ = split_pinches(mesh)
    np.testing.assert_array_equal(split.vertices[split.faces], mesh.vertices[mesh.faces])
    np.testing.assert_array_equal(split.vertex_source[split.faces], mesh.vertex_source[mesh.faces])
    np.testing.assert_array_equal(split.attributes["id"], split.vertex_source)


def test_faces_without_sides_are_not_cut():
    mesh = recon.Mesh.from_arrays(CORNERS, [[0, 1, 2], [0, 1, 3]])
    assert not topology(mesh.faces).oriented
    assert split_pinches(mesh) == (mesh, 0)


def test_where_an_edge_stays_crowded_faces_that_walk_the_same_way_are_cut_apart():
    fan = [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
    points = np.vstack([CORNERS, [[0.0, -1.0, -1.0]]])
    split, _ = split_pinches(recon.Mesh.from_arrays(points, fan))
    assert topology(split.faces).nonmanifold_edges == 0


def test_a_manifold_is_left_alone():
    mesh = recon.Mesh.from_arrays(CORNERS, TETRAHEDRON)
    assert split_pinches(mesh) == (mesh, 0)
    empty = recon.Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert split_pinches(empty) == (empty, 0)


@pytest.mark.parametrize("seed", range(60))
def test_whatever_the_faces_splitting_gives_a_manifold_of_the_same_faces(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        n, f = int(rng.integers(3, 14)), int(rng.integers(1, 40))
        faces = np.array([rng.choice(n, 3, replace=False) for _ in range(f)])  # turned anyhow, crowded, some twice
        mesh = recon.Mesh.from_arrays(rng.normal(size=(n, 3)), faces)
        split, copies = split_pinches(mesh)
        assert topology(split.faces).manifold
        assert (split.vertex_source[split.faces] == faces).all()
        assert len(split.vertices) == n + copies
