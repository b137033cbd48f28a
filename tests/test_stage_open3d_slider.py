"""The slider of Open3D's viewer shows the alpha shape of the alpha that it stands at."""

import os
import subprocess
import sys

import numpy as np
import pytest

import recon
from recon.stages import open3d_slider as stage

pytestmark = pytest.mark.peers
o3d = pytest.importorskip("open3d")


def cloud(points):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.array(points)))


@pytest.fixture(scope="module")
def points():
    found = np.random.default_rng(2).normal(size=(400, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


class Viewer:
    """What of Open3D's viewer the slider needs, without a window; like it, it calls back when things are added."""

    def __init__(self):
        self.held, self.times, self.callback, self._time = {}, {}, None, 0.0

    def add_geometry(self, name, geometry, time=0.0):
        assert name not in self.held
        self.held[name], self.times[name] = geometry, time
        if self.callback is not None:
            self.callback(self, self._time)

    def remove_geometry(self, name):
        self.held.pop(name, None)

    def set_on_animation_frame(self, callback):
        self.callback = callback

    def post_redraw(self):
        pass

    reset_camera_to_default = post_redraw

    @property
    def current_time(self):
        return self._time

    @current_time.setter
    def current_time(self, time):
        assert 0 <= time <= max(self.times.values())
        self._time = time
        self.callback(self, time)


def triangles(mesh):
    return {
        tuple(sorted(map(tuple, corners))) for corners in np.asarray(mesh.vertices)[np.asarray(mesh.triangles)].tolist()
    }


@pytest.mark.parametrize("weights", [None, "adaptive"])
def test_every_place_of_the_slider_shows_the_facets_of_its_alpha(points, weights):
    shapes = stage.alpha_shapes(cloud(points), weights, steps=30)
    assert (np.diff(shapes.alphas) > 0).all() and len(shapes.alphas) >= 30
    viewer = Viewer()
    stage.attach(viewer, shapes)
    assert viewer.current_time == shapes.start
    for place in (shapes.start, 0, 7, len(shapes.alphas) - 1):
        viewer.current_time = float(place)
        alpha = shapes.alphas[place]
        boundary = shapes.family.boundary(alpha)
        for name, chosen in (("regular facets", ~boundary.singular), ("singular facets", boundary.singular)):
            expected = {tuple(sorted(map(tuple, corners))) for corners in points[boundary.facets[chosen]].tolist()}
            assert (triangles(viewer.held[name]) if name in viewer.held else set()) == expected
            assert name not in viewer.held or viewer.times[name] == place
        assert len(viewer.held["points"].points) == len(points)
        assert viewer.title == f"Alpha shape, alpha = {alpha:.6g}"


def test_it_begins_with_the_recommended_shape(points):
    shapes = stage.alpha_shapes(cloud(points))
    regular, singular = shapes.parts(shapes.start)
    assert shapes.family.betti(shapes.alphas[shapes.start]).tolist() == [1, 0, 1]
    assert len(regular.faces) + len(singular.faces) >= 796


def test_what_cannot_be_is_refused(points):
    for call, error, words in (
        (lambda: stage.alpha_shapes(points), recon.InvalidInput, "PointCloud"),
        (lambda: stage.alpha_shapes(cloud(points), "heavy"), recon.InvalidInput, "weights: expected 'adaptive'"),
        (lambda: stage.alpha_shapes(cloud(points), steps=1), recon.InvalidInput, "steps"),
        (lambda: stage.alpha_shapes(cloud(points * [1, 1, 0])), recon.DegenerateInput, "less than 3 dimensions"),
    ):
        with pytest.raises(error, match=words):
            call()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there always is a display")
def test_without_a_display_one_line_says_what_else_there_is():
    code = (
        "import open3d, numpy as np\nfrom recon import StageError\nfrom recon.stages.open3d import show_alpha_shapes\n"
        "try: show_alpha_shapes(open3d.geometry.PointCloud(open3d.utility.Vector3dVector(np.eye(3))))\n"
        "except StageError as error: print(error)"
    )
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment)
    said = "there is no display for Open3D's viewer; recon view CLOUD -o view.html writes a page instead\n"
    assert out.stdout == said, out.stderr
