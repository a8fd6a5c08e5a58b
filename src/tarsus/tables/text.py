"""A table for a console, by rich."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tarsus.tables.table import Table

WIDEST = 10_000
"""Letters of a line that is not to be broken: more than any table has, within what rich sets."""

GAP = 3
"""Blanks between columns: the box has one of its own."""


def table_text(table: Table, width: int | None = None) -> str:
    """The title, the rows, the notes and the parts of a table as lines without blanks at their ends.

    Texts are broken between words where `width` is given; numbers and words never are, so that a table may be wider.
    """
    pieces = [table.title] if table.title else []
    if table.columns and table.rows:
        pieces.append(_grid(table, width))
    pieces += table.notes
    whole = "\n".join(pieces)
    return "\n\n".join(filter(None, (whole, *(table_text(part, width) for part in table.parts))))


def _grid(table: Table, width: int | None) -> str:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table as Grid
    from rich.text import Text

    grid = Grid(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    cells = [
        [_cell(one, (i, j) in table.flagged) for j, one in enumerate(row)]
        for i, row in enumerate(table.cells())
    ]
    heads = table.heads()
    names = [
        f"{one.over}: {head}" if one.over else head for one, head in zip(table.columns, heads, strict=True)
    ]
    numeric = table.numeric()
    columns = [[name, *(row[j] for row in cells)] for j, name in enumerate(names)]
    for texts, number, room in zip(columns, numeric, _widths(columns, numeric, width), strict=True):
        grid.add_column(Text(texts[0]), justify="right" if number else "left", no_wrap=number, width=room)
    for row in cells:
        grid.add_row(*map(Text, row))
    out = io.StringIO()
    Console(file=out, width=WIDEST, color_system=None, legacy_windows=False).print(grid)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())


def _widths(columns: Sequence[Sequence[str]], numeric: Sequence[bool], width: int | None) -> list[int]:
    """Letters of every column: as many as its texts have, of the widest with words fewer where the table is too wide,
    down to a word. rich would cut words and numbers instead."""
    widths = [max(map(len, texts)) for texts in columns]
    excess = 0 if width is None else sum(widths) + GAP * (len(widths) - 1) - width
    for j in sorted(range(len(widths)), key=lambda j: -widths[j]):
        word = max(len(word) for text in columns[j] for word in text.split() or [""])
        fewer = 0 if numeric[j] else min(max(excess, 0), widths[j] - word)
        widths[j], excess = widths[j] - fewer, excess - fewer
    return widths


def _cell(shown: str, flagged: bool) -> str:
    """A word with its remarks behind it, as terminals have it."""
    plain: str = getattr(shown, "striptags", lambda: shown)()  # of HTML, the text in it
    word, *remarks = plain.split("\n")
    return f"{word}{' !' * flagged}" + (f" ({'; '.join(remarks)})" if remarks else "")
