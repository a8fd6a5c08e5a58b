"""Sweeps of one device: which records agree with most of them, and what is wrong with each of the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeVar

import numpy as np

from tarsus.base.arrays import Complexes
from tarsus.base.errors import InputError
from tarsus.modes.frf import estimate_frf
from tarsus.records.excluded import Excluded
from tarsus.records.measurement import Measurement, Quantity

Kind = TypeVar("Kind")

_MOTIONS = (Quantity.VELOCITY, Quantity.DISPLACEMENT, Quantity.ACCELERATION)
_GAIN = 0.15
"""Deviation of the common factor from 1: repeats differ by a few percent, and wrong units and ranges by more."""
_SHAPE = 0.3
"""What responses of two sweeps may differ in: their common factor from 1, and the part of them that no factor
explains."""
_SHARED = 0.2
"""Spread of the factors of all channels up to which the drive, which they share, is the cause."""
_SMOOTHED = 0.04
"""Part of the band over which responses are averaged before they are compared."""


@dataclass(frozen=True)
class Agreed:
    """Records that agree, their drive and the channels of the points, and those left out with reasons."""

    records: tuple[Measurement, ...]
    drive: str
    channels: tuple[str, ...]
    left_out: tuple[Excluded, ...]


def agreeing(records: Sequence[Measurement], points: Sequence[str], band: tuple[float, float]) -> Agreed:
    """Records that have the points and a drive, are sampled alike and show the same responses, as most of them do.

    Parameters
    ----------
    records
        Sweeps of one device.
    points
        Names of the points that need a channel each, all of one quantity.
    band
        Lowest and highest frequency [Hz] that is compared.

    Raises
    ------
    InputError
        If no majority agrees.
    """
    kept, layout, out = sampled_alike(records, points)
    drive, channels = layout[0], layout[1:]
    spectra: dict[int, Complexes] = {}
    for k in kept:
        try:
            spectra[k] = _smoothed(estimate_frf([records[k]], [drive], channels, band).values[:, 0])
        except InputError as error:
            out += [Excluded(records[k].source, "", said) for said in error.problems]
    if not spectra:
        raise InputError([str(one) for one in out])
    group = _majority(spectra, records)
    common = np.mean([spectra[k] for k in group], axis=0)
    for k in sorted(set(spectra) - set(group)):
        channel, said = _cause(spectra[k], common, channels, drive)
        out.append(Excluded(records[k].source, channel, said))
    return Agreed(tuple(records[k] for k in group), drive, tuple(channels), tuple(out))


def _smoothed(responses: Complexes) -> Complexes:
    """Running means of responses (no, nf) over part of the band.

    Harmonics of a drive that is not quite linear meet a mode at another time in each sweep: they turn fast over the
    lines, and average out, while the response to the drive itself stays.
    """
    from scipy.signal import fftconvolve

    weights = np.hanning(max(int(_SMOOTHED * responses.shape[1]), 1) + 2)[None]
    return np.asarray(fftconvolve(responses, weights / weights.sum(), "valid", axes=1), dtype=np.complex128)


def sampled_alike(
    records: Sequence[Measurement], points: Sequence[str]
) -> tuple[list[int], tuple[str, ...], list[Excluded]]:
    """Numbers of the records with the drive, channels and sampling that most have; drive and channels; the others.

    Raises
    ------
    InputError
        If no record has the points and a drive, or no majority agrees.
    """
    out: list[Excluded] = []
    layouts: dict[int, tuple[str, ...]] = {}
    for k, record in enumerate(records):
        channels = _channels_of(record, points)
        if record.drive is None:
            out.append(Excluded(record.source, "", "the drive is missing: no channel is known to be it"))
        elif channels is None:
            needed = f"the points {', '.join(points)} need a channel each, all of one quantity"
            out.append(Excluded(record.source, "", needed))
        else:
            layouts[k] = (record.drive, *channels)
    if not layouts:
        raise InputError([str(one) for one in out])
    layout = _most(layouts, records, "have different channels")
    own = {k: (records[k].count, round(records[k].rate, 6)) for k in layouts if layouts[k] == layout}
    count, rate = _most(own, records, "have different lengths or sampling rates", ": repeat one of them")
    for k, names in layouts.items():
        if names != layout:
            said = f"its channels {', '.join(names)} are not those of most sweeps: {', '.join(layout)}"
        elif own[k] != (count, rate):
            said = f"it has {own[k][0]} samples at {own[k][1]:g} Hz, most sweeps {count} at {rate:g} Hz: they must be "
            said += "sampled alike"
        else:
            continue
        out.append(Excluded(records[k].source, "", said))
    return [k for k, found in own.items() if found == (count, rate)], layout, out


def _channels_of(record: Measurement, points: Sequence[str]) -> tuple[str, ...] | None:
    """Names of the channels of all points, of one quantity, or None."""
    for quantity in _MOTIONS:
        by_point = {c.at: c.name for c in record.channels if c.quantity is quantity}
        if all(point in by_point for point in points):
            return tuple(by_point[point] for point in points)
    return None


def _most(found: Mapping[int, Kind], records: Sequence[Measurement], what: str, cure: str = "") -> Kind:
    """What more than half of the records have."""
    value, times = Counter(found.values()).most_common(1)[0]
    if 2 * times <= len(found):
        raise InputError(f"{_named(found, records)} {what}, and no more than half of them agree{cure}")
    return value


def _majority(spectra: Mapping[int, Complexes], records: Sequence[Measurement]) -> list[int]:
    """Numbers of the records whose responses are those of more than half of them."""
    friends = {
        a: [b for b in spectra if _agree(spectra[a], spectra[b]) and _agree(spectra[b], spectra[a])] for a in spectra
    }
    best = max(friends, key=lambda k: len(friends[k]))
    if 2 * len(friends[best]) <= len(spectra):
        raise InputError(
            f"{_named(spectra, records)} show different responses, and no more than half of them agree: are they of "
            "one device, with the same units and channels?"
        )
    return sorted(friends[best])


def _named(numbers: Mapping[int, object], records: Sequence[Measurement]) -> str:
    return ", ".join(records[k].source for k in numbers)


def _factor(seen: Complexes, common: Complexes) -> tuple[complex, float]:
    """Factor that takes one response (nf,) to another, and the part of this that it does not explain."""
    power = float(np.vdot(common, common).real)
    if power == 0.0 or not np.any(seen):
        return 0.0, 1.0
    factor = complex(np.vdot(common, seen) / power)
    left = seen - factor * common
    return factor, float(np.linalg.norm(left) / np.linalg.norm(seen))


def _agree(seen: Complexes, common: Complexes) -> bool:
    """Whether responses (no, nf) are the same channel by channel."""
    return all(alike(one, other) for one, other in zip(seen, common, strict=True))


def alike(seen: Complexes, common: Complexes) -> bool:
    """Whether two responses (nf,) are the same, up to what repeats of one measurement differ in."""
    factor, left = _factor(seen, common)
    return left < _SHAPE and abs(factor - 1.0) < _GAIN


def _cause(seen: Complexes, common: Complexes, channels: Sequence[str], drive: str) -> tuple[str, str]:
    """Channel ("" for all) and what is wrong with a record's responses (no, nf), compared with the common ones."""
    found = [_factor(one, other) for one, other in zip(seen, common, strict=True)]
    off = [k for k, (one, other) in enumerate(zip(seen, common, strict=True)) if not alike(one, other)]
    for a, b in combinations(range(len(channels)), 2):
        order = list(range(len(channels)))
        order[a], order[b] = order[b], order[a]
        if _agree(seen[order], common):
            return ("", f"channels '{channels[a]}' and '{channels[b]}' look swapped: the other sweeps have them so")
    factors = np.array([factor for factor, _ in found])
    scaled = all(left < _SHAPE for _, left in found)
    if scaled and len(off) > 1 and np.max(np.abs(factors - factors.mean())) < _SHARED * abs(factors.mean()):
        return drive, (
            f"all responses are {_size(factors.mean())} times those of the other sweeps: are unit, scale and sign of "
            "the drive right?"
        )
    if len(off) == 1 and found[off[0]][1] < _SHAPE:
        return channels[off[0]], (
            f"it is {_size(found[off[0]][0])} times what the other sweeps show: are its unit, scale and sign right?"
        )
    if len(off) == 1:
        return channels[off[0]], "it does not respond to the drive as in the other sweeps"
    return "", "its responses are not those of the other sweeps: is it of this device, and of this drive?"


def _size(factor: complex) -> str:
    """A factor in words, with its sign."""
    return f"{np.copysign(abs(factor), factor.real):.3g}"
