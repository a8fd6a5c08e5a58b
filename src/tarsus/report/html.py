"""Pieces of a report page: tables, figures, numbers with units, and the page around them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from markupsafe import Markup
from markupsafe import escape as escaped

from tarsus.files.store import package_version
from tarsus.report.figures import Plate
from tarsus.report.render import rendered
from tarsus.report.style import scale_of

MISSING = "–"
"""Shown where a value does not exist."""


@dataclass(frozen=True)
class Column:
    """One column of a table: title, unit shown after it, and whether it holds numbers (right-aligned)."""

    title: str
    unit: str = ""
    number: bool = True


Cell = str
"""Text of a cell: a `Markup` is used as it stands, other strings are escaped."""


def table(
    columns: Sequence[Column],
    rows: Iterable[Sequence[Cell]],
    *,
    tall: bool = False,
    wrap: bool = False,
    over: Sequence[tuple[str, int]] = (),
) -> str:
    """An HTML table; `tall` makes it scroll, `wrap` lets its numbers break between lines.

    `over` is a row of (title, columns spanned) above its titles. A `Markup` cell is used as it stands, one that begins
    with `<td` is a whole cell; strings are escaped.
    """
    kind = "many" if len(columns) > 9 else "wrap" if wrap else ""
    cells = ([_cell(cell, column) for cell, column in zip(row, columns, strict=True)] for row in rows)
    label = next((column.title for column in columns if column.title), "table")
    return rendered("table.html", columns=columns, rows=cells, tall=tall, kind=kind, over=over, label=label)


def _cell(cell: Cell, column: Column) -> Markup:
    if isinstance(cell, Markup) and cell.startswith("<td"):
        return cell
    return Markup(f"<td class=n>{escaped(cell)}</td>" if column.number else f"<td>{escaped(cell)}</td>")


def tag(word: str) -> Markup:
    """A word as a small label, coloured if the page's style knows it (provenance)."""
    return Markup('<span class="tag {0}">{0}</span>').format(word)


def code(word: str) -> Markup:
    """A path or file name, which may break after its dots."""
    return Markup("<code>{}</code>").format(Markup(escape(word).replace(".", ".<wbr>")))


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
    return rendered("figure.html", plate=plate, index=index)


def warning(sentence: str | None) -> str:
    """A sentence the reader must not miss; nothing for None."""
    return "" if sentence is None else f'<p class="verdict failed">{escape(sentence)}</p>\n'


_HEADING = re.compile(r"<h2>(.*?)</h2>")


def page(title: str, body: str) -> str:
    """The whole page around `body`, with a list of its headings before the first of them."""
    headings: list[tuple[str, Markup]] = []

    def marked(found: re.Match[str]) -> str:
        headings.append((f"part-{len(headings) + 1}", Markup(found[1])))
        return f'<h2 id="{headings[-1][0]}">{found[1]}</h2>'

    body = _HEADING.sub(marked, body)
    first = body.find('<h2 id="part-1">')
    if first >= 0:
        body = body[:first] + rendered("contents.html", headings=headings) + body[first:]
    charts = '<div class="charts"' in body
    return rendered("base.html", title=title, version=package_version(), body=body, charts=charts)


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
