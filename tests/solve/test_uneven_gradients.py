"""Derivatives of runs on uneven ground, by its heights, places and factors and by all other numbers, against
differences; what is no derivative is flagged."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from differences import assert_as_differences
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.scene import Scene
from tarsus.solve.trajectories import Trajectories
from walking_scenes import GRAVITY, block, moving, sticky, trotter

GRAV, MU = "ground.gravity.acceleration", "ground.friction.coefficient"


def on(scene: Scene, gap: float, **profile: Any) -> Scene:
    gaps = {f"robot.feet.{name}.gap": gap for name in scene.robot.feet}
    return with_values(scene, {"ground.profile": profile} | gaps)


def shaped(*names: str) -> list[str]:
    return [f"ground.profile.{name}" for name in names]


def test_a_ball_on_stairs_in_closed_form() -> None:
    """It lands on the second tread, d below the first, at t = sqrt(2 (h + d) / g), by d 1 / v later."""
    drop, height = 4e-3, 5e-3
    scene = moving(block(friction=None), block_x=0.4)
    stairs = {"kind": "staircase", "tread": 20e-3, "rise": -drop, "start": 10e-3}
    run = ts.simulate(on(scene, height, **stairs), 0.05, gradients=shaped("rise", "tread", "start"))
    speed = math.sqrt(2.0 * GRAVITY * (height + drop))
    assert not run.flags and run.events["kind"].tolist() == [1]
    by_rise, by_tread, by_start = (run.event_gradients[path] for path in shaped("rise", "tread", "start"))
    assert by_rise["time"][0] == pytest.approx(-1.0 / speed, rel=1e-6)
    assert by_rise["speed_before"][0] == pytest.approx(-GRAVITY / speed, rel=1e-6)
    assert [by_tread["time"][0], by_start["time"][0]] == pytest.approx([0.0, 0.0], abs=1e-7)


def test_a_ball_on_stairs_and_their_sides() -> None:
    scene = moving(block(friction=0.2), block_x=0.5)
    paths = [*shaped("rise", "tread", "start"), "ground.restitution.coefficient", "initial.velocity.2"]
    for rise, start in ((-4e-3, 10e-3), (10e-3, 5e-3)):
        stairs = {"kind": "staircase", "tread": 10e-3, "rise": rise, "start": start, "steps": 4}
        run = assert_as_differences(on(scene, 5e-3, **stairs), paths, 0.09, 3e-6, (1e-3, 1e-4))
        assert len(run.events) >= 1


def test_a_sled_on_teeth() -> None:
    """It slides down, hits the next side, and rises on it; the film's momentum is of no account."""
    half, height = 10e-3, 2e-3
    scene = with_values(block(friction=0.1), {"ground.restitution": None})
    sled = on(scene, height / 2 + 1e-5, kind="sawtooth", length=2 * half, height=height, start=-1.5 * half)
    terms = ("ledger.friction", "ledger.work_in")
    run = assert_as_differences(
        sled, [*shaped("height", "length", "start"), GRAV, MU], 0.2, 1e-6, (1e-3, 1e-4), terms
    )
    assert len(run.events) > 5


def test_a_block_waits_in_a_corner() -> None:
    """Heights of three points, of which one is the corner."""
    scene = with_values(block(friction=0.2), {"ground.restitution": None})
    along = ts.Square(amplitude=3e-6, frequency=10.0)
    scene = scene.model_copy(update={"signals": {"along": along}})
    points = [(-0.01, 1e-3), (1e-3, 1e-3), (1.1e-3, 1.2e-3)]
    block_there = on(scene, 1e-3 + 1e-5, kind="polyline", given=points)
    paths = [*shaped("given.0.1", "given.1.0", "given.1.1", "given.2.0"), "signals.along.amplitude"]
    run = assert_as_differences(block_there, paths, 0.09, 1e-6, (1e-4, 1e-5))
    assert 8 in run.events["kind"]


FACTORS = {"friction": [1.0, 0.5], "adhesion": [0.7, 1.0, 0.8], "restitution": [0.9, 0.6]}
TEETH = {"kind": "sawtooth", "length": 9e-5, "height": 2e-7, "rising": 0.4, "start": 1.3e-5} | FACTORS
ROUGH = {
    "kind": "random",
    "seed": 3,
    "rms": 2e-7,
    "correlation_length": 3e-5,
    "spacing": 1.3e-5,
    "facets": 256,
}
FILM = {"film": ts.Film(coefficient=1e-26, thickness=1e-7)}


@pytest.mark.parametrize(
    ("shape", "names", "laws"),
    [
        (TEETH, ("height", "friction.1"), {}),
        pytest.param(TEETH, ("start", "restitution.0", "adhesion.1"), {}, marks=pytest.mark.slow),
        pytest.param(
            TEETH,
            ("length", "friction.0", "adhesion.0", "adhesion.2", "restitution.1"),
            FILM,
            marks=pytest.mark.slow,
        ),
        pytest.param(
            ROUGH,
            ("rms", "correlation_length", "hurst", "spacing"),
            {"adhesion": None},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_trotters_on_uneven_ground(
    shape: dict[str, Any], names: tuple[str, ...], laws: dict[str, Any]
) -> None:
    scene = with_values(trotter(2, ground=sticky(**laws)), {"ground.profile": shape})
    paths = [*shaped(*names), "robot.structure.legs.leg0.x"]
    if len(names) > 2:
        paths += [
            "robot.structure.legs.leg1.stiffness_l",
            "robot.drives.leg0.law.gain",
            "robot.feet.leg1.gap",
        ]
    terms = ("ledger.damping", "ledger.friction", "ledger.work_in")
    run = assert_as_differences(scene, paths, 0.006, 5e-6, (1e-3, 1e-4, 1e-5), terms)
    assert len(run.events) > 5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "names", "within"),
    [
        ({"kind": "pits", "spacing": 3e-4, "width": 1.2e-4, "depth": 2e-8, "start": 3.7e-5}, ("depth",), 5e-5),
        (
            {
                "kind": "polyline",
                "given": [(-0.02, 0.0), (-1e-3, -3e-8), (1e-3, 2e-8), (2.1e-3, -3e-8), (0.02, 0.0)],
            },
            ("given.1.1", "given.2.1"),
            5e-4,
        ),
    ],
)
def test_the_packaged_millipede_on_uneven_ground(
    shape: dict[str, Any], names: tuple[str, ...], within: float
) -> None:
    """Its film and attraction act on every foot. Runs know gaps to 1e-17 m or so, differences over 1e-9 m as much less
    well: these derivatives state errors of up to 2e-5 and 1.3e-4 of the largest themselves."""
    scene = with_values(ts.load_scene("millipede", hz=50, volts=14), {"ground.profile": shape})
    run = assert_as_differences(
        scene, [*shaped(*names), "ground.film.coefficient"], 0.05, within, (5e-2, 2e-2, 1e-3)
    )
    assert len(run.events) >= 30


def test_a_foot_that_starts_at_a_corner_has_no_derivative() -> None:
    stairs = on(block(), 1e-3, kind="staircase", tread=1e-3, rise=-1e-4, start=0.0)
    flags = ts.simulate(stairs, 0.02, gradients=shaped("start")).flags
    assert "otherwise" in flags["ground.profile.start"][0]


def test_a_seed_is_no_number_to_differentiate_by() -> None:
    scene = with_values(trotter(1), {"ground.profile": ROUGH})
    with pytest.raises(InputError, match=r"ground\.profile\.seed: there is no derivative by it"):
        ts.simulate(scene, 1e-3, gradients=["ground.profile.seed"])


def test_walks_on_uneven_ground_go_on_in_parts() -> None:
    """A run in parts is the run in one, and a session's robots know their gaps."""
    scene = with_values(trotter(2, ground=sticky(**FILM)), {"ground.profile": TEETH})
    run, end = ts.simulate(scene, 0.006), 0.006
    runs = Trajectories.of(scene, {}, end, accuracy=ts.Accuracy(gap=1e-12))
    found = [runs.advance([np.array([t])])[0] for t in np.linspace(0.0, end, 6)[1:]]
    events = np.concatenate([one.events for one in found])
    assert events["kind"].tolist() == run.events["kind"].tolist() and len(events) > 8
    assert events["time"] == pytest.approx(run.events["time"], rel=1e-6)
    size = np.abs(run.motion.last).max()
    assert np.abs(runs.state[0] - run.motion.last).max() < 1e-7 * size
    session = ts.Session(scene, robots=2, vary={"ground.profile.height": [1e-7, 2e-7]})
    session.reset()
    for _ in range(3):
        state = session.step(dt="1 ms")
    alone = [ts.simulate(with_values(scene, {"ground.profile.height": h}), 0.003) for h in (1e-7, 2e-7)]
    gaps = np.array([one.states(np.array([0.003])).gap[:, 0] for one in alone])
    assert state.gaps == pytest.approx(gaps, abs=1e-9) and state.ok.all()
