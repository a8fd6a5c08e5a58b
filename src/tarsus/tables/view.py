"""A result as people read it and as plain data: for verbs whose results are no objects of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tarsus.tables.table import Table


@dataclass(frozen=True, repr=False)
class View:
    """What there is to see: ``data``, plain and in SI units; ``shown``, the same as a table; remarks on it;
    problems: sentences on what is not as it should be."""

    data: dict[str, Any]
    shown: Table
    remarks: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()

    def table(self) -> Table:
        """The table."""
        return self.shown

    def to_dict(self) -> dict[str, Any]:
        """The plain data."""
        return self.data

    def __str__(self) -> str:
        return self.shown.text()

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return self.shown.html()
