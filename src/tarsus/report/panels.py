"""Panels of lines, bars and words as SVG text, written directly.

A run's report has a dozen of them, all alike: to load a general library and have it lay them out takes most of the
report's time. Methods that matplotlib's axes have too are called and used as those are, so that what draws on one
draws on the other.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np
import numpy.typing as npt

from tarsus.report.style import BOTTOM, INK, LEFT, LEGEND_ROW, MUTED, RIGHT, WIDTH_IN

__all__ = ["Dash", "Drawing", "Panel", "stack"]

Floats = npt.NDArray[np.float64]
Dash = str | tuple[int, tuple[float, ...]]
"""Solid as ``"-"``, else (0, (drawn, left out, ...)) in widths of the line."""

POINTS = 72.0
"""An inch. Everything in the drawing is in points, from its upper left corner."""
SIZE = 8.0
"""Height of letters."""
LETTER = 0.56 * SIZE
"""Room for a letter in legends: the mean width of those of the page's fonts."""
MARGIN = 0.05
"""Part of the span of the values that is left free above and below them."""
TICK = 3.0
ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Steps from number to number along an axis, times a power of ten; with fewer a low panel has a single one."""
HANDLE = 1.6 * SIZE
"""Length of the line beside its name in a legend."""


@dataclass(frozen=True)
class _Line:
    x: Floats
    y: Floats
    color: str
    lw: float
    ls: Dash
    alpha: float


@dataclass(frozen=True)
class _Area:
    """A polygon, or a bar from top to bottom where y is None."""

    x: Floats
    y: Floats | None
    color: str
    edge: str
    lw: float


@dataclass(frozen=True)
class _Mark:
    """A marker: 'o' or '^'."""

    x: float
    y: float
    shape: str
    size: float
    color: str
    edge: str


@dataclass(frozen=True)
class _Words:
    x: float
    y: float
    text: str
    color: str
    size: float
    halo: bool


_Item = _Line | _Area | _Mark | _Words


@dataclass
class Panel:
    """One set of axes at (left, top), width x height [pt]; ``x`` are the limits that panels of one stack share."""

    left: float
    top: float
    width: float
    height: float
    x: dict[str, tuple[float, float]]
    bare: bool = False
    lowest: bool = True
    _items: list[tuple[float, _Item]] = field(default_factory=list)
    _named: list[tuple[str, str, float, Dash, bool]] = field(default_factory=list)
    _legend: tuple[int, list[tuple[str, str, float, Dash, bool]]] | None = None
    _y: tuple[float | None, float | None] = (None, None)
    _margin: float = MARGIN
    _most: int = 6
    _names: Sequence[tuple[float, str]] | None = None
    _labels: dict[str, str] = field(default_factory=dict)
    _small: float = SIZE

    def plot(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, lw: float = 1.1, ls: Dash = "-", label: str = "",
        alpha: float = 1.0, zorder: float = 2.0,
    ) -> None:  # fmt: skip
        """A line through points; it is broken where one of them is NaN."""
        item = _Line(np.asarray(x, dtype=float), np.asarray(y, dtype=float), color, lw, ls, alpha)
        self._items.append((zorder, item))
        self._name(label, color, lw, ls, False)

    def axhline(self, y: float, *, color: str, lw: float, ls: Dash = "-", zorder: float = 2.0) -> None:
        """A level line from end to end."""
        self._items.append(
            (zorder, _Line(np.array([-math.inf, math.inf]), np.array([y, y]), color, lw, ls, 1.0))
        )

    def axvspan(self, start: float, end: float, *, color: str, lw: float = 0.0, zorder: float = 1.0) -> None:
        """A bar from bottom to top."""
        self._items.append((zorder, _Area(np.array([start, end]), None, color, "none", lw)))

    def broken_barh(
        self, spans: Sequence[tuple[float, float]], place: tuple[float, float], *, color: str, lw: float = 0.0,
        label: str = "", zorder: float = 1.0,
    ) -> None:  # fmt: skip
        """Bars by (start, length), between ``place[0]`` and ``place[0] + place[1]``."""
        low, high = place[0], place[0] + place[1]
        for start, length in spans:
            corners = np.array([start, start + length, start + length, start])
            self._items.append((zorder, _Area(corners, np.array([low, low, high, high]), color, "none", lw)))
        self._name(label, color, 0.0, "-", True)

    def polygon(self, points: Floats, *, fill: str, edge: str, lw: float, zorder: float) -> None:
        """A closed polygon through points (n, 2)."""
        self._items.append((zorder, _Area(points[:, 0], points[:, 1], fill, edge, lw)))

    def marker(
        self, x: float, y: float, shape: str, *, size: float, fill: str, edge: str, zorder: float
    ) -> None:
        """A circle, ``"o"``, or a triangle, ``"^"``, of a width [pt]."""
        self._items.append((zorder, _Mark(x, y, shape, size, fill, edge)))

    def text(
        self, x: float, y: float, words: str, *, color: str, size: float = SIZE, halo: bool = False
    ) -> None:
        """Words about a point, on white where there is a halo."""
        self._items.append((3.0, _Words(x, y, words, color, size, halo)))

    def set_xlim(self, low: float, high: float) -> None:
        self.x["limits"] = (low, high)

    def set_ylim(self, bottom: float | None = None, top: float | None = None) -> None:
        self._y = (self._y[0] if bottom is None else bottom, self._y[1] if top is None else top)

    def get_ylim(self) -> tuple[float, float]:
        """Limits as set, else about all lines."""
        values = [item.y for _, item in self._items if isinstance(item, _Line)]
        known = np.concatenate([np.zeros(0), *values])
        known = known[np.isfinite(known)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
        room = self._margin * ((high - low) or abs(high) or 1.0)
        low, high = low - room, high + room
        return (low if self._y[0] is None else self._y[0], high if self._y[1] is None else self._y[1])

    def set_yticks(self, places: npt.ArrayLike, names: Sequence[str], *, size: float = SIZE) -> None:
        """Names in place of numbers, without ticks."""
        self._names = list(zip(np.asarray(places, dtype=float).tolist(), names, strict=True))
        self._small = size

    def margins(self, *, y: float) -> None:
        self._margin = y

    def few_ticks(self, y: int) -> None:
        """At most so many intervals between numbers."""
        self._most = y

    def set_xlabel(self, words: str) -> None:
        self._labels["x"] = words

    def set_ylabel(self, words: str) -> None:
        self._labels["y"] = words

    def set_title(self, words: str, *, centred: bool = False) -> None:
        self._labels["centred" if centred else "title"] = words

    def legend(self, columns: int, *, contact: str = "", ground: bool = False) -> None:
        """Names above the panel, in the order of what they name; ``contact``: colour of the shading for it."""
        more: list[tuple[str, str, float, Dash, bool]] = []
        if contact:
            more.append(("contact", contact, 0.0, "-", True))
        if ground:
            more.append(("ground", INK, 0.7, (0, (5, 3)), False))
        self._legend = columns, more

    def _name(self, label: str, color: str, lw: float, ls: Dash, area: bool) -> None:
        if label and not label.startswith("_"):
            self._named.append((label, color, lw, ls, area))

    def svg(self, clip: str) -> Iterator[str]:
        """Its elements; ``clip`` is the id of its frame."""
        low, high = self.get_ylim()
        first, last = self.x.get("limits", (0.0, 1.0))

        def place(x: Floats, y: Floats) -> Floats:
            across = self.left + (x - first) * (self.width / ((last - first) or 1.0))
            down = self.top + (high - y) * (self.height / ((high - low) or 1.0))
            return np.column_stack([across, down])

        frame = _rect(self.left, self.top, self.width, self.height)
        yield f'<clipPath id="{clip}">{frame}/></clipPath><g clip-path="url(#{clip})">'
        for _, item in sorted(self._items, key=lambda one: one[0]):
            yield _drawn(item, place, self)
        yield "</g>"
        if not self.bare:
            yield from self._axes(place, (low, high), (first, last))
        yield from self._titles()
        if self._legend is not None:
            yield from self._names_above(*self._legend)

    def _axes(
        self, place: Callable[[Floats, Floats], Floats], y: tuple[float, float], x: tuple[float, float]
    ) -> Iterator[str]:
        left, bottom = self.left, self.top + self.height
        ends = f"M{left:.1f} {self.top:.1f}V{bottom:.1f}H{left + self.width:.1f}"
        ticks: list[str] = []
        if self._names is None:
            for at, name in _ticks(*y, self._most):
                down = float(place(np.zeros(1), np.array([at]))[0, 1])
                ticks.append(f"M{left:.1f} {down:.1f}h-{TICK:g}")
                yield _text(left - 2.0 * TICK, down + 0.36 * SIZE, name, anchor="end")
        else:
            for at, name in self._names:
                down = float(place(np.zeros(1), np.array([at]))[0, 1])
                yield _text(left - TICK, down + 0.36 * self._small, name, anchor="end", size=self._small)
        for at, name in _ticks(*x, 9) if self.lowest else ():
            across = float(place(np.array([at]), np.zeros(1))[0, 0])
            ticks.append(f"M{across:.1f} {bottom:.1f}v{TICK:g}")
            yield _text(across, bottom + 2.0 * TICK + 0.75 * SIZE, name)
        yield f'<path d="{ends}{"".join(ticks)}" fill="none" stroke="{MUTED}" stroke-width=".6"/>'

    def _titles(self) -> Iterator[str]:
        middle = self.left + 0.5 * self.width
        if "x" in self._labels:
            yield _text(middle, self.top + self.height + 0.26 * POINTS + 0.75 * SIZE, self._labels["x"])
        if "y" in self._labels:
            lines = self._labels["y"].split("\n")
            for row, words in enumerate(reversed(lines)):
                across = self.left - 0.47 * POINTS - 1.2 * SIZE * row
                yield _text(across, self.top + 0.5 * self.height, words, turned=True)
        if "title" in self._labels:
            yield _text(self.left, self.top - 0.3 * SIZE, self._labels["title"], anchor="start")
        if "centred" in self._labels:
            yield _text(middle, self.top - 0.6 * SIZE, self._labels["centred"])

    def _names_above(self, columns: int, more: list[tuple[str, str, float, Dash, bool]]) -> Iterator[str]:
        entries = self._named + more
        rows = -(-len(entries) // columns)
        for row in range(rows):
            across, down = self.left + 1.0, self.top - (0.35 + rows - 1 - row) * LEGEND_ROW * POINTS
            for name, color, lw, ls, area in entries[row * columns : (row + 1) * columns]:
                if area:
                    yield f'{_rect(across, down - 0.35 * SIZE, HANDLE, 0.7 * SIZE)} fill="{color}"/>'
                else:
                    yield f'<path d="M{across:.1f} {down:.1f}h{HANDLE:g}"{_stroke(color, lw, ls)}/>'
                across += HANDLE + 0.5 * SIZE
                yield _text(across, down + 0.36 * SIZE, name, anchor="start")
                across += LETTER * len(name) + 1.4 * SIZE


class Drawing:
    """Panels on a sheet of so many inches."""

    def __init__(self, width_in: float, height_in: float) -> None:
        self._size = width_in * POINTS, height_in * POINTS
        self._panels: list[Panel] = []

    def add(
        self,
        left: float,
        top: float,
        width: float,
        height: float,
        *,
        shared: Panel | None = None,
        bare: bool = False,
    ) -> Panel:
        """A panel at a place [inch], which shares its horizontal axis; a bare one has no axes."""
        x = {} if shared is None else shared.x
        panel = Panel(left * POINTS, top * POINTS, width * POINTS, height * POINTS, x, bare)
        self._panels.append(panel)
        return panel

    def svg(self, label: str) -> str:
        """One `<svg>` element for inline use; the same drawing always gives the same text, ids are of its content."""
        body = "\n".join(
            part for number, panel in enumerate(self._panels) for part in panel.svg(f"@{number}")
        )
        body = body.replace('"@', f'"f{zlib.crc32(body.encode()):08x}-').replace(
            "(#@", f"(#f{zlib.crc32(body.encode()):08x}-"
        )
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self._size[0]:g} {self._size[1]:.1f}" role="img" '
            f'aria-label="{escape(label)}" font-size="{SIZE:g}" fill="{INK}" stroke-linejoin="round">\n{body}\n</svg>'
        )


def stack(
    heights_in: Sequence[float], gap_in: float = 0.14, legend_rows: int = 0
) -> tuple[Drawing, list[Panel]]:
    """A drawing of panels above each other, with one horizontal axis, of the given heights [inch].

    `legend_rows` leaves room above the first panel.
    """
    top = 0.06 + LEGEND_ROW * legend_rows
    drawing = Drawing(WIDTH_IN, top + sum(heights_in) + gap_in * (len(heights_in) - 1) + BOTTOM)
    panels: list[Panel] = []
    for height in heights_in:
        first = panels[0] if panels else None
        panels.append(drawing.add(LEFT, top, WIDTH_IN - LEFT - RIGHT, height, shared=first))
        panels[-1].lowest = len(panels) == len(heights_in)
        top += height + gap_in
    return drawing, panels


def _ticks(low: float, high: float, most: int) -> Iterator[tuple[float, str]]:
    """Round numbers between the limits, at most so many intervals apart, and their texts."""
    low, high = min(low, high), max(low, high)
    if not high > low:
        return
    rough = (high - low) / most
    power = math.floor(math.log10(rough))
    factor = next(f for f in ROUND if f * 10.0**power >= rough * (1.0 - 1e-9))
    step = factor * 10.0**power
    digits = max(0, -power + (factor % 1.0 > 0.0) - (factor == 10.0))
    for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1):
        yield k * step, f"{k * step:.{digits}f}".replace("-", "−")


def _drawn(item: _Item, place: Callable[[Floats, Floats], Floats], panel: Panel) -> str:
    if isinstance(item, _Line):
        ends = place(item.x, item.y)
        ends[:, 0] = (
            np.clip(ends[:, 0], panel.left, panel.left + panel.width)
            if np.isinf(item.x).any()
            else ends[:, 0]
        )
        fade = f' stroke-opacity="{item.alpha:g}"' if item.alpha < 1.0 else ""
        return f'<path d="{_path(ends)}"{_stroke(item.color, item.lw, item.ls)}{fade}/>'
    if isinstance(item, _Area):
        if item.y is None:
            start, end = place(item.x, np.zeros(2))[:, 0].tolist()
            return f'{_rect(start, panel.top, end - start, panel.height)} fill="{item.color}"/>'
        edge = "" if item.edge == "none" else f' stroke="{item.edge}" stroke-width="{item.lw:g}"'
        return f'<path d="{_path(place(item.x, item.y))}Z" fill="{item.color}"{edge}/>'
    ((x, y),) = place(np.array([item.x]), np.array([item.y])).tolist()
    if isinstance(item, _Words):
        return _text(x, y + 0.36 * item.size, item.text, color=item.color, size=item.size, halo=item.halo)
    look = f'fill="{item.color}" stroke="{item.edge}" stroke-width=".8"'
    r = 0.5 * item.size
    if item.shape == "o":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.2g}" {look}/>'
    return f'<path d="M{x:.1f} {y - r:.1f}l{r:.2g} {2 * r:.2g}h-{2 * r:.2g}Z" {look}/>'


def _path(points: Floats) -> str:
    """Through points (n, 2) [pt] to a tenth; broken at NaN, without those in the middle of level stretches."""
    whole = np.isfinite(points).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]])))
    parts = []
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        part = np.round(points[a:b], 1)
        level = (part[1:-1, 1] == part[:-2, 1]) & (part[1:-1, 1] == part[2:, 1])
        kept = part[np.concatenate([[True], ~level, [True]])] if len(part) > 2 else part
        parts.append("M" + " ".join(f"{x:g} {y:g}" for x, y in kept.tolist()))
    return "".join(parts)


def _stroke(color: str, lw: float, ls: Dash) -> str:
    dash = (
        "" if isinstance(ls, str) else f' stroke-dasharray="{" ".join(f"{part * lw:.3g}" for part in ls[1])}"'
    )
    return f' fill="none" stroke="{color}" stroke-width="{lw:g}"{dash}'


def _rect(x: float, y: float, width: float, height: float) -> str:
    return f'<rect x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}"'


def _text(
    x: float, y: float, words: str, *, anchor: str = "middle", color: str = INK, size: float = SIZE, halo: bool = False,
    turned: bool = False,
) -> str:  # fmt: skip
    look = f' text-anchor="{anchor}"' if anchor != "start" else ""
    look += f' fill="{color}"' if color != INK else ""
    look += f' font-size="{size:g}"' if size != SIZE else ""
    look += ' stroke="white" stroke-width="2.5" paint-order="stroke"' if halo else ""
    look += f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turned else ""
    return f'<text x="{x:.1f}" y="{y:.1f}"{look}>{escape(words)}</text>'
