"""The native engine of walkers against the compiled one, event for event."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import numba_walk
import tarsus as ts
from tarsus.drive.gait import Ripple, Wave
from tarsus.scene import Ground, Initial, Scene, Standing
from tarsus.solve import march as native
from tarsus.solve.engine import Accuracy
from tarsus.solve.simulate import RECORDED
from tarsus.walkplan import lower_walker
from tarsus_reproduce.legs import millipede_leg
from tarsus_reproduce.millipede_parameters import millipede_parameters
from tarsus_reproduce.walkers import hexapod_walker, many_legs
from walking_devices import creeping_millipede
from walking_scenes import block, moving, sticky, trotter

FILM = ts.Film(coefficient=1e-23, thickness=1e-6)
PARAMETERS = millipede_parameters(millipede_leg().leg)


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


SCENES = {
    "millipede": (lambda: ts.load_scene("millipede"), 0.04),
    "millipede as printed": (lambda: ts.load_scene("millipede-printed"), 0.04),
    "millipede of the table": (lambda: ts.load_scene("millipede-table"), 0.04),
    "thirty legs": (lambda: ts.load_scene("millipede-30"), 0.02),
    "creeping": (creeping_millipede, 0.05),
    "stiff film": (lambda: ts.with_values(creeping_millipede(), {"ground.film.thickness": 2e-7}), 0.01),
    "tripod": (lambda: hexapod_walker(PARAMETERS), 0.05),
    "wave": (lambda: many_legs(PARAMETERS, 8, scatter=0.1, gait=Wave(frequency=50.0, high=14.0)), 0.03),
    "ripple": (lambda: many_legs(PARAMETERS, 6, dead=("L2",), gait=Ripple(frequency=50.0, high=14.0)), 0.03),
    "sticky": (on, 0.02),
    "bare": (lambda: trotter(ground=Ground(gravity=ts.Gravity(), restitution=ts.Restitution(coefficient=0.5))), 0.02),
    "no friction": (lambda: on(friction=None), 0.02),
    "restitute first": (lambda: on(landing=ts.RestituteFirst(speed=2e-3)), 0.02),
    "restitute all": (lambda: on(landing=ts.RestituteFirst(speed=0.0)), 0.02),
    "pull as printed": (lambda: on(landing=ts.PullAsPrinted()), 0.02),
    "adhesive friction": (lambda: on(friction=ts.AdhesiveFriction(coefficient=0.3)), 0.02),
    "film": (lambda: on(film=FILM), 0.02),
    "thin film": (lambda: on(adhesion=None, film=ts.Film(coefficient=3e-21, thickness=2e-7)), 0.01),
    "electrostatic": (lambda: on(film=FILM, electrostatic=ts.Electrostatic(coefficient=1e-19, offset=1e-6)), 0.02),
    "along the leg": (
        lambda: on(leg_electrostatic=ts.LegElectrostatic(coefficient=1e-19, offset=1e-6, rest=1e-6)), 0.02,
    ),
    "undamped": (lambda: trotter(damping=0.0), 0.01),
    "no turning": (lambda: trotter(turning=False, legs=5), 0.02),
    "standing": (lambda: standing(on(film=FILM), driven=False), 0.01),
    "standing driven": (lambda: standing(on(), driven=True), 0.01),
    "amplifier": (lambda: slewed(on()), 0.02),
    "slope of a slide": (lambda: moving(block(), block_x=0.05), 0.05),
    "hopping": (hopping, 0.2),
}  # fmt: skip
LONG = {"thirty legs", "undamped", "millipede of the table", "wave"}


APEX = 9
"""Column of an event's highest gap; its time follows."""
STEPS = 1e-2
"""Share of what is only seen at the nodes of steps, or linear within them: rounding may decide which are taken."""


def close(one: np.ndarray, other: np.ndarray, relative: float) -> None:
    """Equal to a share of the largest number."""
    np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
    scale = np.nanmax(np.abs(other), initial=0.0)
    np.testing.assert_allclose(one, other, rtol=0.0, atol=relative * scale)


def same(one: native.RawWalks, other: native.RawWalks, body: int) -> None:
    np.testing.assert_array_equal(one.codes, other.codes)
    np.testing.assert_array_equal(one.event_end, other.event_end)
    np.testing.assert_array_equal(one.mark_end, other.mark_end)
    np.testing.assert_array_equal(one.events[:, 1:3], other.events[:, 1:3])
    for column in range(other.events.shape[1]):
        # flights that begin and end within one step have an apex that the compiled engine did not see
        rows = other.events[:, APEX] > 0.0 if column in (APEX, APEX + 1) else slice(None)
        close(one.events[rows, column], other.events[rows, column], 1e-7)
    close(one.events[:, 0], other.events[:, 0], 1e-10)
    groups = np.cumsum(
        [1, body, (other.marks.shape[1] - 3 - body) // 2, (other.marks.shape[1] - 3 - body) // 2]
    )
    *exact, heave = zip(
        np.split(one.marks, groups, axis=1), np.split(other.marks, groups, axis=1), strict=True
    )
    for pair in exact:
        close(*pair, 1e-9)
    close(*heave, STEPS)
    close(one.finish[:, 0], other.finish[:, 0], 1e-12)
    close(one.finish[:, 1], other.finish[:, 1], 0.3)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in SCENES]
)
def test_the_same_events_marks_samples_and_energies(name: str) -> None:
    make, duration = SCENES[name]
    plan = lower_walker(make())
    how = {
        "accuracy": RECORDED,
        "account": True,
        "period": duration / 3.3,
        "times": np.linspace(0.0, duration, 57),
    }
    one, other = native.walk(plan, duration, **how), numba_walk.walk(plan, duration, **how)
    assert len(other.events) > 1
    body = len(plan.body.body_mass)
    same(one, other, body)
    ends = np.cumsum([2 * body, 4 * len(plan.body.mass), 2 * plan.plan.feet])
    *exact, energies = zip(
        np.split(one.samples, ends, axis=1), np.split(other.samples, ends, axis=1), strict=True
    )
    for pair in exact:
        close(*pair, 1e-7)
    close(*energies, STEPS)
    for a, b in zip(one.end, other.end, strict=True):
        close(a, b, 1e-8)


def test_a_batch_of_runs_with_parameters_and_starts_of_their_own() -> None:
    plan = lower_walker(on(film=FILM))
    parameters = np.repeat(plan.plan.laws.parameters[None], 4, axis=0)
    parameters *= np.linspace(0.7, 1.2, 4)[:, None, None]
    initial = np.repeat(plan.plan.initial[None], 4, axis=0)
    initial[:, 1] += np.linspace(0.0, 1e-6, 4)
    initial[:, -3] += np.linspace(0.0, 1e-3, 4)
    how = {"parameters": parameters, "initial": initial, "period": 1e-3, "track": False}
    same(native.walk(plan, 5e-3, **how), numba_walk.walk(plan, 5e-3, **how), 4)


def test_a_run_that_may_not_take_so_many_steps_ends() -> None:
    plan = lower_walker(on())
    accuracy = dataclasses.replace(Accuracy(), steps=40)
    same(native.walk(plan, 0.02, accuracy=accuracy), numba_walk.walk(plan, 0.02, accuracy=accuracy), 4)
