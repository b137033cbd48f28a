"""The contenders: every way from points to a mesh that is compared, each a generator of meshes of which the best is counted.

All get the points alone. Where one must be told a radius, it gets ten, from one to eight median distances to the nearest
neighbour; where it must be told normals, they are estimated from 15 neighbours and oriented by its own library.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import recon
import weighting

Array = NDArray[np.float64]
FACTORS = np.geomspace(1.0, 8.0, 10)  # radii to try, in median distances to the nearest neighbour
NORMAL = 15  # neighbours that give a normal
DEPTH = 8  # of the octree of Poisson reconstruction
PLACE = 1e-6  # of the extent: a vertex that is nearer than this to a point is that point


class Contender(NamedTuple):
    """One way from points to a mesh.

    Attributes
    ----------
    package : str
        What must be installed for it.
    interpolates : bool
        Its vertices are meant to be the points; others are excused from using them.
    closes : bool
        It can give nothing but closed surfaces, and is not tried on open ones.
    run : callable
        (points (n, 3) [L], median distance to the nearest neighbour [L]) -> meshes.
    """

    package: str
    interpolates: bool
    closes: bool
    run: Callable[[Array, float], Iterator[recon.Mesh]]


def nearest(points: Array) -> float:
    """Median distance to the nearest neighbour [L]."""
    return float(np.median(cKDTree(points).query(points, 2)[0][:, 1]))


def ours(**options: Any) -> Callable[[Array, float], Iterator[recon.Reconstruction]]:
    """`recon.reconstruct`; the whole of what it gives, since it says more than its mesh."""

    def run(points: Array, near: float) -> Iterator[recon.Reconstruction]:
        yield recon.reconstruct(points, **options)

    return run


def closing(points: Array, near: float) -> Iterator[recon.Mesh]:
    """The boundary of W_0 under closing weights: nothing but weights decides what the surface is."""
    yield boundary(points, weighting.closing_weights(points))


def covering(points: Array, near: float) -> Iterator[recon.Mesh]:
    """The same under covering weights."""
    yield boundary(points, weighting.closure(points, weighting.adaptive_weights(points, radius="covering")))


def uniform(points: Array, near: float) -> Iterator[recon.Mesh]:
    """The same under ten uniform weights."""
    for factor in FACTORS:
        yield boundary(points, weighting.closure(points, np.full(len(points), (factor * near) ** 2)))


def adaptive(radius: str) -> Callable[[Array, float], Iterator[recon.Mesh]]:
    """The same under adaptive weights, their median ten radii: as much told as `uniform` is."""

    def run(points: Array, near: float) -> Iterator[recon.Mesh]:
        weights = weighting.adaptive_weights(points, radius=radius)
        for factor in FACTORS:
            yield boundary(points, weighting.closure(points, weights * (factor * near) ** 2 / np.median(weights)))

    return run


def boundary(points: Array, found: weighting.Closure) -> recon.Mesh:
    """What weights reach, turned to face outward as far as it can be; they say nothing of sides themselves."""
    return recon.Mesh.from_arrays(points, outward(points, found.faces))


def outward(points: Array, faces: NDArray) -> NDArray:
    """Faces turned to agree with their neighbours; patches inside of an odd number of others inward, the rest outward."""
    from recon.proximity import FaceQueries
    from recon.topology import agreeing, patches

    faces = agreeing(faces)
    if len(faces) == 0:
        return faces
    patch = patches(faces)
    a, b, c = np.moveaxis((points - points.mean(axis=0))[faces], 1, 0)
    volume = np.bincount(patch, np.einsum("ij,ij->i", a, np.cross(b, c)))
    faces = np.where(volume[patch][:, None] < 0, faces[:, ::-1], faces)
    inside = np.zeros(len(volume), np.int64)
    for other in range(len(volume) if len(volume) > 1 else 0):
        first = points[faces[np.unique(patch, return_index=True)[1], 0]]
        inside += (FaceQueries(points, faces[patch == other]).winding(first) == 1) & (np.arange(len(volume)) != other)
    return np.where(inside[patch][:, None] % 2 == 1, faces[:, ::-1], faces)


def one_spacing(points: Array, near: float) -> Iterator[recon.Mesh]:
    """The steps of `recon.reconstruct` where nothing knows of local density: equal weights, and one spacing for all, of four."""
    from recon.mesh import compact_mesh
    from recon.postprocess import remove_islands, split_pinches
    from recon.surface import label_surface

    triangulation = recon.regular_triangulation(points)
    for factor in FACTORS[::3]:
        spacing = np.full(len(points), factor * near)
        found = label_surface(triangulation, spacing)
        if found.kind == "terrain":  # has no facets in space
            found = label_surface(triangulation, spacing, "sheets")
        yield remove_islands(split_pinches(compact_mesh(points, found.faces))[0])[0]


def identified(points: Array, vertices: Array, faces: NDArray) -> recon.Mesh:
    """A mesh whose vertices name the input row in the same place, where there is one."""
    if len(faces) == 0:
        return recon.Mesh.from_arrays(np.zeros((0, 3)), faces)
    distance, row = cKDTree(points).query(vertices)
    return recon.Mesh.from_arrays(vertices, faces, np.where(distance <= PLACE * np.ptp(points), row, -1))


def open3d_cloud(points: Array, *, normals: bool) -> Any:
    """A cloud of Open3D's; normals estimated and oriented as its documentation advises."""
    import open3d as o3d

    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    if normals:
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NORMAL))
        cloud.orient_normals_consistent_tangent_plane(NORMAL)
    return cloud


def from_open3d(points: Array, mesh: Any) -> recon.Mesh:
    return identified(points, np.asarray(mesh.vertices), np.asarray(mesh.triangles))


def open3d_poisson(points: Array, near: float) -> Iterator[recon.Mesh]:
    from open3d.geometry import TriangleMesh

    cloud = open3d_cloud(points, normals=True)
    yield from_open3d(points, TriangleMesh.create_from_point_cloud_poisson(cloud, depth=DEPTH)[0])


def open3d_pivoting(points: Array, near: float) -> Iterator[recon.Mesh]:
    """Ball pivoting with four radii at once."""
    import open3d as o3d

    cloud = open3d_cloud(points, normals=True)
    radii = o3d.utility.DoubleVector([near * factor for factor in (1, 2, 3, 4)])
    yield from_open3d(points, o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii))


def open3d_alpha(points: Array, near: float) -> Iterator[recon.Mesh]:
    from open3d.geometry import TetraMesh, TriangleMesh

    cloud = open3d_cloud(points, normals=False)
    cells, rows = TetraMesh.create_from_point_cloud(cloud)
    for factor in FACTORS:
        yield from_open3d(points, TriangleMesh.create_from_point_cloud_alpha_shape(cloud, near * factor, cells, rows))


def meshlab(points: Array, *steps: tuple[str, dict[str, Any]], faces: NDArray | None = None) -> recon.Mesh:
    """Run filters of MeshLab on a cloud, or on faces; vertices of the result that are points are known by their place."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points) if faces is None else pymeshlab.Mesh(points, faces))
    for name, options in steps:
        meshes.apply_filter(name, **options)
    made = meshes.current_mesh()
    return identified(points, made.vertex_matrix(), made.face_matrix())


def meshlab_poisson(points: Array, near: float) -> Iterator[recon.Mesh]:
    yield meshlab(
        points,
        ("compute_normal_for_point_clouds", {"k": NORMAL}),
        ("generate_surface_reconstruction_screened_poisson", {"depth": DEPTH, "threads": 1}),
    )


def meshlab_pivoting(points: Array, near: float) -> Iterator[recon.Mesh]:
    """Ball pivoting, which guesses its radius."""
    yield meshlab(points, ("generate_surface_reconstruction_ball_pivoting", {}))


def meshlab_alpha(points: Array, near: float) -> Iterator[recon.Mesh]:
    import pymeshlab

    for factor in FACTORS:
        radius = pymeshlab.PureValue(factor * near)
        yield meshlab(points, ("generate_alpha_shape", {"alpha": radius, "filtering": "Alpha Shape"}))


def meshlab_wrap(points: Array, near: float) -> Iterator[recon.Mesh]:
    """Alpha wrap of four radii, its offset a thirtieth of them, as CGAL advises.

    The filter of MeshLab 2025.7 crashes on points alone, so each point is given as a triangle a thousand times smaller than
    the distance to its neighbours.
    """
    import pymeshlab

    n = len(points)
    corners = np.concatenate([points + 1e-3 * near * step for step in np.eye(3)])
    faces = np.arange(3 * n, dtype=np.int32).reshape(3, n).T
    for factor in FACTORS[::3]:
        lengths = {"alpha": pymeshlab.PureValue(factor * near), "offset": pymeshlab.PureValue(factor * near / 30)}
        yield meshlab(corners, ("generate_alpha_wrap", lengths), faces=faces)


RECON = "recon"
WEIGHTS = {  # adaptive weights against uniform ones, in the same programs
    "recon, uniform weights": Contender("recon", True, False, ours(weights="uniform")),
    "recon, one spacing, best of 4": Contender("recon", True, False, one_spacing),
    "W_0, closing weights": Contender("recon", True, True, closing),
    "W_0, covering weights": Contender("recon", True, True, covering),
    "W_0, best of 10 spacing": Contender("recon", True, True, adaptive("spacing")),
    "W_0, best of 10 covering": Contender("recon", True, True, adaptive("covering")),
    "W_0, best of 10 uniform": Contender("recon", True, True, uniform),
}
PEERS = {
    "Open3D Poisson": Contender("open3d", False, False, open3d_poisson),
    "Open3D ball pivoting": Contender("open3d", True, False, open3d_pivoting),
    "Open3D alpha shape, best of 10": Contender("open3d", True, False, open3d_alpha),
    "MeshLab Poisson": Contender("pymeshlab", False, False, meshlab_poisson),
    "MeshLab ball pivoting": Contender("pymeshlab", True, False, meshlab_pivoting),
    "MeshLab alpha shape, best of 10": Contender("pymeshlab", True, False, meshlab_alpha),
    "MeshLab alpha wrap, best of 4": Contender("pymeshlab", False, True, meshlab_wrap),
}
CONTENDERS = {RECON: Contender("recon", True, False, ours()), **WEIGHTS, **PEERS}
