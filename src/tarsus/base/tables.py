"""Results as small HTML tables, for notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from tarsus.base.units import format_quantity

__all__ = ["html_amount", "html_table"]


def html_amount(value: float, unit: str) -> str:
    """A number in four digits with its unit; the word "none" for one that is not finite."""
    return format_quantity(float(f"{value:.4g}"), unit) if math.isfinite(value) else "none"


def html_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table with a caption; everything in it is escaped."""

    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(line(row, "td") for row in rows)
    return f"<table><caption>{escape(title)}</caption>{line(head, 'th')}{body}</table>"
