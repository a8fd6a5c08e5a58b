"""The table of measured rows: cells as numbers or words, and what was measured in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.units import is_number
from tarsus.files.rows import TableRows, parse_rows
from tarsus.files.tables import read_text
from tarsus.tables.numbers import spaced
from tarsus.validation.claims import MeasuredColumn
from tarsus.validation.selection import Row

T = TypeVar("T")


@dataclass(frozen=True)
class MeasuredRows:
    """A measured table: its rows, the line of the file that each stands on, its columns, and what its head cites."""

    rows: tuple[Row, ...]
    lines: tuple[int, ...]
    columns: tuple[str, ...]
    cites: str

    def __len__(self) -> int:
        return len(self.rows)

    def words(self, number: int, measured: Mapping[str, MeasuredColumn]) -> str:
        """A row by its cells, those that were measured left out."""
        own = {*measured, *(one.spread for one in measured.values())}
        return ", ".join(
            cell if isinstance(cell, str) else f"{spaced(name)} {cell:g}"
            for name, cell in self.rows[number].items()
            if name not in own
        )


class RowCells(dict[str, float | str]):
    """The cells of a row; one that is empty is named where a study asks for it."""

    def __missing__(self, name: str) -> float | str:
        raise InputError(f"the row has nothing in '{name}'{nearest(name, self)}")


def named(row: Row, column: str, known: Mapping[str, T], absent: str | None = None) -> T:
    """What a word of a row stands for.

    absent: the word where the cell is empty. Raises InputError for a word that is not known.
    """
    word = row[column] if absent is None else row.get(column, absent)
    word = word if isinstance(word, str) else f"{word:g}"
    if word not in known:
        raise InputError(f"'{column}': there is no '{word}'{nearest(word, known)}")
    return known[word]


def read_measured(file: Path, measured: Mapping[str, MeasuredColumn]) -> MeasuredRows:
    """The table of a file. A cell of a measured column may hold several readings, ``35.3/33.5``: their mean counts.

    Raises InputError where the first line is no comment that cites, a measured column is missing, or a cell of one is
    no number.
    """
    text = read_text(file)
    first = text.lstrip().partition("\n")[0].strip()
    problems = [] if first.startswith("#") and len(first) > 1 else [f"{file}: the first line must cite, after a #"]
    table = parse_rows(text, str(file))
    wanted = [name for name, one in measured.items() if not one.formula]
    wanted += [one.spread for one in measured.values() if one.spread is not None]
    for name in wanted:
        problems += table.need(name, str(file))
    rows = [_row(table, number, wanted, str(file), problems) for number in range(len(table))]
    if problems:
        raise InputError(problems)
    return MeasuredRows(tuple(rows), table.lines, table.columns, first.lstrip("# "))


def _row(table: TableRows, number: int, wanted: Sequence[str], where: str, problems: list[str]) -> Row:
    """The cells of a row; sentences on those that should be numbers and are none go to ``problems``."""
    cells = RowCells()
    for name, text in table.rows[number].items():
        if not text:
            continue
        parts = text.split("/") if name in wanted else [text]
        if all(is_number(part) and math.isfinite(float(part)) for part in parts):
            cells[name] = sum(map(float, parts)) / len(parts)
        elif name in wanted:
            problems.append(f"{where}, line {table.lines[number]}: '{name}' should be a number, got '{text}'")
        else:
            cells[name] = text
    return cells
