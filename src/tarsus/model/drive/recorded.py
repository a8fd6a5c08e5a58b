"""The volts of a signal from a file, by the readers of records: units, separators and times are those of the file."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.quantities import Quantity
from tarsus.formats import content_of
from tarsus.formats.axes import axis_series, series_axis
from tarsus.formats.headers import in_brackets
from tarsus.formats.raw import Axis, Domain, RawFile, RawSeries, Role, truncated
from tarsus.formats.unit_names import scaled

TIME, VOLTS = "time", "volts"
"""Names of the columns where none are given; any other name must be in the file."""


class RecordedVolts(NamedTuple):
    """Times [s] from the first sample on and volts [V], both (N,) and read-only; begin [s]: when the first one comes by
    the clock of the file."""

    times: Floats
    levels: Floats
    begin: float


def read_volts(path: Path, time_column: str, volts_column: str) -> RecordedVolts:
    """Times and volts of a file in any format that records are read from, or of an archive of numpy.

    The times are the column of that name, else the one that its unit or name tells, else those that the header gives;
    the volts are the column of that name, else the only one in volts, else the only other one. Numbers without a unit
    are seconds and volts.

    Raises
    ------
    InputError
        For a file that cannot be read, is cut, or does not tell which column is which; and for a unit of another kind.
    """
    raw = content_of(path)
    if raw.several:
        raise InputError(f"{raw.source} holds {len(raw.several)} records{raw.cause}; a signal is of one: save it alone")
    real = [one for one in raw.series if one.role is Role.SIGNAL and not np.iscomplexobj(one.values)]
    column = next((one for one in real if one.name == time_column), None)
    if column is None:
        column = axis_series(raw, Domain.TIME, None if time_column == TIME else time_column)
    plain = not any(one.name == volts_column for one in real) and all(not one.unit for one in real)
    if column is None and plain and len(real) == 2 and real[0].axis is None and raw.declared is None:
        column = real[0]
    volts = _volts(raw, [one for one in real if one is not column], volts_column)
    clock = _times(raw, volts, column, time_column)
    times = clock.values
    if volts.count is not None and len(volts.values) < volts.count:
        raise InputError(truncated(raw.source, volts.name, len(volts.values), volts.count))
    if not raw.ragged and len(times) != len(volts.values):
        raise InputError(
            f"{raw.source}: '{volts.name}' has {len(volts.values)} samples and {len(times)} times"
        )
    count = min(len(times), len(volts.values))
    levels = volts.values[:count].astype(float) * _factor(raw, volts)
    first = float(times[0]) if count else 0.0
    times = times[:count] - first
    for one in (times, levels):
        one.flags.writeable = False
    return RecordedVolts(times, levels, first + clock.origin)


def _volts(raw: RawFile, others: list[RawSeries], name: str) -> RawSeries:
    """The series of volts."""
    named = [one for one in others if one.name == name]
    in_volts = [one for one in others if (known := scaled(one.unit)) and known.quantity is Quantity.VOLTAGE]
    unknown = [one.name for one in others if not one.unit and in_brackets(one.name)]
    if name == VOLTS and not named and not in_volts and unknown:
        raise InputError(
            f"{raw.source}: '{unknown[0]}': '{in_brackets(unknown[0])}' is no unit of voltage; name the column of the "
            "volts with volts_column if it is this one"
        )
    for found in (named, in_volts, others) if name == VOLTS else (named,):
        if len(found) == 1:
            return found[0]
    if not others:
        raise InputError(f"{raw.source} holds no samples beside its times")
    raise InputError(
        f"{raw.source} has no column '{name}'{nearest(name, raw.names)}; name that of the volts with volts_column"
    )


def _times(raw: RawFile, volts: RawSeries, column: RawSeries | None, name: str) -> Axis:
    if column is not None:
        return series_axis(raw, column, Domain.TIME)
    declared = volts.declared or raw.declared
    if isinstance(volts.axis, Axis) and volts.axis.domain is Domain.TIME:
        return volts.axis
    if declared is None:
        raise InputError(
            f"{raw.source} has no column '{name}'{nearest(name, raw.names)}; name that of the times with time_column"
        )
    values = declared.step * np.arange(len(volts.values), dtype=np.float64)
    return Axis(Domain.TIME, values, origin=declared.start)


def _factor(raw: RawFile, volts: RawSeries) -> float:
    """Volts of one of the file."""
    if not volts.unit:
        return volts.factor
    found = scaled(volts.unit)
    if found is None or found.quantity is not Quantity.VOLTAGE:
        raise InputError(f"{raw.source}: column '{volts.name}' is in '{volts.unit}', which is no unit of voltage")
    return found.factor * volts.factor
