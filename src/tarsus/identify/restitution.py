"""Bounces -> the coefficient of restitution.

``g'+ = -e g'-`` (2.12, sign by E6) for every impact, with the velocities of the foot from the flights on both
sides; all impacts together by a regression with errors in both velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.bounce import FEWEST as FLIGHT
from tarsus.identify.bounce import BounceFit, Bounces, find_bounces
from tarsus.identify.covariance import scattered
from tarsus.identify.draws import carried, drawn_level, within
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import WORST
from tarsus.identify.foot import FootModel
from tarsus.identify.influence import EVENT, SPEED, Influence, events_of, of_records
from tarsus.identify.robust_ratio import STEEP, RobustRatio, robust_ratio, slope_over
from tarsus.identify.step import Check, Residual, StepResult, Used, points_and_line
from tarsus.identify.traces import Trace
from tarsus.records.excluded import Excluded, enough
from tarsus.tables.numbers import amount, number

PATH = "ground.restitution.coefficient"
FEWEST = 3
"""Bounces that are needed: one that is unlike two others is seen."""
BOUNDS = (0.0, 1.0)
"""A foot that departs has lost energy in the impact, and does not depart into the ground."""

MOST = 200
"""Impacts that are fitted at most: the ratio is then known to a fourteenth of the error of one, and the scatter to a
twentieth."""
_OUTSIDE = 3.5
"""Deviations from the middle ratio beyond which an impact is none like the others: of two thousand normal ones one
is."""
_ONE_EVENT = 1.5
"""Samples up to which impacts of repeats are one: their clocks differ by less than a sample."""
TURN = np.array([[1.0, -1.0], [-1.0, 1.0]])
"""Sign that turns the approach velocity into a speed, in covariances."""


def identify_restitution(
    model: FootModel, known: Estimates, traces: Sequence[Trace], level: tuple[float, float], seed: int
) -> tuple[StepResult, Bounces]:
    """Coefficient of restitution with its interval, and the impacts whose ratio of velocities is like that of the
    others.

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
    if len(items) < FEWEST:
        raise InputError(
            f"{len(traces)} records of bounces: channel '{model.foot_point}' shows {len(items)} bounces that can be "
            f"used, of {total} impacts; at least {FEWEST} are needed: drive it harder, sample faster or record longer"
        )
    left += others
    bounces = Bounces(traces, items, level[0], model)
    fitted = bounces.fit()
    kept = sound(bounces, fitted)
    good = kept.rebounds
    left += [_why_not(bounces, fitted, kept, int(r), model.foot_point) for r in np.flatnonzero(~good)]
    if np.count_nonzero(good) < FEWEST:
        raise InputError(
            f"{len(traces)} records of bounces: channel '{model.foot_point}': {np.count_nonzero(good)} of {total} "
            f"impacts are single ones between free motions of this structure; at least {FEWEST} are needed"
            f"{_sooner(model, bounces.step)}"
        )
    bounces = bounces.chosen(good)
    step, like = _result(known, bounces, fitted.chosen(good), left, total, level[1], seed)
    return step, bounces.chosen(like)


def _sooner(model: FootModel, step: float) -> str:
    """At which rate bounces would be seen one by one, where records [s a sample] are slower: one of the fastest mode
    lasts half its period, in which there must be `FLIGHT` samples."""
    fastest = model.fastest / (2.0 * np.pi)
    rate = 2.0 * FLIGHT * fastest
    if step * rate <= 1.0:
        return ""
    return (
        f": {amount(1.0 / step, 'Hz', 3)} is {number(1.0 / (step * fastest), 2)} samples a period of the fastest mode, "
        f"{amount(fastest, 'Hz', 3)}; sample at {amount(rate, 'Hz', 3)}"
    )


@dataclass(frozen=True)
class Kept:
    """Of impacts (ni,): settled: whose fit has settled; single: of these, one impact between free flights; caught: of
    these, at which the foot was caught and released again, where others rebound; like: of the rebounds, those whose
    ratio of velocities is like that of the others."""

    settled: NDArray[np.bool_]
    single: NDArray[np.bool_]
    caught: NDArray[np.bool_]
    like: NDArray[np.bool_]

    @property
    def rebounds(self) -> NDArray[np.bool_]:
        """Single impacts (ni,) that are no captures."""
        return self.single & ~self.caught


def sound(bounces: Bounces, fitted: BounceFit) -> Kept:
    """Which impacts tell the restitution."""
    again = bounces.moved(bounces.model, fitted)
    error = np.sqrt(np.maximum(np.einsum("raa->ra", fitted.covariance), 0.0))
    settled = np.all(np.abs(again - fitted.speeds) <= error, axis=1) & (
        np.linalg.eigvalsh(fitted.covariance)[:, 0] > 0.0
    )
    single = (fitted.chi < WORST) & _seen(fitted) & settled
    caught = _caught(fitted, single)
    rebounds, like = single & ~caught, np.zeros(len(single), dtype=bool)
    if rebounds.any():
        some = fitted.chosen(rebounds)
        found = robust_ratio(some.speeds[:, 0], -some.speeds[:, 1], some.covariance * TURN, _events(bounces)[rebounds])
        like[rebounds] = np.abs(found.off) < _OUTSIDE
    return Kept(settled, single, caught, like)


def _events(bounces: Bounces) -> NDArray[np.intp]:
    """Number (ni,) of the event that each impact is: in repeats it lies between the same two samples or the next."""
    traces = [bounces.traces[one.trace] for one in bounces.items]
    when = [trace.time[one.last] for trace, one in zip(traces, bounces.items, strict=True)]
    return events_of([one.set for one in traces], when, _ONE_EVENT * bounces.step)


def _seen(fitted: BounceFit) -> NDArray[np.bool_]:
    """Impacts (ni,) whose approach is seen beyond its error: hops that end slower are chatter as often as not, whose
    flights no film explains."""
    return -fitted.speeds[:, 1] > _OUTSIDE * np.sqrt(np.maximum(fitted.covariance[:, 1, 1], 0.0))


def _why_not(bounces: Bounces, fitted: BounceFit, kept: Kept, r: int, foot: str) -> Excluded:
    """Why an impact shows nothing of the restitution."""
    trace = bounces.traces[bounces.items[r].trace]
    at = f"the impact at {trace.time[bounces.items[r].last]:.5g} s"
    if kept.caught[r]:
        text = f"at {at} the foot is caught and released again: it departs with none of the approach's velocity"
    elif not kept.settled[r]:
        text = f"the fit of the motion around {at} does not settle"
    elif not _seen(fitted)[r]:
        text = f"at {at} the approach is slower than its error"
    else:
        text = f"the motion around {at} is no free motion with one impact (chi-squared {fitted.chi[r]:.3g})"
    return Excluded(trace.file, foot, text)


def _caught(fitted: BounceFit, single: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Impacts of single ones at which adhesion held the foot and released it at once: it departs with no velocity where
    others, as many as are needed, depart with one that its error distinguishes from none."""
    departure, approach = fitted.speeds[:, 0], -fitted.speeds[:, 1]
    none = departure < _OUTSIDE * np.sqrt(np.maximum(fitted.covariance[:, 0, 0], 0.0))
    rebounds = single & ~none
    if np.count_nonzero(rebounds) < FEWEST:
        return np.zeros(len(none), dtype=bool)
    middle = float(np.median(departure[rebounds] / approach[rebounds]))
    error = np.sqrt(np.maximum(variance_of(fitted.covariance * TURN, middle), 0.0))
    return single & none & (middle * approach - departure > _OUTSIDE * error)


def _result(
    known: Estimates,
    bounces: Bounces,
    fitted: BounceFit,
    left: Sequence[Excluded],
    total: int,
    level_error: float,
    seed: int,
) -> tuple[StepResult, NDArray[np.bool_]]:
    """The step, and which impacts are like the others."""
    covariance, events = fitted.covariance * TURN, _events(bounces)

    def ratio(speeds: Floats) -> RobustRatio:
        return robust_ratio(speeds[:, 0], -speeds[:, 1], covariance, events)

    def slope(speeds: Floats, value: float) -> tuple[float, float]:
        return slope_over(speeds[:, 0], -speeds[:, 1], covariance, events, value)

    speeds = fitted.speeds
    found, departure, approach = ratio(speeds), speeds[:, 0], -speeds[:, 1]

    def again(values: Floats) -> Floats:
        moved = bounces.moved(known.model(values[:-1]), fitted, float(values[-1]))
        value = ratio(moved).value
        return np.concatenate([[value, slope(moved, value)[0]], moved @ np.array([1.0, found.value])])

    like = np.abs(found.off) < _OUTSIDE
    influence = _influence(bounces, events, found)
    level = drawn_level((bounces.level, level_error), seed - 3)  # the draws of the steps before
    shared = carried(again, np.append(known.values, bounces.level), np.column_stack([known.samples, level]))
    samples = found.value + scattered(influence, seed) + shared[:, :1]
    values, samples, reached = within(np.array([found.value]), samples, (BOUNDS,))
    noise = np.sqrt(variance_of(covariance, found.value))
    panel = points_and_line(
        "velocity after over velocity before an impact",
        ("approach", "m/s", "departure", "m/s"),
        ("impacts", "e times approach"),
        (approach, departure),
        (0.0, found.value),
        np.sqrt(covariance[:, 0, 0]),
    )
    rest = (departure - found.value * approach)[like]
    over, error = slope(speeds, found.value)
    around, seen = float(np.sqrt(fitted.chi.mean())), sum(one.size for one in bounces.measured)
    slow, fast = 1e3 * approach.min(), 1e3 * approach.max()
    step = StepResult(
        "restitution",
        (PATH,),
        values,
        samples,
        residuals=(
            Residual.of("departure velocities", "m/s", rest, np.hypot(noise, found.scatter * approach)[like]),
            Residual("flights around impacts, over the noise", "1", around, 1.0, seen),
        ),
        used=(Used("impacts", int(like.sum()), total),),
        files=bounces.files(),
        panels=(panel,),
        left_out=(*left, *(_unlike(bounces, departure / approach, int(r)) for r in np.flatnonzero(~like))),
        notes=(
            f"The scatter of e from impact to impact, beyond noise, is {found.scatter:.2g}.",
            f"It is that of impacts at {slow:.3g} to {fast:.3g} mm/s.",
        ),
        checks=(_over_speed(found, over, float(np.hypot(error, np.std(shared[:, 1])))),),
        bounds={PATH: reached[0]},
        influence=replace(
            influence,
            information=found.clipped_information[:, None, None],
            score=found.clipped[:, None],
            shared=(found.weight * shared[:, 2:])[:, :, None],
        ),
    )
    return step, like


def bounded(step: StepResult) -> StepResult:
    """The step with draws that keep to what a restitution can be, wherever what others say of them has moved them."""
    _, samples, reached = within(step.values, step.samples, (BOUNDS,))
    return replace(step, samples=samples, bounds={PATH: reached[0]})


def _over_speed(found: RobustRatio, slope: float, error: float) -> Check:
    """Whether the ratio goes by the speed of impact."""
    slow, fast = 1e3 * found.support.min(), 1e3 * found.support.max()
    change = slope * np.log(fast / slow)
    cause = (
        f"restitution changes with speed: by {change:+.2g} from {slow:.3g} to {fast:.3g} mm/s, where most have "
        f"{found.value:.3g} at {1e3 * float(np.median(found.support)):.3g} mm/s"
    )
    return Check(
        "slope of restitution over the logarithm of speed, in standard errors",
        abs(slope) / error,
        STEEP,
        paths=(PATH,),
        cause=cause,
        record="record bounces at further speeds of impact",
    )


def _unlike(bounces: Bounces, ratio: Floats, r: int) -> Excluded:
    """That an impact is another event than most: its weight is next to nothing."""
    trace = bounces.traces[bounces.items[r].trace]
    at = trace.time[bounces.items[r].last]
    text = f"the impact at {at:.5g} s, with a ratio of {ratio[r]:.3g}, is far off the others"
    return Excluded(trace.file, bounces.model.foot_point, text)


def _influence(bounces: Bounces, events: NDArray[np.intp], found: RobustRatio) -> Influence:
    """What each impact says of the ratio."""
    levels, covariates = of_records(bounces.traces, [one.trace for one in bounces.items])
    covariates[SPEED] = np.log(found.support)
    return Influence(
        (PATH,),
        found.clipped_information[:, None, None],
        found.score[:, None],
        np.ones(1),
        {EVENT: events} | levels,
        covariates,
    )


def variance_of(covariance: Floats, ratio: float) -> Floats:
    """Variance (n,) of departure less ratio times approach."""
    turn = np.array([1.0, -ratio])
    return np.einsum("a,nab,b->n", turn, covariance, turn)
