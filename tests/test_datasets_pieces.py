"""The parts beneath the catalogue: differentiation, closest points by formula, closed forms, rigid motion, quadrature."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import datasets_synthetic
from datasets_synthetic import jets
from datasets_synthetic.ellipsoid import Ellipsoid
from datasets_synthetic.formula import Formula
from datasets_synthetic.parametric import Parametric
from datasets_synthetic.piece import Foot, nearest_of, rejection
from datasets_synthetic.planar import Arc, Segment, disc, rectangle
from datasets_synthetic.solid_pieces import Moved, Revolution

# --- differentiation --------------------------------------------------------------------------------------------------

FORMULAS = [
    (lambda u, v: 2.0 - u * v + 3.0, lambda u, v: 5 - u * v),
    (lambda u, v: jets.sin(u * v) * jets.cos(u) - v, lambda u, v: np.sin(u * v) * np.cos(u) - v),
    (lambda u, v: jets.sqrt(u * u + v * v + 1.0) / v, lambda u, v: np.sqrt(u**2 + v**2 + 1) / v),
    (lambda u, v: 1.0 / (u * v) + u / 3.0 - 2.0 * v, lambda u, v: 1 / (u * v) + u / 3 - 2 * v),
    (lambda u, v: -u / jets.cos(v) - np.float64(2.0) * u, lambda u, v: -u / np.cos(v) - 2 * u),
]


@pytest.mark.parametrize(("of_jets", "plain"), FORMULAS)
def test_jets_carry_exact_derivatives(of_jets, plain):
    at = np.random.default_rng(0).uniform(0.3, 1.2, (50, 2))
    jet = of_jets(*jets.variables(at))
    assert np.abs(jet.value - plain(*at.T)).max() < 1e-14
    h = 1e-4
    for i, e in enumerate(h * np.eye(2)):
        slope = (plain(*(at + e).T) - plain(*(at - e).T)) / (2 * h)
        assert np.abs(jet.first[i] - slope).max() < 1e-5
        for j, f in enumerate(h * np.eye(2)):
            four = plain(*(at + e + f).T) - plain(*(at + e - f).T) - plain(*(at - e + f).T) + plain(*(at - e - f).T)
            assert np.abs(jet.second[i, j] - four / (4 * h * h)).max() < 1e-3
    assert (jet.second == jet.second.swapaxes(0, 1)).all()


# --- closest points by formula ----------------------------------------------------------------------------------------


def parabola(half_width: float = 2.0) -> Formula:
    return Formula(lambda t: (t, t * t), (-half_width,), (half_width,), (65,), (True,))


def test_on_a_parabola_the_closest_point_is_the_least_root_of_the_cubic():
    x = np.random.default_rng(1).uniform(-3, 3, (500, 2))
    found = parabola(10.0).nearest(x)[:, 0]
    for (a, b), t in zip(x, found):
        roots = np.roots([2, 0, 1 - 2 * b, -a])
        real = roots[np.abs(roots.imag) < 1e-7].real
        best = np.hypot(real - a, real**2 - b).min()
        assert np.hypot(t - a, t * t - b) == pytest.approx(best, abs=1e-13)


def test_at_the_focal_point_where_three_roots_fall_together_the_answer_is_still_exact():
    # (0, 1/2) is the centre of curvature of the apex: the distance there is flat to fourth order.
    x = np.array([[0.0, 0.5], [1e-9, 0.5], [0.0, 0.5 + 1e-12], [1e-5, 0.5 - 1e-5]])
    found = parabola().nearest(x)
    distance = np.hypot(found[:, 0] - x[:, 0], found[:, 0] ** 2 - x[:, 1])
    for (a, b), d in zip(x, distance):
        fine = np.linspace(-0.1, 0.1, 200_001)
        assert d <= np.hypot(fine - a, fine**2 - b).min() + 1e-15


def test_on_the_medial_axis_either_foot_is_as_near():
    x = np.column_stack([np.zeros(50), np.linspace(0.6, 3.0, 50)])
    found = parabola(10.0).nearest(x)[:, 0]
    assert np.abs(np.abs(found) - np.sqrt(x[:, 1] - 0.5)).max() < 1e-12


def test_near_the_centre_of_an_almost_circle_the_nearest_seed_is_often_on_the_wrong_side():
    almost = Formula(lambda t: (jets.cos(t), 0.999 * jets.sin(t)), (0.3,), (0.3 + 2 * np.pi,), (124,), (False,))
    heights = np.concatenate([sign * 10.0 ** np.arange(-12, -1) for sign in (1, -1)])
    x = np.column_stack([np.zeros(22), heights])
    found = almost.at(almost.nearest(x))[0]
    assert np.abs(np.linalg.norm(found - x, axis=1) - (0.999 - np.abs(heights))).max() < 1e-14


def test_clamped_ends_are_the_nearest_points_beyond_them():
    found = parabola(1.0).nearest(np.array([[5.0, 0.0], [-5.0, 1.0], [1.0, 1.0]]))[:, 0]
    assert found.tolist() == [1.0, -1.0, 1.0]


def test_a_corner_of_a_clamped_patch_is_found_and_held():
    flat = Formula(lambda u, v: (u, v, 0.0 * u), (0.0, 0.0), (1.0, 1.0), (9, 9), (True, True))
    x = np.array([[2.0, 3.0, 1.0], [-1.0, 0.5, 0.2], [0.3, 0.7, -4.0], [2.0, -1.0, 0.0]])
    assert np.abs(flat.nearest(x) - [[1, 1], [0, 0.5], [0.3, 0.7], [1, 0]]).max() < 1e-14


def test_a_knot_of_many_strands_gives_the_global_minimum():
    knot = datasets_synthetic.surface("trefoil").pieces[0].formula
    rng = np.random.default_rng(2)
    x = np.concatenate([rng.uniform(-1.2, 1.2, (150, 3)), 1e-3 * rng.standard_normal((20, 3)), np.zeros((1, 3))])
    x = np.concatenate([x, np.array([0, 0, 1.0]) * np.linspace(-1, 1, 21)[:, None]])  # the axis of symmetry

    def squared(t, p):
        return ((knot.at(np.atleast_2d(t))[0][0] - p) ** 2).sum()

    found = np.linalg.norm(knot.at(knot.nearest(x))[0] - x, axis=1)
    starts = np.linspace(0, 2 * np.pi, 40)
    for p, d in zip(x, found):
        at_starts = ((knot.at(starts[:, None])[0] - p) ** 2).sum(axis=1)
        least = min(
            minimize_scalar(squared, bracket=None, bounds=(t - 0.2, t + 0.2), args=(p,), method="bounded").fun
            for t in starts[np.argsort(at_starts)[:4]]
        )
        assert d <= np.sqrt(least) + 1e-12


@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("bumpy_sphere", {"amplitude": 0.33, "frequency": 12.0}),
        ("bumpy_sphere", {"amplitude": 0.0}),
        ("wavy_sheet", {"amplitude": 0.3, "frequency": 5.0}),
        ("mobius_band", {"half_width": 0.69}),
        ("trefoil", {"radius": 0.19}),
        ("swiss_roll", {"turns": 5.0, "start": 0.01}),
        ("neck", {"waist": 0.02}),
        ("paraboloid", {"height": 5.0}),
        ("ellipse", {"axes": (1.0, 0.001)}),
        ("ellipsoid", {"axes": (1.0, 0.5, 0.01)}),
        ("genus_2", {"radius": 0.3, "hole": 0.33}),
        ("rounded_box", {"radius": 0.399}),
        ("thin_plate", {"thickness": 1e-3}),
    ],
)
def test_extreme_shapes_keep_an_exact_distance(name, params):
    shape = datasets_synthetic.surface(name, **params)
    rng = np.random.default_rng(3)
    n = 30_000
    samples = shape.draw(n, rng).points
    lower, upper = shape.bounds
    x = np.concatenate([rng.uniform(lower - 0.3, upper + 0.3, (1500, shape.dimension)), samples[:500]])
    x[-250:] += rng.normal(0, 0.02, (250, shape.dimension))
    distance, sampled = np.abs(shape.distance(x)), cKDTree(samples).query(x)[0]
    covering = shape.area * np.log(n) / n if shape.dimension == 2 else np.sqrt(shape.area * np.log(n) / n)
    assert (distance <= sampled + 1e-14).all()
    assert (sampled - distance).max() < covering
    assert np.abs(shape.distance(shape.project(x))).max() < 1e-12


def test_a_bumpy_sphere_without_bumps_is_a_sphere():
    flat = datasets_synthetic.surface("bumpy_sphere", radius=1.0, amplitude=0.0)
    x = np.random.default_rng(4).uniform(-1.5, 1.5, (2000, 3))
    assert np.abs(flat.distance(x) - (np.linalg.norm(x, axis=1) - 1)).max() < 1e-14
    assert flat.area == pytest.approx(4 * np.pi, rel=1e-12)
    assert np.abs(flat.curvature(x) - 1).max() < 1e-6


# --- closed forms -----------------------------------------------------------------------------------------------------


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.sampled_from([0.01, 0.3, 0.5, 1.0, 1.0 + 1e-9, 3.0]), min_size=2, max_size=3),
    st.lists(st.sampled_from([0.0, -0.0, 1e-300, 1e-12, -0.1, 0.25, 0.5, 1.0, -2.0, 1e6]), min_size=3, max_size=3),
)
def test_the_foot_on_an_ellipsoid_is_on_it_and_normal_to_it_and_nearest(axes, x):
    e = np.array(axes)
    x = np.array([x[: len(e)]])
    foot = Ellipsoid(tuple(axes)).nearest(x)
    assert np.abs(((foot.points / e) ** 2).sum() - 1) < 1e-14
    gap = (x - foot.points)[0]
    distance = np.linalg.norm(gap)
    across = gap - (gap @ foot.normals[0]) * foot.normals[0]
    # On the focal disc the foot is a double root, and half of the digits go; the distance keeps them.
    assert np.linalg.norm(across) <= 1e-6 * (1 + distance)
    angles = np.linspace(0, 2 * np.pi, 200)
    if len(e) == 2:
        others = e * np.column_stack([np.cos(angles), np.sin(angles)])
    else:
        polar = np.linspace(0, np.pi, 100)[:, None]
        parts = np.sin(polar) * np.cos(angles), np.sin(polar) * np.sin(angles), np.cos(polar) + 0 * angles
        others = e * np.stack(parts, axis=-1).reshape(-1, 3)
    assert distance <= np.linalg.norm(others - x, axis=1).min() + 1e-13 * (1 + distance)


def test_the_distance_to_a_box_is_the_one_of_the_textbook():
    x = np.random.default_rng(5).uniform(-1, 1, (5000, 3))
    q = np.abs(x) - [0.6, 0.5, 0.4]
    textbook = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    assert np.abs(datasets_synthetic.surface("box").distance(x) - textbook).max() < 1e-15
    rounded = datasets_synthetic.surface("rounded_box", size=(1.2, 1.0, 0.8), radius=0.1)
    q += 0.1
    textbook = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - 0.1
    assert np.abs(rounded.distance(x) - textbook).max() < 1e-15


def test_the_distance_to_a_torus_and_a_capsule_is_the_one_of_the_textbook():
    x = np.random.default_rng(6).uniform(-1.2, 1.2, (5000, 3))
    ring = np.hypot(np.hypot(x[:, 0], x[:, 1]) - 0.7, x[:, 2]) - 0.3
    assert np.abs(datasets_synthetic.surface("torus").distance(x) - ring).max() < 1e-15
    above = np.maximum(np.abs(x[:, 2]) - 0.6, 0)
    stick = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2 + above**2) - 0.4
    assert np.abs(datasets_synthetic.surface("capsule").distance(x) - stick).max() < 1e-15


def test_corners_of_a_rounded_box_are_spheres_its_edges_cylinders_and_its_faces_flat():
    box = datasets_synthetic.surface("rounded_box", size=(1.4, 1.1, 0.8), radius=0.15)
    x = np.array([[1.0, 1.0, 1.0], [-1.0, 0.1, 1.0], [0.1, -1.0, -1.0], [1.0, 1.0, 0.1], [0.0, 0.1, 2.0], [0.1, 2, 0]])
    r = 1 / 0.15
    assert np.abs(box.curvature(x) - [[r, r], [r, 0], [r, 0], [r, 0], [0, 0], [0, 0]]).max() < 1e-12


def test_the_equator_of_a_pretzel_is_as_round_as_its_ball_and_its_outline():
    pretzel = datasets_synthetic.surface("genus_2", radius=0.15, hole=0.27)
    x = np.array([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.4, 0.0, 0.0]])
    r, outline, hole = 1 / 0.15, 1 / 0.6, -1 / (0.27 - 0.15)
    assert np.abs(pretzel.curvature(x) - [[r, outline], [r, 0], [r, hole]]).max() < 1e-12


def test_arcs_and_segments_stop_at_their_ends():
    arc = Arc((1.0, 0.0), 2.0, -0.25 * np.pi, 0.5 * np.pi)
    x = np.array([[5.0, 0.0], [1.0, 5.0], [1.0, -5.0], [-5.0, 0.1], [-5.0, -0.1]])
    end = 1 + np.sqrt(2)
    expected = [[3, 0], [end, np.sqrt(2)], [end, -np.sqrt(2)], [end, np.sqrt(2)], [end, -np.sqrt(2)]]
    assert np.abs(arc.nearest(x).points - expected).max() < 1e-14
    assert np.abs(arc.bounds - [[end, -np.sqrt(2)], [3, np.sqrt(2)]]).max() < 1e-14
    segment = Segment((0.0, 0.0), (0.1, 0.3))
    ends = segment.nearest(np.array([[9.0, 9.0], [-9.0, -9.0]])).points
    assert ends.tolist() == [[0.1, 0.3], [0.0, 0.0]]


def test_a_region_contains_what_its_boundary_says():
    region = rectangle(2.0, 1.0, 0.2).minus(disc(0.2, (0.5, 0.0)), disc(0.1, (-0.5, 0.1)))
    assert region.area == pytest.approx(2 - (4 - np.pi) * 0.04 - np.pi * 0.05, rel=1e-12)
    x = np.random.default_rng(7).uniform(-1.2, 1.2, (20_000, 2))
    foot = region.nearest(x)
    outward = np.einsum("md,md->m", x - foot.points, foot.normals)
    assert (region.contains(x) == (outward < 0)).all()


# --- composition ------------------------------------------------------------------------------------------------------


def test_a_moved_piece_answers_as_the_piece_does():
    rng = np.random.default_rng(8)
    turn, shift = Rotation.random(random_state=8).as_matrix(), rng.standard_normal(3)
    ring = Revolution(Arc((0.7, 0.0), 0.3))
    moved = Moved(ring, turn, shift)
    x = rng.uniform(-1, 1, (1000, 3))
    here, there = ring.nearest(x), moved.nearest(x @ turn.T + shift)
    assert np.abs(there.points - (here.points @ turn.T + shift)).max() < 1e-13
    assert np.abs(there.normals - here.normals @ turn.T).max() < 1e-12
    assert np.abs(there.curvatures - here.curvatures).max() < 1e-10
    inside = moved.draw(1000, rng).points
    assert (inside > moved.bounds[0]).all() and (inside < moved.bounds[1]).all()


def test_of_two_pieces_that_tie_the_first_has_the_point_whichever_box_is_nearer():
    corner, line = Arc((0.0, 0.0), 0.0), Segment((0.0, 0.0), (-1.0, -1.0))
    x = np.array([[1.0, -0.5]])
    radial = x / np.linalg.norm(x)
    assert np.abs(nearest_of([corner, line], x).normals - radial).max() < 1e-15
    assert np.abs(nearest_of([line, corner], x).normals - [-np.sqrt(0.5), np.sqrt(0.5)]).max() < 1e-15


def test_a_formula_and_a_closed_form_of_one_surface_agree():
    def coordinates(u, v):
        r = 0.7 + 0.3 * jets.cos(v)
        return r * jets.cos(u), r * jets.sin(u), 0.3 * jets.sin(v)

    turn = 2 * np.pi
    formula = Parametric(Formula(coordinates, (0.0, 0.0), (turn, turn), (129, 65), (False, False)))
    torus = Revolution(Arc((0.7, 0.0), 0.3))
    x = np.random.default_rng(9).uniform(-1.2, 1.2, (3000, 3))
    x = x[np.abs(np.hypot(np.hypot(x[:, 0], x[:, 1]) - 0.7, x[:, 2])) > 0.01]
    x = x[np.hypot(x[:, 0], x[:, 1]) > 0.01]
    ours, theirs = formula.nearest(x), torus.nearest(x)
    assert np.abs(ours.points - theirs.points).max() < 1e-10
    assert np.abs(ours.normals - theirs.normals).max() < 1e-10
    assert np.abs(ours.curvatures - theirs.curvatures).max() < 1e-8
    assert formula.rule(64)[1].sum() == pytest.approx(torus.rule(64)[1].sum(), rel=1e-12)


@pytest.mark.parametrize("name", [name for name in datasets_synthetic.surfaces()])
def test_no_proposal_is_ever_more_likely_than_certain(name):
    # Rejection is exact only while the bound on the element of area holds everywhere.
    for piece in datasets_synthetic.surface(name).pieces:
        if isinstance(piece, Parametric):
            lower, upper = np.array(piece.formula.lower), np.array(piece.formula.upper)
            parameters = np.random.default_rng(10).uniform(lower, upper, (20_000, len(lower)))
            assert piece._foot(parameters)[1].max() < piece._largest_element


def test_rejection_keeps_the_proportions():
    rng = np.random.default_rng(11)

    def propose(k):
        x = rng.random((k, 1))
        return Foot(x, x, x[:, :0]), x[:, 0]

    drawn = rejection(40_000, propose, rng).points[:, 0]
    assert drawn.mean() == pytest.approx(2 / 3, abs=0.005)
    assert len(drawn) == 40_000
