"""The loop of the micro-cantilever's drive: coefficients by half the force swing of a 6 V loop, from a table."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.files.rows import parse_rows
from tarsus_reproduce.packaged import data_text

TABLE = "loop_by_swing.csv"
MICRO = 1e-6
_TERMS = {"c0": "constant", "c1": "linear", "c2": "quadratic", "c3": "cubic", **{f"w{n}": f"weights.{n}" for n in range(6)}}


@lru_cache
def loop_table() -> dict[str, Floats]:
    """Columns of the table: half swings [uN], and coefficients [uN, V] at each."""
    table = parse_rows(data_text(TABLE), TABLE)
    return {name: np.array([float(row[name]) for row in table.rows]) for name in table.columns}


def loop_changes(swing: float, offset: float) -> dict[str, float]:
    """Coefficients of the drive's law by path [SI], for half a swing and a zero of the force [uN]: linear between the
    table's rows."""
    table = loop_table()
    found = {name: float(np.interp(swing, table["swing"], table[name])) for name in _TERMS}
    found["c0"] += offset
    return {f"robot.drives.pzt.law.{path}": found[name] * MICRO for name, path in _TERMS.items()}
