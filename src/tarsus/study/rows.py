"""Tables of experiments as text files: comma-separated rows with known columns, every fault in a sentence."""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.base.units import is_number
from tarsus.files.tables import text_of

WAVES = ("square", "sine")


@dataclass(frozen=True)
class Columns:
    """Columns of a table in their usual order.

    positive: must be there and above zero; ``wave`` is always a word of `WAVES`; the others are numbers of zero or
    more, or empty; those of ``above`` are above zero, or empty; ``1~2`` in one of ``ranges`` is its middle.
    """

    names: tuple[str, ...]
    positive: tuple[str, ...]
    ranges: tuple[str, ...] = ()
    above: tuple[str, ...] = ()

    @property
    def required(self) -> tuple[str, ...]:
        """Columns that must be there."""
        return tuple(name for name in self.names if name in self.positive or name == "wave")


@dataclass(frozen=True)
class Line:
    """One row: numbers by column (None where empty) and the wave."""

    numbers: Mapping[str, float | None]
    wave: str

    def __getitem__(self, name: str) -> float | None:
        return self.numbers[name]

    def known(self, name: str) -> float:
        """A number that must be there."""
        value = self.numbers[name]
        assert value is not None  # checked when the row was read
        return value


def read_text(path: str | Path) -> str:
    """Text of a rows file.

    Raises
    ------
    InputError
        when the file is missing or unreadable.
    """
    path = Path(path)
    try:
        return text_of(path)
    except OSError as error:
        raise InputError(
            [f"cannot read the rows file '{path}': {(error.strerror or str(error)).lower()}."]
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(
            [f"the rows file '{path}' is not text (UTF-8): byte {error.start} cannot be read."]
        ) from error


def parse_lines(text: str, columns: Columns, where: str) -> list[Line]:
    """Rows of a table; ``where`` names it in error sentences.

    Lines that begin with `#` and empty lines are skipped. The first other line may name the columns (the required ones
    must be among them); without names the usual order is assumed. Empty cells mean "not known".

    Raises
    ------
    InputError
        naming every bad line at once.
    """
    lines = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError([f"{where} holds no rows."])
    names = columns.names
    first_number, first = lines[0]
    if any(cell in columns.names for cell in first) or not (
        is_number(first[0]) or first[0].lower() in WAVES
    ):
        names = _header(first, columns, f"{where}, line {first_number}")
        lines = lines[1:]
        if not lines:
            raise InputError([f"{where} names its columns but holds no rows."])
    problems: list[str] = []
    rows = [_line(cells, names, columns, f"{where}, line {number}", problems) for number, cells in lines]
    if problems:
        raise InputError(problems)
    return [row for row in rows if row is not None]


def _header(cells: list[str], columns: Columns, where: str) -> tuple[str, ...]:
    """Column names, checked."""
    problems = []
    for name in cells:
        if name not in columns.names:
            near = difflib.get_close_matches(name, columns.names, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else f"; known are {', '.join(columns.names)}."
            problems.append(f"{where}: unknown column '{name}'{hint}")
    problems += [
        f"{where}: the column '{name}' appears twice." for name in sorted(set(cells)) if cells.count(name) > 1
    ]
    problems += [
        f"{where}: the column '{name}' is missing." for name in columns.required if name not in cells
    ]
    if problems:
        raise InputError(problems)
    return tuple(cells)


def _line(
    cells: list[str], names: tuple[str, ...], columns: Columns, where: str, problems: list[str]
) -> Line | None:
    """One row; what is wrong with it is added to `problems`, and then None is returned."""
    before = len(problems)
    if len(cells) > len(names):
        problems.append(f"{where}: {len(cells)} cells, but there are {len(names)} columns.")
        return None
    row = dict.fromkeys(columns.names, "") | dict(zip(names, cells, strict=False))
    numbers: dict[str, float | None] = {}
    for name in columns.names:
        if name == "wave":
            continue
        try:
            numbers[name] = _number(row[name], ranges=name in columns.ranges)
        except ValueError:
            problems.append(f"{where}: '{name}' should be a number, got '{row[name]}'.")
            numbers[name] = math.nan
            continue
        value = numbers[name]
        if name in columns.positive or name in columns.above:
            if value is None:
                if name in columns.positive:
                    problems.append(f"{where}: '{name}' is empty.")
            elif not (math.isfinite(value) and value > 0.0):
                problems.append(f"{where}: '{name}' must be a number above zero, got '{row[name]}'.")
        elif value is not None and not (math.isfinite(value) and value >= 0.0):
            problems.append(f"{where}: '{name}' must be zero or more, got '{row[name]}'.")
    wave = row["wave"].lower()
    if wave not in WAVES:
        near = difflib.get_close_matches(wave, WAVES, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else "."
        problems.append(f"{where}: 'wave' must be {' or '.join(WAVES)}, got '{row['wave']}'{hint}")
    return None if len(problems) > before else Line(numbers, wave)


def _number(text: str, *, ranges: bool) -> float | None:
    """The number in a cell, None when it is empty; with `ranges`, `1~2` is its middle."""
    if not text:
        return None
    if ranges and "~" in text:
        low, high = text.split("~")
        return (float(low) + float(high)) / 2.0
    return float(text)
