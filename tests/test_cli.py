"""The command line as a person meets it: what it prints, what it writes, how it ends."""

import io
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import recon
import recon.io
from recon.cli import main
from recon.cli.survey import survey

COMMANDS = ("reconstruct", "info", "alphas", "measure", "sample", "check")


def run(*args, stdin=None):
    return CliRunner().invoke(main, [str(arg) for arg in args], input=stdin)


def shell(*args, **options):
    command = [sys.executable, "-m", "recon", *map(str, args)]
    return subprocess.run(command, capture_output=True, timeout=120, check=False, **options)


def one_line(result, code, *parts):
    """Assert the exit code and a single line on stderr that has the parts."""
    assert result.exit_code == code, result.output
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("recon: "), lines
    for part in parts:
        assert str(part) in lines[0]


@pytest.fixture
def tetrahedron(tmp_path):
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    path = tmp_path / "tetrahedron.ply"
    recon.write_mesh(recon.Mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], faces), path)
    return path


@pytest.fixture
def open_book(tmp_path):
    path = tmp_path / "book.off"
    path.write_text("OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 -1 0\n0 0 1\n3 0 1 2\n3 1 0 3\n3 0 1 4\n")
    return path


# ---- the whole


def test_help_names_every_command_and_needs_no_numpy():
    result = run("--help")
    assert result.exit_code == 0
    assert all(command in result.output for command in COMMANDS)
    check = (
        "import sys, recon.cli; sys.exit(any(m in sys.modules for m in ('numpy', 'scipy', 'numba', 'tqdm', 'sklearn')))"
    )
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_each_command_has_examples(command):
    result = run(command, "--help")
    assert result.exit_code == 0
    assert f"recon {command}" in result.stdout.partition("Examples:")[2]


def test_version_and_module_entry():
    result = shell("--version")
    assert result.returncode == 0
    assert recon.__version__ in result.stdout.decode()


@pytest.mark.parametrize(
    "args",
    [(), ("frobnicate",), ("info",), ("info", "--colour"), ("sample", "torus"), ("reconstruct", "a.xyz"), ("check", "x", "--require", "beauty"),
     ("info", "x", "--threads", 10**22), ("sample", "torus", "-", "-n", 10**22), ("measure", "x", "--samples", 10**22)],
)  # fmt: skip
def test_usage_errors_end_with_2_and_say_how_to_get_help(args):
    result = run(*args)
    assert result.exit_code == 2
    assert "--help" in result.output


def test_a_bug_is_reported_as_a_bug(tmp_path, monkeypatch):
    def broken(*args, **kwargs):
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr(recon.io, "read", broken)
    result = run("info", tmp_path)
    assert result.exit_code == 1
    assert "internal error: ZeroDivisionError: division by zero" in result.stderr
    assert "please report" in result.stderr
    assert "Traceback" not in result.stderr
    monkeypatch.setenv("RECON_DEBUG", "1")
    assert "Traceback" in run("info", tmp_path).stderr


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (recon.InvalidInput("x"), 2),
        (recon.DegenerateInput("x"), 3),
        (recon.MissingDependency("x"), 4),
        (recon.CertificateError("x"), 5),
        (MemoryError(), 1),
    ],
)
def test_every_error_has_its_exit_code_and_one_line(monkeypatch, error, code):
    def fail(*args, **kwargs):
        raise error

    monkeypatch.setattr(recon.io, "read", fail)
    one_line(run("info", "x"), code)


def test_a_missing_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "laspy", None)
    header = bytearray(300)
    header[:4], header[94:96], header[96:100] = b"LASF", (227).to_bytes(2, "little"), (227).to_bytes(4, "little")
    (tmp_path / "p.las").write_bytes(header)
    one_line(run("info", tmp_path / "p.las"), 4, "pip install 'weighted-alpha-recon[las]'")


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX pipes")
def test_a_closed_pipe_is_no_error_worth_a_word():
    script = f"{sys.executable} -m recon sample sphere - -n 100000 --to xyz | head -n 1"
    result = subprocess.run(["bash", "-c", script], capture_output=True, timeout=120, check=False)
    assert len(result.stdout.split()) == 3
    assert result.stderr == b""


# ---- info


def test_info_says_what_a_cloud_is(tmp_path):
    assert run("sample", "torus", tmp_path / "p.ply", "-n", 3000, "--truth").exit_code == 0
    result = run("info", tmp_path / "p.ply")
    assert result.exit_code == 0
    words = dict(line.split(maxsplit=1) for line in result.stdout.splitlines())
    assert words["points"] == "3,000 in 3-D"
    assert words["surface"] == "looks closed"
    assert "normals (float64 x 3)" in words["attributes"]


def test_info_json_of_two_files_is_a_list(tmp_path, tetrahedron):
    (tmp_path / "p.xy").write_text("0 0\n1 1\n0 1\n0 1\n")
    result = run("info", tetrahedron, tmp_path / "p.xy", "--json")
    first, second = json.loads(result.stdout)
    assert (first["faces"], first["points"], first["span"]) == (4, 4, 3)
    assert (second["dimension"], second["duplicates"], second["spacing"]) == (2, 1, None)


def test_info_names_degenerate_clouds(tmp_path):
    (tmp_path / "equal.xyz").write_text("1 2 3\n" * 5)
    (tmp_path / "line.xyz").write_text("".join(f"{t} {2 * t} {3 * t}\n" for t in range(99)))
    assert "all points are equal" in run("info", tmp_path / "equal.xyz").output
    assert "all points lie on a line" in run("info", tmp_path / "line.xyz").output


@pytest.mark.parametrize("exponent", [-1030, -500, 0, 300])
def test_survey_scales_with_the_cloud(exponent):
    import datasets_synthetic

    points = datasets_synthetic.surface("torus").sample(3000, spacing="blue", rng=1).points
    points = np.concatenate([points, points[:7]]).astype(np.float16).astype(float)  # few digits: exact at any scale
    one, other = survey(points), survey(np.ldexp(points, exponent))
    assert (one.surface, one.span, one.duplicates) == (other.surface, other.span, other.duplicates)
    assert one.duplicates >= 7 and one.surface == "closed"
    assert (one.density_ratio, one.outliers, one.rim) == (other.density_ratio, other.outliers, other.rim)
    for name in ("diagonal", "spacing", "noise"):
        assert np.ldexp(getattr(one, name), exponent) == getattr(other, name)


def test_info_drops_invalid_rows_on_request(tmp_path):
    (tmp_path / "p.xyz").write_text("1 2 3\nnan 0 0\n4 5 6\n")
    one_line(run("info", tmp_path / "p.xyz"), 2, "line 2 is no point", "--drop-invalid")
    result = run("info", tmp_path / "p.xyz", "--drop-invalid", "--json")
    assert (json.loads(result.stdout)["points"], json.loads(result.stdout)["dropped"]) == (2, 1)


def test_info_reads_standard_input():
    result = run("info", "-", "--from", "xyz", "--json", stdin="1 2 3\n4 5 7\n")
    assert json.loads(result.stdout)["points"] == 2


@pytest.mark.parametrize(
    ("name", "expected"),
    [("torus", "closed"), ("box", "closed"), ("cylinder", "closed"), ("paraboloid", "open"), ("wavy_sheet", "open"), ("disk", "planar")],
)  # fmt: skip
def test_survey_tells_closed_from_open(name, expected):
    import datasets_synthetic

    sample = datasets_synthetic.surface(name).sample(4000, rng=1)
    assert survey(sample.points).surface == expected


def test_survey_measures_noise_spacing_and_outliers():
    import datasets_synthetic

    sphere = datasets_synthetic.surface("sphere")
    clean = sphere.sample(4000, spacing="blue", rng=2).points
    assert survey(clean).noise < 1e-4
    assert survey(clean).spacing == pytest.approx(np.sqrt(4 * np.pi / 4000), rel=0.3)
    noisy = sphere.sample(20000, noise=0.004, outliers=0.02, rng=2).points
    assert survey(noisy).noise == pytest.approx(0.004, rel=0.2)
    assert survey(noisy).outliers == pytest.approx(0.02, abs=0.01)
    assert survey(noisy + np.array([512000, 5403000, 300])).noise == pytest.approx(0.004, rel=0.2)


# ---- sample


def test_sample_is_the_same_for_the_same_seed(tmp_path):
    outputs = []
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        path = tmp_path / f"{name}.xyz"
        options = ("-n", 200, "--noise", 0.01, "--outliers", 0.1, "--density", 5, "--seed", seed)
        assert run("sample", "torus:minor=0.2", path, *options).exit_code == 0
        outputs.append(path.read_bytes())
    assert outputs[0] == outputs[1] != outputs[2]
    assert recon.read_points(tmp_path / "a.xyz").points.shape == (200, 3)


def test_sample_truth_and_planar_curves(tmp_path):
    assert run("sample", "circle", tmp_path / "c.csv", "-n", 50).exit_code == 0
    assert recon.read_points(tmp_path / "c.csv").points.shape == (50, 2)
    assert run("sample", "torus", tmp_path / "t.ply", "-n", 50, "--truth", "--outliers", 0.1).exit_code == 0
    assert recon.read_points(tmp_path / "t.ply").attributes["outlier"].sum() == 5


@pytest.mark.parametrize(
    ("args", "part"),
    [
        (("blob", "x.ply"), "no surface 'blob'; there are sphere"),
        (("torus:thickness=1", "x.ply"), "no parameter 'thickness'"),
        (("torus:minor=thin", "x.ply"), "'minor=thin' is not of the form size=1.5"),
        (("torus", "x.docx"), "extension .docx is unknown"),
        (("torus", "nowhere/x.ply"), "there is no folder"),
        (("torus", "x.ply", "--noise", "-1"), "noise"),
        (("torus", "x.ply", "--outliers", "2"), "outliers"),
    ],
)
def test_sample_refuses_nonsense_in_one_line(tmp_path, monkeypatch, args, part):
    monkeypatch.chdir(tmp_path)
    one_line(run("sample", *args), 2, part)
    assert os.listdir(tmp_path) == []


# ---- measure and check


def test_measure_prints_name_value_and_meaning(tetrahedron):
    result = run("measure", tetrahedron)
    rows = {line.split()[0]: line for line in result.stdout.splitlines()}
    assert "0.166667 L^3" in rows["volume"]
    assert rows["closed"].split()[1] == "yes"


def test_measure_against_a_mesh_a_cloud_and_a_surface(tmp_path, tetrahedron):
    against = {}
    recon.write_points([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]], tmp_path / "corners.xyz")
    for reference in (tetrahedron, tmp_path / "corners.xyz", "sphere:radius=2"):
        result = run("measure", tetrahedron, reference, "--samples", 500, "--json")
        against[str(reference)] = {row["name"]: row["value"] for row in json.loads(result.stdout)}
    same, corners, sphere = against.values()
    assert same["hausdorff"] < 1e-12
    assert corners["from_reference_max"] < 1e-12 < corners["to_reference_max"]
    assert sphere["bias"] < -1


def test_measure_refuses_sizes_that_cannot_be_compared(tmp_path, tetrahedron):
    (tmp_path / "tiny.xyz").write_text("0 0 0\n1e-320 0 0\n0 1e-320 0\n0 0 1e-320\n")
    result = run("measure", tetrahedron, tmp_path / "tiny.xyz")
    assert result.exit_code == 3 and "differs in size" in result.stderr and result.stderr.count("\n") == 1


def test_measure_refuses_what_is_not_there(tetrahedron):
    one_line(run("measure", tetrahedron, "truth.ply"), 2, "truth.ply: no such file")
    one_line(run("measure", tetrahedron, "blob"), 2, "no surface 'blob'")


def test_check_ends_with_5_where_a_promise_is_broken(tetrahedron, open_book):
    assert run("check", tetrahedron).exit_code == 0
    assert (
        run("check", tetrahedron, *(word for name in ("closed", "outward") for word in ("--require", name))).exit_code
        == 0
    )
    result = run("check", open_book, "--json")
    assert result.exit_code == 5
    found = json.loads(result.stdout)
    assert not found["ok"] and not found["holds"]["manifold"]
    assert run("check", open_book, "--require", "non-degenerate").exit_code == 0
    shown = dict(line.split()[:2] for line in run("check", open_book).stdout.splitlines())
    assert (shown["closed"], shown["manifold"], shown["outward"]) == ("no", "NO", "-")  # NO: asked for; -: no answer


def test_bad_files_are_one_line_in_every_command(tmp_path):
    (tmp_path / "cut.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\n")
    for args in (("info",), ("measure",), ("check",), ("alphas",)):
        one_line(run(*args, tmp_path / "cut.ply"), 2, "cut.ply", "is the file truncated?")
        one_line(run(*args, tmp_path / "none.ply"), 2, "none.ply: no such file")
    one_line(run("reconstruct", tmp_path / "cut.ply", tmp_path / "out.ply"), 2, "is the file truncated?")
    assert sorted(os.listdir(tmp_path)) == ["cut.ply"]


def test_stdin_is_read_as_bytes():
    data = io.BytesIO()
    np.save(data, np.eye(3))
    assert json.loads(run("info", "-", "--json", stdin=data.getvalue()).stdout)["points"] == 3


# ---- alphas


def test_alphas_of_a_square_are_those_of_pencil_and_paper(tmp_path):
    (tmp_path / "square.xy").write_text("0 0\n2 0\n2 2\n0 2\n")
    result = run(
        "alphas", tmp_path / "square.xy", "--weights", "uniform", "--at", "0.5", "--at", "1.5", "--at", "3", "--json"
    )
    found = json.loads(result.stdout)
    assert [state["betti"][:2] for state in found["states"]] == [[4, 0], [1, 1], [1, 0]]
    assert found["lasting"] == [{"birth": 1.0, "death": 2.0}]
    assert (found["lowest"], found["highest"]) == (0.0, 2.0)


def test_alphas_show_the_inside_of_a_torus_as_the_most_lasting_void(tmp_path):
    run("sample", "torus", tmp_path / "t.xyz", "-n", 1500, "--spacing", "blue")
    result = run("alphas", tmp_path / "t.xyz", "--voids", 2, "--ranges", 6)
    assert result.exit_code == 0, result.output
    rows = [line.split() for line in result.stdout.splitlines()]
    assert ["alpha", "from", "to", "pieces", "tunnels", "voids", "facets"] in rows
    assert any(row[2:5] == ["1", "2", "1"] for row in rows)  # a hollow torus
    lasting = {row[0]: float(row[3]) for row in rows[-2:]}
    assert lasting["1"] > 3 * lasting["2"]


def test_alphas_of_every_range_agree_with_the_complex(tmp_path):
    points = np.random.default_rng(0).random((60, 3))
    recon.write_points(points, tmp_path / "p.npy")
    family = recon.alpha_complex(points)
    for options, count in (((), None), (("--ranges", 5), 5)):
        options = options or ("--all",)
        found = json.loads(run("alphas", tmp_path / "p.npy", "--weights", "uniform", *options, "--json").stdout)
        states = found["states"]
        assert len(states) == (count or len(family.spectrum()))
        for state in states:
            until = state["until"] or np.inf
            inside = [state["alpha"], np.nextafter(until, -np.inf) if until < np.inf else 1e9]
            for alpha in inside:
                assert family.betti(alpha).tolist() == state["betti"]
            assert len(family.boundary(state["alpha"]).facets) == state["facets"]
        if count is None:
            assert [state["alpha"] for state in states] == family.spectrum().tolist()
            assert [state["until"] for state in states[:-1]] == family.spectrum()[1:].tolist()
        else:
            choice = family.choices()[0]
            best = found["choices"][0]
            assert (best["alpha"], best["start"], best["why"]) == (choice.alpha, choice.start, choice.why)
            assert states[0]["alpha"] <= 0.0 < states[0]["until"] and states[-1]["until"] is None


@pytest.mark.parametrize("text", ["1 2 3\n", "1 2 3\n" * 5, "0 0\n1 1\n2 2\n", "0 0 0\n1 0 0\n0 1 0\n", "1e-310 0 0\n0 1e-310 0\n0 0 1e-310\n0 0 0\n"])  # fmt: skip
@pytest.mark.parametrize("weights", ["uniform", "adaptive"])
def test_alphas_of_degenerate_clouds_are_answered(tmp_path, text, weights):
    (tmp_path / "p.txt").write_text(text)
    result = run("alphas", tmp_path / "p.txt", "--weights", weights)
    assert result.exit_code == 0, result.stderr
    assert result.stderr == "" and "critical values" in result.stdout


# ---- what shells do


def test_patterns_that_the_shell_leaves_are_expanded(tmp_path, tetrahedron):
    (tmp_path / "b[1].xyz").write_text("0 0 0\n")
    found = json.loads(run("info", tmp_path / "*", "--json").stdout)
    assert [os.path.basename(entry["file"]) for entry in found] == ["b[1].xyz", "tetrahedron.ply"]
    assert json.loads(run("info", tmp_path / "b[1].xyz", "--json").stdout)["points"] == 1  # a name, no pattern
    one_line(run("info", tmp_path / "*.las"), 2, "*.las: no such file")


def test_info_goes_on_after_a_bad_file(tmp_path, tetrahedron):
    (tmp_path / "a.xyz").write_text("1 2\n3\n")
    result = run("info", tmp_path / "a.xyz", tetrahedron)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"recon: {tmp_path / 'a.xyz'}: line 2") and "4 in 3-D, 4 faces" in result.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX shells")
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("recon rec", "plain,reconstruct"),
        ("recon info ", "file,"),
        ("recon reconstruct a.ply ", "file,"),
        ("recon reconstruct a.ply --surface cl", "plain,closed"),
        ("recon reconstruct a.ply --weights ", "file,"),
        ("recon info --from la", "plain,las"),
        ("recon sample tor", "plain,torus"),
        ("recon measure mesh.ply tor", "plain,torus"),
        ("recon measure mesh.ply ./t", "file,./t"),
    ],
)
def test_bash_completes(line, expected):
    words = line.split(" ")
    out = subprocess.run(
        [sys.executable, "-c", "from recon.cli import main; main(prog_name='recon')"],
        env={
            **os.environ,
            "_RECON_COMPLETE": "bash_complete",
            "COMP_WORDS": line,
            "COMP_CWORD": str(len(words) - 1),
        },
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert expected in out.stdout.splitlines(), out


@pytest.mark.parametrize("shell_name", ["bash", "zsh", "fish"])
def test_the_line_that_sets_completion_up_gives_a_script(shell_name):
    out = subprocess.run(
        [sys.executable, "-c", "from recon.cli import main; main(prog_name='recon')"],
        env={**os.environ, "_RECON_COMPLETE": f"{shell_name}_source"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert "_RECON_COMPLETE" in out.stdout, out
