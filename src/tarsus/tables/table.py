"""A result as rows of plain values with units and notes, and its four forms: text, HTML, CSV, plain data."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tarsus.tables.numbers import MISSING, amount, interval, number, prefixed

ROW = "row"
"""Unit of a column whose rows each have their own: `Table.units`."""


@dataclass(frozen=True)
class Column:
    """A column: its name, the unit of its numbers, the digits shown, and what else is to be known of it.

    unit: SI, "1" for pure numbers and texts, "%" for fractions of 1 that are shown in percent, `ROW` where every row
    has its own unit. digits: significant digits of its numbers where people read them. note: a sentence, shown below
    the table. over: a title above the names of neighbouring columns that have the same one. shared: whether all of its
    numbers stand under one prefix, which is then said in its head.
    """

    name: str
    unit: str = "1"
    digits: int = 4
    note: str = ""
    over: str = ""
    shared: bool = False

    def shown(self, value: Any, unit: str) -> str:
        """A value as it is read; unit: that of its row, which counts where the column has none of its own."""
        unit = unit if self.unit == ROW else self.unit
        if value is None:
            return MISSING
        if isinstance(value, str):
            return value
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, tuple):
            return interval(value[0], value[1], unit, self.digits)
        if isinstance(value, int) and unit in ("1", ""):
            return str(value)
        return amount(value, unit, self.digits)


class Table:
    """Rows of plain values under columns with units.

    title: a line above it, or ""; columns: a text stands for `Column` of that name; rows: one value for every column:
    float or int [unit of its column], text, bool, None (or NaN) where there is no value, a tuple (low, high) for an
    interval. A text of several lines is a word and remarks on it. notes: sentences below it; parts: further tables
    below those; units: unit of every row, where a column has the unit `ROW`; flagged: (row, column) of the cells that
    the reader must not miss.

    Raises ValueError where a row has more or fewer values than there are columns, or rows have no unit.
    """

    def __init__(
        self,
        title: str,
        columns: Sequence[Column | str],
        rows: Iterable[Sequence[Any]],
        notes: Sequence[str] = (),
        parts: Sequence[Table] = (),
        *,
        units: Sequence[str] = (),
        flagged: Iterable[tuple[int, int]] = (),
    ) -> None:
        self.title = title
        self.columns = tuple(Column(one) if isinstance(one, str) else one for one in columns)
        self.rows = tuple(tuple(_plain(value) for value in row) for row in rows)
        self.notes = (*notes, *(f"{one.name}: {one.note}" for one in self.columns if one.note))
        self.parts = tuple(parts)
        self.flagged = frozenset(flagged)
        self.units = tuple(units) or ("1",) * len(self.rows)
        wrong = next((i for i, row in enumerate(self.rows) if len(row) != len(self.columns)), None)
        if wrong is not None:
            count = len(self.rows[wrong])
            raise ValueError(f"row {wrong} of '{title}' has {count} values for {len(self.columns)} columns")
        if len(self.units) != len(self.rows):
            raise ValueError(f"'{title}' has {len(self.units)} units for {len(self.rows)} rows")

    def heads(self) -> list[str]:
        """Names of the columns as they are read."""
        labels = (step[1] if (step := self._step(j)) else "" for j in range(len(self.columns)))
        return [f"{one.name} ({label})" if label else one.name for one, label in zip(self.columns, labels, strict=True)]

    def cells(self) -> list[list[str]]:
        """Every value as it is read."""
        columns = []
        for j, column in enumerate(self.columns):
            step, values = self._step(j), [row[j] for row in self.rows]
            if step is None:
                columns.append([column.shown(value, unit) for value, unit in zip(values, self.units, strict=True)])
            else:
                columns.append([number(None if one is None else one / step[0], column.digits) for one in values])
        return [list(row) for row in zip(*columns, strict=True)]

    def _step(self, j: int) -> tuple[float, str] | None:
        """Of a column under one prefix: what its numbers are divided by, and the unit with the prefix."""
        column = self.columns[j]
        if not column.shared:
            return None
        if column.unit == "%":
            return 0.01, "%"
        return prefixed(max((abs(row[j]) for row in self.rows if row[j] is not None), default=0.0), column.unit)

    def numeric(self) -> list[bool]:
        """Of every column, whether it holds numbers and nothing else."""
        columns = zip(*self.rows, strict=True) if self.rows else ((),) * len(self.columns)
        return [not any(isinstance(value, str | bool) for value in values) for values in columns]

    def text(self, width: int | None = None) -> str:
        """The table for a console of `width` letters; without, as wide as it needs to be."""
        from tarsus.tables.text import table_text

        return table_text(self, width)

    def html(self) -> str:
        """The table as a piece of HTML: everything in it is escaped but texts that are HTML themselves (`__html__`)."""
        from tarsus.tables.html import table_html

        return table_html(self)

    def csv(self) -> str:
        """The rows as comma-separated values below a line of names with units; both ends of an interval; no parts."""
        whole = self._whole()
        ranges = [any(isinstance(row[j], tuple) for row in whole.rows) for j in range(len(whole.columns))]
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        names: list[str] = []
        for column, ends in zip(whole.columns, ranges, strict=True):
            name = f"{column.over} {column.name}".strip()
            unit = "" if column.unit in ("1", "%", ROW) else f" [{column.unit}]"
            names += [f"{name} {end}{unit}" for end in ("from", "to")] if ends else [f"{name}{unit}"]
        writer.writerow(names)
        for row in whole.rows:
            values: list[Any] = []
            for value, ends in zip(row, ranges, strict=True):
                values += (value or (None, None)) if ends else (value,)
            writer.writerow("" if one is None else _written(one) for one in values)
        return out.getvalue()

    def json(self) -> dict[str, Any]:
        """Plain data: title, columns with name and unit, rows, notes, parts; numbers are SI, or None."""
        whole = self._whole()
        return {
            "title": self.title,
            "columns": [
                {"name": f"{one.over} {one.name}".strip(), "unit": "1" if one.unit == "%" else one.unit}
                for one in whole.columns
            ],
            "rows": [[list(v) if isinstance(v, tuple) else _text(v) for v in row] for row in whole.rows],
            "notes": list(self.notes),
            "parts": [part.json() for part in self.parts],
        }

    def bare(self, every: int = 1) -> Table:
        """The rows alone, one in so many, without title, notes and parts: for a page that has words of its own."""
        flagged = [(i // every, j) for i, j in self.flagged if i % every == 0]
        return Table("", self.columns, self.rows[::every], units=self.units[::every], flagged=flagged)

    def _whole(self) -> Table:
        """The table with its rows' units as a column of their own, where a column has none."""
        if all(one.unit != ROW for one in self.columns):
            return self
        rows = [(*row, unit) for row, unit in zip(self.rows, self.units, strict=True)]
        return Table(self.title, (*self.columns, "unit"), rows)

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Table '{self.title}': {len(self.rows)} rows of {', '.join(c.name for c in self.columns)}>"

    def _repr_html_(self) -> str:
        return self.html()

    __html__ = html


LETTERS = 120
"""Width of what `print` shows: words of wider tables are folded, as a console of that width would break their lines."""


class Tabled:
    """What prints as its table, in consoles and in notebooks."""

    def table(self) -> Table:
        """Everything found."""
        raise NotImplementedError

    def __repr__(self) -> str:
        first, *_ = self.table().title.split("\n")
        return f"<{type(self).__name__} {first}>" if first else f"<{type(self).__name__}>"

    def __str__(self) -> str:
        return self.table().text(LETTERS)

    def _repr_html_(self) -> str:
        return self.table().html()


def _plain(value: Any) -> Any:
    """A value without numpy around it; None for NaN and infinities."""
    if isinstance(value, tuple | list):
        return tuple(_plain(one) for one in value)
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text(value: Any) -> Any:
    """A text without the HTML in it; other values as they are."""
    return value.striptags() if hasattr(value, "striptags") else value


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(_text(value))
