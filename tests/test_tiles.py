"""Tiles and threads change nothing: the boundary of W_alpha is the same, facet by facet."""

from __future__ import annotations

import numpy as np
import pytest

from recon import InvalidInput, alpha_complex
from recon.scale.tiles import tiled_boundary


def clouds():
    rng = np.random.default_rng(1)
    sphere = rng.normal(size=(800, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    grid = np.stack(np.meshgrid(*[np.arange(9.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    plate = np.column_stack([rng.integers(0, 12, (500, 2)), rng.integers(0, 2, 500) * 5.0])
    yield "volume", rng.uniform(size=(1500, 3)), rng.uniform(-0.002, 0.006, 1500)
    yield "sphere", sphere, np.full(800, 0.15**2)
    yield "grid", grid, rng.integers(0, 4, len(grid)) * 0.25
    yield "two flat plates", plate, rng.integers(0, 3, 500) * 0.5
    yield "one large ball", np.vstack([sphere, np.zeros((1, 3))]), np.append(np.full(800, 0.01), 0.8)
    yield "far apart", np.vstack([grid, grid + 1e6]), np.full(2 * len(grid), 0.75)
    yield "duplicates", np.repeat(sphere[:200], 4, axis=0), rng.integers(0, 3, 800) * 0.02


CLOUDS = [pytest.param(p, w, id=name) for name, p, w in clouds()]


@pytest.mark.parametrize(("points", "weights"), CLOUDS)
@pytest.mark.parametrize("tiles", [2, 3, 7])
def test_tiles_give_the_identical_boundary(points, weights, tiles):
    whole = alpha_complex(points, weights)
    for alpha in (0.0, -0.01, float(np.median(whole.spectrum())), float(whole.spectrum()[-1])):
        expected, found = whole.boundary(alpha), tiled_boundary(points, weights, alpha, tiles=tiles)
        assert found.facets.tolist() == expected.facets.tolist()
        assert found.singular.tolist() == expected.singular.tolist()


def test_more_tiles_than_points_and_flat_clouds():
    rng = np.random.default_rng(2)
    for points in (
        rng.uniform(size=(6, 3)),
        rng.uniform(size=(50, 2)),
        rng.uniform(size=(50, 2)) @ [[1, 0, 1], [0, 1, 1.0]],
    ):
        expected, found = alpha_complex(points).boundary(0.05), tiled_boundary(points, None, 0.05, tiles=12)
        assert found.facets.tolist() == expected.facets.tolist()


def test_nothing_at_all_within_reach():
    assert len(tiled_boundary(np.random.default_rng(3).uniform(size=(100, 3)), None, -1.0)) == 0


def test_everything_at_infinity():
    points = np.random.default_rng(4).uniform(size=(300, 3))
    expected, found = alpha_complex(points).boundary(np.inf), tiled_boundary(points, None, np.inf, tiles=4)
    assert found.facets.tolist() == expected.facets.tolist()


def test_senseless_requests_are_refused():
    for request in ({"threads": 0}, {"tiles": 0}, {"alpha": np.nan}):
        with pytest.raises(InvalidInput):
            tiled_boundary(np.eye(3), **request)
