"""Creep and rate-dependent hysteresis: closed forms, the inverse, the fit, and what a robot sees of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from model.test_drive_lower import check_shape
from tarsus.files.toml import parse_scene
from tarsus.model.drive.laws import Creeping, PrandtlIshlinskii, fit_rates
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.waveforms import Constant, Sampled, Sine, Square

INSTANT = PrandtlIshlinskii(linear=1e-6, quadratic=2e-8, thresholds=(1.0, 2.0), weights=(2e-7, 1e-7))
LAW = Creeping(
    instant=INSTANT,
    thresholds=(0.0, 1.5, 0.0, 0.5),
    weights=(1e-7, 2e-7, 3e-7, 5e-8),
    times=(0.05, 0.05, 3e-3, 2.0),
    temperature=303.15,
    per_kelvin=4e-3,
)


def test_a_step_is_followed_by_exponentials() -> None:
    """From a microsecond to 1e4 s: at once, then each element of its play from its rest at the end of the history."""
    for history in ((), (9.0, -2.0)):
        force = lower(Constant(level=5.0), LAW, history)[0]
        check_shape(force)
        t = np.append(0.0, np.geomspace(1e-6, 1e4, 300))
        r, w, lags = LAW.elements()
        before = np.zeros(4)
        for volts in history:
            before = np.clip(before, volts - r, volts + r)
        after = np.clip(before, 5.0 - r, 5.0 + r)
        late = after + (before - after) * np.exp(-t[:, None] / lags)
        wanted = 1.04 * (INSTANT.force([5.0], history)[0] + late @ w)
        np.testing.assert_allclose(evaluate(force, t), wanted, rtol=2e-13, atol=0)
        assert evaluate(force, t)[-1] == pytest.approx(LAW.force([5.0], history)[0], rel=1e-13)


@pytest.mark.parametrize("hz", [1e-3, 1e-5])
@pytest.mark.parametrize("lag", [1e-5, 1e-7, 1e-9, 1e-12, 1e-15])
def test_elements_far_faster_than_the_signal(lag: float, hz: float) -> None:
    """After each edge of a square an exponential of its own, though its pieces begin at rounded instants; none of an
    element that settles within the rounding of time. Some pieces passed for such in which it had settled."""
    plain = PrandtlIshlinskii(linear=1e-6)
    law = Creeping(instant=plain, thresholds=(0.0,), weights=(5e-7,), times=(lag,))
    force = lower(Square(amplitude=5.0, frequency=hz), law)[0]
    assert np.all(np.diff(force.start) > 0.0)
    t = lag * np.array([0.1, 0.5, 1.0, 1.4, 2.5, 5.0, 40.0])
    left = np.exp(-t / lag) if 36.0 * lag > 1e-12 / hz else np.zeros(len(t))
    np.testing.assert_allclose(evaluate(force, t), 5e-6 + 2.5e-6 * (1.0 - left), rtol=1e-11)
    np.testing.assert_allclose(evaluate(force, np.array([0.3, 0.7]) / hz), [7.5e-6, -7.5e-6], rtol=1e-12)


@pytest.mark.parametrize("lag", [1e-5, 1e-9])
def test_a_robot_feels_elements_far_faster_than_the_signal(lag: float) -> None:
    """It moves as under the force that they make at rest, but for an impulse of what they lag."""
    creeping = f"""
        kind = "creeping", instant = {{ kind = "prandtl_ishlinskii", linear = 1e-6 }},
        thresholds = [0], weights = [5e-7], times = [{lag}]"""
    found = []
    for law in (creeping, 'kind = "linear", gain = 1.5e-6'):
        scene = parse_scene(f"""
            name = "fast"
            duration = "2 s"
            signals.d = {{ kind = "square", amplitude = 5.0, frequency = 1e-3 }}
            [robot.structure]
            kind = "lumped"
            coordinates = ["x"]
            mass = ["1 g"]
            stiffness = ["1 N/m"]
            damping_ratios = [0.05]
            [robot.drives.d]
            load = {{ kind = "point", weights = {{ x = 1.0 }} }}
            law = {{ {" ".join(law.split())} }}
        """)
        run = ts.simulate(scene)
        assert run.ok and run.ledger.closure < 1e-9
        found.append(run.at(np.linspace(0.1, 2.0, 20)).state.x)
    impulse, impedance = 2.5e-6 * lag, 1e-3 * math.sqrt(1.0 / 1e-3)
    assert np.abs(found[0] - found[1]).max() < 1.01 * impulse / impedance + 1e-13


def steady(t: float, amplitude: float, hz: float, r: float, lag: float) -> float:
    """An element under a sine that has come for ever: the integral of exp(-(t - s)/T) play(s)/T over one period.

    The play is -A + r at the bottom, follows the voltage by r below from there on, and rests at the turns.
    """
    omega, period = 2.0 * math.pi * hz, 1.0 / hz
    turn = math.asin((2.0 * r - amplitude) / amplitude) / omega  # from the rising zero of the voltage on
    edges = [turn, period / 4.0, period / 2.0 + turn, 3.0 * period / 4.0, turn + period]
    rate, total = 1.0 / lag, 0.0
    for turns in range(-2, 2):
        for k, level in enumerate((-r, amplitude - r, r, r - amplitude)):
            a, b = max(edges[k] + turns * period, t - period), min(edges[k + 1] + turns * period, t)
            if a >= b:
                continue
            ends = np.exp(rate * (np.array([a, b]) - t))
            total += level * (ends[1] - ends[0])
            if k in (0, 2):
                swing = np.imag(ends * np.exp(1j * omega * np.array([a, b])) / (rate + 1j * omega))
                total += amplitude * rate * (swing[1] - swing[0])
    return total / -math.expm1(-period * rate)


@pytest.mark.parametrize("hz", [0.1, 3.0, 60.0, 1000.0])
def test_loops_are_those_of_the_closed_form(hz: float) -> None:
    amplitude, r, w, lags = 5.0, 1.5, 2e-7, (1e-3, 0.03, 0.5)
    plain = PrandtlIshlinskii(linear=1e-6)
    law = Creeping(instant=plain, thresholds=(r,) * 3, weights=(w,) * 3, times=lags)
    force = lower(Sine(amplitude=amplitude, frequency=hz), law)[0]
    begin = float(force.start[force.loop])
    times = np.linspace(0.0, 1.0 / hz, 23)[:-1]
    wanted = [
        1e-6 * amplitude * math.sin(2.0 * math.pi * hz * t) + w * sum(steady(t, amplitude, hz, r, lag) for lag in lags)
        for t in times
    ]
    found = evaluate(force, begin + times)
    assert np.abs(found - wanted).max() < 1e-9 * np.ptp(found)


def test_the_way_to_a_loop_is_that_of_straight_moves() -> None:
    """Of a voltage that is straight between samples, at each of which the elements are known, and held at the end."""
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(1e-4, 0.2, 40)) - 1e-4
    volts = rng.uniform(-8.0, 8.0, 40)
    times -= times[0]
    signal = Sampled(times=tuple(times), levels=tuple(volts))
    force = lower(signal, LAW, (3.0,))[0]
    check_shape(force)
    later = np.append(times, times[-1] + np.array([0.01, 3.0]))
    held = np.append(volts, [volts[-1]] * 2)
    wanted = LAW.along(later, held, (3.0,))
    np.testing.assert_allclose(evaluate(force, later), wanted, rtol=0, atol=1e-12 * np.ptp(wanted))


def test_the_inverse_gives_the_forces_that_are_wanted() -> None:
    rng = np.random.default_rng(5)
    times = np.linspace(0.0, 0.3, 60)
    wanted = 4e-6 * np.sin(40.0 * times) + 5e-7 * rng.normal(size=60)
    volts = LAW.inverse(times, wanted, (4.0, 1.0))
    span = np.ptp(wanted)
    np.testing.assert_allclose(LAW.along(times, volts, (4.0, 1.0)), wanted, rtol=0, atol=1e-14 * span)
    signal = Sampled(times=tuple(times), levels=tuple(volts))
    force = lower(signal, LAW, (4.0, 1.0))[0]
    assert np.abs(evaluate(force, times) - wanted).max() < 1e-11 * span


def test_loops_at_several_rates_tell_the_elements() -> None:
    """Exact loops give the law back; with 0.1 % of noise its creep to a few per cent."""
    law = Creeping(
        instant=INSTANT, thresholds=(0.0, 0.0, 1.5, 1.5), weights=(1e-7, 3e-7, 0.0, 2e-7), times=(3e-3, 0.3, 3e-3, 0.3)
    )
    phase = np.linspace(0.0, 1.0, 201)
    rng, loops, noisy = np.random.default_rng(7), [], []
    for hz in (0.1, 1.0, 10.0, 100.0):
        times, volts = phase / hz, 6.0 * np.sin(2.0 * np.pi * phase)
        volts[-1] = volts[0]
        force = law.along(times, volts, loop=True)
        loops.append((times, volts, force))
        noisy.append((times, volts, force + 1e-3 * np.ptp(force) * rng.normal(size=201)))
    found = fit_rates(loops, (0.0, 1.5), (3e-3, 0.3), (1.0, 2.0))
    assert found.thresholds == (0.0, 0.0, 1.5, 1.5) and found.times == law.times
    np.testing.assert_allclose(found.weights, law.weights, rtol=1e-8, atol=1e-15)
    np.testing.assert_allclose(found.instant.weights, INSTANT.weights, rtol=1e-8)
    near = fit_rates(noisy, (0.0, 1.5), (3e-3, 0.3), (1.0, 2.0))
    np.testing.assert_allclose(near.weights, law.weights, rtol=0.06, atol=2e-8)


@pytest.mark.parametrize(
    "wave", [Constant(level=5.0), Sine(amplitude=6.0, frequency=40.0), Square(amplitude=5.0, frequency=30.0)]
)
@pytest.mark.parametrize("seconds", [0.0, 1.3e-3, 0.0377, 0.3, 0.71])
def test_what_lags_can_be_taken_up_at_any_moment(wave, seconds):
    """A signal that is left at a moment and held there: the force goes on as that of the two in one."""
    history = (9.0, -2.0)
    late = LAW.late(wave.track(), history, None, seconds)
    (before, _), last = lower(wave, LAW, history), wave.volts(np.array([seconds]))[0]
    dense = np.union1d([0.0, seconds], np.arange(0.0, seconds, 1.0 / 480.0))  # all extremes of both waves among them
    past = (*history, *wave.volts(dense))
    (held,) = LAW.channels(Constant(level=last).track(), past, late)
    now = 1.04 * (INSTANT.force([last], past)[0]) + late.sum()
    assert evaluate(held, np.zeros(1))[0] == pytest.approx(now, rel=1e-12)
    assert evaluate(before, np.array([seconds]))[0] == pytest.approx(now, rel=1e-7)
    forever = evaluate(held, np.array([1e4]))[0]
    assert forever == pytest.approx(LAW.force([last], past)[0], rel=1e-6)
