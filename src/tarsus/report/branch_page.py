"""The report of branches of orbits: their picture, what happens along them, where several coexist, multipliers."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.arrays import Floats
from tarsus.orbits.branches import Branches
from tarsus.report.pages import PageFigure, Section, noted, sections_page
from tarsus.report.panel_grid import name_axes, panel, panels, shade
from tarsus.report.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RULE, SKY, VERMILION, level_limits
from tarsus.tables.numbers import number, spaced

MARKS = {
    "fold": ("s", VERMILION),
    "flip": ("D", PURPLE),
    "neimark-sacker": ("^", GREEN),
    "grazing": ("o", ORANGE),
    "sticking": ("v", INK),
    "capture": ("<", SKY),
    "simultaneous": ("P", MUTED),
    "events": ("X", MUTED),
}
"""What happens along a branch: its sign on paper, and its colour."""

SMALLEST = 1e-4
"""Multipliers below are not drawn: what is left of a deviation after a period is then far below what is seen."""

APART = 1e-6
"""Share by which the sizes of two multipliers differ that are no pair: those of a pair are one to rounding."""

MOST_LISTED = 60
"""Orbits in the page's table, four screens of it: every one is in `branch.json`."""


def branch_html(found: Branches) -> str:
    """The page of a result, as text."""
    whole = found.table()
    branches, several, orbits = whole.parts
    listed = orbits.bare(max(1, -(-len(orbits.rows) // MOST_LISTED)))
    sizes = _sizes(found)
    several = several.bare() if found.coexisting else f"None: {found.alone}."
    nothing = "Nothing: the same events in the same order all along, and no change of stability."
    small = f"All multipliers are below {number(SMALLEST)}: less than that of a deviation is left after a period."
    sections = [
        Section("Motion", _motion(found)),
        Section("Branches", branches.bare(), noted(whole)),
        Section("Several stable motions", several),
        Section("What happens", whole.bare() if found.special else nothing),
        Section("Stability", sizes or small),
        Section("Orbits", listed),
    ]
    return sections_page(f"Branches: {found.scene.name}", [f"{whole.title}."], sections)


LOOKS: dict[bool, dict[str, Any]] = {
    True: {"label": "stable", "color": BLUE, "lw": 1.2},
    False: {"label": "unstable", "color": VERMILION, "lw": 1.2, "ls": (0, (4.0, 3.0))},
}
"""Of a branch where its motion is stable, and where it is not."""


def draw_branches(axes: Axes, found: Branches, name: str, unit: str) -> None:
    """A number of every orbit, such as `hardest_impact`, along the branches, each with its number half way; what
    happens on them by its name."""
    shade(axes, ((one.low, one.high) for one in found.coexisting), "several stable motions")
    every: list[Floats] = []
    for place, branch in enumerate(found, 1):
        at = np.array([point.at for point in branch.points])
        every.append(np.array([getattr(point.orbit, name) for point in branch.points]))
        for stable, part in branch.parts():
            axes.plot(at[part], every[-1][part], **LOOKS[stable])
        half = len(at) // 2
        if len(found) > 1 and np.isfinite(every[-1][half]):
            words = {"textcoords": "offset points", "color": MUTED, "size": 7.0}
            axes.annotate(str(place), (at[half], every[-1][half]), (0.0, 2.0), **words)
        for kind, (marker, color) in MARKS.items():
            own = np.array([point.kind == kind for point in branch.points])
            if np.isfinite(every[-1][own]).any():
                axes.plot(at[own], every[-1][own], marker, color=color, ms=5.0, mew=0.0, zorder=5, label=kind)
    name_axes(axes, (found.path, found.unit), (spaced(name), unit))
    if limits := level_limits(*every):
        axes.set_ylim(*limits)


def _motion(found: Branches) -> PageFigure:
    """Hardest impact and highest flight against the parameter."""

    return panels(
        (("hardest_impact", "m/s"), ("highest_flight", "m")),
        1.9,
        lambda axes, drawn: draw_branches(axes, found, *drawn),
        "Approach speed of the hardest impact and height of the highest flight of a period along every branch"
        f"{', numbered as in the table' * (len(found) > 1)}.",
    )


def draw_multipliers(axes: Axes, multipliers: np.ndarray, size: float) -> None:
    """Multipliers in the complex plane, with the circle within which deviations die out."""
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    axes.plot(np.real(turn), np.imag(turn), color=RULE, lw=0.8)
    axes.plot(np.real(multipliers), np.imag(multipliers), "o", ms=size, mew=0.0, color=BLUE)
    axes.set_aspect("equal")
    axes.set(xlabel="real part", ylabel="imaginary part")


def _sizes(found: Branches) -> PageFigure | None:
    """Magnitude of the largest multipliers along the branches; nothing where all are too small to be seen."""
    points = [point for branch in found for point in branch.points]
    at = np.array([point.at for point in points])
    sizes = np.zeros((2, len(points)))
    for n, point in enumerate(points):
        own = np.abs(point.orbit.multipliers[:2])
        sizes[: len(own), n] = own
    pair = np.abs(sizes[0] - sizes[1]) <= APART * sizes[0]
    drawn = sizes >= SMALLEST
    if not drawn.any():
        return None

    def draw(axes: Axes) -> None:
        for row, kept, color, word in (
            (0, drawn[0] & ~pair, BLUE, "largest"),
            (0, drawn[0] & pair, GREEN, "largest two, a pair"),
            (1, drawn[1] & ~pair, ORANGE, "second"),
        ):
            if kept.any():
                axes.plot(at[kept], sizes[row, kept], "o", ms=2.5, mew=0.0, color=color, label=word)
        axes.axhline(1.0, color=MUTED, lw=0.7)
        name_axes(axes, (found.path, found.unit), ("|multiplier|", ""))
        axes.set_yscale("log")
        least = float(sizes[drawn].min())
        axes.set_ylim(10.0 ** np.floor(np.log10(least)), 2.0 * max(1.0, float(sizes.max())))

    left = int((sizes[0] < SMALLEST).sum())
    small = f" At {left} of {len(points)} orbits all are below {number(SMALLEST)}, and not drawn." if left else ""
    return panel(2.3, draw, f"The two largest multipliers along the branches. Above the line deviations grow.{small}")
