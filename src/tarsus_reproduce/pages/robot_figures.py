"""Figures of a robot's reproduction: motion of points, mode shapes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tarsus.report import figures
from tarsus.report.figures import TURNS
from tarsus.report.pages import PageFigure
from tarsus.report.panel_grid import PanelGrid, page_figure
from tarsus.report.series import last_turns
from tarsus.report.style import BLUE, INK, RULE
from tarsus.tables import Table
from tarsus_reproduce.robot_runs import RobotRun

SAMPLES = 720
"""Samples across a figure of motion: twice as many as a panel has pixels."""

SHOWN_PERIODS = 4
"""Drive periods in a figure of motion."""


def motion(one: RobotRun) -> PageFigure:
    """The last drive periods of a run, as on the page of a run (Figs 3.9, 3.10, 3.19 and 3.21 of the source)."""
    series = last_turns(one.run, SHOWN_PERIODS, SAMPLES // SHOWN_PERIODS)
    return _titled(one, figures.motion(series, series.last_periods(SHOWN_PERIODS)))


def by_period(one: RobotRun) -> PageFigure:
    """Its drive periods over each other (Figs 3.20 and 3.22 of the source, where a period is a circle)."""
    found = figures.turns(last_turns(one.run, TURNS, SAMPLES))
    assert found is not None  # the drive of a robot repeats
    return _titled(one, found)


def _titled(one: RobotRun, found: PageFigure) -> PageFigure:
    return PageFigure(found.picture, f"{one.title}. {found.caption}")


def mode_shapes(modes: Table, points: Sequence[str]) -> PageFigure:
    """Every mode at the points over the printed CoR column (as Figs 3.13d and 3.14 of the source), from their table,
    whose last row is that column."""
    *rows, last = modes.rows
    column, places = np.array(last[3:]), np.arange(len(points))
    printed = column / np.abs(column).max()
    look = {"lw": 0.9, "marker": "o", "ms": 4.0, "mfc": "white"}

    def draw(page: PanelGrid) -> None:
        panels = page.grid(len(rows), 1.05)
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
        page.legend(panels[0])

    return page_figure(
        draw,
        "Mode shapes at the points, each to its largest entry, with the sign nearer to the column. Below them: the "
        "change of velocity that the printed CoR matrix gives the points. MAC is the likeness of each mode and the "
        "column (modal assurance criterion, 1 = the same shape).",
    )
