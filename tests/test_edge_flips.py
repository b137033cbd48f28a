"""Edges of the surface that are flipped so that it bends less."""

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon._kernels.edge_flips import SLIGHT
from recon._kernels.energy import RADIUS_CAP, WALL
from recon.surface import label_surface
from recon.topology import topology

SHAPES = (
    "box",
    "cylinder",
    "trefoil",
    "nested_spheres",
    "csg_part",
    "thin_plate",
    "swiss_roll",
    "mobius_band",
    "wavy_sheet",
)


def with_and_without(points: np.ndarray, kind: str = "auto", factor: float = 1.0) -> tuple:
    spacing = weighting.spacing(points * factor)
    triangulation = recon.regular_triangulation(points * factor, spacing**2)
    return [label_surface(triangulation, spacing, kind, flips=flips) for flips in (True, False)]


def energy(points: np.ndarray, faces: np.ndarray) -> float:
    """Of edges and facets, from its definition alone; faces of a patch agree."""
    spacing = weighting.spacing(points)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    cross = np.cross(b - a, c - a)
    twice = np.linalg.norm(cross, axis=1)
    sides = np.prod([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    radius = np.minimum(sides / (2 * twice * spacing[faces].mean(axis=1)), RADIUS_CAP)
    normal = cross / twice[:, None]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    pair = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    (u, v), apart = edges[pair].T, np.linalg.norm(normal[owner[pair]] - normal[owner[pair + 1]], axis=1)
    bends = apart * np.linalg.norm(points[u] - points[v], axis=1) / (0.5 * (spacing[u] + spacing[v]))
    return float(bends.sum() + WALL * (radius**2).sum())


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("density", (1.0, 10.0))
def test_topology_and_vertices_stay_and_the_surface_bends_less(name, density):
    shape = datasets_synthetic.surface(name)
    points = shape.sample(1500, rng=1, density=density).points
    flipped, plain = with_and_without(points, "closed" if shape.boundary_loops == 0 else "open")
    now, before = topology(flipped.faces), topology(plain.faces)
    for what in ("vertices", "edges", "faces", "euler", "components", "boundary_loops", "nonmanifold_edges"):
        assert getattr(now, what) == getattr(before, what), what
    assert (np.unique(flipped.faces) == np.unique(plain.faces)).all()
    assert flipped.kind == plain.kind
    assert plain.flipped_edges == 0 < flipped.flipped_edges
    if shape.orientable and now.manifold:
        gain = energy(points, plain.faces) - energy(points, flipped.faces)
        assert gain > SLIGHT * flipped.flipped_edges / 3


@pytest.mark.parametrize("name", ("box", "cylinder", "cone_frustum", "csg_part", "trefoil"))
def test_creases_and_bends_come_out_closer(name):
    shape = datasets_synthetic.surface(name)
    points = shape.sample(3000, rng=0).points

    def off(faces: np.ndarray) -> float:
        mesh = recon.Mesh.from_arrays(points, faces)
        found = {metric.name: metric.value for metric in recon.measure(mesh, shape, samples=20_000)}
        assert found["self_intersections"] == 0
        return max(found["to_reference_mean"], found["from_reference_mean"])

    flipped, plain = with_and_without(points, "closed")
    assert off(flipped.faces) < 0.75 * off(plain.faces)


def test_a_square_grid_has_nothing_to_flip():
    """Both diagonals of a square are alike, and where all is flat and round nothing is gained."""
    side = np.arange(12.0)
    cube = np.array([p for p in np.stack(np.meshgrid(side, side, side), -1).reshape(-1, 3) if (p % 11 == 0).any()])
    assert with_and_without(cube, "closed")[0].flipped_edges == 0


def test_scale_order_and_threads_change_nothing():
    points = datasets_synthetic.surface("csg_part").sample(6000, rng=3).points
    faces = with_and_without(points)[0].faces
    for factor in (2.0**-40, 2.0**40):
        assert (with_and_without(points, factor=factor)[0].faces == faces).all()
    order = np.random.default_rng(0).permutation(len(points))
    permuted = order[with_and_without(points[order])[0].faces]
    assert set(map(tuple, np.sort(permuted, axis=1))) == set(map(tuple, np.sort(faces, axis=1)))
    spacing = weighting.spacing(points)
    triangulation = recon.regular_triangulation(points, spacing**2)
    for threads in (1, 3):
        assert (label_surface(triangulation, spacing, threads=threads).faces == faces).all()
