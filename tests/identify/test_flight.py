"""Free flights against the engine, and the pull of a held foot against the engine's own."""

from __future__ import annotations

import numpy as np
import pytest

from laboratory import LABORATORY
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.identify.flight import ground_constants
from tarsus.identify.foot import FootModel
from tarsus.model.standing import rest_state
from tarsus.solve import simulate
from tarsus.solve.flights import SUBSTEPS, Flow, Launches, Varied


@pytest.fixture(scope="module")
def run():
    scene = load_scene(LABORATORY, volts=8, hz=60, wave="ramped_square", **{"signals.pzt.duty": 1.0})
    return simulate(with_values(scene, {"initial.displacement": rest_state(scene)}), 0.05)


@pytest.fixture(scope="module")
def model(run):
    return FootModel(run.scene, "tip", "pzt", ("tip", "center"))


def flow_of(model, step):
    return Flow(model.flow, model.inputs, model.row, step)


def launched(states, film, gap):
    """Flights that begin at their first samples in states (N, 2n), under the law (5,) of a film."""
    none, two = np.zeros(len(states)), np.zeros((len(states), 2))
    law = Varied(np.tile(film, (len(states), 1)))
    return Launches(Varied(states), Varied(none), Varied(two), law, np.full(len(states), gap), two, 1.0)


def test_a_flight_is_that_of_the_engine(run, model):
    release = run.events[run.events["kind"] == 3][1]["time"]
    step = 5e-5
    times = release + 1e-9 + step / SUBSTEPS * np.arange(SUBSTEPS * 30 + 1)
    series = run.at(times)
    states = np.concatenate([series.state.x, series.state.v])
    launch = launched(states[:, :1].T, ground_constants(model), model.gap)
    flown = flow_of(model, step / SUBSTEPS).fly(launch, series.force[0][None], np.array([31]), np.eye(4))[0]
    wanted = states[:, ::SUBSTEPS].T
    assert flown == pytest.approx(wanted, abs=2e-4 * np.abs(wanted).max(axis=0).max())
    size = np.abs(wanted).max(axis=0)
    assert np.all(np.abs(flown - wanted).max(axis=0) < 1e-3 * size)


def test_short_flights_go_both_ways(run, model):
    release = run.events[run.events["kind"] == 3][1]["time"]
    series = run.at(release + np.array([1e-6, 81e-6]))
    states = np.concatenate([series.state.x, series.state.v])
    force = series.force[0][None]

    def come(state, begin, near):
        """The state 80 us beside a launch, on the flight's first sample."""
        launch = Launches(
            Varied(state[None]),
            Varied(np.array([begin])),
            Varied(np.zeros((1, 2))),
            Varied(ground_constants(model)[None]),
            np.array([model.gap]),
            near,
            -begin,
        )
        return flow_of(model, 1e-5).fly(launch, np.zeros((1, 1)), np.array([1]), np.eye(4))[0][0]

    there = come(states[:, 0], -80e-6, force)
    size = np.abs(states).max(axis=1)
    assert np.all(np.abs(there - states[:, 1]) < 1e-3 * size)
    back = come(there, 80e-6, force[:, ::-1])
    assert np.all(np.abs(back - states[:, 0]) < 1e-6 * size)


@pytest.mark.parametrize("exponent", [3.0, 2.9])
def test_derivatives_of_flights_are_those_of_their_arithmetic(run, model, exponent):
    """By eleven unknowns, two blocks of the engine: state, moment, force, drift and all constants at the foot."""
    random = np.random.default_rng(4)
    release = run.events[run.events["kind"] == 3][1]["time"]
    there = run.at(release + np.array([1e-4, 2e-4, 3e-4])).state
    count, q = 3, 11
    base = {
        "state": np.concatenate([there.x, there.v]).T,
        "begin": np.array([-2e-5, 0.0, -7e-5]),
        "offset": np.tile([1e-7, 1e-4], (count, 1)),
        "film": np.tile([2e-21, 5e-5, 2e-21, 2e-5, exponent], (count, 1)),
    }
    slopes = {name: np.abs(value[..., None]) * random.normal(size=(*value.shape, q)) for name, value in base.items()}
    slopes["begin"] = 1e-5 * random.normal(size=(count, q))
    drive = run.at(release + np.array([1e-4, 2e-4, 3e-4])).force[0][:, None] + np.linspace(0.0, 1e-7, 31)
    near = drive[:, :1] + 1e-8 * np.arange(-8, 1)
    flow = flow_of(model, 1e-5)

    def flown(along: float, way: int | None):
        moved = {
            name: Varied(value + (0.0 if way is None else along * slopes[name][..., way]), slopes[name])
            for name, value in base.items()
        }
        launch = Launches(**moved, neutral=np.full(count, model.gap), near=near, near_step=1e-5)
        return flow.fly(launch, drive, np.array([11, 4, 7]), np.kron(np.eye(2), model.rows), np.full(drive.shape, 16.0))

    values, by = flown(0.0, None)
    assert values.shape == (22, 4) and by.shape == (22, 4, q)
    for way in range(q):
        near_by = [flown(k * 1e-5, way)[0] for k in (-2, -1, 1, 2)]
        wanted = (near_by[0] - 8.0 * near_by[1] + 8.0 * near_by[2] - near_by[3]) / 12e-5
        if way == 0:
            assert np.abs(wanted).max() > 1e-8
        assert np.all(np.abs(by[..., way] - wanted) < 1e-7 * np.abs(wanted).max(axis=0))


def test_the_pull_of_a_held_foot_is_the_engines(run, model):
    release = run.events[run.events["kind"] == 3][1]["time"]
    series = run.at(np.array([release - 1e-3, release - 1e-9]))
    states = np.concatenate([series.state.x, series.state.v])
    assert model.pull(states, series.force[0]) == pytest.approx(series.state.pull[0], rel=1e-6)
    assert model.pull(states, series.force[0])[1] == pytest.approx(series.strength[0, 1], rel=1e-4)
