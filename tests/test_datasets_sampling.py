"""Clouds have the statistics that were asked for, and know the truth about themselves."""

from functools import cache

import numpy as np
import pytest
from scipy import stats
from scipy.spatial import cKDTree

import datasets_synthetic
from datasets_synthetic import Sample, Surface, surfaces


@cache
def surface(name: str) -> Surface:
    return datasets_synthetic.surface(name)


def columns(sample: Sample) -> list[np.ndarray]:
    return [sample.points, sample.normals, sample.clean, sample.is_outlier, sample.scan]


# --- seeds ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", surfaces())
def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not(name):
    def ask(rng):
        return surface(name).sample(
            300, density=5, spacing="blue", noise=0.01, noise_kind="isotropic", outliers=0.1, rng=rng
        )

    first, again, other = ask(7), ask(np.random.default_rng(7)), ask(8)
    assert all((a == b).all() for a, b in zip(columns(first), columns(again)))
    assert not (first.points == other.points).all()


def test_the_global_random_state_is_neither_read_nor_moved():
    np.random.seed(1)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    first = surface("torus").sample(100, noise=0.1, outliers=0.1, rng=3).points
    assert (np.random.get_state()[1] == before).all()  # noqa: NPY002
    np.random.seed(2)  # noqa: NPY002
    assert (surface("torus").sample(100, noise=0.1, outliers=0.1, rng=3).points == first).all()


@pytest.mark.parametrize("rng", [None, "1", 1.5, -1, True])
def test_a_seed_that_is_none_is_refused(rng):
    with pytest.raises(ValueError, match="rng"):
        surface("sphere").sample(10, rng=rng)


def test_a_sample_is_its_points_and_cannot_be_written():
    sample = surface("sphere").sample(50, outliers=0.1, rng=0)
    assert (np.asarray(sample) == sample.points).all() and len(sample) == 50
    assert np.asarray(sample, dtype=np.float32).dtype == np.float32
    assert repr(sample) == "Sample(50 points in 3-D, 5 outliers, 1 scan(s))"
    for column in columns(sample):
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 0


# --- where the points go ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", surfaces())
def test_uniform_samples_have_the_moments_of_the_area(name):
    # Flat parts carry their whole weight in one node: exact for 1 alone, so that is what they are asked.
    shape, n = surface(name), 20_000
    foot = shape.draw(n, np.random.default_rng(1))
    rules = [piece.rule(64) for piece in shape.pieces]
    points = np.concatenate([rule.points for rule, _ in rules])
    weights = np.concatenate([w for _, w in rules]) / shape.area
    curved = [np.abs(np.concatenate([rule.curvatures for rule, _ in rules])).max(axis=1) > 1e-9]
    curved.append(np.abs(foot.curvatures).max(axis=1) > 1e-9)
    share = min(weights[curved[0]].sum(), 1.0)
    assert abs(curved[1].mean() - share) <= 4.5 * np.sqrt(share * (1 - share) / n) + 1e-12
    for f in (lambda p: p, lambda p: p**2, lambda p: np.sin(3 * p + 1)):
        values = f(foot.points[curved[1]])
        if len(values):
            expected = weights[curved[0]] @ f(points[curved[0]]) / share
            error = np.abs(values.mean(axis=0) - expected)
            assert (error <= 4.5 * values.std(axis=0) / np.sqrt(len(values)) + 1e-12).all()


def test_a_box_gets_points_by_the_area_of_its_faces_evenly_over_each():
    sample = surface("box").sample(30_000, rng=2)
    size = np.array([1.2, 1.0, 0.8])
    faces = np.array([(sample.normals[:, k] == side).sum() for k in range(3) for side in (-1, 1)])
    areas = np.repeat(np.prod(size) / size, 2)
    assert stats.chisquare(faces, areas / areas.sum() * faces.sum()).pvalue > 1e-4
    top = sample.points[sample.normals[:, 2] == 1]
    for axis in (0, 1):
        assert stats.kstest(top[:, axis] / size[axis] + 0.5, "uniform").pvalue > 1e-4


@pytest.mark.parametrize("spacing", ["random", "blue"])
@pytest.mark.parametrize("ratio", [2, 10, 50])
@pytest.mark.parametrize("name", ["torus", "csg_part", "neck"])
def test_the_density_ratio_along_the_surface_is_the_one_asked_for(name, ratio, spacing):
    shape = surface(name)
    n = 1500 if name == "neck" and spacing == "blue" else 6_000
    points = shape.sample(n, density=ratio, spacing=spacing, rng=3).points
    uniform = shape.draw(200_000, np.random.default_rng(4)).points
    lower, upper = shape.bounds
    axis = int(np.argmax(upper - lower))
    found, area = (np.sort((p[:, axis] - lower[axis]) / (upper - lower)[axis]) for p in (points, uniform))
    wanted = ratio**area / np.sum(ratio**area)
    # The mean of the place is the sufficient statistic of the exponent; the whole distribution is held against, too.
    mean = wanted @ area
    assert abs(found.mean() - mean) < 5 * np.sqrt(wanted @ (area - mean) ** 2 / n)
    places = np.linspace(0.001, 0.999, 200)  # off the faces at both ends
    expected = np.append(0, np.cumsum(wanted))[np.searchsorted(area, places)]
    assert np.abs(expected - np.searchsorted(found, places) / n).max() < 2.5 / np.sqrt(n)


def test_curvature_density_is_proportional_between_its_limits():
    shape = datasets_synthetic.surface("ellipsoid", axes=(1.0, 0.5, 0.25))
    sample = shape.sample(40_000, density="curvature", rng=5)
    uniform = shape.draw(200_000, np.random.default_rng(6))
    edges = np.quantile(np.abs(uniform.curvatures).max(axis=1), np.linspace(0, 1, 9))
    of_sample = np.abs(shape.curvature(sample.points)).max(axis=1)
    found = np.histogram(of_sample, edges)[0]
    least = 1 / np.linalg.norm(np.ptp(shape.bounds, axis=0))
    every = np.abs(uniform.curvatures).max(axis=1)
    wanted = np.histogram(every, edges, weights=np.clip(every, least, 50 * least))[0]
    assert np.abs(found / found.sum() / (wanted / wanted.sum()) - 1).max() < 0.1
    flat = surface("capsule").sample(20_000, density="curvature", rng=7).points
    on_side = np.abs(flat[:, 2]) < 0.6
    assert on_side.mean() == pytest.approx(2 * np.pi * 0.4 * 1.2 / surface("capsule").area, abs=0.02)


def test_a_function_as_density_is_followed_and_leaves_out_where_it_is_zero():
    def density(x: np.ndarray) -> np.ndarray:
        return np.where(x[:, 2] > 0.5, 0.0, np.where(x[:, 2] > 0, 0.25, 1.0))

    z = surface("sphere").sample(20_000, density=density, rng=8).points[:, 2]
    assert z.max() <= 0.5
    assert (z > 0).mean() == pytest.approx(0.125 / 1.125, abs=0.01)
    z = surface("sphere").sample(2_000, density=density, spacing="blue", rng=8).points[:, 2]
    assert z.max() <= 0.5
    assert (z > 0).mean() == pytest.approx(0.125 / 1.125, abs=0.02)


@pytest.mark.parametrize("name", ["sphere", "bumpy_sphere", "mobius_band", "linked_tori", "disk", "neck", "annulus"])
def test_blue_noise_keeps_points_apart_and_leaves_no_gap(name):
    shape, n = surface(name), 1500
    flat = shape.dimension == 2
    # The distance in the tightest packing of n points.
    tight = shape.area / n if flat else np.sqrt(2 / np.sqrt(3) * shape.area / n)
    even, random = (shape.sample(n, spacing=spacing, rng=9).points for spacing in ("blue", "random"))
    nearest_even, nearest_random = (cKDTree(p).query(p, 2)[0][:, 1] for p in (even, random))
    assert len(even) == n
    assert nearest_even.min() > 0.55 * tight
    assert nearest_random.min() < 0.1 * tight
    probes = shape.draw(20_000, np.random.default_rng(10)).points
    assert cKDTree(even).query(probes)[0].max() < 1.2 * tight
    assert cKDTree(random).query(probes)[0].max() > 1.2 * tight


def test_blue_noise_treats_the_sheets_of_a_thin_plate_apart():
    plate = datasets_synthetic.surface("thin_plate", thickness=0.002)
    sample = plate.sample(2000, spacing="blue", rng=11)
    tight = np.sqrt(2 / np.sqrt(3) * plate.area / 2000)
    for up in (-1, 1):
        sheet = sample.points[sample.normals[:, 2] == up]
        assert len(sheet) == pytest.approx(1000, rel=0.05)
        assert cKDTree(sheet).query(sheet, 2)[0][:, 1].min() > 0.55 * tight


@pytest.mark.parametrize("spacing", ["random", "blue"])
def test_holes_are_empty_and_the_count_is_kept(spacing):
    holes = [((1.0, 0.0, 0.0), 0.4), ((0.0, 0.0, -1.0), 0.3)]
    points = surface("sphere").sample(3000, holes=holes, spacing=spacing, rng=12).points
    assert len(points) == 3000
    for center, radius in holes:
        gap = np.linalg.norm(points - center, axis=1).min()
        assert radius <= gap < radius + 0.05


@pytest.mark.parametrize("name", surfaces(3))
def test_scan_lines_lie_in_few_planes_and_are_even(name):
    shape, n, ratio = surface(name), 3000, 9.0
    sample = shape.sample(n, lines=ratio, rng=4)
    assert len(sample) == n and np.abs(shape.distance(sample.points)).max() < 1e-9
    across = np.empty(3)
    across[np.argsort(shape.bounds[0] - shape.bounds[1], kind="stable")] = 1.0, 0.5, 0.3
    height = np.sort(sample.points @ (across / np.linalg.norm(across)))
    step = np.sqrt(shape.area / n / ratio)
    lines = np.split(height, np.flatnonzero(np.diff(height) > 0.3 * step) + 1)
    gaps = np.diff([line.mean() for line in lines])
    assert max(np.ptp(line) for line in lines) < 0.05 * step * ratio  # planes
    assert np.allclose(gaps / gaps.min(), np.round(gaps / gaps.min()), atol=0.02)  # equally far apart
    slope = np.sqrt(1 - (shape.sample(9000, rng=0).normals @ (across / np.linalg.norm(across))) ** 2).mean()
    assert gaps.min() == pytest.approx(ratio * step * slope, rel=0.02)
    nearest = cKDTree(sample.points).query(sample.points, k=2)[0][:, 1]
    assert np.median(nearest) == pytest.approx(0.8 * step, rel=0.2)
    assert (nearest < 0.4 * step).mean() < 0.04  # where lines meet at edges and near poles


def test_curves_in_the_plane_have_no_scan_lines():
    with pytest.raises(ValueError, match="lines"):
        surface("circle").sample(10, lines=3, rng=0)


@pytest.mark.parametrize(
    ("params", "word"),
    [
        ({"n": -1}, "n: "),
        ({"n": 1.5}, "n: "),
        ({"n": True}, "n: "),
        ({"density": "even"}, "density"),
        ({"density": 0.5}, "density"),
        ({"density": float("nan")}, "density"),
        ({"density": lambda x: np.full(len(x), 2.0)}, "density"),
        ({"density": lambda x: np.full(len(x), np.nan)}, "density"),
        ({"density": lambda x: 1.0}, "density"),
        ({"density": lambda x: np.zeros(len(x))}, "nothing to sample"),
        ({"holes": [((0.0, 0.0, 0.0), 2.0)]}, "nothing to sample"),
        ({"holes": [((0.0, 0.0), 1.0)]}, "hole"),
        ({"holes": [1.0]}, "holes"),
        ({"holes": [((0.0, 0.0, 0.0), -1.0)]}, "radius"),
        ({"spacing": "poisson"}, "spacing"),
        ({"lines": 0.5}, "lines"),
        ({"lines": float("nan")}, "lines"),
        ({"lines": "few"}, "lines"),
        ({"lines": 1e300}, "lines"),
        ({"noise": -0.1}, "noise"),
        ({"noise": float("inf")}, "noise"),
        ({"noise_kind": "gauss"}, "noise_kind"),
        ({"outliers": 1.0}, "outliers"),
        ({"outliers": -0.1}, "outliers"),
    ],
)
def test_arguments_that_cannot_be_meant_are_refused_in_one_line(params, word):
    with pytest.raises(ValueError, match=word) as caught:
        surface("sphere").sample(**{"n": 10, "rng": 0, **params})
    assert "\n" not in str(caught.value)


# --- what goes wrong --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["torus", "neck"])
def test_normal_noise_is_gaussian_and_along_the_true_normal(name):
    sample = surface(name).sample(20_000, noise=0.01, rng=13)
    moved = sample.points - sample.clean
    heights = np.einsum("md,md->m", moved, sample.normals)
    assert np.abs(moved - heights[:, None] * sample.normals).max() < 1e-15
    assert stats.kstest(heights / 0.01, "norm").pvalue > 1e-4
    assert np.abs(surface(name).distance(sample.points) - heights).max() < 1e-12
    assert np.abs(surface(name).distance(sample.clean)).max() < 1e-12


def test_isotropic_noise_is_gaussian_in_every_coordinate():
    sample = surface("torus").sample(20_000, noise=0.01, noise_kind="isotropic", rng=14)
    moved = (sample.points - sample.clean) / 0.01
    assert all(stats.kstest(moved[:, axis], "norm").pvalue > 1e-4 for axis in range(3))
    assert np.abs(np.corrcoef(moved.T) - np.eye(3)).max() < 0.03


def test_quantized_coordinates_are_the_nearest_multiples_of_the_step():
    sample = surface("torus").sample(2000, noise=0.125, noise_kind="quantized", outliers=0.1, rng=15)
    assert (sample.points * 8 == np.round(sample.points * 8)).all()
    assert np.abs(sample.points - sample.clean).max() <= 0.0625


def test_outliers_are_the_share_asked_for_uniform_in_a_larger_box_and_marked():
    shape = surface("disk")
    sample = shape.sample(10_000, noise=0.01, outliers=0.3, rng=16)
    assert len(sample) == 10_000 and sample.is_outlier.sum() == 3000
    stray = sample.points[sample.is_outlier]
    assert (sample.clean[sample.is_outlier] == stray).all()
    assert (sample.normals[sample.is_outlier] == 0).all()
    margin = 0.25 * np.sqrt(8)
    half = np.array([1 + margin, 1 + margin, margin])
    for axis in range(3):
        assert stats.kstest(0.5 + 0.5 * stray[:, axis] / half[axis], "uniform").pvalue > 1e-4
    assert np.abs(shape.distance(sample.clean[~sample.is_outlier])).max() < 1e-12


def test_a_misaligned_scan_is_moved_rigidly_and_remembers_where_it_was():
    first, second = surface("torus").sample(500, rng=17), surface("torus").sample(300, rng=18)
    both = first.joined(second)
    assert (both.scan == np.repeat([0, 1], [500, 300])).all()
    slipped = both.moved(both.scan == 1, angle=0.05, shift=0.02, rng=19)
    assert (slipped.points[:500] == both.points[:500]).all()
    assert (slipped.clean == both.clean).all()
    before, after = both.points[500:], slipped.points[500:]
    gaps = [np.linalg.norm(p[:, None] - p[None], axis=2) for p in (before, after)]
    assert np.abs(gaps[0] - gaps[1]).max() < 1e-12
    assert np.linalg.norm(after.mean(axis=0) - before.mean(axis=0)) == pytest.approx(0.02)
    turn = np.linalg.lstsq(before - before.mean(axis=0), after - after.mean(axis=0), rcond=None)[0]
    assert np.arccos((np.trace(turn) - 1) / 2) == pytest.approx(0.05)
    assert np.linalg.det(turn) == pytest.approx(1)
    assert np.abs(slipped.normals[500:] - both.normals[500:] @ turn).max() < 1e-12


def test_moving_in_the_plane_and_moving_nothing():
    circle = surface("circle").sample(100, rng=20)
    turned = circle.moved(np.arange(100), angle=np.pi / 2, rng=0)
    assert np.abs(turned.normals - circle.normals @ [[0, 1], [-1, 0]]).max() < 1e-12
    assert (circle.moved([], angle=1, shift=1, rng=0).points == circle.points).all()


def test_rows_that_are_not_there_are_refused():
    sample = surface("circle").sample(10, rng=21)
    for rows in ([10], [-1], [0.5], [True] * 9, [[0]]):
        with pytest.raises(ValueError, match="rows"):
            sample.where(rows)
        with pytest.raises(ValueError, match="rows"):
            sample.moved(rows, rng=0)
    assert len(sample.where([3, 3, 1])) == 3 and len(sample.where(sample.points[:, 0] > 5)) == 0
    with pytest.raises(ValueError, match="2-D and one in 3-D"):
        sample.joined(surface("sphere").sample(10, rng=0))
    with pytest.raises(ValueError, match="empty"):
        sample.where([]).with_outliers(3, rng=0)
