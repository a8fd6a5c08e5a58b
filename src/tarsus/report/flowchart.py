"""A table of transitions as a picture: states as boxes, changes as numbered arrows, their conditions below."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

WIDTH, BOX_WIDTH, BOX_HEIGHT = 900.0, 170.0, 48.0
TOP, BOTTOM, LEGEND, ROW = 52.0, 252.0, 366.0, 24.0
"""Heights of the upper state, of the others, of the first condition, and of a row of conditions."""

APART = 13.0
"""How far an arrow is moved aside, so that there and back are two."""

Transition = tuple[int, int, str, str]
"""Number of the state before and of the one after, name of the event, its condition as a sentence."""


class Point(NamedTuple):
    """A place in the picture, y downward."""

    x: float
    y: float


def flowchart(transitions: Sequence[Transition], names: Mapping[int, str]) -> str:
    """The states of a foot and all that takes it from one to another, as one SVG that stands alone.

    The first state of `names` stands above the others. Arrows bear the numbers of the transitions from 1 in their
    order; the conditions follow below. Equal tables give equal text. Raises KeyError for a state without a name.
    """
    places = _places(list(names))
    arrows: dict[tuple[int, int], list[int]] = {}
    for number, (before, after, _, _) in enumerate(transitions, 1):
        if before not in names or after not in names:
            raise KeyError(after if before in names else before)
        arrows.setdefault((before, after), []).append(number)
    parts: list[str] = []
    for (before, after), numbers in arrows.items():
        path, label, anchor = (
            _loop(places[before]) if before == after else _straight(places[before], places[after])
        )
        parts.append(f'<path d="{path}" class="arrow" marker-end="url(#tip)"/>')
        parts += _label(label, anchor, [(number, transitions[number - 1][2]) for number in numbers])
    for state, name in names.items():
        x, y = places[state]
        parts.append(
            f'<rect x="{x - BOX_WIDTH / 2:.0f}" y="{y - BOX_HEIGHT / 2:.0f}" width="{BOX_WIDTH:.0f}" '
            f'height="{BOX_HEIGHT:.0f}" rx="12" class="state"/>'
        )
        parts.append(f'<text x="{x:.0f}" y="{y + 5:.0f}" class="name">{escape(name)}</text>')
    for row, (before, after, event, condition) in enumerate(transitions):
        parts += _row(row, f"{names[before]} → {names[after]}", event, condition)
    height = LEGEND + ROW * len(transitions)
    title = "States of a foot and what takes it from one to the next"
    return "\n".join([_HEAD.format(width=WIDTH, height=height, title=title), *parts, "</svg>", ""])


_HEAD = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" \
aria-label="{title}">
<title>{title}</title>
<style>
text {{ font: 14px system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; fill: #1f2328; }}
.name {{ font-weight: 600; text-anchor: middle; }}
.quiet {{ fill: #5f6773; }}
.number {{ font-size: 12px; fill: #fff; text-anchor: middle; }}
.end {{ text-anchor: end; }}
.middle {{ text-anchor: middle; }}
.state {{ fill: #eef3f7; stroke: #1f2328; stroke-width: 1.4; }}
.arrow {{ fill: none; stroke: #5f6773; stroke-width: 1.6; }}
.disc {{ fill: #005a8c; }}
</style>
<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" orient="auto">\
<path d="M0 1L9 5L0 9z" fill="#5f6773"/></marker></defs>
<rect width="{width:.0f}" height="{height:.0f}" rx="8" fill="#fff"/>"""


def _places(states: Sequence[int]) -> dict[int, Point]:
    """The first state above the middle, the others side by side below."""
    others = states[1:]
    room = WIDTH / max(len(others), 1)
    below = {state: Point(room * (i + 0.5), BOTTOM) for i, state in enumerate(others)}
    return {states[0]: Point(WIDTH / 2, TOP)} | below


def _straight(start: Point, end: Point) -> tuple[str, Point, str]:
    """An arrow between boxes, on the right as one goes along it; where its label stands, and how."""
    dx, dy = end.x - start.x, end.y - start.y
    length = math.hypot(dx, dy)
    aside = Point(-dy / length * APART, dx / length * APART)
    a, b = _edge(start, aside, dx, dy), _edge(end, aside, -dx, -dy)
    path = f"M{a.x:.1f} {a.y:.1f}L{b.x:.1f} {b.y:.1f}"
    middle = Point((a.x + b.x) / 2, (a.y + b.y) / 2)
    if abs(dy) < 1.0:
        return path, Point(middle.x, middle.y + math.copysign(18.0, aside.y)), "middle"
    return path, Point(middle.x + math.copysign(20.0, aside.x), middle.y), "end" if aside.x < 0 else "start"


def _edge(centre: Point, aside: Point, dx: float, dy: float) -> Point:
    """Where a line from beside a box's centre, along (dx, dy), leaves the box."""
    across = (math.copysign(BOX_WIDTH / 2, dx) - aside.x) / dx if dx else math.inf
    down = (math.copysign(BOX_HEIGHT / 2, dy) - aside.y) / dy if dy else math.inf
    share = min(across, down)
    return Point(centre.x + aside.x + share * dx, centre.y + aside.y + share * dy)


def _loop(centre: Point) -> tuple[str, Point, str]:
    """An arrow from a box to itself: beside the upper one, below the others."""
    x, y = centre
    if y == TOP:
        x += BOX_WIDTH / 2
        path = (
            f"M{x:.1f} {y - 12:.1f}C{x + 62:.1f} {y - 26:.1f} {x + 62:.1f} {y + 26:.1f} {x:.1f} {y + 12:.1f}"
        )
        return path, Point(x + 62, y), "start"
    y += BOX_HEIGHT / 2
    path = f"M{x + 24:.1f} {y:.1f}C{x + 44:.1f} {y + 52:.1f} {x - 44:.1f} {y + 52:.1f} {x - 24:.1f} {y:.1f}"
    return path, Point(x, y + 56), "middle"


def _label(place: Point, anchor: str, events: Sequence[tuple[int, str]]) -> list[str]:
    """Numbers and names of the events on one arrow, below each other."""
    out = []
    for line, (number, event) in enumerate(events):
        y = place.y + 22.0 * (line - 0.5 * (len(events) - 1))
        width = 6.6 * len(event)
        disc = place.x + {"start": 0.0, "end": 0.0, "middle": -0.5 * width - 4.0}[anchor]
        text = disc + (-15.0 if anchor == "end" else 15.0)
        out += _disc(disc, y, number)
        kind = ' class="end"' if anchor == "end" else ""
        out.append(f'<text x="{text:.1f}" y="{y + 5:.1f}"{kind}>{escape(event)}</text>')
    return out


def _disc(x: float, y: float, number: int) -> list[str]:
    return [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="10" class="disc"/>',
        f'<text x="{x:.1f}" y="{y + 4.5:.1f}" class="number">{number}</text>',
    ]


def _row(row: int, change: str, event: str, condition: str) -> list[str]:
    y = LEGEND + ROW * row
    return [
        *_disc(24.0, y - 5.0, row + 1),
        f'<text x="44" y="{y:.0f}" class="quiet">{escape(change)}</text>',
        f'<text x="206" y="{y:.0f}">{escape(event)}</text>',
        f'<text x="312" y="{y:.0f}">{_set(condition)}</text>',
    ]


def _set(condition: str) -> str:
    """A condition with its symbols set as such: f_a with an index, mu as a letter."""
    text = escape(condition.replace("<=", "≤").replace(">=", "≥"), quote=False)
    text = re.sub(r"\bmu\b", "μ", text)
    lowered = r'\1<tspan dy="4" font-size="11">\2</tspan><tspan dy="-4">&#8203;</tspan>'
    return re.sub(r"\b([A-Za-z])_([a-z])\b", lowered, text)
