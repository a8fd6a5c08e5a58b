"""What a file holds before anything is chosen from it: series, their units as written, and what it says of its axis."""

from __future__ import annotations

import contextlib
import os
import stat
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest


class Domain(Enum):
    """What a series runs over."""

    TIME = auto()
    FREQUENCY = auto()


class Role(Enum):
    """What a series is."""

    SIGNAL = auto()
    RESPONSE = auto()
    COHERENCE = auto()


@dataclass(frozen=True)
class Axis:
    """Times [s] or frequencies [Hz] of a series (ns,), counted from an origin; resolution: step of the digits they were
    written in."""

    domain: Domain
    values: Floats
    resolution: float = 0.0
    origin: float = 0.0


@dataclass(frozen=True)
class Declared:
    """A sampling step [s] that a header states; where: in which words; resolution: step of its digits [s]; start [s]:
    time of the first sample; rounding: share by which the step may be off, since its digits are few."""

    where: str
    step: float
    resolution: float = 0.0
    start: float = 0.0
    rounding: float = 0.0


@dataclass(frozen=True)
class Reference:
    """Input of a frequency response: name, unit as written, and a factor that comes on top of it."""

    name: str
    unit: str
    factor: float = 1.0


@dataclass(frozen=True)
class RawSeries:
    """One series as it stands in the file.

    name; values (ns,), real or complex, as written; unit: as written, empty when the file says none; role; axis: its
    own, or None where a column or a header gives it; declared: sampling step that the file states for it; reference:
    input of a response; count: number of values that the file announces; point: name of the point it looks at;
    excitation: whether the file says that it drives the structure; noise, full_scale: in the unit as written;
    resolution: step of the digits the values were written in; factor: what comes on top of the unit as written.
    """

    name: str
    values: NDArray[Any]
    unit: str = ""
    role: Role = Role.SIGNAL
    axis: Axis | None = None
    declared: Declared | None = None
    reference: Reference | None = None
    count: int | None = None
    point: str | None = None
    excitation: bool = False
    noise: float | None = None
    full_scale: float | None = None
    resolution: float = 0.0
    factor: float = 1.0


@dataclass(frozen=True)
class RawFile:
    """All series of a file. source: its name; notes: what else it holds and is not used; ragged: whether series of
    different lengths begin together, so that the record ends with the shortest; several: the records of a file that
    holds more than one, of which the series are the first's; cause: in which words it does."""

    source: str
    series: tuple[RawSeries, ...]
    declared: Declared | None = None
    notes: tuple[str, ...] = field(default=())
    ragged: bool = False
    several: tuple[RawFile, ...] = ()
    cause: str = ""

    def one(self, record: int | None) -> RawFile:
        """The record of a number, from 1; 0 joins all, one behind the other; None is the only one.

        Raises
        ------
        InputError
            Where there are several and none was chosen, or not so many; and to join records of other channels.
        """
        count = max(len(self.several), 1)
        if record is None and count == 1:
            return self
        if record is None:
            raise InputError(
                f"{self.source} holds {count} records{self.cause}; say which with record (1 to {count}; 0 joins them)"
            )
        if not 0 <= record <= count:
            raise InputError(f"{self.source} has no record {record}: it holds {count}")
        if count == 1:
            return self
        return self.several[record - 1] if record else _end_to_end(self.source, self.several)

    @property
    def names(self) -> list[str]:
        """Names of the series, each once."""
        return list(dict.fromkeys(one.name for one in self.series))

    def named(self, name: str) -> RawSeries:
        """The first series of a name. Raises InputError where there is none, with the nearest name."""
        for one in self.series:
            if one.name == name:
                return one
        raise InputError(f"{self.source} has no series '{name}'{nearest(name, self.names)}")


def _end_to_end(source: str, records: Sequence[RawFile]) -> RawFile:
    """Records of the same channels as one."""
    first = records[0]
    if any(one.names != first.names for one in records):
        raise InputError(f"{source}: its records have other channels, and cannot be joined; choose one with record")
    series = []
    for one in first.series:
        same = [other.named(one.name) for other in records]
        axes = [other.axis.values for other in same if other.axis is not None]
        axis = one.axis and replace(one.axis, values=np.concatenate(axes))
        values = np.concatenate([other.values for other in same])
        series.append(replace(one, values=values, axis=axis, count=None))
    note = f"{source}: {len(records)} records are joined, as chosen"
    return replace(first, series=tuple(series), notes=(*first.notes, note))


MOST_BYTES = 1 << 31
"""Largest file [B] that is read: its content and the numbers in it are in memory together."""
MOST_VALUES = 1 << 27
"""Most values that a file may hold, 1 GiB: ten minutes of two channels at 100 kHz. A file of zeros is a thousand times
smaller than what it unpacks to."""


_DAMAGED = (
    "truncated",
    "end of file",
    "eof",
    "checksum",
    "corrupt",
    "buffer is smaller",
    "cannot reshape",
    "enough bytes",
)
"""Words by which libraries say that a file holds fewer bytes than it announces, or other ones."""


def read_bytes(path: Path) -> bytes:
    """Content of a file; raises InputError if it cannot be read, is no file such as a device, or is too large."""
    try:
        with path.open("rb") as opened:
            status = os.fstat(opened.fileno())
            if not (stat.S_ISREG(status.st_mode) or stat.S_ISFIFO(status.st_mode)):
                raise InputError(f"{path} is a device, not a file")
            if status.st_size <= MOST_BYTES:
                content = opened.read() if stat.S_ISREG(status.st_mode) else opened.read(MOST_BYTES + 1)
                if len(content) <= MOST_BYTES:
                    return content
    except OSError as error:
        raise InputError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from None
    raise InputError(
        f"{path.name} is larger than the {MOST_BYTES >> 30} GiB that are read; cut it into several records"
    )


@contextlib.contextmanager
def parsing(source: str, kind: str) -> Iterator[None]:
    """Of a library's parser, which raises whatever a file makes it run into: one sentence in place of it.

    It says that the file is damaged only where the parser found its end or its checksums wrong.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        said = str(error) or type(error).__name__
        if isinstance(error, (EOFError, zlib.error)) or any(word in said.lower() for word in _DAMAGED):
            raise InputError(f"{source} is damaged or truncated: it cannot be read as {kind} ({said})") from None
        raise InputError(f"{source} cannot be read as {kind} ({said})") from None


def truncated(source: str, channel: str, count: int, announced: int) -> str:
    """What to say of a channel with fewer values than its file announces."""
    return f"{source} is truncated: channel '{channel}' has {count} values where the file announces {announced}"


def check_values(name: str, count: int) -> None:
    """Raise InputError where a file announces more values than are read, before they are unpacked."""
    if count > MOST_VALUES:
        raise InputError(
            f"{name} holds {count:.3g} values, and at most {MOST_VALUES:.3g} are read; cut it into several records"
        )
