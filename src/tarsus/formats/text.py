"""Tables in text: CSV, and the ASCII files of vibrometer software (Latin-1, tabs, units in a line of their own)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.formats.numerals import (
    check_ending,
    column_of,
    column_step,
    digit_step,
    number,
    text_of,
    whole_table,
)
from tarsus.formats.parts import is_decibel, joined, phase_factor
from tarsus.formats.raw import Declared, RawFile, RawSeries, Role
from tarsus.formats.unit_names import frequency_factor, ratio_of, scaled, time_factor

_SEPARATORS = ("\t", ";", ",", None)
_LONGEST_HEADER = 2000
"""Lines before the numbers: more than any instrument writes."""
_UNIT_IN_NAME = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))\s*$")
_RATE = re.compile(
    r"^\W*(?:sampl\w*[ _]?(?:rate|freq\w*)|abtast(?:rate|frequenz)|fs)\b[^\d+-]*?([\d.,eE+-]+)\s*(\w*)", re.I
)
_STEP = re.compile(
    r"^\W*(?:sampl\w*[ _]?(?:interval|step|period|time)|dt|resolution)\b[^\d+-]*?([\d.,eE+-]+)\s*(\w*)", re.I
)
_COUNT = re.compile(r"^\W*(?:samples|number of samples|lines)\b\D*(\d+)\s*$", re.I)


def _word(*words: str) -> re.Pattern[str]:
    """A pattern for one of some words, which marks, digits and underscores may end."""
    return re.compile(rf"(?<![^\W\d_])(?:{'|'.join(words)})(?![^\W\d_])", re.I)


_REAL = _word("real(?: part)?", "re", "realteil", "partie r[eé]elle", "parte reale?")
_IMAGINARY = _word(
    "imag(?:inary)?(?: part)?", "im", "imagin[aä]rteil", "partie imaginaire", "parte im+ag\\w+"
)
_MAGNITUDE = _word("magnitude", "amplitude", "mag", "abs", "betrag", "module", "modulo", "db")
_PHASE = _word("phase", "angle", "phasenwinkel", "winkel", "fase")
_COMMENT = re.compile(r"^\s*[#%]+ ?")


@dataclass(frozen=True)
class _Table:
    """Lines of a text file split at the first row; first: its line number; comma: decimal comma."""

    header: list[str]
    names: list[str]
    units: list[str]
    body: list[str]
    separator: str | None
    first: int
    comma: bool

    @cached_property
    def rows(self) -> list[list[str]]:
        """Cells of the rows."""
        return [_cells(line, self.separator) for line in self.body]

    @property
    def ends(self) -> list[list[str]]:
        """Cells of the first and the last rows."""
        return [_cells(line, self.separator) for line in (*self.body[:-3][:3], *self.body[-3:])]


def read_text(path: Path, content: bytes) -> RawFile:
    """Columns of a table in text.

    The separator (tab, semicolon, comma, blanks) and the decimal sign are told from the numbers. The names are those
    of the last header line with as many cells as the rows; units stand in the line below it or behind the names, in
    brackets. Pairs of columns (real and imaginary part, magnitude and phase) become complex series, and so do cells
    such as ``(1-2j)``.

    Raises
    ------
    InputError
        If there are no numbers, the last line is cut, or a cell is no number, with its line.
    """
    text = text_of(content)
    table = _split(path.name, text.splitlines())
    width = len(table.names)
    numbers = whole_table(table.body, table.separator, table.comma)
    if numbers is None or numbers.shape[1] != width:
        numbers = None
        _check_widths(path.name, table, width)
    series, notes = [], check_ending(text, table.ends, path.name)
    for column, (name, unit) in enumerate(zip(table.names, table.units, strict=True)):
        label = name or f"column {column + 1}"
        if numbers is not None:
            values = numbers[:, column]
        elif not name and not any(row[column] for row in table.rows):
            continue
        else:
            values = _values(path.name, table, column, label)
        step = column_step(table.ends, column, table.comma)
        series.append(RawSeries(label, values, unit, count=_announced(table.header), resolution=step))
    paired = _pairs(series)
    notes += [
        f"{path.name}: column '{one.name}' is a phase, but nothing says whether in deg or rad; name it under channels "
        "with phase and phase_unit"
        for one in paired
        if _PHASE.search(one.name) and phase_factor(one.unit, one.name) is None
    ]
    return RawFile(path.name, tuple(paired), _declared(table), tuple(notes), ragged=True)


def _check_widths(source: str, table: _Table, width: int) -> None:
    """Raise InputError if rows lack columns; a last row that does was cut."""
    short = [i for i, row in enumerate(table.rows) if len(row) < width]
    if short and short[-1] == len(table.rows) - 1:
        raise InputError(
            f"{source} is truncated: its last line {table.first + short[-1]} has {len(table.rows[-1])} of {width} "
            "columns"
        )
    if short:
        raise InputError(
            f"{source}, line {table.first + short[0]}: {len(table.rows[short[0]])} of {width} columns are there"
        )


def _split(source: str, lines: list[str]) -> _Table:
    """Header, names, units and rows; the separator is the one that gives rows of numbers of the same width."""
    for separator in _SEPARATORS:
        for comma in (False, True):
            if comma and separator == ",":
                continue
            start = _first_row(lines, separator, comma)
            if start is None:
                continue
            width = len(_cells(lines[start], separator))
            if separator is None and width == 1 and "," in lines[start] and not comma:
                continue
            body = [line for line in lines[start:] if line.strip()]
            names, units = _labels(lines[:start], separator, width)
            return _Table(lines[:start], names, units, body, separator, start + 1, comma)
    raise InputError(f"{source} holds no rows of numbers{_what_instead(lines)}")


def _what_instead(lines: Sequence[str]) -> str:
    """What the last line of a file has where its numbers might be."""
    last = next((line for line in reversed(lines) if line.strip()), "")
    for separator in _SEPARATORS:
        cells = _cells(last, separator)
        other = [
            cell for cell in cells if cell and not _is_number(cell, False) and not _is_number(cell, True)
        ]
        if len(cells) > 1 and 0 < len(other) < len(cells):
            return f": its last line has '{other[0]}' where a number is expected; write times as seconds"
    return ""


def _first_row(lines: Sequence[str], separator: str | None, comma: bool) -> int | None:
    """The first line of two in a row that are all numbers (of the same count), or None."""
    last, place = None, 0
    for i, line in enumerate(lines[:_LONGEST_HEADER]):
        if not line.strip():
            continue
        cells = _cells(line, separator)
        if separator is not None and len(cells) < 2:
            last = None
            continue
        filled = [cell for cell in cells if cell]
        width = (
            len(cells) if filled and cells[0] and all(_is_number(cell, comma) for cell in filled) else None
        )
        if width is not None and width == last:
            return place
        last, place = width, i
    return None


def _cells(line: str, separator: str | None) -> list[str]:
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    return cells[:-1] if separator in ("\t", ";", ",") and len(cells) > 1 and not cells[-1] else cells


def _is_real(text: str, comma: bool) -> bool:
    try:
        number(text, comma)
    except ValueError:
        return False
    return True


def _is_number(text: str, comma: bool) -> bool:
    return _is_real(text, comma) or _complex(text) is not None


def _complex(text: str) -> complex | None:
    try:
        return complex(text.replace("i", "j").replace(" ", ""))
    except ValueError:
        return None


def _values(source: str, table: _Table, column: int, name: str) -> NDArray[np.generic]:
    """Numbers of a column, complex if its first one is."""
    written = table.rows[0][column]
    if not written or _is_real(written, table.comma):
        return column_of(table.rows, column, name, table.first, source, table.comma)
    found = [_complex(row[column]) for row in table.rows]
    if None in found:
        at = found.index(None)
        raise InputError(
            f"{source}, line {table.first + at}: column '{name}' has '{table.rows[at][column]}' where a complex number "
            "is expected"
        )
    return np.array(found, dtype=complex)


def _labels(header: Sequence[str], separator: str | None, width: int) -> tuple[list[str], list[str]]:
    """Names and units of the columns from the last lines of the header; empty where it says none."""
    plain = (_COMMENT.sub("", line) for line in header)
    split = [cells for cells in (_cells(line, separator) for line in plain) if any(cells)]
    units = [""] * width
    if split and len(split[-1]) == width and any(_unit(cell) for cell in split[-1]):
        candidate = split[-1]
        if all(not cell or _unit(cell) for cell in candidate) or all(
            not cell or cell.startswith(("[", "(")) for cell in candidate
        ):
            units = [re.sub(r"^[\[(]\s*(.*?)\s*[\])]$", r"\1", cell) for cell in candidate]
            split.pop()
    names = list(split[-1]) if split and len(split[-1]) == width else [""] * width
    if len(split) > 1 and len(split[-2]) == width > 1:
        parts = (_REAL, _IMAGINARY, _MAGNITUDE, _PHASE)
        bare = [not name or any(pattern.fullmatch(name) for pattern in parts) for name in names]
        if all(bare) and any(names):
            names = [f"{above} {name}".strip() for above, name in zip(split[-2], names, strict=True)]
    if (
        width == 1
        and names[0]
        and not any(units)
        and _UNIT_IN_NAME.match(names[0]) is None
        and len(split) > 1
    ):
        names = [""]
    for i, name in enumerate(names):
        match = _UNIT_IN_NAME.match(name)
        found = (match[2] or match[3] or "").strip() if match else ""
        if match and not units[i] and (_unit(found) or found in ("", "-", "1")):
            names[i], units[i] = match[1], found
    return names, units


def _unit(text: str) -> bool:
    """Whether a text is a unit of anything that is read."""
    plain = text.strip().strip("[]()").strip()
    known = (scaled, ratio_of, time_factor, frequency_factor)
    return (
        any(parse(plain) is not None for parse in known)
        or is_decibel(plain)
        or plain.lower() in ("deg", "°", "rad", "-", "1")
    )


def _declared(table: _Table) -> Declared | None:
    """The sampling step that a line of the header states."""
    for line in table.header:
        for pattern, parse, is_rate in ((_RATE, frequency_factor, True), (_STEP, time_factor, False)):
            match = pattern.match(line)
            if match is None:
                continue
            factor = parse(match[2]) if match[2] else 1.0
            text = match[1].rstrip(".,")
            try:
                value = number(text, table.comma) * (factor or 0.0)
            except ValueError:
                continue
            if not value > 0.0:
                continue
            digits = digit_step(text, table.comma) * (factor or 0.0)
            step = 1.0 / value if is_rate else value
            resolution = 0.5 * digits / value**2 if is_rate else digits
            return Declared(f"the header ('{line.strip()[:60]}')", step, resolution)
    return None


def _announced(header: Sequence[str]) -> int | None:
    """Number of rows that the header announces."""
    found = [match[1] for line in header if (match := _COUNT.match(line.replace(",", " ").replace(";", " ")))]
    return int(found[0]) if found else None


def _pairs(series: Sequence[RawSeries]) -> list[RawSeries]:
    """Series with neighbouring columns of real and imaginary part, or magnitude and phase, joined; coherences told."""
    out: list[RawSeries] = []
    for one in series:
        before = out[-1] if out else None
        whole = None if before is None else _joined(before, one)
        if whole is not None and not any(_same(whole, other) for other in out):
            out[-1] = whole
        elif re.search("coheren|kohärenz", one.name, re.I):
            out.append(RawSeries(one.name, one.values, "", Role.COHERENCE))
        else:
            out.append(one)
    return out


def _same(one: RawSeries, other: RawSeries) -> bool:
    """Whether a response is there already, as real and imaginary part for example."""
    return bool(
        one.name == other.name
        and len(one.values) == len(other.values)
        and np.allclose(one.values, other.values, rtol=1e-2, equal_nan=True)
    )


def _joined(first: RawSeries, second: RawSeries) -> RawSeries | None:
    if (
        np.iscomplexobj(first.values)
        or np.iscomplexobj(second.values)
        or len(first.values) != len(second.values)
    ):
        return None
    if _REAL.search(first.name) and _IMAGINARY.search(second.name):
        whole, pattern = joined(first, second, None), _REAL
    elif _MAGNITUDE.search(first.name) and _PHASE.search(second.name):
        factor = phase_factor(second.unit, second.name)
        if factor is None:
            return None
        whole, pattern = joined(first, second, factor), _MAGNITUDE
    else:
        return None
    return replace(whole, name=pattern.sub("", first.name).strip(" -_,:()/") or first.name)
