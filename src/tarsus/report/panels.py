"""Panels over time below each other, as data of uPlot, which draws them in the page: lines, bars, shading, their names.

All numbers are SI; each axis shows its own under a prefix.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from markupsafe import Markup

from tarsus.base.arrays import Floats
from tarsus.report.packing import packed, packed_times, script_text
from tarsus.report.pages import PageFigure, rendered
from tarsus.report.style import INK, AxisScale, level_limits, paint_of, samples_inside, scale_of, thinned

Window = tuple[float, float]
"""Start and end of a stretch of an axis, most often of time [s]."""

Dash = tuple[float, ...]
"""What is drawn and left out of a line, in turn, in widths of the line; () is solid."""

PIXELS = 118.0
"""Pixels of a panel's inch: figures of 7.4 inch fill the page's width."""

AXIS = 26.0
"""Height of the numbers below the lowest panel [pixels]."""

POINTS = 5000
"""Samples of a line at most: a zoom of three still shows every pixel's."""

SHORTEST = 1.0 / 1500.0
"""Of the window: what is shaded shorter is drawn so long, about half a pixel."""

NUMBERS = 36_000
"""Numbers of a panel at most, those of all its lines together."""


@dataclass(frozen=True)
class DrawnLine:
    """A line through points (n,), x rising, broken where y is NaN. Lines of one name are one to a reader."""

    x: Floats
    y: Floats
    color: str
    name: str = ""
    width: float = 1.1
    dash: Dash = ()

    def inside(self, window: Window | None) -> DrawnLine:
        """What is seen of it within a window."""
        if window is None:
            return self
        part = samples_inside(self.x, window)
        return replace(self, x=self.x[part], y=self.y[part])


@dataclass(frozen=True)
class Level:
    """A level line from end to end, below the others."""

    y: float
    color: str
    dash: Dash = ()


@dataclass(frozen=True)
class Bars:
    """Bars over stretches, between two heights."""

    stretches: Sequence[Window]
    low: float
    high: float
    color: str


@dataclass(frozen=True)
class Sign:
    """A name for what is no line: an area of a colour, or a dashed level."""

    name: str
    color: str = INK
    area: bool = False


@dataclass(frozen=True)
class TimePanel:
    """One panel. height: [inch]; words, unit: what its numbers are, and the SI unit that they are in; shaded: stretches
    from bottom to top; limits: of its axis, None as its lines need, the first one larger where it counts downward;
    names: of the places 0, 1, ... of its axis, in place of numbers."""

    height: float
    words: str = ""
    unit: str = ""
    lines: Sequence[DrawnLine] = ()
    shaded: Sequence[Window] = ()
    bars: Sequence[Bars] = ()
    levels: Sequence[Level] = ()
    signs: Sequence[Sign] = ()
    limits: tuple[float | None, float | None] = (None, None)
    names: Sequence[str] = ()

    def seen(self, window: Window | None) -> tuple[list[DrawnLine], AxisScale]:
        """Its lines within a window, and the prefix of their numbers."""
        lines = [line.inside(window) for line in self.lines]
        return lines, scale_of(self.unit, *(line.y for line in lines))

    def options(self, window: Window, step: float, places: list[Floats]) -> dict[str, Any]:
        """What the script hands to uPlot, x in parts of `step`; its times are added to `places` unless they are
        there."""
        lines, scale = self.seen(window)
        x, rows = _columns(lines, window)
        x, rows = x / step, rows / scale.step
        limits = (level_limits(rows) if self.limits == (None, None) else None) or tuple(
            None if one is None else one / scale.step for one in self.limits
        )
        where = next((i for i, one in enumerate(places) if np.array_equal(one, x)), len(places))
        if where == len(places):
            places.append(x)
        least = SHORTEST * (window[1] - window[0])
        shaded = [(a, max(b, a + least)) for a, b in self.shaded]
        return {
            "x": where,
            "step": scale.step,
            "limits": limits,
            "names": self.names,
            "shaded": _inside(shaded, window, step),
            "series": [
                {
                    "stroke": paint_of(one.color),
                    "width": one.width,
                    "dash": _pixels(one.dash, one.width),
                    "values": packed(row, 16, gaps=True),
                }
                for one, row in zip(lines, rows, strict=True)
            ],
            "bars": [
                {
                    "color": paint_of(one.color),
                    "low": one.low / scale.step,
                    "high": one.high / scale.step,
                    "spans": _inside(one.stretches, window, step),
                }
                for one in self.bars
            ],
            "levels": [
                {"at": float(one.y) / scale.step, "color": paint_of(one.color), "dash": _pixels(one.dash, 0.7)}
                for one in self.levels
            ],
        }

    def head(self, window: Window) -> dict[str, Any]:
        """What stands above the panel: what its numbers are, and names of lines with the places in `options` of all
        that bear it."""
        lines, scale = self.seen(window)
        named: dict[str, list[int]] = {}
        for place, line in enumerate(lines, 1):
            named.setdefault(line.name or f"\0{place}", []).append(place)
        return {
            "label": scale.axis(self.words),
            "signs": [(one.name, one.area, f"var(--{paint_of(one.color)})") for one in self.signs],
            "lines": [
                (lines[own[0] - 1], f"var(--{paint_of(lines[own[0] - 1].color)})", " ".join(map(str, own)))
                for own in named.values()
            ],
        }


def _pixels(dash: Dash, width: float) -> list[float]:
    return [round(part * width * 1.5, 2) for part in dash]


def _inside(stretches: Iterable[Window], window: Window, step: float) -> list[Window]:
    """Those that reach into a window."""
    seen = [(a, b) for a, b in stretches if b > window[0] and a < window[1]]
    return [(float(f"{a / step:.7g}"), float(f"{b / step:.7g}")) for a, b in seen]


def _columns(lines: Sequence[DrawnLine], window: Window) -> tuple[Floats, Floats]:
    """Lines at common times: (n,) and (lines, n), thinned to what a page can hold."""
    if not lines:
        return np.array(window), np.zeros((0, 2))
    x = lines[0].x
    if all(np.array_equal(line.x, x) for line in lines[1:]):
        rows = np.stack([line.y for line in lines])
    else:
        x = np.unique(np.concatenate([line.x for line in lines]))
        rows = np.stack([np.interp(x, line.x, line.y) for line in lines])
    return thinned(x, rows, max(400, min(POINTS, NUMBERS // len(rows))))


def panels_html(
    panels: Sequence[TimePanel], label: str, window: Window | None = None, *, across: str = "time", unit: str = "s"
) -> Markup:
    """Panels with one horizontal axis for a page; ``label`` describes them to those who do not see them.

    across, unit: what that axis is, and the SI unit of its numbers; window: its stretch that is shown, all without.
    """
    if window is None:
        every = [line.x for panel in panels for line in panel.lines if len(line.x)]
        window = (float(min(x[0] for x in every)), float(max(x[-1] for x in every)))
    scale = scale_of(unit, window[1] - window[0])
    places: list[Floats] = []
    options = [panel.options(window, scale.step, places) for panel in panels]
    heights = [round(PIXELS * panel.height) for panel in panels]
    heights[-1] += round(AXIS)
    data = script_text(
        {
            "x": [packed_times(one) for one in places],
            "window": [end / scale.step for end in window],
            "step": scale.step,
            "clock": across == "time",
            "panels": [one | {"height": height} for one, height in zip(options, heights, strict=True)],
        }
    )
    heads = zip((panel.head(window) for panel in panels), heights, strict=True)
    return rendered("charts.html", panels=list(heads), across=scale.axis(across), label=label, data=data)


def panels_figure(panels: Sequence[TimePanel], caption: str, window: Window | None = None, **axis: Any) -> PageFigure:
    """Panels as a figure; axis: as of `panels_html`."""
    return PageFigure(panels_html(panels, caption, window, **axis), caption)
