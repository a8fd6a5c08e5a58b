"""Tracks: the voltages of many runs over time as monotone smooth stretches, in closed form; what all tracks can do, and
the tracks of straight lines, of sines and of cubics that waveforms build theirs of.

Hysteresis depends on the order of extremes only, so a waveform is cut where it turns, jumps or changes its
formula. On each stretch the voltage is a polynomial of the local coordinate xi in [-1, 1] (a cubic for most
waveforms, of degree 11 behind an amplifier), or a sine of a cubic; both can be inverted, which is how the
instants at which a play engages are found.

The stretches of all runs lie one behind the other, so that whatever is made of a track is made for all runs at
once, and to the same bits for each as if it were alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.columns import alike, columns
from tarsus.base.errors import InputError

Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Track:
    """Monotone stretches of the voltages [V] of nr runs, S in all, each run's from t = 0 on."""

    runs: Ints
    """(nr+1,) first stretch of every run, and S."""
    begin: Floats
    """(S,) [s]."""
    end: Floats
    """(S,) [s], where the next stretch of the run begins."""
    inner: Floats
    """(S, K), K from 4 to 12: q(xi) = sum_k inner[k] xi**k, xi in [-1, 1]."""
    amplitude: Floats | None
    """(S,) [V], signed, or None. None, or NaN: V = q(xi). Else V = offset + amplitude sin(q(xi)), |q| <= pi/2."""
    offset: Floats
    """(S,) [V], used with `amplitude`."""
    first: Floats
    """(S,) [V] value at the start of each stretch; exactly the previous `last` where V is continuous."""
    last: Floats
    """(S,) [V] value at the end of each stretch."""
    kink: NDArray[np.bool_]
    """(S,): value or a derivative jumps where the stretch starts (that a run repeats from: also on the way back)."""
    loops: Ints
    """(nr,) stretch of each run that follows its last, counted in the run, those before it come once; -1: the last
    value is held."""
    periods: Floats
    """(nr,) time [s] that the stretches that repeat take, NaN where none do."""

    @property
    def count(self) -> int:
        """S, the number of stretches."""
        return len(self.kink)

    @cached_property
    def run(self) -> Ints:
        """(S,) number of the run that each stretch is of."""
        return np.repeat(np.arange(len(self.loops)), np.diff(self.runs))

    @property
    def start(self) -> Floats:
        """(S+1,) [s] times at which the stretches of a track of one run start, and the end."""
        return np.concatenate([self.begin, self.end[-1:]])

    @property
    def periodic(self) -> bool:
        """Whether the stretches of a track of one run repeat; otherwise its last value is held."""
        return bool(self.loops[0] >= 0)

    @property
    def loop(self) -> int:
        """Stretch that follows the last one of a periodic track of one run; those before it come once."""
        return max(int(self.loops[0]), 0)

    @property
    def period(self) -> float:
        """Time [s] from where a track of one run repeats, or from its start, to its end."""
        return float(self.end[-1] - self.begin[self.loop])

    def before(self) -> Ints:
        """(S,) stretch before each one, of the first of a run the last of the same run."""
        out = np.arange(-1, self.count - 1)
        out[self.runs[:-1]] = self.runs[1:] - 1
        return out

    def of_run(self, values: Any) -> Any:
        """Numbers (k,), or of every run (nr, k), for each stretch: (S, k)."""
        return np.broadcast_to(values, (self.count, *np.shape(values))) if np.ndim(values) < 2 else values[self.run]

    def direction(self) -> Floats:
        """(S,): +1 rising, -1 falling, 0 constant."""
        return np.sign(self.last - self.first)

    def values(self, stretch: Ints, xi: Floats) -> Floats:
        """Volts at local coordinates `xi` (Q,) or (Q, n) of the stretches `stretch` (Q,)."""
        rows, column = self.inner[stretch], (slice(None), None) if xi.ndim == 2 else slice(None)
        q = horner(rows[:, :, None] if xi.ndim == 2 else rows, xi)
        if self.amplitude is None:
            return q
        scale, offset = self.amplitude[stretch][column], self.offset[stretch][column]
        return np.where(np.isnan(scale), q, offset + scale * np.sin(q))

    def solve(self, stretch: Ints, volts: Floats) -> Floats:
        """Local coordinate (Q,) at which each stretch (Q,) reaches `volts` (Q,), a value it takes."""
        if not len(stretch):
            return np.zeros(0)
        rows, first, last = self.inner[stretch], self.first[stretch], self.last[stretch]
        target, run = volts, self.run[stretch]
        sine = np.zeros(len(stretch), dtype=bool)
        if self.amplitude is not None:
            scale = self.amplitude[stretch]
            sine = ~np.isnan(scale)
            target = np.where(sine, np.arcsin(np.clip((volts - self.offset[stretch]) / scale, -1.0, 1.0)), volts)

        def of_runs(bent: Any, runs: Ints) -> NDArray[np.bool_]:
            """Which of the stretches are of runs where any of these is a curve."""
            return (np.bincount(runs[bent], minlength=len(self.loops)) > 0)[run]

        lines = ~sine & ~of_runs(self.inner[:, 2:].any(axis=1), self.run)
        linear = np.clip((target - rows[:, 0]) / rows[:, 1], -1.0, 1.0)
        found = np.where(lines, np.clip(2.0 * (volts - first) / (last - first) - 1.0, -1.0, 1.0), linear)
        curved = np.flatnonzero(of_runs(rows[:, 2:].any(axis=1), run))
        if len(curved):
            found[curved] = _solve_monotone(rows[curved], target[curved], run[curved])
        return found

    def picked(self, runs: Ints) -> Track:
        """The track of some of the runs, one after the other."""
        return self._of(runs, np.diff(self.runs)[runs], self.loops[runs])

    def twice(self) -> Track:
        """The track with one more period of what repeats, which is then what repeats; it starts at exactly the first's
        end."""
        counts = np.diff(self.runs)
        again = np.where(self.loops >= 0, counts - self.loops, 0)
        return self._of(np.arange(len(counts)), counts + again, np.where(self.loops >= 0, counts, -1))

    def _of(self, which: Ints, counts: Ints, loops: Ints) -> Track:
        """So many stretches of some of the runs: after the last what repeats comes once more."""
        runs = np.concatenate([[0], np.cumsum(counts)])
        own = np.repeat(which, counts)
        place = np.arange(runs[-1]) - np.repeat(runs[:-1], counts)
        over = place - np.diff(self.runs)[own]
        source = self.runs[own] + np.where(over < 0, place, over + np.maximum(self.loops[own], 0))
        begin, end = self.begin[source], self.end[source]
        if (over >= 0).any():
            close = self.end[self.runs[own + 1] - 1]
            since = self.begin[self.runs[own] + self.loops[own]]
            begin, end = (np.where(over >= 0, close + (one - since), one) for one in (begin, end))
        return Track(
            runs,
            begin,
            end,
            self.inner[source],
            None if self.amplitude is None else self.amplitude[source],
            self.offset[source],
            self.first[source],
            self.last[source],
            self.kink[source],
            loops,
            self.periods[which],
        )


def joined(tracks: Sequence[Track]) -> Track:
    """The runs of some tracks, one track after the other."""
    if len(tracks) == 1:
        return tracks[0]
    counts = np.concatenate([np.diff(one.runs) for one in tracks])
    wide = max(one.inner.shape[1] for one in tracks)

    def all_of(name: str) -> Any:
        return np.concatenate([getattr(one, name) for one in tracks])

    inner = np.concatenate([_with_terms(one.inner, wide) for one in tracks])
    sines = [one.amplitude for one in tracks]
    amplitude = None
    if any(one is not None for one in sines):
        none = [np.full(track.count, np.nan) if one is None else one for one, track in zip(sines, tracks, strict=True)]
        amplitude = np.concatenate(none)
    return Track(
        np.concatenate([[0], np.cumsum(counts)]),
        all_of("begin"),
        all_of("end"),
        inner,
        amplitude,
        all_of("offset"),
        all_of("first"),
        all_of("last"),
        all_of("kink"),
        all_of("loops"),
        all_of("periods"),
    )


def chosen(condition: Any, one: Callable[[], Track], other: Callable[[], Track]) -> Track:
    """One track for the runs (nr,) where a condition holds, another for those where it does not; each of all runs,
    or of one that stands for them."""
    holds = np.atleast_1d(condition)
    if not holds.any():
        return other()
    tracks = (one(),) if holds.all() else (one(), other())
    count = max(len(holds), *(len(track.loops) for track in tracks))
    of_each = np.zeros(count, dtype=np.intp)
    first, second = (track if len(track.loops) == count else track.picked(of_each) for track in (tracks[0], tracks[-1]))
    holds = holds if len(holds) == count else np.repeat(holds, count)
    if len(tracks) == 1:
        return first
    return joined([first, second]).picked(np.arange(len(holds)) + np.where(holds, 0, len(holds)))


def polynomial(*terms: Any, width: int = 4) -> Any:
    """Polynomials (Q, width) from their lowest terms (Q,)."""
    none = 0.0 * terms[0]
    return np.stack([*terms, *[none] * (width - len(terms))], axis=-1)


def _with_terms(rows: Any, width: int) -> Any:
    """Polynomials (Q, k) with as many terms as a width asks for."""
    left = width - rows.shape[1]
    return rows if not left else np.concatenate([rows, np.zeros((len(rows), left))], axis=1)


def horner(rows: Floats, xi: Floats) -> Floats:
    """Polynomials `rows` (Q, K) at `xi`, (Q,) or what (Q,) is broadcast to."""
    q = rows[:, -1]
    for k in range(rows.shape[1] - 2, -1, -1):
        q = q * xi + rows[:, k]
    return q


def _solve_monotone(rows: Floats, target: Floats, run: Ints) -> Floats:
    """Root in [-1, 1] of monotone polynomials `rows` (Q, K) = `target` (Q,): Newton kept inside a bracket, until
    nothing of a run moves any more."""
    c0, c1 = rows[:, 0], rows[:, 1]
    slopes = rows[:, 1:] * np.arange(1, rows.shape[1])
    low, high = np.full_like(target, -1.0), np.ones_like(target)
    rising = rows[:, 1::2].sum(axis=1) >= 0.0  # sign of q(1) - q(-1)
    x = np.clip((target - c0) / np.where(c1 == 0.0, np.inf, c1), -1.0, 1.0)
    going = np.ones(len(x), dtype=bool)
    for _ in range(200):
        miss = horner(rows, x) - target
        beyond = (miss > 0.0) == rising
        high = np.where(beyond | (miss == 0.0), x, high)
        low = np.where(beyond & (miss != 0.0), low, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = x - miss / horner(slopes, x)
        safe = (step > low) & (step < high)
        new = np.where(safe, step, 0.5 * (low + high))
        new = np.where((miss == 0.0) | ~going, x, new)
        moved = np.abs(new - x) > 4e-16
        x = new
        if not moved.any():
            break
        going = np.isin(run, run[moved])
    return x


def shifted(rows: Floats, low: Floats, high: Floats) -> Floats:
    """Polynomials (Q, K) in the coordinate that is -1 and 1 where xi of `rows` (Q, K) is `low` and `high`."""
    mid, half = 0.5 * (low + high), 0.5 * (high - low)
    terms = [rows[:, k] for k in range(rows.shape[1])]
    top = max([k for k in range(rows.shape[1]) if (terms[k] != 0.0).any()], default=0)
    for i in range(top):
        for j in range(top - 1, i - 1, -1):
            terms[j] = terms[j] + mid * terms[j + 1]
    return np.stack(terms, axis=-1) * half[:, None] ** np.arange(rows.shape[1])


MOST_STRETCHES = 1_000_000
"""A voltage with more monotone stretches than this is refused: its pieces would not fit in memory."""


def _check_count(stretches: float) -> None:
    if not stretches <= MOST_STRETCHES:
        raise InputError(
            f"the waveform rises and falls about {stretches:.3g} times, more than {MOST_STRETCHES}: "
            "shorten it or lower its frequency"
        )


def _kept(times: Any, keep: NDArray[np.bool_]) -> tuple[Ints, Any, Any]:
    """First stretches of the runs, and begin and end of those stretches that are kept (nr, S), between times (nr,
    S+1)."""
    _check_count(float(keep.sum(axis=1).max()))
    runs = np.concatenate([[0], np.cumsum(keep.sum(axis=1))])
    begin = times[:, :-1][keep]
    first, final = (np.zeros(runs[-1], dtype=bool) for _ in range(2))
    first[runs[:-1]] = final[runs[1:] - 1] = True
    begin = np.where(first, 0.0, begin)  # from t = 0 on, each from the end of the one before
    close = np.where(final, np.repeat(times[:, -1], np.diff(runs)), np.roll(begin, -1))
    return runs, begin, close


def linear_track(start: Any, first: Any, last: Any, *, periodic: bool, hold: bool = False, keep: Any = True) -> Track:
    """Track of straight stretches from `first` (S,) to `last` (S,) [V] between the times `start` (S+1,) [s].

    Each is a list of numbers, or of one number a run (nr,), or an array, of every run (nr, S). Stretches of no
    length, to
    rounding, and those that are not to be kept are dropped. With `hold` a constant stretch at the last value
    follows, so
    that the corner at the end is a stretch's start like every other. Kinks are where value or slope differs from
    before.
    """
    t, v0, v1 = (_of_runs(columns(one)) for one in (start, first, last))
    count = max(len(t), len(v0), len(v1))
    t, v0, v1 = (_in_rows(one, count) for one in (t, v0, v1))
    keep = np.broadcast_to(keep, v0.shape)
    if hold:
        end, value = t[:, -1:], v1[:, -1:]
        t = np.concatenate([t, end + np.maximum(1.0, end)], axis=1)
        v0, v1 = np.concatenate([v0, value], axis=1), np.concatenate([v1, value], axis=1)
        keep = np.concatenate([keep, np.ones((count, 1), dtype=bool)], axis=1)
    shortest = 1e-14 * t[:, -1:] if periodic else 4.0 * np.spacing(t[:, 1:])
    keep = keep & (np.diff(t, axis=1) > shortest)
    runs, begin, end = _kept(t, keep)
    v0, v1 = v0[keep], v1[keep]
    middle = np.where(v0 == v1, v0, 0.5 * v0 + 0.5 * v1)
    periods = t[:, -1] if periodic else np.full(count, np.nan)
    track = Track(
        runs,
        begin,
        end,
        polynomial(middle, 0.5 * (v1 - v0)),
        None,
        np.zeros(runs[-1]),
        v0,
        v1,
        np.zeros(runs[-1], dtype=bool),
        np.full(count, 0 if periodic else -1),
        periods,
    )
    kink = _kinks(track)
    if not periodic:
        kink[runs[:-1]] = True
    return replace(track, kink=kink)


def _in_rows(one: Any, count: int) -> Any:
    return one if len(one) == count else np.broadcast_to(one, (count, one.shape[1]))


def _of_runs(values: Any) -> Any:
    values = np.asarray(values, dtype=np.float64)
    return values[None] if values.ndim == 1 else values


def _kinks(track: Track) -> NDArray[np.bool_]:
    """Where straight stretches (S,) differ from those before in value or in slope."""
    before = track.before()
    slope = (track.last - track.first) / (track.end - track.begin)
    steep, change = np.abs(slope), slope - slope[before]
    most = np.maximum.reduceat(steep, track.runs[:-1])[track.run]
    return (track.first != track.last[before]) | (np.abs(change) > 1e-12 * most)


def constant_track(volts: Any) -> Track:
    """Track of one voltage, or one a run (nr,), held for ever."""
    level = np.atleast_1d(np.asarray(volts, dtype=np.float64))
    count = len(level)
    inner = np.zeros((count, 4))
    inner[:, 0] = level
    zeros, ones = np.zeros(count), np.ones(count)
    return Track(
        np.arange(count + 1),
        zeros,
        ones,
        inner,
        None,
        zeros,
        level,
        level,
        ones.astype(bool),
        np.full(count, -1),
        np.full(count, np.nan),
    )


def sine_track(amplitude: Any, period: Any, phase: Any, offset: Any) -> Track:
    """One period of offset + amplitude sin(2 pi t / period + phase), cut at its extremes; numbers, or one a run
    (nr,)."""
    return chosen(
        amplitude == 0.0, lambda: constant_track(offset), lambda: _sines(*alike(amplitude, period, phase, offset))
    )


def _sines(amplitude: Any, period: Any, phase: Any, offset: Any) -> Track:
    """That of sines, all numbers (nr,)."""
    begin, sign = _fold(phase)
    turn = (0.5 * np.pi - begin) / (2.0 * np.pi)
    start = period[:, None] * columns([0.0, turn, turn + 0.5, 1.0])
    psi0, psi1 = columns([begin, -0.5 * np.pi, -0.5 * np.pi]), columns([0.5 * np.pi, 0.5 * np.pi, begin])
    scale = (sign * amplitude)[:, None] * np.array([1.0, -1.0, 1.0])
    keep = np.diff(start, axis=1) > 1e-14 * period[:, None]
    runs, begin, end = _kept(start, keep)
    above = offset[:, None] + 0.0 * scale
    first, last = above + scale * np.sin(psi0), above + scale * np.sin(psi1)
    inner = polynomial((0.5 * (psi0 + psi1))[keep], (0.5 * (psi1 - psi0))[keep])
    return Track(
        runs,
        begin,
        end,
        inner,
        scale[keep],
        above[keep],
        first[keep],
        last[keep],
        np.zeros(runs[-1], dtype=bool),
        np.zeros(len(runs) - 1, dtype=np.intp),
        period,
    )


def _fold(phase: Any) -> tuple[Any, Floats]:
    """(psi, sign) with sin(phase + s) = sign sin(psi + s) and psi in [-pi/2, pi/2)."""
    phase = np.remainder(phase + 0.5 * np.pi, 2.0 * np.pi) - 0.5 * np.pi
    sign = np.ones(phase.shape)
    for _ in range(2):
        beyond = phase >= 0.5 * np.pi - 1e-12
        phase, sign = np.where(beyond, phase - np.pi, phase), np.where(beyond, -sign, sign)
    return np.maximum(phase, -0.5 * np.pi), sign


def each_run(track_of: Callable[..., Track], *numbers: Any) -> Track:
    """The runs that a function makes one by one, of what each has of the numbers (nr, ...)."""
    return joined([track_of(*(one[i : i + 1] for one in numbers)) for i in range(len(numbers[0]))])


def swept_track(amplitude: Any, start_frequency: Any, stop_frequency: Any, duration: Any, offset: Any) -> Track:
    """offset + amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 duration))) until `duration`, then held; numbers, or one a
    run (nr,)."""
    numbers = amplitude, start_frequency, stop_frequency, duration, offset
    return chosen(amplitude == 0.0, lambda: constant_track(offset), lambda: each_run(_one_sweep, *alike(*numbers)))


def _one_sweep(amplitude: Any, low: Any, high: Any, duration: Any, offset: Any) -> Track:
    """That of one run, all numbers (1,)."""
    rate = (high - low) / duration
    cycles = 0.5 * (low + high) * duration
    count = float(cycles[0])
    _check_count(2.0 * count + 2.0)
    turns = np.arange(0.25, count, 0.5)
    at = 2.0 * turns / (low + np.sqrt(np.maximum(low * low + 2.0 * rate * turns, 0.0)))
    start = np.concatenate([[0.0], at[at < duration * (1.0 - 1e-14)], duration])
    count = len(start) - 1
    nearest = 0.5 * (count - 1)  # the cycle count, whole or half, around which the last stretch's sine is odd
    psi0 = np.concatenate([[0.0], np.full(count - 1, -0.5 * np.pi)])
    psi1 = np.concatenate([np.full(count - 1, 0.5 * np.pi), 2.0 * np.pi * (cycles - nearest)])
    scale = amplitude * (1.0 - 2.0 * (np.arange(count) % 2))
    half = 0.5 * (start[1:] - start[:-1])
    bend = np.pi * rate * (half * half)
    inner = polynomial(0.5 * (psi0 + psi1) - bend, 0.5 * (psi1 - psi0), bend)
    above = np.broadcast_to(offset, (count,))
    kink = np.zeros(count, dtype=bool)
    kink[0] = True
    return _held(start, inner, scale, above, above + scale * np.sin(psi0), above + scale * np.sin(psi1), kink)


def _held(start: Any, inner: Any, amplitude: Any, offset: Any, first: Any, last: Any, kink: Any) -> Track:
    """A track of one run, followed by a constant stretch at its last value."""
    end, value = start[-1:], last[-1:]
    after = end + np.maximum(1.0, end)
    return Track(
        np.array([0, len(kink) + 1]),
        start,
        np.concatenate([start[1:], after]),
        np.concatenate([inner, polynomial(value)]),
        None if amplitude is None else np.concatenate([amplitude, [np.nan]]),
        np.concatenate([offset, [0.0]]),
        np.concatenate([first, value]),
        np.concatenate([last, value]),
        np.append(kink, True),
        np.array([-1]),
        np.array([np.nan]),
    )


def polyline_track(edges: Any, first: Any, last: Any, begin: Any, period: Any) -> Track:
    """One period of a periodic polyline given in cycles.

    Stretches run from `first` (S,) to `last` (S,) [V] between `edges` (S+1,) [cycles], which span one cycle; t = 0
    is at `begin` [cycles]. Each is a list of numbers, or of one number a run (nr,); begin and period [s] a number, or
    one a run.
    """
    u, v0, v1 = (_of_runs(columns(one)) for one in (edges, first, last))
    begin, period = alike(begin, period)
    runs = max(len(one) for one in (u, v0, v1, begin, period))
    u, v0, v1 = (_in_rows(one, runs) for one in (u, v0, v1))
    begin, period = (
        (np.broadcast_to(one, (runs,)) for one in (begin, period)) if len(begin) != runs else (begin, period)
    )
    size, each = v0.shape[1], np.arange(runs)
    begin = u[:, 0] + np.remainder(begin - u[:, 0], 1.0)
    at, knots = begin, u
    near = np.abs(knots - at[:, None]) < 1e-13
    nearest = size - np.argmax(near[:, ::-1], axis=1)  # the last of those that are
    at = np.where(near.any(axis=1), knots[each, nearest], at)  # no sliver of the stretch before
    at = np.where(at == knots[:, -1], knots[:, 0], at)
    begin = at
    k = np.minimum((knots <= at[:, None]).sum(axis=1) - 1, size - 1)
    left, right, rise = u[each, k], u[each, k + 1], v1[each, k] - v0[each, k]
    snapped = at == left
    share = np.where((right > left) & ~snapped, (begin - left) / (right - left), 0.0)
    middle = (v0[each, k] + rise * share)[:, None]
    later = k[:, None] + np.arange(1, size + 1)  # edges after t = 0, once around
    around = u[each[:, None], np.where(later > size, later - size, later)] - begin[:, None]
    around = np.where(later > size, around + 1.0, around)
    zero = np.where(snapped, left - begin, 0.0)[:, None]
    t = np.concatenate([zero, around, np.ones((runs, 1))], axis=1)
    inside = np.maximum(np.minimum(t, 1.0), 0.0)
    turn = (k[:, None] + np.arange(size + 1)) % size
    rows = each[:, None]
    first = np.concatenate([middle, v0[rows, turn[:, 1:]]], axis=1)
    last = np.concatenate([v1[rows, turn[:, :-1]], middle], axis=1)
    return linear_track(period[:, None] * inside, first, last, periodic=True)


def cubic_track(start: Any, rows: Any, samples: Any) -> Track:
    """Track of C continuous cubics `rows` (C, 4) in xi between the times `start` (C+1,) [s], then held; of one run.

    Each cubic is cut where it turns. `samples` (C+1,) [V] are the values at `start`, where a kink is marked.
    """
    count = len(rows)
    _check_count(3.0 * count)
    _, c1, c2, c3 = rows.T
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(c2**2 - 3.0 * c1 * c3)
        sum_ = -(c2 + np.where(c2 >= 0.0, root, -root))
        turns = np.stack([sum_ / (3.0 * c3), c1 / sum_])  # NaN where the cubic does not turn
    which, cubic = np.nonzero((turns > -1.0 + 1e-13) & (turns < 1.0 - 1e-13))
    low = np.concatenate([np.full(count, -1.0), turns[which, cubic]])
    owner = np.concatenate([np.arange(count), cubic])
    order = np.lexsort((low, owner))
    low, owner = low[order], owner[order]
    keep = np.ones(len(low), dtype=bool)
    keep[1:] = (owner[1:] != owner[:-1]) | (low[1:] - low[:-1] > 1e-13)
    low, owner = low[keep], owner[keep]
    new = low == -1.0
    high = np.append(np.where(new[1:], 1.0, low[1:]), 1.0)
    a = rows[owner]
    turning = ((a[:, 3] * low + a[:, 2]) * low + a[:, 1]) * low + a[:, 0]
    first = np.where(new, samples[owner], turning)
    last = np.concatenate([np.where(new[1:], samples[owner[:-1] + 1], first[1:]), samples[-1:]])
    inner, flat = shifted(a, low, high), (first == last)[:, None] & (np.arange(4) > 0)
    left, right = start[owner], start[owner + 1]
    times = np.concatenate([np.where(new, left, left + 0.5 * (low + 1.0) * (right - left)), start[-1:]])
    return _held(times, np.where(flat, 0.0, inner), None, np.zeros(len(low)), first, last, new)
