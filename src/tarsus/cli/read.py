"""`tarsus read`: what a file of a vibrometer or recorder holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tarsus.cli.options import Json

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tarsus.records.measurement import Channel, FrequencyResponse, Measurement

    Floats = NDArray[np.float64]


def read(
    file: Path,
    /,
    *,
    channel: Annotated[list[str] | None, Parameter(negative=())] = None,
    axis: str | None = None,
    axis_unit: str | None = None,
    step: str | None = None,
    drive: str | None = None,
    json: Json = False,
) -> int:
    """Show what a record holds, as the other verbs would read it: channels, units, points, span, remarks.

    Parameters
    ----------
    file
        a record: UFF 55/58, MATLAB, HDF5, NetCDF, TDMS, LVM, CSV or ASCII.
    channel
        name=unit of a channel whose unit the file does not tell, or its name alone; may be repeated.
    axis
        series of the times or frequencies, where the file does not say.
    axis_unit
        its unit.
    step
        time between samples, e.g. "50 us", where the file has no times.
    drive
        channel that recorded the drive.
    """
    from tarsus.cli import console

    said = {"axis": axis, "axis_unit": axis_unit, "step": step, "drive": drive}
    choices: dict[str, Any] = {key: value for key, value in said.items() if value is not None}
    if channel:
        choices["channels"] = {
            name: {"unit": unit} if unit else {} for name, _, unit in (c.partition("=") for c in channel)
        }
    content = _content(file, choices)
    if json:
        console.print_json(content)
        return 0
    print(f"{file}: {content['holds']}")
    headings = ("channel", "unit", "point", "smallest", "largest")
    rows = [
        (c["name"], c["unit"], c["point"], f"{c['smallest']:.6g}", f"{c['largest']:.6g}")
        for c in content["channels"]
    ]
    console.table(headings, rows, numbers_from=3)
    console.note(content["notes"])
    return 0


UNIT = "give it with --channel NAME=UNIT"
"""What to do here about a channel whose unit the file does not tell."""


def _content(file: Path, choices: dict[str, Any]) -> dict[str, Any]:
    """What a file holds, as a record or else as frequency responses; the first refusal where it is neither."""
    from tarsus.base.errors import InputError
    from tarsus.records.readers import read_measurement, read_response

    try:
        return _of_record(read_measurement(file, **choices))
    except InputError as error:
        try:
            return _of_response(read_response(file, **choices))
        except InputError:
            said = (one.replace("give its unit under channels", UNIT) for one in error.problems)
            raise InputError(list(said)) from None


def _of_record(record: Measurement) -> dict[str, Any]:
    from tarsus.base.units import format_quantity

    lasts = format_quantity(float(f"{record.count * record.step:.6g}"), "s")
    rate = format_quantity(float(f"{record.rate:.6g}"), "Hz")
    return {
        "holds": f"a record of {record.count} samples at {rate}, {lasts}",
        "kind": "record",
        "samples": record.count,
        "rate_hz": record.rate,
        "start_s": record.start,
        "drive": record.drive,
        "channels": [
            _channel(one, values) for one, values in zip(record.channels, record.values, strict=True)
        ],
        "notes": [*record.notes, *record.clipped()],
    }


def _of_response(found: FrequencyResponse) -> dict[str, Any]:
    low, high = float(found.frequency[0]), float(found.frequency[-1])
    return {
        "holds": f"frequency responses at {len(found.frequency)} lines from {low:g} to {high:g} Hz, per "
        + ", ".join(f"{one.name} [{one.quantity.unit}]" for one in found.inputs),
        "kind": "response",
        "lines": len(found.frequency),
        "inputs": [one.name for one in found.inputs],
        "channels": [_channel(one, abs(row)) for one, row in zip(found.outputs, found.values, strict=True)],
        "notes": list(found.notes),
    }


def _channel(one: Channel, values: Floats) -> dict[str, Any]:
    """A channel with the range of its numbers, of a response that of its magnitude."""
    return {
        "name": one.name,
        "quantity": one.quantity.name.lower(),
        "unit": one.quantity.unit,
        "point": one.at,
        "smallest": float(values.min()),
        "largest": float(values.max()),
    }
