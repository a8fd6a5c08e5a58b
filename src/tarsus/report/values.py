"""The scene's numbers as rows of a table: path, value with unit, where it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from tarsus.report.html import amount, number, pretty_unit
from tarsus.spec import float_paths

LONGEST_LIST = 6
"""Values of a list shown one by one; longer lists are described by their length and range."""


@dataclass(frozen=True)
class ValueRow:
    """One row: `path` of the value or list, `value` for reading, `source` word ("" if not stated), `note`, `doc`."""

    path: str
    value: str
    source: str
    note: str
    doc: str


def value_rows(scene: Any) -> list[ValueRow]:
    """All floats of a scene in its own order, lists gathered into one row, each with its provenance."""
    rows = []
    for path, group in groupby(float_paths(scene).items(), key=lambda item: _list_path(item[0])):
        infos = [info for _, info in group]
        source, note = _origin(path, scene.provenance)
        rows.append(ValueRow(path, _value([i.value for i in infos], infos[0].unit), source, note, infos[0].doc))
    return rows


def _list_path(path: str) -> str:
    """The path without trailing indices: elements of one list or matrix share it."""
    parts = path.split(".")
    while len(parts) > 1 and parts[-1].isdigit():
        parts.pop()
    return ".".join(parts)


def _value(values: list[float], unit: str) -> str:
    if len(values) <= LONGEST_LIST:
        return ", ".join(amount(value, unit) for value in values)
    shown = pretty_unit(unit)
    return f"{len(values)} values, {number(min(values))} to {number(max(values))}" + (f" {shown}" if shown else "")


def _origin(path: str, provenance: Mapping[str, Any]) -> tuple[str, str]:
    """Provenance stated for the path, for its first element, or for the nearest part of the scene around it."""
    for candidate in (path, f"{path}.0"):
        if candidate in provenance:
            return str(provenance[candidate].source.value), provenance[candidate].note
    parts = path.split(".")
    for length in range(len(parts) - 1, 0, -1):
        above = ".".join(parts[:length])
        if above in provenance:
            return str(provenance[above].source.value), provenance[above].note
    return "", ""
