"""Drives with stretches shorter than any step of the engine: steep ramps, and plays that a turn barely reaches."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms import OnOff, Sampled, Sine
from tarsus.solve import Run

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
