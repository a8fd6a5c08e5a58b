"""Verdicts by profile likelihood, and of a whole chain of steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.fit.verdict import LEVEL
from tarsus.identify.coordinates import Coordinates
from tarsus.identify.correlation import Combination, Sum, Ties, find_exponents, find_weight
from tarsus.identify.profile import LogLikelihood, Profile, Profiler, one_by_one
from tarsus.identify.ranges import Range
from tarsus.identify.step import StepResult, joined_samples
from tarsus.identify.verdict import (
    Assessment,
    ParameterVerdict,
    judge_samples,
    known_tie,
    own_size,
    product_of,
    sum_of,
    verdict_of,
)

__all__ = ["judge_likelihood", "judge_steps"]

Floats = NDArray[np.float64]

_RIDGE = float(np.log(10.0))


def judge_likelihood(
    names: Sequence[str],
    values: ArrayLike,
    likelihood: LogLikelihood,
    *,
    ties: Ties | None = None,
    sizes: Mapping[str, float] | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    level: float = LEVEL,
    starts: int = 64,
    step: float = 1e-4,
) -> Assessment:
    """Judge numbers by profile likelihoods (see `Profiler`, which also tells the parameters).

    Verdicts as in `judge_samples`. A product of powers, or else a sum, is read off the ridge, the points that all
    profiles together passed through within a factor of ten of the best, and then has a profile of its own, which
    decides. Correlations are those of the ridges' slopes, ``sqrt(du_k/du_j du_j/du_k)``: exact for a Gaussian
    likelihood.

    Parameters
    ----------
    names, values
        Of the numbers, (np,) where the likelihood is best [SI].
    likelihood
        Logarithm of it at values (n, np), as (n,).
    ties, sizes, limits, level, starts, step
        As `Profiler` takes them.

    Raises
    ------
    InputError
        As `Profiler` and `Coordinates.of`.
    """
    coordinates = Coordinates.of(tuple(names), values, sizes)
    wanted = ties or Ties()
    profiler = Profiler(likelihood, coordinates, limits, level=level, starts=starts, step=step)
    profiles = _consistent(profiler)
    ranges = tuple(profiler.range_of(j, profile) for j, profile in enumerate(profiles))
    related = _correlation_of_ridges(profiles)
    verdicts: list[ParameterVerdict] = []
    for j, one in enumerate(ranges):
        tie = None
        if one.half_width(coordinates.size(j)) > wanted.width and coordinates.logarithmic[j]:
            tie = known_tie(verdicts, one, coordinates, j, wanted)
            tie = tie or _tied(profiler, profiles, j, one, wanted) or _summed(profiler, profiles, j, wanted)
        verdicts.append(verdict_of(coordinates, j, one, tie, related, wanted))
    return Assessment(coordinates.names, ranges, related, tuple(verdicts), "profile likelihoods")


def judge_steps(
    steps: Mapping[str, StepResult],
    *,
    ties: Ties | None = None,
    sizes: Mapping[str, float] | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    level: float = LEVEL,
) -> Assessment:
    """Judge all numbers of a chain by the draws of its steps side by side.

    The draws carry what earlier steps do not know into later ones, and tie numbers of different steps together. A range
    without an end is what draws cannot show: where a step has a likelihood, its profiles are taken, the other steps
    being as found, and a number whose profile does not close has the range and the verdict of that.

    Raises
    ------
    InputError
        As `judge_samples`; or if the steps have different numbers of draws.
    """
    paths, samples = joined_samples(steps)
    values = np.concatenate([step.values for step in steps.values() if step.paths])
    found = judge_samples(paths, values, samples, ties=ties, sizes=sizes, limits=limits, level=level)
    ranges, verdicts = list(found.ranges), list(found.verdicts)
    for step in steps.values():
        if step.likelihood is None or not step.paths:
            continue
        own = {path: own_size(step.draws(path)) for path in step.paths if step.value(path) == 0.0}
        given = {path: size for path, size in (sizes or {}).items() if path in step.paths}
        ends = {path: pair for path, pair in (limits or {}).items() if path in step.paths}
        profiled = judge_likelihood(
            step.paths, step.values, one_by_one(step.likelihood), ties=ties, sizes={**own, **given}, limits=ends,
            level=level, starts=0,
        )  # fmt: skip
        for path in step.paths:
            if not profiled.range(path).closed:
                k = paths.index(path)
                ranges[k], verdicts[k] = profiled.range(path), profiled[path]
    return Assessment(paths, tuple(ranges), found.correlation, tuple(verdicts), found.basis)


def _consistent(profiler: Profiler) -> list[Profile]:
    """Profiles of all parameters from one and the same maximum."""
    for _ in range(4):
        lowest = profiler.lowest
        profiles = [profiler.of(j) for j in range(len(profiler.best))]
        if profiler.lowest >= lowest - 1e-3:
            return profiles
    raise InputError("the likelihood has ever higher maxima: give more starts, or narrower limits")


def _tied(profiler: Profiler, profiles: list[Profile], j: int, own: Range, ties: Ties) -> Combination | None:
    """A product of powers with parameter j that has a narrow profile."""
    coordinates = profiler.coordinates
    others = [int(k) for k in np.flatnonzero(coordinates.logarithmic) if k != j]
    cloud = np.vstack([profile.ridge for profile in profiles])
    near = cloud[np.all(np.abs(cloud - profiler.best) <= _RIDGE, axis=1)]
    for points in (near, cloud):
        if len(points) < 2 * len(coordinates.names):
            continue
        for powers, whole in find_exponents(points, j, others, ties, level=1.0):
            found = profiler.range_of_product(powers, profiler.along(powers))
            width = found.half_width() / abs(powers[j])
            if width <= min(ties.width, own.half_width() / ties.gain):
                return product_of(coordinates, powers, found, whole)
    return None


def _summed(profiler: Profiler, profiles: list[Profile], j: int, ties: Ties) -> Sum | None:
    """A sum with parameter j that has a narrow profile."""
    coordinates = profiler.coordinates
    cloud = np.vstack([profile.ridge for profile in profiles])
    points = coordinates.outward(cloud[np.all(cloud - profiler.best <= _RIDGE, axis=1)])
    others = [int(k) for k in np.flatnonzero(coordinates.logarithmic) if k != j]
    found = find_weight(points, j, others, ties, level=1.0)
    if found is None:
        return None
    k, weight, _ = found
    interval = profiler.range_of_sum(j, k, weight)
    if interval.half_width(abs(interval.value)) > ties.width:
        return None
    return sum_of(coordinates, j, k, weight, interval)


def _correlation_of_ridges(profiles: list[Profile]) -> Floats:
    """Correlations (np, np) from how far the others follow when one parameter is moved."""
    count = len(profiles)
    slopes = np.full((count, count), np.nan)
    for j, profile in enumerate(profiles):
        moved = profile.ridge - profile.ridge[np.argmin(profile.drop)]
        weight = float(moved[:, j] @ moved[:, j])
        if weight > 0.0:
            slopes[j] = moved.T @ moved[:, j] / weight
    both = slopes * slopes.T
    return np.sign(slopes) * np.sqrt(np.clip(both, 0.0, 1.0))
