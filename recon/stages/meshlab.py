"""Weighted alpha shapes as a filter of PyMeshLab's, and a runner for MeshLab's filter scripts in which it may stand.

Importing this module gives ``pymeshlab.MeshSet`` the method ``generate_weighted_alpha_shape``. MeshLab's desktop program
cannot load filters written in Python: there, make the mesh with the command line (``recon reconstruct``) and open it.
"""

from __future__ import annotations

import importlib.util
import os
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput, ReconError, StageError, require, shown
from ..mesh import Mesh
from .attributes import doubles, others, refuse_other, unit_colors
from .mlx import CLEAN_UP, FILTER, PARAMETERS, FilterScript, filters, percentage, python_name

__all__ = ["CLEAN_UP", "FilterScript", "generate_weighted_alpha_shape", "register", "run_filter_script"]

_STOCK = threading.Lock()  # PyMeshLab's own filters crash the process where two threads run them


def generate_weighted_alpha_shape(mesh_set: Any, **parameters: Any) -> dict[str, Any]:
    """Make a mesh from the points of the current layer, as a new layer, which becomes the current one.

    Coordinates are those of the scene: the matrix of the layer is applied. Colour and quality come with their points,
    normals as the custom attribute "normals" (MeshLab computes those of a mesh from its faces), other custom attributes by
    name: PyMeshLab cannot list them.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    weights : {"Adaptive", "Uniform", "Radius attribute", "Quality"}
        Uniform: one `radius` for all points. Radius attribute, Quality: a radius [L] a point, in the custom scalar attribute
        named by `radiusattribute`, or in the quality.
    radius : pymeshlab.PercentageValue or pymeshlab.PureValue
        For uniform weights; 0, the default: the median distance between neighbours.
    alpha : float [L^2]
        Added to all weights.
    surface : {"Auto", "Closed", "Open", "Complex", "Terrain"}
    denoise : {"Auto", "Yes", "No"}
        Move the points to the local surface first; Auto: where they are noisy.
    clean : bool
        Split vertices where the surface touches itself.
    radiusattribute : str
        Carried over if it is there. Default "radius".
    attributes : str
        Names of further custom attributes to carry over, with commas between.
    threads : int
        0, the default: all.

    Returns
    -------
    dict
        What was done; see `recon.Report`.

    Raises
    ------
    InvalidInput
        No parameter of that name, a wrong value, no such attribute, a negative radius, no layer.
    DegenerateInput
        The points carry no surface.
    MissingDependency
        PyMeshLab is not installed.
    """
    from ..pipeline import reconstruct

    meshlab = require("pymeshlab", "meshlab")
    given = {key: _from_pymeshlab(meshlab, value) for key, value in parameters.items()}
    [(_, checked)] = FilterScript([(FILTER, given)]).filters
    values = {key: default for key, (_, default) in PARAMETERS.items()} | checked
    if values["threads"] < 0:
        raise InvalidInput(f"threads: expected 0 (all) or more, got {values['threads']}")
    _refuse_no_mesh_set(meshlab, mesh_set)
    if mesh_set.mesh_number() == 0:
        raise InvalidInput("mesh_set: has no layer")
    layer = mesh_set.current_mesh()
    if not layer.is_compact():
        layer.compact()
    points, attributes = _points(layer)
    custom = _custom(meshlab, layer, values)
    weights = _weights(layer, values, custom)
    result = reconstruct(
        points,
        weights,
        alpha=values["alpha"],
        surface=values["surface"].lower(),
        attributes=attributes | custom,
        clean=values["clean"],
        denoise={"Auto": None, "Yes": True, "No": False}[values["denoise"]],
        threads=values["threads"] or None,
    )
    try:
        mesh_set.add_mesh(to_pymeshlab(result.mesh), FILTER, True)
    except meshlab.PyMeshLabException as error:
        raise StageError(f"MeshLab did not take the mesh: {error}") from error
    return result.report.to_dict()


def run_filter_script(mesh_set: Any, script: FilterScript | str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Run a filter script, saved by MeshLab or made here, on the layers of a mesh set.

    The whole script is checked first; each filter then goes through PyMeshLab's own door, which refuses what MeshLab's
    runner of scripts skips. Parameters that are not in the script have their defaults for the mesh at hand.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    script : FilterScript or path
        `CLEAN_UP` is the path of one that is shipped.

    Returns
    -------
    list of dict
        What each filter had to say.

    Raises
    ------
    InvalidInput
        A wrong name or value in the script: nothing has run then.
    StageError
        A filter failed; the message names it, MeshLab's error is chained.
    """
    meshlab = require("pymeshlab", "meshlab")
    _refuse_no_mesh_set(meshlab, mesh_set)
    steps = script if isinstance(script, FilterScript) else FilterScript.read(script)
    known = set(meshlab.filter_list())
    for name, _ in steps.filters:
        if name != FILTER and filters()[name]["filter"] not in known:
            raise InvalidInput(f"no filter {name!r} in this version of PyMeshLab")
    answers = []
    for place, (name, parameters) in enumerate(steps.filters):
        entry = filters()[name]
        where = f"filter {place}, {name!r}"
        try:
            if name == FILTER:
                answers.append(generate_weighted_alpha_shape(mesh_set, **parameters))
                continue
            if mesh_set.mesh_number() == 0 and not entry["filter"].startswith("create_"):
                raise StageError("there is no layer")
            typed = {
                python_name(key): _to_pymeshlab(meshlab, entry["parameters"][key], value)
                for key, value in parameters.items()
            }
            with _STOCK:
                answers.append(mesh_set.apply_filter(entry["filter"], **typed) or {})
        except ReconError as error:
            error.args = (f"{where}: {error}",)
            raise
        except meshlab.PyMeshLabException as error:
            raise StageError(f"{where}: {' '.join(str(error).split())}") from error
    return answers


def register() -> None:
    """Give ``pymeshlab.MeshSet`` our filter as a method."""
    require("pymeshlab", "meshlab").MeshSet.generate_weighted_alpha_shape = generate_weighted_alpha_shape


def to_pymeshlab(mesh: Mesh) -> Any:
    """Give a mesh to PyMeshLab.

    Colours become bytes, as MeshLab keeps them, and ``"quality"`` the vertex scalar. Other attributes of one number or three a
    vertex become custom attributes: ``"normals"`` too, as MeshLab computes its own from the faces, and `vertex_source`
    where it is not 0 .. v-1.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    pymeshlab.Mesh

    Raises
    ------
    InvalidInput
        No vertices, or an attribute of another shape: MeshLab cannot hold them.
    """
    meshlab = require("pymeshlab", "meshlab")
    refuse_other(mesh, Mesh, "recon.Mesh")
    if len(mesh.vertices) == 0:
        raise InvalidInput("mesh: has no vertices, and MeshLab holds no such mesh")
    held: dict[str, NDArray] = {}
    if (quality := doubles(mesh, "quality", 1)) is not None:
        held["v_scalar_array"] = quality[:, 0]
    if "colors" in mesh.attributes:
        held["v_color_matrix"] = unit_colors(np.asarray(mesh.attributes["colors"]), 4)
    made = meshlab.Mesh(vertex_matrix=mesh.vertices, face_matrix=mesh.faces, **held)
    custom = others(mesh.attributes, "quality", "colors")
    if not np.array_equal(mesh.vertex_source, np.arange(len(mesh.vertices))):
        custom["vertex_source"] = mesh.vertex_source
    for name, values in custom.items():
        if values.dtype.kind not in "fiub":
            raise InvalidInput(f"attribute {name!r}: MeshLab holds numbers, got {values.dtype}")
        if values.size == len(mesh.vertices):
            made.add_vertex_custom_scalar_attribute(values.reshape(-1).astype(np.float64), name)
        elif values.shape == (len(mesh.vertices), 3):
            made.add_vertex_custom_point_attribute(values.astype(np.float64), name)
        else:
            raise InvalidInput(
                f"attribute {name!r}: MeshLab holds one number or three a vertex, got shape {values.shape}"
            )
    return made


def from_pymeshlab(mesh: Any, attributes: tuple[str, ...] = ()) -> Mesh:
    """Take a mesh from PyMeshLab, in the coordinates of the scene.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
    attributes : tuple of str
        Custom attributes to take along: PyMeshLab cannot list them; the normals of a cloud come anyway. ``"vertex_source"`` is taken where it is there.

    Returns
    -------
    Mesh
    """
    meshlab = require("pymeshlab", "meshlab")
    refuse_other(mesh, meshlab.Mesh, "pymeshlab.Mesh")
    if not isinstance(attributes, (tuple, list)) or not all(isinstance(name, str) for name in attributes):
        raise InvalidInput(f"attributes: expected names in a tuple, got {shown(attributes)}")
    if not mesh.is_compact():
        mesh.compact()
    points, held = _points(mesh)
    if mesh.face_number():
        held.pop("normals", None)  # computed from the faces
    custom = {name: _attribute(meshlab, mesh, name) for name in attributes}
    source = _attribute_or_none(meshlab, mesh, "vertex_source")
    return Mesh.from_arrays(points, mesh.face_matrix(), source, held | custom)


def _refuse_no_mesh_set(meshlab: Any, mesh_set: Any) -> None:
    if not isinstance(mesh_set, meshlab.MeshSet):
        raise InvalidInput(f"mesh_set: expected a pymeshlab.MeshSet, got {type(mesh_set).__name__}")


def _points(layer: Any) -> tuple[NDArray[np.float64], dict[str, NDArray]]:
    """Coordinates in the scene, and the attributes that have a place of their own."""
    matrix = np.asarray(layer.transform_matrix())
    moved = not np.array_equal(matrix, np.eye(4))
    points = np.array(layer.transformed_vertex_matrix() if moved else layer.vertex_matrix())
    attributes: dict[str, NDArray] = {}
    if layer.has_vertex_color():
        attributes["colors"] = np.round(np.array(layer.vertex_color_matrix()) * 255).astype(np.uint8)
    quality = np.array(layer.vertex_scalar_array()) if layer.has_vertex_scalar() else np.zeros(0)
    if quality.any():  # it is there, and zero, in every mesh
        attributes["quality"] = quality
    normals = np.array(layer.vertex_normal_matrix())
    if normals.any():
        attributes["normals"] = normals @ np.linalg.inv(matrix[:3, :3]) if moved else normals
    return points, attributes


def _custom(meshlab: Any, layer: Any, values: dict[str, Any]) -> dict[str, NDArray]:
    """Custom attributes: the radius where it is there, and those asked for."""
    found = {}
    radius = _attribute_or_none(meshlab, layer, values["radiusattribute"])
    if radius is not None:
        found[values["radiusattribute"]] = radius
    for name in filter(None, map(str.strip, values["attributes"].split(","))):
        found[name] = _attribute(meshlab, layer, name)
    return found


def _attribute(meshlab: Any, layer: Any, name: str) -> NDArray[np.float64]:
    values = _attribute_or_none(meshlab, layer, name)
    if values is None:
        raise InvalidInput(f"the layer has no custom vertex attribute {name!r}")
    return values


def _attribute_or_none(meshlab: Any, layer: Any, name: str) -> NDArray[np.float64] | None:
    for read in (layer.vertex_custom_scalar_attribute_array, layer.vertex_custom_point_attribute_matrix):
        try:
            return np.array(read(name))
        except meshlab.PyMeshLabException:
            continue  # PyMeshLab says by an exception that there is none
    return None


def _weights(layer: Any, values: dict[str, Any], custom: dict[str, NDArray]) -> Any:
    """Weights as `recon.reconstruct` takes them."""
    kind = values["weights"]
    if kind == "Adaptive":
        return "adaptive"
    if kind == "Uniform":
        length = values["radius"]
        if isinstance(length, str):
            length = percentage(length, "radius") / 100 * layer.bounding_box().diagonal()
        if length < 0:
            raise InvalidInput(f"radius: expected a non-negative length, got {length}")
        return np.full(layer.vertex_number(), length * length) if length else "uniform"
    if kind == "Quality":
        if not layer.has_vertex_scalar():
            raise InvalidInput("weights: the layer has no quality")
        radius = np.array(layer.vertex_scalar_array())
    elif values["radiusattribute"] in custom:
        radius = custom[values["radiusattribute"]]
    else:
        raise InvalidInput(f"weights: the layer has no custom vertex attribute {values['radiusattribute']!r}")
    if radius.ndim != 1:
        raise InvalidInput(f"weights: expected one radius a point, got shape {radius.shape}")
    wrong = np.flatnonzero(~(radius >= 0))
    if len(wrong):
        raise InvalidInput(f"weights: the radius of point {wrong[0]} is no length: {radius[wrong[0]]}")
    return radius**2


def _from_pymeshlab(meshlab: Any, value: Any) -> Any:
    """Give PyMeshLab's own value types in ours."""
    if isinstance(value, meshlab.PercentageValue):
        return f"{value.value()!r}%"
    return value.value() if isinstance(value, meshlab.PureValue) else value


def _to_pymeshlab(meshlab: Any, kind: str | list[str], value: Any) -> Any:
    """Give a checked value in PyMeshLab's own type."""
    if isinstance(kind, list):
        return kind.index(value)
    if kind == "RichAbsPerc":
        percent = isinstance(value, str)
        return meshlab.PercentageValue(percentage(value, kind)) if percent else meshlab.PureValue(value)
    if kind == "RichColor":
        return meshlab.Color(*map(int, value))
    if kind in ("RichPosition", "RichDirection"):
        return np.array(value)
    return np.array(value).reshape(4, 4) if kind == "RichMatrix44f" else value


if importlib.util.find_spec("pymeshlab") is not None:
    register()
