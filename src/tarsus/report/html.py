"""Pieces of a report page: tables, figures, numbers with units, and the page around them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from string import Template

from tarsus.files.store import package_version
from tarsus.report.figures import Plate
from tarsus.report.style import scale_of

MISSING = "–"
"""Shown where a value does not exist."""


@dataclass(frozen=True)
class Column:
    """One column of a table: title, unit shown after it, and whether it holds numbers (right-aligned)."""

    title: str
    unit: str = ""
    number: bool = True


@dataclass(frozen=True)
class Markup:
    """Text that is HTML already; plain strings are escaped wherever they are used."""

    text: str


Cell = str | Markup


def table(
    columns: Sequence[Column],
    rows: Iterable[Sequence[Cell]],
    *,
    tall: bool = False,
    wrap: bool = False,
    over: Sequence[tuple[str, int]] = (),
) -> str:
    """An HTML table; `tall` makes it scroll, `wrap` lets its numbers break between lines.

    `over` is a row of (title, columns spanned) above its titles.

    A `Markup` cell is used as it stands, strings are escaped.
    """
    head = "".join(
        f"<th{' class=n' if c.number else ''}>{escape(c.title)}"
        + (f' <span class="unit">({escape(c.unit)})</span>' if c.unit else "")
        + "</th>"
        for c in columns
    )
    body = "".join(
        "<tr>" + "".join(_cell(cell, column) for cell, column in zip(row, columns, strict=True)) + "</tr>\n"
        for row in rows
    )
    above = "".join(f"<th colspan={span}>{escape(title)}</th>" for title, span in over)
    above = f'<tr class="over">{above}</tr>' if above else ""
    many = ' class="many"' if len(columns) > 9 else ' class="wrap"' if wrap else ""
    kind = ' class="table tall" tabindex="0"' if tall else ' class="table"'
    head = f"<thead>{above}<tr>{head}</tr></thead>"
    return f"<div{kind}><table{many}>{head}\n<tbody>\n{body}</tbody></table></div>\n"


def _cell(cell: Cell, column: Column) -> str:
    if isinstance(cell, Markup) and cell.text.startswith("<td"):
        return cell.text
    return f"<td{' class=n' if column.number else ''}>{text(cell)}</td>"


def text(cell: Cell) -> str:
    """A cell's HTML."""
    return cell.text if isinstance(cell, Markup) else escape(cell)


def tag(word: str) -> Markup:
    """A word as a small label, coloured if the page's style knows it (provenance)."""
    return Markup(f'<span class="tag {escape(word)}">{escape(word)}</span>')


def code(word: str) -> Markup:
    """A path or file name, which may break after its dots."""
    return Markup(f"<code>{escape(word).replace('.', '.<wbr>')}</code>")


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
    """A value with its unit under an engineering prefix, e.g. "264.1 µm"; unit "1" or "" is left out."""
    if unit in ("1", "", "-") or not math.isfinite(value):
        return number(value, digits)
    if unit not in ("s", "m", "N", "J", "V", "Hz", "kg", "m/s", "W"):
        return f"{number(value, digits)} {pretty_unit(unit)}"
    if unit == "kg":
        value, unit = value * 1e3, "g"
    if value == 0.0:
        return f"0 {unit}"
    scale = scale_of(unit, value)
    return f"{number(value / scale.step, digits)} {scale.label}"


def pretty_unit(unit: str) -> str:
    """A unit with exponents and products set as such: "N m^2 s" -> "N m² s"."""
    out = unit
    for power, sign in (("^2", "²"), ("^3", "³"), ("^4", "⁴"), ("^-1", "⁻¹"), ("^-2", "⁻²")):
        out = out.replace(power, sign)
    return "" if out == "1" else re.sub(r"\bu(?=[A-Zmsg])", "µ", out)


def figure(plate: Plate, index: int) -> str:
    """A plate with its numbered caption."""
    kind = "" if plate.wide else ' class="narrow"'
    caption = f"<figcaption><b>Figure {index}.</b> {escape(plate.caption)}</figcaption>"
    return f'<figure{kind}><div class="plate">{plate.svg}</div>{caption}</figure>\n'


def warning(sentence: str | None) -> str:
    """A sentence the reader must not miss; nothing for None."""
    return "" if sentence is None else f'<p class="verdict failed">{escape(sentence)}</p>\n'


def page(title: str, body: str) -> str:
    """The whole page around `body`."""
    template = Template(files("tarsus.report").joinpath("page.html").read_text(encoding="utf-8"))
    return template.substitute(title=escape(title), version=escape(package_version()), body=body)


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
