"""Bounces -> the coefficient of restitution.

``g'+ = -e g'-`` (2.12, sign by E6) for every impact, with the velocities of the foot from the flights on both
sides; all impacts together by a regression with errors in both velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.bounce import BounceFit, Bounces, find_bounces, offsets_of_records
from tarsus.identify.draws import DRAWS, NORMAL, by_group, carried, newton_draws, within
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import WORST
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Residual, StepResult, Used, points_and_line
from tarsus.identify.traces import Trace
from tarsus.impacts.estimates import Spread, common_ratio, supported
from tarsus.records.excluded import Excluded, Exclusion, enough

PATH = "ground.restitution.coefficient"
FEWEST = 3
"""Bounces that are needed: one that is unlike two others is seen."""
_RECORDS = 5
"""Records from which on their scatter is that of the ratio, rather than that of all impacts."""
BOUNDS = (0.0, 1.0)
"""A foot that departs has lost energy in the impact, and does not depart into the ground."""

MOST = 200
"""Impacts that are fitted at most: the ratio is then known to a fourteenth of what one tells, and the scatter to a
twentieth."""
_OUTSIDE = 3.5
"""Deviations from the middle ratio beyond which an impact is none like the others: of two thousand normal ones one
is."""
_ONE_EVENT = 1.5
"""Samples up to which impacts of repeats are one: their clocks differ by less than a sample."""
TURN = np.array([[1.0, -1.0], [-1.0, 1.0]])
"""Sign that turns the approach velocity into a speed, in covariances."""


@dataclass(frozen=True)
class BounceStudy:
    """The step's result, and the impacts it used, as fitted; shared (draws, ni) [m/s]: what numbers of earlier steps
    and zeros of the records do to the departure velocities, less the ratio times the approach."""

    step: StepResult
    bounces: Bounces
    fitted: BounceFit
    shared: Floats


def identify_restitution(
    model: FootModel, known: Estimates, traces: Sequence[Trace], level: tuple[float, float], seed: int
) -> BounceStudy:
    """Coefficient of restitution with its interval.

    Parameters
    ----------
    model
        Structure, drive and film as identified.
    known
        What earlier steps found, with draws.
    traces
        Records of bounces.
    level
        Contact level from the rest, and its standard error [m].
    seed
        Of the draws.

    Raises
    ------
    InputError
        If there are too few bounces that can be used.
    """
    found, left = find_bounces(traces, model.foot_point, level[0])
    total = len(found) + len(left)
    items, others = enough(found, MOST, "bounces", "all records of bounces", model.foot_point)
    files = ", ".join(sorted({trace.file for trace in traces}))
    if len(items) < FEWEST:
        raise InputError(
            f"{files}: channel '{model.foot_point}' shows {len(items)} bounces that can be used, of {total} "
            f"impacts; at least {FEWEST} are needed: drive it harder, sample faster or record longer"
        )
    left += others
    bounces = Bounces(traces, items, level[0], model)
    fitted = bounces.fit()
    kept = sound(bounces, fitted)
    left += [_why_not(bounces, fitted, kept, int(r), model.foot_point) for r in np.flatnonzero(~kept.good)]
    if np.count_nonzero(kept.good) < FEWEST:
        raise InputError(
            f"{files}: channel '{model.foot_point}': {np.count_nonzero(kept.good)} of {total} impacts are single "
            f"ones between free motions of this structure; at least {FEWEST} are needed"
        )
    bounces = bounces.chosen(kept.good)
    fitted = fitted.chosen(kept.good)
    step, shared = _result(known, bounces, fitted, left, total, level[1], seed)
    return BounceStudy(step, bounces, fitted, shared)


@dataclass(frozen=True)
class Kept:
    """Of impacts (ni,): settled: whose fit has settled; single: of these, one impact between free flights; caught: of
    these, at which the foot was caught and let go again, where others rebound; good: whose ratio of velocities is like
    that of the others that rebound."""

    settled: NDArray[np.bool_]
    single: NDArray[np.bool_]
    caught: NDArray[np.bool_]
    good: NDArray[np.bool_]


def sound(bounces: Bounces, fitted: BounceFit) -> Kept:
    """Which impacts tell the restitution."""
    again = bounces.moved(bounces.model, fitted)
    error = np.sqrt(np.maximum(np.einsum("raa->ra", fitted.covariance), 0.0))
    settled = np.all(np.abs(again - fitted.speeds) <= error, axis=1) & (
        np.linalg.eigvalsh(fitted.covariance)[:, 0] > 0.0
    )
    single = (fitted.chi < WORST) & _seen(fitted) & settled
    caught = _caught(fitted, single)
    return Kept(settled, single, caught, single & _alike(fitted, single & ~caught, _events(bounces)))


def _events(bounces: Bounces) -> NDArray[np.intp]:
    """Number (ni,) of the event that each impact is: repeats of a set show one and the same impact, which lies between
    the same two samples of theirs or the next ones."""
    sets = [bounces.traces[one.trace].set for one in bounces.items]
    names = np.unique(sets, return_inverse=True)[1]
    when = np.array([bounces.traces[one.trace].time[one.last] for one in bounces.items])
    order = np.lexsort((when, names))
    apart = (np.diff(names[order]) > 0) | (np.diff(when[order]) > _ONE_EVENT * bounces.step)
    number = np.empty(len(order), dtype=np.intp)
    number[order] = np.concatenate([[0], np.cumsum(apart)])
    return number


def _seen(fitted: BounceFit) -> NDArray[np.bool_]:
    """Impacts (ni,) whose approach is seen beyond its error: hops that end slower are chatter as often as not, whose
    flights no film explains."""
    return -fitted.speeds[:, 1] > _OUTSIDE * np.sqrt(np.maximum(fitted.covariance[:, 1, 1], 0.0))


def _why_not(bounces: Bounces, fitted: BounceFit, kept: Kept, r: int, foot: str) -> Excluded:
    """Why an impact tells nothing of the restitution."""
    trace = bounces.traces[bounces.items[r].trace]
    at, kind = f"the impact at {trace.time[bounces.items[r].last]:.5g} s", Exclusion.UNUSABLE
    if kept.caught[r]:
        text = f"at {at} the foot is caught and let go again: it departs with none of the approach's velocity"
    elif kept.single[r]:
        ratio = -fitted.speeds[r, 0] / fitted.speeds[r, 1]
        text, kind = f"{at}, with a ratio of {ratio:.3g}, is far off the others", Exclusion.UNLIKE
    elif not kept.settled[r]:
        text = f"the fit of the motion around {at} does not settle"
    elif not _seen(fitted)[r]:
        text = f"at {at} the approach is slower than its error tells from none"
    else:
        text = f"the motion around {at} is no free motion with one impact (chi-squared {fitted.chi[r]:.3g})"
        kind = Exclusion.SEVERAL
    return Excluded(trace.file, foot, text, kind=kind)


def _ratios(fitted: BounceFit, chosen: NDArray[np.bool_]) -> tuple[Floats, Floats, float]:
    """Ratios of velocities (ni,), their errors (ni,) at the middle one of the chosen, and this."""
    departure, approach = fitted.speeds[:, 0], -fitted.speeds[:, 1]
    ratio = departure / np.where(approach > 0.0, approach, np.nan)
    middle = float(np.nanmedian(ratio[chosen]))
    error = np.sqrt(np.maximum(variance_of(fitted.covariance * TURN, middle), 0.0)) / np.abs(approach)
    return ratio, np.where(error > 0.0, error, np.nan), middle


def _caught(fitted: BounceFit, single: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Impacts of single ones at which adhesion held the foot and let it go at once: it departs with no velocity where
    others, as many as are needed, depart with one that its error tells from this."""
    none = fitted.speeds[:, 0] < _OUTSIDE * np.sqrt(np.maximum(fitted.covariance[:, 0, 0], 0.0))
    rebounds = single & ~none
    if np.count_nonzero(rebounds) < FEWEST:
        return np.zeros(len(none), dtype=bool)
    ratio, error, middle = _ratios(fitted, rebounds)
    return single & none & (middle - ratio > _OUTSIDE * error)


def _alike(
    fitted: BounceFit, single: NDArray[np.bool_], events: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Impacts of single ones whose ratio is as far from the middle one as its error allows, or as most others are by
    theirs; and those far off that lie with these on a line over the logarithm of speed, as many events as are needed:
    what happens again is no accident, and whether restitution depends on speed is asked of all of them.

    A foot that was caught and let go again within a sample looks like a weak rebound, and is caught in every repeat: of
    impacts that depart with less than others, repeats of one event (ni, its number) are one. None departs with more."""
    if not single.any():
        return single
    ratio, error, middle = _ratios(fitted, single)
    off = np.abs(ratio - middle) / error
    most = _OUTSIDE * max(1.4826 * float(np.nanmedian(off[single])), 1.0)
    near = single & (off < most)
    residual, support, weight = supported(
        fitted.speeds[:, 0], -fitted.speeds[:, 1], fitted.covariance * TURN, middle
    )
    seen = single & (support > 0.0)
    far = np.flatnonzero(seen & ~near)
    alone = np.where(ratio > middle, events.max() + 1 + np.arange(len(events)), events)
    if len(np.unique(alone[far])) < FEWEST:
        return near
    speed = np.log(np.where(seen, support, 1.0))
    lever = np.sqrt(weight[far]) * support[far] * (speed[far] - speed[near & seen].mean())
    left = np.sqrt(weight[far]) * residual[far]
    order = np.argsort(
        left / lever
    )  # the median slope that single ones have, by what each of them says of it
    share = np.cumsum(lever[order] ** 2)
    slope = (left / lever)[order[np.searchsorted(share, 0.5 * share[-1])]]
    more = far[np.abs(left - slope * lever) < most]
    again = len(np.unique(alone[more])) >= FEWEST
    return near | np.isin(np.arange(len(near)), more) if again else near


def _result(
    known: Estimates,
    bounces: Bounces,
    fitted: BounceFit,
    left: Sequence[Excluded],
    total: int,
    level_error: float,
    seed: int,
) -> tuple[StepResult, Floats]:
    zeros = offsets_of_records(bounces, fitted, level_error, seed)
    fitted_speeds = zeros.moved(fitted.speeds, zeros.values)
    departure, approach = fitted_speeds[:, 0], -fitted_speeds[:, 1]
    covariance = fitted.covariance * TURN
    try:
        whole = common_ratio(departure, approach, covariance)
    except OverflowError:
        raise InputError("velocities before and after the impacts have no ratio in common") from None

    def told(speeds: Floats) -> Floats:
        ratio = common_ratio(speeds[:, 0], -speeds[:, 1], covariance).value
        return np.concatenate([[ratio], speeds @ np.array([1.0, whole.value])])

    def again(values: Floats) -> Floats:
        return told(zeros.moved(bounces.moved(known.model(values), fitted), zeros.values))

    def shifted(values: Floats) -> Floats:
        return told(zeros.moved(fitted.speeds, values))

    groups = np.array([one.trace for one in bounces.items])
    own = _draws(departure, approach, covariance, groups, whole, seed)
    shared = carried(again, known.values, known.samples)
    shared += carried(shifted, zeros.values.ravel(), zeros.samples.reshape(len(shared), -1))
    samples = whole.value + own[:, None] + shared[:, :1]
    values, samples, reached = within(np.array([whole.value]), samples, (BOUNDS,))
    noise = variance_of(covariance, whole.value)
    rest = departure - whole.value * approach

    panels = points_and_line(
        ("velocity after over velocity before an impact", "what e times approach leaves"),
        ("approach", "m/s", "departure", "m/s"), ("impacts", "e times approach"), (approach, departure),
        (0.0, whole.value), (np.sqrt(covariance[:, 0, 0]), np.sqrt(noise)),
    )  # fmt: skip
    step = StepResult(
        "restitution", (PATH,), values, samples,
        residuals=(Residual.of("departure velocities", "m/s", rest, np.sqrt(noise)),),
        used=(Used("impacts", len(departure), total),), files=bounces.files(), left_out=tuple(left), panels=panels,
        notes=(
            f"The scatter of e from impact to impact, beyond noise, is {whole.scatter:.2g}.",
            f"It is that of impacts at {1e3 * approach.min():.3g} to {1e3 * approach.max():.3g} mm/s.",
        ),
        bounds={PATH: reached[0]},
    )  # fmt: skip
    return step, shared[:, 1:]


def variance_of(covariance: Floats, ratio: float) -> Floats:
    """Variance (n,) of departure less ratio times approach."""
    turn = np.array([1.0, -ratio])
    return np.einsum("a,nab,b->n", turn, covariance, turn)


def _draws(
    departure: Floats,
    approach: Floats,
    covariance: Floats,
    groups: NDArray[np.intp],
    whole: Spread,
    seed: int,
) -> Floats:
    """Deviations (draws,) of the ratio, as records scatter, and at least those that the regression over all impacts
    allows, which are all that few records determine."""
    weight = 1.0 / variance_of(covariance, whole.value)
    # few impacts may agree by chance to less than their noise
    allowed = max((whole.high - whole.low) / (2.0 * NORMAL), float(np.sum(weight * approach**2)) ** -0.5)
    if len(np.unique(groups)) < _RECORDS:
        return allowed * np.random.default_rng([seed, 11]).standard_normal(DRAWS)
    shares = weight * approach**2, weight * approach * (departure - whole.value * approach)
    information, score = by_group(groups, *shares)
    own = newton_draws(information[:, None, None], score[:, None], seed)[:, 0]
    return own * max(1.0, allowed / float(np.std(own)))
