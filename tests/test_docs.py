"""The documentation says what is so: snippets run and print what is shown, every name and page is there, the site builds."""

import contextlib
import importlib
import importlib.util
import io
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import datasets_synthetic
import recon
import weighting
from recon.cli import main

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
SNIPPET = re.compile(r"^```python\n(.*?)^```\n(?:\n``` \{ \.text \.output \}\n(.*?)^```\n)?", re.DOTALL | re.MULTILINE)
SHELL = re.compile(r"^```sh\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
NEEDS = {"stages.md": ("open3d", "pymeshlab")}


def text(page):
    return (DOCS / page).read_text(encoding="utf-8")


def module(name):
    """Load docs/NAME.py, which is in no package."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", DOCS / f"{name}.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def with_snippets():
    """Pages that have code, those that need more than the core marked."""
    for page in PAGES:
        if "```python" in text(page):
            yield pytest.param(page, marks=pytest.mark.peers if page in NEEDS else ())


@pytest.mark.parametrize("page", list(with_snippets()))
def test_every_snippet_prints_what_the_page_shows(page, tmp_path, monkeypatch):
    for name in NEEDS.get(page, ()):
        pytest.importorskip(name)
    monkeypatch.chdir(tmp_path)
    snippets = SNIPPET.findall(text(page))
    assert len(snippets) == text(page).count("```python")
    scope = {"__name__": "page"}
    for code, shown in snippets:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, page, "exec"), scope)
        assert printed.getvalue() == shown


@pytest.mark.parametrize("page", [page for page in PAGES if re.search(r"^recon ", text(page), re.MULTILINE)])
def test_every_command_works(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [line for block in SHELL.findall(text(page)) for line in block.splitlines() if line.startswith("recon ")]
    assert lines
    for line in lines:
        done = CliRunner().invoke(main, shlex.split(line, comments=True)[1:])
        assert done.exit_code == 0, f"{line}: {done.output}"


def test_every_public_name_is_in_the_reference():
    documented = set(re.findall(r"^::: (\S+)$", "".join(text(page) for page in PAGES), re.MULTILINE))
    for target in sorted(documented):
        owner, _, name = target.rpartition(".")
        try:
            importlib.import_module(target)
        except ModuleNotFoundError:
            assert hasattr(importlib.import_module(owner), name), target
    documented |= set(re.findall(r"^## (datasets_synthetic\.\w+)$", text("api/datasets.md"), re.MULTILINE))
    names = {target.rpartition(".")[2] for target in documented}
    listed = text("api/recon.md")
    for name in recon.__all__:
        assert name in names or re.search(rf"\b{name}\b", listed) or name == "__version__", name
    for package in (weighting, datasets_synthetic):
        assert set(package.__all__) <= names, package.__name__


def test_the_navigation_has_every_page_once():
    listed = re.findall(r"[\w/-]+\.md$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == PAGES


def test_links_lead_somewhere():
    """To pages and pictures here; the anchors in them are checked when the site is built."""
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)", text(page)):
            if not target.startswith("http") and target != "torus.html":  # made when the site is built
                assert (DOCS / page).parent.joinpath(target).exists(), f"{page}: {target}"


def test_every_picture_is_drawn_and_shown():
    pytest.importorskip("matplotlib")
    pictures = module("pictures")
    shown = set(re.findall(r"pictures/([\w-]+)\.svg", "".join(text(page) for page in PAGES)))
    assert shown == set(pictures.DRAWINGS) == {path.stem for path in (DOCS / "pictures").iterdir()}


@pytest.mark.slow
def test_pictures_can_be_drawn_anew(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    pictures = module("pictures")
    for name, draw in pictures.DRAWINGS.items():
        draw().savefig(tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").stat().st_size > 5000, name


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_shows_formulas_without_a_script(site):
    pages = [path.read_text(encoding="utf-8") for path in site.rglob("*.html")]
    assert len(pages) > len(PAGES)
    assert sum(page.count("<math ") for page in pages) > 100
    assert not any('class="arithmatex"' in page or "merror" in page for page in pages)
    assert (site / "assets" / "STIXTwoMath-Regular.ttf").stat().st_size > 100_000


def test_the_site_shows_the_help_of_every_command(site):
    page = (site / "cli.html").read_text(encoding="utf-8")
    for name in main.commands:
        assert f"Usage: recon {name} " in page, name


def test_the_site_has_a_page_made_by_the_viewer(site):
    page = (site / "torus.html").read_text(encoding="utf-8")
    assert "<title>a torus of 2,000 points" in page and len(page) > 100_000


def test_the_site_keeps_sources_of_programs_to_itself(site):
    assert not list(site.rglob("*.py"))


@pytest.mark.parametrize(
    "page, fetches",
    [
        ('<script src="https://example.org/a.js"></script>', True),
        ("<link rel=stylesheet href=//example.org/a.css>", True),
        ('<img alt="" src="http://example.org/a.png">', True),
        ("<style>@import url(https://example.org/a.css)</style>", True),
        (
            '<a href="https://example.org/">a link</a><img src="a.png"><link rel="canonical" href="https://example.org">',
            False,
        ),
    ],
)
def test_a_site_that_fetches_from_elsewhere_is_refused(tmp_path, page, fetches):
    exceptions = pytest.importorskip("mkdocs.exceptions")
    (tmp_path / "page.html").write_text(page)
    refused = pytest.raises(exceptions.PluginError, match=r"page\.html") if fetches else contextlib.nullcontext()
    with refused:
        module("hooks").on_post_build({"site_dir": str(tmp_path)})


def test_the_picture_of_the_introduction_is_right():
    """What its caption says: 47 pieces, a filled waist, one closed curve through all points."""
    pytest.importorskip("matplotlib")
    small, large, adaptive = module("pictures").snippet("theory/index.md")["shapes"].values()
    assert small.betti().tolist() == [47, 0]
    assert np.count_nonzero(~large.boundary().singular) > 0
    assert adaptive.betti().tolist() == [1, 1] and np.count_nonzero(adaptive.classify(0) != recon.EXTERIOR) == 110
    degree = np.bincount(adaptive.boundary().facets.ravel(), minlength=110)
    assert (degree == 2).all() and adaptive.boundary().singular.all()
