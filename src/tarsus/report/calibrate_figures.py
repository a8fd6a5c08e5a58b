"""Figures of a calibration: rows against their predictions, and how far each unknown is determined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tarsus.calibrate.results import options_word
from tarsus.report.charts import Charts
from tarsus.report.pages import Plate
from tarsus.report.rows_figure import Mark, RowMarks, RowPanel, rows_figure
from tarsus.report.style import CYCLE

_KINDS = {
    "training": ("fitted", Mark.OTHER_MODEL),
    "left_out": ("excluded", Mark.MODEL),
    "predicted": ("predicted", Mark.MODEL),
}
"""Kinds of predictions: their words, and how they are drawn."""


def predictions_figure(table: Mapping[str, Any], names: Sequence[str]) -> Plate:
    """Every row beside the next, observed and medians as dots, these with their 80 % intervals; one panel a measure."""
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
                        RowMarks(words, mark, [(n, e["median"], e["low"], e["high"]) for n, e in found[key]])
                        for key, (words, mark) in _KINDS.items()
                    ),
                    RowMarks(
                        "measured", Mark.MEASURED, [(n, e.get("observed"), None, None) for n, e in known]
                    ),
                ],
            )
        )
    caption = "Measured values, and median and 80 % interval of the ensemble: fitted with all rows, without the row."
    return rows_figure([row_name(row) for row in rows], panels, caption)


def ranges(branches: Sequence[Mapping[str, Any]]) -> Plate:
    """90 % range of every unknown in parts of its bounds, one colour a hypothesis; dots are the best members."""
    names = list(branches[0]["unknowns"])
    charts = Charts([1.6], "unknown", "", rows=names)
    (panel,) = charts.panels
    for b, branch in enumerate(branches):
        low, high, best = (
            [_place(one, one[key]) for one in branch["unknowns"].values()] for key in ("low", "high", "best")
        )
        at = np.arange(len(names)) + 0.7 * ((b + 0.5) / len(branches) - 0.5)
        panel.dots(at, best, color=CYCLE[b % len(CYCLE)], label=options_word(branch), low=low, high=high)
    panel.set_ylim(-0.02, 1.02)
    panel.set_ylabel("place between the bounds")
    return charts.plate(
        "90 % range of each unknown between its bounds, 0 the lower and 1 the upper, on its own scale; its best set as "
        "a dot."
    )


def row_name(row: Mapping[str, Any]) -> str:
    """A row by its conditions."""
    return " ".join(row["conditions"].values()) or f"row {row['row']}"


def _place(unknown: Mapping[str, Any], value: float) -> float:
    low, high = unknown["bounds"]
    if unknown["scale"] == "log":
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)
