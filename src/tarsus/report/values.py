"""The scene's numbers as rows of a table: path, value with unit, where it comes from."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import Any

from tarsus.base.spec import float_paths
from tarsus.base.units import format_quantity
from tarsus.report.html import number, pretty_unit, set_power

LONGEST_LIST = 6
"""Values of a list shown one by one; longer lists are described by their length and range."""


@dataclass(frozen=True)
class ValueRow:
    """One row: `path` of the value or list, `value` for reading, `source` word or "", `note`, `doc`."""

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
        source, note = _origin(scene, path)
        rows.append(
            ValueRow(path, _value([i.value for i in infos], infos[0].unit), source, note, infos[0].doc)
        )
    return rows


def _list_path(path: str) -> str:
    """The path without trailing indices: elements of one list or matrix share it."""
    parts = path.split(".")
    while len(parts) > 1 and parts[-1].isdigit():
        parts.pop()
    return ".".join(parts)


def _value(values: list[float], unit: str) -> str:
    if len(values) <= LONGEST_LIST:
        return ", ".join(_exact(value, unit) for value in values)
    shown = pretty_unit(unit)
    return f"{len(values)} values, {number(min(values))} to {number(max(values))}" + (
        f" {shown}" if shown else ""
    )


def _exact(value: float, unit: str) -> str:
    """An input value to six digits, which is all of them for a number typed by hand."""
    rounded = float(f"{value:.6g}")
    if unit == "1":
        return number(rounded, 6)
    figure, shown = format_quantity(rounded, unit).split(" ", 1)
    return f"{set_power(figure)} {pretty_unit(shown)}"


def _origin(scene: Any, path: str) -> tuple[str, str]:
    """Source word and note of a value or list; of a list whose elements differ, those of the first."""
    found = scene.origin(path) or scene.origin(f"{path}.0")
    return (found.source.value, found.note) if found is not None else ("", "")
