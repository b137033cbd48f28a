"""Insertion on several threads: cell by cell what one thread makes."""

import numpy as np
import pytest

import datasets_synthetic
import recon
from recon import insertion


def same(a: recon.RegularTriangulation, b: recon.RegularTriangulation) -> None:
    np.testing.assert_array_equal(a.cells, b.cells)
    np.testing.assert_array_equal(a.neighbors, b.neighbors)
    np.testing.assert_array_equal(a.hidden, b.hidden)


def clouds() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Points and weights: generic, flat in places, tied, hidden, crowded."""
    rng = np.random.default_rng(0)
    torus = datasets_synthetic.surface("torus").sample(2000, density=10, noise=1e-3, rng=0).points
    grid = np.stack(np.meshgrid(*[np.arange(12.0)] * 3), axis=-1).reshape(-1, 3)
    ball = rng.normal(size=(1500, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    hub = np.r_[ball, [[0.0, 0.0, 0.0]]]  # one vertex of every cell
    slabs = rng.random((1500, 3)) * [1, 1, 0] + rng.integers(0, 4, (1500, 1)) * [0, 0, 1]
    moment = np.linspace(0, 1, 150)[:, None] ** [[1, 2, 3]]  # every two are neighbours
    return {
        "torus": (torus, np.full(len(torus), 1e-3)),
        "cube": (rng.random((2000, 3)), np.zeros(2000)),
        "grid": (grid, np.zeros(len(grid))),
        "weighted grid": (grid, rng.integers(0, 3, len(grid)).astype(float)),
        "hidden": (rng.random((2000, 3)), rng.random(2000) * 0.05),
        "hub": (hub, np.zeros(len(hub))),
        "four planes": (slabs, np.zeros(len(slabs))),
        "doubled": (np.repeat(rng.random((700, 3)), 2, axis=0), rng.random(1400) * 1e-3),
        "curve": (moment, np.zeros(len(moment))),
        "clump": (np.r_[rng.random((1000, 3)), 0.5 + 1e-9 * rng.random((1000, 3))], np.zeros(2000)),
    }


@pytest.mark.parametrize("name", clouds())
@pytest.mark.parametrize("threads", [2, 3, 8])
def test_threads_do_not_change_the_triangulation(name, threads, monkeypatch):
    points, weights = clouds()[name]
    alone = recon.regular_triangulation(points, weights, threads=1)
    monkeypatch.setattr(insertion, "WORTH", 8)
    monkeypatch.setattr(insertion, "SHARE", 16)  # cells are taken, and put aside, all the time
    same(alone, recon.regular_triangulation(points, weights, threads=threads))


def test_threads_do_the_work(monkeypatch):
    """Most vertices are inserted by slabs, few are left for one thread."""
    points = np.random.default_rng(1).random((20000, 3))
    left = []
    alone = insertion._Insertion.insert_alone

    def counted(self, sequence):
        left.append(len(sequence))
        alone(self, sequence)

    monkeypatch.setattr(insertion._Insertion, "insert_alone", counted)
    monkeypatch.setattr(insertion, "WORTH", 1000)
    several = recon.regular_triangulation(points, threads=4)
    assert sum(left) < 0.2 * len(points)
    same(recon.regular_triangulation(points, threads=1), several)


@pytest.mark.parametrize("room", [1, 200])
def test_threads_that_run_out_of_room_leave_the_rest_to_one(room, monkeypatch):
    points = np.random.default_rng(2).random((3000, 3))
    expected = recon.regular_triangulation(points, threads=1)
    start = insertion._Insertion.__init__

    def cramped(self, *given):
        start(self, *given)
        self.words = self.words[: 8 * (self.taken + room)].copy()

    monkeypatch.setattr(insertion._Insertion, "__init__", cramped)
    monkeypatch.setattr(insertion, "WORTH", 100)
    monkeypatch.setattr(insertion, "SHARE", 64)
    for threads in (1, 4):
        same(expected, recon.regular_triangulation(points, threads=threads))


def test_order_of_rows_changes_nothing_but_their_numbers():
    rng = np.random.default_rng(3)
    points, order = rng.random((1000, 3)), rng.permutation(1000)
    straight, shuffled = recon.regular_triangulation(points), recon.regular_triangulation(points[order])
    np.testing.assert_array_equal(straight.cells, order[shuffled.cells])
    np.testing.assert_array_equal(straight.neighbors, shuffled.neighbors)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_cells_are_positive_and_neighbours_opposite(d):
    points = np.random.default_rng(d).random((300, d))
    found = recon.regular_triangulation(points)
    corners = points[found.cells]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    assert (volume > 0).all()
    for c, beside in enumerate(found.neighbors):
        for k, o in enumerate(beside):
            if o >= 0:
                assert set(np.delete(found.cells[c], k)) < set(found.cells[o])


def test_cells_come_in_the_order_of_their_vertices_along_the_curve():
    for points, weights in clouds().values():
        rank = np.empty(len(points), np.int64)
        rank[insertion.hilbert_order(points)] = np.arange(len(points))
        cells = rank[recon.regular_triangulation(points, weights).cells]
        assert (cells[:, 0] < cells[:, 1]).all() and (cells[:, 1] < cells[:, 2:].min(axis=1)).all()
        first, second, third = np.sort(cells, axis=1)[:, :3].T
        odd = cells[:, 2] > cells[:, 3]  # on which hand of these
        np.testing.assert_array_equal(np.lexsort((odd, third, second, first)), np.arange(len(cells)))


def test_a_bad_number_of_threads_is_refused():
    with pytest.raises(recon.InvalidInput, match="threads"):
        recon.regular_triangulation(np.eye(4), threads=0)
