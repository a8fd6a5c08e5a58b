"""Derivatives of runs whose feet slide under contact modes: through slips, sticks and impacts with friction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import tarsus as ts
from differences import TIGHT, assert_as_differences
from random_scenes import sliding_scene
from sliding_scenes import MASS, biped, by_modes, cantilever, slider
from tarsus.base.events import EventKind
from tarsus.base.spec import get_value
from tarsus.model.laws.rate_friction import RateWeakeningFriction
from tarsus.model.scene import Scene
from walking_scenes import GRAVITY, sticky, trotter


def knocked() -> Scene:
    """A slider that a square force moves to and fro, whose friction jumps with the push that it makes."""
    wave = ts.Square(amplitude=1.3 * 0.3 * MASS * GRAVITY, frequency=60.0, phase=0.7, duty=0.4)
    return ts.with_values(slider(coupling=0.3), {"signals": {"along": wave}})


SCENES: dict[str, tuple[Callable[[], Scene], float, list[str]]] = {
    "block": (lambda: slider(speed=0.05, coupling=0.4), 0.03, ["ground.friction.coefficient", "initial.velocity.1"]),
    "knocked": (knocked, 0.05, ["ground.friction.coefficient", "signals.along.phase", "signals.along.amplitude"]),
    "thrown": (
        lambda: slider(speed=0.3, fall=0.1, gap=1e-6, coupling=0.3),
        0.02, ["ground.friction.coefficient", "initial.velocity.0", "ground.restitution.coefficient"],
    ),
    "stribeck": (
        lambda: slider(speed=0.05, friction={"kind": "stribeck", "static": 0.4, "dynamic": 0.2, "speed": 0.02}),
        0.03, ["ground.friction.static", "ground.friction.speed"],
    ),
    "cantilever": (cantilever, 0.004, ["ground.friction.coefficient", "ground.adhesion.rate", "robot.feet.tip.gap"]),
    "biped": (biped, 0.005, ["ground.friction.coefficient", "signals.a.amplitude"]),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_events_states_and_energies_move_as_their_differences_say(name: str) -> None:
    make, duration, paths = SCENES[name]
    scene = make()
    fields = ("time", "pull", "strength", "energy", "speed_before")
    terms = [f"ledger.{one}" for one in ("friction", "work_in", "impacts", "kinetic")]
    run = assert_as_differences(scene, paths, duration, 1e-5, (1e-5, 1e-4), terms, fields)
    assert len(run.events) > 1


def test_a_sliding_robot_has_derivatives_by_its_structure() -> None:
    """Its stride by the modal mass that carries it along, as by differences of tight runs."""
    assert_as_differences(cantilever(), ["robot.structure.modal_masses.0"], 0.004, 1e-5, (1e-4, 1e-5))


def test_friction_stops_in_an_impact_what_would_move_along_the_ground() -> None:
    """A block that falls straight: of a small speed along the ground nothing is left by its first impact."""
    path = "initial.velocity.1"
    run = ts.simulate(slider(fall=0.1, gap=1e-6), 0.015, gradients=[path])
    first = run.events["time"][0]
    when = np.array([0.5 * first, 0.5 * (first + run.events["time"][1])])
    np.testing.assert_allclose(run.state_gradients(when)[path].v[1], [1.0, 0.0], atol=1e-12)


def test_friction_by_speed_has_the_derivatives_that_the_walker_of_the_same_equations_has() -> None:
    law = RateWeakeningFriction(static=0.9, dynamic=0.25, speed=1e-3)
    walker, path = trotter(2, seed=38, ground=sticky(friction=law)), "ground.friction.static"
    one, other = (ts.simulate(scene, 0.02, gradients=[path]) for scene in (walker, by_modes(walker)))
    assert np.count_nonzero(one.events["kind"] == 8) > 2
    np.testing.assert_allclose(other.events["time"], one.events["time"], rtol=1e-6)
    found, wanted = (run.event_gradients[path]["time"] for run in (other, one))
    np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max())


def lasting(events: np.ndarray) -> np.ndarray:
    """Numbers of the events but slips of feet that leave at the same moment: an impact that tears a foot off takes its
    hold along the ground first or at once, which changes nothing but the log, and hangs on rounding."""
    left = {(one["foot"], one["time"]) for one in events if one["kind"] == EventKind.RELEASE}
    slips = events["kind"] == EventKind.SLIP_BEGINS
    return np.array(
        [k for k, one in enumerate(events) if not (slips[k] and (one["foot"], one["time"]) in left)]
    )


@pytest.mark.parametrize(("seed", "event"), [(3071, 25), (1729, 9), (983, 13)])
def test_slides_against_the_pull_and_impacts_that_tear_off_two_contacts(seed: int, event: int) -> None:
    """3071: a foot slides against what pulls it. 1729: one impact tears off a foot that sticks.
    983: one impact turns another foot that slides."""
    scene, path = sliding_scene(seed), "ground.friction.coefficient"
    run = ts.simulate(scene, accuracy=TIGHT, gradients=[path])
    at = float(get_value(scene, path))
    above, below = (
        ts.simulate(ts.with_values(scene, {path: at * (1.0 + sign * 1e-5)}), accuracy=TIGHT)
        for sign in (1.0, -1.0)
    )
    of, over, under = (lasting(one.events)[: event + 1] for one in (run, above, below))  # later ones part
    for field in ("time", "pull"):
        wanted = (above.events[field][over] - below.events[field][under]) / (2e-5 * at)
        found = run.event_gradients[path][field][of]
        np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max(), err_msg=field)
