"""Whether a curve over a parameter does what is said of it: rises, falls, peaks inside, has extrema; by fixed rules.

A curve has a value at every value of the parameter for several replicates: the same sweep on other grounds. `CRITERION`
has the rules in sentences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from tarsus.base.arrays import Floats
from tarsus.measure import STANDSTILL

RELEVANT = 0.01
"""A change counts from so much of the largest magnitude on: what is said of a trend was read off a printed figure, in
which a line is a hundredth of its height wide."""
SIGNIFICANT = 0.01
"""Noise has such a rank correlation in one replicate of a hundred; all of five, as a verdict asks, in one of 1e10."""
PROMINENT = 0.05
"""An extremum that one points at in a printed figure stands out by several widths of its line."""
MUCH = 2.0
"""A ratio that counts as 'much greater': the least that nobody would call 'greater' alone, and a convention."""

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

SIGNS = {"rises": 1.0, "falls": -1.0}
MUCH_ABOVE = {"(b)": (1, 1), "(a) with the electrostatics of (b)": (1, 0), "(a) with the adhesion of (b)": (0, 1)}
"""What the first value of the first replicate is compared with: its place and replicate."""
SAID = {
    **{name: name for name in SIGNS},
    "maximum": "is largest at a critical value",
    "extrema": "has a local maximum and minimum",
    **{f"much above {name}": f"is much greater than on {name}" for name in MUCH_ABOVE},
}
"""What can be said of a curve, as verbs. Extrema and maxima lie strictly inside the range."""


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
    rho: tuple[float, ...] = ()
    at: tuple[float, ...] = ()


class _ReplicateLook(NamedTuple):
    """One replicate: whether it has enough values to tell a change, whether it changes, whether it is no zero, its
    rank correlation, whether it shows what is said or the opposite, and where it has maxima and minima."""

    known: bool
    moves: bool = False
    some: bool = False
    rho: float = 0.0
    right: bool = False
    wrong: bool = False
    high: Sequence[float] = ()
    low: Sequence[float] = ()


def judge(said: str, curve: TrendCurve, beyond: float | None = None) -> Finding:
    """What a curve says of a claim, a word of `SAID`; beyond: of which part of the range it is said."""
    other = MUCH_ABOVE.get(said.removeprefix("much above "))
    if other is not None:
        return _much_above(curve, other)
    inside = curve.x >= (-np.inf if beyond is None else beyond * (1.0 - 1e-9))
    x, y, spread = curve.x[inside], curve.y[inside], curve.spread[inside]
    looks = [_look(said, x, *one) for one in zip(y.T, spread.T, strict=True)]
    moving = [one for one in looks if one.moves]
    at = [place for one in looks for place in (*one.high, *one.low)]
    at = sorted(set(at)) if said == "extrema" else at
    words = _reason(said, looks, at)
    if not all(one.known for one in looks):
        verdict, words = TrendVerdict.NOT_DETERMINED, "too few runs reached their end"
    elif not moving:
        verdict = TrendVerdict.INSENSITIVE
        words = "does not change" if any(one.some for one in looks) else "0 throughout"
    elif all(one.right for one in looks):
        verdict = TrendVerdict.AGREES
    elif all(one.wrong for one in moving):
        verdict = TrendVerdict.CONTRADICTS
    else:
        verdict = TrendVerdict.NOT_DETERMINED
        words += f" ({sum(one.right for one in looks)} of {len(looks)} replicates as said)"
    ends = [row[np.isfinite(row)] for row in y[[0, -1]]]
    first, last = (float(np.mean(row)) if row.size else np.nan for row in ends)
    return Finding(verdict, words, first, last, tuple(one.rho for one in looks), tuple(at))


def _look(said: str, x: Floats, y: Floats, spread: Floats) -> _ReplicateLook:
    """What a replicate (nx,) shows of a claim."""
    from scipy.stats import spearmanr  # takes longer to load than a verb

    known = np.isfinite(y)
    noise = spread[known & np.isfinite(spread)]
    x, y = x[known], y[known]
    least = max(RELEVANT * float(np.abs(y).max(initial=0.0)), 2.0 * float(np.median(noise)) if noise.size else 0.0)
    if len(y) <= 2 or np.ptp(y) <= least:
        return _ReplicateLook(len(y) > 2, some=bool(np.any(y)))
    found = spearmanr(x, y)
    rho, p = float(found.statistic), float(found.pvalue)  # pyright: ignore[reportAttributeAccessIssue]
    if said in SIGNS:
        way = SIGNS[said] * rho if p < SIGNIFICANT else 0.0
        return _ReplicateLook(True, True, True, rho, way > 0.0, way < 0.0)
    if said == "maximum":
        inside = float(y.max() - max(y[0], y[-1])) > least
        return _ReplicateLook(True, True, True, rho, inside, not inside, [float(x[np.argmax(y)])] * inside)
    stands_out = max(PROMINENT * float(np.ptp(y)), least)
    high, low = (x[find_peaks(sign * y, prominence=stands_out)[0]].tolist() for sign in (1.0, -1.0))
    return _ReplicateLook(True, True, True, rho, bool(high and low), not high and not low, high, low)


def _reason(said: str, looks: Sequence[_ReplicateLook], at: Sequence[float]) -> str:
    """What the replicates show, in short."""
    if said in SIGNS:
        return f"rho {_range([one.rho for one in looks])}"
    if said == "maximum":
        return f"largest at {_range(at)}" if at else "largest at an end"
    kinds = ["maximum"] * any(one.high for one in looks) + ["minimum"] * any(one.low for one in looks)
    return f"local {' and '.join(kinds)} at {_range(at)}" if at else "no local extremum"


def _much_above(curve: TrendCurve, place: tuple[int, int]) -> Finding:
    """Whether the first value is `MUCH` times another; a length below `STANDSTILL` is none."""
    one, other = (float(curve.y[at]) for at in ((0, 0), place))
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
    return Finding(verdict, words, one, other)


def _range(values: Sequence[float]) -> str:
    """One number, or the smallest and the largest."""
    low, high = (f"{one:.3g}" for one in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
