"""Draw docs/rooms.svg, the rooms of the native engine as their headers know each other: `python docs/draw_rooms.py`."""

import re
from html import escape
from itertools import pairwise
from pathlib import Path

TARGET = Path(__file__).with_name("rooms.svg")
NATIVE = Path(__file__).parents[1] / "src" / "tarsus" / "core" / "native"

ROOMS = {
    "packet": "a plan as bytes, run without Python",
    "modal": "a linear structure in each set of held feet",
    "legged": "a body on exact legs",
    "measure": "what runs are judged by, from their events",
    "march": "the loop from event to event, landing rule, log",
    "laws": "what acts at a foot: twins and programs",
    "drives": "channels of piecewise polynomials",
    "base": "rows of 8 numbers, small matrices, nodes",
}
"""What each room is, from above."""
WIDTH, COLUMN, GAP, LINE, HEAD = 1060.0, 250.0, 46.0, 17.0, 62.0
"""Of the picture, a column of names, between floors, a name, and what stands above the names."""

STYLE = """<style>
text { font: 13px system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; fill: #1f2328; }
.name { font-weight: 600; font-size: 15px; }
.quiet { fill: #5f6773; }
.room { fill: #eef3f7; stroke: #1f2328; stroke-width: 1.4; }
.arrow { fill: none; stroke: #5f6773; stroke-width: 1.6; }
</style>
<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" orient="auto">
<path d="M0 1L9 5L0 9z" fill="#5f6773"/></marker></defs>"""


def headers(room: str) -> list[str]:
    """Names of a room's headers."""
    return sorted(path.stem for path in (NATIVE / room).glob("*.hpp"))


def known(room: str) -> set[str]:
    """Other rooms whose headers those of a room include."""
    texts = (path.read_text(encoding="utf-8") for path in (NATIVE / room).glob("*.hpp"))
    return {name for text in texts for name in re.findall(r'^#include "(\w+)/', text, re.MULTILINE)} - {room}


def floors() -> list[list[str]]:
    """Rooms by floors from above: a room stands above every room that its headers know."""
    below = {room: known(room) for room in ROOMS}
    height: dict[str, int] = {}
    while len(height) < len(ROOMS):
        ready = [room for room in ROOMS if room not in height and below[room] <= set(height)]
        if not ready:
            raise ValueError("rooms know each other in a circle")
        height |= {room: 1 + max((height[other] for other in below[room]), default=-1) for room in ready}
    levels = sorted(set(height.values()), reverse=True)
    return [[room for room in ROOMS if height[room] == level] for level in levels]


def drawing() -> str:
    """The picture's text."""
    parts: list[str] = []
    places: dict[str, tuple[float, float, float, float]] = {}
    y = 12.0
    for floor in floors():
        wide = WIDTH - 24.0 if len(floor) == 1 else (WIDTH - 24.0 - GAP * (len(floor) - 1)) / len(floor)
        columns = max(1, int(wide // COLUMN))
        tall = HEAD + LINE * max(-(-len(headers(room)) // columns) for room in floor)
        for n, room in enumerate(floor):
            x = 12.0 + n * (wide + GAP)
            places[room] = (x, y, wide, tall)
            parts += [
                f'<rect x="{x:.0f}" y="{y:.0f}" width="{wide:.0f}" height="{tall:.0f}" rx="10" class="room"/>',
                f'<text x="{x + 14:.0f}" y="{y + 22:.0f}" class="name">{room}</text>',
                f'<text x="{x + 14:.0f}" y="{y + 41:.0f}" class="quiet">{escape(ROOMS[room])}</text>',
            ]
            names = headers(room)
            rows = -(-len(names) // columns)
            for k, name in enumerate(names):
                across, down = divmod(k, rows)
                parts.append(
                    f'<text x="{x + 14 + across * wide / columns:.0f}" '
                    f'y="{y + HEAD + LINE * down:.0f}">{escape(name)}</text>'
                )
        y += tall + GAP
    parts += _arrows(places)
    start = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {y - GAP + 12:.0f}" role="img">'
    title = "<title>Rooms of the native engine, each above those it knows, and their headers</title>"
    return "\n".join([start, title, STYLE, *parts, "</svg>", ""])


def _arrows(places: dict[str, tuple[float, float, float, float]]) -> list[str]:
    """From each room to those of the next floor below that it knows; lower ones are known to all above."""
    found = []
    for upper, lower in pairwise(floors()):
        for room in upper:
            for other in (o for o in lower if o in known(room)):
                x, y, wide, tall = places[room]
                to_x, to_y, to_wide, _ = places[other]
                start = min(max(to_x + to_wide / 2, x + 30), x + wide - 30)
                end = min(max(start, to_x + 30), to_x + to_wide - 30)
                found.append(
                    f'<path d="M{start:.0f} {y + tall:.0f}L{end:.0f} {to_y - 1:.0f}" '
                    'class="arrow" marker-end="url(#tip)"/>'
                )
    return found


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8", newline="\n")
