"""Ask MeshLab for its filters: ``python -m recon.stages.meshlab_survey meshlab_filters.json`` writes the table that scripts are checked by.

PyMeshLab knows a filter by another name than MeshLab's scripts do, and tells MeshLab's names only of what it has applied. So
every filter is applied once, mostly with its defaults, to scratch meshes, each in a process of its own, as some crash. What
fails on all of them is not in the table; its names are printed on stderr. In PyMeshLab 2025.07 these are 27 of 281: the filters
that draw or compare with rasters (14: they end the process where there is no graphics card), those that take a camera from the file (3),
that follow an abstract parametrization (3), both MLS projections, the mesh by grammar and the atlas defragmentation, which crash,
two volumetric samplings, which do not come to an end, and the upload, which is not tried.
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
SCENES = ("plain", "rich", "cloud", "ball", "grid", "textured", "pair", "raster", "moved")
_PICTURE = bytes.fromhex(  # a PNG of one pixel
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c49444154789c636868680000030401814bd3d2100000000049454e44ae426082"
)
_ARGUMENTS: dict[str, dict[str, Any]] = {  # where the defaults fail, or take too long
    "apply_coord_craters_from_point_cloud": {"target_mesh": 0, "samples_mesh": 1},
    "apply_coord_point_cloud_movement_over_mesh": {"target_mesh": 0, "point_cloud": 1},
    "apply_coord_directional_preservation": {"attr_name": "before"},
    "compute_texmap_from_color": {"textname": "out.png", "textw": 64, "texth": 64},
    "nxs_build": {"input_file": "mesh.ply", "output_file": "mesh.nxs"},
    "nxs_compress": {"input_file": "mesh.nxs", "output_file": "mesh.nxz"},
    "set_raster_name": {"newname": "raster"},
    "set_texture_per_mesh": {"textname": "texture.png", "use_dummy_texture": True},
    "transfer_attributes_to_texture_per_vertex": {"sourcemesh": 0, "targetmesh": 1, "textname": "out.png"},
    "transfer_texture_to_color_per_vertex": {"sourcemesh": 0, "targetmesh": 1},
}


def survey() -> dict[str, dict[str, Any]]:
    """Give MeshLab's name -> PyMeshLab's name and the types of the parameters; of an enumeration its values."""
    meshlab = require("pymeshlab", "meshlab")
    found: dict[str, dict[str, Any]] = {}
    for name in meshlab.filter_list():
        if name in EXCLUDED:
            continue
        for scene in SCENES:
            element = _isolated(name, scene)
            if element is not None:
                found[element.attrib["name"]] = {
                    "filter": name,
                    "parameters": {parameter.get("name"): _type(parameter.attrib) for parameter in element},
                }
                break
        else:
            print(name, file=sys.stderr)
    return {name: found[name] for name in sorted(found)}


def _type(attributes: dict[str, str]) -> str | list[str]:
    if attributes["type"] != "RichEnum":
        return attributes["type"]
    return [attributes[f"enum_val{i}"] for i in range(int(attributes["enum_cardinality"]))]


def _isolated(name: str, scene: str) -> ElementTree.Element | None:
    """Apply one filter in a new process; its element of the saved script, or None."""
    context = multiprocessing.get_context("spawn")
    answers: Any = context.Queue()
    process = context.Process(target=_apply, args=(name, scene, answers))
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


def _apply(name: str, scene: str, answers: Any) -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    meshlab = require("pymeshlab", "meshlab")
    os.chdir(tempfile.mkdtemp())
    meshes = meshlab.MeshSet()
    try:
        _prepare(meshlab, meshes, scene, name)
        meshes.clear_filter_script()
        meshes.apply_filter(name, **_ARGUMENTS.get(name, {}))
    except meshlab.PyMeshLabException:
        return
    meshes.save_filter_script("applied.mlx")
    with open("applied.mlx", encoding="utf-8") as file:
        answers.put(file.read())


def _prepare(meshlab: Any, meshes: Any, scene: str, name: str) -> None:
    """Make the layers that a filter is tried on."""
    match scene:
        case "plain":
            meshes.create_cube()
            meshes.create_sphere()
            meshes.set_selection_all()
        case "rich":
            for _ in range(2):
                meshes.create_sphere()
                meshes.compute_scalar_by_border_distance_per_vertex()
                meshes.compute_color_by_function_per_vertex()
                meshes.compute_color_by_function_per_face()
                meshes.compute_scalar_by_function_per_face()
                meshes.compute_texcoord_by_function_per_vertex()
                meshes.compute_texcoord_by_function_per_wedge()
        case "cloud":
            meshes.create_sphere_points()
            meshes.create_sphere_points()
        case "ball" | "moved":
            meshes.create_sphere(subdiv=3)
            if scene == "moved":
                layer = meshes.current_mesh()
                layer.add_vertex_custom_point_attribute(layer.vertex_matrix(), "before")
            meshes.save_current_mesh("mesh.ply")
            if name == "nxs_compress":
                meshes.nxs_build(input_file="mesh.ply", output_file="mesh.nxs")
        case "grid" | "textured":
            for _ in range(2):
                meshes.create_grid(numvertx=12, numverty=12)
                if scene == "textured":
                    meshes.compute_texcoord_by_function_per_vertex()
                    meshes.compute_texcoord_transfer_vertex_to_wedge()
                    meshes.compute_color_by_function_per_vertex()
                    meshes.set_texture_per_mesh(textname="texture.png", use_dummy_texture=True)
        case "pair":
            meshes.create_sphere(subdiv=2)
            points = meshes.current_mesh().vertex_matrix()
            meshes.add_mesh(meshlab.Mesh(points, v_normals_matrix=points))
        case "raster":
            meshes.create_sphere()
            with open("picture.png", "wb") as file:
                file.write(_PICTURE)
            meshes.load_new_raster(os.path.abspath("picture.png"))


if __name__ == "__main__":
    lines = [
        f" {json.dumps(name, ensure_ascii=False)}: {json.dumps(entry, ensure_ascii=False)}"
        for name, entry in survey().items()
    ]
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("{\n" + ",\n".join(lines) + "\n}\n")
