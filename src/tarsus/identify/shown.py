"""An identification as a table, for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from tarsus.base.spec import float_paths
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.identify.chain import Identification

__all__ = ["Shown"]


class Shown:
    """Base of an identification: how a terminal and a notebook show it."""

    def __repr__(self) -> str:
        found = cast("Identification", self)
        numbers = sum(len(step.paths) for step in found.steps.values())
        left = f", not done: {', '.join(one.name for one in found.not_done)}" if found.not_done else ""
        told = f"{numbers} numbers in {len(found.steps)} steps{left}"
        return f"<Identification of '{found.opened.campaign.name}': {told}>"

    def _repr_html_(self) -> str:
        found = cast("Identification", self)
        units = float_paths(found.model.scene)
        rows = [
            (path, name, value, tuple(step.interval(path)))
            for name, step in found.steps.items()
            for path, value in zip(step.paths, step.values.tolist(), strict=True)
        ]
        left = f"; not done: {', '.join(one.name for one in found.not_done)}" if found.not_done else ""
        title = f"Identified from '{found.opened.campaign.name}', {found.files_used} files{left}"
        columns = ("parameter", "step", Column("value", ROW), Column("95 % interval", ROW))
        return Table(title, columns, rows, units=[units[row[0]].unit for row in rows]).html()
