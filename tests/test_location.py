"""Where locations are in R and in W_alpha: interior, boundary and exterior as section 2 has them."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle, barycentric, exact

from recon import EXTERIOR, INTERIOR, REGULAR, SINGULAR, InvalidInput, alpha_complex, regular_triangulation
from recon.location import find_simplices

CLASSES = {"exterior": EXTERIOR, "singular": SINGULAR, "regular": REGULAR, "interior": INTERIOR}


def holders(oracle, x) -> set[tuple[int, ...]]:
    """The simplices whose relative interiors hold x, by barycentric coordinates over all cells, in fractions."""
    x, found = exact(x), set()
    for cell in oracle.simplices(oracle.dimension):
        corners = [oracle.points[i] for i in cell]
        shares = barycentric([oracle.flat[i] for i in cell], tuple(x[a] for a in oracle.axes))
        if min(shares) >= 0 and all(sum(s * c[a] for s, c in zip(shares, corners)) == x[a] for a in range(len(x))):
            found.add(tuple(i for i, s in zip(cell, shares) if s > 0))
    return found


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("unit", [1.0, 0.1])
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_locations_are_held_by_the_simplex_of_the_definition(d, unit, data):
    """Among integers and halves most locations are on faces; each is held by one simplex, whose class it has."""
    spot = st.lists(st.integers(-2, 2).map(lambda i: i * unit), min_size=d, max_size=d)
    points = data.draw(st.lists(spot, min_size=1, max_size=8))
    x = np.array(data.draw(st.lists(spot, min_size=1, max_size=6)))
    x = np.vstack([x, points[0], np.mean(points[:2], axis=0), np.mean(points, axis=0)])
    oracle, complex_ = Oracle(points), alpha_complex(points)
    found = find_simplices(complex_.triangulation, x)
    for location, corners in zip(x, found.tolist()):
        expected = holders(oracle, location)
        assert expected == ({tuple(i for i in corners if i >= 0)} if max(corners) >= 0 else set())
    for alpha in (-1.0, 0.4 * unit**2, 2.3 * unit**2, math.inf):
        at = Fraction(10**9) if alpha == math.inf else alpha
        for corners, kind in zip(found.tolist(), complex_.classify_locations(x, alpha)):
            simplex = tuple(i for i in corners if i >= 0)
            assert kind == (CLASSES[oracle.classify(simplex, at)] if simplex else EXTERIOR)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_interior_is_the_union_of_the_cells_that_are_in(d):
    rng = np.random.default_rng(d)
    points, x = rng.normal(size=(60, d)), 1.2 * rng.normal(size=(400, d))
    complex_ = alpha_complex(points)
    for alpha in (0.2, 0.6, 2.0, math.inf):
        cells = points[complex_.simplices(d)[complex_.classify(d, alpha) == INTERIOR]]
        inside = np.zeros(len(x), bool)
        for cell in cells:
            shares = np.linalg.solve((cell[1:] - cell[0]).T, (x - cell[0]).T)
            inside |= (shares > 0).all(axis=0) & (shares.sum(axis=0) < 1)
        kinds = complex_.classify_locations(x, alpha)
        assert set(np.unique(kinds)) <= {EXTERIOR, INTERIOR} and (inside == (kinds == INTERIOR)).all()


def test_vertices_midpoints_and_neighbours_to_the_last_bit():
    """In thirds, whose midpoints are not on the edges but for luck; a location an ulp off a facet is beyond it."""
    points = np.random.default_rng(5).integers(-3, 4, (30, 3)) / 3
    t = regular_triangulation(points)
    places = np.unique(t.cells)
    assert find_simplices(t, points[places]).tolist() == [[-1, -1, -1, i] for i in places]
    square = regular_triangulation([[0, 0], [1, 0], [0, 1], [1, 1]])
    x = [[0.5, 0.5], [0.5, np.nextafter(0.5, 1)], [0.5, np.nextafter(0.5, 0)], [0.5, 5e-324], [0.5, -5e-324]]
    held = [sum(corners) for corners in find_simplices(square, np.array(x)).tolist()]
    assert (
        held[0] == -1 + 0 + 3 and {held[1], held[2]} == {0 + 2 + 3, 0 + 1 + 3} and held[3] == held[2] and held[4] == -3
    )


def test_the_gate():
    complex_ = alpha_complex([[0, 0], [1, 0], [0, 1]])
    for x, alpha in (([[0, 0, 0]], 0), ([0, 0], 0), ([[math.nan, 0]], 0), ([[0, 0]], math.nan)):
        with pytest.raises(InvalidInput):
            complex_.classify_locations(x, alpha)
