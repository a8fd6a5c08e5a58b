"""What predictors that know nothing of the model make of a table, so that an error can be judged: the mean of the other
rows, the nearest row, and a power law through the other rows. The skill of a model is 1 less its error over the least
of theirs: 0 of one that knows as little."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats


def naive_errors(observed: Floats, conditions: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Mean relative errors of predictors that know the other rows alone.

    Parameters
    ----------
    observed
        Values of the rows (n,), of one measure; rows of NaN and 0 are not counted.
    conditions
        Numbers and words of each row, by name.

    Returns
    -------
    dict
        By ``mean of the other rows``, ``nearest row`` and, of rows that are two more than its numbers, ``power law of
        the other rows``; empty where fewer than two rows count.
    """
    counted = np.flatnonzero(np.isfinite(observed) & (observed > 0.0))
    if len(counted) < 2:
        return {}
    values = observed[counted]
    found = naive_predictions(values, [conditions[i] for i in counted.tolist()])
    return {name: float(np.mean(np.abs(one / values - 1.0))) for name, one in found.items()}


def naive_predictions(values: Floats, conditions: Sequence[Mapping[str, Any]]) -> dict[str, Floats]:
    """What predictors that know the other rows alone make of each of at least two rows (n,), by their names; the power
    law only where all values are above 0."""
    apart = distances(conditions)
    np.fill_diagonal(apart, np.inf)
    near = apart <= apart.min(axis=1, keepdims=True) * (1.0 + 1e-9)  # rows equally near count alike
    found = {
        "mean of the other rows": (values.sum() - values) / (len(values) - 1),
        "nearest row": (near * values).sum(axis=1) / near.sum(axis=1),
    }
    terms = power_terms(conditions)
    if len(values) >= terms.shape[1] + 2 and (values > 0.0).all():
        found["power law of the other rows"] = without_each(terms, np.log(values))
    return found


def power_terms(conditions: Sequence[Mapping[str, Any]]) -> Floats:
    """Terms (n, nt) of a power law: 1, logarithms of numbers, and for each word but the first 1 where it is said."""
    terms = [np.ones(len(conditions))]
    for name in conditions[0]:
        column = [one[name] for one in conditions]
        if _positive(column):
            terms += [np.log(np.array(column, dtype=float))] if len(set(column)) > 1 else []
        else:
            words = sorted(set(map(str, column)))[1:]
            terms += [np.array([one == word for one in column], dtype=float) for word in words]
    return np.stack(terms, axis=1)


def without_each(terms: Floats, logs: Floats) -> Floats:
    """Predictions (n,) by least squares through all rows but the one that is predicted."""
    found = np.empty(len(logs))
    for i in range(len(logs)):
        rest = np.arange(len(logs)) != i
        found[i] = terms[i] @ np.linalg.lstsq(terms[rest], logs[rest], rcond=None)[0]
    return np.exp(found)


def _positive(column: Sequence[Any]) -> bool:
    return all(isinstance(one, int | float) and one > 0.0 for one in column)


def distances(conditions: Sequence[Mapping[str, Any]]) -> Floats:
    """Between rows (n, n): numbers by the logarithm of their ratio over that of the whole range, words by 1 where they
    differ; root of the sum of squares."""
    total: Floats = np.zeros((len(conditions), len(conditions)))
    for name in conditions[0]:
        column = [one[name] for one in conditions]
        if _positive(column):
            place = np.log(np.array(column, dtype=float))
            total += ((place[:, None] - place) / (np.ptp(place) or 1.0)) ** 2
        else:
            total += np.array([[a != b for b in column] for a in column], dtype=float)
    return np.sqrt(total)


def skill_of(error: float | None, naive: Mapping[str, float]) -> float | None:
    """1 less the error over the least of predictors that know nothing; None where either is unknown."""
    return None if error is None or not naive or min(naive.values()) == 0.0 else 1.0 - error / min(naive.values())
