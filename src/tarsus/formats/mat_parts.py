"""What MATLAB files of every version have in common: what is left out of them, and sparse matrices as whole ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.formats.raw import MOST_VALUES

DEEPEST = 32
"""Cells and structures within each other up to which they are followed."""
_WAYS = {
    "string": "save it as a character array",
    "datetime": "save its times as seconds: seconds(t - t(1))",
    "duration": "save it as seconds: seconds(t)",
    "table": "save its columns as vectors: v = T.v",
    "timetable": "save its times and columns as vectors: t = seconds(T.Time - T.Time(1)), v = T.v",
    "timeseries": "save its times and data as vectors: t = ts.Time, v = ts.Data",
}
"""How objects become arrays, by their classes."""


@dataclass(frozen=True)
class Left:
    """A variable that is not read, and why, as what follows its name."""

    why: str


TOO_DEEP = Left("too deep within structures and cells")


def an_object(kind: str) -> Left:
    """An object of a class."""
    way = f"; {_WAYS[kind]}" if kind in _WAYS else ""
    return Left(f"an object of MATLAB's class {kind or 'unknown'}{way}")


def whole(values: np.ndarray, rows: np.ndarray, starts: np.ndarray, count: int) -> np.ndarray | Left:
    """A sparse matrix of ``count`` rows: its values, the row of each, and where each column begins.

    Raises ValueError for rows and columns that do not belong together.
    """
    columns = len(starts) - 1
    if count * columns > MOST_VALUES:
        return Left("a sparse matrix that is too large as a whole one")
    number = int(starts[-1])
    if starts[0] != 0 or np.any(np.diff(starts) < 0) or number > min(len(values), len(rows)):
        raise ValueError("its columns do not hold its values")
    rows = rows[:number].astype(np.int64)
    if np.any((rows < 0) | (rows >= count)):
        raise ValueError("a value is in none of its rows")
    out = np.zeros((count, columns), dtype=values.dtype)
    out[rows, np.repeat(np.arange(columns), np.diff(starts))] = values[:number]
    return out
