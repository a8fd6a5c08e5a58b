"""Walkers that move across the way against a second simulator in three directions, and against the others of the
library where these say as much."""

from __future__ import annotations

import numpy as np
import pytest

import independent.compare
import tarsus as ts
from independent import turning
from independent.compare import compare
from sliding_scenes import by_modes
from tarsus.model.structure import Walker
from turning_scenes import across, turning_walk
from walking_scenes import sticky, trotter

TIGHT = ts.Accuracy(gap=1e-10, drive=1e-11)


def agree(seed: int, duration: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(independent.compare, "simulate", turning.simulate)
    found = compare(turning_walk(seed).model_copy(update={"duration": duration}), TIGHT)
    assert found.wrong is None and found.compared > 0, found


def test_the_first_events_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    agree(2, 5e-4, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_whole_sequences_of_events_agree(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    agree(seed, 3e-3, monkeypatch)


@pytest.mark.slow
def test_the_hexapod_turns_as_the_other_says() -> None:
    scene = ts.load_scene("turning-hexapod").model_copy(update={"duration": 0.02})
    run = ts.simulate(scene)
    start = tuple(run.motion.acting.rows.initial[0][: scene.robot.structure.size])
    scene = ts.with_values(scene, {"initial": {"displacement": start}, "signals": dict(scene.waveforms), "gait": None})
    found = turning.simulate(scene, run.plan.length).state
    body = run.at(np.array([0.02])).body
    assert body is not None and found[: len(body)] == pytest.approx(body[:, 0], rel=1e-4, abs=1e-9)


def test_contact_modes_say_the_same_where_nothing_rubs() -> None:
    """Contact modes know one way along the ground; without friction they need none, and have every coordinate."""
    scene = across(trotter(3, ground=sticky(friction=None))).model_copy(update={"duration": 0.004})
    shove = scene.model_copy(update={"initial": ts.Initial(velocity=tuple(_shove(scene)))})
    one, other = ts.simulate(shove, accuracy=TIGHT), ts.simulate(_free(by_modes(shove)), accuracy=TIGHT)
    assert len(one.events) > 4 and np.array_equal(one.events["kind"], other.events["kind"])
    assert one.events["time"] == pytest.approx(other.events["time"], abs=1e-11)
    ends = [run.at(np.array([run.end_time])).state.x[:, 0] for run in (one, other)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-7, abs=1e-15)


def _shove(scene: ts.Scene) -> np.ndarray:
    walker = scene.robot.structure
    return 2e-3 * walker.row("body_y") + 1e-3 * walker.row("leg1_y")


def _free(scene: ts.Scene) -> ts.Scene:
    feet = {name: foot.model_copy(update={"along": None}) for name, foot in scene.robot.feet.items()}
    return scene.model_copy(update={"robot": scene.robot.model_copy(update={"feet": feet})})


def test_a_walker_with_its_legs_in_one_plane_walks_as_one_that_has_no_other() -> None:
    flat = trotter(3, turning=False)
    walker = flat.robot.structure
    assert isinstance(walker, Walker)
    legs = {name: leg.model_copy(update={"y": 0.0}) for name, leg in walker.legs.items()}
    flat = ts.with_values(flat, {"robot.structure.legs": legs}).model_copy(update={"duration": 0.004})
    one, other = ts.simulate(flat), ts.simulate(across(flat))
    assert len(one.events) > 4 and np.array_equal(one.events["kind"], other.events["kind"])
    assert one.events["time"] == pytest.approx(other.events["time"], abs=1e-14)
