"""The figure of a table's rows: what was measured and what is computed, every row a line, every measure a panel."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes

from tarsus.calibrate.compared import MODELS, NumberRow
from tarsus.report.pages import PageFigure
from tarsus.report.panel_grid import few_ticks, intervals, name_axes, panels
from tarsus.report.style import BLUE, INK, ORANGE, RULE

LETTERS = 18
"""Letters of a line of a row's name: a third of a panel."""

LINE, GAP = 0.13, 0.08
"""Height of a line of a row's name, and what is free about it [inch]."""

SPREAD = 0.7
"""Of a row's height, over which its marks of several kinds stand."""

THOUSANDTH = 1e-3
"""Times are drawn linearly to a thousandth of a second and logarithmically above: tables hold both 0 and 100 ms."""


def rows_figure(rows: Sequence[NumberRow], caption: str, models: Sequence[str] = MODELS) -> PageFigure:
    """Cases below each other, quantities that some row has a number to compare with side by side: measured and
    both models as dots, ours with its 80 % interval."""
    compared = dict.fromkeys(row.quantity for row in rows if (row.measured, row.source) != (None, None))
    shown = [row for row in rows if row.quantity in compared]
    cases = list(dict.fromkeys(row.case for row in shown))
    names = [fill(name, LETTERS) for name in cases]
    lines = 1 + max((name.count("\n") for name in names), default=0)

    def draw(axes: Axes, quantity: str) -> None:
        own = [row for row in shown if row.quantity == quantity]
        at = np.array([cases.index(row.case) for row in own])
        plain = np.array([(row.measured, row.source) for row in own], dtype=float).T
        ours = np.array([row.ours for row in own]).T
        every = (("measured", INK, (plain[0],) * 3), (models[0], ORANGE, (plain[1],) * 3), (models[1], BLUE, ours))
        kinds = [one for one in every if np.isfinite(one[2][0]).any()]
        for kind, (label, color, numbers) in enumerate(kinds):
            place = at + SPREAD * ((kind + 0.5) / len(kinds) - 0.5)
            intervals(axes, place, *numbers, color=color, label=label, across=True)
        if own[0].unit == "s":
            axes.set_xscale("asinh", linear_width=THOUSANDTH)
            most = max(axes.dataLim.x1, 10.0 * THOUSANDTH)
            axes.set_xticks([0.0, *10.0 ** np.arange(np.log10(THOUSANDTH), np.log10(most) + 0.1)], minor=False)
        else:
            few_ticks(axes, x=5)
        name_axes(axes, (quantity, own[0].unit))
        for edge in np.arange(1, len(names)) - 0.5:
            axes.axhline(edge, color=RULE, lw=0.5, zorder=0)
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(axis="y", length=0.0)
        axes.set_ylim(len(names) - 0.5, -0.5)

    return panels(compared, max(len(names) * (LINE * lines + GAP), 0.5), draw, caption)
