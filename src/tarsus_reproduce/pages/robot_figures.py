"""Figures of a robot's reproduction: heights as bars, motion of points, mode shapes, energies of impact maps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from tarsus.report.circular import TURNS
from tarsus.report.figures import Plate, shade
from tarsus.report.html import amount
from tarsus.report.series import Trace, last_turns, point_trace
from tarsus.report.sheet import Sheet, few_ticks, plate
from tarsus.report.style import BLUE, INK, MUTED, RULE, VERMILION, Scale, decimate, scale_of, upright
from tarsus_reproduce.impacts import ImpactEnergies, ModeRow
from tarsus_reproduce.robot_runs import RobotRuns

SAMPLES = 720
"""Samples of a drive period in figures of motion: two for each of the 360 degrees of a circular plot."""

SHOWN_PERIODS = 4
"""Drive periods in a figure of motion."""

DECADES = 5
"""Orders of magnitude of energy drawn on either side of zero."""


def ground_traces(runs: RobotRuns) -> list[Trace]:
    """Heights over the last drive periods of the runs over the ground that came to their end."""
    traces: list[Trace] = []
    for near in runs.near:
        if not near.run.ok:
            continue
        series = last_turns(near.run, TURNS, SAMPLES)
        for point in near.points:
            foot = " (bouncing foot)" if point in series.foot_points else ""
            title = near.title if len(near.points) == 1 else f"{point}{foot}"
            traces.append(point_trace(series, point, title))
    return traces


def ground_motion(runs: RobotRuns) -> Plate:
    """Motion over the ground of every run (as Figs 3.19 to 3.22 of the source)."""
    traces = ground_traces(runs)
    whole = [near for near in runs.near if near.run.ok]
    which = f" {runs.near[0].title}." if len(runs.near) == 1 else ""
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
    return motion_of(traces, "height", caption, ground=True)


def air_motion(runs: RobotRuns) -> Plate:
    """Steady motion in the air (as Figs 3.9 and 3.10 of the source)."""
    several = len(runs.air) > 1
    traces = [
        Trace(
            f"{point}, {air.volt_v:g} V, {air.freq_hz:.4g} Hz" if several else point,
            air.time, shift, air.volts, 1.0 / air.freq_hz,
        )
        for air in runs.air
        if not air.problem
        for point, shift in zip(air.points, air.displacement, strict=True)
    ]  # fmt: skip
    what = "the actuated foot" if several else "the points"
    return motion_of(
        traces,
        "displ.",
        f"Displacement of {what} in the air under a square wave, steady periods.",
        ground=False,
    )


def motion_of(traces: Sequence[Trace], what: str, caption: str, *, ground: bool) -> Plate:
    """Motion of points over the last drive periods, one panel each, the drive above; `what` names the heights."""
    heights: list[float] = []
    for k in range(len(traces)):
        heights += [0.2] * _new_drive(traces, k) + [0.8 if len(traces) > 3 else 1.05]
    seen = [trace.height[_shown(trace)] for trace in traces]
    scale = scale_of("m", *seen)
    low, high = (float(pick(np.concatenate(seen))) / scale.step for pick in (np.min, np.max))
    edge = 0.06 * (high - low) or 1.0
    longest = max(1, *(last - first for first, last in map(_span, traces)))

    def draw(sheet: Sheet) -> None:
        panels = sheet.stack(heights, gap=0.26)
        free = iter(panels)
        for k, trace in enumerate(traces):
            if _new_drive(traces, k):
                _volts(next(free), trace)
            axes = next(free)
            _heights(axes, trace, scale)
            axes.set_ylabel(f"{what} ({scale.label})")
            if ground:
                axes.axhline(0.0, color=INK, lw=0.7, ls=(0, (5, 3)), zorder=1)
            axes.set_ylim(low - edge, high + edge)
        panels[-1].set_xlim(0.0, float(longest))
        panels[-1].set_xticks(np.arange(0.0, longest + 0.25, 0.5))
        panels[-1].set_xlabel("time (drive periods)")

    return plate(draw, caption)


def _volts(axes: Axes, trace: Trace) -> None:
    """The drive of a trace."""
    first, _ = _span(trace)
    part = _shown(trace)
    when, volts = decimate(*upright(trace.time[part], trace.volts[part]))
    axes.plot(when / trace.period - first, volts, color=MUTED, lw=0.9)
    axes.set_ylabel("(V)")
    axes.spines["bottom"].set_visible(False)
    axes.tick_params(axis="x", length=0)
    axes.margins(y=0.15)
    swing = np.array([volts.min(initial=0.0), volts.max(initial=0.0)])
    axes.set_yticks(swing, [f"{v:.3g}".replace("-", "−") for v in swing])


def _heights(axes: Axes, trace: Trace, scale: Scale) -> None:
    """The motion of a trace, contact shaded."""
    first, last = _span(trace)
    part = _shown(trace)
    when, shown = decimate(trace.time[part], trace.height[part])
    axes.plot(when / trace.period - first, shown / scale.step, color=BLUE, lw=0.9)
    axes.set_title(trace.title, loc="left", pad=2.0, color=INK)
    contacts = [(a / trace.period - first, b / trace.period - first) for a, b in trace.contacts]
    shade(axes, contacts, (0.0, float(last - first)), Scale(1.0, ""))
    few_ticks(axes, y=4)


def _new_drive(traces: Sequence[Trace], k: int) -> bool:
    """Whether a trace is under another drive than the one above it."""
    above, own = traces[k - 1], traces[k]
    return k == 0 or above.period != own.period or not np.array_equal(above.volts, own.volts)


def _span(trace: Trace) -> tuple[int, int]:
    return trace.last_periods(SHOWN_PERIODS)


def _shown(trace: Trace) -> slice:
    first, last = _span(trace)
    return trace.inside((first * trace.period, last * trace.period))


def mode_shapes(modes: Sequence[ModeRow], column: np.ndarray, points: Sequence[str]) -> Plate:
    """Every mode at the points over the printed CoR column, and their MAC (as Figs 3.13d and 3.14 of the source)."""
    places = np.arange(len(points))
    printed = column / np.abs(column).max()
    numbers = np.array([mode.number for mode in modes])

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(modes) + 1, 1.05, across=4, left=0.45, title=1)
        for axes, mode in zip(panels, modes, strict=False):
            shape = np.array(mode.shape)
            shape = shape * np.sign(shape @ column) / np.abs(shape).max()
            axes.axhline(0.0, color=RULE, lw=0.7, zorder=0)
            axes.plot(
                places,
                printed,
                color=INK,
                lw=0.9,
                marker="o",
                ms=4.0,
                mfc="white",
                label="printed CoR column",
            )
            axes.plot(places, shape, color=BLUE, lw=1.2, marker="D", ms=3.4, mew=0.0, label="mode")
            axes.set_title(f"mode {mode.number}, {mode.freq_hz:.4g} Hz", loc="left", pad=3.0, color=INK)
            axes.set_ylim(-1.15, 1.15)
            axes.set_yticks([-1.0, 0.0, 1.0])
            axes.set_xticks(places, points)
            axes.tick_params(axis="x", labelsize=6.5, labelrotation=0.0 if sheet.narrow else 90.0)
        bars = panels[-1]
        bars.barh(numbers, [mode.mac for mode in modes], height=0.6, color=BLUE)
        bars.set_yticks(numbers)
        bars.set_ylim(numbers.max() + 0.6, numbers.min() - 0.6)
        bars.set_xlim(0.0, 1.0)
        bars.set_xlabel("MAC")
        bars.set_title("by mode", loc="left", pad=3.0, color=INK)
        sheet.legend(panels[0])

    return plate(
        draw,
        "Mode shapes at the points, each to its largest entry and with the sign nearer to the column, over the change "
        "of velocity that the printed CoR matrix gives the points when the struck foot's velocity changes; last, "
        "the likeness of each mode and the column (modal assurance criterion, 1 = the same shape).",
    )


def impact_histograms(energies: ImpactEnergies, run: str) -> Plate:
    """How much energy each map takes or makes, as the number of impacts, with each sum."""
    rows: Mapping[str, np.ndarray] = {"as run": energies.actual} | {
        f"{name}, as it is": made for name, made in energies.by_map.items()
    }
    scale = scale_of("J", *rows.values())
    largest = max(float(np.abs(values).max()) for values in rows.values()) / scale.step
    top = math.ceil(math.log10(largest)) if largest > 0.0 else 0
    least = 10.0 ** (top - DECADES)
    decades = np.logspace(top - DECADES, top, 8 * DECADES + 1)
    edges = np.concatenate([-decades[::-1], np.linspace(-least, least, 9)[1:-1], decades])
    marks = [10.0**power for power in range(top - DECADES + 1, top + 1)]

    def draw(sheet: Sheet) -> None:
        panels = sheet.stack([0.62] * len(rows), gap=0.27)
        for axes, (name, values) in zip(panels, rows.items(), strict=True):
            _histogram(axes, values / scale.step, edges, least)
            total = float(values.sum())
            words = f"sum {'+' * (total > 0.0)}{amount(total, 'J', 3)}"
            axes.set_title(name if not sheet.narrow else f"{name}: {words}", loc="left", pad=2.0, color=INK)
            if not sheet.narrow:
                axes.set_title(words, loc="right", pad=2.0, color=INK)
            axes.set_ylabel("impacts")
        every = 2 if sheet.narrow else 1  # as many as stand beside each other
        ticks = [*(-mark for mark in marks[::-every]), 0.0, *marks[::-every][::-1]]
        panels[-1].set_xticks(ticks, [f"{tick:g}".replace("-", "−") for tick in ticks])
        panels[-1].minorticks_off()
        room = 4.0 if sheet.narrow else 1.2  # for the words of the last tick
        panels[-1].set_xlim(room * edges[0], room * edges[-1])
        panels[-1].set_xlabel(f"energy made by an impact ({scale.label}); left of zero it is lost")
        sheet.raise_by(0.15)

    return plate(
        draw,
        f"Kinetic energy of the {len(energies.time)} impacts of the run at {run}: what each took in the run, and what "
        "each map, acting as it is, would have done with the velocities just before that impact. Right of zero "
        f"(red) an impact creates energy. The scale is logarithmic beyond ±{least:g} {scale.label}, linear between "
        "(grey).",
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


__all__ = ["air_motion", "ground_motion", "ground_traces", "impact_histograms", "mode_shapes", "motion_of"]
