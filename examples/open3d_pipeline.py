"""One stage among Open3D's own. Usage: python open3d_pipeline.py [CLOUD [MESH]]. Needs the extra "open3d"."""

import sys

import open3d as o3d

import datasets_synthetic
from recon.stages.open3d import Pipeline, Step, WeightedAlphaShape

if len(sys.argv) > 1:
    cloud = o3d.io.read_point_cloud(sys.argv[1])
else:  # nothing given: a torus, 8,000 points, no normals
    points = datasets_synthetic.surface("torus").sample(8000, rng=0).points
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.copy()))

extent = cloud.get_axis_aligned_bounding_box().get_max_extent()
run = Pipeline(
    Step("voxel_down_sample", voxel_size=0.005 * extent),
    Step("remove_statistical_outlier", nb_neighbors=20, std_ratio=4.0),
    WeightedAlphaShape(),
    Step("simplify_quadric_decimation", target_number_of_triangles=4000),
)
mesh = run(cloud)
mesh.compute_vertex_normals()
print(mesh, f"watertight: {mesh.is_watertight()}", f"edge manifold: {mesh.is_edge_manifold()}", sep=", ")
o3d.io.write_triangle_mesh(sys.argv[2] if len(sys.argv) > 2 else "mesh.ply", mesh)
