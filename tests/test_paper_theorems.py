"""The theorems of Edelsbrunner's "Weighted alpha shapes" (1992), one test each, named by their numbers.

Integers in [-3, 3] are cospherical, coplanar and duplicate most of the time; where a theorem needs general position, so
does its test. 3.1 of every face, and 4.2 with the components that it does not speak of, are tested with their modules.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Oracle, determinant, sign
from scipy.optimize import linprog

from recon import (
    EXTERIOR,
    INTERIOR,
    REGULAR,
    SINGULAR,
    alpha_complex,
    power_diagram,
    regular_triangulation,
    space_filling_diagram,
)

DIMENSIONS = pytest.mark.parametrize("d", [1, 2, 3])
FOUR_TOO = pytest.mark.parametrize("d", [1, 2, 3, 4])


def lattice(d, low=-3, high=3, n=None):
    """Degenerate clouds: points (n, d) and weights (n,) of small integers."""
    n = n or (8 if d < 4 else 7)
    spot = st.tuples(*[st.integers(low, high)] * d, st.integers(low, high))
    return st.lists(spot, min_size=1, max_size=n).map(lambda rows: _split(np.array(rows, float)))


def generic(d, n=9):
    """Clouds in general position with certainty enough: random floats from a drawn seed."""
    return st.integers(0, 2**32 - 1).map(lambda seed: _split(np.random.default_rng(seed).normal(size=(n, d + 1))))


def _split(rows):
    return rows[:, :-1], rows[:, -1]


def rows(array) -> list[tuple[int, ...]]:
    return list(map(tuple, array.tolist()))


def alphas_between(complex_) -> list[float]:
    """Alphas clear of every critical value, rounding included, and -1, 0, 1 where they are."""
    critical = complex_.spectrum()
    wanted = np.concatenate([(critical[1:] + critical[:-1]) / 2, [critical[0] - 1, critical[-1] + 1, -1, 0, 1]])
    distance = np.abs(wanted[:, None] - critical).min(axis=1)
    return wanted[distance > 1e-9 * (1 + np.abs(wanted))].tolist()


def in_complex(complex_, alpha) -> set[tuple[int, ...]]:
    """K_alpha as a set of simplices."""
    return {
        simplex
        for k in range(complex_.dimension + 1)
        for simplex, kind in zip(rows(complex_.simplices(k)), complex_.classify(k, alpha))
        if kind != EXTERIOR
    }


def each_simplex(complex_):
    for k in range(complex_.dimension + 1):
        for i, simplex in enumerate(rows(complex_.simplices(k))):
            yield k, i, simplex


@FOUR_TOO
@given(data=st.data(), shift=st.integers(-5, 5))
@settings(max_examples=20, deadline=None)
def test_2_1_power_is_the_same_for_p_plus_alpha_and_x_minus_alpha(d, data, shift):
    """So raising all weights by alpha lowers every size by alpha and changes neither R nor attachment."""
    points, weights = data.draw(lattice(d))
    given_, raised = Oracle(points, weights), Oracle(points, weights + shift)
    assert given_.cells == raised.cells
    for simplex in given_.cells:
        center, size = given_.orthosphere(simplex)
        assert raised.orthosphere(simplex) == (center, size - shift)
    before, after = alpha_complex(points, weights), alpha_complex(points, weights + shift)
    for k in range(before.dimension + 1):
        assert rows(before.simplices(k)) == rows(after.simplices(k))
        assert (before.attached(k) == after.attached(k)).all()
        np.testing.assert_allclose(after.rho(k), before.rho(k) - shift, rtol=1e-12, atol=1e-11)
    assert np.array_equal(before.rho(0) - shift, after.rho(0))


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_2_2_the_shape_at_alpha_is_the_shape_at_zero_of_weights_raised_by_alpha(d, data):
    points, weights = data.draw(lattice(d))
    family = alpha_complex(points, weights)
    for alpha in alphas_between(family)[:: 1 + d]:
        alpha = float(np.round(alpha * 2**20) / 2**20)  # so that weights + alpha is exact
        if np.abs(family.spectrum() - alpha).min() < 1e-5:
            continue
        raised = alpha_complex(points, weights + alpha)
        here, there = family.boundary(alpha), raised.boundary(0.0)
        assert rows(here.facets) == rows(there.facets)
        assert here.singular.tolist() == there.singular.tolist()
        for k in range(family.dimension + 1):
            assert family.classify(k, alpha).tolist() == raised.classify(k, 0.0).tolist()


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_section_2_the_shape_at_infinity_is_the_convex_hull(d, data):
    points, weights = data.draw(lattice(d))
    complex_, oracle = alpha_complex(points, weights), Oracle(points, weights)
    d = complex_.dimension
    for k in range(d):
        exposed = complex_.simplices(k)[complex_.exposed(k, math.inf)]
        assert rows(exposed) == [t for t in oracle.simplices(k) if oracle.on_hull(t)]
        assert not complex_.exposed(k, -math.inf).any()
    assert (complex_.classify(d, math.inf) == INTERIOR).all()
    boundary = complex_.boundary(math.inf)
    assert not boundary.singular.any() and len(boundary) == (complex_.on_hull(d - 1).sum() if d else 0)
    assert len(complex_.boundary(-math.inf)) == 0


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@given(data=st.data())
@settings(max_examples=3, deadline=None)
def test_3_1_a_simplex_is_regular_exactly_where_its_power_cell_is_not_empty(d, data):
    """Every subset of at most d + 1 points: is any location as near to all of it as to no other? A linear program."""
    points, weights = data.draw(generic(d, n=d + 3))
    heights = (points**2).sum(axis=1) - weights
    complex_ = alpha_complex(points, weights)
    for k in range(d + 1):
        regular = set(rows(complex_.simplices(k)))
        for simplex in combinations(range(len(points)), k + 1):
            first, others = simplex[0], [q for q in range(len(points)) if q not in simplex]
            # pi(q, x) - pi(p, x) = h_q - h_p - 2 <q - p, x>: none for q in T, as much as can be for all others
            beyond = np.column_stack([2 * (points[others] - points[first]), np.ones(len(others))])
            equal = np.column_stack([2 * (points[list(simplex[1:])] - points[first]), np.zeros(k)])
            found = linprog(
                np.append(np.zeros(d), -1.0),
                beyond, heights[others] - heights[first],
                equal if k else None, heights[list(simplex[1:])] - heights[first] if k else None,
                [(None, None)] * d + [(None, 1.0)],
            )  # fmt: skip
            assert (simplex in regular) == (found.status == 0 and -found.fun > 0)


@DIMENSIONS
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_3_1_power_cells_of_simplices_are_not_empty_however_degenerate(d, data):
    """And their corners, the orthocentres of the cells that T is a face of, are in no other half-space: in fractions."""
    points, weights = data.draw(lattice(d))
    diagram, oracle = power_diagram(regular_triangulation(points, weights)), Oracle(points, weights)
    d = diagram.dimension
    for k in range(d + 1):
        faces = diagram.faces(d - k)
        for i, simplex in enumerate(rows(faces.simplices)):
            owners = [rows(np.sort(diagram.triangulation.cells[[c]]))[0] for c in faces.corners_of(i)]
            assert sorted(owners) == [u for u in oracle.simplices(d) if set(simplex) <= set(u)]
            for cell in owners:
                powers = [oracle.power(q, cell) for q in range(len(points))]
                assert min(powers) == 0 and all(powers[p] == 0 for p in simplex)


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_3_2_sizes_grow_with_the_simplex(d, data):
    """To the last bit, rounding included; strictly in general position only."""
    complex_ = alpha_complex(*data.draw(st.one_of(lattice(d), generic(d))))
    rho = {simplex: complex_.rho(k)[i] for k, i, simplex in each_simplex(complex_)}
    for simplex in rho:
        assert all(rho[face] <= rho[simplex] for face in combinations(simplex, len(simplex) - 1) if face)


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=10, deadline=None)
def test_3_3_the_shape_is_the_underlying_space_of_the_complex(d, data):
    """The alpha-exposed simplices by the definition of section 2, from all subsets of S, are those of table 5.1."""
    points, weights = data.draw(generic(d, n=6))
    complex_, oracle = alpha_complex(points, weights), Oracle(points, weights)
    candidates = [t for k in range(d) for t in combinations(range(len(points)), k + 1)]
    for alpha in alphas_between(complex_)[::5]:
        exposed = {rows(complex_.simplices(k))[i] for k in range(d) for i in np.flatnonzero(complex_.exposed(k, alpha))}
        assert exposed == {t for t in candidates if oracle.exposed(t, alpha)}
        # A facet exposed from both sides bounds no interior: neither cell beside it is in.
        boundary = complex_.boundary(alpha)
        inside = {t for t in in_complex(complex_, alpha) if len(t) == d + 1}
        for facet, singular in zip(boundary.facets.tolist(), boundary.singular):
            assert sum(set(facet) < set(cell) for cell in inside) == (0 if singular else 1)


@DIMENSIONS
@given(data=st.data())
@settings(max_examples=10, deadline=None)
def test_3_3_holds_of_the_simplices_of_R_however_degenerate(d, data):
    """Of cospherical points R holds some of the simplices that section 2 exposes, and of those it holds all are faces."""
    points, weights = data.draw(lattice(d, n=7))
    complex_, oracle = alpha_complex(points, weights), Oracle(points, weights)
    for alpha in alphas_between(complex_)[::3]:
        for k in range(complex_.dimension):
            expected = [oracle.exposed(simplex, alpha) for simplex in rows(complex_.simplices(k))]
            assert complex_.exposed(k, alpha).tolist() == expected


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=12, deadline=None)
def test_3_3_facets_are_exposed_from_one_side_or_from_both(d, data):
    """The two weighted points (x', alpha) orthogonal to d points, and which of them no other point conflicts with."""
    points, weights = data.draw(generic(d))
    family = alpha_complex(points, weights)
    size = {simplex: rho for simplex, rho in zip(rows(family.simplices(d - 1)), family.rho(d - 1))}
    center = dict(zip(size, family.centers(d - 1)))
    for alpha in alphas_between(family)[::4]:
        boundary = family.boundary(alpha)
        found = {tuple(sorted(f)): 2 if both else 1 for f, both in zip(boundary.facets.tolist(), boundary.singular)}
        for facet in combinations(range(len(points)), d):
            if facet not in size or size[facet] > alpha:
                assert facet not in found
                continue
            edges = points[list(facet[1:])] - points[facet[0]]
            normal = np.linalg.svd(edges)[2][-1] * math.sqrt(alpha - size[facet])
            others = [q for q in range(len(points)) if q not in facet]
            witnesses = [center[facet] + normal, center[facet] - normal]
            powers = [((points[others] - x) ** 2).sum(axis=1) - weights[others] - alpha for x in witnesses]
            assert found.get(facet, 0) == sum((p > 0).all() for p in powers)


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_3_4_complexes_grow_with_alpha_and_each_is_one(d, data):
    complex_ = alpha_complex(*data.draw(lattice(d)))
    previous: set[tuple[int, ...]] = set()
    critical = complex_.spectrum().tolist()
    for alpha in sorted([*critical, *alphas_between(complex_), -math.inf, math.inf]):
        now = in_complex(complex_, alpha)
        assert previous <= now
        assert all(face in now for simplex in now for k in range(1, len(simplex)) for face in combinations(simplex, k))
        previous = now
    assert len(previous) == sum(len(complex_.simplices(k)) for k in range(complex_.dimension + 1))


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=8, deadline=None)
def test_4_1_a_location_is_on_the_boundary_of_the_union_exactly_where_its_spheres_are_of_an_exposed_simplex(d, data):
    """Sampled on every sphere K_T: a location in no ball is a witness for T, and an exposed simplex has a witness."""
    points, weights = data.draw(generic(d, n=7))
    family, rng = alpha_complex(points, weights), np.random.default_rng(0)
    for alpha in alphas_between(family)[::5]:
        for k in range(d):
            exposed = dict(zip(rows(family.simplices(k)), family.exposed(k, alpha)))
            for simplex in combinations(range(len(points)), k + 1):
                center, rho = orthosphere(points, weights, simplex)
                if rho >= alpha:
                    assert not exposed.get(simplex, False)
                    continue
                away = rng.normal(size=(400, d))
                if k:
                    across = np.linalg.qr((points[list(simplex[1:])] - points[simplex[0]]).T)[0]
                    away -= away @ across @ across.T
                x = center + away * math.sqrt(alpha - rho) / np.linalg.norm(away, axis=1)[:, None]
                others = [q for q in range(len(points)) if q not in simplex]
                power = ((x[:, None] - points[others]) ** 2).sum(axis=2) - weights[others] - alpha
                outside = (power > 0).all(axis=1)
                if outside.any() or k == d - 1:  # of the two points of K_T all are sampled
                    assert exposed.get(simplex, False) == outside.any()


@DIMENSIONS
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_4_2_a_simplex_is_a_face_of_the_shape_exactly_where_its_sphere_has_a_face_of_the_union(d, data):
    points, weights = data.draw(st.one_of(lattice(d), generic(d)))
    family = alpha_complex(points, weights)
    for alpha in alphas_between(family)[::4]:
        union = space_filling_diagram(family, alpha=alpha)
        for k in range(d):
            if k <= family.dimension:
                # of points in a flat all of the complex is exposed, seen from outside of the flat
                exposed = family.exposed(k, alpha) if family.dimension == d else family.classify(k, alpha) > 0
                assert set(rows(union.faces(d - k - 1).simplices)) == set(rows(family.simplices(k)[exposed]))


def orthosphere(points, weights, simplex):
    """Centre and size of the smallest sphere orthogonal to the points of a simplex, in floats."""
    first, others = simplex[0], list(simplex[1:])
    edges = points[others] - points[first]
    right = ((edges**2).sum(axis=1) + weights[first] - weights[others]) / 2
    step = np.linalg.lstsq(edges, right, rcond=None)[0] if others else np.zeros(points.shape[1])
    return points[first] + step, step @ step - weights[first]


def is_sphere(link: set[tuple[int, ...]], dimension: int) -> bool:
    """Is a complex (without its empty simplex) a topological sphere of dimension -1, 0, 1 or 2?"""
    if dimension < 0:
        return not link
    vertices = [s for s in link if len(s) == 1]
    if dimension == 0:
        return len(link) == 2 == len(vertices)
    top = [s for s in link if len(s) == dimension + 1]
    if not top or any(not any(set(s) <= set(t) for t in top) for s in link) or len(max(link, key=len)) > dimension + 1:
        return False
    if any(not is_sphere(link_of(v, link), dimension - 1) for v in vertices):
        return False
    reached, queue = {vertices[0]}, [vertices[0]]
    while queue:
        (v,) = queue.pop()
        new = {(u,) for s in link if v in s for u in s} - reached
        reached |= new
        queue += new
    euler = sum((-1) ** (len(s) - 1) for s in link)
    return len(reached) == len(vertices) and euler == (0 if dimension == 1 else 2)


def link_of(simplex: tuple[int, ...], complex_: set[tuple[int, ...]]) -> set[tuple[int, ...]]:
    return {tuple(v for v in u if v not in simplex) for u in complex_ if set(simplex) < set(u)}


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_5_1_the_link_of_a_simplex_tells_its_class(d, data):
    complex_ = alpha_complex(*data.draw(lattice(d)))
    d = complex_.dimension
    for alpha in [*alphas_between(complex_)[::4], math.inf]:
        there = in_complex(complex_, alpha)
        for k in range(d + 1):
            for simplex, kind in zip(rows(complex_.simplices(k)), complex_.classify(k, alpha)):
                if kind == EXTERIOR:
                    continue
                link = link_of(simplex, there)
                assert {t for part in complex_.link(simplex, alpha) for t in rows(part)} == link
                if is_sphere(link, d - k - 1):
                    assert kind == INTERIOR
                else:
                    assert kind == (REGULAR if link else SINGULAR)


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_5_2_a_simplex_is_unattached_exactly_where_its_orthosphere_has_no_conflict(d, data):
    """Against every point of S by fractions; a point exactly on the orthosphere is no conflict."""
    points, weights = data.draw(lattice(d))
    complex_, oracle = alpha_complex(points, weights), Oracle(points, weights)
    for k, i, simplex in each_simplex(complex_):
        assert complex_.attached(k)[i] == oracle.attached(simplex)
    # And it is principal at some alpha, or never: for the smallest alpha at which it is in, if at all.
    for k, i, simplex in each_simplex(complex_):
        there = in_complex(complex_, complex_.rho(k)[i])
        principal = simplex in there and not link_of(simplex, there)
        tie = k < complex_.dimension and complex_.mu_lower(k)[i] == complex_.rho(k)[i]
        assert principal == (not complex_.attached(k)[i] and not tie)


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_5_3_interval_bounds_follow_from_the_next_dimension_up(d, data):
    """Bit for bit by the rule, and by definition (all cofaces, not those of one dimension more) up to rounding."""
    points, weights = data.draw(lattice(d))
    complex_, oracle = alpha_complex(points, weights), Oracle(points, weights)
    scale = 1 + np.abs(weights).max()
    for k in range(complex_.dimension):
        up, cofaces = k + 1, rows(complex_.simplices(k + 1))
        entry = np.where(complex_.attached(up), complex_.mu_lower(up), complex_.rho(up))
        for i, simplex in enumerate(rows(complex_.simplices(k))):
            above = [j for j, u in enumerate(cofaces) if set(simplex) < set(u)]
            assert complex_.mu_lower(k)[i] == min(entry[above])
            assert complex_.mu_upper(k)[i] == (
                math.inf if complex_.on_hull(k)[i] else max(complex_.mu_upper(up)[above])
            )
            lower, upper = float(oracle.mu_lower(simplex)), float(oracle.mu_upper(simplex))
            assert complex_.mu_lower(k)[i] == pytest.approx(lower, rel=1e-11, abs=1e-11 * scale)
            assert complex_.mu_upper(k)[i] == pytest.approx(upper, rel=1e-11, abs=1e-11 * scale)
            assert complex_.on_hull(k)[i] == oracle.on_hull(simplex)


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_table_5_1(d, data):
    points, weights = data.draw(lattice(d))
    complex_, oracle = alpha_complex(points, weights), Oracle(points, weights)
    names = {"exterior": EXTERIOR, "singular": SINGULAR, "regular": REGULAR, "interior": INTERIOR}
    for alpha in alphas_between(complex_)[::2]:
        for k in range(complex_.dimension + 1):
            expected = [names[oracle.classify(simplex, alpha)] for simplex in rows(complex_.simplices(k))]
            assert complex_.classify(k, alpha).tolist() == expected


# --- appendix B, by determinants of fractions


def homogeneous(points, weights) -> dict[int, list[Fraction]]:
    """phi_{i,0} = 1, the coordinates, and the height phi_{i,d+1}; points at infinity -1 .. -(d+1). Indices from 1."""
    d = points.shape[1]
    phi = {-j: [Fraction(int(c == j)) for c in range(d + 2)] for j in range(1, d + 2)}
    for i, (point, weight) in enumerate(zip(points.tolist(), weights.tolist()), start=1):
        x = [Fraction(v) for v in point]
        phi[i] = [Fraction(1), *x, sum(v * v for v in x) - Fraction(weight)]
    return phi


def minor(phi, indices, width) -> Fraction:
    return determinant([phi[i][:width] for i in indices])


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_b_1_the_hyperplane_test_is_a_sign_of_a_minor(d, data):
    """Cells are positive; the vertex beyond a facet is on its negative side; on the hull no point is."""
    points, weights = data.draw(lattice(d))
    t, phi = regular_triangulation(points, weights), homogeneous(points, weights)
    if t.dimension < d:
        return
    for cell, beside in zip(t.cells.tolist(), t.neighbors.tolist()):
        assert minor(phi, [i + 1 for i in cell], d + 1) > 0
        for slot, other in enumerate(beside):
            apexes = set(t.cells[other].tolist()) - set(cell) if other >= 0 else range(len(points))
            for q in apexes:
                value = minor(phi, [(q if s == slot else i) + 1 for s, i in enumerate(cell)], d + 1)
                assert value < 0 if other >= 0 else value >= 0


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_b_2_the_orthogonality_test_is_a_sign_of_a_product_of_minors(d, data):
    """For all sets of d + 1 points, in whatever order; and no point conflicts with a cell of R."""
    points, weights = data.draw(lattice(d, n=d + 3))
    oracle, phi = Oracle(points, weights), homogeneous(points, weights)
    cells = set(map(tuple, np.sort(regular_triangulation(points, weights).cells, axis=1).tolist()))
    if oracle.dimension < d:
        return
    for cell in combinations(range(len(points)), d + 1):
        order = [i + 1 for i in data.draw(st.permutations(cell))]
        positive = minor(phi, order, d + 1)
        if positive == 0:
            assert cell not in cells
            continue
        for q in range(len(points)):
            product = sign(positive) * sign(minor(phi, [*order, q + 1], d + 2))
            assert product == sign(oracle.power(q, cell))
            assert product >= 0 or cell not in cells


def hyperplanes(phi, simplex, d):
    """Independent rows N_{I,0} .. N_{I,d+1}: vertical hyperplanes through the simplex, parallel to all axes of I."""
    k, found = len(simplex) - 1, []
    if k == d:
        return []
    for axes in combinations(range(1, d + 1), d - k - 1):
        columns = [j for j in range(d + 2) if j not in axes and j != d + 1]
        normal = [Fraction(0)] * (d + 2)
        for m, j in enumerate(columns):
            minor = [[phi[i][c] for c in columns if c != j] for i in simplex]
            normal[j] = (-1) ** (k + 1 + m) * determinant(minor)
        if independent([*found, normal]):
            found.append(normal)
    return found[: d - k]


def independent(normals) -> bool:
    gram = [[sum(a * b for a, b in zip(u[1:], v[1:])) for v in normals] for u in normals]
    return determinant(gram) != 0


def gamma(phi, simplex, d):
    normals = hyperplanes(phi, simplex, d)
    left = [[2 * v for v in phi[i][1 : d + 1]] + [Fraction(-1)] for i in simplex] + [n[1:] for n in normals]
    right = [phi[i][d + 1] for i in simplex] + [-n[0] for n in normals]
    return left, right, normals


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_b_3_the_size_is_a_quotient_of_determinants(d, data):
    points, weights = data.draw(lattice(d, n=6))
    phi, complex_, oracle = homogeneous(points, weights), alpha_complex(points, weights), Oracle(points, weights)
    for k, i, simplex in each_simplex(complex_):
        left, right, _ = gamma(phi, [v + 1 for v in simplex], d)
        by_column = [determinant([[*r[:j], b, *r[j + 1 :]] for r, b in zip(left, right)]) for j in range(d + 1)]
        full = determinant(left)
        size = (sum(g * g for g in by_column[:d]) - full * by_column[d]) / full**2
        assert size == oracle.rho(simplex)
        center = [float(column / full) for column in by_column[:d]]
        assert complex_.centers(k)[i] == pytest.approx(center, rel=1e-12, abs=1e-11)
        assert complex_.rho(k)[i] == pytest.approx(float(size), rel=1e-12, abs=1e-11)


@FOUR_TOO
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_b_4_attachment_is_a_sign_of_determinants(d, data):
    points, weights = data.draw(lattice(d, n=6))
    phi, complex_ = homogeneous(points, weights), alpha_complex(points, weights)
    for k in range(complex_.dimension):
        cofaces = rows(complex_.simplices(k + 1))
        for simplex, attached in zip(rows(complex_.simplices(k)), complex_.attached(k)):
            left, _, normals = gamma(phi, [v + 1 for v in simplex], d)
            conflicts = []
            for q in {q for u in cofaces if set(simplex) < set(u) for q in u if q not in simplex}:
                lifted = phi[q + 1]
                matrix = [[phi[v + 1][d + 1], *r] for v, r in zip(simplex, left)]
                matrix += [[-n[0], *n[1:]] for n in normals]
                matrix.append([lifted[d + 1], *(2 * v for v in lifted[1 : d + 1]), Fraction(-1)])
                conflicts.append((-1) ** (d + 1) * determinant(left) * determinant(matrix) < 0)
            assert attached == any(conflicts)
