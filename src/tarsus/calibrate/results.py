"""Everything a calibration found: as plain data, which `calibration.json` holds, and as tables made from that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.calibrate.cells import column_value
from tarsus.calibrate.compared import NumberRow, relative_error
from tarsus.calibrate.objective import existence
from tarsus.calibrate.prediction import Prediction
from tarsus.calibrate.readings import unit_of
from tarsus.calibrate.search import WITHIN
from tarsus.calibrate.skill import naive_errors, skill_of
from tarsus.files.version import package_version
from tarsus.fit.ranges import weighted_quantile
from tarsus.tables import Column, Table
from tarsus.tables.numbers import number
from tarsus.tables.table import ROW

if TYPE_CHECKING:
    from tarsus.calibrate.calibrating import Calibration
    from tarsus.calibrate.ensemble import HypothesisEnsemble
    from tarsus.calibrate.lowering import Lowered

OPEN = 0.1
"""A choice is open when another option keeps so much of the weight: odds of less than ten to one decide nothing."""


def device_file(place: int) -> str:
    """Name of the device file of a hypothesis that is kept, from 0."""
    return f"branch-{place + 1}.toml"


def options_word(branch: Mapping[str, Any]) -> str:
    """The choices of a hypothesis in words."""
    return ", ".join(f"{choice} {option}" for choice, option in branch["options"].items()) or "the only one"


def prediction_entry(one: Prediction, unit: str, observed: float | None = None) -> dict[str, Any]:
    """A prediction in a column's unit; with the observed value [SI], its error and whether the interval holds it."""
    entry: dict[str, Any] = {
        "unit": unit,
        **{key: column_value(getattr(one, key), unit) for key in ("median", "low", "high")},
        "p_bounce": one.p_bounce,
        "failed": one.failed,
    }
    if observed is not None and np.isfinite(observed):
        entry |= {
            "observed": column_value(observed, unit),
            "error": relative_error(observed, one.median),
            "holds": one.holds(observed),
        }
    return entry


def calibration_json(result: Calibration) -> dict[str, Any]:
    """All numbers of a calibration; nothing of the machine or of time, so that equal studies give equal tables."""
    solution, lowered, study = result.solution, result.lowered, result.lowered.study
    cells, trained = lowered.problem.objective.cells, result.predicted[: len(lowered.trained)]
    return {
        "tarsus": package_version(),
        "study": study.name,
        "device": study.scene.name,
        "seed": study.search.seed,
        "sets": solution.sets,
        "residual_scale": float(np.sqrt(solution.fit.freedom.scale)),
        "effective_unknowns": solution.fit.freedom.unknowns,
        "discrepancy": {
            name: {"sigma": float(s), "existence_wrong": float(w) if e else None}
            for name, s, w, e in zip(
                cells.names, solution.discrepancy.sigma, solution.discrepancy.wrong, cells.exists, strict=True
            )
        },
        "branches": _hypotheses(result),
        "choices": _choices(result),
        "constraints": [{"name": one.name, "reason": one.reason} for one in study.constraints],
        "rows": [_row(result, n, place) for n, place in enumerate((*lowered.trained, *lowered.others))],
        "summary": {
            "training": _summary(result, trained),
            "left_out": None if solution.excluded is None else _summary(result, solution.excluded),
            "best": _summary(result, [_at_best(result, n) for n in range(len(lowered.trained))]),
        },
    }


def _hypotheses(result: Calibration) -> list[dict[str, Any]]:
    solution = result.solution
    places = {b: place for place, b in enumerate(solution.fit.kept)}
    out = []
    for b, one in enumerate(solution.problem.hypotheses):
        found = solution.fit.found[b]
        entry: dict[str, Any] = {"options": one.options, "cost": found.cost, "dropped": found.rejected or None}
        if b in places:
            place = places[b]
            ensemble = solution.fit.ensembles[place]
            entry |= {
                "weight": float(solution.fit.weights[place]),
                "file": device_file(place),
                "members": len(ensemble.weights),
                "doubt": ensemble.doubt,
                "constraints": _limits(result, place),
                "unknowns": _unknowns(result, ensemble),
            }
        out.append(entry)
    return out


def _unknowns(result: Calibration, ensemble: HypothesisEnsemble) -> dict[str, Any]:
    """What an ensemble says of each unknown: the best value, the 90 and 95 % intervals of its members, the verdict."""
    study, unknowns = result.lowered.study, result.solution.problem.unknowns
    values, weights = unknowns.values(ensemble.points), ensemble.weights
    free = sum(one is None for one in unknowns.priors) - len(study.constraints)
    doubted = bool(ensemble.doubt) or bool((result.solution.discrepancy.sigma > MISSED).any())
    doubted |= result.solution.fit.freedom.cells < free  # bounds, not data, then set the ends of some
    out = {}
    for i, one in enumerate(ensemble.ranges(unknowns, doubted=doubted)):
        assert one.verdict is not None
        out[one.name] = {
            "best": one.value,
            "low": weighted_quantile(values[:, i], weights, 0.05),
            "high": weighted_quantile(values[:, i], weights, 0.95),
            "interval_95": (one.low, one.high),
            "unit": one.unit,
            "bounds": [float(unknowns.low[i]), float(unknowns.high[i])],
            "scale": "log" if unknowns.log[i] else "linear",
            "determined": one.verdict.value,
            "meaning": study.unknowns[one.name].meaning,
        }
    return out


def _limits(result: Calibration, place: int) -> list[dict[str, Any]]:
    """Cost of every constraint at the best set: 0 where it is kept."""
    ensemble, objective = result.solution.fit.ensembles[place], result.solution.problem.objective
    costs = objective.pieces(ensemble.readings[:1], ensemble.hypothesis).limits
    return [{"name": one.name, "cost": float(cost[0])} for one, cost in zip(objective.limits, costs, strict=True)]


def _choices(result: Calibration) -> dict[str, dict[str, Any]]:
    out = {}
    for name, weights in result.solution.option_weights().items():
        ranked = sorted(weights.values(), reverse=True)
        meaning = result.lowered.study.choices[name].meaning
        out[name] = {"weights": weights, "open": len(ranked) > 1 and ranked[1] >= OPEN, "meaning": meaning}
    return out


def _conditions(result: Calibration, place: int) -> dict[str, Any]:
    """Cells of a row's conditions."""
    row = result.lowered.table.rows[place]
    return {column: row[column] for column in result.lowered.study.conditions}


def _row(result: Calibration, n: int, place: int) -> dict[str, Any]:
    """A row of the table, and what is said of it by measure: None where nothing is."""
    cells, excluded, fitted = result.lowered.cells, result.solution.excluded, n < len(result.lowered.trained)
    said: dict[str, Sequence[Prediction] | None] = {"training" if fitted else "predicted": result.predicted[n]}
    if fitted:
        said["left_out"] = None if excluded is None else excluded[n]
    entries = {
        what: found
        and {
            name: prediction_entry(one, unit, value)
            for name, unit, one, value in zip(cells.names, cells.units, found, cells.observed[n].tolist(), strict=True)
        }
        for what, found in said.items()
    }
    return {"row": place + 1, "conditions": _conditions(result, place), "fitted": fitted, **entries}


def compared_rows(result: Calibration) -> list[NumberRow]:
    """Every number of the table with the median of the ensemble that was fitted to it, and as ours what the search
    without its row says, where there is one; and the probability that there is some of what may not exist."""
    lowered, excluded, out = result.lowered, result.solution.excluded, []
    cells, units = lowered.cells, [unit_of(one.measure) for one in lowered.study.measures.values()]
    for n, place in enumerate((*lowered.trained, *lowered.others)):
        case = f"{place + 1}: {', '.join(_conditions(result, place).values())}"
        fitted = n < len(lowered.trained)
        held_out = excluded[n] if fitted and excluded is not None else None
        role = "predicted" if not fitted else "fitted" if held_out is None else "excluded"
        values = zip(cells.observed[n].tolist(), result.predicted[n], held_out or result.predicted[n], strict=True)
        for unit, (measured, known, new) in zip(units, values, strict=True):
            about, measured = (case, role, new.measure), None if np.isnan(measured) else measured
            ours = new.median, new.low, new.high
            out.append(NumberRow(*about, unit, measured, known.median if fitted else None, ours))
            if new.p_bounce is not None:
                out.append(
                    NumberRow(case, role, f"{new.measure} above 0", "%", None, None, (new.p_bounce, np.nan, np.nan))
                )
    return out


def _at_best(result: Calibration, n: int) -> list[Prediction]:
    """What the best set of all gives in a fitted row: the mean of its windows, without an interval."""
    best, cells = result.solution.fit.best, result.lowered.problem.objective.cells
    read = np.asarray(best.readings[0, n][list(best.hypothesis.columns)], dtype=float)
    there = existence(read)
    means = np.where(np.isinf(read).any(axis=-1), np.nan, np.nan_to_num(read, posinf=0.0).mean(axis=-1))
    return [
        Prediction(name, value, value, value, p if judged else None, float(np.isnan(value)))
        for name, value, p, judged in zip(cells.names, means.tolist(), there.tolist(), cells.exists, strict=True)
    ]


def _summary(result: Calibration, predictions: Sequence[Sequence[Prediction]]) -> dict[str, Any]:
    """By measure: mean relative and absolute errors, share of values in their intervals, Brier score, rows whose
    existence is more likely right than wrong, and the skill against predictors that know nothing, with their errors."""
    cells, known = result.lowered.problem.objective.cells, naive_by_measure(result.lowered)
    out: dict[str, Any] = {}
    holds_all: list[bool] = []
    for k, (name, unit) in enumerate(zip(cells.names, cells.units, strict=True)):
        pairs = [(one[k], float(o)) for one, o in zip(predictions, cells.observed[:, k], strict=True) if np.isfinite(o)]
        holds = [one.holds(o) for one, o in pairs if one.low < one.high]
        holds_all += holds
        above = [abs(one.median / o - 1.0) for one, o in pairs if o > 0.0]
        naive = known[name]
        brier = [(one.p_bounce - (o > 0.0)) ** 2 for one, o in pairs if one.p_bounce is not None]
        entry: Mapping[str, Any] = {
            "cells": len(pairs),
            "existence_right": None
            if not cells.exists[k]
            else sum((one.p_bounce or 0.0) > 0.5 for one, o in pairs if o > 0.0)
            + sum((one.p_bounce or 0.0) < 0.5 for one, o in pairs if o == 0.0),
            "mean_relative_error": _mean(above),
            "naive": naive,
            "skill": skill_of(_mean(above), naive),
            "mean_absolute_error": _mean([abs(column_value(one.median - o, unit)) for one, o in pairs]),
            "unit": unit,
            "held": _mean(holds),
            "brier": _mean(brier),
        }
        out[name] = entry
    return {"measures": out, "held": _mean(holds_all)}


def naive_by_measure(lowered: Lowered) -> dict[str, dict[str, float]]:
    """Errors of predictors that know the other fitted rows alone (`naive_errors`), by measure."""
    cells, rows = lowered.problem.objective.cells, lowered.forward.variants[0].rows
    conditions = [row.cells for row in rows[: len(lowered.trained)]]
    return {name: naive_errors(cells.observed[:, k], conditions) for k, name in enumerate(cells.names)}


def _mean(values: Sequence[float] | Sequence[bool]) -> float | None:
    return float(np.mean(values)) if len(values) else None


MISSED = 2.0
"""Tolerances by which a model misses a column at least that it does not describe: by chance one in a thousand tables of
seven rows. With damping held 10 % too high the gain was *determined* of 24 tables of a resonance, and wrong of 19; of
those 6 stay below it."""


def calibration_table(numbers: Mapping[str, Any]) -> Table:
    """Hypotheses, what is said of the unknowns of each that is kept, and errors, from the numbers of
    `calibration_json`."""
    ranked = sorted(numbers["branches"], key=lambda one: one["cost"])
    kept = [one for one in ranked if not one["dropped"]]
    notes = [
        f"A hypothesis is kept when its cost is within {WITHIN:g} residual scales of the best (a likelihood ratio of "
        f"20 to 1); the scale is the square of {number(numbers['residual_scale'], 3)} tolerances, for "
        f"{number(numbers['effective_unknowns'], 3)} unknowns that the table's cells determine. Seed {numbers['seed']}."
    ]
    for name, one in numbers["choices"].items():
        weights = ", ".join(f"{option} {weight:.2f}" for option, weight in one["weights"].items())
        notes.append(f"{name}: {weights} ({'open' if one['open'] else 'decided'}). {one['meaning']}".strip())
    notes += [f"Known besides the table: {one['name']}. {one['reason']}".strip() for one in numbers["constraints"]]
    notes.append(
        "Determined: the 95 % interval reaches no farther than a quarter to either side, and the data set both ends; "
        "preferred: it is as narrow, but the search was too short, or the model misses a column by more than "
        f"{MISSED:g} tolerances, or has more unknowns than cells; undecided: it reaches farther, or a bound of the "
        "search set an end; assumed: its spread is that of its prior."
    )
    notes += [
        f"The search of the hypothesis {options_word(one)} was too short: {one['doubt']}."
        for one in kept
        if one["doubt"]
    ]
    rows = [
        (options_word(one), one["cost"], one.get("weight"), one.get("file") or one["dropped"], _broken(one))
        for one in ranked
    ]
    columns = ("hypothesis", "cost", Column("weight", digits=2), "device", "constraints")
    title = f"{numbers['study']}: {numbers['sets']} sets, {len(kept)} of {len(ranked)} hypotheses kept"
    sigmas = "; ".join(f"{name} {one['sigma']:.2f}" for name, one in numbers["discrepancy"].items())
    spread = f"Intervals are of unknowns, windows, draws and the model's discrepancy, in tolerances: {sigmas}."
    missed = [
        f"The model misses {name} by {number(one['sigma'], 2)} tolerances: it lacks something, or the tolerance, "
        "the unit or the measure of the column is another."
        for name, one in numbers["discrepancy"].items()
        if one["sigma"] > MISSED
    ]
    parts = (*map(unknowns_table, kept), errors_table(numbers["summary"], notes=(spread, *missed)))
    return Table(title, columns, rows, notes, parts)


def _broken(branch: Mapping[str, Any]) -> str | None:
    """Constraints that the best set of a hypothesis does not keep, with their costs; None for a rejected one."""
    if "constraints" not in branch:
        return None
    broken = [f"{one['name']}: {one['cost']:.2g}" for one in branch["constraints"] if one["cost"] > 0.0]
    return "; ".join(broken) or "kept"


def unknowns_table(branch: Mapping[str, Any]) -> Table:
    """What is said of the unknowns of a hypothesis that is kept, with what each of them is."""
    found = branch["unknowns"]
    columns = (
        "unknown",
        Column("best", ROW),
        *(Column(name, ROW, 3) for name in ("95 % interval", "bounds")),
        "the data say",
    )
    rows = [
        (
            f"{name}\n{one['meaning']}".strip(),
            one["best"],
            tuple(one["interval_95"]),
            tuple(one["bounds"]),
            one["determined"],
        )
        for name, one in found.items()
    ]
    return Table(
        f"unknowns of the hypothesis {options_word(branch)}",
        columns,
        rows,
        units=[one["unit"] for one in found.values()],
    )


def errors_table(summary: Mapping[str, Any], title: str = "errors", notes: Sequence[str] = ()) -> Table:
    """Errors by measure, of the fitted and of the excluded rows and of the best set."""
    found = sorted(
        (name, what.replace("_", " ").replace("left out", "excluded"), one)
        for what, part in summary.items()
        for name, one in (part or {"measures": {}})["measures"].items()
    )
    columns = (
        "measure",
        "rows",
        "cells",
        Column("mean relative error", "%", 2),
        Column("skill", digits=2),
        Column("mean error", ROW, 3),
        Column("in 80 % interval", "%", 2),
        Column("Brier score", digits=2),
    )
    keys = ("cells", "mean_relative_error", "skill", "mean_absolute_error", "held", "brier")
    rows = [(name, what, *(one.get(key) for key in keys)) for name, what, one in found]
    said = "skill: 1 less the error over the least of predictors that know the other rows alone"
    return Table(title, columns, rows, [said, *notes], units=[one["unit"] for *_, one in found])
