"""Figures of a calibration: rows against their predictions, and how far each unknown is determined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tarsus.calibrate.results import options_word
from tarsus.report.pages import Plate
from tarsus.report.rows_figure import RowMarks, RowPanel, rows_figure
from tarsus.report.style import BLUE, CYCLE, INK, ORANGE

_KINDS = {"training": ("fitted", ORANGE), "left_out": ("excluded", BLUE), "predicted": ("predicted", BLUE)}
"""Kinds of predictions: their words and colours."""


def predictions_figure(table: Mapping[str, Any], names: Sequence[str]) -> Plate:
    """Every row below the next, observed and medians as dots, these with their 80 % intervals; one panel a measure."""
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
                        RowMarks(words, color, [(n, e["median"], e["low"], e["high"]) for n, e in found[key]])
                        for key, (words, color) in _KINDS.items()
                    ),
                    RowMarks("measured", INK, [(n, e.get("observed"), None, None) for n, e in known]),
                ],
            )
        )
    caption = "Measured values, and median and 80 % interval of the ensemble: fitted with all rows, without the row."
    return rows_figure([row_name(row) for row in rows], panels, caption)


def ranges(branches: Sequence[Mapping[str, Any]]) -> Plate:
    """90 % range of every unknown in parts of its bounds, one colour a hypothesis; dots are the best members."""
    names = list(branches[0]["unknowns"])
    marks = []
    for b, branch in enumerate(branches):
        places = ([_place(one, one[key]) for key in ("best", "low", "high")] for one in branch["unknowns"].values())
        numbers = [(n, best, low, high) for n, (best, low, high) in enumerate(places)]
        marks.append(RowMarks(options_word(branch), CYCLE[b % len(CYCLE)], numbers))
    return rows_figure(
        names,
        [RowPanel("place between the bounds", "", marks, (-0.02, 1.02))],
        "90 % range of each unknown between its bounds, 0 the lower and 1 the upper, on its own scale; its best set as "
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
