"""Figures of a validation: computed against measured numbers with their band, errors over the columns of rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from tarsus.report.pages import Plate
from tarsus.report.sheet import Sheet, few_ticks, name_axes, panel, plate
from tarsus.report.style import CYCLE, MUTED, RULE
from tarsus.tables.numbers import number, percent, spaced
from tarsus.validation.result import Validation
from tarsus.validation.verdict import Compared

DECADE = 10.0
"""Numbers that span more than that are drawn on logarithmic axes: on others the small ones could not be read."""

FEW = 3
"""Different values of a column from which errors over it are worth a panel."""

MOST = 1.0
"""Errors beyond that are drawn at this end, as open marks: one row ten times off would flatten all others."""


def agreement(found: Validation, column: str) -> Plate:
    """Computed against measured numbers of a column, with the band of its claims; a colour a claim."""
    measured = found.experiment.claims.measured[column]
    rows = [one for one in found.of(column) if np.isfinite(one.computed)]
    band = found.band(column)

    def draw(axes: Axes) -> None:
        ends = [value for one in rows for value in (one.measured, one.computed)]
        low, high = min(ends), max(ends)
        if low > 0.0 and high > DECADE * low:
            axes.set_xscale("log")
            axes.set_yscale("log")
        line = np.geomspace(low, high, 50) if low > 0.0 else np.linspace(low, high, 50)
        if band is not None:
            axes.fill_between(line, (1.0 - band) * line, (1.0 + band) * line, color=RULE, lw=0.0)
        axes.plot(line, line, color=MUTED, lw=0.7)
        for label, color, own in _groups(found, rows):
            x, y = (np.array([getattr(one, name) for one in own]) for name in ("measured", "computed"))
            axes.plot(x, y, "o", ms=2.5, color=color, label=label, alpha=0.8)
        name_axes(axes, ("measured", measured.si), ("computed", measured.si))

    shaded = "" if band is None else f" Shaded: {percent(band)} to either side."
    return panel(2.8, draw, f"{measured.words.capitalize()}: computed against measured; the line is equality.{shaded}")


def errors_over_columns(found: Validation, column: str) -> Plate | None:
    """Relative errors of a measured column over every column of numbers that varies; None where none does."""
    rows = [one for one in found.of(column) if np.isfinite(one.error)]
    names = [name for name in found.experiment.measured.columns if _varies(found, rows, name)]
    if not names:
        return None
    band = found.band(column)

    def draw(sheet: Sheet) -> None:
        for name, axes in zip(names, sheet.grid(len(names), 1.9), strict=True):
            _draw_errors(axes, found, [one for one in rows if isinstance(one.row.get(name), float)], name, band)
            sheet.legend(axes) if name == names[0] else None

    words = found.experiment.claims.measured[column].words
    caption = f"{words.capitalize()}: errors over the columns of the rows; open marks lie beyond {percent(MOST)}."
    return plate(draw, caption)


def _draw_errors(axes: Axes, found: Validation, rows: Sequence[Compared], name: str, band: float | None) -> None:
    if band is not None:
        axes.axhspan(-100.0 * band, 100.0 * band, color=RULE, lw=0.0)
    axes.axhline(0.0, color=MUTED, lw=0.7)
    x = np.array([one.row[name] for one in rows], dtype=float)
    if x.min() > 0.0 and x.max() > DECADE * x.min():
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(lambda value, _: number(value))
        axes.xaxis.set_minor_formatter(lambda value, _: "")
    else:
        few_ticks(axes, x=5)
    for label, color, own in _groups(found, rows):
        at = np.array([one.row[name] for one in own], dtype=float)
        error = np.array([one.error for one in own])
        shown = np.abs(error) <= MOST
        axes.plot(at[shown], 100.0 * error[shown], "o", ms=2.5, color=color, label=label, alpha=0.8)
        axes.plot(at[~shown], 100.0 * MOST * np.sign(error[~shown]), "o", ms=3.0, mfc="none", color=color)
    axes.set_xlabel(spaced(name))
    axes.set_ylabel("error (%)")


def _varies(found: Validation, rows: Sequence[Compared], name: str) -> bool:
    """Whether a column is one of conditions whose numbers differ."""
    measured = found.experiment.claims.measured
    if name in measured or any(one.spread == name for one in measured.values()):
        return False
    return len({one.row[name] for one in rows if isinstance(one.row.get(name), float)}) >= FEW


def _groups(found: Validation, rows: Sequence[Compared]) -> list[tuple[str, str, list[Compared]]]:
    """Rows by the first claim that is about them, each group with its name and colour; those of no claim are grey."""
    by_name: dict[str, list[Compared]] = {}
    for one in rows:
        by_name.setdefault(found.claim_of(one), []).append(one)
    colors = {name: CYCLE[i % len(CYCLE)] for i, name in enumerate(name for name in by_name if name)}
    return [(spaced(name) or "no claim", colors.get(name, MUTED), own) for name, own in by_name.items()]
