"""Every surface of the catalogue keeps every promise of `Surface`."""

from functools import cache

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

import datasets_synthetic
from datasets_synthetic import Surface, surfaces

NAMES = surfaces()
CLOSED = surfaces(closed=True)
SMOOTH = [name for name in NAMES if not datasets_synthetic.surface(name).sharp]


@cache
def surface(name: str) -> Surface:
    return datasets_synthetic.surface(name)


def around(shape: Surface, m: int, seed: int) -> np.ndarray:
    """Positions in the bounds enlarged by a quarter of their diagonal on every side."""
    lower, upper = shape.bounds
    margin = 0.25 * np.linalg.norm(upper - lower)
    return np.random.default_rng(seed).uniform(lower - margin, upper + margin, (m, shape.dimension))


def test_the_catalogue_is_whole():
    solids = {
        *("sphere", "ellipsoid", "torus", "capsule", "box", "rounded_box", "cylinder", "cone_frustum", "bumpy_sphere"),
        *("genus_2", "genus_3", "trefoil", "linked_tori", "nested_spheres", "thin_plate", "csg_part"),
    }
    sheets = {"hemisphere", "disk", "paraboloid", "swiss_roll", "wavy_sheet", "mobius_band"}
    curves = {"circle", "ellipse", "annulus", "square", "neck", "spiral"}
    assert set(surfaces(3, closed=True)) == solids
    assert set(surfaces(3, closed=False)) == sheets
    assert set(surfaces(2)) == curves
    assert set(NAMES) == solids | sheets | curves


@pytest.mark.parametrize("name", NAMES)
def test_samples_lie_on_the_surface_and_inside_the_bounds(name):
    shape = surface(name)
    points = shape.sample(2000, rng=1).points
    assert np.abs(shape.distance(points)).max() < 1e-12
    lower, upper = shape.bounds
    assert (points >= lower - 1e-12).all() and (points <= upper + 1e-12).all()
    assert (points.min(axis=0) < lower + 0.1).all() and (points.max(axis=0) > upper - 0.1).all()


@pytest.mark.parametrize("name", NAMES)
def test_the_projection_is_on_the_surface_and_as_far_as_the_distance_says(name):
    shape = surface(name)
    x = around(shape, 2000, 2)
    feet = shape.project(x)
    assert np.abs(shape.distance(feet)).max() < 1e-12
    assert np.abs(np.linalg.norm(x - feet, axis=1) - np.abs(shape.distance(x))).max() < 1e-14
    assert np.abs(shape.project(feet) - feet).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_no_sample_is_nearer_than_the_distance_and_some_sample_is_about_as_near(name):
    shape = surface(name)
    n = 50_000
    tree = cKDTree(shape.draw(n, np.random.default_rng(3)).points)
    x = around(shape, 3000, 4)
    distance, sampled = np.abs(shape.distance(x)), tree.query(x)[0]
    covering = shape.area * np.log(n) / n if shape.dimension == 2 else np.sqrt(shape.area * np.log(n) / n)
    assert (distance <= sampled + 1e-14).all()
    assert (sampled - distance).max() < covering


@pytest.mark.parametrize("name", NAMES)
def test_the_distance_has_slope_one_away_from_the_medial_axis(name):
    shape = surface(name)
    x, h = around(shape, 1500, 5), 1e-6
    gradient, jump = np.empty_like(x), np.zeros(len(x))
    for axis, step in enumerate(h * np.eye(shape.dimension)):
        ahead, behind = shape.distance(x + step), shape.distance(x - step)
        gradient[:, axis] = (ahead - behind) / (2 * h)
        jump = np.maximum(jump, np.linalg.norm(shape.project(x + step) - shape.project(x - step), axis=1))
    # Feet that race have a focal point near, feet that jump a medial axis.
    steady = (jump < 100 * h) & (np.abs(shape.distance(x)) > 1e-3)
    assert steady.mean() > 0.9
    assert np.abs(np.linalg.norm(gradient[steady], axis=1) - 1).max() < 1e-4
    towards = x - shape.project(x)
    direction = towards / shape.distance(x)[:, None]
    assert np.abs(gradient[steady] - direction[steady]).max() < 1e-4


@pytest.mark.parametrize("name", NAMES)
def test_the_normal_leads_straight_off_the_surface(name):
    shape, height = surface(name), 1e-3
    sample = shape.sample(1000, rng=6)
    for side in (1, -1):
        x = sample.points + side * height * sample.normals
        foot = shape.nearest(x)
        # Beside a concave edge another face is nearer.
        straight = np.linalg.norm(foot.points - sample.points, axis=1) < 1e-9
        assert straight.all() if not shape.sharp else straight.mean() > 0.98
        expected = side * height if shape.closed else height
        assert np.abs(shape.distance(x) - expected)[straight].max() < 1e-12
        assert np.abs(foot.normals - sample.normals)[straight].max() < 1e-7
        assert np.abs(np.linalg.norm(foot.normals, axis=1) - 1).max() < 1e-13


@pytest.mark.parametrize("name", NAMES)
def test_curvatures_are_how_the_normal_turns(name):
    shape, h = surface(name), 1e-5
    sample = shape.sample(400, rng=7)
    d = shape.dimension
    basis = np.linalg.svd(sample.normals[:, None, :])[2][:, 1:]
    turns = []
    for side in (1, -1):
        turn = np.empty((len(sample), d - 1, d - 1))
        for k in range(d - 1):
            normals = shape.normal(sample.points + side * h * basis[:, k])
            turn[:, k] = np.einsum("mjd,md->mj", basis, (normals - sample.normals) / (side * h))
        turns.append(turn)
    stated = shape.curvature(sample.points)
    assert stated.shape == (len(sample), d - 1)
    assert (np.diff(stated, axis=1) <= 0).all()
    # Where the two sides disagree, an edge or a jump of the curvature lies within h, or a boundary.
    smooth = np.abs(turns[0] - turns[1]).max(axis=(1, 2)) < 0.01
    assert smooth.mean() > 0.97
    middle = 0.5 * (turns[0] + turns[1])
    measured = np.linalg.eigvalsh(0.5 * (middle + middle.swapaxes(1, 2)))[:, ::-1]
    error = np.abs(measured - stated) / (1 + np.abs(stated).max(axis=1, keepdims=True))
    assert error[smooth].max() < 1e-3


@pytest.mark.parametrize("name", CLOSED)
def test_the_volume_is_the_share_of_positions_inside(name):
    shape, m = surface(name), 40_000
    x = around(shape, m, 8)
    box = np.prod(np.ptp(shape.bounds, axis=0) + 0.5 * np.linalg.norm(np.ptp(shape.bounds, axis=0)))
    share = shape.volume / box
    assert abs((shape.distance(x) < 0).mean() - share) < 4.5 * np.sqrt(share * (1 - share) / m)


@pytest.mark.parametrize("name", NAMES)
def test_the_area_is_the_rate_at_which_a_shell_around_the_surface_grows(name):
    shape, m, thickness = surface(name), 60_000, 0.008
    lower, upper = shape.bounds
    lower, upper = lower - thickness, upper + thickness
    x = np.random.default_rng(9).uniform(lower, upper, (m, shape.dimension))
    share = 2 * thickness * shape.area / np.prod(upper - lower)
    found = (np.abs(shape.distance(x)) < thickness).mean()
    # Edges, boundaries and corners add or take terms of second order in the thickness.
    assert abs(found - share) < 4.5 * np.sqrt(share * (1 - share) / m) + 0.05 * share


@pytest.mark.parametrize("name", [name for name in CLOSED if name in SMOOTH])
def test_total_curvature_is_two_pi_times_the_euler_characteristic(name):
    shape = surface(name)
    total = 0.0
    for piece in shape.pieces:
        foot, weights = piece.rule(96)
        total += weights @ foot.curvatures.prod(axis=1)
    if shape.dimension == 3:
        assert total == pytest.approx(2 * np.pi * shape.euler, abs=1e-8)
    else:  # the tangent turns once around each curve, backwards around a hole
        assert total == pytest.approx(0 if name == "annulus" else 2 * np.pi, abs=1e-8)


def euler_of_cells(full: np.ndarray) -> int:
    """Vertices - edges + faces - cubes of the union of closed grid cells."""
    total = 0
    for kind in np.ndindex((2,) * full.ndim):
        cells = np.pad(full, 1)
        for axis, thin in enumerate(kind):
            if thin:
                ahead = [slice(None)] * full.ndim
                behind = [slice(None)] * full.ndim
                ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
                cells = cells[tuple(ahead)] | cells[tuple(behind)]
        total += (-1) ** (full.ndim - sum(kind)) * int(cells.sum())
    return total


@pytest.mark.parametrize("name", NAMES)
def test_the_topology_is_that_of_the_solid_or_the_thickened_sheet_on_a_grid(name):
    shape = surface(name)
    lower, upper = shape.bounds
    thickness = 0.0 if shape.closed else 0.07
    lower, upper = lower - thickness - 0.01, upper + thickness + 0.01
    cells = np.full(shape.dimension, 46) if shape.closed else np.ceil((upper - lower) / 0.05).astype(int)
    axes = [low + (high - low) * (np.arange(n) + 0.5) / n for low, high, n in zip(lower, upper, cells)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, shape.dimension)
    full = (shape.distance(x) < thickness).reshape(cells)
    euler = euler_of_cells(full)
    bodies = ndimage.label(full)[1]
    cavities = ndimage.label(np.pad(~full, 1, constant_values=True), np.ones((3,) * shape.dimension))[1] - 1
    if not shape.closed:
        assert (euler, bodies, cavities) == (shape.euler, shape.components, 0)
    elif shape.dimension == 3:
        assert (2 * euler, bodies + cavities) == (shape.euler, shape.components)
    else:
        assert (bodies - cavities, bodies + cavities) == (euler, shape.components)


@pytest.mark.parametrize("name", NAMES)
def test_euler_genus_and_boundary_fit_together(name):
    shape = surface(name)
    if shape.dimension == 2:
        assert shape.euler == shape.boundary_loops // 2
    else:
        handles = 2 * shape.genus if shape.orientable else shape.genus
        assert shape.euler == 2 * shape.components - handles - shape.boundary_loops
    assert shape.closed == (shape.boundary_loops == 0)


@pytest.mark.parametrize("name", NAMES)
def test_the_normal_is_continuous_unless_there_are_edges_or_one_side(name):
    shape = surface(name)
    foot = shape.draw(20_000, np.random.default_rng(10))
    pairs = cKDTree(foot.points).query_pairs(0.02, output_type="ndarray")
    cosines = np.einsum("md,md->m", *(foot.normals[pairs[:, k]] for k in (0, 1)))
    assert (cosines.min() < 0.5) == (shape.sharp or not shape.orientable)


def test_a_mobius_band_flips_its_normal_at_one_rung_alone():
    shape = surface("mobius_band")
    foot = shape.draw(20_000, np.random.default_rng(11))
    pairs = cKDTree(foot.points).query_pairs(0.02, output_type="ndarray")
    flipped = np.einsum("md,md->m", *(foot.normals[pairs[:, k]] for k in (0, 1))) < 0
    assert flipped.any()
    at_flip = foot.points[pairs[flipped].ravel()]
    assert (np.abs(at_flip[:, 1]) < 0.02).all() and (at_flip[:, 0] > 0).all()


def test_open_surfaces_have_no_sign_and_no_volume():
    for name in surfaces(closed=False):
        assert (surface(name).distance(around(surface(name), 500, 12)) >= 0).all()
        assert np.isnan(surface(name).volume)


@pytest.mark.parametrize("name", NAMES)
def test_no_position_at_all_and_far_away_positions_have_answers(name):
    shape = surface(name)
    none = np.empty((0, shape.dimension))
    assert shape.distance(none).shape == (0,)
    assert shape.curvature(none).shape == (0, shape.dimension - 1)
    assert len(shape.sample(0, rng=0)) == 0
    away = np.random.default_rng(13).standard_normal((20, shape.dimension))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    for scale in (1e3, 1e8, 1e50):
        assert np.abs(shape.distance(scale * away) / scale - 1).max() < 2 / scale + 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_the_places_of_highest_symmetry_have_answers(name):
    shape = surface(name)
    lower, upper = shape.bounds
    steps = np.stack(np.meshgrid(*[[-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0]] * shape.dimension), axis=-1)
    x = 0.5 * (lower + upper) + 0.5 * (upper - lower) * steps.reshape(-1, shape.dimension)
    x = np.concatenate([x, -x, 0.0 * x[:1]])
    foot = shape.nearest(x)
    for array in (foot.points, foot.normals, foot.curvatures, shape.distance(x)):
        assert np.isfinite(array).all()
    assert np.abs(shape.distance(foot.points)).max() < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_positions_are_checked(name):
    shape = surface(name)
    d = shape.dimension
    bad = [np.zeros(d), np.zeros((2, d + 1)), [[np.nan] * d], [[np.inf] * d], [["a"] * d], [[1e200] * d], [[0.0], []]]
    for x in bad:
        for ask in (shape.distance, shape.normal, shape.curvature, shape.project):
            with pytest.raises(ValueError, match=r"^x: "):
                ask(x)


def test_an_unknown_surface_is_refused_with_the_names_there_are():
    with pytest.raises(KeyError, match=r"no surface 'spher'; there are sphere, ellipsoid"):
        datasets_synthetic.surface("spher")
    with pytest.raises(ValueError, match="dimension"):
        surfaces(4)


@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("sphere", {"radius": 0.0}),
        ("sphere", {"radius": float("nan")}),
        ("sphere", {"radius": "1"}),
        ("sphere", {"radios": 1.0}),
        ("csg_part", {"size": 1.0}),
        ("ellipsoid", {"axes": (1.0, 1.0)}),
        ("ellipsoid", {"axes": (1.0, 1.0, -1.0)}),
        ("ellipse", {"axes": 1.0}),
        ("torus", {"major": 0.3, "minor": 0.3}),
        ("capsule", {"radius": 1.0, "length": 2.0}),
        ("box", {"size": (1.0, 1.0)}),
        ("rounded_box", {"radius": 0.4}),
        ("cone_frustum", {"top": 0.0}),
        ("bumpy_sphere", {"amplitude": 0.5}),
        ("bumpy_sphere", {"frequency": 31.0}),
        ("bumpy_sphere", {"amplitude": 0.3, "frequency": 20.0}),
        ("genus_2", {"radius": 0.3}),
        ("genus_2", {"hole": 0.4}),
        ("genus_3", {"hole": 0.1}),
        ("trefoil", {"radius": 0.2}),
        ("linked_tori", {"minor": 0.3}),
        ("nested_spheres", {"inner": 1.0}),
        ("thin_plate", {"thickness": 0.0}),
        ("paraboloid", {"height": -1.0}),
        ("swiss_roll", {"turns": 0.0}),
        ("wavy_sheet", {"hole": 1.0}),
        ("wavy_sheet", {"amplitude": 0.5}),
        ("mobius_band", {"half_width": 0.7}),
        ("annulus", {"inner": 2.0}),
        ("neck", {"waist": 0.01}),
        ("neck", {"waist": 1.0}),
    ],
)
def test_sizes_that_make_no_surface_are_refused_in_one_line(name, params):
    with pytest.raises(ValueError) as caught:
        datasets_synthetic.surface(name, **params)
    assert "\n" not in str(caught.value)
