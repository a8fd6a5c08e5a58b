"""The recorded drive against the one that was meant: size, offset, delay and pace by least squares.

``V(T) = offset + gain s(pace T - rest - late)`` at times T from the beginning of the record, with s the drive that was
meant, 0 before it begins. A drive that jumps is compared through a running mean of a few samples, so that an edge
counts by its place although it lands within a sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.volts import jumps_of
from tarsus.model.drive.waveforms import Waveform

_GAIN = 0.03
"""Factor of the size: amplifiers are specified to a few percent, and a wrong unit or range deviates by more."""
_OFFSET = 0.03
"""Part of the amplitude, as for the size."""
_LATE = 2.0
"""Samples: a trigger errs by one, and the recorder may round it once more."""
_PACE = 2e-3
"""Deviation of the pace from 1: clocks agree to 1e-5, and wrongly stated rates deviate by percents."""
_DRIFT = 1.0
"""Samples over the record by which the pace may be off besides: what a delay may be."""
_SHAPE = 0.15
"""What may differ from the drive that was meant: factor of its size, part of its amplitude, samples, factor of its
pace with samples over the record, part of its root mean square that nothing of these explains."""
_SHAPE_OF_SWEEPS = 0.7
"""The same for a sweep, whose responses are divided by what was recorded: an amplifier may be slow."""
_CUT = 0.005
"""Part of its length by which a record may end early: the last half percent of a period holds no event."""
_WELL = 0.12
"""Part of the root mean square below which a fit from the stated place needs no search for a better one."""
_BETTER = 0.7
"""How much less another fit must leave to be taken instead: half a period later a wave is its own negative."""
_RUNNING = 9
"""Samples of a running mean at most: an edge then counts in nine samples, within which its place is linear."""
_STEPS = 15
"""Steps of the fit at most; one that leaves more than the last ends it before."""
_FAST = 0.1
"""Part of its span that a drive moves by from one sample to the next where it is fast."""
_SETTLED = 1e-3
"""Samples below which a step no longer matters: a steep ramp moves by a fortieth of itself then, less than a digit."""
_FASTEST = 4.0
"""Factor of the pace beyond which no record is the drive that was meant."""
_AWAY = 0.5
"""Part of the samples that must be left when those next to jumps are dropped; else all count."""
_ROUNDED = 0.6
"""Digits by which rounding takes volts from their fit: half of one, and what the fit itself may be off."""
_DIGIT = 0.02
"""Digit over the amplitude above which volts do not show what they were rounded from."""
_SINGULAR = 1e-6
"""Share of the largest eigenvalue below which columns do not determine a direction: a thousandth of its size."""


@dataclass(frozen=True)
class DriveFit:
    """How a recorded drive relates to the one that was meant.

    gain; offset [V]; late [s]; pace: how many times as fast it runs; unexplained: part of the drive's root mean square
    that is left; amplitude [V]: half of the span of the drive that was meant; smooth: it does not jump; fitted (ns,)
    [V]: the drive that was meant, with all of these.
    """

    gain: float
    offset: float
    late: float
    pace: float
    unexplained: float
    amplitude: float
    smooth: bool
    fitted: Floats

    def meant(self, signal: Waveform, rest: float, time: Floats, step: float) -> Floats:
        """Volts (nt,) of the drive that was meant, with all of these, at times [s] of a record with this step."""
        return self.gain * _meant(signal, rest, step, self.pace * time - self.late) + self.offset

    def unrounded(self, volts: Floats) -> Floats:
        """Volts (ns,) that were recorded, or what they were before they were rounded, where the fit says no more and no
        less than they do: a smooth drive of many digits, nowhere farther from it than rounding takes it."""
        digit = float(np.min(np.diff(np.unique(volts)), initial=np.inf))
        known = self.smooth and digit < _DIGIT * self.amplitude
        return self.fitted if known and np.all(np.abs(volts - self.fitted) < _ROUNDED * digit) else volts


@dataclass(frozen=True)
class _Case:
    """A record of volts (ns,) every ``step`` [s], the drive that was meant after ``rest`` [s], and samples of the
    running mean by which the two are compared, 1 for none."""

    volts: Floats
    step: float
    rest: float
    signal: Waveform
    running: int

    @property
    def time(self) -> Floats:
        """Times (ns,) from the beginning of the record [s]."""
        return self.step * np.arange(len(self.volts), dtype=np.float64)

    def meant(self, late: float, pace: float) -> Floats:
        """Volts that were meant, at the samples."""
        return _meant(self.signal, self.rest, self.step, pace * self.time - late)

    def averaged(self, values: Floats) -> Floats:
        """Running means (ns,)."""
        half = self.running // 2
        summed = np.cumsum(np.concatenate([[0.0], np.pad(values, half, mode="edge")]))
        return values if self.running == 1 else (summed[self.running :] - summed[: -self.running]) / self.running


def _meant(signal: Waveform, rest: float, step: float, time: Floats) -> Floats:
    """Volts of a drive that begins after a rest; a sample that a jump falls on, by rounding, is behind it."""
    since = time - rest + 1e-6 * step
    return np.where(since < 0.0, 0.0, signal.volts(np.maximum(since, 0.0)))


def fit_drive(volts: Floats, step: float, rest: float, signal: Waveform) -> DriveFit | None:
    """The best fit of a drive that was meant to recorded volts; None where it was meant to be 0 V.

    Parameters
    ----------
    volts
        Recorded (ns,) [V].
    step
        Between samples [s].
    rest
        Time before the drive begins [s].
    signal
        The drive that was meant, from its beginning.
    """
    meant = _Case(volts, step, rest, signal, 1).meant(0.0, 1.0)
    span = float(np.ptp(meant))
    if span == 0.0:
        return None
    jumps = jumps_of(meant)
    fast = int(np.count_nonzero(np.abs(np.diff(meant)) > _FAST * span)) > 2 * len(jumps)
    apart = int(np.min(np.diff(jumps), initial=len(volts)))
    running = max(2 * (min(_RUNNING, apart // 2) // 2) + 1, 1) if len(jumps) and not fast else 1
    case = _Case(volts, step, rest, signal, running)
    best = _refined(case, 0.0, 1.0)
    if best.unexplained <= _WELL:
        return best
    other = _refined(case, _most_alike(case), 1.0)
    return other if other.unexplained < _BETTER * best.unexplained else best


def _refined(case: _Case, late: float, pace: float) -> DriveFit:
    """Gauss-Newton from a start, as long as less is left at each step.

    Whole steps: where edges are compared what is left is no smooth function of their place, and the damped descent of
    `tarsus.fit` ends next to the least (a slow square that is 2 % fast: 1.9 samples away)."""
    recorded, length, half = case.averaged(case.volts), float(case.time[-1]), 0.5 * case.step
    least, place = np.inf, (late, pace)
    for _ in range(_STEPS):
        meant = case.averaged(case.meant(late, pace))
        # a sample between both: a jump then moves by one in every case
        slope = case.averaged(case.meant(late - half, pace) - case.meant(late + half, pace)) / case.step
        columns = np.column_stack([meant, np.ones_like(meant), -slope, slope * case.time / length])
        found, own, seen = _least_squares(columns, recorded), meant - meant.mean(), recorded - recorded.mean()
        left = float(seen @ seen - (own @ seen) ** 2 / max(float(own @ own), 1e-300))
        if left >= least or abs(found[0]) < 1e-9:
            break
        least, place = left, (late, pace)
        move = found[2:] / found[0]
        late, pace = late + float(move[0]), pace + float(move[1]) / length
        if not 1.0 / _FASTEST < pace < _FASTEST:
            break
        if float(np.max(np.abs(move))) < _SETTLED * case.step:
            place = late, pace
            break
    return _judged(case, *place)


def _least_squares(columns: Floats, values: Floats) -> Floats:
    """Coefficients of columns (n, p) in values (n,); what the columns do not determine is 0."""
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    scaled = columns / size
    return np.linalg.pinv(scaled.T @ scaled, _SINGULAR, hermitian=True) @ (scaled.T @ values) / size


def _judged(case: _Case, late: float, pace: float) -> DriveFit:
    """Size and offset at a place in time, and what is left, without the samples next to jumps."""
    meant = case.meant(late, pace)
    away = np.ones(len(meant), dtype=bool)
    if case.running > 1:
        half = case.running // 2
        for jump in jumps_of(meant):
            away[max(jump - half + 1, 0) : jump + half + 1] = False
        away |= np.mean(away) < _AWAY
    m, v = meant[away], case.volts[away]
    gain, offset = _least_squares(np.column_stack([m, np.ones_like(m)]), v).tolist()
    size = abs(gain) * float(np.std(m))
    unexplained = float(np.std(v - gain * m)) / size if size > 0.0 else np.inf
    smooth = case.running == 1
    return DriveFit(gain, offset, late, pace, unexplained, 0.5 * float(np.ptp(meant)), smooth, gain * meant + offset)


def _most_alike(case: _Case) -> float:
    """Delay [s] at which both are most alike."""
    from scipy.signal import correlate

    meant = case.meant(0.0, 1.0)
    alike = correlate(case.volts - np.mean(case.volts), meant - np.mean(meant), "full", "fft")
    return case.step * float(np.argmax(np.abs(alike)) - (len(meant) - 1))


def stated_length(signal: Waveform) -> float:
    """Time [s] that a drive takes to do all it does: its period, or until its last value is held."""
    track = signal.track()
    held = not track.periodic and bool(track.first[-1] == track.last[-1])
    return float(track.start[-2 if held else -1])


def drive_faults(fit: DriveFit, step: float, length: float, rest: float, swept: bool) -> list[str]:
    """Sentences on a drive that is not the one that was meant.

    Parameters
    ----------
    fit
        From `fit_drive`.
    step, length, rest
        Between samples, of the record, and before the drive begins [s].
    swept
        Whether responses are divided by what was recorded, so that its size does not matter.
    """
    if fit.unexplained > (_SHAPE_OF_SWEEPS if swept else _SHAPE):
        return [
            "the drive is not the one that the campaign states "
            f"({100.0 * min(fit.unexplained, 1.0):.0f} % of it differs, whatever its size and delay): is the sampling "
            f"rate of {1.0 / step:.6g} Hz right?"
        ]
    faults = []
    if not swept and abs(fit.gain - 1.0) > _GAIN:
        word = "its sign, unit or scale" if fit.gain < 0.0 else "its unit or scale"
        faults.append(f"the drive is {fit.gain:.3g} times the one that the campaign states: is {word} right?")
    if not swept and abs(fit.offset) > _OFFSET * fit.amplitude:
        faults.append(f"the drive is {fit.offset:+.3g} V off the one that the campaign states: is its zero right?")
    if abs(fit.pace - 1.0) > max(_PACE, _DRIFT * step / length):
        faults.append(
            f"the drive runs {fit.pace:.5g} times as fast as the campaign states: is the sampling rate of "
            f"{1.0 / step:.6g} Hz right, and not {1.0 / (step * fit.pace):.5g} Hz?"
        )
    if abs(fit.late) > _LATE * step:
        word = "late" if fit.late > 0.0 else "early"
        faults.append(
            f"the drive comes {1e3 * abs(fit.late):.3g} ms {word} ({abs(fit.late) / step:.3g} samples): is the rest of "
            f"{1e3 * rest:.4g} ms before it stated rightly, and is its channel recorded together with the others?"
        )
    return faults


def cut_short(record: float, rest: float, step: float, signal: Waveform) -> str | None:
    """A sentence if a record [s] ends before the drive that was meant has done all it does."""
    needed, lasts = stated_length(signal), record - rest
    if lasts >= needed - max(_LATE * step, _CUT * needed):
        return None
    if lasts <= 0.0:
        return f"the record lasts {record:.4g} s, and the rest before the drive that the campaign states {rest:.4g} s"
    return (
        f"the record ends {lasts:.4g} s after the drive begins, and the drive that the campaign states takes "
        f"{needed:.4g} s: is the file cut short?"
    )
