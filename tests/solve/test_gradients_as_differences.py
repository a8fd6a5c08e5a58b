"""Derivatives of runs against differences of tight runs over other steps: one scene of every kind in a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import pytest

import tarsus as ts
from differences import STEPS, assert_as_differences
from printed_robots import hexapod
from scene_files import scene as scene_of
from sliding_scenes import MASS, by_modes, cantilever, slider
from survey_gradients import look_at
from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from walking_bodies import BODIES, with_body
from walking_scenes import GRAVITY, block, moving, sticky, trotter

MU, REBOUND = "ground.friction.coefficient", "ground.restitution.coefficient"
FRICTION = ("ledger.friction", "ledger.work_in", "ledger.impacts", "ledger.kinetic")
WALK = ("work_in", "damping", "friction", "kinetic", "elastic", "impacts", "adhesion")
CHAIN = ("work_in", "damping", "kinetic", "elastic", "impacts", "adhesion", "film")
LONG = (1e-3, 1e-4, 1e-5)
FACTORS = {"friction": [1.0, 0.5], "adhesion": [0.7, 1.0, 0.8], "restitution": [0.9, 0.6]}
TEETH = {"kind": "sawtooth", "length": 9e-5, "height": 2e-7, "rising": 0.4, "start": 1.3e-5} | FACTORS
ROUGH: dict[str, Any] = {
    "kind": "random",
    "seed": 3,
    "rms": 2e-7,
    "correlation_length": 3e-5,
    "spacing": 1.3e-5,
    "facets": 256,
}
FILM = ts.Film(coefficient=1e-26, thickness=1e-7)


@dataclass(frozen=True)
class Case:
    """A scene, how long it runs [s], the numbers that are varied, to what part of the largest of each kind all agrees,
    over which steps of the number, and which measures and energies beside events, states and marks."""

    make: Callable[[], Scene]
    duration: float
    paths: Sequence[str]
    within: float
    steps: Sequence[float] = STEPS
    terms: Sequence[str] = ()
    slow: bool = False


def knocked() -> Scene:
    """A slider that a square force moves to and fro, whose friction jumps with the push that it makes."""
    wave = ts.Square(amplitude=1.3 * 0.3 * MASS * GRAVITY, frequency=60.0, phase=0.7, duty=0.4)
    return with_values(slider(coupling=0.3), {"signals": {"along": wave}})


def on(scene: Scene, gap: float, **profile: Any) -> Scene:
    gaps = {f"robot.feet.{name}.gap": gap for name in scene.robot.feet}
    return with_values(scene, {"ground.profile": profile} | gaps)


def stairs(rise: float, start: float) -> Scene:
    """A block thrown along, down stairs or against the side of one."""
    thrown = moving(block(friction=0.2), block_x=0.5)
    return on(thrown, 5e-3, kind="staircase", tread=10e-3, rise=rise, start=start, steps=4)


def sled() -> Scene:
    """It slides down, hits the next side, and rises on it; the film's momentum is of no account."""
    scene = with_values(block(friction=0.1), {"ground.restitution": None})
    return on(scene, 1e-3 + 1e-5, kind="sawtooth", length=2e-2, height=2e-3, start=-1.5e-2)


def corner() -> Scene:
    """A block that waits in the second of three points."""
    scene = with_values(block(friction=0.2), {"ground.restitution": None})
    scene = scene.model_copy(update={"signals": {"along": ts.Square(amplitude=3e-6, frequency=10.0)}})
    return on(scene, 1e-3 + 1e-5, kind="polyline", given=[(-0.01, 1e-3), (1e-3, 1e-3), (1.1e-3, 1.2e-3)])


def steps_on(shape: dict[str, Any], **laws: Any) -> Scene:
    return with_values(trotter(2, ground=sticky(**laws)), {"ground.profile": shape})


def bodies() -> Scene:
    """A mode, a payload and a compliant tip on an incline."""
    return with_values(with_body(trotter(3), **BODIES["all"]), {"ground.incline": 0.1})


def pits() -> Scene:
    pits = {"kind": "pits", "spacing": 3e-4, "width": 1.2e-4, "depth": 2e-8, "start": 3.7e-5}
    return with_values(ts.load_scene("millipede", hz=50, volts=14), {"ground.profile": pits})


def of(prefix: str, *names: str) -> list[str]:
    return [f"{prefix}.{name}" for name in names]


PROFILE, LEGS = "ground.profile", "robot.structure.legs"
STAIRS = [*of(PROFILE, "rise", "tread", "start"), REBOUND, "initial.velocity.2"]
UNEVEN = [*of(LEGS, "leg0.x", "leg1.stiffness_l"), "robot.drives.leg0.law.gain", "robot.feet.leg1.gap"]
CASES = {
    "a passive map": Case(
        lambda: hexapod(
            signal=ts.Sine(amplitude=20.0, frequency=120.0),
            gap=1e-5,
            restitution=0.6,
            impact=ts.laws.DominantMode(mode=2),
        ),
        0.02,
        (REBOUND, "signals.pzt.amplitude"),
        1e-6,
    ),
    "measures of a chain": Case(
        lambda: scene_of("p1_n2"),
        0.073,
        ("signals.pull.duty", "robot.drives.pull.law.gain", "robot.structure.stiffness.0.0"),
        1e-6,
        (1e-6, 1e-5, 1e-4, 1e-3),
        ("contact_duration", "duty_factor", "mean_height", "hardest_impact", "longest_contact", *of("ledger", *CHAIN)),
        slow=True,
    ),
    "a slider that is knocked": Case(
        knocked, 0.05, (MU, "signals.along.phase", "signals.along.amplitude"), 1e-5, (1e-5, 1e-4), FRICTION
    ),
    "a slider that is thrown": Case(
        lambda: slider(speed=0.3, fall=0.1, gap=1e-6, coupling=0.3),
        0.02,
        (MU, "initial.velocity.0", REBOUND),
        1e-5,
        (1e-5, 1e-4),
        FRICTION,
    ),
    "a cantilever that slides": Case(
        cantilever,
        0.004,
        (MU, "ground.adhesion.rate", "robot.feet.tip.gap", "robot.structure.modal_masses.0"),
        1e-5,
        (1e-5, 1e-4),
        FRICTION,
    ),
    # the way slid in contact bends more than all else: runs to both sides know it to 3e-5, and say 1e-3
    "measures of a walk": Case(
        lambda: trotter(3),
        0.0121,
        (MU, "robot.feet.leg1.gap", f"{LEGS}.leg1.damping_v"),
        5e-5,
        (1e-4,),
        (*of("ledger", *WALK), "mean_speed", "stride", "foot_slip"),
    ),
    "a slope, by contact modes": Case(
        lambda: by_modes(with_values(trotter(2, turning=False), {"ground.incline": 0.2})),
        0.003,
        ("ground.incline",),
        1e-6,
        (1e-5, 1e-4),
    ),
    "a body with parts": Case(
        bodies,
        0.002,
        (
            "robot.structure.payloads.bag.stiffness_v",
            "robot.structure.body.modes.bends.frequency",
            f"{LEGS}.leg1.tip.stiffness_v",
            "ground.incline",
        ),
        1e-5,
        (1e-4, 1e-5),
    ),
    "down stairs": Case(lambda: stairs(-4e-3, 10e-3), 0.09, STAIRS, 3e-6, (1e-3, 1e-4)),
    "against a step": Case(lambda: stairs(10e-3, 5e-3), 0.09, STAIRS, 3e-6, (1e-3, 1e-4)),
    "a sled on teeth": Case(
        sled,
        0.2,
        [*of(PROFILE, "height", "length", "start"), "ground.gravity.acceleration", MU],
        1e-6,
        (1e-3, 1e-4),
        FRICTION[:2],
    ),
    "a block in a corner": Case(
        corner,
        0.09,
        [*of(PROFILE, "given.0.1", "given.1.0", "given.1.1", "given.2.0"), "signals.along.amplitude"],
        1e-6,
        (1e-4, 1e-5),
    ),
    "a trotter on teeth": Case(
        lambda: steps_on(TEETH), 0.006, [*of(PROFILE, "height", "friction.1"), UNEVEN[0]], 5e-6, LONG, FRICTION[:2]
    ),
    "teeth and a film": Case(
        lambda: steps_on(TEETH, film=FILM),
        0.006,
        [*of(PROFILE, "start", "length", "friction.0", "adhesion.0", "adhesion.2", "restitution.1"), *UNEVEN],
        5e-6,
        LONG,
        FRICTION[:2],
        slow=True,
    ),
    "a trotter on rough ground": Case(
        lambda: steps_on(ROUGH, adhesion=None),
        0.006,
        [*of(PROFILE, "rms", "correlation_length", "hurst", "spacing"), *UNEVEN],
        5e-6,
        LONG,
        FRICTION[:2],
        slow=True,
    ),
    # by no step do differences over it tell more: those over steps ten times apart differ by some 1e-6
    "a millipede": Case(
        lambda: ts.load_scene("millipede"),
        0.026,
        (MU, "ground.film.thickness", REBOUND, "ground.adhesion.initial"),
        1e-5,
        (1e-4, 1e-3, 1e-2),
        slow=True,
    ),
    # runs know gaps to 1e-17 m or so, differences over 1e-9 m less well: these derivatives state errors of 2e-5, 1.3e-4
    "a millipede over pits": Case(
        pits, 0.05, (f"{PROFILE}.depth", "ground.film.coefficient"), 5e-5, (5e-2, 2e-2, 1e-3), slow=True
    ),
}


@pytest.mark.parametrize(
    "case", [pytest.param(one, id=name, marks=[pytest.mark.slow] * one.slow) for name, one in CASES.items()]
)
def test_a_scene_moves_as_its_derivatives_say(case: Case) -> None:
    run = assert_as_differences(case.make(), case.paths, case.duration, case.within, case.steps, case.terms)
    assert len(run.events) >= 1


MODAL, LEGGED = (2, 3, 6, 10, 18, 26, 36, 132), (0, 2, 4, 5, 11, 14, 18, 19, 22)


@pytest.mark.parametrize(("seed", "legged"), [*((s, False) for s in MODAL), *((s, True) for s in LEGGED)])
def test_derivatives_of_random_scenes_as_differences(seed, legged):
    """In the modal one of seed 132 steps go far beyond a short piece."""
    found = look_at(seed, legged)
    assert found["compared"] > 50
    assert not found["wrong"] and not found["signs"] and not found["flagged"]
