"""Panels over time below each other, which a page draws with uPlot: lines, bars, shading, and what they are called.

All numbers are SI; each axis shows its own under a prefix. Methods that matplotlib's axes have too are called as those
are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal

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
from tarsus.tables.numbers import number, pretty_unit

Window = tuple[float, float]
"""Start and end of a stretch of an axis, most often of time [s]."""

Dash = str | tuple[int, tuple[float, ...]]
"""Solid as ``"-"``, else (0, (drawn, left out, ...)) in widths of the line."""

PIXELS = 118.0
"""Pixels of a panel's inch: figures of 7.4 inch fill the page's width."""

AXIS = 26
"""Height of the numbers below the lowest panel [pixels]."""

LETTER, SHORT = 7.0, 3
"""Height of a letter of a name that stands upright below an axis [pixels]; names up to so many letters lie."""

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
    sparse: bool = False
    hidden: bool = False

    def inside(self, window: Window | None) -> _Line:
        """What is seen of it within a window."""
        if window is None:
            return self
        part = samples_inside(self.x, window)
        return replace(self, x=self.x[part], y=self.y[part])


@dataclass
class _Between:
    """What lies between two hidden lines: an area, or an interval about every dot of a line."""

    low: _Line
    high: _Line
    of: _Line | None
    alpha: float


@dataclass
class ChartPanel:
    """One panel of a height [pixels]."""

    height: float
    _lines: list[_Line] = field(default_factory=list)
    _between: list[_Between] = field(default_factory=list)
    _shaded: list[Window] = field(default_factory=list)
    _bars: list[tuple[str, float, float, Sequence[Window]]] = field(default_factory=list)
    _levels: list[tuple[float, str, float, list[float]]] = field(default_factory=list)
    _signs: list[dict[str, Any]] = field(default_factory=list)
    _limits: tuple[float | None, float | None] = (None, None)
    _names: list[tuple[float, str]] | None = None
    _label: tuple[str, str] = ("", "")
    _log: bool = False
    _bend: float | None = None
    _texts: list[tuple[float, float, str]] = field(default_factory=list)

    def plot(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, lw: float = 1.1, ls: Dash = "-", label: str = "",
        alpha: float = 1.0, zorder: float = 2.0,
    ) -> None:  # fmt: skip
        """A line through points (n,); it is broken where y is NaN. Where x turns, another line of that name goes on."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        if not len(x):
            return
        for part, back in _rising(x):
            step = -1 if back else 1
            self._lines.append(
                _Line(
                    x[part][::step], y[part][::step], paint_of(color), lw, _dash(ls, lw), label, alpha, zorder
                )
            )

    def dots(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, label: str = "", low: npt.ArrayLike | None = None,
        high: npt.ArrayLike | None = None, sparse: bool = False,
    ) -> None:  # fmt: skip
        """A dot at each point (n,), with its interval if low and high (n,) are given; sparse: of those that lie close
        together on the screen only some, until one zooms in."""
        x = np.asarray(x, dtype=float)
        order = np.argsort(x, kind="stable")
        if not len(x):
            return

        def line(values: npt.ArrayLike, **look: bool) -> _Line:
            row = np.asarray(values, dtype=float)[order]
            self._lines.append(_Line(x[order], row, paint_of(color), 1.0, [], label, 1.0, 3.0, **look))
            return self._lines[-1]

        of = line(y, dots=True, sparse=sparse)
        if low is not None and high is not None:
            self._between.append(_Between(line(low, hidden=True), line(high, hidden=True), of, 1.0))

    def fill_between(
        self, x: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike, *, color: str, alpha: float = 0.25
    ) -> None:
        """An area between two lines through points (n,), x rising."""
        x = np.asarray(x, dtype=float)
        lower, upper = (
            _Line(x, np.broadcast_to(np.asarray(values, dtype=float), x.shape), paint_of(color), 0.0, [], "", alpha,
                  1.0, hidden=True)
            for values in (low, high)
        )  # fmt: skip
        self._lines += [lower, upper]
        self._between.append(_Between(lower, upper, None, alpha))

    def annotate(self, text: str, xy: tuple[float, float]) -> None:
        """A word just above a point."""
        self._texts.append((*xy, text))

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

    def set_yscale(self, kind: Literal["log", "asinh"], *, linear_width: float = 1.0) -> None:
        """A logarithmic axis, on which what is not above 0 is left out; or one that is linear up to a width only."""
        self._log, self._bend = kind == "log", linear_width if kind == "asinh" else None

    def set_yticks(self, places: npt.ArrayLike, names: Sequence[str]) -> None:
        """Names in place of numbers."""
        self._names = list(zip(np.asarray(places, dtype=float).tolist(), names, strict=True))

    def set_ylabel(self, words: str, unit: str = "") -> None:
        """What its numbers are, and the SI unit that they are in."""
        self._label = (words, unit)

    def sign(self, name: str, color: str = INK, *, area: bool = False) -> None:
        """A name for what is no line: shading (``area``), or a dashed level."""
        self._signs.append({"name": name, "area": area, "paint": f"var(--{paint_of(color)})"})

    def _ordered(self) -> list[_Line]:
        return sorted(self._lines, key=lambda line: line.order)

    def seen(self, window: Window | None) -> tuple[list[_Line], AxisScale]:
        """Its lines within a window, those in front last, and the prefix of their numbers."""
        lines = [line.inside(window) for line in self._ordered()]
        return lines, AxisScale(1.0, pretty_unit(self._label[1])) if self._log else scale_of(
            self._label[1], *(line.y for line in lines)
        )

    def spec(self, window: Window, step: float, places: list[Floats]) -> dict[str, Any]:
        """All that the script draws, x in parts of `step`; its times are added to `places` unless they are there."""
        lines, scale = self.seen(window)
        x, rows = _columns(lines, window)
        x, rows = x / step, rows / scale.step
        low, high = (None if one is None else one / scale.step for one in self._limits)
        if self._log:
            rows = np.log10(np.where(rows > 0.0, rows, np.nan))
        limits = (level_limits(rows) if not self._log and low is None and high is None else None) or (
            low,
            high,
        )
        where = next((i for i, one in enumerate(places) if np.array_equal(one, x)), len(places))
        if where == len(places):
            places.append(x)
        drawn = [
            {"color": line.color, "width": line.width, "dash": line.dash, "alpha": line.alpha,
             "dots": line.dots, "sparse": line.sparse, "hidden": line.hidden, "values": packed(row, 16, gaps=True)}
            for line, row in zip(lines, rows, strict=True)
        ]  # fmt: skip
        bars = [
            {
                "color": color,
                "low": a / scale.step,
                "high": b / scale.step,
                "spans": _inside(spans, window, step),
            }
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
            "texts": [(a / step, b / scale.step, text) for a, b, text in self._texts],
            "between": self._areas(), "log": self._log, "apart": _apart(lines),
            "bend": None if self._bend is None else self._bend / scale.step,
        }  # fmt: skip

    def _areas(self) -> list[dict[str, Any]]:
        """What lies between lines, by their places in `spec`."""
        place = {id(line): i for i, line in enumerate(self._ordered(), 1)}
        return [
            {"low": place[id(one.low)], "high": place[id(one.high)], "color": one.low.color, "alpha": one.alpha,
             "of": one.of and place[id(one.of)]}
            for one in self._between
        ]  # fmt: skip

    def head(self, window: Window) -> dict[str, Any]:
        """What stands above the panel: what its numbers are, names of lines with the places in `spec` of all that bear
        it, and for those without a script name, least and largest value of each."""
        lines, scale = self.seen(window)
        named: dict[str, list[int]] = {}
        for place, line in enumerate(lines, 1):
            if not line.hidden:
                named.setdefault(line.name or f"\0{place}", []).append(place)
        parts = [[lines[place - 1] for place in places] for places in named.values()]
        known = [(part[0].name, np.concatenate([one.y for one in part]) / scale.step) for part in parts]
        finite = [(name, y[np.isfinite(y)]) for name, y in known]
        return {
            "label": scale.axis(self._label[0]), "signs": self._signs, "height": round(self.height),
            "lines": [
                {
                    "name": part[0].name, "paint": f"var(--{part[0].color})", "width": part[0].width,
                    "dash": part[0].dash, "dots": part[0].dots, "places": " ".join(map(str, places)),
                }
                for part, places in zip(parts, named.values(), strict=True)
            ],
            "ends": [(name, number(float(y.min())), number(float(y.max()))) for name, y in finite if len(y)],
        }  # fmt: skip


def _dash(ls: Dash, width: float) -> list[float]:
    return [] if isinstance(ls, str) else [round(part * width * 1.5, 2) for part in ls[1]]


def _rising(x: Floats) -> list[tuple[slice, bool]]:
    """Stretches in which x (n,) does not turn, each from the end of the one before, and whether it falls there."""
    if np.all(np.diff(x) >= 0.0):
        return [(slice(0, len(x)), False)]
    signs = np.sign(np.diff(x))
    going = signs[np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), 0))]
    ends = [0, *(np.flatnonzero(np.diff(going)) + 1).tolist(), len(x) - 1]
    return [(slice(a, b + 1), bool(going[a] < 0.0)) for a, b in pairwise(ends)]


def _inside(stretches: Iterable[Window], window: Window, step: float) -> list[Window]:
    """Those that reach into a window."""
    seen = [(a, b) for a, b in stretches if b > window[0] and a < window[1]]
    return [(float(f"{a / step:.7g}"), float(f"{b / step:.7g}")) for a, b in seen]


def _columns(lines: Sequence[_Line], window: Window) -> tuple[Floats, Floats]:
    """Lines at common times: (n,) and (lines, n), thinned to what a page can hold."""
    if not lines:
        return np.array(window), np.zeros((0, 2))
    x = lines[0].x
    if _apart(lines):
        return _beside(lines)
    if all(np.array_equal(line.x, x) for line in lines[1:]):
        rows = np.stack([line.y for line in lines])
    else:
        x = np.unique(np.concatenate([line.x for line in lines]))
        rows = np.stack([np.interp(x, line.x, line.y) for line in lines])
    return thinned(*upright(x, rows), max(400, min(POINTS, NUMBERS // len(rows))))


def _apart(lines: Sequence[_Line]) -> bool:
    """Whether each line has numbers at its own places alone: dots have none between theirs, nor parts of a line."""
    names = [line.name for line in lines if line.name and not line.hidden]
    return any(line.dots for line in lines) or len(names) > len(set(names))


def _beside(lines: Sequence[_Line]) -> tuple[Floats, Floats]:
    """Dots and lines at the places of all, each with numbers at its own alone; lines go on over the others'."""
    own: list[tuple[Floats, list[int]]] = []
    for i, line in enumerate(lines):
        same = next((rows for x, rows in own if np.array_equal(x, line.x)), None)
        if same is None:
            own.append((line.x, [i]))
        else:
            same.append(i)
    places = np.concatenate([x for x, _ in own])
    values = np.full((len(lines), len(places)), np.nan)
    first = 0
    for x, rows in own:
        for i in rows:
            values[i, first : first + len(x)] = lines[i].y
        first += len(x)
    order = np.argsort(places, kind="stable")
    return places[order], values[:, order]


def with_room(low: float, high: float, *, log: bool = False) -> Window:
    """A window with room for the dots at both of its ends."""
    if log and low > 0.0:
        beyond = (high / low) ** 0.03 if high > low else 1.1
        return low / beyond, high * beyond
    beyond = 0.03 * (high - low) or 0.05 * abs(high) or 1.0
    return low - beyond, high + beyond


class Charts:
    """Panels below each other, of the given heights [inch of a page 7.4 inch wide], with one horizontal axis.

    across, unit: what that axis is, and the SI unit of its numbers; window: its stretch that is shown, all without;
    log: whether it is logarithmic; rows: names of the places 0, 1, ... on it, which are not numbers then.
    """

    def __init__(
        self, heights: Sequence[float], across: str = "time", unit: str = "s", window: Window | None = None,
        *, log: bool = False, rows: Sequence[str] | None = None,
    ) -> None:  # fmt: skip
        self.panels = [ChartPanel(PIXELS * height) for height in heights]
        longest = max(map(len, rows or ()), default=0)
        self.panels[-1].height += AXIS if longest <= SHORT else LETTER * longest + 10.0
        if rows is not None and window is None:
            window = (-0.5, len(rows) - 0.5)
        self._across, self._unit, self._window, self._log, self._rows = across, unit, window, log, rows

    def html(self, label: str) -> Markup:
        """The charts for a page; ``label`` tells those who do not see them what they show."""
        window = self._window
        if window is None:
            every = [line.x for panel in self.panels for line in panel.seen(None)[0] if len(line.x)]
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
                "rows": self._rows,
                "panels": panels,
            }
        )
        heads = [panel.head(window) for panel in self.panels]
        return rendered("charts.html", panels=heads, across=scale.axis(self._across), label=label, data=data)

    def plate(self, caption: str) -> Plate:
        """The charts as a figure."""
        return Plate(self.html(caption), caption)
