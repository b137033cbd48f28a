"""Holes of a sheet that are filled, and those that stay."""

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon.pinholes import EDGES, pinholes
from recon.surface import OPEN_GATE, PINHOLE, _Evidence
from recon.topology import topology


@pytest.fixture(scope="module")
def sheet():
    """What `pinholes` is told of a sheet without holes, and its faces."""
    points = datasets_synthetic.surface("wavy_sheet").sample(1500, rng=4, spacing="blue").points
    spacing = weighting.spacing(points)
    evidence = _Evidence(recon.regular_triangulation(points, spacing**2), spacing, True, 1)
    sides, _ = evidence.open_sides()
    facets = evidence.between(sides)
    faces = evidence.faces(facets[evidence.gate.ravel()[facets] <= OPEN_GATE]).astype(np.int64)
    ground = (evidence.points, evidence.spacing), (evidence.nodes, evidence.gate, *evidence.stars)
    assert len(pinholes(*ground, faces, PINHOLE)) == 0
    return evidence, ground, faces


def filled(sheet, removed: list[int]) -> np.ndarray:
    """The faces that fill what is left when some are removed, corners ascending."""
    evidence, ground, faces = sheet
    return np.sort(evidence.faces(pinholes(*ground, np.delete(faces, removed, axis=0), PINHOLE)), axis=1)


def inner_face(faces: np.ndarray) -> int:
    """A face none of whose vertices is on the boundary."""
    corners = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, count = np.unique(corners, axis=0, return_counts=True)
    return int(np.flatnonzero(~np.isin(faces, edges[count == 1]).any(axis=1))[100])


def test_one_missing_face_is_put_back(sheet):
    face = inner_face(sheet[2])
    np.testing.assert_array_equal(filled(sheet, [face]), np.sort(sheet[2][[face]], axis=1))


def test_a_hole_of_four_edges_is_filled_by_a_disk_of_facets(sheet):
    faces = sheet[2]
    face = inner_face(faces)
    other = next(f for f in np.flatnonzero(np.isin(faces, faces[face]).sum(axis=1) == 2))
    found = filled(sheet, [face, other])
    assert len(found) == 2
    whole = np.concatenate([np.delete(faces, [face, other], axis=0), found])
    assert topology(whole).euler == topology(faces).euler and topology(whole).nonmanifold_edges == 0


def test_a_hole_as_wide_as_several_samples_stays(sheet):
    points, faces = sheet[1][0][0], sheet[2]
    middle = points[faces[inner_face(faces)]].mean(axis=0)
    radius = 3 * np.median(sheet[1][0][1])
    hole = np.flatnonzero(np.linalg.norm(points[faces].mean(axis=1) - middle, axis=1) < radius)
    assert len(filled(sheet, hole)) == 0


def test_the_boundary_of_a_small_piece_is_no_hole(sheet):
    evidence, ground, faces = sheet
    assert len(pinholes(*ground, faces[[inner_face(faces)]], PINHOLE)) == 0
    assert EDGES > PINHOLE


@pytest.mark.parametrize("name, n, density, noise", [("mobius_band", 3000, 10, 0.3), ("wavy_sheet", 30000, 50, 0.3)])
def test_no_pinholes_are_left(name, n, density, noise):
    truth = datasets_synthetic.surface(name)
    sample = truth.sample(n, rng=1, density=density, noise=noise * np.sqrt(truth.area / n))
    result = recon.reconstruct(sample.points)
    t = topology(result.mesh.faces)
    assert (t.euler, t.boundary_loops) == (truth.euler, truth.boundary_loops)
    assert t.manifold
    recon.certify(result)


def test_a_missing_triangle_of_a_planar_region_is_put_back():
    points = np.array(datasets_synthetic.surface("disk").sample(30000, rng=1).points)
    assert topology(recon.reconstruct(points).mesh.faces).boundary_loops == 1


def test_mending_pinched_samples_tears_no_sheet():
    """Facets too wide for a sheet are none, and of no energy: cells far away are not worth a hole."""
    truth = datasets_synthetic.surface("wavy_sheet")
    sample = truth.sample(30000, rng=2, density=10, noise=0.3 * np.sqrt(truth.area / 30000))
    t = topology(recon.reconstruct(sample.points).mesh.faces)
    assert (t.euler, t.boundary_loops) == (truth.euler, truth.boundary_loops)
