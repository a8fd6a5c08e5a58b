"""Two records of the same signal brought to the same clock: delay to a fraction of a sample, gain, and zero; and
whether one explains the other well enough to be subtracted from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import convolve1d
from scipy.optimize import fminbound
from scipy.signal import correlate, correlation_lags, firwin, oaconvolve

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.records.measurement import Measurement, check_sampled_together

_TAPS = 32
"""Samples on either side that a delayed sample is made of."""

_BETA = 9.0
"""Of the Kaiser window on the taps: the delay is right to 1e-4 up to 80 % of half the sampling rate."""

_BAND = np.asarray(firwin(2 * _TAPS + 1, 0.6), dtype=float)
"""Low-pass in front of the search for the delay: near half the sampling rate a delay by half a sample takes noise away,
and the search would prefer it."""

_FLOOR = 1e-4
"""Share of the energy below which what is left counts as nothing: 1 % of the motion."""

_NEARLY = 2.0
"""Times the least that is left, in energy, within which another delay fits nearly as well: noise, and half a sample
of delay, change what is left by less."""

_APART = float(np.log(4.0))
"""Rise of what is left between two delays, as a logarithm, that makes them two: twice the residual."""

_NEAR = 3
"""Whole samples on either side that are tried on the way from the peak of the cross-correlation."""

RESIDUAL_LIMIT = 0.10
"""Largest root mean square residual over signal before contact that passes, all channels together [1]."""

GAIN_LIMIT = 0.05
"""Largest deviation from one that the gain of a channel may have [1]."""


@dataclass(frozen=True)
class Alignment:
    """How a reference record lies against another one, over the part of it that was compared.

    names: the nc channels compared; delay [s]: the reference runs behind by this much; gain (nc,): of the record over
    the reference; offset (nc,): zero of the record less that of the reference, in the channels' units; residual (nc,):
    root mean square of record less aligned reference (unit gain, offset taken out) over that of the record about its
    mean; noise (nc,): standard deviation of that difference, in the channels' units; other [s]: another delay that
    fits nearly as well, None where there is none.
    """

    names: tuple[str, ...]
    delay: float
    gain: Floats
    offset: Floats
    residual: Floats
    noise: Floats
    other: float | None = None

    @property
    def overall(self) -> float:
        """Residual of all channels together: root mean square of their residuals."""
        return float(np.sqrt(np.mean(self.residual**2)))


def delayed(values: Floats, samples: float) -> Floats:
    """Evenly sampled values (..., ns) as they would be ``samples`` later; a windowed sinc, exact for whole samples.

    Beyond the ends the first and last values are held; what comes from there is right to the first order only.
    """
    whole = int(np.floor(samples))
    part = samples - whole
    count = values.shape[-1]
    if part == 0.0:
        return np.asarray(values[..., np.clip(np.arange(count) - whole, 0, count - 1)], dtype=float)
    lag = np.arange(-_TAPS + 1, _TAPS + 1)
    taps = np.sinc(lag - part) * np.i0(_BETA * np.sqrt(1.0 - ((lag - part) / _TAPS) ** 2).clip(0.0)) / np.i0(_BETA)
    taps /= taps.sum()
    width = _TAPS + abs(whole)
    ends = [(0, 0)] * (values.ndim - 1) + [(width, width)]
    padded = np.pad(values, ends, mode="reflect", reflect_type="odd")  # through the end point, so that slopes go on
    first = abs(whole) - whole
    out = oaconvolve(padded, taps.reshape((1,) * (values.ndim - 1) + (-1,)), "valid", axes=-1)
    return np.asarray(out[..., first : first + count], dtype=float)


def align(
    record: Measurement, reference: Measurement, names: Sequence[str], before: float, search: float | None = None
) -> Alignment:
    """Delay, gain and zero of a reference against a record, from the part before ``before`` [s].

    The delay is one number for all channels: the most likely one, where each channel has a noise of its own. The
    reference's values after the delay are those of a windowed sinc, so that its noise stays white.

    Parameters
    ----------
    record, reference
        Sampled at the same step; where they differ in length the shorter counts.
    names
        Channels to compare.
    before
        End of the part compared [s], on the record's clock: what happens later (a contact) does not count.
    search
        Largest delay looked for [s] in either direction; a quarter of the part compared by default.

    Raises
    ------
    InputError
        If the records do not belong together, or the part is too short or silent.
    """
    names = tuple(names)
    check_sampled_together(record, reference, names)
    span = int(np.floor((before - record.start) / record.step + 1e-9)) + 1
    span = min(span, record.count, reference.count)
    if span < 8 * _TAPS:
        raise InputError(
            f"{max(span, 0)} samples lie before {before:g} s: aligning two records takes at least {8 * _TAPS}"
        )
    ours = np.array([record[name][:span] for name in names])
    theirs = np.array([reference[name] for name in names])
    _refuse_silent(names, ours)
    _refuse_silent(names, theirs[:, :span], "in the reference record")
    reach = span // 4 if search is None else min(int(np.ceil(search / record.step)), span // 2)
    coarse, other = _whole_delays(ours, theirs[:, :span], reach)
    edge = 3 * _TAPS + abs(coarse)
    inner = slice(edge, span - edge)
    if span - 2 * edge < _TAPS:
        raise InputError(
            f"the records are {abs(coarse)} samples apart, too far for the {span} samples before {before:g} s"
        )
    scale = np.std(ours[:, inner], axis=1)
    ours_low, theirs_low = (convolve1d(v, _BAND, axis=1, mode="nearest") for v in (ours, theirs))

    def cost(samples: float) -> float:
        left = _misfit(ours_low, theirs_low, samples, inner)[0].std(axis=1) / scale
        return float(np.sum(np.log(left + 1e-9)))  # the likelihood where each channel has a noise of its own

    whole = coarse
    while (near := min(range(whole - _NEAR, whole + _NEAR + 1), key=cost)) != whole and abs(near - coarse) < _TAPS:
        whole = near
    samples, *_ = fminbound(cost, whole - 1.0, whole + 1.0, xtol=1e-5, full_output=True)
    difference, gain = _misfit(ours, theirs, float(samples), inner)
    plain = ours[:, inner] - delayed(theirs, float(samples))[:, inner]
    return Alignment(
        names,
        delay=float(samples) * -record.step,
        gain=gain,
        offset=plain.mean(axis=1),
        residual=plain.std(axis=1) / scale,
        noise=np.sqrt(np.sum(difference**2, axis=1) / (difference.shape[1] - 2)),
        other=None if other is None else other * -record.step,
    )


def _refuse_silent(names: Sequence[str], values: Floats, where: str = "before the first contact") -> None:
    silent = [name for name, row in zip(names, values, strict=True) if np.ptp(row) == 0.0]
    if silent:
        raise InputError([f"channel '{name}' is constant {where}: there is nothing to align by" for name in silent])


def _whole_delays(ours: Floats, theirs: Floats, reach: int) -> tuple[int, int | None]:
    """Whole samples by which the reference is best delayed, and another such delay that fits nearly as well, if any.

    Each channel's correlation over the part that overlaps, by the energy of both in that part: a motion that grows or
    decays would otherwise prefer a false period of the drive, where there is less of it. Of delays that fit alike the
    smallest is taken.
    """
    a, b = (v - v.mean(axis=1, keepdims=True) for v in (ours, theirs))
    count = a.shape[1]
    lags = correlation_lags(count, count)
    lags = lags[np.abs(lags) <= reach]
    first, last = np.maximum(lags, 0), count + np.minimum(lags, 0)
    left = np.zeros(len(lags))
    for x, y in zip(a, b, strict=True):
        energy_x, energy_y = (np.concatenate([[0.0], np.cumsum(v**2)]) for v in (x, y))
        local = (energy_x[last] - energy_x[first]) * (energy_y[last - lags] - energy_y[first - lags])
        product = correlate(x, y, method="fft")[count - 1 + lags]
        share = product / np.sqrt(np.maximum(local, 1e-12 * energy_x[-1] * energy_y[-1]))
        left += np.log((1.0 - np.minimum(share, 1.0)).clip(_FLOOR)) / len(a)
    dips = np.flatnonzero(
        (left <= np.concatenate([[np.inf], left[:-1]])) & (left <= np.concatenate([left[1:], [np.inf]]))
    )
    near = dips[left[dips] <= left.min() + np.log(_NEARLY)]
    chosen = int(near[np.argmin(np.abs(lags[near]))])
    # another dip is not noise along the same trough where what is left rises to twice as much in between
    others = [k for k in near.tolist() if left[min(k, chosen) : max(k, chosen) + 1].max() > left[near].max() + _APART]
    other = min(others, key=lambda k: left[k], default=None)
    return int(lags[chosen]), None if other is None else int(lags[other])


def _misfit(ours: Floats, theirs: Floats, samples: float, inner: slice) -> tuple[Floats, Floats]:
    """What is left of the record (nc, k) with the delayed reference's best gain and offset taken out; the gains."""
    shifted = delayed(theirs, samples)[:, inner]
    x = ours[:, inner] - ours[:, inner].mean(axis=1, keepdims=True)
    y = shifted - shifted.mean(axis=1, keepdims=True)
    gain = np.sum(x * y, axis=1) / np.sum(y * y, axis=1)
    return x - gain[:, None] * y, gain


def residual_gate(
    alignment: Alignment, residual_limit: float = RESIDUAL_LIMIT, gain_limit: float = GAIN_LIMIT
) -> tuple[str, ...]:
    """Why a repeat must not be used, by what the aligned in-air record leaves of it before the first contact; no
    sentence where it may.

    A gain other than one means that drive, structure or instrument changed between the records: the subtraction (3.27)
    has no gain, so such a pair is refused rather than mended.
    """
    reasons = []
    if not alignment.overall <= residual_limit:
        worst = int(np.argmax(alignment.residual))
        reasons.append(
            f"The repeat is rejected: before contact {alignment.overall:.1%} of the signal is left after subtraction, "
            f"above the limit of {residual_limit:.0%}; the worst channel is '{alignment.names[worst]}' with "
            f"{alignment.residual[worst]:.1%}."
        )
    if alignment.other is not None:
        reasons.append(
            "The repeat is rejected: the in-air record fits nearly as well delayed by "
            f"{1e3 * alignment.other:.4g} ms as by {1e3 * alignment.delay:.4g} ms, a period of the drive apart "
            "perhaps; give a part that is not periodic, or a narrower search."
        )
    for name, gain in zip(alignment.names, alignment.gain, strict=True):
        if not abs(gain - 1.0) <= gain_limit:
            reasons.append(
                f"The repeat is rejected: channel '{name}' has a gain of {gain:.3f} against the in-air record, which "
                f"differs from one by more than {gain_limit:.0%}."
            )
    return tuple(reasons)


def subtract(record: Measurement, reference: Measurement, alignment: Alignment) -> Measurement:
    """The record less the aligned reference, (3.27) as the formula has it: near the ground less in the air.

    The gain stays one, since the formula has none; the difference of the zeros is taken out. The channels are those of
    the alignment; their noise is that of both records together. The record keeps its clock and its impacts; only the
    reference, which has none, is resampled.
    """
    check_sampled_together(record, reference, alignment.names)
    count = min(record.count, reference.count)
    shift = -alignment.delay / record.step
    channels, rows = [], []
    for i, name in enumerate(alignment.names):
        channel = record.channel(name)
        channels.append(replace(channel, noise=float(alignment.noise[i]) or None, full_scale=None))
        rows.append(record[name][:count] - delayed(reference[name], shift)[:count] - alignment.offset[i])
    return Measurement(
        tuple(channels), np.array(rows), record.step, record.start, f"{record.source} less {reference.source}"
    )
