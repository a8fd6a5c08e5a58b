"""Walkers of one or two legs march as a whole; the march of each leg by itself, which shares no step, agrees."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.core.arrays import ENERGIES
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.plan.slots import rows_of
from tarsus.solve.engine import Accuracy
from tarsus.solve.march import RawWalks, walk
from walking_devices import creeping_millipede
from walking_scenes import sticky, trotter

FILM = ts.Film(coefficient=1e-23, thickness=1e-6)
FORCE = ts.Electrostatic(coefficient=1e-19, offset=1e-6)


def ground(**values: float) -> Scene:
    return ts.with_values(ts.load_scene("millipede"), {f"ground.{path}": one for path, one in values.items()})


def on(**laws) -> Scene:
    """Two scattered legs under a body that turns, on sticky ground with other laws."""
    return trotter(legs=2, ground=sticky(**laws))


SCENES = {
    "millipede": (lambda: ts.load_scene("millipede"), 0.06),
    "thick film": (lambda: ground(**{"film.coefficient": 8e-25, "restitution.coefficient": 0.8}), 0.03),
    "strong force": (lambda: ground(**{"electrostatic.coefficient": 8e-17}), 0.03),
    "sticky": (lambda: ground(**{"adhesion.rate": 5e-4}), 0.03),
    "overdamped": (creeping_millipede, 0.05),
    "stiff film": (lambda: ts.with_values(creeping_millipede(), {"ground.film.thickness": 2e-7}), 0.01),
    "turning": (lambda: on(film=FILM, electrostatic=FORCE), 0.02),
    "one leg": (lambda: trotter(legs=1, ground=sticky(film=FILM)), 0.02),
    "adhesive friction": (lambda: on(friction=ts.AdhesiveFriction(coefficient=0.3)), 0.02),
    "no friction": (lambda: on(friction=None), 0.02),
    "undamped": (lambda: trotter(legs=2, damping=0.0), 0.01),
}


def leg_by_leg(plan: Plan, duration: float, accuracy: Accuracy, **options) -> RawWalks:
    """The run from a window's start, which is marched leg by leg; here it starts as every run does."""
    nobody = np.zeros(plan.feet, dtype=np.uint8)
    return walk(
        plan, duration, accuracy=accuracy, start=(0.0, nobody, nobody, np.zeros(plan.feet)), **options
    )


@pytest.mark.parametrize("name", SCENES)
def test_the_whole_walker_finds_what_its_legs_find(name: str) -> None:
    make, duration = SCENES[name]
    plan = lower_scene(make())
    times = np.linspace(0.0, duration, 23)
    whole = walk(plan, duration, accuracy=Accuracy(gap=1e-10), account=True, times=times)
    legs = leg_by_leg(plan, duration, Accuracy(gap=1e-10), account=True, times=times)
    ours, theirs = (run.events[run.events[:, 2] != EventKind.PERIOD_MARK] for run in (whole, legs))
    assert whole.codes.tolist() == [0] and len(ours) > 5
    assert whole.finish[0, 1] != legs.finish[0, 1]  # other steps
    np.testing.assert_array_equal(ours[:, 1:3], theirs[:, 1:3])
    np.testing.assert_allclose(ours[:, 0], theirs[:, 0], rtol=0.0, atol=1e-11)
    for one, other, by in (
        *((ours[:, c], theirs[:, c], 1e-6) for c in range(3, 9)),
        # legs by themselves take an apex from the polynomial through the nodes, whose steps span some radians
        *((ours[:, c], theirs[:, c], 1e-5) for c in (9, 11)),
        *((whole.samples[:, c], legs.samples[:, c], 1e-6) for c in range(whole.samples.shape[1] - ENERGIES)),
        (whole.end[3], legs.end[3], 1e-7),
    ):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=by * np.abs(other).max() + 1e-300)


def test_an_account_and_samples_change_no_bit_of_a_run() -> None:
    plan = lower_scene(ts.load_scene("millipede"))
    bare, full = (
        walk(plan, 0.03, account=account, times=times)
        for account, times in ((False, None), (True, np.linspace(0.0, 0.03, 50)))
    )
    np.testing.assert_array_equal(full.events, bare.events)
    np.testing.assert_array_equal(full.finish, bare.finish)


def test_runs_of_a_batch_of_whole_walkers_are_those_made_alone_to_the_last_bit() -> None:
    plan = lower_scene(ts.load_scene("millipede"))
    parameters = np.repeat(plan.laws.parameters[None], 5, axis=0) * np.linspace(0.7, 1.2, 5)[:, None, None]
    rows = dataclasses.replace(rows_of(plan, 5, 1e-2), parameters=parameters)
    batch = walk(plan, 0.03, rows=rows)
    for i in (4, 2, 0, 1, 3):
        one = dataclasses.replace(rows_of(plan, 1, 1e-2), parameters=parameters[i : i + 1])
        alone = walk(plan, 0.03, rows=one)
        np.testing.assert_array_equal(batch.of(i), alone.events)
        np.testing.assert_array_equal(batch.marks_of(i), alone.marks)
        np.testing.assert_array_equal(batch.finish[i], alone.finish[0])
