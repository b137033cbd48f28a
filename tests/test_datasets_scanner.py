"""The virtual scanner sees all that is in sight, and nothing else."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

import datasets_synthetic
from datasets_synthetic import Surface, surfaces
from datasets_synthetic.scanner import _rays


@cache
def surface(name: str) -> Surface:
    return datasets_synthetic.surface(name)


EYE = np.array([3.0, -2.0, 1.5])


@pytest.mark.parametrize("name", surfaces(3))
def test_every_scanned_point_is_on_the_surface_and_nothing_stands_before_it(name):
    shape = surface(name)
    sample = shape.scan(EYE[None], 30)
    assert len(sample) > 50
    assert np.abs(shape.distance(sample.points)).max() < 1e-12
    away = np.linalg.norm(sample.points - EYE, axis=1)
    toward = (EYE - sample.points) / away[:, None]
    incidence = np.abs(np.einsum("md,md->m", sample.normals, toward))
    assert incidence.min() >= np.cos(np.radians(80)) - 1e-12
    if shape.closed:
        assert (np.einsum("md,md->m", sample.normals, toward) > 0).all()
    for step in np.linspace(0.02, away.min() - 0.1, 40):
        x = sample.points + step * toward
        heights = shape.distance(x)
        assert (heights > 0).all()
    if shape.closed and name != "thin_plate":
        x = sample.points + 0.003 * toward
        assert (shape.distance(x) > 0).all()


@pytest.mark.parametrize("name", ["sphere", "torus", "csg_part", "mobius_band", "trefoil"])
def test_every_part_in_sight_is_scanned(name):
    shape = surface(name)
    scanned = shape.scan(EYE[None], 120, grazing=85)
    probes = shape.draw(250, np.random.default_rng(22))
    away = np.linalg.norm(EYE - probes.points, axis=1)
    toward = (EYE - probes.points) / away[:, None]
    facing = np.einsum("md,md->m", probes.normals, toward)
    in_sight = np.abs(facing) > np.cos(np.radians(70))
    for step in np.linspace(0.01, 3.5, 230):
        x = probes.points + step * toward
        # Clear by a margin: a line of sight that brushes an edge may go either way.
        in_sight &= (np.abs(shape.distance(x)) > 0.25 * min(step, 0.04)) | (step > away)
    if shape.closed:
        in_sight &= facing > 0
    assert in_sight.sum() > 50
    gap = cKDTree(scanned.points).query(probes.points[in_sight])[0]
    assert gap.max() < 0.06


def test_a_sphere_shows_the_cap_that_geometry_says():
    sample = surface("sphere").scan([[2.0, 0.0, 0.0]], 200, grazing=90)
    assert sample.points[:, 0].min() == pytest.approx(0.5, abs=0.05)
    nearer = surface("sphere").scan([[2.0, 0.0, 0.0]], 200, grazing=30)
    # At the incidence i the law of sines gives the angle at the centre: i - asin(sin(i) / 2).
    edge = np.cos(np.radians(30) - np.arcsin(0.25))
    assert nearer.points[:, 0].min() == pytest.approx(edge, abs=0.01)


def test_rays_that_pass_close_by_the_rim_go_on_to_what_is_behind():
    eye = np.array([3.0, 0.1, -0.5])
    shape = surface("hemisphere")
    sample = shape.scan(eye[None], (60, 400), grazing=79)
    lower, upper = shape.bounds
    rays = _rays(eye, 0.5 * (lower + upper), 0.5 * np.linalg.norm(upper - lower), (60, 400))
    half, rest = rays @ eye, eye @ eye - 1
    reaches = half**2 > rest
    roots = -half[reaches, None] + np.array([-1, 1]) * np.sqrt(half[reaches, None] ** 2 - rest)
    hits = eye + roots[:, :, None] * rays[reaches, None]
    first = np.where((hits[:, 0, 2] >= 0)[:, None], hits[:, 0], hits[:, 1])
    steep = np.abs(np.einsum("md,md->m", first, rays[reaches])) >= np.cos(np.radians(79))
    expected = first[steep & (first[:, 2] >= 0)]
    assert len(expected) > 500 and (hits[:, 0, 2] < 0).sum() > 500
    assert len(sample) == len(expected)
    assert cKDTree(sample.points).query(expected)[0].max() < 1e-6


def test_scans_are_numbered_by_viewpoint_and_leave_the_back_unseen():
    sample = surface("sphere").scan([[3.0, 0.0, 0.0], [0.0, 3.0, 0.0]], (50, 60))
    assert set(sample.scan) == {0, 1}
    assert (sample.points[sample.scan == 0][:, 0] > 0).all()
    assert (sample.points[sample.scan == 1][:, 1] > 0).all()
    assert sample.points.sum(axis=1).min() > -1.2


def test_few_rows_of_many_columns_are_scan_lines():
    sample = surface("sphere").scan([[3.0, 0.0, 0.0]], (12, 600))
    directions = sample.points - [3.0, 0.0, 0.0]
    elevation = np.arcsin(directions[:, 2] / np.linalg.norm(directions, axis=1))
    assert len(np.unique(elevation.round(6))) <= 12
    assert len(sample) > 1200


def test_a_viewpoint_inside_sees_all_around():
    sample = surface("sphere").scan([[0.1, 0.0, 0.0]], 60)
    assert len(sample) == 3600
    probes = surface("sphere").draw(500, np.random.default_rng(23)).points
    assert cKDTree(sample.points).query(probes)[0].max() < 0.15


def test_a_planar_scan_sees_the_near_side_of_both_lobes():
    sample = surface("neck").scan([[0.0, 2.0]], 400)
    assert (sample.points[:, 1] > 0).all() and np.ptp(sample.points[:, 0]) > 1.5
    assert sample.points.shape[1] == 2


def test_a_scan_can_be_noisy_and_is_deterministic():
    first, again = (surface("torus").scan(EYE[None], 60).noisy(0.01, rng=1) for _ in range(2))
    assert (first.points == again.points).all()
    assert np.abs(surface("torus").distance(first.points)).std() > 0.003


@pytest.mark.parametrize(
    ("viewpoints", "params", "word"),
    [
        ([1.0, 2.0, 3.0], {}, "viewpoints"),
        ([[1.0, 0.0, 0.0]], {}, "lies on the surface"),
        ([[np.nan, 0.0, 0.0]], {}, "viewpoints"),
        ([[3.0, 0.0, 0.0]], {"resolution": 0}, "resolution"),
        ([[3.0, 0.0, 0.0]], {"resolution": (3, 4, 5)}, "resolution"),
        ([[3.0, 0.0, 0.0]], {"resolution": (3, 0)}, "resolution"),
        ([[3.0, 0.0, 0.0]], {"grazing": -5.0}, "grazing"),
    ],
)
def test_scans_that_cannot_be_meant_are_refused(viewpoints, params, word):
    with pytest.raises(ValueError, match=word):
        surface("sphere").scan(viewpoints, **params)


def test_no_viewpoint_and_a_viewpoint_that_looks_past_give_empty_scans():
    assert len(surface("sphere").scan(np.empty((0, 3)), 10)) == 0
    assert len(surface("disk").scan([[3.0, 0.0, 0.0]], 21)) == 0
