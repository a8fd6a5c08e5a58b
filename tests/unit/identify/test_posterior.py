"""Posteriors with known answers, by emcee; and what is said without it."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.base.errors import InputError
from tarsus.identify.feature_likelihood import FeatureLikelihood, Observed
from tarsus.identify.features import features_of
from tarsus.identify.posterior import sample_posterior, weigh_prior
from tarsus.identify.prior import LogNormalPrior
from tarsus.identify.verdict import Determined, OnlyTogether

PRIOR = LogNormalPrior(("a", "b"), np.array([2.0, 3.0]), np.diag([1.0, 1.0]))


def product_only(theta):
    return -0.5 * (np.log(theta[:, 0] * theta[:, 1] / 6.0) / 0.05) ** 2


def test_a_gaussian_posterior_is_the_exact_one():
    def likelihood(theta):
        return -0.5 * ((np.log(theta / [2.2, 2.5]) / [0.5, 0.1]) ** 2).sum(axis=1)

    found = sample_posterior(likelihood, PRIOR, steps=2200, seed=3)
    variance = 1.0 / (1.0 + 1.0 / np.array([0.5, 0.1]) ** 2)
    middle = variance / np.array([0.5, 0.1]) ** 2 * np.log([2.2 / 2.0, 2.5 / 3.0])
    logs = np.log(found.samples / PRIOR.values)
    assert logs.mean(axis=0) == pytest.approx(middle, abs=0.03)
    assert logs.std(axis=0) == pytest.approx(np.sqrt(variance), rel=0.08)
    assert found.settled and 0.2 < found.acceptance < 0.9
    assert found.as_prior().std == pytest.approx(np.sqrt(variance), rel=0.08)


def test_only_a_product_is_known_and_the_same_seed_gives_the_same_draws():
    found, again, other = (sample_posterior(product_only, PRIOR, steps=400, seed=s) for s in (1, 1, 2))
    assert np.array_equal(found.samples, again.samples) and not np.array_equal(found.samples, other.samples)
    verdict = found.judge()["a"]
    assert isinstance(verdict, OnlyTogether) and str(verdict.combination) == "a * b"
    assert verdict.combination.interval.half_width() == pytest.approx(1.96 * 0.05, rel=0.15)


# Slow: 976 runs. The likelihood of features stays in test_features.py, posteriors with exact answers above.
@pytest.mark.slow
def test_restitution_from_the_features_of_one_record():
    path = "ground.restitution.coefficient"
    ramped = {"signals.pzt.kind": "ramped_square", "signals.pzt.duty": 0.25}
    scene = ts.load_scene(LABORATORY, volts=2, hz=100, **ramped)
    truth = ts.get_value(scene, path)
    observed = Observed(scene, features_of(ts.simulate(scene, 0.08)), 0.08)
    prior = LogNormalPrior((path,), np.array([1.15 * truth]), np.array([[0.3**2]]))
    found = sample_posterior(
        FeatureLikelihood([observed], [path]), prior, walkers=16, steps=60, seed=5
    ).judge()
    assert isinstance(found[path], Determined)
    assert found.range(path).low < truth < found.range(path).high


def test_weighing_the_prior_gives_the_exact_posterior_too():
    def likelihood(theta):
        return -0.5 * ((np.log(theta / [2.2, 2.5]) / [0.5, 0.4]) ** 2).sum(axis=1)

    found = weigh_prior(likelihood, PRIOR, draws=8192, seed=2)
    variance = 1.0 / (1.0 + 1.0 / np.array([0.5, 0.4]) ** 2)
    middle = variance / np.array([0.5, 0.4]) ** 2 * np.log([2.2 / 2.0, 2.5 / 3.0])
    logs = np.log(found.samples / PRIOR.values)
    assert logs.mean(axis=0) == pytest.approx(middle, abs=0.02)
    assert logs.std(axis=0) == pytest.approx(np.sqrt(variance), rel=0.05)
    assert 1000.0 < found.effective < 4000.0
    near = LogNormalPrior(PRIOR.paths, np.array([2.3, 2.5]), np.diag([0.3, 0.2]))
    nearer = weigh_prior(likelihood, PRIOR, proposal=near, draws=8192, seed=2)
    logs = np.log(nearer.samples / PRIOR.values)
    assert logs.mean(axis=0) == pytest.approx(middle, abs=0.02)
    assert logs.std(axis=0) == pytest.approx(np.sqrt(variance), rel=0.05)
    assert nearer.effective > 1.3 * found.effective
    with pytest.raises(InputError, match="the proposal is of b, a, the prior of a, b"):
        weigh_prior(likelihood, PRIOR, proposal=LogNormalPrior(("b", "a"), near.values, near.covariance))
    with pytest.raises(InputError, match="1 of 64 draws"):
        weigh_prior(lambda theta: -1e6 * np.log(theta[:, 0] / 2.0) ** 2, PRIOR, draws=64)
    with pytest.raises(InputError, match="0 of 64 draws"):
        weigh_prior(lambda theta: np.full(len(theta), -np.inf), PRIOR, draws=64)


def test_what_cannot_be_drawn():
    with pytest.raises(InputError) as refused:
        sample_posterior(product_only, PRIOR, walkers=3, steps=4)
    assert len(refused.value.problems) == 2
    with pytest.raises(InputError, match="0 of 128 draws of the prior"):
        sample_posterior(lambda theta: np.full(len(theta), -np.inf), PRIOR)
    with pytest.raises(InputError) as refused:
        LogNormalPrior(("a", "b"), np.array([0.0, 1.0]), np.diag([1.0, 0.0]))
    assert len(refused.value.problems) == 2


def test_without_emcee_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(InputError, match=r"pip install 'tarsus\[posterior\]'"):
        sample_posterior(product_only, PRIOR)
