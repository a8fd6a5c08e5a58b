"""Walkers of every kind against what another implementation of the same equations found.

`tests/data/walkers.npz` keeps the events (time, foot, kind, speeds, pull, strength, energy), marks and energies of its
runs: the engine that was compiled by numba, which shared no code with the native one.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.base.spec import with_values
from tarsus.model.scene import Ground, Initial, Scene, Standing
from tarsus.plan.lowering import lower_scene
from tarsus.solve.codes import ResultCode, structured_events
from tarsus.solve.engine import Accuracy, execute, walk
from tarsus.solve.simulate import RECORDED
from walking_devices import creeping_millipede
from walking_scenes import block, moving, sticky, trotter

FILM = ts.Film(coefficient=1e-23, thickness=1e-6)
RECORD = Path(__file__).parents[1] / "data" / "walkers.npz"


def on(**laws) -> Scene:
    """A trotter on sticky ground with other laws."""
    return trotter(ground=sticky(**laws))


def standing(scene: Scene, driven: bool) -> Scene:
    return scene.model_copy(update={"initial": Initial(standing=Standing(driven=driven))})


def slewed(scene: Scene) -> Scene:
    """A square of the same drives behind amplifiers that lag and slew."""
    signals = {name: ts.Square(amplitude=7.0, offset=7.0, frequency=200.0) for name in scene.signals}
    amplifier = ts.Amplifier(slew_rate=4e4, bandwidth=5e3)
    drives = {
        name: drive.model_copy(update={"amplifier": amplifier}) for name, drive in scene.robot.drives.items()
    }
    return scene.model_copy(
        update={"signals": signals, "robot": scene.robot.model_copy(update={"drives": drives})}
    )


def hopping() -> Scene:
    """A block thrown up that comes to rest and is thrown again."""
    signals = {
        "upward": ts.Sine(amplitude=1.5e-5, frequency=60.0),
        "along": ts.Sine(amplitude=3e-6, frequency=23.0),
    }
    return moving(block(signals=signals), block_x=0.02)


BARE = Ground(gravity=ts.Gravity(), restitution=ts.Restitution(coefficient=0.5))
THIN = ts.Film(coefficient=3e-21, thickness=2e-7)
SCENES = {
    "creeping": (creeping_millipede, 0.05),
    "stiff film": (lambda: ts.with_values(creeping_millipede(), {"ground.film.thickness": 2e-7}), 0.01),
    "sticky": (on, 0.02),
    "bare": (lambda: trotter(ground=BARE), 0.02),
    "no friction": (lambda: on(friction=None), 0.02),
    "restitute first": (lambda: on(landing=ts.laws.RestituteFirst(speed=2e-3)), 0.02),
    "restitute all": (lambda: on(landing=ts.laws.RestituteFirst(speed=0.0)), 0.02),
    "pull as printed": (lambda: on(landing=ts.laws.PullAsPrinted()), 0.02),
    "adhesive friction": (lambda: on(friction=ts.laws.AdhesiveFriction(coefficient=0.3)), 0.02),
    "film": (lambda: on(film=FILM), 0.02),
    "thin film": (lambda: on(adhesion=None, film=THIN), 0.01),
    "electrostatic": (
        lambda: on(film=FILM, electrostatic=ts.Electrostatic(coefficient=1e-19, offset=1e-6)),
        0.02,
    ),
    "along the leg": (
        lambda: on(leg_electrostatic=ts.laws.LegElectrostatic(coefficient=1e-19, offset=1e-6, rest=1e-6)),
        0.02,
    ),
    "undamped": (lambda: trotter(damping=0.0), 0.01),
    "no turning": (lambda: trotter(turning=False, legs=5), 0.02),
    "standing": (lambda: standing(on(film=FILM), driven=False), 0.01),
    "standing driven": (lambda: standing(on(), driven=True), 0.01),
    "amplifier": (lambda: slewed(on()), 0.02),
    "slope of a slide": (lambda: moving(block(), block_x=0.05), 0.05),
    "hopping": (hopping, 0.2),
}


def close(one: np.ndarray, other: np.ndarray, relative: float) -> None:
    """Equal to a share of the largest number."""
    scale = np.abs(other).max(initial=0.0)
    np.testing.assert_allclose(one, other, rtol=0.0, atol=relative * scale)


@pytest.mark.parametrize("name", SCENES)
def test_the_events_marks_and_energies_that_another_implementation_found(name: str) -> None:
    make, duration = SCENES[name]
    with np.load(RECORD) as record:
        events, marks, energy = (
            record[f"{name.replace(' ', '_')}__{part}"] for part in ("events", "marks", "energy")
        )
    plan = lower_scene(make())
    # the record was made where feet came to rest below what the error of a step hides
    low = 0.1 * RECORDED.gap * max(plan.length, *plan.system.rest_gap)
    accuracy = dataclasses.replace(RECORDED, flight=low)
    run = walk(plan, duration, accuracy=accuracy, account=True, period=duration / 3.3)
    assert len(events) > 1 and run.codes.tolist() == [0]
    np.testing.assert_array_equal(run.events[:, 1:3], events[:, 1:3])
    close(run.events[:, 0], events[:, 0], 1e-10)
    for column in range(3, events.shape[1]):
        close(run.events[:, column], events[:, column], 1e-7)
    body, feet = len(plan.legs.body.body_mass), plan.feet
    for first, last in ((0, 1), (1, 1 + body), (1 + body, 1 + body + 2 * feet)):
        close(run.marks[:, first:last], marks[:, first:last], 1e-8)
    close(run.end[3], energy, 1e-7)


def test_an_account_and_samples_change_no_bit_of_a_run() -> None:
    plan = lower_scene(ts.load_scene("millipede"))
    bare, full = (
        walk(plan, 0.03, account=account, times=times)
        for account, times in ((False, None), (True, np.linspace(0.0, 0.03, 50)))
    )
    np.testing.assert_array_equal(full.events, bare.events)
    np.testing.assert_array_equal(full.finish, bare.finish)


def test_a_run_that_may_not_take_so_many_steps_ends_where_it_is() -> None:
    plan = lower_scene(on())
    short = walk(plan, 0.02, accuracy=dataclasses.replace(Accuracy(), steps=40))
    whole = walk(plan, 0.02)
    assert ResultCode.of(int(short.codes[0])) is ResultCode.STEP_LIMIT
    assert 0 < len(short.events) < len(whole.events)
    np.testing.assert_array_equal(short.events, whole.events[: len(short.events)])


def test_both_engines_find_both_feet_of_the_millipede_on_the_ground_at_once() -> None:
    """By contact modes the second was captured at 2e-17 s with 5e-15 m/s: rounding of its film's momentum."""
    plan = lower_scene(with_values(ts.load_scene("millipede"), {"ground.friction": None}))
    for log in (walk(plan, 0.2, accuracy=RECORDED), execute(plan, 0.2, accuracy=RECORDED)):
        first = structured_events(log.events)[:2]
        assert list(first["kind"]) == [EventKind.CONTACT_AT_START] * 2 and not first["time"].any()
