"""Oracle 6: closing of a MEMS switch (published table), of the packaged device."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tarsus as ts

STIFFNESS, GAP, TRAVEL, RATIO = 42.0, 3.8e-6, 2.6e-6, 0.02
OMEGA = 2.0 * math.pi * 21e3
MASS = STIFFNESS / OMEGA**2
FORCE = 1.9e-11 * MASS  # eps A / 2


def switch(level: float | ts.OnOff, **values: Any) -> ts.Scene:
    """The packaged switch held at a voltage, or with a signal of its own."""
    signal = level if isinstance(level, ts.OnOff) else ts.Constant(level=level)
    return ts.load_scene("mems-switch", **{"signals.gate": signal, **values})


@pytest.mark.parametrize(
    ("volts", "time", "speed"), [(80.0, 69.24e-6, 0.1394), (90.0, 27.795e-6, 0.23378), (140.0, None, None)]
)
def test_closing_as_published_and_as_another_integrator_has_it(volts, time, speed):
    def flow(t: float, state: Any) -> list[float]:
        x, v = state
        pull = FORCE * volts**2 / (GAP - x) ** 2
        return [v, (pull - STIFFNESS * x) / MASS - 2.0 * RATIO * OMEGA * v]

    def closed(t: float, state: Any) -> float:
        return state[0] - TRAVEL

    closed.terminal = True  # type: ignore[attr-defined]
    other = solve_ivp(flow, (0.0, 1e-4), [0.0, 0.0], "DOP853", events=closed, rtol=1e-12, atol=(1e-18, 1e-13))
    run = ts.simulate(switch(volts), 100e-6)
    closing = run.events[0]
    assert run.ok and run.ledger.closure < 1e-8
    if time is not None:
        assert closing["time"] == pytest.approx(time, rel=0.5e-9 / time if volts == 90.0 else 5e-9 / time)
        assert closing["speed_before"] == pytest.approx(speed, abs=0.6e-5 if volts == 90.0 else 0.6e-4)
    assert closing["time"] == pytest.approx(other.t_events[0][0], rel=1e-9)
    assert closing["speed_before"] == pytest.approx(other.y_events[0][0, 1], rel=1e-9)


def pull_in(ratio: float, low: float, high: float, duration: float) -> tuple[float, float]:
    """Voltage between which and which a step closes the switch."""
    still = switch(low, **{"robot.structure.damping_ratios": [ratio]})
    for _ in range(4):
        levels = np.linspace(low, high, 17)
        batch = ts.simulate_batch(still, {"signals.gate.level": levels}, duration=duration, threads=1)
        closed = np.array([len(batch.events(i)) > 0 for i in range(len(levels))])
        assert np.all(np.diff(closed.astype(int)) >= 0) and closed[-1] and not closed[0]
        first = int(np.argmax(closed))
        low, high = levels[first - 1], levels[first]
    return low, high


def test_dynamic_pull_in():
    low, high = pull_in(RATIO, 79.0, 81.0, 2e-3)
    assert high - low < 1e-3
    assert 0.5 * (low + high) == pytest.approx(79.943, abs=5e-4)


def test_static_pull_in():
    """An overdamped switch creeps: a step closes it only above the static pull-in voltage."""
    low, high = pull_in(5.0, 86.0, 87.0, 2.0)
    exact = math.sqrt(8.0 * STIFFNESS * GAP**3 / (27.0 * 2.0 * FORCE))
    assert exact == pytest.approx(86.307, abs=5e-4)
    assert low - 1e-5 < exact < high + 1e-5


def test_a_pulse_and_a_coast_close_it_softly():
    """One pair at 0 and 90 V: full volts, then none, so that the spring takes the speed away before the contact."""
    scene = ts.load_scene("mems-switch")
    design = ts.design.landing(
        scene, "beam", pairs=1, levels="0 V, 90 V", tick=10e-9, shortest=1e-6, effort=0.4, risk="nominal"
    )
    assert design.before.speed[0, 0] == pytest.approx(0.23327, abs=1e-5)  # rung down to 0.5 %, not at rest
    assert design.touchdowns == 1.0 and design.speed < 0.015
    assert design.signal.levels == (90.0, 0.0, 90.0, 0.0)
    pulse, coast = design.signal.durations[:2]
    assert pulse + coast == pytest.approx(29.8e-6, abs=1e-6)  # 2 us later than the step
    events = ts.simulate(design.scene, 12e-3).events
    landings = events[events["speed_before"] > 0.0]
    periodic = landings["speed_before"][landings["time"] > 4e-3]
    assert len(periodic) == 2 and periodic.max() == pytest.approx(design.speed, rel=0.05)
    # 13 nm of ringing that is not there yet: a landing is soft for the motion that it was made for
    assert 0.03 < landings["speed_before"][landings["time"] < 4e-3].max() < 0.1


def test_a_switch_held_by_volts_opens_when_they_are_gone():
    signal = ts.OnOff(levels=(90.0, 60.0, 0.0), durations=(40e-6, 30e-6, 1.0))
    run = ts.simulate(switch(signal), duration=150e-6)
    assert run.events["kind"].tolist()[:2] == [2, 3]
    assert run.events["time"][1] == pytest.approx(70e-6, rel=1e-12)
    assert run.ledger.closure < 1e-8
