"""How far a number can be off: its interval from draws."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity
from tarsus.fit.verdict import LEVEL, cut_ends, half_width

__all__ = ["Range", "range_of_draws"]

Floats = NDArray[np.float64]

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
