"""Plain data, such as the JSON of a result, as tables: numbers by name, and one table for each list of alike rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from tarsus.tables.numbers import number, spaced
from tarsus.tables.table import ROW, Column, Table

MOST_ROWS, MOST_COLUMNS = 20, 9
"""Rows and columns of a table that are shown; the file has all of them. More do not fit a screen."""

LISTED, LETTERS = 4, 100
"""Values of a list, and letters of a text, that stand in one cell."""

UNITS = {"_s": "s", "_m": "m", "_hz": "Hz", "_J": "J"}
"""Units of numbers by the last letters of their names."""


def data_tables(data: Mapping[str, Any], keys: Iterable[str] = ()) -> list[Table]:
    """Tables of plain data; keys: the names that are shown, by default all. Long lists of numbers are not shown."""
    chosen = {key: data[key] for key in keys if key in data}
    return _tables("", chosen or data)


def _tables(name: str, value: Any) -> list[Table]:
    if isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
        return _rows(name, {str(i): one for i, one in enumerate(value, start=1)})
    if not isinstance(value, Mapping):
        return []
    plain = {key: one for key, one in value.items() if _fits(one)}
    deep = {key: one for key, one in value.items() if one and not _fits(one)}
    alike = {tuple(one) if isinstance(one, Mapping) else None for one in deep.values()}
    if not plain and len(alike) == 1 and None not in alike and any(map(_flat, deep.values())):
        inner = [(f"{key} {within}", one) for key, entry in deep.items() for within, one in entry.items() if _deep(one)]
        return [*_rows(name, deep), *(table for key, one in inner for table in _tables(key, one))]
    rows = [(spaced(key), _cell(one)) for key, one in plain.items()]
    made = [Table("", (name, Column("value", ROW)), rows, units=[_unit(key) for key in plain])] if rows else []
    return [*made, *(table for key, one in deep.items() for table in _tables(f"{name} {spaced(key)}".strip(), one))]


def _rows(name: str, entries: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """One table of entries by name, each with the values that it has besides longer lists."""
    flat = {key: _flat(entry) for key, entry in entries.items()}
    names = list(dict.fromkeys(column for entry in flat.values() for column in entry))[:MOST_COLUMNS]
    rows = [(key, *(_cell(entry.get(column)) for column in names)) for key, entry in flat.items()]
    more = [f"{len(rows) - MOST_ROWS} more {spaced(name)}"] * (len(rows) > MOST_ROWS)
    columns = [name, *(Column(spaced(column), _unit(column)) for column in names)]
    return [Table("", columns, rows[:MOST_ROWS], more)] if names else []


def _flat(entry: Any) -> dict[str, Any]:
    """Values of an entry that stand in cells, those of the tables in it under both names."""
    found: dict[str, Any] = {}
    for key, value in entry.items():
        if _fits(value):
            found[key] = value
        elif isinstance(value, Mapping):
            found |= {f"{key} {inner}": one for inner, one in value.items() if _fits(one)}
    return found


def _deep(value: Any) -> bool:
    """Whether a value is a table of tables, which no cells hold."""
    return isinstance(value, Mapping) and any(isinstance(one, Mapping) for one in value.values())


def _fits(value: Any) -> bool:
    """Whether a value stands in one cell."""
    if isinstance(value, list):
        return 0 < len(value) <= LISTED and all(_fits(one) and not isinstance(one, list) for one in value)
    return not isinstance(value, Mapping) and len(str(value)) <= LETTERS


def _cell(value: Any) -> Any:
    if not isinstance(value, list):
        return value
    numbers = all(isinstance(one, int | float) and not isinstance(one, bool) for one in value)
    if numbers and len(value) == 2:
        return tuple(value)
    return ", ".join(number(one) if numbers else str(one) for one in value)


def _unit(name: str) -> str:
    return next((unit for end, unit in UNITS.items() if name.endswith(end)), "1")
