"""Figures of a calibration: rows against their predictions, and how far each unknown is determined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.report.pages import Plate
from tarsus.report.sheet import Sheet, few_ticks, plate
from tarsus.report.style import BLUE, CYCLE, INK, ORANGE, RULE

_LOOKS = {
    "training": (-0.16, ORANGE, "fitted"),
    "left_out": (0.16, BLUE, "excluded"),
    "predicted": (0.0, BLUE, ""),
}


def rows_figure(table: Mapping[str, Any], names: Sequence[str]) -> Plate:
    """Every row as one line, observed as circles, medians as dots with their 80 % intervals; one panel a measure."""
    rows = table["rows"]
    words = [row_name(row) for row in rows]

    def draw(sheet: Sheet) -> None:
        panels = sheet.grid(len(names), 0.28 * len(rows))
        for axes, name in zip(panels, names, strict=True):
            _measure(axes, rows, name)
            axes.set_yticks(range(len(rows)), words)
            axes.set_ylim(len(rows) - 0.5, -0.5)
        sheet.legend(panels[0])

    return plate(
        draw,
        "Measured values, and median and 80 % interval of the ensemble: fitted with all rows, and without the row.",
    )


def _measure(axes: Axes, rows: Sequence[Mapping[str, Any]], name: str) -> None:
    """One measure of all rows."""
    lines = np.arange(len(rows), dtype=float)
    axes.hlines(lines, 0.0, 1.0, transform=axes.get_yaxis_transform(), color=RULE, lw=0.6, zorder=0)
    for key, (shift, color, label) in _LOOKS.items():
        entries = [(n, row[key][name]) for n, row in enumerate(rows) if row.get(key)]
        y = [n + shift for n, _ in entries]
        axes.hlines(y, [e["low"] for _, e in entries], [e["high"] for _, e in entries], color=color, lw=1.1)
        axes.plot(
            [e["median"] for _, e in entries], y, "D", ms=3.4, mew=0.0, color=color, label=label or None
        )
    seen = [_observed(row, name) for row in rows]
    axes.plot(seen, lines, "o", ms=6.0, mfc="white", mew=1.2, color=INK, label="measured")
    unit = _unit(rows, name)
    axes.set_xlabel(f"{name} ({unit})" if unit != "1" else name)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    few_ticks(axes, x=5)


def ranges(branches: Sequence[Mapping[str, Any]]) -> Plate:
    """90 % range of every unknown in parts of its bounds, one colour a hypothesis; dots are the best members."""
    names = list(branches[0]["unknowns"])

    def draw(sheet: Sheet) -> None:
        height = 0.1 + len(names) * max(0.26, 0.09 * len(branches))
        (axes,) = sheet.grid(1, height)
        for b, branch in enumerate(branches):
            shift = 0.7 * ((b + 0.5) / len(branches) - 0.5)
            color = CYCLE[b % len(CYCLE)]
            y = [n + shift for n in range(len(names))]
            low, high, best = (
                [_place(one, one[key]) for one in branch["unknowns"].values()]
                for key in ("low", "high", "best")
            )
            axes.hlines(y, low, high, color=color, lw=2.0)
            axes.plot(best, y, "o", ms=3.2, color=color)
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlim(0.0, 1.0)
        axes.set_xlabel("between the bounds")

    return plate(
        draw,
        "90 % range of each unknown between its bounds, on its own scale; one colour for each hypothesis, its best set as "
        "a dot.",
    )


def row_name(row: Mapping[str, Any]) -> str:
    """A row by its conditions."""
    return " ".join(row["conditions"].values()) or f"row {row['row']}"


def _place(unknown: Mapping[str, Any], value: float) -> float:
    low, high = unknown["bounds"]
    if unknown["scale"] == "log":
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)


def _observed(row: Mapping[str, Any], name: str) -> float:
    for key in ("training", "predicted"):
        if row.get(key):
            return row[key][name].get("observed", math.nan)
    return math.nan


def _unit(rows: Sequence[Mapping[str, Any]], name: str) -> str:
    return next(row[key][name]["unit"] for row in rows for key in ("training", "predicted") if row.get(key))
