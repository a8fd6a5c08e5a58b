"""Circular plots: height above the ground over one drive period as angle (as Figs 3.20 and 3.22 of the source)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tarsus.report.figures import MOST_FEET
from tarsus.report.pages import Plate
from tarsus.report.series import PlotTrace, RunSeries, foot_traces
from tarsus.report.sheet import Sheet, plate
from tarsus.report.style import BLUE, INK, MUTED, RULE, AxisScale, decimate, scale_of, upright
from tarsus.tables.numbers import amount, set_power

TURNS = 12
"""Drive periods laid over each other."""

NOTHING = 1e-3
"""A height below the ground's level by less than this part of the largest is none."""

SIDE = 3.2
"""Height of a plot [inch]."""


def circular(series: RunSeries) -> Plate | None:
    """One plot for each of the first feet; None if nothing repeats."""
    traces = foot_traces(series)
    if not traces:
        return None
    found = dials(traces[:MOST_FEET], titled=len(traces) > 1)
    if len(traces) <= MOST_FEET:
        return found
    return Plate(found.picture, f"{found.caption} Shown are the first {MOST_FEET} of {len(traces)} feet.")


def dials(traces: Sequence[PlotTrace], *, titled: bool = True) -> Plate:
    """One plot for each trace, all on one scale of heights."""
    spans = [trace.last_periods(TURNS) for trace in traces]
    shown = [
        trace.height[trace.inside((first * trace.period, last * trace.period))]
        for trace, (first, last) in zip(traces, spans, strict=True)
    ]
    scale = scale_of("m", *shown)
    largest = max(float(np.max(part, initial=0.0)) for part in shown) / scale.step
    least = min(float(np.min(part, initial=0.0)) for part in shown) / scale.step
    rings = _Rings(largest, least)

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(traces), SIDE, polar=True)
        for axes, trace, (first, last) in zip(panels, traces, spans, strict=True):
            _dial(axes, trace, first, last, rings, scale)
            if titled:
                axes.set_title(trace.title)

    return plate(draw, _caption(traces, spans, rings, scale))


class _Rings:
    """Ring heights in the unit of the plot, and the height at the centre: 0, or lower where a point goes below."""

    def __init__(self, largest: float, least: float) -> None:
        below = least < -NOTHING * max(largest, -least)
        step = _round_step(largest - least if below else largest)
        self.centre = float(np.floor(least / step)) * step if below else 0.0
        count = int((largest - self.centre) / step + 0.3)
        self.heights = [self.centre + step * k for k in range(1, max(count, 1) + 1)]
        self.rim = self.beyond(1.12, max(largest, self.heights[-1]))

    def beyond(self, part: float, height: float | None = None) -> float:
        """A height so many times as far from the centre as another one, or as the rim."""
        return self.centre + part * ((self.rim if height is None else height) - self.centre)


def _dial(axes: Any, trace: PlotTrace, first: int, last: int, rings: _Rings, scale: AxisScale) -> None:
    """Heights of the last turns, contact and volts of the last one about them; angle clockwise from above."""
    period = trace.period
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetagrids([0, 90, 180, 270], ["0", "T/4", "T/2", "3T/4"], color=INK)
    axes.set_rgrids(
        rings.heights, [set_power(f"{height:g}") for height in rings.heights], angle=45.0, color=MUTED
    )
    axes.grid(color=RULE, lw=0.6)
    axes.spines["polar"].set_visible(False)
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    if rings.centre < 0.0:
        axes.plot(circle, np.zeros(181), color=INK, lw=0.6, ls=(0, (5, 3)))
    for turn in range(first, last):
        inside = trace.inside((turn * period, (turn + 1) * period))
        when, height = decimate(trace.time[inside], trace.height[inside], bins=360)
        newest = turn == last - 1
        look = {"lw": 1.2, "zorder": 3} if newest else {"lw": 0.6, "alpha": 0.3}
        axes.plot(
            2.0 * np.pi * (when / period - turn),
            np.maximum(height / scale.step, rings.centre),
            color=BLUE,
            **look,
        )
    for start, end in trace.contacts:
        a, b = max(start, (last - 1) * period), min(end, last * period)
        if b > a:
            angle = 2.0 * np.pi * (np.linspace(a, b, 60) / period - (last - 1))
            axes.plot(angle, np.full(60, rings.rim), color=INK, lw=2.4, zorder=4)
    inside = trace.inside(((last - 1) * period, last * period))
    when, volts = decimate(*upright(trace.time[inside], trace.volts[inside]), bins=180)
    swing = float(np.max(np.abs(volts), initial=0.0)) or 1.0
    around = [rings.beyond(1.12 + 0.06 * one / swing) for one in volts]
    axes.plot(2.0 * np.pi * (when / period - (last - 1)), around, color=MUTED, lw=0.9)
    axes.set_rlim(rings.centre, rings.beyond(1.2))


def _caption(
    traces: Sequence[PlotTrace], spans: Sequence[tuple[int, int]], rings: _Rings, scale: AxisScale
) -> str:
    turns = max(last - first for first, last in spans)
    periods = {trace.period for trace in traces}
    each = f" ({amount(traces[0].period, 's')})" if len(periods) == 1 else ""
    which = (
        f"the last {turns} periods laid over each other, the last one darkest" if turns > 1 else "one period"
    )
    centre = "the centre is the ground"
    if rings.centre != 0.0:
        height = set_power(f"{rings.centre:g}")
        centre = f"the centre is at {height} {scale.label}, the dashed ring is the ground's level"
    drive = " The grey curve is the drive voltage."
    if any(trace.contacts for trace in traces):
        drive = (
            " The outer arc marks contact in the last period, the grey curve around it is the drive voltage."
        )
    return (
        f"One turn clockwise is one drive period{each}, radius is the height above the ground (rings in "
        f"{scale.label}, {centre}); {which}.{drive}"
    )


def _round_step(largest: float) -> float:
    """A round step of which three to five reach past most of `largest`."""
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest / 4.0))
    return float(next(power * f for f in (1.0, 2.0, 5.0, 10.0) if power * f * 4.5 >= largest))
