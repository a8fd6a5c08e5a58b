"""A part of a result as it is shown: its heading, and texts, tables and figures below it."""

from __future__ import annotations

from typing import Any


class Section:
    """A part of a result: its heading, and what stands below it in its order.

    parts: texts, tables, further sections, and what draws a figure; `tarsus.report.pages` says what a page makes of
    each.
    """

    def __init__(self, heading: str, *parts: Any) -> None:
        self.heading, self.parts = heading, parts
