"""The voltage that an amplifier gives, as a track: exact cuts where it saturates, degree 11 in between.

The amplifier is one pole in a loop whose rate and whose output saturate,

    lag dV/dt = u - V,  |dV/dt| <= slew,  low <= V <= high,

with the command u. At a rail the output stays while the command is beyond it, and comes back with the command: no
charge is wound up behind the rail. Without a lag V follows the clipped command as fast as the slew rate allows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from tarsus.base.errors import InputError
from tarsus.base.linear import product, solve
from tarsus.model.drive.crossings import crossing, turns, value
from tarsus.model.drive.parts import IDENTITY, to_pieces, whole_parts
from tarsus.model.drive.pieces import TERMS, Pieces
from tarsus.model.drive.pole import (
    FIT,
    MOST_SETTLING,
    ROUNDING,
    SETTLED,
    SWING,
    TERMS_KEPT,
    TO_CHEBYSHEV,
    TO_MONOMIAL,
    followed,
)
from tarsus.model.drive.track import Floats, Track, joined, shifted

MOST_STRETCHES = 200_000
"""An output with more stretches is refused: finding them would take minutes."""

_INTEGRAL = np.array([chebyshev.chebint(e, lbnd=-1)[:TERMS_KEPT] for e in np.eye(TERMS_KEPT)]).T
"""Chebyshev terms of the integral from -1, by those of a function."""

_SLIVER = 1e-13
"""A stretch this short, of 2 for a piece of the command, is rounding of the instants at which limits are met."""


@dataclass(frozen=True)
class Stage:
    """The numbers of an amplifier, one or one a run (nr,): what is absent is 0 (lag) or infinite."""

    lag: Any
    """[s]."""
    slew: Any
    """[V/s]."""
    low: Any
    """[V]."""
    high: Any
    """[V]."""

    def of_runs(self, count: int) -> list[Floats]:
        """Its numbers (nr,) of every run."""
        return [np.broadcast_to(one, (count,)) for one in (self.lag, self.slew, self.low, self.high)]


class _Mode(Enum):
    """What the output does; the value is its direction."""

    FOLLOWS = 0.0
    RISES = 1.0
    FALLS = -1.0
    AT_TOP = 2.0
    AT_BOTTOM = -2.0

    @property
    def sign(self) -> float:
        return math.copysign(1.0, self.value)


_RAILS = (_Mode.AT_TOP, _Mode.AT_BOTTOM)
_RAMPS = (_Mode.RISES, _Mode.FALLS)


@dataclass(frozen=True)
class _Move:
    """One smooth stretch of the output, from where it is to `end` of a command piece, and what follows."""

    end: float
    row: Floats
    last: float
    then: _Mode


def amplified(track: Track, stage: Stage, start: Any) -> Track:
    """Voltages behind an amplifier that gives `start` [V], one or one a run, until t = 0, for the commands `track`.

    A periodic command is followed until the output repeats to 1e-13 of its span; what comes before is kept apart. Runs
    in which nothing saturates are followed together, others one by one.

    Raises
    ------
    InputError
        For an output of too many stretches, by an amplifier that is very slow against its signal.
    """
    command = to_pieces(track, whole_parts(track, IDENTITY))
    lag, slew, low, high = stage.of_runs(len(command))
    volts = np.clip(np.broadcast_to(start, low.shape), low, high)
    size = np.abs(command.coef[:, 1:]).sum(axis=1)
    top = np.maximum(volts, np.maximum.reduceat(command.coef[:, 0] + size, command.first))
    bottom = np.minimum(volts, np.minimum.reduceat(command.coef[:, 0] - size, command.first))
    span = top - bottom
    linear = (span > 0.0) & (lag > 0.0) & np.isinf(slew) & (low <= bottom) & (top <= high)
    pole, other = np.flatnonzero(linear), np.flatnonzero(~linear)
    parts = []
    if len(pole):
        periodic = track.loops[pole] >= 0
        parts.append(followed(command.picked(pole), periodic, lag[pole], volts[pole], span[pole]))
    for r in other:
        own = Stage(*(float(one[r]) for one in (lag, slew, low, high)))
        alone = track.picked(np.array([r]))
        parts.append(
            alone
            if span[r] == 0.0
            else _followed(command[int(r)], own, float(span[r]), float(volts[r]), alone.periodic)
        )
    return joined(parts).picked(np.argsort(np.concatenate([pole, other])))


def _followed(command: Pieces, stage: Stage, span: float, volts: float, periodic: bool) -> Track:
    """The output of one run, stretch by stretch."""
    if stage.lag == 0.0:
        command = _clipped(command, stage, ROUNDING * span)
    output = _Output(stage, span, volts)
    if stage.lag == 0.0 and math.isinf(stage.slew):
        for p in range(command.count):
            output.add(command.start[p], command.start[p + 1], command.coef[p], bool(command.kink[p]))
        return output.track(float(command.start[-1]), 0 if periodic else -1)
    if periodic:
        return _periodic(output, command)
    output.pass_through(command, 0.0)
    end, level = float(command.start[-1]), float(command.coef[-1].sum())
    rest = np.zeros(TERMS)
    rest[0] = level
    decay = abs(level - output.volts) / stage.slew + 40.0 * stage.lag  # e^-40 is below rounding
    if decay > 0.0:
        output.piece(end, end + decay, rest, False)
        end += decay
    rest[0] = output.volts
    final = end + max(1.0, end)
    output.add(end, final, rest, True)
    return output.track(final, -1)


def _periodic(output: _Output, command: Pieces) -> Track:
    """Whole periods until one ends where it began."""
    period = float(command.start[-1])
    change, k = math.inf, 0
    for k in range(MOST_STRETCHES):
        loop, mode, begun = output.count, output.mode, output.volts
        output.pass_through(command, k * period)
        before, change = change, abs(output.volts - begun)
        # what is still to come, if changes go on to shrink as they do
        ahead = change**2 / (before - change) if change < before < math.inf else change
        if change <= 1e-15 * output.span or max(change, ahead) <= ROUNDING * output.span:
            output.kinks[loop] |= mode is not output.mode
            output.last[-1] = output.first[loop]
            return output.track((k + 1) * period, loop)
        if loop and output.count > MOST_SETTLING:
            break
    raise InputError(
        f"the amplifier's output does not repeat within {k + 1} periods of its signal: it is too slow against "
        "the signal"
    )


def _clipped(command: Pieces, stage: Stage, tolerance: float) -> Pieces:
    """The command cut where it crosses a rail, and the rail beyond."""
    starts: list[float] = []
    rows: list[Floats] = []
    kinks: list[bool] = []
    for p in range(command.count):
        left, right, row = command.start[p], command.start[p + 1], command.coef[p]
        swing = float(np.abs(row[1:]).sum())
        if row[0] + swing <= stage.high and row[0] - swing >= stage.low:
            starts.append(left)
            rows.append(row)
            kinks.append(bool(command.kink[p]))
            continue
        for low, part, cut in _between_rails(row, stage, tolerance):
            starts.append(left + 0.5 * (low + 1.0) * (right - left))
            rows.append(part)
            kinks.append(cut or bool(command.kink[p]))
    begin = np.append(starts, command.start[-1])
    return Pieces(begin, np.array(rows), np.array(kinks), command.loop)


def _between_rails(row: Floats, stage: Stage, tolerance: float) -> list[tuple[float, Floats, bool]]:
    """Parts (from, polynomial, begins inside) of one piece of the command."""
    parts: list[tuple[float, Floats, bool]] = []
    at = -1.0
    while at < 1.0:
        rest = _part(row, at, 1.0)
        begins = value(row, min(1.0, at + 1e-9))
        over, under = _offset(rest, -stage.high), _offset(-rest, stage.low)
        flat = None
        if begins > stage.high:
            flat, leaves = stage.high, [-over]
        elif begins < stage.low:
            flat, leaves = stage.low, [-under]
        else:
            leaves = [over, under]
        found = [x for side in leaves if math.isfinite(side[0]) and (x := crossing(side, tolerance)) is not None]
        end = 1.0 if not found else at + 0.5 * (min(found) + 1.0) * (1.0 - at)
        end = max(end, min(1.0, at + 1e-9))
        part = _part(row, at, end)
        if flat is not None:
            part = np.zeros(TERMS)
            part[0] = flat
        parts.append((at, part, at > -1.0))
        at = end
    return parts


def _part(row: Floats, low: float, high: float) -> Floats:
    """A polynomial in the coordinate of [low, high]."""
    return shifted(row[None], np.array([low]), np.array([high]))[0]


def _offset(row: Floats, volts: float) -> Floats:
    """The polynomial plus a constant."""
    row = row.copy()
    row[0] += volts
    return row


class _Output:
    """The output as it grows, stretch by stretch."""

    def __init__(self, stage: Stage, span: float, volts: float) -> None:
        self.stage = stage
        self.span = span
        self.volts = volts
        self.mode = _Mode.FOLLOWS
        self.starts: list[float] = []
        self.rows: list[Floats] = []
        self.first: list[float] = []
        self.last: list[float] = []
        self.kinks: list[bool] = []
        self._reach = math.inf
        railed = stage.lag > 0.0  # without a lag the command has been clipped already
        self._low = stage.low if railed else -math.inf
        self._high = stage.high if railed else math.inf
        self._threshold = stage.slew * stage.lag  # error beyond which the rate saturates

    @property
    def count(self) -> int:
        return len(self.rows)

    def track(self, end: float, loop: int) -> Track:
        """All stretches, of which those from `loop` on repeat (-1: the last value is held)."""
        begin, first, last = (np.array(one) for one in (self.starts, self.first, self.last))
        period = end - begin[loop] if loop >= 0 else np.nan
        return Track(
            np.array([0, self.count]),
            begin,
            np.append(begin[1:], end),
            np.array(self.rows),
            None,
            np.zeros(self.count),
            first,
            last,
            np.array(self.kinks),
            np.array([loop]),
            np.array([period]),
        )

    def pass_through(self, command: Pieces, since: float) -> None:
        """Follow the command's pieces once, from time `since` [s] on."""
        for p in range(command.count):
            left, right = since + command.start[p], since + command.start[p + 1]
            self.piece(float(left), float(right), command.coef[p], bool(command.kink[p]))

    def add(self, time: float, end: float, row: Floats, kink: bool, last: float | None = None) -> None:
        """A stretch of the output from `time` to `end` [s], cut where it turns."""
        if len(self.rows) >= MOST_STRETCHES:
            raise InputError(
                f"the amplifier's output rises and falls more than {MOST_STRETCHES} times: shorten its signal or "
                "lower the frequency"
            )
        cuts = [-1.0, *turns(row, SWING * self.span), 1.0]
        for low, high in pairwise(cuts):
            begin = time if low == -1.0 else time + 0.5 * (low + 1.0) * (end - time)
            part = row if len(cuts) == 2 else _part(row, low, high)
            first = value(row, low)
            if self.last and abs(first - self.last[-1]) <= 1e-12 * self.span:
                first = self.last[-1]
            self.starts.append(begin)
            self.rows.append(part)
            self.kinks.append(kink and low == -1.0)
            self.first.append(first)
            self.last.append(value(row, high))
        self.volts = self.last[-1] if last is None else last
        self.last[-1] = self.volts

    def piece(self, left: float, right: float, command: Floats, kink: bool) -> None:
        """The output under one piece of the command."""
        at, stalls = -1.0, 0
        half = 0.5 * (right - left)
        mode = self._mode_at(value(command, -1.0), _slope(command, -1.0) / half)
        kink |= mode is not self.mode
        while at < 1.0:
            # a limit that is met just where the last was left is the same one, seen through rounding
            after = -1.0 if stalls < 4 else -1.0 + 1e-6
            move = self._move(mode, command, at, half, after)
            if move.end - at > _SLIVER:
                begin = left + (at + 1.0) * half
                end = right if move.end == 1.0 else left + (move.end + 1.0) * half
                self.add(begin, end, move.row, kink, move.last)
                at, kink = move.end, False
            else:  # what follows begins here
                stalls += 1
                at = 1.0 if move.end == 1.0 else at
            self.volts = move.last
            kink |= move.then is not mode
            mode = move.then
        self.mode = mode

    def _mode_at(self, command: float, slope: float) -> _Mode:
        """What the output does at the start of a piece of the command."""
        if self.volts >= self._high and command >= self._high:
            return _Mode.AT_TOP
        if self.volts <= self._low and command <= self._low:
            return _Mode.AT_BOTTOM
        near = ROUNDING * self.span
        for mode in _RAMPS:
            excess = mode.sign * (command - self.volts) - self._threshold
            too_fast = mode.sign * slope > self.stage.slew * (1.0 + 1e-12)
            if excess > near or (abs(excess) <= near and too_fast):
                return mode
        return _Mode.FOLLOWS

    def _move(self, mode: _Mode, command: Floats, at: float, half: float, after: float) -> _Move:
        if mode in _RAILS:
            return self._stay(mode, command, at, after)
        if mode in _RAMPS:
            return self._ramp(mode, command, at, half, after)
        if self.stage.lag > 0.0:
            return self._lag(command, at, half, after)
        return self._follow(command, at, half, after)

    def _stay(self, mode: _Mode, command: Floats, at: float, after: float) -> _Move:
        """At a rail until the command comes back."""
        rail = self._high if mode is _Mode.AT_TOP else self._low
        back = crossing(-mode.sign * _offset(_part(command, at, 1.0), -rail), ROUNDING * self.span, after)
        row = np.zeros(TERMS)
        row[0] = rail
        if back is None:
            return _Move(1.0, row, rail, mode)
        return _Move(_place(at, back), row, rail, _Mode.FOLLOWS)

    def _ramp(self, mode: _Mode, command: Floats, at: float, half: float, after: float) -> _Move:
        """At the slew rate until the error is small enough, or to a rail."""
        rest = _part(command, at, 1.0)
        rise = mode.sign * self.stage.slew * 0.5 * (1.0 - at) * half
        row = np.zeros(TERMS)
        row[:2] = self.volts + rise, rise
        caught = crossing(_offset(mode.sign * (row - rest), self._threshold), ROUNDING * self.span, after)
        rail = self._high if mode is _Mode.RISES else self._low
        hit = (rail - self.volts) / rise - 1.0
        if hit <= min(1.0, 1.0 if caught is None else caught):
            then = _Mode.AT_TOP if mode is _Mode.RISES else _Mode.AT_BOTTOM
            return _Move(_place(at, hit), _part(row, -1.0, hit), rail, then)
        if caught is None:
            return _Move(1.0, row, value(row, 1.0), mode)
        end = _place(at, caught)
        last, then = value(row, caught), _Mode.FOLLOWS
        if self.stage.lag == 0.0:
            last = value(rest, caught)
            back = _Mode.FALLS if mode is _Mode.RISES else _Mode.RISES
            steep = -mode.sign * _slope(command, end) / half
            then = back if steep > self.stage.slew * (1.0 + 1e-12) else then
        return _Move(end, _part(row, -1.0, caught), last, then)

    def _follow(self, command: Floats, at: float, half: float, after: float) -> _Move:
        """On the command until that is too fast."""
        rest = _part(command, at, 1.0)
        most = self.stage.slew * 0.5 * (1.0 - at) * half
        slope = np.append(rest[1:] * np.arange(1, TERMS), 0.0)
        return self._first(
            rest,
            at,
            1.0,
            after,
            1e-12 * (most + self.span),
            [(_offset(mode.sign * slope, -most), mode) for mode in _RAMPS],
        )

    def _lag(self, command: Floats, at: float, half: float, after: float) -> _Move:
        """The pole's answer, as far as degree 11 carries and until something saturates."""
        lag, end = self.stage.lag, 1.0
        constant = not command[1:].any()
        target = float(command[0])
        if constant:
            left = abs(target - self.volts)
            if left <= SETTLED * self.span:
                return _Move(1.0, command, target, _Mode.FOLLOWS)
            end = min(end, at + lag * math.log(2.0 * left / (SETTLED * self.span)) / half)
        arrives = constant and end < 1.0
        tried = min(end, at + self._reach / half)
        while True:
            arrived = arrives and tried == end
            rest = _part(command, at, tried)
            row, miss = lagged(rest, 0.5 * (tried - at) * half / lag, self.volts, self.span)
            if miss <= FIT * self.span:
                break
            tried = at + (tried - at) * min(max(0.9 * (FIT * self.span / miss) ** (1.0 / TERMS), 0.1), 0.7)
        self._reach = 3.0 * (tried - at) * half
        error = rest - row
        events = [(_offset(mode.sign * error, -self._threshold), mode) for mode in _RAMPS]
        events += [(_offset(row, -self._high), _Mode.AT_TOP), (_offset(-row, self._low), _Mode.AT_BOTTOM)]
        move = self._first(row, at, tried, after, ROUNDING * self.span, events)
        if move.then in _RAILS:
            rail = self._high if move.then is _Mode.AT_TOP else self._low
            return _Move(move.end, move.row, rail, move.then)
        if arrived and move.then is _Mode.FOLLOWS:
            return _Move(move.end, move.row, target, move.then)
        return move

    def _first(
        self, row: Floats, at: float, end: float, after: float, tolerance: float, events: list[tuple[Floats, _Mode]]
    ) -> _Move:
        """The stretch `row` on [at, end] up to the first event."""
        found: list[tuple[float, _Mode]] = []
        for margin, mode in events:
            if math.isfinite(margin[0]):
                x = crossing(margin, tolerance, after)
                found += [] if x is None else [(x, mode)]
        if not found:
            return _Move(end, row, value(row, 1.0), _Mode.FOLLOWS)
        x, mode = min(found, key=lambda item: item[0])
        return _Move(at + 0.5 * (x + 1.0) * (end - at), _part(row, -1.0, x), value(row, x), mode)


def lagged(command: Floats, ratio: float, start: float, span: float) -> tuple[Floats, float]:
    """Polynomial (12,) of a pole's answer to the command (12,) on an interval, half as long as `ratio` lags,
    from `start`
    on; and what it misses. Terms that are rounding of the span are none.

    V = V0 + ratio times the integral of u - V from -1 on, in Chebyshev terms.
    """
    right = ratio * product(_INTEGRAL, product(TO_CHEBYSHEV, command))
    right[0] += start
    series = solve(np.eye(TERMS_KEPT) + ratio * _INTEGRAL, right)
    miss = float(np.abs(series[TERMS:]).sum())
    kept = series[:TERMS]
    rest = np.cumsum(np.abs(kept[::-1]))[::-1]
    return product(TO_MONOMIAL, np.where(rest <= 2e-15 * span, 0.0, kept)), miss


def _place(at: float, x: float) -> float:
    """Local coordinate of `x`, which is one of [at, 1]."""
    return at + 0.5 * (x + 1.0) * (1.0 - at)


def _slope(row: Floats, xi: float) -> float:
    return value(row[1:] * np.arange(1, len(row)), xi)
