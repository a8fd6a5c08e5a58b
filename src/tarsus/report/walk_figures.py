"""Figures of a walk: travel of the body, its path from above, drives and footfalls, forces under every foot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.measure.path import path_of
from tarsus.records.excluded import evenly
from tarsus.report.motion import AIR, SLIPPING, STUCK, Motion
from tarsus.report.pages import PageFigure
from tarsus.report.panels import Bars, DrawnLine, Level, Sign, TimePanel, Window, panels_figure
from tarsus.report.style import BLUE, CYCLE, GREEN, INK, MUTED, PURPLE, RULE, VERMILION, samples_inside, scale_of
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BODIES, POINTS = 7, 500
"""Moments of its path at which the body is drawn, and points of the path: about one for every pixel."""

_WORDS = {
    "surge": "travel of the body's centre along the way",
    "heave": "its height above that at rest",
    "sway": "its sway to the left",
    "roll": "its roll about x",
    "pitch": "its pitch about y",
    "yaw": "its yaw about z, its heading",
}

SAME = 1e-6
"""Drive voltages that differ by less than this part of the largest are one."""

RESOLVED = 1e-6
"""Share of the body's motion below which a turn or sway that a run gives is none: steps are exact to 1e-8 of the
lengths at which forces change, and a hundred drive periods add up some hundred errors."""


def travel(motion: Motion) -> PageFigure:
    """Travel and height of the body over the whole run, and its sway and turns where the run resolves them."""
    ways = {name: _way(motion, name) for name in _WORDS if name in motion.body}
    least = RESOLVED * max(ways.values())
    shown = [name for name, way in ways.items() if name in ("surge", "heave") or way > least]
    panels = []
    for name in shown:
        height = {"surge": 1.05, "heave": 0.7}.get(name, 0.55)
        unit, factor = ("mrad", 1e3) if name in _ANGLES else ("m", 1.0)
        panels.append(TimePanel(height, name, unit, [DrawnLine(motion.time, factor * motion.body[name], BLUE)]))
    caption = ", ".join(_WORDS[name] for name in shown)
    said = "".join(
        f" Its {name} stays within {amount(float(np.ptp(motion.body[name])), _ANGLES.get(name, 'm'), 2)}, which the "
        f"accuracy of the run does not resolve, and is not drawn."
        for name in ways
        if name not in shown
    )
    return panels_figure(panels, f"{caption[0].upper()}{caption[1:]}.{said}")


_ANGLES = {"roll": "rad", "pitch": "rad", "yaw": "rad"}


def _way(motion: Motion, name: str) -> float:
    """How far a coordinate moves the body or, where it is a turn, its farthest hip [m]."""
    x, y, z = np.abs(motion.hips).max(axis=0)
    arm = {"roll": np.hypot(y, z), "pitch": np.hypot(x, z), "yaw": np.hypot(x, y)}.get(name, 1.0)
    return float(arm * np.ptp(motion.body[name]))


def distinct_drives(motion: Motion) -> list[tuple[str, int]]:
    """The different drive voltages, as many as there are colours: a drive that has it and how many more, and its
    row."""
    alike: dict[int, list[str]] = {}
    for row, name in enumerate(motion.drives):
        volts = motion.volts[row]
        near = SAME * max(float(np.abs(volts).max()), 1e-12)
        first = next((r for r in alike if float(np.abs(motion.volts[r] - volts).max()) <= near), row)
        alike.setdefault(first, []).append(name)
    labels = (names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} alike" for names in alike.values())
    return list(zip(labels, alike, strict=True))[: len(CYCLE)]


def contact_panel(feet: Sequence[str], bars: Sequence[Bars], **others: Any) -> TimePanel:
    """A panel with a row for each foot, from above in their order."""
    count = len(feet)
    height = max(row_height(count) * count, 0.5)
    return TimePanel(height, bars=bars, limits=(count - 0.4, -0.8), names=feet, **others)


def footfalls(motion: Motion, window: Window) -> PageFigure:
    """Volts above the gait diagram (Hildebrand's): bars where a foot is on the ground, narrow where it slips."""
    part = _part(motion, window)
    count = len(motion.legs)
    kinds = ((STUCK, INK, 0.72, "stuck"), (SLIPPING, VERMILION, 0.36, "slipping"))
    bars = [
        Bars(_spans(part, row, state), row - height / 2.0, row + height / 2.0, color)
        for state, color, height, _ in kinds
        for row in range(count)
    ]
    drives = distinct_drives(motion)
    colors = CYCLE if len(drives) > 1 else (INK,)
    volts = [
        DrawnLine(part.time, part.volts[row], color, label) for (label, row), color in zip(drives, colors, strict=False)
    ]
    falls = contact_panel(motion.legs, bars, signs=[Sign(name, color, area=True) for _, color, _, name in kinds])
    caption = "Footfalls: bars where a foot is on the ground, narrow ones where it slips."
    if drives:
        return panels_figure([TimePanel(0.62, "drive", "V", volts), falls], f"{caption} Above: volts.", window)
    return panels_figure([falls], caption, window)


USUAL, CUT = 0.95, 1.5
"""Share of the samples in contact whose forces a row shows in full, and how far beyond them it reaches: the impact of
one landing would press all others to the width of a line."""


def ground_forces(motion: Motion, window: Window) -> PageFigure:
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
        min(0.8 * count, 1.0 + 2.0 * row_height(count) * count),
        lines=lines,
        names=motion.legs,
        levels=[Level(row, RULE) for row in range(count)],
        limits=(count - 0.95 - low / step, -high / step - 0.05),
    )
    caption = (
        f"Force of the ground on every foot in contact; from one line to the next is {step / scale.step:g} "
        f"{scale.label}. Upward, below its line while adhesion holds the foot back, and friction, positive forward."
    )
    if cut < most:
        caption += (
            f" Forces above {cut / scale.step:.2g} {scale.label}, short ones at landings, are cut there; the largest "
            f"is {most / scale.step:.3g} {scale.label}."
        )
    return panels_figure([panel], caption, window)


def row_height(count: int) -> float:
    """Height of one of so many rows [inch]: of many as low as their names allow."""
    return 0.17 if count <= 12 else 0.1


def path_above(motion: Motion) -> PageFigure:
    """Path of the centre of a body that has a yaw, forward to the right and its left upward, to scale, with the
    rectangle about its hips and its heading at moments evenly apart."""
    from tarsus.report.panel_grid import name_axes, panel

    yaw = motion.coordinate("yaw")
    place = path_of(motion.coordinate("surge"), motion.coordinate("sway"), yaw)
    half = np.maximum(np.abs(motion.hips[:, :2]).max(axis=0), 1e-3 * np.abs(motion.hips).max())
    corners = half * np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    shown = np.array(evenly(list(place.T), POINTS)).T

    def draw(axes: Axes) -> None:
        for frame in evenly(range(len(motion.time)), BODIES):
            c, s = math.cos(yaw[frame]), math.sin(yaw[frame])
            body = place[:, frame] + corners @ np.array([[c, s], [-s, c]])
            axes.fill(*body.T, fc="none", ec=MUTED, lw=0.6)
            axes.plot(*np.stack([place[:, frame], body[:2].mean(axis=0)]).T, color=INK, lw=0.7)
        axes.plot(*shown, color=BLUE)
        axes.set_aspect("equal", adjustable="datalim")
        name_axes(axes, ("forward", "m"), ("to the left", "m"))

    turned = math.degrees(float(yaw[-1] - yaw[0]))
    side = "left" if turned >= 0.0 else "right"
    return panel(
        1.6,
        draw,
        f"Path of the body's centre seen from above, to scale; the rectangle about its hips at {BODIES} moments, its "
        "heading as a line. It began by looking to the right of the page, and turned "
        f"{abs(turned):.3g} deg to the {side}.",
    )


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
