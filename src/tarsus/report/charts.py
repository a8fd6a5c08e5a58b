"""Panels over time below each other, which a page draws with uPlot: lines, bars, shading, and what they are called.

All numbers are SI; each axis shows its own under a prefix. Methods that matplotlib's axes have too are called as those
are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from tarsus.base.arrays import Floats
from tarsus.report.packing import packed, packed_times, script_text
from tarsus.report.pages import Plate, rendered
from tarsus.report.style import (
    INK,
    AxisScale,
    level_limits,
    paint_of,
    samples_inside,
    scale_of,
    thinned,
    upright,
)
from tarsus.tables.numbers import number

Window = tuple[float, float]
"""Start and end of a stretch of an axis, most often of time [s]."""

Dash = str | tuple[int, tuple[float, ...]]
"""Solid as ``"-"``, else (0, (drawn, left out, ...)) in widths of the line."""

PIXELS = 118.0
"""Pixels of a panel's inch: figures of 7.4 inch fill the page's width."""

AXIS = 26
"""Height of the numbers below the lowest panel [pixels]."""

POINTS = 5000
"""Samples of a line at most: a zoom of three still shows every pixel's."""

SHORTEST = 1.0 / 1500.0
"""Of the window: what is shaded shorter is drawn so long, about half a pixel."""

NUMBERS = 36_000
"""Numbers of a panel at most, those of all its lines together."""


@dataclass
class _Line:
    x: Floats
    y: Floats
    color: str
    width: float
    dash: list[float]
    name: str
    alpha: float
    order: float
    dots: bool = False

    def inside(self, window: Window | None) -> _Line:
        """What is seen of it within a window."""
        if window is None:
            return self
        part = samples_inside(self.x, window)
        return replace(self, x=self.x[part], y=self.y[part])


@dataclass
class ChartPanel:
    """One panel of a height [pixels]."""

    height: float
    _lines: list[_Line] = field(default_factory=list)
    _shaded: list[Window] = field(default_factory=list)
    _bars: list[tuple[str, float, float, Sequence[Window]]] = field(default_factory=list)
    _levels: list[tuple[float, str, float, list[float]]] = field(default_factory=list)
    _signs: list[dict[str, Any]] = field(default_factory=list)
    _limits: tuple[float | None, float | None] = (None, None)
    _names: list[tuple[float, str]] | None = None
    _label: tuple[str, str] = ("", "")

    def plot(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, lw: float = 1.1, ls: Dash = "-", label: str = "",
        alpha: float = 1.0, zorder: float = 2.0,
    ) -> None:  # fmt: skip
        """A line through points (n,), x rising; it is broken where y is NaN."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        self._lines.append(_Line(x, y, paint_of(color), lw, _dash(ls, lw), label, alpha, zorder))

    def dots(self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, label: str = "") -> None:
        """A dot at each point (n,), x rising."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        self._lines.append(_Line(x, y, paint_of(color), 1.0, [], label, 1.0, 3.0, dots=True))

    def axhline(self, y: float, *, color: str, lw: float = 0.7, ls: Dash = "-") -> None:
        """A level line from end to end, below the others."""
        self._levels.append((float(y), paint_of(color), lw, _dash(ls, lw)))

    def shade(self, stretches: Iterable[Window]) -> None:
        """Stretches shaded from bottom to top."""
        self._shaded += stretches

    def bars(
        self, stretches: Sequence[Window], low: float, high: float, *, color: str, label: str = ""
    ) -> None:
        """Bars over stretches, between two heights."""
        if label:
            self.sign(label, color, area=True)
        if stretches:
            self._bars.append((paint_of(color), low, high, stretches))

    def set_ylim(self, bottom: float | None = None, top: float | None = None) -> None:
        self._limits = (
            self._limits[0] if bottom is None else float(bottom),
            self._limits[1] if top is None else float(top),
        )

    def set_yticks(self, places: npt.ArrayLike, names: Sequence[str]) -> None:
        """Names in place of numbers."""
        self._names = list(zip(np.asarray(places, dtype=float).tolist(), names, strict=True))

    def set_ylabel(self, words: str, unit: str = "") -> None:
        """What its numbers are, and the SI unit that they are in."""
        self._label = (words, unit)

    def sign(self, name: str, color: str = INK, *, area: bool = False) -> None:
        """A name for what is no line: shading (``area``), or a dashed level."""
        self._signs.append({"name": name, "area": area, "paint": f"var(--{paint_of(color)})"})

    def seen(self, window: Window | None) -> tuple[list[_Line], AxisScale]:
        """Its lines within a window, those in front last, and the prefix of their numbers."""
        lines = [line.inside(window) for line in sorted(self._lines, key=lambda line: line.order)]
        return lines, scale_of(self._label[1], *(line.y for line in lines))

    def spec(self, window: Window, step: float, places: list[Floats]) -> dict[str, Any]:
        """All that the script draws, x in parts of `step`; its times are added to `places` unless they are there."""
        lines, scale = self.seen(window)
        x, rows = _columns(lines, window)
        x, rows = x / step, rows / scale.step
        low, high = (None if one is None else one / scale.step for one in self._limits)
        limits = (level_limits(rows) if len(rows) == 1 and low is None and high is None else None) or (
            low,
            high,
        )
        where = next((i for i, one in enumerate(places) if np.array_equal(one, x)), len(places))
        if where == len(places):
            places.append(x)
        drawn = [
            {"color": line.color, "width": line.width, "dash": line.dash, "alpha": line.alpha,
             "dots": line.dots, "values": packed(row, 16, gaps=True)}
            for line, row in zip(lines, rows, strict=True)
        ]  # fmt: skip
        bars = [
            {"color": color, "low": a, "high": b, "spans": _inside(spans, window, step)}
            for color, a, b, spans in self._bars
        ]
        levels = [
            {"at": at / scale.step, "color": color, "width": width, "dash": dash}
            for at, color, width, dash in self._levels
        ]
        least = SHORTEST * (window[1] - window[0])
        shaded = [(a, max(b, a + least)) for a, b in self._shaded]
        return {
            "x": where, "step": scale.step, "height": round(self.height), "lines": drawn,
            "shaded": _inside(shaded, window, step),
            "bars": bars, "levels": levels, "limits": limits, "names": self._names,
        }  # fmt: skip

    def head(self, window: Window) -> dict[str, Any]:
        """What stands above the panel: what its numbers are, the names of its lines in the order of `spec`, and for
        those without a script name, least and largest value of each."""
        lines, scale = self.seen(window)
        known = [(line.name, line.y[np.isfinite(line.y)] / scale.step) for line in lines]
        return {
            "label": scale.axis(self._label[0]), "signs": self._signs, "height": round(self.height),
            "lines": [
                {
                    "name": one.name, "paint": f"var(--{one.color})", "width": one.width, "dash": one.dash,
                    "dots": one.dots,
                }
                for one in lines
            ],
            "ends": [(name, number(float(y.min())), number(float(y.max()))) for name, y in known if len(y)],
        }  # fmt: skip


def _dash(ls: Dash, width: float) -> list[float]:
    return [] if isinstance(ls, str) else [round(part * width * 1.5, 2) for part in ls[1]]


def _inside(stretches: Iterable[Window], window: Window, step: float) -> list[Window]:
    """Those that reach into a window."""
    seen = [(a, b) for a, b in stretches if b > window[0] and a < window[1]]
    return [(float(f"{a / step:.7g}"), float(f"{b / step:.7g}")) for a, b in seen]


def _columns(lines: Sequence[_Line], window: Window) -> tuple[Floats, Floats]:
    """Lines at common times: (n,) and (lines, n), thinned to what a page can hold."""
    if not lines:
        return np.array(window), np.zeros((0, 2))
    x = lines[0].x
    if any(line.dots for line in lines):
        return _beside(lines)
    if all(np.array_equal(line.x, x) for line in lines[1:]):
        rows = np.stack([line.y for line in lines])
    else:
        x = np.unique(np.concatenate([line.x for line in lines]))
        rows = np.stack([np.interp(x, line.x, line.y) for line in lines])
    return thinned(*upright(x, rows), max(400, min(POINTS, NUMBERS // len(rows))))


def _beside(lines: Sequence[_Line]) -> tuple[Floats, Floats]:
    """Dots and lines at the places of all, each with numbers at its own alone; lines go on over the others'."""
    x = np.concatenate([line.x for line in lines])
    rows = np.full((len(lines), len(x)), np.nan)
    first = 0
    for row, line in zip(rows, lines, strict=True):
        row[first : first + len(line.x)] = line.y
        first += len(line.x)
    order = np.argsort(x, kind="stable")
    return x[order], rows[:, order]


class Charts:
    """Panels below each other, of the given heights [inch of a page 7.4 inch wide], with one horizontal axis.

    across, unit: what that axis is, and the SI unit of its numbers; window: its stretch that is shown, all without;
    log: whether it is logarithmic.
    """

    def __init__(
        self, heights: Sequence[float], across: str = "time", unit: str = "s", window: Window | None = None,
        *, log: bool = False,
    ) -> None:  # fmt: skip
        self.panels = [ChartPanel(PIXELS * height) for height in heights]
        self.panels[-1].height += AXIS
        self._across, self._unit, self._window, self._log = across, unit, window, log

    def html(self, label: str) -> Markup:
        """The charts for a page; ``label`` tells those who do not see them what they show."""
        window = self._window
        if window is None:
            every = [line.x for panel in self.panels for line in panel.seen(None)[0]]
            window = (float(min(x[0] for x in every)), float(max(x[-1] for x in every)))
        scale = scale_of(self._unit, window[1] - window[0])
        places: list[Floats] = []
        panels = [panel.spec(window, scale.step, places) for panel in self.panels]
        data = script_text(
            {
                "x": [packed_times(one) for one in places],
                "window": [end / scale.step for end in window],
                "step": scale.step,
                "log": self._log,
                "panels": panels,
            }
        )
        heads = [panel.head(window) for panel in self.panels]
        return rendered("charts.html", panels=heads, across=scale.axis(self._across), label=label, data=data)

    def plate(self, caption: str) -> Plate:
        """The charts as a figure."""
        return Plate(self.html(caption), caption)
