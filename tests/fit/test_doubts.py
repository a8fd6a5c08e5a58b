"""What a fit doubts: models that are off, errors that were stated too small, valleys as deep, inputs with noise."""

from __future__ import annotations

import re

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.fit.doubts import doubts_of
from tarsus.fit.input_noise import input_errors, recorded_inputs
from tarsus.fit.problem import Problem
from tarsus.model.scene import Scene

SQUEEZE = "robot.drives.squeeze.law.offset"
TIMES = np.arange(1, 288) / 960.0
"""A video of 0.3 s."""
NOISE = 2e-5
"""Of its places [m]."""


def push(point: str) -> dict[str, object]:
    """A load on one point."""
    return {"kind": "point", "weights": {point: 1.0}}


def held(friction: dict[str, object], squeeze: float) -> Scene:
    """A part of 0.36 kg that is squeezed to an upright pad, which shakes it up and down; in the frame of the pad."""
    shaken = {"kind": "sine", "amplitude": 30.0, "frequency": 15.0, "phase": 0.3, "offset": 0.0}
    return Scene(
        name="held part",
        robot={
            "structure": ts.Lumped(
                coordinates=("press", "part"), mass=(0.1, 0.36), stiffness=(0.0, 0.0), upward=(0.0, 1.0)
            ),
            "drives": {
                "squeeze": {"load": push("press"), "law": {"kind": "linear", "gain": 0.0, "offset": -squeeze}},
                "pad": {"load": push("part"), "law": {"kind": "linear", "gain": -0.36}},
            },
            "feet": {"pad": ts.Foot(point="press", along="part", gap=0.0)},
        },
        ground={"gravity": {"acceleration": 9.81}, "friction": friction},
        signals={"pad": shaken},
        duration=0.3,
    )


TWO = {"kind": "static_kinetic", "static": 0.4, "kinetic": 0.3}
ONE = {"kind": "coulomb", "coefficient": 0.3}
BOUNDS = {SQUEEZE: (-100.0, -10.0)}


def seen(squeeze: float):
    """Residuals of the places of a part with two constants of friction, seen with noise."""
    places = ts.simulate(held(TWO, squeeze)).states(TIMES).x[1]
    record = places + np.random.default_rng(int(squeeze)).normal(0.0, NOISE, len(TIMES))
    return lambda run: (run.states(TIMES).x[1] - record) / NOISE


def test_a_number_of_a_model_that_is_off_is_preferred_and_that_of_a_right_one_determined():
    """By one constant of friction in place of two the squeeze comes out a tenth off, far outside its interval."""
    squeeze = 35.0
    (off,) = (wrong := ts.fit(held(ONE, 50.0), BOUNDS, seen(squeeze))).ranges
    assert not off.low <= -squeeze <= off.high and off.verdict == "preferred"
    assert "residuals are correlated" in str(wrong) and wrong.doubts.failed.all()
    (right,) = (found := ts.fit(held(TWO, 50.0), BOUNDS, seen(squeeze))).ranges
    assert right.low <= -squeeze <= right.high and right.verdict == "determined"
    assert found.doubts.notes == ()
    (cut,) = ts.fit(held(TWO, 50.0), {SQUEEZE: (-squeeze, -10.0)}, seen(squeeze)).ranges
    assert cut.low == -np.inf and cut.high == pytest.approx(right.high, abs=0.005)  # a bound is no measurement


def test_of_a_plateau_one_point_is_a_start_and_what_it_does_not_tell_is_open():
    """A part that is held does not move, however hard it is squeezed: from 36 N on all runs are the same."""
    (firm,) = ts.fit(held(ONE, 50.0), BOUNDS, seen(60.0)).ranges
    assert firm.verdict == "undecided" and not np.isfinite(firm.low)
    (near,) = ts.fit(held(TWO, 90.0), BOUNDS, seen(35.0)).ranges  # a third of the bounds is no plateau
    assert near.value == pytest.approx(-35.0, rel=1e-3)


def test_two_valleys_as_deep_are_one_interval():
    def either(run):
        gap = run.scene.robot.feet["tip"].gap
        return [(gap - 62e-6) * (gap - 75e-6) / 1e-11]

    found = ts.fit("cantilever", {"robot.feet.tip.gap": ("55 um", "85 um")}, either, "1 ms")
    (gap,) = found.ranges
    assert gap.low < 62.1e-6 and gap.high > 74.9e-6
    assert len(found.valleys) >= 1 and "ended elsewhere as deep" in str(found)


def line(count: int, seed: int, correlation: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of a slope that was fitted to noise of an autoregression, and their Jacobian."""
    random, jacobian = np.random.default_rng(seed), np.linspace(0.5, 1.5, count)[:, None]
    noise = random.normal(0.0, size, count)
    for k in range(1, count):
        noise[k] += correlation * noise[k - 1]
    slope = float(np.linalg.lstsq(jacobian, noise, rcond=None)[0][0])
    return np.array([slope]), noise - jacobian[:, 0] * slope


@pytest.mark.parametrize(("correlation", "size"), [(0.0, 1.0), (0.0, 3.0), (0.6, 1.0)])
def test_errors_are_those_that_slopes_have(correlation, size):
    """Of white residuals with the stated errors nothing is doubted; of others the error is near the true scatter."""
    jacobian = np.linspace(0.5, 1.5, 400)[:, None]
    stated = 1.0 / np.sqrt((jacobian**2).sum(axis=0))
    slopes, errors, failed = [], [], []
    for seed in range(60):
        slope, left = line(400, seed, correlation, size)
        doubts = doubts_of(left, jacobian, [slice(0, 400)], stated)
        slopes.append(slope[0])
        errors.append(doubts.errors[0])
        failed.append(bool(doubts.failed[0]))
    assert np.mean(failed) == (1.0 if correlation else 0.0)
    assert np.mean(errors) / np.std(slopes) == pytest.approx(1.0, abs=0.3)
    if size > 1.0:
        assert np.mean(errors) == pytest.approx(size * stated[0], rel=0.1)


def test_lags_weigh_as_sums_over_windows():
    """Weights that fall by the lag: sums of squares of windows of one sample more than the lags (Newey and West)."""
    _, left = line(400, 1, 0.8, 3.0)
    jacobian = np.linspace(0.5, 1.5, 400)
    found = doubts_of(left, jacobian[:, None], [slice(0, 400)], np.array([0.01]))
    (said,) = re.findall(r"over (\d+) of 400 samples", found.notes[0])
    windows = np.convolve(jacobian * left, np.ones(int(said) + 1))
    expected = np.sqrt((windows**2).sum() / (int(said) + 1)) / (jacobian**2).sum()
    assert int(said) > 3 and found.errors[0] == pytest.approx(expected, rel=1e-12)


def oscillator(wave: np.ndarray) -> Scene:
    """A mass of 1 kg on a spring of 1 kN/m, pulled by a recorded wave."""
    return Scene(
        name="oscillator",
        robot={
            "structure": ts.Lumped(coordinates=("x",), mass=(1.0,), stiffness=(1000.0,), damping=(3.0,)),
            "drives": {"pull": {"load": push("x"), "law": {"kind": "linear", "gain": 1.0}}},
            "feet": {"far": ts.Foot(point="x", gap=1.0)},
        },
        signals={"pull": {"kind": "sampled", "times": tuple(np.arange(len(wave)) * 0.01), "levels": tuple(wave)}},
        duration=0.4,
    )


def test_the_error_by_the_noise_of_an_input_is_the_scatter_of_fits_with_other_noise():
    """Twelve recordings of one pull, each with its own noise: their fits scatter by what one of them says."""
    wave, times = np.sin(np.arange(41) * 0.25), np.linspace(0.02, 0.4, 16)
    unknowns = {"robot.structure.stiffness.0.0": (900.0, 1100.0)}
    record = ts.simulate(oscillator(wave)).states(times).x[0]

    def off(run):
        return (run.states(times).x[0] - record) / 1e-4

    found = []
    for seed in range(12):
        given = oscillator(wave + np.random.default_rng(seed).normal(0.0, 0.05, len(wave)))
        found.append(ts.fit.least_squares(Problem(given, unknowns, off)).x[0])
    problem = Problem(oscillator(wave), unknowns, off)
    inputs = recorded_inputs(problem.scene, {"signals.pull": "50 mV"})
    (error,) = input_errors(problem, np.array([0.5]), inputs, seed=1)
    assert error == pytest.approx(np.std(found), rel=0.5)  # of 12, to a fifth; of 32, to an eighth
    problem = ts.fit(oscillator(wave), unknowns, off, noise={"signals.pull": "50 mV"})
    (known,) = problem.ranges
    assert known.high - known.low == pytest.approx(
        2.0 * 1.96 * 200.0 * np.hypot(error, problem.found.uncertainty.errors[known.name] / 200.0), rel=0.02
    )


@pytest.mark.parametrize(
    ("noise", "said"),
    [
        ({"signals.pad": "1 V"}, "signals.pad is no sampled signal"),
        ({"signals.pat": "1 V"}, "signals.pat"),
        ({"signals.pad": "1 V", "signals.pat": "1 V"}, "no sampled signal.*\n.*signals.pat"),
    ],
)
def test_noise_is_that_of_a_recorded_signal(noise, said):
    with pytest.raises(InputError, match=said):
        ts.fit(held(TWO, 50.0), BOUNDS, lambda run: run.states(TIMES[:3]).x[1] / NOISE, noise=noise)
