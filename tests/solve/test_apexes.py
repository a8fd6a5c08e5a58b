"""The highest gap of a flight is that of the whole flight, over however many drive periods it goes."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.base.events import IMPACTS
from walking_scenes import trotter

E, GAP = "ground.restitution.coefficient", "robot.feet.ball.gap"


def ball(period: float) -> ts.Scene:
    """The ball dropped by a metre with a silent drive that has a period [s]."""
    silent = scene("vibrating_table", {"signals.table.amplitude": 0.0, "signals.table.frequency": 1.0 / period})
    values = {"robot": silent.robot.model_copy(update={"feet": scene("ball").robot.feet})}
    return scene("ball").model_copy(update=values | {"signals": silent.signals})


@pytest.mark.parametrize("period", [0.05, 0.3, 0.7])
def test_flights_over_many_periods_keep_their_apex(period):
    run = ts.simulate(ball(period), 4.0, gradients=[E, GAP])
    assert run.period == period
    number = np.arange(1, len(run.events))
    np.testing.assert_allclose(run.events["apex"], 0.9 ** (2.0 * np.arange(len(run.events))), rtol=1e-9)
    middles = 0.5 * (run.events["time"][:-1] + run.events["time"][1:])
    np.testing.assert_allclose(run.events["apex_time"][1:], middles, rtol=1e-7)
    by_gap, by_e = (run.event_gradients[path]["apex"][1:] for path in (GAP, E))
    np.testing.assert_allclose(by_gap, 0.9 ** (2.0 * number), rtol=1e-7)
    np.testing.assert_allclose(by_e, 2.0 * number * 0.9 ** (2.0 * number - 1.0), rtol=1e-7)
    assert len(run.all_events) > len(run.events), "the period marks are there"


def test_a_walkers_flights_are_as_high_as_its_series():
    robot = trotter()
    run = ts.simulate(robot, 0.06)
    landings = run.events[np.isin(run.events["kind"], IMPACTS)]
    long = 0
    for foot in range(len(run.foot_names)):
        own = run.events[run.events["foot"] == foot]
        for before, after in itertools.pairwise(own):
            if after["kind"] not in IMPACTS:
                continue
            times = np.linspace(before["time"], after["time"], 400)
            sampled = run.states(times).gap[foot].max()
            assert after["apex"] == pytest.approx(sampled, rel=1e-3, abs=1e-12)
            edges = np.floor(after["time"] / run.period) - np.floor(before["time"] / run.period)
            long += edges > 0 and after["apex"] > 1e-9
    assert len(landings) and long


def test_an_orbits_flight_is_whole_although_its_section_cuts_it():
    gamma = 1.2
    phase = math.acos(math.pi / 3.0 / gamma)  # its period-one orbit
    speed = 0.5 - gamma * math.cos(phase) / (2.0 * math.pi)
    values = {"signals.table.amplitude": gamma, "signals.table.phase": phase, "initial.velocity": [speed]}
    orbit = ts.periodic(scene("vibrating_table", values))
    (impact,) = orbit.events
    times = orbit.start + np.linspace(0.0, 1.0, 4001) * orbit.period
    gap = orbit.map.window(orbit.state, times).states.gap[0]
    assert impact["apex"] == pytest.approx(gap.max(), rel=1e-6)
    when = times[np.argmax(gap)] - orbit.start
    assert (impact["apex_time"] - when + 0.5 * orbit.period) % orbit.period == pytest.approx(
        0.5 * orbit.period, abs=1e-3 * orbit.period
    )
    assert impact["time"] - orbit.period <= impact["apex_time"] < impact["time"]
