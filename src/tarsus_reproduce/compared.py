"""Rows of a printed table beside what a device, or a weighted ensemble of devices, forecasts for them.

A table is compared by naming the packaged study of its conditions and measures: its ensemble predicts the rows
(`tarsus.calibrate.weighted_ensemble`). Errors, figures of merit and skill, tables and files are the same for all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tarsus.calibrate.description import TableSampling
from tarsus.calibrate.prediction import Prediction
from tarsus.calibrate.results import errors_table, naive_by_measure
from tarsus.calibrate.skill import naive_predictions, skill_of
from tarsus.calibrate.weighted_ensemble import WeightedEnsemble
from tarsus.files.library import load_scene
from tarsus.model.scene import Scene, Source
from tarsus.tables import Column, Section, Table
from tarsus_reproduce.ensembles import device_ensemble, packaged_ensemble, packaged_errors, packaged_study
from tarsus_reproduce.reproduction import CALIBRATED, PREDICTED, FigureCall, NumberRow, Progress, numbers_table
from tarsus_reproduce.rows import PrintedQuantity, PrintedRow, PrintedTable

GOOD = 0.30
"""Relative error below which Table 2.3 counts a case as good."""
HALF = 0.5
"""A number of bounces is right when it is less than half a bounce off; half a bounce a period is one that exists."""

MINE, SOURCE, SOURCE_COLUMN = "ours", "source", "ours_against_source"
"""Models of a row, by their names in files; the last is ours against the source's model instead of the measurement."""
_MODELS = {SOURCE: "source's model", MINE: "Tarsus", SOURCE_COLUMN: "Tarsus, against the source's model"}


@dataclass(frozen=True)
class TableComparison:
    """How a printed table is compared.

    study: the packaged study of the same conditions and measures; driven: a device under the conditions of a row;
    sampling: windows and initial states of its runs; share: words for the share of windows with a bounce.
    """

    table: PrintedTable
    study: str
    driven: Callable[[Scene, Mapping[str, Any]], Scene]
    sampling: TableSampling
    share: str

    def row(self, ensemble: WeightedEnsemble, printed: PrintedRow) -> ComparedRow:
        """Predict a row."""
        conditions = ensemble.lowered.study.conditions
        asked = {name: value for name, value in printed.conditions.items() if name in conditions}
        (scene,) = ensemble.scenes([asked])
        if printed.freq_hz is not None and "freq_hz" not in conditions:
            asked |= {f"signals.{name}.frequency": printed.freq_hz for name in scene.signals}
        (found,) = ensemble.predict([asked], sampling=self.sampling)
        period = next(iter(scene.signals.values())).period
        early = max(one.failed for one in found.values())
        fitted = printed.origin == "packaged" and printed.measured is not None and _calibrated(scene)
        return ComparedRow(
            printed,
            printed.freq_hz or (1.0 / period if period else math.nan),
            {one.key: found[one.studied] for one in self.table.quantities},
            found["bounces"].p_bounce,
            CALIBRATED if fitted else PREDICTED,
            (f"{early:.0%} of the runs ended early",) if early else (),
        )


def _calibrated(scene: Scene) -> bool:
    """Whether any number of a device was calibrated."""
    return any(origin.source is Source.CALIBRATED for origin in scene.provenance.values())


@dataclass(frozen=True)
class ComparedRow:
    """A row, and our predictions [SI] by key of the table's quantities.

    freq_hz: drive frequency [Hz] of the best member; p_bounce: probability of a bounce in a period or window; role:
    whether the device was calibrated on this row; problems: sentences of runs that did not reach their end.
    """

    printed: PrintedRow
    freq_hz: float
    ours: Mapping[str, Prediction]
    p_bounce: float | None
    role: str
    problems: tuple[str, ...]

    @property
    def case(self) -> str:
        """The drive in words; a star marks a row of a file."""
        star = "" if self.printed.origin == "packaged" else " *"
        return f"{self.freq_hz:.4g} Hz, {self.printed.words}{star}"

    def pair(self, one: PrintedQuantity, model: str) -> tuple[float | None, float | None]:
        """What a model is held against, and what it says of a quantity, in the table's units."""
        measured, source = (self.printed.seen(who, one) for who in ("measured", "source"))
        if model == SOURCE:
            return measured, source
        return source if model == SOURCE_COLUMN else measured, one.plain(self.ours[one.key])["median"]

    def to_dict(self, table: PrintedTable) -> dict[str, Any]:
        """Plain data, in the table's units."""
        printed, every = self.printed, table.quantities
        return {
            **printed.conditions,
            "freq_hz": self.freq_hz,
            "origin": printed.origin,
            "role": self.role,
            "source": printed.source,
            "measured": printed.measured,
            MINE: {one.key: one.plain(self.ours[one.key]) for one in every},
            "p_bounce": self.p_bounce,
            "errors": {name: {one.key: one.error(*self.pair(one, name)) for one in every} for name in _MODELS},
            "problems": list(self.problems),
        }

    def numbers(self, how: TableComparison) -> list[NumberRow]:
        """Every quantity in SI, and the share of windows with a bounce."""
        rows = []
        for one in how.table.quantities:
            values = (self.printed.seen(who, one) for who in ("measured", "source"))
            measured, source = (None if value is None else value / one.factor for value in values)
            ours = self.ours[one.key]
            ends = ours.median, ours.low, ours.high
            rows.append(NumberRow(self.case, self.role, one.words, one.unit, measured, source, ends))
        chance = math.nan if self.p_bounce is None else self.p_bounce
        return [*rows, NumberRow(self.case, self.role, how.share, "%", None, None, (chance, math.nan, math.nan))]


@dataclass(frozen=True)
class ComparedTable:
    """A table as predicted.

    device: in words; runs: of every row; calibration: what that of the packaged ensemble says of its errors, None of a
    device that is named.
    """

    how: TableComparison
    device: str
    runs: int
    rows: tuple[ComparedRow, ...]
    calibration: Mapping[str, Any] | None

    @classmethod
    def of(
        cls,
        how: TableComparison,
        packaged: str,
        device: str | None,
        printed: Sequence[PrintedRow],
        progress: Progress | None = None,
        *,
        draws: int = 1,
    ) -> ComparedTable:
        """Rows predicted by a device, or by the ensemble of the packaged one where none is named; draws: initial states
        of every row, shared out over the members, one each at least."""
        own = None if device is not None else packaged_ensemble(packaged)
        ensemble = own or device_ensemble(how.study, load_scene(device or packaged), how.driven)
        members = sum(len(one.weights) for one in ensemble.ensembles)
        each = math.ceil(draws / members)
        how = replace(how, sampling=how.sampling.model_copy(update={"draws": each}))
        done: list[ComparedRow] = []
        for one in printed:
            if progress is not None:
                frequency = "" if one.freq_hz is None else f"{one.freq_hz:g} Hz, "
                progress(len(done), len(printed), f"{frequency}{one.words}")
            done.append(how.row(ensemble, one))
        words = device or (packaged if members == 1 else f"{packaged}, a weighted ensemble of {members}")
        return cls(how, words, members * each, tuple(done), packaged_errors(packaged) if device is None else None)

    @property
    def problems(self) -> tuple[str, ...]:
        """Sentences of the runs that did not reach their end."""
        return tuple(f"{row.case}: {one}" for row in self.rows for one in row.problems)

    @property
    def numbers(self) -> list[NumberRow]:
        """Every number of every row."""
        return [number for row in self.rows for number in row.numbers(self.how)]

    def to_dict(self) -> dict[str, Any]:
        """Plain data: lengths in um, times in ms, rates in 1/s."""
        table = self.how.table
        return {
            "device": self.device,
            "runs": self.runs,
            "ok": not self.problems,
            "rows": [row.to_dict(table) for row in self.rows],
            "summary": summary_of(table, self.rows),
        }

    def section(self, title: str, notes: Sequence[str], caption: str) -> Section:
        """Figures of merit, what the calibration says of each row that was excluded, every number, and their figure."""
        files = dict.fromkeys(row.printed.origin for row in self.rows if row.printed.origin != "packaged")
        stars = [f"* = from {name}." for name in files]
        excluded = () if self.calibration is None else (_excluded_table(self.how.study, self.calibration),)
        merits = merits_table(self.how.table, summary_of(self.how.table, self.rows))
        shown = numbers_table(f"{title}, row by row", self.numbers, [*notes, *stars])
        return Section(
            title, FigureCall("numbers_figure.numbers_figure", self.numbers, caption), merits, *excluded, shown
        )


# Figures of merit


def merits_of(one: PrintedQuantity, pairs: Sequence[tuple[float | None, float | None]]) -> dict[str, Any]:
    """Table 2.3 of a quantity, of numbers and what is said of them: `mean_error` signed, `mean_absolute_error`, and how
    many of the `cases` are `close`: less than half a bounce off, or by less than 30 %.

    `in_means` of the cases have an error. A case without one (something against a measured 0) is a miss: it counts
    among the cases and is not close. Of counts `existence_right` says how often there is a bounce where there is one.
    """
    known = [(ref, sim) for ref, sim in pairs if ref is not None and sim is not None]
    values = [error for ref, sim in known if (error := one.error(ref, sim)) is not None]
    return {
        "cases": len(known),
        "in_means": len(values),
        "mean_error": None if one.count else _mean(values),
        "mean_absolute_error": _mean([abs(value) for value in values]),
        "close": sum(abs(value) < (HALF if one.count else GOOD) for value in values),
        **({"existence_right": sum((ref >= HALF) == (sim >= HALF) for ref, sim in known)} if one.count else {}),
    }


def skill_in(
    one: PrintedQuantity, every: Sequence[PrintedRow], part: Sequence[ComparedRow], model: str
) -> float | None:
    """Skill of a model in some of the rows: 1 less its mean error over the least of predictors that know the other rows
    alone, measured or (against the source's model) simulated by the source."""
    who = "source" if model == SOURCE_COLUMN else "measured"
    rows = [row for row in every if row.seen(who, one) is not None]
    if len(rows) < 2:
        return None
    values = [row.seen(who, one) or 0.0 for row in rows]
    naive = naive_predictions(np.array(values), [_alike(row, rows) for row in rows])
    known = {
        rows.index(row.printed): abs(error)
        for row in part
        if row.printed in rows and (error := one.error(*row.pair(one, model))) is not None
    }
    others = {name: [abs(one.error(values[k], float(found[k])) or 0.0) for k in known] for name, found in naive.items()}
    return skill_of(_mean([*known.values()]), {name: float(np.mean(each)) for name, each in others.items() if each})


def _alike(row: PrintedRow, rows: Sequence[PrintedRow]) -> dict[str, Any]:
    """Conditions of a row that all of the rows have."""
    return {name: row.conditions[name] for name in row.conditions if all(name in one.conditions for one in rows)}


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None


def summary_of(table: PrintedTable, rows: Sequence[ComparedRow]) -> dict[str, Any]:
    """Figures of merit of every model by quantity, with its skill: of all rows, and of those by role and by origin
    where they differ."""
    parts = {
        "all rows": list(rows),
        "calibrated on": [row for row in rows if row.role == CALIBRATED],
        "predicted": [row for row in rows if row.role == PREDICTED],
        "of the table": [row for row in rows if row.printed.origin == "packaged"],
        "of the file": [row for row in rows if row.printed.origin != "packaged"],
    }
    every, out = [row.printed for row in rows], {}
    for words, part in parts.items():
        if not part or (words != "all rows" and len(part) == len(rows)):
            continue
        out[words] = {"rows": len(part)} | {
            model: {
                one.key: merits_of(one, [row.pair(one, model) for row in part])
                | {"skill": skill_in(one, every, part, model)}
                for one in table.quantities
            }
            for model in _MODELS
        }
    return out


# What is shown


def merits_table(table: PrintedTable, summary: Mapping[str, Any]) -> Table:
    """Figures of merit with the skill beside each."""
    columns = (
        "rows",
        "model",
        "quantity",
        "cases",
        "close",
        "bounces exist, right",
        Column("mean error", "row", 3),
        Column("its size", "row", 3),
        Column("skill", digits=2),
    )
    keys = ("cases", "close", "existence_right", "mean_error", "mean_absolute_error", "skill")
    rows, units = [], []
    for words, part in summary.items():
        for model in _MODELS:
            for one in table.quantities:
                found = part[model][one.key]
                if found["cases"]:
                    rows.append((f"{words} ({part['rows']})", _MODELS[model], one.words, *map(found.get, keys)))
                    units.append("1" if one.count else "%")
    notes = (
        "Close: an error below 30 %, of a number of bounces below one half. Mean errors are signed, and by their size.",
        "Skill is 1 less the mean size of the error over the least of predictors that know the other rows alone: their "
        "mean, the nearest row, a power law through them. A skill of 0 knows as little; below 0 it knows less.",
    )
    return Table("Figures of merit, as in Table 2.3", columns, rows, notes, units=units)


EXCLUDED = (
    "Medians against the measurement: 'training' over the rows it was fitted to, 'excluded' over each row as it was "
    "predicted by a search that never had it, 'best' of the best set alone. A coin has a Brier score of 0.25."
)


def _excluded_table(study: str, calibration: Mapping[str, Any]) -> Table:
    """What the calibration of a packaged study says of its errors, with skill against the packaged rows."""
    naive = naive_by_measure(packaged_study(study))

    def known(name: str, found: Mapping[str, Any]) -> dict[str, Any]:
        return {**found, "skill": skill_of(found["mean_relative_error"], naive[name])}

    summary = {
        words: {"measures": {name: known(name, one) for name, one in part["measures"].items()}}
        for words, part in calibration.items()
        if words != "told" and part
    }
    return errors_table(summary, "The ensemble by its calibration", (EXCLUDED, *calibration.get("told", ())))
