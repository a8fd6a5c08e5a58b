"""Lines of text to cells: separators, quotes (RFC 4180), decimal commas, and where the numbers begin."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property

from tarsus.base.errors import InputError
from tarsus.base.units import is_ambiguous
from tarsus.formats.numerals import number

_SEPARATORS = ("\t", ";", ",", "|", None)
_LONGEST_HEADER = 2000
"""Lines before the numbers: more than any instrument writes."""
_LONGEST_CELL = 3
"""Lines that a quoted cell of a header may go on for; more are taken for a stray quotation mark, such as of inches."""
_WORD = re.compile(r"[^\W\d_]{2,}")
_AT_BLANKS = re.compile(r"\s+(?![\[({<])(?![^\[({<]*[\])}>])")
"""Blanks outside of brackets, and before none: a unit belongs to its name."""
_DIGITS = re.compile(r"\d+(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class SplitText:
    """Lines of a text file split at the first row of numbers.

    header, body: lines above it, and from it on; separator: None for blanks; first: number of its line in the file;
    comma: whether numbers have a decimal comma; left: whether the header stands left of the numbers, which names no
    columns; below: lines of words below the numbers.
    """

    header: list[str]
    body: list[str]
    separator: str | None
    first: int
    comma: bool
    left: bool = False
    below: Sequence[str] = ()

    @cached_property
    def width(self) -> int:
        """Columns; those at the end that are empty in the first and the last rows are none."""
        return max((i + 1 for row in self.ends for i, cell in enumerate(row) if cell), default=0)

    @cached_property
    def rows(self) -> list[list[str]]:
        """Cells of the rows."""
        return [cells_of(line, self.separator) for line in self.body]

    @property
    def ends(self) -> list[list[str]]:
        """Cells of the first and the last rows."""
        return [cells_of(line, self.separator) for line in (*self.body[:-3][:3], *self.body[-3:])]


def split(source: str, lines: Sequence[str]) -> SplitText:
    """Header and rows; the separator is the one that gives rows of numbers of the same width.

    Raises
    ------
    InputError
        If there are no rows of numbers, or commas part cells and decimals alike.
    """
    left = _header_left(lines)
    if left is not None:
        return left
    lines, merged = _whole_cells(lines)
    for separator in _SEPARATORS:
        for comma in (False, True):
            if comma and separator == "," and not any('"' in line for line in lines):
                continue  # a decimal comma needs quotes there
            start = _first_row(lines, separator, comma)
            if start is None:
                continue
            body = [line for line in lines[start:] if line.strip()]
            rows = _without_words(body, separator)
            found = SplitText(list(lines[:start]), rows, separator, start + 1 + merged, comma, below=body[len(rows) :])
            return _without_double_commas(source, found)
    raise InputError(f"{source} holds no rows of numbers{_what_instead(lines)}")


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line; quotation marks hold a cell together, and a separator at the end adds none."""
    if separator is None:
        return [cell.strip('"') for cell in _AT_BLANKS.split(line.strip()) if cell]
    if '"' in line:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        except (csv.Error, StopIteration):  # a cell of more than 128 KiB
            cells = line.split(separator)
    else:
        cells = line.split(separator)
    cells = [cell.strip() for cell in cells]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _whole_cells(lines: Sequence[str]) -> tuple[list[str], int]:
    """Lines of a header with those joined that one quoted cell goes over, and how many were joined."""
    out: list[str] = []
    place = 0
    while place < min(len(lines), _LONGEST_HEADER):
        line, taken = lines[place], 1
        if line.count('"') % 2:
            for more in range(2, _LONGEST_CELL + 1):
                whole = " ".join(lines[place : place + more])
                if whole.count('"') % 2 == 0:
                    line, taken = whole, more
                    break
        out.append(line)
        place += taken
    return [*out, *lines[place:]], place - len(out)


def _without_words(body: Sequence[str], separator: str | None) -> list[str]:
    """Lines before those at the end that begin with a word, such as a mean: a number that was cut is none."""
    count = len(body)
    while count > 0 and _WORD.match(cells_of(body[count - 1], separator)[0]):
        if is_real(cells_of(body[count - 1], separator)[0], False):  # nan, inf
            break
        count -= 1
    return list(body[:count])


def _header_left(lines: Sequence[str]) -> SplitText | None:
    """Lines whose header stands in the first three columns, left of the numbers, as some oscilloscopes of Tektronix
    write it; None for all others."""
    filled = [line for line in lines if line.strip()]
    rows = [cells_of(line, ",") for line in filled[:3]]
    if len(rows) < 3 or not all(
        len(row) >= 5 and row[0] and not is_number(row[0], False) and all(is_real(cell, False) for cell in row[3:5])
        for row in rows
    ):
        return None
    parts = [line.split(",", 3) for line in filled]
    header = [",".join(part[:2]) for part in parts if part[0].strip()]
    return SplitText(header, [part[3] for part in parts if len(part) > 3], ",", 1, False, True)


def _without_double_commas(source: str, found: SplitText) -> SplitText:
    """The same; a comma that parts cells where the header has half as many is a decimal one, read in a single column
    and refused in several; quoted ones that may all be of thousands are refused."""
    if found.separator == "," and found.comma:
        with_comma = [cell for row in found.ends for cell in row if "," in cell]
        if with_comma and all(map(is_ambiguous, with_comma)):
            raise InputError(f"{source}: '{with_comma[0]}' has a decimal comma or one of thousands; export it without")
    if found.separator != "," or found.comma or found.width % 2 or any('"' in line for line in found.body[:3]):
        return found
    named = next((cells_of(line, ",") for line in reversed(found.header) if line.strip()), [])
    odd = [cell for row in found.ends for cell in row[1::2]]
    if not named or len(named) * 2 != found.width or not all(_DIGITS.fullmatch(cell) for cell in odd):
        return found
    if found.width == 2:
        return replace(found, separator=None, comma=True)
    raise InputError(
        f"{source}: its header has {len(named)} columns and its rows have {found.width}: commas part cells and "
        "decimals alike; export with semicolons, tabs or decimal points"
    )


def _what_instead(lines: Sequence[str]) -> str:
    """What the last line of a file has where its numbers might be."""
    last = next((line for line in reversed(lines) if line.strip()), "")
    for separator in _SEPARATORS:
        cells = cells_of(last, separator)
        other = [cell for cell in cells if cell and not is_number(cell, False) and not is_number(cell, True)]
        if len(cells) > 1 and 0 < len(other) < len(cells):
            return f": its last line has '{other[0]}' where a number is expected; write times as seconds"
    return ""


def _first_row(lines: Sequence[str], separator: str | None, comma: bool) -> int | None:
    """The first line of two in a row that are all numbers (of the same count), or None."""
    last, place = None, 0
    for i, line in enumerate(lines[:_LONGEST_HEADER]):
        if not line.strip():
            continue
        cells = [line] if separator is not None and separator not in line else cells_of(line, separator)
        if separator is not None and len(cells) < 2:
            last = None
            continue
        filled = [cell for cell in cells if cell]
        numeric = filled and cells[0] and all(is_number(cell, comma) or stamp_of(cell) for cell in filled)
        numeric = numeric and any(is_number(cell, comma) for cell in filled)
        width = len(cells) if numeric else None
        if width is not None and width == last:
            return place
        last, place = width, i
    return None


def stamp_of(text: str) -> datetime | None:
    """A date with a time of day by ISO 8601, or a time of day alone; None if it is none."""
    if text.count(":") < 2 or not text[:1].isdigit():
        return None
    try:
        return datetime.fromisoformat(text if "-" in text else f"1970-01-01 {text}")
    except ValueError:
        return None


def stamp_step(text: str) -> float:
    """Step of the last digit of a time of day [s]; a microsecond at least, to which it is read."""
    decimals = re.search(r":\d\d[.,](\d+)", text)
    return 10.0 ** -min(len(decimals[1]), 6) if decimals else 1.0


def is_number(text: str, comma: bool) -> bool:
    """Whether a cell is a number, real or complex."""
    return is_real(text, comma) or complex_of(text) is not None


def is_real(text: str, comma: bool) -> bool:
    """Whether a cell is a real number, or a word for a gap."""
    try:
        number(text, comma)
    except ValueError:
        return False
    return True


def complex_of(text: str) -> complex | None:
    """A complex number such as ``(1-2j)``; None if it is none."""
    try:
        return complex(text.replace("i", "j").replace(" ", ""))
    except ValueError:
        return None
