"""How far a number can be off: its interval from draws, or over repeats of a measurement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import bootstrap, norm, t

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity
from tarsus.fit.verdict import LEVEL, cut_ends, half_width

__all__ = ["Range", "Resampled", "over_repeats", "range_of_draws", "range_of_repeats"]

Floats = NDArray[np.float64]
T = TypeVar("T")

_FEWEST = 8
"""Repeats from which on they are drawn; fewer have the interval of Student's t."""

_EMPTY = 0.25
"""Share of an interval that must hold no draw for it to count as two."""

_PART = 0.05
"""Share of the draws that each part of a split interval holds at least."""


@dataclass(frozen=True)
class Range:
    """A number and where it lies with probability ``level``.

    value, low, high in one unit; low is -inf and high inf where the data set no end; pieces: the parts of the interval
    in order where it has a hole, else empty.
    """

    value: float
    low: float
    high: float
    level: float = LEVEL
    pieces: tuple[tuple[float, float], ...] = ()

    @property
    def closed(self) -> bool:
        """Whether the data set both ends."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))

    def half_width(self, size: float | None = None) -> float:
        """Half of the interval's width relative to ``size``; without it, half of the logarithm of high over low.

        0.1 is about 10 % to either side. Infinite where an end is open, or, without a size, where the sign is.
        """
        return half_width(self.low, self.high, size)

    def text(self, unit: str = "1") -> str:
        """The interval in a unit, as ``2.1 um to 2.4 um``, ``above 2.1 um`` or ``anything``."""
        if self.closed:
            parts = self.pieces or ((self.low, self.high),)
            digits = _digits(parts)
            return " or ".join(
                f"{_shown(low, unit, digits)} to {_shown(high, unit, digits)}" for low, high in parts
            )
        if np.isfinite(self.low):
            return f"above {_shown(self.low, unit)}"
        if np.isfinite(self.high):
            return f"below {_shown(self.high, unit)}"
        return "anything"


@dataclass(frozen=True)
class Resampled:
    """A fit to repeats, and to draws of them with replacement.

    values (np,); samples (ns, np): the fit to every draw that could be fitted; failed: draws that could not; ranges:
    of each number, NaN ends where the draws do not tell.
    """

    values: Floats
    samples: Floats
    failed: int
    ranges: tuple[Range, ...]


def range_of_draws(
    draws: ArrayLike,
    value: float | None = None,
    *,
    level: float = LEVEL,
    limits: tuple[float, float] = (-np.inf, np.inf),
) -> Range:
    """Interval between equal tails of draws (ns,) of a number.

    Parameters
    ----------
    draws
        From a bootstrap or of a posterior; NaN is left out.
    value
        The estimate; the median of the draws by default.
    level
        Probability between the tails.
    limits
        Where the search for the number, or what physics leaves of it, ended. An end of the interval that one of them
        cuts (`cut_ends`) was not set by the data: it is open.

    Raises
    ------
    InputError
        If fewer than 20 draws are finite: their tails are not known.
    """
    known = np.sort(np.asarray(draws, dtype=float))
    known = known[np.isfinite(known)]
    if len(known) < 20:
        raise InputError(f"an interval needs at least 20 draws, got {len(known)}")
    low, high = (float(q) for q in np.quantile(known, [0.5 - 0.5 * level, 0.5 + 0.5 * level]))
    middle = float(np.median(known)) if value is None else float(value)
    pieces = _split(known, low, high)
    cut = cut_ends(low, high, limits)
    low, high = -np.inf if cut[0] else low, np.inf if cut[1] else high
    return Range(middle, low, high, level, pieces if np.isfinite([low, high]).all() else ())


def range_of_repeats(values: ArrayLike, *, level: float = LEVEL) -> Range:
    """Mean of the estimates (n,), in their unit, that n independent repeats gave one by one, and its interval.

    Positive estimates are averaged as logarithms. From 8 repeats on the interval is the bias-corrected and accelerated
    bootstrap (Efron 1987) at the level that makes up for the narrowness of a resampled variance (Hesterberg 2015);
    fewer repeats have Student's interval.

    Raises
    ------
    InputError
        If there are fewer than 2 repeats, or one is not finite.
    """
    known = np.asarray(values, dtype=float)
    if known.ndim != 1 or len(known) < 2 or not np.isfinite(known).all():
        raise InputError(f"an interval over repeats needs at least 2 finite estimates, got {known}")
    positive = bool(np.all(known > 0.0))
    scale = np.log(known) if positive else known
    middle, n = float(scale.mean()), len(scale)
    if n < _FEWEST or np.ptp(scale) == 0.0:
        half = float(t.ppf(0.5 + 0.5 * level, n - 1) * scale.std(ddof=1) / np.sqrt(n))
        low, high = middle - half, middle + half
    else:
        found = bootstrap(
            (scale,), np.mean, confidence_level=_expanded(level, n),
            random_state=np.random.default_rng(0),  # pyright: ignore[reportCallIssue] scipy before 1.15 knows no rng
        ).confidence_interval  # fmt: skip
        low, high = float(found.low), float(found.high)
    if positive:
        middle, low, high = (float(np.exp(end)) for end in (middle, low, high))
    return Range(middle, low, high, level)


def over_repeats(
    estimate: Callable[[Sequence[T]], ArrayLike],
    repeats: Sequence[T],
    *,
    draws: int = 500,
    level: float = LEVEL,
    seed: int = 0,
) -> Resampled:
    """Fit repeats of a measurement, and draws of them with replacement; intervals as `range_of_repeats`.

    Parameters
    ----------
    estimate
        Numbers (np,) [each in a unit of its own] from a list of repeats; a fit that fails raises `InputError`, and its
        draw is left out.
    repeats
        What was repeated, independently.
    draws
        How many.
    level
        Probability of the intervals.
    seed
        Of the draws.

    Raises
    ------
    InputError
        If there are fewer than 3 repeats, if the fit to all of them fails, or more than one draw in five.
    """
    n = len(repeats)
    if n < 3:
        raise InputError(f"drawing repeats needs at least 3 of them, got {n}")
    values = np.atleast_1d(np.asarray(estimate(repeats), dtype=float))

    def of(index: NDArray[np.intp]) -> Floats:
        try:
            return np.atleast_1d(np.asarray(estimate([repeats[i] for i in index]), dtype=float))
        except InputError:
            return np.full(len(values), np.nan)

    drawn = np.random.default_rng(seed).integers(0, n, (draws, n))
    samples = np.array([of(index) for index in drawn])
    samples = samples[np.isfinite(samples).all(axis=1)]
    if len(samples) < 0.8 * draws:
        raise InputError(f"{draws - len(samples)} of {draws} draws of the repeats could not be fitted")
    left_out = np.array([of(np.delete(np.arange(n), i)) for i in range(n)])
    ranges = tuple(
        _accelerated(float(value), samples[:, j], left_out[:, j], n, level) for j, value in enumerate(values)
    )
    return Resampled(values, samples, draws - len(samples), ranges)


def _accelerated(value: float, draws: Floats, left_out: Floats, n: int, level: float) -> Range:
    """Bias-corrected and accelerated interval of one number, from its draws and the fits to all repeats but one."""
    below = float(np.mean(draws < value) + 0.5 * np.mean(draws == value))
    bias = float(norm.ppf(np.clip(below, 0.5 / len(draws), 1.0 - 0.5 / len(draws))))
    off = np.nanmean(left_out) - left_out[np.isfinite(left_out)]
    cubes, squares = float(np.sum(off**3)), float(np.sum(off**2))
    acceleration = cubes / (6.0 * squares**1.5) if squares > 0.0 else 0.0
    reach = float(norm.ppf(0.5 + 0.5 * _expanded(level, n)))
    tails = []
    for z in (bias - reach, bias + reach):
        tails.append(float(norm.cdf(bias + z / max(1.0 - acceleration * z, 0.1))))
    low, high = (float(q) for q in np.quantile(draws, tails))
    if n < _FEWEST:  # draws of few repeats have no tails
        half = float(t.ppf(0.5 + 0.5 * level, n - 1)) * float(draws.std(ddof=1)) * np.sqrt(n / (n - 1.0))
        low, high = min(low, value - half), max(high, value + half)
    return Range(value, low, high, level)


def _expanded(level: float, n: int) -> float:
    """Level at which draws of n repeats cover as Student's t does: P(|Z| < sqrt(n / (n - 1)) t)."""
    reach = float(t.ppf(0.5 + 0.5 * level, n - 1)) * np.sqrt(n / (n - 1.0))
    return float(1.0 - 2.0 * norm.sf(reach))


def _split(known: Floats, low: float, high: float) -> tuple[tuple[float, float], ...]:
    """Parts of an interval between which a long stretch holds no draw; empty where it is one."""
    inside = known[(known >= low) & (known <= high)]
    if len(inside) < 20 or high <= low:
        return ()
    scale = np.log(inside) if inside[0] > 0.0 else inside
    holes = np.flatnonzero(np.diff(scale) > _EMPTY * (scale[-1] - scale[0]))
    edges = [0, *(int(i) + 1 for i in holes), len(inside)]
    parts = [(a, b) for a, b in pairwise(edges) if b - a >= _PART * len(inside)]
    return tuple((float(inside[a]), float(inside[b - 1])) for a, b in parts) if len(parts) > 1 else ()


def _digits(parts: tuple[tuple[float, float], ...]) -> int:
    """Digits that tell the ends of the narrowest part apart, three in its width; from 4 to 9."""
    width = min(high - low for low, high in parts)
    largest = max(abs(end) for part in parts for end in part)
    return int(np.clip(np.ceil(np.log10(largest / width)) + 2, 4, 9)) if width > 0.0 else 4


def _shown(value: float, unit: str, digits: int = 4) -> str:
    return format_quantity(float(f"{value:.{digits}g}"), unit)
