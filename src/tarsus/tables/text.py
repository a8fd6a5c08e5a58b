"""A table for a console, by rich."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tarsus.tables.table import Table

WIDEST = 10_000
"""Letters of a line that is not to be broken: more than any table has, within what rich sets."""


def table_text(table: Table, width: int | None = None) -> str:
    """The title, the rows, the notes and the parts of a table as lines without blanks at their ends.

    Texts are broken between words where `width` is given; numbers never are.
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

    grid = Grid(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 2, 0, 0))
    for column, head, number in zip(table.columns, table.heads(), table.numeric(), strict=True):
        name = f"{column.over}: {head}" if column.over else head
        grid.add_column(Text(name), justify="right" if number else "left", no_wrap=number or width is None)
    for i, row in enumerate(table.cells()):
        cells = (_cell(one, (i, j) in table.flagged) for j, one in enumerate(row))
        grid.add_row(*map(Text, cells))
    out = io.StringIO()
    Console(file=out, width=width or WIDEST, color_system=None, legacy_windows=False).print(grid)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())


def _cell(shown: str, flagged: bool) -> str:
    """A word with its remarks behind it, as terminals have it."""
    plain: str = getattr(shown, "striptags", lambda: shown)()  # of HTML, the text in it
    word, *remarks = plain.split("\n")
    return f"{word}{' !' * flagged}" + (f" ({'; '.join(remarks)})" if remarks else "")
