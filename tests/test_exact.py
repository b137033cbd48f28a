"""Signs over many rows against the oracle, on numbers that rounding gets wrong."""

from itertools import combinations

import numpy as np
import pytest
from oracle import Oracle, dot, exact, orient, power_sign, sign

from recon.exact import Cloud, Rounded, determinant


def lattice(rng, n, d):
    return rng.integers(-1, 2, size=(n, d)).astype(float), rng.integers(-1, 2, size=n).astype(float)


def ulps(rng, n, d):
    """Neighbouring floats around one, where rounded differences vanish."""
    points = 1.0 + rng.integers(-2, 3, size=(n, d)) * 2.0**-52
    return points, 1.0 + rng.integers(-2, 3, size=n) * 2.0**-52


def tenths(rng, n, d):
    points, weights = lattice(rng, n, d)
    return points * 0.1 + 1e6, weights * np.nextafter(0.1, 1)


def tiny(rng, n, d):
    points, weights = lattice(rng, n, d)
    return points * 2.0**-600, weights * 2.0**-1074


def huge(rng, n, d):
    points, weights = lattice(rng, n, d)
    return points * 1e100, weights * 1e200


def mixed(rng, n, d):
    points, weights = lattice(rng, n, d)
    return points * 10.0 ** rng.integers(-90, 90, size=(n, 1)), weights * 10.0 ** rng.integers(-200, 200, size=n)


def wide(rng, n, d):
    """Integers whose products need more than 53 bits, all but dependent."""
    points, weights = lattice(rng, n, d)
    return points * (2.0**28 - 3) + rng.integers(-1, 2, size=(n, d)), weights * 2.0**50


def smooth(rng, n, d):
    return rng.normal(size=(n, d)), rng.normal(size=n)


CLOUDS = [lattice, ulps, tenths, tiny, huge, mixed, wide, smooth]


@pytest.mark.parametrize("make", CLOUDS)
@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_orientation_and_perturbed_power_are_exact(make, d):
    points, weights = make(np.random.default_rng(d), d + 4, d)
    cloud, n = Cloud(points, weights), len(points)
    spots, w = exact(points), exact(weights)
    heights = [dot(p, p) - v for p, v in zip(spots, w)]
    simplices = list(combinations(range(n), d + 1))
    orientation = cloud.sign(cloud.orient, *np.array(simplices).T)
    assert orientation.tolist() == [orient(*(spots[i] for i in s)) for s in simplices]
    rows = []
    for simplex, side in zip(simplices, orientation):
        if side:
            cell = simplex if side > 0 else (simplex[1], simplex[0], *simplex[2:])
            rows += [(*cell, q) for q in range(n) if q not in cell]
    if rows:
        table = np.array(rows)
        found = cloud.perturbed_power(table[:, :-1], table[:, -1])
        assert found.tolist() == [power_sign(spots, heights, row[:-1], row[-1]) for row in rows]


@pytest.mark.parametrize("make", CLOUDS)
@pytest.mark.parametrize("d", [1, 2, 3])
def test_attachment_is_exact(make, d):
    points, weights = make(np.random.default_rng(10 + d), d + 3, d)
    cloud, oracle = Cloud(points, weights), Oracle(points, weights)
    for k in range(oracle.dimension + 1):
        rows = [(*s, q) for s in oracle.simplices(k) for q in range(len(points)) if q not in s]
        if rows:
            found = cloud.sign(cloud.attachment, *np.array(rows).T)
            assert found.tolist() == [sign(oracle.power(row[-1], row[:-1])) for row in rows]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_determinant_by_minors_is_the_determinant(n):
    matrix = np.random.default_rng(n).integers(-9, 10, size=(n, n))
    assert determinant(matrix.tolist()) == round(np.linalg.det(matrix))


def test_rounded_bounds_hold():
    """A long chain of operations on floats, against rational numbers."""
    rng = np.random.default_rng(5)
    a, b, c = (rng.normal(size=200) * 10.0 ** rng.integers(-150, 150, size=200) for _ in range(3))

    def chain(x, y, z):
        return (x - y) * z + (y + z) * x - x * y

    result = chain(Rounded(a), Rounded(b), Rounded(c))
    for value, error, truth in zip(result.value, result.error, map(chain, *map(exact, (a, b, c)))):
        assert not np.isfinite(error) or abs(truth - exact(value)) <= exact(error)


def test_rounded_knows_when_it_does_not_know():
    with np.errstate(over="ignore"):
        product = Rounded(np.array([1e-200, 1e200, 0.0])) * Rounded(np.array([1e-200, 1e200, 1e200]))
    sign, certain = product.sign()
    assert certain.tolist() == [False, False, True]
    assert sign.tolist() == [0, 0, 0]
