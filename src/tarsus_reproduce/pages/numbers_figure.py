"""Printed numbers beside ours: every case a row, one panel for each quantity."""

from __future__ import annotations

from collections.abc import Sequence

from tarsus.report.pages import Plate
from tarsus.report.rows_figure import RowMarks, RowPanel, rows_figure
from tarsus.report.style import BLUE, INK, ORANGE
from tarsus_reproduce.reproduction import NumberRow


def numbers_figure(rows: Sequence[NumberRow], caption: str) -> Plate:
    """Measured, source's model and ours as dots, our 80 % intervals as bars, of the quantities that are printed."""
    printed = {row.quantity for row in rows if row.measured is not None or row.source is not None}
    shown = [row for row in rows if row.quantity in printed]
    cases = list(dict.fromkeys(row.case for row in shown))
    own = {quantity: [row for row in shown if row.quantity == quantity] for quantity in printed}
    panels = (_quantity(own[quantity], cases) for quantity in dict.fromkeys(row.quantity for row in shown))
    return rows_figure(cases, panels, caption)


def _quantity(rows: Sequence[NumberRow], cases: Sequence[str]) -> RowPanel:
    """One quantity of all cases."""
    lines = [cases.index(row.case) for row in rows]

    def plain(who: str) -> list[tuple[int, float | None, None, None]]:
        return [(line, getattr(row, who), None, None) for line, row in zip(lines, rows, strict=True)]

    marks = [
        RowMarks("measured", INK, plain("measured")),
        RowMarks("source's model", ORANGE, plain("source")),
        RowMarks("Tarsus", BLUE, [(line, *row.ours) for line, row in zip(lines, rows, strict=True)]),
    ]
    return RowPanel(rows[0].quantity, rows[0].unit, marks)
