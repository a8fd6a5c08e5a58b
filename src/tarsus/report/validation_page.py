"""The page of a validation, and the index of several: claims with verdicts, measured against computed, parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from tarsus.files.jsontext import json_text
from tarsus.files.whole import write_text
from tarsus.report.pages import Markup, PageFigure, Section, bullets, marked, sections_page, whole
from tarsus.report.panel_grid import few_ticks, name_axes, panel, panels
from tarsus.report.run_page import values_table
from tarsus.report.style import CYCLE, MUTED, RULE
from tarsus.tables.numbers import number, percent, spaced
from tarsus.tables.table import Table
from tarsus.validation.result import Suite, Validation, claims_table
from tarsus.validation.verdict import ClaimVerdict, Compared

DECADE = 10.0
"""Numbers that span more than that are drawn on logarithmic axes: on others the small ones could not be read."""

FEW = 3
"""Different values of a column from which errors over it are worth a panel."""

MOST = 1.0
"""Errors beyond that are drawn at this end, as open marks: one row ten times off would flatten all others."""


def validation_html(found: Validation) -> str:
    """The page of a validation, one self-contained HTML file."""
    one, outside = found.experiment, found.outside()
    sections = [
        Section("Claims", whole(claims_table(found)), bullets(map(_claim, found.verdicts)), marked(CLAIMED)),
        Section("Measured and computed", found.columns_table(), *_drawn(found)),
        Section("Rows outside the bands", found.rows_table(outside) if outside else "None."),
        Section(
            "Parameters",
            *(marked("Fitted to these rows: <code>{}</code>.", words) for words in one.claims.parameters.fitted),
            *(f"Chosen: {words}." for words in one.claims.parameters.chosen),
            values_table(one.device),
        ),
        Section("What else was tried", Table("", ("variant", "score"), one.claims.variants.items()))
        if one.claims.variants
        else None,
        Section("Notes", *map(_note, one.notes.strip().split("\n\n"))),
    ]
    footer = Markup("With <code>tarsus validate {}</code>. {}").format(one.name, one.measured.cites)
    return sections_page(one.claims.title, [_about(found)], sections, footer)


ONE = ("report.html", "validation.json", "validation.csv")
"""What is written of one experiment."""

FILES = ("index.html", *ONE, *(f"*/{file}" for file in ONE))
"""And of all, a folder each."""


def write_validation(found: Validation | Suite, folder: Path) -> list[Path]:
    """Write the plain data and the rows of an experiment into a folder and return the files; of several a folder each,
    and their data."""
    texts = {"validation.json": json_text(found.to_dict()) + "\n"}
    if isinstance(found, Suite):
        for name, one in found.validations.items():
            write_validation(one, folder / name)
    else:
        texts["validation.csv"] = found.csv()
    return _written(texts, folder)


def write_pages(found: Validation | Suite, folder: Path) -> list[Path]:
    """Write the page of an experiment and return it; of several a page each and an index."""
    if not isinstance(found, Suite):
        return _written({"report.html": validation_html(found)}, folder)
    for name, one in found.validations.items():
        write_pages(one, folder / name)
    return _written({"index.html": suite_html(found)}, folder)


def _written(texts: Mapping[str, str], folder: Path) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        write_text(folder / file, text)
    return [folder / file for file in texts]


CLAIMED = """A claim is written before the run that judges it. <i>Seen</i> says which of its rows had been looked at by
then: all makes it a regression test, none a prediction. An error is computed over measured, less one; a row without a
computed number is the worst of all."""


def suite_html(suite: Suite) -> str:
    """The index of several validations, with a link to the page of each."""
    table = suite.table()
    link = Markup('<a href="{0}/report.html">{0}</a>')
    rows = [(link.format(name), *others) for name, *others in table.rows]
    about = [f"{table.title}.", whole(Table("", table.columns, rows))]
    sections = [Section("How to read the pages", bullets(READING))]
    footer = Markup("With <code>tarsus validate --all</code>.")
    return sections_page("Published experiments", about, sections, footer)


READING = (
    "Parameters come from print; numbers that were fitted to the rows are counted.",
    "A claim is written before the run that judges it, and says which rows had been seen by then.",
    "A claim that fails stays, and is marked as one that is known to fail.",
    "An error is computed over measured, less one. A row without a computed number counts as the worst.",
)


def _about(found: Validation) -> str:
    """How much was compared, and where the numbers are from."""
    one = found.experiment
    source = one.claims.source
    texts = [
        f"{len(found.compared)} measured numbers of {len(one.measured)} rows; "
        f"{len(one.claims.parameters.fitted)} fitted. {source.cite}."
    ]
    texts += [f"Numbers from {source.data}."] if source.data else []
    texts += [f"Licence: {source.licence}."] if source.licence else []
    return " ".join(texts)


def _claim(verdict: ClaimVerdict) -> Markup:
    """Which rows a claim is about, and its note."""
    rows = Markup("rows where <code>{}</code>").format(verdict.claim.rows) if verdict.claim.rows else "all rows"
    return Markup("<b>{}</b>: {}. {}").format(spaced(verdict.name), rows, verdict.claim.note)


def _drawn(found: Validation) -> list[Section]:
    """The figures of every measured column."""
    names = [name for name, figures in found.figures().items() if figures.closes]
    words = {name: found.experiment.claims.measured[name].words.capitalize() for name in names}
    return [Section(words[name], agreement(found, name), errors_over_columns(found, name)) for name in names]


def _note(paragraph: str) -> Section | Markup | str:
    """A paragraph of the notes: a heading, a list, or words."""
    if paragraph.startswith("## "):
        return Section(paragraph.removeprefix("## "))
    if paragraph.startswith("- "):
        return bullets(paragraph.removeprefix("- ").split("\n- "))
    return paragraph


def agreement(found: Validation, column: str) -> PageFigure:
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


def errors_over_columns(found: Validation, column: str) -> PageFigure | None:
    """Relative errors of a measured column over every column of numbers that varies; None where none does."""
    rows = [one for one in found.of(column) if np.isfinite(one.error)]
    names = [name for name in found.experiment.measured.columns if _varies(found, rows, name)]
    if not names:
        return None
    band = found.band(column)

    def draw(axes: Axes, name: str) -> None:
        _draw_errors(axes, found, [one for one in rows if isinstance(one.row.get(name), float)], name, band)

    words = found.experiment.claims.measured[column].words
    caption = f"{words.capitalize()}: errors over the columns of the rows; open marks lie beyond {percent(MOST)}."
    return panels(names, 1.9, draw, caption)


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
