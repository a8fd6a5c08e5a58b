"""Units as instruments write them: text in, quantity and SI factor out."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.units import Unit, parse_unit


class Scaled(NamedTuple):
    """A quantity and the factor that brings its numbers to SI."""

    quantity: Quantity
    factor: float


_INCHES = {"inch": "in", "inches": "in", "foot": "ft", "feet": "ft"}
_SMALL = {"v": "V", "mv": "mV", "uv": "uV", "kv": "kV", "ma": "mA", "ua": "uA"}
"""Symbols that some instruments write in small letters, where no other unit can be meant."""
_GRAVITY = 9.80665
"""Standard gravity [m/s^2], by definition."""
_MOTIONS = (Quantity.DISPLACEMENT, Quantity.VELOCITY, Quantity.ACCELERATION)
_POUND_FORCE = 4.4482216152605
"""Newtons of a pound-force, by definition."""
_IMPERIAL = {
    "lbf": (Quantity.FORCE, _POUND_FORCE),
    "mil": (Quantity.DISPLACEMENT, 2.54e-5),
    "in": (Quantity.DISPLACEMENT, 0.0254),
    "in/s": (Quantity.VELOCITY, 0.0254),
    "ips": (Quantity.VELOCITY, 0.0254),
    "in/s^2": (Quantity.ACCELERATION, 0.0254),
    "ft": (Quantity.DISPLACEMENT, 0.3048),
    "ft/s": (Quantity.VELOCITY, 0.3048),
    "ft/s^2": (Quantity.ACCELERATION, 0.3048),
}
"""Factors of units outside SI, by definition."""
_GRAVITIES = {"g", "gn", "g_n", "g0"}


def scaled(text: str) -> Scaled | None:
    """Quantity and SI factor of a unit, or None if it is no unit of a known quantity.

    ``g`` alone is the standard gravity, as accelerometers mean it, and not the gram.
    """
    plain = _plain(text)
    if plain.lower() in _GRAVITIES:
        return Scaled(Quantity.ACCELERATION, _GRAVITY)
    imperial = _IMPERIAL.get(re.sub("sec$", "s", plain.replace(" ", "").lower()))
    if imperial is not None:
        return Scaled(*imperial)
    given = _given(plain)
    if given is None:
        return None
    same = (one for one in Quantity if given.dimension == parse_unit(one.unit).dimension)
    return next((Scaled(one, _scale(given)) for one in same), None)


def ratio_of(text: str) -> tuple[Scaled, Scaled] | None:
    """Output and input of the unit of a frequency response, such as ``m/s^2/N``; None if it is no such unit."""
    plain = _plain(text)
    for place in reversed([match.start() for match in re.finditer("/", plain)]):
        output, source = scaled(plain[:place]), scaled(plain[place + 1 :])
        if output is not None and source is not None:
            return output, source
    for output in _MOTIONS if _given(plain) else ():  # such as (1/N)*(m/s^2), or kg^-1
        for source in (Quantity.FORCE, Quantity.VOLTAGE):
            factor = _factor(plain, f"{output.unit}/{source.unit}")
            if factor is not None:
                return Scaled(output, factor), Scaled(source, 1.0)
    return None


def time_factor(text: str) -> float | None:
    """SI factor of a unit of time, or None; ``S`` alone, which some oscilloscopes write, is the second. What a time
    counts from, as in ``days since 2026-01-01``, is no part of it."""
    plain = _plain(re.sub(r"\s+since\b.*", "", text))
    if plain.lower() in ("d", "day", "days"):
        return 86400.0
    return _factor("s" if plain == "S" else plain, "s")


def frequency_factor(text: str) -> float | None:
    """Factor that brings a unit of frequency, or ``rad/s``, to Hz; None for others."""
    plain = _plain(text)
    return 0.5 / math.pi if plain.replace(" ", "") == "rad/s" else _factor(plain, "Hz")


def _plain(text: str) -> str:
    """A unit in the spelling of `tarsus.base.units`: no brackets, small letters mended, ``s2`` as ``s^2``."""
    plain = re.sub(r"[\[\]()]", " ", text).replace("\N{DEGREE SIGN}", "deg").strip()
    plain = _SMALL.get(plain, plain)
    plain = re.sub(r"[A-Za-z]+", lambda m: _INCHES.get(m[0].lower(), m[0]), plain)
    return re.sub(r"(?<=[A-Za-z])([23])(?!\d)", r"^\1", plain)


def _given(plain: str) -> Unit | None:
    """A unit as it is written; None of no text, and of one that is none."""
    if not plain:
        return None
    try:
        return parse_unit(plain)
    except InputError:
        return None


def _scale(given: Unit) -> float:
    return given.scale * 10.0**given.exponent


def _factor(plain: str, unit: str) -> float | None:
    given = _given(plain)
    return _scale(given) if given is not None and given.dimension == parse_unit(unit).dimension else None
