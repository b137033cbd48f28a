"""Pages in headless Chromium: what is drawn is what the library gives, bit for bit; keys, console, network, narrow windows."""

import json
import shutil
import time

import numpy as np
import pytest

import datasets_synthetic
import recon
from recon.page import report_page, view_page

pytestmark = pytest.mark.browser

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--force-device-scale-factor=1",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip
MISSING = "browser tests need chromium, chromedriver (apt-get install chromium chromium-driver) and selenium (pip); or -m 'not browser and not slow'"


class Browser:
    """A window of Chromium, and what it complained of and asked for."""

    def __init__(self):
        chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        driver = shutil.which("chromedriver")
        try:
            from selenium import webdriver
        except ModuleNotFoundError:
            webdriver = None
        if not (chromium and driver and webdriver):
            pytest.fail(MISSING, pytrace=False)
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for flag in FLAGS:
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
        self.run = self.driver.execute_script

    def open(self, page, folder, width=800, height=600, theme="light"):
        self.driver.get("about:blank")
        self.complaints()
        self.requests()
        emulate = self.driver.execute_cdp_cmd
        emulate(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )
        emulate("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
        path = folder / "page.html"
        path.write_text(page, "utf-8")
        self.driver.get(path.as_uri())
        until = time.monotonic() + 60
        while not self.run("return document.querySelector('.viewer').dataset.ready === 'true'"):
            assert time.monotonic() < until, self.complaints()
        return self

    def complaints(self):
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def requests(self):
        sent = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        urls = [m["params"]["request"]["url"] for m in sent if m["method"] == "Network.requestWillBeSent"]
        return [url for url in urls if not url.startswith(("data:", "blob:", "about:"))]

    def find(self, selector):
        return self.driver.find_element("css selector", selector)

    def press(self, *keys):
        self.find("body").send_keys(*keys)

    def slide(self, place):
        self.run(
            "const s = document.querySelector('.slider'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))",
            place,
        )
        return self.run("return recon.alpha")

    def drawn(self, layer="facets", width=3):
        found = self.run("return recon.drawn()")[layer]
        return {name: np.array(rows, np.int64).reshape(-1, width) for name, rows in found.items()}

    def seen(self):
        """A number for the picture."""
        return self.run("""
            recon.time(1);
            const gl = document.querySelector('.scene').getContext('webgl2');
            const w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, p = new Uint8Array(4 * w * h);
            gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, p);
            let hash = 0;
            for (const byte of p) hash = (Math.imul(hash, 31) + byte) | 0;
            return hash;""")

    def lit(self):
        """How many pixels differ from the corner."""
        return self.run("""
            recon.time(1);
            const gl = document.querySelector('.scene').getContext('webgl2');
            const w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, p = new Uint8Array(4 * w * h);
            gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, p);
            let count = 0;
            for (let i = 0; i < p.length; i += 4) if (p[i] !== p[0] || p[i + 1] !== p[1] || p[i + 2] !== p[2]) count++;
            return count;""")


@pytest.fixture(scope="module")
def browser():
    window = Browser()
    yield window
    window.driver.quit()


def order(facets):
    """Rows in lexicographic order of their sorted corners."""
    return np.lexsort(np.sort(facets, axis=1).T[::-1])


def grid():
    return np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3), None


def weighted():
    rng = np.random.default_rng(1)
    return rng.normal(size=(60, 3)), rng.uniform(-0.2, 0.6, 60)


def planar():
    points = np.random.default_rng(2).integers(0, 9, (40, 3)).astype(float)
    points[:, 2] = points[:, 0] + 2 * points[:, 1]
    return points, None


def line():
    return np.array([[1.0, 1, 1], [2, 2, 2], [4, 4, 4], [8, 8, 8]]), [0.0, 1, 0, -1]


def torus():
    return datasets_synthetic.surface("torus").sample(300, density=3, rng=0).points, None


CLOUDS = [torus, grid, weighted, planar, line]


@pytest.mark.parametrize("cloud", CLOUDS, ids=lambda f: f.__name__)
def test_the_page_knows_the_boundary_at_every_critical_value_and_beside_it(browser, tmp_path, cloud):
    points, weights = cloud()
    family = recon.alpha_complex(points, weights)
    browser.open(view_page(points, weights), tmp_path)
    critical = family.spectrum()
    some = critical[np.linspace(0, len(critical) - 1, 25).astype(int)]
    alphas = [0.0, *some, *np.nextafter(some, -np.inf), *np.nextafter(some, np.inf)]
    found = browser.run(
        "return arguments[0].map((alpha) => [recon.facets(alpha), recon.betti(alpha)])", list(map(float, alphas))
    )
    for alpha, (boundary, betti) in zip(alphas, found, strict=True):
        expected = family.boundary(alpha)
        rows = np.reshape(boundary["facets"], (-1, family.dimension)).astype(int)
        theirs, ours = order(rows), order(expected.facets)
        assert np.array_equal(rows[theirs], expected.facets[ours]), alpha
        assert np.array_equal(np.array(boundary["singular"], bool)[theirs], expected.singular[ours])
        assert betti == family.betti(alpha).tolist()
    assert browser.run("return [recon.facets(-Infinity).facets.length, recon.facets(Infinity).facets.length]") == [
        len(family.boundary(-np.inf)),
        len(family.boundary(np.inf)),
    ]
    assert browser.complaints() == [] and len(browser.requests()) == 1


@pytest.mark.parametrize("cloud", CLOUDS, ids=lambda f: f.__name__)
def test_the_slider_draws_exactly_the_facets_of_that_alpha(browser, tmp_path, cloud):
    points, weights = cloud()
    family = recon.alpha_complex(points, weights)
    d = family.dimension
    browser.open(view_page(points, weights), tmp_path)
    if d == 3:
        browser.press("3")
    seen, counts = set(), set()
    for place in np.linspace(0, 1, 9):
        alpha = browser.slide(float(place))
        drawn = browser.drawn(width=d)
        classes = family.classify(d - 1, alpha)
        kinds = {"singular": recon.SINGULAR, "regular": recon.REGULAR} | (
            {"interior": recon.INTERIOR} if d == 3 else {}
        )
        for name, kind in kinds.items():
            expected = family.simplices(d - 1)[classes == kind]
            got = np.sort(drawn.get(name, np.zeros((0, d), int)), axis=1)
            assert np.array_equal(got[order(got)], expected), (place, alpha, name)
        if d < 3:
            inside = family.simplices(d)[family.classify(d, alpha) == recon.INTERIOR]
            assert np.array_equal(browser.drawn("cells", d + 1).get("interior", np.zeros((0, d + 1), int)), inside)
        boundary = family.boundary(alpha)
        outward, expected = drawn.get("regular", np.zeros((0, d), int)), boundary.facets[~boundary.singular]
        assert np.array_equal(outward[order(outward)], expected[order(expected)])
        assert float(browser.find(".alpha").get_attribute("value")) == alpha
        seen.add(len(boundary))
        counts.add(browser.lit())
    assert len(seen) > 2 and len(counts) > 1
    assert browser.complaints() == []


@pytest.mark.parametrize("cloud", [weighted, planar], ids=lambda f: f.__name__)
def test_the_picture_at_an_alpha_does_not_depend_on_the_way_there(browser, tmp_path, cloud):
    points, weights = cloud()
    browser.open(view_page(points, weights), tmp_path)
    pictures = {browser.slide(place): browser.seen() for place in (0.2, 0.4, 0.6, 0.9, 0.5)}
    assert len(set(pictures.values())) > 3
    for alpha, expected in pictures.items():
        browser.open(view_page(points, weights, alpha=alpha), tmp_path)
        assert browser.seen() == expected


def test_a_step_of_the_slider_uploads_the_facets_that_it_draws_and_nothing_else(browser, tmp_path):
    points, _ = torus()
    result = recon.reconstruct(points)
    browser.open(view_page(points, result.weights, mesh=result.mesh), tmp_path)
    browser.press("m", "3")
    browser.slide(0.5)
    browser.run("""
        recon.time(1);
        window.uploaded = 0;
        const send = WebGL2RenderingContext.prototype.bufferSubData;
        WebGL2RenderingContext.prototype.bufferSubData = function (target, offset, source, start, length) {
          uploaded += length * source.BYTES_PER_ELEMENT;
          return send.apply(this, arguments);
        };
        WebGL2RenderingContext.prototype.bufferData = () => { uploaded = NaN; };""")
    for place in (0.1, 0.45, 0.7, 1.0):
        browser.slide(place)
        browser.run("recon.time(1)")
        facets = sum(len(rows) for rows in browser.drawn().values())
        assert facets > 0 and browser.run("const all = uploaded; uploaded = 0; return all") == 4 * 3 * facets
    browser.press("p", "m", "w")
    browser.run("recon.time(1)")
    assert browser.complaints() == []


def test_arrows_step_through_the_critical_values_in_double_precision(browser, tmp_path):
    points, weights = weighted()
    critical = recon.alpha_complex(points, weights).spectrum().tolist()
    browser.open(view_page(points, weights, alpha=critical[100]), tmp_path)
    alpha = lambda: browser.run("return recon.alpha")  # noqa: E731
    right, left, home, end = "\ue014", "\ue012", "\ue011", "\ue010"
    for key, expected in ((right, 101), (right, 102), (left, 101), (left, 100), (left, 99)):
        browser.press(key)
        assert alpha() == critical[expected]
    browser.run("recon.alpha = arguments[0]", float(np.nextafter(critical[50], np.inf)))
    browser.press(left)
    assert alpha() == critical[50]
    browser.press(home)
    assert alpha() < critical[0]
    browser.press(right)
    assert alpha() == critical[0]
    browser.press(end)
    assert alpha() > critical[-1]
    browser.press(right)
    assert alpha() == critical[-1]
    browser.press("0")
    assert alpha() == 0
    browser.press("g")
    assert alpha() == recon.alpha_complex(points, weights).choices()[0].alpha


def test_keys_switch_what_is_shown(browser, tmp_path):
    points, _ = torus()
    result = recon.reconstruct(points)
    browser.open(view_page(points, result.weights, mesh=result.mesh), tmp_path)
    groups = lambda: {k for layer in browser.run("return recon.drawn()").values() for k in layer}  # noqa: E731
    assert groups() == {"singular", "regular", "points"}
    for key, change in (("1", "singular"), ("2", "regular"), ("3", "interior"), ("m", "mesh"), ("p", "points")):
        before = groups()
        browser.press(key)
        assert groups() == before ^ {change}
        browser.press(key)
        assert groups() == before
    browser.press("m")
    faces = browser.drawn("mesh")["mesh"]
    assert np.array_equal(faces, result.mesh.vertex_source[result.mesh.faces])
    whole = browser.lit()
    browser.press("x")
    half = browser.lit()
    assert half < whole
    browser.press(".", ".", ".")
    assert browser.lit() != half
    browser.press("x")
    assert browser.lit() == whole
    for key, label in (("w", "weight"), ("e", "distance to mesh"), ("k", "kind")):
        browser.press(key)
        assert (
            browser.run("const s = document.querySelector('.colours select'); return s.selectedOptions[0].text")
            == label
        )
        assert browser.find(".scale").is_displayed() == (label != "kind")
    theme = lambda: browser.run("return document.documentElement.dataset.theme")  # noqa: E731
    assert theme() == "light"
    browser.press("t")
    assert theme() == "dark"
    browser.press("?")
    assert browser.find(".help").is_displayed() and browser.find(".help").text.count("\n") > 20
    browser.press("1")
    assert "singular" in groups()
    browser.press("?")
    assert not browser.find(".help").is_displayed()
    assert browser.complaints() == []


def test_alpha_can_be_typed_and_nonsense_is_marked(browser, tmp_path):
    browser.open(view_page(*weighted()), tmp_path, theme="dark")
    assert browser.run("return document.documentElement.dataset.theme") == "dark"
    field = browser.find(".alpha")
    for text, expected in (("0.123456789012345678", 0.12345678901234568), ("-1e-3", -0.001)):
        field.clear()
        field.send_keys(text, "\n")
        assert browser.run("return recon.alpha") == expected
    field.clear()
    field.send_keys("1,5", "\n")
    assert field.get_attribute("aria-invalid") == "true" and browser.run("return recon.alpha") == -0.001
    field.send_keys("m?t1")
    assert browser.run("return document.documentElement.dataset.theme") == "dark"


def test_where_nothing_is_there_the_page_says_where_something_is(browser, tmp_path):
    points, weights = torus()
    family = recon.alpha_complex(points, weights)
    browser.open(view_page(points, weights, alpha=-1.0), tmp_path)
    notice = browser.find(".notice")
    assert "No facet" in notice.text
    browser.find(".notice button").click()
    assert not notice.is_displayed()
    alpha = browser.run("return recon.alpha")
    assert len(family.boundary(alpha)) > 0
    earlier = family.spectrum()[family.spectrum() < alpha]
    assert not any(len(family.boundary(value)) for value in earlier)


def test_a_cloud_without_mesh_shows_the_reason_until_it_is_closed(browser, tmp_path):
    browser.open(view_page(*planar(), note="no mesh, because"), tmp_path)
    assert browser.find(".notice span").text == "no mesh, because"
    browser.find(".notice button").click()
    assert not browser.find(".notice").is_displayed()


@pytest.mark.parametrize(
    "points", [[[0.0, 0, 0]], [[0.0, 0, 0], [1, 0, 0]], [[1e200, 0, 0], [0, 1e200, 0]]], ids=["one", "two", "huge"]
)
def test_the_smallest_clouds_open(browser, tmp_path, points):
    browser.open(view_page(np.minimum(points, 1e99)), tmp_path)
    for place in (0.0, 0.3, 1.0):
        browser.slide(place)
    browser.press("\ue014", "\ue012", "0", "x", "w", "t")
    assert browser.lit() > 0
    assert browser.complaints() == []


def test_a_narrow_window_holds_everything(browser, tmp_path):
    points, weights = weighted()
    browser.open(view_page(points, weights, title="a rather long name of a file " * 3), tmp_path, width=400, height=760)
    assert browser.run("return document.documentElement.scrollWidth") == 400
    assert browser.run("return document.documentElement.scrollHeight") <= 760
    assert browser.find(".scene").size["height"] > 380
    assert not browser.find(".layers").is_displayed()
    browser.find(".panel summary").click()
    assert browser.find(".layers").is_displayed()


def test_the_report_page_shows_the_mesh_and_lets_the_wheel_scroll(browser, tmp_path):
    points, _ = torus()
    result = recon.reconstruct(points)
    page = report_page(result, points, title="torus")
    for width in (800, 400):
        browser.open(page, tmp_path, width=width)
        assert browser.run("return document.documentElement.scrollWidth") == width
    assert np.array_equal(browser.drawn("mesh")["mesh"], result.mesh.vertex_source[result.mesh.faces])
    assert browser.lit() > 1000
    browser.press("1", "m")  # not meant for the view
    assert "mesh" in browser.drawn("mesh")
    browser.find(".viewer").send_keys("m")
    assert "mesh" not in browser.drawn("mesh")
    images = browser.run("return [...document.images].map((image) => image.naturalWidth)")
    assert len(images) == 5 and min(images) > 100
    assert browser.complaints() == [] and len(browser.requests()) == 1
