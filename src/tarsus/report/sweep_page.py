"""The report of a sweep: its measures in numbers, each against every swept value, and the runs that failed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray

from tarsus.report.pages import Fold, Markup, Plate, Section, marked, said, sections_page, terms
from tarsus.report.panels import DrawnLine, TimePanel, Window, panels_plate
from tarsus.report.style import BLUE, MUTED
from tarsus.solve import Run
from tarsus.study.axes import Logspace
from tarsus.study.summary import FEW, SweepValues, read_scored, summary, summary_table, units_of_axes
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import DONE, OUTCOMES
from tarsus.tables.numbers import amount, percent, spaced
from tarsus.tables.table import Column, Table

MOST_RUNS = 100_000
"""Runs that a page is made of: of more, every so manieth, evenly over the sweep."""

MOST_DOTS = 3000
"""Runs drawn in a figure: more dots are one blot."""

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


def _figures(sweep: Sweep, found: SweepValues, measure: str, units: Mapping[str, str], unit: str) -> list[list[Plate]]:
    """Of one measure, its figures against every swept value, two in a row."""
    plates = [
        _against(found, name, units[name], measure, unit, isinstance(sweep.vary[name], Logspace))
        for name in list(sweep.vary)[:MOST_AXES]
    ]
    if measure in found.maps:
        plates.insert(0, _map(found.maps[measure]))
    return [plates[left : left + 2] for left in range(0, len(plates), 2)]


def _against(found: SweepValues, axis: str, axis_unit: str, measure: str, unit: str, log: bool) -> Plate:
    x, y = found.points[axis], found.values[measure]
    known = np.isfinite(y)
    levels = np.unique(x)
    chosen = np.flatnonzero(known)[:: max(1, -(-int(known.sum()) // MOST_DOTS))]
    chosen = chosen[np.argsort(x[chosen], kind="stable")]
    few = 1 < len(levels) <= FEW
    alone = few and len(levels) == len(x)
    lines = [DrawnLine(x[chosen], y[chosen], BLUE, "" if alone or not few else "a run", dots=True)]
    caption = f"{spaced(measure).capitalize()} against {axis}."
    if few and known.any():
        middle = np.array([_median_run(y[known & (x == one)]) for one in levels])
        parts = _stretches(np.isfinite(middle))
        name = "" if alone else "median run"
        lines += [DrawnLine(levels[part], middle[part], MUTED, name, 1.0) for part in parts]
        caption += "" if alone else " The line joins the median run of each value."
        if not np.isfinite(middle).all():
            caption += " It is broken at values of which no run gave a number."
    window = _with_room(float(levels[0]), float(levels[-1]), log=log)
    return panels_plate(
        [TimePanel(1.9, spaced(measure), unit, lines)], caption, window, across=axis, unit=axis_unit, log=log
    )


def _with_room(low: float, high: float, *, log: bool) -> Window:
    """A window with room for the dots at both of its ends."""
    if log and low > 0.0:
        beyond = (high / low) ** 0.03 if high > low else 1.1
        return low / beyond, high * beyond
    beyond = 0.03 * (high - low) or 0.05 * abs(high) or 1.0
    return low - beyond, high + beyond


def _map(shown: xarray.DataArray) -> Plate:
    from tarsus.report.saved import draw_measure
    from tarsus.report.sheet import panel

    caption = f"{spaced(str(shown.name)).capitalize()} over both swept values."
    return panel(2.3, lambda axes: draw_measure(axes, shown), caption)


def _median_run(values: np.ndarray) -> float:
    """The middle one of the runs (n,), the lower of two: where runs fall into two groups, a mean lies where none is."""
    return float(np.quantile(values, 0.5, method="lower")) if len(values) else np.nan


def _stretches(known: np.ndarray) -> list[slice]:
    """Stretches of at least two neighbours (n,) that are known."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]])))
    return [slice(a, b) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True) if b - a > 1]


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
