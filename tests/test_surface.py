"""Surfaces of known truth: right topology, right side out, every sample used."""

import numpy as np
import pytest

import datasets_synthetic
import recon
import weighting
from recon.surface import label_surface
from recon.topology import topology

CLOSED = [
    "sphere", "ellipsoid", "torus", "capsule", "box", "rounded_box", "cylinder", "cone_frustum", "bumpy_sphere",
    "genus_2", "genus_3", "trefoil", "nested_spheres", "csg_part",
]  # fmt: skip
OPEN = ["hemisphere", "paraboloid", "swiss_roll", "wavy_sheet", "mobius_band"]


def signed_volume(mesh: recon.Mesh) -> float:
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("name", CLOSED)
def test_closed_surfaces_come_out_closed_with_their_topology_and_every_sample(name):
    truth = datasets_synthetic.surface(name)
    result = recon.reconstruct(truth.sample(3000, rng=0).points)
    t = topology(result.mesh.faces)
    assert result.surface == "closed"
    assert t.closed and t.manifold and t.oriented
    assert t.euler == truth.euler
    assert result.report["mesh"]["share_of_points_used"] == 1
    assert signed_volume(result.mesh) == pytest.approx(truth.volume, rel=0.07)  # chords lose volume, a thin tube most
    centers = result.mesh.vertices[result.mesh.faces].mean(axis=1)
    assert np.abs(truth.distance(centers)).mean() < 0.005


@pytest.mark.parametrize("name", OPEN)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_open_sheets_keep_their_boundary_and_every_sample(name, noise):
    truth = datasets_synthetic.surface(name)
    result = recon.reconstruct(truth.sample(3000, noise=noise, rng=0).points)
    t = topology(result.mesh.faces)
    assert result.surface == "open"
    assert t.manifold
    assert t.oriented == t.orientable == (name != "mobius_band")
    assert (t.euler, t.boundary_loops, t.components) == (truth.euler, truth.boundary_loops, 1)
    assert result.report["mesh"]["share_of_points_used"] == 1
    recon.certify(result)


@pytest.mark.parametrize("noise", [0.1, 0.5])
def test_a_flat_sheet_with_noise_is_no_heap_of_bubbles(noise):
    truth = datasets_synthetic.surface("disk")
    result = recon.reconstruct(truth.sample(5000, noise=noise * np.sqrt(truth.area / 5000), rng=0).points)
    assert result.surface == "open"
    assert topology(result.mesh.faces).euler == 1


def test_voids_between_the_turns_of_a_roll_do_not_close_it():
    result = recon.reconstruct(datasets_synthetic.surface("swiss_roll").sample(1500, rng=0).points)
    assert result.surface == "open" and "walls" in result.report["surface"]["because"]
    t = topology(result.mesh.faces)
    assert (t.euler, t.boundary_loops) == (1, 1)


@pytest.mark.parametrize(
    "name", [*CLOSED, "thin_plate", "hemisphere", "paraboloid", "swiss_roll", "wavy_sheet", "mobius_band"]
)
@pytest.mark.parametrize("seed", range(2))
def test_closed_and_open_are_told_apart_at_any_density(name, seed):
    truth = datasets_synthetic.surface(name)
    kind = "closed" if name in (*CLOSED, "thin_plate") else "open"
    for density in (10.0, 50.0):
        assert recon.reconstruct(truth.sample(3000, density=density, rng=seed).points).surface == kind


@pytest.mark.parametrize("ratio", [1, 10, 50])
def test_density_ratios_do_no_harm(ratio):
    cloud = datasets_synthetic.surface("torus").sample(5000, density=ratio, rng=1).points
    t = topology(recon.reconstruct(cloud).mesh.faces)
    assert (t.closed, t.manifold, t.genus) == (True, True, 1)


@pytest.mark.parametrize("step", [0.0, 2.0**-24, 1e-5])
@pytest.mark.parametrize("seed", range(3))
def test_samples_of_flat_faces_that_lie_askew_give_no_handles(seed, step):
    """A torus of 120 triangles, turned: cells of samples on one face are flat but for rounding."""
    points = polyhedral_torus(20_000, np.random.default_rng(seed))
    result = recon.reconstruct(points if step == 0 else np.round(points / step) * step)
    assert result.surface == "closed"
    assert topology(result.mesh.faces).euler == 0
    assert result.report["mesh"]["share_of_points_used"] == 1


def polyhedral_torus(n: int, rng: np.random.Generator) -> np.ndarray:
    """Random samples of the triangles of a coarse torus."""
    i, j = np.divmod(np.arange(60), 6)
    around, across = 2 * np.pi * i / 10, 2 * np.pi * j / 6
    radius = 1 + 0.4 * np.cos(across)
    corners = np.stack([radius * np.cos(around), radius * np.sin(around), 0.4 * np.sin(across)], axis=1)
    corners = corners @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    here, right = 6 * i + j, 6 * ((i + 1) % 10) + j
    above, both = 6 * i + (j + 1) % 6, 6 * ((i + 1) % 10) + (j + 1) % 6
    a, b, c = corners[np.r_[np.stack([here, right, both]).T, np.stack([here, both, above]).T]].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    face = rng.choice(len(a), n, p=area / area.sum())
    u, v = rng.random((2, n, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return a[face] + u * (b - a)[face] + v * (c - a)[face]


def test_bodies_apart_come_out_apart():
    one = datasets_synthetic.surface("sphere").sample(500, rng=0).points
    two = datasets_synthetic.surface("torus").sample(1500, rng=0).points
    result = recon.reconstruct(np.concatenate([one, two + [3, 0, 0]]))
    t = topology(result.mesh.faces)
    assert (t.components, t.euler, t.closed) == (2, 2, True)


@pytest.mark.parametrize("ratio", [1, 10])
def test_bodies_that_pass_close_by_are_not_joined_by_a_neck(ratio):
    cloud = datasets_synthetic.surface("linked_tori").sample(3000, density=ratio, rng=1)
    mesh = recon.reconstruct(cloud.points).report["mesh"]
    assert (mesh["components"], mesh["chi"], mesh["genus"]) == (2, 0, 2)


def test_scaling_by_a_power_of_two_and_moving_by_integers_change_nothing():
    points = np.round(datasets_synthetic.surface("torus").sample(800, rng=3).points * 2**20) / 2**20
    faces = recon.reconstruct(points).mesh.faces
    for moved in (points * 2.0**-30, points * 2.0**30):
        np.testing.assert_array_equal(recon.reconstruct(moved).mesh.faces, faces)


def test_the_same_bytes_whatever_the_threads():
    points = datasets_synthetic.surface("genus_2").sample(2000, noise=0.01, rng=5).points
    one, two = (recon.reconstruct(points, threads=k).mesh for k in (1, 2))
    assert one.faces.tobytes() == two.faces.tobytes()
    assert one.vertices.tobytes() == two.vertices.tobytes()


def test_points_in_a_plane_give_the_region_they_cover():
    grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(12.0)), axis=-1).reshape(-1, 2)
    tilted = grid @ np.array([[1.0, 0, 1], [0, 1, 2]]) + [5, 5, 5]
    result = recon.reconstruct(tilted)
    t = topology(result.mesh.faces)
    assert result.surface == "planar"
    assert (t.euler, t.boundary_loops, t.faces) == (1, 1, 2 * 9 * 11)


@pytest.mark.parametrize("surface", ["auto", "terrain"])
def test_a_plane_is_the_same_at_any_scale(surface):
    points = np.random.default_rng(0).random((400, 3)) * [1, 1, 0]
    faces = recon.reconstruct(points, surface=surface).mesh.faces
    for power in (-490, 330):
        np.testing.assert_array_equal(recon.reconstruct(points * 2.0**power, surface=surface).mesh.faces, faces)


def test_closed_on_request_and_open_on_request():
    points = datasets_synthetic.surface("hemisphere").sample(2000, rng=0).points
    closed = recon.reconstruct(points, surface="closed")
    opened = recon.reconstruct(points, surface="open")
    assert topology(closed.mesh.faces).closed and closed.surface == "closed" and closed.confidence == 1
    assert topology(opened.mesh.faces).boundary_loops == 1 and opened.surface == "open"
    assert closed.report["surface"]["bridged"] > opened.report["surface"]["bridged"]


def cut_off(shape: str, n: int, height: float) -> np.ndarray:
    """Samples of a surface above a height: a body that is open at its base."""
    points = datasets_synthetic.surface(shape).sample(n, rng=0).points
    lowest, extent = points[:, 2].min(), np.ptp(points[:, 2])
    return points[points[:, 2] > lowest + height * extent]


@pytest.mark.parametrize(("shape", "chi"), [("sphere", 1), ("bumpy_sphere", 1), ("capsule", 1), ("torus", 0)])
def test_a_body_open_at_its_base_is_closed_over_it_or_not(shape, chi):
    points = cut_off(shape, 4000, 0.1)
    closed, opened = recon.reconstruct(points), recon.reconstruct(points, surface="open")
    assert (closed.surface, opened.surface) == ("closed", "open")
    walls = closed.report["surface"]["walls"]
    assert 0.01 < walls == opened.report["surface"]["walls"] < 0.25 and closed.confidence == pytest.approx(
        1 - 4 * walls
    )
    t = topology(opened.mesh.faces)
    assert (t.euler, t.boundary_loops, t.manifold, t.oriented) == (chi, 2 - chi, True, True)
    assert opened.report["mesh"]["share_of_points_used"] > 0.99
    recon.certify(opened)

    def corners(mesh):  # each face as it is turned, from its lowest row on
        rows = mesh.vertex_source[mesh.faces]
        return {tuple(np.roll(row, -int(row.argmin())).tolist()) for row in rows}

    same = corners(opened.mesh) & corners(closed.mesh)
    assert len(same) > 0.98 * len(opened.mesh.faces)  # the same surface, facing outward too


def test_a_cavity_keeps_facing_inward_where_a_body_is_left_open():
    outer, inner = cut_off("sphere", 6000, 0.02), datasets_synthetic.surface("sphere").sample(1500, rng=1).points / 2
    result = recon.reconstruct(np.concatenate([outer, inner]), surface="open")
    faces, outside = result.mesh.vertex_source[result.mesh.faces], len(outer)
    rows = np.concatenate([outer, inner])
    normal = np.cross(rows[faces[:, 1]] - rows[faces[:, 0]], rows[faces[:, 2]] - rows[faces[:, 0]])
    outward = np.einsum("ij,ij->i", normal, rows[faces].mean(axis=1)) > 0
    assert outward[faces[:, 0] < outside].all() and not outward[faces[:, 0] >= outside].any()


def test_sheets_are_read_as_such_even_where_they_enclose_something():
    points = cut_off("sphere", 2000, 0.1)
    spacing = weighting.spacing(points)
    triangulation = recon.regular_triangulation(points, spacing**2)
    opened, sheets = (label_surface(triangulation, spacing, kind) for kind in ("open", "sheets"))
    assert opened.walls is not None and sheets.walls is None
    assert [topology(found.faces).boundary_loops for found in (opened, sheets)] == [1, 1]
    assert "without its walls" in opened.reason and sheets.reason == "asked for"


def test_1500_points_of_a_sphere_have_2996_triangles_at_radius_a_half():
    x = np.random.default_rng(0).normal(size=(1500, 3))
    mesh = recon.alpha_shape(x / np.linalg.norm(x, axis=1)[:, None], 0.5)
    t = topology(mesh.faces)  # a ball of that radius fits inside too: a shell of singular facets
    assert (len(mesh.faces), t.euler, t.manifold, t.closed, t.oriented) == (2996, 2, True, True, True)
    assert signed_volume(mesh) == pytest.approx(4 / 3 * np.pi, rel=0.02)
    solid = topology(recon.alpha_shape(x / np.linalg.norm(x, axis=1)[:, None], 1.5).faces)
    assert (solid.faces, solid.euler, solid.manifold, solid.oriented) == (2996, 2, True, True)


@pytest.mark.parametrize("radius", [-1.0, float("nan")])
def test_alpha_shape_rejects_a_radius_that_is_none(radius):
    with pytest.raises(recon.InvalidInput, match="radius"):
        recon.alpha_shape(np.eye(3), radius)


def test_label_surface_rejects_what_it_cannot_do():
    line = np.arange(12.0).reshape(-1, 1) * [1.0, 2, 3]
    on_line = recon.regular_triangulation(line)
    with pytest.raises(recon.DegenerateInput, match="on a line"):
        label_surface(on_line, np.ones(12))
    plane = recon.regular_triangulation(np.random.default_rng(0).random((9, 2)))
    with pytest.raises(recon.InvalidInput, match="3-D"):
        label_surface(plane, np.ones(9))
    solid = recon.regular_triangulation(np.random.default_rng(0).random((9, 3)))
    with pytest.raises(recon.InvalidInput, match="surface"):
        label_surface(solid, np.ones(9), "half-open")


def test_bridged_facets_are_those_of_positive_size():
    points = datasets_synthetic.surface("torus").sample(2000, rng=0).points
    spacing = weighting.spacing(points)
    triangulation = recon.regular_triangulation(points, weighting.adaptive_weights(points))
    found = label_surface(triangulation, spacing, "closed")
    complex_ = recon.alpha_complex(triangulation)
    in_w0 = complex_.classify(2) != recon.EXTERIOR
    member = {tuple(facet) for facet in complex_.simplices(2)[in_w0]}
    for facet, bridged in zip(np.sort(found.faces, axis=1), found.bridged):
        assert (tuple(facet) in member) != bridged


def test_alpha_shapes_of_planar_points_are_their_triangles():
    square = [[0, 0, 5], [1, 0, 5], [0, 1, 5], [1, 1, 5], [9, 9, 5]]
    mesh = recon.alpha_shape(square, radius=0.75)
    assert len(mesh.faces) == 2 and sorted(mesh.vertex_source) == [0, 1, 2, 3]
    assert len(recon.alpha_shape(square, radius=1e200).faces) == len(recon.regular_triangulation(square).cells)
    assert len(recon.alpha_shape(square, radius=0.1).faces) == 0


@pytest.mark.parametrize("radius", ["a", -1.0, float("nan"), None])
def test_alpha_shapes_refuse_what_is_no_radius(radius):
    with pytest.raises(recon.InvalidInput, match="radius"):
        recon.alpha_shape(np.eye(4)[:, :3], radius=radius)


def test_alpha_shapes_refuse_lines():
    with pytest.raises(recon.DegenerateInput, match="line"):
        recon.alpha_shape([[0, 0, 0], [1, 1, 1], [2, 2, 2]], radius=1.0)
