"""Numbers with units as people read them: every page, figure, notebook and console shows its numbers by these.

What is read back by the program is written by `tarsus.base.units.format_quantity`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

MISSING = "–"
"""Shown where a value does not exist."""

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_BEARS = re.compile(r"(?:s|m|N|J|V|A|Hz|W|Pa|C|F|g|kg|ohm)(?![\^A-Za-z])")
"""A unit whose first factor may bear a prefix: powers of one, angles, pure numbers and prefixed units do not."""


def number(value: float | None, digits: int = 4) -> str:
    """A number for reading; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    shown = f"{value:.{digits}g}"
    if "e+" in shown and abs(value) < 1e5:
        shown = f"{float(shown):.0f}"
    return set_power(shown)


def set_power(shown: str) -> str:
    """The text of a number with a minus sign and a power of ten set as such: "1.7e-21" -> "1.7·10⁻²¹"."""
    mantissa, _, power = shown.partition("e")
    return f"{mantissa}·10{_superscript(int(power))}".replace("-", "−") if power else shown.replace("-", "−")


def amount(value: float | None, unit: str, digits: int = 4) -> str:
    """A value with its unit under an engineering prefix, e.g. "264.1 µm" or "−137.1 nN/V"; unit "1" or "" is not shown.

    What no prefix brings between 1 and 1000 has a power of ten; where there is no value stands a dash. A unit that
    bears a prefix already ("um") stays; a value in "%" is a fraction of 1.
    """
    if unit == "%":
        return percent(value, digits)
    if value is None or unit in ("1", "", "-") or not math.isfinite(value):
        return number(value, digits)
    step, label = prefixed(value, unit, digits)
    shown = value if step == 1.0 else float(f"{value / step:.{digits}g}")
    return f"{number(shown, digits)} {label}"


def percent(fraction: float | None, digits: int = 3) -> str:
    """A fraction of 1 in percent: 0.0941 -> "9.41 %"."""
    if fraction is None or not math.isfinite(fraction):
        return MISSING
    return f"{number(100.0 * fraction, digits)} %"


def interval(low: float | None, high: float | None, unit: str = "1", digits: int = 4) -> str:
    """Two ends under one prefix, that of the farther one: "1.2 to 34 µm"; ends that read alike stand once."""
    known = [abs(one) for one in (low, high) if one is not None and math.isfinite(one)]
    shown, label = _under_one_prefix((low, high), unit, digits, max(known, default=0.0))
    return MISSING if set(shown) == {MISSING} else " to ".join(dict.fromkeys(shown)) + label


def amounts(values: Sequence[float], unit: str = "1", digits: int = 4) -> str:
    """Values under one prefix, that of the middle one of those that are not 0: "0, −8.509, −182.9 nN/V"."""
    sizes = sorted(abs(one) for one in values if one != 0.0 and math.isfinite(one)) or [0.0]
    shown, label = _under_one_prefix(values, unit, digits, sizes[len(sizes) // 2])
    return ", ".join(shown) + label


def _under_one_prefix(values: Sequence[float | None], unit: str, digits: int, size: float) -> tuple[list[str], str]:
    """Values as they read before a unit with the prefix of such a size, and the unit after them."""
    if unit == "%":
        values, unit = [None if one is None else 100.0 * one for one in values], " %"
    step, label = (1.0, unit.strip()) if unit in ("1", "", "-", " %") else prefixed(size, unit, digits)
    shown = [number(None if one is None else one / step, digits) for one in values]
    return shown, f" {label}" if label not in ("1", "", "-") else ""


LEAST_DIGITS, MOST_DIGITS = 4, 7
"""Digits that tell numbers apart: four are read at a glance, and no instrument sets a seventh."""


def digits_apart(values: Iterable[float]) -> int:
    """Significant digits at which different numbers read differently, from `LEAST_DIGITS` to `MOST_DIGITS`."""
    known = {one for one in values if math.isfinite(one)}
    apart = (
        digits
        for digits in range(LEAST_DIGITS, MOST_DIGITS)
        if len({f"{one:.{digits}g}" for one in known}) == len(known)
    )
    return next(apart, MOST_DIGITS)


def prefixed(value: float, unit: str, digits: int = 4) -> tuple[float, str]:
    """The step by which a value is divided, and the unit with the prefix that says so; 1 where it bears none."""
    if value == 0.0 or _BEARS.match(unit) is None:
        return 1.0, pretty_unit(unit)
    rounded, base, own = float(f"{value:.{digits}g}"), unit, 1.0
    if unit.startswith("kg"):
        rounded, base, own = float(f"{value * 1e3:.{digits}g}"), unit[1:], 1e-3
    # a part in 1e12 above: 1e-6 is 1 µ, though its logarithm may be below -6 by rounding
    power = 3 * math.floor(math.log10(abs(rounded) * (1.0 + 1e-12)) / 3)
    if power not in _PREFIXES:
        return 1.0, pretty_unit(unit)
    return 10.0**power * own, pretty_unit(_PREFIXES[power] + base)


def pretty_unit(unit: str) -> str:
    """A unit with exponents and prefixes set as such: "uN m^2 s" -> "µN m² s"."""
    out = re.sub(r"\^(-?\d+)", lambda m: _superscript(int(m[1])), unit)
    return "" if out == "1" else re.sub(r"\bu(?=[A-Zmsg])", "µ", out)


def how_many(count: int, one: str) -> str:
    """A count with its noun, whose plural ends in s."""
    return f"{count} {one}{'s' * (count != 1)}"


def spaced(name: str) -> str:
    """A name of the program as words: "contact_duration" -> "contact duration"."""
    return name.replace("_", " ")


def path_end(path: str) -> str:
    """The end of a path that distinguishes numbers: "film.thickness", "law.weights.0"."""
    parts = path.split(".")
    return ".".join(parts[-3:] if parts[-1].isdigit() else parts[-2:])


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
