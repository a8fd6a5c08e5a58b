"""Tracks of straight lines, of sines and of cubics: what a waveform builds its track of.

Numbers may be one for all runs or one a run (nr,), and carry derivatives: see `tarsus.model.drive.stretches`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.dual import Dual, alike, columns, value_of
from tarsus.base.errors import InputError
from tarsus.model.drive.stretches import (
    Floats,
    Ints,
    NoSlopeError,
    Track,
    chosen,
    joined,
    polynomial,
    shifted,
)

__all__ = [
    "NoSlopeError", "Track", "chosen", "constant_track", "cubic_track", "each_run", "joined", "linear_track",
    "polyline_track", "polynomial", "sine_track", "swept_track",
]  # fmt: skip

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
    begin, end = times[:, :-1][keep], times[:, 1:][keep]
    first, final = (np.zeros(runs[-1], dtype=bool) for _ in range(2))
    first[runs[:-1]] = final[runs[1:] - 1] = True
    begin = begin - np.where(
        first, value_of(begin), 0.0
    )  # from t = 0 on, each from the end of the one before
    close = np.where(final, np.repeat(value_of(times)[:, -1], np.diff(runs)), np.roll(value_of(begin), -1))
    return runs, begin, Dual(close, end.slope) if isinstance(end, Dual) else close


def _check_lost(times: Any, short: NDArray[np.bool_], v0: Any, v1: Any) -> None:
    """Raise NoSlopeError where a stretch of no length may get one, and is not of one voltage with the next."""
    length = times[:, 1:] - times[:, :-1]
    if isinstance(length, Dual):
        alone = (v0 != v1) | (v1 != np.roll(v0, -1, axis=1))
        lost = np.flatnonzero(length.slope[short & alone].any(axis=0))
        if len(lost):
            raise NoSlopeError(int(lost[0]))


def linear_track(
    start: Any, first: Any, last: Any, *, periodic: bool, hold: bool = False, keep: Any = True
) -> Track:
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
        t = np.concatenate([t, end + np.maximum(1.0, value_of(end))], axis=1)
        v0, v1 = np.concatenate([v0, value], axis=1), np.concatenate([v1, value], axis=1)
        keep = np.concatenate([keep, np.ones((count, 1), dtype=bool)], axis=1)
    times = value_of(t)
    shortest = 1e-14 * times[:, -1:] if periodic else 4.0 * np.spacing(times[:, 1:])
    long = np.diff(times, axis=1) > shortest
    _check_lost(t, ~long, v0, v1)
    keep = keep & long
    runs, begin, end = _kept(t, keep)
    v0, v1 = v0[keep], v1[keep]
    middle = np.where(v0 == v1, v0, 0.5 * v0 + 0.5 * v1)
    periods = t[:, -1] if periodic else np.full(count, np.nan)
    track = Track(
        runs, begin, end, polynomial(middle, 0.5 * (v1 - v0)), None, np.zeros(runs[-1]), v0, v1,
        np.zeros(runs[-1], dtype=bool), np.full(count, 0 if periodic else -1), periods,
    )  # fmt: skip
    kink = _kinks(track)
    if not periodic:
        kink[runs[:-1]] = True
    return replace(track, kink=kink)


def _in_rows(one: Any, count: int) -> Any:
    return one if len(one) == count else np.broadcast_to(one, (count, one.shape[1]))


def _of_runs(values: Any) -> Any:
    values = values if isinstance(values, Dual) else np.asarray(values, dtype=np.float64)
    return values[None] if values.ndim == 1 else values


def _kinks(track: Track) -> NDArray[np.bool_]:
    """Where straight stretches (S,) differ from those before in value or in slope, or may come to."""
    before = track.before()
    slope = (track.last - track.first) / (track.end - track.begin)
    steep, change = np.abs(value_of(slope)), slope - slope[before]
    most = np.maximum.reduceat(steep, track.runs[:-1])[track.run]
    kink = (track.first != track.last[before]) | (np.abs(value_of(change)) > 1e-12 * most)
    return kink | (change != value_of(change)) if isinstance(change, Dual) else kink


def constant_track(volts: Any) -> Track:
    """Track of one voltage, or one a run (nr,), held for ever."""
    return linear_track([0.0, 1.0], [volts], [volts], periodic=False)


def sine_track(amplitude: Any, period: Any, phase: Any, offset: Any) -> Track:
    """One period of offset + amplitude sin(2 pi t / period + phase), cut at its extremes; numbers, or one a run
    (nr,)."""
    return chosen(
        amplitude == 0.0,
        lambda: constant_track(offset),
        lambda: _sines(*alike(amplitude, period, phase, offset)),
    )


def _sines(amplitude: Any, period: Any, phase: Any, offset: Any) -> Track:
    """That of sines, all numbers (nr,)."""
    begin, sign = _fold(phase)
    turn = (0.5 * np.pi - begin) / (2.0 * np.pi)
    start = period[:, None] * columns([0.0, turn, turn + 0.5, 1.0])
    psi0, psi1 = columns([begin, -0.5 * np.pi, -0.5 * np.pi]), columns([0.5 * np.pi, 0.5 * np.pi, begin])
    scale = (sign * amplitude)[:, None] * np.array([1.0, -1.0, 1.0])
    keep = np.diff(value_of(start), axis=1) > 1e-14 * value_of(period)[:, None]
    runs, begin, end = _kept(start, keep)
    above = offset[:, None] + 0.0 * scale
    first, last = above + scale * np.sin(psi0), above + scale * np.sin(psi1)
    inner = polynomial((0.5 * (psi0 + psi1))[keep], (0.5 * (psi1 - psi0))[keep])
    return Track(
        runs, begin, end, inner, scale[keep], above[keep], first[keep], last[keep], np.zeros(runs[-1], dtype=bool),
        np.zeros(len(runs) - 1, dtype=np.intp), period,
    )  # fmt: skip


def _fold(phase: Any) -> tuple[Any, Floats]:
    """(psi, sign) with sin(phase + s) = sign sin(psi + s) and psi in [-pi/2, pi/2)."""
    phase = np.remainder(phase + 0.5 * np.pi, 2.0 * np.pi) - 0.5 * np.pi
    sign = np.ones(phase.shape)
    for _ in range(2):
        beyond = phase >= 0.5 * np.pi - 1e-12
        phase, sign = np.where(beyond, phase - np.pi, phase), np.where(beyond, -sign, sign)
    return phase + (np.maximum(value_of(phase), -0.5 * np.pi) - value_of(phase)), sign


def each_run(track_of: Callable[..., Track], *numbers: Any) -> Track:
    """The runs that a function makes one by one, of what each has of the numbers (nr, ...)."""
    return joined([track_of(*(one[i : i + 1] for one in numbers)) for i in range(len(numbers[0]))])


def swept_track(
    amplitude: Any, start_frequency: Any, stop_frequency: Any, duration: Any, offset: Any
) -> Track:
    """offset + amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 duration))) until `duration`, then held; numbers, or one a
    run (nr,)."""
    numbers = amplitude, start_frequency, stop_frequency, duration, offset
    return chosen(
        amplitude == 0.0, lambda: constant_track(offset), lambda: each_run(_one_sweep, *alike(*numbers))
    )


def _one_sweep(amplitude: Any, low: Any, high: Any, duration: Any, offset: Any) -> Track:
    """That of one run, all numbers (1,)."""
    rate = (high - low) / duration
    cycles = 0.5 * (low + high) * duration
    count = float(value_of(cycles)[0])
    _check_count(2.0 * count + 2.0)
    turns = np.arange(0.25, count, 0.5)
    at = 2.0 * turns / (low + np.sqrt(np.maximum(low * low + 2.0 * rate * turns, 0.0)))
    start = np.concatenate([[0.0], at[value_of(at) < value_of(duration) * (1.0 - 1e-14)], duration])
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
    after = end + np.maximum(1.0, value_of(end))
    return Track(
        np.array([0, len(kink) + 1]), start, np.concatenate([start[1:], after]),
        np.concatenate([inner, polynomial(value)]),
        None if amplitude is None else np.concatenate([amplitude, [np.nan]]), np.concatenate([offset, [0.0]]),
        np.concatenate([first, value]), np.concatenate([last, value]), np.append(kink, True), np.array([-1]),
        np.array([np.nan]),
    )  # fmt: skip


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
    at, knots = value_of(begin), value_of(u)
    near = np.abs(knots - at[:, None]) < 1e-13
    nearest = size - np.argmax(near[:, ::-1], axis=1)  # the last of those that are
    at = np.where(near.any(axis=1), knots[each, nearest], at)  # no sliver of the stretch before
    at = np.where(at == knots[:, -1], knots[:, 0], at)
    begin = begin + (at - value_of(begin))
    k = np.minimum((knots <= at[:, None]).sum(axis=1) - 1, size - 1)
    left, right, rise = u[each, k], u[each, k + 1], v1[each, k] - v0[each, k]
    snapped = at == value_of(left)
    share = np.where((value_of(right) > value_of(left)) & ~snapped, (begin - left) / (right - left), 0.0)
    middle = (v0[each, k] + rise * share)[:, None]
    later = k[:, None] + np.arange(1, size + 1)  # edges after t = 0, once around
    around = u[each[:, None], np.where(later > size, later - size, later)] - begin[:, None]
    around = np.where(later > size, around + 1.0, around)
    zero = np.where(snapped, left - begin, 0.0)[:, None]
    t = np.concatenate([zero, around, np.ones((runs, 1))], axis=1)
    inside = np.maximum(np.minimum(value_of(t), 1.0), 0.0)
    turn = (k[:, None] + np.arange(size + 1)) % size
    rows = each[:, None]
    first = np.concatenate([middle, v0[rows, turn[:, 1:]]], axis=1)
    last = np.concatenate([v1[rows, turn[:, :-1]], middle], axis=1)
    return linear_track(period[:, None] * (t + (inside - value_of(t))), first, last, periodic=True)


def cubic_track(start: Any, rows: Any, samples: Any) -> Track:
    """Track of C continuous cubics `rows` (C, 4) in xi between the times `start` (C+1,) [s], then held; of one run.

    Each cubic is cut where it turns. `samples` (C+1,) [V] are the values at `start`, where a kink is marked.
    """
    plain = value_of(rows)
    count = len(plain)
    _check_count(3.0 * count)
    _, c1, c2, c3 = plain.T
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
