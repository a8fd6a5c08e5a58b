"""What one pole makes of the voltages of many runs: V' = (u - V) / lag in closed form, for all runs at once.

On a part of a command's piece that begins at u0 the answer is linear in the voltage V0 at its start: V = a + (V0 - u0)
b, polynomials that do not depend on what came before. Parts are laid where the exponential of a step needs them, the
voltages at their starts follow one from the other, and parts that miss more than rounding are cut again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from tarsus.base.arrays import Floats, counted
from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.model.drive.crossings import turns
from tarsus.model.drive.pieces import TERMS, Channels
from tarsus.model.drive.track import Ints, Track, horner, shifted

MOST_SETTLING = 20_000
"""Most stretches before a periodic output repeats: an amplifier so slow hardly passes its signal."""
TERMS_KEPT = 20
"""Chebyshev terms of a solution; those beyond degree 11 must vanish, which limits how long a part may be."""
TO_CHEBYSHEV = np.array([np.pad(c := chebyshev.poly2cheb(e), (0, TERMS_KEPT - len(c))) for e in np.eye(TERMS)]).T
TO_MONOMIAL = np.array([np.pad(c := chebyshev.cheb2poly(e), (0, TERMS - len(c))) for e in np.eye(TERMS)]).T
"""Between the powers of pieces and Chebyshev terms."""

FIT = 5e-14
"""Share of the voltage's span that a part may miss; the command's own pieces miss 2e-13."""
ROUNDING = 1e-13
"""Share of the span below which a voltage beyond a limit, or from period to period, is rounding."""
SETTLED = 1e-14
"""Share of the span to a constant command at which the output has arrived: 32 lags after a step."""
SWING = 2e-14
"""Share of the span below which a turn of the voltage is rounding."""

_NEAR = 0.1
"""No part begins this many lags from a piece's ends: it would be a sliver."""
_ALTERNATE = (-1.0) ** np.arange(TERMS_KEPT)
_BERNSTEIN = np.zeros((TERMS - 1, TERMS - 1))
"""From powers of xi in [-1, 1] to Bernstein's terms: a polynomial has no more roots than those change their sign."""
for _k in range(TERMS - 1):
    _powers = (np.polynomial.Polynomial([-1.0, 2.0]) ** _k).coef
    for _j in range(TERMS - 1):
        _BERNSTEIN[_j, _k] = sum(
            math.comb(_j, i) / math.comb(TERMS - 2, i) * _powers[i] for i in range(min(_j, _k) + 1)
        )


def _cuts() -> Floats:
    """Where parts begin after a step, in lags, so that degree 11 carries the exponential, which is smaller and
    smaller, from each to the next; the last is where it has settled."""
    at, out = 0.0, list[float]()
    while at < -math.log(SETTLED):
        half = 0.5
        for _ in range(20):  # the first term that is left out: 2 exp(-at - half) half^12 / (2^12 12!), and its kind
            half = 2.0 * (0.2 * FIT * math.factorial(TERMS) * math.exp(at + half - half**2 / 52.0)) ** (1.0 / TERMS)
        at += 2.0 * half
        out.append(min(at, -math.log(SETTLED) + _NEAR))
    return np.array(out)


_CUTS = _cuts()


@dataclass(frozen=True)
class _Parts:
    """Parts of the pieces of a command, those of each run one after the other: piece (Q,), local ends low and high (Q,)
    in it."""

    piece: Ints
    low: Floats
    high: Floats

    def cut(self, counts: Ints) -> _Parts:
        """Each cut into so many (Q,) of one length."""
        rank = counted(counts)
        low, width, high = (np.repeat(one, counts) for one in (self.low, self.high - self.low, self.high))
        many = np.repeat(counts, counts)
        begin = np.where(rank == 0, low, low + width * (rank / many))
        end = np.where(rank == many - 1, high, low + width * ((rank + 1) / many))
        return _Parts(np.repeat(self.piece, counts), begin, end)


def followed(command: Channels, periodic: Any, lag: Floats, start: Floats, span: Floats) -> Track:
    """Voltages behind a pole of lags (nr,) [s] that gives `start` (nr,) [V] until t = 0, for the command of nr runs.

    periodic (nr,): whether the command repeats, all of it; its output then is followed until it repeats to 1e-13 of the
    span (nr,) [V]. Otherwise it is followed until it rests.

    Raises
    ------
    InputError
        For a lag so long against the signal that its output does not repeat soon.
    """
    rounds = np.ones(len(lag), dtype=np.intp)
    if periodic.any():
        first = _Pass(command, lag, span, rounds)
        rounds = _rounds(first, periodic, start)
    whole = _Pass(_with_rest(command, periodic, lag), lag, span, rounds)
    return whole.track(periodic, start)


def _with_rest(command: Channels, periodic: Any, lag: Floats) -> Channels:
    """The command, and where it ends rest at its last voltage until the output has settled on it."""
    rests = np.flatnonzero(~periodic)
    if not len(rests):
        return command
    last = (command.first + command.counts)[rests] - 1
    end = command.end[last]
    coef = np.zeros((len(rests), TERMS))
    coef[:, 0] = command.coef[last].sum(axis=1)
    place = last + 1
    return replace(
        command,
        counts=command.counts + ~periodic,
        begin=np.insert(command.begin, place, end),
        end=np.insert(command.end, place, end + 40.0 * lag[rests]),  # e^-40 is below rounding
        coef=np.insert(command.coef, place, coef, axis=0),
        kink=np.insert(command.kink, place, False),
    )


def _rounds(first: _Pass, periodic: Any, start: Floats) -> Ints:
    """(nr,) rounds of what repeats until the last ends where it began; a start's part shrinks alike in each."""
    period = first.period / first.lag
    change = np.abs(first.voltages(start)[1] - start)
    with np.errstate(divide="ignore", over="ignore"):
        ahead = change * np.maximum(1.0, 1.0 / np.expm1(period))
        lasts = np.minimum(np.log(ahead / (ROUNDING * first.span)), np.log(change / (1e-15 * first.span))) / period
    rounds = 1.0 + np.where(periodic, np.maximum(np.ceil(lasts), 0.0), 0.0)
    parts = np.bincount(first.run, minlength=len(rounds))
    slow = (rounds > 1.0) & (rounds * parts > MOST_SETTLING)
    if slow.any():
        seen = int(np.ceil(MOST_SETTLING / parts[slow][0]))
        raise InputError(
            f"the amplifier's output does not repeat within {seen} periods of its signal: it is too slow against "
            "the signal"
        )
    return rounds.astype(np.intp)


class _Pass:
    """Rounds (nr,) of a command through a pole, as parts of its pieces."""

    def __init__(self, command: Channels, lag: Floats, span: Floats, rounds: Ints) -> None:
        self.lag, self.span, self.counts = lag, span, rounds * command.counts
        runs = np.arange(len(lag))
        self.piece_run = np.repeat(runs, self.counts)
        place = counted(self.counts)
        own = command.counts[self.piece_run]
        source = command.first[self.piece_run] + place % own
        self.round, self.source = place // own, source
        self.period = command.end[command.first + command.counts - 1]
        since = self.round * self.period[self.piece_run]
        self.begin, self.end = since + command.begin[source], since + command.end[source]
        self.coef, self.kink = command.coef[source], command.kink[source]
        self.flat = ~self.coef[:, 1:].any(axis=1)
        self._lay(self._laid(place == 0))

    def _laid(self, opens: Any) -> _Parts:
        """Parts of the pieces by what a step at the last kink needs; where a run opens there is one."""
        lag = self.lag[self.piece_run]
        last = np.maximum.accumulate(np.where(self.kink | opens, np.arange(len(lag)), 0))
        since, width = (self.begin - self.begin[last]) / lag, (self.end - self.begin) / lag
        one = np.searchsorted(_CUTS, since + _NEAR, side="right")
        two = np.maximum(np.searchsorted(_CUTS, since + width - _NEAR, side="left"), one)
        counts = two - one + 1
        piece = np.repeat(np.arange(len(lag)), counts)
        rank = counted(counts)
        cut = np.append(_CUTS, np.inf)[one[piece] + rank]
        high = np.where(rank == counts[piece] - 1, 1.0, 2.0 * (cut - since[piece]) / width[piece] - 1.0)
        return _Parts(piece, np.where(rank == 0, -1.0, np.roll(high, 1)), high)

    def _lay(self, parts: _Parts) -> None:
        """The answers on these parts."""
        self.parts, piece = parts, parts.piece
        self.run = self.piece_run[piece]
        left, width = self.begin[piece], (self.end - self.begin)[piece]
        self.left = np.where(parts.low == -1.0, left, left + 0.5 * (parts.low + 1.0) * width)
        self.right = np.where(parts.high == 1.0, self.end[piece], left + 0.5 * (parts.high + 1.0) * width)
        self.target = np.where(self.flat[piece], self.coef[piece, 0], np.nan)
        ratio = 0.25 * (parts.high - parts.low) * width / self.lag[self.run]
        command = shifted(self.coef[piece], parts.low, parts.high)
        self.level = horner(command, np.full(len(piece), -1.0))
        command[:, 0] -= self.level
        self.driven, self.left_over = _answers(product(command, TO_CHEBYSHEV.T), ratio)
        self.answer, self.shrinks = self.driven.sum(axis=1), self.left_over.sum(axis=1)

    def voltages(self, start: Floats) -> tuple[Floats, Floats]:
        """Voltages (Q+nr,) at the starts of the parts of every run, and its last; and these last ones (nr,)."""
        counts = np.bincount(self.run, minlength=len(self.lag))
        first = np.cumsum(counts) - counts
        answer, near = self.answer + self.level, SETTLED * self.span
        out, volts = np.empty(len(self.run) + len(counts)), start
        out[first + np.arange(len(counts))] = volts
        for k in range(int(counts.max())):
            own = np.flatnonzero(counts > k)
            part = first[own] + k
            found = answer[part] + self.shrinks[part] * (volts[own] - self.level[part])
            target = self.target[part]
            found = np.where(np.abs(found - target) <= near[own], target, found)
            volts = volts.copy()
            volts[own] = found
            out[part + own + 1] = found
        return out, volts

    def track(self, periodic: Any, start: Floats) -> Track:
        """The output from `start` (nr,) on as monotone stretches."""
        before = np.full(len(self.run), np.inf)
        while True:
            volts, last = self.voltages(start)
            opens = np.arange(len(self.run)) + self.run  # the places of the parts among the voltages
            series = self.driven + (volts[opens] - self.level)[:, None] * self.left_over
            series[:, 0] += self.level
            miss, allowed = np.abs(series[:, TERMS:]).sum(axis=1), FIT * self.span[self.run]
            bad = (miss > allowed) & (miss < 0.5 * before)
            if not bad.any():
                break
            counts = np.ones(len(miss), dtype=np.intp)
            counts[bad] = np.clip(np.ceil((miss[bad] / allowed[bad]) ** (1.0 / TERMS)), 2, 8)
            before = np.repeat(np.where(bad, miss, np.inf), counts)
            self._lay(self.parts.cut(counts))
        first, final = volts[opens], volts[opens + 1]
        rests = (first == self.target) & (final == self.target)
        kept = np.where(rests[:, None], np.where(np.arange(TERMS) == 0, self.target[:, None], 0.0), series[:, :TERMS])
        rest = np.cumsum(np.abs(kept[:, ::-1]), axis=1)[:, ::-1]
        kept = np.where(~rests[:, None] & (rest <= 2e-15 * self.span[self.run][:, None]), 0.0, kept)
        rows = np.where(rests[:, None], kept, product(kept, TO_MONOMIAL.T))
        return self._stretches(rows, first, final, last, periodic)

    def _stretches(self, rows: Any, first: Floats, final: Floats, last: Floats, periodic: Any) -> Track:
        """The track of the parts' polynomials, cut where they turn; what has settled is held."""
        part, low, high = _monotone(rows, SWING * self.span[self.run])
        whole_low, whole_high = low == -1.0, high == 1.0
        left, width = self.left[part], (self.right - self.left)[part]
        begin = np.where(whole_low, left, left + 0.5 * (low + 1.0) * width)
        inner = rows[part]
        cut = ~(whole_low & whole_high)
        ends = np.where(whole_high, final[part], horner(inner, high))
        starts = np.where(whole_low, first[part], np.roll(ends, 1))
        if cut.any():
            inner = inner.copy()
            inner[cut] = shifted(inner[cut], low[cut], high[cut])
        opening = whole_low & (self.parts.low[part] == -1.0)
        piece = self.parts.piece[part]
        kink = self.kink[piece] & opening
        run = self.run[part]
        counts = np.bincount(run, minlength=len(self.lag))
        runs = np.concatenate([[0], np.cumsum(counts)])
        rounds = self.round[np.cumsum(self.counts) - 1]
        fresh = np.searchsorted(
            run * (self.round.max() + 1) + self.round[piece], np.arange(len(counts)) * (self.round.max() + 1) + rounds
        )
        loops = np.where(periodic, fresh - runs[:-1], -1)
        close = self.end[np.cumsum(self.counts) - 1]
        until = np.append(begin[1:], 0.0)
        until[runs[1:] - 1] = close
        ends[runs[1:] - 1] = np.where(periodic, starts[fresh], ends[runs[1:] - 1])
        track = Track(
            runs,
            begin,
            until,
            inner,
            None,
            np.zeros(len(run)),
            starts,
            ends,
            kink,
            loops,
            np.where(periodic, close - begin[fresh], np.nan),
        )
        return _held(track, np.flatnonzero(~periodic))


def _answers(command: Floats, ratio: Floats) -> tuple[Floats, Floats]:
    """Chebyshev terms (Q, 20) of a pole's answer from 0 to a command (Q, 20) on intervals half as long as `ratio` (Q,)
    lags, and of what is left of 1 at the start.

    Of r (u - V) = V' the terms are k V_k = r / 2 ((u - V)_{k-1} - (u - V)_{k+1}), solved from the highest on.
    """
    terms = command.shape[1]
    after, slope = np.zeros_like(command), np.zeros_like(command)
    upper = np.concatenate([command[:, 1:], np.zeros((len(command), 2))], axis=1)
    ahead, steep = np.zeros(len(command)), np.zeros(len(command))
    for k in range(terms - 1, 0, -1):
        c = ratio / (2.0 * k)
        lower = 2.0 * command[:, 0] if k == 1 else command[:, k - 1]
        pivot = 1.0 - c * steep
        ahead = (c * (lower - upper[:, k]) + c * ahead) / pivot
        steep = -(2.0 * c if k == 1 else c) / pivot
        after[:, k], slope[:, k] = ahead, steep
    free = np.ones_like(command)
    driven = np.zeros_like(command)
    for k in range(1, terms):
        driven[:, k] = after[:, k] + slope[:, k] * driven[:, k - 1]
        free[:, k] = slope[:, k] * free[:, k - 1]
    free /= (free * _ALTERNATE).sum(axis=1)[:, None]
    return driven - (driven * _ALTERNATE).sum(axis=1)[:, None] * free, free


def _monotone(rows: Floats, tolerance: Floats) -> tuple[Ints, Floats, Floats]:
    """Stretches of polynomials (Q, 12) that do not turn: which (S,), and where in [-1, 1] each begins and ends; swings
    up to a tolerance (Q,) are none."""
    slopes = rows[:, 1:] * np.arange(1, TERMS)
    shape = product(slopes, _BERNSTEIN.T)
    # a slope below a quarter of the tolerance makes swings of half of it
    sign = np.where(np.abs(shape) <= 0.25 * tolerance[:, None], 0.0, np.sign(shape))
    maybe = np.flatnonzero((sign > 0.0).any(axis=1) & (sign < 0.0).any(axis=1))
    if not len(maybe):
        return np.arange(len(rows)), np.full(len(rows), -1.0), np.ones(len(rows))
    own = sign[maybe]
    once = (own[:, 0] * own[:, -1] < 0.0) & (own != 0.0).all(axis=1)
    once &= (own[:, 1:] != own[:, :-1]).sum(axis=1) == 1
    where: dict[int, list[float]] = {int(q): turns(rows[q], float(tolerance[q])) for q in maybe[~once]} | {
        int(q): [x] for q, x in zip(maybe[once], _root(slopes[maybe[once]]).tolist(), strict=True)
    }
    many = np.ones(len(rows), dtype=np.intp)
    for q, found in where.items():
        many[q] += len(found)
    part = np.repeat(np.arange(len(rows)), many)
    after = np.cumsum(many)
    high = np.ones(len(part))
    for q, found in where.items():
        high[after[q] - many[q] : after[q] - 1] = found
    opens = np.append(True, part[1:] != part[:-1])
    return part, np.where(opens, -1.0, np.roll(high, 1)), high


def _root(rows: Floats) -> Floats:
    """The root (Q,) in [-1, 1] of polynomials (Q, k) that have one, by halving until nothing is left."""
    low, high = np.full(len(rows), -1.0), np.ones(len(rows))
    rising = horner(rows, high) > 0.0
    for _ in range(54):
        middle = 0.5 * (low + high)
        above = (horner(rows, middle) > 0.0) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return 0.5 * (low + high)


def _held(track: Track, runs: Ints) -> Track:
    """A track whose runs hold their last voltage in a stretch of their own."""
    if not len(runs):
        return track
    place = track.runs[1:][runs]
    end, volts = track.end[place - 1], track.last[place - 1]
    rows = np.where(np.arange(track.inner.shape[1]) == 0, volts[:, None], 0.0)
    more = np.zeros(len(track.loops), dtype=np.intp)
    more[runs] = 1
    return Track(
        np.concatenate([[0], np.cumsum(np.diff(track.runs) + more)]),
        np.insert(track.begin, place, end),
        np.insert(track.end, place, end + np.maximum(1.0, end)),
        np.insert(track.inner, place, rows, axis=0),
        None,
        np.zeros(track.count + len(runs)),
        np.insert(track.first, place, volts),
        np.insert(track.last, place, volts),
        np.insert(track.kink, place, True),
        track.loops,
        track.periods,
    )
