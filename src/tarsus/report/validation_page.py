"""The page of a validation, and the index of several: claims with verdicts, measured against computed, parameters."""

from __future__ import annotations

from tarsus.base.spec import float_paths
from tarsus.model.scene import Scene, Source
from tarsus.report.pages import page, rendered
from tarsus.report.validation_figures import agreement, errors_over_columns
from tarsus.tables.table import ROW, Column, Table
from tarsus.validation.result import Suite, Validation, claims_table


def validation_html(found: Validation) -> str:
    """The page of a validation, one self-contained HTML file."""
    outside = found.outside()
    sections = [
        (
            found.experiment.claims.measured[name].words,
            agreement(found, name),
            errors_over_columns(found, name),
        )
        for name, figures in found.figures().items()
        if figures.closes
    ]
    body = rendered(
        "validation.html", found=found, one=found.experiment, claims=claims_table(found),
        columns=found.columns_table(), sections=sections, outside=found.rows_table(outside) if outside else "",
        parameters=parameters_table(found.experiment.device), variants=variants_table(found),
        notes=found.experiment.notes.strip().split("\n\n"),
    )  # fmt: skip
    return page(f"{found.experiment.name} – validation", body)


def suite_html(suite: Suite) -> str:
    """The index of several validations, with a link to the page of each."""
    table = suite.table()
    rows = [(rendered("validation_link.html", name=row[0]), *row[1:]) for row in table.rows]
    body = rendered(
        "validation_index.html", suite=suite, table=Table("", table.columns, rows), said=table.title
    )
    return page("Published experiments", body)


def parameters_table(device: Scene) -> Table:
    """Every number of a device by where it comes from: value, provenance, and the sentence on it."""
    rows = []
    for path, info in float_paths(device).items():
        origin = device.origin(path)
        said = (origin.source, origin.note) if origin is not None else (None, "")
        rows.append((said[0], path, info.value, info.unit, said[1]))
    order = {source: place for place, source in enumerate(Source)}
    rows.sort(key=lambda row: order.get(row[0], len(order)))
    cells = [
        (path, value, source.value if source else "not stated", note) for source, path, value, _, note in rows
    ]
    columns = ("number", Column("value", ROW), "where from", "note")
    return Table("", columns, cells, units=[unit for *_, unit, _ in rows])


def variants_table(found: Validation) -> Table | None:
    """What else was tried, with its score."""
    variants = found.experiment.claims.variants
    return Table("", ("variant", "score"), variants.items()) if variants else None
