"""What a file of a vibrometer or recorder holds, as the other verbs read it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity
from tarsus.records.readers import read_measurement, read_response
from tarsus.tables.table import ROW, Column, Table
from tarsus.tables.view import View

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tarsus.records.measurement import Channel, FrequencyResponse, Measurement

UNIT = "give it with --channel NAME=UNIT"
"""What to do about a channel whose unit the file does not say."""


def record_view(file: Path, channel: Sequence[str] = (), **choices: str | None) -> View:
    """The channels of a record, or else of frequency responses; the first refusal where the file is neither.

    channel: names, or name=unit; choices: axis, axis_unit, step and drive, as the readers take them.
    """
    given: dict[str, Any] = {key: value for key, value in choices.items() if value is not None}
    if channel:
        named = (one.partition("=") for one in channel)
        given["channels"] = {name: {"unit": unit} if unit else {} for name, _, unit in named}
    try:
        data = _of_record(read_measurement(file, **given))
    except InputError as error:
        try:
            data = _of_response(read_response(file, **given))
        except InputError:
            said = (one.replace("give its unit under channels", UNIT) for one in error.problems)
            raise InputError(list(said)) from None
    columns = ("channel", "unit", "point", Column("smallest", ROW, 6), Column("largest", ROW, 6))
    rows = [
        (one["name"], one["unit"], one["point"], one["smallest"], one["largest"]) for one in data["channels"]
    ]
    table = Table(f"{file}: {data['holds']}", columns, rows, units=[row[1] for row in rows])
    return View(data, table, tuple(data["notes"]))


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
        "channels": [
            _of_channel(one, abs(row)) for one, row in zip(found.outputs, found.values, strict=True)
        ],
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
