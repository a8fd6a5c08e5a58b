"""Chains of own unknowns eliminated link by link: against one dense system."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tarsus.fit.chain_equations import ChainEquations


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
