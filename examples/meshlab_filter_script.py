"""A MeshLab filter script with our filter among stock ones, written, read and run on a cloud.

Usage: python meshlab_filter_script.py [CLOUD [MESH]]. Needs the extra "meshlab". MeshLab's desktop program cannot load filters
written in Python: see meshlab_desktop.py for that.
"""

import sys

import pymeshlab

import datasets_synthetic
from recon.stages.meshlab import CLEAN_UP, FilterScript, run_filter_script

meshes = pymeshlab.MeshSet(verbose=False)
if len(sys.argv) > 1:
    meshes.load_new_mesh(sys.argv[1])
else:  # nothing given: a torus, 8,000 points, no normals
    meshes.add_mesh(pymeshlab.Mesh(datasets_synthetic.surface("torus").sample(8000, rng=0).points), "torus")

FilterScript(
    [
        ("Remove Duplicate Vertices", {}),
        ("Weighted Alpha Shape", {"surface": "Auto"}),
        ("Simplification: Quadric Edge Collapse Decimation", {"TargetFaceNum": 4000, "PreserveTopology": True}),
    ]
).write("reconstruct.mlx")
run_filter_script(meshes, "reconstruct.mlx")
run_filter_script(meshes, CLEAN_UP)

measures = meshes.get_topological_measures()
print(f"{measures['faces_number']} triangles, 2-manifold: {measures['is_mesh_two_manifold']},", end=" ")
print(f"genus {measures['genus']}, {measures['boundary_edges']} open edges")
meshes.save_current_mesh(sys.argv[2] if len(sys.argv) > 2 else "mesh.ply")
