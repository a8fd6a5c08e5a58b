"""Derivatives of measures by the numbers of the events against differences of the measures' one definition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from random_scenes import plain_scene
from scene_files import scene as scene_of
from scene_files import with_gradients
from tarsus.base.spec import get_value
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.whole import WHOLE_RUN
from tarsus.solve import directional
from tarsus.solve.directional import difference, measure_slopes, row_slopes, step_along


def compared(scene: ts.Scene, duration: float | None, monkeypatch) -> int:
    """How many derivatives of measures, with the products and by differences alone, agree; all do."""
    run, paths = with_gradients(scene, duration)
    log, count = run._log, 0
    for name in (*PER_WINDOW, *WHOLE_RUN):
        known = row_slopes(log, run.foot_names, name)
        if known is None or not (
            known[0].any() or known[1]
        ):  # of counts differences leave rounding over a step
            continue
        got, kinked = measure_slopes(log, run.foot_names, name)
        with monkeypatch.context() as patch:
            patch.setattr(directional, "row_slopes", lambda *_, **__: None)
            wanted, doubtful = measure_slopes(log, run.foot_names, name)
        both = ~kinked & ~doubtful & np.isfinite(wanted) & (got != 0.0)
        value = abs(run.measures[name].value)
        numbers = np.array([abs(float(get_value(scene, path))) or 1.0 for path in paths])
        steps = np.array([step_along(log, p) for p in range(len(paths))])
        size = 1e-6 * np.abs(wanted) + 1e-9 * value / numbers + 1e-13 * value / steps
        assert (np.abs(got - wanted)[both] <= size[both]).all(), name
        assert kinked[doubtful].all() or not doubtful.any(), name
        count += int(both.sum())
    return count


@pytest.mark.parametrize(
    ("name", "duration"),
    [("sticky_feet", 0.05), ("three_feet", 0.03), ("p1_n2", 0.09), ("damped_chain", 0.02)],
)
def test_products_are_the_differences(name, duration, monkeypatch):
    assert compared(scene_of(name), duration, monkeypatch) > 30


@pytest.mark.parametrize("seed", [2, 6, 18, 26])
def test_products_are_the_differences_of_random_scenes(seed, monkeypatch):
    assert compared(plain_scene(seed, legged=False), None, monkeypatch) > 10


def test_a_measure_of_early_events_does_not_feel_sensitive_late_ones():
    """The highest point is the start, a gap above the ground, however fast the last events of the run part."""
    scene = plain_scene(2, legged=False)
    run = ts.simulate(scene, gradients=["robot.feet.f0.gap", "robot.feet.f1.gap"])
    assert run.gradient("peak")["robot.feet.f0.gap"] == pytest.approx(1.0, rel=1e-9)


def run_of(count: int = 4) -> ts.solve.GradientRun:
    return ts.simulate(scene_of("p1_n2"), 0.02 * count + 0.005, gradients=["signals.pull.frequency"])


def test_the_period_moves_what_is_reported_per_time():
    """Events as they are: bounces per second fall with the period as its inverse."""
    run = run_of()
    rate = run.measures["bounces_per_second"].value
    assert rate > 0.0
    rows, period = row_slopes(run._log, run.foot_names, "bounces_per_second")
    assert not rows.any() and period == pytest.approx(-rate / run.period, rel=1e-12)


def moved(run: ts.solve.GradientRun, change) -> directional.EventDerivatives:
    rows = run._log.rows.copy()
    change(rows)
    return replace(run._log, rows=rows)


def test_near_a_kink_there_is_no_product():
    run = run_of()
    hits = np.flatnonzero(run._log.rows[:, 3] > 0.0)
    last = hits[run._log.rows[hits, 0] > run.period * 2.0]

    def on_the_edge(rows):
        next_one = hits[run._log.rows[hits, 0] > run.period * 3.0][0]
        rows[next_one, 0] = 3.0 * run.period * (1.0 + 1e-11)

    def tied(rows):
        inside = last[(run._log.rows[last, 0] < 3.0 * run.period)]
        rows[inside[:2], 3] = 2.0 * rows[:, 3].max() * np.array([1.0, 1.0 + 1e-11])

    def at_the_height(rows):
        rows[last[1], 9] = 1e-7 * (1.0 + 1e-12)

    feet = run.foot_names
    for name in ("impact_speed", "hardest_impact", "contact_duration"):
        assert row_slopes(run._log, feet, name) is not None
    assert row_slopes(moved(run, on_the_edge), feet, "impact_speed") is None
    assert row_slopes(moved(run, tied), feet, "hardest_impact") is None
    assert row_slopes(moved(run, tied), feet, "impact_speed") is not None
    assert row_slopes(moved(run, at_the_height), feet, "contact_duration") is None


def test_numbers_that_do_not_change_have_no_slope() -> None:
    """Weights times five equal counts left 1e-17, over a step of 1e-3 a slope of -3e-14."""
    counts = np.array([3.0, 7.0, 11.0, 0.1, 1e9])
    slopes, kinked = difference(np.repeat(counts[:, None], 5, axis=1))
    assert not slopes.any() and not kinked.any()
    assert difference(np.arange(5.0) / 3.0)[0] == pytest.approx(1.0 / 3.0, rel=1e-15)
