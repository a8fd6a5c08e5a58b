"""Means and common ratios with their intervals: closed forms, and coverage on made pairs."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.impacts.estimates import common_ratio, spread


def test_a_mean_with_its_interval():
    found = spread([0.4, 0.5, 0.6])
    assert found.value == pytest.approx(0.5) and found.scatter == pytest.approx(0.1) and found.n == 3
    assert found.std == pytest.approx(0.1 / np.sqrt(3.0))
    assert found.high - found.value == pytest.approx(4.302653 * found.std, rel=1e-6)
    assert np.isnan(spread([0.5]).std)


def pairs(random: np.random.Generator, n: int, ratio: float, scatter: float, noise: np.ndarray):
    """Pairs (y, x) with correlated noise and a ratio of their own each."""
    x = random.uniform(0.2, 3.0, n)
    own = ratio + scatter * random.standard_normal(n)
    size = random.uniform(0.5, 2.0, n)
    cov = noise[None] * (size**2)[:, None, None]
    errors = np.einsum("nij,nj->ni", np.linalg.cholesky(cov), random.standard_normal((n, 2)))
    return own * x + errors[:, 0], x + errors[:, 1], cov


def test_one_pair_has_the_interval_of_its_noise():
    found = common_ratio([1.0], [2.0], [[[1e-4, 5e-5], [5e-5, 4e-4]]])
    assert found.value == pytest.approx(0.5)
    assert found.std == pytest.approx(np.sqrt(1e-4 - 5e-5 + 0.25 * 4e-4) / 2.0, rel=1e-6)
    assert found.high - found.low == pytest.approx(2.0 * 1.959964 * found.std, rel=1e-6)


@pytest.mark.parametrize("scatter", [0.0, 0.11])
def test_intervals_cover(scatter):
    random = np.random.default_rng(11)
    noise = np.array([[0.01, -0.006], [-0.006, 0.02]])
    found = [common_ratio(*pairs(random, 25, 0.51, scatter, noise)) for _ in range(400)]
    values = np.array([one.value for one in found])
    covered = np.mean([one.low <= 0.51 <= one.high for one in found])
    assert 0.92 < covered < 0.98
    assert values.mean() == pytest.approx(0.51, abs=3.5 * values.std() / 20.0)
    assert np.mean([one.std for one in found]) == pytest.approx(values.std(), rel=0.12)
    if scatter:
        assert np.mean([one.scatter for one in found]) == pytest.approx(scatter, rel=0.1)


def test_what_pairs_share_does_not_average_out():
    random = np.random.default_rng(13)
    n, zero, covered, blind = 60, 0.01, [], []
    cov = np.tile(1e-4 * np.eye(2), (n, 1, 1))
    x = np.linspace(1.0, 2.0, n)
    for _ in range(300):
        shift = zero * random.standard_normal()
        y_seen, x_seen = (0.5 * x, x) + 0.01 * random.standard_normal((2, n)) + np.array([[-shift], [shift]])
        shared = np.tile([-zero, zero], (1, n, 1))
        for kept, found in (
            (covered, common_ratio(y_seen, x_seen, cov, shared)),
            (blind, common_ratio(y_seen, x_seen, cov)),
        ):
            kept.append(found.low <= 0.5 <= found.high)
    assert 0.91 < np.mean(covered) < 0.98
    assert np.mean(blind) < 0.5


def test_neighbours_made_of_the_same_samples_tell_less():
    random = np.random.default_rng(14)
    n, covered, blind = 60, [], []
    cov = np.tile(np.diag([2e-4, 1e-12]), (n, 1, 1))
    following = np.tile(np.diag([1e-4, 0.0]), (n - 1, 1, 1))
    x = np.linspace(1.0, 2.0, n)
    for _ in range(300):
        noise = 0.01 * random.standard_normal(n + 1)
        y = 0.5 * x + noise[1:] + noise[:-1]
        for kept, found in ((covered, common_ratio(y, x, cov, following=following)), (blind, common_ratio(y, x, cov))):
            kept.append(found.low <= 0.5 <= found.high)
    assert 0.91 < np.mean(covered) < 0.98
    assert np.mean(blind) < 0.9
    alone, linked = (
        common_ratio(0.5 + 0.01 * (-1.0) ** np.arange(n), np.ones(n), cov, following=one) for one in (None, following)
    )
    assert linked.std / alone.std == pytest.approx(np.sqrt(1.0 + (n - 1) / n)), (
        "of a sum, neighbours correlated by half"
    )
