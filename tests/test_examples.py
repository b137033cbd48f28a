"""The examples run as they are and make a mesh."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import recon
from recon.topology import topology

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def run(name, folder, *arguments):
    return subprocess.run(
        [sys.executable, str(EXAMPLES / name), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "PYTHONPATH": str(EXAMPLES.parent), "PATH": ""},  # no MeshLab to open a window,
    )


@pytest.mark.parametrize(
    "name, needs",
    [
        ("command_line.py", None),
        pytest.param("open3d_pipeline.py", "open3d", marks=pytest.mark.peers),
        pytest.param("meshlab_filter_script.py", "pymeshlab", marks=pytest.mark.peers),
    ],
)
def test_an_example_makes_a_closed_mesh_of_genus_one(tmp_path, name, needs):
    if needs is not None:
        pytest.importorskip(needs)
    out = run(name, tmp_path)
    assert out.returncode == 0, out.stderr
    found = topology(recon.read_mesh(tmp_path / "mesh.ply").faces)
    assert found.euler == 0 and found.open_edges == 0 and found.components == 1 and found.nonmanifold_edges == 0
    assert out.stdout.count("\n") <= 3


def test_the_desktop_example_calls_the_command_line(tmp_path):
    out = run("command_line.py", tmp_path)
    assert out.returncode == 0, out.stderr
    out = run("meshlab_desktop.py", tmp_path, "cloud.ply", "other.ply", "--surface", "closed", "--quiet")
    assert out.returncode == 0, out.stderr
    assert Path(out.stdout.strip().rsplit(" ", 1)[1]).name == "clean_up.mlx"
    assert len(recon.read_mesh(tmp_path / "other.ply").faces) > 10_000
    assert run("meshlab_desktop.py", tmp_path, "none.ply").returncode == 2
