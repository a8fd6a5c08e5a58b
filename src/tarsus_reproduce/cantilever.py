"""The micro-cantilever under periodic drive, case by case (Tables A.1 and 2.3 of the source)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tarsus.files.library import changed
from tarsus.measure import Counting, histories_of
from tarsus.measure.periods import by_window
from tarsus.model.scene import Scene
from tarsus_reproduce.compared import TableComparison, compared_section, csv_columns, summary_of
from tarsus_reproduce.ensembles import packaged_errors, packaged_members, packaged_misses
from tarsus_reproduce.forecast import Member, RowReadings, members_of
from tarsus_reproduce.reproduction import Progress, Reproduction
from tarsus_reproduce.rows import CANTILEVER, PrintedRow, packaged_rows, read_rows

SETTLING_TIME, SETTLING_PERIODS = 0.1, 4
"""Transients that are dropped: this long [s] and at least so many drive periods. By then the first mode
of every packaged beam has decayed to 7 % or less."""
SEEN_TIME, SEEN_PERIODS = 0.4, 12
"""What is measured afterwards: this long [s] and at least so many drive periods."""

FOOTER = (
    "Bounces are flights above 0.1 µm that follow a contact shorter than 0.5 ms or a tenth of the period, however they "
    "began; peak is the height above contact level after break-off, contact the time per drive period on the ground."
)
NOTE = (
    "Tarsus is the median over drive periods after transients, with the interval that holds 80 % of them; for an "
    "ensemble also over its members, and over what the model misses of rows that were excluded."
)
CAPTION = (
    "Bounces per period, peak after break-off and contact duration per period of every case, bars are our 80 % "
    "intervals; the axis of contact durations is linear below 1 ms and logarithmic above."
)


def reproduce_cantilever(
    device: str | Sequence[Member] | None = None,
    rows: str | Path | None = None,
    progress: Progress | None = None,
) -> Reproduction:
    """Simulate every row of Table A.1, and of a rows file, with a device of one drive and one foot, or an ensemble of
    such; arguments and errors as for `tarsus_reproduce.verb.reproduce`."""
    members = members_of(packaged_members("cantilever") if device is None else device)
    misses = packaged_misses("cantilever") if device is None else {}
    printed = packaged_rows(CANTILEVER) + (read_rows(rows, CANTILEVER) if rows is not None else [])
    done = []
    for number, one in enumerate(printed):
        if progress is not None:
            progress(number, len(printed), f"{one.freq_hz:g} Hz, {one.volt_v:g} V, {one.wave}")
        done.append(PERIODS.row(members, one, misses))
    name = device if isinstance(device, str) else f"cantilever, a weighted ensemble of {len(members)}"
    plain = [row.to_dict(CANTILEVER) for row in done]
    problems = tuple(f"{row.case}: {code}" for row in done for code in row.problems)
    calibration = packaged_errors("cantilever") if device is None else None
    return Reproduction(
        name="cantilever",
        title="Micro-cantilever under periodic drive",
        about=f"{name}, {len(done)} drives",
        data={"device": name, "ok": not problems, "rows": plain, "summary": summary_of(CANTILEVER, done)},
        columns=csv_columns(CANTILEVER, done),
        lines=plain,
        sections=(compared_section(PERIODS, "Table A.1", done, [NOTE], calibration, CAPTION),),
        problems=problems,
        footer=FOOTER,
    )


def periods_of(freq_hz: float) -> tuple[int, int]:
    """Drive periods that are dropped as transient, and that are measured, at a drive frequency [Hz]."""
    dropped = max(SETTLING_PERIODS, math.ceil(SETTLING_TIME * freq_hz))
    seen = max(SEEN_PERIODS, math.ceil(SEEN_TIME * freq_hz))
    return dropped, seen


def _driven(scene: Scene, printed: PrintedRow) -> Scene:
    return changed(scene, volts=printed.volt_v, hz=printed.freq_hz, wave=printed.wave)


def _by_period(scene: Scene, printed: PrintedRow) -> RowReadings:
    """One run from rest, taken apart by drive period after transients."""
    from tarsus.solve import simulate

    assert printed.freq_hz is not None
    dropped, seen = periods_of(printed.freq_hz)
    period = 1.0 / printed.freq_hz
    edges = np.array([period * k for k in range(dropped, dropped + seen + 1)], dtype=np.float64)
    run = simulate(scene, duration=(dropped + seen) * period)
    names = tuple(one.measure for one in CANTILEVER.quantities)
    found = by_window(histories_of(run), edges, Counting.of(period), names)
    whole = edges[1:] <= run.end_time * (1.0 + 1e-9)  # a run that stopped early has fewer periods
    values = {name: found[name][0][whole] for name in names}
    return RowReadings(values, int(run.ok), () if run.ok else (str(run.code.value),))


PERIODS = TableComparison(CANTILEVER, _driven, _by_period, ("bounces", 1.0), "periods with a bounce")
"""Table A.1, by drive period."""
