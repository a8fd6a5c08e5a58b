"""Pictures of lines, shapes and words as SVG text: a robot on its feet, a turn of its drive.

What is drawn over time is drawn by `charts`; nothing here has axes.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from html import escape

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from tarsus.report.style import INK, themed

__all__ = ["Drawing", "Panel"]

Floats = npt.NDArray[np.float64]
Dash = str | tuple[int, tuple[float, ...]]
"""Solid as ``"-"``, else (0, (drawn, left out, ...)) in widths of the line."""

POINTS = 72.0
"""An inch. Everything in the drawing is in points, from its upper left corner."""
SIZE = 8.0
"""Height of letters."""


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
    """A polygon."""

    x: Floats
    y: Floats
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
    """One picture at (left, top), width x height [pt], with limits of what it shows."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float] = (0.0, 1.0)
    y: tuple[float, float] = (0.0, 1.0)
    _items: list[tuple[float, _Item]] = field(default_factory=list)
    _title: tuple[str, bool] = ("", False)

    def plot(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, color: str, lw: float = 1.1, ls: Dash = "-",
        alpha: float = 1.0, zorder: float = 2.0,
    ) -> None:  # fmt: skip
        """A line through points; it is broken where one of them is NaN."""
        item = _Line(np.asarray(x, dtype=float), np.asarray(y, dtype=float), color, lw, ls, alpha)
        self._items.append((zorder, item))

    def axhline(self, y: float, *, color: str, lw: float, ls: Dash = "-", zorder: float = 2.0) -> None:
        """A level line from end to end."""
        self.plot(np.array([-np.inf, np.inf]), np.array([y, y]), color=color, lw=lw, ls=ls, zorder=zorder)

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
        self.x = (low, high)

    def set_ylim(self, low: float, high: float) -> None:
        self.y = (low, high)

    def set_title(self, words: str, *, centred: bool = False) -> None:
        self._title = (words, centred)

    def svg(self, clip: str) -> Iterator[str]:
        """Its elements; ``clip`` is the id of its frame."""
        (low, high), (first, last) = self.y, self.x

        def place(x: Floats, y: Floats) -> Floats:
            across = self.left + (x - first) * (self.width / ((last - first) or 1.0))
            down = self.top + (high - y) * (self.height / ((high - low) or 1.0))
            return np.column_stack([across, down])

        frame = _rect(self.left, self.top, self.width, self.height)
        yield f'<clipPath id="{clip}">{frame}/></clipPath><g clip-path="url(#{clip})">'
        for _, item in sorted(self._items, key=lambda one: one[0]):
            yield _drawn(item, place, self)
        yield "</g>"
        words, centred = self._title
        if centred:
            yield _text(self.left + 0.5 * self.width, self.top - 0.6 * SIZE, words)
        elif words:
            yield _text(self.left, self.top - 0.3 * SIZE, words, anchor="start")


class Drawing:
    """Panels on a sheet of so many inches."""

    def __init__(self, width_in: float, height_in: float) -> None:
        self._size = width_in * POINTS, height_in * POINTS
        self._panels: list[Panel] = []

    def add(self, left: float, top: float, width: float, height: float) -> Panel:
        """A panel at a place [inch]."""
        self._panels.append(Panel(left * POINTS, top * POINTS, width * POINTS, height * POINTS))
        return self._panels[-1]

    def svg(self, label: str) -> Markup:
        """One `<svg>` element for inline use; the same drawing always gives the same text, ids are of its content."""
        body = "\n".join(
            part for number, panel in enumerate(self._panels) for part in panel.svg(f"@{number}")
        )
        body = body.replace('"@', f'"f{zlib.crc32(body.encode()):08x}-').replace(
            "(#@", f"(#f{zlib.crc32(body.encode()):08x}-"
        )
        whole = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self._size[0]:g} {self._size[1]:.1f}" role="img" '
            f'aria-label="{escape(label)}" font-size="{SIZE:g}" fill="{INK}" stroke-linejoin="round">\n{body}\n</svg>'
        )
        return themed(whole)


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
    x: float, y: float, words: str, *, anchor: str = "middle", color: str = INK, size: float = SIZE, halo: bool = False
) -> str:  # fmt: skip
    look = f' text-anchor="{anchor}"' if anchor != "start" else ""
    look += f' fill="{color}"' if color != INK else ""
    look += f' font-size="{size:g}"' if size != SIZE else ""
    look += ' stroke="#ffffff" stroke-width="2.5" paint-order="stroke"' if halo else ""
    return f'<text x="{x:.1f}" y="{y:.1f}"{look}>{escape(words)}</text>'
