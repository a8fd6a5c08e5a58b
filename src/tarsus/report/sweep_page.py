"""The report of a sweep: its measures in numbers, each against every swept value, and the runs that failed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes

from tarsus.base.spec import float_paths
from tarsus.report.pages import Fold, Markup, Plate, Section, marked, said, sections_page, terms
from tarsus.report.saved import draw_measure
from tarsus.report.sheet import name_axes, panels
from tarsus.report.style import BLUE, MUTED, level_limits
from tarsus.solve import Run
from tarsus.study.axes import Logspace
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import DONE, OUTCOMES
from tarsus.tables.numbers import amount, path_end, percent, spaced
from tarsus.tables.table import ROW, Column, Table

MOST_RUNS = 100_000
"""Runs that a page is made of: of more, every so manieth, evenly over the sweep."""

MOST_DOTS = 600
"""Runs drawn in a panel, evenly from all: more dots are one blot."""

MOST_AXES, MOST_MEASURES = 6, 8
"""Swept values and measures that are drawn: the first ones."""

FEW = 40
"""An axis of at most so many different values has a line through the median runs at each."""

MOST_FAILURES = 30
"""Failed runs that are listed."""


@dataclass(frozen=True)
class _Scored:
    """Runs (nr,): their values by axis, measures by name [SI], and outcomes; `every` so manieth run of the sweep. Of
    settled motions also the standard deviations between starts by measure, and the shares of starts that repeat."""

    points: Mapping[str, np.ndarray]
    values: Mapping[str, np.ndarray]
    code: np.ndarray
    every: int
    between: Mapping[str, np.ndarray]
    settled: np.ndarray | None

    @property
    def grid(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Values of both axes where the runs are all pairs of few of them."""
        if len(self.points) != 2:
            return None
        first, second = (np.unique(one) for one in self.points.values())
        pairs = len(set(zip(*self.points.values(), strict=True)))
        whole = len(first) * len(second) == len(self.code) == pairs
        sizes = (len(first), len(second))
        return (first, second) if whole and min(sizes) > 1 and max(sizes) <= FEW else None

    @property
    def repeating(self) -> float | None:
        """Share of all starts that repeat; None of episodes."""
        return None if self.settled is None else float(np.nanmean(self.settled))


def sweep_html(sweep: Sweep, collected: str | Path) -> str:
    """The page of a result, as text."""
    found = _read(sweep, Path(collected))
    units = {name: float_paths(sweep.scene)[sweep.paths(name)[0]].unit for name in sweep.vary}
    measures = Run.offered(sweep.scene, sweep.seconds)
    kinds = {name: measures[name].unit for name in sweep.measures}
    definitions = {spaced(name): measures[name].definition for name in sweep.measures}
    failures = _failures(found, units)
    sections = [
        Section(
            "Measures", _table(found, units, kinds), _settled(found), Fold("What each measure is", terms(definitions))
        ),
        *(
            Section(spaced(name).capitalize(), _figure(sweep, found, name, units, kinds[name]))
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
    return sections_page(f"Sweep: {sweep.name}", about, sections, footer, head=f"{sweep.name} – sweep")


def _ended(found: _Scored) -> Markup:
    """Whether all runs reached their end."""
    total, failed = len(found.code), int((found.code != DONE).sum())
    if failed:
        return said(f"{failed} of {total} runs did not reach their end", failed=True)
    return said("All runs reached their end")


def _settled(found: _Scored) -> str:
    """What measures of settled motions are; nothing of episodes."""
    if found.repeating is None:
        return ""
    return (
        "A measure is the mean over the starts, so one over the motions that last, by their share; between starts it "
        f"has that standard deviation. {percent(found.repeating)} of the starts repeat at the end of their runs."
    )


def _read(sweep: Sweep, file: Path) -> _Scored:
    import h5py

    every = -(-sweep.runs // MOST_RUNS)

    def thin(values: np.ndarray) -> np.ndarray:
        return np.asarray(values).reshape(-1)[::every]

    with h5py.File(file, "r") as stored:
        values = {name: thin(stored[name][()]) for name in sweep.measures}  # type: ignore[index]
        code = thin(stored["code"][()])  # type: ignore[index]
        lasting = "settled" in stored
        names = sweep.measures if lasting else ()
        between = {name: thin(stored[f"{name}_over_starts"][()]) for name in names}  # type: ignore[index]
        settled = thin(stored["settled"][()]) if lasting else None  # type: ignore[index]
    points = {name: thin(one) for name, one in sweep.points().items()}
    return _Scored(points, values, code, every, between, settled)


def _span(values: np.ndarray, unit: str) -> str:
    different = len(np.unique(values))
    return f"{different} values from {amount(values.min(), unit)} to {amount(values.max(), unit)}"


def _table(found: _Scored, units: Mapping[str, str], kinds: Mapping[str, str]) -> Table:
    rows: list[tuple[Any, ...]] = []
    for name, values in found.values.items():
        known = np.flatnonzero(np.isfinite(values))
        if not len(known):
            rows.append((spaced(name), 0, *(None,) * (4 if found.between else 3), "", ""))
            continue
        low, high = (int(known[pick(values[known])]) for pick in (np.argmin, np.argmax))
        rows.append(
            (
                spaced(name),
                len(known),
                values[low],
                np.median(values[known]),
                values[high],
                *((float(np.nanmedian(found.between[name])),) if found.between else ()),
                _where(found, low, units),
                _where(found, high, units),
            )
        )
    columns = (
        "measure",
        "runs",
        *(Column(one, ROW) for one in ("least", "median", "largest")),
        *((Column("between starts, median", ROW, 2),) if found.between else ()),
        "least at",
        "largest at",
    )
    return Table("", columns, rows, units=[kinds[name] for name in found.values])


def _where(found: _Scored, run: int, units: Mapping[str, str]) -> str:
    return ", ".join(f"{path_end(name)} {amount(float(one[run]), units[name])}" for name, one in found.points.items())


def _figure(sweep: Sweep, found: _Scored, measure: str, units: Mapping[str, str], unit: str) -> Plate:
    """One measure over both swept values where they are a grid, and against each."""
    both = [] if found.grid is None else [_over_both(found, found.grid, measure, units, unit)]

    def draw(axes: Axes, over: str | xarray.DataArray) -> None:
        if isinstance(over, xarray.DataArray):
            draw_measure(axes, over)
            return
        _against(axes, found, over, measure)
        axes.set_xscale("log" if isinstance(sweep.vary[over], Logspace) else "linear")
        name_axes(axes, (over, units[over]), (spaced(measure), unit))

    caption = f"{spaced(measure).capitalize()}{' over both swept values, and' * bool(both)} against every swept value."
    if any(1 < len(np.unique(one)) <= FEW for one in found.points.values()):
        caption += " The line joins the median run of each value, and is broken where no run gave a number."
    return panels([*both, *list(sweep.vary)[:MOST_AXES]], 1.9, draw, caption)


def _against(axes: Axes, found: _Scored, axis: str, measure: str) -> None:
    """Runs as dots, and where the swept value has few levels the median run of each."""
    x, y = found.points[axis], found.values[measure]
    known = np.flatnonzero(np.isfinite(y))
    shown = known[:: max(1, -(-len(known) // MOST_DOTS))]
    axes.plot(x[shown], y[shown], "o", ms=3.0, mew=0.0, color=BLUE, label="a run")
    levels = np.unique(x)
    if 1 < len(levels) <= FEW:
        middle = [_median_run(y[known][x[known] == one]) for one in levels]
        axes.plot(levels, middle, color=MUTED, lw=1.0, zorder=1.0, label="median run")
    if limits := level_limits(y):
        axes.set_ylim(*limits)


def _over_both(
    found: _Scored, grid: tuple[np.ndarray, np.ndarray], measure: str, units: Mapping[str, str], unit: str
) -> xarray.DataArray:
    """A measure over both swept values, the first one across."""
    names, order = list(found.points), np.lexsort(tuple(found.points.values()))
    coords = {
        name: xarray.DataArray(levels, dims=name, attrs={"units": units[name]})
        for name, levels in zip(names, grid, strict=True)
    }
    values = found.values[measure][order].reshape([len(levels) for levels in grid[::-1]])
    return xarray.DataArray(values, coords, names[::-1], measure, {"units": unit})


def _median_run(values: np.ndarray) -> float:
    """The middle one of the runs (n,), the lower of two: where runs fall into two groups, a mean lies where none is."""
    return float(np.quantile(values, 0.5, method="lower")) if len(values) else np.nan


def _failures(found: _Scored, units: Mapping[str, str]) -> Table | None:
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
