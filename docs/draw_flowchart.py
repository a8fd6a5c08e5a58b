"""Draw docs/flowchart.svg from the table of transitions that the engine goes by: `python docs/draw_flowchart.py`."""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from tarsus.base.events import TRANSITIONS, FootState

TARGET = Path(__file__).with_name("flowchart.svg")
PLACES = {FootState.AIR: (4.5, 3.4), FootState.STUCK: (2.1, 0.7), FootState.SLIPPING: (6.9, 0.7)}
BLUE, GREY, INK = "#005a8c", "#5f6773", "#1f2328"
EDGE = 0.42
"""From the middle of a state to the right edge of its box, about."""
ASIDE = 0.16
"""How far arrows there and back stand from the line between two states."""


def drawing() -> str:
    """The picture's text: states as boxes, changes as numbered arrows, their conditions below."""
    rows = len(TRANSITIONS)
    style = {"svg.fonttype": "none", "svg.hashsalt": "flowchart", "font.size": 9.0, "font.family": "sans-serif"}
    with matplotlib.rc_context(style):
        figure = Figure(figsize=(9.2, 4.3 + 0.24 * rows), facecolor="white")
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, 9.2), ylim=(-0.5 - 0.24 * rows, 3.8))
        axes.set_axis_off()
        arrows: dict[tuple[FootState, FootState], list[int]] = {}
        for number, (before, after, *_) in enumerate(TRANSITIONS, 1):
            arrows.setdefault((before, after), []).append(number)
        for (before, after), numbers in arrows.items():
            _arrow(axes, before, after, [f"{number}  {TRANSITIONS[number - 1][2]}" for number in numbers])
        box = {"boxstyle": "round,pad=0.7", "facecolor": "#eef3f7", "edgecolor": INK}
        for state, place in PLACES.items():
            axes.text(*place, state.words, ha="center", va="center", weight="bold", color=INK, bbox=box)
        for row, (before, after, event, condition) in enumerate(TRANSITIONS):
            y = -0.5 - 0.24 * row
            change = f"{before.words} → {after.words}"
            cells = (f"{row + 1}", BLUE), (change, GREY), (event, INK), (_set(condition), INK)
            for x, (words, color) in zip((0.2, 0.4, 1.9, 2.8), cells, strict=True):
                axes.text(x, y, words, va="center", color=color)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()


def _arrow(axes, before: FootState, after: FootState, words: list[str]) -> None:
    """An arrow between two states, on the right as one goes along it, or from one to itself, with its changes."""
    (x0, y0), (x1, y1) = PLACES[before], PLACES[after]
    look = {"arrowstyle": "-|>", "color": GREY, "shrinkA": 26.0, "shrinkB": 26.0}
    if before is after:
        loop = {**look, "connectionstyle": "arc3,rad=-1.8", "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", (x0 + EDGE, y0 - 0.1), (x0 + EDGE, y0 + 0.1), arrowprops=loop)
        axes.text(x0 + EDGE + 0.3, y0, "\n".join(words), va="center", color=BLUE)
        return
    length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    right, down = (y1 - y0) / length * ASIDE, -(x1 - x0) / length * ASIDE
    axes.annotate("", (x1 + right, y1 + down), (x0 + right, y0 + down), arrowprops=look)
    middle = (0.5 * (x0 + x1) + 1.2 * right, 0.5 * (y0 + y1) + 2.0 * down)
    side = "center" if abs(right) < 0.05 else "left" if right > 0.0 else "right"
    axes.text(*middle, "\n".join(words), ha=side, va="center", color=BLUE)


def _set(condition: str) -> str:
    """A condition with its symbols as letters."""
    return condition.replace("<=", "≤").replace(">=", "≥").replace("mu ", "μ ")


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8", newline="\n")
