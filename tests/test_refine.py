"""Inserted vertices lie on the surface between the samples, and change nothing else."""

import numpy as np
import pytest

import datasets_synthetic
import recon
from recon.intersections import intersecting_faces
from recon.postprocess import refine
from recon.proximity import area_samples
from recon.topology import topology


def meshed(name, n=2000, noise=0.0, **how):
    surface = datasets_synthetic.surface(name)
    sample = surface.sample(n, noise=noise * np.sqrt(surface.area / n), **{"rng": 2, **how})
    return surface, recon.reconstruct(sample.points, attributes={"row": np.arange(n), "x": sample.points[:, 0]}).mesh


def off(surface, mesh):
    return np.abs(surface.distance(area_samples(mesh.vertices, mesh.faces, 5000, np.random.default_rng(0))[0])).mean()


@pytest.mark.parametrize(("name", "share"), [("sphere", 0.5), ("torus", 0.35), ("ellipsoid", 0.4), ("trefoil", 0.4)])
def test_a_refined_mesh_is_nearer_to_the_surface(name, share):
    surface, mesh = meshed(name)
    fine, inserted = refine(mesh)
    assert inserted > 0
    assert off(surface, fine) < share * off(surface, mesh)


@pytest.mark.parametrize("noise", [0.0, 0.2])
@pytest.mark.parametrize("name", ["torus", "csg_part", "rounded_box", "paraboloid", "swiss_roll"])
def test_topology_orientation_and_embedding_stay(name, noise):
    _, mesh = meshed(name, n=1500, noise=noise)
    fine, _ = refine(mesh)
    one, two = topology(mesh.faces), topology(fine.faces)
    for figure in (
        "euler",
        "components",
        "boundary_loops",
        "nonmanifold_edges",
        "nonmanifold_vertices",
        "oriented",
        "closed",
    ):
        assert getattr(one, figure) == getattr(two, figure), figure
    assert len(intersecting_faces(fine.vertices, fine.faces)) == 0


def test_given_vertices_stay_and_attributes_are_interpolated():
    _, mesh = meshed("torus", n=1500)
    fine, inserted = refine(mesh)
    v = len(mesh.vertices)
    assert len(fine.vertices) == v + inserted
    np.testing.assert_array_equal(fine.vertices[:v], mesh.vertices)
    np.testing.assert_array_equal(fine.vertex_source[:v], mesh.vertex_source)
    assert (fine.vertex_source[v:] == -1).all()
    np.testing.assert_array_equal(fine.attributes["row"][:v], mesh.attributes["row"])
    assert fine.attributes["row"].dtype == mesh.attributes["row"].dtype
    assert np.abs(fine.attributes["x"] - fine.vertices[:, 0]).max() < 0.03  # the bulge alone is missing
    assert fine.attributes["x"][v:].std() > 0.1


def test_what_is_flat_is_left_alone():
    x, y = np.meshgrid(np.arange(12.0), np.arange(12.0))
    plane = recon.reconstruct(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])).mesh
    assert refine(plane) == (plane, 0)
    empty = recon.Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert refine(empty) == (empty, 0)
    tetrahedron = recon.Mesh.from_arrays(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    assert refine(tetrahedron) == (tetrahedron, 0)  # four vertices say nothing of a curve


def test_sharp_edges_do_not_bulge():
    surface, mesh = meshed("box", n=6000, spacing="blue")
    fine, _ = refine(mesh)
    assert off(surface, fine) <= off(surface, mesh)
    beyond = surface.distance(fine.vertices)
    spacing = np.sqrt(surface.area / 6000)
    assert beyond.max() < 0.1 * spacing and (beyond > 0.02 * spacing).mean() < 0.02


def test_a_smaller_turn_gives_more_and_nearer():
    surface, mesh = meshed("torus", n=1000)
    coarse, few = refine(mesh, 20.0)
    fine, many = refine(mesh, 5.0)
    assert 0 < few < many and off(surface, fine) < off(surface, coarse)
    with pytest.raises(recon.InvalidInput, match="turn"):
        refine(mesh, 0.0)


def test_a_one_sided_band_can_be_refined():
    surface, mesh = meshed("mobius_band", n=2000)
    fine, inserted = refine(mesh, 2.0)
    assert inserted > 0 and off(surface, fine) < off(surface, mesh)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_any_scale_and_offset(scale):
    _, mesh = meshed("torus", n=1000)
    inserted = refine(mesh)[1]
    for offset in (0.0, 5e5):
        moved = recon.Mesh.from_arrays((mesh.vertices + offset) * scale, mesh.faces)
        assert refine(moved)[1] == pytest.approx(inserted, rel=0.01)
