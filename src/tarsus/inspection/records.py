"""What a file of a vibrometer or recorder holds: as the other verbs read it, or else its series as they are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import Fault, InputError
from tarsus.base.units import format_quantity
from tarsus.formats.content import content_of
from tarsus.records.readers import choices_of, read_measurement, read_response
from tarsus.tables.table import ROW, Column, Table
from tarsus.tables.view import View

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tarsus.records.measurement import Channel, FrequencyResponse, Measurement

UNIT = "give it with --read NAME=UNIT"
"""What to do about a channel whose unit the file does not say."""


SERIES = "series"
"""Kind of what is shown of a file that no verb can read as it is."""


def record_view(file: Path, read: Mapping[str, Any]) -> View:
    """The channels of a record, or else of frequency responses; where the file is neither, the series it holds, with
    what is missing as remarks.

    read: as `tarsus.records.readers.choices_of` takes it.

    Raises
    ------
    InputError
        Where nothing of the file can be read, or nothing by the choices that were given.
    """
    given = choices_of(read)
    try:
        data = _of_record(read_measurement(file, **given))
    except InputError as error:
        try:
            data = _of_response(read_response(file, **given))
        except InputError as other:
            refusal = other if error.has(Fault.RESPONSES) else error
            problems = [one.cured(Fault.NO_UNIT, UNIT) for one in refusal.problems]
            if given:
                raise InputError(problems) from None
            return _as_written(file, problems)
    columns = ("channel", "unit", "point", Column("smallest", ROW, 6), Column("largest", ROW, 6))
    rows = [(one["name"], one["unit"], one["point"], one["smallest"], one["largest"]) for one in data["channels"]]
    table = Table(f"{file}: {data['holds']}", columns, rows, units=[row[1] for row in rows])
    return View(data, table, tuple(data["notes"]))


def _as_written(file: Path, problems: Sequence[str]) -> View:
    """The series of a file as they stand there, with what else it holds as remarks."""
    raw = content_of(file)
    notes = list(dict.fromkeys([*problems, *raw.notes]))
    if not raw.series and not raw.notes:
        raise InputError(notes)
    shown = [(one.name, one.unit, len(one.values), _size(one.values)) for one in raw.series]
    rows = [(name, unit, count, low, high) for name, unit, count, (low, high) in shown]
    count = f"{len(rows)} series" + (f" in each of {len(raw.several)} records" if raw.several else "")
    holds = f"{count}, not read as a record yet" if rows else "no series that a record or a response could be"
    columns = ("series", "unit as written", "values", Column("smallest", digits=6), Column("largest", digits=6))
    data = {
        "holds": holds,
        "kind": SERIES,
        "series": [dict(zip(("name", "unit", "values", "smallest", "largest"), row, strict=True)) for row in rows],
        "notes": notes,
    }
    return View(data, Table(f"{file}: {holds}", columns, rows), tuple(notes))


def _size(values: NDArray[Any]) -> tuple[float | None, float | None]:
    """Smallest and largest finite value, of complex ones of the magnitude; None where there is none."""
    plain = np.abs(values) if np.iscomplexobj(values) else np.asarray(values, dtype=float)
    plain = plain[np.isfinite(plain)]
    return (float(plain.min()), float(plain.max())) if len(plain) else (None, None)


def _of_record(record: Measurement) -> dict[str, Any]:
    lasts = format_quantity(float(f"{record.count * record.step:.6g}"), "s")
    rate = format_quantity(float(f"{record.rate:.6g}"), "Hz")
    return {
        "holds": f"a record of {record.count} samples at {rate}, {lasts}",
        "kind": "record",
        "samples": record.count,
        "rate_hz": record.rate,
        "start_s": record.start,
        "drive": record.drive,
        "channels": [_of_channel(*one) for one in zip(record.channels, record.values, strict=True)],
        "notes": [*record.notes, *record.clipped()],
    }


def _of_response(found: FrequencyResponse) -> dict[str, Any]:
    low, high = float(found.frequency[0]), float(found.frequency[-1])
    inputs = ", ".join(f"{one.name} [{one.quantity.unit}]" for one in found.inputs)
    return {
        "holds": f"frequency responses at {len(found.frequency)} lines from {low:g} to {high:g} Hz, per {inputs}",
        "kind": "response",
        "lines": len(found.frequency),
        "inputs": [one.name for one in found.inputs],
        "channels": [_of_channel(one, abs(row)) for one, row in zip(found.outputs, found.values, strict=True)],
        "notes": list(found.notes),
    }


def _of_channel(one: Channel, values: NDArray[np.float64]) -> dict[str, Any]:
    """A channel with the range of its numbers, of a response that of its magnitude."""
    return {
        "name": one.name,
        "quantity": one.quantity.name.lower(),
        "unit": one.quantity.unit,
        "point": one.at,
        "smallest": float(values.min()),
        "largest": float(values.max()),
    }
