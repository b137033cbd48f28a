"""Curvature with its error, noise, thickness, outliers: against surfaces about which all is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import datasets_synthetic
import weighting
from weighting._frame import normal_of


def sample(name, n=6000, **how):
    surface = datasets_synthetic.surface(name)
    return surface, surface.sample(n, **{"rng": 11, **how})


def truth(surface, cloud, found):
    """True curvatures, larger magnitude first, in the sense of the normals that were found."""
    principal = np.asarray(surface.curvature(cloud.clean))
    order = np.argsort(-np.abs(principal), axis=1, kind="stable")
    sense = np.sign((found.normal * cloud.normals).sum(axis=1))
    return -sense[:, None] * np.take_along_axis(principal, order, axis=1)  # theirs bend away from the normal


# --- curvature ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [0.001, 0.005])
@pytest.mark.parametrize("name", ["sphere", "torus", "bumpy_sphere"])
def test_the_error_of_curvature_is_what_it_says(name, noise):
    surface, cloud = sample(name, noise=noise)
    found = weighting.curvature(cloud.points, 40)
    score = (found.principal - truth(surface, cloud, found)) / found.error
    inner = np.median(np.abs(score))
    assert 0.4 < inner < 1.1  # 0.67 for a normal distribution
    assert (np.abs(score) < 3).mean() > 0.95


@pytest.mark.parametrize("name", ["sphere", "torus", "ellipsoid"])
def test_without_noise_the_error_holds_the_bias(name):
    surface, cloud = sample(name)
    found = weighting.curvature(cloud.points)
    off = np.abs(found.principal - truth(surface, cloud, found))
    assert (off < 3 * found.error).mean() > 0.95
    assert np.median(found.error[:, 0]) < 0.03 * np.median(np.abs(found.principal[:, 0]))


@settings(deadline=None)
@given(hnp.arrays(np.int64, (5, 3), elements=st.integers(-3, 3)), st.sampled_from([1.0, 1e-3, 1e-9]))
def test_the_normal_is_the_eigenvector_of_the_smallest_eigenvalue(rows, flat):
    rows = rows * np.array([1.0, 1.0, flat])
    a = rows.T @ rows
    n = np.array(normal_of(a[0, 0], a[0, 1], a[0, 2], a[1, 1], a[1, 2], a[2, 2]))
    assert np.linalg.norm(n) == pytest.approx(1.0)
    values = np.linalg.eigvalsh(a)
    assert n @ a @ n - values[0] <= 1e-6 * values[2]


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 0, 1), (1, 2, 2), (-3, 0, 4)])
@pytest.mark.parametrize("length", [1.0, 2.0**-200, 0.0])
def test_the_normal_of_a_line_is_across_it(axis, length):
    a = np.outer(axis, axis) * length
    n = np.array(normal_of(a[0, 0], a[0, 1], a[0, 2], a[1, 1], a[1, 2], a[2, 2]))
    assert np.linalg.norm(n) == pytest.approx(1.0)
    assert length == 0.0 or abs(n @ axis) < 1e-7


def test_curvature_of_a_torus_without_noise():
    surface, cloud = sample("torus")
    found = weighting.curvature(cloud.points)
    off = np.abs(found.principal - truth(surface, cloud, found))
    assert np.median(off[:, 0]) < 0.02 * 3.33 and np.median(off[:, 1]) < 0.03
    assert np.median(np.abs((found.normal * cloud.normals).sum(axis=1))) > 1 - 1e-5


def test_the_error_of_curvature_falls_with_the_spacing():
    medians = []
    for n in (2000, 8000, 32000):
        surface, cloud = sample("torus", n)
        found = weighting.curvature(cloud.points)
        medians.append(np.median(np.abs(found.principal - truth(surface, cloud, found))))
    assert medians[0] > 3 * medians[1] > 9 * medians[2]  # second order in the spacing, first in 1 / n: 4 each


def test_a_quadric_is_fitted_exactly():
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.3, 0.3, (2, 400))
    x[0] = y[0] = 0.0
    points = np.column_stack([x, y, 1.5 * x * x + 0.5 * x * y - 0.25 * y * y])
    # the tangent plane at the middle of 12 neighbours is not that at the sample: nearly, then
    found = weighting.curvature(points, 12)
    expected = np.linalg.eigvalsh([[3.0, 0.5], [0.5, -0.5]])
    assert np.allclose(np.sort(found.principal[0] * np.sign(found.normal[0, 2])), expected, rtol=0.05)
    assert abs(found.normal[0, 2]) > 1 - 1e-4


def test_curvature_of_a_cylinder_side():
    turn, z = np.random.default_rng(0).uniform(0, 1, (2, 6000)) * [[2 * np.pi], [3.0]]
    points = np.column_stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), z])
    found = np.abs(weighting.curvature(points).principal[(z > 0.5) & (z < 2.5)])
    assert np.allclose(found[:, 0], 2.0, rtol=0.05) and np.allclose(found[:, 1], 0.0, atol=0.05)


@pytest.mark.parametrize("tilt", [0.0, 1.0])
def test_a_plane_has_no_curvature_no_noise_and_no_thickness(tilt):
    x, y = np.random.default_rng(0).uniform(size=(2, 300))
    points = np.column_stack([x, y, tilt * (x + 2 * y)])
    assert np.abs(weighting.curvature(points).principal).max() < 1e-10
    assert weighting.noise(points).max() < 1e-14
    assert np.isinf(weighting.thickness(points)).all()


@pytest.mark.parametrize("n", [1, 3, 6, 40])
def test_curvature_that_the_neighbours_do_not_determine_has_an_infinite_error(n):
    line = np.column_stack([np.arange(float(n)), np.zeros(n), np.zeros(n)])
    found = weighting.curvature(line)
    assert np.isinf(found.error).all() and np.isfinite(found.principal).all()
    assert np.allclose(np.linalg.norm(found.normal, axis=1), 1.0)
    assert np.isinf(weighting.thickness(line)).all()


# --- noise --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", [0.001, 0.003, 0.01])
@pytest.mark.parametrize("name", ["sphere", "torus", "paraboloid"])
@pytest.mark.parametrize("density", [1, 10])
def test_noise_is_estimated_without_bias(name, level, density):
    _, cloud = sample(name, noise=level, density=density)
    found = weighting.noise(cloud.points)
    assert np.median(found) == pytest.approx(level, rel=0.07)
    assert np.percentile(found, 90) / np.percentile(found, 10) < 2


def test_samples_without_noise_have_none_that_counts():
    for name in ("sphere", "torus", "ellipsoid"):
        _, cloud = sample(name)
        assert np.percentile(weighting.noise(cloud.points) / weighting.spacing(cloud.points), 99) < 0.02


def test_too_few_samples_say_nothing_of_noise():
    assert np.isnan(weighting.noise(np.eye(3))).all()
    assert np.isnan(weighting.noise([[1.0, 2.0, 3.0]])).all()


# --- thickness ----------------------------------------------------------------------------------------------------


def test_thickness_of_a_ball_and_of_a_torus_is_their_diameter():
    for name, diameter in (("sphere", 2.0), ("torus", 0.6)):
        _, cloud = sample(name)
        assert np.percentile(weighting.thickness(cloud.points), [5, 95]) == pytest.approx(diameter, rel=0.02)


def test_thickness_of_nested_spheres_is_the_gap_between_them():
    _, cloud = sample("nested_spheres")
    assert np.median(weighting.thickness(cloud.points)) == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("thick", [0.1, 0.3])
def test_thickness_of_two_sheets_is_their_distance(thick):
    x, y = np.random.default_rng(0).uniform(size=(2, 4000))
    points = np.column_stack([x, y, thick * (np.arange(4000) % 2)])
    inner = (np.abs(x - 0.5) < 0.3) & (np.abs(y - 0.5) < 0.3)
    found = weighting.thickness(points)[inner]  # the other sheet is touched beside the normal, a little later
    assert found.min() >= thick * 0.98 and np.percentile(found, 95) < 1.05 * thick


def test_noise_does_not_pass_for_thickness():
    _, cloud = sample("torus", noise=0.003)
    assert np.median(weighting.thickness(cloud.points)) == pytest.approx(0.6, rel=0.1)


# --- outliers -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("density", [1, 50])
@pytest.mark.parametrize("spacing", ["random", "blue"])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_clean_samples_are_no_outliers(density, spacing, noise):
    _, cloud = sample("torus", density=density, spacing=spacing, noise=noise)
    assert not weighting.outliers(cloud.points).any()


@pytest.mark.parametrize("density", [1, 50])
@pytest.mark.parametrize(("share", "found"), [(0.01, 0.8), (0.1, 0.5)])
def test_outliers_are_found_and_nothing_else(density, share, found):
    surface, cloud = sample("torus", density=density, outliers=share)
    far = cloud.is_outlier & (np.abs(surface.distance(cloud.points)) > 3 * np.median(weighting.spacing(cloud.points)))
    flagged = weighting.outliers(cloud.points)
    assert flagged[far].mean() > found and not flagged[~cloud.is_outlier].any()
    assert weighting.outliers(cloud.points, excess=2.0)[far].mean() > flagged[far].mean()


def test_an_outlier_gets_no_bigger_ball_than_its_surroundings():
    _, cloud = sample("sphere", 3000)
    points = np.concatenate([cloud.points, [[0.0, 0.0, 0.0], [2.0, 2.0, 2.0], [0.0, 0.1, 0.0]]])
    assert weighting.outliers(points).nonzero()[0].tolist() == [3000, 3001, 3002]
    for radius in ("spacing", "covering"):
        weights = weighting.adaptive_weights(points, radius=radius)
        assert (weights[3000:] <= weights[:3000].max() * 4).all()
        alone = weighting.adaptive_weights(cloud.points, radius=radius)
        assert np.allclose(weights[:3000], alone, rtol=1e-12)


def test_the_ball_of_an_outlier_is_what_its_surroundings_lead_to_expect():
    _, cloud = sample("torus", outliers=0.1)
    flagged = weighting.outliers(cloud.points)
    radius = np.sqrt(weighting.adaptive_weights(cloud.points))
    clean = weighting.spacing(cloud.points[~cloud.is_outlier]).max()
    away = np.linalg.norm(cloud.points[flagged][:, None] - cloud.points[~cloud.is_outlier][None, ::10], axis=2).min(
        axis=1
    )
    assert (radius[flagged] <= 2 * clean + 0.05 * 2 * away).all()  # the way through neighbours is a detour
    assert weighting.spacing(cloud.points)[flagged].max() > 1.5 * radius[flagged].max()


def test_sparse_parts_of_a_surface_are_no_outliers():
    dense, sparse = (sample("torus", n, spacing="blue")[1].points for n in (20000, 1000))
    points = np.concatenate([dense[dense[:, 0] < 0], sparse[sparse[:, 0] > 0]])
    assert not weighting.outliers(points).any()


def test_outliers_in_the_plane():
    turn = np.linspace(0, 2 * math.pi, 400, endpoint=False)
    points = np.concatenate([np.column_stack([np.cos(turn), np.sin(turn)]), [[0.1, 0.2], [3.0, 0.0]]])
    assert weighting.outliers(points).nonzero()[0].tolist() == [400, 401]
