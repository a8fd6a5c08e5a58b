"""One channel as a piecewise polynomial of time: what the engine integrates, and how to evaluate it.

A channel is continued for ever: it either repeats its last pieces (`loop >= 0`) or holds its last value.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import counted
from tarsus.base.errors import InputError

TERMS = 12
"""Coefficients of a piece: polynomials of degree 11 at most."""


@dataclass(frozen=True)
class Pieces:
    """A piecewise polynomial of time with P pieces, in the channel's SI unit (volts or newtons)."""

    start: NDArray[np.float64]
    """(P+1,) [s], increasing, start[0] = 0: piece p spans [start[p], start[p+1]]."""
    coef: NDArray[np.float64]
    """(P, 12): value = sum_k coef[p, k] xi**k with xi = 2 (t - start[p]) / (start[p+1] - start[p]) - 1.
    On a constant stretch coef[p, 1:] is exactly zero."""
    kink: NDArray[np.bool_]
    """(P,): True if value or a derivative may jump at start[p], False if start[p] only subdivides a smooth
    stretch. For the first piece of the loop the flag also holds for the way back from the end of the loop."""
    loop: int
    """Piece that follows the last one (periodic channel), or -1: the last value is held."""

    @property
    def count(self) -> int:
        """P, the number of pieces."""
        return len(self.kink)

    def rate(self) -> Pieces:
        """Their derivative by time [1/s], piece by piece: a jump has none; what is held to the end has none either."""
        width = np.diff(self.start)[:, None]
        coef = np.zeros_like(self.coef)
        coef[:, :-1] = self.coef[:, 1:] * np.arange(1.0, TERMS) * (2.0 / width)
        start, kink = self.start, self.kink
        if self.loop < 0:  # a piece of rest, whose last value is held
            start, kink = np.append(start, start[-1] + width[-1]), np.append(kink, True)
            coef = np.concatenate([coef, np.zeros((1, TERMS))])
        return Pieces(start, coef, kink, self.loop)

    @property
    def span(self) -> float:
        """Range of the values: that of bounds of the pieces, each the sum of its coefficients' sizes."""
        swing = np.abs(self.coef[:, 1:]).sum(axis=1)
        top, bottom = self.coef[:, 0] + swing, self.coef[:, 0] - swing
        held = float(self.coef[-1].sum()) if self.loop < 0 else float(self.coef[0, 0])
        return max(float(top.max()), held) - min(float(bottom.min()), held)


@dataclass(frozen=True)
class Channels(Sequence[Pieces]):
    """The pieces of nc channels, Q in all, one channel behind the other."""

    counts: NDArray[np.intp]
    """(nc,) pieces of each."""
    loops: NDArray[np.intp]
    """(nc,) as `Pieces.loop`."""
    begin: Any
    """(Q,) [s] start of each piece."""
    end: Any
    """(Q,) [s] end of each piece: the start of the next one, which may have another slope."""
    coef: Any
    """(Q, 12) as `Pieces.coef`."""
    kink: NDArray[np.bool_]
    """(Q,)."""
    periods: Any
    """(nc,) [s] of what repeats, NaN where nothing does."""

    @classmethod
    def of(cls, pieces: Sequence[Pieces]) -> Channels:
        """Channels that are given one by one."""
        if isinstance(pieces, Channels):
            return pieces
        loops = np.array([one.loop for one in pieces], dtype=np.intp)
        periods = [one.start[-1] - one.start[one.loop] if one.loop >= 0 else np.nan for one in pieces]
        return cls(
            np.array([one.count for one in pieces], dtype=np.intp),
            loops,
            np.concatenate([np.zeros(0), *(one.start[:-1] for one in pieces)]),
            np.concatenate([np.zeros(0), *(one.start[1:] for one in pieces)]),
            np.concatenate([np.zeros((0, TERMS)), *(one.coef for one in pieces)]),
            np.concatenate([np.zeros(0, dtype=bool), *(one.kink for one in pieces)]),
            np.array(periods),
        )

    @staticmethod
    def joined(parts: Sequence[Channels]) -> Channels:
        """The channels of several, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return Channels(
            *(np.concatenate([getattr(one, name) for one in parts]) for name in Channels.__dataclass_fields__)
        )

    def picked(self, which: NDArray[np.intp]) -> Channels:
        """Some of the channels, one after the other."""
        counts = self.counts[which]
        own = counted(counts) + np.repeat(self.first[which], counts)
        return Channels(
            counts,
            self.loops[which],
            self.begin[own],
            self.end[own],
            self.coef[own],
            self.kink[own],
            self.periods[which],
        )

    def rate(self) -> Channels:
        """Their derivatives by time, as `Pieces.rate`."""
        return Channels.of([one.rate() for one in self])

    def times(self, factor: float) -> Channels:
        """Their values times a factor."""
        return replace(self, coef=factor * self.coef)

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """(nc,) first piece of each."""
        return np.cumsum(self.counts) - self.counts

    @property
    def starts(self) -> NDArray[np.float64]:
        """(Q + nc,) [s] starts of the pieces of each channel, with the end of its last."""
        if (self.counts == 1).all():
            return np.stack([self.begin, self.end], axis=1).ravel()
        after = np.cumsum(self.counts)
        return np.insert(self.begin, after, self.end[after - 1])

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """The channels as the engine takes them, laid end to end, by name."""
        names = ("counts", "loops", "starts", "coef", "kink")
        return {name: np.ascontiguousarray(getattr(self, name)) for name in names}

    def __len__(self) -> int:
        return len(self.counts)

    def __getitem__(self, channel: Any) -> Any:
        first = self.first[channel]
        own = slice(first, first + self.counts[channel])
        begin, end, coef = (one[own] for one in (self.begin, self.end, self.coef))
        return Pieces(np.append(begin, end[-1]), coef, self.kink[own], int(self.loops[channel]))

    def __iter__(self) -> Iterator[Pieces]:
        return (self[channel] for channel in range(len(self)))


def evaluate(pieces: Pieces, time: ArrayLike) -> NDArray[np.float64]:
    """Value of a channel at `time` [s], any shape, all >= 0; on a jump the value after it.

    Raises InputError for a negative or NaN time.
    """
    t = np.asarray(time, dtype=np.float64)
    if t.size and not t.min() >= 0.0:
        raise InputError("a drive is defined from t = 0 on: times must be numbers that are not negative")
    start = pieces.start
    end = start[-1]
    held = None
    if pieces.loop >= 0:
        first = start[pieces.loop]
        t = np.where(t >= end, first + np.fmod(t - first, end - first), t)
        t = np.where(t >= end, first, t)
    else:
        held = t >= end
    piece = np.clip(np.searchsorted(start, t, side="right") - 1, 0, pieces.count - 1)
    left = start[piece]
    xi = 2.0 * (t - left) / (start[piece + 1] - left) - 1.0
    if held is not None:
        xi = np.where(held, 1.0, xi)
    rows = pieces.coef
    value = rows[piece, TERMS - 1].copy()
    for k in range(TERMS - 2, -1, -1):
        value = value * xi + rows[piece, k]
    return value
