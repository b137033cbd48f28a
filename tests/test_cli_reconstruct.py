"""``recon reconstruct`` from end to end: the mesh, the report, and every way in which it may not work."""

import functools
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import datasets_synthetic
import recon
from recon.cli import main
from recon.topology import topology


def run(*args, stdin=None):
    return CliRunner().invoke(main, [str(arg) for arg in args], input=stdin)


def refused(result, code, *parts):
    """Assert the exit code and one line on stderr that has the parts."""
    assert result.exit_code == code, result.output
    assert result.stdout == ""
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("recon: "), lines
    for part in parts:
        assert str(part) in lines[0], lines


@pytest.fixture(scope="module")
def torus():
    return datasets_synthetic.surface("torus").sample(1500, spacing="blue", rng=5).points


@pytest.fixture
def cloud(tmp_path, torus):
    path = tmp_path / "torus.ply"
    colors = np.random.default_rng(1).integers(0, 256, (len(torus), 3), dtype=np.uint8)
    recon.write_points(torus, path, attributes={"colors": colors, "id": np.arange(len(torus))})
    return path


@pytest.fixture
def no_work(monkeypatch):
    """Fail the test if any work is begun."""
    import recon.pipeline

    def fail(*args, **kwargs):
        pytest.fail("work was begun")

    monkeypatch.setattr(recon.pipeline, "reconstruct", fail)


def test_a_torus_comes_out_closed_with_its_attributes(cloud, tmp_path, torus):
    result = run("reconstruct", cloud, tmp_path / "mesh.ply")
    assert result.exit_code == 0, result.output
    assert "closed" in result.stdout and "1,500" in result.stdout
    mesh = recon.read_mesh(tmp_path / "mesh.ply")
    values = {metric.name: metric.value for metric in recon.measure(mesh)}
    assert values["closed"] and values["manifold"] and values["outward"] and values["euler"] == 0
    assert np.array_equal(mesh.vertices, torus[mesh.vertex_source])
    assert np.array_equal(mesh.attributes["id"], mesh.vertex_source)
    assert run("check", tmp_path / "mesh.ply", "--require", "closed", "--require", "outward").exit_code == 0


def test_standard_streams_carry_points_in_and_a_mesh_out(cloud, torus, tmp_path):
    result = run("reconstruct", "-", "-", stdin=cloud.read_bytes())
    assert result.exit_code == 0
    (tmp_path / "out").write_bytes(result.stdout_bytes)
    assert len(recon.read_mesh(tmp_path / "out").vertices) > 0.99 * len(torus)
    assert "1,500" in result.stderr


def test_quiet_prints_nothing_and_json_is_json(cloud, tmp_path):
    assert run("reconstruct", cloud, tmp_path / "a.obj", "--quiet").stdout == ""
    result = run("reconstruct", cloud, tmp_path / "b.ply", "--json", "--report", tmp_path / "r.json")
    report = json.loads(result.stdout)
    written = json.loads((tmp_path / "r.json").read_text())
    assert report == written
    assert "1500" in json.dumps(report)


def test_the_result_does_not_depend_on_threads(cloud, tmp_path):
    for threads in (1, 2):
        assert run("reconstruct", cloud, tmp_path / f"{threads}.ply", "--threads", threads).exit_code == 0
    assert (tmp_path / "1.ply").read_bytes() == (tmp_path / "2.ply").read_bytes()


def test_what_a_format_cannot_hold_is_said(cloud, tmp_path):
    result = run("reconstruct", cloud, tmp_path / "mesh.stl")
    assert "mesh.stl: this format cannot hold colors, id; PLY can" in result.stderr


def test_dropped_rows_are_counted_and_vertices_name_rows_of_the_file(torus, tmp_path):
    points = np.insert(torus, [0, 700], np.nan, axis=0)
    np.save(tmp_path / "p.npy", points)
    refused(run("reconstruct", tmp_path / "p.npy", tmp_path / "m.ply"), 2, "point 0", "2 such rows", "--drop-invalid")
    result = run("reconstruct", tmp_path / "p.npy", tmp_path / "m.ply", "--drop-invalid")
    assert result.exit_code == 0
    assert "dropped 2 of 1,502 rows" in result.stderr
    mesh = recon.read_mesh(tmp_path / "m.ply")
    assert np.array_equal(mesh.vertices, points[mesh.vertex_source])


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[1, 2, 3]] * 9,
        [[t, 2 * t, 3 * t] for t in range(30)],
        [[0.1 * t, 0.1, 0.3] for t in range(30)],
    ],
    ids=["three", "equal", "line", "axis"],
)
def test_degenerate_clouds_end_with_3_and_write_nothing(tmp_path, points):
    recon.write_points(points, tmp_path / "p.xyz")
    refused(run("reconstruct", tmp_path / "p.xyz", tmp_path / "m.ply"), 3, "p.xyz")
    assert os.listdir(tmp_path) == ["p.xyz"]


@pytest.mark.parametrize(
    ("args", "part"),
    [
        (("m.docx",), "extension .docx is unknown"),
        (("m",), "no extension"),
        (("nowhere/m.ply",), "there is no folder"),
        (("m.ply", "--to", "xyz"), "no format that can be written here"),
    ],
)
def test_an_impossible_output_is_refused_before_any_work(cloud, tmp_path, monkeypatch, no_work, args, part):
    monkeypatch.chdir(tmp_path)
    refused(run("reconstruct", "torus.ply", *args), 2, part)
    assert os.listdir(tmp_path) == ["torus.ply"]


@pytest.mark.parametrize(
    ("args", "part"),
    [
        (("torus.ply", "torus.ply"), "is the input"),
        (("torus.ply", "other.ply", "m.ply"), "2 inputs need a folder"),
        (("torus.ply", "a/torus.xyz", "out/"), "two inputs would both be written"),
        (("torus.ply", "m.ply", "--report", "r.docx"), "should end in .json"),
        (("torus.ply", "m.ply", "--surface", "flat"), "--surface"),
        (("torus.ply", "m.ply", "--threads", "0"), "--threads"),
        (("torus.ply", "m.ply", "--alpha", "nan"), "nan is no squared length"),
        (("torus.ply", "m.ply", "--alpha", "-1e300"), "-1e300 is no squared length"),
    ],
)
def test_senseless_requests_are_usage_errors_before_any_work(cloud, tmp_path, monkeypatch, no_work, args, part):
    monkeypatch.chdir(tmp_path)
    result = run("reconstruct", *args)
    assert result.exit_code == 2 and part in result.output
    assert os.listdir(tmp_path) == ["torus.ply"]


def test_weights_come_from_a_file_with_one_a_point(cloud, torus, tmp_path):
    weights = tmp_path / "w.txt"
    weights.write_text("0.001\n" * len(torus))
    assert run("reconstruct", cloud, tmp_path / "m.ply", "--weights", weights).exit_code == 0
    weights.write_text("0.001\n" * 7)
    refused(run("reconstruct", cloud, tmp_path / "n.ply", "--weights", weights), 2, "7 weights for 1,500 points")
    refused(run("reconstruct", cloud, tmp_path / "n.ply", "--weights", "heavy"), 2, "heavy: no such file")
    assert not (tmp_path / "n.ply").exists()


def test_many_inputs_go_to_a_folder(cloud, torus, tmp_path):
    recon.write_points(torus * 2, tmp_path / "big.xyz")
    result = run("reconstruct", cloud, tmp_path / "big.xyz", f"{tmp_path}/out/", "--to", "off", "--quiet")
    assert result.exit_code == 0, result.output
    assert sorted(os.listdir(tmp_path / "out")) == ["big.off", "torus.off"]


def test_one_bad_input_of_many_does_not_stop_the_others(cloud, tmp_path):
    (tmp_path / "bad.xyz").write_text("1 2\n3\n")
    (tmp_path / "out").mkdir()
    result = run("reconstruct", tmp_path / "bad.xyz", tmp_path / "none.xyz", cloud, tmp_path / "out")
    assert result.exit_code == 2
    assert "bad.xyz: line 2: 1 column, expected 2" in result.stderr
    assert "none.xyz: no such file" in result.stderr
    assert os.listdir(tmp_path / "out") == ["torus.ply"]


def test_points_without_z_are_refused_in_one_line(tmp_path):
    (tmp_path / "p.xy").write_text("0 0\n1 0\n0 1\n1 1\n")
    (tmp_path / "m.ply").write_text("old")
    refused(run("reconstruct", tmp_path / "p.xy", tmp_path / "m.ply"), 2, "p.xy: has points x y without z")
    refused(run("reconstruct", tmp_path / "none.xyz", tmp_path / "m.ply"), 2, "none.xyz: no such file")
    assert (tmp_path / "m.ply").read_text() == "old"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux")
def test_a_full_disk_is_said_in_one_line(cloud):
    refused(run("reconstruct", cloud, "/dev/full", "--to", "ply"), 2, "/dev/full: cannot be written (No space left")


def test_memory_is_estimated_for_large_clouds_only(monkeypatch):
    from recon.cli import work

    monkeypatch.setattr(work, "_memory_available", lambda: 8e9)
    assert work.memory_needed(999_999, "mesh") is None
    assert work.memory_needed(1_000_000, "mesh") == "1,000,000 points take about 1.8 GB of memory, 8.0 GB are free"
    assert "3.8 GB of" in work.memory_needed(1_000_000, "family")
    assert work.memory_needed(10_000_000, "mesh").endswith("; this may fail")
    monkeypatch.setattr(work, "_memory_available", lambda: 1e8)
    assert work.memory_needed(1000, "mesh").endswith("; this may fail")


BUSY = """
import sys, time
import recon.pipeline
from recon.__main__ import run

def busy(*args, **kwargs):
    print("busy", flush=True)
    time.sleep(60)  # as compiled code does: the interpreter is free, the thread is not

recon.pipeline.reconstruct = busy
sys.argv[0] = "recon"
run()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_acts_at_once_and_leaves_nothing(cloud, tmp_path, number, code):
    command = [sys.executable, "-c", BUSY, "reconstruct", str(cloud), str(tmp_path / "m.ply")]
    # A shell that runs this in the background has SIGINT ignored, and children inherit that.
    listening = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=listening) as process:
        assert process.stdout.readline() == b"busy\n"
        process.send_signal(number)
        _, errors = process.communicate(timeout=30)  # the work would take 60
    assert process.returncode == code
    assert errors.decode() == "recon: interrupted; nothing half-written was left\n"
    assert os.listdir(tmp_path) == ["torus.ply"]


def test_progress_shows_on_a_terminal_only(monkeypatch, capsys):
    from recon.cli.work import Progress

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    for quiet in (True, False):
        progress = Progress(quiet)
        progress("triangulation", 0.25)
        progress("strange", 0.5)
        shown = capsys.readouterr().err
        assert ("triangulation" in shown and "50 %" in shown) is not quiet
        progress.close()
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False)
    capsys.readouterr()
    Progress(False)("surface", 0.5)
    assert capsys.readouterr().err == ""


def test_the_time_left_follows_from_the_time_taken_and_never_stands_still(monkeypatch, capsys):
    from recon.cli import work

    clock = [1000.0]
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(work.time, "monotonic", lambda: clock[0])
    progress = work.Progress(False, {"first": 0.25, "second": 0.75})
    progress("first", 0.0)
    progress.tick()
    assert "left" not in capsys.readouterr().err  # nothing to go by yet
    clock[0] = 1060.0
    progress("second", 0.5)
    assert "25 %" in (shown := capsys.readouterr().err) and "about 3:00 left" in shown
    left = []
    for clock[0] in (1090.0, 1180.0, 1300.0, 2000.0):
        progress.tick()
        shown = capsys.readouterr().err
        left.append(shown.rpartition("about ")[2].split(" ")[0])
        assert float(shown.rpartition("%")[0].split()[-1]) <= 100
    assert left[0] == "2:32" and left[-1] < left[1] < left[0]
    progress.close()


def test_an_empty_or_absurd_result_names_the_useful_range(cloud, tmp_path):
    out = tmp_path / "m.ply"
    result = run("reconstruct", cloud, out, "--surface", "complex", "--alpha", "-1")
    refused(result, 3, "no facet at alpha = -1", "first one appears at", "useful are")
    assert not out.exists()
    low, high, say = (
        float(result.stderr.partition(f" {word} ")[2].split()[0].rstrip(";,")) for word in ("are", "to", "say")
    )
    assert low < say < high
    again = run("reconstruct", cloud, out, "--surface", "complex", "--alpha", say)
    assert again.exit_code == 0 and again.stderr == ""
    huge = run("reconstruct", cloud, out, "--surface", "complex", "--alpha", 1e6)
    assert huge.exit_code == 0 and "of the points lie on the mesh; useful: --alpha from" in huge.stderr
    small = run("reconstruct", cloud, out, "--alpha", "-1")
    assert small.exit_code == 0 and "100% of the faces bridge leaks" in small.stderr
    named = float(small.stderr.rpartition("say ")[2])
    assert run("reconstruct", cloud, out, "--alpha", named).stderr == ""
    assert run("reconstruct", cloud, out, "--alpha", "-1", "--quiet").stderr == ""


def test_points_are_moved_where_there_is_noise_or_as_asked(torus, tmp_path):
    noisy = torus + np.random.default_rng(2).normal(scale=0.01, size=torus.shape)
    recon.write_points(noisy, tmp_path / "p.npy")
    moved = {}
    for options in ((), ("--denoise",), ("--no-denoise",)):
        result = run("reconstruct", tmp_path / "p.npy", tmp_path / "m.ply", "--json", *options)
        assert result.exit_code == 0, result.output
        mesh = recon.read_mesh(tmp_path / "m.ply")
        moved[options] = not np.array_equal(mesh.vertices, noisy[mesh.vertex_source])
        assert json.loads(result.stdout)["samples"]["denoised"] is moved[options]
    assert moved == {(): True, ("--denoise",): True, ("--no-denoise",): False}


def test_quoted_patterns_make_many_meshes(cloud, torus, tmp_path):
    recon.write_points(torus * 2, tmp_path / "big.ply")
    result = run("reconstruct", f"{tmp_path}/*.ply", f"{tmp_path}/out/", "--to", "glb", "--quiet")
    assert result.exit_code == 0, result.output
    assert sorted(os.listdir(tmp_path / "out")) == ["big.glb", "torus.glb"]


def test_refining_inserts_vertices_of_no_row(cloud, tmp_path):
    result = run("reconstruct", cloud, tmp_path / "mesh.ply", "--refine", "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)["refined"]
    mesh = recon.read_mesh(tmp_path / "mesh.ply")
    assert told["inserted_vertices"] == (mesh.vertex_source == -1).sum() > 0
    assert told["faces"] == len(mesh.faces)


LISTENING = """
import signal
import recon.__main__
def tell(number, handler, heed=signal.signal):
    heed(number, handler)
    if number == signal.SIGTERM:
        print("listening", flush=True)
signal.signal = tell
recon.__main__.run()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize("seconds", [0.0, 0.2, 0.6])
def test_an_interruption_among_the_imports_is_one_line(cloud, tmp_path, seconds):
    command = [sys.executable, "-c", LISTENING, "reconstruct", str(cloud), str(tmp_path / "m.ply"), "--refine"]
    heeding = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heeding) as process:
        assert process.stdout.readline() == b"listening\n"  # however long Python takes to get there
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(seconds)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors.decode() == "recon: interrupted; nothing half-written was left\n"
    assert os.listdir(tmp_path) == ["torus.ply"]


HALF_IMPORTED = """
import sys, types
sys.modules["recon.io.files"] = types.ModuleType("recon.io.files")
from recon.__main__ import _leave
_leave(2, None)
"""


def test_an_interruption_in_the_midst_of_an_import_is_one_line_too():
    done = subprocess.run([sys.executable, "-c", HALF_IMPORTED], capture_output=True)
    assert done.returncode == 130 and done.stderr == b"recon: interrupted; nothing half-written was left\n"


WRITING = """
import sys, time
import recon.io.files
from recon.__main__ import run

def slow(mesh, target, **options):
    with recon.io.files.whole_file(target) as file:
        file.write(b"half")
        file.flush()
        print("busy", flush=True)
        time.sleep(60)

recon.io.write_mesh = slow
sys.argv[0] = "recon"
run()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_an_interruption_while_writing_leaves_the_old_file(cloud, tmp_path):
    (tmp_path / "m.ply").write_text("old")
    command = [sys.executable, "-c", WRITING, "reconstruct", str(cloud), str(tmp_path / "m.ply")]
    listening = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=listening) as process:
        assert process.stdout.readline() == b"busy\n"
        assert len(os.listdir(tmp_path)) == 3
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
    assert process.returncode == 130
    assert sorted(os.listdir(tmp_path)) == ["m.ply", "torus.ply"]
    assert (tmp_path / "m.ply").read_text() == "old"


def test_the_report_compares_with_the_truth(cloud, tmp_path):
    told = tmp_path / "r.json"
    result = run("reconstruct", cloud, tmp_path / "m.ply", "--against", "torus", "--report", told)
    assert result.exit_code == 0, result.output
    assert "to reference mean" in result.stdout
    mesh = recon.read_mesh(tmp_path / "m.ply")
    truth = {m.name: m.value for m in recon.measure(mesh, datasets_synthetic.surface("torus"), points=1500)}
    measured = json.loads(told.read_text())["measured"]
    assert measured == truth and measured["to_reference_mean"] < 0.01
    page = tmp_path / "r.html"
    assert run("reconstruct", cloud, tmp_path / "m.ply", "--against", "torus", "--report", page, "-q").exit_code == 0
    assert "Measured against the reference." in page.read_text()
    refused(run("reconstruct", cloud, tmp_path / "n.ply", "--against", "toros"), 2, "toros", "torus")
    assert not (tmp_path / "n.ply").exists()


def test_weights_are_the_squares_of_the_radii_that_the_input_has(cloud, torus, tmp_path):
    radii = np.linspace(0.1, 0.2, len(torus))
    recon.write_points(torus, tmp_path / "balls.ply", attributes={"radius": radii})
    options = ("--surface", "complex", "--no-clean", "--no-denoise")
    result = run("reconstruct", tmp_path / "balls.ply", tmp_path / "m.ply", "--weights", "radius", *options)
    assert result.exit_code == 0, result.output
    facets = recon.alpha_complex(torus, radii**2).boundary(0.0).facets
    mesh = recon.read_mesh(tmp_path / "m.ply")
    rows = np.sort(mesh.vertex_source[mesh.faces], axis=1)
    assert np.array_equal(np.unique(rows, axis=0), np.unique(np.sort(facets, axis=1), axis=0))
    refused(run("reconstruct", cloud, tmp_path / "n.ply", "--weights", "radius"), 2, "torus.ply: --weights radius")
    refused(run("alphas", cloud, "--weights", "radius"), 2, "torus.ply: --weights radius")


def test_openings_that_are_closed_over_are_told_and_open_leaves_them_open(tmp_path):
    ball = datasets_synthetic.surface("sphere").sample(3000, rng=0).points
    recon.write_points(ball[ball[:, 2] > -0.7], tmp_path / "bust.ply")
    told = run("reconstruct", tmp_path / "bust.ply", tmp_path / "m.ply")
    line = next(line for line in told.stderr.splitlines() if "--surface open" in line)
    assert "of the surface closes openings" in line and "bust.ply: 1" in line
    left = run("reconstruct", tmp_path / "bust.ply", tmp_path / "m.ply", "--surface", "open", "--json")
    assert left.exit_code == 0 and "openings" not in left.stderr
    assert topology(recon.read_mesh(tmp_path / "m.ply").faces).boundary_loops == 1
