"""Figures of a calibration: rows against their predictions, and how far each unknown is determined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tarsus.report.pages import Plate
from tarsus.report.rows_figure import MEASURED, MODEL, OTHER_MODEL, RowMarks, RowPanel, rows_figure
from tarsus.report.sheet import Sheet, plate
from tarsus.report.style import CYCLE

_KINDS = {
    "training": ("fitted", OTHER_MODEL, -0.16),
    "left_out": ("excluded", MODEL, 0.16),
    "predicted": ("predicted", MODEL, 0.0),
}
"""Kinds of predictions: their words, how they are drawn, and how far below the line."""


def predictions_figure(table: Mapping[str, Any], names: Sequence[str]) -> Plate:
    """Every row as one line, observed as circles, medians as dots with their 80 % intervals; one panel a measure."""
    rows = table["rows"]
    panels = []
    for name in names:
        found = {key: [(n, row[key][name]) for n, row in enumerate(rows) if row.get(key)] for key in _KINDS}
        known = [*found["training"], *found["predicted"]]
        panels.append(
            RowPanel(
                name,
                next((entry["unit"] for _, entry in known), "1"),
                [
                    *(
                        RowMarks(
                            words, look, [(n, e["median"], e["low"], e["high"]) for n, e in found[key]], shift
                        )
                        for key, (words, look, shift) in _KINDS.items()
                    ),
                    RowMarks("measured", MEASURED, [(n, e.get("observed"), None, None) for n, e in known]),
                ],
            )
        )
    caption = "Measured values, and median and 80 % interval of the ensemble: fitted with all rows, without the row."
    return rows_figure([row_name(row) for row in rows], panels, caption)


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
        "90 % range of each unknown between its bounds, on its own scale; one colour for each hypothesis, its best set "
        "as a dot.",
    )


def row_name(row: Mapping[str, Any]) -> str:
    """A row by its conditions."""
    return " ".join(row["conditions"].values()) or f"row {row['row']}"


def _place(unknown: Mapping[str, Any], value: float) -> float:
    low, high = unknown["bounds"]
    if unknown["scale"] == "log":
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)
