"""The regular triangulation against its definition, in exact arithmetic, on input chosen to be degenerate."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle
from scipy.spatial import ConvexHull

from recon import InvalidInput, certify, regular_triangulation


def cell_set(triangulation) -> list[tuple[int, ...]]:
    """Cells as ascending tuples, sorted."""
    return sorted(map(tuple, np.sort(triangulation.cells, axis=1).tolist()))


def check_arrays(triangulation) -> None:
    """Shapes, types, neighbours that return the link over the same facet, hidden the complement of the vertices."""
    t = triangulation
    width = t.dimension + 1
    assert t.cells.dtype == t.neighbors.dtype == np.int32 and t.hidden.dtype == np.int64
    assert t.cells.shape == t.neighbors.shape == (len(t.cells), width)
    assert t.cells.flags.c_contiguous and t.neighbors.flags.c_contiguous
    assert sorted({*t.cells.ravel().tolist(), *t.hidden.tolist()}) == list(range(len(t.points)))
    assert not set(t.cells.ravel().tolist()) & set(t.hidden.tolist())
    assert (np.diff(t.hidden) > 0).all()
    for i, (cell, row) in enumerate(zip(t.cells.tolist(), t.neighbors.tolist(), strict=True)):
        for k, j in enumerate(row):
            if j >= 0:
                facet = set(cell) - {cell[k]}
                back = [m for m in range(width) if t.neighbors[j, m] == i]
                assert [set(t.cells[j].tolist()) - {t.cells[j, m].item()} for m in back] == [facet]


def check_against_definition(points, weights=None):
    oracle = Oracle(points, weights)
    t = regular_triangulation(points, weights)
    check_arrays(t)
    assert t.dimension == oracle.dimension
    assert cell_set(t) == oracle.cells
    assert t.hidden.tolist() == oracle.hidden
    assert all(oracle.oriented(cell) == 1 for cell in t.cells.tolist())
    return t


# --- random degeneracy -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("reach", [1, 3])
@pytest.mark.parametrize("weighted", [False, True])
def test_small_integers_give_the_cells_of_the_definition(d, reach, weighted):
    """Cospherical, coplanar, collinear, duplicate, hidden: most of the time, all at once."""
    rng = np.random.default_rng([d, reach, weighted])
    for _ in range(150):
        n = rng.integers(1, 10)
        points = rng.integers(-reach, reach + 1, (n, d)).astype(float)
        weights = rng.integers(-reach, reach + 1, n).astype(float) if weighted else None
        check_against_definition(points, weights)


@pytest.mark.parametrize("n", [12, 18])
def test_larger_sets_of_integers(n):
    rng = np.random.default_rng(n)
    for _ in range(6):
        points = rng.integers(-2, 3, (n, 3)).astype(float)
        check_against_definition(points, rng.integers(-2, 3, n) * float(rng.integers(0, 2)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_tens_of_thousands_of_small_cases(seed):
    rng = np.random.default_rng([2024, seed])
    for _ in range(600):
        d, n, reach = rng.integers(1, 4), rng.integers(1, 9), rng.integers(1, 4)
        points = rng.integers(-reach, reach + 1, (n, d)).astype(float)
        scale = 2.0 ** rng.integers(-100, 100)
        weights = rng.integers(-reach, reach + 1, n).astype(float) * rng.integers(0, 2)
        check_against_definition(points * scale, weights * scale * scale)


coordinate = st.integers(-3, 3).map(float)
weight = st.one_of(st.integers(-4, 4).map(float), st.sampled_from([1e-300, -1e-300, 1e150, -1e150, 1e-17, 0.1]))


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_whatever_hypothesis_finds(data):
    d = data.draw(st.integers(1, 3))
    points = data.draw(st.lists(st.lists(coordinate, min_size=d, max_size=d), min_size=1, max_size=8))
    weights = data.draw(st.lists(weight, min_size=len(points), max_size=len(points)))
    check_against_definition(points, weights)


def test_ulp_grids():
    """Neighbouring floats around numbers that binary cannot hold, where every difference is a few units."""
    rng = np.random.default_rng(4)
    for base in ([1 / 3, 24.0, 0.1], [1e-3, 5e5, 5.4e6], [1e12, -1e12, 1e-12]):
        base = np.array(base)
        for _ in range(25):
            points = base + rng.integers(-2, 3, (8, 3)) * np.spacing(base)
            check_against_definition(points, rng.choice([0.0, np.spacing(base).min() ** 2], 8))


def test_any_exponent():
    """Denormals, the largest admitted numbers, and both at once."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        grid = rng.integers(-2, 3, (7, 3)).astype(float)
        check_against_definition(grid * 5e-324)
        check_against_definition(grid * 2.0**-1000, rng.choice([0.0, 5e-324], 7))
        check_against_definition(grid * 2.0**330, rng.integers(-2, 3, 7) * 2.0**660)
        check_against_definition(
            np.ldexp(grid, rng.integers(-1074, 330, grid.shape)), rng.choice([0, 1e200, -5e-324], 7)
        )
        check_against_definition(
            np.ldexp(grid, rng.integers(-30, 30, grid.shape)), np.ldexp(1.0, rng.integers(-60, 60, 7))
        )


@pytest.mark.parametrize("d", [2, 3])
def test_wild_weights(d):
    """Heavy points hide whom they cover, light ones hide themselves."""
    rng = np.random.default_rng(6)
    for _ in range(40):
        points = rng.integers(-3, 4, (8, d)).astype(float)
        check_against_definition(points, rng.choice([0.0, 1e150, -1e150, 1e-150, 5.0, -20.0, 7.0], 8))


# --- points that span less than their space -----------------------------------------------------------------------------


def test_a_spot_is_one_vertex():
    t = check_against_definition([[1.0, 2.0, 3.0]] * 5, [0.0, 2.0, 7.0, 7.0, 1.0])
    assert t.cells.tolist() == [[2]] and t.hidden.tolist() == [0, 1, 3, 4] and t.neighbors.tolist() == [[-1]]


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -1, 0), (0, 2, 3), (3, -2, 1)])
def test_points_of_a_line(direction):
    rng = np.random.default_rng(7)
    for _ in range(30):
        steps = rng.integers(-4, 5, (9, 1)).astype(float)
        check_against_definition(1.0 + steps * direction, rng.integers(-20, 21, 9).astype(float))


@pytest.mark.parametrize("u", [(1, 0, 0), (0, 1, 0), (1, 1, 0), (2, -1, 3)])
@pytest.mark.parametrize("v", [(0, 0, 1), (0, 1, 1), (1, 0, 2), (1, 1, 1)])
def test_points_of_a_plane(u, v):
    rng = np.random.default_rng(8)
    for _ in range(12):
        points = 0.5 + rng.integers(-2, 3, (9, 2)).astype(float) @ np.array([u, v], float)
        check_against_definition(points, rng.integers(-5, 6, 9) * float(rng.integers(0, 2)))


def test_a_plane_in_space_is_triangulated_as_in_the_plane():
    rng = np.random.default_rng(9)
    flat = rng.normal(size=(400, 2))
    weights = rng.uniform(0, 0.01, 400)
    expected = cell_set(regular_triangulation(flat, weights))
    for axes in ([0, 1], [1, 2], [2, 0]):
        points = np.full((400, 3), 0.3)
        points[:, axes] = flat
        assert cell_set(regular_triangulation(points, weights)) == expected


# --- theorems ----------------------------------------------------------------------------------------------------------


def degenerate_cloud(rng, n):
    """A grid with a sphere, coplanar slabs, duplicates and weights: exact in a few bits."""
    points = rng.integers(-4, 5, (n, 3)).astype(float)
    points[: n // 4, 2] = 2.0
    points[n // 4 : n // 2] = points[: n // 2 - n // 4]
    return points, rng.integers(0, 6, n) * 0.5


def test_the_order_of_the_input_only_renames():
    """With distinct power the names of the points do not matter; with ties, the names decide and nothing else."""
    rng = np.random.default_rng(10)
    for d in (1, 2, 3):
        points, weights = rng.normal(size=(300, d)), rng.uniform(0, 0.05, 300)
        expected = cell_set(regular_triangulation(points, weights))
        for _ in range(4):
            order = rng.permutation(300)
            t = regular_triangulation(points[order], weights[order])
            assert sorted(tuple(sorted(cell)) for cell in order[t.cells].tolist()) == expected


def test_the_order_of_insertion_does_not_matter(monkeypatch):
    """Ties are broken by input row, whatever the order in which the kernel sees the points."""
    from recon import insertion

    rng = np.random.default_rng(11)
    for d in (2, 3):
        points, weights = degenerate_cloud(rng, 300)
        points = points[:, :d]
        expected = regular_triangulation(points, weights)
        certify(expected)
        for _ in range(5):
            order = rng.permutation(300)
            monkeypatch.setattr(insertion, "hilbert_order", lambda points, order=order: order)
            t = regular_triangulation(points, weights)
            assert cell_set(t) == cell_set(expected) and t.hidden.tolist() == expected.hidden.tolist()
        monkeypatch.undo()


def test_same_input_same_bytes():
    points, weights = degenerate_cloud(np.random.default_rng(12), 500)
    first, second = (regular_triangulation(points, weights) for _ in range(2))
    assert first.cells.tobytes() == second.cells.tobytes()
    assert first.neighbors.tobytes() == second.neighbors.tobytes()


def test_exact_transformations_change_nothing():
    """Scaling by powers of two, exact translation, mirroring, and a constant added to all weights."""
    points, weights = degenerate_cloud(np.random.default_rng(13), 400)
    expected = cell_set(regular_triangulation(points, weights))
    for k in (-300, -40, 5, 300):
        assert cell_set(regular_triangulation(points * 2.0**k, weights * 4.0**k)) == expected
    for offset in ([5e5, 5.4e6, 200.0], [-(2.0**40), 2.0**30, 0.5]):
        assert cell_set(regular_triangulation(points + offset, weights)) == expected
    for constant in (-1024.0, 2.0**30):
        assert cell_set(regular_triangulation(points, weights + constant)) == expected
    for mirror in ([-1, 1, 1], [-1, -1, -1]):
        assert cell_set(regular_triangulation(points * mirror, weights)) == expected
    assert cell_set(regular_triangulation(points[:, [2, 0, 1]], weights)) == expected


def test_of_duplicates_the_heaviest_then_the_first_survives():
    rng = np.random.default_rng(14)
    spots = rng.normal(size=(40, 3))
    points = np.repeat(spots, 5, axis=0)
    weights = rng.integers(0, 3, 200) * 1e-9
    t = regular_triangulation(points, weights)
    certify(t)
    best = [5 * i + np.argmax(weights[5 * i : 5 * i + 5]) for i in range(40)]
    assert np.unique(t.cells).tolist() == best
    assert len(t.hidden) == 160


@pytest.mark.parametrize("place", ["first", "last"])
def test_a_heavy_point_hides_whom_it_covers(monkeypatch, place):
    """Whether it comes first, or last and sweeps away thousands of cells at once, so that buffers must grow."""
    from recon import insertion

    points = np.random.default_rng(15).normal(size=(3000, 3))
    points[:8] = 10.0 * (np.arange(8)[:, None] >> np.arange(3) & 1) - 5.0
    points[8] = 0.0
    weights = np.zeros(3000)
    weights[8] = 100.0
    order = np.append(8, np.delete(np.arange(3000), 8))
    order = order if place == "first" else order[::-1]
    monkeypatch.setattr(insertion, "hilbert_order", lambda points: order)
    monkeypatch.setattr(insertion, "rounds", lambda n, present: [np.setdiff1d(np.arange(n), present).astype(np.uint32)])
    t = regular_triangulation(points, weights)
    certify(t)
    assert len(t.hidden) > 2900 and 8 in t.cells


# --- input that others fail on ------------------------------------------------------------------------------------------


def hard_clouds():
    rng = np.random.default_rng(16)
    grid = np.stack(np.meshgrid(*[np.arange(7.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    sphere = rng.normal(size=(600, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    angle = np.linspace(0, 6, 300)
    yield "grid", grid, None
    yield "tenths", grid / 10, None
    yield "body-centred grid", np.concatenate([grid, grid + 0.5]), None
    yield "weighted grid", grid, rng.integers(0, 2, len(grid)) * 0.5
    yield "sphere", sphere, None
    yield "sphere in single precision", sphere.astype(np.float32).astype(float), None
    yield "sphere and centre", np.vstack([sphere, np.zeros((1, 3))]), np.append(np.zeros(600), 0.9)
    yield "two slabs", np.column_stack([rng.integers(0, 15, (400, 2)), rng.integers(0, 2, 400)]).astype(float), None
    yield "almost a plane", np.column_stack([rng.uniform(size=(400, 2)), rng.normal(size=400) * 1e-16]), None
    yield "tilted plane, rounded", (tilted := rng.uniform(size=(400, 2)) @ rng.normal(size=(2, 3))), None
    yield "tilted plane, weighted", tilted, rng.uniform(0, 0.01, 400)
    yield "line, rounded", np.linspace(0, 1, 200)[:, None] * [1 / 3, 0.7, 1.1], None
    yield "cylinder", np.column_stack([np.cos(angle), np.sin(angle), np.arange(300) % 10]), None
    yield (
        "two skew lines",
        np.vstack([np.linspace(0, 1, 40)[:, None] * [1, 0, 0], [0, 0, 1] + np.linspace(0, 1, 40)[:, None] * [0, 1, 0]]),
        None,
    )
    yield "utm", np.array([5e5, 5.4e6, 200]) + np.round(rng.uniform(0, 50, (500, 3)), 2), None
    yield "tiny", rng.normal(size=(400, 3)) * 1e-12, rng.uniform(0, 1e-26, 400)
    yield "huge", rng.normal(size=(400, 3)) * 1e12, rng.uniform(0, 1e22, 400)
    yield "smallest", rng.integers(-9, 10, (300, 3)) * 5e-324, None
    yield "largest", rng.uniform(-1, 1, (100, 3)) * 1e100, rng.uniform(-1, 1, 100) * 1e200
    yield "outlier", np.vstack([rng.normal(size=(500, 3)), [[1e90, 0, 0]]]), None
    yield "nested scales", np.vstack([rng.normal(size=(60, 3)) * 10.0**-k for k in range(0, 60, 6)]), None
    yield "wild weights", rng.normal(size=(400, 3)), rng.choice([0.0, 1e-150, -1e150, -1.0], 400)
    yield "quantised scan", np.round(sphere * 100) / 100, None
    yield (
        "all on one circle but the poles",
        np.vstack([np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [[0, 0, 1], [0, 0, -1]]]),
        None,
    )


@pytest.mark.parametrize(("points", "weights"), [pytest.param(p, w, id=name) for name, p, w in hard_clouds()])
def test_hard_clouds_are_certified(points, weights):
    t = regular_triangulation(points, weights)
    certify(t)


@pytest.mark.parametrize("d", [2, 3])
def test_random_clouds_are_certified(d):
    rng = np.random.default_rng(17)
    t = regular_triangulation(rng.normal(size=(4000, d)), rng.uniform(0, 0.02, 4000))
    certify(t)


# --- other programs -----------------------------------------------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize("d", [2, 3])
def test_general_position_agrees_with_gudhi(d):
    gudhi = pytest.importorskip("gudhi")
    rng = np.random.default_rng(18)
    points, weights = rng.normal(size=(3000, d)), rng.uniform(0, 0.02, 3000)
    tree = gudhi.AlphaComplex(points=points, weights=weights, precision="exact").create_simplex_tree()
    theirs = sorted(tuple(sorted(s)) for s, _ in tree.get_skeleton(d) if len(s) == d + 1)
    assert theirs == cell_set(regular_triangulation(points, weights))


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_general_position_agrees_with_qhull(d):
    rng = np.random.default_rng(19)
    points, weights = rng.normal(size=(2000, d)), rng.uniform(0, 0.02, 2000) ** 2
    hull = ConvexHull(np.column_stack([points, (points**2).sum(axis=1) - weights]), qhull_options="Qt")
    lower = hull.simplices[hull.equations[:, d] < 0]
    expected = {tuple(cell) for cell in np.sort(lower, axis=1).tolist()}
    found = np.sort(regular_triangulation(points, weights).cells, axis=1).tolist()
    assert {tuple(cell) for cell in found} == expected


def test_malformed_input_is_refused():
    for points, weights in (
        ([[0.0, np.nan]], None),
        ([[np.inf, 0.0]], None),
        ([], None),
        ([1.0, 2.0], None),
        ([[0.0], [1.0]], [0.0]),
        ([[0.0]], [np.nan]),
        ([[1e101]], None),
        ([[1.0]], [1e201]),
        ([["a"]], None),
    ):
        with pytest.raises(InvalidInput):
            regular_triangulation(points, weights)
