"""The judge of benchmarks/evidence.py: what is right passes, and each single fault is found and named."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import recon

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
import evidence  # noqa: E402
import evidence_clouds  # noqa: E402
import evidence_report  # noqa: E402
import peers  # noqa: E402

sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def sphere():
    """A cloud of the sphere and a mesh that solves it."""
    cloud = evidence_clouds.cloud_of(evidence_clouds.Case("sphere"), None)
    mesh = recon.reconstruct(cloud.points).mesh
    assert evidence.judge(mesh, cloud, True)["faults"] == []
    return cloud, mesh


def faults_of(cloud, vertices, faces, source=None, interpolates=True):
    return evidence.judge(recon.Mesh.from_arrays(vertices, faces, source), cloud, interpolates)["faults"]


def test_a_missing_triangle_is_found(sphere):
    cloud, mesh = sphere
    (fault,) = faults_of(cloud, mesh.vertices, mesh.faces[1:], mesh.vertex_source)
    assert fault == "open: 1 loops, chi 1, not 2"


def test_a_triangle_too_many_is_found(sphere):
    cloud, mesh = sphere
    a, b, c = mesh.faces[0]
    far = mesh.vertices[a] - 0.1  # a fin on the edge a, b
    vertices, source = np.vstack([mesh.vertices, far]), np.append(mesh.vertex_source, -1)
    faults = faults_of(cloud, vertices, np.vstack([mesh.faces, [a, b, len(mesh.vertices)]]), source)
    assert faults[0].startswith("not manifold: 1 edges")


def test_inside_out_is_found(sphere):
    cloud, mesh = sphere
    assert faults_of(cloud, mesh.vertices, mesh.faces[:, ::-1], mesh.vertex_source) == ["not outward"]


def test_a_second_layer_is_found(sphere):
    cloud, mesh = sphere
    vertices, source = np.vstack([mesh.vertices, 0.9 * mesh.vertices]), np.tile(mesh.vertex_source, 2)
    faults = faults_of(cloud, vertices, np.vstack([mesh.faces, mesh.faces[:, ::-1] + len(mesh.vertices)]), source)
    assert faults[0] == "chi 4, not 2"


def test_what_lies_off_the_surface_is_found(sphere):
    cloud, mesh = sphere
    away = mesh.vertices * (1 + 0.3 * cloud.near)
    assert [fault[4:] for fault in faults_of(cloud, away, mesh.faces, mesh.vertex_source)] == [" d1 off"]


def test_unused_samples_are_found_where_vertices_are_meant_to_be_samples(sphere):
    cloud, mesh = sphere
    source = mesh.vertex_source.copy()
    source[:60] = -1
    assert faults_of(cloud, mesh.vertices, mesh.faces, source) == ["98.0% of the samples used"]
    assert faults_of(cloud, mesh.vertices, mesh.faces, source, interpolates=False) == []


def test_no_faces_and_no_area_are_faults(sphere):
    cloud, mesh = sphere
    assert faults_of(cloud, np.zeros((0, 3)), np.zeros((0, 3), int)) == ["no faces"]
    flat = np.repeat(mesh.vertices[:1], 4, axis=0)
    assert "no area" in faults_of(cloud, flat, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.zeros(4, int))


def test_outliers_need_not_be_used():
    cloud = evidence_clouds.cloud_of(evidence_clouds.Case("sphere", outliers=0.1), None)
    assert cloud.genuine.sum() == 0.9 * len(cloud.points)
    figures = evidence.judge(recon.reconstruct(cloud.points[cloud.genuine]).mesh, cloud, True)
    assert figures["used"] == 1.0
    assert figures["faults"] == []


def test_a_removed_piece_may_be_closed_over_or_kept_as_a_hole():
    cloud = evidence_clouds.cloud_of(evidence_clouds.Case("sphere", hole=True), None)
    whole = recon.reconstruct(cloud.points, surface="closed").mesh
    corners = whole.vertices[whole.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    rest = whole.faces[longest < 3 * np.median(longest)]
    assert len(rest) < len(whole.faces)
    for faces in (whole.faces, rest):
        assert faults_of(cloud, whole.vertices, faces, whole.vertex_source) == []
    assert faults_of(cloud, whole.vertices, rest[1:], whole.vertex_source) != []


def test_an_open_surface_that_was_closed_is_found():
    cloud = evidence_clouds.cloud_of(evidence_clouds.Case("hemisphere"), None)
    assert evidence.judge(recon.reconstruct(cloud.points).mesh, cloud, True)["faults"] == []
    faults = evidence.judge(recon.reconstruct(cloud.points, surface="closed").mesh, cloud, True)["faults"]
    assert "closed over its boundary" in faults


def test_noise_is_measured_against_the_samples_before_it():
    clean, noisy = (evidence_clouds.cloud_of(evidence_clouds.Case("torus", noise=level), None) for level in (0.0, 0.5))
    assert noisy.near == clean.near
    moved = np.linalg.norm(noisy.points - clean.points, axis=1)
    assert 0.4 < np.sqrt(np.mean(moved**2)) / np.sqrt(clean.truth.area / len(clean.points)) < 0.6


def test_a_mesh_file_is_its_own_truth(tmp_path):
    (tmp_path / "meshes").mkdir()
    recon.write_mesh(
        recon.reconstruct(evidence_clouds.cloud_of(evidence_clouds.Case("torus"), None).points).mesh,
        tmp_path / "meshes/t.off",
    )
    (case,) = evidence_clouds.files(tmp_path)
    cloud = evidence_clouds.cloud_of(case, tmp_path)
    assert (case.name, cloud.topologies) == ("meshes/t.off", ((0, 0),))
    figures = evidence.judge(recon.reconstruct(cloud.points).mesh, cloud, True)
    assert figures["faults"] == []


def test_every_way_of_weighing_gives_a_mesh_to_judge():
    cloud = evidence_clouds.cloud_of(evidence_clouds.Case("sphere"), None)
    few = cloud.points[:200]
    for name in (peers.RECON, *peers.WEIGHTS):
        made = list(peers.CONTENDERS[name].run(few, peers.nearest(few)))
        assert any(len(getattr(result, "mesh", result).faces) for result in made), name


def test_of_two_the_solved_one_is_better_then_the_right_topology_then_the_closer_one():
    best, close, far = ({"faults": [], "shape": True, "off": off} for off in (0.1, 0.101, 0.2))
    wrong, worse = ({"faults": ["x"], "shape": shape, "off": 0.05} for shape in (True, False))
    order = [best, far, wrong, worse, {"faults": ["crashed"]}]
    for k, one in enumerate(order):
        assert [evidence_report.compare(one, two) for two in order] == [-1] * k + [0] + [1] * (len(order) - k - 1)
    assert evidence_report.compare(best, close) == 0


def test_failures_are_listed_and_come_first(tmp_path):
    good = {
        "contender": "recon",
        "source": "torus",
        "condition": "plain",
        "faults": [],
        "shape": True,
        "off": 0.1,
        "cpu": 1.0,
    }
    bad = {"contender": "recon", "source": "sphere", "condition": "plain", "faults": ["crashed, exit code -11"]}
    assert evidence_report.cell([good, bad], 2) == "1 / 1; inf"
    assert evidence_report.cell([good], 2) == "1 / 1; 0.10 (of 1)"
    evidence_report.write([good, bad], tmp_path)
    text = (tmp_path / "results.md").read_text()
    assert text.index("crashed, exit code -11") < text.index("Solved, one thing at a time")


def test_what_was_run_is_not_run_again(tmp_path, monkeypatch):
    command = ["evidence.py", str(tmp_path), "--data", "", "--only", "recon: torus, plain", "--jobs", "1"]
    monkeypatch.setattr(sys, "argv", command)
    kept = {"recon: torus, plain": {"contender": "recon", "source": "torus", "condition": "plain", "faults": ["kept"]}}
    (tmp_path / "results.json").write_text(json.dumps(kept))
    evidence.main()
    assert json.loads((tmp_path / "results.json").read_text()) == kept
