"""The weighted alpha complex as a user meets it: closed forms, conventions, invariances, both ways to the boundary."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle
from scipy.spatial import cKDTree

from recon import (
    EXTERIOR,
    INTERIOR,
    REGULAR,
    SINGULAR,
    InvalidInput,
    RegularTriangulation,
    alpha_complex,
    certify,
    intervals_nd,
    regular_triangulation,
)
from recon.boundary import _boundary_alone, _boundary_of_levels
from recon.intervals import Family, Level


def rows(array) -> list[tuple[int, ...]]:
    return list(map(tuple, array.tolist()))


def torus(n: int, rng, noise=0.01):
    """A torus of radii 1 and 0.4, weights that cover it, some points hidden."""
    u, v = rng.uniform(0, 2 * np.pi, (2, n))
    ring = 1 + 0.4 * np.cos(v)
    points = np.column_stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)])
    points += noise * rng.normal(size=points.shape)
    return points, (0.9 * cKDTree(points).query(points, k=9)[0][:, 8]) ** 2


CLOUDS = {
    "torus": lambda rng: torus(400, rng),
    "negative weights": lambda rng: (rng.normal(size=(150, 3)), -rng.random(150)),
    "exact grid": lambda rng: (np.argwhere(np.ones((5, 5, 4))).astype(float), None),
    "decimal grid": lambda rng: (np.argwhere(np.ones((4, 4, 4))) * 0.1, None),
    "weighted grid": lambda rng: (np.argwhere(np.ones((4, 4, 4))).astype(float), rng.integers(-1, 2, 64).astype(float)),
    "sphere": lambda rng: ((lambda p: p / np.linalg.norm(p, axis=1)[:, None])(rng.normal(size=(150, 3))), None),
    "far away": lambda rng: (rng.random((120, 3)) + np.array([5e5, 5.4e6, 100]), None),
    "nearly flat": lambda rng: ((lambda p: np.c_[p, p @ [0.3, 0.7]])(rng.random((80, 2))), None),
    "tiny": lambda rng: (1e-40 * rng.random((80, 3)), 1e-82 * rng.random(80)),
    "huge": lambda rng: (1e60 * rng.random((80, 3)), None),
    "wild weights": lambda rng: (rng.random((60, 3)), rng.random(60) * 10.0 ** rng.integers(-30, -1, 60)),
    "in the plane": lambda rng: (rng.random((150, 2)), 0.01 * rng.random(150)),
    "plane grid": lambda rng: (np.argwhere(np.ones((7, 6))).astype(float), None),
    "flat in space": lambda rng: ((lambda p: np.c_[p, p @ [1, -2]])(rng.integers(-9, 9, (90, 2)) * 1.0), None),
}
CLOUD = pytest.mark.parametrize("name", CLOUDS)


def cloud(name):
    return CLOUDS[name](np.random.default_rng(len(name)))


# --- closed forms


def test_sizes_of_a_regular_tetrahedron():
    complex_ = alpha_complex([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # edges of squared length 8
    assert complex_.rho(0).tolist() == [0] * 4
    assert complex_.rho(1).tolist() == [2] * 6
    assert complex_.rho(2) == pytest.approx([8 / 3] * 4, rel=1e-15)
    assert complex_.rho(3).tolist() == [3]
    assert not any(complex_.attached(k).any() for k in range(4))
    assert [complex_.on_hull(k).all() for k in range(4)] == [True, True, True, False]


def test_orthosphere_of_two_balls():
    """Two balls of squared radii 4 and 1 at a distance of 3: the centre is at 2 from the first, rho = 0."""
    complex_ = alpha_complex([[0.0], [3.0]], [4, 1])
    assert complex_.rho(1).tolist() == [0.0]
    assert complex_.classify(1, 0.0).tolist() == [INTERIOR] and complex_.classify(1, -1e-9).tolist() == [EXTERIOR]


def test_a_sphere_of_1500_points_has_2996_triangles_at_radius_one_half():
    points = np.random.default_rng(0).normal(size=(1500, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    boundary = alpha_complex(points).boundary(0.5**2)
    assert len(boundary) == 2996 and boundary.singular.all()
    assert sorted(set(boundary.facets.ravel().tolist())) == list(range(1500))


def test_right_angles_tie_and_are_unattached():
    """The longest edge of a right triangle has the triangle's own orthosphere: no conflict, and never singular."""
    complex_ = alpha_complex([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    assert rows(complex_.simplices(1)) == [(0, 1), (0, 2), (1, 2)]
    assert not complex_.attached(1).any()
    assert complex_.rho(1)[2] == complex_.rho(2)[0] == complex_.mu_lower(1)[2] == 6.25
    assert complex_.classify(1, 6.25)[2] == REGULAR and complex_.classify(1, 6.2)[2] == EXTERIOR


def test_an_obtuse_triangle_attaches_its_longest_edge():
    complex_ = alpha_complex([[0.0, 0.0], [4.0, 0.0], [2.0, 0.5]])
    assert complex_.attached(1).tolist() == [True, False, False]


# --- conventions


def test_equality_is_in():
    complex_ = alpha_complex([[0, 0], [2, 0], [2, 2], [0, 2]])
    assert complex_.classify(1, 1.0).tolist() == [SINGULAR, EXTERIOR, SINGULAR, SINGULAR, SINGULAR]
    assert complex_.classify(1, np.nextafter(1, 0)).tolist() == [EXTERIOR] * 5
    assert complex_.classify(1, 2.0).tolist() == [REGULAR, INTERIOR, REGULAR, REGULAR, REGULAR]
    assert complex_.betti([0, 1, 2]).tolist() == [[4, 0], [1, 1], [1, 0]]
    assert complex_.f_vector([-1, 0, 1, 2]).tolist() == [[0, 0, 0], [4, 0, 0], [4, 4, 0], [4, 5, 2]]


@CLOUD
def test_infinite_alphas_give_nothing_and_the_hull(name):
    complex_ = alpha_complex(*cloud(name))
    d = complex_.dimension
    assert not len(complex_.boundary(-math.inf)) and not complex_.exposed(d - 1, -math.inf).any()
    hull = complex_.boundary(math.inf)
    for k in range(d):
        assert (complex_.exposed(k, math.inf) == complex_.on_hull(k)).all()
        assert (complex_.classify(k, math.inf) == np.where(complex_.on_hull(k), REGULAR, INTERIOR)).all()
    assert len(hull) == complex_.on_hull(d - 1).sum() and not hull.singular.any()
    assert complex_.betti(math.inf).tolist() == [1] + [0] * (d - 1)
    assert not complex_.betti(-math.inf).any()


@pytest.mark.parametrize("k", [-1, 3, 1.0, True, "1", None])
def test_dimensions_that_are_not_there_are_refused(k):
    with pytest.raises(InvalidInput, match="k: expected an integer from 0 to 2"):
        alpha_complex(np.eye(3)[:, :2] @ [[1, 0], [0, 1]]).simplices(k)


@pytest.mark.parametrize("simplex", [[], [0, 2], [0, 1, 2, 3], [7], [-1], [0.0, 1.0], "01", [[0], [1, 2]]])
def test_links_of_what_is_no_simplex_are_refused(simplex):
    with pytest.raises(InvalidInput):
        alpha_complex([[0, 0], [3, 0], [3, 1], [0, 1]], [0.5, 0, 0.5, 0]).link(simplex if simplex != [0, 2] else [1, 3])


def test_a_single_place_has_one_component_and_nothing_else():
    for d in (1, 2, 3, 4):
        complex_ = alpha_complex(np.ones((3, d)), [1.0, 2.0, 2.0])
        assert rows(complex_.simplices(0)) == [(1,)] and complex_.rho(0).tolist() == [-2.0]
        assert len(complex_.voids()) == 0 and complex_.persistence(0).tolist() == [[-2.0, math.inf]]
        assert complex_.centers(0).tolist() == [[1.0] * d] and complex_.link([1]) == ()
        assert [choice.alpha for choice in complex_.choices()] == [-2.0]


@pytest.mark.parametrize("alpha", [math.nan, "0", None, [0.0, 1.0], True])
def test_alphas_that_are_no_number_are_refused(alpha):
    complex_ = alpha_complex(np.eye(3))
    for method in (complex_.boundary, lambda a: complex_.classify(1, a)):
        with pytest.raises(InvalidInput, match="alpha: expected"):
            method(alpha)


def test_weights_beside_a_triangulation_are_refused():
    with pytest.raises(InvalidInput, match="given twice"):
        alpha_complex(regular_triangulation(np.eye(3)), np.zeros(3))


def test_neighbors_of_no_ball_are_refused():
    whole = regular_triangulation(np.random.default_rng(0).random((20, 3)))
    part = RegularTriangulation(
        whole.points, whole.weights, whole.cells[:9], np.full((9, 4), -1, np.int32), whole.hidden
    )
    with pytest.raises(InvalidInput, match="Euler characteristic"):
        alpha_complex(part).simplices(1)


def test_arrays_are_frozen():
    complex_ = alpha_complex(np.random.default_rng(0).random((20, 3)))
    for k in range(4):
        for array in (complex_.simplices(k), complex_.rho(k), complex_.mu_lower(k), complex_.mu_upper(k)):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0
    with pytest.raises(ValueError, match="read-only"):
        complex_.boundary(0.1).facets[0] = 0


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_few_points(n, d):
    """One, two and three points: a complex of dimension n - 1, or less where they coincide."""
    points = np.vander(np.arange(n) + 1.0, d + 1)[:, :d]
    complex_ = alpha_complex(points)
    assert complex_.dimension == min(n - 1, d)
    assert rows(complex_.simplices(0)) == [(i,) for i in range(n)]
    assert len(complex_.boundary(math.inf)) == complex_.on_hull(max(0, complex_.dimension - 1)).sum()
    assert complex_.betti(0.0)[0] == n and complex_.betti(math.inf)[0] == 1
    same = alpha_complex(np.ones((n, d)))
    assert same.dimension == 0 and rows(same.simplices(0)) == [(0,)] and same.persistence(0).tolist() == [[0, math.inf]]


@CLOUD
def test_rows_are_lexicographic_and_of_vertices_of_r(name):
    complex_ = alpha_complex(*cloud(name))
    hidden = set(complex_.triangulation.hidden.tolist())
    for k in range(complex_.dimension + 1):
        simplices = rows(complex_.simplices(k))
        assert complex_.simplices(k).dtype == np.int32
        assert simplices == sorted(set(simplices)) and all(list(s) == sorted(s) for s in simplices)
        assert not hidden & {v for s in simplices for v in s}


# --- the plain twin, and the oracle in 4-D


@CLOUD
def test_kernels_and_their_plain_twin_agree(name):
    complex_ = alpha_complex(*cloud(name))
    twin = intervals_nd.levels(complex_.triangulation, Level)
    weights = np.abs(complex_.triangulation.weights)
    for k in range(complex_.dimension + 1):
        simplices = complex_.simplices(k)
        assert (twin[k].simplices == simplices).all()
        assert (twin[k].attached == complex_.attached(k)).all()
        assert (twin[k].on_hull == complex_.on_hull(k)).all()
        scale = np.abs(twin[k].rho) + weights[simplices].max(axis=1)
        assert (np.abs(twin[k].rho - complex_.rho(k)) <= 2.0**-39 * scale).all()


@pytest.mark.parametrize("d", [4, 5])
@pytest.mark.parametrize("seed", range(9))
def test_more_dimensions_against_the_oracle(d, seed):
    """Grids, generic clouds, and clouds in a hyperplane."""
    rng = np.random.default_rng(seed)
    cloud = rng.integers(-2, 3, (8, d + 1)).astype(float) if seed % 3 else rng.normal(size=(8, d + 1))
    if seed % 3 == 2:
        cloud[:, 3] = cloud[:, 0] - cloud[:, 2]
    points, weights = np.ascontiguousarray(cloud[:, :d]), cloud[:, d].copy()
    oracle = Oracle(points, weights)
    complex_ = alpha_complex(points, weights)
    certify(complex_)
    for k in range(oracle.dimension + 1):
        simplices = oracle.simplices(k)
        assert rows(complex_.simplices(k)) == simplices
        assert complex_.rho(k) == pytest.approx([float(oracle.rho(s)) for s in simplices], rel=1e-11, abs=1e-11)
        if k < oracle.dimension:
            assert complex_.attached(k).tolist() == [oracle.attached(s) for s in simplices]
            assert complex_.on_hull(k).tolist() == [oracle.on_hull(s) for s in simplices]
            lower = [float(oracle.mu_lower(s)) for s in simplices]
            upper = [float(oracle.mu_upper(s)) for s in simplices]
            assert complex_.mu_lower(k) == pytest.approx(lower, rel=1e-11, abs=1e-11)
            assert complex_.mu_upper(k) == pytest.approx(upper, rel=1e-11, abs=1e-11)
    for alpha in (-1.3, 0.3, 0.9, 2.1, 17.3):
        boundary = complex_.boundary(alpha)
        exposed = complex_.simplices(oracle.dimension - 1)[complex_.exposed(oracle.dimension - 1, alpha)]
        assert (np.sort(boundary.facets, axis=1) == exposed).all()
        check_orientation(complex_, boundary, alpha)


# --- the boundary


def check_orientation(complex_, boundary, alpha):
    """Cones from the origin over the oriented regular facets have the volume of the cells that are in."""
    if complex_.dimension < complex_.triangulation.points.shape[1]:
        return
    points, d = complex_.triangulation.points, complex_.dimension
    cells = complex_.simplices(d)[complex_.classify(d, alpha) == INTERIOR]
    center = points.mean(axis=0)
    corners = points[cells]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()
    cones = np.linalg.det(points[boundary.facets[~boundary.singular]] - center)
    assert (-1) ** (d - 1) * cones.sum() * (1 if d % 2 else -1) == pytest.approx(volume, rel=1e-9, abs=1e-200)


@CLOUD
def test_both_ways_to_the_boundary_agree_with_the_classes(name):
    points, weights = cloud(name)
    triangulation = regular_triangulation(points, weights)
    complex_ = alpha_complex(triangulation)
    d = complex_.dimension
    critical = complex_.spectrum()
    alphas = [0.0, *np.quantile(critical, [0, 0.1, 0.3, 0.5, 0.7, 0.9, 1], method="nearest"), critical.mean(), math.inf]
    for alpha in alphas:
        boundary = _boundary_of_levels(Family(triangulation), alpha)
        if d == 3:
            alone = _boundary_alone(Family(triangulation), alpha)
            assert (alone.facets == boundary.facets).all() and (alone.singular == boundary.singular).all()
        kinds = complex_.classify(d - 1, alpha)
        exposed = (kinds == SINGULAR) | (kinds == REGULAR)
        assert (np.sort(boundary.facets, axis=1) == complex_.simplices(d - 1)[exposed]).all()
        assert (boundary.singular == (kinds[exposed] == SINGULAR)).all()
        if name != "nearly flat":  # whose volume is rounding
            check_orientation(complex_, boundary, alpha)


def test_a_single_cell_faces_outward():
    tetrahedron = alpha_complex([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]).boundary(1.0)
    assert rows(tetrahedron.facets) == [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    triangle = alpha_complex([[0, 0], [1, 0], [0, 1]]).boundary(1.0)
    assert rows(triangle.facets) == [(0, 1), (2, 0), (1, 2)]


# --- invariances


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_the_order_of_the_points_does_not_matter(d, data):
    """In general position: else the lower index wins a tie. Attachment is the same set, sizes but for the last bits."""
    seed = data.draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    points, weights = rng.normal(size=(25, d)), rng.normal(size=25)
    order = rng.permutation(25)
    one, two = alpha_complex(points, weights), alpha_complex(points[order], weights[order])
    for k in range(d + 1):
        first = {frozenset(s): (a, r) for s, a, r in zip(rows(one.simplices(k)), one.attached(k), one.rho(k))}
        second = {
            frozenset(order[list(s)].tolist()): (a, r)
            for s, a, r in zip(rows(two.simplices(k)), two.attached(k), two.rho(k))
        }
        assert first.keys() == second.keys()
        assert all(first[s][0] == second[s][0] for s in first)
        assert all(abs(first[s][1] - second[s][1]) <= 1e-11 * (1 + abs(first[s][1])) for s in first)


@CLOUD
@pytest.mark.parametrize("power", [-3, 5])
def test_scaling_by_powers_of_two_scales_sizes_exactly(name, power):
    points, weights = cloud(name)
    weights = np.zeros(len(points)) if weights is None else weights
    one, two = alpha_complex(points, weights), alpha_complex(points * 2.0**power, weights * 4.0**power)
    for k in range(one.dimension + 1):
        assert rows(one.simplices(k)) == rows(two.simplices(k))
        assert (one.rho(k) * 4.0**power == two.rho(k)).all()
        assert (one.attached(k) == two.attached(k)).all()


@pytest.mark.parametrize("d", [2, 3])
def test_exact_translation_and_mirrors_change_nothing(d):
    rng = np.random.default_rng(d)
    points, weights = rng.integers(0, 2**20, (60, d)).astype(float), rng.integers(0, 2**20, 60).astype(float)
    one = alpha_complex(points, weights)
    for other in (points + 2.0**30, points * [-1.0] + 0.0, points[:, ::-1] + 0.0):
        two = alpha_complex(np.ascontiguousarray(other), weights)
        for k in range(d + 1):
            assert rows(one.simplices(k)) == rows(two.simplices(k))
            assert (one.attached(k) == two.attached(k)).all()
            np.testing.assert_allclose(one.rho(k), two.rho(k), rtol=1e-12)


def test_a_plane_in_space_is_the_plane():
    """Planar points have the same complex in the plane, and in three planes of space."""
    rng = np.random.default_rng(2)
    flat, weights = rng.integers(-20, 20, (80, 2)).astype(float), rng.integers(-9, 9, 80).astype(float)
    plane = alpha_complex(flat, weights)
    zero = np.zeros(80)
    for points in (np.c_[flat, zero], np.c_[zero, flat], np.c_[flat[:, :1], zero, flat[:, 1:]]):
        space = alpha_complex(points, weights)
        assert space.dimension == 2
        for k in range(3):
            assert (space.simplices(k) == plane.simplices(k)).all() and (space.rho(k) == plane.rho(k)).all()
            assert (space.attached(k) == plane.attached(k)).all()


# --- peers and data


@pytest.mark.peers
@pytest.mark.parametrize("d", [2, 3])
def test_entries_are_the_filtration_of_gudhi(d):
    gudhi = pytest.importorskip("gudhi")
    rng = np.random.default_rng(d)
    points, weights = rng.normal(size=(120, d)), 0.05 * rng.normal(size=120)
    complex_ = alpha_complex(points, weights)
    tree = gudhi.AlphaComplex(points=points, weights=weights, precision="exact").create_simplex_tree()
    theirs = {tuple(sorted(simplex)): value for simplex, value in tree.get_filtration()}
    ours = {s: v for k in range(d + 1) for s, v in zip(rows(complex_.simplices(k)), complex_.entry(k).tolist())}
    assert ours.keys() == theirs.keys()
    assert all(value == pytest.approx(theirs[s], rel=1e-9, abs=1e-9) for s, value in ours.items())


@pytest.mark.peers
def test_the_simplex_tree_holds_the_entries():
    pytest.importorskip("gudhi")
    complex_ = alpha_complex(*cloud("weighted grid"))
    tree = complex_.to_gudhi_simplex_tree()
    theirs = {tuple(sorted(simplex)): value for simplex, value in tree.get_filtration()}
    ours = {s: v for k in range(4) for s, v in zip(rows(complex_.simplices(k)), complex_.entry(k).tolist())}
    assert theirs == ours
    assert not tree.make_filtration_non_decreasing()


@pytest.mark.data
@pytest.mark.skipif("RECON_DATA" not in os.environ, reason="RECON_DATA is not set")
def test_a_planar_scan_has_a_planar_shape():
    points = np.loadtxt(Path(os.environ["RECON_DATA"]) / "points" / "point_set_2.xyz")[:, :3]
    complex_ = alpha_complex(points)
    assert complex_.dimension == 2
    alpha = 4 * np.median(complex_.rho(2))
    boundary = complex_.boundary(alpha)
    assert boundary.facets.shape[1] == 2 and 0 < len(boundary) < len(complex_.simplices(1))
    assert (complex_.classify(2, alpha) == INTERIOR).any()


# --- adapters


@CLOUD
def test_the_boundary_of_a_boundary_is_nothing(name):
    complex_ = alpha_complex(*cloud(name))
    for k in range(1, complex_.dimension + 1):
        matrix = complex_.boundary_matrix(k)
        assert matrix.shape == (len(complex_.simplices(k - 1)), len(complex_.simplices(k)))
        assert (np.diff(matrix.indptr) == k + 1).all()
        if k > 1:
            assert not (complex_.boundary_matrix(k - 1) @ matrix.astype(np.int64)).count_nonzero()


def test_vertices_have_no_boundary():
    with pytest.raises(InvalidInput, match="vertices have no boundary"):
        alpha_complex(np.eye(3)).boundary_matrix(0)


@pytest.mark.peers
def test_the_graph_of_networkx_has_the_components_of_the_complex():
    networkx = pytest.importorskip("networkx")
    complex_ = alpha_complex(*cloud("in the plane"))
    for alpha in (-0.005, 0.0, 0.002):
        graph = complex_.to_networkx(alpha)
        assert [len(graph), graph.number_of_edges()] == complex_.f_vector(alpha)[:2].tolist()
        assert networkx.number_connected_components(graph) == complex_.betti(alpha)[0]
        assert max([*(e for *_, e in graph.nodes(data="entry")), *(e for *_, e in graph.edges(data="entry"))]) <= alpha
    assert alpha_complex([[1.0, 2.0]]).to_networkx().number_of_nodes() == 1


def test_the_grid_of_pyvista_has_the_simplices_of_the_complex():
    pytest.importorskip("pyvista")
    complex_ = alpha_complex(*cloud("torus"))
    grid = complex_.to_pyvista(0.0)
    assert grid.n_cells == complex_.f_vector(0.0).sum()
    assert (grid.cell_data["rho"] <= 0).all()
    assert [repr(complex_), repr(complex_.boundary(0.0))] == [
        f"AlphaComplex(400 points in 3-D, {len(complex_.simplices(3))} cells of dimension 3)",
        repr(complex_.boundary(0.0)),
    ]


@pytest.mark.parametrize("scale", [1e-160, 1e-250, 1e-300])
def test_sizes_too_small_for_floats_keep_their_signs(scale):
    points = np.random.default_rng(1).random((40, 3)) * scale
    family = alpha_complex(points)
    alone = family.boundary(0.0)
    assert (family.rho(2) > 0).all() and len(alone) == 0
    np.testing.assert_array_equal(family.boundary(0.0).facets, alone.facets)  # now from all levels
    np.testing.assert_array_equal(np.unique(family.classify(2, 0.0)), [0])
