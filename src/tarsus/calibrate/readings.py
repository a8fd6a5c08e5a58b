"""What an instrument reads of one foot in windows of a run: the measures a table can hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.measure.history import Counting, EventHistories
from tarsus.measure.periods import PER_WINDOW, by_window
from tarsus.measure.table import RunTable
from tarsus.solve import Batch

PER_PERIOD = ("bounces", "rebounds", "contact_duration", "impacts")
"""Measures that grow with the window: a table has them by drive period."""

MOTION = {"swing": "m", "oscillations_per_step": "1"}
"""Measures of the foot's motion in a single recorded run, for constraints; see `tarsus.calibrate.motion`."""


def known_measures() -> dict[str, str]:
    """SI unit of every measure of a window, by name."""
    return {name: one.unit for name, one in PER_WINDOW.items()}


def unit_of(measure: str) -> str:
    """SI unit of a measure."""
    return MOTION[measure] if measure in MOTION else known_measures()[measure]


def readings(
    batch: Batch, foot: int, names: Sequence[str], edges: Floats, resolution: float
) -> NDArray[np.float64]:
    """Measures (nr, names, windows) of a foot of every run in windows between ``edges`` (nw + 1,) [s]; NaN where a
    window has none.

    Those of `PER_PERIOD` are scaled from the window to the drive period.
    """
    out = np.full((len(batch), len(names), len(edges) - 1), np.nan)
    for members, table in batch.tables():
        out[members] = table_readings(table, foot, names, edges, resolution)
    return out


def table_readings(
    table: RunTable, foot: int, names: Sequence[str], edges: Floats, resolution: float
) -> Floats:
    """The same of runs as measures see them."""
    histories = EventHistories(table.events, table.first, table.ends, [foot], len(table.feet))
    found = by_window(histories, edges, Counting.of(table.period, resolution), names)
    scale = table.period[:, None] / np.diff(edges)
    return np.stack([found[name] * (scale if name in PER_PERIOD else 1.0) for name in names], axis=1)
