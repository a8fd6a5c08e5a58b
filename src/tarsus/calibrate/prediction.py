"""What an ensemble over hypotheses predicts for a row: median, 80 % interval, and probability of a bounce.

The predictive distribution of a measure has three parts. *Parameters*: every member of every hypothesis by its weight.
*TableSampling*: every window and draw of a member counts alike. *Discrepancy*: what the model misses even where it was
fitted. On the scale on which cells are compared, taken at the model's value v, it is normal with standard deviation

    sigma = max(1, q / 1.2816 * f),   f = min(2, sqrt(n / (n - k))),

q the quantile at 0.8 (m + 1) / m of the sizes of ``log((o + a) / (v + a)) (v + a) / tau(v)`` over the m fitted cells of
the measure (as in conformal prediction: one more is to come), 1.2816 the 80 % quantile of the size of a standard
normal, and f the usual correction for the k unknowns that all n cells determine (`tarsus.calibrate.degrees`), at
most 2 because with few cells it means nothing. Sizes are in the table's own tolerances and include them; sigma is at
least 1. Where four or more rows were excluded and predicted, their residuals take the place of the fitted ones, with
f = 1: of fewer, one excluded leaves the unknowns undetermined, and its residual shows that instead. One
standard deviation is at most a factor of `WORST`: a model that misses by more predicts nothing, which sigma shows and
an interval cannot.

The probability of a bounce p is the weighted fraction of windows with one; existence was wrong with probability w on
the fitted rows, so p (1 - w) + (1 - p) w is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tarsus.base.arrays import Floats
from tarsus.calibrate.objective import Cells, existence, tolerance
from tarsus.fit.ranges import weighted_quantile

if TYPE_CHECKING:
    from tarsus.calibrate.ensemble import HypothesisEnsemble

INTERVAL = 0.8
"""Probability of the intervals."""
FEWEST = 3
"""Cells of a measure from which its own residuals are used; with fewer those of all measures are."""
NODES = ndtri((np.arange(15) + 0.5) / 15.0)
"""Middles of fifteen equal parts of a standard normal, by which the discrepancy is added without random numbers."""
WORST = 6.0
"""Largest factor that one standard deviation of the discrepancy is: its 80 % interval then spans two orders."""


@dataclass(frozen=True)
class Discrepancy:
    """By measure (nk,): sigma, in tolerances, and the probability that existence is wrong."""

    sigma: Floats
    wrong: Floats


@dataclass(frozen=True)
class Prediction:
    """One measure of one row [SI]: median and 80 % interval; p_bounce, None where existence is not judged; failed:
    share of the members' runs that did not reach their end."""

    measure: str
    median: float
    low: float
    high: float
    p_bounce: float | None
    failed: float

    def holds(self, value: float) -> bool:
        """Whether the interval holds a value; a value on its edge is held."""
        slack = 1e-9 * max(abs(self.low), abs(self.high))
        return self.low - slack <= value <= self.high + slack


def median_and_interval(values: Floats, weights: Floats) -> tuple[float, float, float]:
    """Median, lower and upper end of the 80 % interval of weighted values (n,); NaN without values."""
    tail = 0.5 * (1.0 - INTERVAL)
    low, median, high = (weighted_quantile(values, weights, at) for at in (tail, 0.5, 1.0 - tail))
    return median, low, high


def widened(values: Floats, weights: Floats, tolerances: tuple[float, float], sigma: float) -> tuple[Floats, Floats]:
    """Weighted values (n,) of zero or more [SI] with a discrepancy of sigma added to each, in tolerances (absolute,
    relative): values and weights, `NODES` times as many."""
    absolute, relative = tolerances
    tau = tolerance(values, np.full(1, absolute), np.full(1, relative))
    scaled = values + absolute
    shift = np.divide(sigma * tau, scaled, out=np.zeros_like(values), where=scaled > 0.0)
    factors = np.exp(np.minimum(shift, np.log(WORST))[:, None] * NODES)
    noisy = np.maximum(scaled[:, None] * factors - absolute, 0.0)
    return noisy.ravel(), np.repeat(weights / len(NODES), len(NODES))


def discrepancy_of(
    cells: Cells, residuals: Floats, wrong: Floats, unknowns: float, *, fitted: bool = True
) -> Discrepancy:
    """Discrepancy from residuals (nr, nk) in tolerances and probabilities of the wrong existence (nr, nk), NaN where
    there is none.

    fitted: the rows were fitted; False where each was excluded when it was predicted.
    """
    known = np.isfinite(residuals)
    n = int(known.sum())
    factor = min(2.0, float(np.sqrt(n / max(n - unknowns, 1.0)))) if fitted and n else 1.0
    everything = np.abs(residuals[known])
    sigma, error = np.ones(len(cells.names)), np.zeros(len(cells.names))
    for k in range(len(cells.names)):
        own = np.abs(residuals[known[:, k], k])
        used = own if len(own) >= FEWEST else everything
        if len(used):
            level = min(1.0, INTERVAL * (len(used) + 1) / len(used))
            sigma[k] = max(1.0, float(np.quantile(used, level)) / ndtri(0.5 + 0.5 * INTERVAL) * factor)
        judged = wrong[np.isfinite(wrong[:, k]), k]
        if len(judged):
            error[k] = min(0.5, (float(judged.sum()) + 0.5) / (len(judged) + 1.0))
    return Discrepancy(sigma, error)


def predict_row(
    ensembles: Sequence[HypothesisEnsemble],
    weights: Floats,
    readings: Sequence[NDArray[np.floating]],
    cells: Cells,
    absolute: Floats,
    discrepancy: Discrepancy,
) -> tuple[Prediction, ...]:
    """Predictions of all measures of one row.

    readings: of each ensemble's members in that row (nm, channels, samples); absolute (nk,): tolerances of the row.
    """
    every = np.concatenate([w * one.weights for w, one in zip(weights, ensembles, strict=True)])
    out = []
    for k, name in enumerate(cells.names):
        parts = [r[:, one.hypothesis.columns[k]] for r, one in zip(readings, ensembles, strict=True)]
        windows = np.concatenate(parts).astype(float)  # (nm, samples)
        failed = np.isinf(windows).any(axis=1)
        lost = float(every[failed].sum())
        if failed.all():
            out.append(Prediction(name, np.nan, np.nan, np.nan, None, 1.0))
            continue
        windows, member = np.maximum(np.nan_to_num(windows[~failed]), 0.0), every[~failed] / (1.0 - lost)
        each = np.repeat(member / windows.shape[1], windows.shape[1])
        tolerances = float(absolute[k]), float(cells.relative[k])
        ends = median_and_interval(*widened(windows.ravel(), each, tolerances, float(discrepancy.sigma[k])))
        p, wrong = None, float(discrepancy.wrong[k])
        if cells.exists[k]:
            share = float(existence(windows) @ member)
            p = share * (1.0 - wrong) + (1.0 - share) * wrong
        out.append(Prediction(name, *ends, p, lost))
    return tuple(out)
