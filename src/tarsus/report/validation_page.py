"""The page of a validation, and the index of several: claims with verdicts, measured against computed, parameters."""

from __future__ import annotations

from tarsus.base.spec import float_paths
from tarsus.model.scene import Scene, Source
from tarsus.report.pages import Markup, Section, bullets, marked, sections_page, whole
from tarsus.report.validation_figures import agreement, errors_over_columns
from tarsus.tables.numbers import spaced
from tarsus.tables.table import ROW, Column, Table
from tarsus.validation.result import Suite, Validation, claims_table
from tarsus.validation.verdict import ClaimVerdict


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
            parameters_table(one.device),
        ),
        Section("What else was tried", variants_table(found)) if one.claims.variants else None,
        Section("Notes", *map(_note, one.notes.strip().split("\n\n"))),
    ]
    footer = Markup("With <code>tarsus validate {}</code>. {}").format(one.name, one.measured.cites)
    return sections_page(one.claims.title, [_about(found)], sections, footer, head=f"{one.name} – validation")


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
    told = [
        f"{len(found.compared)} measured numbers of {len(one.measured)} rows; "
        f"{len(one.claims.parameters.fitted)} fitted. {source.cite}."
    ]
    told += [f"Numbers from {source.data}."] if source.data else []
    told += [f"Licence: {source.licence}."] if source.licence else []
    return " ".join(told)


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


def parameters_table(device: Scene) -> Table:
    """Every number of a device by where it comes from: value, provenance, and the sentence on it."""
    rows = []
    for path, info in float_paths(device).items():
        origin = device.origin(path)
        said = (origin.source, origin.note) if origin is not None else (None, "")
        rows.append((said[0], path, info.value, info.unit, said[1]))
    order = {source: place for place, source in enumerate(Source)}
    rows.sort(key=lambda row: order.get(row[0], len(order)))
    cells = [(path, value, source.value if source else "not stated", note) for source, path, value, _, note in rows]
    columns = ("number", Column("value", ROW), "where from", "note")
    return Table("", columns, cells, units=[unit for *_, unit, _ in rows])


def variants_table(found: Validation) -> Table | None:
    """What else was tried, with its score."""
    variants = found.experiment.claims.variants
    return Table("", ("variant", "score"), variants.items()) if variants else None
