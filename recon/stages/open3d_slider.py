"""All alpha shapes of a cloud in Open3D's own viewer, with alpha on its time slider."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..alpha import AlphaComplex, alpha_complex
from ..contracts import DegenerateInput, InvalidInput, StageError, as_points, as_whole, require, shown
from ..mesh import Mesh
from .open3d import from_point_cloud, to_open3d

_REGULAR, _SINGULAR = (0.58, 0.67, 0.75), (0.85, 0.55, 0.25)  # colours of facets that bound a solid, and that do not
_NAMES = ("regular facets", "singular facets")


@dataclass(frozen=True, slots=True, eq=False)
class AlphaShapes:
    """The alpha shapes of a cloud at a number of alphas, each made when it is asked for.

    Attributes
    ----------
    family : AlphaComplex
    alphas : (a,) ndarray of float64 [L^2]
        Ascending critical values.
    start : int
        The one among `alphas` to begin with: the last that is not above the recommended one.
    """

    family: AlphaComplex
    alphas: NDArray[np.float64]
    start: int

    def parts(self, place: int) -> tuple[Mesh, Mesh]:
        """Give the regular facets, which bound a solid, and the singular ones, at ``alphas[place]``."""
        from ..mesh import compact_mesh

        place = as_whole(place, "place", 0)
        if place >= len(self.alphas):
            raise InvalidInput(f"place: expected 0 to {len(self.alphas) - 1}, got {shown(place)}")
        boundary = self.family.boundary(float(self.alphas[place]))
        points = self.family.triangulation.points
        kinds = (boundary.facets[~boundary.singular], boundary.facets[boundary.singular])
        return compact_mesh(points, kinds[0], {}), compact_mesh(points, kinds[1], {})


def alpha_shapes(pcd: Any, weights: Literal["adaptive"] | ArrayLike | None = None, *, steps: int = 200) -> AlphaShapes:
    """Collect the shapes that a slider goes through.

    Parameters
    ----------
    pcd : open3d.geometry.PointCloud or open3d.t.geometry.PointCloud
    weights : (n,) array_like of float [L^2] or "adaptive", default: all zero
    steps : int
        How many: where facets come and go, at even ranks, and where the most lasting voids begin and end.

    Returns
    -------
    AlphaShapes

    Raises
    ------
    InvalidInput
        No point cloud, malformed points or weights, fewer than 2 steps.
    DegenerateInput
        Points that span less than space.
    """
    steps = as_whole(steps, "steps", 2)
    values, _ = from_point_cloud(pcd)
    points = as_points(values, 3)
    if isinstance(weights, str):
        import weighting

        if weights != "adaptive":
            raise InvalidInput(f"weights: expected 'adaptive' or one number a point, got {weights!r}")
        weights = weighting.adaptive_weights(points)
    family = alpha_complex(points, weights)
    if family.dimension < 3:
        raise DegenerateInput("points: they span less than 3 dimensions; their alpha shapes bound nothing")
    changes = np.unique(np.concatenate([family.entry(2), family.rho(3)]))
    even = changes[np.linspace(0, len(changes) - 1, min(steps, len(changes))).round().astype(np.int64)]
    voids = family.voids()
    lasting = np.argsort(voids.birth - voids.death, kind="stable")[: steps // 10]
    alphas = np.unique(np.concatenate([even, voids.birth[lasting], voids.death[lasting]]))
    start = int(np.searchsorted(alphas, family.choices()[0].alpha, side="right")) - 1
    return AlphaShapes(family, alphas, max(start, 0))


def show_alpha_shapes(pcd: Any, weights: Literal["adaptive"] | ArrayLike | None = None, *, steps: int = 200) -> None:
    """Open Open3D's viewer on the alpha shapes of a cloud; its time slider goes through alpha. Returns when it is closed.

    Parameters
    ----------
    pcd, weights, steps
        See `alpha_shapes`.

    Raises
    ------
    InvalidInput, DegenerateInput
        See `alpha_shapes`.
    StageError
        There is no display, or Open3D cannot draw on it. `recon view` writes a page that needs none.
    MissingDependency
        Open3D is not installed.
    """
    o3d = require("open3d", "open3d")
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise StageError("there is no display for Open3D's viewer; recon view CLOUD -o view.html writes a page instead")
    shapes = alpha_shapes(pcd, weights, steps=steps)
    application = o3d.visualization.gui.Application.instance
    try:
        application.initialize()
        window = o3d.visualization.O3DVisualizer("Alpha shapes", 1024, 768)
    except RuntimeError as error:
        raise StageError(f"Open3D's viewer cannot draw here: {error}") from error
    attach(window, shapes)
    application.add_window(window)
    application.run()


def attach(window: Any, shapes: AlphaShapes) -> None:
    """Fill a viewer, and let its time slider, from 0 to ``len(shapes.alphas) - 1``, choose alpha."""
    o3d = require("open3d", "open3d")
    last = len(shapes.alphas) - 1
    points = o3d.utility.Vector3dVector(np.array(shapes.family.triangulation.points))
    cloud = o3d.geometry.PointCloud(points)
    cloud.paint_uniform_color((0.3, 0.3, 0.3))
    shown = -1

    def show(viewer: Any, time: float) -> None:
        nonlocal shown
        place = min(max(round(time), 0), last)
        if place == shown:  # to add something calls this again
            return
        shown = place
        drawn = {"points": cloud}
        for name, part, colour in zip(_NAMES, shapes.parts(place), (_REGULAR, _SINGULAR)):
            if len(part.faces):
                drawn[name] = to_open3d(part)
                drawn[name].compute_triangle_normals()
                drawn[name].paint_uniform_color(colour)
        for name in ("points", *_NAMES):
            viewer.remove_geometry(name)
            if name in drawn:
                viewer.add_geometry(name, drawn[name], time=float(place))
        viewer.title = f"Alpha shape, alpha = {shapes.alphas[place]:.6g}"
        viewer.post_redraw()

    for name, time in (
        ("least alpha", 0.0),
        ("greatest alpha", float(last)),
    ):  # the slider goes as far as there are things
        window.add_geometry(name, o3d.geometry.PointCloud(points[:1]), time=time)
    window.show_settings = True
    window.animation_time_step = 1.0
    window.set_on_animation_frame(show)
    window.current_time = float(shapes.start)
    show(window, float(shapes.start))
    window.reset_camera_to_default()
