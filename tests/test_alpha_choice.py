"""The alphas that are offered: their reasons hold, and they follow the weights."""

from __future__ import annotations

import math

import numpy as np
import pytest

from recon import INTERIOR, alpha_complex

CLOUDS = {
    "ball": np.random.default_rng(0).normal(size=(300, 3)),
    "sphere": (lambda p: p / np.linalg.norm(p, axis=1)[:, None])(np.random.default_rng(1).normal(size=(400, 3))),
    "two clusters": np.concatenate([np.random.default_rng(i).random((60, 2)) + 4 * i for i in (0, 1)]),
    "grid": np.argwhere(np.ones((4, 4, 4))).astype(float),
    "line": np.random.default_rng(2).random((25, 1)),
    "one point": np.zeros((1, 3)),
}
CLOUD = pytest.mark.parametrize("name", CLOUDS)


@CLOUD
def test_reasons_hold(name):
    complex_ = alpha_complex(CLOUDS[name])
    choices = complex_.choices()
    assert len({choice.criterion for choice in choices}) == len(choices) >= 1
    for choice in choices:
        assert choice.start <= choice.alpha < choice.stop
        betti = complex_.betti(choice.alpha)
        just_before = np.nextafter(choice.start, -math.inf)
        if choice.criterion in ("connected", "solid", "stable"):
            assert betti[0] == 1 and complex_.f_vector(choice.alpha)[0] == len(complex_.simplices(0))
        if choice.criterion == "connected":
            assert complex_.betti(just_before)[0] != 1
        if choice.criterion == "solid":
            cells = complex_.simplices(complex_.dimension)
            inside = complex_.classify(complex_.dimension, choice.alpha) == INTERIOR
            assert set(cells[inside].ravel().tolist()) == set(complex_.simplices(0).ravel().tolist())
            before = cells[complex_.classify(complex_.dimension, just_before) == INTERIOR]
            assert len(np.unique(before)) < len(complex_.simplices(0)) or complex_.betti(just_before)[0] > 1
        if choice.criterion == "stable":
            within = np.linspace(choice.start, choice.stop, 20)[:-1]
            assert (complex_.betti(within) == betti).all()
        if choice.criterion == "void":
            voids = complex_.voids()
            assert choice.stop - choice.start == (voids.death - voids.birth).max()
            assert betti[-1] > 0


def test_a_sphere_is_chosen_for_its_void_and_a_ball_as_a_solid():
    sphere, ball = alpha_complex(CLOUDS["sphere"]), alpha_complex(CLOUDS["ball"])
    assert sphere.choices()[0].criterion == "void" and sphere.betti(sphere.choices()[0].alpha).tolist() == [1, 0, 1]
    assert ball.choices()[0].criterion == "solid"


@pytest.mark.parametrize("shift", [-3.0, 0.5])
def test_raising_all_weights_lowers_every_choice_by_as_much(shift):
    points = CLOUDS["sphere"]
    before, after = alpha_complex(points).choices(), alpha_complex(points, np.full(len(points), shift)).choices()
    assert [c.criterion for c in before] == [c.criterion for c in after]
    for one, two in zip(before, after):
        assert two.alpha + shift == pytest.approx(one.alpha, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("exponent", [-400, -130, 130, 270])
def test_choices_scale_with_the_points_up_to_the_ends_of_the_range(exponent):
    points = np.random.default_rng(3).normal(size=(30, 3))
    for expected, choice in zip(
        alpha_complex(points).choices(), alpha_complex(np.ldexp(points, exponent)).choices(), strict=True
    ):
        assert choice.criterion == expected.criterion
        assert choice.alpha == pytest.approx(np.ldexp(expected.alpha, 2 * exponent), rel=1e-9)
