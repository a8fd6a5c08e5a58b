"""Walkers that sway and turn: what they may have, what refuses them, and where the path goes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tarsus as ts
from tarsus.measure.path import path_of
from tarsus.model.structure import Walker
from turning_scenes import across, turning_walk
from walking_scenes import trotter

HEXAPOD = ts.load_scene("turning-hexapod")


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


def test_strides_are_shorter_on_the_inside_of_a_turn() -> None:
    waves: dict[float, Any] = {
        turn: ts.with_values(HEXAPOD, {"gait.turn": turn}).waveforms for turn in (-1.0, 0.0, 0.5, 2.0)
    }
    swing = {turn: (one["LF_swing"].amplitude, one["RF_swing"].amplitude) for turn, one in waves.items()}
    assert swing == {-1.0: (50.0, 0.0), 0.0: (50.0, 50.0), 0.5: (25.0, 50.0), 2.0: (-50.0, 50.0)}
    assert {one["LF_lift"].amplitude for one in waves.values()} == {50.0}


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
