"""Is it determined? For every number its range, what it hangs together with, and a verdict with a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.errors import InputError
from tarsus.identify.coordinates import Coordinates
from tarsus.identify.correlation import (
    Combination,
    Sum,
    Ties,
    correlation,
    find_exponents,
    find_weight,
    left_over,
)
from tarsus.identify.profile import LogLikelihood, Profile, Profiler, one_by_one
from tarsus.identify.ranges import LEVEL, Range, range_of_draws
from tarsus.identify.step import StepResult, joined_samples

__all__ = [
    "Assessment",
    "Determined",
    "NotFromTheseData",
    "OnlyTogether",
    "ParameterVerdict",
    "judge_likelihood",
    "judge_samples",
    "judge_steps",
]

Floats = NDArray[np.float64]

_RIDGE = float(np.log(10.0))
_RELATED = 0.5
_MUCH = 0.5
"""Share of what a product leaves open that a sum must leave at most to be named instead."""


@dataclass(frozen=True)
class Determined:
    """The data fix the number: its range is narrow enough."""

    name: str
    range: Range

    def sentence(self, unit: str = "1") -> str:
        """In words, with the range in ``unit``."""
        return f"{self.name} is determined: {self.range.text(unit)} ({100 * self.range.level:g} %)."


@dataclass(frozen=True)
class OnlyTogether:
    """The data fix a product of powers, or a sum, with the number in it, but not the number."""

    name: str
    range: Range
    combination: Combination | Sum

    def sentence(self, unit: str = "1") -> str:
        """In words, with the range in ``unit``; the combination is in SI."""
        partners = [name for name in self.combination.names if name != self.name]
        fixed = self.combination.interval
        percent = 100.0 * fixed.half_width(abs(fixed.value))
        return (
            f"{self.name} is determined only together with {' and '.join(partners)}: these data fix "
            f"{self.combination} = {fixed.value:.4g} (SI) within {percent:.2g} %, and leave {self.name} alone "
            f"{_free(self.range, unit)}."
        )


@dataclass(frozen=True)
class NotFromTheseData:
    """The data fix neither the number nor a product of powers or a sum with it.

    related: the other parameters it is most correlated with, and how much.
    """

    name: str
    range: Range
    related: tuple[tuple[str, float], ...] = ()

    def sentence(self, unit: str = "1") -> str:
        """In words, with the range in ``unit``."""
        tied = ", ".join(f"{name} ({value:+.2f})" for name, value in self.related)
        more = f"; it is correlated with {tied}" if tied else ""
        return f"{self.name} is not determined by these data: they leave it {_free(self.range, unit)}{more}."


ParameterVerdict = Determined | OnlyTogether | NotFromTheseData
"""What data say of one number."""


@dataclass(frozen=True)
class Assessment:
    """What data say of np numbers.

    names; ranges (np); correlation (np, np), NaN where one does not vary; verdicts (np); basis: what they rest on.
    """

    names: tuple[str, ...]
    ranges: tuple[Range, ...]
    correlation: Floats
    verdicts: tuple[ParameterVerdict, ...]
    basis: str

    def __getitem__(self, name: str) -> ParameterVerdict:
        return self.verdicts[self.names.index(name)]

    def range(self, name: str) -> Range:
        """Range of one number, SI."""
        return self.ranges[self.names.index(name)]

    @property
    def combinations(self) -> tuple[Combination | Sum, ...]:
        """Every combination that a verdict names, once."""
        found = [one.combination for one in self.verdicts if isinstance(one, OnlyTogether)]
        return tuple({(type(one), frozenset(one.names)): one for one in found}.values())

    def sentences(self, units: Mapping[str, str] | None = None) -> list[str]:
        """One sentence a number; ``units`` are SI units by name."""
        return [one.sentence((units or {}).get(one.name, "1")) for one in self.verdicts]


def judge_samples(
    names: Sequence[str],
    values: ArrayLike,
    samples: ArrayLike,
    *,
    ties: Ties | None = None,
    sizes: Mapping[str, float] | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    level: float = LEVEL,
) -> Assessment:
    """Judge numbers by draws of them: fits to resampled repeats, or a posterior.

    A number is `Determined` when the half-width of its range is at most ``ties.width``. Else it is `OnlyTogether` when
    a product of its and at most ``ties.partners`` other numbers' powers is that narrow, and ``ties.gain`` times
    narrower than the number itself (see `find_exponents`), or a weighted sum with one other (see `find_weight`), which
    is named where it says much more than the product. Else it is `NotFromTheseData`; so is a number whose sign the
    draws leave open, unless it has a size.

    Parameters
    ----------
    names, values
        Of the numbers, SI (np,).
    samples
        Draws (ns, np); rows with NaN are left out.
    ties
        Thresholds; see `Ties`.
    sizes
        By name, for numbers that may be of either sign: what a change is compared with instead of the number itself.
    limits
        By name, where the search for a number ended: an end of a range that lies there is open.
    level
        Probability of the ranges.

    Raises
    ------
    InputError
        If names, values and samples do not fit each other, or fewer than 20 draws are finite.
    """
    rows = np.asarray(samples, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != len(names):
        raise InputError(f"expected samples of shape (draws, {len(names)}), got {rows.shape}")
    rows = rows[np.isfinite(rows).all(axis=1)]
    own = {name: _own_size(rows[:, j]) for j, name in enumerate(names) if np.asarray(values)[j] == 0.0}
    coordinates = Coordinates.of(tuple(names), values, {**own, **(sizes or {})})
    wanted = ties or Ties()
    ends = limits or {}
    ranges = tuple(
        range_of_draws(
            rows[:, j], coordinates.values[j], level=level, limits=ends.get(name, (-np.inf, np.inf))
        )
        for j, name in enumerate(coordinates.names)
    )
    u = coordinates.inward(rows)
    usable = coordinates.logarithmic & np.isfinite(u).all(axis=0) & (np.ptp(rows, axis=0) > 0.0)
    spread = np.where(np.isfinite(u).all(axis=0), u, rows)
    related = correlation(spread)
    verdicts = []
    for j, one in enumerate(ranges):
        combination = None
        if one.half_width(_size(coordinates, j)) > wanted.width and usable[j]:
            others = [int(k) for k in np.flatnonzero(usable) if k != j]
            combination = _tied_draws(coordinates, rows, np.where(usable, u, 0.0), j, others, wanted, level)
        verdicts.append(_verdict(coordinates, j, one, combination, related, wanted))
    basis = f"{len(rows)} draws"
    return Assessment(coordinates.names, ranges, related, tuple(verdicts), basis)


def _tied_draws(
    coordinates: Coordinates, rows: Floats, u: Floats, j: int, others: list[int], ties: Ties, level: float
) -> Combination | Sum | None:
    """What draws (ns, np), with logarithms u, hold fixed with parameter j."""
    products = find_exponents(u, j, others, ties, level)
    summed = find_weight(rows, j, others, ties, level)
    if summed is not None:
        k, weight, left = summed
        if not products or left < _MUCH * abs(coordinates.values[j]) * left_over(u, j, products[0][0], level):
            value = float(coordinates.values[j] + weight * coordinates.values[k])
            return _sum(
                coordinates,
                j,
                k,
                weight,
                range_of_draws(rows[:, j] + weight * rows[:, k], value, level=level),
            )
    if not products:
        return None
    powers, whole = products[0]
    used = powers != 0.0
    value = float(np.prod(np.abs(coordinates.values[used]) ** powers[used]))
    drawn = value * np.exp(u[:, used] @ powers[used])
    return _combination(coordinates, powers, range_of_draws(drawn, value, level=level), whole)


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
    decides. Correlations
    are those of the ridges' slopes, ``sqrt(du_k/du_j du_j/du_k)``: exact for a Gaussian likelihood.

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
    verdicts = []
    for j, one in enumerate(ranges):
        combination = None
        if one.half_width(_size(coordinates, j)) > wanted.width and coordinates.logarithmic[j]:
            combination = _tied(profiler, profiles, j, one, wanted) or _summed(profiler, profiles, j, wanted)
        verdicts.append(_verdict(coordinates, j, one, combination, related, wanted))
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
        own = {path: _own_size(step.draws(path)) for path in step.paths if step.value(path) == 0.0}
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
                return _combination(coordinates, powers, found, whole)
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
    return _sum(coordinates, j, k, weight, interval)


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


def _combination(coordinates: Coordinates, powers: Floats, interval: Range, whole: bool) -> Combination:
    named = [(name, float(p)) for name, p in zip(coordinates.names, powers, strict=True) if p != 0.0]
    return Combination(tuple(named), interval, whole)


def _sum(coordinates: Coordinates, j: int, k: int, weight: float, interval: Range) -> Sum:
    return Sum(((coordinates.names[j], 1.0), (coordinates.names[k], weight)), interval)


def _verdict(
    coordinates: Coordinates,
    j: int,
    one: Range,
    combination: Combination | Sum | None,
    related: Floats,
    ties: Ties,
) -> ParameterVerdict:
    name = coordinates.names[j]
    if one.half_width(_size(coordinates, j)) <= ties.width:
        return Determined(name, one)
    if combination is not None:
        return OnlyTogether(name, one, combination)
    order = np.argsort(-np.abs(np.nan_to_num(related[j])))
    strongest = [
        (coordinates.names[k], float(related[j, k]))
        for k in order
        if k != j and abs(related[j, k]) >= _RELATED
    ]
    return NotFromTheseData(name, one, tuple(strongest[:3]))


def _size(coordinates: Coordinates, j: int) -> float | None:
    return None if coordinates.logarithmic[j] else float(coordinates.sizes[j])


def _own_size(draws: Floats) -> float:
    """Size of a number estimated as zero: its largest draw, so that it does not count as determined."""
    return float(np.abs(draws).max(initial=0.0)) or 1.0


def _free(one: Range, unit: str) -> str:
    """What a range leaves open, after "they leave it"."""
    text = one.text(unit)
    if text == "anything":
        return "free to be anything"
    if not one.closed:
        return f"anything {text}"
    return f"at {text}" if one.pieces else f"anywhere from {text}"
