"""Ground under feet: shapes, lines of their own, surfaces, and ground that moves."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import tarsus as ts
from scene_files import scene
from tarsus.base.events import EventKind
from tarsus.base.quantities import Quantity
from tarsus.base.spec import validate, with_values
from tarsus.files.library import load_scene
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.ground import Ground
from tarsus.model.motion import GroundMotion, GroundShift
from tarsus.model.profile import Relief, gaps_above, heights_of, line_between
from tarsus.model.profile.random_ground import _coherence, _shares
from tarsus.model.scene import Scene
from tarsus.orbits.starts import Box
from tarsus.plan.lowering import lower_scene, slot
from tarsus.report.drawing import drawing_of
from tarsus.report.motion import motion_of
from tarsus.report.player import payload, walk_figure
from tarsus.solve.outputs import Output
from tarsus.solve.session import Session
from tarsus.study.sweeping import run_sweep
from walking_scenes import sticky, trotter

STAIRS = {"kind": "staircase", "tread": 1e-3, "rise": 1e-5}
ROUGH = {"kind": "random", "seed": 3, "rms": 1e-6, "correlation_length": 3e-4, "hurst": 0.8, "spacing": 4e-5}


def shape(**profile: Any) -> Relief:
    found = validate(Ground, {"profile": profile}).profile
    assert found is not None
    return found


def test_points_of_shapes(tmp_path: Path) -> None:
    assert shape(kind="staircase", tread="1 mm", rise="1 um", steps=2).points().tolist() == [
        [0.0, 0.0],
        [0.0, 1e-6],
        [1e-3, 1e-6],
        [1e-3, 2e-6],
    ]
    stairs = shape(**STAIRS)
    at = np.array([-0.5e-3, 0.0, 0.5e-3, 1e-3, 2.5e-3])
    assert heights_of(stairs.points(), stairs.repeats, at) == pytest.approx([0.0, 0.0, 1e-5, 1e-5, 3e-5])
    pits = shape(kind="pits", spacing=1.0, width=0.25, depth=0.5)
    assert heights_of(pits.points(), True, np.array([0.1, 0.5, 3.2, -0.1])).tolist() == [-0.5, 0.0, -0.5, 0.0]
    teeth = shape(kind="sawtooth", length=1.0, height=0.5, rising=1.0)
    line = line_between(teeth.points(), True, 0.5, 1.5)
    assert line == pytest.approx(np.array([[0.5, 0.25], [1.0, 0.5], [1.0, 0.0], [1.5, 0.25]]))
    (tmp_path / "line.csv").write_text("# mm\n0, 1\n1, 2\n3, 2\n")
    assert shape(kind="file", file=str(tmp_path / "line.csv"), unit="1 mm").points()[1].tolist() == [1e-3, 2e-3]
    (tmp_path / "map.txt").write_text("0 1 2\n3 4 5\n")
    row = shape(kind="file", file=str(tmp_path / "map.txt"), spacing=0.5, row=1).points()
    assert row.tolist() == [[0.0, 3.0], [0.5, 4.0], [1.0, 5.0]]


@pytest.mark.parametrize("periodic", [False, True])
def test_gaps_above_facets(periodic: bool) -> None:
    """Height above the ground times the cosine of its slope; on the level beyond its ends, where it has such."""
    points = np.array([[0.0, 0.0], [1.0, 0.5], [1.0, 0.0], [3.0, 1.0]])
    x = np.array([-1.7, 0.3, 1.9, 3.4])
    below = np.array([np.nan, np.nan, 2.0, 3.0])
    cos = np.array([1.0, *(2.0 / math.sqrt(5.0),) * 2, 1.0])
    if periodic:
        below, cos = np.array([np.nan, 0.0, np.nan, 3.0]), np.full(4, 2.0 / math.sqrt(5.0))
    high = (2.0 - heights_of(points, periodic, x)) * cos
    assert gaps_above(points, below, x, np.full(4, 2.0), periodic) == pytest.approx(high)


def test_random_ground_has_its_height_and_its_spectrum() -> None:
    numbers: dict[str, Any] = {"rms": 1e-6, "correlation_length": 2e-3, "hurst": 0.7, "spacing": 1e-5, "facets": 4096}
    one, other = (shape(kind="random", seed=seed, **numbers).points() for seed in (1, 2))
    assert np.sqrt(np.mean(one[:-1, 1] ** 2)) == pytest.approx(1e-6, rel=1e-12)
    assert one[-1, 1] == one[0, 1] and not np.allclose(one, other)
    power = np.abs(np.fft.rfft(one[:-1, 1])[1:-1]) ** 2
    slope = np.polyfit(np.log(np.arange(100, 2000)), np.log(power[99:1999]), 1)[0]
    assert slope == pytest.approx(-2.0 * 0.7 - 1.0, abs=0.01)


def test_random_ground_may_grow_along_the_way() -> None:
    numbers = {"kind": "random", "seed": 1, "rms": 2e-6, "correlation_length": 6e-5, "spacing": 1e-5, "facets": 64}
    level, growing = shape(**numbers), shape(**numbers, growth=1e3)
    x, heights = level.points().T
    assert np.allclose(growing.points()[:, 1], heights * (1.0 + 1e3 * x), rtol=1e-14)
    assert level.repeats and not growing.repeats


def test_random_grounds_are_drawn(tmp_path: Path) -> None:
    """A seed is data as the heights are: each run of a batch or of a sweep walks on its own ground."""
    rough = {"kind": "random", "seed": 0, "rms": 1e-8, "correlation_length": 1e-4, "spacing": 2e-5, "facets": 64}
    scene = with_values(
        trotter(2, ground=sticky(), turning=False), {"ground.profile": rough, "initial": {"standing": {}}}
    )
    batch = ts.simulate_batch(scene, {"ground.profile.seed": [1, 2]}, "5 ms")
    first, second = (batch.run(i) for i in range(2))
    assert not np.array_equal(first.events, second.events)
    assert slot(scene, "ground.profile.facets") is None
    vary = {"ground.profile.seed": [1.0, 2.0], "ground.profile.rms": [0.0, 1e-8]}
    numbers = {"name": "grounds", "scene": scene, "from_rest": "5 ms", "vary": vary, "measures": ["mean_speed"]}
    done = run_sweep(validate(ts.Sweep, numbers), tmp_path / "out")
    assert done.failed == 0
    found = xarray.load_dataset(done.file)["mean_speed"].values
    assert found[0, 0] == found[1, 0] != found[0, 1] != found[1, 1]


def test_robots_are_put_down_onto_the_ground_that_each_has() -> None:
    box = Box.of(with_values(load_scene("millipede", hz=50, volts=14), {"ground.profile": ROUGH}), None)
    seeds, starts = np.arange(0.0, 120.0, 10.0), box.values(box.drawn(12, 0))
    batch = Session(box.scene).batch(starts | {"ground.profile.seed": seeds}, 0.01)
    assert np.all(batch.done)
    begun = [with_values(box.scene, {path: own[k] for path, own in starts.items()}) for k in range(12)]
    lifts = [
        lower_scene(with_values(one, {"ground.profile.seed": seed})).initial[3] - one.initial.displacement[3]  # pyright: ignore[reportOptionalSubscript]
        for one, seed in zip(begun, seeds, strict=True)
    ]
    assert min(lifts) == 0.0 and 1e-8 < max(lifts) < 4e-6  # none by more than from the lowest to the highest place


@pytest.mark.parametrize("slope", [-0.01, 0.01])
def test_a_film_above_a_corner_does_not_hold_a_foot_there(slope: float) -> None:
    """It comes down at the very corner: the films of a valley drive it back from both sides, those of a ridge away."""
    corner = {"kind": "polyline", "given": [[-1e-4, -slope * 1e-4], [0.0, 0.0], [1e-4, -slope * 1e-4]]}
    scene = with_values(load_scene("millipede", hz=50, volts=14), {"ground.profile": corner})
    speed, lifted = np.zeros(6), np.zeros(6)
    speed[[1, 3, 5]], lifted[[1, 3, 5]] = -5e-3, 1e-7
    thrown = {"initial": {"displacement": lifted.tolist(), "velocity": speed.tolist(), "lifted": True}}
    run = ts.simulate(with_values(scene, thrown), 0.01)
    assert run.ok and np.any(run.events["kind"] == EventKind.BOUNCE) and run.ledger.closure < 1e-8


TEETH = {"kind": "sawtooth", "length": 9e-5, "height": 2e-7, "rising": 0.4, "start": 1.3e-5}
PATCHY = {"kind": "random", "seed": 3, "rms": 2e-7, "correlation_length": 3e-5, "spacing": 1.3e-5, "facets": 256}
STEP = {"kind": "staircase", "tread": 1e-3, "rise": 1e-7, "start": 1e-5}


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


def test_higher_ground_is_a_smaller_gap() -> None:
    """Right feet on ground that is higher by h, and the same robot with gaps smaller by h on level ground."""
    scene, height = trotter(4, ground=sticky(film=ts.Film(coefficient=1e-26, thickness=1e-7))), 2e-7
    lower = {f"robot.feet.{name}.gap": 1e-6 - height for name, y in scene.across.items() if y < 0.0}
    raised = walks_alike(on(scene, level(0.0), level(height)), with_values(scene, lower), 0.004, 1e-11)
    assert raised.ledger.closure < 1e-8


def test_batches_windows_and_sessions_have_each_foot_on_its_ground() -> None:
    scene = on(trotter(2, ground=sticky(film=ts.Film(coefficient=1e-26, thickness=1e-7))), TEETH, PATCHY)
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
    numbers = {**PATCHY, "facets": 4096, "correlation_length": 1e-3, "hurst": 0.5}
    feet = {"a": 5e-4, "b": -2e-4, "c": 0.0, "d": 5e-4}
    lines, which = shape(**numbers, across=True).lines(feet)
    assert which == [2, 0, 1, 2]
    (single,), _ = shape(**numbers).lines(feet)
    assert np.array_equal(lines[1].points, single.points)
    shares = _shares((-2e-4, 0.0, 5e-4), 1e-3, 0.5, 1.3e-5, 64)
    rate = np.hypot(2.0 * math.pi * np.arange(1, 33) / (64 * 1.3e-5), 1e3)
    for i, k, apart in ((0, 1, 2e-4), (0, 2, 7e-4), (1, 2, 5e-4), (2, 2, 0.0)):
        assert np.sum(shares[i] * shares[k], axis=0) == pytest.approx(_coherence(apart * rate, 1.0), abs=1e-9)


def test_maps_are_read_at_each_foot(tmp_path: Path) -> None:
    (tmp_path / "map.txt").write_text("0 0 0\n2 4 2\n4 8 6\n")
    ground = shape(kind="file", file=str(tmp_path / "map.txt"), spacing=1e-3, unit=1e-9, row=1, across=True)
    lines, which = ground.lines({"right": -1e-3, "left": 5e-4})
    assert [lines[k].points[:, 1].tolist() for k in which] == [[0.0, 0.0, 0.0], pytest.approx([3e-9, 6e-9, 4e-9])]
    assert "row 2.5 of a map of rows 0 to 2" in ground.faults({"far": 1.5e-3})[0][1]


SINE = {"kind": "sine", "amplitude": 1e-6, "frequency": 100.0}


def moving(name: str, motion: dict[str, Any], **values: Any) -> ts.Scene:
    made = ts.load_scene(name) if name in ("millipede", "hexapod") else scene(name)
    return ts.with_values(made, {"ground.motion": motion, **values})


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


def test_players_draw_it() -> None:
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
    assert payload(motion, drawing)["moved"]["bits"] == 16 and "seen from the laboratory" in walk_figure(motion).caption
    assert payload(still, drawing)["moved"] is None
