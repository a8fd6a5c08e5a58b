"""LabVIEW measurement files (.lvm): text with a header for each block of columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.formats.format import Format
from tarsus.formats.numerals import check_ending, column_of, column_step, digit_step, number, rounding_of_step, text_of
from tarsus.formats.pieces import by_count, several
from tarsus.formats.raw import Axis, Declared, Domain, RawFile, RawSeries

_START = b"LabVIEW Measurement"
_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ","}


def is_lvm(head: bytes) -> bool:
    """Whether a file begins like a LabVIEW measurement file."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(_START)


def read_lvm(path: Path, content: bytes) -> RawFile:
    """Columns of a LabVIEW measurement file; each segment of it, under a header of its own, is a record.

    Columns may differ in length. Unit labels, ``X0``, ``Delta_X`` and numbers of samples are those of the segment's
    header. Where more samples follow than it announces, and no times say that they go on, they are further records.

    Raises
    ------
    InputError
        If the file has no samples, or a cell that is no number, with its line.
    """
    text = text_of(content)
    lines = text.splitlines()
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    if not ends:
        raise InputError(f"{path.name} is truncated: its header does not end")
    general = dict(_entry(line) for line in lines[: ends[0]])
    separator = _SEPARATORS.get(general.get("separator", "tab").lower(), "\t")
    style = _Style(separator, general.get("decimal_separator", ".") == ",", general.get("x_columns", "").lower())
    heads = [_begin(lines, end, separator) for end in ends[1:]] or [ends[0]]
    records: list[RawFile] = []
    last = [line.split(separator) for line in lines[ends[-1] + 2 :][-20:]]
    notes = check_ending(text, last, path.name)
    for k, (head, end, until) in enumerate(zip(heads, ends[1:] or ends, [*heads[1:], len(lines)], strict=True), 1):
        found = _segment(path.name, lines[:until], head, end, style)
        if found is not None:
            records += by_count(found, _times(found))
        else:
            notes.append(f"{path.name}: header {k} of {len(heads)} has no samples below it, or one: not used")
    if not records:
        raise InputError(f"{path.name} ends after its header: it has no samples")
    whole = several(records, len(heads))
    return replace(whole, notes=(*notes, *whole.notes))


def _times(found: RawFile) -> list[Floats]:
    """Columns of times of a segment."""
    own = [one.axis.values for one in found.series if one.axis is not None]
    return own + [one.values for one in found.series if one.name == "X_Value"]


@dataclass(frozen=True)
class _Style:
    """How a file writes its cells; x_columns: no, one or multi."""

    separator: str
    comma: bool
    x_columns: str


def _begin(lines: Sequence[str], end: int, separator: str) -> int:
    """Line where the header of a segment begins that ends at a line: with its channels."""
    for i in range(end - 1, -1, -1):
        if lines[i].split(separator)[0].strip() == "Channels":
            return i
        if lines[i].startswith(_END):
            return i + 1
    return end


def _segment(source: str, lines: Sequence[str], head: int, end: int, style: _Style) -> RawFile | None:
    """The columns of one segment: its header stands from line ``head`` to ``end``, its numbers to the last line. None
    where these are fewer than two."""
    separator, comma = style.separator, style.comma
    header = next((i for i in range(end + 1, len(lines)) if lines[i].strip(f"{separator} ")), None)
    if header is None:
        return None
    block = {
        cells[0].strip().lower(): [cell.strip() for cell in cells[1:]]
        for cells in (line.split(separator) for line in lines[head:end])
    }
    names = [cell.strip() for cell in lines[header].split(separator)]
    rows = [line.split(separator) for line in lines[header + 1 :]]
    while rows and not any(cell.strip() for cell in rows[-1]):
        rows.pop()
    if len(rows) < 2:
        return None
    own_times = style.x_columns == "multi"
    if own_times and _paired(block, sum(name not in ("", "X_Value", "Comment") for name in names)):
        block = {key: cells[::2] for key, cells in block.items()}
    notes, series, times = [], [], None
    channel = -1
    for column, name in enumerate(names):
        channel += name not in ("", "X_Value", "Comment")
        if not name or name == "Comment":
            notes += [f"{source}: not used: comments"] if name else []
            continue
        values = column_of(rows, column, name, header + 2, source, comma)
        frequency = _cell(block, "x_dimension", max(channel, 0)).lower().startswith("freq")
        step = column_step(rows, column, comma)
        if name == "X_Value":
            times = Axis(Domain.FREQUENCY if frequency else Domain.TIME, values, step) if own_times else None
            if not own_times and len(values) > 1:
                series.append(RawSeries(name, values, "Hz" if frequency else "s", resolution=step))
        elif len(values) < 2:
            notes.append(f"{source}: not used, since it has {len(values)} samples: column '{name}'")
        else:
            unit, count = _cell(block, "y_unit_label", channel), _count(block, channel)
            declared = None if frequency else _declared(block, channel, comma)
            series.append(RawSeries(name, values, unit, axis=times, declared=declared, count=count, resolution=step))
    return RawFile(source, tuple(series), notes=tuple(notes), ragged=True)


def _entry(line: str) -> tuple[str, str]:
    """Key and value of a line of the general header, whichever separator it has."""
    key, _, value = re.sub(r"[\t,]", "\t", line, count=1).partition("\t")
    return key.strip().lower(), value.strip()


def _paired(block: Mapping[str, Sequence[str]], channels: int) -> bool:
    """Whether the header of a block has an empty cell behind that of every channel, for its column of times."""
    return channels > 1 and any(
        len(cells) >= 2 * channels - 1 and any(cells) and not any(cells[1 : 2 * channels : 2])
        for cells in (block.get(key, ()) for key in ("samples", "delta_x", "x_dimension", "y_unit_label"))
    )


def _cell(block: Mapping[str, Sequence[str]], key: str, channel: int) -> str:
    """Entry of a channel in the header of a block; empty if there is none."""
    cells = block.get(key, ())
    return cells[channel] if channel < len(cells) else ""


def _declared(block: Mapping[str, Sequence[str]], channel: int, comma: bool) -> Declared | None:
    """The sampling step of a channel that the header states; 1 is what LabVIEW writes when it knows none."""
    cell = _cell(block, "delta_x", channel)
    try:
        step = number(cell, comma)
    except ValueError:
        return None
    try:
        start = number(_cell(block, "x0", channel), comma)
    except ValueError:
        start = 0.0
    if not step > 0.0 or step == 1.0:
        return None
    digits = digit_step(cell, comma)
    return Declared("the header", step, digits, start, rounding_of_step(step, digits))


def _count(block: Mapping[str, Sequence[str]], channel: int) -> int | None:
    """Number of samples that the header announces."""
    cell = _cell(block, "samples", channel)
    return int(cell) if cell.isdecimal() else None


FORMATS = (Format("LVM", is_lvm, read_lvm, (".lvm",)),)
