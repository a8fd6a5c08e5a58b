"""Oracles 1 to 3: bouncing ball, accumulation of bounces, grazing of an impact oscillator.

The ball on a vibrating table (4) and the oscillator's orbit are in tests/orbits.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene

BOUNCE, CAPTURE, REST = 1, 2, 4
FALL = math.sqrt(2.0 / 9.81)


def test_bouncing_ball_follows_the_published_events():
    run = ts.simulate(scene("ball"))
    assert run.ok
    times = [
        0.4515236409857308,
        1.264266194760045,
        1.995734493156927,
        2.654055961714119,
        3.246545283415589,
        3.779785672946910,
    ]
    speeds = [3.986502226263017, 3.587852003636709, 3.229066803273031]
    assert run.events["kind"].tolist() == [BOUNCE] * 6
    np.testing.assert_allclose(run.events["time"], times, rtol=1e-10)
    np.testing.assert_allclose(run.events["speed_after"][:3], speeds, rtol=1e-10)
    np.testing.assert_allclose(run.events["speed_before"] * 0.9, run.events["speed_after"], rtol=1e-14)
    np.testing.assert_allclose(run.events["apex"][1:], 0.81 ** np.arange(1, 6), rtol=1e-10)


@pytest.mark.parametrize("e", [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999])
def test_infinitely_many_bounces_end_at_rest(e):
    over = FALL * (1.0 + e) / (1.0 - e)
    run = ts.simulate(scene("ball", {"ground.restitution.coefficient": e}), duration=1.2 * over)
    assert run.ok
    last = run.events[-1]
    assert last["kind"] == (REST if e > 0.0 else CAPTURE)
    assert last["time"] == pytest.approx(over, rel=1e-10)
    # a flight e times as long as the one before: the number of those above the resolution is logarithmic in it
    assert len(run.events) <= 2 + (math.log(1e-15) / math.log(e) if e > 0.0 else 0.0)
    rest = run.at(np.linspace(over * (1.0 + 1e-9), 1.2 * over, 50))
    assert rest.state.held.all() and np.all(rest.state.v == 0.0)
    assert run.ledger.impacts == pytest.approx(9.81, rel=1e-10)


@pytest.mark.parametrize("duration", [0.4, 1.2, 3.0])
@pytest.mark.parametrize("hz", [2.0, 10.0, 11.0, 31.0])
def test_a_ball_in_flight_follows_a_drive_that_is_faster_than_anything_of_it(hz, duration):
    """A free ball has no rate of its own, so that steps could span whole numbers of half swings, which look level at
    nodes that lie alike about the middle."""
    rate, size = 2.0 * math.pi * hz, 2.0
    push = ts.Drive(load=ts.PointLoad(weights={"ball": 1.0}), law=ts.LinearForce(gain=1.0))
    changes = {
        "robot.drives": {"push": push},
        "signals": {"push": ts.Sine(amplitude=size, frequency=hz)},
        "initial.velocity": [-size / rate],
    }
    run = ts.simulate(scene("ball", changes), duration)
    times = np.linspace(0.0, 0.35, 20)
    fall = -0.5 * 9.81 * times**2 - size / rate**2 * np.sin(rate * times)
    np.testing.assert_allclose(run.states(times).x[0], fall, atol=1e-10)


@pytest.mark.parametrize(("excess", "touches"), [(-1e-9, False), (1e-9, True), (1e-6, True)])
def test_grazing_amplitude(excess, touches):
    """COCO's example 15.2: k = 1, c = 0.1, A cos t, stop at 1. The steady swing reaches the stop at
    A = d sqrt((k - w^2)^2 + (c w)^2) = 0.1, at first at a quarter turn."""
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
