"""The report of a branch of orbits: its picture, what happens along it, multipliers."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from tarsus.orbits.branching import Branch
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

BREAK = 0.06
"""Part of the range beyond which points are not joined: a branch's steps are at most 0.04 of it."""

MOST_LISTED = 60
"""Orbits in the page's table, four screens of it: every one is in `branch.json`."""


def branch_html(branch: Branch) -> str:
    """The page of a result, as text."""
    whole = branch.table()
    (orbits,) = whole.parts
    body = rendered(
        "branch.html", branch=branch, motion=_motion(branch), multipliers=_multipliers(branch),
        specials=whole.bare(), orbits=orbits.bare(max(1, -(-len(orbits.rows) // MOST_LISTED))),
    )  # fmt: skip
    return page(f"{branch.scene.name} – branch", body)


def draw_branch(axes: Axes, branch: Branch, name: str, unit: str) -> None:
    """A number of every orbit along the branch, such as `hardest_impact`: lines where it is stable, broken where not,
    and a mark where something happens."""
    at = np.array([point.at for point in branch.points])
    values = np.array([getattr(point.orbit, name) for point in branch.points])
    named: set[str] = set()
    for stable, places in _segments(branch):
        word = "stable" if stable else "unstable"
        axes.plot(
            at[places], values[places], "-" if stable else "--",
            color=BLUE if stable else VERMILION, lw=1.2, label=None if word in named else word,
        )  # fmt: skip
        named.add(word)
    for i, point in enumerate(branch.points):
        if point.kind in _MARKS and np.isfinite(values[i]):
            marker, color = _MARKS[point.kind]
            axes.plot(
                at[i], values[i], marker, color=color, ms=5.0, mew=0.0, zorder=5,
                label=None if point.kind in named else point.kind,
            )  # fmt: skip
            named.add(point.kind)
    name_axes(axes, (branch.path, branch.unit), (spaced(name), unit))
    if limits := level_limits(values):
        axes.set_ylim(*limits)


def _segments(branch: Branch) -> list[tuple[bool, list[int]]]:
    """Runs of points of one stability that follow each other; a new one where the branch begins anew."""
    out: list[tuple[bool, list[int]]] = []
    points = branch.points
    span = np.ptp([point.at for point in points]) or 1.0
    for i, point in enumerate(points):
        jump = i > 0 and abs(point.at - points[i - 1].at) > BREAK * span
        if not out or jump or out[-1][0] != point.orbit.stable:
            joined = [out[-1][1][-1]] if out and not jump else []
            out.append((point.orbit.stable, joined))
        out[-1][1].append(i)
    return out


def _motion(branch: Branch) -> Plate:
    """Hardest impact and highest flight against the parameter."""

    def draw(sheet: Sheet) -> None:
        for axes, name, unit in zip(
            sheet.grid(2, 2.2), ("hardest_impact", "highest_flight"), ("m/s", "m"), strict=True
        ):
            draw_branch(axes, branch, name, unit)
            few_ticks(axes, x=5, y=6)
            sheet.legend(axes)

    return plate(
        draw,
        "Approach speed of the hardest impact and height of the highest flight of a period along the branch.",
    )


def draw_multipliers(axes: Axes, multipliers: np.ndarray, size: float) -> None:
    """Multipliers in the complex plane, with the circle within which deviations die out."""
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    axes.plot(np.real(turn), np.imag(turn), color=RULE, lw=0.8)
    axes.plot(np.real(multipliers), np.imag(multipliers), "o", ms=size, mew=0.0, color=BLUE)
    axes.set_aspect("equal")
    axes.set(xlabel="real part", ylabel="imaginary part")


def _multipliers(branch: Branch) -> Plate:
    """Magnitude of the largest multipliers along the branch, and all of them in the plane."""
    at = np.array([point.at for point in branch.points])
    most = min(2, max((len(point.orbit.multipliers) for point in branch.points), default=0))
    every = np.concatenate([point.orbit.multipliers for point in branch.points])

    def draw(sheet: Sheet) -> None:
        left, right = sheet.grid(2, 2.3)
        for k in range(most):
            values = [
                abs(p.orbit.multipliers[k]) if len(p.orbit.multipliers) > k else np.nan for p in branch.points
            ]
            left.plot(at, np.maximum(values, 1e-4), ".", ms=2.5, color=(BLUE, ORANGE)[k])
        left.axhline(1.0, color=RULE, lw=0.8, zorder=0)
        left.set_yscale("log")
        name_axes(left, (branch.path, branch.unit), ("|multiplier|", ""))
        left.set_ylim(bottom=0.5e-4)
        few_ticks(left, x=5)
        draw_multipliers(right, every[np.abs(every) < 3.0], 2.5)
        few_ticks(right, x=4, y=4)

    return plate(
        draw,
        "The two largest multipliers (below 1e-4: drawn there), and all: inside the circle deviations die out.",
    )
