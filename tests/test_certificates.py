"""Certificates pass what is right, however degenerate, and name the offender in everything that is not."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracle import Oracle

from recon import CertificateError, InvalidInput, RegularTriangulation, certify

GRID = np.array(list(product(range(3), repeat=3)), float)
SQUARE = np.array([[0, 0], [2, 0], [0, 2], [2, 2], [1, 0.25], [0.5, 1]])
TILTED = np.array([[0, 0, 0], [1, 1, 0], [0, 1, 1], [1, 2, 1], [2, 2, 0], [2, 3, 1.0]])


def neighbors_of(cells):
    """Links over facets that two cells share."""
    owner, links = {}, np.full(np.shape(cells), -1, np.int32)
    for i, cell in enumerate(cells):
        for j in range(len(cell)):
            owner.setdefault(frozenset(cell[:j]) | frozenset(cell[j + 1 :]), []).append((i, j))
    for sides in owner.values():
        if len(sides) == 2 and len(cells[0]) > 1:
            (a, i), (b, j) = sides
            links[a, i], links[b, j] = b, a
    return links


def assemble(points, weights, cells, hidden):
    return RegularTriangulation(
        np.asarray(points, float),
        np.asarray(weights, float),
        np.array(cells, np.int32),
        neighbors_of([list(c) for c in cells]),
        np.array(hidden, np.int64),
    )


def truth(points, weights=None):
    """The right answer, made by the oracle."""
    weights = np.zeros(len(points)) if weights is None else weights
    oracle = Oracle(points, weights)
    cells = [c if len(c) == 1 or oracle.oriented(c) > 0 else (c[1], c[0], *c[2:]) for c in oracle.cells]
    return assemble(points, weights, cells, oracle.hidden)


def refused(result, match="."):
    with pytest.raises(CertificateError, match=match) as error:
        certify(result)
    return str(error.value)


def changed(array, *edits):
    copy = array.copy()
    for index, value in edits:
        copy[index] = value
    return copy


def spots(d, low=-2, high=2):
    return st.tuples(*[st.integers(low, high)] * d)


# --- what is right passes


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_the_truth_passes_however_degenerate(d, data):
    cloud = data.draw(st.lists(st.tuples(spots(d), st.integers(-2, 2)), min_size=1, max_size=8))
    certify(truth([p for p, _ in cloud], [w for _, w in cloud]))


@pytest.mark.parametrize("scale", [2.0**-500, 1.0, 2.0**300])
@pytest.mark.parametrize("cloud", [GRID[:12], TILTED, SQUARE, GRID[:9] * 0.1 + 1e6, GRID[[0, 13, 26]]])
def test_the_truth_passes_at_any_scale(cloud, scale):
    certify(truth(cloud * scale))


def test_a_flat_triangulation_may_be_turned_over():
    t = truth(TILTED)
    order = [1, 0, 2]
    certify(replace(t, cells=t.cells[:, order], neighbors=t.neighbors[:, order]))
    mixed = changed(t.cells, (0, t.cells[0, order]))
    refused(replace(t, cells=mixed, neighbors=changed(t.neighbors, (0, t.neighbors[0, order]))), "oriented")


# --- what is accepted is right


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_what_passes_is_the_truth(d, data):
    """The triangulation of one set of weights, held against another: accepted if and only if the cells are the same."""
    n = data.draw(st.integers(d + 2, 8))
    points = data.draw(st.lists(spots(d), min_size=n, max_size=n))
    mine, yours = (data.draw(st.lists(st.integers(-1, 1), min_size=n, max_size=n)) for _ in range(2))
    claim = replace(truth(points, mine), weights=np.array(yours, float))
    if Oracle(points, mine).cells == Oracle(points, yours).cells:
        certify(claim)
    else:
        refused(claim)


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=120, deadline=None)
def test_one_wrong_number_is_found(d, data):
    points = data.draw(st.lists(spots(d), min_size=d + 2, max_size=7))
    t = truth(points)
    assume(t.dimension == d)
    name = data.draw(st.sampled_from(["cells", "neighbors"]))
    array = getattr(t, name)
    row, slot = data.draw(st.integers(0, len(array) - 1)), data.draw(st.integers(0, d))
    value = data.draw(st.integers(-1, max(len(points), len(t.cells))))
    assume(array[row, slot] != value)
    refused(replace(t, **{name: changed(array, ((row, slot), value))}))


# --- one corruption each


def test_shapes_types_and_ranges():
    t = truth(SQUARE)
    refused(replace(t, cells=t.cells.astype(np.int64)), "cells: dtype int64")
    refused(replace(t, neighbors=t.neighbors[:, :2]), "neighbors: shape")
    refused(replace(t, weights=t.weights[1:]), "weights: shape")
    refused(replace(t, cells=t.cells[:0], neighbors=t.neighbors[:0]), "cells: shape")
    refused(replace(t, cells=changed(t.cells, ((1, 1), 6))), "cells: row 1 is out of range")
    refused(replace(t, neighbors=changed(t.neighbors, ((2, 0), -2))), "neighbors: row 2 is out of range")


def test_every_row_is_a_vertex_or_hidden_once():
    t = truth([*SQUARE.tolist(), [2, 2], [0, 0]])
    assert t.hidden.tolist() == [6, 7]
    refused(replace(t, hidden=t.hidden[:1]), "point 7 is neither vertex nor hidden")
    refused(replace(t, hidden=np.array([3, 6, 7])), "point 3 is vertex and hidden at once")
    refused(replace(t, hidden=t.hidden[::-1]), "not ascending")
    refused(replace(t, hidden=np.array([6, 6, 7])), "not ascending")
    refused(replace(t, hidden=np.array([6, 7, 8])), "not ascending rows")


def test_a_turned_cell():
    t = truth(GRID)
    order = [1, 0, 2, 3]
    cells, neighbors = changed(t.cells, (5, t.cells[5, order])), changed(t.neighbors, (5, t.neighbors[5, order]))
    refused(replace(t, cells=cells, neighbors=neighbors), "cell 5 .* is not positively oriented")


def test_all_cells_turned():
    t = truth(GRID)
    order = [1, 0, 2, 3]
    refused(replace(t, cells=t.cells[:, order], neighbors=t.neighbors[:, order]), "cell 0 .* oriented")


def test_a_flat_cell():
    t = truth(SQUARE)
    points = changed(SQUARE, (5, [0.5, 0.0]), (4, [1.0, 0.0]))
    refused(replace(t, points=points))


def test_links():
    t = truth(GRID)
    i, j = np.argwhere(t.neighbors >= 0)[7]
    refused(replace(t, neighbors=changed(t.neighbors, ((i, j), -1))), "does not point back")
    refused(replace(t, neighbors=changed(t.neighbors, ((i, j), i))), "neighbors of cell|share")
    turned = changed(t.neighbors, (0, np.roll(t.neighbors[0], 1)))
    refused(replace(t, neighbors=turned), "share the facet|point back")


def test_links_that_agree_over_the_wrong_facets():
    """Two cells that point at each other, but not over what they share."""
    t = truth(SQUARE)
    neighbors = t.neighbors.copy()
    inside = np.flatnonzero((neighbors >= 0).sum(axis=1) == 2)
    neighbors[inside] = np.roll(neighbors[inside], 1, axis=1)
    refused(replace(t, neighbors=neighbors))


def test_a_hole():
    """A cell left out, its neighbours closed towards it."""
    t = truth(GRID)
    for gone in (0, len(t.cells) // 2, len(t.cells) - 1):
        refused(assemble(t.points, t.weights, np.delete(t.cells, gone, axis=0).tolist(), t.hidden))


def test_two_cells_on_the_same_side_of_their_facet():
    points = [[0, 0], [4, 0], [2, 4], [2, 1]]
    refused(assemble(points, np.zeros(4), [[0, 1, 2], [0, 1, 3]], []), "cells 0 and 1 fold over")
    points = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 4], [1, 1, 1]]
    refused(assemble(points, np.zeros(5), [[0, 1, 2, 3], [0, 1, 2, 4]], []), "cells 0 and 1 fold over")


def test_a_cell_twice():
    t = truth(SQUARE)
    twice = assemble(SQUARE, np.zeros(6), [*t.cells.tolist(), t.cells[0].tolist()], [])
    refused(replace(twice, neighbors=np.vstack([t.neighbors, [[-1, -1, -1]]]).astype(np.int32)))


def test_a_disc_covered_twice():
    """Two turns around the middle: positive, linked, no ridge bends inwards, every hull facet faces outwards."""
    angle = 2 * np.pi * np.arange(5) / 5
    points = np.concatenate([[[0.0, 0.0]], np.column_stack([np.cos(angle), np.sin(angle)])])
    points = np.concatenate([points, points[1:] * 1.0])
    ring = [*range(1, 6), *range(6, 11)]
    cells = np.array([[0, ring[i], ring[(i + 1) % 10]] for i in range(10)], np.int32)
    neighbors = np.array([[-1, (i + 1) % 10, (i - 1) % 10] for i in range(10)], np.int32)
    refused(RegularTriangulation(points, np.zeros(11), cells, neighbors, np.zeros(0, np.int64)), "overlap")


def test_two_pieces_apart():
    left, right = SQUARE, SQUARE + np.array([9, 0])
    cells = truth(left).cells
    both = assemble(np.vstack([left, right]), np.zeros(12), [*cells.tolist(), *(cells + 6).tolist()], [])
    refused(both, "hull")


def test_a_flipped_edge_and_a_flipped_facet():
    points = [[0, 0], [4, 0], [4, 3], [0, 2]]
    right = truth(points)
    wrong = [[0, 1, 2], [0, 2, 3]] if (0, 2) not in Oracle(points).simplices(1) else [[0, 1, 3], [1, 2, 3]]
    certify(right)
    refused(assemble(points, np.zeros(4), wrong, []), "conflicts with cell")
    five = [[0, 0, 0], [3, 0, 0], [0, 3, 0], [1, 1, 2], [1, 1, -2]]
    two, three = [[0, 1, 2, 3], [0, 2, 1, 4]], [[0, 1, 4, 3], [1, 2, 4, 3], [2, 0, 4, 3]]
    wrong = two if len(Oracle(five).cells) == 3 else three
    refused(assemble(five, np.zeros(5), wrong, []), "conflicts with cell")


def test_a_tie_broken_the_wrong_way():
    corners = SQUARE[:4]
    certify(assemble(corners, np.zeros(4), [[0, 1, 3], [0, 3, 2]], []))
    refused(assemble(corners, np.zeros(4), [[0, 1, 2], [1, 3, 2]], []), "conflicts with cell")


def test_the_wrong_one_of_equals_survives():
    points = [[0, 0], [1, 0], [0, 1], [1, 0]]
    certify(assemble(points, np.zeros(4), [[0, 1, 2]], [3]))
    refused(assemble(points, np.zeros(4), [[0, 3, 2]], [1]), "point 1 is called hidden but conflicts")
    certify(assemble(points, [0, 0, 0, 1], [[0, 3, 2]], [1]))
    refused(assemble(points, [0, 0, 0, 1], [[0, 1, 2]], [3]), "point 3 is called hidden")


def test_a_point_wrongly_hidden():
    points = [[0, 0], [4, 0], [0, 4], [1, 1]]
    refused(assemble(points, np.zeros(4), [[0, 1, 2]], [3]), "point 3 is called hidden but conflicts with cell 0")
    certify(assemble(points, [0, 0, 0, -9], [[0, 1, 2]], [3]))
    # On an edge of the hull, on the plane of its lifted ends: a tie that the index decides.
    edge = [[0, 0], [2, 0], [0, 2], [1, 0]]
    certify(assemble(edge, [0, 0, 0, -1], [[0, 1, 2]], [3]))
    refused(assemble([edge[3], *edge[:3]], [-1, 0, 0, 0], [[1, 2, 3]], [0]), "point 0 is called hidden")


def test_a_point_wrongly_a_vertex():
    points = [[0, 0], [4, 0], [0, 4], [1, 1]]
    split = [[0, 1, 3], [1, 2, 3], [2, 0, 3]]
    certify(assemble(points, np.zeros(4), split, []))
    refused(assemble(points, [0, 0, 0, -9], split, []), "conflicts with cell")


def test_a_hidden_point_outside_the_hull():
    points = [[0, 0], [4, 0], [0, 4], [9, 9]]
    refused(assemble(points, np.zeros(4), [[0, 1, 2]], [3]), "hidden point 3 is outside every cell")


def test_hull_facets_left_out():
    """A point beyond the hull of the cells on a line with one of its edges, and a dent in the hull."""
    points = [[0, 0], [4, 0], [4, 4], [0, 4], [2, 1]]
    dent = [[1, 2, 4], [2, 3, 4], [3, 0, 4]]
    refused(assemble(points, np.zeros(5), dent, []), "bends inwards|has the inside of cell 0 outside")


def test_one_spot():
    points = np.ones((3, 2))
    certify(assemble(points, [0, 5, 5], [[1]], [0, 2]))
    refused(assemble(points, [0, 5, 5], [[2]], [0, 1]), "all points in one place")
    refused(assemble([[1, 1], [1, 1], [1, 2]], [0, 0, 0], [[0]], [1, 2]), "point 2 is not where point 0 is")


def test_points_off_the_plane_by_one_ulp():
    t = truth(TILTED)
    certify(t)
    off = changed(TILTED, ((5, 2), np.nextafter(1.0, 2)))
    refused(replace(t, points=off), "point 5 is outside that affine hull")
    line = truth(GRID[[0, 13, 26]])
    refused(replace(line, points=changed(line.points, ((1, 0), np.nextafter(1, 0)))), "outside that affine hull")


def test_a_chain_with_three_ends():
    points = [[0.0], [1.0], [2.0], [3.0]]
    refused(assemble(points, np.zeros(4), [[0, 1], [2, 3]], []), "ends|inside")


def test_nothing_to_certify():
    with pytest.raises(InvalidInput, match="nothing to certify about a list"):
        certify([1, 2])
