"""Unit strings at the edge: ``"70 um"`` in, SI floats inside.

A quantity is a number and a product of unit factors, such as ``"1.747e-15 uN m^2 s"`` or
``"3 N/V"``.  Factors are separated by a space, ``*`` or ``·``; ``/`` divides by the one factor after it;
powers are written ``m^2``, ``m**2``, ``m²`` or, as in CF, ``s-1``.  Units may be words: ``"5 milliseconds"``,
``"3 microns/s"``, ``"meters per second"``.  Decimal prefixes shift the decimal exponent of the number as text, so
``"70 um"`` is exactly the float ``70e-6``.
"""

from __future__ import annotations

import difflib
import math
import re
from decimal import Decimal
from functools import lru_cache
from typing import NamedTuple

from tarsus.base.errors import InputError, InputProblem

Dimension = tuple[int, int, int, int, int, int]
"""Integer powers of kg, m, s, A, rad and K (angles are kept apart so that Hz and rad/s cannot be mixed up)."""


class Unit(NamedTuple):
    """A parsed unit: SI value of one of it is ``scale * 10**exponent``."""

    exponent: int
    scale: float
    dimension: Dimension


_PREFIXES = {"a": -18, "f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}
"""Powers of ten of the SI's prefixes that these devices use; da, h and d are left to other trades."""
_PREFIXES |= {"\N{MICRO SIGN}": -6, "\N{GREEK SMALL LETTER MU}": -6}

_PREFIXABLE: dict[str, Unit] = {
    "m": Unit(0, 1.0, (0, 1, 0, 0, 0, 0)),
    "g": Unit(-3, 1.0, (1, 0, 0, 0, 0, 0)),
    "s": Unit(0, 1.0, (0, 0, 1, 0, 0, 0)),
    "A": Unit(0, 1.0, (0, 0, 0, 1, 0, 0)),
    "rad": Unit(0, 1.0, (0, 0, 0, 0, 1, 0)),
    "Hz": Unit(0, 1.0, (0, 0, -1, 0, 0, 0)),
    "N": Unit(0, 1.0, (1, 1, -2, 0, 0, 0)),
    "J": Unit(0, 1.0, (1, 2, -2, 0, 0, 0)),
    "W": Unit(0, 1.0, (1, 2, -3, 0, 0, 0)),
    "Pa": Unit(0, 1.0, (1, -1, -2, 0, 0, 0)),
    "V": Unit(0, 1.0, (1, 2, -3, -1, 0, 0)),
    "C": Unit(0, 1.0, (0, 0, 1, 1, 0, 0)),
    "F": Unit(0, 1.0, (-1, -2, 4, 2, 0, 0)),
    "ohm": Unit(0, 1.0, (1, 2, -3, -2, 0, 0)),
}
"""Units that take a prefix, in base units by the SI: of mass the gram, which is 1e-3 of its base unit."""
_PLAIN: dict[str, Unit] = {
    "1": Unit(0, 1.0, (0, 0, 0, 0, 0, 0)),
    "%": Unit(-2, 1.0, (0, 0, 0, 0, 0, 0)),
    "K": Unit(0, 1.0, (0, 0, 0, 0, 0, 1)),
    "deg": Unit(0, math.pi / 180.0, (0, 0, 0, 0, 1, 0)),
    "min": Unit(0, 60.0, (0, 0, 1, 0, 0, 0)),
    "h": Unit(0, 3600.0, (0, 0, 1, 0, 0, 0)),
}
"""Units that take none."""
_WORDS = {
    "meter": "m",
    "metre": "m",
    "gram": "g",
    "gramme": "g",
    "second": "s",
    "sec": "s",
    "ampere": "A",
    "amp": "A",
    "radian": "rad",
    "hertz": "Hz",
    "newton": "N",
    "joule": "J",
    "watt": "W",
    "pascal": "Pa",
    "volt": "V",
    "coulomb": "C",
    "farad": "F",
    "ohm": "ohm",
    "kelvin": "K",
    "degree": "deg",
    "percent": "%",
    "micron": "um",
    "minute": "min",
    "hour": "h",
    "hr": "h",
    "sekunde": "s",
    "sekunden": "s",
}
"""Words for units, in any case, with an s for several."""
_PREFIX_WORDS = {
    "femto": "f",
    "pico": "p",
    "nano": "n",
    "micro": "u",
    "milli": "m",
    "centi": "c",
    "kilo": "k",
    "mega": "M",
    "giga": "G",
}

_NOUNS = {
    "1": "a pure number",
    "m": "a length",
    "kg": "a mass",
    "s": "a time",
    "A": "a current",
    "V": "a voltage",
    "V/s": "a rate of voltage",
    "rad": "an angle",
    "Hz": "a frequency",
    "rad/s": "an angular rate",
    "m/s": "a velocity",
    "m/s^2": "an acceleration",
    "N": "a force",
    "N/s": "a rate of force",
    "N/m": "a stiffness",
    "m/N": "a compliance",
    "N s/m": "a damping coefficient",
    "N/V": "a force per volt",
    "N/V^2": "a force per volt squared",
    "N/V^3": "a force per volt cubed",
    "N m": "an energy",
    "N m/rad": "a torsional stiffness",
    "N m^2": "a bending stiffness",
    "N m^2 s": "a film coefficient",
    "N m^2/V^2": "an electrostatic coefficient",
    "kg/m": "a mass per length",
    "kg/m^3": "a density",
    "kg m^2": "a moment of inertia",
    "W": "a power",
    "Pa": "a pressure",
    "C": "a charge",
    "F": "a capacitance",
    "ohm": "a resistance",
    "m^2": "an area",
    "m^3": "a volume",
    "K": "a temperature",
    "1/K": "a change per kelvin",
}

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def _symbol(name: str) -> str:
    """Symbol of a unit that is written as a word, such as ``milliseconds``, ``msec`` or ``hz``; else the name."""
    plain = name.lower()
    word = next((plain[:-k] if k else plain for k in (0, 1) if (plain[:-k] if k else plain) in _WORDS), "")
    if word and (plain == word or plain.endswith("s")):
        return _WORDS[word]
    for prefix, letter in _PREFIX_WORDS.items():
        rest = _WORDS.get(plain.removeprefix(prefix).removesuffix("s"), "")
        if plain.startswith(prefix) and rest in _PREFIXABLE:
            return letter + rest
    if plain[1:] in ("sec", "secs") and name[0] in _PREFIXES:
        return f"{name[0]}s"
    return {"hz": "Hz", "khz": "kHz", "ghz": "GHz"}.get(plain, name)  # mhz may be either of two


def _simple_unit(given: str) -> Unit:
    if re.match(r",\d", given):
        raise InputError("decimals begin with a point, not with a comma")
    name = given if given in _PLAIN or given in _PREFIXABLE else _symbol(given)
    if name in _PLAIN:
        return _PLAIN[name]
    if name in _PREFIXABLE:
        return _PREFIXABLE[name]
    prefix, rest = name[:1], name[1:]
    if prefix in _PREFIXES and rest in _PREFIXABLE:
        base = _PREFIXABLE[rest]
        return base._replace(exponent=base.exponent + _PREFIXES[prefix])
    near = difflib.get_close_matches(name, [*_PREFIXABLE, *_PLAIN, "kg", "um", "mm", "ms", "uN", "mg"], n=1, cutoff=0.5)
    raise InputError(f"unknown unit '{given}'" + (f", did you mean '{near[0]}'?" if near else ""))


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Parse a product of unit factors; raises `InputError` for an unknown one."""
    plain = re.sub(r"(?<=[^\W\d_])([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)", lambda m: "^" + m[1].translate(_SUPERSCRIPTS), text)
    plain = plain.replace("Ω", "ohm").replace("**", "^").replace("*", " ").replace("·", " ")
    plain = re.sub(r"(?<=[^\W\d_])(?=[+-]\d)", "^", plain)  # s-1, as CF writes it
    plain = re.sub(r"(?<=\w)\.(?=[^\W\d_])|(?<=[^\W\d_])-(?=[^\W\d_])", " ", plain)  # m.s-1, N-m
    plain = re.sub(r"\s*\^\s*", "^", plain).replace("/", " / ")
    plain = re.sub(r"(?<![^\s\d])per(?!\S)", "/", plain)
    exponent, scale, dimension, sign = 0, 1.0, [0] * 6, 1
    for token in plain.split():
        if token == "/":
            sign = -1
            continue
        name, caret, power_text = token.partition("^")
        if caret and not re.fullmatch(r"[+-]?\d+", power_text):
            raise InputError(f"unknown unit '{token}': a power is a whole number, as in m^2")
        power = sign * (int(power_text) if caret else 1)
        unit = _simple_unit(name)
        exponent += power * unit.exponent
        scale *= unit.scale**power
        dimension = [d + power * u for d, u in zip(dimension, unit.dimension, strict=True)]
        sign = 1
    kg, m, s, ampere, rad, kelvin = dimension
    return Unit(exponent, scale, (kg, m, s, ampere, rad, kelvin))


@lru_cache(maxsize=1)
def _noun_by_dimension() -> dict[Dimension, str]:
    return {parse_unit(unit).dimension: noun for unit, noun in _NOUNS.items()}


def si_unit(unit: str) -> str:
    """The SI unit of a unit's dimension, "m/s" for "mm/s"; raises `InputError` for a unit of no known quantity."""
    dimension = parse_unit(unit).dimension
    found = next((one for one in _NOUNS if parse_unit(one).dimension == dimension), None)
    if found is None:
        raise InputError(f"'{unit}' is the unit of no quantity that is known here")
    return found


def describe_unit(unit: str) -> str:
    """Physical words for an expected unit, such as ``"a length (m)"`` for ``"m"``."""
    noun = _noun_by_dimension().get(parse_unit(unit).dimension, "a quantity")
    return noun if unit == "1" else f"{noun} ({unit})"


def parse_quantity(text: str | float, unit: str) -> float:
    """SI value of a quantity that is expected in the SI unit ``unit``.

    Parameters
    ----------
    text
        ``"70 um"``, ``"25 %"``, or a plain number (or its text), which is taken as SI.
    unit
        Expected SI unit, such as ``"m"``, ``"N m^2 s"`` or ``"1"``.

    Returns
    -------
    float
        Value in ``unit``.

    Raises
    ------
    InputError
        If the text is no quantity, is not finite, or has another dimension than ``unit``.
    """
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        raise InputError(f"expected {describe_unit(unit)}, got {text!r}")
    if not isinstance(text, str):
        if not math.isfinite(text):
            raise InputError(f"expected {describe_unit(unit)} that is finite, got {text}")
        return float(text)
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise InputError(f"expected {describe_unit(unit)}, got '{text}', which is not a number with a unit")
    number, unit_text = match[1], match[2]
    if not unit_text:
        given = Unit(0, 1.0, parse_unit(unit).dimension)
    else:
        try:
            given = parse_unit(unit_text)
        except InputError as error:
            raise InputError(f"expected {describe_unit(unit)}, got '{text}': {error}") from None
    if given.dimension != parse_unit(unit).dimension:
        noun = _noun_by_dimension().get(given.dimension, "another kind of quantity")
        raise InputError(f"expected {describe_unit(unit)}, got '{text}', which is {noun}")
    try:
        value = float(Decimal(number).scaleb(given.exponent)) * given.scale
    except ArithmeticError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(f"expected {describe_unit(unit)} that is finite, got '{text}'")
    return value


def quantity_of(name: str, value: float | str, unit: str) -> float:
    """As `parse_quantity` of an argument, whose name stands before what is wrong."""
    try:
        return parse_quantity(value, unit)
    except InputError as error:
        raise InputError([InputProblem.at(name, one) for one in error.problems]) from None


@lru_cache(maxsize=256)
def _spellings(unit: str) -> tuple[tuple[int, str], ...]:
    """Ways to write a unit with one decimal prefix on its first factor: (exponent, text)."""
    first = re.match(r"[A-Za-z]+(?![\^A-Za-z])", unit)
    if first is None or parse_unit(unit).scale != 1.0:
        return ((0, unit),)
    name, rest = first[0], unit[first.end() :]
    base, shift = ("g", -3) if name == "kg" else (name, 0)
    if base not in _PREFIXABLE or base == "rad":
        return ((0, unit),)
    spellings = [(shift, base + rest), (0, unit)] if shift else [(0, unit)]
    spellings += [
        (power + shift, prefix + base + rest)
        for prefix, power in _PREFIXES.items()
        if prefix in ("fpnum" if shift else "fpnumkMG") and power + shift != 0
    ]
    return tuple(spellings)


def _number_text(value: Decimal) -> str:
    """Shortest plain text of a decimal that needs no exponent, else with one."""
    plain = format(value, "f")
    if "." in plain:
        plain = plain.rstrip("0").rstrip(".")
    short = repr(float(value)).removesuffix(".0")
    return short if len(short) < len(plain) and Decimal(short) == value else plain


TENTH = Decimal("0.1")
"""Least number that is written before a unit where another prefix would do."""


def format_quantity(value: float, unit: str) -> str:
    """Text such as ``"70 um"`` that `parse_quantity` reads back to exactly ``value``.

    The decimal prefix that gives the shortest text from 0.1 to 1000 is chosen, as people say it: ``"-744.687 nN/V"``,
    ``"0.5 s"``; digits are those of ``repr(value)``.

    Parameters
    ----------
    value
        SI value, finite.
    unit
        SI unit; ``"1"`` gives the bare number.
    """
    if unit == "1":
        return repr(float(value))
    if value == 0.0:
        return f"{'-' if math.copysign(1.0, value) < 0 else ''}0 {unit}"
    exact = Decimal(repr(float(value)))

    def candidate(exponent: int, text: str) -> tuple[tuple[bool, int, bool, int], str]:
        number = exact.scaleb(-exponent)
        whole = f"{_number_text(number)} {text}"
        size = abs(number)
        return (not TENTH <= size < 1000, len(whole), not 1 <= size < 1000, abs(exponent)), whole

    return min(candidate(exponent, text) for exponent, text in _spellings(unit))[1]


_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+")


def is_ambiguous(text: str) -> bool:
    """Whether the commas of a number may be of thousands, as that of ``1,208``: another program reads it so."""
    return _THOUSANDS.fullmatch(text) is not None


def is_number(text: str) -> bool:
    """Whether a text is a plain number, as `float` reads it."""
    try:
        float(text)
    except ValueError:
        return False
    return True
