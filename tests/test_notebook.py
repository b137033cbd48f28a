"""What a session shows: lines that tell something, and in a notebook a small picture beside figures."""

import base64
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import datasets_synthetic
import recon


@pytest.fixture(scope="module")
def result():
    points = datasets_synthetic.surface("torus").sample(1500, rng=0).points
    return recon.reconstruct(points, attributes={"a<b": np.arange(1500)})


class Tags(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.open, self.names, self.text = [], [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_lines_tell_what_there_is(result):
    used = len(np.unique(result.mesh.vertex_source)) / 1500
    shape = f"Mesh({len(result.mesh.vertices):,} vertices, {len(result.mesh.faces):,} faces, attributes: a<b)"
    assert repr(result.mesh) == shape
    assert repr(result) == f"Reconstruction(closed, chi 0, {used:.2%} of 1,500 points used, {shape})"


def test_a_notebook_shows_a_picture_and_figures_and_runs_nothing(result):
    for shown, words in ((result, ["closed, because", "of 1,500"]), (result.mesh, ["closed, manifold, 1 piece, χ 0"])):
        markup = shown._repr_html_()
        tags = Tags(markup)
        assert set(tags.names) == {"div", "img", "table", "tr", "td"}
        assert "a<b" in tags.text and all(any(word in text for text in tags.text) for word in words)
        assert "http" not in markup and len(markup) < 100_000
        picture = base64.b64decode(re.search('base64,([^"]*)', markup)[1])
        assert picture.startswith(b"\x89PNG")


def test_an_empty_mesh_is_shown_without_a_picture():
    empty = recon.Mesh.from_arrays(np.empty((0, 3)), np.empty((0, 3), int))
    assert "img" not in Tags(empty._repr_html_()).names
    assert repr(empty) == "Mesh(0 vertices, 0 faces)"
