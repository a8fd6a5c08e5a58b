"""The report of a branch of orbits: its picture, what happens along it, multipliers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tarsus.files.store import package_version, write_text
from tarsus.orbits import Branch, BranchPoint, Orbit
from tarsus.orbits.files import hardest, highest
from tarsus.report.figures import Plate
from tarsus.report.html import Cell, Column, amount, escape, figure, number, page, table
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
    WIDTH_IN,
    few_ticks,
    figure_style,
    scale_of,
    to_svg,
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
    numbers = count(1)
    first, last = branch.points[0], branch.points[-1]
    parts = [
        f"<h1>Branch: {escape(branch.scene.name)}</h1>\n",
        f'<p class="lede">Periodic motion along {escape(branch.path)} from {amount(first.at, branch.unit)} to '
        f"{amount(last.at, branch.unit)}: {len(branch.points)} orbits; {escape(branch.ended)}. "
        f"Tarsus {escape(package_version())}.</p>\n",
        "<h2>Motion</h2>\n",
    ]
    with figure_style():
        parts.append(figure(_motion(branch), next(numbers)))
        parts.append("<h2>Stability</h2>\n")
        parts.append(figure(_multipliers(branch), next(numbers)))
    parts += ["<h2>What happens</h2>\n", _specials(branch), "<h2>Orbits</h2>\n", _orbits(branch)]
    return page(f"{branch.scene.name} – branch", "".join(parts))


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
    few_ticks(axes)


def _motion(branch: Branch) -> Plate:
    """Hardest impact and highest flight against the parameter."""
    drawn = Figure(figsize=(WIDTH_IN, 2.9))
    left, right = drawn.subplots(1, 2)
    drawn.subplots_adjust(left=0.09, right=0.985, bottom=0.17, top=0.88, wspace=0.28)
    _panel(left, branch, hardest, "m/s", "hardest impact")
    _panel(right, branch, highest, "m", "highest flight")
    kinds = list(dict.fromkeys(point.kind for point in branch.special if point.kind in _MARKS))
    for kind in kinds:
        marker, color = _MARKS[kind]
        left.plot([], [], marker, color=color, ms=5.0, mew=0.0, label=kind)
    if any(point.orbit.stable for point in branch.points):
        left.plot([], [], "-", color=BLUE, label="stable")
    if not all(point.orbit.stable for point in branch.points):
        left.plot([], [], "--", color=VERMILION, label="unstable")
    handles, labels = left.get_legend_handles_labels()
    drawn.legend(handles, labels, loc="upper center", ncols=len(labels), handletextpad=0.4)
    caption = (
        "Approach speed of the hardest impact and height of the highest flight of a period along the branch."
    )
    return Plate(to_svg(drawn, caption), caption)


def _multipliers(branch: Branch) -> Plate:
    """Magnitude of the largest multipliers along the branch, and all of them in the plane."""
    drawn = Figure(figsize=(WIDTH_IN, 2.9))
    left, right = drawn.subplots(1, 2, width_ratios=(1.6, 1.0))
    drawn.subplots_adjust(left=0.09, right=0.985, bottom=0.17, top=0.96, wspace=0.25)
    at = np.array([point.at for point in branch.points])
    along = scale_of(branch.unit, at)
    most = min(2, max((len(point.orbit.multipliers) for point in branch.points), default=0))
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
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    right.plot(np.real(turn), np.imag(turn), color=RULE, lw=0.8)
    every = np.concatenate([point.orbit.multipliers for point in branch.points])
    near = every[np.abs(every) < 3.0]
    right.plot(np.real(near), np.imag(near), ".", ms=2.5, color=BLUE)
    right.set_aspect("equal")
    right.set_xlabel("real part")
    right.set_ylabel("imaginary part")
    caption = "The two largest multipliers (below 1e-4: drawn there), and all: inside the circle deviations die out."
    return Plate(to_svg(drawn, caption), caption)


def _specials(branch: Branch) -> str:
    if not branch.special:
        return "<p>Nothing: the same events in the same order all along, and no change of stability.</p>\n"
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


def _orbits(branch: Branch) -> str:
    rows: list[list[Cell]] = []
    for point in _thinned(branch.points):
        largest = abs(point.orbit.multipliers[0]) if len(point.orbit.multipliers) else np.nan
        rows.append(
            [
                number(point.at, 6),
                point.orbit.kind,
                number(hardest(point.orbit), 4),
                number(highest(point.orbit) * 1e6, 4),
                number(largest, 4),
            ]
        )
    head = (
        Column(branch.path, branch.unit), Column("motion", number=False), Column("hardest impact", "m/s"),
        Column("highest flight", "µm"), Column("largest |multiplier|"),
    )  # fmt: skip
    return table(head, rows, tall=True)


MOST_LISTED = 60
"""Orbits in the page's table: every one is in `branch.json`."""


def _thinned(points: Sequence[BranchPoint]) -> Sequence[BranchPoint]:
    step = max(1, -(-len(points) // MOST_LISTED))
    return points[::step]
