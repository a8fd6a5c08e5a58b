"""TDMS files with every flag of the format, written by npTDMS or byte by byte, and read back by npTDMS."""

from __future__ import annotations

import struct
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from nptdms import ChannelObject, RootObject, TdmsFile, TdmsWriter

from record_case import Case, Held

STEP = 1 / 1024
N = np.arange(32)
TIP = 2.0 * np.cos(0.3 * N)
DRIVE = 5.0 * np.sin(0.3 * N)
WAVE = {"wf_increment": STEP, "wf_start_offset": 0.0}
META, NEW_OBJECTS, RAW, INTERLEAVED, BIG_ENDIAN = 1 << 1, 1 << 2, 1 << 3, 1 << 5, 1 << 6
DOUBLE, TEXT = 10, 0x20


def _held(path: Path, start: float = 0.0, step: float = STEP) -> Held:
    """What npTDMS reads of group 'g', in SI by hand."""
    file = TdmsFile.read(path)
    tip, drive = (np.asarray(file["g"][name][:], dtype=float) for name in ("tip", "drive"))
    return Held({"g/tip": ("m/s", 1e-3 * tip), "g/drive": ("V", drive)}, step, start)


def _by_writer(pieces: int = 1, start: float = 0.0, unit_name: str = "unit_string") -> Callable[[Path], Held]:
    """A file of npTDMS' own writer, in one or several segments."""

    def write(path: Path) -> Held:
        own = {**WAVE, "wf_start_offset": start}
        with TdmsWriter(path) as out:
            for tip, drive in zip(np.array_split(TIP, pieces), np.array_split(DRIVE, pieces), strict=True):
                out.write_segment(
                    [
                        RootObject({"author": "lab"}),
                        ChannelObject("g", "tip", 100 * tip, {**own, unit_name: "mm/s"}),
                        ChannelObject("g", "drive", 100 * drive, {**own, unit_name: "V"}),
                    ]
                )
        return _held(path, start)

    return write


def _text(order: str, words: str) -> bytes:
    return struct.pack(order + "I", len(words.encode())) + words.encode()


def _object(order: str, name: str, unit: str) -> bytes:
    """A channel of doubles, with its unit and the step of its samples."""
    head = _text(order, f"/'g'/'{name}'") + struct.pack(order + "IIIQ", 20, DOUBLE, 1, len(N))
    step = _text(order, "wf_increment") + struct.pack(order + "Id", DOUBLE, STEP)
    words = _text(order, "unit_string") + struct.pack(order + "I", TEXT) + _text(order, unit)
    return head + struct.pack(order + "I", 2) + step + words


def _by_hand(order: str = "<", interleaved: bool = False, opened: bool = False) -> Callable[[Path], Held]:
    """One segment, byte by byte. opened: its length was never written, as after a crash."""

    def write(path: Path) -> Held:
        raw = [np.asarray(values, order + "f8") for values in (TIP, DRIVE)]
        meta = struct.pack(order + "I", 2) + _object(order, "tip", "mm/s") + _object(order, "drive", "V")
        numbers = np.column_stack(raw).tobytes() if interleaved else b"".join(r.tobytes() for r in raw)
        flags = META | NEW_OBJECTS | RAW | INTERLEAVED * interleaved | BIG_ENDIAN * (order == ">")
        size = 2**64 - 1 if opened else len(meta) + len(numbers)
        lead = b"TDSm" + struct.pack("<I", flags) + struct.pack(order + "IQQ", 4713, size, len(meta))
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
    Case("five segments.tdms", _by_writer(pieces=5)),
    Case("start.tdms", _by_writer(start=0.125)),
    Case("unit of ni.tdms", _by_writer(unit_name="NI_UnitDescription")),
    Case("big endian.tdms", _by_hand(">")),
    Case("interleaved.tdms", _by_hand(interleaved=True)),
    Case("not closed.tdms", _by_hand(opened=True)),
    Case("times of day.tdms", _times_of_day),
]
