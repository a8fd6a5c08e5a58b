"""A table as HTML, by the one macro for tables that there is."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib.resources import files
from itertools import groupby
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

if TYPE_CHECKING:
    from tarsus.tables.table import Table

CARDS, LETTERS = 4, 40
"""Columns from which on, and letters of all titles, or of the longest words of three columns, beyond which a narrow
screen shows rows as cards below each other where a wide one has a table: the last columns would be beyond its edge."""

MANY = 9
"""Columns beyond which letters and gaps are smaller: at 960 px, the width of a page, ten columns have 96 px each."""

TALL = 14
"""Rows beyond which a page scrolls them, about as many as half a screen shows."""

_PATH = re.compile(r"[A-Za-z_*][\w*-]*(?:\.[\w*-]+)+")
"""A path of a description or the name of a file, which may break after its dots."""


def table_html(table: Table) -> Markup:
    """The title, the rows, the notes and the parts of a table; classes are those of the page's style."""
    columns, heads = table.columns, table.heads()
    cells, letters = table.cells(), sum(map(len, heads))
    if len(columns) == CARDS - 1:  # with fewer, columns of long words fit; with more, rows are cards anyway
        words = (" ".join(map(str, texts)).split() for texts in zip(heads, *cells, strict=True))
        letters = max(letters, sum(max(map(len, one), default=0) for one in words))
    over = [(title, len(list(same))) for title, same in groupby(columns, lambda one: one.over)]
    made: Any = _macro()(
        table,
        rows=[[_cell(one) for one in row] for row in cells],
        numbers=table.numeric(),
        heads=heads,
        titles=[f"{one.over}: {head}" if one.over else head for one, head in zip(columns, heads, strict=True)],
        over=over if any(title for title, _ in over) else (),
        cards=len(columns) >= CARDS or letters > LETTERS,
        many=len(columns) > MANY,
        tall=len(table.rows) > TALL,
    )
    return Markup(made)


@lru_cache
def _macro() -> Any:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    source = files("tarsus.tables").joinpath("table.html").read_text(encoding="utf-8")
    return environment.from_string(source).module.table  # type: ignore[attr-defined]


def _cell(shown: str) -> Markup:
    """A text as HTML: paths may break after their dots, remarks stand small below."""
    if hasattr(shown, "__html__"):
        return Markup(shown)
    word, *remarks = (escape(one) for one in shown.split("\n"))
    if _PATH.fullmatch(word):
        word = Markup("<code>{}</code>").format(Markup(word.replace(".", Markup(".<wbr>"))))
    return word + Markup("").join(Markup("<small>{}</small>").format(one) for one in remarks)
