"""How far a number can be off: its interval from draws, plain or weighted."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.verdict import LEVEL, Verdict, cut_ends, half_width
from tarsus.tables.numbers import amount

FEWEST = 20
"""Draws from which an interval is made: of fewer its tails hold half a draw each."""

EMPTY = 0.25
"""Share of an interval that must hold no draw for it to count as two: beyond chance from twenty draws on."""

PART = 0.05
"""Share of the draws that each part of a split interval holds at least: one of twenty."""


@dataclass(frozen=True)
class Range:
    """A number and where it lies with probability ``level``.

    value, low, high in ``unit``; low is -inf and high inf where the data set no end; pieces: the parts of the interval
    in order where it has a hole, else empty; name: whose it is; verdict: what the data say of it, where they were
    asked.
    """

    value: float
    low: float
    high: float
    level: float = LEVEL
    pieces: tuple[tuple[float, float], ...] = ()
    name: str = ""
    unit: str = "1"
    verdict: Verdict | None = None

    @property
    def closed(self) -> bool:
        """Whether the data set both ends."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))

    def half_width(self, size: float | None = None) -> float:
        """Half of the interval's width relative to ``size``; without it, half of the logarithm of high over low.

        0.1 is about 10 % to either side. Infinite where an end is open, or, without a size, where the sign is.
        """
        return half_width(self.low, self.high, size)

    def text(self, unit: str | None = None) -> str:
        """The interval in a unit, as ``2.1 µm to 2.4 µm``, ``above 2.1 um`` or ``anything``."""
        unit = self.unit if unit is None else unit
        if self.closed:
            parts = self.pieces or ((self.low, self.high),)
            digits = _digits(parts)
            return " or ".join(f"{amount(low, unit, digits)} to {amount(high, unit, digits)}" for low, high in parts)
        if np.isfinite(self.low):
            return f"above {amount(self.low, unit)}"
        if np.isfinite(self.high):
            return f"below {amount(self.high, unit)}"
        return "anything"


def range_of(
    draws: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    value: float | None = None,
    level: float = LEVEL,
    limits: tuple[float, float] = (-np.inf, np.inf),
    name: str = "",
    unit: str = "1",
) -> Range:
    """Interval between equal tails of draws of a number.

    Parameters
    ----------
    draws
        (ns,): of a bootstrap, of a posterior, or the members of an ensemble; NaN is left out.
    weights
        (ns,), equal unless given.
    value
        The estimate; the median of the draws by default.
    level
        Probability between the tails.
    limits
        Where the search for the number, or what physics leaves of it, ended. An end of the interval that one of them
        cuts (`cut_ends`) was not set by the data: it is open.
    name, unit
        Whose range it is.

    Raises
    ------
    InputError
        If fewer than 20 draws without weights are finite: their tails are not known.
    """
    given = np.asarray(draws, dtype=float)
    finite = np.isfinite(given)
    if weights is None and finite.sum() < FEWEST:
        raise InputError(f"an interval needs at least {FEWEST} draws, got {int(finite.sum())}")
    known = np.sort(given[finite])
    tails = 0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level
    if weights is None:
        low, median, high = (float(q) for q in np.quantile(known, tails))
    else:
        share = np.asarray(weights, dtype=float)[finite]
        low, median, high = (weighted_quantile(given[finite], share, at) for at in tails)
    pieces = _split(known, low, high)
    cut = cut_ends(low, high, limits)
    low, high = -np.inf if cut[0] else low, np.inf if cut[1] else high
    middle = median if value is None else float(value)
    return Range(middle, low, high, level, pieces if np.isfinite([low, high]).all() else (), name, unit)


def weighted_quantile(values: Floats, weights: Floats, at: float) -> float:
    """Quantile of weighted values (n,): interpolated between the middles of their shares; NaN without values."""
    if len(values) == 0:
        return float("nan")
    order = np.argsort(values, kind="stable")
    share = weights[order] / weights.sum()
    return float(np.interp(at, np.cumsum(share) - 0.5 * share, values[order]))


def _split(known: Floats, low: float, high: float) -> tuple[tuple[float, float], ...]:
    """Parts of an interval between which a long stretch holds no draw; empty where it is one."""
    inside = known[(known >= low) & (known <= high)]
    if len(inside) < FEWEST or high <= low:
        return ()
    scale = np.log(inside) if inside[0] > 0.0 else inside
    holes = np.flatnonzero(np.diff(scale) > EMPTY * (scale[-1] - scale[0]))
    edges = [0, *(int(i) + 1 for i in holes), len(inside)]
    parts = [(a, b) for a, b in pairwise(edges) if b - a >= PART * len(inside)]
    return tuple((float(inside[a]), float(inside[b - 1])) for a, b in parts) if len(parts) > 1 else ()


def _digits(parts: tuple[tuple[float, float], ...]) -> int:
    """Digits that distinguish the ends of the narrowest part, three in its width; from 4 to 9."""
    width = min(high - low for low, high in parts)
    largest = max(abs(end) for part in parts for end in part)
    return int(np.clip(np.ceil(np.log10(largest / width)) + 2, 4, 9)) if width > 0.0 else 4
