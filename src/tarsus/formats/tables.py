"""Named arrays with attributes, as MATLAB and HDF5 files hold them, to series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tarsus.base.messages import some_of
from tarsus.formats.declared import Statements, declared, group_of
from tarsus.formats.packing import unapplied, unpacked
from tarsus.formats.raw import Declared, RawFile, RawSeries

_UNITS = ("units", "unit", "Unit", "Units")
"""Attributes that hold the unit of an array."""


@dataclass(frozen=True)
class Array:
    """An array of a file: name with the names of its groups before it, values, attributes (unit, point, noise,
    full_scale, and what packs its numbers), and names for its rows where it is a table of them."""

    name: str
    values: np.ndarray
    attributes: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[str] = ()


def file_of(
    source: str,
    arrays: Sequence[Array],
    notes: Sequence[str] = (),
    groups: Mapping[str, Mapping[str, Any]] | None = None,
) -> RawFile:
    """Series from arrays: vectors as they are, each row or column of a table along its longer side.

    groups: attributes of the groups by their names, those of the file by the empty one. An attribute, or a scalar,
    named like a sampling rate or step (``fs``, ``sample_rate``, ``dt``...) is what the array, its group or the file
    declares.
    """
    statements = Statements()
    for name, attributes in (groups or {}).items():
        statements.add_attributes(name, attributes)
    vectors, other, said = [], [], []
    for array in arrays:
        values = np.asarray(array.values)
        if values.dtype.kind not in "fiucb" or values.size == 0:
            other.append(array.name)
        elif values.size == 1:
            last = array.name[len(group_of(array.name)) :].lstrip("/.")
            found = declared(f"'{array.name}'", last, values, _text(array.attributes, *_UNITS))
            other += [] if statements.add(group_of(array.name), found) else [array.name]
        else:
            vectors.append(array)
    series = []
    for array in vectors:
        try:
            made = _series_of(array, statements.nearest(array.name))
        except ValueError as error:
            said.append(f"{source}: not used: '{array.name}': {error}")
            continue
        series += made
        other += [] if made else [array.name]
        said += [
            f"{source}: '{array.name}' has the attribute {one}, which is of no convention and is not applied"
            for one in unapplied(array.attributes)
        ]
    said += [f"{source}: not used: {some_of(other)}"] if other else []
    said += statements.contradictions(source)
    return RawFile(source, tuple(series), statements.of_file(), (*notes, *said))


def _series_of(array: Array, around: Declared | None) -> list[RawSeries]:
    """Series of an array of one or two dimensions longer than one, of others none; around: what its group declares."""
    values, resolution = unpacked(np.asarray(array.values), array.attributes)
    table = values.squeeze()
    stated = [declared(f"'{array.name}'", name, value) for name, value in array.attributes.items()]
    one = next((found for found in stated if found is not None), around)
    if table.ndim == 1:
        return [_series(array, array.name, table, resolution, one)]
    if table.ndim != 2:
        return []
    lines = table if array.rows or table.shape[1] >= table.shape[0] else table.T
    names = array.rows if len(array.rows) == len(lines) else [str(i + 1) for i in range(len(lines))]
    return [
        _series(array, f"{array.name}/{name}", line, resolution, one) for name, line in zip(names, lines, strict=True)
    ]


def _series(array: Array, name: str, values: np.ndarray, resolution: float, stated: Declared | None) -> RawSeries:
    attributes = array.attributes
    return RawSeries(
        name,
        values,
        _text(attributes, *_UNITS),
        point=_text(attributes, "point") or None,
        noise=_level(attributes, "noise"),
        full_scale=_level(attributes, "full_scale"),
        resolution=resolution,
        declared=stated,
    )


def _text(attributes: Mapping[str, Any], *names: str) -> str:
    for name in names:
        value = attributes.get(name)
        if isinstance(value, np.ndarray) and value.size == 1:
            value = value.ravel()[0]
        if isinstance(value, bytes):
            value = value.decode("utf-8", errors="replace")
        if isinstance(value, str):
            return value.strip()
    return ""


def _level(attributes: Mapping[str, Any], name: str) -> float | None:
    try:
        return float(np.asarray(attributes[name]).ravel()[0])
    except (KeyError, TypeError, ValueError, IndexError):
        return None
