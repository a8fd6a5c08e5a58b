"""The report of branches of orbits: their picture, what happens along them, where several coexist, multipliers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.arrays import Floats
from tarsus.orbits.branches import Branches
from tarsus.report.charts import Charts, with_room
from tarsus.report.pages import Plate, page, rendered
from tarsus.report.sheet import Sheet, few_ticks, plate
from tarsus.report.style import (
    BLUE,
    CONTACT,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    RULE,
    SKY,
    VERMILION,
)
from tarsus.tables.numbers import number, spaced

MARKS = {
    "fold": ("s", VERMILION), "flip": ("D", PURPLE), "neimark-sacker": ("^", GREEN), "grazing": ("o", ORANGE),
    "sticking": ("v", INK), "capture": ("<", SKY), "simultaneous": ("P", MUTED), "events": ("X", MUTED),
}  # fmt: skip
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
    body = rendered(
        "branch.html", found=found, motion=_motion(found), sizes=_sizes(found), plane=_plane(found), smallest=SMALLEST,
        specials=whole.bare(),
        branches=branches.bare(), several=several.bare(), orbits=listed,
    )  # fmt: skip
    return page(f"{found.scene.name} – branches", body)


@dataclass(frozen=True)
class BranchLine:
    """A stretch of a branch: numbers of its orbits (n,) along the parameter, and whether their motion is stable."""

    at: Floats
    values: Floats
    stable: bool

    @property
    def look(self) -> dict[str, Any]:
        """How it is drawn: broken where the motion is unstable."""
        if self.stable:
            return {"label": "stable", "color": BLUE, "lw": 1.2}
        return {"label": "unstable", "color": VERMILION, "lw": 1.2, "ls": (0, (4.0, 3.0))}


@dataclass(frozen=True)
class BranchPicture:
    """A number of every orbit along the branches, such as `hardest_impact`: lines, the number of each branch half way
    (place, value, text; none of an only one), and by its name what happens (place and value (n,))."""

    lines: Sequence[BranchLine]
    numbers: Sequence[tuple[float, float, str]]
    marks: Mapping[str, tuple[Floats, Floats]]

    @classmethod
    def of(cls, found: Branches, name: str) -> BranchPicture:
        """Of the branches found."""
        lines, numbers, happens = [], [], {}
        for place, branch in enumerate(found, 1):
            at = np.array([point.at for point in branch.points])
            values = np.array([getattr(point.orbit, name) for point in branch.points])
            lines += [BranchLine(at[places], values[places], stable) for stable, places in branch.parts()]
            half = len(at) // 2
            if len(found) > 1 and np.isfinite(values[half]):
                numbers.append((float(at[half]), float(values[half]), str(place)))
            for point, value in zip(branch.points, values.tolist(), strict=True):
                if point.kind in MARKS and np.isfinite(value):
                    happens.setdefault(point.kind, []).append((point.at, value))
        return cls(lines, numbers, {kind: tuple(np.array(rows).T) for kind, rows in happens.items()})


def _motion(found: Branches) -> Plate:
    """Hardest impact and highest flight against the parameter."""
    charts = _along(found, [1.7, 1.7])
    for panel, name, unit in zip(
        charts.panels, ("hardest_impact", "highest_flight"), ("m/s", "m"), strict=True
    ):
        drawn = BranchPicture.of(found, name)
        for one in drawn.lines:
            panel.plot(one.at, one.values, **one.look)
        for place, value, text in drawn.numbers:
            panel.annotate(text, (place, value))
        for kind, (places, values) in drawn.marks.items():
            panel.dots(places, values, color=MARKS[kind][1], label=kind)
        if found.coexisting:
            panel.shade((one.low, one.high) for one in found.coexisting)
            panel.sign("several stable motions", CONTACT, area=True)
        panel.set_ylabel(spaced(name), unit)
    return charts.plate(
        "Approach speed of the hardest impact and height of the highest flight of a period along every branch"
        f"{', numbered as in the table' * (len(found) > 1)}."
    )


def _along(found: Branches, heights: Sequence[float]) -> Charts:
    at = [point.at for branch in found for point in branch.points]
    return Charts(heights, found.path, found.unit, with_room(min(at), max(at)))


def draw_multipliers(axes: Axes, multipliers: np.ndarray, size: float) -> None:
    """Multipliers in the complex plane, with the circle within which deviations die out."""
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    axes.plot(np.real(turn), np.imag(turn), color=RULE, lw=0.8)
    axes.plot(np.real(multipliers), np.imag(multipliers), "o", ms=size, mew=0.0, color=BLUE)
    axes.set_aspect("equal")
    axes.set(xlabel="real part", ylabel="imaginary part")


def _sizes(found: Branches) -> Plate | None:
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
    charts = _along(found, [2.0])
    (panel,) = charts.panels
    for row, kept, color, word in (
        (0, drawn[0] & ~pair, BLUE, "largest"), (0, drawn[0] & pair, GREEN, "largest two, a pair"),
        (1, drawn[1] & ~pair, ORANGE, "second"),
    ):  # fmt: skip
        panel.dots(at[kept], sizes[row, kept], color=color, label=word)
    panel.axhline(1.0, color=MUTED)
    panel.set_yscale("log")
    panel.set_ylim(top=2.0 * max(1.0, float(sizes.max())))
    panel.set_ylabel("|multiplier|")
    left = int((sizes[0] < SMALLEST).sum())
    small = f" At {left} of {len(points)} orbits all are below {number(SMALLEST)}, and not drawn." if left else ""
    return charts.plate(f"The two largest multipliers along the branches. Above the line deviations grow.{small}")


def _plane(found: Branches) -> Plate:
    """All multipliers in the complex plane."""
    every = np.concatenate([point.orbit.multipliers for branch in found for point in branch.points])

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 2.3)
        draw_multipliers(axes, every[np.abs(every) < 3.0], 2.5)
        few_ticks(axes, x=4, y=4)

    return plate(draw, "All multipliers: inside the circle deviations die out.")
