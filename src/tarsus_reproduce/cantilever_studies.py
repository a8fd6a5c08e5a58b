"""What the two studies of the micro-cantilever share: rules of landing, what the text says of a row, the drive."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.files.rows import parse_rows
from tarsus_reproduce.packaged import data_text

LANDINGS = {
    "capture": {"kind": "capture_unless_pulled"},
    "restitute": {"kind": "restitute_first", "speed": "20 mm/s"},
    "printed": {"kind": "pull_as_printed"},
}
LANDING = {
    "options": list(LANDINGS),
    "meaning": "When a touch becomes a bounce: held unless the pull exceeds the adhesion, as we read section 2.3 "
    "(capture); restitution first, held below a departing speed of which nothing is known, 20 mm/s, which rises some "
    "5 um (restitute); (2.13) with its own signs (printed).",
}
BREAKS_OFF = {
    "name": "the tip leaves the ground at 5 Hz, 6 V, sine",
    "reason": "The source gives a peak after break-off for all of its sixteen cases, of which four are not in our "
    "table: of these the tip would stay longest in this one. We only know that it lifts off (resolution 0.1 um, "
    "smoothed over 0.02 um).",
    "conditions": [{"freq_hz": 5, "volt_v": 6, "wave": "sine"}],
    "measure": "peak",
    "unit": "um",
    "min": "0.1 um",
    "softness": "0.02 um",
}

LOOPS = "loop_by_swing.csv"
MICRO = 1e-6
COMPLIANCES = 132.131008, 0.320264308
"""Static tip deflections of the device's two modes [m/N of a unit participation]."""
_TERMS = {"c0": "constant", "c1": "linear", "c2": "quadratic", "c3": "cubic"} | {
    f"w{n}": f"weights.{n}" for n in range(6)
}


@lru_cache
def loop_table() -> dict[str, Floats]:
    """Columns of the table of loops: half swings [uN], and coefficients [uN, V] at each."""
    table = parse_rows(data_text(LOOPS), LOOPS)
    return {name: np.array([float(row[name]) for row in table.rows]) for name in table.columns}


def loop_changes(swing: float, offset: float) -> dict[str, float]:
    """Coefficients of the drive's law by path [SI], for half a swing and a zero of the force [uN]: linear between the
    table's rows."""
    table = loop_table()
    found = {name: float(np.interp(swing, table["swing"], table[name])) for name in _TERMS}
    found["c0"] += offset
    return {f"robot.drives.pzt.law.{path}": found[name] * MICRO for name, path in _TERMS.items()}


def drive_changes(unknowns: Any, row: Mapping[str, Any]) -> dict[str, Any]:
    """Signal, participation and loop of the drive, and the rule of landing, by path."""
    first, second = COMPLIANCES
    return {
        "signals.pzt": {"kind": row["wave"], "amplitude": row["volt_v"], "frequency": row["freq_hz"]},
        "robot.drives.pzt.load.participation.0": unknowns.static / (1 + unknowns.ratio) / first,
        "robot.drives.pzt.load.participation.1": unknowns.static * unknowns.ratio / (1 + unknowns.ratio) / second,
        **loop_changes(unknowns.swing, unknowns.offset),
        "ground.landing": LANDINGS[unknowns.landing],
    }
