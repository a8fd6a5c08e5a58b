"""Tracks: the voltages of many runs over time as monotone smooth stretches, in closed form; what all tracks can do.

Hysteresis depends on the order of extremes only, so a waveform is cut where it turns, jumps or changes its
formula. On each stretch the voltage is a polynomial of the local coordinate xi in [-1, 1] (a cubic for most
waveforms, of degree 11 behind an amplifier), or a sine of a cubic; both can be inverted, which is how the
instants at which a play engages are found.

The stretches of all runs lie one behind the other, so that whatever is made of a track is made for all runs at
once, and to the same bits for each as if it were alone. The numbers a track is made of may carry derivatives
(`tarsus.base.dual`): those of the track, and of all that is made of it, follow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.dual import Dual, value_of
from tarsus.base.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

__all__ = ["NoSlopeError", "Track", "chosen", "horner", "joined", "polynomial", "shifted"]


class NoSlopeError(InputError):
    """A derivative that a track does not have; lane: by which of the numbers."""

    def __init__(self, lane: int) -> None:
        super().__init__("there is no derivative by it here, for the drive's voltage changes its pieces")
        self.lane = lane


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

    @cached_property
    def plain(self) -> Track:
        """The track without the derivatives that its numbers may carry."""
        parts = {one.name: getattr(self, one.name) for one in fields(self)}
        return replace(
            self, **{name: value_of(part) for name, part in parts.items() if isinstance(part, Dual)}
        )

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
        return float(value_of(self.end)[-1] - value_of(self.begin)[self.loop])

    def before(self) -> Ints:
        """(S,) stretch before each one, of the first of a run the last of the same run."""
        out = np.arange(-1, self.count - 1)
        out[self.runs[:-1]] = self.runs[1:] - 1
        return out

    def of_run(self, values: Any) -> Any:
        """Numbers (k,), or of every run (nr, k), for each stretch: (S, k)."""
        return (
            np.broadcast_to(values, (self.count, *np.shape(values)))
            if np.ndim(values) < 2
            else values[self.run]
        )

    def direction(self) -> Floats:
        """(S,): +1 rising, -1 falling, 0 constant."""
        return np.sign(self.last - self.first)

    def values(self, stretch: Ints, xi: Floats) -> Floats:
        """Volts at local coordinates `xi` (Q,) or (Q, n) of the stretches `stretch` (Q,)."""
        rows, beside = self.inner[stretch], (slice(None), None) if xi.ndim == 2 else slice(None)
        q = horner(rows[:, :, None] if xi.ndim == 2 else rows, xi)
        if self.amplitude is None:
            return q
        scale, offset = self.amplitude[stretch][beside], self.offset[stretch][beside]
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
            target = np.where(
                sine, np.arcsin(np.clip((volts - self.offset[stretch]) / scale, -1.0, 1.0)), volts
            )

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
            close = value_of(self.end)[self.runs[own + 1] - 1]
            since = value_of(self.begin)[self.runs[own] + self.loops[own]]
            later = (self.periods[own] - value_of(self.periods)[own], over >= 0)
            begin, end = (
                np.where(later[1], close + (value_of(one) - since) + (one - value_of(one)) + later[0], one)
                for one in (begin, end)
            )
        return Track(
            runs, begin, end, self.inner[source], None if self.amplitude is None else self.amplitude[source],
            self.offset[source], self.first[source], self.last[source], self.kink[source], loops, self.periods[which],
        )  # fmt: skip


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
        none = [
            np.full(track.count, np.nan) if one is None else one
            for one, track in zip(sines, tracks, strict=True)
        ]
        amplitude = np.concatenate(none)
    return Track(
        np.concatenate([[0], np.cumsum(counts)]), all_of("begin"), all_of("end"), inner, amplitude, all_of("offset"),
        all_of("first"), all_of("last"), all_of("kink"), all_of("loops"), all_of("periods"),
    )  # fmt: skip


def chosen(condition: Any, one: Callable[[], Track], other: Callable[[], Track]) -> Track:
    """One track for the runs (nr,) where a condition holds, another for those where it does not; each of all runs,
    or of one that stands for them."""
    holds = np.atleast_1d(condition)
    if not holds.any():
        return other()
    tracks = (one(),) if holds.all() else (one(), other())
    count = max(len(holds), *(len(track.loops) for track in tracks))
    of_each = np.zeros(count, dtype=np.intp)
    first, second = (
        track if len(track.loops) == count else track.picked(of_each) for track in (tracks[0], tracks[-1])
    )
    holds = holds if len(holds) == count else np.repeat(holds, count)
    if len(tracks) == 1:
        return first
    return joined([first, second]).picked(np.arange(len(holds)) + np.where(holds, 0, len(holds)))


def polynomial(*terms: Any, width: int = 4) -> Any:
    """Polynomials (Q, width) from their lowest terms (Q,)."""
    none = 0.0 * value_of(terms[0])
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
