"""Samples on scan lines: how far the lines are apart, noise on them, and the surfaces through them."""

import math

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon.postprocess import denoise
from recon.surface import label_surface
from recon.topology import topology
from weighting.lines import thinning

CLOSED = ["sphere", "torus", "capsule", "rounded_box", "bumpy_sphere", "genus_2"]
OPEN = ["disk", "paraboloid", "mobius_band"]  # a hemisphere is parallel to the planes somewhere, and has a hole there


def lattice(ratio, rows=24, columns=400):
    """Lines of samples at distance 1, `ratio` apart, and which of them are far from all ends."""
    x, y = np.meshgrid(np.arange(float(columns)), ratio * np.arange(float(rows)), indexing="ij")
    x, y = x.ravel(), y.ravel()
    inner = (np.abs(x - columns / 2) < columns / 5) & (np.abs(y / ratio - rows / 2) < rows / 4)
    return np.column_stack([x, y, np.zeros(len(x))]), inner


def scan(name, lines, noise=0.0, n=4000, seed=0):
    """A surface, and samples of it on lines, with noise in units of the mean spacing."""
    surface = datasets_synthetic.surface(name)
    return surface, surface.sample(n, lines=lines, noise=noise * math.sqrt(surface.area / n), rng=seed).points


# --- how far apart ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [6, 10, 20, 60])
def test_line_spacing_is_that_of_even_samples_as_far_apart_as_the_lines(ratio):
    points, inner = lattice(ratio)
    assert np.allclose(weighting.line_spacing(points)[inner], math.sqrt(math.pi / 8) * ratio, rtol=0.01)


def test_lines_farther_apart_than_128_neighbours_reach_are_no_lines():
    points, inner = lattice(70)
    assert np.allclose(weighting.line_spacing(points)[inner], weighting.spacing(points)[inner], rtol=1e-12)


@pytest.mark.parametrize("name", datasets_synthetic.surfaces(3))
def test_where_samples_lie_on_no_lines_line_spacing_is_spacing_to_the_bit(name):
    surface = datasets_synthetic.surface(name)
    step = math.sqrt(surface.area / 2000)
    for how in ({}, {"spacing": "blue"}, {"density": 50}, {"noise": 0.3 * step}, {"outliers": 0.1}):
        hood = weighting.neighbors(surface.sample(2000, rng=2, **how).points)
        assert np.array_equal(weighting.line_spacing(hood), weighting.spacing(hood))
        assert thinning(hood, None) == 1


def test_line_spacing_scales_turns_and_counts_duplicates_once():
    _, points = scan("torus", 12)
    found = weighting.line_spacing(points)
    assert (found > 2 * weighting.spacing(points)).mean() > 0.5
    order = np.random.default_rng(0).permutation(len(points))
    assert np.array_equal(weighting.line_spacing(points[order]), found[order])
    assert np.array_equal(weighting.line_spacing(points * 2.0**40), found * 2.0**40)
    assert np.array_equal(weighting.line_spacing(points * 2.0**-400), found * 2.0**-400)
    assert np.array_equal(weighting.line_spacing(np.concatenate([points, points[::3]]))[: len(points)], found)
    assert np.array_equal(weighting.line_spacing(points, threads=1), found)
    assert np.allclose(weighting.line_spacing(points[:, [2, 0, 1]] + 1.0), found, rtol=1e-9)


@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 0.0, 0.0]],
        [[1.0, 2.0, 3.0]] * 40,
        np.column_stack([np.arange(300.0), np.zeros(300), np.zeros(300)]),  # one line alone
        np.column_stack([np.cos(np.arange(300.0) / 40), np.sin(np.arange(300.0) / 40), np.arange(300.0) / 40]),  # bent
        np.random.default_rng(0).normal(size=(300, 2)),
        np.random.default_rng(0).normal(size=(300, 5)),
        np.column_stack([np.tile(np.arange(150.0), 2), np.repeat([0.0, 1e90], 150), np.zeros(300)]),
    ],
)
def test_what_is_no_surface_on_lines_has_its_plain_spacing(points):
    found = weighting.line_spacing(points)
    assert np.array_equal(found, weighting.spacing(points)) and np.isfinite(found).all()
    assert thinning(weighting.neighbors(points), None) >= 1


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(("ratio", "least", "most"), [(1, 1, 1), (3, 1, 1), (8, 2, 4), (20, 5, 8)])
def test_so_many_samples_are_passed_over_that_the_rest_is_even(ratio, noise, least, most):
    for name in ("sphere", "swiss_roll"):
        _, points = scan(name, ratio, noise)
        assert least <= thinning(weighting.neighbors(points), None) <= most


# --- noise on lines ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sphere", "torus", "capsule", "mobius_band"])
@pytest.mark.parametrize(("lines", "noise"), [(6, 0.3), (12, 0.1), (12, 0.3)])
def test_noise_on_scan_lines_is_seen_and_taken_out(name, lines, noise):
    surface, points = scan(name, lines, noise)
    unit = math.sqrt(surface.area / len(points))
    found = weighting.scatter(points)
    assert found.noisy > 0.9
    assert np.median(found.sigma) == pytest.approx(noise * unit, rel=0.25)
    assert found.relative == pytest.approx(np.median(found.sigma / weighting.spacing(points)), rel=1e-12)
    before, after = (np.abs(surface.distance(p)).mean() for p in (points, denoise(points)))
    assert after < 0.45 * before


@pytest.mark.parametrize("name", CLOSED + OPEN)
def test_clean_scan_lines_stay_where_they_are(name):
    _, points = scan(name, 8)
    assert weighting.scatter(points).noisy == 0


# --- surfaces ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lines", [4, 12])
@pytest.mark.parametrize("name", CLOSED + OPEN)
def test_surfaces_through_scan_lines_have_their_topology(name, lines):
    surface, points = scan(name, lines)
    result = recon.reconstruct(points)
    t = topology(result.mesh.faces)
    assert result.surface == ("closed" if name in CLOSED else "planar" if name == "disk" else "open")
    assert (t.euler, t.boundary_loops, t.nonmanifold_edges) == (surface.euler, surface.boundary_loops, 0)
    assert result.report["mesh"]["share_of_points_used"] > 0.99
    recon.certify(result)


@pytest.mark.parametrize("name", CLOSED)
def test_closed_surfaces_through_noisy_scan_lines_have_their_topology(name):
    surface, points = scan(name, 8, 0.3)
    result = recon.reconstruct(points)
    assert (result.surface, result.report["mesh"]["chi"]) == ("closed", surface.euler)


def test_a_closed_surface_that_was_asked_for_does_not_depend_on_how_far_lines_are_apart():
    _, points = scan("torus", 12)
    triangulation = recon.regular_triangulation(points, weighting.adaptive_weights(points))
    spacing, apart = weighting.spacing(points), weighting.line_spacing(points)
    plain, wide = (label_surface(triangulation, spacing, "closed", apart=a) for a in (None, apart))
    assert np.array_equal(plain.faces, wide.faces)
    assert label_surface(triangulation, spacing).kind == "open"  # between lines all facets are walls
    assert label_surface(triangulation, spacing, apart=apart).kind == "closed"


def test_samples_of_a_circle_are_no_region():
    u = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    with pytest.raises(recon.DegenerateInput, match="samples of a surface"):
        recon.reconstruct(np.column_stack([np.cos(u), np.sin(u), np.cos(u)]))


def test_scans_in_rings_from_four_sides_make_a_torus():
    torus = datasets_synthetic.surface("torus")
    eyes = ([3, 3, 2.0], [-3, 3, -2.0], [3, -3, -2.0], [-3, -3, 2.0])
    result = recon.reconstruct(np.concatenate([torus.scan([eye], (30, 500)).points for eye in eyes]))
    assert (result.surface, result.report["mesh"]["genus"]) == ("closed", 1)
