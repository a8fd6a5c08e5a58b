"""Records and responses of the files of vibrometers and recorders, in SI."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.base.verb import verb
from tarsus.formats.content import content_of
from tarsus.formats.raw import RawFile
from tarsus.records.measurement import FrequencyResponse, Measurement
from tarsus.records.readers.choices import ChannelChoice, Choices, choices_of
from tarsus.records.readers.record import measurement_of
from tarsus.records.readers.response import response_of

Read = TypeVar("Read")

__all__ = ["ChannelChoice", "Choices", "choices_of", "read_measurement", "read_response"]


@verb
def read_measurement(path: str | os.PathLike[str], **choices: Any) -> Measurement:
    """Time series of a file, in SI. The format is recognised from the content.

    Parameters
    ----------
    path
        The file.
    choices
        Fields of `Choices`: what the file does not say, or says wrongly. ``channels`` (names, or names with units),
        ``axis``, ``axis_unit``, ``step``, ``drive``.

    Returns
    -------
    Measurement
        Channels by name with quantity and unit, their samples [SI], the sampling step [s] and where the drive is.

    Raises
    ------
    InputError
        If the file cannot be read (with the way to export it), or its data cannot be used: gaps, truncation, times
        that are uneven or contradict the header, clipped channels, a missing drive, channels of unknown unit. Each is
        a sentence with the file, the channel and the cause.
    """
    return _with_notes(measurement_of, content_of(Path(path)), validate(Choices, choices))


def read_response(path: str | os.PathLike[str], **choices: Any) -> FrequencyResponse:
    """Frequency responses of a file, in SI; as `read_measurement`.

    Parameters
    ----------
    path
        The file.
    choices
        Fields of `Choices`: ``channels``, ``axis``, ``axis_unit``, ``frequency_step``, ``inputs``, ``input_unit``.

    Raises
    ------
    InputError
        As `read_measurement`.
    """
    return _with_notes(response_of, content_of(Path(path)), validate(Choices, choices))


def _with_notes(reading: Callable[[RawFile, Choices], Read], raw: RawFile, choices: Choices) -> Read:
    """What is read of a file; a refusal says what else the file holds, too."""
    try:
        return reading(raw, choices)
    except InputError as error:
        raise InputError(list(dict.fromkeys([*error.problems, *raw.notes]))) from None
