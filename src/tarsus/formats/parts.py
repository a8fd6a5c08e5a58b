"""Complex responses from two series of real numbers: real and imaginary part, or amplitude and phase."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.formats.raw import RawSeries, Role

_DECIBEL = re.compile(r"(?:^|[^A-Za-z])dB(?![A-Za-z])")
_REFERENCE = re.compile(r"^\W*dB\W*(?:re\.?|rel\.?)?\s*:?\s*(?:1\s+)?(.*?)\W*$", re.I)


class Amplitude(NamedTuple):
    """Amplitudes, and the unit they are in, as written."""

    values: NDArray[np.float64]
    unit: str


def amplitude_of(series: RawSeries) -> Amplitude:
    """Amplitudes of a series. Decibels, by unit or name, are of the amplitude, with 1 in their unit at 0 dB."""
    values = np.asarray(series.values, dtype=float)
    if not (is_decibel(series.unit) or is_decibel(series.name)):
        return Amplitude(values, series.unit)
    match = _REFERENCE.match(series.unit)
    return Amplitude(10.0 ** (values / 20.0), match[1] if match else "")


def is_decibel(text: str) -> bool:
    """Whether a unit or a name says decibels."""
    return _DECIBEL.search(text) is not None


def phase_factor(unit: str, name: str = "") -> float | None:
    """Factor of a phase to rad, from its unit or else from its name, such as ``phase_deg``; None if neither has it."""
    plain = unit.strip("[]() ").lower()
    if not plain:
        units = re.findall(r"(?<![a-z])(deg|rad)(?![a-z])", name.lower())
        plain = units[0] if len(units) == 1 else ""
    if plain in ("deg", "degree", "degrees", "\N{DEGREE SIGN}"):
        return float(np.pi / 180.0)
    return 1.0 if plain in ("rad", "radian", "radians") else None


def joined(first: RawSeries, second: RawSeries, factor: float | None) -> RawSeries:
    """One response of two series: amplitude and phase, which ``factor`` brings to rad, or real and imaginary part."""
    if factor is None:
        return replace(first, values=first.values + 1.0j * second.values, role=Role.RESPONSE)
    size = amplitude_of(first)
    values = size.values * np.exp(1.0j * factor * second.values)
    return replace(first, values=values, unit=size.unit, role=Role.RESPONSE)
