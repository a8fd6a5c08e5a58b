"""Tables in text: CSV, the files of oscilloscopes, and the ASCII files of vibrometer software."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.formats.axes import is_axis
from tarsus.formats.cells import SplitText, complex_of, is_real, split, stamp_of, stamp_step
from tarsus.formats.headers import IMAGINARY, MAGNITUDE, PHASE, REAL, header_of, is_counter
from tarsus.formats.numerals import check_ending, column_of, column_step, text_of, whole_table
from tarsus.formats.parts import joined, phase_factor
from tarsus.formats.pieces import by_count, several
from tarsus.formats.raw import Domain, RawFile, RawSeries, Role

_LONG = re.compile(r"[+-]?\d{16,18}|[+-]?[1-8]\d{18}")
"""Whole numbers that fit into 64 bits, and not all into the 53 of a double."""
_NO_NUMBER = 9.9e37
"""What instruments write for no number and for infinity, by SCPI (9.91e37 and 9.9e37)."""


def read_text(path: Path, content: bytes) -> RawFile:
    """Columns of a table in text.

    The separator (tab, semicolon, comma, blanks) and the decimal sign follow from the numbers; quotation marks hold
    a cell together (RFC 4180). The names are those of the last header line with as many cells as the rows; units stand
    in the line below it, behind the names, or behind a key of the header. Pairs of columns (real and imaginary part,
    magnitude and phase) become complex series, and so do cells such as ``(1-2j)``.

    Raises
    ------
    InputError
        If there are no numbers, the last line is cut, or a cell is no number, with its line.
    """
    text = text_of(content)
    table = split(path.name, text.splitlines())
    header = header_of(table)
    numbers = whole_table(table.body, table.separator, table.comma)
    if numbers is None or numbers.shape[1] != table.width:
        numbers = None
        _check_widths(path.name, table)
    series: list[RawSeries] = []
    notes = [] if table.below else check_ending(text, table.ends, path.name)
    for column, (name, unit) in enumerate(zip(header.names, header.units, strict=True)):
        label = name or f"column {column + 1}"
        if any(one.name == label for one in series):
            label = f"{label} (column {column + 1})"
        if numbers is not None and not _LONG.fullmatch(table.ends[0][column]):
            values = numbers[:, column]
        elif not name and not any(row[column] for row in table.rows if column < len(row)):
            continue
        else:
            values = _values(path.name, table, column, label)
        if values.dtype.kind != "i":
            values = np.where(np.abs(values) >= _NO_NUMBER, np.nan, values)
        if is_counter(name, unit):
            notes.append(f"{path.name}: column '{label}' counts the samples: not used")
            continue
        step = column_step(table.ends, column, table.comma)
        if stamp_of(table.ends[0][column] if column < len(table.ends[0]) else "") is not None:
            unit, step = "s", stamp_step(table.ends[0][column])
        series.append(RawSeries(label, values, unit, count=header.count, resolution=step))
    notes += [f"{path.name}: column '{name}' holds no numbers: not used" for name in header.unused]
    notes += [f"{path.name}: not used: its last lines, from '{table.below[0].strip()[:40]}' on"] if table.below else []
    paired = _pairs(series)
    notes += [
        f"{path.name}: column '{one.name}' is a phase, but nothing says whether in deg or rad; name it under channels "
        "with phase and phase_unit"
        for one in paired
        if PHASE.search(one.name) and phase_factor(one.unit, one.name) is None
    ]
    whole = RawFile(path.name, tuple(paired), header.declared, tuple(notes), ragged=True)
    axes = [one.values for one in paired if any(is_axis(one, domain) for domain in Domain)]
    return several(by_count(whole, axes), 1)


def _check_widths(source: str, table: SplitText) -> None:
    """Raise InputError if rows lack columns; a last row that does was cut."""
    width, mark = table.width, table.separator or " "
    open_ = (line.rstrip("\r\n ").endswith(mark) for line in table.body)  # its last cell is there, and empty
    short = [i for i, (row, more) in enumerate(zip(table.rows, open_, strict=True)) if len(row) + more < width]
    if short and short[-1] == len(table.rows) - 1:
        raise InputError(
            f"{source} is truncated: its last line {table.first + short[-1]} has {len(table.rows[-1])} of {width} "
            "columns"
        )
    if short:
        raise InputError(
            f"{source}, line {table.first + short[0]}: {len(table.rows[short[0]])} of {width} columns are there"
        )


def _values(source: str, table: SplitText, column: int, name: str) -> NDArray[np.generic]:
    """Numbers of a column, complex if its first one is."""
    written = next((row[column] for row in table.rows if column < len(row)), "")
    if stamp_of(written) is not None:
        return _since_first(source, table, column, name)
    if _LONG.fullmatch(written):  # more digits than a double has, such as of nanoseconds since 1970
        with suppress(ValueError, OverflowError):
            return np.array([int(row[column]) for row in table.rows if column < len(row)], dtype=np.int64)
    if not written or is_real(written, table.comma):
        return column_of(table.rows, column, name, table.first, source, table.comma)
    found = [complex_of(row[column]) if column < len(row) else None for row in table.rows]
    if None in found:
        at = found.index(None)
        raise InputError(
            f"{source}, line {table.first + at}: column '{name}' has '{table.rows[at][column]}' where a complex number "
            "is expected"
        )
    return np.array(found, dtype=complex)


def _since_first(source: str, table: SplitText, column: int, name: str) -> NDArray[np.float64]:
    """Seconds from the first time of day of a column on."""
    stamps = [stamp_of(row[column] if column < len(row) else "") for row in table.rows]
    if None in stamps:
        at = stamps.index(None)
        raise InputError(f"{source}, line {table.first + at}: column '{name}' has no time where one is expected")
    return np.array([(one - stamps[0]).total_seconds() for one in stamps if one is not None and stamps[0] is not None])


def _pairs(series: Sequence[RawSeries]) -> list[RawSeries]:
    """Series with neighbouring columns of real and imaginary part, or magnitude and phase, joined, and coherences."""
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
    if np.iscomplexobj(first.values) or np.iscomplexobj(second.values) or len(first.values) != len(second.values):
        return None
    if REAL.search(first.name) and IMAGINARY.search(second.name):
        whole, pattern = joined(first, second, None), REAL
    elif MAGNITUDE.search(first.name) and PHASE.search(second.name):
        factor = phase_factor(second.unit, second.name)
        if factor is None:
            return None
        whole, pattern = joined(first, second, factor), MAGNITUDE
    else:
        return None
    return replace(whole, name=pattern.sub("", first.name).strip(" -_,:()/") or first.name)
