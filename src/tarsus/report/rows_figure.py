"""The figure of a table's rows: what was measured beside what is computed, every row a line, every measure a panel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes

from tarsus.report.pages import Plate
from tarsus.report.sheet import few_ticks, intervals, name_axes, panels
from tarsus.report.style import RULE

LETTERS = 18
"""Letters of a line of a row's name: a third of a panel."""

LINE, GAP = 0.13, 0.08
"""Height of a line of a row's name, and what is free about it [inch]."""

SPREAD = 0.7
"""Of a row's height, over which its marks of several kinds stand."""

THOUSANDTH = 1e-3
"""Times are drawn linearly to a thousandth of a second and logarithmically above: tables hold both 0 and 100 ms."""


@dataclass(frozen=True)
class RowMarks:
    """Numbers of one kind: (row, value, low, high) each, None where there is none."""

    label: str
    color: str
    numbers: Sequence[tuple[int, float | None, float | None, float | None]]


@dataclass(frozen=True)
class RowPanel:
    """One measure of all rows: its words, SI unit (or another one, as it is), and numbers of every kind."""

    words: str
    unit: str
    marks: Sequence[RowMarks]

    def draw(self, axes: Axes) -> None:
        """Kinds below each other in every row, as dots with their intervals as lines."""
        shown = [one for one in self.marks if one.numbers]
        for kind, one in enumerate(shown):
            row, value, low, high = np.array(one.numbers, dtype=float).T
            at = row + SPREAD * ((kind + 0.5) / len(shown) - 0.5)
            intervals(axes, at, value, low, high, color=one.color, label=one.label, across=True)
        if self.unit == "s":
            axes.set_xscale("asinh", linear_width=THOUSANDTH)
            most = max(axes.dataLim.x1, 10.0 * THOUSANDTH)
            axes.set_xticks([0.0, *10.0 ** np.arange(np.log10(THOUSANDTH), np.log10(most) + 0.1)], minor=False)
        else:
            few_ticks(axes, x=5)
        name_axes(axes, (self.words, self.unit))


def rows_figure(rows: Sequence[str], measures: Iterable[RowPanel], caption: str) -> Plate:
    """Rows by name below each other, measures beside each other."""
    names = [fill(name, LETTERS) for name in rows]
    lines = 1 + max((name.count("\n") for name in names), default=0)

    def draw(axes: Axes, measure: RowPanel) -> None:
        measure.draw(axes)
        for edge in np.arange(1, len(names)) - 0.5:
            axes.axhline(edge, color=RULE, lw=0.5, zorder=0)
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(axis="y", length=0.0)
        axes.set_ylim(len(names) - 0.5, -0.5)

    return panels(measures, max(len(names) * (LINE * lines + GAP), 0.5), draw, caption)
