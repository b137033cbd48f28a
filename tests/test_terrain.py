"""Terrain: what a scanner sees from above, one height at each place."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import datasets_synthetic
import recon
import weighting
from recon.cli import main
from recon.contracts import CertificateError, DegenerateInput
from recon.mesh import Mesh
from recon.samples import Samples
from recon.stages.meshlab import generate_weighted_alpha_shape
from recon.stages.open3d import create_from_point_cloud_weighted_alpha_shape
from recon.terrain import from_above, seen_from_above
from recon.topology import topology

SIDE = 60.0


def pulses(rng: np.random.Generator, step: float = 1.0) -> np.ndarray:
    """Places on a jittered grid."""
    along = np.arange(step / 2, SIDE, step)
    grid = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    return grid + rng.normal(0, 0.15 * step, grid.shape)


def hills(xy: np.ndarray) -> np.ndarray:
    return 3 * np.sin(xy[:, 0] / 11) * np.cos(xy[:, 1] / 9)


def forest(rng: np.random.Generator, step: float = 1.0) -> np.ndarray:
    """Hills under trees: of the pulses that meet a crown three in four are sent back from somewhere in it, the others from below."""
    xy = pulses(rng, step)
    z = hills(xy) + rng.normal(0, 0.05, len(xy))
    for middle in rng.random((90, 2)) * SIDE:
        away = np.linalg.norm(xy - middle, axis=1) / rng.uniform(2, 4)
        seen = (away < 1) & (rng.random(len(xy)) < 0.75)
        crown = rng.uniform(6, 14) * (1 - 0.5 * away**2) - rng.exponential(1.5, len(xy))
        z[seen] = (hills(xy) + np.maximum(crown, 0))[seen]
    return np.column_stack([xy, z])


def is_disk(mesh: Mesh) -> bool:
    t = topology(mesh.faces)
    return (t.euler, t.components, t.boundary_loops, t.manifold, t.oriented) == (1, 1, 1, True, True)


@pytest.mark.parametrize("seed", range(3))
def test_pulses_over_trees_are_a_terrain(seed):
    points = forest(np.random.default_rng(seed))
    result = recon.reconstruct(points)
    assert result.surface == "terrain" and result.confidence > 0
    assert "in the plan" in result.report["surface"]["because"]
    assert is_disk(result.mesh)
    assert result.report["mesh"]["share_of_points_used"] == 1
    recon.certify(result)
    assert topology(recon.reconstruct(points, surface="open").mesh.faces).euler < -20  # what the choice is for


@pytest.mark.parametrize("turn", [[1, 2, 0], [2, 0, 1]], ids=["x up", "y up"])
def test_up_is_z(turn):
    assert recon.reconstruct(forest(np.random.default_rng(0))[:, turn]).surface != "terrain"


def test_smooth_hills_stay_a_sheet_and_are_a_terrain_on_request():
    xy = pulses(np.random.default_rng(0))
    points = np.column_stack([xy, hills(xy)])
    sheet, terrain = recon.reconstruct(points), recon.reconstruct(points, surface="terrain")
    assert sheet.surface == "open" and is_disk(sheet.mesh)
    assert terrain.surface == "terrain" and terrain.confidence == 1 and is_disk(terrain.mesh)
    np.testing.assert_array_equal(np.sort(terrain.mesh.vertex_source), np.arange(len(points)))


@pytest.mark.parametrize("name", ["wavy_sheet", "disk", "paraboloid", "thin_plate", "bumpy_sphere"])
@pytest.mark.parametrize(
    "condition", [{"outliers": 0.3}, {"density": 50}, {"noise": 0.05}, {"outliers": 0.1, "density": 50}]
)
def test_outliers_noise_and_gradients_are_no_terrain(name, condition):
    points = datasets_synthetic.surface(name).sample(3000, rng=0, **condition).points
    assert not seen_from_above(points, None)
    assert recon.reconstruct(points).surface != "terrain"


def test_a_full_grid_is_no_terrain():
    grid = np.stack(np.meshgrid(*[np.arange(12.0)] * 3), axis=-1).reshape(-1, 3)
    assert not seen_from_above(grid, None)


def test_the_highest_of_one_place_counts():
    rng = np.random.default_rng(0)
    top = np.column_stack([pulses(rng), rng.uniform(5, 6, 3600)])
    below = top[::3] - [0, 0, 4]
    twice = top[:5]
    points = np.vstack([below, top, twice])
    result = recon.reconstruct(points, surface="terrain", denoise=False)
    assert sorted(result.mesh.vertex_source) == list(
        range(len(below), len(below) + len(top))
    )  # the first row of equal ones
    assert result.report["triangulation"]["hidden_points"] == len(below)
    assert result.report["mesh"]["share_of_points_used"] == len(top) / (len(top) + len(below))
    recon.certify(result)


def test_removed_samples_do_not_count_as_highest():
    located = np.array([[0.0, 0, 1], [0, 0, 2], [1, 0, 5], [0, 0, 2], [1, 0, 5]])
    # Row 4 was an outlier and stands where row 2 does; row 1 is above row 0, row 3 repeats it.
    samples = Samples(located, weighting.neighbors(located), np.array([4]), np.array([2]), 1, {})
    plan = from_above(samples, None)
    np.testing.assert_array_equal(plan.points, located * [1, 1, 0])
    np.testing.assert_array_equal(plan.removed, [0, 3, 4])
    np.testing.assert_array_equal(plan.nearest, [1, 1, 2])
    lowered = replace(samples, removed=np.array([1]), nearest=np.array([3]))
    np.testing.assert_array_equal(from_above(lowered, None).removed, [0, 1, 4])


def test_overlapping_flights_leave_no_holes():
    rng = np.random.default_rng(0)
    first, second = forest(rng), forest(rng)
    beside = second[second[:, 0] > SIDE / 2] + [0.1, 0.1, 0]  # the same places again, nearly
    result = recon.reconstruct(np.vstack([first, beside]), surface="terrain")
    assert is_disk(result.mesh)


def test_every_face_is_seen_from_above_whatever_the_order():
    points = forest(np.random.default_rng(2))
    for rows in (slice(None), slice(None, None, -1), np.random.default_rng(0).permutation(len(points))):
        mesh = recon.reconstruct(points[rows], surface="terrain").mesh
        a, b, c = (mesh.vertices[corner, :2] for corner in mesh.faces.T)
        u, v = b - a, c - a
        assert (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0).all()


def test_the_certificate_refuses_a_face_seen_from_below():
    result = recon.reconstruct(forest(np.random.default_rng(0), 3.0), surface="terrain")
    recon.certify(result)
    faces = result.mesh.faces.copy()
    faces[7] = faces[7, ::-1]
    with pytest.raises(CertificateError, match=r"face 7 .* not seen from above"):
        recon.certify(replace(result, mesh=replace(result.mesh, faces=faces)))


def test_same_bytes_whatever_threads_and_unit():
    points = forest(np.random.default_rng(0))
    one, two = (recon.reconstruct(points, threads=k).mesh for k in (1, 2))
    assert one.faces.tobytes() == two.faces.tobytes() and one.vertices.tobytes() == two.vertices.tobytes()
    np.testing.assert_array_equal(recon.reconstruct(points * 2.0**20).mesh.faces, one.faces)


@pytest.mark.parametrize("weights", ["uniform", "array"])
def test_other_weights(weights):
    points = forest(np.random.default_rng(0), 2.0)
    w = np.zeros(len(points)) if weights == "array" else weights
    result = recon.reconstruct(points, w, surface="terrain")
    assert is_disk(result.mesh)
    recon.certify(result)


def test_a_wall_is_no_terrain():
    rng = np.random.default_rng(0)
    wall = np.column_stack([rng.random(200), np.zeros(200), rng.random(200)])
    with pytest.raises(DegenerateInput, match="seen from above all points lie on a line; z must point up"):
        recon.reconstruct(wall, surface="terrain")
    with pytest.raises(DegenerateInput, match="seen from above all points lie in one spot"):
        recon.reconstruct(wall * [0, 0, 1], surface="terrain")


def test_on_the_command_line(tmp_path):
    points = forest(np.random.default_rng(0), 2.0)
    np.savetxt(tmp_path / "flight.xyz", np.vstack([points, points[::2] - [0, 0, 1]]))
    run = CliRunner().invoke(
        main,
        [
            "reconstruct",
            str(tmp_path / "flight.xyz"),
            str(tmp_path / "terrain.ply"),
            "--surface",
            "terrain",
            "--no-denoise",
        ],
    )
    assert run.exit_code == 0, run.output
    assert "have one above them" in run.output
    assert is_disk(recon.read_mesh(tmp_path / "terrain.ply"))


def test_as_a_stage_of_open3d_and_a_filter_of_meshlab():
    o3d, pymeshlab = pytest.importorskip("open3d"), pytest.importorskip("pymeshlab")
    points = forest(np.random.default_rng(0), 2.0)
    faces = recon.reconstruct(points, surface="terrain").mesh.faces
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    np.testing.assert_array_equal(
        create_from_point_cloud_weighted_alpha_shape(cloud, surface="terrain").triangles, faces
    )
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points))
    assert generate_weighted_alpha_shape(meshes, surface="Terrain")["surface"]["kind"] == "terrain"
    np.testing.assert_array_equal(meshes.current_mesh().face_matrix(), faces)
