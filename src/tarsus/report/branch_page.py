"""The report of a branch of orbits: its picture, what happens along it, multipliers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from tarsus.files.store import write_text
from tarsus.orbits import Branch, BranchPoint, Orbit
from tarsus.report.figures import Plate
from tarsus.report.html import Cell, Column, Markup, amount, number, page, table
from tarsus.report.render import rendered
from tarsus.report.sheet import Sheet, few_ticks, plate
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
    scale_of,
)

__all__ = ["branch_html", "write_branch_report"]

_MARKS = {
    "fold": ("s", VERMILION), "flip": ("D", PURPLE), "neimark-sacker": ("^", GREEN), "grazing": ("o", ORANGE),
    "sticking": ("v", INK), "capture": ("<", SKY), "simultaneous": ("P", MUTED), "events": ("X", MUTED),
}  # fmt: skip


def write_branch_report(branch: Branch, path: str | Path) -> Path:
    """Write a branch as one self-contained HTML file and return its path. Raises InputError if it cannot be written."""
    target = Path(path)
    write_text(target, branch_html(branch))
    return target


def branch_html(branch: Branch) -> str:
    """The page as text; see `write_branch_report`."""
    body = rendered(
        "branch.html", branch=branch, motion=_motion(branch), multipliers=_multipliers(branch),
        specials=_specials(branch), orbits=_orbits(branch),
    )  # fmt: skip
    return page(f"{branch.scene.name} – branch", body)


def _segments(branch: Branch) -> list[tuple[bool, list[int]]]:
    """Runs of points of one stability that follow each other; a new one where the branch begins anew."""
    out: list[tuple[bool, list[int]]] = []
    points = branch.points
    span = np.ptp([point.at for point in points]) or 1.0
    for i, point in enumerate(points):
        jump = i > 0 and abs(point.at - points[i - 1].at) > 0.06 * span
        if not out or jump or out[-1][0] != point.orbit.stable:
            joined = [out[-1][1][-1]] if out and not jump else []
            out.append((point.orbit.stable, joined))
        out[-1][1].append(i)
    return out


def _panel(axes: Axes, branch: Branch, value: Callable[[Orbit], float], unit: str, label: str) -> None:
    at = np.array([point.at for point in branch.points])
    values = np.array([value(point.orbit) for point in branch.points])
    along, across = (
        scale_of(branch.unit, at),
        scale_of(unit, values[np.isfinite(values)] if np.isfinite(values).any() else 1.0),
    )
    for stable, places in _segments(branch):
        axes.plot(
            at[places] / along.step, values[places] / across.step, "-" if stable else "--",
            color=BLUE if stable else VERMILION, lw=1.2,
        )  # fmt: skip
    for i, point in enumerate(branch.points):
        if point.kind in _MARKS and np.isfinite(values[i]):
            marker, color = _MARKS[point.kind]
            axes.plot(
                at[i] / along.step, values[i] / across.step, marker, color=color, ms=5.0, mew=0.0, zorder=5
            )
    axes.set_xlabel(f"{branch.path} ({along.label})".replace(" ()", ""))
    axes.set_ylabel(f"{label} ({across.label})")
    few_ticks(axes, x=5, y=6)
    if limits := level_limits(values / across.step):
        axes.set_ylim(*limits)


def _motion(branch: Branch) -> Plate:
    """Hardest impact and highest flight against the parameter."""

    def draw(sheet: Sheet) -> None:
        left, right = sheet.grid(2, 2.2)
        _panel(left, branch, lambda one: one.hardest_impact, "m/s", "hardest impact")
        _panel(right, branch, lambda one: one.highest_flight, "m", "highest flight")
        for kind in dict.fromkeys(point.kind for point in branch.special if point.kind in _MARKS):
            marker, color = _MARKS[kind]
            left.plot([], [], marker, color=color, ms=5.0, mew=0.0, label=kind)
        for stable, style, color, label in (
            (True, "-", BLUE, "stable"),
            (False, "--", VERMILION, "unstable"),
        ):
            if any(point.orbit.stable == stable for point in branch.points):
                left.plot([], [], style, color=color, label=label)
        sheet.legend(left)

    return plate(
        draw,
        "Approach speed of the hardest impact and height of the highest flight of a period along the branch.",
    )


def _multipliers(branch: Branch) -> Plate:
    """Magnitude of the largest multipliers along the branch, and all of them in the plane."""
    at = np.array([point.at for point in branch.points])
    along = scale_of(branch.unit, at)
    most = min(2, max((len(point.orbit.multipliers) for point in branch.points), default=0))
    every = np.concatenate([point.orbit.multipliers for point in branch.points])
    near, turn = every[np.abs(every) < 3.0], np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))

    def draw(sheet: Sheet) -> None:
        left, right = sheet.grid(2, 2.3)
        for k in range(most):
            values = [
                abs(p.orbit.multipliers[k]) if len(p.orbit.multipliers) > k else np.nan for p in branch.points
            ]
            left.plot(at / along.step, np.maximum(values, 1e-4), ".", ms=2.5, color=(BLUE, ORANGE)[k])
        left.axhline(1.0, color=RULE, lw=0.8, zorder=0)
        left.set_yscale("log")
        left.set_xlabel(f"{branch.path} ({along.label})".replace(" ()", ""))
        left.set_ylabel("|multiplier|")
        left.set_ylim(bottom=0.5e-4)
        few_ticks(left, x=5)
        right.plot(np.real(turn), np.imag(turn), color=RULE, lw=0.8)
        right.plot(np.real(near), np.imag(near), ".", ms=2.5, color=BLUE)
        right.set_aspect("equal")
        right.set_xlabel("real part")
        right.set_ylabel("imaginary part")
        few_ticks(right, x=4, y=4)

    return plate(
        draw,
        "The two largest multipliers (below 1e-4: drawn there), and all: inside the circle deviations die out.",
    )


def _specials(branch: Branch) -> Markup:
    rows: list[list[Cell]] = [
        [point.kind, number(point.at, 10), point.note, point.orbit.kind] for point in branch.special
    ]
    head = (
        Column("kind", number=False),
        Column(branch.path, branch.unit),
        Column("what", number=False),
        Column("motion", number=False),
    )
    return table(head, rows)


def _orbits(branch: Branch) -> Markup:
    rows: list[list[Cell]] = []
    for point in _thinned(branch.points):
        largest = abs(point.orbit.multipliers[0]) if len(point.orbit.multipliers) else np.nan
        rows.append(
            [
                number(point.at, 6),
                point.orbit.kind,
                number(point.orbit.hardest_impact, 4),
                amount(point.orbit.highest_flight, "m"),
                number(largest, 4),
            ]
        )
    head = (
        Column(branch.path, branch.unit), Column("motion", number=False), Column("hardest impact", "m/s"),
        Column("highest flight"), Column("largest |multiplier|"),
    )  # fmt: skip
    return table(head, rows, tall=True)


MOST_LISTED = 60
"""Orbits in the page's table: every one is in `branch.json`."""


def _thinned(points: Sequence[BranchPoint]) -> Sequence[BranchPoint]:
    step = max(1, -(-len(points) // MOST_LISTED))
    return points[::step]
