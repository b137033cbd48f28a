"""One simplex at a time: certain signs and bounded errors of the size kernels, against fractions, on hostile input."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, permutations

import numpy as np
import pytest
from oracle import exact, minus, solve

from recon import intervals_nd
from recon._kernels.sizes import settle
from recon._kernels.sizes_exact import (
    INACCURATE,
    UNDECIDED,
    dd_tetrahedron,
    dd_triangle,
    exact_simplex,
)
from recon.intervals import scale

ACCURACY = Fraction(2) ** -40


def truth(points, weights):
    """Size and barycentric coordinates of the orthocentre, by elimination; None where the points are dependent."""
    points, weights = exact(points), exact(weights)
    edges = [minus(p, points[0]) for p in points[1:]]
    heights = [sum(x * x for x in e) - w + weights[0] for e, w in zip(edges, weights[1:])]
    x = solve([[sum(a * b for a, b in zip(e, f)) for f in edges] for e in edges], heights)
    if x is None:
        return None
    rho = sum(h * y for h, y in zip(heights, x)) / 4 - weights[0]
    return rho, [1 - sum(x) / 2, *(y / 2 for y in x)]


def beyond(rho, exponent) -> bool:
    """Does a size leave the range of float64, or that of the scaled points? Then it is infinite."""
    return abs(rho) > Fraction(2) ** 1000 or abs(rho) * Fraction(4) ** -exponent > Fraction(2) ** 1000


def lattice(rng):
    return rng.integers(-3, 4, (4, 3)).astype(float), rng.integers(-3, 4, 4).astype(float)


def ordinary(rng):
    return rng.normal(size=(4, 3)), rng.normal(size=4) * 10.0 ** rng.integers(-6, 6)


def wild(rng):
    return rng.normal(size=(4, 3)) * 10.0 ** rng.integers(-90, 90), rng.normal(size=4) * 10.0 ** rng.integers(-150, 150)


def ulps(rng):
    nudge = rng.integers(-2, 3, (4, 3)) * 2.0**-50
    return rng.integers(-2, 3, (4, 3)) + nudge, rng.integers(-2, 3, 4) * 2.0 ** -rng.integers(0, 100)


def far_decimals(rng):
    return rng.integers(0, 4, (4, 3)) * 0.1 + 5e5, np.zeros(4)


def nearly_flat(rng):
    points = rng.normal(size=(4, 3))
    points[:, 2] = points[:, 0] * 0.3 + points[:, 1] * 0.7
    return points, np.zeros(4)


def needle(rng):
    points = rng.normal(size=(4, 3)) * [1, 1e-9, 1e-13]
    return points, 1e-3 * rng.random(4)


def cospherical(rng):
    """Points of one sphere, right angles among them: (3, 4, 0), (5, 0, 0) and their like."""
    shell = [p for a in ((3, 4, 0), (5, 0, 0)) for p in permutations(a)]
    signs = rng.choice([-1.0, 1.0], (4, 3))
    return np.array(shell)[rng.choice(len(shell), 4)] * signs * 2.0 ** rng.integers(-60, 60), np.zeros(4)


def wide_integers(rng):
    """Exact ties that need the digits: integers of 30 bits in right angles."""
    a, b = rng.integers(2**29, 2**30, 2).astype(float)
    return np.array([[0, 0, 0], [a, 0, 0], [0, b, 0], [a, b, float(rng.integers(0, 5))]]), np.zeros(4)


def skew_integers(rng):
    """Right angles askew, of 6 to 16 bits: their products pass 53 bits somewhere on the way."""
    a = rng.integers(2**5, 2 ** rng.integers(6, 16), 3)
    b = np.cross(a, rng.integers(-2, 3, 3)) + [0, 0, int(rng.integers(0, 20) == 0)]
    points = np.array([[0, 0, 0], a, b, a + b + rng.integers(-3, 4, 3)]).astype(float)
    return points[rng.permutation(4)], np.zeros(4)


def centre_on_a_face(rng):
    """Weights that put the orthocentre on a face, but for rounding: some coordinate is about zero."""
    points = rng.normal(size=(4, 3))
    shares = rng.random(4) * (rng.permutation(4) < rng.integers(1, 4))
    centre = shares / shares.sum() @ points
    return points, ((points - centre) ** 2).sum(axis=1) - rng.random()


KINDS = [lattice, ordinary, wild, ulps, far_decimals, nearly_flat, needle, cospherical]
KINDS += [wide_integers, skew_integers, centre_on_a_face]


@pytest.mark.parametrize("kind", KINDS)
def test_signs_are_certain_and_sizes_close_and_monotone(kind):
    rng = np.random.default_rng(1)
    ties = checked = 0
    for _ in range(250):
        points, weights = kind(rng)
        scaled, exponent, integral = scale(points, weights)
        sizes = {(i,): -weights[i] for i in range(4)}
        for k in (1, 2, 3):
            for simplex in combinations(range(4), k + 1):
                rows = list(simplex)
                expected = truth(points[rows], weights[rows])
                if expected is None or beyond(expected[0], exponent):
                    continue
                rho, code = np.zeros(1), np.full(1, (1 << (k + 1)) - 1, np.uint8)
                settle(scaled, integral, np.array([simplex], np.int32), rho, code)
                assert code[0] == sum(1 << j for j, share in enumerate(expected[1]) if share < 0)
                size = rho[0] * 4.0**exponent
                bound = abs(expected[0]) + max(abs(Fraction(w)) for w in weights[rows].tolist())
                assert abs(Fraction(size) - expected[0]) <= ACCURACY * bound or bound < Fraction(2) ** -1000
                sizes[simplex] = size
                checked += 1
                for j, share in enumerate(expected[1]):
                    face = simplex[:j] + simplex[j + 1 :]
                    assert sizes[face] <= size
                    if share == 0:  # the face has the same orthosphere
                        ties += 1
                        # To the last bit, unless a third face is closer than rounding.
                        assert sizes[face] == (pytest.approx(size, rel=1e-15) if kind is wide_integers else size)
    assert checked > 1000 or kind is cospherical
    assert ties > 20 or kind in (ordinary, wild, ulps, far_decimals, nearly_flat, needle, centre_on_a_face)


def test_the_order_of_vertices_does_not_matter():
    """Bits follow the columns, and the size is the same to the last bit."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        points, weights = ordinary(rng)
        scaled, _, integral = scale(points, weights)
        for k in (1, 2, 3):
            results = set()
            for row in permutations(range(k + 1)):
                rho, code = np.zeros(1), np.full(1, (1 << (k + 1)) - 1, np.uint8)
                settle(scaled, integral, np.array([row], np.int32), rho, code)
                results.add((rho[0], frozenset(v for j, v in enumerate(row) if code[0] >> j & 1)))
            assert len(results) == 1


def test_only_open_rows_are_touched():
    scaled, _, integral = scale(np.eye(3), np.zeros(3))
    rho, code = np.array([7.0, 7.0]), np.array([3, 3 | 64], np.uint8)
    settle(scaled, integral, np.array([[0, 1], [1, 2]], np.int32), rho, code)
    assert rho.tolist() == [0.5, 0.5] and code.tolist() == [0, 64]
    rho[:], code[:] = 7, [1, 64]
    settle(scaled, integral, np.array([[0, 1], [1, 2]], np.int32), rho, code)
    assert rho.tolist() == [7, 7] and code.tolist() == [1, 64]


@pytest.mark.parametrize(
    "kind", [lattice, ordinary, ulps, far_decimals, nearly_flat, needle, cospherical, centre_on_a_face]
)
def test_double_doubles_say_what_they_know(kind):
    """What they call settled is so; and they settle all but little."""
    rng = np.random.default_rng(2)
    settled = total = 0
    for _ in range(200):
        points, weights = kind(rng)
        scaled, exponent, integral = scale(points, weights)
        for k, function in (2, dd_triangle), (3, dd_tetrahedron):
            expected = truth(points[: k + 1], weights[: k + 1])
            if expected is None:
                continue
            rho, code = function(*scaled[: k + 1], integral)
            total += 1
            if not code & UNDECIDED:
                assert code & 15 == sum(1 << j for j, share in enumerate(expected[1]) if share < 0)
                assert code >> 4 & 15 == sum(1 << j for j, share in enumerate(expected[1]) if share == 0)
            if not code & INACCURATE:
                bound = abs(expected[0]) + max(abs(Fraction(w)) for w in weights[: k + 1].tolist())
                assert abs(Fraction(np.ldexp(rho, 2 * exponent)) - expected[0]) <= ACCURACY * bound
            settled += not code & (UNDECIDED | INACCURATE)
    assert settled > 0.4 * total > 0 or kind in (ulps, cospherical)


@pytest.mark.parametrize("kind", [lattice, ordinary, wild, ulps, cospherical, wide_integers, centre_on_a_face])
def test_integers_are_exact(kind):
    rng = np.random.default_rng(4)
    for _ in range(60):
        points, weights = kind(rng)
        scaled, exponent, _ = scale(points, weights)
        for k in (1, 2, 3):
            expected = truth(points[: k + 1], weights[: k + 1])
            if expected is None or beyond(expected[0], exponent) or abs(expected[0]) < Fraction(2) ** -900:
                continue
            rho, code = exact_simplex(scaled, *range(k + 1), *[-1] * (3 - k))
            assert code & 15 == sum(1 << j for j, share in enumerate(expected[1]) if share < 0)
            assert code >> 4 == sum(1 << j for j, share in enumerate(expected[1]) if share == 0)
            assert abs(Fraction(np.ldexp(rho, 2 * exponent)) - expected[0]) <= Fraction(2) ** -49 * abs(expected[0])


@pytest.mark.parametrize("d", [1, 2, 3, 5])
@pytest.mark.parametrize("integers", [False, True])
def test_the_plain_twin_is_certain_in_any_dimension(d, integers):
    rng = np.random.default_rng([d, integers])
    points, weights = rng.normal(size=(60, d)), rng.normal(size=60)
    if integers:
        points, weights = rng.integers(-3, 4, (60, d)).astype(float), rng.integers(-3, 4, 60).astype(float)
    for k in range(1, d + 1):
        simplices = np.array([rng.choice(60, k + 1, replace=False) for _ in range(80)], np.int32)
        expected = [truth(points[s], weights[s]) for s in simplices]
        proper = [i for i, t in enumerate(expected) if t is not None]
        rho, signs = intervals_nd.measure(points, weights, simplices[proper])
        for i, j in enumerate(proper):
            size, shares = expected[j]
            assert signs[i].tolist() == [(share > 0) - (share < 0) for share in shares]
            bound = abs(size) + max(abs(Fraction(w)) for w in weights[simplices[j]].tolist())
            assert abs(Fraction(rho[i]) - size) <= ACCURACY * bound


@pytest.mark.parametrize("d", [1, 2, 3, 5])
def test_the_plain_twin_is_certain_of_centres_on_faces(d):
    """Weights that put the orthocentre on a face, but for rounding."""
    rng = np.random.default_rng(d)
    points = rng.normal(size=(200, d + 1, d))
    shares = rng.random((200, d + 1)) * (
        rng.permuted(np.tile(np.arange(d + 1), (200, 1)), axis=1) < rng.integers(1, d + 1)
    )
    centre = np.einsum("si,sid->sd", shares / shares.sum(axis=1, keepdims=True), points)
    weights = ((points - centre[:, None]) ** 2).sum(axis=2) - rng.random((200, 1))
    simplices = np.arange(200 * (d + 1), dtype=np.int32).reshape(200, d + 1)
    _, signs = intervals_nd.measure(points.reshape(-1, d), weights.ravel(), simplices)
    for i in range(200):
        assert signs[i].tolist() == [(share > 0) - (share < 0) for share in truth(points[i], weights[i])[1]]


@pytest.mark.parametrize("power", [-900, -333, -20, 0, 20, 300])
def test_scaling_is_exact_and_undone(power):
    rng = np.random.default_rng(0)
    points, weights = rng.random((50, 3)) * 2.0**power, rng.random(50) * 4.0 ** max(power, -500)
    scaled, exponent, integral = scale(points, weights)
    assert not integral
    assert (np.ldexp(scaled[:, :3], exponent) == points).all()
    assert (np.ldexp(scaled[:, 3], 2 * exponent) == weights).all()


@pytest.mark.parametrize("unit", [2.0**-40, 0.25, 1.0, 1024.0])
def test_integers_are_recognised_by_their_unit(unit):
    rng = np.random.default_rng(0)
    points = rng.integers(-100, 100, (500, 3)) * unit
    weights = rng.integers(-100, 100, 500) * unit**2
    scaled, exponent, integral = scale(points, weights)
    assert integral and 2.0**exponent <= unit and (scaled == np.round(scaled)).all()
    points[499, 2] += unit / 2**60 if unit < 1 else 0.1  # the last one only: no sample may hide it
    assert not scale(points, weights)[2] or (scale(points, weights)[0] == np.round(scale(points, weights)[0])).all()
