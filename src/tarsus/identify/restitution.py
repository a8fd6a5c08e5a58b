"""Bounces -> the coefficient of restitution.

``g'+ = -e g'-`` (2.12, sign by E6) for every impact, with the velocities of the foot from the flights on both
sides; all impacts together by a regression with errors in both velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.identify.bounce import BounceFit, Bounces, fewer, find_bounces, offsets_of_records
from tarsus.identify.detachment import WORST
from tarsus.identify.draws import DRAWS, NORMAL, carried, newton_draws, within
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import FilmConstants
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Residual, StepResult, Used, points_and_line
from tarsus.identify.traces import Trace
from tarsus.impacts.estimates import Spread, common_ratio
from tarsus.records.excluded import Excluded, Exclusion

Floats = NDArray[np.float64]

PATH = "ground.restitution.coefficient"
FEWEST = 5
"""Bounces that are needed."""
BOUNDS = (0.0, 1.0)
"""A foot that departs has lost energy in the impact, and does not depart into the ground."""

MOST = 200
"""Impacts that are fitted at most: the ratio is then known to a fourteenth of what one tells, and the scatter to a
twentieth."""
_OUTSIDE = 3.5
"""Deviations from the middle ratio beyond which an impact is none like the others: of two thousand normal ones one
is."""
_TURN = np.array([[1.0, -1.0], [-1.0, 1.0]])
"""Sign that turns the approach velocity into a speed, in covariances."""


@dataclass(frozen=True)
class BounceStudy:
    """The step's result, and the impacts it used, as fitted."""

    step: StepResult
    bounces: Bounces
    fitted: BounceFit


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
    items = fewer(found, MOST)
    files = ", ".join(sorted({trace.file for trace in traces}))
    if len(items) < FEWEST:
        raise InputError(
            f"{files}: channel '{model.foot_point}' shows {len(items)} bounces that can be used, of {total} "
            "impacts; at least "
            f"{FEWEST} are needed: drive it harder, sample faster or record longer"
        )
    if len(items) < len(found):
        text = f"{len(found) - len(items)} of {len(found)} bounces, evenly from all: {MOST} are enough"
        count = len(found) - len(items)
        left.append(Excluded("all records of bounces", model.foot_point, text, count, Exclusion.ENOUGH))
    bounces = Bounces(traces, items, level[0])
    # a device with an impact map of its own need not follow the mass-weighted law
    fitted = bounces.fit(model, film_of(model), free=model.scene.ground.impact is not None)
    settled, single, good = sound(model, bounces, fitted)
    for r in np.flatnonzero(~good):
        trace = traces[items[int(r)].trace]
        at = trace.time[items[int(r)].last]
        if single[r]:
            ratio = -fitted.speeds[r, 0] / fitted.speeds[r, 1]
            text = f"the impact at {at:.5g} s, with a ratio of {ratio:.3g}, is far off the others"
            left.append(Excluded(trace.file, model.foot_point, text, kind=Exclusion.UNLIKE))
            continue
        if not settled[r]:
            text = f"the fit of the motion around the impact at {at:.5g} s does not settle"
            left.append(Excluded(trace.file, model.foot_point, text))
            continue
        text = (
            f"the motion around the impact at {at:.5g} s is no free motion with one impact (chi-squared "
            f"{fitted.chi[r]:.3g})"
        )
        left.append(Excluded(trace.file, model.foot_point, text))
    if np.count_nonzero(good) < FEWEST:
        raise InputError(
            f"{files}: channel '{model.foot_point}': {np.count_nonzero(good)} of {total} impacts are single "
            "ones between free "
            f"motions of this structure; at least {FEWEST} are needed"
        )
    bounces = bounces.chosen(good)
    fitted = _only(fitted, good)
    return BounceStudy(_result(model, known, bounces, fitted, left, total, level[1], seed), bounces, fitted)


def sound(
    model: FootModel, bounces: Bounces, fitted: BounceFit
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Impacts (ni,) whose fit has settled; those of these that are one impact between free flights; and those of these
    whose ratio of velocities is like most others'."""
    again = bounces.moved(model, film_of(model), fitted)
    error = np.sqrt(np.maximum(np.einsum("raa->ra", fitted.covariance), 0.0))
    settled = np.all(np.abs(again - fitted.speeds) <= error, axis=1) & (
        np.linalg.eigvalsh(fitted.covariance)[:, 0] > 0.0
    )
    single = (fitted.chi < WORST) & (fitted.speeds[:, 1] < 0.0) & settled
    return settled, single, single & _alike(fitted, single)


def _alike(fitted: BounceFit, single: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Impacts whose ratio is as far from the middle one as its error allows, or as most others are by theirs.

    A foot that was caught and let go again within a sample looks like a weak rebound."""
    if not single.any():
        return single
    departure, approach = fitted.speeds[:, 0], -fitted.speeds[:, 1]
    ratio = departure / np.where(approach > 0.0, approach, np.nan)
    middle = float(np.nanmedian(ratio[single]))
    error = np.sqrt(np.maximum(_variance(fitted.covariance * _TURN, middle), 0.0)) / np.abs(approach)
    off = np.abs(ratio - middle) / np.where(error > 0.0, error, np.nan)
    usual = 1.4826 * float(np.nanmedian(off[single]))
    return off < _OUTSIDE * max(usual, 1.0)


def film_of(model: FootModel) -> FilmConstants:
    """The film of a model's ground; none damps nothing."""
    law = model.scene.ground.acting.film
    return FilmConstants(0.0, 1.0) if law is None else FilmConstants(law.coefficient, law.thickness)


def _only(fitted: BounceFit, keep: NDArray[np.bool_]) -> BounceFit:
    residuals = tuple(one for one, yes in zip(fitted.residuals, keep, strict=True) if yes)
    return replace(
        fitted,
        unknowns=fitted.unknowns[keep],
        speeds=fitted.speeds[keep],
        covariance=fitted.covariance[keep],
        chi=fitted.chi[keep],
        residuals=residuals,
        inverse=fitted.inverse[keep],
    )


def _result(
    model: FootModel,
    known: Estimates,
    bounces: Bounces,
    fitted: BounceFit,
    left: Sequence[Excluded],
    total: int,
    level_error: float,
    seed: int,
) -> StepResult:
    equations = bounces.about(model, film_of(model), fitted.unknowns, fitted.free(model))
    zeros = offsets_of_records(model, bounces, equations, level_error, seed)
    fitted_speeds = zeros.moved(fitted.speeds, zeros.values)
    departure, approach = fitted_speeds[:, 0], -fitted_speeds[:, 1]
    covariance = fitted.covariance * _TURN
    try:
        whole = common_ratio(departure, approach, covariance)
    except OverflowError:
        raise InputError("velocities before and after the impacts have no ratio in common") from None

    def again(values: Floats) -> Floats:
        other = known.model(values)
        speeds = zeros.moved(bounces.moved(other, film_of(other), fitted), zeros.values)
        return np.array([common_ratio(speeds[:, 0], -speeds[:, 1], covariance).value])

    def shifted(values: Floats) -> Floats:
        speeds = zeros.moved(fitted.speeds, values)
        return np.array([common_ratio(speeds[:, 0], -speeds[:, 1], covariance).value])

    groups = np.array([one.trace for one in bounces.items])
    own = _draws(departure, approach, covariance, groups, whole, seed)
    samples = whole.value + own[:, None] + carried(again, known.values, known.samples)
    samples = samples + carried(shifted, zeros.values.ravel(), zeros.samples.reshape(len(samples), -1))
    values, samples, reached = within(np.array([whole.value]), samples, (BOUNDS,))
    noise = _variance(covariance, whole.value)
    rest = departure - whole.value * approach

    panels = points_and_line(
        ("velocity after over velocity before an impact", "what e times approach leaves"),
        ("approach", "m/s", "departure", "m/s"), ("impacts", "e times approach"), (approach, departure),
        (0.0, whole.value), (np.sqrt(covariance[:, 0, 0]), np.sqrt(noise)),
    )  # fmt: skip
    return StepResult(
        "restitution",
        (PATH,),
        values,
        samples,
        residuals=(
            Residual(
                "departure velocities",
                "m/s",
                float(np.sqrt(np.mean(rest**2))),
                float(np.sqrt(np.mean(noise))),
                len(rest),
            ),
        ),
        used=(Used("impacts", len(departure), total),),
        files=frozenset(bounces.traces[one.trace].file for one in bounces.items),
        left_out=tuple(left),
        panels=panels,
        notes=(f"The scatter of e from impact to impact, beyond noise, is {whole.scatter:.2g}.",),
        bounds={PATH: reached[0]},
    )


def _variance(covariance: Floats, ratio: float) -> Floats:
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
    allowed = (whole.high - whole.low) / (2.0 * NORMAL)
    numbers, which = np.unique(groups, return_inverse=True)
    if len(numbers) < FEWEST:
        return allowed * np.random.default_rng([seed, 11]).standard_normal(DRAWS)
    weight = 1.0 / _variance(covariance, whole.value)
    shares = weight * approach**2, weight * approach * (departure - whole.value * approach)
    information, score = (np.asarray(np.bincount(which, share), dtype=np.float64) for share in shares)
    own = newton_draws(information[:, None, None], score[:, None], seed)[:, 0]
    return own * max(1.0, allowed / float(np.std(own)))
