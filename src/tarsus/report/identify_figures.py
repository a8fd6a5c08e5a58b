"""Figures of an identification: panels of every step, and held-out records over their simulations."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap

from tarsus.identify.heldout import Comparison
from tarsus.identify.step import Curve, Panel
from tarsus.identify.verdict import Assessment
from tarsus.records.excluded import evenly
from tarsus.report import sheet
from tarsus.report.pages import Plate
from tarsus.report.sheet import QUARTER, Sheet, few_ticks, name_axes, plate
from tarsus.report.style import BLUE, INK, ON_DARK, ON_LIGHT, VERMILION, decimate
from tarsus.tables.numbers import number, path_end
from tarsus.tables.table import Column, Table

MOST_PANELS = 4
"""Panels of one figure, a row of a wide page; of more, the first ones."""

MOST_HELD_OUT = 4
"""Held-out records that are drawn: a row."""

PERIODS = 1.0
"""Drive periods of a held-out record that are drawn, after transients."""

_POINTS = 250
"""Points of a curve that are drawn: one to a pixel of its panel."""

_LETTERS = 32
"""Letters of a line of a panel's title."""

_TOLD = 0.3

MOST_PAIRS = 12
"""Pairs of numbers that a narrow screen lists, on which their table of colours would be unreadable."""

OPPOSED = LinearSegmentedColormap.from_list("opposed", (VERMILION, "#f4f5f7", BLUE))
"""From -1 to 1 about nothing."""


def panels(shown: Sequence[Panel], caption: str) -> Plate:
    """Panels: measured as points with two standard errors to either side, fitted as lines."""
    return sheet.panels(shown[:MOST_PANELS], 1.7, _draw, caption, width=QUARTER)


def held_out(comparisons: Sequence[Comparison]) -> Plate:
    """The last period of held-out records over the simulations of the identified device."""
    return panels(
        [_last_period(one) for one in evenly(comparisons, MOST_HELD_OUT)],
        "The last drive period of held-out records, evenly from all: the gap of the foot as measured (points) and as "
        "simulated with the identified device (line).",
    )


def correlations(judged: Assessment) -> Plate:
    """How the numbers hang together: correlation of every pair over the draws, with its hundredths where it counts."""
    count = len(judged.names)
    labels = [path_end(name) for name in judged.names]
    shown = np.where(np.tri(count, k=-1, dtype=bool), judged.correlation, np.nan)

    pairs = sorted(np.argwhere(np.abs(np.nan_to_num(shown)) >= _TOLD).tolist(), key=lambda ij: -abs(shown[*ij]))

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, min(4.2, 0.24 * count), width=7.4)
        image = axes.imshow(shown, cmap=OPPOSED, vmin=-1.0, vmax=1.0)
        for i, j in pairs:
            color = ON_LIGHT if abs(shown[i, j]) <= 0.7 else ON_DARK
            axes.text(j, i, number(100 * shown[i, j], 2), ha="center", va="center", fontsize=6.0, color=color)
        axes.set_xticks(range(count), labels, rotation=90, fontsize=6.5)
        axes.set_yticks(range(count), labels, fontsize=6.5)
        axes.tick_params(length=0.0)
        axes.spines[:].set_visible(False)
        bar = sheet.figures[0].colorbar(image, ax=axes, shrink=0.6)
        bar.outline.set_visible(False)

    wide = plate(draw, "Correlations of the numbers over their draws, in per cent where 30 or more.")
    rows = [(labels[i], labels[j], shown[i, j]) for i, j in pairs[:MOST_PAIRS]]
    narrow = Table("", ("correlated", "with", Column("by", "%", 2)), rows).html()
    both = Markup('<div class="on-wide large">{}</div><div class="on-narrow">{}</div>').format(wide.picture, narrow)
    return Plate(both, wide.caption)


def _last_period(one: Comparison) -> Panel:
    curves = []
    span = float(one.panel.curves[0].x[-1]) / max(one.periods, 1)
    for curve in one.panel.curves:
        part = curve.x >= curve.x[-1] - PERIODS * span
        curves.append(Curve(curve.label, curve.x[part] - curve.x[part][0], curve.y[part], curve.label != "measured"))
    return Panel(one.name, one.panel.x_label, one.panel.x_unit, one.panel.y_label, one.panel.y_unit, tuple(curves))


def _draw(axes: Axes, panel: Panel) -> None:
    """A panel: lines below, points above them."""
    for one in panel.curves:
        x, y, every = one.x, one.y, slice(None, None, -(-len(one.x) // _POINTS) or 1)
        if one.joined and len(x) > _POINTS and np.all(np.diff(x) > 0.0):
            axes.plot(*decimate(x, y, _POINTS // 2), color=BLUE)
        elif one.joined:
            axes.plot(x[every], y[every], color=BLUE)
        elif one.error is None:
            axes.plot(x[every], y[every], ".", ms=2.5, mew=0.0, color=INK, zorder=3.0)
        else:
            bar = 2.0 * one.error[every]
            axes.errorbar(x[every], y[every], bar, fmt=".", ms=3.0, mew=0.0, lw=0.6, color=INK, zorder=3.0)
    axes.set_title(fill(panel.title, _LETTERS))
    name_axes(axes, (panel.x_label, panel.x_unit), (panel.y_label, panel.y_unit))
    few_ticks(axes, x=4, y=4)
