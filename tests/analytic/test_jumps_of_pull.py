"""Drives that jump against what holds a foot: it leaves at the jump where the pull exceeds the strength of its contact,
however soon it would not any more."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from random_scenes import plain_scene
from tarsus.base.events import EventKind
from tarsus.model.structure import WalkerBody, WalkerLeg
from walking_scenes import LOOSE, moving

JUMP = 0.3
STRENGTH = 1.0


def jumping(structure: ts.Lumped | ts.Walker, foot: str, level: float, duration: float) -> ts.Scene:
    """A foot on the ground that adheres with 1 N, driven by -1 N and from 0.3 s on by ``level`` [N]."""
    drive = ts.Drive(load=ts.PointLoad(weights={foot: 1.0}), law=ts.LinearForce(gain=1.0))
    return ts.Scene(
        name="jump",
        duration=duration,
        robot=ts.Robot(structure=structure, drives={"d": drive}, feet={"f": ts.Foot(point=foot, gap=0.0)}),
        signals={"d": ts.OnOff(levels=(-1.0, level), durations=(JUMP, 1e3), repeat=False)},
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.0), adhesion=ts.Adhesion(initial=STRENGTH, rate=0.0)),
    )


def tied(level: float, duration: float) -> ts.Scene:
    """It carries a mass on a spring that moves down at 1 m/s: from the jump on the pull is ``level`` - sin t [N]."""
    structure = ts.Lumped(
        coordinates=("foot", "mass"), mass=(1.0, 1.0), stiffness=((1.0, -1.0), (-1.0, 1.0)), damping=(0.0, 0.0)
    )
    scene = jumping(structure, "foot", level, duration)
    return scene.model_copy(update={"initial": ts.Initial(velocity=(0.0, -1.0))})


def walking(level: float, duration: float) -> ts.Scene:
    """The same as a walker: the body is the mass, its leg the spring and the foot."""
    leg = WalkerLeg(mass=1.0, **(LOOSE | {"stiffness_v": 1.0}))
    walker = ts.Walker(body=WalkerBody(mass=1.0), legs={"leg": leg})
    return moving(jumping(walker, "leg", level, duration), body=-1.0)


@pytest.mark.parametrize("make", [tied, walking])
@pytest.mark.parametrize("duration", [0.5, 3.0, 30.0])
@pytest.mark.parametrize("level", [1.32, 1.35, 1.5])
def test_a_pull_above_the_strength_for_a_moment_releases_at_once(make, duration: float, level: float) -> None:
    """It is level - sin t, above 1 N for another 26 to 224 ms. By contact modes such feet were held until 2.8 s, or
    not, by how long the run was."""
    run = ts.simulate(make(level, duration))
    released = run.events[run.events["kind"] == EventKind.RELEASE]
    assert run.ok and run.ledger.closure < 1e-12
    assert released["time"][0] == pytest.approx(JUMP, rel=1e-15)


@pytest.mark.parametrize(
    ("excess", "leaves"), [(-1e-12, False), (-1e-16, False), (0.0, False), (2e-16, False), (1e-11, True)]
)
def test_a_pull_that_is_the_strength_to_rounding_holds(excess: float, leaves: bool) -> None:
    """A single mass, on which the pull is the drive's force: no decision hangs on its last bit."""
    structure = ts.Lumped(coordinates=("foot",), mass=(1.0,), stiffness=(0.0,), damping=(0.0,))
    run = ts.simulate(jumping(structure, "foot", STRENGTH * (1.0 + excess), 1.0))
    kinds = run.events["kind"].tolist()
    assert run.ok and (EventKind.RELEASE in kinds) == leaves and len(kinds) <= 2


@pytest.mark.parametrize("gap", [7e-12, 1e-10, 1e-8, 1e-6])
def test_a_pull_that_bends_within_a_step_releases_where_it_passes_the_strength(gap: float) -> None:
    """Of two feet on one coordinate one is held, so that steps are far longer than the pieces of the drive, a cubic:
    between two nodes of such a step the pull was above the strength, and the foot left 18 us late at the next kink."""
    run = ts.simulate(plain_scene(1482, legged=False), accuracy=ts.Accuracy(gap=gap))
    released = run.events[run.events["kind"] == EventKind.RELEASE]
    assert run.ok and released["time"][0] == pytest.approx(8.0434366554e-5, rel=1e-8)


@pytest.mark.parametrize(
    ("duration", "frequency", "phase", "gap"),
    [(92.87, 0.4419, 1.5537, 0.0456), (0.1304, 29.863, 1.54029, 0.00364), (2.4488, 0.6528, 1.5487, 0.046)],
)
def test_the_pull_on_a_foot_that_lands_is_that_of_its_moment(
    duration: float, frequency: float, phase: float, gap: float
) -> None:
    """On a single mass it is the drive's force, also where the step in which the foot lands begins before the top of a
    sine, at which a piece of the drive ends: that piece was continued, to 7000 times the force."""
    structure = ts.Lumped(coordinates=("foot",), mass=(1.0,), stiffness=(0.0,), damping=(0.0,))
    wave = ts.Sine(amplitude=STRENGTH / 2.0, frequency=frequency, phase=phase)
    scene = ts.with_values(jumping(structure, "foot", STRENGTH, duration), {"robot.feet.f.gap": gap, "signals.d": wave})
    caught = ts.simulate(scene.model_copy(update={"initial": ts.Initial(velocity=(-1.0,))})).events[0]
    force = STRENGTH / 2.0 * np.sin(2.0 * np.pi * frequency * caught["time"] + phase)
    assert caught["kind"] == EventKind.CAPTURE and caught["pull"] == pytest.approx(force, rel=1e-7)
