"""What an instrument recorded: channels in time or frequency, with their quantities, points, noise and coherence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError, InputProblem
from tarsus.base.messages import nearest
from tarsus.base.quantities import Quantity
from tarsus.records.clipping import heaped_samples


@dataclass(frozen=True)
class Channel:
    """One channel of a measurement.

    name: of the channel; quantity: what it measures, and so its unit; point: name of the structure's point it looks
    at, when that is not the channel's own; noise: standard deviation of one sample, or None when it is not known;
    full_scale: largest absolute value the instrument can give, or None. Noise and full scale are in the unit of the
    quantity.
    """

    name: str
    quantity: Quantity
    point: str | None = None
    noise: float | None = None
    full_scale: float | None = None

    @property
    def unit(self) -> str:
        """SI unit of its values."""
        return self.quantity.unit

    @property
    def at(self) -> str:
        """Name of the point it looks at."""
        return self.name if self.point is None else self.point


@dataclass(frozen=True)
class Measurement:
    """Channels sampled together at an even step.

    channels: nc of them, with different names; values (nc, ns) in the channels' SI units, read-only; step [s] between
    samples; start [s] of the first sample on the recorder's clock; source: where the record comes from; drive: name
    of the channel that recorded the drive, or None; notes: sentences on what of the source was used and what was not;
    rounding: share by which all steps may be longer or shorter, since the source wrote them in few digits.

    Raises
    ------
    InputError
        With a sentence for every channel that is short, not finite or named twice, for a step that is not positive,
        and for a drive that is no channel.
    """

    channels: tuple[Channel, ...]
    values: Floats
    step: float
    start: float = 0.0
    source: str = ""
    drive: str | None = None
    notes: tuple[str, ...] = ()
    rounding: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", tuple(self.channels))
        values = _rows(self.channels, self.values)
        problems = _channel_problems(self.channels, values)
        if not (np.isfinite(self.step) and self.step > 0.0):
            problems.append(f"expected a sampling step above 0 s, got {self.step:g} s")
        if not np.isfinite(self.start):
            problems.append(f"expected a finite start time, got {self.start:g} s")
        if self.drive is not None and self.drive not in self.names:
            problems.append(f"the drive is no channel: '{self.drive}'{nearest(self.drive, self.names)}")
        if problems:
            raise InputError(problems)
        values = values.copy()
        values.setflags(write=False)
        object.__setattr__(self, "values", values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    @property
    def count(self) -> int:
        """Number of samples ns."""
        return self.values.shape[1]

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return 1.0 / self.step

    @property
    def time(self) -> Floats:
        """Times of the samples [s], shape (ns,)."""
        return self.start + self.step * np.arange(self.count, dtype=np.float64)

    def index(self, name: str) -> int:
        """Row of a channel by its name.

        Raises
        ------
        InputError
            If there is no such channel, with the nearest name.
        """
        if name not in self.names:
            raise InputError(f"the measurement has no channel '{name}'{nearest(name, self.names)}")
        return self.names.index(name)

    def channel(self, name: str) -> Channel:
        """Description of a channel by its name."""
        return self.channels[self.index(name)]

    def __getitem__(self, name: str) -> Floats:
        """Values of a channel (ns,), read-only."""
        return self.values[self.index(name)]

    def of(self, quantity: Quantity) -> tuple[str, ...]:
        """Names of the channels that measure a quantity."""
        return tuple(channel.name for channel in self.channels if channel.quantity is quantity)

    def select(self, names: Iterable[str]) -> Measurement:
        """A measurement of some channels only, in the order given; it knows its drive if that is one of them."""
        rows = [self.index(name) for name in names]
        channels = tuple(self.channels[i] for i in rows)
        drive = self.drive if self.drive in [channel.name for channel in channels] else None
        return replace(self, channels=channels, values=self.values[rows], drive=drive)

    def between(self, start: float, end: float) -> Measurement:
        """The samples from ``start`` to ``end`` [s], both included.

        Raises
        ------
        InputError
            If no sample lies there.
        """
        inside = np.flatnonzero((self.time >= start) & (self.time <= end))
        if not len(inside):
            last = self.time[-1]
            raise InputError(
                f"no sample lies between {start:g} s and {end:g} s: the record lasts from {self.start:g} s "
                f"to {last:g} s"
            )
        return replace(self, values=self.values[:, inside], start=float(self.time[inside[0]]))

    def clipped(self) -> tuple[InputProblem, ...]:
        """A sentence for every channel whose samples reach its full scale.

        Where that is not known, for a velocity or acceleration whose largest or smallest value comes again and again,
        unlike those next to it; a displacement may stay at a stop.
        """
        said = []
        for channel, row in zip(self.channels, self.values, strict=True):
            if channel.full_scale is not None:
                hit = int(np.count_nonzero(np.abs(row) >= channel.full_scale))
                cause = f"reach the full scale of {channel.full_scale:g} {channel.quantity.unit}"
            elif channel.quantity in (Quantity.VELOCITY, Quantity.ACCELERATION):
                hit, value = heaped_samples(row)
                cause = f"have the same extreme value of {value:.4g} {channel.quantity.unit}"
            else:
                continue
            if hit:
                text = f"is clipped: {hit} of {len(row)} samples {cause}"
                said.append(InputProblem(f"channel '{channel.name}' {text}", said=text, channel=channel.name))
        return tuple(said)


@dataclass(frozen=True)
class FrequencyResponse:
    """Responses of outputs per unit of inputs at the same frequencies: H of x(t) = Re(H u exp(i 2 pi f t)).

    outputs: no channels; inputs: ni channels; frequency (nf,) [Hz], increasing, not below 0; values (no, ni, nf),
    complex, in the unit of the output over that of the input; coherence (no, ni, nf), the squared magnitude from 0
    to 1, nan where it is not known, or None; source: where it comes from; notes: sentences on what of the source was
    used and what was not. Arrays are read-only.

    Raises
    ------
    InputError
        With a sentence for every response that is short or not finite, for names given twice, frequencies that do not
        increase, and a coherence that is not between 0 and 1.
    """

    outputs: tuple[Channel, ...]
    inputs: tuple[Channel, ...]
    frequency: Floats
    values: Complexes
    coherence: Floats | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", tuple(self.outputs))
        object.__setattr__(self, "inputs", tuple(self.inputs))
        frequency = np.array(self.frequency, dtype=float)
        values = np.array(self.values, dtype=complex)
        coherence = None if self.coherence is None else np.array(self.coherence, dtype=float)
        shape = (len(self.outputs), len(self.inputs), frequency.size)
        if frequency.ndim != 1 or values.shape != shape:
            raise InputError(f"expected values of shape (outputs, inputs, frequencies) = {shape}, got {values.shape}")
        problems = _frequency_problems(frequency) + _twice(self.outputs) + _twice(self.inputs)
        if 0 in shape[:2]:
            problems.append("expected at least one output and one input")
        for row, output in zip(values, self.outputs, strict=True):
            bad = np.flatnonzero(~np.isfinite(row).all(axis=0))
            if len(bad):
                problems.append(
                    f"the response of '{output.name}' has {len(bad)} lines that are no finite number, the first at "
                    f"{frequency[bad[0]]:g} Hz"
                )
        if coherence is not None and coherence.shape != shape:
            problems.append(f"expected a coherence of the shape of the values {shape}, got {coherence.shape}")
        elif coherence is not None and np.any((coherence < 0.0) | (coherence > 1.0)):
            problems.append("the coherence is not between 0 and 1 everywhere")
        if problems:
            raise InputError(problems)
        for name, array in (("frequency", frequency), ("values", values), ("coherence", coherence)):
            if array is not None:
                array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def unit(self) -> tuple[tuple[str, ...], ...]:
        """SI unit of each response, by output and input, such as ``"m/s^2 / N"``."""
        return tuple(tuple(f"{o.quantity.unit} / {i.quantity.unit}" for i in self.inputs) for o in self.outputs)

    def between(self, low: float, high: float) -> FrequencyResponse:
        """The lines from ``low`` to ``high`` [Hz], both included.

        Raises
        ------
        InputError
            If fewer than two lines lie there.
        """
        inside = (self.frequency >= low) & (self.frequency <= high)
        if np.count_nonzero(inside) < 2:
            raise InputError(
                f"fewer than two lines lie between {low:g} Hz and {high:g} Hz: the response goes from "
                f"{self.frequency[0]:g} Hz to {self.frequency[-1]:g} Hz"
            )
        coherence = None if self.coherence is None else self.coherence[..., inside]
        return replace(self, frequency=self.frequency[inside], values=self.values[..., inside], coherence=coherence)

    def deviation(self, averages: int) -> Floats:
        """Random standard deviation of each value (no, ni, nf), as its magnitude, from coherence and averages.

        ``|H| sqrt((1 - c) / (2 c n))`` for n independent averages (Bendat and Piersol, Random Data, chapter 9).

        Raises
        ------
        InputError
            If the coherence is not known, or there is not at least one average.
        """
        if self.coherence is None:
            raise InputError("the coherence of the response is not known, and so neither is its scatter")
        if averages < 1:
            raise InputError(f"expected at least 1 average, got {averages}")
        known = np.maximum(self.coherence, np.finfo(float).tiny)
        return np.abs(self.values) * np.sqrt((1.0 - self.coherence) / (2.0 * averages * known))


def _twice(channels: Sequence[Channel]) -> list[str]:
    names = [channel.name for channel in channels]
    return [f"two channels are named '{name}'" for name in sorted({n for n in names if names.count(n) > 1})]


def _frequency_problems(frequency: Floats) -> list[str]:
    if frequency.size < 2:
        return [f"expected at least 2 frequencies, got {frequency.size}"]
    if not np.all(np.isfinite(frequency)):
        return [f"the frequency at line {int(np.flatnonzero(~np.isfinite(frequency))[0])} is no finite number"]
    if frequency[0] < 0.0 or np.any(np.diff(frequency) <= 0.0):
        return ["expected frequencies that increase, from 0 Hz or above"]
    return []


def _rows(channels: Sequence[Channel], values: ArrayLike | Sequence[ArrayLike]) -> Floats:
    """Values as an array (nc, ns); channels of different lengths are a problem of their own."""
    try:
        rows = np.asarray(values, dtype=float)
    except ValueError:
        lengths = {c.name: np.size(row) for c, row in zip(channels, values, strict=False)}  # type: ignore[arg-type]
        shown = ", ".join(f"'{name}' {length}" for name, length in lengths.items())
        raise InputError(f"the channels have different numbers of samples: {shown}") from None
    if rows.ndim == 2 and rows.shape[0] == len(channels):
        return rows
    if rows.ndim == 2 and rows.shape[1] == len(channels):
        raise InputError(
            f"expected values of shape (channels, samples) = ({len(channels)}, ...), got {rows.shape}: "
            "they look transposed"
        )
    raise InputError(f"expected values of shape (channels, samples) = ({len(channels)}, ...), got {rows.shape}")


def _channel_problems(channels: Sequence[Channel], values: Floats) -> list[str]:
    problems = _twice(channels)
    if not channels:
        problems.append("expected at least one channel, got none")
    if values.shape[1] < 2:
        problems.append(f"expected at least 2 samples, got {values.shape[1]}")
    for channel, row in zip(channels, values, strict=True):
        bad = np.flatnonzero(~np.isfinite(row))
        if len(bad):
            problems.append(
                f"channel '{channel.name}' has {len(bad)} samples that are no finite number, the first at "
                f"sample {bad[0]}"
            )
        for word, number in (("noise", channel.noise), ("full scale", channel.full_scale)):
            if number is not None and not (np.isfinite(number) and number > 0.0):
                problems.append(f"channel '{channel.name}': expected a {word} above 0, got {number:g}")
    return problems


def check_sampled_together(first: Measurement, second: Measurement, names: Sequence[str]) -> None:
    """Raise InputError unless two measurements have the named channels, of the same quantity, at the same step."""
    problems = []
    if abs(first.step - second.step) > 1e-9 * first.step:
        problems.append(
            f"the records are sampled differently: every {first.step:g} s and every {second.step:g} s; resample one"
        )
    for name in names:
        missing = [which for which, one in (("first", first), ("second", second)) if name not in one.names]
        problems += [f"the {which} record has no channel '{name}'" for which in missing]
        if missing:
            continue
        quantities = first.channel(name).quantity, second.channel(name).quantity
        if quantities[0] is not quantities[1]:
            problems.append(
                f"channel '{name}' is in {quantities[0].unit} in one record and in {quantities[1].unit} in the other"
            )
    if problems:
        raise InputError(problems)
