"""Frequency responses: what they are, and their estimation from swept or random records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.signal import csd

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError
from tarsus.records.measurement import Measurement, Quantity

_UNEXCITED = 1e-8
"""Part of the largest power below which a line holds no drive: a ten-thousandth of the amplitude, the digit of a
recorder of 13 bits."""
MOTIONS = {
    Quantity.DISPLACEMENT: 0,
    Quantity.VELOCITY: 1,
    Quantity.ACCELERATION: 2,
    Quantity.ANGLE: 0,
    Quantity.ANGULAR_VELOCITY: 1,
}
"""Motions, by how often the displacement, or the rotation, is differentiated to give them."""
ROTATIONS = {Quantity.ANGLE, Quantity.ANGULAR_VELOCITY}
"""Motions of rotational degrees of freedom."""


class Estimator(Enum):
    """Where the noise of a frequency response is taken to be."""

    H1 = "in the response"
    H2 = "in the drive"
    HV = "in both, in proportion to their power"


@dataclass(frozen=True)
class Frf:
    """Frequency responses of no points to ni drives on evenly spaced lines.

    frequency (nf,) [Hz]; values (no, ni, nf) in the unit of ``quantity`` per unit of drive, of rotations
    with translations in rad for m; outputs: names of the
    points; inputs: names of the drives (that of a point where the drive is a force at it, along the response); repeats
    (nr, no, ni, nf): the same of single repeats, or None; coherence (no, nf): multiple coherence, or None; hann:
    whether the lines are seen through Hann windows, which smear them; files: where each point was measured, empty where
    all were together; forced: whether a known drive excites the motion, False of free decays, whose residues are turned
    as they began; rounding: share by which all frequencies may be wrong together, for steps of few digits.

    Raises
    ------
    InputError
        With a sentence for every fault of shape, spacing, name and number.
    """

    frequency: Floats
    values: Complexes
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    quantity: Quantity
    repeats: Complexes | None = None
    coherence: Floats | None = None
    hann: bool = False
    files: tuple[str, ...] = ()
    forced: bool = True
    rounding: float = 0.0

    def __post_init__(self) -> None:
        problems = []
        shape = (len(self.outputs), len(self.inputs), len(self.frequency))
        if self.values.shape != shape:
            problems.append(f"expected responses of shape (outputs, inputs, lines) = {shape}, got {self.values.shape}")
        elif not np.all(np.isfinite(self.values)):
            bad = np.argwhere(~np.isfinite(self.values))[0]
            problems.append(
                f"the response of '{self.outputs[bad[0]]}' to '{self.inputs[bad[1]]}' has no finite number at "
                f"{self.frequency[bad[2]]:g} Hz"
            )
        if self.repeats is not None and self.repeats.shape[1:] != shape:
            problems.append(f"expected repeats of shape (repeats, *{shape}), got {self.repeats.shape}")
        if len(self.frequency) < 3:
            problems.append(f"expected at least 3 lines, got {len(self.frequency)}")
        else:
            steps = np.diff(self.frequency)
            if steps.min() <= 0.0 or np.ptp(steps) > 1e-2 * steps.mean():
                problems.append(
                    "the lines are not evenly spaced: steps from "
                    f"{steps.min():g} Hz to {steps.max():g} Hz; interpolate or export them evenly"
                )
        if self.quantity not in MOTIONS:
            problems.append(
                f"the response is no motion: expected m, m/s or m/s^2, got {self.quantity.unit}: are drive and "
                "response channels swapped?"
            )
        if problems:
            raise InputError(problems)

    @property
    def line(self) -> float:
        """Spacing of the lines [Hz]."""
        return float((self.frequency[-1] - self.frequency[0]) / (len(self.frequency) - 1))

    @property
    def derivatives(self) -> int:
        """How often the displacement is differentiated to give the responses: 0, 1 or 2."""
        return MOTIONS[self.quantity]

    def between(self, low: float, high: float) -> Frf:
        """The lines from ``low`` to ``high`` [Hz], both included, without one at 0 Hz.

        Raises
        ------
        InputError
            If fewer than 3 lines lie there.
        """
        inside = (self.frequency >= low) & (self.frequency <= high) & (self.frequency > 0.0)
        if np.count_nonzero(inside) < 3:
            raise InputError(
                f"fewer than 3 lines lie between {low:g} Hz and {high:g} Hz: they go from {self.frequency[0]:g} Hz to "
                f"{self.frequency[-1]:g} Hz in steps of {self.line:g} Hz"
            )
        return self.lines(np.flatnonzero(inside))

    def lines(self, which: slice | NDArray[np.intp]) -> Frf:
        """Some of the lines, by their place."""
        return replace(
            self,
            frequency=self.frequency[which],
            values=self.values[..., which],
            repeats=None if self.repeats is None else self.repeats[..., which],
            coherence=None if self.coherence is None else self.coherence[..., which],
        )


def estimate_frf(
    records: Sequence[Measurement],
    drives: Sequence[str],
    responses: Sequence[str],
    band: tuple[float, float],
    estimator: Estimator = Estimator.H1,
    segment: float | None = None,
) -> Frf:
    """Frequency responses from records of one or several repeats.

    Parameters
    ----------
    records
        Repeats of one experiment, sampled alike and of equal length.
    drives, responses
        Names of channels; the responses must all be of one quantity.
    band
        Lowest and highest frequency [Hz] wanted.
    estimator
        Where the noise is taken to be (H1, H2, Hv).
    segment
        None for sweeps that begin and end at rest, and for whole periods of a periodic drive: every record is
        transformed whole. For random drives, the length of a segment [s]: Hann windows, half overlapping.

    Returns
    -------
    Frf
        With repeats if there are several records, each good for all drives on its own, and with the multiple coherence
        if there are more averages than drives.

    Raises
    ------
    InputError
        For channels that are missing or of mixed quantities, records unlike each other, too few averages, or a drive
        that does not excite part of the band.
    """
    names, count = [*drives, *responses], len(drives)
    _check_records(records, responses)
    first = records[0]
    size = first.count if segment is None else round(segment / first.step)
    if not 4 <= size <= first.count:
        raise InputError(
            f"a segment of {size} samples does not fit into a record of {first.count} samples: give 4 samples or more"
        )
    averages = 1 if segment is None else (first.count - size) // (size - size // 2) + 1
    if averages * len(records) < count:
        raise InputError(
            f"{count} drives need at least {count} averages, got {averages * len(records)}: add records or "
            "shorten the segments"
        )
    spectra: list[Complexes] = []
    frequency = np.zeros(0)
    for record in records:
        rows = np.array([record[name] for name in names])
        if segment is None:
            frequency, whole = np.fft.rfftfreq(size, 1.0 / first.rate), np.fft.rfft(rows - rows.mean(axis=1)[:, None])
            full, power = whole, np.abs(whole[:count]) ** 2
        else:  # csd(a, b) is <conj(A) B>
            frequency, found = csd(
                rows[:, None], rows[None, :], first.rate, "hann", nperseg=size, noverlap=size // 2, detrend="constant"
            )
            full = np.asarray(found, dtype=complex)
            power = np.einsum("iif->if", full)[:count].real
        inside = (frequency >= band[0]) & (frequency <= band[1]) & (frequency > 0.0)
        if np.count_nonzero(inside) < 3:
            raise InputError(
                f"fewer than 3 lines lie between {band[0]:g} Hz and {band[1]:g} Hz: the spacing is {frequency[1]:g} Hz "
                f"and the highest line {frequency[-1]:g} Hz; take longer segments or a higher sampling rate"
            )
        frequency, full = np.asarray(frequency, dtype=float)[inside], full[..., inside]
        spectra.append(full.conj()[:, None] * full if segment is None else full)
        _check_drive(power, inside, frequency, drives)
    mean: Complexes = np.mean(spectra, axis=0)
    single = averages >= count and len(records) > 1
    total = averages * len(records)
    return Frf(
        frequency,
        _response(mean, count, estimator),
        tuple(first.channel(name).at for name in responses),
        tuple(first.channel(name).at for name in drives),
        first.channel(responses[0]).quantity,
        np.array([_response(one, count, estimator) for one in spectra]) if single else None,
        _coherence(mean, count) if total > count else None,
        segment is not None,
        rounding=max(one.rounding for one in records),
    )


def _check_records(records: Sequence[Measurement], responses: Sequence[str]) -> None:
    if not records:
        raise InputError("there is no record to estimate frequency responses from")
    first, problems = records[0], []
    for number, record in enumerate(records[1:], start=2):
        if record.count != first.count or abs(record.step / first.step - 1.0) > 1e-9:
            problems.append(
                f"record {number} has {record.count} samples at {record.rate:g} Hz, the first {first.count} at "
                f"{first.rate:g} Hz: repeats must be sampled alike"
            )
    quantities = {first.channel(name).quantity.unit for name in responses}
    if len(quantities) > 1:
        problems.append(f"the responses are of different units: {', '.join(sorted(quantities))}")
    if problems:
        raise InputError(problems)


def _check_drive(powers: Floats, inside: NDArray[np.bool_], frequency: Floats, drives: Sequence[str]) -> None:
    """Refuse drives of which a line inside of the band (nb,) has next to none of the powers (n, nf)."""
    problems = []
    for name, whole in zip(drives, powers, strict=True):
        power, top = whole[inside], float(whole.max())
        if top <= 0.0:
            problems.append(f"channel '{name}' is no drive: it does not change")
        elif np.any(power < _UNEXCITED * top):
            weak = frequency[power < _UNEXCITED * top]
            problems.append(
                f"the drive '{name}' does not excite {len(weak)} of {len(frequency)} lines of the band, from "
                f"{weak[0]:g} Hz to {weak[-1]:g} Hz: narrow the band"
            )
    if problems:
        raise InputError(problems)


def _response(spectra: Complexes, count: int, estimator: Estimator) -> Complexes:
    """Responses (no, ni, nf) from mean cross spectra (n, n, nf), drives first."""
    by_line = np.moveaxis(spectra, -1, 0)
    drive = by_line[:, :count, :count]
    cross = by_line[:, :count, count:]
    own = np.einsum("fii->fi", by_line).real[:, count:]
    if estimator is Estimator.H1:
        # <conj(X) Y> = <conj(X) X> H^T
        if count == 1:
            return spectra[:1, 1:].swapaxes(0, 1) / spectra[0, 0].real
        return np.moveaxis(np.linalg.solve(drive, cross).astype(np.complex128), (0, 1, 2), (2, 1, 0))
    if estimator is Estimator.H2:
        if count > 1:
            raise InputError("H2 is for a single drive: take H1 or Hv for several")
        return np.moveaxis((own[:, None, :] / cross.conj()).astype(np.complex128), (0, 1, 2), (2, 1, 0))
    values = np.empty((own.shape[1], count, len(by_line)), dtype=complex)
    for o in range(own.shape[1]):
        pick = np.array([*range(count), count + o])
        part = by_line[:, pick][:, :, pick]
        size = np.sqrt(np.einsum("fii->fi", part).real)
        size = np.where(size > 0.0, size, 1.0)
        _, vectors = np.linalg.eigh(part / size[:, :, None] / size[:, None, :])
        least = vectors[:, :, 0] / size
        # part @ [H, -1] is smallest: conj(X)(X H - Y)
        values[o] = (-least[:, :count] / least[:, count:]).T
    return values


def _coherence(spectra: Complexes, count: int) -> Floats:
    """Multiple coherence (no, nf) of the responses with all drives."""
    by_line = np.moveaxis(spectra, -1, 0)
    cross = by_line[:, :count, count:]
    own = np.einsum("fii->fi", by_line).real[:, count:]
    explained = np.einsum("fio,fio->fo", cross.conj(), np.linalg.solve(by_line[:, :count, :count], cross)).real
    return np.divide(explained, own, out=np.zeros_like(explained), where=own > 0.0).T
