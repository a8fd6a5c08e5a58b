"""The micro-cantilever under periodic drive, case by case (Tables A.1 and 2.3 of the source)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.calibrate.prediction import Miss
from tarsus.files.library import changed
from tarsus.measure import Counting, histories_of
from tarsus.measure.periods import by_window
from tarsus.tables import Column, Table
from tarsus_reproduce.ensembles import packaged_errors, packaged_members, packaged_misses
from tarsus_reproduce.forecast import (
    CALIBRATED,
    PREDICTED,
    Floats,
    Forecast,
    Member,
    WeightedValues,
    forecast,
    medians,
    members_of,
    role_of,
)
from tarsus_reproduce.reproduction import (
    OURS,
    FigureCall,
    NumberRow,
    Progress,
    Reproduction,
    ReproductionSection,
    found_at,
    number_rows,
    numbers_table,
)  # fmt: skip
from tarsus_reproduce.rows import (
    CANTILEVER,
    PrintedRow,
    mean_percent,
    packaged_rows,
    read_rows,
    relative_error,
    relative_errors,
)

SETTLING_TIME, SETTLING_PERIODS = 0.1, 4
"""Transients that are dropped: this long [s] and at least so many drive periods. By then the first mode
of every packaged beam has decayed to 7 % or less."""
SEEN_TIME, SEEN_PERIODS = 0.4, 12
"""What is measured afterwards: this long [s] and at least so many drive periods."""

GOOD = 0.30
"""Relative error below which Table 2.3 counts a case as good."""
CLOSE_PEAK, CLOSE_CONTACT = 0.15, 1.0
"""How close to the source's model is close: peaks by this part, half of what is good, as they are read off the same
model; contacts by `GOOD` or so many milliseconds, a hundredth of the longest printed one."""

Observed = Mapping[str, float | None]
"""Numbers of a case by key of the table's quantities; None where nothing is known."""

_MEASURES = {"bounces": "bounces", "peak": "peak", "contact_duration": "contact"}
"""Measure of a run -> name of the quantity in the calibration's study, in the order of the table's quantities."""

FOOTER = (
    "Bounces are flights above 0.1 µm that follow a contact shorter than 0.5 ms or a tenth of the period, however they "
    "began; peak is the height above contact level after break-off, contact the time per drive period on the ground."
)


@dataclass(frozen=True)
class PeriodsRow:
    """One case and our forecasts, in the table's units, over `periods` drive periods after transients of every member.

    p_bounce: probability of a bounce in a drive period; role: whether the device was calibrated on this row; problems:
    codes of the runs that did not reach their end.
    """

    printed: PrintedRow
    forecasts: Mapping[str, Forecast]
    p_bounce: float | None
    periods: int
    role: str
    problems: tuple[str, ...]

    @property
    def case(self) -> str:
        """The drive in words; a star marks a row of a file."""
        one = self.printed
        return f"{one.freq_hz:g} Hz, {one.volt_v:g} V, {one.wave}{'' if one.origin == 'packaged' else ' *'}"

    def to_dict(self) -> dict[str, Any]:
        """Plain data; lengths in um and times in ms, as in the table."""
        one = self.printed
        return {
            "freq_hz": one.freq_hz,
            "volt_v": one.volt_v,
            "wave": one.wave,
            "origin": one.origin,
            "role": self.role,
            "source": one.source,
            "measured": one.measured,
            "ours": {key: found.to_dict() for key, found in self.forecasts.items()},
            "p_bounce": self.p_bounce,
            "periods": self.periods,
            "errors": {
                "source": errors(one.measured, one.source),
                "ours": errors(one.measured, medians(self.forecasts)),
                "ours_against_source": errors(one.source, medians(self.forecasts)),
            },
            "problems": list(self.problems),
        }


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
    done: list[PeriodsRow] = []
    for number, one in enumerate(printed):
        if progress is not None:
            progress(number, len(printed), f"{one.freq_hz:g} Hz, {one.volt_v:g} V, {one.wave}")
        done.append(simulate_row(members, one, misses))
    name = device if isinstance(device, str) else f"cantilever, a weighted ensemble of {len(members)}"
    return _comparison(name, done, packaged_errors("cantilever") if device is None else None)


def simulate_row(
    members: Sequence[Member], printed: PrintedRow, misses: Mapping[str, Miss] | None = None
) -> PeriodsRow:
    """Simulate one case with every member, and take it apart by drive period after transients.

    misses: what the ensemble is known to miss of "bounces", "peak" and "contact"; nothing where it is left out.
    """
    from tarsus.solve import simulate

    assert printed.freq_hz is not None
    dropped, seen = periods_of(printed.freq_hz)
    period = 1.0 / printed.freq_hz
    edges = np.array([period * k for k in range(dropped, dropped + seen + 1)], dtype=np.float64)
    parts: dict[str, list[tuple[float, Floats]]] = {name: [] for name in _MEASURES}
    problems: list[str] = []
    for member in members:
        scene = changed(member.scene, volts=printed.volt_v, hz=printed.freq_hz, wave=printed.wave)
        run = simulate(scene, duration=(dropped + seen) * period)
        if not run.ok:
            problems.append(str(run.code.value))
        found = by_window(histories_of(run), edges, Counting.of(period), tuple(_MEASURES))
        whole = edges[1:] <= run.end_time * (1.0 + 1e-9)  # a run that stopped early has fewer periods
        for name, of_member in parts.items():
            of_member.append((member.weight, found[name][0][whole]))
    samples = {name: WeightedValues.joined(of_member) for name, of_member in parts.items()}
    known = misses or {}
    forecasts = {
        quantity.key: forecast(samples[name], known.get(own)).scaled(quantity.factor)
        for quantity, (name, own) in zip(CANTILEVER.quantities, _MEASURES.items(), strict=True)
    }
    chance = samples["bounces"].share(1.0, known.get("bounces"))
    role = role_of(members, printed.origin == "packaged", printed.measured is not None)
    return PeriodsRow(printed, forecasts, chance, seen, role, tuple(problems))


def periods_of(freq_hz: float) -> tuple[int, int]:
    """Drive periods that are dropped as transient, and that are measured, at a drive frequency [Hz]."""
    dropped = max(SETTLING_PERIODS, math.ceil(SETTLING_TIME * freq_hz))
    seen = max(SEEN_PERIODS, math.ceil(SEEN_TIME * freq_hz))
    return dropped, seen


def errors(reference: Observed | None, simulated: Observed | None) -> dict[str, float | None]:
    """Errors of a case, None where there is none: of the peak and the contact (reference - simulated)/reference, the
    definition of Tables 2.3 and A.1; of the bounces per period the absolute difference."""
    ref, sim = reference or {}, simulated or {}
    one, other = ref.get("bounces"), sim.get("bounces")
    return {
        "count": None if one is None or other is None else abs(one - other),
        "peak": relative_error(ref.get("peak_um"), sim.get("peak_um")),
        "contact": relative_error(ref.get("contact_ms"), sim.get("contact_ms")),
    }


def summary_of(rows: Sequence[PeriodsRow]) -> dict[str, Any]:
    """Table 2.3 for both models; also for packaged and added rows apart, and for those that were calibrated on and
    those that are predicted, when there are both."""
    whole = _merits_of(rows)
    added = [row for row in rows if row.printed.origin != "packaged"]
    given = [row for row in rows if row.printed.origin == "packaged"]
    if given and added:
        whole |= {"packaged_rows": _merits_of(given), "added_rows": _merits_of(added)}
    fitted, predicted = ([row for row in rows if row.role == role] for role in (CALIBRATED, PREDICTED))
    if fitted and predicted:
        whole |= {"calibrated_rows": _merits_of(fitted), "predicted_rows": _merits_of(predicted)}
    return whole


def _merits_of(rows: Sequence[PeriodsRow]) -> dict[str, Any]:
    """Table 2.3 for both models against the measurement, and our model against the source's."""
    measured, source = ([getattr(row.printed, who) or {} for row in rows] for who in ("measured", "source"))
    ours = [medians(row.forecasts) for row in rows]
    return {
        "rows": len(rows),
        "source": compare(measured, source),
        "ours": compare(measured, ours),
        "ours_against_source": compare(source, ours) | _closeness(source, ours),
    }


def compare(reference: Sequence[Observed], simulated: Sequence[Observed]) -> dict[str, Any]:
    """One column of Table 2.3, with absolute means beside the signed ones; errors in percent.

    A count is right when it is less than half a bounce off; existence means at least half a bounce a period.
    """
    counts = _known(reference, simulated, "bounces")
    return {
        "existence_right": sum((ref >= 0.5) == (sim >= 0.5) for ref, sim in counts),
        "count_right": sum(abs(ref - sim) < 0.5 for ref, sim in counts),
        "count_cases": len(counts),
        "mean_count_error": _mean([abs(ref - sim) for ref, sim in counts]),
        "peak": _merits(_known(reference, simulated, "peak_um")),
        "contact": _merits(_known(reference, simulated, "contact_ms")),
    }


def _known(
    reference: Sequence[Observed], simulated: Sequence[Observed], key: str
) -> list[tuple[float, float]]:
    """Pairs of one quantity where both are known."""
    pairs = ((ref.get(key), sim.get(key)) for ref, sim in zip(reference, simulated, strict=True))
    return [(ref, sim) for ref, sim in pairs if ref is not None and sim is not None]


def _merits(pairs: Sequence[tuple[float, float]]) -> dict[str, Any]:
    """Errors of one quantity over (reference, simulated) pairs.

    `in_means` of the `cases` have a relative error. A case without one (something against a measured 0) is a miss: it
    counts among the cases and is not below 30 %.
    """
    values = relative_errors(pairs)
    return {
        "cases": len(pairs),
        "in_means": len(values),
        "mean_signed_percent": mean_percent(values),
        "mean_absolute_percent": mean_percent([abs(value) for value in values]),
        "below_30_percent": sum(abs(value) < GOOD for value in values),
    }


def _closeness(source: Sequence[Observed], ours: Sequence[Observed]) -> dict[str, int]:
    """How many cases come close to the source's model: see `CLOSE_PEAK`."""
    peaks = contacts = 0
    for ref, sim in zip(source, ours, strict=True):
        pair = errors(ref, sim)
        peaks += pair["peak"] is not None and abs(pair["peak"]) <= CLOSE_PEAK
    for ref, sim in _known(source, ours, "contact_ms"):
        error = relative_error(ref, sim)
        contacts += abs(ref - sim) <= CLOSE_CONTACT or (error is not None and abs(error) <= GOOD)
    return {"peak_within_15_percent": peaks, "contact_within_30_percent_or_1_ms": contacts}


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None


# What is shown


def _comparison(
    device: str, rows: Sequence[PeriodsRow], calibration: Mapping[str, Any] | None
) -> Reproduction:
    """Rows as tables, figure and files; calibration: what the packaged ensemble's calibration says of each row that was
    excluded (see `tarsus_reproduce.ensembles.packaged_errors`)."""
    summary = summary_of(rows)
    numbers = [one for row in rows for one in _number_rows(row)]
    notes = [
        "Tarsus is the median over drive periods after transients, with the interval that holds 80 % of them; for an "
        "ensemble also over its members, and over what the model misses of rows that were excluded."
    ]
    notes += ["* = from the rows file."] * any(row.printed.origin != "packaged" for row in rows)
    sections = [ReproductionSection("Summary", tuple(_summary_tables(summary)))]
    if calibration is not None:
        sections.append(ReproductionSection("Calibrated on and excluded", (_excluded_table(calibration),)))
    shown = numbers_table("Table A.1, row by row", numbers, notes)
    sections.append(
        ReproductionSection(
            "Row by row", (shown,), (FigureCall("numbers_figure.numbers_figure", numbers, CAPTION),)
        )
    )
    plain = [row.to_dict() for row in rows]
    columns: dict[str, tuple[str, ...]] = {
        name: (name,) for name in ("freq_hz", "volt_v", "wave", "role", "p_bounce")
    }
    for one in CANTILEVER.quantities:
        columns |= {f"{one.key}_{who}": (who, one.key) for who in ("source", "measured")}
        columns |= {f"{one.key}_{name}": ("ours", one.key, end) for name, end in OURS.items()}
    return Reproduction(
        name="cantilever",
        title="Micro-cantilever under periodic drive",
        about=f"{device}, {len(rows)} drives",
        data={
            "device": device,
            "ok": not any(row.problems for row in rows),
            "rows": plain,
            "summary": summary,
        },
        columns=columns,
        lines=plain,
        sections=tuple(sections),
        problems=tuple(f"{row.case}: {code}" for row in rows for code in row.problems),
        footer=FOOTER,
    )


CAPTION = (
    "Bounces per period, peak after break-off and contact duration per period of every case, bars are our 80 % "
    "intervals; the axis of contact durations is linear below 1 ms and logarithmic above."
)


def _number_rows(row: PeriodsRow) -> list[NumberRow]:
    """Every quantity of a case, and the share of periods with a bounce."""
    found = number_rows(row.case, row.role, row.printed, CANTILEVER, row.forecasts)
    return [*found, NumberRow.probability(row.case, row.role, "periods with a bounce", row.p_bounce)]


_MERITS = (
    ("existence of bounces right", ("existence_right",), "1"),
    ("number of bounces right", ("count_right",), "1"),
    ("cases with a number of bounces", ("count_cases",), "1"),
    ("mean error of the number", ("mean_count_error",), "1"),
    *(
        row
        for what in ("peak", "contact")
        for row in (
            (f"{what}: cases compared", (what, "cases"), "1"),
            (f"{what}: cases with a relative error", (what, "in_means"), "1"),
            (f"{what}: mean error, signed", (what, "mean_signed_percent"), "%"),
            (f"{what}: mean error, absolute", (what, "mean_absolute_percent"), "%"),
            (f"{what}: errors below 30 %", (what, "below_30_percent"), "1"),
        )
    ),
    ("peak within 15 %", ("peak_within_15_percent",), "1"),
    ("contact within 30 % or 1 ms", ("contact_within_30_percent_or_1_ms",), "1"),
)
"""Figures of merit: words, place in a summary, and unit."""

_PARTS = {
    "packaged_rows": "packaged rows alone",
    "added_rows": "rows of the file alone",
    "calibrated_rows": "rows calibrated on",
    "predicted_rows": "rows predicted",
}


def _summary_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Table 2.3 of all rows, then of those parts that there are."""
    parts = [
        ("all rows", summary),
        *((words, summary[key]) for key, words in _PARTS.items() if key in summary),
    ]
    columns = [
        "figure of merit",
        *(
            Column(words, "row", 3)
            for words in ("source's model, measured", "Tarsus, measured", "Tarsus, source's model")
        ),
    ]
    tables = []
    for words, part in parts:
        rows, units = [], []
        for title, place, unit in _MERITS:
            values = [found_at(part[who], place) for who in ("source", "ours", "ours_against_source")]
            if any(value is not None for value in values):
                step = 100.0 if unit == "%" else 1.0
                rows.append((title, *(None if value is None else value / step for value in values)))
                units.append(unit)
        tables.append(Table(f"Table 2.3 for {words} ({part['rows']})", columns, rows, units=units))
    return tables


def _excluded_table(calibration: Mapping[str, Any]) -> Table:
    """Errors of the packaged ensemble over the rows it was fitted to, and over each row excluded from the fit."""
    parts = [("calibrated on", calibration["training"]), ("excluded", calibration["left_out"])]
    known = [(title, part) for title, part in parts if part is not None]
    keys = (
        ("mean_relative_error", "relative error", "%"),
        ("held", "in 80 %", "%"),
        ("brier", "Brier score", "1"),
    )
    columns = [
        "measure",
        *(Column(words, unit, 3, over=title) for title, _ in known for _, words, unit in keys),
    ]
    rows = [
        (name, *(part["measures"][name][key] for _, part in known for key, _, _ in keys))
        for name in calibration["training"]["measures"]
    ]
    note = (
        "The ensemble's medians against the measurement over the rows it was fitted to, and over each row as it was "
        "predicted by a search that never had it: mean absolute relative error, values in the 80 % interval, and the "
        "Brier score of existence (a coin has 0.25)."
    )
    return Table("The ensemble by its calibration", columns, rows, (note, *calibration.get("told", ())))
