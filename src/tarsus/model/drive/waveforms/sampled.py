"""A waveform given by samples, inline or from a file, joined by lines or by a cubic spline."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns
from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.quantities import Quantity
from tarsus.base.spec import quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, cubic_track, each_run, linear_track, polynomial

if TYPE_CHECKING:
    from tarsus.model.drive.recorded import RecordedSignal


class Interpolation(Enum):
    """How samples are joined."""

    LINEAR = "linear"
    CUBIC = "cubic"
    """Natural cubic spline."""


class Sampled(Signal):
    """Voltages at increasing times; before the first sample its value holds, after the last one that one's.

    Samples are given inline (`times`, `levels`), or as `file`, in any format that records are read from (docs,
    "Reading measurements"), or .npz: units, decimal commas and times are those of the file, of which the columns
    `time_column` and `value_column` are read, else those that their units show. The recorder's clock does not
    count: the first sample of a file comes at `start`. A relative file is looked for next to the scene file (validation
    context "folder"), then in the current folder.
    """

    synonyms: ClassVar[Mapping[str, str]] = {"volts_column": "value_column"}
    kind: Literal["sampled"] = "sampled"
    times: tuple[float, ...] | None = quantity("s", "times of the samples, increasing", default=None, ge=0)
    levels: tuple[float, ...] | None = quantity("V", "voltages of the samples", default=None)
    file: str | None = None
    time_column: str = "time"
    value_column: str = Field(default="", description="absent: volts, or what else is measured")
    start: float | None = quantity("s", "time of the first sample of a file; 0 s where absent", default=None, ge=0)
    interpolation: Interpolation = Interpolation.LINEAR

    @field_validator("file")
    @classmethod
    def _resolve(cls, value: str | None, info: ValidationInfo) -> str | None:
        """Make a file next to the scene file absolute, so that it is found from any folder later."""
        folder = (info.context or {}).get("folder")
        if value is None or Path(value).is_absolute() or folder is None:
            return value
        there = Path(folder) / value
        return str(there.resolve()) if there.exists() else value

    @model_validator(mode="after")
    def _check_samples(self) -> Sampled:
        inline = self.times is not None or self.levels is not None
        if inline and self.file is not None:
            raise PathErrors([("file", "give either a file or times and levels, not both")])
        if self.file is None and (self.times is None or self.levels is None):
            raise PathErrors([("", "expected either times and levels, or a file")])
        if self.file is None and self.start is not None:
            raise PathErrors([("start", "is of a file: times state their own start")])
        place = "times" if self.file is None else "file"
        try:
            times, levels = self.samples()
            _check(times, levels)
        except InputError as error:
            raise PathErrors([(place, text) for text in error.problems]) from None
        return self

    def samples(self) -> tuple[Floats, Floats]:
        """Times [s] and voltages [V], each (N,)."""
        if self.file is None:
            return columns(self.times), columns(self.levels)
        times, levels, _ = self._recorded()
        return (times if self.start is None else times + self.start), levels

    def _recorded(self) -> RecordedSignal:
        path = Path(str(self.file))
        if not path.is_file():
            raise InputError(f"there is no file '{self.file}' (looked from {Path.cwd()})")
        given = self.time_column, self.value_column
        return _cached(str(path.resolve()), path.stat().st_mtime_ns, *given, self.measured)

    @property
    def remarks(self) -> tuple[str, ...]:
        """A sentence where the clock of a file does not begin at 0 s and nothing says when it is played."""
        first = 0.0 if self.file is None or self.start is not None else self._recorded().begin
        if first == 0.0:
            return ()
        name, begin = Path(str(self.file)).name, f"{first:.6g}"
        return (f"{name} begins at {begin} s of its own clock; here its first sample comes at 0 s (start).",)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        t = np.asarray(time, dtype=np.float64)
        times, levels = self.samples()
        if self.interpolation is Interpolation.LINEAR or len(times) < 3:
            return np.interp(t, times, levels)
        rows = _spline(times, levels)
        t = np.clip(t, times[0], times[-1])
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(rows) - 1)
        xi = 2.0 * (t - times[k]) / (times[k + 1] - times[k]) - 1.0
        return ((rows[k, 3] * xi + rows[k, 2]) * xi + rows[k, 1]) * xi + rows[k, 0]

    def track(self) -> Track:
        """Lines or monotone cubics between the samples, and the hold."""
        times, levels = self.samples()
        shape = np.broadcast_shapes((1, times.shape[-1]), times.shape, levels.shape)
        times, levels = (np.broadcast_to(one, shape) for one in (times, levels))
        for run in np.flatnonzero((np.diff(times, axis=1) <= 0.0).any(axis=1)):
            _check(times[run], levels[run])
        if self.interpolation is Interpolation.CUBIC and times.shape[1] >= 3:
            return each_run(_cubics, times, levels)
        late = times[:, 0] > 0.0
        if late.any():
            times = np.concatenate([np.where(late, 0.0, times[:, 0])[:, None], times], axis=1)
            levels = np.concatenate([levels[:, :1], levels], axis=1)
        bent = (levels[:, 1:-1] != levels[:, :-2]) | (levels[:, 1:-1] != levels[:, 2:])
        keep = np.concatenate([np.ones((len(bent), 1), dtype=bool), bent], axis=1)
        if late.any():
            keep[:, 1] |= ~late
        return linear_track(times, levels[:, :-1], levels[:, 1:], periodic=False, hold=True, keep=keep)


def _cubics(times: Any, levels: Any) -> Track:
    """The cubic spline of one run, of samples (1, N)."""
    times, levels = times[0], levels[0]
    rows = _spline(times, levels)
    if times[0] > 0.0:
        rows = np.concatenate([polynomial(levels[:1]), rows])
        times, levels = np.concatenate([[0.0], times]), np.concatenate([levels[:1], levels])
    return cubic_track(times, rows, levels)


def _check(times: Floats, levels: Floats) -> None:
    """Raise InputError with one sentence for what is wrong with the samples."""
    if len(times) != len(levels):
        raise InputError(f"expected as many times as voltages, got {len(times)} and {len(levels)}")
    if len(times) < 2:
        raise InputError(f"expected at least two samples, got {len(times)}")
    if not (np.isfinite(times).all() and np.isfinite(levels).all()):
        raise InputError("expected finite samples, got a NaN or infinite one")
    if times[0] < 0.0:
        raise InputError(f"expected sample times from 0 on, got {times[0]!r} s first")
    back = np.nonzero(np.diff(times) <= 0.0)[0]
    if len(back):
        k = int(back[0])
        pair = f"{float(times[k])!r} s is followed by {float(times[k + 1])!r} s"
        raise InputError(f"sample times must increase, but sample {k + 1} at {pair}")


def _spline(times: Floats, levels: Floats) -> Floats:
    """Natural cubic spline: coefficients (N-1, 4) in xi of each interval, from the tridiagonal system."""
    step = times[1:] - times[:-1]
    slope = (levels[1:] - levels[:-1]) / step
    count = len(step) - 1
    right, across = 6.0 * (slope[1:] - slope[:-1]), 2.0 * (step[:-1] + step[1:])
    right, across, h = ([one[i] for i in range(len(one))] for one in (right, across, step))
    for i in range(1, count):
        factor = h[i] / across[i - 1]
        across[i] = across[i] - factor * h[i]
        right[i] = right[i] - factor * right[i - 1]
    bend = [0.0] * (count + 2)
    for i in range(count - 1, -1, -1):
        bend[i + 1] = (right[i] - h[i + 1] * bend[i + 2]) / across[i]
    m = columns(bend)
    m0, m1 = m[:-1] * (step * step) / 8.0, m[1:] * (step * step) / 8.0
    mean, rise = 0.5 * (levels[:-1] + levels[1:]), 0.5 * (levels[1:] - levels[:-1])
    return polynomial(mean - 0.5 * (m0 + m1), rise - (m1 - m0) / 6.0, 0.5 * (m0 + m1), (m1 - m0) / 6.0)


@lru_cache(maxsize=16)
def _cached(path: str, changed: int, time_column: str, value_column: str, measured: Quantity) -> RecordedSignal:
    """Samples of one version of a file."""
    from tarsus.model.drive.recorded import column_of, read_signal  # readers of files, which few signals need

    return read_signal(Path(path), time_column, value_column or column_of(measured), measured)
