"""Figures of a walk: travel of the body, footfalls, forces under every foot, and moments of it side by side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tarsus.report.motion import AIR, SLIPPING, STUCK, Motion
from tarsus.report.pages import Plate
from tarsus.report.panels import Bars, DrawnLine, Level, Sign, TimePanel, Window, panels_plate
from tarsus.report.stage import WalkStage, drawn, facets
from tarsus.report.style import BLUE, GREEN, INK, MUTED, PURPLE, RULE, VERMILION, samples_inside, scale_of
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAR_BODY, NEAR_BODY, FAR_LEG = "#d9dee5", "#b9c3cf", "#9fb4c6"
ARROW = 0.5
"""Length of the arrow of a large force, of a drawn leg's."""

MOMENTS = 4

_WORDS = {
    "surge": "travel of the body's centre along the way", "heave": "its height above that at rest",
    "sway": "its sway to the left", "roll": "its roll about x", "pitch": "its pitch about y",
    "yaw": "its yaw about z, its heading",
}  # fmt: skip

RESOLVED = 1e-6
"""Share of the body's motion below which a turn or sway that a run gives is none: steps are exact to 1e-8 of the
lengths at which forces change, and a hundred drive periods add up some hundred errors."""


def travel(motion: Motion) -> Plate:
    """Travel and height of the body over the whole run, and its sway and turns where the run resolves them."""
    ways = {name: _way(motion, name) for name in _WORDS if name in motion.body}
    least = RESOLVED * max(ways.values())
    shown = [name for name, way in ways.items() if name in ("surge", "heave") or way > least]
    panels = []
    for name in shown:
        height = {"surge": 1.05, "heave": 0.7}.get(name, 0.55)
        unit, factor = ("mrad", 1e3) if name in _ANGLES else ("m", 1.0)
        panels.append(
            TimePanel(height, name, unit, [DrawnLine(motion.time, factor * motion.body[name], BLUE)])
        )
    caption = ", ".join(_WORDS[name] for name in shown)
    said = "".join(
        f" Its {name} stays within {amount(float(np.ptp(motion.body[name])), _ANGLES.get(name, 'm'), 2)}, which the "
        f"accuracy of the run does not resolve, and is not drawn."
        for name in ways
        if name not in shown
    )
    return panels_plate(panels, f"{caption[0].upper()}{caption[1:]}.{said}")


_ANGLES = {"roll": "rad", "pitch": "rad", "yaw": "rad"}


def _way(motion: Motion, name: str) -> float:
    """How far a coordinate moves the body or, where it is a turn, its farthest hip [m]."""
    x, y, z = np.abs(motion.hips).max(axis=0)
    arm = {"roll": np.hypot(y, z), "pitch": np.hypot(x, z), "yaw": np.hypot(x, y)}.get(name, 1.0)
    return float(arm * np.ptp(motion.body[name]))


def footfalls(motion: Motion, window: Window) -> Plate:
    """Gait diagram (Hildebrand's): bars where a foot is on the ground, narrow where it slips."""
    part = _part(motion, window)
    count = len(motion.legs)
    kinds = ((STUCK, INK, 0.72, "stuck"), (SLIPPING, VERMILION, 0.36, "slipping"))
    bars = [
        Bars(_spans(part, row, state), row - height / 2.0, row + height / 2.0, color)
        for state, color, height, _ in kinds
        for row in range(count)
    ]
    panel = TimePanel(
        max(_row(count) * count, 0.5), bars=bars, signs=[Sign(name, color, area=True) for _, color, _, name in kinds],
        limits=(count - 0.4, -0.8), names=motion.legs,
    )  # fmt: skip
    return panels_plate(
        [panel], "Footfalls: bars where a foot is on the ground, narrow ones where it slips.", window
    )


USUAL, CUT = 0.95, 1.5
"""Share of the samples in contact whose forces a row shows in full, and how far beyond them it reaches: the impact of
one landing would press all others to the width of a line."""


def ground_forces(motion: Motion, window: Window) -> Plate:
    """Force of the ground on every foot, a row each, all on one scale."""
    part = _part(motion, window)
    count = len(motion.legs)
    forces = np.where(part.state == AIR, np.nan, np.stack([part.normal, part.friction]))
    scale = scale_of("N", forces)
    low, high = float(np.nanmin(forces, initial=0.0)), float(np.nanmax(forces, initial=0.0))
    most = max(-low, high)
    cut = CUT * float(np.nanquantile(np.abs(forces), USUAL)) if np.isfinite(forces).any() else most
    if cut < most:
        low, high, forces = max(low, -cut), min(high, cut), np.clip(forces, -cut, cut)
    step = float(f"{1.05 * (high - low):.2g}") or 1.0
    lines = [
        DrawnLine(part.time, row - values[row] / step, color, label, 0.9)
        for row in range(count)
        for values, color, label in zip(forces, (GREEN, PURPLE), ("upward", "friction, forward"), strict=True)
    ]
    panel = TimePanel(
        min(0.8 * count, 1.0 + 2.0 * _row(count) * count), lines=lines, names=motion.legs,
        levels=[Level(row, RULE) for row in range(count)],
        limits=(count - 0.95 - low / step, -high / step - 0.05),
    )  # fmt: skip
    caption = (
        f"Force of the ground on every foot in contact; from one line to the next is {step / scale.step:g} "
        f"{scale.label}. Upward, below its line while adhesion holds the foot back, and friction, positive forward."
    )
    if cut < most:
        caption += (
            f" Forces above {cut / scale.step:.2g} {scale.label}, short ones at landings, are cut there; the largest "
            f"is {most / scale.step:.3g} {scale.label}."
        )
    return panels_plate([panel], caption, window)


def _row(count: int) -> float:
    """Height of one of so many rows [inch]: of many as low as their names allow."""
    return 0.17 if count <= 12 else 0.1


def still(motion: Motion, stage: WalkStage) -> Plate:
    """Moments of a walk side by side, as the animation draws them: a picture for paper."""
    from tarsus.report.sheet import WIDTH, Sheet, plate

    frames = _moments(motion)
    left, right, top = _extent(motion, stage, frames)
    low = -0.1 * stage.length
    clock = scale_of("s", float(motion.time[-1]))

    def draw(sheet: Sheet) -> None:
        height = WIDTH * (top - low) / (right - left)
        for axes, frame in zip(sheet.grid(len(frames), height), frames, strict=True):
            draw_robot(axes, motion, stage, frame)
            draw_ground(axes, motion, stage, frame, MUTED, 0.8)
            if motion.incline:
                draw_gravity(axes, motion.incline, left + 0.06 * (right - left), 0.9 * top, 0.5 * stage.leg)
            axes.set(
                xlim=(left, right),
                ylim=(low, top),
                title=f"{motion.time[frame] / clock.step:.4g} {clock.label}",
            )
            axes.set_axis_off()

    span = "a drive period" if motion.period is not None else "the run"
    caption = (
        f"{len(frames)} moments of {span}. Full feet are stuck, open triangles slip, open circles are in the air. "
        f"Displacements are drawn {stage.up:g} times larger upward and {stage.along:g} times along the way."
        + rising(motion)
    )
    return plate(draw, caption)


def rising(motion: Motion) -> str:
    """What a caption says of an incline; nothing of level ground."""
    if not motion.incline:
        return ""
    return f" The ground rises forward by {math.degrees(motion.incline):.3g} deg: an arrow shows where gravity pulls."


def draw_gravity(axes: Axes, incline: float, x: float, y: float, length: float) -> None:
    """An arrow of a length from (x, y) where gravity pulls, seen along a ground that rises forward by an incline
    [rad]."""
    end = (x - length * math.sin(incline), y - length * math.cos(incline))
    axes.annotate(
        "", end, (x, y), arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
    )


def _moments(motion: Motion) -> list[int]:
    """Frames a quarter of the last drive period apart (of the whole motion if none repeats)."""
    span = float(motion.time[-1] - motion.time[0])
    span = min(motion.period or span, span)
    times = motion.time[-1] - span * (1.0 - np.arange(MOMENTS) / MOMENTS)
    return [int(np.argmin(np.abs(motion.time - time))) for time in times]


def _extent(motion: Motion, stage: WalkStage, frames: list[int]) -> tuple[float, float, float]:
    """Left, right and top of all that is drawn [m], with some room."""
    corners = []
    for frame in frames:
        moment = drawn(motion, stage, frame)
        corners += [moment.hips, moment.feet, moment.near_face, moment.far_face]
    points = np.concatenate(corners)
    room = 0.06 * stage.length + ARROW * stage.leg * 0.5
    return (
        float(points[:, 0].min()) - room,
        float(points[:, 0].max()) + room,
        float(points[:, 1].max()) + 0.02 * stage.length,
    )


def draw_ground(axes: Axes, motion: Motion, stage: WalkStage, frame: int, color: str, width: float) -> None:
    """The ground at a moment: a line, or of uneven ground the piece below each foot, as large as motion is drawn, in
    the colour of its leg where feet go along several lines."""
    if not motion.ground:
        axes.axhline(stage.up * motion.ground_shift[1, frame], color=color, lw=width, zorder=0)
        return
    for leg, piece in enumerate(facets(motion, stage, frame)):
        own = color if len(motion.ground) == 1 else FAR_LEG if stage.far[leg] else BLUE
        axes.plot(*piece.T, color=own, lw=width, zorder=0)


def draw_robot(axes: Axes, motion: Motion, stage: WalkStage, frame: int, *, forces: bool = True) -> None:
    """A moment of a walk in axes of metres: the body's faces, legs, feet by their state, forces of the ground."""
    moment, far = drawn(motion, stage, frame), stage.far
    axes.fill(*moment.far_face.T, facecolor=FAR_BODY, edgecolor=MUTED, lw=0.5, zorder=1.5)
    axes.fill(*moment.near_face.T, facecolor=NEAR_BODY, edgecolor=INK, lw=0.6, zorder=2.5)
    size = float(np.clip(60.0 / len(motion.legs), 1.6, 4.5))
    reach = ARROW * stage.leg / stage.force if forces and stage.force > 0.0 else 0.0
    state = motion.state[:, frame]
    for side, color, order in ((far, FAR_LEG, 1.0), (~far, BLUE, 3.0)):
        axes.plot(*_broken(moment.hips[side], moment.feet[side]), color=color, lw=0.9, zorder=order)
        for kind, (marker, fill, edge) in _MARKS.items():
            feet = moment.feet[side & (state == kind)]
            axes.plot(*feet.T, marker, ms=size, mfc=fill, mec=edge, mew=0.8, zorder=order + 1.0)
        pressed = side & (state != AIR)
        foot = moment.feet[pressed]
        for values, along, paint in (
            (motion.normal, (0.0, 1.0), GREEN),
            (motion.friction, (1.0, 0.0), PURPLE),
        ):
            arrow = np.clip(values[pressed, frame] * reach, -stage.leg, stage.leg)
            axes.plot(*_broken(foot, foot + np.outer(arrow, along)), color=paint, lw=1.2, zorder=order + 0.5)


def _broken(starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Lines from points (n, 2) to others as one that is broken between them (2, 3 n)."""
    return np.stack([starts, ends, np.full_like(starts, np.nan)], axis=1).reshape(-1, 2).T


_MARKS = {AIR: ("o", "#ffffff", MUTED), STUCK: ("o", INK, INK), SLIPPING: ("^", "#ffffff", VERMILION)}
"""Marker, filling and edge of a foot in each state."""


def _part(motion: Motion, window: Window) -> Motion:
    """Times within a window, with one more on either side."""
    inside = samples_inside(motion.time, window)
    return motion.taken(inside) if inside.stop - inside.start >= 2 else motion


def _spans(motion: Motion, leg: int, state: int) -> list[Window]:
    """Stretches of time [s] a foot is in a state, from the first sample in it to the first that is not."""
    inside = np.concatenate([[False], motion.state[leg] == state, [False]])
    edges = np.flatnonzero(np.diff(inside))
    time = np.append(motion.time, motion.time[-1])
    return [(float(time[a]), float(time[b])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
