"""A robot's drawing on paper: the shapes of a moment in axes of metres, and moments side by side."""

from __future__ import annotations

import math
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.report.drawing import Drawing, FootMark, Shape
from tarsus.report.motion import AIR, SLIPPING, STUCK, Motion
from tarsus.report.pages import Plate
from tarsus.report.style import BLUE, GREEN, INK, MUTED, PURPLE, RULE, VERMILION, scale_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAINTS = {
    "leg": BLUE,
    "far-leg": "#9fb4c6",
    "near": "#b9c3cf",
    "far": "#d9dee5",
    "muted": MUTED,
    "ink": INK,
    "rule": RULE,
}
"""Colours of a drawing on paper, by their names."""

_MARKS = {AIR: ("o", "#ffffff", MUTED), STUCK: ("o", INK, INK), SLIPPING: ("^", "#ffffff", VERMILION)}
"""Marker, filling and edge of a foot in each state."""

POINTS = 0.5
"""Width of a line of width 1 [pt]."""

ARROW = 0.5
"""Length of the arrow of a large force, of a drawn leg's."""

MOMENTS = 4


def paint(axes: Axes, drawing: Drawing, motion: Motion, at: Floats, frame: int, *, forces: bool = True) -> None:
    """A moment of a motion in axes of metres, its points at (2, n): shapes, feet by their state, forces on them."""
    groups = groupby(drawing.side.parts, lambda one: one if isinstance(one, Shape) and one.fill else _look(one))
    for order, (look, parts) in enumerate(groups, 1):
        if isinstance(look, Shape):
            shape = at[:, list(look.points)]
            axes.fill(*shape, fc=PAINTS[look.fill], ec=PAINTS[look.edge], lw=POINTS * look.width, zorder=order)
        elif look:
            lines = _broken([at[:, list(one.points)] for one in parts if isinstance(one, Shape)])
            axes.plot(*lines, color=PAINTS[look[0]], lw=POINTS * look[1], zorder=order)
        else:
            _feet(axes, drawing, motion, at, frame, [one for one in parts if isinstance(one, FootMark)], forces, order)


def _look(part: Shape | FootMark) -> tuple[str, float] | None:
    """By what neighbours are painted at once: lines of one look, and feet."""
    return (part.edge, part.width) if isinstance(part, Shape) else None


def _feet(
    axes: Axes, drawing: Drawing, motion: Motion, at: Floats, frame: int, feet: list[FootMark], forces: bool, order: int
) -> None:
    """Feet at a moment, as open circles in the air, full ones stuck, triangles slipping."""
    size = float(np.clip(60.0 / len(motion.legs), 1.6, 4.5))
    legs, points = [one.leg for one in feet], [one.point for one in feet]
    state = motion.state[legs, frame]
    for kind, (marker, fill, edge) in _MARKS.items():
        own = at[:, points][:, state == kind]
        axes.plot(*own, marker, ms=size, mfc=fill, mec=edge, mew=0.8, zorder=order + 0.5)
    if not forces or drawing.force <= 0.0:
        return
    reach = ARROW * drawing.leg / drawing.force
    for values, way, color in ((motion.normal, (0.0, 1.0), GREEN), (motion.friction, (1.0, 0.0), PURPLE)):
        arrows = np.clip(values[legs, frame] * reach, -drawing.leg, drawing.leg)
        pressed = [(point, arrow) for point, arrow, now in zip(points, arrows, state, strict=True) if now != AIR]
        lines = [at[:, [point, point]] + np.outer(way, (0.0, arrow)) for point, arrow in pressed]
        axes.plot(*_broken(lines), color=color, lw=1.2, zorder=order + 0.4)


def _broken(lines: list[Floats]) -> Floats:
    """Lines, each (2, n), as one that is broken between them."""
    return np.concatenate([part for one in lines for part in (one, np.full((2, 1), np.nan))] or [np.zeros((2, 0))], 1)


def paint_ground(
    axes: Axes, drawing: Drawing, motion: Motion, at: Floats, frame: int, color: str, width: float = 0.8
) -> None:
    """The ground at a moment: a line, or of uneven ground the piece below each foot, as large as motion is drawn."""
    for piece, line in zip(drawing.pieces, drawing.ground_below(motion, at, frame), strict=True):
        axes.plot(*line, color=color if piece.paint == "muted" else PAINTS[piece.paint], lw=width, zorder=0)
    if drawing.level and not drawing.pieces:
        axes.axhline(drawing.up * motion.ground_shift[1, frame], color=color, lw=width, zorder=0)


def still(motion: Motion, drawing: Drawing) -> Plate:
    """Moments of a motion side by side, as the animation draws them: a picture for paper."""
    from tarsus.report.sheet import WIDTH, Sheet, plate

    frames, places = _moments(motion), drawing.seen(motion)
    left, right, low, high = drawing.box
    room = 0.06 * drawing.length + 0.5 * ARROW * drawing.leg
    ends = (left - room, right + room, low - 0.1 * drawing.length, high + 0.02 * drawing.length)
    clock = scale_of("s", float(motion.time[-1]))

    def draw(sheet: Sheet) -> None:
        height = WIDTH * (ends[3] - ends[2]) / (ends[1] - ends[0])
        for axes, frame in zip(sheet.grid(len(frames), height), frames, strict=True):
            paint(axes, drawing, motion, places[..., frame], frame)
            paint_ground(axes, drawing, motion, places[..., frame], frame, MUTED)
            if motion.incline:
                gravity(axes, motion.incline, left, 0.9 * ends[3], 0.5 * drawing.leg)
            title = f"{motion.time[frame] / clock.step:.4g} {clock.label}"
            axes.set(xlim=ends[:2], ylim=ends[2:], title=title)
            axes.set_axis_off()

    span = "a drive period" if motion.period is not None else "the run"
    caption = (
        f"{len(frames)} moments of {span}. Full feet are stuck, open triangles slip, open circles are in the air. "
        f"Displacements are drawn {drawing.up:g} times larger upward and {drawing.along:g} times along the way."
        + rising(motion)
    )
    return plate(draw, caption)


def rising(motion: Motion) -> str:
    """What a caption says of an incline; nothing of level ground."""
    if not motion.incline:
        return ""
    return f" The ground rises forward by {math.degrees(motion.incline):.3g} deg: an arrow shows where gravity pulls."


def gravity(axes: Axes, incline: float, x: float, y: float, length: float) -> None:
    """An arrow of a length from (x, y) where gravity pulls, seen along a ground that rises forward by an incline
    [rad]."""
    end = (x - length * math.sin(incline), y - length * math.cos(incline))
    look = {"arrowstyle": "-|>", "color": INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, (x, y), arrowprops=look)


def _moments(motion: Motion) -> list[int]:
    """Frames a quarter of the last drive period apart (of the whole motion if none repeats)."""
    span = float(motion.time[-1] - motion.time[0])
    span = min(motion.period or span, span)
    times = motion.time[-1] - span * (1.0 - np.arange(MOMENTS) / MOMENTS)
    return [int(np.argmin(np.abs(motion.time - time))) for time in times]
