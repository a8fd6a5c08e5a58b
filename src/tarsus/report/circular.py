"""Circular plots: height above the ground over one drive period as angle (as Figs 3.20 and 3.22 of the source)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tarsus.report.drawing import Drawing, Panel
from tarsus.report.figures import MOST_FEET, Plate
from tarsus.report.series import Series, Trace, foot_traces
from tarsus.report.style import BLUE, INK, MUTED, RULE, Scale, decimate, scale_of, upright
from tarsus.tables.numbers import amount

TURNS = 12
"""Drive periods laid over each other."""

TITLE = 0.2
"""Height of a title [inch]."""

NOTHING = 1e-3
"""A height below the ground's level by less than this part of the largest is none."""


def circular(series: Series) -> Plate | None:
    """One plot for each of the first feet; None if nothing repeats."""
    traces = foot_traces(series)
    if not traces:
        return None
    plate = dials(traces[:MOST_FEET], titled=len(traces) > 1)
    if len(traces) <= MOST_FEET:
        return plate
    more = f" Shown are the first {MOST_FEET} of {len(traces)} feet."
    return Plate(plate.picture, plate.caption + more, plate.wide)


def dials(traces: Sequence[Trace], *, across: int = 2, titled: bool = True) -> Plate:
    """One plot for each trace, all on one scale of heights, `across` of them side by side."""
    spans = [trace.last_periods(TURNS) for trace in traces]
    shown = [
        trace.height[trace.inside((first * trace.period, last * trace.period))]
        for trace, (first, last) in zip(traces, spans, strict=True)
    ]
    scale = scale_of("m", *shown)
    largest = max(float(np.max(part, initial=0.0)) for part in shown) / scale.step
    least = min(float(np.min(part, initial=0.0)) for part in shown) / scale.step
    rings = _Rings(largest, least)
    caption = _caption(traces, spans, rings, scale)

    def drawn(across: int, size: float) -> Markup:
        head = TITLE * titled
        figure = Drawing(size * across, (size + head) * -(-len(traces) // across))
        for number, (trace, (first, last)) in enumerate(zip(traces, spans, strict=True)):
            down, right = divmod(number, across)
            axes = figure.add(size * right, (size + head) * down + head, size, size)
            _dial(axes, trace, first, last, rings, scale, 1.38 if size > 3.0 else 1.55)
            if titled:
                axes.set_title(trace.title, centred=True)
        return figure.svg(caption)

    if len(traces) == 1:
        return Plate(drawn(1, 3.6), caption, wide=False)
    across = min(len(traces), across)
    return Plate.of_both(drawn(across, 7.2 / across), drawn(1, 3.6), caption)


class _Rings:
    """Ring heights in the unit of the plot, and the height at the centre: 0, or lower where a point goes below."""

    def __init__(self, largest: float, least: float) -> None:
        below = least < -NOTHING * max(largest, -least)
        step = _round_step(largest - least if below else largest)
        self.centre = float(np.floor(least / step)) * step if below else 0.0
        count = int((largest - self.centre) / step + 0.3)
        self.heights = [self.centre + step * k for k in range(1, max(count, 1) + 1)]
        self.rim = 1.12 * (max(largest, self.heights[-1]) - self.centre)

    def radius(self, height: np.ndarray | float) -> np.ndarray:
        return np.maximum(np.asarray(height) - self.centre, 0.0)


def _dial(
    axes: Panel, trace: Trace, first: int, last: int, rings: _Rings, scale: Scale, frame: float
) -> None:
    rim, period = rings.rim, trace.period
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    for height in rings.heights:
        radius = rings.radius(height)
        level = abs(height) < 1e-9 * rim
        look = {"color": INK, "ls": (0, (5, 3))} if level else {"color": RULE}
        axes.plot(radius * np.sin(circle), radius * np.cos(circle), lw=0.6, zorder=0, **look)  # type: ignore[arg-type]
        at = np.deg2rad(45.0)
        axes.text(
            float(radius * np.sin(at)), float(radius * np.cos(at)), f"{0.0 if level else height:g}".replace("-", "−"),
            color=MUTED, size=7.0 if frame < 1.5 else 6.0, halo=True,
        )  # fmt: skip
    axes.plot([-rim, rim], [0, 0], color=RULE, lw=0.6, zorder=0)
    axes.plot([0, 0], [-rim, rim], color=RULE, lw=0.6, zorder=0)
    for turn in range(first, last):
        inside = trace.inside((turn * period, (turn + 1) * period))
        when, height = decimate(trace.time[inside], trace.height[inside], bins=360)
        angle = 2.0 * np.pi * (when / period - turn)
        newest = turn == last - 1
        style = (
            {"color": BLUE, "lw": 1.2, "zorder": 3} if newest else {"color": BLUE, "lw": 0.6, "alpha": 0.3}
        )
        radius = rings.radius(height / scale.step)
        axes.plot(radius * np.sin(angle), radius * np.cos(angle), **style)  # type: ignore[arg-type]
    for start, end in trace.contacts:
        a, b = max(start, (last - 1) * period), min(end, last * period)
        if b > a:
            angle = 2.0 * np.pi * (np.linspace(a, b, 60) / period - (last - 1))
            axes.plot(rim * np.sin(angle), rim * np.cos(angle), color=INK, lw=2.4, zorder=4)
    inside = trace.inside(((last - 1) * period, last * period))
    when, volts = decimate(*upright(trace.time[inside], trace.volts[inside]), bins=180)
    swing = float(np.max(np.abs(volts), initial=0.0)) or 1.0
    around = rim * (1.12 + 0.06 * volts / swing)
    angle = 2.0 * np.pi * (when / period - (last - 1))
    axes.plot(around * np.sin(angle), around * np.cos(angle), color=MUTED, lw=0.9)
    for turn, text in enumerate(("0", "T/4", "T/2", "3T/4")):
        at, far = 0.5 * np.pi * turn, (1.29 + (turn % 2) * (frame - 1.38) / 2.0) * rim
        axes.text(far * np.sin(at), far * np.cos(at), text, color=INK)
    axes.set_xlim(-frame * rim, frame * rim)
    axes.set_ylim(-frame * rim, frame * rim)


def _caption(traces: Sequence[Trace], spans: Sequence[tuple[int, int]], rings: _Rings, scale: Scale) -> str:
    turns = max(last - first for first, last in spans)
    periods = {trace.period for trace in traces}
    each = f" ({amount(traces[0].period, 's')})" if len(periods) == 1 else ""
    which = (
        f"the last {turns} periods laid over each other, the last one darkest" if turns > 1 else "one period"
    )
    centre = (
        "the centre is the ground"
        if rings.centre == 0.0
        else f"the centre is at {rings.centre:g} {scale.label}, the dashed ring is the ground's level".replace(
            "-", "−"
        )
    )
    contact = " The outer arc marks contact in the last period," if any(t.contacts for t in traces) else ""
    drive = (
        " the grey curve around it is the drive voltage."
        if contact
        else " The grey curve is the drive voltage."
    )
    return (
        f"One turn clockwise is one drive period{each}, radius is the height above the ground (rings in "
        f"{scale.label}, {centre}); {which}.{contact}{drive}"
    )


def _round_step(largest: float) -> float:
    """A round step of which three to five reach past most of `largest`."""
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest / 4.0))
    return float(next(power * f for f in (1.0, 2.0, 5.0, 10.0) if power * f * 4.5 >= largest))


__all__ = ["circular", "dials"]
