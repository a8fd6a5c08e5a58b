"""The verb `tarsus.modes`: from files of responses, records or free decays to modes with intervals."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tarsus.base.arguments import Range, Values
from tarsus.base.errors import Fault, InputError
from tarsus.base.units import quantity_of
from tarsus.modes.gather import decays, merged, responses_of
from tarsus.modes.modal import ModalFit, identify_modes
from tarsus.records.measurement import FrequencyResponse, Measurement
from tarsus.records.readers import choices_of, read_measurement, read_response
from tarsus.tables.numbers import amount

Source = str | os.PathLike[str] | Measurement | FrequencyResponse


def modes(
    *sources: Source,
    band: Range | None = None,
    order: int = 40,
    drive: str | None = None,
    segment: float | str | None = None,
    decay: bool = False,
    read: Values | None = None,
) -> ModalFit:
    """Find modes of a structure from one or several files: frequency responses, records with a drive, or free decays.

    Files of other points, of other drives and of repeats are merged (`tarsus.modes.gather`); their sampling may differ.

    Parameters
    ----------
    sources
        Files, all of frequency responses or all of time records; in Python also what was read from them.
    band
        Lowest and highest frequency, e.g. 100Hz and 1500Hz; by default all lines of responses, or what the drive
        excites within 40 dB.
    order
        Largest order of the models: two or three times the number of modes expected.
    drive
        Channel that recorded the drive, where the files do not say it.
    segment
        Of records with a random drive: length of a segment, e.g. "2 s"; by default a record makes sixteen averages.
    decay
        Whether the records are free decays, without a drive.
    read
        What the files do not say: units of channels by name, such as Ch1 in m/s, and choices of
        `tarsus.read_measurement`: step, frequency_step, axis, axis_unit, input_unit, record.

    Returns
    -------
    ModalFit
        With intervals and a verdict on every mode.

    Raises
    ------
    InputError
        For files that cannot be read or merged, and where no mode is found.
    """
    if not sources:
        raise InputError("name at least one file of frequency responses, of records with a drive, or of free decays")
    ends = None if band is None else _band(band)
    length = None if segment is None else quantity_of("segment", segment, "s")
    if length is not None and not length > 0.0:
        raise InputError(f"segment: expected a time above 0 s, got {amount(length, 's')}")
    reading = choices_of(read or {})
    found = [_read(one, reading, decay) for one in sources]
    names = [one.source for one in found]
    found = [
        one if names.count(one.source) == 1 else replace(one, source=f"({k}) {one.source}".strip())
        for k, one in enumerate(found, start=1)
    ]
    records = [one for one in found if isinstance(one, Measurement)]
    responses = [one for one in found if isinstance(one, FrequencyResponse)]
    if records and responses:
        raise InputError(
            f"{records[0].source} holds time series and {responses[0].source} frequency responses: give one kind"
        )
    if decay and responses:
        raise InputError(f"{responses[0].source} holds frequency responses: a free decay is a time series")
    if decay:
        frf = decays(records, drive)
    else:
        frf = responses_of(records, drive, ends, length) if records else merged(responses)
    low, high = float(frf.frequency[0]), float(frf.frequency[-1])
    return identify_modes(frf, ends or (low, high), order)


def _band(band: Range) -> tuple[float, float]:
    """Both ends [Hz]."""
    low, high = (quantity_of("band", one, "Hz") for one in band)
    if not 0.0 <= low < high:
        ends = f"{amount(low, 'Hz')} and {amount(high, 'Hz')}"
        raise InputError(f"band: expected a lower and a higher frequency, got {ends}")
    return low, high


def _read(source: Source, reading: Mapping[str, Any], decay: bool) -> Measurement | FrequencyResponse:
    """A file as what it holds: responses where there are any, else time series."""
    if isinstance(source, Measurement | FrequencyResponse):
        return source
    ways = ((read_response, ("step",)), (read_measurement, ("frequency_step", "inputs", "input_unit")))
    errors: list[InputError] = []
    for way, of_the_other in ways[decay:]:
        try:
            return way(source, **{k: v for k, v in reading.items() if k not in of_the_other})
        except InputError as error:
            errors.append(error)
    # what it holds is said by the reading that got farther
    holds_none = errors[-1].has(Fault.NO_SERIES) or errors[-1].has(Fault.RESPONSES)
    raise errors[0 if holds_none else -1]
