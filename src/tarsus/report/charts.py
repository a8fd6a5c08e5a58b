"""Panels over time below each other, which a page draws with uPlot: lines, bars, shading, and what they are called.

Methods that matplotlib's axes have too are called and used as those are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from tarsus.report.packing import packed, packed_times, script_text
from tarsus.report.pages import rendered
from tarsus.report.style import CONTACT, INK, level_limits, paint_of, thinned, upright
from tarsus.tables.numbers import number

Floats = npt.NDArray[np.float64]
Dash = str | tuple[int, tuple[float, ...]]
"""Solid as ``"-"``, else (0, (drawn, left out, ...)) in widths of the line."""

PIXELS = 118.0
"""Pixels of a panel's inch: figures of 7.4 inch fill the page's width."""

AXIS = 26
"""Height of the numbers below the lowest panel [pixels]."""

POINTS = 5000
"""Samples of a line at most: a zoom of three still shows every pixel's."""

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


@dataclass
class ChartPanel:
    """One panel of a height [pixels]; ``window`` is the stretch that panels of one stack share."""

    height: float
    window: dict[str, tuple[float, float]]
    _lines: list[_Line] = field(default_factory=list)
    _shaded: list[tuple[float, float]] = field(default_factory=list)
    _bars: list[dict[str, Any]] = field(default_factory=list)
    _levels: list[dict[str, Any]] = field(default_factory=list)
    _signs: list[dict[str, Any]] = field(default_factory=list)
    _limits: tuple[float | None, float | None] = (None, None)
    _names: list[tuple[float, str]] | None = None
    _labels: dict[str, str] = field(default_factory=dict)
    _log: bool = False

    def plot(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, lw: float = 1.1, ls: Dash = "-", label: str = "",
        alpha: float = 1.0, zorder: float = 2.0,
    ) -> None:  # fmt: skip
        """A line through points (n,), x rising; it is broken where y is NaN."""
        dash = [] if isinstance(ls, str) else [round(part * lw * 1.5, 2) for part in ls[1]]
        name = "" if label.startswith("_") else label
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        self._lines.append(_Line(x, y, paint_of(color), lw, dash, name, alpha, zorder))

    def dots(self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, label: str = "") -> None:
        """A dot at each point (n,), x rising."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        self._lines.append(_Line(x, y, paint_of(color), 1.0, [], label, 1.0, 3.0, dots=True))

    def axhline(self, y: float, *, color: str, lw: float, ls: Dash = "-", zorder: float = 0.0) -> None:
        """A level line from end to end, below the others."""
        dash = [] if isinstance(ls, str) else [part * lw * 1.5 for part in ls[1]]
        self._levels.append({"at": float(y), "color": paint_of(color), "width": lw, "dash": dash})

    def axvspan(
        self, start: float, end: float, *, color: str = CONTACT, lw: float = 0, zorder: float = 0
    ) -> None:
        """A stretch shaded from bottom to top."""
        self._shaded.append((float(start), float(end)))

    def broken_barh(
        self, spans: Sequence[tuple[float, float]], place: tuple[float, float], *, color: str, lw: float = 0.0,
        label: str = "",
    ) -> None:  # fmt: skip
        """Bars by (start, length), between ``place[0]`` and ``place[0] + place[1]``."""
        if label:
            self._signs.append({"name": label, "area": True, "paint": f"var(--{paint_of(color)})"})
        if spans:
            ends = [(float(f"{a:.7g}"), float(f"{a + long:.7g}")) for a, long in spans]
            low, high = place[0], place[0] + place[1]
            self._bars.append({"color": paint_of(color), "low": low, "high": high, "spans": ends})

    def set_xlim(self, low: float, high: float) -> None:
        self.window["limits"] = (float(low), float(high))

    def set_ylim(self, bottom: float | None = None, top: float | None = None) -> None:
        self._limits = (
            self._limits[0] if bottom is None else float(bottom),
            self._limits[1] if top is None else float(top),
        )

    def least(self) -> float:
        """The least value of all lines; infinity without any."""
        values = [line.y[np.isfinite(line.y)] for line in self._lines]
        return min((float(one.min()) for one in values if len(one)), default=math.inf)

    def set_yticks(self, places: npt.ArrayLike, names: Sequence[str]) -> None:
        """Names in place of numbers."""
        self._names = list(zip(np.asarray(places, dtype=float).tolist(), names, strict=True))

    def set_xlabel(self, words: str) -> None:
        self._labels["x"] = words

    def set_xscale(self, *, log: bool) -> None:
        """Whether the horizontal axis is logarithmic."""
        self._log = log

    def set_ylabel(self, words: str) -> None:
        self._labels["y"] = words

    def sign(self, name: str, color: str = INK, *, area: bool = False) -> None:
        """A name for what is no line: shading (``area``), or a dashed level."""
        self._signs.append({"name": name, "area": area, "paint": f"var(--{paint_of(color)})"})

    def columns(self) -> tuple[Floats, Floats]:
        """Its lines at common times: (n,) and (lines, n), thinned to what a page can hold."""
        if not self._lines:
            return np.array(self.window.get("limits", (0.0, 1.0))), np.zeros((0, 2))
        x = self._lines[0].x
        if any(line.dots for line in self._lines):
            return self._beside()
        if all(np.array_equal(line.x, x) for line in self._lines[1:]):
            rows = np.stack([line.y for line in self._lines])
        else:
            x = np.unique(np.concatenate([line.x for line in self._lines]))
            rows = np.stack([np.interp(x, line.x, line.y) for line in self._lines])
        return thinned(*upright(x, rows), max(400, min(POINTS, NUMBERS // len(rows))))

    def _beside(self) -> tuple[Floats, Floats]:
        """Dots and lines at the places of all, each with numbers at its own alone; lines go on over the others'."""
        x = np.concatenate([line.x for line in self._lines])
        rows = np.full((len(self._lines), len(x)), np.nan)
        first = 0
        for row, line in zip(rows, self._lines, strict=True):
            row[first : first + len(line.x)] = line.y
            first += len(line.x)
        order = np.argsort(x, kind="stable")
        return x[order], rows[:, order]

    def spec(self, places: list[Floats]) -> dict[str, Any]:
        """All that the script draws; the times are added to ``places`` unless they are there."""
        self._lines.sort(key=lambda line: line.order)
        x, rows = self.columns()
        limits = self._limits
        if limits == (None, None) and len(rows) == 1:
            limits = level_limits(rows) or limits
        where = next((i for i, one in enumerate(places) if np.array_equal(one, x)), len(places))
        if where == len(places):
            places.append(x)
        lines = [
            {"color": line.color, "width": line.width, "dash": line.dash, "alpha": line.alpha,
             "dots": line.dots, "values": packed(row, 16, gaps=True)}
            for line, row in zip(self._lines, rows, strict=True)
        ]  # fmt: skip
        return {
            "x": where, "height": round(self.height), "lines": lines, "shaded": self._shaded, "bars": self._bars,
            "levels": self._levels, "limits": limits, "names": self._names,
        }  # fmt: skip

    def head(self) -> dict[str, Any]:
        """What stands above the panel: what its numbers are, and the names of its lines, in the order of `spec`."""
        lines = [
            {
                "name": line.name,
                "paint": f"var(--{line.color})",
                "width": line.width,
                "dash": line.dash,
                "dots": line.dots,
            }
            for line in self._lines
        ]
        height = round(self.height)
        return {"label": self._labels.get("y", ""), "lines": lines, "signs": self._signs, "height": height}

    def ends(self) -> list[tuple[str, str, str]]:
        """Name, least and largest value of each line, for those without a script."""
        known = [(line.name, line.y[np.isfinite(line.y)]) for line in self._lines]
        return [(name, number(float(y.min())), number(float(y.max()))) for name, y in known if len(y)]

    @property
    def log(self) -> bool:
        return self._log

    @property
    def across(self) -> str:
        """What the axis below is."""
        return self._labels.get("x", "")


class Charts:
    """Panels below each other."""

    def __init__(self, heights_in: Sequence[float]) -> None:
        window: dict[str, tuple[float, float]] = {}
        self.panels = [ChartPanel(PIXELS * height, window) for height in heights_in]
        self.panels[-1].height += AXIS
        self._window = window

    def html(self, label: str) -> Markup:
        """The charts for a page; ``label`` tells those who do not see them what they show."""
        places: list[Floats] = []
        panels = [panel.spec(places) for panel in self.panels]
        window = self._window.get("limits") or (float(places[0][0]), float(places[0][-1]))
        data = script_text(
            {
                "x": [packed_times(one) for one in places],
                "window": window,
                "log": self.panels[-1].log,
                "panels": panels,
            }
        )
        heads = [{**panel.head(), "ends": panel.ends()} for panel in self.panels]
        return rendered("charts.html", panels=heads, across=self.panels[-1].across, label=label, data=data)


def stack(heights_in: Sequence[float]) -> tuple[Charts, list[ChartPanel]]:
    """Panels below each other, with one horizontal axis, of the given heights [inch of a page 7.4 inch wide]."""
    charts = Charts(heights_in)
    return charts, charts.panels
