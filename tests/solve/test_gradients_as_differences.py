"""Derivatives of runs against differences of tight runs: of random scenes, and of what their events do not tell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest

import tarsus as ts
from differences import assert_as_differences
from scene_files import scene as scene_of
from scene_kinds import KINDS, over
from sliding_scenes import slider
from survey_gradients import look_at
from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from tarsus.plan.slots import slots
from walking_bodies import BODIES, with_body
from walking_scenes import block, trotter

MU, REBOUND = "ground.friction.coefficient", "ground.restitution.coefficient"
FRICTION = ("ledger.friction", "ledger.work_in", "ledger.impacts", "ledger.kinetic")
WALK = ("work_in", "damping", "friction", "kinetic", "elastic", "impacts", "adhesion")
CHAIN = ("work_in", "damping", "kinetic", "elastic", "impacts", "adhesion", "film")


@dataclass(frozen=True)
class Case:
    """A scene, how long it runs [s], the numbers that are varied, to what part of the largest of each kind all agrees,
    over which steps of the number, and which measures and energies beside events, states and marks."""

    make: Callable[[], Scene]
    duration: float
    paths: Sequence[str]
    within: float
    steps: Sequence[float]
    terms: Sequence[str] = ()


def corner() -> Scene:
    """A block that waits in the second of three points."""
    scene = with_values(block(friction=0.2), {"ground.restitution": None})
    line = {"kind": "polyline", "given": [(-0.01, 1e-3), (1e-3, 1e-3), (1.1e-3, 1.2e-3)]}
    scene = scene.model_copy(update={"signals": {"along": ts.Square(amplitude=3e-6, frequency=10.0)}})
    return with_values(scene, {"ground.profile": line, "robot.feet.block.gap": 1e-3 + 1e-5})


def bodies() -> Scene:
    """A mode, a payload and a compliant tip on an incline."""
    return with_values(with_body(trotter(3), **BODIES["all"]), {"ground.incline": 0.1})


def of(prefix: str, *names: str) -> list[str]:
    return [f"{prefix}.{name}" for name in names]


CASES = {
    "a chain": Case(
        lambda: scene_of("p1_n2"),
        0.073,
        ("signals.pull.duty", "robot.drives.pull.law.gain", "robot.structure.stiffness.0.0"),
        1e-6,
        (1e-6, 1e-5, 1e-4, 1e-3),
        ("contact_duration", "duty_factor", "mean_height", "hardest_impact", "longest_contact", *of("ledger", *CHAIN)),
    ),
    "a slider that is thrown": Case(
        lambda: slider(speed=0.3, fall=0.1, gap=1e-6, coupling=0.3),
        0.02,
        (MU, "initial.velocity.0", REBOUND),
        1e-5,
        (1e-5, 1e-4),
        FRICTION,
    ),
    # the way slid in contact bends more than all else: runs to both sides know it to 3e-5, and say 1e-3
    "a walk": Case(
        lambda: trotter(3),
        0.0121,
        (MU, "robot.feet.leg1.gap", "robot.structure.legs.leg1.damping_v"),
        5e-5,
        (1e-4,),
        (*of("ledger", *WALK), "mean_speed", "stride", "foot_slip"),
    ),
    "a body with parts": Case(
        bodies,
        0.002,
        (
            "robot.structure.payloads.bag.stiffness_v",
            "robot.structure.body.modes.bends.frequency",
            "robot.structure.legs.leg1.tip.stiffness_v",
            "ground.incline",
        ),
        1e-5,
        (1e-4, 1e-5),
    ),
    "a block in a corner": Case(
        corner,
        0.09,
        [*of("ground.profile", "given.0.1", "given.1.0", "given.1.1", "given.2.0"), "signals.along.amplitude"],
        1e-6,
        (1e-4, 1e-5),
        FRICTION[:2],
    ),
}


@pytest.mark.parametrize("name", [pytest.param("a chain", marks=pytest.mark.slow), *list(CASES)[1:]])
def test_measures_accounts_and_motion_change_as_their_derivatives_say(name: str) -> None:
    case = CASES[name]
    run = assert_as_differences(case.make(), case.paths, case.duration, case.within, case.steps, case.terms)
    assert len(run.events) >= 1


@over(
    modal=(2, 3, 6, 10, 18, 26, 36, 132),
    legged=(0, 2, 4, 5, 11, 14, 18, 19, 22),
    sliding=(1, 2, 5, 9, 10, 11),
    turning=(0, 2, 3, 4, 7, 8, 11, 12, 13),
    uneven=range(8),
)
def test_derivatives_of_random_scenes_as_differences(kind: str, seed: int) -> None:
    """Those of uneven walks by all numbers of their ground. In the modal one of seed 132 steps go far beyond a short
    piece."""
    scene = KINDS[kind](seed)
    shape = [path for path in slots(scene) if path.startswith("ground.profile.")]
    found = look_at(scene, seed, [*shape, "robot.feet.leg0.gap"] if shape else None)
    assert found["compared"] > 40
    assert not found["wrong"] and not found["signs"] and not found["flagged"]
