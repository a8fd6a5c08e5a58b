"""Moments of detachment, where two moments fit the same flight and only physics tells them apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laboratory import LABORATORY
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.identify.campaign import read_campaign, read_records
from tarsus.identify.detachment import Detachments, find_detachments
from tarsus.identify.film import film_parameters
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace, trace_of
from tarsus.model.standing import rest_state
from tarsus.solve import simulate
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.plan import planned
from tarsus.synthesis.recordings import Instrument


def test_a_hop_within_the_noise_is_no_flight():
    """Two stays with a hop of five deviations between them: the flight begins after the second alone."""
    noise = 1e-7
    time = 5e-5 * np.arange(400)
    height = np.zeros(len(time))
    height[60:70] = 6.0 * noise
    height[120:] = 0.5 * 0.2 * (time[120:] - time[120]) ** 2 + 0.03 * (time[120:] - time[120])
    speed = np.gradient(height, time)
    speed[56:74] = 1e-3  # hops are fast
    one = np.full(1, noise)
    trace = Trace(
        "one.mat", "ramps", ("tip",), time, height[None], speed[None], np.zeros(len(time)), one, 10.0 * one, 0.1 * one
    )
    items, left = find_detachments([trace], "tip", 0.0)
    assert [trace.time[one.hold.first] for one in items] == [pytest.approx(time[74], abs=1e-4)]
    assert [said.reason for said in left] == [
        f"the foot is back on the ground too soon after its release at {time[55]:.5g} s"
    ]
    away = replace(trace, x=trace.x + 1e-5)  # a record in which the foot never stands costs none of the others
    again, _ = find_detachments([away, trace], "tip", 0.0)
    assert [(one.trace, one.hold) for one in again] == [(1, one.hold) for one in items]


# Slow: 30 flights of a device of its own. The film of test_chain.py is from detachments fitted the same way.
@pytest.mark.slow
def test_a_pressed_foot_does_not_let_go(tmp_path):
    """Of this device most flights at 100 Hz also fit a release 0.04 ms early, with the foot pressed by 25 nN."""
    truth = perturbed(load_scene(LABORATORY), 0.2, seed=14)
    take = next(one for one in planned(truth, 20e3, "pzt") if one.name == "ramps-100hz-100")
    write_campaign(truth, tmp_path, Instrument(), 14, recordings=[take])
    opened = read_campaign(tmp_path)
    readings = read_records(opened, take.name)
    points = opened.model.points
    traces = [trace_of(r.record, points, take.name, r.record.drive, 0.01, None) for r in readings]
    model = FootModel(truth, "tip", "pzt", points)
    level = -model.gap - float(model.row @ rest_state(truth))
    items, _ = find_detachments(traces, "tip", level)
    film, offs = truth.ground.film, Detachments(traces, items, level, model)
    place = np.log([film.coefficient / film.thickness**3, film.thickness])
    fitted = offs.under(film_parameters(model), place)
    assert len(items) > 20
    pulls = offs.pulls_of(fitted)
    assert np.all(pulls.pull > -3.0 * pulls.error)
    run = simulate(with_values(truth, {"signals.pzt": take.signal, "initial.displacement": rest_state(truth)}), 0.1)
    releases = run.events[run.events["kind"] == 3]["time"]
    moments = [traces[i.trace].time[i.first] - late for i, late in zip(items, fitted.unknowns[:, 0], strict=True)]
    off = np.abs(np.array(moments)[:, None] - releases).min(axis=1)
    assert np.median(off) < 3e-6 and off.max() < 15e-6
