"""Figures of a calibration: rows against their predictions, and how far each unknown is determined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tarsus.report.figures import Plate
from tarsus.report.style import BLUE, CYCLE, INK, ORANGE, RULE, WIDTH_IN, few_ticks, to_svg

__all__ = ["ranges", "rows_figure"]

_LOOKS = {
    "training": (-0.16, ORANGE, "fitted"),
    "left_out": (0.16, BLUE, "left out"),
    "predicted": (0.0, BLUE, ""),
}


def rows_figure(table: Mapping[str, Any], names: Sequence[str]) -> Plate:
    """Every row as one line, observed as circles, medians as dots with their 80 % intervals; one panel a measure."""
    rows = table["rows"]
    height = 0.85 + 0.28 * len(rows)
    drawn = Figure(figsize=(WIDTH_IN, height))
    panels = drawn.subplots(1, len(names), sharey=True, squeeze=False)[0]
    drawn.subplots_adjust(left=0.2, right=0.985, bottom=0.5 / height, top=1.0 - 0.35 / height, wspace=0.09)
    lines = np.arange(len(rows), dtype=float)
    for axes, name in zip(panels, names, strict=True):
        axes.hlines(lines, 0.0, 1.0, transform=axes.get_yaxis_transform(), color=RULE, lw=0.6, zorder=0)
        for key, (shift, color, label) in _LOOKS.items():
            entries = [(n, row[key][name]) for n, row in enumerate(rows) if row.get(key)]
            y = [n + shift for n, _ in entries]
            axes.hlines(
                y, [e["low"] for _, e in entries], [e["high"] for _, e in entries], color=color, lw=1.1
            )
            axes.plot(
                [e["median"] for _, e in entries], y, "D", ms=3.4, mew=0.0, color=color, label=label or None
            )
        seen = [(n, _observed(row, name)) for n, row in enumerate(rows)]
        axes.plot(
            [o for _, o in seen],
            [n for n, _ in seen],
            "o",
            ms=6.0,
            mfc="white",
            mew=1.2,
            color=INK,
            label="measured",
        )
        unit = _unit(rows, name)
        axes.set_xlabel(f"{name} ({unit})" if unit != "1" else name)
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        few_ticks(axes, x=5)
    panels[0].set_yticks(lines, [row_name(row) for row in rows])
    panels[0].set_ylim(len(rows) - 0.5, -0.5)
    handles, labels = panels[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="upper center", ncols=max(len(labels), 1), handletextpad=0.3)
    caption = "Measured values, and median and 80 % interval of the mixture: fitted with all rows, and without the row."
    return Plate(to_svg(drawn, caption), caption)


def ranges(branches: Sequence[Mapping[str, Any]]) -> Plate:
    """90 % range of every unknown in parts of its bounds, one colour a branch; dots are the best members."""
    names = list(branches[0]["unknowns"])
    height = 0.7 + len(names) * max(0.26, 0.09 * len(branches))
    drawn = Figure(figsize=(WIDTH_IN, height))
    axes = drawn.subplots()
    drawn.subplots_adjust(left=0.2, right=0.985, bottom=0.48 / height, top=1.0 - 0.2 / height)
    for b, branch in enumerate(branches):
        shift = 0.7 * ((b + 0.5) / len(branches) - 0.5)
        color = CYCLE[b % len(CYCLE)]
        y = [n + shift for n in range(len(names))]
        places = [
            [_place(one, one[key]) for key in ("low", "high", "best")] for one in branch["unknowns"].values()
        ]
        axes.hlines(y, [p[0] for p in places], [p[1] for p in places], color=color, lw=2.0)
        axes.plot([p[2] for p in places], y, "o", ms=3.2, color=color)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("between the bounds")
    caption = (
        "90 % range of each unknown between its bounds, on its own scale; one colour for each branch, its best set as "
        "a dot."
    )
    return Plate(to_svg(drawn, caption), caption)


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
