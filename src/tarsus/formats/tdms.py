"""TDMS files of LabVIEW and DAQmx, by npTDMS (the optional extra ``tdms``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.raw import Axis, Declared, Domain, RawFile, RawSeries, parsing

_LEAD_IN = 28
"""Bytes before a segment, by the format."""
_NEXT_SEGMENT = slice(12, 20)
"""Where its length stands in them."""


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
    except ImportError:
        raise InputError(
            f"{path.name} is a TDMS file, which needs npTDMS: install it with pip install 'tarsus[tdms]', or export "
            "the file as LVM or CSV"
        ) from None
    if _is_cut(content):
        raise InputError(f"{path.name} is truncated: its last segment does not end")
    with parsing(path.name, "TDMS"):
        file = TdmsFile.read(path)
        series = [_channel(group.name, channel) for group in file.groups() for channel in group.channels()]
    empty = [one.name for one in series if one.values.dtype.kind not in "fiuc" or len(one.values) < 2]
    notes = [f"{path.name}: not used, since they hold no series of numbers: {', '.join(map(repr, empty))}"]
    return RawFile(
        path.name, tuple(one for one in series if one.name not in empty), notes=tuple(notes if empty else ())
    )


def _is_cut(content: bytes) -> bool:
    """Whether a segment announces more bytes than there are."""
    place = 0
    while place + _LEAD_IN <= len(content) and content[place : place + 4] == b"TDSm":
        size = int.from_bytes(content[place:][_NEXT_SEGMENT], "little")
        if size == 2**64 - 1:
            return True
        place += _LEAD_IN + size
    return place != len(content)


def _channel(group: str, channel: Any) -> RawSeries:
    properties = channel.properties
    values = np.asarray(channel[:])
    step = float(properties.get("wf_increment", 0.0) or 0.0)
    name = f"{group}/{channel.name}"
    unit = str(properties.get("unit_string", "") or properties.get("NI_UnitDescription", "")).strip()
    axis, declared = None, None
    if step > 0.0:
        declared = Declared("the waveform of the channel", step)
        start = float(properties.get("wf_start_offset", 0.0) or 0.0)
        axis = Axis(Domain.TIME, start + step * np.arange(len(values), dtype=np.float64))
    return RawSeries(name, values, unit, axis=axis, declared=declared)
