"""LabVIEW measurement files (.lvm): text with a header for each block of columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.formats.numerals import check_ending, column_of, column_step, digit_step, number, text_of
from tarsus.formats.raw import Axis, Declared, Domain, RawFile, RawSeries

_START = b"LabVIEW Measurement"
_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ","}


def is_lvm(head: bytes) -> bool:
    """Whether a file begins like a LabVIEW measurement file."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(_START)


def read_lvm(path: Path, content: bytes) -> RawFile:
    """Columns of a LabVIEW measurement file.

    Columns may differ in length. Unit labels, ``Delta_X`` and numbers of samples are those of the block's header.

    Raises
    ------
    InputError
        If the file has several blocks, no samples, or a cell that is no number, with its line.
    """
    text = text_of(content)
    lines = text.splitlines()
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    if not ends:
        raise InputError(f"{path.name} is truncated: its header does not end")
    general = dict(_entry(line) for line in lines[: ends[0]])
    separator = _SEPARATORS.get(general.get("separator", "tab").lower(), "\t")
    comma = general.get("decimal_separator", ".") == ","
    if len(ends) > 2:
        raise InputError(
            f"{path.name} has {len(ends) - 1} blocks of samples; save each as a file of its own, or export as TDMS"
        )
    header = next((i for i in range(ends[-1] + 1, len(lines)) if lines[i].strip(f"{separator} ")), None)
    if header is None:
        raise InputError(f"{path.name} ends after its header: it has no samples")
    block = {
        cells[0].strip().lower(): [cell.strip() for cell in cells[1:]]
        for cells in (line.split(separator) for line in lines[ends[0] + 1 : ends[-1]])
    }
    names = [cell.strip() for cell in lines[header].split(separator)]
    rows = [line.split(separator) for line in lines[header + 1 :]]
    if len(rows) < 2:
        raise InputError(f"{path.name} ends after its header: it has no samples")
    own_times = general.get("x_columns", "").lower() == "multi"
    if own_times and _paired(block, sum(name not in ("", "X_Value", "Comment") for name in names)):
        block = {key: cells[::2] for key, cells in block.items()}
    notes, series, times = check_ending(text, rows, path.name), [], None
    channel = -1
    for column, name in enumerate(names):
        channel += name not in ("", "X_Value", "Comment")
        if not name or name == "Comment":
            notes += [f"{path.name}: not used: comments"] if name else []
            continue
        values = column_of(rows, column, name, header + 2, path.name, comma)
        frequency = _cell(block, "x_dimension", max(channel, 0)).lower().startswith("freq")
        if name == "X_Value":
            step = column_step(rows, column, comma)
            times = Axis(Domain.FREQUENCY if frequency else Domain.TIME, values, step) if own_times else None
            if not own_times and len(values):
                series.append(RawSeries(name, values, "Hz" if frequency else "s", resolution=step))
        elif len(values) < 2:
            notes.append(f"{path.name}: not used, since it has {len(values)} samples: column '{name}'")
        else:
            series.append(
                RawSeries(
                    name,
                    values,
                    _cell(block, "y_unit_label", channel),
                    axis=times,
                    declared=None if frequency else _declared(block, channel, comma),
                    count=_count(block, channel),
                    resolution=column_step(rows, column, comma),
                )
            )
    return RawFile(path.name, tuple(series), notes=tuple(notes), ragged=True)


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
    return Declared("the header", step, digit_step(cell, comma)) if step > 0.0 and step != 1.0 else None


def _count(block: Mapping[str, Sequence[str]], channel: int) -> int | None:
    """Number of samples that the header announces."""
    cell = _cell(block, "samples", channel)
    return int(cell) if cell.isdecimal() else None
