"""Impacts fitted by free motion on both sides: which samples, how sure, and which of them count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from tarsus.base.arrays import Floats
from tarsus.impacts.detection import Impacts
from tarsus.impacts.free import FreeResponse, ImpactFit, fit_impact
from tarsus.records.measurement import Measurement

_AIR_ORDER = 5
"""Order of the polynomial that smooths the in-air velocity of the foot around an impact."""


@dataclass(frozen=True)
class FitWindow:
    """How impacts are fitted and which of them count.

    cycles: length of the fit on either side at most, in periods of the structure's highest mode; fewest: samples on
    either side at least; smeared: samples after an impact that are left out, where the instrument is too slow to follow
    it; misfit: an impact whose fit is this improbable (chi-squared) is not one between free motions
    and does not count; clarity: least ratio of the foot's velocity change to its standard deviation.
    """

    cycles: float = 0.5
    fewest: int = 6
    smeared: int = 0
    misfit: float = 1e-3
    clarity: float = 10.0


@dataclass(frozen=True)
class FittedImpacts:
    """Impacts fitted by free motion on both sides: nf of them.

    time (nf,) [s]; before (nf,) [m/s]: velocity of the foot just before; change (nf, np) [m/s]: changes of the points'
    velocities; covariance (nf, 1 + np, 1 + np) [m²/s²] of both together; probability (nf,): of a misfit as large;
    zero (nf, 1 + np, np) [m/s]: shifts of before and change by one standard deviation of each channel's zero, an error
    that the impacts of a repeat share; repeat (nf,): its number; following (nf, 1 + np, 1 + np) [m²/s²]: covariance
    with the impact after it, as far as both are fitted to the same samples.
    """

    time: Floats
    before: Floats
    change: Floats
    covariance: Floats
    probability: Floats
    zero: Floats
    repeat: NDArray[np.int64]
    following: Floats

    def __len__(self) -> int:
        return len(self.time)


_FIELDS = tuple(field.name for field in fields(FittedImpacts))


def fit_impacts(
    subtracted: Measurement,
    in_air: Floats,
    free: FreeResponse,
    impacts: Impacts,
    foot: int,
    share: float,
    zero: Floats,
    repeat: int,
    window: FitWindow,
) -> FittedImpacts | None:
    """Fit every impact that has room on both sides; None where none has.

    subtracted: difference of the records; in_air (ns,): velocity of the foot in the air; foot: its channel's number;
    share: variance of the in-air mean over that of the close record; zero (np,) [m/s]: standard deviation of the
    channels' zeros; repeat: number of the pair.
    """
    values = subtracted.values.T
    widest = max(int(window.cycles / free.highest / free.step), window.fewest)
    reach = max(int(0.2 / free.highest / free.step), 2)
    edges = np.concatenate([[0], impacts.after, [len(values)]])
    rows, uses = [], []
    for i, after in enumerate(impacts.after):
        start = max(after - widest, edges[i] + 1)
        end = min(after + widest, edges[i + 2] - 1)
        best = _best_fit(free, values[start:end], after - start, window)
        if best is None or not reach <= start + best[1] <= len(in_air) - reach:
            continue
        fit, earlier = best
        row = _row(subtracted, fit, start, earlier, reach, in_air, free.noise, foot, share)
        own = row[-1]
        rows.append((*row[:-1], own.sum(axis=1) * zero, repeat))
        uses.append((start, own * free.noise))
    if not rows:
        return None
    links = [_link(*one, *other) for one, other in pairwise(uses)]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return FittedImpacts(*columns, following=np.array([*links, np.zeros_like(columns[3][0])]))


def _link(start: int, uses: Floats, next_start: int, next_uses: Floats) -> Floats:
    """Covariance of two impacts from the samples that both use; uses: weights (a, k, np) times the noise."""
    first, last = max(start, next_start), min(start + uses.shape[1], next_start + next_uses.shape[1])
    if last <= first:
        return np.zeros((uses.shape[0], next_uses.shape[0]))
    ours, theirs = uses[:, first - start : last - start], next_uses[:, first - next_start : last - next_start]
    return np.einsum("akp,bkp->ab", ours, theirs)


def _best_fit(free: FreeResponse, samples: Floats, earlier: int, window: FitWindow) -> tuple[ImpactFit, int] | None:
    """The interval between two samples, of three, that the impact fits into best, and its number."""
    latest = len(samples) - window.smeared - window.fewest
    fits = [
        (fit, trial)
        for trial in (earlier - 1, earlier, earlier + 1)
        if window.fewest <= trial <= latest and (fit := fit_impact(free, samples, trial, window.smeared)) is not None
    ]
    return min(fits, key=lambda one: one[0].misfit, default=None)


def _smoothing(half: int, late: float) -> tuple[Floats, Floats]:
    """Weights (2 half,) of samples for the value ``late`` samples after their middle, and for its derivative per
    sample, of a polynomial through them."""
    order = min(_AIR_ORDER, 2 * half - 1)
    at, place, power = (np.arange(-half, half) + 0.5) / half, late / half, np.arange(1, order + 1)
    solve = np.linalg.pinv(np.vander(at, order + 1, increasing=True))
    return place ** np.arange(order + 1) @ solve, power * place ** (power - 1) / half @ solve[1:]


def _row(
    subtracted: Measurement,
    fit: ImpactFit,
    start: int,
    earlier: int,
    reach: int,
    in_air: Floats,
    noise: Floats,
    foot: int,
    share: float,
) -> tuple[float, float, Floats, Floats, float, Floats]:
    """Time, foot velocity before, changes, covariance, probability of the misfit, and how they use the samples."""
    middle = start + earlier
    late = fit.late / subtracted.step
    near, (smoothed, slope) = in_air[middle - reach : middle + reach], _smoothing(reach, late)
    velocity = fit.before[foot] + float(smoothed @ near)
    points = len(fit.before)
    own = fit.weights[[foot, *range(points, 2 * points)]]
    # an error of the instant moves the in-air velocity that is read there
    drift = float(slope @ near) / subtracted.step
    own[0] = own[0] + drift * fit.weights[-1]
    close = own * noise * np.sqrt(1.0 / (1.0 + share))
    # the in-air record enters the difference with a minus sign, and the foot's own velocity by the smoother
    first, last = min(start, middle - reach), max(start + own.shape[1], middle + reach)
    air = np.zeros((own.shape[0], last - first, points))
    air[:, start - first : start - first + own.shape[1]] = -own
    air[0, middle - reach - first : middle + reach - first, foot] += smoothed
    air *= noise * np.sqrt(share / (1.0 + share))
    covariance = np.einsum("akp,bkp->ab", close, close) + np.einsum("akp,bkp->ab", air, air)
    time = subtracted.start + (middle - 0.5) * subtracted.step + fit.late
    probability = float(chdtrc(fit.freedom, fit.misfit))
    return time, velocity, fit.change, covariance, probability, own


def joined(parts: Sequence[FittedImpacts]) -> FittedImpacts:
    """The impacts of several repeats together."""
    return FittedImpacts(*(np.concatenate([getattr(part, name) for part in parts]) for name in _FIELDS))


def usable(fitted: FittedImpacts, foot: int, window: FitWindow) -> FittedImpacts:
    """Impacts between free motions, clear of the noise, that turn an approach."""
    clear = np.abs(fitted.change[:, foot]) > window.clarity * np.sqrt(fitted.covariance[:, 1 + foot, 1 + foot])
    chosen = (fitted.probability > window.misfit) & clear & (fitted.before * fitted.change[:, foot] < 0.0)
    kept = FittedImpacts(*(getattr(fitted, name)[chosen] for name in _FIELDS))
    apart = np.append(np.diff(np.flatnonzero(chosen)) > 1, True)  # the impact after it is not among those kept
    return replace(kept, following=np.where(apart[:, None, None], 0.0, kept.following))
