"""Whether a curve over a parameter does what is said of it: rises, falls, peaks inside, has extrema; by fixed rules.

A curve has a value at every value of the parameter for several replicates: the same sweep on other grounds. `CRITERION`
has the rules in sentences.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from scipy.signal import find_peaks
from scipy.stats import spearmanr

from tarsus.base.arrays import Floats
from tarsus.measure import STANDSTILL

RELEVANT = 0.01
"""A change counts from so much of the largest magnitude on: what is said of a trend was read off a printed figure, in
which a line is a hundredth of its height wide."""
SIGNIFICANT = 0.01
"""Noise has such a rank correlation in one replicate of a hundred; all of five, as a verdict asks, in one of 1e10."""
PROMINENT = 0.05
"""An extremum that one points at in a printed figure stands out by several widths of its line."""

CRITERION = (
    "A trend agrees if every replicate shows it, is insensitive if no replicate changes, is contradicted if every "
    "replicate that changes shows the opposite, and is not determined else. A replicate changes if its range exceeds "
    f"{100 * RELEVANT:g} % of its largest magnitude and twice its median spread. The spread is that from period to "
    "period, of a settled motion the standard error over starts. A replicate rises or "
    f"falls if its rank correlation (Spearman's rho) has that sign with p < {SIGNIFICANT:g}; it is largest at a "
    "critical value if it exceeds both ends of the range by as much as a change needs; a local extremum stands out by "
    f"{100 * PROMINENT:g} % of the range."
)
"""The rules of this module in a few sentences."""


class TrendVerdict(Enum):
    """What a simulation says of a claim."""

    AGREES = "agrees"
    CONTRADICTS = "contradicts"
    INSENSITIVE = "insensitive"
    NOT_DETERMINED = "not determined"


@dataclass(frozen=True)
class TrendCurve:
    """A measure over a parameter.

    x (nx,), increasing; y (nx, nr) values of nr replicates, SI; spread (nx, nr) by how much each is uncertain, NaN
    where a measure has none. Values that are not finite are left out.
    """

    x: Floats
    y: Floats
    spread: Floats

    def beyond(self, least: float) -> TrendCurve:
        """The part from ``least`` on."""
        inside = self.x >= least * (1.0 - 1e-9)
        return TrendCurve(self.x[inside], self.y[inside], self.spread[inside])

    @property
    def replicates(self) -> list[Replicate]:
        """One curve for each replicate."""
        return [Replicate.of(self.x, y, spread) for y, spread in zip(self.y.T, self.spread.T, strict=True)]


@dataclass(frozen=True)
class Replicate:
    """One replicate of a curve: x (n,), y (n,) where they are finite; least: a difference that counts."""

    x: Floats
    y: Floats
    least: float

    @classmethod
    def of(cls, x: Floats, y: Floats, spread: Floats) -> Replicate:
        """From values (nx,) and their spread (nx,)."""
        known = np.isfinite(y)
        noise = spread[known & np.isfinite(spread)]
        twice = 2.0 * float(np.median(noise)) if noise.size else 0.0
        size = float(np.abs(y[known]).max(initial=0.0))
        return cls(x[known], y[known], max(RELEVANT * size, twice))

    @property
    def changes(self) -> bool:
        """Whether its range counts."""
        return len(self.y) > 2 and float(np.ptp(self.y)) > self.least

    @property
    def known(self) -> bool:
        """Whether it has enough values to tell a change."""
        return len(self.y) > 2

    def rank(self) -> tuple[float, float]:
        """Spearman's rho and its two-sided p; 0 and 1 where it does not change."""
        if not self.changes:
            return 0.0, 1.0
        found = spearmanr(self.x, self.y)
        return float(found.statistic), float(found.pvalue)  # pyright: ignore[reportAttributeAccessIssue]

    def inside(self) -> float | None:
        """The x of the largest value, if it exceeds both ends by what counts."""
        if not self.changes:
            return None
        top = int(np.argmax(self.y))
        return float(self.x[top]) if self.y[top] - max(self.y[0], self.y[-1]) > self.least else None

    def extrema(self) -> tuple[list[float], list[float]]:
        """The x of local maxima and of local minima."""
        if not self.changes:
            return [], []
        stands_out = max(PROMINENT * float(np.ptp(self.y)), self.least)
        high, low = (find_peaks(sign * self.y, prominence=stands_out)[0] for sign in (1.0, -1.0))
        return self.x[high].tolist(), self.x[low].tolist()


@dataclass(frozen=True)
class Finding:
    """A verdict with the numbers behind it.

    first, last: mean over replicates at the ends; rho: of each replicate; at: where something is, such as the maximum
    of each replicate; words: the reason in short.
    """

    verdict: TrendVerdict
    words: str
    first: float
    last: float
    rho: tuple[float, ...]
    at: tuple[float, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "verdict": self.verdict.value,
            "words": self.words,
            "first": self.first,
            "last": self.last,
            "rho": list(self.rho),
            "at": list(self.at),
        }


class Claim(ABC):
    """Something said of a curve."""

    @property
    @abstractmethod
    def words(self) -> str:
        """What is said, as a verb: 'falls'."""

    @abstractmethod
    def judge(self, curve: TrendCurve) -> Finding:
        """What the curve says of it."""


class ReplicateClaim(Claim):
    """Something that each replicate shows or not; each_place: of its places one for each replicate is told, else each
    place once."""

    each_place = True

    @abstractmethod
    def shown(self, one: Replicate) -> tuple[bool, bool, list[float]]:
        """Whether a replicate that changes shows it, whether it shows the opposite, and where something is."""

    @abstractmethod
    def reason(self, replicates: Sequence[Replicate], at: Sequence[float]) -> str:
        """What the replicates show, in short; at: where, of all of them."""

    def part(self, curve: TrendCurve) -> TrendCurve:
        """The part of a curve of which it is said."""
        return curve

    def judge(self, curve: TrendCurve) -> Finding:
        part = self.part(curve)
        replicates = part.replicates
        shown = [self.shown(one) for one in replicates]
        at = [place for _, _, places in shown for place in places]
        at = at if self.each_place else sorted(set(at))
        right = [one.changes and yes for one, (yes, _, _) in zip(replicates, shown, strict=True)]
        opposite = [no for one, (_, no, _) in zip(replicates, shown, strict=True) if one.changes]
        words = self.reason(replicates, at)
        if not all(one.known for one in replicates):
            verdict, words = TrendVerdict.NOT_DETERMINED, "too few runs reached their end"
        elif not any(one.changes for one in replicates):
            verdict = TrendVerdict.INSENSITIVE
            words = "does not change" if any(np.any(one.y) for one in replicates) else "0 throughout"
        elif all(right):
            verdict = TrendVerdict.AGREES
        elif all(opposite):
            verdict = TrendVerdict.CONTRADICTS
        else:
            verdict = TrendVerdict.NOT_DETERMINED
            words += f" ({sum(right)} of {len(right)} replicates as said)"
        first, last = (
            float(np.mean(row[np.isfinite(row)])) if np.isfinite(row).any() else np.nan for row in part.y[[0, -1]]
        )
        rho = tuple(one.rank()[0] for one in replicates)
        return Finding(verdict, words, first, last, rho, tuple(at))


@dataclass(frozen=True)
class Direction(ReplicateClaim):
    """The curve goes one way (sign 1 or -1), over its whole range or from `beyond` on."""

    sign: int
    beyond: float | None = None

    @property
    def words(self) -> str:
        return "rises" if self.sign > 0 else "falls"

    def part(self, curve: TrendCurve) -> TrendCurve:
        return curve if self.beyond is None else curve.beyond(self.beyond)

    def shown(self, one: Replicate) -> tuple[bool, bool, list[float]]:
        rho, p = one.rank()
        sure = p < SIGNIFICANT
        return sure and self.sign * rho > 0.0, sure and self.sign * rho < 0.0, []

    def reason(self, replicates: Sequence[Replicate], at: Sequence[float]) -> str:
        return f"rho {_range([one.rank()[0] for one in replicates])}"


def rises(beyond: float | None = None) -> Direction:
    """It rises, over its whole range or from `beyond` on."""
    return Direction(1, beyond)


def falls(beyond: float | None = None) -> Direction:
    """It falls, over its whole range or from `beyond` on."""
    return Direction(-1, beyond)


@dataclass(frozen=True)
class HasMaximum(ReplicateClaim):
    """It is largest at a critical value strictly inside the range."""

    @property
    def words(self) -> str:
        return "is largest at a critical value"

    def shown(self, one: Replicate) -> tuple[bool, bool, list[float]]:
        place = one.inside()
        return place is not None, place is None, [] if place is None else [place]

    def reason(self, replicates: Sequence[Replicate], at: Sequence[float]) -> str:
        return f"largest at {_range(at)}" if at else "largest at an end"


@dataclass(frozen=True)
class HasExtrema(ReplicateClaim):
    """It has both a local maximum and a local minimum strictly inside the range."""

    each_place = False

    @property
    def words(self) -> str:
        return "has a local maximum and minimum"

    def shown(self, one: Replicate) -> tuple[bool, bool, list[float]]:
        high, low = one.extrema()
        return bool(high and low), not high and not low, [*high, *low]

    def reason(self, replicates: Sequence[Replicate], at: Sequence[float]) -> str:
        if not at:
            return "no local extremum"
        places = [one.extrema() for one in replicates]
        kinds = [name for k, name in enumerate(("maximum", "minimum")) if any(place[k] for place in places)]
        return f"local {' and '.join(kinds)} at {_range(at)}"


MUCH = 2.0
"""A ratio that counts as 'much greater': the least that nobody would call 'greater' alone, and a convention."""


@dataclass(frozen=True)
class MuchAbove(Claim):
    """Its first value, of the first replicate, is much greater than another (of a place and a replicate): `MUCH` times.

    A length below `STANDSTILL` is none. other: of what that is, in words.
    """

    other: str
    place: tuple[int, int]

    @property
    def words(self) -> str:
        return f"is much greater than on {self.other}"

    def judge(self, curve: TrendCurve) -> Finding:
        one, other = (float(curve.y[at]) for at in ((0, 0), self.place))
        ratio = one / other if other > STANDSTILL else np.inf
        words = f"{ratio:.3g} times" if np.isfinite(ratio) else "the other stands still"
        if not np.isfinite([one, other]).all():
            verdict, words = TrendVerdict.NOT_DETERMINED, "too few runs reached their end"
        elif max(one, other) <= STANDSTILL or abs(ratio - 1.0) <= RELEVANT:
            verdict = TrendVerdict.INSENSITIVE
        elif one <= STANDSTILL or ratio < 1.0:
            verdict = TrendVerdict.CONTRADICTS
        else:
            verdict = TrendVerdict.AGREES if ratio >= MUCH else TrendVerdict.NOT_DETERMINED
        return Finding(verdict, words, one, other, ())


def _range(values: Sequence[float]) -> str:
    """One number, or the smallest and the largest."""
    low, high = (f"{one:.3g}" for one in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
