"""Moments of one run: touchdowns, flights, departures, volts at them, speeds of points."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.base.errors import InputError
from tarsus.measure import departure, flight, point_speed, touchdown, touchdown_times, volts_at

FALL = math.sqrt(2.0 / 9.81)


@pytest.fixture(scope="module")
def ball() -> ts.Run:
    """Falls from 1 m, e = 0.5, and comes to rest at three times its fall."""
    return ts.simulate(scene("ball", {"ground.restitution.coefficient": 0.5}), duration=2.0)


@pytest.fixture(scope="module")
def switch() -> ts.Run:
    """Closed by a ramp up, opened on the way down."""
    ramp = ts.Sampled(times=(0.0, 0.05, 0.1), levels=(0.0, 100.0, 0.0))
    return ts.simulate(ts.load_scene("mems-switch", **{"signals.gate": ramp}), duration=0.1)


def test_touchdowns_and_flights_of_a_ball(ball):
    (foot,) = ball.foot_names
    assert [touchdown(ball, foot, n) for n in (1, 2, 3)] == pytest.approx([FALL, 2.0 * FALL, 2.5 * FALL], rel=1e-12)
    assert [flight(ball, foot, n) for n in (1, 2)] == pytest.approx([FALL, 0.5 * FALL], rel=1e-12)
    times = touchdown_times(ball, foot)
    assert times[-1] == pytest.approx(3.0 * FALL, rel=1e-9) and np.all(np.diff(times) > 0.0)
    assert math.isnan(touchdown(ball, foot, len(times) + 1)) and math.isnan(departure(ball, foot))


def test_speed_of_a_point_is_its_way_over_the_time(ball):
    point = ball.scene.robot.feet[ball.foot_names[0]].point
    assert point_speed(ball, point, 0.1, 0.3) == pytest.approx(-9.81 * 0.2, rel=1e-12)


def test_volts_at_pull_in_and_pull_out(switch):
    """Static pull-in at 2/3 of the gap, 86.31 V; pull-out where the spring outgrows the pull of the closed gap."""
    closing, opening = touchdown(switch, "beam"), departure(switch, "beam")
    assert volts_at(switch, "gate", closing) == pytest.approx(86.307, rel=0.01)
    law = switch.scene.ground.electrostatic
    hold = math.sqrt(42.0 * 2.6e-6 / law.coefficient) * law.offset
    assert volts_at(switch, "gate", opening) == pytest.approx(hold, rel=1e-9)
    assert math.isnan(volts_at(switch, "gate", math.nan))


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda run: touchdown(run, "tip"), "no foot 'tip'"),
        (lambda run: flight(run, run.foot_names[0], 0), "expected a number from 1"),
        (lambda run: volts_at(run, "gat", 0.0), "no drive 'gat'"),
        (lambda run: point_speed(run, "tip", 0.0, 1.0), "no point 'tip'"),
        (lambda run: point_speed(run, run.scene.robot.structure.points[0], 1.0, 1.0), "expected a time after 1 s"),
    ],
)
def test_what_a_run_does_not_have(ball, ask, said):
    with pytest.raises(InputError, match=said):
        ask(ball)
