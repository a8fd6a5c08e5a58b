"""Printed numbers beside ours: every case as one line, one panel for each quantity."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tarsus.report.pages import Plate
from tarsus.report.sheet import Sheet, plate
from tarsus.report.style import BLUE, INK, ORANGE, RULE, SKY, scale_of
from tarsus_reproduce.reproduction import NumberRow

_LOOKS = {
    "measured": {"marker": "o", "color": INK, "ms": 6.0, "mfc": "white", "mew": 1.2},
    "source's model": {"marker": "s", "color": ORANGE, "ms": 4.2, "mew": 0.0},
    "without small forces": {"marker": "^", "color": SKY, "ms": 4.6, "mew": 0.0},
    "Tarsus": {"marker": "D", "color": BLUE, "ms": 4.6, "mew": 0.0},
}


def numbers_figure(rows: Sequence[NumberRow], caption: str) -> Plate:
    """Measured, source's model and ours as dots, our 80 % intervals as bars, of the quantities that are printed."""
    printed = {row.quantity for row in rows if row.measured is not None or row.source is not None}
    shown = [row for row in rows if row.quantity in printed]
    cases = list(dict.fromkeys(row.case for row in shown))
    quantities = list(dict.fromkeys(row.quantity for row in shown))

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(quantities), 0.2 * max(len(cases), 5))
        for axes, quantity in zip(panels, quantities, strict=True):
            _quantity(axes, [row for row in shown if row.quantity == quantity], cases)
            axes.set_yticks(range(len(cases)), cases)
            axes.set_ylim(len(cases) - 0.5, -0.5)
        sheet.legend(panels[0])

    return plate(draw, caption)


def _quantity(axes: Axes, rows: Sequence[NumberRow], cases: Sequence[str]) -> None:
    """One quantity of all cases."""
    lines = np.array([cases.index(row.case) for row in rows], dtype=float)
    bare = [row.without for row in rows if row.without is not None]
    known = np.array([_number(value) for row in rows for value in (row.measured, row.ours.high)])
    scale = scale_of(rows[0].unit, known[np.isfinite(known)])
    axes.hlines(lines, 0.0, 1.0, transform=axes.get_yaxis_transform(), color=RULE, lw=0.6, zorder=0)
    values = {
        "measured": [row.measured for row in rows],
        "source's model": [row.source for row in rows],
        "without small forces": [one.median for one in bare],
        "Tarsus": [row.ours.median for row in rows],
    }
    intervals = {"Tarsus": ([row.ours for row in rows], BLUE), "without small forces": (bare, SKY)}
    for who, found in values.items():
        at = lines + (0.22 if who == "without small forces" else 0.0)
        if not found:
            continue
        if who in intervals:
            ends, color = intervals[who]
            low, high = (
                np.array([getattr(one, end) for one in ends]) / scale.step for end in ("low", "high")
            )
            axes.hlines(at, low, high, color=color, lw=1.1, zorder=3)
        shown = np.array([_number(value) for value in found]) / scale.step
        axes.plot(shown, at, ls="none", label=who, zorder=4 if who == "Tarsus" else 3, **_LOOKS[who])
    axes.set_xlabel(
        f"{rows[0].quantity} ({scale.label})" if scale.label not in ("", "1") else rows[0].quantity
    )
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    if rows[0].unit == "s":
        _stretch(axes)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=rows[0].unit == "1"))
        axes.set_xlim(left=0.0 if rows[0].unit != "1" else -0.02 * axes.get_xlim()[1])


def _stretch(axes: Axes) -> None:
    """A scale that shows 0 and both 1 and 100 ms: linear below 1 ms and logarithmic above."""
    axes.set_xscale("symlog", linthresh=1.0, linscale=0.5)
    axes.set_xticks([0.0, 1.0, 3.0, 10.0, 30.0, 100.0], ["0", "1", "3", "10", "30", "100"])
    axes.set_xticks([], minor=True)
    axes.set_xlim(-0.2, max(140.0, axes.get_xlim()[1]))


def _number(value: float | None) -> float:
    return math.nan if value is None else value
