"""Least squares of many records against scipy's, which fits one dense problem."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tarsus.fit import Descent, NormalEquations, descend

T = np.linspace(0.0, 3.0, 25)
RATE = 1.3


@pytest.fixture(scope="module")
def decays():
    """Eight records a exp(-k t) + b that share k, with noise of 0.02 and different lengths."""
    rng = np.random.default_rng(5)
    amounts, floors = rng.uniform(1.0, 3.0, 8), rng.uniform(-0.5, 0.5, 8)
    return [
        (T[: 25 - n], a * np.exp(-RATE * T[: 25 - n]) + b + rng.normal(0.0, 0.02, 25 - n))
        for n, (a, b) in enumerate(zip(amounts, floors, strict=True))
    ]


def left(record, a, b, k):
    return (a * np.exp(-k * record[0]) + b - record[1]) / 0.02


def equations_of(decays, asked=None):
    def equations(own, shared, part):
        residuals, slopes = [], []
        for (a, b, *k), number in zip(own, part, strict=True):
            rate = shared[0] if len(shared) else k[0]
            fall, t = np.exp(-rate * decays[number][0]), decays[number][0]
            residuals.append(left(decays[number], a, b, rate))
            slopes.append(np.stack([fall, np.ones_like(t), -a * t * fall], axis=1) / 0.02)
        if asked is not None:
            asked.append(len(part))
        return NormalEquations.of(residuals, slopes, own.shape[1])

    return equations


def test_records_that_share_an_unknown_end_where_one_dense_problem_does(decays):
    def every(x):
        return np.concatenate([left(one, *x[2 * n : 2 * n + 2], x[-1]) for n, one in enumerate(decays)])

    dense = least_squares(every, np.append(np.tile([1.0, 0.0], 8), 0.5), x_scale="jac", xtol=1e-12, ftol=1e-12)
    found = descend(equations_of(decays), np.tile([1.0, 0.0], (8, 1)), np.array([0.5]), how=Descent(settled=1e-6))
    assert found.settled.all() and found.shared == pytest.approx(dense.x[-1:], rel=1e-6)
    assert found.own == pytest.approx(dense.x[:-1].reshape(8, 2), rel=1e-5)
    information = found.equations.reduced()[0].sum()
    assert information == pytest.approx(1.0 / np.linalg.inv(dense.jac.T @ dense.jac)[-1, -1], rel=1e-4)


def test_what_is_known_of_a_shared_unknown_weighs_as_one_more_residual(decays):
    centre, information = np.array([1.0]), np.array([[1e4]])

    def every(x):
        own = [left(one, *x[2 * n : 2 * n + 2], x[-1]) for n, one in enumerate(decays)]
        return np.concatenate([*own, [100.0 * (x[-1] - 1.0)]])

    dense = least_squares(every, np.append(np.tile([1.0, 0.0], 8), 0.5), x_scale="jac", xtol=1e-12, ftol=1e-12)
    found = descend(
        equations_of(decays),
        np.tile([1.0, 0.0], (8, 1)),
        np.array([0.5]),
        prior=(centre, information),
        how=Descent(settled=1e-6),
    )
    assert found.shared == pytest.approx(dense.x[-1:], rel=1e-6) and found.shared[0] < RATE - 0.05


def test_records_of_their_own_go_down_side_by_side_and_settled_ones_are_asked_no_more(decays):
    asked: list[int] = []
    start = np.tile([1.0, 0.0, 0.5], (8, 1))
    found = descend(equations_of(decays, asked), start, how=Descent(settled=1e-4))
    for n, one in enumerate(decays):
        alone = least_squares(lambda x, one=one: left(one, *x), [1.0, 0.0, 0.5], x_scale="jac")
        assert found.own[n] == pytest.approx(alone.x, rel=1e-3)
        assert found.equations.covariance()[n] == pytest.approx(np.linalg.inv(alone.jac.T @ alone.jac), rel=0.02)
    assert found.settled.all() and asked[0] == 8 and asked[-1] < 8


def test_an_unknown_at_its_bound_stays_there_and_the_others_are_best_for_it(decays):
    top = np.array([np.inf, np.inf, 1.0])
    found = descend(equations_of(decays), np.tile([1.0, 0.0, 0.5], (8, 1)), how=Descent(settled=1e-5, high=top))
    for n, one in enumerate(decays):
        alone = least_squares(lambda x, one=one: left(one, *x, 1.0), [1.0, 0.0], x_scale="jac")
        assert found.own[n] == pytest.approx([*alone.x, 1.0], rel=1e-4)
    assert found.settled.all()


def test_a_step_that_would_gain_nothing_is_not_taken_and_slopes_are_not_asked_for_it(decays):
    base, asked = equations_of(decays), []

    def equations(own, shared, part):
        asked.append(len(part))
        return base(own, shared, part)

    def costs(own, shared, part):
        return base(own, shared, part).cost + np.where(own[:, 2] > 0.7, np.nan, 0.0)  # a cliff of no number

    found = descend(equations, np.tile([1.0, 0.0, 0.5], (8, 1)), costs=costs, how=Descent(rounds=40))
    assert (found.own[:, 2] <= 0.7).all() and (found.own[:, 2] > 0.55).all()
    assert sum(asked) < 8 * (found.rounds + 1)
