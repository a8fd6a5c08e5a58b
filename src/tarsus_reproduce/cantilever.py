"""The micro-cantilever under periodic drive, case by case (Tables A.1 and 2.3 of the source)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.calibrate.compared import numbers_table
from tarsus.calibrate.description import TableSampling
from tarsus.files.library import changed
from tarsus.model.scene import Scene
from tarsus_reproduce.compared import ComparedTable, TableComparison
from tarsus_reproduce.reproduction import Progress, Reproduction
from tarsus_reproduce.rows import CANTILEVER, packaged_rows, read_rows

FOOTER = (
    "Bounces are flights above 0.1 µm that follow a contact shorter than 0.5 ms or a tenth of the period, however they "
    "began; peak is the height above contact level after break-off, contact the time per drive period on the ground."
)
NOTE = (
    "This model gives the median over drive periods after transients, with the interval that holds 80 % of them; for "
    "an ensemble also over its members, and over what the model misses of rows that were excluded."
)
CAPTION = (
    "Bounces per period, peak after break-off and contact duration per period of every case, bars are our 80 % "
    "intervals; the axis of contact durations is linear below 1 ms and logarithmic above."
)


def _driven(scene: Scene, row: Mapping[str, Any]) -> Scene:
    return changed(scene, volts=row["volt_v"], hz=row["freq_hz"], wave=row["wave"])


PERIODS = TableComparison(
    CANTILEVER, "cantilever", _driven, TableSampling(settle=0.2, windows=16, accuracy=1e-6), "periods with a bounce"
)
"""Table A.1, by drive period: after 0.2 s the first mode of every packaged beam has decayed to a hundredth."""


def reproduce_cantilever(
    device: str | None = None, rows: str | Path | None = None, progress: Progress | None = None
) -> Reproduction:
    """Predict every row of Table A.1, and of a rows file, by a device of one drive and one foot, or by the packaged
    ensemble; arguments and errors as for `tarsus_reproduce.verb.reproduce`."""
    printed = packaged_rows(CANTILEVER) + (read_rows(rows, CANTILEVER) if rows is not None else [])
    found = ComparedTable.of(PERIODS, "cantilever", device, printed, progress)
    return Reproduction(
        name="cantilever",
        title="Micro-cantilever under periodic drive",
        about=f"{found.device}, {len(found.printed)} drives",
        rows=numbers_table("Table A.1, row by row", found.numbers, repeated=True),
        sections=(found.section("Table A.1", [NOTE], CAPTION),),
        problems=found.problems,
        footer=FOOTER,
    )
