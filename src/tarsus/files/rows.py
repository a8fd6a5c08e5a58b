"""Tables that users write: rows of cells under named columns (CSV or TSV), every fault of a file in one answer."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.units import is_ambiguous, is_number


@dataclass(frozen=True)
class TableRows:
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


@dataclass(frozen=True)
class Cell:
    """What the cells of a column hold: a number of zero or more, or one of some words.

    required: the column is there and no cell of it is empty; positive: numbers are above zero; ranges: ``1~2`` stands
    for its middle; words: the words that are allowed instead of a number.
    """

    required: bool = False
    positive: bool = False
    ranges: bool = False
    words: tuple[str, ...] = ()

    def read(self, text: str, name: str) -> tuple[float | str | None, str | None]:
        """The value of a cell, None where it is empty, and what is wrong with it."""
        if self.words:
            word = text.lower()
            if word in self.words or not (word or self.required):
                return word or None, None
            return (
                None,
                f"'{name}' must be {' or '.join(self.words)}, got '{text}'{nearest(word, self.words) if word else ''}",
            )
        if not text:
            return None, f"'{name}' is empty" if self.required else None
        try:
            value = number_of(text) if self.ranges else float(text)
        except ValueError:
            return None, f"'{name}' should be a number, got '{text}'"
        if value is None or not math.isfinite(value) or value < 0.0 or (self.positive and value == 0.0):
            least = "a number above zero" if self.positive else "zero or more"
            return None, f"'{name}' must be {least}, got '{text}'"
        return value, None


def number_of(cell: str) -> float | None:
    """The number in a cell: None when it is empty, the middle of ``1~2``.

    Raises
    ------
    ValueError
        When it is neither, or not finite.
    """
    if not cell:
        return None
    parts = [float(part) for part in cell.split("~")]
    if len(parts) > 2 or not all(map(math.isfinite, parts)):
        raise ValueError(cell)
    return sum(parts) / len(parts)


def parse_rows(text: str, where: str, cells: Mapping[str, Cell] | None = None) -> TableRows:
    """Rows of a table; ``where`` names it in sentences.

    Lines that begin with `#` and empty lines are skipped; cells are separated by commas, or by tabs or semicolons where
    the first line has one, and then numbers may have a decimal comma. That line names the columns: any, or those of
    `cells`, whose order holds where it names none. Empty cells at the end of a line may be left out.

    Raises
    ------
    InputError
        With every bad line.
    """
    written = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not written:
        raise InputError(f"{where} holds no rows")
    apart = next((one for one in "\t;" if one in written[0][1]), ",")
    plain = [(number, next(csv.reader([line], delimiter=apart))) for number, line in written]
    lines = [(number, [_cell(one) for one in cells]) for number, cells in plain]
    first, head = lines[0]
    if cells is None or _names_columns(head, cells):
        lines = lines[1:]
        problems = _head_faults(head, cells or {}, f"{where}, line {first}")
        if not problems and not lines:
            problems = [f"{where} names its columns but holds no rows"]
    else:
        head, problems = list(cells), []
    problems += [
        f"{where}, line {number}: {len(found)} cells, but there are {len(head)} columns"
        for number, found in lines
        if len(found) > len(head)
    ]
    problems += [
        f"{where}, line {number}: '{cell.strip()}' has a decimal comma or one of thousands; write it without"
        for number, found in plain
        for cell in found
        if apart == "," and is_ambiguous(cell.strip())
    ]
    if problems:
        raise InputError(problems)
    rows = tuple(dict.fromkeys(head, "") | dict(zip(head, found, strict=False)) for _, found in lines)
    return TableRows(tuple(head), rows, tuple(number for number, _ in lines))


def _cell(text: str) -> str:
    """A cell, with a point for a decimal comma."""
    plain = text.strip()
    pointed = plain.replace(",", ".", 1)
    return pointed if is_number(pointed) else plain


def _names_columns(first: Sequence[str], cells: Mapping[str, Cell]) -> bool:
    """Whether a first line names columns: one that is known, or one that begins neither with a number nor with a word
    that cells hold."""
    words = {word for cell in cells.values() for word in cell.words}
    return any(name in cells for name in first) or not (is_number(first[0]) or first[0].lower() in words)


def _head_faults(names: Sequence[str], cells: Mapping[str, Cell], where: str) -> list[str]:
    """What is wrong with the names of columns; without `cells` any name is one."""
    faults = [f"{where}: unknown column '{one}'{nearest(one, cells)}" for one in names if cells and one not in cells]
    faults += [f"{where}: the column '{one}' appears twice" for one in sorted(set(names)) if names.count(one) > 1]
    faults += [f"{where}: column {i} has no name" for i, one in enumerate(names, start=1) if not one and not cells]
    required = [name for name, cell in cells.items() if cell.required]
    return faults + [f"{where}: the column '{one}' is missing" for one in required if one not in names]


def typed_rows(text: str, where: str, cells: Mapping[str, Cell]) -> list[dict[str, Any]]:
    """Values of every row of a table by column: a number, a word, or None where a cell is empty or its column absent.

    Raises
    ------
    InputError
        With every bad cell, as `parse_rows`.
    """
    table = parse_rows(text, where, cells)
    read, problems = [], []
    for number, row in zip(table.lines, table.rows, strict=True):
        found = {name: cell.read(row.get(name, ""), name) for name, cell in cells.items()}
        problems += [f"{where}, line {number}: {fault}" for _, fault in found.values() if fault]
        read.append({name: value for name, (value, _) in found.items()})
    if problems:
        raise InputError(problems)
    return read
