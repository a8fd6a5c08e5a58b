"""Numbers with units as people read them, and results as small HTML tables for notebooks.

Every page, figure and notebook shows its numbers by these; what is read back is written by `format_quantity`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape

__all__ = ["MISSING", "amount", "html_amount", "html_table", "number", "pretty_unit", "set_power"]

MISSING = "–"
"""Shown where a value does not exist."""

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_BEARS = re.compile(r"(?:s|m|N|J|V|A|Hz|W|Pa|C|F|g|kg|ohm)(?![\^A-Za-z])")
"""A unit whose first factor may bear a prefix: powers of one, angles and pure numbers do not."""


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


def amount(value: float, unit: str, digits: int = 4) -> str:
    """A value with its unit under an engineering prefix, e.g. "264.1 µm" or "−137.1 nN/V"; unit "1" or "" is left out.

    What no prefix brings between 1 and 1000 has a power of ten; where there is no value stands a dash.
    """
    if unit in ("1", "", "-") or not math.isfinite(value):
        return number(value, digits)
    if value == 0.0 or _BEARS.match(unit) is None:
        return f"{number(value, digits)} {pretty_unit(unit)}"
    rounded, base = float(f"{value:.{digits}g}"), unit
    if unit.startswith("kg"):
        rounded, base = float(f"{value * 1e3:.{digits}g}"), unit[1:]
    power = 3 * math.floor(math.log10(abs(rounded) * (1.0 + 1e-12)) / 3)
    if power not in _PREFIXES:
        return f"{number(value, digits)} {pretty_unit(unit)}"
    return f"{number(rounded / 10.0**power, digits)} {pretty_unit(_PREFIXES[power] + base)}"


def pretty_unit(unit: str) -> str:
    """A unit with exponents and prefixes set as such: "uN m^2 s" -> "µN m² s"."""
    out = re.sub(r"\^(-?\d+)", lambda m: _superscript(int(m[1])), unit)
    return "" if out == "1" else re.sub(r"\bu(?=[A-Zmsg])", "µ", out)


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def html_amount(value: float, unit: str) -> str:
    """A number in four digits with its unit; the word "none" for one that is not finite."""
    return amount(value, unit) if math.isfinite(value) else "none"


def html_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table with a caption; everything in it is escaped."""

    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(line(row, "td") for row in rows)
    return f"<table><caption>{escape(title)}</caption>{line(head, 'th')}{body}</table>"
