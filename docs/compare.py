"""Compare with other tools on surfaces whose truth is known: the tables of docs/comparison.md.

Usage: python docs/compare.py ["TOOL" ...]. Needs the extras "open3d" and "meshlab"; takes some minutes. Every tool gets the points
alone. Where a tool must be told a radius, it gets ten, and the one that does best is counted, chosen with the truth in hand.
"""

import sys
import time

import numpy as np
import open3d as o3d
import pymeshlab
from scipy.spatial import cKDTree

import datasets_synthetic
import recon

POINTS = 3000
CLOUDS = {
    "random": {},
    "density 10 : 1": {"density": 10.0},
    "noise 0.1": {"noise": 0.1},  # in median distances to the nearest neighbour, see `clouds`
    "noise 0.5": {"noise": 0.5},
}
FACTORS = np.geomspace(1.0, 8.0, 10)  # radii to try, in median distances to the nearest neighbour
SAMPLES = 20_000
O3D = o3d.geometry


def clouds(kind):
    """Yield name, truth, points and their median distance to the nearest neighbour of every closed surface."""
    for name in datasets_synthetic.surfaces(3, closed=True):
        truth = datasets_synthetic.surface(name)
        options = dict(CLOUDS[kind])
        points = truth.sample(POINTS, rng=0, **{key: value for key, value in options.items() if key != "noise"}).points
        near = nearest(points)
        if "noise" in options:
            points = truth.sample(POINTS, noise=options["noise"] * near, rng=0).points
        yield name, truth, np.array(points), near


def nearest(points):
    """Give the median distance to the nearest neighbour [L]."""
    return float(np.median(cKDTree(points).query(points, 2)[0][:, 1]))


def ours(points, near):
    """Reconstruct with no parameter."""
    yield recon.reconstruct(points).mesh


def with_normals(points):
    """Give a cloud of Open3D's with normals estimated and oriented as its documentation advises."""
    cloud = O3D.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(O3D.KDTreeSearchParamKNN(15))
    cloud.orient_normals_consistent_tangent_plane(15)
    return cloud


def from_open3d(mesh, points):
    """Take a mesh of Open3D's; vertices that are input points are known by their place."""
    return identified(np.asarray(mesh.vertices), np.asarray(mesh.triangles), points)


def identified(vertices, faces, points):
    """Make a mesh whose vertices name the input row in the same place, if there is one."""
    if len(faces) == 0:
        return None
    distance, row = cKDTree(points).query(vertices)
    return recon.Mesh.from_arrays(vertices, faces, np.where(distance <= 1e-6 * np.ptp(points), row, -1))


def poisson(points, near):
    """Screened Poisson reconstruction of Open3D, depth 8."""
    mesh, _ = O3D.TriangleMesh.create_from_point_cloud_poisson(with_normals(points), depth=8)
    yield from_open3d(mesh, points)


def ball_pivoting(points, near):
    """Ball pivoting of Open3D with four radii at once."""
    radii = o3d.utility.DoubleVector([near * factor for factor in (1, 2, 3, 4)])
    yield from_open3d(O3D.TriangleMesh.create_from_point_cloud_ball_pivoting(with_normals(points), radii), points)


def open3d_alpha(points, near):
    """Alpha shapes of Open3D for ten radii."""
    cloud = O3D.PointCloud(o3d.utility.Vector3dVector(points))
    tetrahedra, rows = O3D.TetraMesh.create_from_point_cloud(cloud)
    for factor in FACTORS:
        mesh = O3D.TriangleMesh.create_from_point_cloud_alpha_shape(cloud, near * factor, tetrahedra, rows)
        yield from_open3d(mesh, points)


def meshlab_alpha(points, near):
    """Alpha shapes of MeshLab for ten radii."""
    for factor in FACTORS:
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(points))
        meshes.generate_alpha_shape(alpha=pymeshlab.PureValue(near * factor), filtering="Alpha Shape")
        made = meshes.current_mesh()
        yield identified(made.vertex_matrix(), made.face_matrix(), points)


def meshlab_pivoting(points, near):
    """Ball pivoting of MeshLab, which guesses its radius."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points))
    meshes.generate_surface_reconstruction_ball_pivoting()
    made = meshes.current_mesh()
    yield identified(made.vertex_matrix(), made.face_matrix(), points)


TOOLS = {
    "recon": ours,
    "Open3D Poisson": poisson,
    "Open3D ball pivoting": ball_pivoting,
    "MeshLab ball pivoting": meshlab_pivoting,
    "Open3D alpha shape, best of 10": open3d_alpha,
    "MeshLab alpha shape, best of 10": meshlab_alpha,
}


def judge(mesh, truth, near, interpolates):
    """Give what of a mesh counts: solved or not, and why."""
    if mesh is None:
        return {"solved": False, "closed": False, "chi": False, "error": np.inf}
    found = {metric.name: metric.value for metric in recon.measure(mesh, truth, points=POINTS, samples=SAMPLES)}
    error = max(found["to_reference_mean"], found["from_reference_mean"]) / near
    closed = found["closed"] and found["manifold"]
    chi = found["euler_error"] == 0
    used = not interpolates or found["points_used"] > 0.99
    return {"solved": closed and chi and used and error < 0.25, "closed": closed, "chi": chi, "error": error}


def main(names):
    """Run the tools named, or all, on all clouds, and print the table: solved, closed manifolds, error; CPU seconds."""
    next(ours(datasets_synthetic.surface("sphere").sample(500, rng=0).points, 0.0))  # compiles, if need be
    cases = {kind: list(clouds(kind)) for kind in CLOUDS}
    print("| tool |", " | ".join(CLOUDS), "| CPU s |")
    print("|" + "---|" * (len(CLOUDS) + 2))
    for tool in names or TOOLS:
        cells, spent, meshes = [], 0.0, 0
        for kind in CLOUDS:
            best = []
            for name, truth, points, near in cases[kind]:
                begin, made = time.process_time(), []
                try:
                    made.extend(TOOLS[tool](points, near))
                except (RuntimeError, pymeshlab.PyMeshLabException, recon.ReconError) as error:
                    print(f"{kind}: {tool}: {name}: {error}", file=sys.stderr)
                spent, meshes = spent + time.process_time() - begin, meshes + max(len(made), 1)
                results = [judge(mesh, truth, near, tool != "Open3D Poisson") for mesh in made or [None]]
                best.append(max(results, key=lambda r: (r["solved"], -r["error"])))
                print(f"{kind}: {tool}: {name}: {best[-1]}", file=sys.stderr, flush=True)
            solved, closed = (sum(bool(result[key]) for result in best) for key in ("solved", "closed"))
            cells.append(f"**{solved}**, {closed}, {np.median([result['error'] for result in best]):.2f}")
        print(f"| {tool} |", " | ".join(cells), f"| {spent / meshes:.2f} |", flush=True)


if __name__ == "__main__":
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    main(sys.argv[1:])
