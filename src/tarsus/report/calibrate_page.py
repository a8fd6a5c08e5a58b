"""The report of a calibration: rows with fitted and excluded predictions, hypotheses, choices, ranges of unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import starmap
from typing import TYPE_CHECKING, Any

from tarsus.calibrate.results import calibration_table, errors_table, options_word, unknowns_table
from tarsus.calibrate.search import WITHIN
from tarsus.report.pages import Markup, Plate, Section, bullets, marked, sections_page
from tarsus.report.rows_figure import RowMarks, RowPanel, rows_figure
from tarsus.report.style import BLUE, INK, ORANGE
from tarsus.tables.numbers import interval, number
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.calibrate.calibrating import Calibration

_KINDS = {"training": ("fitted", ORANGE), "left_out": ("excluded", BLUE), "predicted": ("predicted", BLUE)}
"""Kinds of predictions: their words and colours."""


def calibration_html(found: Calibration) -> str:
    """The page of a result, as text."""
    result = found.to_dict()
    kept = sorted((one for one in result["branches"] if not one["dropped"]), key=lambda one: one["cost"])
    names, study = list(result["discrepancy"]), result["study"]
    sections = [
        Section("How good", errors_table(result["summary"]).bare()),
        Section("Rows", predictions_figure(result, names), _rows(result, names), ROWS),
        Section(
            "Hypotheses",
            calibration_table(result).bare(),
            _threshold(result),
            *starmap(_choice, result["choices"].items()),
            *_constraints(result["constraints"]),
        ),
        Section("Unknowns", *(Section(options_word(one), unknowns_table(one, meanings=True).bare()) for one in kept)),
    ]
    about = (
        f"Device {result['device']}; {result['sets']} sets of unknowns; {len(kept)} of {len(result['branches'])} "
        f"hypotheses kept; seed {result['seed']}."
    )
    title = f"Calibration: {study}"
    return sections_page(title, [about], sections, _definitions(result))


ROWS = """P is the probability of a bounce without the row; intervals in colour do not hold the measured value. Rows
without a fitted value are predictions."""


def _threshold(result: Mapping[str, Any]) -> str:
    """Which hypotheses are kept, and what the scale of residuals is."""
    return (
        f"A hypothesis is kept when its cost is within {number(WITHIN)} residual scales of the best (a likelihood "
        f"ratio of 20 to 1); the residual scale is {number(result['residual_scale'], 3)} tolerances, for "
        f"{number(result['effective_unknowns'], 3)} unknowns that the table's cells determine."
    )


def _choice(name: str, choice: Mapping[str, Any]) -> Markup:
    """The weights of a choice's options."""
    weights = ", ".join(f"{option} {weight:.2f}" for option, weight in choice["weights"].items())
    decided = "open: the data do not decide" if choice["open"] else "decided"
    return marked("<b>{}</b>: {} ({}). {}", name, weights, decided, choice["meaning"])


def _constraints(constraints: Sequence[Mapping[str, Any]]) -> list[str | Markup]:
    if not constraints:
        return []
    known = (f"{one['name']}: {one['reason'] or 'the study gives no reason.'}" for one in constraints)
    return ["Known besides the table:", bullets(known)]


def _definitions(result: Mapping[str, Any]) -> str:
    """What the page's words mean."""
    sigmas = "; ".join(f"{name} {one['sigma']:.2f}" for name, one in result["discrepancy"].items())
    return (
        f"Intervals hold 80 %: spread of the unknowns, of windows and draws, and the discrepancy of the model, in "
        f"tolerances: {sigmas}. Excluded: by the same search without the row. Determined: the 95 % interval reaches no "
        "farther than a quarter to either side, and the data set both of its ends; undecided: it reaches farther, or a "
        "bound of the search set an end; assumed: its spread is that of its prior."
    )


def _rows(result: Mapping[str, Any], names: list[str]) -> Table:
    """Every row of the table; an interval that does not hold the measured value is flagged."""
    titles = ("measured", "fitted", "excluded", "80 % interval")
    columns = ["row", *(Column(title, digits=3, over=name) for name in names for title in titles)]
    body, flagged = [], []
    for row in result["rows"]:
        cells: list[Any] = [row_name(row)]
        for name in names:
            fitted = (row.get("training") or {}).get(name)
            new = (row.get("left_out") or row.get("predicted") or {}).get(name)
            shown: Mapping[str, Any] = new or fitted or {}
            cells += [shown.get("observed"), fitted and fitted["median"], new and new["median"], _interval(shown)]
            flagged += [(len(body), len(cells) - 1)] * (shown.get("holds") is False)
        body.append(cells)
    return Table("", columns, body, flagged=flagged)


def _interval(entry: Mapping[str, Any]) -> str:
    """The interval, and the probability of a bounce where it is one."""
    bounce = "" if entry["p_bounce"] is None else f", P {entry['p_bounce']:.2f}"
    return interval(entry["low"], entry["high"], digits=3) + bounce


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


def row_name(row: Mapping[str, Any]) -> str:
    """A row by its conditions."""
    return " ".join(row["conditions"].values()) or f"row {row['row']}"
