"""Whatever is given for a number, a path or a name, the answer is a result or one line that names the argument."""

import math
from pathlib import Path

import numpy as np
import pytest
from test_stage_garbage import GARBAGE as STAGE_GARBAGE

import datasets_synthetic
import recon
import recon.io
import weighting

POINTS = datasets_synthetic.surface("sphere").sample(60, rng=0).points.copy()
MESH = recon.Mesh.from_arrays(POINTS, [[0, 1, 2]])
GARBAGE = STAGE_GARBAGE | {
    "empty text": "",
    "longest": -(10**5000),
    "half": 2.5,
    "words": np.array(["a"]),
    "no array": np.array(None),
    "ragged": [[1, 2], [3]],
    "one to two": {1: 2},
}
NUMBERS = {"infinite", "negative", "large", "half"}
LENGTHS = {"large", "half"}  # what a length may be
CALLS = {  # function and argument: how it is called, and what it takes of the garbage
    "neighbors k": (lambda v: weighting.neighbors(POINTS, v), {"huge"}),
    "spacing k": (lambda v: weighting.spacing(POINTS, v), {"huge"}),
    "spacing rounds": (lambda v: weighting.spacing(POINTS, rounds=v), set()),
    "covering k": (lambda v: weighting.covering(POINTS, v), {"huge"}),
    "covering widest": (lambda v: weighting.covering(POINTS, widest=v), LENGTHS),
    "curvature k": (lambda v: weighting.curvature(POINTS, v), {"huge"}),
    "noise k": (lambda v: weighting.noise(POINTS, v), {"huge"}),
    "thickness k": (lambda v: weighting.thickness(POINTS, v), {"huge"}),
    "graded theta": (lambda v: weighting.graded(POINTS, np.ones(60), v), set()),
    "graded k": (lambda v: weighting.graded(POINTS, np.ones(60), k=v), {"huge"}),
    "outliers excess": (lambda v: weighting.outliers(POINTS, v), LENGTHS),
    "adaptive_weights radius": (lambda v: weighting.adaptive_weights(POINTS, radius=v), set()),
    "adaptive_weights cap": (lambda v: weighting.adaptive_weights(POINTS, cap=v), LENGTHS | {"none"}),
    "adaptive_weights theta": (lambda v: weighting.adaptive_weights(POINTS, theta=v), set()),
    "AdaptiveWeights radius": (lambda v: weighting.AdaptiveWeights(radius=v).fit(POINTS), set()),
    "AdaptiveWeights theta": (lambda v: weighting.AdaptiveWeights(theta=v).fit(POINTS), set()),
    "closing_weights rounds": (lambda v: weighting.closing_weights(POINTS, rounds=v), set()),
    "enforce where": (lambda v: weighting.enforce(POINTS, None, [[0]], where=v), set()),
    "enforce simplices": (lambda v: weighting.enforce(POINTS, None, v), {"empty text", "dict", "ragged"}),
    "sufficient_weight covering": (
        lambda v: weighting.sufficient_weight(v, 1.0),
        NUMBERS | {"nan", "array", "square", "list", "flag", "numpy flag"},
    ),
    "measure mesh": (lambda v: recon.measure(v), set()),
    "measure samples": (lambda v: recon.measure(MESH, POINTS, samples=v), set()),
    "measure seed": (lambda v: recon.measure(MESH, POINTS, samples=9, seed=v), {"huge"}),
    "measure thresholds": (lambda v: recon.measure(MESH, POINTS, samples=9, thresholds=v), {"array", "list"}),
    "measure points": (lambda v: recon.measure(MESH, points=v), {"none", "huge"}),
    "measure reference": (lambda v: recon.measure(MESH, v, samples=9), {"none"}),
    "alpha_shape radius": (lambda v: recon.alpha_shape(POINTS, v), LENGTHS),
    "space_filling_diagram alpha": (
        lambda v: recon.space_filling_diagram(POINTS, alpha=v),
        NUMBERS - {"infinite"},
    ),
    "betti alpha": (lambda v: recon.alpha_complex(POINTS).betti(v), NUMBERS | {"array", "square", "list"}),
    "write_mesh mesh": (lambda v: recon.write_mesh(v, "-"), set()),
    "write_points attributes": (lambda v: recon.write_points(POINTS, "-", attributes=v, format="ply"), {"none", "dict"}),
    "read_points drop_invalid": (lambda v: recon.read_points(__file__, drop_invalid=v), {"flag", "numpy flag"}),
    "read_weights n": (lambda v: recon.io.read_weights(__file__, v), {"huge"}),
}  # fmt: skip


def assert_refused(name, call, *arguments):
    """One line, not long, that begins with the name of the argument."""
    with pytest.raises(recon.InvalidInput) as caught:
        call(*arguments)
    message = str(caught.value)
    assert message.startswith(f"{name}: ") and message.isprintable() and len(message) < 200, message


@pytest.mark.parametrize("what", CALLS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_is_no_such_thing_is_refused_in_one_line_that_names_the_argument(what, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call, taken = CALLS[what]
    for kind, value in GARBAGE.items():
        if kind not in taken:
            assert_refused(what.split()[1], call, value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "what", [what for what, (_, taken) in CALLS.items() if taken and not what.endswith(("drop_invalid", "n"))]
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_may_be_is_taken(what):
    call, taken = CALLS[what]
    for kind in taken:
        call(GARBAGE[kind])


PATHS = [value for kind, value in GARBAGE.items() if kind != "text"] + ["a\0b", b"a.ply", Path]
DOORS = {
    "read_points": recon.read_points,
    "read_mesh": recon.read_mesh,
    "read": recon.io.read,
    "read_weights": lambda path: recon.io.read_weights(path, 3),
    "check_writable": recon.io.check_writable,
    "write_mesh": lambda path: recon.write_mesh(MESH, path),
    "write_points": lambda path: recon.write_points(POINTS, path, format="ply"),
}


@pytest.mark.parametrize("door", DOORS)
def test_what_is_no_path_is_refused(door):
    for path in PATHS:
        assert_refused("path", DOORS[door], path)


def test_what_is_no_format_is_refused(tmp_path):
    file = tmp_path / "a.xyz"
    file.write_text("1 2 3\n")
    for kind, value in GARBAGE.items():
        if kind != "none":
            for call in (recon.read_points, recon.read_mesh, recon.io.read):
                with pytest.raises(recon.InvalidInput, match=r"^format: .* is no format that can be read"):
                    call(file, format=value)
            for call in (lambda v: recon.write_mesh(MESH, file, format=v), lambda v: recon.write_points(POINTS, file, format=v)):  # fmt: skip
                with pytest.raises(recon.InvalidInput, match=r"^format: .* is no format that can be written"):
                    call(value)
    assert file.read_text() == "1 2 3\n"


@pytest.mark.parametrize("name", ["a\nb", "a\x1b[2Jb.ply", "\udcff.ply", "no\nfolder/a.ply"])
def test_a_path_of_control_characters_is_shown_in_one_line(name):
    for door in DOORS.values():
        try:
            door(Path("nowhere") / name)
        except recon.InvalidInput as error:
            assert str(error).isprintable()
        else:
            pytest.fail("found")


def test_a_row_of_many_columns_is_shown_in_one_line():
    for value in (math.nan, 1e300):
        assert_refused("points", weighting.spacing, np.full((3, 40), value))


@pytest.mark.parametrize(
    "call",
    [
        lambda v: weighting.covering(POINTS, widest=v),
        lambda v: weighting.graded(POINTS, np.linspace(0, 1, 60), v / 4),
        lambda v: weighting.adaptive_weights(POINTS, cap=v, theta=v / 4),
        lambda v: weighting.outliers(POINTS, v),
        lambda v: weighting.sufficient_weight(v, v, v, v),
        lambda v: recon.alpha_shape(POINTS, v).faces,
        lambda v: recon.space_filling_diagram(POINTS, alpha=v).volume,
        lambda v: [m.value for m in recon.measure(MESH, POINTS, samples=9, thresholds=[v])],
    ],
)
def test_numbers_of_numpys_are_numbers(call):
    for kind in (np.float64, np.float32, np.float16, np.longdouble, np.array):
        assert np.array_equal(call(kind(1.5)), call(1.5)), kind
    assert np.array_equal(call(np.int64(2)), call(2))


@pytest.mark.parametrize(
    "call",
    [
        lambda v: weighting.neighbors(POINTS, v).index,
        lambda v: weighting.spacing(POINTS, v, v),
        lambda v: weighting.covering(POINTS, v),
        lambda v: weighting.curvature(POINTS, v).principal,
        lambda v: weighting.noise(POINTS, v),
        lambda v: weighting.thickness(POINTS, v),
        lambda v: weighting.graded(POINTS, np.linspace(0, 1, 60), k=v),
        lambda v: [m.value for m in recon.measure(MESH, points=60 + v)],
        lambda v: [m.value for m in recon.measure(MESH, POINTS, samples=v, seed=v)],
    ],
)
def test_whole_numbers_of_numpys_are_whole_numbers(call):
    for kind in (np.int64, np.uint8, np.int32, np.array):
        assert np.array_equal(call(kind(12)), call(12)), kind


@pytest.mark.parametrize("n", [200, 300])
def test_a_curve_of_which_a_closed_crumb_is_left_is_not_called_open(n):
    u = np.linspace(0, 2 * np.pi, n, endpoint=False)
    knot = np.column_stack([np.sin(u) + 2 * np.sin(2 * u), np.cos(u) - 2 * np.cos(2 * u), -np.sin(3 * u)])
    result = recon.reconstruct(knot)
    assert (result.surface == "open") == (result.report["mesh"]["open_edges"] > 0)
    assert result.report["surface"]["kind"] == result.surface
    recon.certify(result)
