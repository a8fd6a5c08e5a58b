"""The report of a calibration: errors, rows with fitted and excluded predictions, hypotheses, ranges of unknowns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tarsus.calibrate.compared import numbers_table
from tarsus.calibrate.results import compared_rows
from tarsus.report.pages import Section, sections_page, whole
from tarsus.report.rows_figure import rows_figure
from tarsus.tables.table import Table

if TYPE_CHECKING:
    from tarsus.calibrate.calibrating import Calibration

MODELS = ("fitted", "median", "error when fitted", "error")
"""Columns of the rows: the ensemble that was fitted to a row, and the one that was not, where there is one."""

CAPTION = (
    "Measured values, medians of the ensemble that was fitted to them, and medians and 80 % intervals without the row."
)
ROWS = (
    "Excluded: median and interval are of the same search without the row. Predicted: the row holds no value that was "
    "fitted. That there are any above 0 has the probability of the same ensemble.",
)


def calibration_html(found: Calibration) -> str:
    """The page of a result, as text."""
    table, rows, study = found.table(), compared_rows(found), found.lowered.study
    *unknowns, errors = table.parts
    sections = [
        Section("How good", whole(errors)),
        Section("Rows", rows_figure(rows, CAPTION, MODELS), numbers_table("", rows, ROWS, models=MODELS)),
        Section("Hypotheses", whole(Table("", table.columns, table.rows, table.notes))),
        Section("Unknowns", *unknowns),
    ]
    return sections_page(f"Calibration: {study.name}", [f"Device {study.scene.name}; {table.title}."], sections)
