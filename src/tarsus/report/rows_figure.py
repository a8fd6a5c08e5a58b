"""The figure of a table's rows: what was measured beside what is computed, every row a line, every measure a panel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tarsus.report.pages import Plate
from tarsus.report.sheet import Sheet, name_axes, plate
from tarsus.report.style import BLUE, INK, ORANGE, RULE, SKY

ROW = 0.2
"""Height of a row [inch], five of them at least."""

THOUSANDTH, LONGEST = 1e-3, 0.14
"""Times are drawn linearly to a thousandth of a second and logarithmically above, to the longest one or 0.14 s: tables
hold both 0 and 100 ms."""

MEASURED = {"marker": "o", "color": INK, "ms": 6.0, "mfc": "white", "mew": 1.2, "zorder": 3.5}
MODEL = {"marker": "D", "color": BLUE, "ms": 4.0, "mew": 0.0, "zorder": 4.0}
OTHER_MODEL = {"marker": "s", "color": ORANGE, "ms": 4.0, "mew": 0.0, "zorder": 3.0}
THIRD_MODEL = {"marker": "^", "color": SKY, "ms": 4.4, "mew": 0.0, "zorder": 3.0}
"""How numbers are drawn, by what they are."""


@dataclass(frozen=True)
class RowMarks:
    """Numbers of one kind: (row, value, low, high) each, None where there is none; shift: down from their line."""

    label: str
    look: dict[str, object]
    numbers: Sequence[tuple[int, float | None, float | None, float | None]]
    shift: float = 0.0

    def draw(self, axes: Axes) -> None:
        """As dots, with their intervals as lines."""
        if not self.numbers:
            return
        row, value, low, high = np.array(self.numbers, dtype=float).T
        axes.hlines(row + self.shift, low, high, color=str(self.look["color"]), lw=1.1, zorder=2.5)
        axes.plot(value, row + self.shift, ls="none", label=self.label, **self.look)  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class RowPanel:
    """One measure of all rows: its words, SI unit (or another one, as it is), and numbers of every kind."""

    words: str
    unit: str
    marks: Sequence[RowMarks]


def rows_figure(rows: Sequence[str], panels: Iterable[RowPanel], caption: str) -> Plate:
    """Rows by name, measures beside each other."""
    shown = list(panels)

    def draw(sheet: Sheet) -> None:
        drawn = sheet.grid(len(shown), ROW * max(len(rows), 5))
        for axes, panel in zip(drawn, shown, strict=True):
            axes.hlines(
                range(len(rows)), 0.0, 1.0, transform=axes.get_yaxis_transform(), color=RULE, lw=0.6, zorder=0
            )
            for marks in panel.marks:
                marks.draw(axes)
            axes.set_yticks(range(len(rows)), rows)
            axes.set_ylim(len(rows) - 0.5, -0.5)
            axes.spines["left"].set_visible(False)
            axes.tick_params(axis="y", length=0)
            _scale(axes, panel.unit)
            name_axes(axes, (panel.words, panel.unit))
        sheet.legend(drawn[0])

    return plate(draw, caption)


def _scale(axes: Axes, unit: str) -> None:
    """The horizontal axis, from 0 on."""
    right = float(np.nanmax(axes.dataLim.intervalx, initial=0.0))
    if unit == "s":
        axes.set_xscale("symlog", linthresh=THOUSANDTH, linscale=0.5)
        axes.set_xticks([0.0, *(factor * 1e-3 for factor in (1.0, 3.0, 10.0, 30.0, 100.0))])
        axes.set_xticks([], minor=True)
        axes.set_xlim(-0.2 * THOUSANDTH, max(LONGEST, 1.05 * right))
        return
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=unit == "1"))
    axes.set_xlim(left=-0.02 * right)
