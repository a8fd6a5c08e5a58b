"""Free flights against the engine, and the pull of a held foot against the engine's own."""

from __future__ import annotations

import numpy as np
import pytest

from laboratory import LABORATORY
from tarsus.base.spec import with_values
from tarsus.experiment.synthesis import rest_state
from tarsus.files.library import load_scene
from tarsus.identify.flight import SUBSTEPS, Film, Flow
from tarsus.identify.foot import FootModel
from tarsus.solve import simulate


@pytest.fixture(scope="module")
def run():
    scene = load_scene(LABORATORY, volts=8, hz=60, wave="ramped_square", **{"signals.pzt.duty": 1.0})
    return simulate(with_values(scene, {"initial.displacement": rest_state(scene)}), 0.05)


@pytest.fixture(scope="module")
def model(run):
    return FootModel(run.scene, "tip", "pzt", ("tip", "center"))


def test_a_flight_is_that_of_the_engine(run, model):
    release = run.events[run.events["kind"] == 3][1]["time"]
    step = 5e-5
    times = release + 1e-9 + step / SUBSTEPS * np.arange(SUBSTEPS * 30 + 1)
    series = run.at(times)
    states = np.concatenate([series.state.x, series.state.v])
    film = run.scene.ground.film
    flown = Flow(model, step / SUBSTEPS).fly(
        states[:, :1], series.force[0][:, None], Film(film.coefficient, film.thickness), model.gap
    )
    wanted = states[:, ::SUBSTEPS].T
    assert flown[:, :, 0] == pytest.approx(wanted, abs=2e-4 * np.abs(wanted).max(axis=0).max())
    size = np.abs(wanted).max(axis=0)
    assert np.all(np.abs(flown[:, :, 0] - wanted).max(axis=0) < 1e-3 * size)


def test_short_flights_go_both_ways(run, model):
    film = Film(run.scene.ground.film.coefficient, run.scene.ground.film.thickness)
    release = run.events[run.events["kind"] == 3][1]["time"]
    series = run.at(release + np.array([1e-6, 81e-6]))
    states = np.concatenate([series.state.x, series.state.v])
    slope = np.diff(series.force[0]) / 80e-6
    flow = Flow(model, 1e-5)
    there = flow.short(
        states[:, :1], lambda t: series.force[0, :1] + slope * t, film, model.gap, np.array([80e-6])
    )
    size = np.abs(states).max(axis=1)
    assert np.all(np.abs(there[:, 0] - states[:, 1]) < 1e-3 * size)
    back = flow.short(there, lambda t: series.force[0, 1:] + slope * t, film, model.gap, np.array([-80e-6]))
    assert np.all(np.abs(back - states[:, :1])[:, 0] < 1e-6 * size)


def test_the_pull_of_a_held_foot_is_the_engines(run, model):
    release = run.events[run.events["kind"] == 3][1]["time"]
    series = run.at(np.array([release - 1e-3, release - 1e-9]))
    states = np.concatenate([series.state.x, series.state.v])
    assert model.pull(states, series.force[0]) == pytest.approx(series.state.pull[0], rel=1e-6)
    assert model.pull(states, series.force[0])[1] == pytest.approx(series.strength[0, 1], rel=1e-4)
