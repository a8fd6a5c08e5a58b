"""Moments of detachment, where two moments fit the same flight and only physics tells them apart."""

from __future__ import annotations

import numpy as np
import pytest

from laboratory import LABORATORY
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.identify.campaign import read_campaign, read_records
from tarsus.identify.detachment import Detachments, FilmGuess, find_detachments
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import trace_of
from tarsus.model.standing import rest_state
from tarsus.solve import simulate
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.plan import planned
from tarsus.synthesis.recordings import Instrument


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
    film = FilmGuess.of(truth.ground.film.coefficient, truth.ground.film.thickness)
    fitted = Detachments(traces, items, level).fit(model, film, fixed=True)
    assert len(items) > 20
    assert np.all(fitted.pull > -3.0 * fitted.pull_error)
    run = simulate(
        with_values(truth, {"signals.pzt": take.signal, "initial.displacement": rest_state(truth)}), 0.1
    )
    releases = run.events[run.events["kind"] == 3]["time"]
    moments = [
        traces[i.trace].time[i.first] - late for i, late in zip(items, fitted.unknowns[:, 0], strict=True)
    ]
    off = np.abs(np.array(moments)[:, None] - releases).min(axis=1)
    assert np.median(off) < 3e-6 and off.max() < 15e-6
