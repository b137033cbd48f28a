"""Measures against truths that are known in closed form, and queries against rational numbers."""

from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import dot, exact, minus, solve
from test_topology import CUBE

import datasets_synthetic
import recon
from recon import InvalidInput, Mesh, measure
from recon.metrics import MEANING
from recon.proximity import FaceQueries, area_samples

CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)


def values(*args, **kwargs):
    return {m.name: m.value for m in measure(*args, **kwargs)}


def cube(shift=(0, 0, 0), size=1.0, flip=False):
    return CORNERS * size + np.array(shift, float), CUBE[:, ::-1] if flip else CUBE


def joined(*parts):
    offsets = np.cumsum([0, *(len(v) for v, _ in parts)])
    faces = [f + o for (_, f), o in zip(parts, offsets)]
    return Mesh.from_arrays(np.concatenate([v for v, _ in parts]), np.concatenate(faces))


def icosphere(level):
    """A sphere of 20 * 4^level faces, by splitting the faces of an icosahedron."""
    g = (1 + 5**0.5) / 2
    v = np.array([[s, t * g, 0] for s in (-1, 1) for t in (-1, 1)])
    v = np.concatenate([np.roll(v, k, axis=1) for k in range(3)])
    near = np.linalg.norm(v[:, None] - v[None], axis=2).round(6) == 2
    f = np.array(
        [t for t in np.ndindex(12, 12, 12) if t[0] < t[1] < t[2] and all(near[t[i], t[i - 1]] for i in range(3))]
    )
    inward = np.linalg.det(v[f]) < 0
    f[inward] = f[inward, ::-1]
    for _ in range(level):
        edges, inverse = np.unique(np.sort(f[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0, return_inverse=True)
        a, b, c = (len(v) + inverse.reshape(-1, 3)).T
        v = np.concatenate([v, v[edges].mean(axis=1)])
        f = np.concatenate([np.c_[f[:, 0], a, c], np.c_[a, f[:, 1], b], np.c_[c, b, f[:, 2]], np.c_[a, b, c]])
    return v / np.linalg.norm(v, axis=1, keepdims=True), f


class Sphere:
    """The unit sphere with no more than the contract asks of a surface."""

    area, volume, euler, components, boundary_loops, closed = 4 * np.pi, 4 / 3 * np.pi, 2, 1, 0, True

    def distance(self, x):
        return np.linalg.norm(x, axis=1) - 1

    def normal(self, x):
        return x / np.linalg.norm(x, axis=1, keepdims=True)

    def sample(self, n, *, rng):
        return self.normal(rng.normal(size=(n, 3)))


# --- queries


def true_distance_sq(point, triangle):
    """Squared distance in rational numbers: the least over the foot points of all corners, edges and the plane."""
    best = []
    for corners in ([0], [1], [2], [0, 1], [1, 2], [0, 2], [0, 1, 2]):
        base, *others = (triangle[i] for i in corners)
        edges = [minus(o, base) for o in others]
        gap = minus(point, base)
        share = solve([[dot(a, b) for b in edges] for a in edges], [dot(a, gap) for a in edges])
        if share is not None and all(s >= 0 for s in share) and sum(share) <= 1:
            foot = tuple(b + sum(s * e[i] for s, e in zip(share, edges)) for i, b in enumerate(base))
            best.append(dot(minus(point, foot), minus(point, foot)))
    return min(best)


spot = st.tuples(*[st.integers(-3, 3)] * 3)


@given(st.lists(spot, min_size=3, max_size=9), st.lists(spot, min_size=1, max_size=4))
@settings(max_examples=150, deadline=None)
def test_distance_is_that_of_rational_numbers(corners, points):
    vertices, queries = np.array(corners, float), np.array(points, float)
    faces = np.arange(len(corners) // 3 * 3).reshape(-1, 3)
    distance, face, foot = FaceQueries(vertices, faces).nearest(queries)
    for x, d, f, y in zip(queries, distance, face, foot):
        truth = [true_distance_sq(exact(x), exact(vertices[t])) for t in faces]
        assert d**2 == pytest.approx(float(min(truth)), rel=1e-14, abs=1e-14)
        assert float(truth[f]) == pytest.approx(float(min(truth)), rel=1e-14, abs=1e-14)
        assert np.linalg.norm(x - y) == pytest.approx(d, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("thin", [1e-3, 1e-8, 1e-13, 0.0])
def test_distance_to_slivers(thin):
    rng = np.random.default_rng(1)
    triangle = np.array([[0, 0, 0], [1, 0.3, 0.2], [0.4, 0.12 + thin, 0.08]])
    queries = rng.normal(size=(200, 3))
    distance = FaceQueries(triangle, np.array([[0, 1, 2]])).nearest(queries)[0]
    truth = [float(true_distance_sq(exact(x), exact(triangle))) ** 0.5 for x in queries]
    assert np.abs(distance - truth).max() < 1e-15 * 8


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1e90])
@pytest.mark.parametrize("offset", [0.0, 5e5])
def test_queries_at_any_scale_and_offset(scale, offset):
    vertices, faces = icosphere(2)
    queries = np.random.default_rng(2).normal(size=(500, 3))
    plain = FaceQueries(vertices, faces)
    moved = FaceQueries((vertices + offset) * scale, faces)
    distance = moved.nearest((queries + offset) * scale)[0]
    np.testing.assert_allclose(
        distance, plain.nearest(queries)[0] * scale, rtol=0, atol=scale * (4e-15 + offset * 1e-15)
    )
    assert (moved.winding((queries + offset) * scale) == plain.winding(queries)).all()


def test_winding_number_through_edges_and_corners():
    """Rays along x from a lattice run into edges and corners of these cubes, and along their faces."""
    mesh = joined(cube(), cube((2, 0, 0)), cube((0, 0.25, 2)), cube((0.5, 0.5, 0.5)))
    lattice = np.stack(np.meshgrid(*[np.arange(-0.25, 3.5, 0.25)] * 3), axis=-1).reshape(-1, 3)
    low = mesh.vertices.reshape(4, 8, 3).min(axis=1)
    away = np.abs(lattice[:, None] - low - 0.5).max(axis=2) - 0.5
    clear = (away != 0).all(axis=1)
    count = FaceQueries(mesh.vertices, mesh.faces).winding(lattice[clear])
    assert (count == (away[clear] < 0).sum(axis=1)).all()


def test_winding_number_through_the_corners_of_an_octahedron():
    """Rays along x through corners, along edges, and through edges that stand on end."""
    vertices = np.vstack([np.eye(3), -np.eye(3)]) * 4
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    lattice = np.stack(np.meshgrid(*[np.arange(-5.0, 6)] * 3), axis=-1).reshape(-1, 3)
    level = np.abs(lattice).sum(axis=1)
    clear = level != 4
    count = FaceQueries(vertices, np.array(faces)).winding(lattice[clear])
    assert (count == (level[clear] < 4)).all()


def test_winding_number_of_a_rough_solid():
    rng = np.random.default_rng(4)
    vertices, faces = icosphere(4)
    radius = 1 + 0.3 * np.sin(3 * vertices[:, :1]) + 0.05 * rng.random((len(vertices), 1))
    queries = FaceQueries(radius * vertices, faces)
    x = rng.normal(size=(20_000, 3))
    distance, face, foot = queries.nearest(x)
    a, b, c = (radius * vertices)[faces[face]].swapaxes(0, 1)
    side = np.einsum("ij,ij->i", x - foot, np.cross(b - a, c - a))
    interior = np.abs(side) > 0.2 * distance * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert interior.mean() > 0.9
    assert ((queries.winding(x) == 1) == (side < 0))[interior].all()


def test_samples_spread_by_area():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [3, 0, 5], [0, 3, 5], [9, 9, 9.0]])
    faces = np.array([[6, 6, 6], [0, 1, 2], [3, 4, 5]])
    points, face = area_samples(vertices, faces, 1000, np.random.default_rng(0))
    assert np.bincount(face, minlength=3).tolist() == [0, 100, 900]
    assert (points[face == 2, 2] == 5).all()
    np.testing.assert_allclose(points[face == 2].mean(axis=0), [1, 1, 5], atol=0.1)


# --- measures


def test_error_of_inscribed_spheres_is_of_second_order():
    rows = [values(Mesh.from_arrays(*icosphere(k)), Sphere(), samples=20_000) for k in (2, 3, 4)]
    for coarse, fine in pairwise(rows):
        for name in (
            "to_reference_mean",
            "from_reference_mean",
            "to_reference_max",
            "area_error",
            "volume_error",
            "bias",
        ):
            assert coarse[name] / fine[name] == pytest.approx(4, rel=0.06)
        assert coarse["normal_angle_mean"] / fine["normal_angle_mean"] == pytest.approx(2, rel=0.03)
        assert 1 - fine["iou"] == pytest.approx((1 - coarse["iou"]) / 4, abs=5 * fine["iou_standard_error"] + 1e-4)
    best = rows[-1]
    assert best["to_reference_mean"] < 1e-3 and best["bias"] == -best["to_reference_mean"]
    assert best["iou"] == pytest.approx(1 + best["volume_error"], abs=4 * best["iou_standard_error"])
    assert best["normal_same_side"] == 1 and best["outward"] and best["f_score@0.001"] == 1
    assert best["euler_error"] == best["components_error"] == best["boundary_loops_error"] == 0


@pytest.mark.parametrize("name", ["sphere", "torus", "box", "hemisphere", "mobius_band", "nested_spheres"])
def test_analytic_surfaces_know_what_is_asked(name):
    """A reconstruction of an even sample: every measure that has a meaning for the surface has a value."""
    surface = datasets_synthetic.surface(name)
    mesh = recon.reconstruct(surface.sample(3000, spacing="blue", rng=0).points).mesh
    v = values(mesh, surface, points=3000, samples=5000)
    size = np.linalg.norm(surface.bounds[1] - surface.bounds[0])
    assert 0 < v["to_reference_mean"] < 2e-3 * size and 0 < v["from_reference_mean"] < 2e-3 * size
    assert v["points_used"] > 0.99 and v["normal_angle_mean"] < 6 and abs(v["area_error"]) < 0.05
    for key in ("bias", "iou", "volume_error"):
        assert (v[key] is not None) == surface.closed
    assert (v["normal_same_side"] is not None) == surface.orientable
    if surface.closed:
        assert v["euler_error"] == v["components_error"] == 0 and v["outward"] and v["iou"] > 0.97


def test_parallel_sheets_are_their_distance_apart():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    faces = [[0, 1, 2], [0, 2, 3]]
    low, high = Mesh.from_arrays(square, faces), Mesh.from_arrays(square + np.array([0, 0, 0.25]), faces)
    v = values(high, low)
    for name in ("to_reference_mean", "from_reference_rms", "to_reference_p99", "chamfer", "hausdorff"):
        assert v[name] == pytest.approx(0.25, rel=1e-12)
    assert v["normal_angle_mean"] == 0 and v["normal_consistency"] == 1 and v["normal_same_side"] == 1
    assert v["area_error"] == 0 and v["area"] == 1
    assert v["bias"] is v["volume"] is v["iou"] is v["genus"] is v["outward"] is None
    v = values(high, low, thresholds=[0.1, 0.25 / 2**0.5 + 1e-9])
    assert [v[k] for k in v if "@" in k] == [0, 0, 0, 1, 1, 1]


def test_what_is_missing_shows_from_the_reference_alone():
    square = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0.0]])
    whole = Mesh.from_arrays(square, [[0, 1, 2], [0, 2, 3]])
    half = Mesh.from_arrays(square, [[0, 4, 5], [0, 5, 3]])
    v = values(half, whole, thresholds=[0.1])
    assert v["to_reference_max"] < 1e-15 and v["from_reference_mean"] == pytest.approx(0.25, abs=5e-3)
    assert v["precision@0.1"] == 1 and v["recall@0.1"] == pytest.approx(0.5 + 0.05 * 5**0.5, abs=5e-3)
    assert v["area_error"] == -0.5
    back = values(whole, half, thresholds=[0.1])
    assert back["from_reference_mean"] < 1e-15 and back["to_reference_mean"] == pytest.approx(0.25, abs=5e-3)


def test_overlap_of_shifted_cubes():
    v = values(joined(cube((0.5, 0, 0))), joined(cube()))
    assert v["iou"] == pytest.approx(1 / 3, abs=4 * v["iou_standard_error"])
    assert 0 < v["iou_standard_error"] < 3e-3
    # One face 0.5 outside, one half-way inside at 1/6 in the mean; of the four others, half outside at 1/4, half inside at 0.
    assert v["bias"] == pytest.approx((0.5 - 1 / 6 + 4 * 0.5 * 0.25) / 6, abs=2e-3)


def test_a_normal_on_the_wrong_side_shows():
    v = values(joined(cube(flip=True)), joined(cube()))
    assert v["normal_same_side"] == 0 and v["normal_consistency"] == pytest.approx(1) and v["outward"] is False
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    sheet, turned = (Mesh.from_arrays(square, f) for f in ([[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]]))
    mixed = Mesh.from_arrays(square, [[0, 1, 2], [0, 3, 2]])
    assert values(turned, sheet)["normal_same_side"] == 1 and values(mixed, sheet)["normal_same_side"] == 0.5
    assert v["volume"] == pytest.approx(-1) and v["volume_error"] == pytest.approx(-2) and v["iou"] == pytest.approx(1)


@pytest.mark.parametrize(
    ("parts", "outward"),
    [
        ([cube()], True),
        ([cube(flip=True)], False),
        ([cube(), cube((3, 0, 0))], True),
        ([cube(size=3), cube((9, 0, 0), flip=True)], False),
        ([cube(size=3), cube((1, 1, 1), flip=True)], True),
        ([cube(size=3), cube((1, 1, 1))], False),
        ([cube(size=5), cube((1, 1, 1), 3, flip=True), cube((2, 2, 2))], True),
        ([cube(size=9), cube((2, 3, 4), 3, flip=True)], True),
    ],
)
def test_outward_means_inside_behind(parts, outward):
    assert values(joined(*parts))["outward"] is outward


def test_outward_of_many_bodies_at_any_angle():
    rng = np.random.default_rng(8)
    parts = []
    for k in range(60):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        vertices, faces = cube()
        parts.append((vertices @ turn.T + [4.1 * k, 0.1 * k, 0], faces if np.linalg.det(turn) > 0 else faces[:, ::-1]))
    assert values(joined(*parts))["outward"] is True
    parts[33] = (parts[33][0], parts[33][1][:, ::-1])
    assert values(joined(*parts))["outward"] is False


def test_outward_looks_at_patches_that_touch():
    vertices, faces = cube()
    both = np.concatenate([vertices, vertices - 1])
    inside_out = np.where(CUBE == 7, 0, CUBE + 8)[:, ::-1]
    v = values(Mesh.from_arrays(both, np.concatenate([faces, inside_out])))
    assert v["components"] == 1 and v["nonmanifold_vertices"] == 1 and v["outward"] is False


def test_self_intersections_and_zero_area_are_counted():
    v = values(joined(cube(), cube((0.5, 0.5, 0.5))))
    assert v["self_intersections"] > 0 and v["zero_area_faces"] == 0 and v["manifold"]
    line = Mesh.from_arrays([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2]])
    v = values(line)
    assert v["zero_area_faces"] == 1 and v["degenerate_faces"] == 0 and v["area"] == 0


def test_a_cloud_as_reference():
    rng = np.random.default_rng(0)
    cloud = rng.random((500, 3)) * [1, 1, 0] + [0, 0, 0.5]
    v = values(joined(cube((0, 0, -0.5))), cloud, points=8)
    assert v["from_reference_max"] == 0 and v["to_reference_mean"] > 0.2
    assert v["normal_angle_mean"] is v["area_error"] is v["bias"] is v["iou"] is v["euler_error"] is None
    assert v["points_used"] == 1


def test_points_used_counts_rows_in_faces_once():
    vertices = np.zeros((6, 3)) + np.arange(6)[:, None] * [1, 0.5, 0.1]
    mesh = Mesh.from_arrays(vertices, [[0, 1, 2], [2, 3, 0]], vertex_source=[7, 7, -1, 2, 5, 6])
    assert values(mesh, points=10)["points_used"] == 0.2
    assert values(mesh, points=np.zeros((8, 3)))["points_used"] == 0.25
    with pytest.raises(InvalidInput, match="row 7"):
        measure(mesh, points=7)


@pytest.mark.parametrize("scale", [2.0**-300, 2.0**300])
def test_units_change_lengths_and_nothing_else(scale):
    mesh, truth = Mesh.from_arrays(*icosphere(2)), Mesh.from_arrays(*icosphere(3))
    other = measure(*(Mesh.from_arrays(m.vertices * scale, m.faces) for m in (mesh, truth)), samples=2000)
    for a, b in zip(measure(mesh, truth, samples=2000), other):
        power = {"L": 1, "L^2": 2, "L^3": 3}.get(a.unit, 0)
        assert b.value == (a.value if power == 0 else np.ldexp(a.value, power * int(np.log2(scale)))), a.name


def test_utm_coordinates_cost_nothing():
    mesh, truth = icosphere(2), icosphere(3)
    offset = np.array([431_234.5, 5_412_345.25, 312.0])
    moved = [Mesh.from_arrays(v + offset, f) for v, f in (mesh, truth)]
    plain = measure(Mesh.from_arrays(*mesh), Mesh.from_arrays(*truth), samples=5000)
    for a, b in zip(plain, measure(*moved, samples=5000)):
        assert b.value == (a.value if isinstance(a.value, (int, type(None))) else pytest.approx(a.value, abs=1e-5)), (
            a.name
        )


def test_same_seed_same_values_on_any_number_of_threads(monkeypatch):
    mesh = Mesh.from_arrays(*icosphere(3))
    first = measure(mesh, Sphere(), samples=40_000, seed=5)
    monkeypatch.setattr("recon.proximity.workers", lambda threads: 1)
    assert measure(mesh, Sphere(), samples=40_000, seed=5) == first
    assert measure(mesh, Sphere(), samples=40_000, seed=6) != first


def test_an_empty_mesh_has_values_too():
    empty = Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    v = values(empty, Sphere(), points=10)
    assert v["chamfer"] is v["to_reference_mean"] is v["iou"] is v["outward"] is None
    assert v["f_score@0.01"] == 0 and v["area"] == 0 and v["points_used"] == 0 and v["area_error"] == -1
    assert [m.name for m in measure(empty, Sphere())] == [m.name for m in measure(joined(cube()), Sphere())]
    flat = Mesh.from_arrays([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2]])
    assert values(flat, Sphere())["from_reference_mean"] is None


def test_every_measure_is_written_down():
    mesh = Mesh.from_arrays(*icosphere(1))
    given = measure(mesh, Sphere(), points=99)
    assert {m.name.partition("@")[0] for m in given} == set(MEANING)
    assert all(m.meaning for m in given)
    assert {m.unit for m in given} <= {"L", "L^2", "L^3", "deg", "1", "count", "yes/no"}
    assert {type(m.value) for m in given} <= {float, int, bool, type(None)}
    page = (Path(__file__).parents[1] / "docs" / "metrics.md").read_text(encoding="utf-8")
    for name in MEANING:
        tail = name.rpartition("_")[2]
        assert f"`{name}`" in page or f"`{name}@t`" in page or f"`…_{tail}`" in page, name


@pytest.mark.parametrize(
    ("arguments", "options"),
    [
        ((CORNERS,), {}),
        ((joined(cube()), "truth.ply"), {}),
        ((joined(cube()), np.zeros((3, 2))), {}),
        ((joined(cube()), np.full((3, 3), np.nan)), {}),
        ((joined(cube()), Mesh.from_arrays(CORNERS, [])), {}),
        ((joined(cube()),), {"samples": 0}),
        ((joined(cube()),), {"thresholds": [0.0]}),
        ((joined(cube()),), {"points": 0}),
    ],
)
def test_what_cannot_be_measured_is_refused(arguments, options):
    with pytest.raises(InvalidInput):
        measure(*arguments, **options)


def test_volume_of_a_lattice_cube_is_exact():
    assert values(joined(cube((4, 4, 4), 2)))["volume"] == 8
    assert Fraction(values(joined(cube()))["area"]) == 6
    assert recon.Metric("area", "L^2", 6.0).meaning == "area of the mesh"
