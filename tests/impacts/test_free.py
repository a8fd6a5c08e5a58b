"""The free motion fitted on both sides of an impact: exact on exact samples, and as uncertain as it says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import tarsus as ts
from hexapod_records import POINTS, structure
from tarsus.impacts.free import FreeResponse, fit_impact

STEP = 5e-6
NOISE = np.full(6, 1e-4)


def samples(before: np.ndarray, change: np.ndarray, late: float, earlier: int, later: int) -> np.ndarray:
    """Velocities (k, 6) of the hexapod with an impact ``late`` [s] after the middle between two samples.

    before: displacements and velocities (12,) at the impact; change (6,): of the velocities.
    """
    m = structure().matrices()
    inverse = np.linalg.inv(m.mass)
    flow = np.block([[np.zeros((6, 6)), np.eye(6)], [-inverse @ m.stiffness, -inverse @ m.damping]])
    after = before + np.concatenate([np.zeros(6), change])
    times = (np.arange(-earlier, later) + 0.5) * STEP - late
    return np.array([(expm(flow * t) @ (after if t > 0.0 else before))[6:] for t in times])


BEFORE = np.concatenate([1e-6 * np.array([-9.0, 2.0, 1.0, 3.0, -1.0, 2.0]), [-0.03, 0.01, 0.02, -0.01, 0.01, 0.02]])
CHANGE = 0.045 * np.array([1.0, -0.35, -0.21, -0.13, -0.51, 0.23])


@pytest.mark.parametrize("late", [0.0, 1.7e-6, -2.3e-6])
def test_exact_samples_give_the_impact_exactly(late):
    free = FreeResponse(structure(), POINTS, NOISE, STEP)
    fit = fit_impact(free, samples(BEFORE, CHANGE, late, 25, 12), 25)
    assert fit is not None
    assert fit.late == pytest.approx(late, abs=1e-4 * STEP)
    assert fit.before == pytest.approx(BEFORE[6:], abs=1e-7)
    assert fit.change == pytest.approx(CHANGE, abs=1e-7)
    assert fit.misfit < 1e-3
    assert fit.freedom == 37 * 6 - 19


def test_errors_are_as_large_as_the_weights_say():
    free = FreeResponse(structure(), POINTS, NOISE, STEP)
    clean = samples(BEFORE, CHANGE, 1e-6, 20, 15)
    random = np.random.default_rng(4)
    fits = [fit_impact(free, clean + NOISE * random.standard_normal(clean.shape), 20) for _ in range(300)]
    kept = [fit for fit in fits if fit is not None]
    assert len(kept) == 300
    found = np.array([np.concatenate([fit.before, fit.change, [fit.late]]) for fit in kept])
    said = np.sqrt(np.sum((kept[0].weights * NOISE) ** 2, axis=(1, 2)))
    assert found.std(axis=0) == pytest.approx(said, rel=0.15)
    truth = np.concatenate([BEFORE[6:], CHANGE, [1e-6]])
    assert np.all(np.abs(found.mean(axis=0) - truth) < 4.0 * said / np.sqrt(300.0))
    misfit = np.array([fit.misfit for fit in kept])
    assert misfit.mean() == pytest.approx(kept[0].freedom, rel=0.03)


def test_samples_just_after_an_impact_can_be_left_out():
    free = FreeResponse(structure(), POINTS, NOISE, STEP)
    smeared = samples(BEFORE, CHANGE, 0.0, 25, 15)
    smeared[25:27] -= 0.3 * CHANGE
    wrong, right = (fit_impact(free, smeared, 25, skip) for skip in (0, 2))
    assert wrong is not None and right is not None
    assert wrong.misfit > 100.0 * wrong.freedom
    assert right.change == pytest.approx(CHANGE, abs=1e-6)
    assert right.freedom == 38 * 6 - 19


def test_a_rigid_body_moves_freely_too():
    # a mass on nothing beside a vibrating one: zero frequency, velocities constant between impacts
    body = ts.Lumped(coordinates=("a", "b"), mass=(1e-3, 1e-3), stiffness=((40.0, -40.0), (-40.0, 40.0)))
    free = FreeResponse(body, ("a", "b"), np.full(2, 1e-4), 1e-4)
    level = np.where(np.arange(40) < 20, -1.0, 0.5)[:, None] * np.ones(2)
    fit = fit_impact(free, level, 20)
    assert fit is not None
    assert fit.change == pytest.approx([1.5, 1.5], abs=1e-9)
    assert abs(fit.late) < 1e-20, "constant velocities do not tell the instant"


def test_samples_that_do_not_determine_an_impact():
    free = FreeResponse(structure(), POINTS, NOISE, STEP)
    assert fit_impact(free, samples(BEFORE, CHANGE, 0.0, 2, 1), 2) is None
    still = fit_impact(free, np.zeros((20, 6)), 10)
    assert still is not None and not np.any(still.change) and not np.any(still.weights[-1])
