"""Walkers that sway and turn: what they may have, what refuses them, and where the path goes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.measure.path import path_of
from tarsus.model.structure import Payload, Walker
from turning_scenes import across, turning_walk
from walking_scenes import trotter

HEXAPOD = ts.load_scene("turning-hexapod")
TIP = {"mass": 1e-7, "stiffness_v": 1.0, "damping_v": 0.0, "stiffness_l": 1.0, "damping_l": 0.0}
BAG = Payload(mass=1e-4, stiffness_v=40.0, damping_v=0.01, stiffness_l=60.0, damping_l=0.01)


@pytest.mark.parametrize(
    "ask",
    [
        lambda scene: ts.periodic(scene),
        lambda scene: ts.export(scene, to="c", output="nowhere"),
        pytest.param(lambda scene: ts.explore(scene, "nowhere.html"), marks=pytest.mark.slow),
    ],
    ids=["orbit", "export", "page"],
)
def test_what_knows_one_plane_refuses_three_directions(ask: Callable[[ts.Scene], object]) -> None:
    with pytest.raises(InputError, match="legs that move upward and along the way alone"):
        ask(ts.with_values(HEXAPOD, {"duration": 0.01}))


def test_runs_of_a_batch_are_those_of_one() -> None:
    varied = {"gait.turn": [0.0, 1.0], "robot.structure.legs.LF.stiffness_t": [9.5, 20.0]}
    rates = ts.simulate_batch(HEXAPOD, varied, 0.2).measure("turn_rate")
    for i, rate in enumerate(rates):
        one = ts.simulate(ts.with_values(HEXAPOD, {path: values[i] for path, values in varied.items()}), 0.2)
        assert one.measures["turn_rate"].value == pytest.approx(rate, abs=1e-8)


def test_a_session_walks_as_a_run_does() -> None:
    """Told nothing new, step by step, in places along and across, and with the same heading; without derivatives."""
    scene = ts.with_values(HEXAPOD, {"duration": 0.02})
    run, session = ts.simulate(scene), ts.Session(scene)
    session.reset()
    for _ in range(5):
        state = session.step(dt="4 ms")
    end = run.at(np.array([0.02])).body
    assert end is not None
    ends = dict(zip(walker_of(scene).body_coordinates, end[:, 0], strict=True))
    assert abs(ends["yaw"]) > 1e-3
    for name in ("surge", "sway", "yaw"):
        assert state.body[name] == pytest.approx(ends[name], rel=1e-6, abs=1e-10)
    path = "robot.structure.legs.LF.stiffness_v"
    _, slopes = session.step(dt="1 ms", gradients=[path])
    assert np.isfinite(slopes.by_state).all() and slopes.by(path).any()


def walker_of(scene: ts.Scene) -> Walker:
    assert isinstance(scene.robot.structure, Walker)
    return scene.robot.structure


def test_samples_end_where_the_run_does() -> None:
    run = ts.simulate(turning_walk(3), 0.004)
    state = run.at(np.array([run.end_time])).state
    assert np.concatenate([state.x[:, 0], state.v[:, 0]]) == pytest.approx(run.motion.last, rel=1e-12, abs=1e-18)
    walker = walker_of(run.scene)
    series = run.at(np.linspace(0.0, run.end_time, 40))
    assert series.foot_y == pytest.approx(np.stack([walker.row(f"{leg}_y") @ series.state.x for leg in walker.legs]))


def test_friction_is_against_the_slip_and_in_its_disk() -> None:
    """mu (N + f_a) against the velocity of a foot that slides; under one that sticks no more than that."""
    run = ts.simulate(turning_walk(7), 0.01)
    series = run.at(np.linspace(0.0, 0.01, 400))
    most = 0.3 * np.maximum(series.contact + series.strength, 0.0)
    walker = walker_of(run.scene)
    assert series.friction is not None and series.friction_across is not None and series.slipping is not None
    friction = np.stack([series.friction, series.friction_across])
    velocity = np.array([[walker.row(f"{leg}_{d}") @ series.state.v for leg in walker.legs] for d in "xy"])
    size, speed, slides = np.hypot(*friction), np.hypot(*velocity), series.slipping
    assert slides.any() and np.all(size <= most * (1.0 + 1e-9) + 1e-13)
    assert size[slides] == pytest.approx(most[slides], rel=1e-9)
    against = -(friction * velocity).sum(axis=0)
    assert against[slides] == pytest.approx((size * speed)[slides], rel=1e-9)


def test_strides_are_shorter_on_the_inside_of_a_turn() -> None:
    waves: dict[float, Any] = {
        turn: ts.with_values(HEXAPOD, {"gait.turn": turn}).waveforms for turn in (-1.0, 0.0, 0.5, 2.0)
    }
    swing = {turn: (one["LF_swing"].amplitude, one["RF_swing"].amplitude) for turn, one in waves.items()}
    assert swing == {-1.0: (50.0, 0.0), 0.0: (50.0, 50.0), 0.5: (25.0, 50.0), 2.0: (-50.0, 50.0)}
    assert {one["LF_lift"].amplitude for one in waves.values()} == {50.0}


def test_one_drive_for_both_sides_cannot_turn() -> None:
    scene = trotter(2)
    both = ts.PointLoad(weights={"leg0": -1.0, "leg1": -1.0})
    drives = {"all": scene.robot.drives["leg0"].model_copy(update={"load": both})}
    feet = {name: foot.model_copy(update={"electrode": None}) for name, foot in scene.robot.feet.items()}
    robot = scene.robot.model_copy(update={"drives": drives, "feet": feet})
    gait = {"kind": "free", "frequency": 10.0, "high": 1.0, "phases": {"leg0": 0.0, "leg1": 0.0}, "turn": 0.5}
    with pytest.raises(InputError, match=r"gait\.turn: drive 'all' moves legs of both sides"):
        ts.Scene(name="both", robot=robot, ground=scene.ground, gait=gait, duration=0.1)  # pyright: ignore


def test_a_body_that_goes_ahead_and_turns_goes_round_a_circle() -> None:
    yaw = np.linspace(0.0, np.pi, 2001)
    x, y = path_of(0.1 * yaw, np.zeros(2001), yaw)
    assert np.hypot(x, y - 0.1) == pytest.approx(np.full(2001, 0.1), rel=1e-6)
    assert (x[-1], y[-1]) == pytest.approx((0.0, 0.2), abs=1e-7)


def test_hips_follow_a_turn_of_any_axis_as_a_rigid_body() -> None:
    walker = across(trotter(3)).robot.structure
    assert isinstance(walker, Walker)
    turn = {"roll": 0.3, "pitch": -0.2, "yaw": 0.5}
    body = np.array([turn.get(name, 0.0) for name in walker.body_coordinates])
    for name, leg in walker.legs.items():
        moved = [row(name) @ body for row in (walker.hip_row_x, walker.hip_row_y, walker.hip_row_z)]
        assert moved == pytest.approx(np.cross(list(turn.values()), (leg.x, leg.y, leg.z)))
