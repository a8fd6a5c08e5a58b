"""Ground that moves: what is refused in words, what instruments and files see, and what draws it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.base.quantities import Quantity
from tarsus.base.spec import validate
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.motion import GroundMotion, GroundShift
from tarsus.plan.lowering import lower_scene
from tarsus.report.drawing import drawing_of
from tarsus.report.motion import motion_of
from tarsus.report.movie import movie
from tarsus.report.player import payload, walk_plate
from tarsus.solve.outputs import Output

SINE = {"kind": "sine", "amplitude": 1e-6, "frequency": 100.0}
TABLE = {"normal": {"displacement": SINE}}


def moving(name: str, motion: dict[str, Any], **values: Any) -> ts.Scene:
    made = ts.load_scene(name) if name in ("millipede", "hexapod") else scene(name)
    return ts.with_values(made, {"ground.motion": motion, **values})


def test_ground_that_stays_costs_nothing() -> None:
    """The same plan as ever; a motion adds a load and a channel for each of its forces."""
    still, shaken = lower_scene(scene("p1_n6")), lower_scene(moving("p1_n6", TABLE))
    assert still.drives == len(scene("p1_n6").robot.drives) == len(still.periods)
    assert shaken.drives == still.drives + 1 and len(shaken.channels) == len(still.channels) + 1
    staying = lower_scene(moving("p1_n6", TABLE | {"base": "stays"}))
    assert staying.drives == still.drives + 3
    free = lower_scene(moving("ball", TABLE | {"base": "stays"}))  # no base holds it
    assert free.drives == 1


def test_accelerometers_feel_the_ground() -> None:
    """That in the laboratory: of a ball in flight gravity alone, and by differences of y + s over times."""
    run = ts.simulate(moving("ball", {"normal": {"displacement": SINE | {"amplitude": 1e-3}}}), 0.4)
    times, h = np.linspace(0.1, 0.3, 7), 1e-4
    felt = run.outputs([Output(Quantity.ACCELERATION, "ball")], times)[0]
    np.testing.assert_allclose(felt, -9.81, rtol=1e-9)
    shift = run.scene.ground.motion.normal
    place = [run.states(times + by).x[0] + shift.at(times + by) for by in (-h, 0.0, h)]
    np.testing.assert_allclose((place[0] - 2.0 * place[1] + place[2]) / h**2, -9.81, rtol=1e-5)


@pytest.mark.parametrize("told", ["displacement", "velocity", "acceleration"])
def test_rates_and_integrals_of_a_shift(told: str) -> None:
    """Of a sine that is told as each of them, in closed form; from a rate it starts at zero."""
    w, size, phase = 2.0 * np.pi * 7.0, 0.3, 0.4
    shift = GroundShift(**{told: {"kind": "sine", "amplitude": size, "frequency": 7.0, "phase": phase}})
    order = ("displacement", "velocity", "acceleration").index(told)
    t = np.array([0.0, 0.01, 0.12, 0.5, 1.23])

    def sine(derivative: int) -> np.ndarray:
        return size * w**derivative * np.sin(w * t + phase + 0.5 * np.pi * derivative)

    for k in range(3):
        wanted = sine(k - order)
        for lower in range(k, order):  # constants of what was integrated
            wanted = wanted - sine_at_start(size, w, phase, lower - order) * t ** (lower - k)
        np.testing.assert_allclose(shift.at(t, k), wanted, rtol=1e-11, atol=1e-13 * size * w**2)


def sine_at_start(size: float, w: float, phase: float, derivative: int) -> float:
    return float(size * w**derivative * np.sin(phase + 0.5 * np.pi * derivative))


def test_a_record_moves_the_ground(tmp_path: Path) -> None:
    """An accelerometer's file in its own unit, the column that is in one; and files of scenes keep it."""
    file = tmp_path / "table.csv"
    file.write_text("time (ms),volts (V),table (mm/s^2)\n0,9,0\n10,9,500\n30,9,-250\n")
    raw = {"normal": {"acceleration": {"kind": "sampled", "file": "table.csv"}}}
    motion = validate(GroundMotion, raw, context={"folder": tmp_path})
    assert motion.normal is not None
    np.testing.assert_allclose(motion.normal.at(np.array([0.0, 5e-3, 0.01, 0.02]), 2), [0.0, 0.25, 0.5, 0.125])
    assert motion.normal.at(0.01, 1) == pytest.approx(0.5 * 0.01 * 0.5)
    written = ts.with_values(scene("ball"), {"ground.motion": motion})
    assert parse_scene(scene_text(written)) == written


def test_a_periodic_motion_on_a_shaker_is_found() -> None:
    table = {"normal": {"displacement": {"kind": "sine", "amplitude": 1.2 / (2.0 * np.pi) ** 2, "frequency": 1.0}}}
    shaken = scene("vibrating_table", {"robot.drives": {}, "signals": {}, "ground.motion": table})
    phase = float(np.arccos(np.pi / 3.0 / 1.2))
    start = {"ground.motion.normal.displacement.phase": phase, "initial.velocity": [1.0 / 3.0]}
    orbit = ts.periodic(ts.with_values(shaken, start))
    assert orbit.period == 1.0 and orbit.stable


def test_players_and_movies_draw_it(tmp_path: Path) -> None:
    plate = {"normal": {"displacement": SINE}, "along": {"displacement": SINE | {"frequency": 50.0}}}
    run = ts.simulate(moving("millipede", plate), "40 ms")
    motion = motion_of(run)
    drawing = drawing_of(motion)
    assert motion.moved is not None
    np.testing.assert_allclose(motion.moved[1], 1e-6 * np.sin(200.0 * np.pi * motion.time), atol=1e-12)
    still = replace(motion, moved=None)
    lifted, level = drawing.seen(motion), drawing.seen(still)
    risen = np.broadcast_to(drawing.up * motion.moved[1], lifted[1].shape)
    np.testing.assert_allclose(lifted[1] - level[1], risen, atol=1e-12)
    assert payload(motion, drawing)["moved"]["bits"] == 16 and "seen from the laboratory" in walk_plate(motion).caption
    assert payload(still, drawing)["moved"] is None
    movie(run, tmp_path / "walk.gif", periods=1)
    assert (tmp_path / "walk.gif").stat().st_size > 1000
