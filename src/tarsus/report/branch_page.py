"""The report of branches of orbits: their picture, what happens along them, where several coexist, multipliers."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from tarsus.orbits.branches import Branches
from tarsus.report.pages import Plate, page, rendered
from tarsus.report.sheet import Sheet, few_ticks, name_axes, plate
from tarsus.report.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    RULE,
    SKY,
    VERMILION,
    level_limits,
)
from tarsus.tables.numbers import spaced

_MARKS = {
    "fold": ("s", VERMILION), "flip": ("D", PURPLE), "neimark-sacker": ("^", GREEN), "grazing": ("o", ORANGE),
    "sticking": ("v", INK), "capture": ("<", SKY), "simultaneous": ("P", MUTED), "events": ("X", MUTED),
}  # fmt: skip

MOST_LISTED = 60
"""Orbits in the page's table, four screens of it: every one is in `branch.json`."""


def branch_html(found: Branches) -> str:
    """The page of a result, as text."""
    whole = found.table()
    branches, several, orbits = whole.parts
    listed = orbits.bare(max(1, -(-len(orbits.rows) // MOST_LISTED)))
    body = rendered(
        "branch.html", found=found, motion=_motion(found), multipliers=_multipliers(found), specials=whole.bare(),
        branches=branches.bare(), several=several.bare(), orbits=listed,
    )  # fmt: skip
    return page(f"{found.scene.name} – branches", body)


def draw_branches(axes: Axes, found: Branches, name: str, unit: str) -> None:
    """A number of every orbit along the branches, such as `hardest_impact`: lines where a motion is stable, broken
    where not, a mark where something happens, and shade where several motions are stable."""
    named: set[str] = set()

    def once(word: str) -> str | None:
        """A word for the legend, at its first use."""
        if word in named:
            return None
        named.add(word)
        return word

    for one in found.coexisting:
        axes.axvspan(
            one.low, one.high, color=RULE, alpha=0.35, lw=0.0, zorder=0, label=once("several stable motions")
        )
    for number, branch in enumerate(found, 1):
        at = np.array([point.at for point in branch.points])
        values = np.array([getattr(point.orbit, name) for point in branch.points])
        for stable, places in branch.parts():
            axes.plot(
                at[places], values[places], "-" if stable else "--", color=BLUE if stable else VERMILION, lw=1.2,
                label=once("stable" if stable else "unstable"),
            )  # fmt: skip
        if len(found) > 1 and np.isfinite(values[len(at) // 2]):
            middle = (at[len(at) // 2], values[len(at) // 2])
            axes.annotate(str(number), middle, (0.0, 2.0), textcoords="offset points", color=MUTED, size=7.0)
        for point, value in zip(branch.points, values.tolist(), strict=True):
            if point.kind in _MARKS and np.isfinite(value):
                marker, color = _MARKS[point.kind]
                axes.plot(
                    point.at, value, marker, color=color, ms=5.0, mew=0.0, zorder=5, label=once(point.kind)
                )
    name_axes(axes, (found.path, found.unit), (spaced(name), unit))
    values = np.array([getattr(point.orbit, name) for branch in found for point in branch.points])
    if limits := level_limits(values):
        axes.set_ylim(*limits)


def _motion(found: Branches) -> Plate:
    """Hardest impact and highest flight against the parameter."""

    def draw(sheet: Sheet) -> None:
        for axes, name, unit in zip(
            sheet.grid(2, 2.2), ("hardest_impact", "highest_flight"), ("m/s", "m"), strict=True
        ):
            draw_branches(axes, found, name, unit)
            few_ticks(axes, x=5, y=6)
            sheet.legend(axes)

    return plate(
        draw,
        "Approach speed of the hardest impact and height of the highest flight of a period along every branch.",
    )


def draw_multipliers(axes: Axes, multipliers: np.ndarray, size: float) -> None:
    """Multipliers in the complex plane, with the circle within which deviations die out."""
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    axes.plot(np.real(turn), np.imag(turn), color=RULE, lw=0.8)
    axes.plot(np.real(multipliers), np.imag(multipliers), "o", ms=size, mew=0.0, color=BLUE)
    axes.set_aspect("equal")
    axes.set(xlabel="real part", ylabel="imaginary part")


def _multipliers(found: Branches) -> Plate:
    """Magnitude of the largest multipliers along the branches, and all of them in the plane."""
    points = [point for branch in found for point in branch.points]
    at = np.array([point.at for point in points])
    most = min(2, max((len(point.orbit.multipliers) for point in points), default=0))
    every = np.concatenate([point.orbit.multipliers for point in points])

    def draw(sheet: Sheet) -> None:
        left, right = sheet.grid(2, 2.3)
        for k in range(most):
            values = [abs(p.orbit.multipliers[k]) if len(p.orbit.multipliers) > k else np.nan for p in points]
            left.plot(at, np.maximum(values, 1e-4), ".", ms=2.5, color=(BLUE, ORANGE)[k])
        left.axhline(1.0, color=RULE, lw=0.8, zorder=0)
        left.set_yscale("log")
        name_axes(left, (found.path, found.unit), ("|multiplier|", ""))
        left.set_ylim(bottom=0.5e-4)
        few_ticks(left, x=5)
        draw_multipliers(right, every[np.abs(every) < 3.0], 2.5)
        few_ticks(right, x=4, y=4)

    return plate(
        draw,
        "The two largest multipliers (below 1e-4: drawn there), and all: inside the circle deviations die out.",
    )
