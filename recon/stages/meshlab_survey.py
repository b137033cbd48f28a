"""Ask MeshLab for its filters: ``python -m recon.stages.meshlab_survey meshlab_filters.json`` writes the table that scripts are checked by.

PyMeshLab knows a filter by another name than MeshLab's scripts do, and tells MeshLab's names only of what it has applied. So
every filter is applied once, with its defaults, to a scratch mesh, each in a process of its own: some crash, some need a
window, a raster or a camera. Those are not in the table.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import queue
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from typing import Any

from ..contracts import require

SECONDS = 20  # for one filter
EXCLUDED = {"export_mesh_to_sketchfab"}  # goes out to the network


def survey() -> dict[str, dict[str, Any]]:
    """Give MeshLab's name -> PyMeshLab's name and the types of the parameters; of an enumeration its values."""
    meshlab = require("pymeshlab", "meshlab")
    found: dict[str, dict[str, Any]] = {}
    for name in meshlab.filter_list():
        if name in EXCLUDED:
            continue
        for preparation in ("plain", "rich", "cloud"):
            element = _isolated(name, preparation)
            if element is not None:
                found[element.attrib["name"]] = {
                    "filter": name,
                    "parameters": {parameter.get("name"): _type(parameter.attrib) for parameter in element},
                }
                break
    return {name: found[name] for name in sorted(found)}


def _type(attributes: dict[str, str]) -> str | list[str]:
    if attributes["type"] != "RichEnum":
        return attributes["type"]
    return [attributes[f"enum_val{i}"] for i in range(int(attributes["enum_cardinality"]))]


def _isolated(name: str, preparation: str) -> ElementTree.Element | None:
    """Apply one filter in a new process; its element of the saved script, or None."""
    context = multiprocessing.get_context("spawn")
    answers: Any = context.Queue()
    process = context.Process(target=_apply, args=(name, preparation, answers))
    process.start()
    text = None
    for _ in range(10 * SECONDS):
        try:
            text = answers.get(timeout=0.1)
            break
        except queue.Empty:
            if not process.is_alive():
                break
    process.kill()
    process.join()
    return None if text is None else ElementTree.fromstring(text).find("filter")


def _apply(name: str, preparation: str, answers: Any) -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    meshlab = require("pymeshlab", "meshlab")
    os.chdir(tempfile.mkdtemp())
    meshes = meshlab.MeshSet()
    if preparation == "plain":
        meshes.create_cube()
        meshes.create_sphere()
        meshes.set_selection_all()
    elif preparation == "rich":
        for _ in range(2):
            meshes.create_sphere()
            meshes.compute_scalar_by_border_distance_per_vertex()
            meshes.compute_color_by_function_per_vertex()
            meshes.compute_color_by_function_per_face()
            meshes.compute_scalar_by_function_per_face()
            meshes.compute_texcoord_by_function_per_vertex()
            meshes.compute_texcoord_by_function_per_wedge()
    else:
        meshes.create_sphere_points()
        meshes.create_sphere_points()
    meshes.clear_filter_script()
    try:
        meshes.apply_filter(name)
    except meshlab.PyMeshLabException:
        return
    meshes.save_filter_script("applied.mlx")
    with open("applied.mlx", encoding="utf-8") as file:
        answers.put(file.read())


if __name__ == "__main__":
    lines = [
        f" {json.dumps(name, ensure_ascii=False)}: {json.dumps(entry, ensure_ascii=False)}"
        for name, entry in survey().items()
    ]
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("{\n" + ",\n".join(lines) + "\n}\n")
