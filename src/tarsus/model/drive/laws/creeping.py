"""A force that goes by the rate as well: a Prandtl-Ishlinskii operator with Kelvin-Voigt elements, creep among them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Amounts, quantity
from tarsus.model.drive.crossings import bracketed_root
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii, expand
from tarsus.model.drive.output import lagged
from tarsus.model.drive.parts import IDENTITY, Parts, to_pieces
from tarsus.model.drive.pieces import TERMS, Channels, Pieces
from tarsus.model.drive.plays import play_states, visited
from tarsus.model.drive.track import Track, horner, shifted

MOST_PIECES = 500_000
"""A force with more is refused: it would take longer to lower than to simulate."""
MOST_LAGS = 0.7
"""Half the length of a piece over the shortest lag in it: of an exponential so long degree 11 misses 1e-14."""
LEAST_LAGS = 5.0
"""The same of a lag that has settled, at least: the derivatives of a piece's rounding are as small as it is."""
SETTLED = 36.0
"""Lags after which rounding is all that is left of a change."""
_CLOSE = 1e-12
"""Part of a piece, or of a whole track, within which two instants are one, seen through rounding."""
_SHORT = math.sqrt(MOST_LAGS * LEAST_LAGS)
"""Between the half lengths, over a lag, of pieces in which it is long and has settled: rounded instants leave
both far from here."""


class Creeping(VoltageLaw):
    """Force = g [instant(V) + sum_j weights[j] z_j], times[j] dz_j/dt + z_j = play_j(V), g = 1 + per_kelvin (T - T_0).

    What follows at once is a Prandtl-Ishlinskii operator; each Kelvin-Voigt element lags the play operator of threshold
    `thresholds[j]`, 0 for an element that lags the voltage itself. Times far longer than a period are creep, a few of
    them, a decade apart, one that goes with the logarithm of time; times near it make loops wider with the rate. At
    t = 0 all elements are at rest at the end of the history. (Krejci and Kuhnen 2001, with lags in place of
    discrete-time sums.)
    """

    kind: Literal["creeping"] = "creeping"
    instant: PrandtlIshlinskii = Field(description="what of the force follows the voltage at once")
    thresholds: Amounts = quantity("V", "threshold of the play that each element lags", default=(), ge=0)
    weights: Amounts = quantity("N/V", "force of each element per volt of its play, at rest", default=())
    times: Amounts = quantity("s", "retardation time of each element", default=(), gt=0)
    temperature: Amount = quantity("K", "temperature T of the actuator", default=293.15, gt=0)
    reference: Amount = quantity("K", "temperature T_0 at which the law was measured", default=293.15, gt=0)
    per_kelvin: Amount = quantity("1/K", "change of the force per kelvin, as a part of it", default=0.0)

    @model_validator(mode="after")
    def _check_lengths(self) -> Creeping:
        count = len(self.thresholds)
        faults = [
            (name, f"expected {count} values, one a threshold, got {len(values)}")
            for name, values in (("weights", self.weights), ("times", self.times))
            if len(values) != count
        ]
        if not self.gain > 0.0:
            faults.append(("per_kelvin", f"leaves {self.gain:g} of the force at this temperature: expected above 0"))
        if faults:
            raise PathErrors(faults)
        return self

    @property
    def gain(self) -> float:
        """Factor of temperature."""
        return 1.0 + self.per_kelvin * (self.temperature - self.reference)

    @property
    def by_rate(self) -> bool:
        """True."""
        return True

    def elements(self) -> tuple[Floats, Floats, Floats]:
        """Thresholds [V], weights [N/V] and times [s] of the elements, each (n,)."""
        return np.array(self.thresholds), np.array(self.weights), np.array(self.times)

    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """Of what follows at once."""
        found = self.instant.parts(track, history)
        return Parts(found.stretch, found.low, found.high, self.gain * found.law, found.kink)

    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force (N,) [N] along a sequence of voltages (n,) [V], at each of which all elements come to rest."""
        r, w, _ = self.elements()
        past = visited(history)
        levels = np.concatenate([past, np.atleast_1d(np.asarray(volts, dtype=np.float64))])
        rest = play_states(levels, r, np.zeros(len(r)))[len(past) :]
        return self.gain * (self.instant.force(volts, history) + product(rest, w))

    def channels(self, track: Track, history: Sequence[float], late: Floats | None = None) -> Channels:
        """The force along the track of one run. A periodic one is followed until all elements repeat to 1e-13.

        Raises InputError for a force of too many pieces, by elements that are very slow against the signal.
        """
        track = track.twice()
        now = to_pieces(track, self.parts(track, history))[0]
        if not len(self.times):
            return Channels.of([now])
        followed, rest = self._followed(track, history, now)
        return Channels.of([followed.along(rest if late is None else late)])

    def late(self, track: Track, history: Sequence[float], late: Floats | None = None, seconds: float = 0.0) -> Floats:
        """Forces (nl,) [N] of the elements of each time, from the shortest on, at a moment of the track of one run."""
        if not len(self.times):
            return np.zeros(0)
        track = track.twice()
        followed, rest = self._followed(track, history, to_pieces(track, self.parts(track, history))[0])
        return followed.at(rest if late is None else late, seconds)

    def _followed(self, track: Track, history: Sequence[float], now: Pieces) -> tuple[_Followed, Floats]:
        """What the lags follow along a track, with the force `now`, and what they are at rest after the history."""
        r, w, times = self.elements()
        plays = PrandtlIshlinskii(linear=1.0, thresholds=self.thresholds, weights=(1.0,) * len(r))
        stretch, low, high, engaged, still = plays.engaged(track, history)
        rows = np.broadcast_to(IDENTITY, (len(stretch), 4))
        volts = to_pieces(track, Parts(stretch, low, high, rows, np.ones(len(stretch), dtype=bool)))[0]
        begins = track.begin[stretch] + 0.5 * (low + 1.0) * (track.end - track.begin)[stretch]
        lags = np.unique(times)
        share = (times == lags[:, None]) * w * self.gain  # of each element in what its lag is asked to follow
        past = visited(history)
        rest = play_states(past, r, np.zeros(len(r)))[-1]
        followed = _Followed.of(
            now, volts, begins, product(engaged.astype(float), share.T), product(still, share.T), lags
        )
        return followed, product(share, rest)

    def along(self, times: ArrayLike, volts: ArrayLike, history: Sequence[float] = (), *, loop: bool = False) -> Floats:
        """Force (N,) [N] at times (N,) [s] at which the voltage is `volts` (N,) [V], straight between them.

        history [V]: visited before, all elements at rest at its end; loop: the samples are a period that is
        repeated until all elements repeat, and ends where it begins.
        """
        moves = _Samples.of(times, volts)
        r, w, lags = self.elements()
        late = moves.elements(r, lags, history, loop)
        past = (*history, *moves.volts) if loop else history
        return self.gain * (self.instant.force(moves.volts, past) + product(late, w))

    def inverse(
        self,
        times: ArrayLike,
        forces: ArrayLike,
        history: Sequence[float] = (),
        limits: tuple[float, float] = (-math.inf, math.inf),
    ) -> Floats:
        """Voltages (N,) [V] that give the wanted forces (N,) [N] at times (N,) [s], straight between them, after
        `history` [V] with all elements at rest; each solved to rounding. The first is reached by a jump.

        `limits` [V] narrow the `monotone_range` of what follows at once. Raises InputError if that law has no
        inverse, if the elements' weights are not of its sign, or if a force is out of reach.
        """
        low, high = self.instant.monotone_range()
        low, high = max(low, limits[0]), min(high, limits[1])
        r, w, lags = self.elements()
        if np.any(w * math.copysign(1.0, self.instant.linear + sum(self.instant.weights)) < 0.0):
            raise InputError("the creeping law has no inverse: its elements pull against what follows at once")
        when, wanted = (np.atleast_1d(np.asarray(one, dtype=np.float64)) for one in (times, forces))
        both = np.concatenate([self.instant.plays()[0], r])
        own = len(both) - len(r)
        past = visited(history)
        state = play_states(past, both, np.zeros(len(both)))[-1]
        z, before, out = state[own:].copy(), float(past[-1]), np.empty(len(when))
        for i, force in enumerate(wanted):
            span = float(when[i] - when[i - 1]) if i else 0.0

            def miss(v: float) -> float:
                moved = _after(state[own:], z, r, lags, before, v, span)  # noqa: B023
                plays = np.minimum(np.maximum(state[:own], v - both[:own]), v + both[:own])  # noqa: B023
                at_once = self.instant.free(v) + float(product(plays, self.instant.plays()[1]))
                return self.gain * (at_once + float(product(moved, w))) - force  # noqa: B023

            found = _reach(miss, min(max(before, low), high), low, high)
            if found is None:
                ends = f"{low:g} V and {high:g} V"
                raise InputError(f"force {i + 1}, {float(force)!r} N, is out of reach between {ends}")
            out[i] = found
            z = _after(state[own:], z, r, lags, before, out[i], span)
            state = np.minimum(np.maximum(state, out[i] - both), out[i] + both)
            before = float(out[i])
        return out


def _after(plays: Floats, late: Floats, r: Floats, lags: Floats, start: float, end: float, span: float) -> Floats:
    """Elements (n,) after a straight move of the voltage from `start` to `end` [V] in the time `span` [s], from
    their states and those of their plays (n,) before it."""
    if span == 0.0:
        return late
    slope, way = (end - start) / span, math.copysign(1.0, end - start)
    room = np.maximum(way * (plays - start) + r, 0.0)  # way of the voltage until each play engages
    ahead = np.maximum(span - room / abs(slope), 0.0) if slope else np.zeros(len(r))
    decay = -np.expm1(-span / lags)
    return late + (plays - late) * decay + slope * (ahead + lags * np.expm1(-ahead / lags))


def _reach(miss: Callable[[float], float], start: float, low: float, high: float) -> float | None:
    """Where in [low, high] a monotone function is zero, looked for from `start` on."""
    here = miss(start)
    for end, way in ((low, -1.0), (high, 1.0)):
        beyond = expand(miss, start, way) if math.isinf(end) else end
        there = miss(beyond)
        if (there < 0.0) != (here < 0.0) or there == 0.0:
            return bracketed_root(miss, start, beyond, here, there) if there != 0.0 else beyond
    return start if here == 0.0 else None


@dataclass(frozen=True)
class _Samples:
    """A voltage (N,) [V] that is straight between times (N,) [s]."""

    times: Floats
    volts: Floats

    @classmethod
    def of(cls, times: ArrayLike, volts: ArrayLike) -> _Samples:
        """Raises InputError unless the times increase and the lengths are equal."""
        when, level = (np.atleast_1d(np.asarray(one, dtype=np.float64)) for one in (times, volts))
        if when.shape != level.shape or not np.all(np.diff(when) > 0.0):
            raise InputError("expected as many voltages as times, and times that increase")
        return cls(when, level)

    def elements(self, r: Floats, lags: Floats, history: Sequence[float], loop: bool) -> Floats:
        """States (N, n) [V] of elements; see `Creeping.along`."""
        past = np.concatenate([visited(history), self.volts if loop else ()])
        begin = play_states(past, r, np.zeros(len(r)))[-1]
        plays = play_states(self.volts, r, begin)
        out = np.empty_like(plays)
        out[0] = begin if not loop else 0.0
        for turn in range(2 if loop else 1):
            for k in range(1, len(out)):
                span = float(self.times[k] - self.times[k - 1])
                out[k] = _after(plays[k - 1], out[k - 1], r, lags, self.volts[k - 1], self.volts[k], span)
            if loop and turn == 0:  # what one period makes of 0, and leaves of any state
                out[0] = out[-1] / -np.expm1(-(self.times[-1] - self.times[0]) / lags)
        return out


@dataclass(frozen=True)
class _Followed:
    """A force along Q pieces of one run and what nl lags follow in it: rows (Q, 12) [N] of what follows at once;
    what each lag makes of nothing (nl, Q, 12), and what is left of its state (nl, Q, 12) per unit of that, at the
    start of the piece.

    start (Q+1,) [s], kink (Q,), loop: as `Pieces`; goals (nl,) [N]: what is followed at the end; lags (nl,) [s].
    """

    start: Floats
    kink: NDArray[np.bool_]
    loop: int
    now: Floats
    made: Floats
    left: Floats
    goals: Floats
    lags: Floats

    @classmethod
    def of(cls, now: Pieces, volts: Pieces, begins: Floats, slope: Floats, level: Floats, lags: Floats) -> _Followed:
        """Of the force `now` that follows at once, and of `volts`, on which each lag follows a straight line,
        slope (P, nl) [N/V] and level (P, nl) [N], from the instants `begins` (P,) [s] on."""
        start, fresh = _united(now, volts)
        middle = 0.5 * (start[1:] + start[:-1])
        own = np.clip(np.searchsorted(begins, middle, side="right") - 1, 0, len(begins) - 1)
        rows = np.stack([_on(one, start) for one in (now, volts)])
        cuts = [_cuts(float(width), _seen(lags, float(start[-1]))) for width in np.diff(start)]
        counts = np.array([len(one) for one in cuts])
        if counts.sum() > MOST_PIECES:
            raise InputError(_TOO_MANY)
        source = np.repeat(np.arange(len(cuts)), counts)
        low = np.concatenate(cuts)
        high = np.where(np.append(source[1:] != source[:-1], True), 1.0, np.append(low[1:], 1.0))
        begin = start[source] + 0.5 * (low + 1.0) * np.diff(start)[source]
        begin = np.where(low == -1.0, start[source], begin)
        at_once, level_of = (shifted(one[source], low, high) for one in rows)
        ends = np.append(begin, start[-1])
        follows = slope[own[source]].T[:, :, None] * level_of
        follows[:, :, 0] += level[own[source]].T
        kink = fresh[source] & (low == -1.0)
        loop = -1 if now.loop < 0 else int(np.argmin(np.abs(ends - now.start[now.loop])))
        made, left = _answers(follows, np.diff(ends), lags)
        goals = _at_end(follows[:, -1])
        return cls(ends, kink, loop, at_once, made, left, goals, lags)

    def states(self, state: Floats, pieces: slice) -> Floats:
        """States (nl, pieces + 1) at the starts of some pieces and after them."""
        made, left = (_at_end(one[:, pieces]) for one in (self.made, self.left))
        out = [state]
        for p in range(made.shape[1]):
            out.append(made[:, p] + left[:, p] * out[-1])
        return np.array(out).T

    def at(self, state: Floats, time: float) -> Floats:
        """States (nl,) at a time [s], from those at the start on."""
        first = 0
        if time >= self.start[-1] and self.loop < 0:
            state = self.states(state, slice(None))[:, -1]
            return self.goals + (state - self.goals) * np.exp((self.start[-1] - time) / self.lags)
        if time >= self.start[-1]:
            again, period = slice(self.loop, None), self.start[-1] - self.start[self.loop]
            count = math.floor((time - self.start[self.loop]) / period)
            state = self.states(state, slice(0, self.loop))[:, -1]
            steady = self.states(np.zeros(len(self.lags)), again)[:, -1] / -np.expm1(-period / self.lags)
            state = steady + (state - steady) * np.exp(-count * period / self.lags)
            first, time = self.loop, min(max(time - count * period, self.start[self.loop]), self.start[-1])
        piece = min(max(int(np.searchsorted(self.start, time, side="right")) - 1, first), len(self.now) - 1)
        state = self.states(state, slice(first, piece))[:, -1]
        xi = 2.0 * (time - self.start[piece]) / (self.start[piece + 1] - self.start[piece]) - 1.0
        made, left = (horner(one[:, piece], np.full(len(self.lags), xi)) for one in (self.made, self.left))
        return made + left * state

    def along(self, state: Floats) -> Pieces:
        """The pieces of the force, from these states (nl,) [N] of the lags on."""
        once = slice(0, self.loop if self.loop >= 0 else len(self.now))
        first = self.states(state, once)
        rows = self.now[once] + self._late(first[:, :-1], once)
        state = first[:, -1]
        return self._held(rows, state) if self.loop < 0 else self._repeated(rows, state)

    def _late(self, states: Floats, pieces: slice) -> Floats:
        return (self.made[:, pieces] + states[:, :, None] * self.left[:, pieces]).sum(axis=0)

    def _held(self, rows: Floats, state: Floats) -> Pieces:
        """With what comes once the voltage is held: until all lags are at rest."""
        end = float(self.start[-1])
        half = max(SETTLED * float(self.lags.max()), _CLOSE * end)
        wide = _cuts(2.0 * half, _seen(self.lags, end))
        ends = end + half * np.append(np.add(wide, 1.0), 2.0)
        constant = np.zeros((len(self.lags), len(wide), TERMS))
        constant[:, :, 0] = self.goals[:, None]
        made, left = _answers(constant, np.diff(ends), self.lags)
        now = np.zeros((len(wide), TERMS))
        now[:, 0] = _at_end(self.now[-1])
        rest = _Followed(ends, np.arange(len(wide)) == 0, -1, now, made, left, self.goals, self.lags)
        states = rest.states(state, slice(None))
        rows = np.concatenate([rows, now + rest._late(states[:, :-1], slice(None))])
        return Pieces(np.concatenate([self.start[:-1], ends]), rows, np.concatenate([self.kink, rest.kink]), -1)

    def _repeated(self, rows: Floats, state: Floats) -> Pieces:
        """With periods until all lags repeat, and one of those that repeat."""
        again = slice(self.loop, len(self.now))
        period = self.start[-1] - self.start[self.loop]
        steady = self.states(np.zeros(len(self.lags)), again)[:, -1] / -np.expm1(-period / self.lags)
        spans = np.abs(rows).sum(axis=1).max(initial=0.0) + np.abs(steady).max() + np.abs(self.now).sum(axis=1).max()
        far = np.abs(state - steady) / (1e-13 * spans)
        wait = float((self.lags * np.log(np.maximum(far, 1.0))).max())
        count = (
            0 if wait == 0.0 else 2 ** math.ceil(math.log2(max(wait / period, 1.0)))
        )  # a number that others near share
        each = len(self.now) - self.loop
        if count * each > MOST_PIECES:
            raise InputError(_TOO_MANY)
        decay = np.exp(-np.arange(count)[:, None] * period / self.lags)  # (count, nl)
        whole = self.now[again] + self._late(self.states(steady, again)[:, :-1], again)
        fading = np.cumprod(_at_end(self.left[:, again]), axis=1)
        fading = np.concatenate([np.ones((len(self.lags), 1)), fading[:, :-1]], axis=1)
        fades = fading[:, :, None] * self.left[:, again]  # (nl, each, 12) of a unit at the start of the period
        more = whole + sum((decay[:, g] * (state - steady)[g])[:, None, None] * fades[g] for g in range(len(self.lags)))
        later = self.start[self.loop] + np.arange(1, count + 2)[:, None] * period
        starts = np.concatenate(
            [
                self.start[: self.loop],
                (later - period + (self.start[self.loop : -1] - self.start[self.loop])).ravel(),
                later[-1],
            ]
        )
        kink = np.concatenate([self.kink[: self.loop], *[self.kink[again]] * (count + 1)])
        rows = np.concatenate([rows, more.reshape(-1, TERMS), whole])
        return Pieces(starts, rows, kink, self.loop + count * each)


_TOO_MANY = (
    f"the creep of the drive needs more than {MOST_PIECES} pieces: its elements are too slow, or too fast, against the "
    "signal"
)


def _at_end(rows: Floats) -> Any:
    """Values of polynomials (..., 12) at the end of their pieces, added up in one order on every machine."""
    out = rows[..., -1]
    for k in range(TERMS - 2, -1, -1):
        out = out + rows[..., k]
    return out


def _united(one: Pieces, other: Pieces) -> tuple[Floats, NDArray[np.bool_]]:
    """Instants (Q + 1,) [s] at which pieces of either begin, and their end, those that are one through rounding
    once; and
    which (Q,) of them are kinks."""
    both = np.concatenate([one.start, other.start])
    order = np.argsort(both, kind="stable")
    kinks = np.concatenate([one.kink, [False], other.kink, [False]])[order]
    apart = np.flatnonzero(np.append(True, np.diff(both[order]) > _CLOSE * both.max()))
    return both[order][apart], np.logical_or.reduceat(kinks, apart)[:-1]


def _on(pieces: Pieces, start: Floats) -> Floats:
    """Polynomials (Q, 12) of a channel on intervals (Q + 1,) [s], none of which goes beyond one of its pieces."""
    middle = 0.5 * (start[1:] + start[:-1])
    own = np.clip(np.searchsorted(pieces.start, middle, side="right") - 1, 0, pieces.count - 1)
    left, width = pieces.start[own], np.diff(pieces.start)[own]
    ends = (2.0 * (one - left) / width - 1.0 for one in (start[:-1], start[1:]))
    low, high = (np.where(np.abs(np.abs(end) - 1.0) <= 1e-9, np.sign(end), end) for end in ends)
    return shifted(pieces.coef[own], low, high)


def _seen(lags: Floats, end: float) -> Floats:
    """The lags whose transients a track of so many seconds shows: others settle within the rounding of its instants."""
    return lags[SETTLED * lags > _CLOSE * end]


def _cuts(width: float, lags: Floats) -> Floats:
    """Where (n,) in [-1, 1) a piece of so many seconds begins anew, so that in each part a lag is long, or has
    settled on a
    polynomial and is much shorter."""
    at, out = 0.0, [0.0]
    while len(out) <= MOST_PIECES:
        step = width - at
        for lag in lags[::-1]:
            far = 2.0 * LEAST_LAGS * lag if at >= SETTLED * lag else math.inf
            step = step if step <= 2.0 * MOST_LAGS * lag or step >= far else 2.0 * MOST_LAGS * lag
        at += step
        if at >= width * (1.0 - _CLOSE):
            break
        out.append(at)
    return 2.0 * np.array(out) / width - 1.0


def _answers(follows: Floats, widths: Floats, lags: Floats) -> tuple[Floats, Floats]:
    """What lags make of what they follow (nl, Q, 12) in pieces of so many seconds (Q,), each from 0 on, and what
    is left of 1,
    (nl, Q, 12) both. Of a lag that has settled the answer is the polynomial x - T x' + T^2 x'' - ..., and
    nothing is left."""
    made, left, one = np.zeros_like(follows), np.zeros_like(follows), np.zeros(TERMS)
    for g, lag in enumerate(lags):
        kept: dict[float, Floats] = {}
        for q, width in enumerate(widths):
            ratio = float(0.5 * width / lag)
            if ratio > _SHORT:
                made[g, q] = follows[g, q]
                for k in range(TERMS - 2, -1, -1):
                    made[g, q, k] -= (k + 1) / ratio * made[g, q, k + 1]
                continue
            if ratio not in kept:
                kept[ratio] = lagged(one, ratio, 1.0, 1.0)[0]
            left[g, q] = kept[ratio]
            made[g, q] = lagged(follows[g, q], ratio, 0.0, ratio * float(np.abs(follows[g, q]).sum()))[0]
    return made, left


def fit_rates(
    loops: Sequence[tuple[ArrayLike, ArrayLike, ArrayLike]],
    thresholds: Sequence[float],
    times: Sequence[float],
    instant: Sequence[float] = (),
) -> Creeping:
    """The operator nearest, in least squares, to loops that were measured at several rates.

    Parameters
    ----------
    loops
        Times [s], voltages [V] and forces [N], each (n,), of periods that repeat, the last sample at the first voltage.
    thresholds, times
        Of the elements [V], [s]: one for each pair of them.
    instant
        Thresholds [V] of the plays that follow at once. All weights get the sign of the mean slope of the loops.

    Raises
    ------
    InputError
        For loops that are not finite, or times that do not increase.
    """
    from scipy.optimize import lsq_linear

    r, lags = (
        one.ravel() for one in np.meshgrid(np.asarray(thresholds, float), np.asarray(times, float), indexing="ij")
    )
    play = np.asarray(instant, dtype=np.float64)
    blocks, target, slopes = [], [], []
    scale = max(float(np.abs(np.asarray(volts)).max(initial=0.0)) for _, volts, _ in loops) or 1.0
    for when, volts, force in loops:
        moves, wanted = _Samples.of(when, volts), np.asarray(force, dtype=np.float64)
        if not (np.isfinite(wanted).all() and np.isfinite(moves.volts).all()):
            raise InputError("the loops to fit are not finite")
        begin = play_states(np.concatenate([[0.0], moves.volts]), play, np.zeros(len(play)))[-1]
        now, late = play_states(moves.volts, play, begin), moves.elements(r, lags, (), True)
        powers = (moves.volts[:, None] / scale) ** np.arange(4)
        blocks.append(np.column_stack([powers, now / scale, late / scale]))
        target.append(wanted)
        slopes.append(float(np.dot(moves.volts - moves.volts.mean(), wanted)))
    columns, force = np.concatenate(blocks), np.concatenate(target)
    size = float(np.ptp(force)) or 1.0
    bounds = np.full((2, columns.shape[1]), np.inf)
    bounds[0] = -np.inf
    bounds[0 if sum(slopes) > 0.0 else 1, 4:] = 0.0
    found = lsq_linear(columns, force / size, bounds=(bounds[0], bounds[1]), method="bvls", tol=1e-14).x * size
    gains = (found / scale ** np.array([0, 1, 2, 3] + [1] * (len(found) - 4))).tolist()
    kept = len(play) + 4
    law = PrandtlIshlinskii(
        constant=gains[0],
        linear=gains[1],
        quadratic=gains[2],
        cubic=gains[3],
        thresholds=tuple(play.tolist()),
        weights=tuple(gains[4:kept]),
    )
    return Creeping(instant=law, thresholds=tuple(r.tolist()), weights=tuple(gains[kept:]), times=tuple(lags.tolist()))
