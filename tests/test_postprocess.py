"""Islands, holes, normals, attributes, remeshing: each step changes what it says and nothing else."""

import numpy as np
import pytest

import datasets_synthetic
import recon
from recon.intersections import intersecting_faces
from recon.postprocess import fill_holes, flip_edges, remesh, remove_islands, transfer, with_normals
from recon.postprocess.embedding import give_way
from recon.topology import topology

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)


@pytest.fixture(scope="module")
def ball():
    sample = datasets_synthetic.surface("sphere").sample(1500, rng=4)
    return recon.reconstruct(sample.points, attributes={"x": sample.points[:, 0], "row": np.arange(1500)}).mesh


def joined(*meshes):
    """All in one, side by side."""
    start = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return recon.Mesh.from_arrays(
        np.concatenate([m.vertices for m in meshes]), np.concatenate([m.faces + s for m, s in zip(meshes, start)])
    )


def without(mesh, vertices):
    """Without the faces at some vertices."""
    return recon.Mesh.from_arrays(
        mesh.vertices, mesh.faces[~np.isin(mesh.faces, vertices).any(axis=1)], mesh.vertex_source, mesh.attributes
    )


def disk(rings):
    """A flat hexagon of so many rings of triangles."""
    from scipy.spatial import Delaunay

    u, v = np.meshgrid(np.arange(-rings, rings + 1.0), np.arange(-rings, rings + 1.0))
    inside = np.abs(u + v) <= rings
    flat = np.column_stack([(u + v / 2)[inside], (np.sqrt(0.75) * v)[inside]])
    return recon.Mesh.from_arrays(np.column_stack([flat, 0 * flat[:, 0]]), Delaunay(flat).simplices)


# --- islands -------------------------------------------------------------------------------------------------------


def test_shallow_pieces_go_and_deep_ones_stay(ball):
    small = recon.Mesh.from_arrays(0.01 * ball.vertices + [3, 0, 0], ball.faces)  # tiny, but as deep as the big one
    bubble = recon.Mesh.from_arrays(CORNERS + [5, 0, 0], TETRAHEDRON)  # large, but no deeper than a face
    kept, removed = remove_islands(joined(ball, small, bubble, disk(1)))
    assert removed == 1 and topology(kept.faces).components == 3
    assert remove_islands(joined(ball, recon.Mesh.from_arrays(CORNERS, TETRAHEDRON[:1])))[1] == 1


def test_the_greatest_piece_stays_whatever_it_is():
    alone = recon.Mesh.from_arrays(CORNERS, TETRAHEDRON)
    assert remove_islands(alone) == (alone, 0)
    assert remove_islands(joined(alone, alone))[1] == 1
    assert remove_islands(joined(alone, alone), standing=0)[1] == 0
    with pytest.raises(recon.InvalidInput, match="standing"):
        remove_islands(alone, -1)


def test_what_is_kept_keeps_source_and_attributes(ball):
    both = joined(recon.Mesh.from_arrays(CORNERS + 9, TETRAHEDRON), ball)
    both = recon.Mesh.from_arrays(both.vertices, both.faces, attributes={"id": np.arange(len(both.vertices))})
    kept, removed = remove_islands(both)
    assert removed == 1
    np.testing.assert_array_equal(kept.vertices, both.vertices[kept.vertex_source])
    np.testing.assert_array_equal(kept.attributes["id"], kept.vertex_source)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("offset", [0.0, 5e5])
def test_islands_do_not_depend_on_unit_nor_place(scale, offset):
    both = joined(disk(4), recon.Mesh.from_arrays(CORNERS + 20, TETRAHEDRON), disk(1))
    moved = recon.Mesh.from_arrays((both.vertices + offset) * scale, both.faces)
    assert remove_islands(moved)[1] == 1


# --- holes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("apart", [[0], [0, 700, 1400]])
def test_small_holes_are_closed(ball, apart):
    holed = without(ball, apart)
    before = topology(holed.faces)
    assert before.boundary_loops == len(apart)
    whole, filled = fill_holes(holed)
    t = topology(whole.faces)
    assert filled == len(apart) and t.closed and t.manifold and t.oriented and t.euler == 2
    np.testing.assert_array_equal(whole.faces[: len(holed.faces)], holed.faces)
    assert len(intersecting_faces(whole.vertices, whole.faces)) == 0


def test_large_holes_stay_open(ball):
    holed = without(ball, np.flatnonzero(ball.vertices[:, 2] > 0.97))
    rim = topology(holed.faces).open_edges
    assert rim > 12 and fill_holes(holed) == (holed, 0)
    whole, filled = fill_holes(holed, rim)
    assert filled == 1 and topology(whole.faces).closed
    with pytest.raises(recon.InvalidInput, match="at least 3"):
        fill_holes(holed, 2)


def test_a_hole_that_cannot_be_closed_properly_stays(ball):
    triangle = recon.Mesh.from_arrays(CORNERS[:3], [[0, 1, 2]])
    assert fill_holes(triangle) == (triangle, 0)  # a second face on the same corners
    pinched = recon.Mesh.from_arrays([*CORNERS[:3], [-1, 0, 0], [0, -1, 0]], [[0, 1, 2], [0, 3, 4]])
    assert fill_holes(pinched) == (pinched, 0)  # its rim touches itself
    pierced = joined(
        without(ball, [0]),
        recon.Mesh.from_arrays(ball.vertices[0] * [[0.5], [2], [2]] + [[0] * 3, [0] * 3, [0.1, 0.1, 0.1]], [[0, 1, 2]]),
    )
    assert fill_holes(pierced)[1] == 0  # a needle goes through it


# --- normals and attributes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_normals_of_a_ball_point_outwards(ball, scale):
    mesh = with_normals(recon.Mesh.from_arrays(ball.vertices * scale, ball.faces))
    cosine = (mesh.attributes["normals"] * ball.vertices).sum(axis=1)
    assert np.median(cosine) > 0.998 and cosine.min() > 0.9


def test_normals_do_not_depend_on_how_a_corner_is_cut():
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    mesh = with_normals(recon.alpha_shape(cube, 2.0))
    np.testing.assert_allclose(mesh.attributes["normals"], (2 * cube - 1) / np.sqrt(3), atol=1e-12)
    lone = with_normals(recon.Mesh.from_arrays([*CORNERS[:3], [9, 9, 9]], [[0, 1, 2]]))
    assert not lone.attributes["normals"][3].any()


def test_attributes_are_transferred(ball):
    middle = ball.vertices[ball.faces].mean(axis=1)
    target = recon.Mesh.from_arrays(np.concatenate([ball.vertices[:10], middle[:50]]), np.zeros((0, 3), int))
    got, interpolated = transfer(ball, target)
    assert interpolated == 50
    np.testing.assert_array_equal(got.vertex_source, [*ball.vertex_source[:10], *[-1] * 50])
    np.testing.assert_allclose(got.attributes["x"], target.vertices[:, 0], atol=1e-12)
    np.testing.assert_array_equal(got.attributes["row"][:10], ball.attributes["row"][:10])
    assert (ball.attributes["row"][ball.faces[:50]] == got.attributes["row"][10:, None]).any(axis=1).all()
    with pytest.raises(recon.InvalidInput, match="no faces"):
        transfer(target, ball)


# --- other faces ---------------------------------------------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize("offset", [0.0, 5e5])
def test_remeshing_makes_even_faces(ball, offset):
    moved = recon.Mesh.from_arrays(ball.vertices + offset, ball.faces, attributes={"x": ball.vertices[:, 0]})
    even, new = remesh(moved)
    t = topology(even.faces)
    assert new > 0 and t.closed and t.manifold and t.euler == 2

    def spread(mesh):
        corners = mesh.vertices[mesh.faces]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        return edges.std() / edges.mean()

    assert spread(even) < 0.6 * spread(moved)
    assert np.abs(even.attributes["x"] + offset - even.vertices[:, 0]).max() < 1e-6
    finer, _ = remesh(moved, 0.05)
    assert len(finer.faces) > 2 * len(even.faces)
    with pytest.raises(recon.InvalidInput, match="edge"):
        remesh(moved, 0.0)


@pytest.mark.peers
def test_flips_move_no_vertex():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.random((300, 2)), np.zeros(300)])
    from scipy.spatial import Delaunay

    stretched = Delaunay(flat[:, :2] * [1, 12]).simplices
    mesh = recon.Mesh.from_arrays(flat, stretched, attributes={"id": np.arange(300)})
    flipped, changed = flip_edges(mesh)
    assert changed > 50
    np.testing.assert_array_equal(flipped.vertices, mesh.vertices)
    np.testing.assert_array_equal(flipped.attributes["id"], np.arange(300))
    one, two = topology(mesh.faces), topology(flipped.faces)
    assert (one.euler, one.faces, one.open_edges) == (two.euler, two.faces, two.open_edges)


# --- embedding -----------------------------------------------------------------------------------------------------


def test_vertices_give_way_where_faces_would_meet_and_nowhere_else():
    sheet = disk(3)
    both = joined(sheet, recon.Mesh.from_arrays(sheet.vertices + [0, 0, 1], sheet.faces))
    before, n = both.vertices, len(sheet.vertices)
    after = before + [0, 0, 0.1]
    middle = int(np.argmin(np.linalg.norm(sheet.vertices, axis=1)))
    after[middle] += [0, 0, 2]  # through the upper sheet
    assert len(intersecting_faces(after, both.faces))
    moved = give_way(both, before, after)
    assert len(intersecting_faces(moved, both.faces)) == 0
    stayed = (moved == before).all(axis=1)
    assert stayed[middle] and (stayed | (moved == after).all(axis=1)).all() and stayed.sum() < n
    np.testing.assert_array_equal(give_way(both, after, after), after)  # what met before may go on
