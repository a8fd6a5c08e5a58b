"""Windows: runs from any moment and state, with outputs at any times."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene as scene_of
from tarsus.orbits.returns import return_map
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve.contacts import Contacts
from tarsus.solve.window import WindowStart, simulate_windows
from walking_scenes import sticky, trotter

TIMES = {"p1_n2": 0.1, "three_feet": 0.03, "sticky_feet": 0.06, "ball": 4.0}


def contacts_at(run: ts.Run, held: np.ndarray, time: float) -> Contacts:
    """What the feet of a run do at a time."""
    begun = run.events[np.isin(run.events["kind"], (2, 4, 5)) & (run.events["time"] <= time)]
    numbers = [int(i) for i in np.flatnonzero(held)]
    return Contacts(numbers, [float(begun["time"][begun["foot"] == i][-1]) for i in numbers])


SCENES = {
    **{name: (lambda name=name: scene_of(name), t) for name, t in TIMES.items()},
    "trotter": (trotter, 0.02),
    "trotter of five": (lambda: trotter(5, ground=sticky()), 0.02),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_window_from_the_middle_of_a_run_goes_on_as_the_run(name):
    scene, duration = SCENES[name][0](), SCENES[name][1]
    run, plan = ts.simulate(scene, duration), lower_scene(scene)
    times = np.linspace(0.0, duration, 301)
    series = run.at(times)
    states = series.state
    assert states.held.any() or name == "ball"
    for k in (0, 97, 200):
        start = np.concatenate([states.x[:, k], states.v[:, k]])
        given = WindowStart(start, times[k], times[k:], contacts_at(run, states.held[:, k], times[k]))
        window = simulate_windows(plan, [given])[0]
        later = run.events[run.events["time"] > times[k]]
        assert list(window.events["kind"]) == list(later["kind"])
        np.testing.assert_allclose(window.events["time"], later["time"], rtol=0, atol=1e-9 * duration)
        pairs = [(getattr(window.states, one), getattr(states, one), 1e-7) for one in ("x", "v", "pull")]
        pairs += [(force, series.laws[law], 1e-6) for law, force in window.forces.items()]
        for got, wanted, within in pairs:
            np.testing.assert_allclose(got, wanted[:, k:], rtol=0, atol=within * np.abs(wanted).max())
        assert np.array_equal(window.states.held, states.held[:, k:])


def test_a_foot_that_is_leaving_flies_though_its_contact_would_hold_it():
    scene = scene_of("p1_n2")
    plan = lower_scene(scene)
    run = ts.simulate(scene, 0.02)
    release = float(run.events["time"][run.events["kind"] == 3][-2])
    at = release - 1e-7
    states = run.states(np.array([at]))
    assert states.held[0, 0] and states.pull[0, 0] > 0.0
    start = np.concatenate([states.x[:, 0], states.v[:, 0]])
    times = at + np.linspace(0.0, 5e-8, 5)
    stays = simulate_windows(plan, [WindowStart(start, at, times)])[0]
    leaves = simulate_windows(plan, [WindowStart(start, at, times, Contacts(leaving=(0,)))])[0]
    assert stays.states.held.all() and stays.events["kind"][0] == 5
    assert not leaves.states.held.any()


def test_a_window_leaves_the_callers_rows_as_they_are():
    scene = scene_of("ball")
    plan = lower_scene(scene)
    rows = rows_of(plan)
    before = rows.initial.copy()
    simulate_windows(plan, [WindowStart(before[0] + 1e-3, 0.0, [0.1])], rows=rows)[0]
    assert np.array_equal(rows.initial, before)


def test_a_return_map_leaves_its_rows_as_they_are():
    scene = scene_of("p1_n2")
    made = return_map(scene, 0.0, Contacts())
    before = made.rows.initial.copy()
    state = before[0] + 1e-9
    made(state)
    made.derivative(state)
    assert np.array_equal(made.rows.initial, before)


def test_a_window_from_the_start_is_the_run_to_the_last_bit():
    """Of a structure of three modes, whose sums depend on how they lie in vectors: that is one choice for both."""
    scene = scene_of("three_feet")
    plan = lower_scene(scene)
    run = ts.simulate(scene, 0.03)
    window = simulate_windows(plan, [WindowStart(plan.initial, 0.0, [0.03])])[0]
    assert len(run.events) > 20
    assert np.array_equal(window.events["time"], run.events["time"])
    assert np.array_equal(window.events["energy"], run.events["energy"])
