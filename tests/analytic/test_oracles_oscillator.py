"""Oracle 3: the impact oscillator of COCO's example 15.2 (k = 1, c = 0.1, A cos t, stop at 1, e = 0.8)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene

TURN = 2.0 * math.pi
PHASE, BEFORE, AFTER = 0.0759521649, 1.6957329376, -1.3565863501


def test_period_one_orbit():
    """From the published start values the run settles on the orbit."""
    start = {"signals.shaker.phase": math.pi / 2 + 0.076, "initial.displacement": [1.0], "initial.velocity": [-1.36]}
    run = ts.simulate(scene("impact_oscillator", start))
    last = run.events[-10:]
    assert run.ok and np.all(last["kind"] == 1)
    np.testing.assert_allclose(np.diff(last["time"]), TURN, rtol=1e-10)
    np.testing.assert_allclose((last["time"] + 0.076) % TURN, PHASE, atol=1e-9)
    np.testing.assert_allclose(last["speed_before"], BEFORE, rtol=1e-10)
    np.testing.assert_allclose(last["speed_after"], -AFTER, rtol=1e-10)


@pytest.mark.parametrize(("excess", "touches"), [(-1e-9, False), (1e-9, True), (1e-6, True)])
def test_grazing_amplitude(excess, touches):
    """The steady swing reaches the stop at A = d sqrt((k - w^2)^2 + (c w)^2) = 0.1, at first at a quarter turn."""
    amplitude = 0.1 * (1.0 + excess)
    values = {
        "signals.shaker.amplitude": amplitude,
        "initial.displacement": [0.0],
        "initial.velocity": [amplitude / 0.1],
    }
    run = ts.simulate(scene("impact_oscillator", values), duration=20.0)
    assert run.ok and (len(run.events) > 0) == touches
    if touches:
        # x = (1 + excess) sin t reaches 1 where cos t = sqrt(2 excess); it is that fast there
        assert run.events["time"][0] == pytest.approx(math.acos(math.sqrt(2.0 * excess)), abs=1e-6)
        assert run.events["speed_before"][0] == pytest.approx(math.sqrt(2.0 * excess), rel=1e-5)
