"""Named arrays with attributes, as MATLAB and HDF5 files hold them, to series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tarsus.formats.raw import Declared, RawFile, RawSeries

_RATES = {
    "fs",
    "rate",
    "sample_rate",
    "samplerate",
    "sampling_rate",
    "sampling_frequency",
    "time_sample_rate",
}
_STEPS = {"dt", "delta_t", "sampling_step", "sample_interval"}
_RATE_RESOLUTION = 6e-8
"""Relative step of the digits of a rate in single precision."""


@dataclass(frozen=True)
class Array:
    """An array of a file: name with the names of its groups before it, values, attributes (unit, point, noise,
    full_scale), and names for its rows where it is a table of them."""

    name: str
    values: np.ndarray
    attributes: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[str] = ()


def file_of(source: str, arrays: Sequence[Array], notes: Sequence[str] = ()) -> RawFile:
    """Series from arrays: vectors as they are, each row or column of a table along its longer side.

    A scalar named like a sampling rate or step (``fs``, ``sample_rate``, ``dt``...) is what the file declares.
    """
    series, other, declared = [], [], None
    for array in arrays:
        values = np.asarray(array.values)
        if values.dtype.kind not in "fiuc":
            other.append(array.name)
            continue
        values = values.astype(complex if values.dtype.kind == "c" else float, copy=False)
        if values.size == 1:
            found = _declared(array, float(np.real(values).ravel()[0]))
            declared = declared or found
            if found is None:
                other.append(array.name)
            continue
        table = values.squeeze()
        if table.ndim == 1:
            series.append(_series(array, array.name, table))
        elif table.ndim == 2:
            lines = table if array.rows or table.shape[1] >= table.shape[0] else table.T
            names = array.rows if len(array.rows) == len(lines) else [str(i + 1) for i in range(len(lines))]
            series += [
                _series(array, f"{array.name}/{name}", line) for name, line in zip(names, lines, strict=True)
            ]
        else:
            other.append(array.name)
    said = [f"{source}: not used: {', '.join(map(repr, other))}"] if other else []
    return RawFile(source, tuple(series), declared, (*notes, *said))


def _series(array: Array, name: str, values: np.ndarray) -> RawSeries:
    attributes = array.attributes
    return RawSeries(
        name,
        values,
        _text(attributes, "units", "unit", "Unit", "Units"),
        point=_text(attributes, "point") or None,
        noise=_level(attributes, "noise"),
        full_scale=_level(attributes, "full_scale"),
        resolution=_single(array.values),
        declared=_stated(array),
    )


def _stated(array: Array) -> Declared | None:
    """The sampling rate or step that an attribute of an array states."""
    for name in array.attributes:
        value = _level(array.attributes, name)
        found = None if value is None else _declared(Array(name, array.values), value)
        if found is not None:
            return found
    return None


def _single(values: np.ndarray) -> float:
    """Step of the digits of numbers in single precision; 0 for others."""
    if values.dtype not in (np.float32, np.complex64):
        return 0.0
    return float(np.spacing(np.max(np.abs(values), initial=0.0)).astype(float))


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


def _declared(array: Array, value: float) -> Declared | None:
    key = array.name.rpartition("/")[2].rpartition(".")[2].lower()
    if not value > 0.0 or key not in _RATES | _STEPS:
        return None
    step = 1.0 / value if key in _RATES else value
    return Declared(f"'{array.name}'", step, _RATE_RESOLUTION * step)
