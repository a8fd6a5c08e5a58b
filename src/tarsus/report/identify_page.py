"""The report of an identification: what was found, what is open and what to record; then every step as its data say:
numbers, figures, residuals, checks; held-out signals and the account of the data."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tarsus.identify import tables
from tarsus.identify.assessment import assessed
from tarsus.identify.heldout import Comparison
from tarsus.identify.result import Identification
from tarsus.identify.step import Curve, Panel, StepResult, failures
from tarsus.identify.verdict import Assessment
from tarsus.records.excluded import evenly
from tarsus.report import modes_page, panel_grid
from tarsus.report.pages import Fold, Foldable, Markup, PageFigure, Section, bullets, said, sections_page, whole
from tarsus.report.panel_grid import QUARTER, few_ticks, name_axes
from tarsus.report.style import BLUE, INK, decimate
from tarsus.tables.numbers import amount, path_end
from tarsus.tables.table import Column, Table

_FITTED = "Measured (points, bars two standard errors to either side) and fitted (lines)."

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

_STRONG = 0.3
"""Correlations of at least this are listed."""


def identify_html(found: Identification) -> str:
    """The page of a result, as text."""
    name = found.opened.campaign.name
    open_ones, failed = tables.open_table(found), failures(tables.checks_of(found))
    about = [
        f"{tables.summary_line(found).removeprefix(f'{name}: ')}; made in {_took(found)}.",
        *(said(one, failed=True) for one in found.remarks if one not in failed),
        whole(tables.numbers_table(found).bare()),
        open_ones if open_ones.rows else Markup("<p>Every number is determined.</p>"),
    ]
    sections = [
        *(_step(found, step) for step in found.steps.values()),
        _held_out(found.comparisons) if found.comparisons else None,
        Section("Account of the data", *_account(found)),
    ]
    footer = "Intervals are 95 %, from draws over repeats with the uncertainty of earlier steps."
    return sections_page(name, about, sections, footer)


def _took(found: Identification) -> str:
    return amount(found.seconds, "s", 2) if found.seconds < 100.0 else f"{found.seconds / 60.0:.0f} min"


def _step(found: Identification, step: StepResult) -> Foldable:
    """What the page shows of a step: one or two panels next to the words, more below them."""
    below, few = [], len(step.panels) in (1, 2)
    shown = step_panels(step.panels, _FITTED) if step.panels else None
    if step.name == "resonances" and found.resonances is not None:
        fit = found.resonances.fit
        shown, few, below = modes_page.synthesis(fit), True, [modes_page.nyquist(fit)]
    words = (f"{step.about} Used: {'; '.join(map(str, step.used))}. {tables.residual_line(step)}", *step.notes)
    return Foldable(step.name.capitalize(), *([[words, shown]] if few else [*words, shown]), *below)


def _account(found: Identification) -> list[Any]:
    """What was checked and tried, and what became of every file and event, to be opened."""
    judged, checks = assessed(found), tables.checks_table(tables.checks_of(found)).bare()
    notes = sorted({note for one in found.readings if one.record is not None for note in one.record.notes})
    passed, files = (len(checks.rows) - len(checks.flagged), f"{found.files_used} of {len(found.readings)} files used")
    return [
        Fold(f"Checks of the model: {passed} of {len(checks.rows)} passed", checks) if checks.rows else None,
        Fold("Landing rules that were tried", bullets(found.landing.sentences())) if found.landing else None,
        Fold("Correlations of the numbers, of 30 % and more", correlations(judged))
        if judged and len(judged.names) > 1
        else None,
        Fold(
            f"Files and events: {files}",
            Markup('<div class="account">{}</div>').format(tables.account_table(found).bare()),
            bullets(notes) if notes else None,
            "identification.json lists every excluded file and event with its reason.",
        ),
    ]


def _held_out(comparisons: Sequence[Comparison]) -> Foldable:
    """Records that no step has seen, compared with their simulations."""
    columns = ("held-out record", Column("motion missed", "%", 2), Column("over its noise", digits=3))
    table = Table("", columns, [(one.name, one.off, one.over) for one in comparisons])
    about = (
        "Records that no step has used, compared with simulations of the identified device: root mean square of the "
        "measured less the simulated motion of the foot over that of the measured one."
    )
    return Foldable("Held-out signals", about, table, held_out(comparisons))


def step_panels(shown: Sequence[Panel], caption: str) -> PageFigure:
    """Panels: measured as points with two standard errors to either side, fitted as lines."""
    return panel_grid.panels(shown[:MOST_PANELS], 1.7, _draw, caption, width=QUARTER)


def held_out(comparisons: Sequence[Comparison]) -> PageFigure:
    """The last period of held-out records over the simulations of the identified device."""
    return step_panels(
        [_last_period(one) for one in evenly(comparisons, MOST_HELD_OUT)],
        "The last drive period of held-out records, evenly from all: the gap of the foot as measured (points) and as "
        "simulated with the identified device (line).",
    )


def correlations(judged: Assessment) -> Table:
    """How the numbers are correlated: pairs by their correlation over the draws, where it counts."""
    names, by = [path_end(name) for name in judged.names], np.nan_to_num(judged.correlation)
    pairs = [(i, j) for i, j in zip(*np.tril_indices(len(names), -1), strict=True) if abs(by[i, j]) >= _STRONG]
    pairs.sort(key=lambda pair: -abs(by[pair]))
    return Table("", ("correlated", "with", Column("by", "%", 2)), [(names[i], names[j], by[i, j]) for i, j in pairs])


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
