"""A table for a console, by rich."""

from __future__ import annotations

import io
import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tarsus.tables.table import Table

WIDEST = 10_000
"""Letters of a line that is not to be broken: more than any table has, within what rich sets."""

JOINED, HELD = "\N{NO-BREAK SPACE}", "\ue000"
"""A space that must not be broken at, and the letter of private use that stands for it: rich breaks at any space."""

FOLDED = 12
"""Letters below which no column of texts goes: fewer cannot be read."""

GAP = 3
"""Blanks between columns: the box has one of its own."""


def table_text(table: Table, width: int | None = None) -> str:
    """The title, the rows, the notes and the parts of a table as lines without blanks at their ends.

    Texts are broken between words where `width` is given, within words where those do not fit either; numbers never
    are, so that a table of many numbers may be wider.
    """
    pieces = [table.title] if table.title else []
    if table.columns and table.rows:
        pieces.append(_grid(table, width))
    pieces += [one for note in table.notes for one in _lines(note, width)]
    whole = "\n".join(pieces)
    return "\n\n".join(filter(None, (whole, *(table_text(part, width) for part in table.parts))))


def _grid(table: Table, width: int | None) -> str:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table as Grid
    from rich.text import Text

    grid = Grid(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    cells = [[_cell(one, (i, j) in table.flagged) for j, one in enumerate(row)] for i, row in enumerate(table.cells())]
    heads = table.heads()
    names = [f"{one.over}: {head}" if one.over else head for one, head in zip(table.columns, heads, strict=True)]
    numeric = table.numeric()
    columns = [[name, *(row[j] for row in cells)] for j, name in enumerate(names)]
    for texts, number, room in zip(columns, numeric, _widths(columns, numeric, width), strict=True):
        grid.add_column(
            Text(texts[0]), justify="right" if number else "left", no_wrap=number, width=room, overflow="fold"
        )
    for row in cells:
        grid.add_row(*map(Text, row))
    out = io.StringIO()
    Console(file=out, width=WIDEST, color_system=None, legacy_windows=False).print(grid)
    return "\n".join(line.rstrip() for line in out.getvalue().replace(HELD, " ").splitlines())


def _lines(note: str, width: int | None) -> list[str]:
    """A sentence in lines of so many letters."""
    if width is None:
        return [note]
    return textwrap.wrap(note, width, break_long_words=False, break_on_hyphens=False) or [note]


def _widths(columns: Sequence[Sequence[str]], numeric: Sequence[bool], width: int | None) -> list[int]:
    """Letters of every column: as many as its texts have. Of a table that is too wide the widest texts give way, down
    to their longest word, and where that is not enough words are folded; numbers stay whole."""
    widths = [max(map(len, texts)) for texts in columns]
    room = math.inf if width is None else width - GAP * (len(widths) - 1)
    words = [max(len(word) for text in texts for word in text.split() or [""]) for texts in columns]
    for least in (words, [FOLDED] * len(words)):
        while sum(widths) > room:
            yielding = [j for j, one in enumerate(widths) if not numeric[j] and one > least[j]]
            if not yielding:
                break
            widths[max(yielding, key=widths.__getitem__)] -= 1
    return widths


def _cell(shown: str, flagged: bool) -> str:
    """A word with its remarks behind it, as terminals have it."""
    plain: str = getattr(shown, "striptags", lambda: shown)()  # of HTML, the text in it
    word, *remarks = plain.split("\n")
    whole = f"{word}{f'{HELD}!' * flagged}" + (f" ({'; '.join(remarks)})" if remarks else "")
    return whole.replace(JOINED, HELD)
