"""LabVIEW measurement files (.lvm), comma separated with a column of times: text in, Measurement out."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tarsus.errors import InputError
from tarsus.explain import nearest
from tarsus.measurement import Channel, Measurement, sampling_step

__all__ = ["read_lvm"]

_END = "***End_of_Header***"


def read_lvm(path: str | Path, channels: Iterable[Channel], time: str = "time") -> Measurement:
    """Channels of a LabVIEW measurement file.

    Parameters
    ----------
    path
        The file. Its channels share one column of times; where they differ in length the record ends with the shortest.
    channels
        The channels wanted: their names are those of the columns. The header's unit labels are not relied on: the
        caller says what each column measures, in SI.
    time
        Name of the column of times [s].

    Raises
    ------
    InputError
        If the file cannot be read, has no such column, a value that is no number (with its line), or uneven times.
    """
    wanted = tuple(channels)
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    header = _header_line(lines, path)
    columns = [cell.strip() for cell in lines[header].split(",")]
    names = [time, *(channel.name for channel in wanted)]
    missing = [name for name in names if name not in columns]
    if missing:
        known = [name for name in columns if name]
        raise InputError([f"{path.name} has no column '{name}'{nearest(name, known)}" for name in missing])
    table = [_numbers(lines[header + 1 :], columns.index(name), name, header + 2, path) for name in names]
    length = min(len(column) for column in table)
    try:
        step = sampling_step(table[0][:length], _resolution(lines[header + 1 :], columns.index(time)))
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    values = np.array([column[:length] for column in table[1:]])
    return Measurement(wanted, values, step, start=float(table[0][0]), source=path.name)


def _header_line(lines: list[str], path: Path) -> int:
    """Line with the names of the columns: the first with text after the last header."""
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    if not lines or not lines[0].startswith("LabVIEW Measurement") or not ends:
        raise InputError(
            f"{path.name} is no LabVIEW measurement file: no 'LabVIEW Measurement' header is in it"
        )
    separators = [line for line in lines[: ends[0]] if line.startswith("Separator")]
    if separators and "comma" not in separators[0].lower():
        raise InputError(
            f"{path.name}: expected values separated by commas, the header says '{separators[0].strip()}'"
        )
    for i in range(ends[-1] + 1, len(lines)):
        if any(cell.strip() for cell in lines[i].split(",")):
            return i
    raise InputError(f"{path.name} ends after its header: it has no samples")


def _numbers(lines: list[str], column: int, name: str, first: int, path: Path) -> list[float]:
    """Numbers of a column until its first empty cell."""
    out: list[float] = []
    for i, line in enumerate(lines):
        cells = line.split(",")
        text = cells[column].strip() if column < len(cells) else ""
        if not text:
            break
        try:
            out.append(float(text))
        except ValueError:
            raise InputError(
                f"{path.name}, line {first + i}: column '{name}' has '{text}' where a number is expected"
            ) from None
    if len(out) < 2:
        raise InputError(f"{path.name}: column '{name}' has {len(out)} samples")
    return out


def _resolution(lines: list[str], column: int) -> float:
    """Step of the digits the times are written in [s]."""
    cell = lines[0].split(",")[column].strip()
    digits = len(cell.split(".")[1]) if "." in cell and "e" not in cell.lower() else 0
    return 10.0**-digits if digits else 0.0
