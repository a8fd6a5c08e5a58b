"""TDMS files of LabVIEW and DAQmx, by npTDMS (the optional extra ``tdms``)."""

from __future__ import annotations

import io
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import some_of
from tarsus.formats.format import Format
from tarsus.formats.numerals import rounding_of_number
from tarsus.formats.raw import Axis, Declared, Domain, RawFile, RawSeries, parsing

_LEAD_IN = 28
"""Bytes before a segment, by the format."""
_BIG_ENDIAN = 1 << 6
"""Bit of a segment's table of contents that says that its most significant bytes come first."""
_OPEN = 2**64 - 1
"""Length of a segment that was not closed, as after a crash of LabVIEW."""


def is_tdms(head: bytes) -> bool:
    """Whether a file begins like TDMS."""
    return head.startswith(b"TDSm")


def read_tdms(path: Path, content: bytes) -> RawFile:
    """Channels of a TDMS file, named ``group/channel``; scaled as the file says; times are those of its waveforms.

    Raises
    ------
    InputError
        If npTDMS is not installed, or the file is damaged or truncated.
    """
    try:
        from nptdms import TdmsFile
        from nptdms.log import log_manager
    except ImportError:
        raise InputError(
            f"{path.name} is a TDMS file, which needs npTDMS: install it with pip install nptdms, or export "
            "the file as LVM or CSV"
        ) from None
    log_manager.set_level(logging.ERROR)  # what it warns of is said by `_check_end`
    with parsing(path.name, "TDMS"):
        file = TdmsFile.read(io.BytesIO(content))  # not by name, which takes an index file next to it for granted
        series, unread = _channels(path.name, file)
        unfinished = file.file_status.channel_statuses or {}
    notes = _check_end(path.name, content, {k: (v.read_length, v.expected_length) for k, v in unfinished.items()})
    notes += unread
    empty = [one.name for one in series if one.values.dtype.kind not in "fiuc" or len(one.values) < 2]
    if empty:
        notes.append(f"{path.name}: not used, since they hold no series of numbers: {some_of(empty)}")
    return RawFile(path.name, tuple(one for one in series if one.name not in empty), notes=tuple(notes))


def _check_end(source: str, content: bytes, unfinished: Mapping[str, tuple[int, int]]) -> list[str]:
    """A note where the last segment was not closed, but holds all samples that it announces.

    unfinished: of every channel of it, by npTDMS, the samples that are there and those announced.

    Raises
    ------
    InputError
        If samples are missing, or the file ends within the header of a segment.
    """
    short = [f"{name} {there} of {many}" for name, (there, many) in unfinished.items() if there < many]
    if short:
        raise InputError(f"{source} is truncated: its last segment holds, of values announced, {', '.join(short)}")
    place = 0
    while place < len(content):
        head = content[place : place + _LEAD_IN]
        if len(head) < _LEAD_IN or not head.startswith(b"TDSm"):
            raise InputError(f"{source} is truncated: its last segment does not end")
        order: Literal["big", "little"] = "big" if int.from_bytes(head[4:8], "little") & _BIG_ENDIAN else "little"
        size, metadata = (int.from_bytes(head[k : k + 8], order) for k in (12, 20))
        if size == _OPEN or place + _LEAD_IN + size > len(content):
            if place + _LEAD_IN + metadata > len(content) or not unfinished:
                raise InputError(f"{source} is truncated: its last segment does not end")
            return [f"{source}: its last segment was not closed; all samples that it announces are there"]
        place += _LEAD_IN + size
    return []


def _channels(source: str, file: Any) -> tuple[list[RawSeries], list[str]]:
    """Series of all channels, and a note on each that npTDMS cannot read, such as DAQmx data without their scaling."""
    series, unread = [], []
    for group in file.groups():
        for channel in group.channels():
            try:
                series.append(_channel(group.name, channel))
            except Exception as error:
                name = f"{group.name}/{channel.name}"
                unread.append(f"{source}: channel '{name}' cannot be read ({error}): not used")
    return series, unread


def _channel(group: str, channel: Any) -> RawSeries:
    properties = channel.properties
    values = np.asarray(channel[:])
    if values.dtype.kind == "M" and len(values) and not np.isnat(values).any():  # times of day, from the first on
        since = (values - values[0]) / np.timedelta64(1, "ns") * 1e-9
        return RawSeries(f"{group}/{channel.name}", since, "s", resolution=1e-6)
    step = _number(properties, "wf_increment")
    name = f"{group}/{channel.name}"
    unit = str(properties.get("unit_string", "") or properties.get("NI_UnitDescription", "")).strip()
    axis, declared = None, None
    if step > 0.0:
        declared = Declared("the waveform of the channel", step, rounding=rounding_of_number(step))
        start = _number(properties, "wf_start_offset")
        axis = Axis(Domain.TIME, start + step * np.arange(len(values), dtype=np.float64))
    return RawSeries(name, values, unit, axis=axis, declared=declared)


def _number(properties: Mapping[str, Any], name: str) -> float:
    """A property as a number; 0 where it is none."""
    try:
        return float(properties.get(name) or 0.0)
    except (TypeError, ValueError):
        return 0.0


FORMATS = (Format("TDMS", is_tdms, read_tdms, (".tdms",)),)
