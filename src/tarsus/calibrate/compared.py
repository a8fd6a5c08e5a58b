"""Measured numbers with those of two models, one a row: the table of a calibration's page and of reproductions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tarsus.tables.table import Column, Table

NOTABLE = 0.30
"""Relative error beyond which a cell is coloured: Table 2.3 counts cases below it as good."""

MODELS = ("dissertation", "this model", "their error", "our error")
"""Columns of `numbers_table`: both models, and the error of each; of a reproduction unless others are named."""


@dataclass(frozen=True)
class NumberRow:
    """One measured number with those of two models [SI], None where there is none.

    case: of which row; role: what ours knew of it; source: of the other model, without an interval; ours: median and
    ends of the 80 % interval, NaN where nothing is predicted, as the ends of a probability (unit "%"); conditions: of
    the row, by column.
    """

    case: str
    role: str
    quantity: str
    unit: str
    measured: float | None
    source: float | None
    ours: tuple[float, float, float]
    conditions: Mapping[str, Any] = field(default_factory=dict)

    @property
    def held(self) -> bool | None:
        """Whether our interval holds the measured number; None where there is nothing to compare."""
        median, low, high = self.ours
        return None if self.measured is None or math.isnan(median) else low <= self.measured <= high

    @property
    def notable(self) -> bool:
        """Whether ours is far off: by more than `NOTABLE` of the measured number, and a count by half of one or more,
        which Table 2.3 takes for another number."""
        if self.measured is None or math.isnan(self.ours[0]):
            return False
        off = abs(self.measured - self.ours[0])
        return off > NOTABLE * abs(self.measured) and (self.unit != "1" or off >= 0.5)


def numbers_table(
    title: str,
    rows: Sequence[NumberRow],
    notes: Iterable[str] = (),
    *,
    models: Sequence[str] = MODELS,
    repeated: bool = False,
) -> Table:
    """Rows of numbers with the errors of both models, which are named as in `MODELS`; the case is named where it
    begins, or repeated in every row."""
    source, ours, *errors = models
    columns = [
        Column("case"),
        Column("role"),
        Column("quantity"),
        Column("measured", "row", 4),
        Column(source, "row", 4),
        Column(ours, "row", 3),
        Column("80 % interval", "row", 3),
        *(Column(one, "%", 3) for one in errors),
        Column("in the interval"),
    ]
    cells: list[tuple[Any, ...]] = []
    for number, row in enumerate(rows):
        first = repeated or number == 0 or rows[number - 1].case != row.case
        median, *ends = row.ours
        cells.append(
            (
                row.case if first else "",
                row.role if first else "",
                row.quantity,
                row.measured,
                row.source,
                median,
                tuple(ends),
                relative_error(row.measured, row.source),
                relative_error(row.measured, median),
                row.held,
            )
        )
    flagged = [(number, len(columns) - 2) for number, row in enumerate(rows) if row.notable]
    said = (
        "Error is (measured − simulated) / measured; 0 measured and something simulated has none. "
        f"Errors beyond {100 * NOTABLE:.0f} % are marked.",
    )
    return Table(title, columns, cells, (*notes, *said), units=[row.unit for row in rows], flagged=flagged)


def relative_error(reference: float | None, simulated: float | None) -> float | None:
    """(reference - simulated)/reference, the definition of Tables 2.3, 3.2 and A.1.

    0 against 0 is no error; anything else against 0, or against an empty cell, has none (None).
    """
    if reference is None or simulated is None or not math.isfinite(simulated):
        return None
    if reference == 0.0:
        return 0.0 if simulated == 0.0 else None
    return (reference - simulated) / reference
