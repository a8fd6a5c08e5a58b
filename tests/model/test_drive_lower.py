"""Lowering: any plays under any history, steep stretches, and drives of many runs at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import tarsus as ts
from drive_cases import PRINTED, WAVEFORMS, jumps
from scene_files import scene as scene_of
from tarsus.base.spec import float_paths
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii
from tarsus.model.drive.lower import Pieces, evaluate, lower
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms import OnOff, RampedSquare, Sampled, Sine
from tarsus.plan.channels import drive_courses
from tarsus.solve import Run


def direct(waveform: Signal, law: VoltageLaw, t: np.ndarray, history: list[float]) -> np.ndarray:
    """Force at sorted times from the direct formula, with the turning points put in between."""
    track = waveform.track()
    if track.periodic:
        track = track.twice()
    edges = track.start[track.start <= t[-1]]
    before = np.nextafter(edges[1:], 0.0)
    extra = np.setdiff1d(np.concatenate([edges, before]), jumps(waveform))
    every = np.concatenate([t, np.append(0.0, extra)])
    order = np.argsort(every, kind="stable")
    forces = np.empty(len(every))
    forces[order] = law.force(waveform.volts(every[order]), history)
    return forces[: len(t)]


def check_shape(pieces: Pieces, terms: float = 0.0, slopes: tuple[float, float] = (0.0, 0.0)) -> None:
    """Well-formed, and smooth in value, slope and curvature wherever no kink is marked.

    `terms` is the size of the terms that may cancel in the values, `slopes` that of those which may cancel in
    the first two derivatives.
    """
    assert pieces.start[0] == 0.0
    assert np.all(np.diff(pieces.start) > 0.0)
    assert pieces.coef.shape == (pieces.count, 12)
    assert pieces.coef.dtype == np.float64 and pieces.coef.flags.c_contiguous
    assert np.isfinite(pieces.coef).all()
    assert -1 <= pieces.loop < pieces.count
    smooth = np.flatnonzero(~pieces.kink)
    smooth = smooth[smooth > 0]
    pairs = [(p - 1, p) for p in smooth]
    if pieces.loop >= 0 and not pieces.kink[pieces.loop]:
        pairs.append((pieces.count - 1, pieces.loop))
    if not pairs:
        return
    left, right = np.array(pairs).T
    k = np.arange(12)
    scale = 2.0 / np.diff(pieces.start)
    top = max(terms, float(np.abs(pieces.coef).sum(axis=1).max()))
    for order, weight in enumerate((np.ones(12), k, k * (k - 1))):
        ends = (pieces.coef @ weight) * scale**order
        begins = (pieces.coef @ (weight * (-1.0) ** (k - order))) * scale**order
        size = max(np.abs(ends).max(), np.abs(begins).max(), (0.0, *slopes)[order], 1e-300)
        # values are known to rounding only, which the slopes of a very short piece magnify
        rounding = (1e-15, 1e-14, 1e-12)[order] * top * np.maximum(scale[left], scale[right]) ** order
        miss = np.abs(ends[left] - begins[right]) - rounding
        assert miss.max() <= (1e-12, 5e-10, 1e-7)[order] * size


def test_play_engagement_is_found_exactly_and_marked() -> None:
    """A triangle of +-8 V through one play of 3 V: engaged from -2 V rising on, and from 2 V falling on."""
    law = PrandtlIshlinskii(linear=0.0, thresholds=(3.0,), weights=(1e-6,))
    wave = RampedSquare(amplitude=8.0, frequency=1.0, duty=1.0)
    force, volts = lower(wave, law)
    # at 32 V/s: engages at 3 V, turns at 8 V, engages at 2 V, turns at -8 V, engages at -2 V
    wanted = [0, 3 / 32, 0.25, 0.25 + 6 / 32, 0.75, 0.75 + 6 / 32, 1.0, 1.25, 1.25 + 6 / 32, 1.75, 1.75 + 6 / 32, 2.0]
    np.testing.assert_allclose(force.start, wanted, rtol=0, atol=2e-16)
    assert force.kink.tolist() == [False, True, True, True, True, True, False, True, True, True, True]
    assert force.loop == 6
    assert volts.kink.tolist() == [False, True, True]
    assert np.all(force.coef[[0, 2, 4, 7, 9], 1:] == 0.0)  # the play rests
    assert np.all(force.coef[[1, 3, 5, 6, 8, 10], 1] != 0.0)


@example([1e-12], [], 1.0, 0.0, 0.0, 1.0, [6.8e-178])  # a sliver of a piece
@example([0.0], [], 1.0, 0.0, 0.0, 0.9999999999999999, [0.0])  # a plateau shorter than rounding
@example([5.0], [9.0], 0.015625, 0.0, 0.0, 1.0, [1.0])  # a small swing on a large force
@example([1.0, 0.0], [], 0.01, -0.75, -3.0, 1.0, [-1.0, -0.5])  # slopes of the terms that nearly cancel
@given(
    thresholds=st.lists(st.floats(0.0, 12.0), min_size=1, max_size=6),
    history=st.lists(st.floats(-12.0, 12.0), max_size=4),
    amplitude=st.floats(0.01, 10.0),
    phase=st.floats(-7.0, 7.0),
    offset=st.floats(-3.0, 3.0),
    duty=st.floats(0.05, 1.0),
    weights=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
)
def test_any_plays_any_history(
    thresholds: list[float],
    history: list[float],
    amplitude: float,
    phase: float,
    offset: float,
    duty: float,
    weights: list[float],
) -> None:
    weights = weights[: len(thresholds)]
    law = PrandtlIshlinskii(
        linear=1.0, quadratic=0.02, cubic=0.003, thresholds=tuple(thresholds), weights=tuple(weights)
    )
    common = {"amplitude": amplitude, "frequency": 1.0, "phase": phase, "offset": offset}
    for wave in (Sine(**common), RampedSquare(**common, duty=duty)):
        pieces, _ = lower(wave, law, history)
        branches = 1.0 + sum(map(abs, weights))
        turning = 2.0 * np.pi  # of one period a second
        check_shape(
            pieces, terms=20.0 * branches, slopes=(amplitude * turning * branches, amplitude * turning**2 * branches)
        )
        t = np.linspace(0.0, 2.0, 801)
        wanted = direct(wave, law, t, history)
        size = float(np.abs(wanted).max()) + 1.0
        assert np.abs(evaluate(pieces, t) - wanted).max() <= 2e-13 * size + 1e-12 * float(np.ptp(wanted))


AIR = 0.03


def drive_law() -> PrandtlIshlinskii:
    return PrandtlIshlinskii(linear=-4e-7, thresholds=(1.5, 3.0), weights=(-4e-8, -6e-8))


def driven(signal: Signal, gap: float, history: tuple[float, ...] = (9.0, 0.0), duration: float = 2.0) -> Run:
    scene = ts.load_scene("cantilever")
    changes = {
        "signals.pzt": signal,
        "robot.feet.tip.gap": gap,
        "robot.drives.pzt.law": drive_law(),
        "robot.drives.pzt.history": history,
    }
    return ts.simulate(ts.with_values(scene, changes), duration)


@pytest.mark.parametrize("ramp", [1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize("gap", [70e-6, AIR])
def test_a_steep_ramp_is_a_jump(ramp: float, gap: float) -> None:
    times = (0.0, 1e-3, 1e-3 + ramp, 2e-3, 2e-3 + ramp, 0.01)
    steep = driven(Sampled(times=times, levels=(0.0, 0.0, 8.0, 8.0, 0.0, 0.0)), gap)
    jump = driven(OnOff(levels=(0.0, 8.0, 0.0), durations=(1e-3, 1e-3, 1.0)), gap)
    assert steep.ok and jump.ok, steep.code
    assert len(steep.events) == len(jump.events)
    t = np.linspace(0.0, 0.02, 501)
    got, wanted = steep.states(t).x, jump.states(t).x
    np.testing.assert_allclose(got, wanted, rtol=0.0, atol=(1e-9 + 1e5 * ramp) * np.abs(wanted).max())


@pytest.mark.parametrize("beyond", [0.0, 1e-16, 1e-13, 1e-11, 1e-9])
def test_a_turn_that_barely_reaches_a_play(beyond: float) -> None:
    """A trough at -0.3 V goes that far [V] beyond where the plays rest: what they add is no more than that."""
    sine = Sine(amplitude=0.3, frequency=500.0)
    run = driven(sine, AIR, (9.0, beyond - 0.3, 0.0))
    free = driven(sine, AIR, (9.0, -0.3 - 1e-6, 0.0))  # the plays are out of reach, and 1e-6 V lower
    assert run.ok and free.ok, run.code
    assert not len(run.events)
    t = np.linspace(0.0, 0.1, 301)
    got, wanted = run.states(t).v, free.states(t).v
    np.testing.assert_allclose(got, wanted, rtol=0.0, atol=1e-5 * np.abs(wanted).max())


PLAYS = ts.drives.PrandtlIshlinskii(
    linear=-1e-4, quadratic=2e-6, cubic=1e-7, thresholds=(0.5, 1.5, 3.0, 5.0), weights=(-1e-4, -2e-4, -1e-4, -5e-5)
)
STRONG = {"linear": ts.LinearForce(gain=-1e-4, offset=2e-5), "plays": PLAYS, "branches": PRINTED}


def check(scene: ts.Scene, varied: dict[str, np.ndarray]) -> None:
    """Force and volts of every run are the pieces of the changed scene alone, to the last bit."""
    course = drive_courses(scene, varied, ["pull"])["pull"]
    for run in range(len(course.which)):
        own = ts.with_values(scene, {path: float(column[run]) for path, column in varied.items()})
        drive = own.robot.drives["pull"]
        alone = lower(own.actuator_volts["pull"], drive.law, drive.history)
        for channels, wanted in zip((course.force, course.volts), alone, strict=True):
            got = channels[course.which[run]]
            for name in ("start", "coef", "kink"):
                np.testing.assert_array_equal(getattr(got, name), getattr(wanted, name), err_msg=f"{run} {name}")
            assert got.loop == wanted.loop


@pytest.mark.parametrize("law", STRONG)
@pytest.mark.parametrize("wave", WAVEFORMS)
def test_every_number_of_a_signal_at_once(wave, law):
    drive = {"robot.drives.pull.law": STRONG[law], "robot.drives.pull.history": (10.0, 0.0)}
    scene = ts.with_values(scene_of("p1_n2"), {**drive, "signals": {"pull": WAVEFORMS[wave]}})
    rng = np.random.default_rng(7)
    # of some runs all numbers are a little different, of the first none is
    small = {path: 0.01 * rng.uniform(0.0, 1.0, 5) * (np.arange(5) > 0) for path in float_paths(scene)}
    check(
        scene, {path: ts.get_value(scene, path) * (1.0 - small[path]) for path in small if path.startswith("signals.")}
    )


def test_what_has_no_amplitude_or_no_edge_is_constant_beside_what_has():
    for wave, path, values in (
        (ts.Sine(amplitude=1.0, frequency=50.0, phase=0.3, offset=2.0), "amplitude", [0.0, 1.0, 3.0]),
        (ts.Square(amplitude=8.0, frequency=50.0), "duty", [0.0, 0.3, 1.0, 0.5]),
        (ts.waveforms.RampedSquare(amplitude=8.0, frequency=50.0, duty=0.2), "amplitude", [0.0, 3.0]),
        (ts.OnOff(levels=(3.0, 5.0), durations=(0.01, 0.02), repeat=True), "levels.1", [3.0, 5.0, 3.0]),
        (ts.OnOff(levels=(3.0, 5.0, 1.0), durations=(0.01, 0.02, 0.01)), "durations.1", [1e-3, 1e-17]),
        (ts.Sampled(times=(0.0, 0.1, 0.2, 0.3), levels=(1.0, 1.0, 1.0, 5.0)), "times.0", [0.0, 0.05]),
        (ts.Sampled(times=(0.0, 0.1, 0.2, 0.3), levels=(1.0, 2.0, 1.0, 5.0)), "levels.1", [1.0, 2.0]),
    ):
        scene = ts.with_values(scene_of("p1_n2"), {"robot.drives.pull.law": PLAYS, "signals": {"pull": wave}})
        check(scene, {f"signals.pull.{path}": np.array(values)})
