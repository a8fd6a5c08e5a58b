"""What holds for any run: it ends in a sentence, stays above the ground, makes no energy, closes its ledger."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import tarsus as ts
from printed_robots import UNIT, hexapod, printed_map
from tarsus.solve.motion import NOTHING

QUICK = settings(max_examples=24, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])


def check(run: ts.Run, closure: float = 1e-8) -> ts.Run:
    """Assert every invariant on a finished run."""
    assert run.ok, run.code.value
    series = run.at(np.linspace(0.0, run.duration, 3001))
    state = series.state
    for values in (state.x, state.v, state.gap, state.rate, state.pull):
        assert np.isfinite(values).all()
    assert state.gap.min(initial=0.0) >= -1e-12
    ledger = run.ledger
    assert ledger.closure < closure
    terms = (ledger.work_in, ledger.kinetic, ledger.elastic, ledger.damping, ledger.impacts, 1e-300)
    scale = max(abs(x) for x in terms)
    if ledger.closure > 0.0:
        scale = max(scale, abs(ledger.residual) / ledger.closure)  # below that all is rounding
    length, force, _ = run.motion.acting.rows.scales[0]
    scale = max(scale, NOTHING * force * length)  # and below that, wherever
    for loss in (ledger.damping, -ledger.laws.get("film", 0.0), ledger.impacts, ledger.adhesion):
        assert loss >= -1e-9 * scale
    events = run.events
    assert np.all(np.diff(events["time"]) >= 0.0)
    assert np.all(events["speed_after"] <= events["speed_before"])
    assert np.all(events["energy"] >= -1e-14 * max(np.abs(events["energy"]).max(initial=0.0), scale))
    for name in events.dtype.names or ():
        assert np.isfinite(events[name]).all(), name
    return run


def mass(
    *,
    frequency: float = 0.0,
    ratio: float = 0.0,
    gap: float = 1e-5,
    signal: object = None,
    gain: float = 1e-4,
    start: float = 0.0,
    speed: float = 0.0,
    duration: float = 0.03,
    **ground: object,
) -> ts.Scene:
    """One mass of 1 mg on a spring, with a drive and a foot that the drive's volts attract."""
    w = 2.0 * math.pi * frequency
    structure = ts.Lumped(coordinates=("x",), mass=1e-6, stiffness=1e-6 * w**2, damping=2.0 * ratio * w * 1e-6)
    drive = ts.Drive(load=ts.PointLoad(weights={"x": 1.0}), law=ts.LinearForce(gain=gain))
    return ts.Scene(
        name="one mass",
        robot=ts.Robot(
            structure=structure, drives={"d": drive}, feet={"f": ts.Foot(point="x", gap=gap, electrode="d")}
        ),
        ground=ts.Ground(**ground),  # type: ignore[arg-type]
        signals={"d": signal} if signal is not None else {},  # type: ignore[dict-item]
        initial=ts.Initial(displacement=(start,), velocity=(speed,)),
        duration=duration,
    )


RAMP = ts.waveforms.Ramp(start=-5.0, stop=20.0, duration=0.02)
SINE, SQUARE = ts.Sine(amplitude=5.0, frequency=100.0), ts.Square(amplitude=5.0, frequency=100.0)
# nothing, or more than an atom
lengths = st.one_of(st.just(0.0), st.floats(1e-9, 1e-4))
restitution = st.one_of(st.sampled_from([0.0, 1.0, 0.5]), st.floats(0.0, 0.99))
signals = st.one_of(
    st.builds(ts.Sine, amplitude=st.floats(0.0, 20.0), frequency=st.floats(20.0, 2000.0), phase=st.floats(0.0, 6.0)),
    st.builds(ts.Square, amplitude=st.floats(0.0, 20.0), frequency=st.floats(20.0, 1000.0), duty=st.floats(0.1, 0.9)),
    st.builds(
        ts.waveforms.RampedSquare,
        amplitude=st.floats(0.0, 20.0),
        frequency=st.floats(20.0, 1000.0),
        duty=st.floats(0.0, 1.0),
    ),
    st.builds(
        ts.waveforms.Ramp, start=st.floats(-20.0, 20.0), stop=st.floats(-20.0, 20.0), duration=st.floats(1e-4, 0.02)
    ),
)


@QUICK
@given(
    e=restitution,
    signal=signals,
    frequency=st.floats(30.0, 3000.0),
    ratio=st.floats(0.0, 2.0),
    gap=lengths,
    adhesion=st.one_of(st.none(), st.tuples(st.floats(0.0, 1e-4), st.floats(0.0, 1.0))),
    film=st.one_of(st.none(), st.tuples(st.floats(0.0, 1e-20), st.floats(1e-6, 1e-4))),
    attraction=st.one_of(st.none(), st.tuples(st.floats(0.0, 1e-15), st.floats(1e-7, 1e-5))),
)
def test_one_mass(e, signal, frequency, ratio, gap, adhesion, film, attraction):
    check(
        ts.simulate(
            mass(
                frequency=frequency,
                ratio=ratio,
                gap=gap,
                signal=signal,
                restitution=ts.Restitution(coefficient=e),
                adhesion=None if adhesion is None else ts.Adhesion(initial=adhesion[0], rate=adhesion[1]),
                film=None if film is None else ts.Film(coefficient=film[0], thickness=film[1]),
                electrostatic=attraction and ts.Electrostatic(coefficient=attraction[0], offset=attraction[1]),
            )
        )
    )


STRENGTHS = [(0.0, 0.0), (0.0, 1e6), (1e-9, 1e-12), (1e-4, 0.0), (1e9, 0.0)]


@pytest.mark.parametrize(("initial", "rate"), STRENGTHS)
@pytest.mark.parametrize(("signal", "gap"), [(SQUARE, 0.0), (RAMP, 0.0), (SINE, 1e-5)], ids=("square", "ramp", "sine"))
def test_adhesion_of_any_strength(initial, rate, gap, signal):
    """None, growing at once, never let go: also with a drive that grows until it pulls the foot off."""
    run = check(
        ts.simulate(
            mass(
                frequency=500.0,
                ratio=0.02,
                gap=gap,
                signal=signal,
                adhesion=ts.Adhesion(initial=initial, rate=rate),
                restitution=ts.Restitution(coefficient=0.4),
            )
        )
    )
    if initial == 1e9:
        assert not np.any(run.events["kind"] == 3)


def test_a_film_is_resolved_in_a_step_of_half_an_oscillation():
    """At 32 Hz a step of 1/64 s brings the gap back to where a force found it: its end says nothing of the error.

    Speed of landing: an independent solution (DOP853, relative tolerance 1e-13) of the same equation.
    """
    film = ts.Film(coefficient=3.0400345887930194e-21, thickness=2.3662972318957683e-05)
    signal = ts.Square(amplitude=1.0, frequency=35.0)
    scene = mass(frequency=32.0, gap=0.0, signal=signal, restitution=ts.Restitution(coefficient=0.0), film=film)
    run = check(ts.simulate(scene))
    assert run.events["speed_before"][0] == pytest.approx(1.3940093460159, rel=1e-9)


THICK = ts.Film(coefficient=7.751589404059684e-21, thickness=6.449820320703989e-05)


@pytest.mark.parametrize(
    ("signal", "ratio", "gap", "film"),
    [
        (ts.Sine(amplitude=2e-80, frequency=20.0, phase=1.0), 1.0, 0.0, THICK),
        (ts.Constant(level=0.0), 0.0, 7.7825e-5, THICK),
        (
            ts.Sine(amplitude=1.192092896e-07, frequency=20.0),
            0.0,
            0.0,
            ts.Film(coefficient=6.14213840557671e-21, thickness=1e-6),
        ),
        (
            ts.Square(amplitude=2.61e-8, frequency=100.0),
            0.451,
            1.22e-8,
            ts.Film(coefficient=1.85e-22, thickness=2.81e-6),
        ),
    ],
)
def test_rounding_in_a_film_is_no_open_account(signal, ratio, gap, film):
    """Energies are differences of those of the film's momentum, whose rounding is larger than what next to no motion
    has; or the way of the foot is 1e-5 of the film's thickness, and its gap known to 5e-10 of that. Found by search."""
    plastic = ts.Restitution(coefficient=0.0)
    check(ts.simulate(mass(frequency=30.0, ratio=ratio, gap=gap, signal=signal, restitution=plastic, film=film)))


def test_a_film_leaves_the_account_of_small_motion_as_strict():
    small = mass(frequency=30.0, ratio=1.0, signal=ts.Sine(amplitude=1e-3, frequency=20.0), film=THICK)
    ledger = check(ts.simulate(small)).ledger
    terms = (ledger.work_in, ledger.kinetic, ledger.elastic, ledger.damping, ledger.impacts)
    assert abs(ledger.residual) == pytest.approx(ledger.closure * max(abs(x) for x in terms))


def test_volts_that_switch_exactly_at_an_impact():
    """Free fall over 10 um under 9.81 m/s^2 lands at the very moment of the switch."""
    fall = math.sqrt(2.0 * 1e-5 / 9.81)
    signal = ts.OnOff(levels=(0.0, 5.0, 0.0), durations=(fall, 1e-4, 1.0))
    run = check(ts.simulate(mass(signal=signal, gravity=ts.Gravity(), restitution=ts.Restitution(coefficient=0.5))))
    assert run.events["time"][0] == pytest.approx(fall, rel=1e-12)


def test_chatter_in_a_stiff_film_comes_to_rest():
    # Flights far below the error of a step are not bounces: without an end to them 1e5 would fit in a millisecond.
    film = ts.Film(coefficient=1e-11 * UNIT, thickness=2.5e-6)
    figures = ts.Electrostatic(coefficient=5e-9 * UNIT, offset=33e-6)
    scene = hexapod(signal=ts.Sine(amplitude=10.0, frequency=40.0), static=4.5e-6, film=film, electrostatic=figures)
    for gap in (1e-6, 1e-8):
        run = ts.simulate(scene, duration=0.2, accuracy=ts.Accuracy(gap=gap, steps=20000))
        assert run.end_time == 0.2 and run.log.finish[0, 1] < 5000
        assert len(run.events) < 1000 and np.isin(run.events["kind"], (2, 4)).sum() >= 8  # once a period at least
    assert run.ok  # at the coarse one the account stays open


def test_late_edges_of_a_drive_are_passed():
    # At 8 s the next edge of a drive may be nearer than the spacing of floating-point times: it counts as reached.
    drive = ts.Square(amplitude=7.558655866212344, frequency=631.0882186399392)
    scene = hexapod(signal=drive, gap=1e-4)
    run = ts.simulate(scene, duration=8.5, accuracy=ts.Accuracy(steps=300_000))
    assert run.ok and run.end_time == 8.5


def test_a_foot_let_go_without_acceleration_rises():
    # A pull that only just outgrows its hold leaves a foot with jerk alone; such releases were once taken back.
    scene = ts.with_values(
        hexapod(signal=ts.Sine(amplitude=10.0, frequency=60.0), static=20e-6), {"initial.velocity": (0.0,) * 6}
    )
    speeds = 1e-3 * np.random.default_rng(1).normal(size=(140, 6))
    vary = {f"initial.velocity.{i}": speeds[:, i] for i in range(6)}
    batch = ts.simulate_batch(scene, vary, duration=0.46, accuracy=ts.Accuracy(steps=20000))
    assert all(code.name == "DONE" for code in batch.codes)


def test_an_impact_that_tears_others_off_is_not_lost():
    scene = hexapod(signal=ts.Square(amplitude=10.0, frequency=40.0), feet=6, gap=2e-6)
    run = check(ts.simulate(scene, duration=0.1, accuracy=ts.Accuracy(steps=20000)))
    assert set(run.events["foot"]) == set(range(6))


def test_the_printed_map_diverges():
    # The documented example: 10 V square, the printed R as it is. The foot is a kilometre up before the first second.
    scene = hexapod(
        signal=ts.Square(amplitude=10.0, frequency=30.0), impact=printed_map(passive=False), restitution=0.5
    )
    run = ts.simulate(scene, duration=0.5)
    heights = [np.abs(run.states(np.linspace(0.0, end, 2001)).x).max() for end in (0.1, 0.3, 0.5)]
    # how fast is chaos, which the last bit of its modes changes: 5e5 to 3e9 times within those 0.4 s
    assert heights[1] > 10.0 * heights[0] and heights[2] > 1e4 * heights[0]
    assert run.ledger.impacts < 0.0, "impacts have made energy"
    longer = ts.simulate(scene, duration=2.0)
    assert longer.code.name == "DIVERGED" and "creates energy" in longer.code.value


TIMES = np.linspace(0.0, 0.1, 101)
WAVES = {
    "sine": ts.Sine(amplitude=8.0, frequency=50.0),
    "square": ts.Square(amplitude=8.0, frequency=50.0),
    "ramped square": ts.waveforms.RampedSquare(amplitude=8.0, frequency=50.0, duty=0.25),
    "swept sine": ts.waveforms.SweptSine(amplitude=8.0, start_frequency=20.0, stop_frequency=900.0, duration=0.1),
    "ramp": ts.waveforms.Ramp(stop=9.0, duration=0.05),
    "on-off": ts.OnOff(levels=(8.0, -8.0, 3.0, -6.0), durations=(0.004, 0.006, 0.003, 0.005), repeat=True),
    "poling": ts.waveforms.Poling(level=10.0, hold=0.02, fall=0.01),
    "sampled": ts.Sampled(times=tuple(TIMES), levels=tuple(8.0 * np.sin(400.0 * TIMES))),
}


@pytest.mark.parametrize("device", ["cantilever", "cantilever-1"])
@pytest.mark.parametrize("wave", WAVES)
def test_a_cantilever_through_its_hysteresis(device, wave):
    """Prandtl-Ishlinskii (cantilever) and two branches (cantilever-1) under every waveform."""
    run = check(ts.simulate(ts.with_values(ts.load_scene(device), {"signals.pzt": WAVES[wave]}), duration=0.06))
    assert run.ledger.impacts + run.ledger.adhesion == pytest.approx(run.events["energy"].sum(), rel=1e-12)
    assert np.any(run.events["kind"] == 2) and np.all(run.events["adhesion_energy"] >= 0.0)
