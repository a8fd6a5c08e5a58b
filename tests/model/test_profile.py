"""Shapes of uneven ground: their points, what is refused, slots, and who does not know them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.base.spec import validate, with_values
from tarsus.files.library import load_scene
from tarsus.model.ground import Ground
from tarsus.model.profile import Profile, gaps_above, heights_of, line_between
from tarsus.model.scene import Scene
from tarsus.orbits.starts import Box
from tarsus.plan.lowering import lower_scene, slot
from tarsus.solve.session import Session
from tarsus.study.sweeping import run_sweep
from walking_scenes import sticky, trotter

STAIRS = {"kind": "staircase", "tread": 1e-3, "rise": 1e-5}
LOW = STAIRS | {"rise": 1e-7}
ROUGH = {"kind": "random", "seed": 3, "rms": 1e-6, "correlation_length": 3e-4, "hurst": 0.8, "spacing": 4e-5}


def shape(**profile: Any) -> Profile:
    found = validate(Ground, {"profile": profile}).profile
    assert found is not None
    return found


def uneven(**profile: Any) -> Scene:
    scene = with_values(trotter(2, ground=sticky(), turning=False), {"ground.profile": profile or LOW})
    return with_values(scene, {"initial": {"standing": {}}})


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
    scene = uneven(**rough)
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
