"""Pieces of a report page: tables, figures, numbers with units, and the page around them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape

from markupsafe import Markup

from tarsus.report.pages import Plate, page, rendered
from tarsus.tables.numbers import MISSING, amount, number, pretty_unit, set_power

__all__ = [
    "MISSING", "Cell", "Column", "Markup", "amount", "code", "escape", "figure", "number", "page", "pretty_unit",
    "sentences", "set_power", "table", "tag", "warning",
]  # fmt: skip


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
) -> Markup:
    """An HTML table; `tall` makes it scroll, `wrap` lets its numbers break between lines.

    `over` is a row of (title, columns spanned) above its titles. A `Markup` cell is used as it stands, one that begins
    with `<td` is a whole cell; strings are escaped.
    """
    kind = "many" if len(columns) > 9 else "wrap" if wrap else ""
    letters = sum(len(column.title) for column in columns)
    cards = not tall and (len(columns) >= CARDS or letters > LETTERS)
    titles = _titles(columns, over) if cards else [""] * len(columns)
    cells = ([_cell(*one) for one in zip(row, columns, titles, strict=True)] for row in rows)
    label = next((column.title for column in columns if column.title), "table")
    heads = [replace(column, unit=pretty_unit(column.unit)) for column in columns]
    return rendered(
        "table.html", columns=heads, rows=cells, tall=tall, kind=kind, over=over, label=label, cards=cards
    )


CARDS, LETTERS = 4, 40
"""Columns from which on, and letters of all titles beyond which, a narrow screen shows rows as cards below each other
where a wide one has a table: the last columns would be beyond its edge."""


def _titles(columns: Sequence[Column], over: Sequence[tuple[str, int]]) -> list[str]:
    """What each cell of a card is: the column's title and unit, after the title above it."""
    above = [title for title, span in over for _ in range(span)] or [""] * len(columns)
    own = (f"{one.title} ({pretty_unit(one.unit)})" if one.unit else one.title for one in columns)
    return [f"{first}: {second}" if first else second for first, second in zip(above, own, strict=True)]


def _cell(cell: Cell, column: Column, title: str) -> Markup:
    kind = Markup(" class=n") if column.number else ""
    whole = cell if isinstance(cell, Markup) and cell.startswith("<td") else None
    told = Markup(' data-of="{}"').format(title) if title else Markup("")
    if whole is not None:
        return Markup("<td") + told + Markup(whole[len("<td") :])
    return Markup("<td{}{}>{}</td>").format(kind, told, cell)


def tag(word: str) -> Markup:
    """A word as a small label, coloured if the page's style knows it (provenance)."""
    return Markup('<span class="tag {0}">{0}</span>').format(word)


def code(word: str) -> Markup:
    """A path or file name, which may break after its dots."""
    return Markup("<code>{}</code>").format(Markup(escape(word).replace(".", ".<wbr>")))


def figure(plate: Plate, index: int) -> Markup:
    """A plate with its numbered caption."""
    return rendered("figure.html", plate=plate, index=index)


def warning(sentence: str | None) -> str:
    """A sentence the reader must not miss; nothing for None."""
    return "" if sentence is None else f'<p class="verdict failed">{escape(sentence)}</p>\n'


def sentences(told: Iterable[str]) -> str:
    """A list of sentences; nothing for none."""
    lines = "".join(f"<li>{escape(one)}</li>" for one in told)
    return f"<ul>{lines}</ul>\n" if lines else ""
