"""Rows of a printed table with what a device, or a weighted ensemble of devices, forecasts for them.

A table is compared by naming the packaged study of its conditions and measures: its ensemble predicts the rows
(`tarsus.calibrate.weighted_ensemble`). Errors, figures of merit and skill, tables and files are the same for all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tarsus.calibrate.compared import MODELS, NOTABLE, NumberRow, numbers_table
from tarsus.calibrate.description import TableSampling
from tarsus.calibrate.results import errors_table, naive_by_measure
from tarsus.calibrate.skill import naive_predictions, skill_of
from tarsus.calibrate.weighted_ensemble import WeightedEnsemble
from tarsus.files.library import load_scene
from tarsus.model.scene import Scene, Source
from tarsus.tables import Column, Section, Table
from tarsus_reproduce.ensembles import device_ensemble, packaged_ensemble, packaged_errors, packaged_study
from tarsus_reproduce.reproduction import CALIBRATED, PREDICTED, FigureCall, Progress
from tarsus_reproduce.rows import PrintedQuantity, PrintedRow, PrintedTable

HALF = 0.5
"""A number of bounces is right when it is less than half a bounce off; half a bounce a period is one that exists."""

SOURCE, MINE = MODELS[:2]
SOURCE_COLUMN = f"{MINE}, against the {SOURCE}"
"""Ours against the other model instead of the measurement."""


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

    def predicted(self, ensemble: WeightedEnsemble, printed: PrintedRow) -> tuple[list[NumberRow], tuple[str, ...]]:
        """Every quantity of a row and the share of windows with a bounce; sentences of runs that ended early.

        A star marks a row of a file.
        """
        conditions = ensemble.lowered.study.conditions
        asked = {name: value for name, value in printed.conditions.items() if name in conditions}
        (scene,) = ensemble.scenes([asked])
        if printed.freq_hz is not None and "freq_hz" not in conditions:
            asked |= {f"signals.{name}.frequency": printed.freq_hz for name in scene.signals}
        (found,) = ensemble.predict([asked], sampling=self.sampling)
        period = next(iter(scene.signals.values())).period
        hertz = printed.freq_hz or (1.0 / period if period else math.nan)
        packaged = printed.origin == "packaged"
        case = f"{hertz:.4g} Hz, {printed.words}{'' if packaged else ' *'}"
        known = any(origin.source is Source.CALIBRATED for origin in scene.provenance.values())
        role = CALIBRATED if packaged and printed.measured is not None and known else PREDICTED
        rows = []
        for one in self.table.quantities:
            measured, source = (printed.si(who, one) for who in ("measured", "source"))
            ours = found[one.studied]
            ends = ours.median, ours.low, ours.high
            rows.append(NumberRow(case, role, one.words, one.unit, measured, source, ends, printed.conditions))
        chance = found["bounces"].p_bounce
        share = math.nan if chance is None else chance, math.nan, math.nan
        early = max(one.failed for one in found.values())
        said = (f"{case}: {early:.0%} of the runs ended early",) if early else ()
        return [*rows, NumberRow(case, role, self.share, "%", None, None, share)], said


@dataclass(frozen=True)
class ComparedTable:
    """A table as predicted.

    device: in words; runs: of every row; printed: its rows; numbers: every number of every row; problems: sentences of
    the runs that did not reach their end; calibration: what that of the packaged ensemble says of its errors, None of a
    device that is named.
    """

    how: TableComparison
    device: str
    runs: int
    printed: tuple[PrintedRow, ...]
    numbers: tuple[NumberRow, ...]
    problems: tuple[str, ...]
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
        numbers: list[NumberRow] = []
        problems: list[str] = []
        for done, one in enumerate(printed):
            if progress is not None:
                frequency = "" if one.freq_hz is None else f"{one.freq_hz:g} Hz, "
                progress(done, len(printed), f"{frequency}{one.words}")
            rows, said = how.predicted(ensemble, one)
            numbers += rows
            problems += said
        words = device or (packaged if members == 1 else f"{packaged}, a weighted ensemble of {members}")
        errors = packaged_errors(packaged) if device is None else None
        return cls(how, words, members * each, tuple(printed), tuple(numbers), tuple(problems), errors)

    def section(self, title: str, notes: Sequence[str], caption: str) -> Section:
        """Figures of merit, what the calibration says of each row that was excluded, every number, and their figure."""
        files = dict.fromkeys(row.origin for row in self.printed if row.origin != "packaged")
        stars = [f"* = from {name}." for name in files]
        excluded = () if self.calibration is None else (_excluded_table(self.how.study, self.calibration),)
        shown = numbers_table(f"{title}, row by row", self.numbers, [*notes, *stars])
        figure = FigureCall("tarsus.report.rows_figure.rows_figure", self.numbers, caption)
        return Section(title, figure, merits_table(self.how.table, self.numbers), *excluded, shown)


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
        "close": sum(abs(value) < (HALF if one.count else NOTABLE) for value in values),
        **({"existence_right": sum((ref >= HALF) == (sim >= HALF) for ref, sim in known)} if one.count else {}),
    }


def _pair(row: NumberRow, model: str) -> tuple[float | None, float | None]:
    """What a model is held against, and what it says."""
    if model == SOURCE:
        return row.measured, row.source
    ours = None if math.isnan(row.ours[0]) else row.ours[0]
    return row.source if model == SOURCE_COLUMN else row.measured, ours


def skill_in(one: PrintedQuantity, every: Sequence[NumberRow], part: Sequence[NumberRow], model: str) -> float | None:
    """Skill of a model in some of the rows of a quantity: 1 less its mean error over the least of predictors that know
    the other rows alone, measured or (against the source's model) simulated by the source."""
    known = [row for row in every if _pair(row, model)[0] is not None]
    if len(known) < 2:
        return None
    values = [_pair(row, model)[0] or 0.0 for row in known]
    alike = [name for name in known[0].conditions if all(name in row.conditions for row in known)]
    naive = naive_predictions(np.array(values), [{name: row.conditions[name] for name in alike} for row in known])
    own = {id(row) for row in part}
    errors = {
        k: abs(error)
        for k, row in enumerate(known)
        if id(row) in own and (error := one.error(*_pair(row, model))) is not None
    }
    others = {
        name: [abs(one.error(values[k], float(found[k])) or 0.0) for k in errors] for name, found in naive.items()
    }
    return skill_of(_mean([*errors.values()]), {name: float(np.mean(each)) for name, each in others.items() if each})


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None


def merits_table(table: PrintedTable, numbers: Sequence[NumberRow]) -> Table:
    """Figures of merit of every model by quantity, each with the skill: of all rows, and of those by role where they
    differ."""
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
    keys = ("cases", "close", "existence_right", "mean_error", "mean_absolute_error")
    rows, units = [], []
    for words in ("all rows", CALIBRATED, PREDICTED):
        part = [row for row in numbers if words in ("all rows", row.role)]
        if words != "all rows" and len(part) == len(numbers):
            continue
        for model in (SOURCE, MINE, SOURCE_COLUMN):
            for one in table.quantities:
                every, own = ([row for row in some if row.quantity == one.words] for some in (numbers, part))
                found = merits_of(one, [_pair(row, model) for row in own])
                if found["cases"]:
                    skill = skill_in(one, every, own, model)
                    rows.append((f"{words} ({len(own)})", model, one.words, *map(found.get, keys), skill))
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
        if words != "notes" and part
    }
    return errors_table(summary, "The ensemble by its calibration", (EXCLUDED, *calibration.get("notes", ())))
