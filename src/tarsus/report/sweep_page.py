"""The report of a sweep: its measures in numbers, each against every swept value, and the runs that failed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from tarsus.report.pages import Fold, Markup, PageFigure, Section, marked, said, sections_page, terms
from tarsus.report.panel_grid import few_ticks, name_axes, panel, panels, whole_ticks
from tarsus.report.saved import draw_measure
from tarsus.report.style import BLUE, MUTED, level_limits
from tarsus.solve import Run
from tarsus.study.axes import Logspace
from tarsus.study.summary import FEW, SweepValues, read_scored, summary, summary_table, units_of_axes
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import DONE, OUTCOMES
from tarsus.tables.numbers import amount, percent, spaced
from tarsus.tables.table import Column, Table

MOST_RUNS = 100_000
"""Runs that a page is made of: of more, every so manieth, evenly over the sweep."""

MOST_DOTS = 400
"""Runs drawn in a panel, evenly over the sweep: more dots hide each other, and every one is 46 bytes of the page."""

MOST_AXES, MOST_MEASURES = 6, 8
"""Swept values and measures that are drawn: the first ones."""

MOST_FAILURES = 30
"""Failed runs that are listed."""


def sweep_html(sweep: Sweep, collected: str | Path) -> str:
    """The page of a result, as text."""
    found, units = read_scored(sweep, Path(collected), -(-sweep.runs // MOST_RUNS)), units_of_axes(sweep)
    measures = Run.offered(sweep.scene, sweep.seconds)
    definitions = {spaced(name): measures[name].definition for name in sweep.measures}
    failures = _failures(found, units)
    sections = [
        Section(
            "Measures",
            summary_table(summary(sweep, found), units),
            _settled(found),
            Fold("What each measure is", terms(definitions)),
        ),
        *(
            Section(spaced(name).capitalize(), *_figures(sweep, found, name, units, measures[name].unit))
            for name in sweep.measures[:MOST_MEASURES]
        ),
        Section("Runs that failed", failures) if failures else None,
    ]
    about = [
        f"{amount(sweep.runs, '1', 8)} runs of {sweep.scene.name}: {sweep.motion}.",
        *(f"{name}: {_span(found.points[name], units[name])}" for name in sweep.vary),
        _ended(found),
        marked("This page is made of one run in {}; all are in sweep.nc.", found.every) if found.every > 1 else None,
    ]
    footer = "All values of all runs are in sweep.nc, the study in study.toml."
    return sections_page(f"Sweep: {sweep.name}", about, sections, footer)


def _ended(found: SweepValues) -> Markup:
    """Whether all runs reached their end."""
    total, failed = len(found.code), int((found.code != DONE).sum())
    if failed:
        return said(f"{failed} of {total} runs did not reach their end", failed=True)
    return said("All runs reached their end")


def _settled(found: SweepValues) -> str:
    """What measures of settled motions are; nothing of episodes."""
    if found.repeating is None:
        return ""
    return (
        "A measure is the mean over the starts, so one over the motions that last, by their share; between starts it "
        f"has that standard deviation. {percent(found.repeating)} of the starts repeat at the end of their runs."
    )


def _span(values: np.ndarray, unit: str) -> str:
    different = len(np.unique(values))
    return f"{different} values from {amount(values.min(), unit)} to {amount(values.max(), unit)}"


def _figures(sweep: Sweep, found: SweepValues, measure: str, units: Mapping[str, str], unit: str) -> list[PageFigure]:
    """A measure against every swept value, and as a map over two that are a grid."""
    y = found.values[measure]
    known = np.flatnonzero(np.isfinite(y))
    dots = known[np.linspace(0, len(known) - 1, min(len(known), MOST_DOTS)).astype(int)]
    names = list(sweep.vary)[:MOST_AXES]
    levels = {name: np.unique(found.points[name]) for name in names}
    middles = {
        name: [_median_run(y[known][found.points[name][known] == one]) for one in each]
        for name, each in levels.items()
        if 1 < len(each) <= FEW
    }

    def draw(axes: Axes, name: str) -> None:
        several = name in middles and len(levels[name]) < len(y)
        axes.plot(found.points[name][dots], y[dots], "o", ms=3.0, mew=0.0, color=BLUE, label="a run" if several else "")
        if name in middles:
            axes.plot(levels[name], middles[name], color=MUTED, lw=1.0, label="median run" if several else "")
        if isinstance(sweep.vary[name], Logspace):
            axes.set_xscale("log")
        else:
            few_ticks(axes, x=5)
        name_axes(axes, (name, units[name]), (spaced(measure), unit))
        if limits := level_limits(y):
            axes.set_ylim(*limits)
        whole_ticks(axes.yaxis, y)

    caption = f"{spaced(measure).capitalize()} against every swept value."
    caption += " The line joins the median run of each value." if middles else ""
    if not all(np.isfinite(middle).all() for middle in middles.values()):
        caption += " It is broken at values of which no run gave a number."
    figures = [panels(names, 1.6, draw, caption)]
    if measure in found.maps:
        over = f"{spaced(measure).capitalize()} over both swept values."
        figures.insert(0, panel(2.3, lambda axes: draw_measure(axes, found.maps[measure]), over))
    return figures


def _median_run(values: np.ndarray) -> float:
    """The middle one of the runs (n,), the lower of two: where runs fall into two groups, a mean lies where none is."""
    return float(np.quantile(values, 0.5, method="lower")) if len(values) else np.nan


def _failures(found: SweepValues, units: Mapping[str, str]) -> Table | None:
    """How the runs ended: those counted, and the first that did not reach their end; nothing where all did."""
    failed = np.flatnonzero(found.code != DONE)
    if not len(failed):
        return None
    sentences = list(OUTCOMES.values())
    kinds, counts = np.unique(found.code[failed], return_counts=True)
    columns = ["run", *(Column(name, units[name]) for name in found.points), "how it ended"]
    rows = [
        (int(run) * found.every, *(one[run] for one in found.points.values()), sentences[int(found.code[run])])
        for run in failed[:MOST_FAILURES]
    ]
    tally = [(n, sentences[int(kind)]) for kind, n in zip(kinds, counts, strict=True)]
    return Table("", ("runs", "how they ended"), tally, parts=[Table("", columns, rows)])
