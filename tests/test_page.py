"""Pages to look at, without a browser: what is in them, exact and whole; pictures, charts, and the command."""

import base64
import gzip
import json
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import datasets_synthetic
import recon
from recon.cli import main
from recon.page import report_page, view_page
from recon.page.charts import histogram
from recon.page.document import SCRIPTS, resource
from recon.page.family import family_arrays
from recon.page.pack import pack
from recon.page.raster import picture
from recon.page.scene import Colour, Scene, own_colours
from recon.report import MEANING

NAME = "</script><script>alert(1)</script> a & b \"c\" 'd' <i> $title ${data} $$ \u2028✓"


def unpack(table, text):
    """What `unpack` of family.js does, slowly."""
    data, arrays, at = gzip.decompress(base64.b64decode(text)), {}, 0
    for entry in table:
        kind = np.dtype(entry["type"].removesuffix("Array").lower())
        total = entry["rows"] * entry["columns"]
        planes = np.frombuffer(data, np.uint8, total * kind.itemsize, at).reshape(kind.itemsize, total)
        columns = planes.T.copy().view(kind.newbyteorder("<")).reshape(entry["columns"], entry["rows"])
        if kind == np.int32:
            columns = np.cumsum(columns, axis=1, dtype=np.int32)
        arrays[entry["name"]], at = columns.T, at + planes.size
    assert at == len(data)
    return arrays


class Reader(HTMLParser):
    """Tags, ids and texts of a page."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.texts, self._id = [], {}, None
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._id = dict(attrs).get("id") if tag == "script" else None

    def handle_data(self, data):
        if self._id:
            self.texts[self._id] = self.texts.get(self._id, "") + data


def content(page):
    """What the scripts of a page get: the facts and the arrays."""
    texts = Reader(page).texts
    meta = json.loads(texts["recon-meta"])
    return meta, unpack(meta["arrays"], texts["recon-data"])


@pytest.fixture(scope="module")
def torus():
    return datasets_synthetic.surface("torus").sample(800, spacing="blue", rng=3).points


@pytest.fixture(scope="module")
def result(torus):
    return recon.reconstruct(torus)


@pytest.fixture(scope="module")
def report(result, torus):
    return report_page(result, torus, title=NAME)


# --- arrays


@given(
    hnp.arrays(
        st.sampled_from([np.float64, np.float32, np.int32, np.uint8]),
        st.one_of(st.tuples(st.integers(0, 9)), st.tuples(st.integers(0, 9), st.integers(1, 4))),
    )
)
def test_arrays_come_back_bit_for_bit(array):
    back = unpack(*pack({"one": array, "two": array}))
    for name in ("one", "two"):
        assert back[name].reshape(array.shape).astype(array.dtype).tobytes() == array.tobytes()


def shape_at(arrays, alpha):
    """What the page draws at alpha: the rule of family.js."""
    rank = np.searchsorted(arrays["critical"], alpha, side="right")
    first, lower, upper = arrays["intervals"].T
    singular, regular = (first < rank) & (rank <= lower), (lower < rank) & (rank <= upper)
    facets = np.where(singular[:, None], np.sort(arrays["facets"], axis=1), arrays["facets"])
    return facets[singular | regular], singular[singular | regular], upper < rank


coordinates = st.one_of(st.integers(-2, 2).map(float), st.floats(-1, 1, width=32))


@settings(deadline=None, max_examples=40)
@given(st.data(), st.integers(1, 3), st.integers(1, 14), st.booleans())
def test_ranks_give_the_boundary_of_every_shape(data, d, n, flat):
    points = np.array(data.draw(st.lists(st.tuples(*[coordinates] * d), min_size=n, max_size=n)))
    if flat and d == 3:
        points[:, 2] = points[:, 0]
    family = recon.alpha_complex(points, data.draw(st.lists(coordinates, min_size=n, max_size=n)))
    arrays = family_arrays(family)
    critical = arrays["critical"]
    assert np.array_equal(critical, family.spectrum())
    for alpha in [-np.inf, 0.0, np.inf, *critical, *np.nextafter(critical, -np.inf), *np.nextafter(critical, np.inf)]:
        rank = np.searchsorted(critical, alpha, side="right")
        expected = family.betti(alpha)
        assert np.array_equal(arrays["betti"][rank - 1] if rank else 0 * expected, expected)
        if family.dimension:
            boundary, (facets, singular, interior) = family.boundary(alpha), shape_at(arrays, alpha)
            assert np.array_equal(facets, boundary.facets) and np.array_equal(singular, boundary.singular)
            assert np.array_equal(interior, family.classify(family.dimension - 1, alpha) == recon.INTERIOR)
        if family.dimension in (1, 2):
            inside = family.classify(family.dimension, alpha) == recon.INTERIOR
            assert np.array_equal(arrays["entries"] < rank, inside)


def test_a_page_carries_the_family_in_double_precision(torus):
    weights = np.random.default_rng(0).uniform(0, 0.01, len(torus))
    meta, arrays = content(view_page(torus, weights))
    family = recon.alpha_complex(torus, weights)
    assert arrays["critical"].dtype == np.float64
    assert np.array_equal(arrays["critical"][:, 0], family.spectrum())
    assert meta["alpha"] == family.choices()[0].alpha
    arrays["critical"] = arrays["critical"][:, 0]
    for choice in family.choices():
        assert np.array_equal(shape_at(arrays, choice.alpha)[0], family.boundary(choice.alpha).facets)


# --- self-contained


def external(page):
    """Everything in a page that would be fetched."""
    for tag, attributes in Reader(page).tags:
        for name in ("src", "href", "data", "action", "poster", "srcset"):
            if name in attributes and not attributes[name].startswith("data:"):
                yield tag, attributes
        if tag in ("iframe", "object", "embed", "base"):
            yield tag, attributes
    styles = page[page.index("<style>") : page.index("</style>")]
    yield from re.findall(r"@import|url\(", styles)


def test_pages_fetch_nothing_and_forbid_it(torus, report):
    for page in (view_page(torus), report):
        assert list(external(page)) == []
        policy = next(a["content"] for tag, a in Reader(page).tags if "http-equiv" in a)
        assert "default-src 'none'" in policy and "http" not in policy


def test_every_page_carries_the_licence_of_three(torus):
    notice = resource("three.LICENSE.txt").strip()
    assert "MIT" in notice and notice in resource("three.min.js") and notice in view_page(torus)


def test_no_script_ends_early():
    assert not any("</script" in resource(name).lower() for name in SCRIPTS)


def test_names_are_text_wherever_they_stand(torus, report):
    for page in (view_page(torus[:50], title=NAME, note=NAME), report):
        reader = Reader(page)
        assert len([tag for tag, _ in reader.tags if tag == "script"]) == 2 + len(SCRIPTS)
        assert not [tag for tag, _ in reader.tags if tag == "i"]
    meta, _ = content(view_page(torus[:50], title=NAME, note=NAME))
    assert meta["title"] == meta["note"] == NAME


def test_the_same_input_gives_the_same_page(torus):
    assert view_page(torus) == view_page(torus)


def test_a_page_too_large_for_browsers_is_refused(torus, monkeypatch):
    monkeypatch.setattr("recon.page.document.LARGEST", 1000)
    with pytest.raises(recon.InvalidInput, match="fewer points"):
        view_page(torus)
    monkeypatch.setattr("recon.page.view.MOST", 10)
    monkeypatch.setattr("recon.page.view.alpha_complex", None)  # refused before the work
    with pytest.raises(recon.InvalidInput, match="up to 10"):
        view_page(torus)


# --- what is drawn


def test_positions_are_near_the_origin_whatever_the_input():
    points = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1.0]])
    expected = content(view_page(points))[1]["positions"]
    for scale, offset in ((2.0**-300, 0.0), (2.0**100, 0.0), (1.0, 2.0**30)):
        assert np.array_equal(content(view_page(points * scale + offset))[1]["positions"], expected)


def test_vertices_that_are_points_are_not_doubled(result, torus):
    scene = Scene.of(torus, result.mesh)
    assert len(scene.places) == len(torus)
    assert np.array_equal(scene.places[scene.faces], result.mesh.vertices[result.mesh.faces])


def test_vertices_that_are_no_points_are_added():
    points = np.eye(3)
    mesh = recon.Mesh.from_arrays(
        [[1, 0, 0], [0, 1, 0.5], [9, 9, 9], [0, 0, 1]], [[0, 1, 2], [1, 3, 2]], vertex_source=[0, 1, -1, 2]
    )
    scene = Scene.of(points, mesh)
    assert np.array_equal(scene.places[scene.faces], mesh.vertices[mesh.faces])
    assert len(scene.places) == 5
    carried = scene.on_all(np.array([1.0, 2.0, 3.0]))
    assert carried[:4].tolist() == [1, 2, 3, 2] and np.isnan(carried[4])


def test_colours_run_along_the_scale_and_missing_ones_are_grey():
    colour = Colour("weight", "", "", "", np.array([0.0, 1.0, 2.0, np.nan]))
    facts = colour.facts()
    assert facts["low"] < 0.1 and facts["high"] > 1.9
    assert colour.array().tolist() == [0, 127, 254, 255]
    signed = Colour("error", "", "", "", np.array([-1.0, 0.0, 3.0])).facts()
    assert signed["diverging"] and signed["low"] == -signed["high"]
    alike = Colour("weight", "", "", "", np.full(3, 7.0))
    assert alike.facts()["low"] == alike.facts()["high"] == 7 and len(set(alike.array())) == 1


@pytest.mark.parametrize(
    "colors", [np.uint8([[255, 0, 128]]), np.uint16([[65535, 0, 32768]]), np.array([[1.0, 0.0, 0.502]])], ids=str
)
def test_own_colours_of_any_type_are_shown_in_eight_bits(colors):
    (colour,) = own_colours({"colors": np.repeat(colors, 2, axis=0)}, Scene(np.zeros((2, 3))))
    assert colour.array().tolist() == [[255, 0, 128]] * 2


def test_errors_are_distances_to_the_reference_or_to_the_mesh(torus, result):
    sphere = datasets_synthetic.surface("sphere")
    meta, _ = content(view_page(torus[:100], reference=sphere))
    (error,) = [colour for colour in meta["colours"] if "error" in colour["array"]]
    assert error["diverging"] and error["high"] == pytest.approx(np.abs(sphere.distance(torus[:100])).max(), rel=0.2)
    meta, _ = content(view_page(torus, mesh=result.mesh))
    assert [colour["label"] for colour in meta["colours"]] == ["weight", "distance to mesh"]


@pytest.mark.parametrize(
    "points",
    [[[0.0, 0, 0]], [[0.0, 0, 0]] * 3, [[0.0, 0, 0], [1, 0, 0]], [[0.0, 0], [1, 0], [0, 1]], [[1.0], [2.0], [4.0]]],
    ids=["one point", "one spot", "a line", "two columns", "one column"],
)
def test_any_cloud_has_a_page(points):
    meta, arrays = content(view_page(points))
    assert meta["points"] == len(points) == len(arrays["positions"]) and np.isfinite(arrays["positions"]).all()


def test_more_than_three_columns_are_refused():
    with pytest.raises(recon.InvalidInput, match="up to 3 columns"):
        view_page(np.eye(4))


# --- pictures


def pixels(png):
    """Decode what `picture` wrote."""
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = (int.from_bytes(png[i : i + 4], "big") for i in (16, 20))
    start = png.index(b"IDAT")
    size = int.from_bytes(png[start - 4 : start], "big")
    assert zlib.crc32(png[start : start + 4 + size]) == int.from_bytes(png[start + 4 + size : start + 8 + size], "big")
    lines = np.frombuffer(zlib.decompress(png[start + 4 : start + 4 + size]), np.uint8).reshape(height, 4 * width + 1)
    assert not lines[:, 0].any()
    return lines[:, 1:].reshape(height, width, 4).astype(int)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_square_fills_its_share_of_the_picture_without_a_seam():
    image = pixels(picture(SQUARE, TWO, (0, 0, 1), (0, 1, 0), (100, 100)))
    solid = image[:, :, 3] == 255
    assert solid[4:96, 4:96].all() and solid.sum() == pytest.approx(94 * 94, rel=0.05)
    assert not image[0].any()


@pytest.mark.parametrize("turn", range(3))
def test_a_triangle_covers_half_of_its_box(turn):
    for corners in ([0, 1, 2], [1, 2, 3], [2, 3, 0], [3, 0, 1]):
        image = pixels(picture(SQUARE, np.roll([corners], turn), (0, 0, 1), (0, 1, 0), (100, 100)))
        assert (image[:, :, 3] > 127).sum() == pytest.approx(94 * 94 / 2, rel=0.05)


def test_fronts_and_backs_differ_and_the_nearer_face_is_seen():
    front = pixels(picture(SQUARE, TWO, (0, 0, 1), (0, 1, 0), (60, 60)))[30, 30, :3]
    back = pixels(picture(SQUARE, TWO, (0, 0, -1), (0, 1, 0), (60, 60)))[30, 30, :3]
    assert front[2] > front[0] and back[0] > back[2]
    both = np.concatenate([SQUARE, SQUARE + (0, 0, -1)])
    faces = np.concatenate([TWO, TWO[:, ::-1] + 4])
    for order in (faces, faces[::-1]):
        assert np.array_equal(pixels(picture(both, order, (0, 0, 1), (0, 1, 0), (60, 60)))[30, 30, :3], front)
        seen = pixels(picture(both, order, (0, 0, -1), (0, 1, 0), (60, 60)))[30, 30, :3]
        assert seen[2] > seen[0]


@pytest.mark.parametrize("scale", [1e-90, 1.0, 1e90])
def test_pictures_do_not_depend_on_the_scale(result, scale):
    mesh = result.mesh
    image = pixels(picture(mesh.vertices * scale, mesh.faces, (1, 1, 1), (0, 0, 1), (80, 60)))
    seen = pixels(picture(mesh.vertices, mesh.faces, (1, 1, 1), (0, 0, 1), (80, 60)))
    assert (image[:, :, 3] > 0).sum() == pytest.approx((seen[:, :, 3] > 0).sum(), rel=0.02)


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.zeros((3, 3)), np.array([[0.0, 0, 0], [1, 0, 0]])])
def test_degenerate_things_can_be_drawn(points):
    assert pixels(picture(points, None, (0.5, 0.4, 1), (0, 1, 0), (40, 30)))[:, :, 3].any()
    picture(points, np.array([[0, 0, 0]]), (0.5, 0.4, 1), (0, 1, 0), (40, 30))


def test_histograms_count_every_value():
    values = np.concatenate([np.linspace(0, 1, 999), [50.0]])
    chart = histogram(values, "x < y", {"mean": 0.5})
    shares = [float(share) for share in re.findall(r"([\d.]+)%</title>", chart)]
    assert sum(shares) == pytest.approx(100, abs=0.01 * len(shares)) and "x &lt; y" in chart
    assert "all 0" in histogram(np.zeros(5), "nothing", {"mean": 0.0})
    tiny = histogram(np.full(4, 5e-324), "tiny", {})
    assert "<rect" in tiny or "all" in tiny


# --- the report


def test_every_figure_of_a_report_has_a_unit_and_a_meaning(result):
    known = {f"{section}.{key}" for section, figures in result.report.sections.items() for key in figures}
    assert known <= set(MEANING), f"add to recon.report.MEANING: {sorted(known - set(MEANING))}"
    assert all(meaning for _, meaning in MEANING.values())
    table = result.report.to_html()
    for section, figures in result.report.sections.items():
        for key in figures:
            assert f">{key.replace('_', ' ')}</td>" in table and MEANING[f"{section}.{key}"][1] in table


def test_the_report_page_tells_all(report, result, torus):
    for metric in recon.measure(result.mesh, torus, points=len(torus), samples=2000):
        assert f">{metric.name.replace('_', ' ')}</td>" in report and metric.unit in report
    for text in (
        "adaptive weights (this mesh)",
        "uniform weights",
        "closed surface",
        "lie on the mesh exactly",
        "<svg",
    ):
        assert text in report
    assert report.count('src="data:image/png;base64,') == 5
    meta, arrays = content(report)
    assert np.array_equal(
        np.sort(arrays["faces"], axis=0), np.sort(result.mesh.vertex_source[result.mesh.faces], axis=0)
    )
    assert "critical" not in arrays and meta["points"] == len(torus)


def test_the_report_page_shows_doubtful_handles(report):
    assert "doubtful" not in Reader(report).texts["recon-meta"] and "loops go" not in report
    points = datasets_synthetic.surface("torus", major=0.54, minor=0.46).sample(1000, spacing="blue", rng=0).points
    narrow = recon.reconstruct(points)
    rows = np.concatenate(narrow.thin_loops)
    page = report_page(narrow, points)
    assert "1 loop goes around handles so thin" in page
    meta, arrays = content(page)
    colour = next(c for c in meta["colours"] if c["label"] == "doubtful handles")
    red, _, blue = arrays[colour["array"]][: len(points)].T
    np.testing.assert_array_equal(np.flatnonzero(red > blue), np.sort(rows))


def test_the_report_against_a_truth_uses_it_and_says_where_other_weights_give_nothing(torus, monkeypatch, result):
    from recon import pipeline

    def fail(*args, **kwargs):
        raise recon.DegenerateInput("nothing <left>")

    monkeypatch.setattr(pipeline, "reconstruct", fail)
    page = report_page(result, torus, reference=datasets_synthetic.surface("torus"))
    assert "Measured against the reference" in page and "iou" in page and "nothing &lt;left&gt;" in page


# --- the command


def run(*args, stdin=None):
    return CliRunner().invoke(main, [str(arg) for arg in args], input=stdin)


def test_view_writes_a_page_with_the_mesh_of_the_cloud(tmp_path, torus):
    recon.write_points(torus, tmp_path / "torus.xyz")
    outcome = run("view", tmp_path / "torus.xyz", "-o", tmp_path / "v.html", "--against", "torus")
    assert outcome.exit_code == 0, outcome.output
    assert "800 points" in outcome.stdout
    meta, arrays = content((tmp_path / "v.html").read_text("utf-8"))
    assert meta["title"] == "torus.xyz" and len(arrays["faces"]) > 1500
    assert {colour["array"] for colour in meta["colours"]} == {"colour weight", "colour error"}


def test_view_shows_the_faces_of_a_mesh_as_they_are(tmp_path, result):
    recon.write_mesh(result.mesh, tmp_path / "m.ply")
    assert run("view", tmp_path / "m.ply", "-o", tmp_path / "v.html", "-q").output == ""
    _, arrays = content((tmp_path / "v.html").read_text("utf-8"))
    assert np.array_equal(arrays["faces"], result.mesh.faces)
    assert len(arrays["positions"]) == len(result.mesh.vertices)


def test_view_of_a_cloud_without_a_surface_says_so_on_the_page():
    outcome = run("view", "-", "-o", "-", stdin="0 0 0\n1 0 0\n2 0 0\n")
    assert outcome.exit_code == 0, outcome.output
    meta, arrays = content(outcome.stdout)
    assert "no mesh" in meta["note"] and "at least 4" in meta["note"] and "faces" not in arrays


def test_view_takes_radii_from_the_file(tmp_path):
    (tmp_path / "two.xyzr").write_text("0 0 0 1.5\n2 0 0 1\n0 2 0 1\n0 0 2 1\n")
    assert (
        run("view", tmp_path / "two.xyzr", "-o", tmp_path / "v.html", "--weights", "radius", "--alpha", 0).exit_code
        == 0
    )
    meta, arrays = content((tmp_path / "v.html").read_text("utf-8"))
    assert meta["alpha"] == 0 and arrays["critical"][0] == -2.25 and meta["note"] is None


def test_view_refuses_what_it_cannot_do(tmp_path):
    (tmp_path / "c.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    for arguments, code, text in (
        ((tmp_path / "c.xyz",), 2, "--out"),
        ((tmp_path / "c.xyz", "-o", tmp_path / "no" / "v.html"), 2, "no folder"),
        ((tmp_path / "c.xyz", "-o", tmp_path / "v.html", "--weights", "radius"), 2, "no radii"),
        ((tmp_path / "c.xyz", "-o", tmp_path / "v.html", "--against", "thorus"), 2, "thorus"),
        ((tmp_path / "c.xyz", "-o", tmp_path / "v.html", "--alpha", "nan"), 2, "alpha"),
        ((tmp_path / "d.xyz", "-o", tmp_path / "v.html"), 2, "no such file"),
    ):
        outcome = run("view", *arguments)
        assert outcome.exit_code == code and text in outcome.stderr, outcome.output
        assert not (tmp_path / "v.html").exists()


def test_reconstruct_writes_a_report_page(tmp_path, torus):
    recon.write_points(torus, tmp_path / "torus.xyz")
    outcome = run("reconstruct", tmp_path / "torus.xyz", tmp_path / "m.ply", "--report", tmp_path / "r.HTML", "-q")
    assert outcome.exit_code == 0 and outcome.output == ""
    page = (tmp_path / "r.HTML").read_text("utf-8")
    assert "<title>torus.xyz</title>" in page and list(external(page)) == []
    assert run("reconstruct", tmp_path / "torus.xyz", tmp_path / "m.ply", "--report", "r.pdf").exit_code == 2
