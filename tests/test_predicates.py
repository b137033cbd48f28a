"""The predicates against rational arithmetic, on input chosen to be degenerate or extreme."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from oracle import determinant

from recon._kernels import doubledouble as dd
from recon._kernels import predicates as p
from recon._kernels.exact import determinant_sign
from recon._kernels.predicates_dd import UNDECIDED, orient2d_dd, orient3d_dd, power2d_dd, power3d_dd


def sign(x) -> int:
    return (x > 0) - (x < 0)


def orient_exact(points) -> int:
    """Sign of the determinant of the edge vectors from the first point."""
    first, *rest = [[Fraction(x) for x in point] for point in points]
    return sign(determinant([[x - o for x, o in zip(point, first, strict=True)] for point in rest]))


def power_exact(points, weights, d: int) -> int:
    """Sign of M of the last point against the others, over the first d coordinates, heights over all, from that point."""
    last = [Fraction(x) for x in points[-1]]
    rows = [[Fraction(x) - o for x, o in zip(point, last, strict=True)] for point in points]
    heights = [sum(x * x for x in row) - Fraction(w) for row, w in zip(rows, weights, strict=True)]
    return sign(determinant([[1, *row[:d], h] for row, h in zip(rows, heights, strict=True)]))


def small_integers(rng, n):
    return rng.integers(-3, 4, (n, 3)).astype(float), rng.integers(-3, 4, n).astype(float)


def thirds_of_integers(rng, n):
    return rng.integers(-3, 4, (n, 3)) / 3.0, np.zeros(n)


def ulp_grid(rng, n):
    base = rng.choice([0.5, 12.0, 24.0, 1.0 / 3.0], size=(1, 3))
    return base + rng.integers(-4, 5, (n, 3)) * np.spacing(base), rng.choice([0.0, 1e-33, 2.0**-104], n)


def single_precision_plane(rng, n):
    x = rng.normal(size=(n, 3)).astype(np.float32).astype(float)
    x[:, 2] = x[:, 0] + x[:, 1]
    return x, np.zeros(n)


def sphere(rng, n):
    x = rng.normal(size=(n, 3))
    return x / np.linalg.norm(x, axis=1)[:, None], np.full(n, rng.choice([0.0, 0.1]))


def clustered_sphere(rng, n):
    x = np.array([0.48, 0.6, 0.64]) + rng.normal(size=(n, 3)) * 1e-4
    return x / np.linalg.norm(x, axis=1)[:, None], np.zeros(n)


def flattened(rng, n):
    """Weights |p|**2 but for their rounding: heights almost zero, every power test almost a tie."""
    x = rng.normal(size=(n, 3))
    return x, (x * x).sum(axis=1)


def wide_integers(rng, n):
    """Zero in more and more bits: where plain floating point, then double-double, is no longer exact."""
    reach = 2 ** rng.integers(6, 26)
    x = rng.integers(-reach, reach + 1, (n, 3)).astype(float)
    if rng.integers(2):
        x[:, 2] = 2 * x[:, 0] - x[:, 1]
    return x, (x * x).sum(axis=1) + rng.choice([0, 0, 0, 0, 1], n)


def vanishing(rng, n):
    """Products of three coordinates are denormal, and round to far more than a part in 2**53."""
    return rng.integers(-3, 4, (n, 3)) / 3.0 * 2.0**-355, rng.integers(-3, 4, n) * 2.0**100


def utm(rng, n):
    return np.array([5e5, 5.4e6, 200.0]) + rng.integers(0, 300, (n, 3)) * 0.01, np.zeros(n)


def mixed_exponents(rng, n):
    x = np.ldexp(rng.integers(-2, 3, (n, 3)).astype(float), rng.integers(-60, 60, (n, 3)))
    return x, np.ldexp(rng.integers(-2, 3, n).astype(float), rng.integers(-120, 120, n))


def extreme_exponents(rng, n):
    x = np.ldexp(rng.integers(-2, 3, (n, 3)).astype(float), rng.integers(-1074, 332, (n, 3)))
    return x, np.ldexp(rng.integers(-2, 3, n).astype(float), rng.integers(-1074, 664, n))


def denormals(rng, n):
    return rng.integers(-3, 4, (n, 3)) * 5e-324, rng.choice([0.0, 5e-324], n)


def huge(rng, n):
    return rng.integers(-3, 4, (n, 3)) * 2.0**330, rng.integers(-3, 4, n) * 2.0**660


def lone_ulp(rng, n):
    """Integers, and one coordinate off by the smallest number there is: a zero that is not one."""
    x, w = small_integers(rng, n)
    x[rng.integers(n), rng.integers(3)] += 0.0
    zero = np.argwhere(x == 0)
    if len(zero):
        x[tuple(zero[rng.integers(len(zero))])] = rng.choice([5e-324, 1e-300, 1e-160, 1e-40])
    return x, w


def lone_weight(rng, n):
    x, _ = small_integers(rng, n)
    w = np.zeros(n)
    w[rng.integers(n)] = rng.choice([5e-324, -1e-300, 1e-40, 1e-17, 1e200, -1e150])
    return x, w


FAMILIES = [
    small_integers,
    thirds_of_integers,
    ulp_grid,
    single_precision_plane,
    sphere,
    clustered_sphere,
    flattened,
    wide_integers,
    vanishing,
    utm,
    mixed_exponents,
    extreme_exponents,
    denormals,
    huge,
    lone_ulp,
    lone_weight,
]
ROUNDS = 400


@pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.__name__)
def test_every_predicate_has_the_sign_of_rational_arithmetic(family):
    rng = np.random.default_rng(20240501)
    seen = {name: set() for name in ("orient2d", "orient3d", "power1d", "power2d", "power3d")}
    for _ in range(ROUNDS):
        x, w = family(rng, 5)
        xw = np.column_stack([x, w])
        truth = {
            "orient2d": (orient_exact(x[:3, :2]), p.orient2d(*x[:3, :2].ravel())),
            "orient3d": (orient_exact(x[:4]), p.orient3d(*x[:4].ravel())),
            "power1d": (power_exact(x[:3], w[:3], 1), p.power1d(*xw[:3].ravel())),
            "power2d": (power_exact(x[:4], w[:4], 2), p.power2d(*xw[:4].ravel())),
            "power3d": (power_exact(x, w, 3), p.power3d(*xw.ravel())),
        }
        for name, (expected, found) in truth.items():
            assert found == expected, (name, x.tolist(), w.tolist())
            seen[name].add(expected)
    assert set().union(*seen.values()) >= {-1, 1}


@pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.__name__)
def test_no_stage_ever_claims_a_wrong_sign(family):
    """Each stage alone: the filter, double-double, and the integers, which must also answer where nobody asks them."""
    rng = np.random.default_rng(7)
    for _ in range(ROUNDS):
        x, w = family(rng, 5)
        xw = np.column_stack([x, w])
        cases = [
            (orient_exact(x[:3, :2]), x[:3, :2].ravel(), p.orient2d_filter, orient2d_dd),
            (orient_exact(x[:4]), x[:4].ravel(), p.orient3d_filter, orient3d_dd),
            (power_exact(x[:4], w[:4], 2), xw[:4].ravel(), p.power2d_filter, power2d_dd),
            (power_exact(x, w, 3), xw.ravel(), p.power3d_filter, power3d_dd),
        ]
        for truth, arguments, stage_a, stage_b in cases:
            assert stage_a(*arguments) in (0, truth), (stage_a, arguments.tolist())
            assert stage_b(*arguments) in (UNDECIDED, truth), (stage_b, arguments.tolist())
        assert determinant_sign(xw[[1, 2, 3, 0]].ravel(), 0) == orient_exact(x[:4])
        assert determinant_sign(xw.ravel(), 1) == power_exact(x, w, 3)
        assert -determinant_sign(xw[:4].ravel(), 1) == power_exact(x[:4], w[:4], 2)


def test_double_double_recognises_zero_on_grids():
    """A grid or a quantised scan must not fall through to the slow integers."""
    rng = np.random.default_rng(3)
    for family in (small_integers, utm):
        for _ in range(200):
            x, w = family(rng, 5)
            if family is utm:
                x = np.round(x * 64) / 64
            assert orient3d_dd(*x[:4].ravel()) != UNDECIDED
            assert power3d_dd(*np.column_stack([x, w]).ravel()) != UNDECIDED


def test_swapping_two_points_flips_every_sign():
    rng = np.random.default_rng(11)
    for family in FAMILIES:
        for _ in range(60):
            x, w = family(rng, 5)
            i, j = rng.choice(4, 2, replace=False)
            order = np.arange(5)
            order[[i, j]] = order[[j, i]]
            xw = np.column_stack([x, w])
            assert p.orient3d(*x[:4].ravel()) == -p.orient3d(*x[order][:4].ravel())
            assert p.power3d(*xw.ravel()) == -p.power3d(*xw[order].ravel())


def test_error_free_transformations_are_error_free():
    rng = np.random.default_rng(5)
    a = np.ldexp(rng.uniform(-1, 1, 2000), rng.integers(-200, 200, 2000))
    b = np.ldexp(rng.uniform(-1, 1, 2000), rng.integers(-200, 200, 2000))
    for x, y in zip(a.tolist(), b.tolist(), strict=True):
        for transform, exact in (
            (dd.two_sum, Fraction(x) + Fraction(y)),
            (dd.two_diff, Fraction(x) - Fraction(y)),
            (dd.two_product, Fraction(x) * Fraction(y)),
        ):
            hi, lo = transform(x, y)
            assert Fraction(hi) + Fraction(lo) == exact
            assert hi == float(exact)


def test_double_double_errs_no_more_than_claimed():
    rng = np.random.default_rng(6)
    u = Fraction(1, 2**53)
    for _ in range(1000):
        a = dd.two_sum(rng.normal(), rng.normal() * 2.0**-53)
        b = dd.two_sum(rng.normal() * rng.choice([1, -1, 1e-3]), rng.normal() * 2.0**-53)
        x, y = (Fraction(v[0]) + Fraction(v[1]) for v in (a, b))
        total, product = dd.dd_add(*a, *b), dd.dd_mul(*a, *b)
        assert abs(Fraction(total[0]) + Fraction(total[1]) - (x + y)) <= 3 * u * u * (abs(x) + abs(y))
        assert abs(Fraction(product[0]) + Fraction(product[1]) - x * y) <= 7 * u * u * abs(x * y)


def test_ties_go_to_the_lower_index():
    """Five points of one sphere: perturbed by index, in every order, as in rational arithmetic with a real epsilon."""
    rng = np.random.default_rng(8)
    epsilon = [Fraction(1, 10 ** (30 * (i + 1))) for i in range(5)]
    for _ in range(300):
        x = rng.integers(-1, 2, (5, 3)).astype(float)
        s = orient_exact(x[:4])
        if s == 0:
            continue
        if s < 0:
            x[[0, 1]] = x[[1, 0]]
        index = rng.permutation(5)
        w = [epsilon[i] for i in index]
        found = p.power3d_perturbed(*np.column_stack([x, np.zeros(5)]).ravel(), *index)
        assert found == power_exact(x, w, 3) != 0
    for _ in range(300):
        x = np.column_stack([rng.integers(-1, 2, (4, 2)).astype(float), np.zeros(4)])
        s = orient_exact(x[:3, :2])
        if s == 0:
            continue
        if s < 0:
            x[[0, 1]] = x[[1, 0]]
        index = rng.permutation(4)
        w = [epsilon[i] for i in index]
        found = p.power2d_perturbed(*np.column_stack([x, np.zeros(4)]).ravel(), *index)
        assert found == power_exact(x, w, 2) != 0
