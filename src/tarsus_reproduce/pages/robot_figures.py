"""Figures of a robot's reproduction: motion of points, mode shapes, energies of impact maps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from tarsus.report import figures
from tarsus.report.figures import TURNS
from tarsus.report.pages import Plate
from tarsus.report.series import PlotTrace, last_turns
from tarsus.report.sheet import Sheet, few_ticks, line, name_axes, plate
from tarsus.report.style import BLUE, CYCLE, INK, MUTED, RULE, VERMILION, samples_inside
from tarsus.tables import amount
from tarsus_reproduce.impacts import ImpactEnergies, ModeRow
from tarsus_reproduce.robot_runs import Near, RobotRuns

SAMPLES = 720
"""Samples of a drive period in figures of motion: twice as many as a panel has pixels for it."""

SHOWN_PERIODS = 4
"""Drive periods in a figure of motion."""

DECADES = 5
"""Orders of magnitude of energy drawn on either side of zero."""


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


def air_motion(runs: RobotRuns) -> Plate:
    """Steady motion in the air (as Figs 3.9 and 3.10 of the source): all drives or points over each other."""
    several = len(runs.air) > 1
    traces = [
        PlotTrace(f"{air.volt_v:g} V" if several else point, air.time, shift, air.volts, 1.0 / air.freq_hz)
        for air in runs.air
        if not air.problem
        for point, shift in zip(air.points, air.displacement, strict=True)
    ]

    def draw(sheet: Sheet) -> None:
        ((top, low),) = sheet.stacks(1, [0.45, 1.5])
        _drive(top, traces if several else traces[:1])
        few_ticks(top, y=2)
        name_axes(top, None, ("drive", "V"))
        for trace, color in zip(traces, cycle(CYCLE)):
            _motion(low, trace, color)
        name_axes(low, (PERIODS, ""), ("displacement", "m"))
        sheet.legend(low)

    what = "the actuated foot" if several else "the points"
    return plate(
        draw, f"Displacement of {what} in the air under a square wave of {runs.air[0].freq_hz:.4g} Hz, steady periods."
    )


PERIODS = "time (drive periods)"


def _span(trace: PlotTrace) -> tuple[int, int]:
    return trace.last_periods(SHOWN_PERIODS)


def _turns(trace: PlotTrace) -> np.ndarray:
    """Times in drive periods from the first one that is shown."""
    return trace.time / trace.period - _span(trace)[0]


def _drive(axes: Axes, traces: Sequence[PlotTrace]) -> None:
    for trace in traces:
        line(axes, _turns(trace), trace.volts, color=MUTED, lw=0.9)


def _motion(axes: Axes, trace: PlotTrace, color: str) -> None:
    turns, (first, last) = _turns(trace), _span(trace)
    seen = samples_inside(turns, (0.0, last - first))
    line(axes, turns[seen], trace.height[seen], color=color, lw=0.9, label=trace.title)
    axes.set_xlim(0.0, max(1.0, last - first))


def mode_shapes(modes: Sequence[ModeRow], column: np.ndarray, points: Sequence[str]) -> Plate:
    """Every mode at the points over the printed CoR column (as Figs 3.13d and 3.14 of the source)."""
    places = np.arange(len(points))
    printed = column / np.abs(column).max()
    look = {"lw": 0.9, "marker": "o", "ms": 4.0, "mfc": "white"}

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(modes), 1.05)
        for axes, mode in zip(panels, modes, strict=True):
            shape = np.array(mode.shape)
            shape = shape * np.sign(shape @ column) / np.abs(shape).max()
            axes.axhline(0.0, color=RULE, lw=0.7, zorder=0)
            axes.plot(places, printed, color=INK, label="printed CoR column", **look)
            axes.plot(places, shape, color=BLUE, lw=1.2, marker="D", ms=3.4, mew=0.0, label="mode")
            axes.set_title(f"mode {mode.number}, {mode.freq_hz:.4g} Hz, MAC {mode.mac:.3f}", color=INK)
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


def impact_histograms(energies: ImpactEnergies, run: str) -> Plate:
    """How much energy each map takes or makes, as the number of impacts, with each sum."""
    rows: Mapping[str, np.ndarray] = {"as run": energies.actual} | {
        f"{name}, as it is": made for name, made in energies.by_map.items()
    }
    largest = max(float(np.abs(values).max()) for values in rows.values())
    top = math.ceil(math.log10(largest)) if largest > 0.0 else 0
    least = 10.0 ** (top - DECADES)
    decades = np.logspace(top - DECADES, top, 8 * DECADES + 1)
    edges = np.concatenate([-decades[::-1], np.linspace(-least, least, 9)[1:-1], decades])
    marks = [10.0**power for power in range(top - DECADES + 1, top + 1)]

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(rows), 0.8)
        ticks = [*(-mark for mark in marks[::-2]), 0.0, *marks[::-2][::-1]]  # as many as stand beside each other
        for axes, (name, values) in zip(panels, rows.items(), strict=True):
            _histogram(axes, values, edges, least)
            total = float(values.sum())
            axes.set_title(f"{name}: sum {'+' * (total > 0.0)}{amount(total, 'J', 3)}", color=INK)
            axes.set_ylabel("impacts")
            axes.set_xticks(ticks)
            axes.minorticks_off()
            axes.set_xlim(4.0 * edges[0], 4.0 * edges[-1])  # with room for the words of the last tick
            name_axes(axes, ("energy made by an impact", "J"))

    return plate(
        draw,
        f"Kinetic energy of the {len(energies.time)} impacts of the run at {run}: what each took in the run, and what "
        "each map, acting as it is, would have done with the velocities just before that impact. Left of zero it is "
        f"lost, right of zero (red) an impact creates energy. The scale is logarithmic beyond "
        f"±{amount(least, 'J')}, linear between (grey).",
    )


def _histogram(axes: Axes, values: np.ndarray, edges: np.ndarray, least: float) -> None:
    """How many impacts made how much, lost, near nothing and created in their colours."""
    counts, _ = np.histogram(values, edges)
    middle = 0.5 * (edges[:-1] + edges[1:])
    sides = ((middle < -least, BLUE), (np.abs(middle) < least, MUTED), (middle > least, VERMILION))
    for side, color in sides:
        axes.stairs(np.where(side, counts, 0), edges, fill=True, color=color, lw=0.0)
    axes.set_xscale("symlog", linthresh=least, linscale=0.5)
    axes.axvline(0.0, color=INK, lw=0.7)
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.7)
    axes.yaxis.set_minor_locator(NullLocator())
