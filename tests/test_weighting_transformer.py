"""Weights as scikit-learn has them."""

import subprocess
import sys

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.pipeline import make_pipeline, make_union
from sklearn.preprocessing import FunctionTransformer, StandardScaler

import datasets_synthetic
import recon
import weighting
from weighting import AdaptiveWeights


@pytest.fixture(scope="module")
def cloud():
    points = datasets_synthetic.surface("torus").sample(2000, density=10, rng=0).points
    return np.concatenate([points, points[:5]])


@pytest.mark.parametrize("options", [{}, {"radius": "covering"}, {"cap": 0.5}, {"theta": 0.3}])
def test_the_weights_are_those_of_the_function(cloud, options):
    column = AdaptiveWeights(**options).fit_transform(cloud)
    assert column.shape == (len(cloud), 1)
    assert np.array_equal(column[:, 0], weighting.adaptive_weights(cloud, **options))


def test_elsewhere_a_weight_hides_no_neighbour_and_is_the_greatest_such(cloud):
    model = AdaptiveWeights().fit(cloud)
    places = np.random.default_rng(1).uniform(-1.2, 1.2, (300, 3))
    found = model.transform(places)[:, 0]
    bounds = model.weights_ + model.theta * ((places[:, None] - cloud) ** 2).sum(axis=2)
    near = np.argsort(((places[:, None] - cloud) ** 2).sum(axis=2), axis=1)[:, :5]
    assert (found <= np.take_along_axis(bounds, near, axis=1).min(axis=1) * (1 + 1e-12)).all()
    assert np.allclose(found, bounds.min(axis=1))  # no far point asks for less


def test_it_stands_among_others_in_a_union_and_a_pipeline(cloud):
    table = make_union(FunctionTransformer(), AdaptiveWeights()).fit_transform(cloud)
    result = recon.reconstruct(table[:, :3], table[:, 3])
    assert np.array_equal(result.mesh.faces, recon.reconstruct(cloud).mesh.faces)
    scaled = make_pipeline(StandardScaler(), AdaptiveWeights(threads=1)).fit(cloud)
    assert clone(scaled).get_params()["adaptiveweights__threads"] == 1
    assert AdaptiveWeights().set_output(transform="default").fit(cloud).get_feature_names_out().tolist() == ["weight"]


def test_scikit_learns_own_checks_pass():
    from sklearn.utils.estimator_checks import check_estimator

    check_estimator(AdaptiveWeights())


def test_weighting_does_not_wait_for_scikit_learn():
    code = "import sys, weighting; assert 'AdaptiveWeights' in weighting.__all__; print('sklearn' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert out.stdout == "False\n", out.stderr
    with pytest.raises(AttributeError, match="no attribute 'Weights'"):
        _ = weighting.Weights
