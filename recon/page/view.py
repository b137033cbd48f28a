"""The page of ``recon view``: a cloud, the mesh of it, and the whole family of its weighted alpha shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..alpha import alpha_complex
from ..contracts import InvalidInput, as_number, as_points, as_weights, check_kind
from ..mesh import Mesh
from ..proximity import FaceQueries
from ..references import as_reference
from .document import document, viewer
from .family import family_arrays, marks
from .scene import Colour, Scene, own_colours

MOST = 700_000  # of them a page takes 240 MB, near the largest that browsers open


def view_page(
    points: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    mesh: Mesh | None = None,
    reference: Any = None,
    alpha: float | None = None,
    attributes: Mapping[str, NDArray] | None = None,
    title: str = "point cloud",
    note: str | None = None,
) -> str:
    """Write a page that sweeps alpha through all shapes of a cloud: one file, for any browser, without network.

    Parameters
    ----------
    points : (n, d) array_like of float [L]
        d up to 3.
    weights : (n,) array_like of float [L^2], default: all zero
    mesh : Mesh, optional
        To be shown as well, d = 3.
    reference : datasets_synthetic.Surface, Mesh or (m, 3) array_like of float [L], optional
        What the colours of errors are distances to; by default the mesh.
    alpha : float, optional [L^2]
        Where to begin: by default at the recommended value, see `AlphaComplex.choices`.
    attributes : mapping of str to (n, ...) ndarray, optional
        "colors" are shown.
    title, note : str
        The note is shown at the bottom at first.

    Returns
    -------
    str
        HTML.

    Raises
    ------
    InvalidInput
        Malformed arrays, something of another kind, alpha not finite, more than 3 dimensions, or so many points that no browser would open the page.

    Examples
    --------
    >>> page = view_page([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], title="four points")
    >>> "<title>four points</title>" in page, "http-equiv" in page
    (True, True)
    """
    check_kind(title, "title", str, "text")
    check_kind(note, "note", (str, type(None)), "text")
    check_kind(mesh, "mesh", (Mesh, type(None)), "a recon.Mesh")
    check_kind(attributes, "attributes", (Mapping, type(None)), "names and arrays in a dict")
    located = as_points(points)
    if located.shape[1] > 3:
        raise InvalidInput(f"points: expected up to 3 columns, got {located.shape[1]}")
    start = None if alpha is None else as_number(alpha, "alpha", "a finite number [L^2]")
    if start is not None and not np.isfinite(start):
        raise InvalidInput(f"alpha: expected a finite number [L^2], got {start}")
    if len(located) > MOST:
        raise InvalidInput(f"points: a page holds up to {MOST:,} of them, got {len(located):,}; take fewer")
    w = as_weights(weights, len(located))
    family = alpha_complex(located, w)
    scene = Scene.of(located, mesh)
    facts, arrays = scene.parts(colours_of(scene, w, mesh, reference, attributes or {}))
    chosen = marks(family)
    facts |= {
        "title": title,
        "note": note,
        "dimension": family.dimension,
        "weighted": bool(w.any()),
        "alpha": start if start is not None else chosen[0]["alpha"] if chosen else 0.0,
        "marks": chosen,
    }
    return document(title, viewer(), facts, {**arrays, **family_arrays(family)})


def colours_of(
    scene: Scene, w: NDArray[np.float64], mesh: Mesh | None, reference: Any, attributes: Mapping[str, NDArray]
) -> list[Colour]:
    """Give all that there is to colour by: weights, errors, the cloud's own colours."""
    colours = [Colour("weight", "weight", "L²", "squared radius of the ball around the point", scene.on_all(w))]
    if (error := _distances(scene, mesh, reference)) is not None:
        colours.append(error)
    return colours + own_colours(attributes, scene)


def _distances(scene: Scene, mesh: Mesh | None, reference: Any) -> Colour | None:
    """Distance of every place from the reference, negative inside a closed one, or from the mesh; None without either."""
    if reference is not None:
        truth = as_reference(reference)
        signed = ", negative inside" if truth.closed else ""
        away = truth.nearest(scene.places)[0]
        return Colour("error", "distance to reference", "L", f"distance to the reference{signed}", away)
    if mesh is None or len(mesh.faces) == 0:
        return None
    to_mesh = FaceQueries(mesh.vertices, mesh.faces).nearest(scene.points)[0]
    on_all = np.concatenate([to_mesh, np.zeros(len(scene.extra))])
    return Colour("error", "distance to mesh", "L", "distance of the points to the mesh", on_all)
