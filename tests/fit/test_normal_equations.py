"""Least squares of many records against scipy's, which fits one dense problem; chains against one dense system."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares

from tarsus.fit import Descent, NormalEquations, descend
from tarsus.fit.chain_equations import ChainEquations

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


@pytest.mark.parametrize("known", [0.0, 1e4])
def test_records_that_share_an_unknown_end_where_one_dense_problem_does(decays, known):
    """What is known of it, about 1 with an information, weighs as one more residual."""

    def every(x):
        own = [left(one, *x[2 * n : 2 * n + 2], x[-1]) for n, one in enumerate(decays)]
        return np.concatenate([*own, [np.sqrt(known) * (x[-1] - 1.0)]])

    dense = least_squares(every, np.append(np.tile([1.0, 0.0], 8), 0.5), x_scale="jac", xtol=1e-12, ftol=1e-12)
    prior = (np.array([1.0]), np.array([[known]])) if known else None
    start = np.tile([1.0, 0.0], (8, 1)), np.array([0.5])
    found = descend(equations_of(decays), *start, prior=prior, how=Descent(settled=1e-6))
    assert found.settled.all() and found.shared == pytest.approx(dense.x[-1:], rel=1e-6)
    assert found.own == pytest.approx(dense.x[:-1].reshape(8, 2), rel=1e-5)
    information = found.equations.reduced()[0].sum() + known
    assert information == pytest.approx(1.0 / np.linalg.inv(dense.jac.T @ dense.jac)[-1, -1], rel=1e-4)
    assert (found.shared[0] < RATE - 0.05) == bool(known)


def test_records_of_their_own_go_down_side_by_side_and_settled_ones_are_asked_no_more(decays):
    asked: list[int] = []
    start = np.tile([1.0, 0.0, 0.5], (8, 1))
    found = descend(equations_of(decays, asked), start, how=Descent(settled=1e-4))
    top = np.array([np.inf, np.inf, 1.0])  # at which the last unknown stays, and the others are best for it
    bound = descend(equations_of(decays), start, how=Descent(settled=1e-5, high=top))
    for n, one in enumerate(decays):
        alone = least_squares(lambda x, one=one: left(one, *x), [1.0, 0.0, 0.5], x_scale="jac")
        assert found.own[n] == pytest.approx(alone.x, rel=1e-3)
        assert found.equations.covariance()[n] == pytest.approx(np.linalg.inv(alone.jac.T @ alone.jac), rel=0.02)
        alone = least_squares(lambda x, one=one: left(one, *x, 1.0), [1.0, 0.0], x_scale="jac")
        assert bound.own[n] == pytest.approx([*alone.x, 1.0], rel=1e-4)
    assert found.settled.all() and asked[0] == 8 and asked[-1] < 8 and bound.settled.all()


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


@pytest.mark.parametrize("links", [1, 2, 5])
def test_a_chain_steps_as_one_dense_system_does(links: int) -> None:
    rng, q, p = np.random.default_rng(links), 3, 2
    size, shared = links * q, slice(links * q, links * q + p)
    rows = list[np.ndarray]()
    for k in range(links):  # of each link some rows, and some that tie it to the next one
        for last in (k, min(k + 1, links - 1)):
            own = np.zeros((6, size + p))
            own[:, k * q : (last + 1) * q] = rng.standard_normal((6, (last + 1 - k) * q))
            own[:, shared] = rng.standard_normal((6, p))
            rows.append(own)
    by = np.vstack(rows)
    off = rng.standard_normal(len(by))
    normal, right = by.T @ by, -by.T @ off
    parts = [slice(k * q, (k + 1) * q) for k in range(links)]
    onward = [normal[a, b] for a, b in pairwise(parts)] + [np.zeros((q, q))]
    chain = ChainEquations(
        np.array([normal[a, a] for a in parts]),
        np.array(onward),
        np.array([normal[a, shared] for a in parts]),
        normal[shared, shared],
        right[:size].reshape(links, q),
        right[shared],
        float(off @ off),
        float(off.size),
    )
    known, pull = np.diag([2.0, 3.0]), np.array([0.5, -0.1])
    whole, wanted = normal.copy(), right.copy()
    whole[shared, shared] += known
    wanted[shared] += pull
    own, step = chain.step(0.0, known, pull)
    assert np.concatenate([own.ravel(), step]) == pytest.approx(np.linalg.solve(whole, wanted), rel=1e-8)
    left = chain.eliminated()
    assert np.linalg.inv(left.information + known) == pytest.approx(np.linalg.inv(whole)[shared, shared], rel=1e-8)
    assert left.taken.reshape(size, p) == pytest.approx(np.linalg.solve(normal[:size, :size], normal[:size, shared]))
    long = np.concatenate([own.ravel(), step]) @ wanted / chain.scale
    assert chain.length(known, pull) == pytest.approx(long, rel=1e-8)
