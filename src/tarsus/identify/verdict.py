"""Is it determined? For every number its range, what it hangs together with, and a verdict with a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.fit.ranges import Range, range_of
from tarsus.fit.verdict import LEVEL
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

__all__ = [
    "Assessment",
    "Determined",
    "NotFromTheseData",
    "OnlyTogether",
    "ParameterVerdict",
    "judge_samples",
    "known_tie",
    "own_size",
    "product_of",
    "sum_of",
    "verdict_of",
]

Floats = NDArray[np.float64]

_RELATED = 0.5
_MUCH = 0.5
"""Share of what a product leaves open that a sum must leave at most to be named instead."""


@dataclass(frozen=True)
class Determined:
    """The data fix the number: its range is narrow enough."""

    name: str
    range: Range

    @property
    def word(self) -> str:
        """In a word, for tables."""
        return "determined"

    def sentence(self, unit: str = "1") -> str:
        """In words, with the range in ``unit``."""
        return f"{self.name} is determined: {self.range.text(unit)} ({100 * self.range.level:g} %)."


@dataclass(frozen=True)
class OnlyTogether:
    """The data fix a product of powers, or a sum, with the number in it, but not the number."""

    name: str
    range: Range
    combination: Combination | Sum

    @property
    def word(self) -> str:
        """In a word, for tables."""
        return "only with others"

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

    @property
    def word(self) -> str:
        """In a word, for tables."""
        return "not from these data"

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
    own = {name: own_size(rows[:, j]) for j, name in enumerate(names) if np.asarray(values)[j] == 0.0}
    coordinates = Coordinates.of(tuple(names), values, {**own, **(sizes or {})})
    wanted = ties or Ties()
    ends = limits or {}
    ranges = tuple(
        range_of(
            rows[:, j], value=coordinates.values[j], level=level, limits=ends.get(name, (-np.inf, np.inf))
        )
        for j, name in enumerate(coordinates.names)
    )
    u = coordinates.inward(rows)
    usable = coordinates.logarithmic & np.isfinite(u).all(axis=0) & (np.ptp(rows, axis=0) > 0.0)
    spread = np.where(np.isfinite(u).all(axis=0), u, rows)
    related = correlation(spread)
    verdicts: list[ParameterVerdict] = []
    for j, one in enumerate(ranges):
        tie = None
        if one.half_width(coordinates.size(j)) > wanted.width and usable[j]:
            others = [int(k) for k in np.flatnonzero(usable) if k != j]
            tie = known_tie(verdicts, one, coordinates, j, wanted)
            tie = tie or _tied_draws(coordinates, rows, np.where(usable, u, 0.0), j, others, wanted, level)
        verdicts.append(verdict_of(coordinates, j, one, tie, related, wanted))
    return Assessment(coordinates.names, ranges, related, tuple(verdicts), f"{len(rows)} draws")


def _tied_draws(
    coordinates: Coordinates, rows: Floats, u: Floats, j: int, others: list[int], ties: Ties, level: float
) -> Combination | Sum | None:
    """What draws (ns, np), with logarithms u, hold fixed with parameter j: a product, or a sum that says more.

    A sum must leave half as much open as a product with whole exponents; one with fitted exponents must leave less.
    """
    products = find_exponents(u, j, others, ties, level)
    summed = find_weight(rows, j, others, ties, level)
    if summed is not None:
        k, weight, left = summed
        rival = np.inf
        if products:
            powers, whole = products[0]
            rival = abs(coordinates.values[j]) * left_over(u, j, powers, level) * (_MUCH if whole else 1.0)
        if left < rival:
            value = float(coordinates.values[j] + weight * coordinates.values[k])
            total = range_of(rows[:, j] + weight * rows[:, k], value=value, level=level)
            return sum_of(coordinates, j, k, weight, total)
    if not products:
        return None
    powers, whole = products[0]
    used = powers != 0.0
    value = float(np.prod(np.abs(coordinates.values[used]) ** powers[used]))
    drawn = value * np.exp(u[:, used] @ powers[used])
    return product_of(coordinates, powers, range_of(drawn, value=value, level=level), whole)


def known_tie(
    before: Sequence[ParameterVerdict], own: Range, coordinates: Coordinates, j: int, ties: Ties
) -> Combination | Sum | None:
    """A combination that was named for another number already, where it serves for parameter j as well.

    What it leaves open of the number may then be ``ties.slack`` times as much, so that two numbers that are tied to
    each other are not given two combinations that differ by chance.
    """
    name = coordinates.names[j]
    for verdict in before:
        if not isinstance(verdict, OnlyTogether) or name not in verdict.combination.names:
            continue
        tie = verdict.combination
        if isinstance(tie, Sum):
            left = tie.interval.half_width(1.0) / abs(dict(tie.weights)[name])
            free = own.half_width(1.0)
            narrow = tie.interval.half_width(abs(tie.interval.value)) <= ties.width
        else:
            left = tie.interval.half_width() / abs(dict(tie.exponents)[name])
            free = own.half_width()
            narrow = left <= ties.slack * ties.width
        if narrow and left <= ties.slack / ties.gain * free:
            return tie
    return None


def product_of(coordinates: Coordinates, powers: Floats, interval: Range, whole: bool) -> Combination:
    """A product of powers (np,) of parameters, with where it lies."""
    named = [(name, float(p)) for name, p in zip(coordinates.names, powers, strict=True) if p != 0.0]
    return Combination(tuple(named), interval, whole)


def sum_of(coordinates: Coordinates, j: int, k: int, weight: float, interval: Range) -> Sum:
    """The sum of parameter j and ``weight`` times parameter k, with where it lies."""
    return Sum(((coordinates.names[j], 1.0), (coordinates.names[k], weight)), interval)


def verdict_of(
    coordinates: Coordinates,
    j: int,
    one: Range,
    combination: Combination | Sum | None,
    related: Floats,
    ties: Ties,
) -> ParameterVerdict:
    """Verdict on parameter j from its range and what it is tied to; ``related`` (np, np) are correlations."""
    name = coordinates.names[j]
    if one.half_width(coordinates.size(j)) <= ties.width:
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


def own_size(draws: Floats) -> float:
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
