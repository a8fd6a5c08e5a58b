"""Figures of a robot's reproduction: motion of points, mode shapes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np

from tarsus.report import figures
from tarsus.report.figures import TURNS
from tarsus.report.pages import Plate
from tarsus.report.series import last_turns
from tarsus.report.sheet import Sheet, few_ticks, line, name_axes, plate
from tarsus.report.style import BLUE, CYCLE, INK, MUTED, RULE
from tarsus.tables import Table
from tarsus_reproduce.robot_runs import AIR_PERIODS, AirRun, Near

SAMPLES = 720
"""Samples of a drive period in figures of motion: twice as many as a panel has pixels for it."""

SHOWN_PERIODS = 4
"""Drive periods in a figure of motion."""


def ground_motion(near: Near) -> Plate:
    """The last drive periods of a run over the ground, as on the page of a run (Figs 3.19 and 3.21 of the source)."""
    series = last_turns(near.run, TURNS, SAMPLES)
    return _titled(near, figures.motion(series, series.last_periods(SHOWN_PERIODS)))


def ground_periods(near: Near) -> Plate:
    """Its drive periods over each other (Figs 3.20 and 3.22 of the source, where a period is a circle)."""
    found = figures.turns(last_turns(near.run, TURNS, SAMPLES))
    assert found is not None  # the drive of a robot repeats
    return _titled(near, found)


def _titled(near: Near, found: Plate) -> Plate:
    return Plate(found.picture, f"{near.title}. {found.caption}")


def air_motion(runs: Sequence[AirRun]) -> Plate:
    """Steady motion in the air (as Figs 3.9 and 3.10 of the source): all drives or points over each other."""
    several = len(runs) > 1

    def draw(sheet: Sheet) -> None:
        ((top, low),) = sheet.stacks(1, [0.45, 1.5])
        colors = cycle(CYCLE)
        for air in runs:
            turns, volts, motion = air.steady
            line(top, turns, volts, color=MUTED, lw=0.9)
            for point, shift in zip(air.points, motion, strict=True):
                line(low, turns, shift, color=next(colors), lw=0.9, label=f"{air.volt_v:g} V" if several else point)
        few_ticks(top, y=2)
        name_axes(top, None, ("drive", "V"))
        low.set_xlim(0.0, AIR_PERIODS)
        name_axes(low, ("time (drive periods)", ""), ("displacement", "m"))
        sheet.legend(low)

    what = "the actuated foot" if several else "the points"
    return plate(
        draw, f"Displacement of {what} in the air under a square wave of {runs[0].freq_hz:.4g} Hz, steady periods."
    )


def mode_shapes(modes: Table, points: Sequence[str]) -> Plate:
    """Every mode at the points over the printed CoR column (as Figs 3.13d and 3.14 of the source), from their table,
    whose last row is that column."""
    *rows, last = modes.rows
    column, places = np.array(last[3:]), np.arange(len(points))
    printed = column / np.abs(column).max()
    look = {"lw": 0.9, "marker": "o", "ms": 4.0, "mfc": "white"}

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(rows), 1.05)
        for axes, (mode, hertz, alike, *own) in zip(panels, rows, strict=True):
            shape = np.array(own)
            shape = shape * np.sign(shape @ column) / np.abs(shape).max()
            axes.axhline(0.0, color=RULE, lw=0.7, zorder=0)
            axes.plot(places, printed, color=INK, label="printed CoR column", **look)
            axes.plot(places, shape, color=BLUE, lw=1.2, marker="D", ms=3.4, mew=0.0, label="mode")
            axes.set_title(f"mode {mode}, {hertz:.4g} Hz, MAC {alike:.3f}", color=INK)
            axes.set_ylim(-1.15, 1.15)
            axes.set_yticks([-1.0, 0.0, 1.0])
            axes.set_xticks(places, points)
        sheet.legend(panels[0])

    return plate(
        draw,
        "Mode shapes at the points, each to its largest entry, with the sign nearer to the column. Below them: the "
        "change of velocity that the printed CoR matrix gives the points. MAC is the likeness of each mode and the "
        "column (modal assurance criterion, 1 = the same shape).",
    )
