"""The values of a signal from a file, by the readers of records: units, separators and times are those of the file."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.quantities import Quantity
from tarsus.formats.axes import axis_series, series_axis
from tarsus.formats.content import content_of
from tarsus.formats.headers import in_brackets
from tarsus.formats.raw import Axis, Domain, RawFile, RawSeries, Role, truncated
from tarsus.formats.unit_names import scaled

TIME = "time"
"""Name of the column of times where none is given; any other name must be in the file."""


class RecordedSignal(NamedTuple):
    """Times [s] from the first sample on and values [SI], both (N,) and read-only; begin [s]: when the first one comes
    by the clock of the file."""

    times: Floats
    levels: Floats
    begin: float


def column_of(measured: Quantity) -> str:
    """Name of the column of values where none is given: ``volts``, ``displacement``."""
    return "volts" if measured is Quantity.VOLTAGE else measured.name.lower()


def read_signal(path: Path, time_column: str, value_column: str, measured: Quantity) -> RecordedSignal:
    """Times and values of a quantity of a file in any format that records are read from, or of an archive of numpy.

    The times are the column of that name, else the one that its unit or name shows, else those that the header gives;
    the values are the column of that name, else the only one in a unit of the quantity, else the only other one.
    Numbers without a unit are in SI.

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
    plain = not any(one.name == value_column for one in real) and all(not one.unit for one in real)
    if column is None and plain and len(real) == 2 and real[0].axis is None and raw.declared is None:
        column = real[0]
    found = _values(raw, [one for one in real if one is not column], value_column, measured)
    clock = _times(raw, found, column, time_column)
    times = clock.values
    if found.count is not None and len(found.values) < found.count:
        raise InputError(truncated(raw.source, found.name, len(found.values), found.count))
    if not raw.ragged and len(times) != len(found.values):
        raise InputError(f"{raw.source}: '{found.name}' has {len(found.values)} samples and {len(times)} times")
    count = min(len(times), len(found.values))
    levels = found.values[:count].astype(float) * _factor(raw, found, measured)
    first = float(times[0]) if count else 0.0
    times = times[:count] - first
    for one in (times, levels):
        one.flags.writeable = False
    return RecordedSignal(times, levels, first + clock.origin)


def _values(raw: RawFile, others: list[RawSeries], name: str, measured: Quantity) -> RawSeries:
    """The series of the quantity."""
    usual = column_of(measured)
    named = [one for one in others if one.name == name]
    in_unit = [one for one in others if (known := scaled(one.unit)) and known.quantity is measured]
    unknown = [one.name for one in others if not one.unit and in_brackets(one.name)]
    if name == usual and not named and not in_unit and unknown:
        raise InputError(
            f"{raw.source}: '{unknown[0]}': '{in_brackets(unknown[0])}' is no unit of {measured.name.lower()}; name "
            f"the column of the {usual} with value_column if it is this one"
        )
    for found in (named, in_unit, others) if name == usual else (named,):
        if len(found) == 1:
            return found[0]
    if not others:
        raise InputError(f"{raw.source} holds no samples but its times")
    raise InputError(
        f"{raw.source} has no column '{name}'{nearest(name, raw.names)}; name that of the {usual} with value_column"
    )


def _times(raw: RawFile, found: RawSeries, column: RawSeries | None, name: str) -> Axis:
    if column is not None:
        return series_axis(raw, column, Domain.TIME)
    declared = found.declared or raw.declared
    if isinstance(found.axis, Axis) and found.axis.domain is Domain.TIME:
        return found.axis
    if declared is None:
        raise InputError(
            f"{raw.source} has no column '{name}'{nearest(name, raw.names)}; name that of the times with time_column"
        )
    values = declared.step * np.arange(len(found.values), dtype=np.float64)
    return Axis(Domain.TIME, values, origin=declared.start)


def _factor(raw: RawFile, found: RawSeries, measured: Quantity) -> float:
    """SI units of one of the file."""
    if not found.unit:
        return found.factor
    known = scaled(found.unit)
    if known is None or known.quantity is not measured:
        word = measured.name.lower()
        raise InputError(f"{raw.source}: column '{found.name}' is in '{found.unit}', which is no unit of {word}")
    return known.factor * found.factor
