"""The report of a calibration: rows with fitted and excluded predictions, hypotheses, choices, ranges of unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import starmap
from typing import TYPE_CHECKING, Any

from tarsus.calibrate.compared import numbers_table
from tarsus.calibrate.results import calibration_table, compared_rows, errors_table, options_word, unknowns_table
from tarsus.calibrate.search import WITHIN
from tarsus.report.pages import Markup, Section, bullets, marked, sections_page
from tarsus.report.rows_figure import rows_figure
from tarsus.tables.numbers import number

if TYPE_CHECKING:
    from tarsus.calibrate.calibrating import Calibration


MODELS = ("fitted", "median", "error when fitted", "error")
"""Columns of the rows: the ensemble that was fitted to a row, and the one that was not, where there is one."""


def calibration_html(found: Calibration) -> str:
    """The page of a result, as text."""
    result = found.to_dict()
    kept = sorted((one for one in result["branches"] if not one["dropped"]), key=lambda one: one["cost"])
    rows = compared_rows(found)
    sections = [
        Section("How good", errors_table(result["summary"]).bare()),
        Section("Rows", rows_figure(rows, CAPTION, MODELS), numbers_table("", rows, ROWS, models=MODELS)),
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
    return sections_page(f"Calibration: {result['study']}", [about], sections, _definitions(result))


CAPTION = (
    "Measured values, medians of the ensemble that was fitted to them, and medians and 80 % intervals without the row."
)
ROWS = (
    "Excluded: median and interval are of the same search without the row. Predicted: the row holds no value that was "
    "fitted. That there are any above 0 has the probability of the same ensemble.",
)


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
        f"tolerances: {sigmas}. Determined: the 95 % interval reaches no "
        "farther than a quarter to either side, and the data set both of its ends; undecided: it reaches farther, or a "
        "bound of the search set an end; assumed: its spread is that of its prior."
    )
