"""Ground along several lines: one a foot or a side, and surfaces of which each foot has the line at its own place."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import validate, with_values
from tarsus.model.ground import Ground
from tarsus.model.profile import Relief
from tarsus.model.profile.random_ground import _coherence, _shares
from tarsus.model.scene import Scene
from tarsus.report.drawing import drawing_of
from tarsus.report.motion import motion_of
from walking_scenes import sticky, trotter

TEETH = {"kind": "sawtooth", "length": 9e-5, "height": 2e-7, "rising": 0.4, "start": 1.3e-5}
ROUGH = {"kind": "random", "seed": 3, "rms": 2e-7, "correlation_length": 3e-5, "spacing": 1.3e-5, "facets": 256}
STEP = {"kind": "staircase", "tread": 1e-3, "rise": 1e-7, "start": 1e-5}


def relief(**profile: Any) -> Relief:
    found = validate(Ground, {"profile": profile}).profile
    assert found is not None
    return found


def on(scene: Scene, left: dict[str, Any], right: dict[str, Any]) -> Scene:
    return with_values(scene, {"ground.profile": {"kind": "feet", "feet": {"left": left, "right": right}}})


def level(height: float) -> dict[str, Any]:
    return {"kind": "polyline", "given": [[-1.0, height], [1.0, height]]}


def walks_alike(one: Scene, other: Scene, duration: float, within: float) -> ts.Run:
    first, second = ts.simulate(one, duration), ts.simulate(other, duration)
    assert len(first.events) > 10 and np.array_equal(first.events["kind"], second.events["kind"])
    assert first.events["time"] == pytest.approx(second.events["time"], abs=within * duration)
    x, y = (run.at(np.array([0.9 * duration])).state.x for run in (first, second))
    assert x == pytest.approx(y, abs=within * np.abs(y).max())
    return first


@pytest.mark.parametrize("shape", [TEETH | {"friction": [1.0, 0.5]}, ROUGH])
def test_the_same_ground_twice_is_one(shape: dict[str, Any]) -> None:
    scene = trotter(3)
    walks_alike(on(scene, shape, shape), with_values(scene, {"ground.profile": shape}), 0.01, 0.0)


def test_higher_ground_is_a_smaller_gap() -> None:
    """Right feet on ground that is higher by h, and the same robot with gaps smaller by h on level ground."""
    scene, height = trotter(4, ground=sticky(film=ts.Film(coefficient=1e-26, thickness=1e-7))), 2e-7
    lower = {f"robot.feet.{name}.gap": 1e-6 - height for name, y in scene.across.items() if y < 0.0}
    raised = walks_alike(on(scene, level(0.0), level(height)), with_values(scene, lower), 0.004, 1e-11)
    assert raised.ledger.closure < 1e-8


def test_two_grounds_close_their_account() -> None:
    run = ts.simulate(on(trotter(4), TEETH | {"friction": [1.0, 0.3]}, ROUGH), 0.02)
    assert run.ok and len(run.events) > 20 and run.ledger.closure < 1e-8


def test_batches_windows_and_sessions_have_each_foot_on_its_ground() -> None:
    scene = on(trotter(2, ground=sticky(film=ts.Film(coefficient=1e-26, thickness=1e-7))), TEETH, ROUGH)
    path, seeds = "ground.profile.feet.right.seed", (3, 4)
    alone = [ts.simulate(with_values(scene, {path: seed}), 0.003) for seed in seeds]
    batch = ts.simulate_batch(scene, {path: [float(seed) for seed in seeds]}, 0.003)
    session = ts.Session(scene, robots=2, vary={path: [float(seed) for seed in seeds]})
    session.reset()
    state = [session.step(dt="1 ms") for _ in range(3)][-1]
    for k, run in enumerate(alone):
        assert batch.run(k).events["time"] == pytest.approx(run.events["time"], rel=1e-9)
        at = run.states(np.array([0.003]))
        assert state.x[k] == pytest.approx(at.x[:, 0], abs=1e-9)
        assert state.gaps[k] == pytest.approx(at.gap[:, 0], abs=1e-9)


def test_standing_robots_and_their_pictures() -> None:
    """Each foot stands on its own ground, where it is drawn."""
    scene = with_values(on(trotter(4, turning=False), level(0.0), STEP), {"signals": {}, "initial": {"standing": {}}})
    motion = motion_of(ts.simulate(scene, "1 ms"))
    drawing, frame = drawing_of(motion), len(motion.time) - 1
    assert (motion.state[:, frame] > 0).all() and [one.line for one in drawing.pieces] == [0, 1, 0, 1]
    seen = drawing.seen(motion)[:, :, frame]
    for piece, (x, z) in zip(drawing.pieces, drawing.ground_below(motion, seen, frame), strict=True):
        along, up = seen[:, piece.point]
        nearest = z[np.argsort(np.abs(x - along))[:2]]
        assert up == pytest.approx(nearest[0], abs=1e-9 * drawing.leg)


def test_surfaces_are_alike_in_all_directions() -> None:
    """Lines of exponential and of once differentiable surfaces are as alike as closed forms say; the middle is the
    ground without, and lines of one place are one."""
    x = np.array([0.0, 1e-3, 0.1, 1.0, 5.0, 40.0])
    assert _coherence(x, 0.5) == pytest.approx(np.exp(-x), abs=1e-14)
    assert _coherence(x, 1.5) == pytest.approx((1.0 + x) * np.exp(-x), abs=1e-14)
    numbers = {**ROUGH, "facets": 4096, "correlation_length": 1e-3, "hurst": 0.5}
    feet = {"a": 5e-4, "b": -2e-4, "c": 0.0, "d": 5e-4}
    lines, which = relief(**numbers, across=True).lines(feet)
    assert which == [2, 0, 1, 2]
    (single,), _ = relief(**numbers).lines(feet)
    assert np.array_equal(lines[1].points, single.points)
    shares = _shares((-2e-4, 0.0, 5e-4), 1e-3, 0.5, 1.3e-5, 64)
    rate = np.hypot(2.0 * math.pi * np.arange(1, 33) / (64 * 1.3e-5), 1e3)
    for i, k, apart in ((0, 1, 2e-4), (0, 2, 7e-4), (1, 2, 5e-4), (2, 2, 0.0)):
        assert np.sum(shares[i] * shares[k], axis=0) == pytest.approx(_coherence(apart * rate, 1.0), abs=1e-9)


def test_maps_are_read_at_each_foot(tmp_path: Path) -> None:
    (tmp_path / "map.txt").write_text("0 0 0\n2 4 2\n4 8 6\n")
    ground = relief(kind="file", file=str(tmp_path / "map.txt"), spacing=1e-3, unit=1e-9, row=1, across=True)
    lines, which = ground.lines({"right": -1e-3, "left": 5e-4})
    assert [lines[k].points[:, 1].tolist() for k in which] == [[0.0, 0.0, 0.0], pytest.approx([3e-9, 6e-9, 4e-9])]
    assert "row 2.5 of a map of rows 0 to 2" in ground.faults({"far": 1.5e-3})[0][1]
