"""Figures of a robot's reproduction: motion of points, mode shapes, energies of impact maps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from tarsus.report.figures import TURNS, last_contacts, turns_caption, turns_of
from tarsus.report.pages import Plate
from tarsus.report.panels import Window
from tarsus.report.series import PlotTrace, by_drive, last_turns, point_trace
from tarsus.report.sheet import Sheet, few_ticks, line, name_axes, plate, shade
from tarsus.report.style import BLUE, CYCLE, INK, MUTED, RULE, SKY, VERMILION, samples_inside
from tarsus.tables import amount
from tarsus_reproduce.impacts import ImpactEnergies, ModeRow
from tarsus_reproduce.robot_runs import RobotRuns

SAMPLES = 720
"""Samples of a drive period in figures of motion: twice as many as a panel has pixels for it."""

SHOWN_PERIODS = 4
"""Drive periods in a figure of motion."""

DECADES = 5
"""Orders of magnitude of energy drawn on either side of zero."""


def _ground_traces(runs: RobotRuns) -> list[PlotTrace]:
    """Heights over the last drive periods of the runs over the ground that came to their end."""
    traces: list[PlotTrace] = []
    for near in runs.near:
        if not near.run.ok:
            continue
        series = last_turns(near.run, TURNS, SAMPLES)
        for point in near.points:
            foot = " (bouncing foot)" if point in series.foot_points else ""
            title = near.title if len(near.points) == 1 else f"{point}{foot}"
            traces.append(point_trace(series, point, title))
    return traces


def ground_periods(runs: RobotRuns) -> Plate:
    """Motion over the ground by drive period (Figs 3.20 and 3.22 of the source, where a period is a circle)."""
    traces = _ground_traces(runs)

    def over_each_other(axes: Axes, trace: PlotTrace) -> list[Window]:
        *older, newest = turns_of(trace)
        for one in older:
            line(axes, *one, color=SKY, lw=0.6)
        line(axes, *newest, color=BLUE, lw=1.3)
        return last_contacts(trace)

    def draw(sheet: Sheet) -> None:
        for drive, panels, same in _stacks(sheet, traces):
            phase = same[0].time / same[0].period - same[0].last_periods(TURNS)[1] + 1
            seen = samples_inside(phase, (0.0, 1.0))
            line(drive, phase[seen], same[0].volts[seen], color=MUTED, lw=0.9)
            drive.set_xlim(0.0, 1.0)
            _heights(panels, same, over_each_other)
            name_axes(panels[-1], ("drive period", ""))

    return plate(draw, turns_caption(traces))


def ground_motion(runs: RobotRuns) -> Plate:
    """Motion over the ground of every run (as Figs 3.19 to 3.22 of the source): a panel for each, its drive above."""
    traces = _ground_traces(runs)

    def in_time(axes: Axes, trace: PlotTrace) -> list[Window]:
        _motion(axes, trace, BLUE)
        first, last = _span(trace)
        turned = ((a / trace.period, b / trace.period) for a, b in trace.contacts)
        return [(max(a, first) - first, min(b, last) - first) for a, b in turned if b > first and a < last]

    def draw(sheet: Sheet) -> None:
        for drive, panels, same in _stacks(sheet, traces):
            _drive(drive, same[:1])
            _heights(panels, same, in_time)
            name_axes(panels[-1], (PERIODS, ""))

    whole = [near for near in runs.near if near.run.ok]
    which = f" {whole[0].title}." if len(runs.near) == 1 else ""
    caption = (
        f"Height above the ground over the last drive periods of a run of {whole[0].run.duration:g} s from rest, "
        f"under the drive above.{which} Contact is shaded, the dashed line is the ground. Every run is one of many: "
        "motion with bounces forgets its start within a few impacts."
    )
    if any(len(near.points) > 1 for near in whole):
        caption += (
            " Heights of points without a foot are their displacement on the bouncing foot's gap at rest; only the "
            "bouncing foot has ground below it."
        )
    return plate(draw, caption)


def _stacks(sheet: Sheet, traces: Sequence[PlotTrace]) -> Iterator[tuple[Axes, list[Axes], list[PlotTrace]]]:
    """For every drive its panel, and below it one for each trace under it."""
    for same in by_drive(traces):
        drive, *panels = sheet.stacks(1, [0.5, *(0.8 for _ in same)])[0]
        yield drive, panels, same
        few_ticks(drive, y=2)
        name_axes(drive, None, ("drive", "V"))


def _heights(
    panels: Sequence[Axes], traces: Sequence[PlotTrace], draw: Callable[[Axes, PlotTrace], list[Window]]
) -> None:
    """Heights above the dashed ground, a panel a trace as it is drawn; contacts, which that returns, are shaded."""
    for axes, trace in zip(panels, traces, strict=True):
        shade(axes, draw(axes, trace))
        axes.axhline(0.0, color=INK, lw=0.7, ls="--")
        axes.set_title(trace.title)
        few_ticks(axes, y=4)
        name_axes(axes, None, ("height", "m"))


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
