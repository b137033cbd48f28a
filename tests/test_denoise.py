"""Noise: told from shape, taken out, and nothing else taken with it."""

import os
from pathlib import Path

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon.postprocess import denoise
from recon.samples import clean_samples
from recon.topology import topology
from weighting import projection
from weighting._frame import tangents_of
from weighting._scales import FRAME


def cloud(name, noise=0.0, n=4000, **how):
    """A surface, a sample of it with noise in units of the mean spacing, and that spacing."""
    surface = datasets_synthetic.surface(name)
    spacing = np.sqrt(surface.area / n)
    return surface, surface.sample(n, noise=noise * spacing, **{"rng": 3, **how}), spacing


def scans():
    """The folder of real clouds."""
    if "RECON_DATA" not in os.environ:
        pytest.skip("RECON_DATA is not set")
    return Path(os.environ["RECON_DATA"])


def two_sheets(apart, noise, n=6000):
    rng = np.random.default_rng(5)
    top = rng.integers(0, 2, n) * apart
    flat = rng.uniform(0, np.sqrt(n / 2), (n, 2))
    return np.column_stack([flat, top + noise * rng.normal(size=n)]), top


# --- what is noise -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sphere", "torus", "bumpy_sphere", "box", "csg_part", "swiss_roll", "mobius_band"])
@pytest.mark.parametrize("noise", [0.1, 0.4])
def test_noise_is_seen_and_measured(name, noise):
    _, sample, spacing = cloud(name, noise, n=8000)
    found = weighting.scatter(sample.points)
    assert found.noisy > 0.5
    assert found.sigma.mean() == pytest.approx(noise * spacing, rel=0.2)


@pytest.mark.parametrize(
    "name",
    ["sphere", "torus", "ellipsoid", "box", "rounded_box", "cone_frustum", "trefoil", "genus_3", "csg_part", "disk"],
)
@pytest.mark.parametrize("n", [1000, 4000])
def test_shape_is_not_noise(name, n):
    _, sample, _ = cloud(name, n=n, density=10.0)
    assert weighting.scatter(sample.points).noisy == 0


def test_two_sheets_are_not_noise():
    assert weighting.scatter(two_sheets(2.0, 0.0)[0]).noisy == 0


@pytest.mark.parametrize("apart", [0.7, 1.0, 1.3, 2.0])
def test_two_sheets_that_share_their_neighbourhoods_are_not_noise(apart):
    for noise in (0.0, 0.1 * apart):
        found = weighting.scatter(two_sheets(apart, noise, n=3000)[0])
        assert found.noisy < 0.25 and (found.layered > 0.75 or apart > 1.0)  # fits keep some of those apart
    clean = two_sheets(apart, 0.0, n=3000)[0]
    np.testing.assert_array_equal(clean_samples(clean, None, None).points, clean)


@pytest.mark.parametrize("seed", range(3))
def test_thin_walls_beside_clean_faces_are_not_noise(seed):
    """Fins 0.9 spacings thick on a plate: a stretch of samples lies on both."""
    rng, count, high, samples = np.random.default_rng(seed), 8, 0.2, 6000
    h = np.sqrt((1 + 2 * count * high) / samples)
    parts = [np.c_[rng.random((int(1 / h**2), 2)), np.zeros(int(1 / h**2))]]
    for place in (np.arange(count)[:, None] + 0.5) / count + 0.45 * h * np.array([-1, 1]):
        for x in place:
            k = int(high / h**2)
            parts.append(np.c_[np.full(k, x), rng.random(k), high * rng.random(k)])
    assert weighting.scatter(np.concatenate(parts)).noisy < 0.25


@pytest.mark.parametrize("kind", ["normal", "uniform", "triangular"])
def test_a_thick_sheet_is_noise_whatever_its_distribution(kind):
    points, rng = two_sheets(0.0, 0.0, n=3000)[0], np.random.default_rng(2)
    points[:, 2] = {
        "normal": rng.normal(0, 0.5, len(points)),
        "uniform": rng.uniform(-0.8, 0.8, len(points)),
        "triangular": rng.triangular(-1, 0, 1, len(points)),
    }[kind]
    found = weighting.scatter(points)
    assert found.noisy > 0.75 and found.layered == 0


@pytest.mark.parametrize("density", [1.0, 10.0, 50.0])
@pytest.mark.parametrize("noise", [0.1, 0.4])
def test_edges_hide_no_noise(noise, density):
    _, sample, _ = cloud("csg_part", noise, n=3000, density=density)
    assert weighting.scatter(sample.points).noisy > 0.5


def test_the_level_follows_noise_that_varies_over_the_cloud():
    surface, sample, spacing = cloud("torus", n=20000)
    side = sample.clean[:, 0] > 0
    rng = np.random.default_rng(1)
    noisy = sample.clean + sample.normals * (np.where(side, 0.3, 0.1) * spacing * rng.normal(size=len(side)))[:, None]
    sigma = weighting.scatter(noisy).sigma / spacing
    assert np.median(sigma[side]) == pytest.approx(0.3, rel=0.15)
    assert np.median(sigma[~side]) == pytest.approx(0.1, rel=0.25)


@pytest.mark.parametrize("name", ["sphere", "torus", "box", "hemisphere"])
@pytest.mark.parametrize("share", [0.5, 0.2])
def test_a_noisy_part_is_told_from_a_clean_one(name, share):
    """Scans of two sensors, or from two distances."""
    surface, sample, spacing = cloud(name, n=6000)
    noisy = sample.clean[:, 0] > np.quantile(sample.clean[:, 0], 1 - share)
    rng = np.random.default_rng(1)
    points = sample.clean + sample.normals * (0.4 * spacing * noisy * rng.normal(size=len(noisy)))[:, None]
    found = weighting.scatter(points)
    assert (found.where == noisy).mean() > 0.95
    assert found.noisy == pytest.approx(found.where.mean())
    result = recon.reconstruct(points)
    t = topology(result.mesh.faces)
    assert (t.euler, t.boundary_loops, t.manifold) == (surface.euler, surface.boundary_loops, True)
    used = result.mesh.vertex_source
    moved = (result.mesh.vertices != points[used]).any(axis=1)
    assert moved[~found.where[used]].mean() == 0 and moved[noisy[used]].mean() > 0.9
    left, before = (
        np.abs(surface.distance(p[n])).mean() for p, n in ((result.mesh.vertices, noisy[used]), (points, noisy))
    )
    assert left < before / 2


@pytest.mark.parametrize("name", ["sphere", "torus", "ellipsoid"])
def test_noise_along_the_line_of_sight_differs_from_place_to_place(name):
    """None of it where a surface is seen edge on."""
    surface, sample, spacing = cloud(name, n=8000)
    points = sample.clean + (0.4 * spacing * np.random.default_rng(1).normal(size=(8000, 1))) * [0.0, 0.0, 1.0]
    result = recon.reconstruct(points)
    assert topology(result.mesh.faces).euler == surface.euler
    left, before = (np.abs(surface.distance(p)).mean() for p in (result.mesh.vertices, points))
    assert left < 0.4 * before


# --- taking it out -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sphere", "torus", "ellipsoid", "swiss_roll"])
@pytest.mark.parametrize("noise", [0.1, 0.3])
def test_samples_of_a_smooth_surface_come_much_closer(name, noise):
    surface, sample, _ = cloud(name, noise)
    before, after = (np.abs(surface.distance(p)).mean() for p in (sample.points, denoise(sample.points)))
    assert after < before / 3.5


@pytest.mark.parametrize(
    ("name", "share"), [("trefoil", 0.34), ("linked_tori", 0.265), ("cylinder", 0.235), ("box", 0.27)]
)
def test_fits_follow_tubes_and_creases(name, share):
    """Fits as wide as they are long leave 0.38, 0.28, 0.244 and 0.29."""
    surface, sample, _ = cloud(name, 0.4)
    before, after = (np.abs(surface.distance(p)).mean() for p in (sample.points, denoise(sample.points)))
    assert after < share * before


@pytest.mark.parametrize("shape", ["tube", "crease"])
def test_fits_are_longer_the_way_the_surface_bends_least(shape):
    rng = np.random.default_rng(4)
    length = 240 if shape == "tube" else 60
    along, around = rng.uniform(0, length, 6000), rng.uniform(0, 1, 6000)
    if shape == "tube":
        side = 25 / (2 * np.pi) * np.stack([np.cos(2 * np.pi * around), np.sin(2 * np.pi * around)])
    else:
        side = np.stack([100 * around - 50, -np.abs(100 * around - 50)])
    points = np.column_stack([*side, along]) + 0.4 * rng.normal(size=(6000, 3))
    linked = projection.Linked.of(weighting.neighbors(points), None)
    fits = np.full(6000, -1, np.int8), np.empty((6000, FRAME))
    projection._fit(linked, np.full(6000, 0.4), np.arange(6000), projection.LEVELS, fits, None)
    inner = (linked.points[:, 2] > 10) & (linked.points[:, 2] < length - 10)
    if shape == "crease":
        inner &= np.abs(linked.points[:, 0]) < 5
    longer = inner & (fits[0] >= 0) & (fits[1][:, 11] > 1)
    assert longer.sum() > inner.sum() / 2
    tilted = [abs(np.dot([c, s], [t[2] for t in np.reshape(tangents_of(*normal), (2, 3))]))
              for *normal, c, s in fits[1][longer][:, [0, 1, 2, 9, 10]]]  # fmt: skip
    assert np.median(tilted) > np.cos(np.radians(15))


@pytest.mark.parametrize("kind", ["normal", "isotropic"])
@pytest.mark.parametrize(("noise", "share"), [(0.1, 0.05), (0.3, 0.04), (0.5, 0.05)])
def test_a_sphere_does_not_shrink(noise, share, kind):
    surface, sample, spacing = cloud("sphere", noise, noise_kind=kind, n=8000)
    assert abs(surface.distance(denoise(sample.points)).mean()) < share * noise * spacing


def test_a_tube_shrinks_by_half_of_what_noise_along_its_normals_does_to_it_and_no_more():
    """Samples outside are spread thinner: the mean of those along a normal is sigma^2 times the sum of the curvatures inside."""
    tube = datasets_synthetic.surface("torus", minor=0.2)
    for kind, share in (("normal", 0.75), ("isotropic", 0.35)):
        points = tube.sample(20000, noise=0.01, noise_kind=kind, rng=0).points
        assert -share * 0.01**2 / 0.2 < tube.distance(denoise(points)).mean() < 0.1 * 0.01**2 / 0.2


def test_density_may_vary_fiftyfold():
    surface, sample, _ = cloud("torus", 0.1, n=8000, density=50.0)
    before, after = (np.abs(surface.distance(p)).mean() for p in (sample.points, denoise(sample.points)))
    assert after < before / 3


@pytest.mark.parametrize("name", ["box", "cylinder", "csg_part"])
def test_sharp_edges_are_not_rounded_by_more_than_the_noise(name):
    surface, sample, spacing = cloud(name, 0.1, n=8000)
    foot = surface.nearest(sample.clean + 0.5 * spacing * np.random.default_rng(0).normal(size=sample.clean.shape))
    edge = (foot.normals * sample.normals).sum(axis=1) < 0.5  # another face is within a spacing or so
    assert edge.sum() > 100
    off = surface.distance(denoise(sample.points)[edge])
    assert np.sqrt((off**2).mean()) < 0.1 * spacing  # rms, against that of the noise
    assert abs(off.mean()) < 0.03 * spacing


def test_sheets_two_spacings_apart_stay_apart():
    points, top = two_sheets(2.0, 0.1)
    off = denoise(points)[:, 2] - top
    assert np.abs(off).max() < 1 and np.abs(off).mean() < np.abs(points[:, 2] - top).mean()


def test_the_boundary_of_a_sheet_is_not_pulled_inwards():
    _, sample, spacing = cloud("disk", 0.1)
    rim = np.hypot(*sample.clean[:, :2].T)
    rim = rim > np.quantile(rim, 0.95)
    inwards = np.hypot(*sample.points[rim, :2].T) - np.hypot(*denoise(sample.points)[rim, :2].T)
    assert abs(inwards.mean()) < 0.01 * spacing and np.abs(inwards).max() < 0.2 * spacing


def test_a_plane_without_noise_stays():
    x, y = np.meshgrid(np.arange(30.0), np.arange(30.0))
    plane = np.column_stack([x.ravel(), y.ravel(), x.ravel() + 2 * y.ravel()])
    np.testing.assert_allclose(denoise(plane), plane, atol=1e-12)


def test_outliers_neither_move_nor_pull():
    surface, sample, spacing = cloud("torus", 0.1, n=8000, outliers=0.02)
    moved = denoise(sample.points)
    far = sample.is_outlier & (np.abs(surface.distance(sample.points)) > 8 * spacing)
    assert far.sum() > 50
    np.testing.assert_array_equal(moved[far], sample.points[far])
    assert np.abs(surface.distance(moved[~sample.is_outlier])).mean() < 0.03 * spacing


@pytest.mark.parametrize("scale", [2.0**-40, 1.0, 2.0**40])
def test_scaling_by_a_power_of_two_is_exact(scale):
    points = cloud("torus", 0.2, n=1500)[1].points
    np.testing.assert_array_equal(denoise(points * scale), denoise(points) * scale)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
@pytest.mark.parametrize("offset", [0.0, 5e5])
def test_any_scale_and_offset(scale, offset):
    surface, sample, _ = cloud("torus", 0.2, n=1500)
    moved = denoise((sample.points + offset) * scale) / scale - offset
    before, after = (np.abs(surface.distance(p)).mean() for p in (sample.points, moved))
    assert after < before / 3


def test_order_duplicates_and_threads_change_nothing():
    points = cloud("torus", 0.2, n=9000)[1].points
    moved = denoise(points, threads=1)
    np.testing.assert_array_equal(denoise(points, threads=3), moved)
    order = np.random.default_rng(0).permutation(len(points))
    np.testing.assert_array_equal(denoise(points[order]), moved[order])
    np.testing.assert_array_equal(denoise(np.concatenate([points, points[:50]])), np.concatenate([moved, moved[:50]]))


@pytest.mark.parametrize("n", [1, 2, 5, 8, 9, 12, 20])
@pytest.mark.parametrize("shape", ["line", "spot", "cloud"])
def test_few_or_degenerate_points_stay_finite(n, shape):
    t = np.arange(float(n))[:, None]
    points = {"line": t * [1, 2, 3], "spot": t * 0 + [1, 2, 3], "cloud": np.random.default_rng(n).random((n, 3))}[shape]
    moved = denoise(points)
    assert np.isfinite(moved).all() and moved.shape == points.shape
    if shape != "cloud":
        np.testing.assert_allclose(moved, points, atol=1e-12)


def test_a_flat_cloud_is_refused():
    with pytest.raises(recon.InvalidInput, match="3 columns"):
        denoise(np.zeros((5, 2)))
    with pytest.raises(recon.InvalidInput, match="d = 3"):
        weighting.scatter(np.zeros((5, 2)))


# --- of a mesh -----------------------------------------------------------------------------------------------------


def test_a_mesh_keeps_its_faces_and_does_not_run_into_itself():
    surface, sample, _ = cloud("torus", 0.3, n=2000)
    mesh = recon.reconstruct(sample.points, denoise=False).mesh
    smooth = denoise(mesh)
    np.testing.assert_array_equal(smooth.faces, mesh.faces)
    before, after = (np.abs(surface.distance(m.vertices)).mean() for m in (mesh, smooth))
    assert after < before / 2
    recon.certify(smooth)


def test_sheets_of_a_mesh_do_not_see_each_other():
    points, top = two_sheets(0.5, 0.1, n=2000)
    from scipy.spatial import Delaunay

    faces = [np.flatnonzero(top == h)[Delaunay(points[top == h, :2]).simplices] for h in (0.0, 0.5)]
    smooth = denoise(recon.Mesh.from_arrays(points, np.concatenate(faces)))
    assert np.abs(smooth.vertices[:, 2] - top).mean() < 0.6 * np.abs(points[:, 2] - top).mean()
    assert topology(smooth.faces).components == 2


# --- in the whole job ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [0.1, 0.3, 0.5, 1.0])
def test_noise_up_to_the_spacing_leaves_the_topology_right(noise):
    surface, sample, spacing = cloud("torus", noise, n=6000)
    result = recon.reconstruct(sample.points)
    t = topology(result.mesh.faces)
    assert (t.closed, t.manifold, t.genus) == (True, True, 1)
    told = result.report["samples"]
    assert told["denoised"] and (noise > 0.5 or told["noise_in_spacings"] == pytest.approx(noise, rel=0.2))
    moved = np.linalg.norm(result.mesh.vertices - sample.points[result.mesh.vertex_source], axis=1)
    assert 0 < moved.max() <= told["greatest_move"]
    recon.certify(result)


def test_clean_samples_stay_bit_for_bit():
    _, sample, _ = cloud("torus", 0.0)
    result = recon.reconstruct(sample.points)
    assert not result.report["samples"]["denoised"]
    np.testing.assert_array_equal(result.mesh.vertices, sample.points[result.mesh.vertex_source])


def test_denoising_can_be_refused_and_asked_for():
    _, noisy, _ = cloud("torus", 0.2)
    off = recon.reconstruct(noisy.points, denoise=False)
    np.testing.assert_array_equal(off.mesh.vertices, noisy.points[off.mesh.vertex_source])
    assert off.report["samples"] == {"removed_outliers": 0, "denoised": False}
    _, clean, _ = cloud("torus", 0.0)
    assert recon.reconstruct(clean.points, denoise=True).report["samples"]["denoised"]
    with pytest.raises(recon.InvalidInput, match="denoise"):
        recon.reconstruct(clean.points, denoise=0.5)


@pytest.mark.parametrize("name", ["sphere", "torus", "genus_2"])
def test_a_tenth_of_uniform_outliers_does_not_change_the_topology(name):
    surface, sample, _ = cloud(name, n=8000, outliers=0.1, rng=0)
    result = recon.reconstruct(sample.points)
    t = topology(result.mesh.faces)
    assert (t.closed, t.manifold, t.components, t.euler) == (True, True, 1, surface.euler)
    assert result.report["samples"]["removed_outliers"] == weighting.certain_outliers(sample.points).sum() > 700
    recon.certify(result)


@pytest.mark.parametrize("name", ["hemisphere", "paraboloid", "mobius_band"])
def test_a_tenth_of_uniform_outliers_leaves_a_sheet_its_boundary(name):
    surface, sample, _ = cloud(name, n=3000, outliers=0.1, rng=0)
    t = topology(recon.reconstruct(sample.points).mesh.faces)
    assert (t.manifold, t.euler, t.boundary_loops) == (True, surface.euler, surface.boundary_loops)


@pytest.mark.parametrize("name", ["torus", "box", "csg_part", "swiss_roll", "thin_plate"])
@pytest.mark.parametrize("noise", [0.0, 0.3, 0.5])
def test_outliers_beside_a_surface_are_removed_and_hardly_a_sample(name, noise):
    """Within a spacing of it, or four times its noise, they pass for samples."""
    surface, sample, spacing = cloud(name, noise, n=3000, outliers=0.1, rng=1)
    found = weighting.certain_outliers(sample.points)
    beside = sample.is_outlier & (surface.distance(sample.points) > max(1.5, 6 * noise) * spacing)
    assert found[beside].mean() > 0.85
    assert found[~sample.is_outlier].mean() < 0.003


@pytest.mark.parametrize("scale", [2.0**-600, 2.0**300])
def test_outliers_are_the_same_at_any_scale(scale):
    points = np.asarray(cloud("torus", n=1000, outliers=0.1, rng=2)[1].points)
    np.testing.assert_array_equal(weighting.certain_outliers(points * scale), weighting.certain_outliers(points))


@pytest.mark.parametrize("name", ["sphere", "csg_part", "thin_plate", "paraboloid", "trefoil"])
@pytest.mark.parametrize("density", ["area", 50.0])
def test_no_sample_of_a_clean_surface_is_removed(name, density):
    for noise in (0.0, 0.5):
        assert not weighting.certain_outliers(cloud(name, noise, density=density)[1].points).any()


@pytest.mark.data
@pytest.mark.parametrize(
    "path",
    ["meshes/femur.off", "meshes/mannequin-devil.off", "points/oni.pwn", "points/samp11-utm.pcd", "points/horse.ply"],
)
def test_no_sample_of_a_real_scan_is_removed(path):
    points = recon.read_points(scans() / path).points
    assert not weighting.certain_outliers(points).any()


@pytest.mark.data
def test_real_scans_are_denoised_where_they_are_noisy_alone():
    folder = scans()
    noisy = {
        "points/milk.pcd",
        "points/fin90_with_PCA_normals.xyz",
        "points/hippo1.ply",
        "points/sphere_20k.xyz",
        "meshes/femur.off",  # steps of the tomograph
    }
    clean = {
        "points/kitten.xyz",
        "points/horse.ply",
        "points/oni.pwn",
        "meshes/hand.off",
        "meshes/elephant.off",
        "meshes/skull_low_resolution.obj",
    }
    found = {path: weighting.scatter(recon.read_points(folder / path).points).noisy for path in noisy | clean}
    assert {path for path, share in found.items() if share > 0.5} == noisy
    assert all(found[path] == 0 for path in clean)


@pytest.mark.parametrize(
    "name, noise, n",
    [
        ("sphere", 3.0, 20000),
        ("torus", 1.0, 20000),
        ("capsule", 1.5, 20000),
        ("disk", 1.5, 3000),
        ("hemisphere", 2.0, 6000),
    ],
)
def test_noise_wider_than_the_spacing_is_seen_and_taken_out(name, noise, n):
    """Quadrics through the next dozen samples would leave most of it."""
    truth = datasets_synthetic.surface(name)
    sigma = noise * np.sqrt(truth.area / n)
    points = truth.sample(n, noise=sigma, rng=0).points
    found = weighting.scatter(points)
    assert found.noisy == 1
    assert np.median(found.sigma) == pytest.approx(sigma, rel=0.2)
    result = recon.reconstruct(points)
    t = topology(result.mesh.faces)
    assert (t.euler, t.boundary_loops, t.manifold) == (truth.euler, truth.boundary_loops, True)
    assert result.report["mesh"]["share_of_points_used"] > 0.999
    off = np.abs(truth.distance(result.mesh.vertices)).mean()
    assert off < 0.4 * np.abs(truth.distance(points)).mean()


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_what_is_no_surface_at_any_width_stays(noise):
    """A body of points has no surface to be found in the middle of it."""
    rng = np.random.default_rng(0)
    points = rng.random((4000, 3)) + noise * rng.normal(size=(4000, 3))
    assert weighting.scatter(points).noisy < 0.5
    assert not recon.reconstruct(points).report["samples"]["denoised"]
