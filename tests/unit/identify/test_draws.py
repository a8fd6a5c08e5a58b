"""Draws handed from step to step: what is known to a factor only moves by factors."""

from __future__ import annotations

import numpy as np

from tarsus.identify.draws import DRAWS, carried


def test_a_linear_estimate_of_well_known_numbers_is_carried_exactly() -> None:
    random = np.random.default_rng(1)
    values, slope = np.array([2.0, -3.0]), np.array([[0.5, 0.2]])
    samples = values + 0.01 * random.standard_normal((DRAWS, 2))
    off = carried(lambda x: slope @ x, values, samples)
    np.testing.assert_allclose(off, (samples - values) @ slope.T, rtol=0.0, atol=1e-12)


def test_a_number_known_to_a_factor_only_is_moved_to_where_draws_lie() -> None:
    """Coefficient and thickness of a film over decades: added standard deviations would lead to a thickness below 0."""
    random = np.random.default_rng(2)
    along = random.standard_normal(DRAWS)
    values = np.array([1e-25, 5e-6])
    samples = values * np.exp(np.outer(along, [9.0, 3.0]) + 0.1 * random.standard_normal((DRAWS, 2)))
    met: list[np.ndarray] = []

    def estimate(x: np.ndarray) -> np.ndarray:
        met.append(x)
        return np.array([np.log(x[0] * x[1])])

    off = carried(estimate, values, samples)
    tried = np.array(met)
    assert np.all((tried > samples.min(axis=0)) & (tried < samples.max(axis=0)))
    wanted = np.log(samples[:, 0] * samples[:, 1]) - np.log(values[0] * values[1])
    np.testing.assert_allclose(off[:, 0], wanted, rtol=0.0, atol=0.05 * wanted.std())
