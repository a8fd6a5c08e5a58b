"""The micro-cantilever under periodic drive, case by case (Tables A.1 and 2.3 of the source)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.calibrate.prediction import Miss
from tarsus.files.library import changed
from tarsus.measure import Counting, by_window, histories_of
from tarsus_reproduce.cases import Case, Observation, packaged_cases, read_cases, relative_error
from tarsus_reproduce.mixtures import packaged_errors, packaged_members, packaged_misses
from tarsus_reproduce.predictions import Floats, Member, Prediction, Samples, members_of, predict, role_of

SETTLING_TIME, SETTLING_PERIODS = 0.1, 4
"""Transients that are dropped: this long [s] and at least so many drive periods."""
SEEN_TIME, SEEN_PERIODS = 0.4, 12
"""What is measured afterwards: this long [s] and at least so many drive periods."""

GOOD = 0.30
"""Relative error below which Table 2.3 counts a case as good."""

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Errors:
    """Relative errors (measured - simulated)/measured; None where there is none.

    `count` is the absolute difference of bounces per period [-]; the others are fractions.
    """

    count: float | None
    peak: float | None
    contact: float | None


@dataclass(frozen=True)
class Predictions:
    """What our device says of one case per drive period: bounces [-], peak [um], contact [ms]."""

    bounces: Prediction
    peak_um: Prediction
    contact_ms: Prediction

    @property
    def medians(self) -> Observation:
        """The medians, which are what is compared with a table."""
        return Observation(self.bounces.median, self.peak_um.median, self.contact_ms.median)

    def to_dict(self) -> dict[str, dict[str, float | None]]:
        """Plain data."""
        return {name: getattr(self, name).to_dict() for name in ("bounces", "peak_um", "contact_ms")}


@dataclass(frozen=True)
class Row:
    """One case and our prediction over `periods` drive periods after transients of every member.

    p_bounce: probability of a bounce in a drive period; role: whether the device was calibrated on this row; codes: of
    the runs that did not reach their end.
    """

    case: Case
    predictions: Predictions
    p_bounce: float | None
    periods: int
    role: str
    codes: tuple[str, ...]

    @property
    def ours(self) -> Observation:
        """Medians of our prediction."""
        return self.predictions.medians

    @property
    def ok(self) -> bool:
        """True when every member's run reached its end."""
        return not self.codes

    @property
    def source_errors(self) -> Errors:
        """The source's model against the measurement."""
        return errors(self.case.measured, self.case.source)

    @property
    def our_errors(self) -> Errors:
        """Our model against the measurement."""
        return errors(self.case.measured, self.ours)

    @property
    def errors_to_source(self) -> Errors:
        """Our model against the source's model."""
        return errors(self.case.source, self.ours)


@dataclass(frozen=True)
class CantileverReproduction:
    """All rows for one device, or a mixture of them.

    calibration: for the packaged mixture what its calibration says of the fitted rows and of each row left out (see
    `tarsus_reproduce.mixtures.packaged_errors`).
    """

    device: str
    rows: tuple[Row, ...]
    calibration: dict[str, Any] | None = None

    @property
    def ok(self) -> bool:
        """True when every row's simulation ended well."""
        return all(row.ok for row in self.rows)

    def summary(self) -> dict[str, Any]:
        """Table 2.3 for both models; also for packaged and added rows apart, and for those that were calibrated on and
        those that are predicted, when there are both."""
        whole = summarise(self.rows)
        given = [row for row in self.rows if row.case.origin == "packaged"]
        added = [row for row in self.rows if row.case.origin != "packaged"]
        if given and added:
            whole |= {"packaged_rows": summarise(given), "added_rows": summarise(added)}
        fitted = [row for row in self.rows if row.role == "calibrated on"]
        predicted = [row for row in self.rows if row.role == "predicted"]
        if fitted and predicted:
            whole |= {"calibrated_rows": summarise(fitted), "predicted_rows": summarise(predicted)}
        return whole

    def to_dict(self) -> dict[str, Any]:
        """Plain data: `device`, `rows`, `summary`, and `calibration` for the packaged mixture; lengths in um and times
        in ms, as in the table."""
        return {
            "device": self.device,
            "ok": self.ok,
            "rows": [_plain(row) for row in self.rows],
            "summary": self.summary(),
        }


def reproduce_cantilever(
    device: str | Sequence[Member] | None = None,
    rows: str | Path | None = None,
    progress: Progress | None = None,
) -> CantileverReproduction:
    """Simulate every row of Table A.1, and of a rows file, with a device or a mixture of devices.

    Parameters
    ----------
    device
        name or file of a device with one drive and one foot, or a mixture of devices; the packaged mixture of the
        cantilever's calibration when left out.
    rows
        a file of additional rows in the format of the packaged table (see `tarsus_reproduce.cases.read_cases`).
    progress
        called as `progress(done, total, what)`.

    Raises
    ------
    InputError
        for an unknown device or a bad rows file.
    """
    members = members_of(packaged_members("cantilever") if device is None else device)
    misses = packaged_misses("cantilever") if device is None else {}
    cases = packaged_cases() + (read_cases(rows) if rows is not None else [])
    done: list[Row] = []
    for number, case in enumerate(cases):
        if progress is not None:
            progress(number, len(cases), f"{case.freq_hz:g} Hz, {case.volt_v:g} V, {case.wave}")
        done.append(simulate_case(members, case, misses))
    name = device if isinstance(device, str) else f"cantilever, a mixture of {len(members)}"
    return CantileverReproduction(
        name, tuple(done), packaged_errors("cantilever") if device is None else None
    )


def periods_of(freq_hz: float) -> tuple[int, int]:
    """Drive periods that are dropped as transient, and that are measured, at a drive frequency [Hz]."""
    dropped = max(SETTLING_PERIODS, math.ceil(SETTLING_TIME * freq_hz))
    seen = max(SEEN_PERIODS, math.ceil(SEEN_TIME * freq_hz))
    return dropped, seen


def errors(reference: Observation, simulated: Observation) -> Errors:
    """Relative errors (reference - simulated)/reference, the definition of Tables 2.3 and A.1.

    0 against 0 is no error; anything else against 0, or against an empty cell, has none (None).
    """
    count = None
    if reference.bounces is not None and simulated.bounces is not None:
        count = abs(reference.bounces - simulated.bounces)
    return Errors(
        count=count,
        peak=relative_error(reference.peak_um, simulated.peak_um),
        contact=relative_error(reference.contact_ms, simulated.contact_ms),
    )


def summarise(rows: Sequence[Row]) -> dict[str, Any]:
    """Table 2.3 for both models against the measurement, and our model against the source's."""
    measured = [row.case.measured for row in rows]
    source = [row.case.source for row in rows]
    ours = [row.ours for row in rows]
    return {
        "rows": len(rows),
        "source": compare(measured, source),
        "ours": compare(measured, ours),
        "ours_against_source": compare(source, ours) | _closeness(source, ours),
    }


def compare(reference: Sequence[Observation], simulated: Sequence[Observation]) -> dict[str, Any]:
    """One column of Table 2.3, with absolute means beside the signed ones; errors in percent.

    A count is right when it is less than half a bounce off; existence means at least half a bounce a period.
    """
    counts = [
        (ref.bounces, sim.bounces)
        for ref, sim in zip(reference, simulated, strict=True)
        if ref.bounces is not None and sim.bounces is not None
    ]
    table: dict[str, Any] = {
        "existence_right": sum((ref >= 0.5) == (sim >= 0.5) for ref, sim in counts),
        "count_right": sum(abs(ref - sim) < 0.5 for ref, sim in counts),
        "count_cases": len(counts),
        "mean_count_error": _mean([abs(ref - sim) for ref, sim in counts]),
    }
    pairs = list(zip(reference, simulated, strict=True))
    table["peak"] = _merits([(ref.peak_um, sim.peak_um) for ref, sim in pairs])
    table["contact"] = _merits([(ref.contact_ms, sim.contact_ms) for ref, sim in pairs])
    return table


def simulate_case(members: Sequence[Member], case: Case, misses: Mapping[str, Miss] | None = None) -> Row:
    """Simulate one case with every member, and take it apart by drive period after transients.

    misses: what the mixture is known to miss of "bounces", "peak" and "contact"; nothing where it is left out.
    """
    from tarsus.solve import simulate

    dropped, seen = periods_of(case.freq_hz)
    period = 1.0 / case.freq_hz
    edges = np.array([period * k for k in range(dropped, dropped + seen + 1)], dtype=np.float64)
    parts: dict[str, list[tuple[float, Floats]]] = {name: [] for name in _UNITS}
    codes: list[str] = []
    for member in members:
        scene = changed(member.scene, volts=case.volt_v, hz=case.freq_hz, wave=case.wave)
        run = simulate(scene, duration=(dropped + seen) * period)
        if not run.ok:
            codes.append(str(run.code.value))
        rows = by_window(histories_of(run), edges, Counting.of(period), _UNITS)
        for name, of_member in parts.items():
            whole = edges[1:] <= run.end_time * (1.0 + 1e-9)  # a run that stopped early has fewer periods
            of_member.append((member.weight, rows[name][0][whole]))
    samples = {name: Samples.joined(of_member) for name, of_member in parts.items()}
    known = misses or {}
    found = Predictions(
        *(predict(samples[name], known.get(column)).scaled(unit) for name, (column, unit) in _UNITS.items())
    )
    chance = samples["bounces"].share(1.0, known.get("bounces"))
    return Row(case, found, chance, seen, role_of(members, case.origin, bool(case.measured)), tuple(codes))


_UNITS = {"bounces": ("bounces", 1.0), "peak": ("peak", 1e6), "contact_duration": ("contact", 1e3)}
"""Measure -> its name in the study, and the factor to the unit of the table."""


def _merits(pairs: Sequence[tuple[float | None, float | None]]) -> dict[str, Any]:
    """Errors of one quantity over (reference, simulated) pairs.

    `cases` have both values; `in_means` of them have a relative error. A case without one (something against
    a measured 0) is a miss: it counts among the cases and is not below 30 %.
    """
    known = [(ref, sim) for ref, sim in pairs if ref is not None and sim is not None]
    values = [value for value in (relative_error(ref, sim) for ref, sim in known) if value is not None]
    return {
        "cases": len(known),
        "in_means": len(values),
        "mean_signed_percent": _percent(_mean(values)),
        "mean_absolute_percent": _percent(_mean([abs(value) for value in values])),
        "below_30_percent": sum(abs(value) < GOOD for value in values),
    }


def _closeness(source: Sequence[Observation], ours: Sequence[Observation]) -> dict[str, int]:
    """How many cases come close to the source's model: peaks within 15 %, contact within 30 % or 1 ms."""
    peaks = contacts = 0
    for ref, sim in zip(source, ours, strict=True):
        pair = errors(ref, sim)
        peaks += pair.peak is not None and abs(pair.peak) <= 0.15
        if ref.contact_ms is not None and sim.contact_ms is not None:
            near = abs(ref.contact_ms - sim.contact_ms) <= 1.0
            contacts += near or (pair.contact is not None and abs(pair.contact) <= GOOD)
    return {"peak_within_15_percent": peaks, "contact_within_30_percent_or_1_ms": contacts}


def _plain(row: Row) -> dict[str, Any]:
    case = row.case
    return {
        "freq_hz": case.freq_hz,
        "volt_v": case.volt_v,
        "wave": case.wave,
        "origin": case.origin,
        "role": row.role,
        "source": asdict(case.source) if case.source else None,
        "measured": asdict(case.measured) if case.measured else None,
        "ours": row.predictions.to_dict(),
        "p_bounce": row.p_bounce,
        "periods": row.periods,
        "errors": {
            "source": asdict(row.source_errors),
            "ours": asdict(row.our_errors),
            "ours_against_source": asdict(row.errors_to_source),
        },
        "problems": list(row.codes),
    }


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value
