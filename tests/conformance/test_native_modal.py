"""The native engine against the compiled loop it came from: the same events at the same times, scene by scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import numba_engine
import tarsus as ts
from scene_files import SCENES, scene
from tarsus.core.arrays import E_APEX, E_FOOT, E_INTEGRAL, E_KIND, E_TIME, PERIOD_MARK
from tarsus.files.toml import parse_scene
from tarsus.measure import scene_period
from tarsus.plan import lower_scene
from tarsus.solve.engine import Accuracy, SharedBook, execute
from tarsus.study import bench

BENCH = Path(str(bench._data()))
OWN = ts.load_laws(SCENES / "squeeze.py")
LOOSE = Accuracy(gap=1e-8)


def device(name: str, duration: float, values: dict | None = None, **options) -> ts.Scene:
    made = ts.load_scene(name, **options).model_copy(update={"duration": duration})
    return ts.with_values(made, values) if values else made


def file(name: str, duration: float | None = None, values: dict | None = None) -> ts.Scene:
    made = scene(name, values)
    return made.model_copy(update={"duration": duration}) if duration else made


def own(name: str, duration: float, **laws) -> ts.Scene:
    """A scene with laws of the user in place of the built-in film, electrostatics, rebound and latch."""
    made = file(name, duration)
    ground = made.ground.model_copy(update={"laws": laws})
    return made.model_copy(update={"ground": ground})


def bed_of_feet(count: int, duration: float = 0.02) -> ts.Scene:
    """A rigid plate that rocks on many feet under its weight: contacts by the dozen, some at the same moment."""
    places = np.linspace(-1.0, 1.0, count)
    feet = "".join(f"[robot.feet.f{i}]\npoint = 'f{i}'\ngap = '{4 + 3 * abs(x):.3f} um'\n" for i, x in enumerate(places))
    shapes = ", ".join(f"f{i} = [1.0, {x:.4f}]" for i, x in enumerate(places))
    return parse_scene(
        f"""
name = "a plate on {count} feet"
duration = "{duration * 1e3} ms"
[robot.structure]
kind = "modal"
frequencies = ["0 Hz", "310 Hz"]
damping_ratios = [0.0, 0.03]
modal_masses = ["4 mg", "2 mg"]
modal_damping = ["0.2 mN s/m", "0 N s/m"]
upward = [1.0, 0.0]
shapes = {{ {shapes} }}
[robot.drives.pzt]
load = {{ kind = "modal", participation = [0.0, 1.0] }}
law = {{ kind = "linear", gain = "40 uN/V" }}
{feet}
[ground]
restitution = {{ coefficient = 0.3 }}
film = {{ coefficient = 1e-21, thickness = "3 um" }}
gravity = {{ acceleration = "9.81 m/s^2" }}
[signals.pzt]
kind = "sine"
amplitude = "5 V"
frequency = "170 Hz"
""",
        folder=SCENES,
    )


SCENES_OF: dict[str, Callable[[], ts.Scene]] = {
    "P1 of 2": lambda: bench.chain(2).model_copy(update={"duration": 0.3}),
    "P1 of 6": lambda: bench.chain(6).model_copy(update={"duration": bench.horizon(6)}),
    "P1 of 32": lambda: bench.chain(32).model_copy(update={"duration": 0.06}),
    "ball": lambda: file("ball"),
    "damped chain": lambda: file("damped_chain"),
    "film only": lambda: file("film_only"),
    "impact oscillator": lambda: file("impact_oscillator"),
    "switch": lambda: file("mems_switch"),
    "sticky feet": lambda: file("sticky_feet"),
    "three feet": lambda: file("three_feet"),
    "vibrating table": lambda: file("vibrating_table"),
    "cantilever": lambda: device("cantilever", 0.1),
    "cantilever, sine": lambda: device("cantilever", 0.1, wave="sine"),
    "cantilever-1": lambda: device("cantilever-1", 0.06),
    "capture": lambda: device("cantilever-capture", 0.06),
    "hexapod": lambda: device("hexapod", 0.15),
    "hexapod of the table": lambda: device("hexapod-table", 0.15),
    "quadruped": lambda: device("quadruped", 0.1),
    "hexapod bench": lambda: ts.load_scene(BENCH / "hexapod.toml").model_copy(update={"duration": 0.3}),
    "hysteresis bench": lambda: ts.load_scene(BENCH / "hysteresis.toml", volts=8.0, hz=50.0, wave="sine").model_copy(
        update={"duration": 0.1}
    ),
    "restitution first": lambda: device("cantilever", 0.05, {"ground.landing": ts.RestituteFirst(speed=2e-3)}),
    "pull as printed": lambda: device("cantilever", 0.05, {"ground.landing": ts.PullAsPrinted()}),
    "as printed, three feet": lambda: file("three_feet", 0.03, {"ground.landing": ts.PullAsPrinted()}),
    "no film": lambda: device("cantilever", 0.05, {"ground.film": None}),
    "overdamped in film": lambda: file("damped_chain", 0.05, {"ground.film": ts.Film(coefficient=1e-20, thickness=5e-6)}),
    "own film": lambda: own("p1_n2", 0.05, own_film=OWN["own_film"](coefficient=1.7e-21, thickness=5e-6)),
    "own attraction": lambda: own("p1_n2", 0.05, pull=OWN["own_electrostatic"](coefficient=2e-20, offset=1e-6)),
    "own latch and rebound": lambda: own(
        "sticky_feet", 0.03, latch=OWN["own_latch"](initial=1e-5, rate=1e-3), rebound=OWN["own_rebound"](coefficient=0.4)
    ),
    "own drag": lambda: own("sticky_feet", 0.02, drag=OWN["drag"](coefficient=1e-4, height=1e-6)),
    "eight feet": lambda: bed_of_feet(8),
}


def both(made: ts.Scene, accuracy: Accuracy, track: bool, record: bool):
    plan, period = lower_scene(made), scene_period(made, made.duration)
    options = {"accuracy": accuracy, "period": period, "track": track, "record": record}
    known = numba_engine.execute(plan, made.duration, **options)
    return known, execute(plan, made.duration, **options)


def without_last_marks(events: np.ndarray) -> np.ndarray:
    """Without the marks at the very end that follow others: the compiled loop marked the end of a period twice."""
    last = (events[:, E_KIND] == PERIOD_MARK) & (events[:, E_TIME] == events[-1, E_TIME]) if len(events) else []
    return events[~np.asarray(last, dtype=bool)]


@pytest.mark.parametrize("name", SCENES_OF)
def test_events_are_those_of_the_compiled_loop(name):
    made = SCENES_OF[name]()
    known, found = both(made, LOOSE, track=True, record=True)
    assert found.codes[0] == known.codes[0]
    a, b = without_last_marks(known.events), without_last_marks(found.events)
    assert len(a) == len(b) and (len(a) > 0 or name == "film only")
    np.testing.assert_array_equal(a[:, [E_FOOT, E_KIND]], b[:, [E_FOOT, E_KIND]])
    scale = np.abs(a).max(axis=0, initial=0.0)
    np.testing.assert_allclose(b[:, E_TIME], a[:, E_TIME], rtol=0, atol=1e-12 * made.duration)
    np.testing.assert_allclose(b[:, E_KIND + 1 : E_APEX] / (scale[E_KIND + 1 : E_APEX] + 1e-300),
                               a[:, E_KIND + 1 : E_APEX] / (scale[E_KIND + 1 : E_APEX] + 1e-300), rtol=0, atol=1e-7)  # fmt: skip
    # the rise of a flight within one step: the compiled loop saw it where rounding left its first node above the ground
    peak = scale[E_APEX]
    assert np.all(b[:, E_APEX] >= a[:, E_APEX] - 1e-7 * peak)
    seen = a[:, E_APEX] > 1e-3 * peak
    np.testing.assert_allclose(b[seen, E_APEX], a[seen, E_APEX], rtol=1e-6)
    np.testing.assert_allclose(b[:, E_INTEGRAL], a[:, E_INTEGRAL], rtol=0, atol=1e-9 * scale[E_INTEGRAL])
    # rounding decides about steps whose only error is that of a sampled drive
    np.testing.assert_allclose(found.finish[0, 1], known.finish[0, 1], rtol=0.05)
    assert math.isclose(found.finish[0, 0], known.finish[0, 0], rel_tol=1e-14)


@pytest.mark.parametrize("n", [2, 6])
def test_reference_problems_step_for_step(n):
    """P1: the same steps and the same rejected ones, every impact within rounding, none wrong."""
    chained = bench.Chain(n)
    book = numba_engine.OracleBook(chained.plan, chained.duration)
    known = numba_engine.execute(chained.plan, chained.duration, book=book, accuracy=chained.accuracy, track=False)
    found = execute(chained.plan, chained.duration, book=chained.book, accuracy=chained.accuracy, track=False)
    np.testing.assert_array_equal(found.finish[0, 1:], known.finish[0, 1:])
    np.testing.assert_allclose(found.events[:, 0], known.events[:, 0], rtol=1e-14)
    times = found.events[np.isin(found.events[:, 2], (1, 2, 4)), 0]
    assert bench.wrong_impacts(times, bench.reference_impacts(n)) == 0


def test_a_foot_held_under_a_smooth_drive_lets_go_in_time():
    """A drive without kinks changes all the same: no held foot is pulled harder than its contact holds."""
    run = ts.simulate(file("damped_chain"))
    held = run.series.state.held[0]
    assert held.sum() > 100
    excess = (run.series.state.pull[0] - run.series.strength[0])[held]
    assert excess.max() < 1e-3 * run.series.strength[0][held].max()


def test_more_feet_than_a_word_has_bits():
    """A plate on 70 feet comes to rest on the feet at its edges; every contact mode has a name."""
    made = bed_of_feet(70, duration=0.012)
    plan = lower_scene(made)
    raw = execute(plan, made.duration, accuracy=LOOSE)
    assert raw.codes[0] == 0
    touched = set(raw.events[np.isin(raw.events[:, E_KIND], (1, 2, 4)), E_FOOT].astype(int))
    assert touched and max(mode.mask for mode in raw.book.book.modes) >= 0
    assert all(0 <= foot < 70 for foot in touched)


def test_a_batch_is_its_runs_one_by_one():
    plan = lower_scene(bench.chain(2))
    book = SharedBook(plan, 0.1)
    parameters = np.repeat(plan.laws.parameters[None], 5, axis=0)
    parameters[:, :, plan.laws.columns["restitution"]] = np.linspace(0.2, 0.6, 5)[:, None]
    raw = execute(plan, 0.1, parameters=parameters, book=book)
    for i in range(5):
        alone = execute(plan, 0.1, parameters=parameters[i : i + 1], book=book)
        np.testing.assert_array_equal(raw.of(i), alone.events)
