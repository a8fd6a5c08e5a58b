"""Everything a calibration found, as plain data: what `calibration.json`, the report and the terminal show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tarsus.calibrate.calibrating import Calibrated
from tarsus.calibrate.cells import column_value
from tarsus.calibrate.leaveout import LeftOut
from tarsus.calibrate.lowering import Lowered
from tarsus.calibrate.objective import existence
from tarsus.calibrate.prediction import INTERVAL, Prediction
from tarsus.files.version import package_version

__all__ = ["OPEN", "calibration_table", "device_file", "found_sentence", "options_word", "prediction_entry"]

OPEN = 0.1
"""A choice is open when another option keeps so much of the weight: odds of less than ten to one decide nothing."""


def device_file(place: int) -> str:
    """Name of the device file of a kept branch, from 0."""
    return f"branch-{place + 1}.toml"


def options_word(branch: Mapping[str, Any]) -> str:
    """The choices of a branch of the table in words."""
    return ", ".join(f"{choice} {option}" for choice, option in branch["options"].items()) or "the only one"


def found_sentence(branch: Mapping[str, Any]) -> str:
    """How the sets of a kept branch of the table were found, in words."""
    found = branch["found"]
    ways = ", ".join(f"{count} by {way}" for way, count in found["members"].items())
    return f"The best set was found by {found['best']}; of all {branch['members']} members {ways}."


def prediction_entry(one: Prediction, unit: str, observed: float | None = None) -> dict[str, Any]:
    """A prediction in a column's unit; with the observed value [SI], its error and whether the interval holds it."""
    entry: dict[str, Any] = {
        "unit": unit,
        **{key: column_value(getattr(one, key), unit) for key in ("median", "low", "high")},
        "p_bounce": one.p_bounce,
        "several_modes": one.modes,
        "decidable": one.decidable,
        "failed": one.failed,
    }
    if observed is not None and np.isfinite(observed):
        entry |= {
            "observed": column_value(observed, unit),
            "error": one.median / observed - 1.0 if observed else None,
            "holds": one.holds(observed),
        }
    return entry


def calibration_table(result: Calibrated) -> dict[str, Any]:
    """All numbers of a calibration; nothing of the machine or of time, so that equal studies give equal tables."""
    solution, lowered, study = result.solution, result.lowered, result.described.study
    cells = lowered.problem.objective.cells
    return {
        "format": 1,
        "tarsus": package_version(),
        "study": study.name,
        "device": study.scene.name,
        "seed": study.search.seed,
        "sets": solution.sets,
        "search": _search(result),
        "residual_scale": float(np.sqrt(solution.fit.freedom.scale)),
        "effective_unknowns": solution.fit.freedom.unknowns,
        "interval": INTERVAL,
        "within": {"value": study.search.within, "reason": study.search.reason},
        "discrepancy": {
            name: {"sigma": float(s), "existence_wrong": float(w) if e else None}
            for name, s, w, e in zip(
                cells.names, solution.discrepancy.sigma, solution.discrepancy.wrong, cells.exists, strict=True
            )
        },
        "branches": _branches(result),
        "choices": _choices(result),
        "constraints": [{"name": one.name, "reason": one.reason} for one in study.constraints],
        "rows": [
            *(_trained(result, n) for n in range(len(lowered.trained))),
            *(_other(result, n) for n in range(len(lowered.others))),
        ],
        "summary": {
            "training": _summary(result, solution.trained),
            "left_out": None if solution.left_out is None else _summary(result, solution.left_out),
            "best": _summary(result, [_at_best(result, n) for n in range(len(lowered.trained))]),
        },
    }


def _search(result: Calibrated) -> dict[str, Any]:
    """How the published sets were found: what was asked for, and what it took."""
    search, solution = result.described.study.search, result.solution
    plan = search.model_dump(
        include={"population", "screening", "short", "generations", "polish", "spread", "members"}
    )
    return {**plan, "sets": solution.fit.sets, "found": solution.fit.best.found[0]}


def _branches(result: Calibrated) -> list[dict[str, Any]]:
    solution = result.solution
    places = {b: place for place, b in enumerate(solution.kept)}
    meanings = {name: one.meaning for name, one in result.described.study.unknowns.items()}
    out = []
    for b, branch in enumerate(solution.problem.branches):
        found = solution.found[b]
        entry: dict[str, Any] = {
            "options": branch.options,
            "cost": found.cost,
            "dropped": found.dropped or None,
        }
        if b in places:
            place = places[b]
            names = solution.problem.unknowns.names
            matrix = solution.correlations[place]
            entry |= {
                "weight": float(solution.fit.weights[place]),
                "file": device_file(place),
                "members": len(solution.fit.ensembles[place].weights),
                "found": _found(solution.fit.ensembles[place].found),
                "constraints": _limits(result, place),
                "unknowns": {
                    one.name: {
                        "best": one.best, "low": one.low, "high": one.high, "interval_95": one.interval,
                        "unit": unit, "bounds": [float(low), float(high)], "scale": "log" if log else "linear",
                        "determined": one.word, "meaning": meanings[one.name],
                    }
                    for one, unit, low, high, log in zip(
                        solution.ranges[place], solution.problem.unknowns.units, solution.problem.unknowns.low,
                        solution.problem.unknowns.high, solution.problem.unknowns.log, strict=True,
                    )
                },
                "correlations": {
                    f"{names[i]}, {names[j]}": float(matrix[i, j]) for i in range(len(names)) for j in range(i)
                },
            }  # fmt: skip
        out.append(entry)
    return out


def _found(found: Sequence[str]) -> dict[str, Any]:
    """How the best member of a branch was found, and how many of all members in each way."""
    ways = [one.split(",")[0] for one in found]
    return {"best": found[0], "members": {way: ways.count(way) for way in dict.fromkeys(ways)}}


def _limits(result: Calibrated, place: int) -> list[dict[str, Any]]:
    """Cost of every constraint at the best set: 0 where it is kept."""
    ensemble = result.solution.fit.ensembles[place]
    costs = result.solution.problem.costs(ensemble.readings[:1], ensemble.branch).limits[0]
    limits = result.solution.problem.objective.limits
    return [{"name": one.name, "cost": float(cost)} for one, cost in zip(limits, costs, strict=True)]


def _choices(result: Calibrated) -> dict[str, dict[str, Any]]:
    out = {}
    for name, weights in result.solution.option_weights().items():
        ranked = sorted(weights.values(), reverse=True)
        meaning = result.described.study.choices[name].meaning
        out[name] = {"weights": weights, "open": len(ranked) > 1 and ranked[1] >= OPEN, "meaning": meaning}
    return out


def _entries(lowered: Lowered, predictions: Sequence[Prediction], observed: np.ndarray) -> dict[str, Any]:
    cells = lowered.problem.objective.cells
    return {
        name: prediction_entry(one, unit, value)
        for name, unit, one, value in zip(
            cells.names, cells.units, predictions, observed.tolist(), strict=True
        )
    }


def _head(result: Calibrated, number: int) -> dict[str, Any]:
    row = result.described.table.rows[number]
    conditions = {column: row[column] for column in result.described.study.conditions}
    return {"row": number + 1, "conditions": conditions}


def _trained(result: Calibrated, n: int) -> dict[str, Any]:
    lowered, solution = result.lowered, result.solution
    observed = lowered.problem.objective.cells.observed[n]
    left = solution.left_out
    return {
        **_head(result, lowered.trained[n]),
        "fitted": True,
        "training": _entries(lowered, solution.trained[n], observed),
        "left_out": None if left is None else _entries(lowered, left[n], observed),
        "refit": None if solution.refits is None else _refit(solution.refits[n]),
    }


def _refit(one: LeftOut) -> dict[str, Any]:
    """The search without a row: its best set, and the branches that it kept."""
    best = one.fit.best
    return {
        "sets": one.fit.sets,
        "cost": best.best,
        "found": best.found[0],
        "branches": {
            each.branch.name: float(weight)
            for weight, each in zip(one.fit.weights, one.fit.ensembles, strict=True)
        },
    }


def _at_best(result: Calibrated, n: int) -> list[Prediction]:
    """What the best set of all gives in a fitted row: the mean of its windows, without an interval."""
    best, cells = result.solution.fit.best, result.lowered.problem.objective.cells
    read = np.asarray(best.readings[0, n][list(best.branch.columns)], dtype=float)
    there = existence(read)
    means = np.where(np.isinf(read).any(axis=-1), np.nan, np.nan_to_num(read, posinf=0.0).mean(axis=-1))
    return [
        Prediction(name, value, value, value, p if judged else None, False, True, float(np.isnan(value)))
        for name, value, p, judged in zip(
            cells.names, means.tolist(), there.tolist(), cells.exists, strict=True
        )
    ]


def _other(result: Calibrated, n: int) -> dict[str, Any]:
    lowered = result.lowered
    return {
        **_head(result, lowered.others[n]),
        "fitted": False,
        "predicted": _entries(lowered, result.others[n], lowered.other_observed[n]),
    }


def _summary(result: Calibrated, predictions: Sequence[Sequence[Prediction]]) -> dict[str, Any]:
    """By measure: mean relative and absolute errors, share of values in their intervals, Brier score, and rows whose
    existence is more likely right than wrong."""
    cells = result.lowered.problem.objective.cells
    out: dict[str, Any] = {}
    holds_all: list[bool] = []
    for k, (name, unit) in enumerate(zip(cells.names, cells.units, strict=True)):
        pairs = [
            (one[k], float(o))
            for one, o in zip(predictions, cells.observed[:, k], strict=True)
            if np.isfinite(o)
        ]
        holds = [one.holds(o) for one, o in pairs if one.low < one.high]
        holds_all += holds
        above = [abs(one.median / o - 1.0) for one, o in pairs if o > 0.0]
        brier = [(one.p_bounce - (o > 0.0)) ** 2 for one, o in pairs if one.p_bounce is not None]
        entry: Mapping[str, Any] = {
            "cells": len(pairs),
            "existence_right": None
            if not cells.exists[k]
            else sum((one.p_bounce or 0.0) > 0.5 for one, o in pairs if o > 0.0)
            + sum((one.p_bounce or 0.0) < 0.5 for one, o in pairs if o == 0.0),
            "mean_relative_error": _mean(above),
            "mean_absolute_error": _mean([abs(column_value(one.median - o, unit)) for one, o in pairs]),
            "unit": unit,
            "held": _mean(holds),
            "brier": _mean(brier),
        }
        out[name] = entry
    return {"measures": out, "held": _mean(holds_all)}


def _mean(values: Sequence[float] | Sequence[bool]) -> float | None:
    return float(np.mean(values)) if len(values) else None
