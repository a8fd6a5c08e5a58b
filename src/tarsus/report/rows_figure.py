"""The figure of a table's rows: what was measured beside what is computed, every row a place, every measure a panel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from tarsus.report.charts import ChartPanel, Charts
from tarsus.report.pages import Plate
from tarsus.report.style import BLUE, INK, ORANGE, SKY

HEIGHT = 1.0
"""Height of a panel [inch]."""

THOUSANDTH = 1e-3
"""Times are drawn linearly to a thousandth of a second and logarithmically above: tables hold both 0 and 100 ms."""


class Mark(Enum):
    """What numbers are: their colour, and how far beside the middle of a row's place they stand."""

    MEASURED = (INK, -0.21)
    MODEL = (BLUE, 0.21)
    OTHER_MODEL = (ORANGE, -0.07)
    THIRD_MODEL = (SKY, 0.07)


@dataclass(frozen=True)
class RowMarks:
    """Numbers of one kind: (row, value, low, high) each, None where there is none."""

    label: str
    mark: Mark
    numbers: Sequence[tuple[int, float | None, float | None, float | None]]

    def draw(self, panel: ChartPanel) -> None:
        """As dots, with their intervals as lines."""
        if not self.numbers:
            return
        row, value, low, high = np.array(self.numbers, dtype=float).T
        color, shift = self.mark.value
        panel.dots(row + shift, value, color=color, label=self.label, low=low, high=high)


@dataclass(frozen=True)
class RowPanel:
    """One measure of all rows: its words, SI unit (or another one, as it is), and numbers of every kind."""

    words: str
    unit: str
    marks: Sequence[RowMarks]


def rows_figure(rows: Sequence[str], panels: Iterable[RowPanel], caption: str) -> Plate:
    """Rows by name beside each other, measures below each other."""
    shown = list(panels)
    charts = Charts([HEIGHT] * len(shown), "row", "", rows=rows)
    for axes, panel in zip(charts.panels, shown, strict=True):
        for marks in panel.marks:
            marks.draw(axes)
        axes.set_ylabel(panel.words, panel.unit)
        if panel.unit == "s":
            axes.set_yscale("asinh", linear_width=THOUSANDTH)
    return charts.plate(caption)
