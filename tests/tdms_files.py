"""TDMS files with every flag of the format, written by npTDMS or byte by byte, and read back by npTDMS."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter

from record_case import Case, Held

STEP = 1 / 1024
N = np.arange(32)
TIP = 2.0 * np.cos(0.3 * N)
DRIVE = 5.0 * np.sin(0.3 * N)
WAVE = {"wf_increment": STEP, "wf_start_offset": 0.0}
META, NEW_OBJECTS, RAW, INTERLEAVED, BIG_ENDIAN = 1 << 1, 1 << 2, 1 << 3, 1 << 5, 1 << 6
DOUBLE, INT16, TEXT, UINT32 = 10, 2, 0x20, 7
KINDS = {DOUBLE: "f8", INT16: "i2"}


def _held(path: Path, start: float = 0.0, step: float = STEP) -> Held:
    """What npTDMS reads of group 'g', in SI by hand."""
    file = TdmsFile.read(path)
    tip, drive = (np.asarray(file["g"][name][:], dtype=float) for name in ("tip", "drive"))
    return Held({"g/tip": ("m/s", 1e-3 * tip), "g/drive": ("V", drive)}, step, start)


def _by_writer(
    version: int = 4712,
    kind: type = np.float64,
    pieces: int = 1,
    start: float = 0.0,
    unit_name: str = "unit_string",
    more: Mapping[str, Any] = {},
) -> Callable[[Path], Held]:
    """A file of npTDMS' own writer, in one or several segments."""

    def write(path: Path) -> Held:
        own = {**WAVE, "wf_start_offset": start, **more}
        with TdmsWriter(path, version=version) as out:
            for tip, drive in zip(np.array_split(TIP, pieces), np.array_split(DRIVE, pieces), strict=True):
                out.write_segment(
                    [
                        RootObject({"author": "lab"}),
                        GroupObject("g", {}),
                        ChannelObject("g", "tip", (100 * tip).astype(kind), {**own, unit_name: "mm/s"}),
                        ChannelObject("g", "drive", (100 * drive).astype(kind), {**own, unit_name: "V"}),
                    ]
                )
        return _held(path, start)

    return write


def _text(order: str, words: str) -> bytes:
    return struct.pack(order + "I", len(words.encode())) + words.encode()


def _object(order: str, name: str, kind: int, count: int, properties: Sequence[bytes]) -> bytes:
    index = struct.pack(order + "IIIQ", 20, kind, 1, count)
    return _text(order, f"/'g'/'{name}'") + index + struct.pack(order + "I", len(properties)) + b"".join(properties)


def _double(order: str, name: str, value: float) -> bytes:
    return _text(order, name) + struct.pack(order + "Id", DOUBLE, value)


def _words(order: str, name: str, value: str) -> bytes:
    return _text(order, name) + struct.pack(order + "I", TEXT) + _text(order, value)


def _integer(order: str, name: str, value: int) -> bytes:
    return _text(order, name) + struct.pack(order + "II", UINT32, value)


def _linear(order: str, slope: float, offset: float) -> list[bytes]:
    """Properties of a scaling of raw numbers, as DAQmx writes it."""
    return [
        _integer(order, "NI_Number_Of_Scales", 1),
        _words(order, "NI_Scale[0]_Scale_Type", "Linear"),
        _double(order, "NI_Scale[0]_Linear_Slope", slope),
        _double(order, "NI_Scale[0]_Linear_Y_Intercept", offset),
        _integer(order, "NI_Scale[0]_Linear_Input_Source", 0xFFFFFFFF),
    ]


def _by_hand(
    order: str = "<",
    interleaved: bool = False,
    kind: int = DOUBLE,
    scaled: bool = False,
    chunks: int = 1,
    opened: bool = False,
    version: int = 4713,
) -> Callable[[Path], Held]:
    """One segment, byte by byte. chunks: how often its numbers are repeated below one description; opened: its length
    was never written, as after a crash."""

    def write(path: Path) -> Held:
        rows = [(("tip", "mm/s"), TIP), (("drive", "V"), DRIVE)]
        raw = [np.asarray(100 * values if kind == INT16 else values, order + KINDS[kind]) for _, values in rows]
        meta = struct.pack(order + "I", 2)
        for (name, unit), _ in rows:
            own = [_double(order, "wf_increment", STEP), _words(order, "unit_string", unit)]
            own += _linear(order, 0.25, 0.5) if scaled else []
            meta += _object(order, name, kind, len(N), own)
        numbers = (np.column_stack(raw).tobytes() if interleaved else b"".join(r.tobytes() for r in raw)) * chunks
        flags = META | NEW_OBJECTS | RAW | INTERLEAVED * interleaved | BIG_ENDIAN * (order == ">")
        size = 2**64 - 1 if opened else len(meta) + len(numbers)
        lead = b"TDSm" + struct.pack("<I", flags) + struct.pack(order + "IQQ", version, size, len(meta))
        path.write_bytes(lead + meta + numbers)
        return _held(path)

    return write


def _times_of_day(path: Path) -> Held:
    """Times as a channel of their own, with microseconds."""
    begin = datetime(2026, 1, 1, 10)
    times = np.array([begin + timedelta(microseconds=500 * int(i)) for i in N], dtype="datetime64[us]")
    with TdmsWriter(path) as out:
        out.write_segment(
            [
                ChannelObject("g", "time", times),
                ChannelObject("g", "remarks", ["a", "b"]),
                ChannelObject("g", "tip", TIP, {"unit_string": "mm/s"}),
                ChannelObject("g", "drive", DRIVE, {"unit_string": "V"}),
            ]
        )
    return _held(path, step=5e-4)


CASES = [
    Case("writer.tdms", _by_writer()),
    Case("version 4713.tdms", _by_writer(4713)),
    Case("single precision.tdms", _by_writer(kind=np.float32)),
    Case("integers.tdms", _by_writer(kind=np.int16)),
    Case("five segments.tdms", _by_writer(pieces=5)),
    Case("start.tdms", _by_writer(start=0.125)),
    Case("unit of ni.tdms", _by_writer(unit_name="NI_UnitDescription")),
    Case("other properties.tdms", _by_writer(more={"wf_samples": 7, "wf_xname": "Time", "wf_xunit_string": "s"})),
    Case("little endian.tdms", _by_hand()),
    Case("big endian.tdms", _by_hand(">")),
    Case("big endian integers.tdms", _by_hand(">", kind=INT16)),
    Case("interleaved.tdms", _by_hand(interleaved=True)),
    Case("interleaved big endian.tdms", _by_hand(">", interleaved=True)),
    Case("scaled.tdms", _by_hand(kind=INT16, scaled=True)),
    Case("scaled big endian.tdms", _by_hand(">", kind=INT16, scaled=True)),
    Case("three chunks.tdms", _by_hand(chunks=3)),
    Case("not closed.tdms", _by_hand(opened=True)),
    Case("times of day.tdms", _times_of_day),
]
