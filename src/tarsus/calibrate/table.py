"""The table that a device is fitted to: comma-separated rows under any column names."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest

__all__ = ["Table", "number_of", "parse_table"]


@dataclass(frozen=True)
class Table:
    """Rows of a table: the cells of every row by column, as written, and the line of the file each stands on."""

    columns: tuple[str, ...]
    rows: tuple[Mapping[str, str], ...]
    lines: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.rows)

    def need(self, column: str, where: str) -> list[str]:
        """A sentence where the table lacks a column, else nothing."""
        if column in self.columns:
            return []
        return [f"{where}: the table has no column '{column}'{nearest(column, self.columns)}"]


def number_of(cell: str) -> float | None:
    """The number in a cell: None when it is empty, the middle of ``1~2``.

    Raises
    ------
    ValueError
        when it is neither, or not finite.
    """
    if not cell:
        return None
    parts = [float(part) for part in cell.split("~")]
    if len(parts) > 2 or not all(map(math.isfinite, parts)):
        raise ValueError(cell)
    return sum(parts) / len(parts)


def parse_table(text: str, where: str) -> Table:
    """Rows of a table; ``where`` names it in sentences.

    Lines that begin with `#` and empty lines are skipped; the first other line names the columns. Empty cells at the
    end of a line may be left out.

    Raises
    ------
    InputError
        With every bad line.
    """
    lines = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 2:
        raise InputError(f"{where}: expected a line of column names and at least one row")
    head = tuple(lines[0][1])
    problems = [
        f"{where}: the column '{name}' appears twice" for name in sorted(set(head)) if head.count(name) > 1
    ]
    problems += [f"{where}: column {i} has no name" for i, name in enumerate(head, start=1) if not name]
    problems += [
        f"{where}, line {number}: {len(cells)} cells, but there are {len(head)} columns"
        for number, cells in lines[1:]
        if len(cells) > len(head)
    ]
    if problems:
        raise InputError(problems)
    rows = tuple(dict.fromkeys(head, "") | dict(zip(head, cells, strict=False)) for _, cells in lines[1:])
    return Table(head, rows, tuple(number for number, _ in lines[1:]))
