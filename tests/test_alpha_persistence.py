"""Betti numbers and barcodes for all alpha at once: against ranks, against GUDHI, and in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import betti_numbers

from recon import EXTERIOR, alpha_complex, persistence
from recon._kernels.voids import reduce_columns


def rows(array) -> list[tuple[int, ...]]:
    return list(map(tuple, array.tolist()))


def lattice(d, low=-3, high=3, n=9):
    spot = st.tuples(*[st.integers(low, high)] * d, st.integers(low, high))
    return st.lists(spot, min_size=1, max_size=n).map(lambda spots: np.array(spots, float))


def in_complex(complex_, alpha) -> set[tuple[int, ...]]:
    return {
        simplex
        for k in range(complex_.dimension + 1)
        for simplex, kind in zip(rows(complex_.simplices(k)), complex_.classify(k, alpha))
        if kind != EXTERIOR
    }


def sphere(n):
    """Points spread evenly over the unit sphere, along a spiral."""
    z = (2 * np.arange(n) + 1) / n - 1
    turn = np.pi * (1 + 5**0.5) * np.arange(n)
    return np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_betti_numbers_are_ranks_of_boundary_matrices(d, data):
    cloud = data.draw(lattice(d))
    complex_ = alpha_complex(cloud[:, :d], cloud[:, d])
    critical = complex_.spectrum()
    alphas = np.unique([critical[0] - 1, *critical, *(critical[1:] + critical[:-1]) / 2])
    counted, numbers = complex_.f_vector(alphas), complex_.betti(alphas)
    for alpha, f_vector, betti in zip(alphas, counted.tolist(), numbers.tolist()):
        there = in_complex(complex_, alpha)
        assert f_vector == [sum(len(s) == k + 1 for s in there) for k in range(complex_.dimension + 1)]
        assert betti == betti_numbers(there, complex_.dimension)[: max(1, complex_.dimension)]
        assert complex_.betti(alpha).tolist() == betti
        assert complex_.euler(alpha) == sum((-1) ** k * b for k, b in enumerate(betti))


def test_betti_numbers_in_four_dimensions():
    cloud = np.random.default_rng(5).integers(-2, 3, (9, 5)).astype(float)
    complex_ = alpha_complex(cloud[:, :4], cloud[:, 4])
    for alpha in complex_.spectrum():
        there = in_complex(complex_, alpha)
        assert complex_.betti(alpha).tolist() == betti_numbers(there, 4)[:4]


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_barcodes_count_the_betti_numbers(d, data):
    """In three dimensions tunnels are counted by Euler and paired by reduction: two ways, one number."""
    cloud = data.draw(lattice(d))
    complex_ = alpha_complex(cloud[:, :d], cloud[:, d])
    for k in range(max(1, complex_.dimension)):
        bars = complex_.persistence(k)
        assert (bars[:, 0] < bars[:, 1]).all() and rows(bars) == sorted(rows(bars))
        assert np.isinf(bars[:, 1]).sum() == (k == 0)
        for alpha in complex_.spectrum():
            alive = ((bars[:, 0] <= alpha) & (alpha < bars[:, 1])).sum()
            assert alive == complex_.betti(alpha)[k]
    assert complex_.persistence(complex_.dimension + 1).shape == (0, 2)
    voids = complex_.voids()  # in two dimensions and more these are the bars of dimension d - 1
    if complex_.dimension > 1:
        assert sorted(zip(voids.birth, voids.death)) == rows(complex_.persistence(complex_.dimension - 1))


@pytest.mark.peers
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("grid", [False, True])
def test_barcodes_are_those_of_gudhi(d, grid):
    pytest.importorskip("gudhi")
    rng = np.random.default_rng(d)
    points, weights = rng.normal(size=(300, d)), 0.1 * rng.normal(size=300)
    if grid:
        points, weights = rng.integers(-4, 5, (300, d)).astype(float), rng.integers(0, 3, 300).astype(float)
    complex_ = alpha_complex(points, weights)
    tree = complex_.to_gudhi_simplex_tree()
    tree.compute_persistence(homology_coeff_field=2, min_persistence=0)
    for k in range(d):
        theirs = tree.persistence_intervals_in_dimension(k).reshape(-1, 2)
        theirs = theirs[theirs[:, 0] < theirs[:, 1]]
        assert rows(complex_.persistence(k)) == sorted(rows(theirs))
    assert len(complex_.persistence(1)) > 20


def test_a_sphere_has_one_void_that_matters():
    complex_ = alpha_complex(sphere(800))
    voids = complex_.voids()
    assert voids.death[0] == pytest.approx(1, rel=1e-9) and voids.birth[0] < 0.1
    assert voids.parent[0] == -1
    triangulation = complex_.triangulation
    assert complex_.triangulation.cells[voids.cell[0]].shape == (4,)
    cell_rho = dict(zip(map(frozenset, complex_.simplices(3).tolist()), complex_.rho(3)))
    for cell, death in zip(voids.cell, voids.death):
        assert cell_rho[frozenset(triangulation.cells[cell].tolist())] == death
    assert (complex_.entry(2)[voids.facet] == voids.birth).all()
    assert (np.diff(voids.death) <= 0).all()


def test_voids_are_split_from_deeper_ones():
    """Two shells, one inside the other: the space between them is a void, and so is the inner ball."""
    points = np.concatenate([sphere(700), 0.5 * sphere(250)])
    complex_ = alpha_complex(points)
    voids = complex_.voids()
    deep = np.flatnonzero(voids.death > 1.5 * voids.birth)  # all others are rounding, as points of a sphere make them
    assert np.sqrt(voids.death[deep]).round(1).tolist() == [0.5, 0.3] and (np.sqrt(voids.birth[deep]) < 0.2).all()
    alpha = 0.2**2
    assert complex_.betti(alpha).tolist() == [2, 0, 2]
    assert len(voids) == len(complex_.persistence(2))
    child = voids.parent >= 0
    assert (voids.parent[child] < np.flatnonzero(child)).all()
    assert (voids.birth[voids.parent[child]] <= voids.birth[child]).all()
    assert (voids.death[voids.parent[child]] >= voids.death[child]).all()


def test_a_square_ring_in_the_plane():
    ring = [[x, y] for x in range(5) for y in range(5) if x in (0, 4) or y in (0, 4)]
    complex_ = alpha_complex(np.array(ring, float))
    assert complex_.persistence(0).tolist() == [[0, 0.25]] * 15 + [[0, math.inf]]
    holes = complex_.persistence(1)
    assert holes[0].tolist()[0] == 0.25 and len(holes) >= 1
    assert complex_.betti(0.25).tolist() == [1, 1] and complex_.betti(holes[:, 1].max()).tolist() == [1, 0]
    voids = complex_.voids()
    assert sorted(zip(voids.birth, voids.death)) == rows(holes)


def test_torus_has_two_tunnels_and_a_void():
    u, v = np.meshgrid(np.arange(40) * 2 * np.pi / 40, np.arange(16) * 2 * np.pi / 16)
    rng = np.random.default_rng(0)
    u, v = u.ravel() + 0.02 * rng.normal(size=640), v.ravel() + 0.02 * rng.normal(size=640)
    ring = 1 + 0.4 * np.cos(v)
    complex_ = alpha_complex(np.column_stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)]))
    assert complex_.betti(0.16**2).tolist() == [1, 2, 1]
    tunnels = complex_.persistence(1)
    lasting = tunnels[np.argsort(tunnels[:, 0] - tunnels[:, 1])[:2]]
    assert lasting[:, 1].max() == pytest.approx(0.6**2, rel=0.1)  # the hole in the middle


def test_order_is_that_of_a_stable_sort():
    rng = np.random.default_rng(0)
    for values in (
        rng.normal(size=5000) * 10.0 ** rng.integers(-300, 300, 5000),
        rng.integers(-3, 4, 5000).astype(float),
        np.array([0.0, -0.0, 1.0, -1.0, math.inf, -0.0, -math.inf, 5e-324, -5e-324]),
        np.empty(0),
    ):
        assert (persistence._order(values) == np.argsort(values, kind="stable")).all()


@pytest.mark.parametrize("width", [3, 4])
def test_reduction_goes_on_where_room_ran_out(width):
    """The same pairs with room for a few columns at a time, and by elimination on dense columns."""
    rng = np.random.default_rng(width)
    boundary = np.array([rng.choice(40, width, replace=False) for _ in range(70)], np.int32)
    columns = np.arange(70, dtype=np.int32)

    def pivots(room):
        owner = np.full(40, -1, np.int32)
        where, size = np.zeros(70, np.int64), np.zeros(70, np.int32)
        pool, position, used, stops = np.empty(room, np.int32), 0, 0, 0
        while position < 70:
            position, used = reduce_columns(columns, boundary, owner, pool, where, size, position, used)
            if position < 70:
                pool, stops = np.concatenate([pool, np.empty(5, np.int32)]), stops + 1
        return owner.tolist(), stops

    dense, expected = [], [-1] * 40
    for c in range(70):
        column = set(boundary[c].tolist())
        while column and expected[max(column)] >= 0:
            column ^= dense[expected[max(column)]]
        dense.append(column)
        if column:
            expected[max(column)] = c
    assert pivots(10_000) == (expected, 0)
    owner, stops = pivots(2 * width)
    assert owner == expected and stops > 5
