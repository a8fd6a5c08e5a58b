"""Tracks: a voltage over time as monotone smooth stretches, in closed form.

Hysteresis depends on the order of extremes only, so a waveform is cut where it turns, jumps or changes its
formula. On each stretch the voltage is a polynomial of the local coordinate xi in [-1, 1] (a cubic for most
waveforms, of degree 11 behind an amplifier), or a sine of a cubic; both can be inverted, which is how the
instants at which a play engages are found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MOST_STRETCHES = 1_000_000
"""A voltage with more monotone stretches than this is refused: its pieces would not fit in memory."""


@dataclass(frozen=True)
class Track:
    """S monotone stretches of a voltage [V], starting at t = 0."""

    start: Floats
    """(S+1,) [s]."""
    inner: Floats
    """(S, K), K from 4 to 12: q(xi) = sum_k inner[k] xi**k, xi in [-1, 1]."""
    amplitude: Floats | None
    """(S,) [V], signed, or None. None: V = q(xi). Else V = offset + amplitude sin(q(xi)), |q| <= pi/2."""
    offset: float
    """[V], used with `amplitude`."""
    first: Floats
    """(S,) [V] value at the start of each stretch; exactly the previous `last` where V is continuous."""
    last: Floats
    """(S,) [V] value at the end of each stretch."""
    kink: NDArray[np.bool_]
    """(S,): value or a derivative jumps where the stretch starts (periodic: row `loop` also tells about the wrap)."""
    periodic: bool
    """True: the stretches from `loop` on repeat. False: the last value is held."""
    loop: int = 0
    """Stretch that follows the last one of a periodic track; those before it come once."""

    @property
    def count(self) -> int:
        """S, the number of stretches."""
        return len(self.kink)

    @property
    def period(self) -> float:
        """Time [s] that the repeated stretches of a periodic track take."""
        return float(self.start[-1] - self.start[self.loop])

    def direction(self) -> Floats:
        """(S,): +1 rising, -1 falling, 0 constant."""
        return np.sign(self.last - self.first)

    def values(self, stretch: Ints, xi: Floats) -> Floats:
        """Volts at local coordinates `xi` (Q,) or (Q, n) of the stretches `stretch` (Q,)."""
        rows = self.inner[stretch]
        if xi.ndim == 2:
            rows = rows[:, :, None]
        q = horner(rows, xi)
        if self.amplitude is None:
            return q
        scale = self.amplitude[stretch]
        return self.offset + (scale[:, None] if xi.ndim == 2 else scale) * np.sin(q)

    def solve(self, stretch: Ints, volts: Floats) -> Floats:
        """Local coordinate (Q,) at which each stretch (Q,) reaches `volts` (Q,), a value it takes."""
        rows = self.inner[stretch]
        target = volts
        if self.amplitude is not None:
            sine = (volts - self.offset) / self.amplitude[stretch]
            target = np.arcsin(np.clip(sine, -1.0, 1.0))
        elif not self.inner[:, 2:].any():
            first = self.first[stretch]
            return np.clip(2.0 * (volts - first) / (self.last[stretch] - first) - 1.0, -1.0, 1.0)
        return _solve_monotone(rows, target)

    def twice(self) -> Track:
        """A periodic track with one more period, which is then what repeats; it starts at exactly the first's end."""
        begin, loop, end = self.start[self.loop], self.loop, self.start[-1]

        def again(values: NDArray[Any]) -> NDArray[Any]:
            return np.concatenate([values, values[loop:]])

        amplitude = None if self.amplitude is None else again(self.amplitude)
        start = np.concatenate([self.start, end + (self.start[loop + 1 :] - begin)])
        first, last, kink = again(self.first), again(self.last), again(self.kink)
        return Track(start, again(self.inner), amplitude, self.offset, first, last, kink, True, self.count)


@dataclass(frozen=True)
class TrackSlopes:
    """Derivatives of a track of straight stretches by P numbers of its waveform, last axis."""

    start: Floats
    """(S+1, P) of the times."""
    first: Floats
    """(S, P) of the values at the starts of stretches."""
    last: Floats
    """(S, P) and at their ends."""

    def twice(self, track: Track) -> TrackSlopes:
        """As `Track.twice` of the periodic track from its first stretch on."""
        assert track.loop == 0
        later = self.start[-1] + (self.start[1:] - self.start[0])
        first, last = (np.concatenate([one, one]) for one in (self.first, self.last))
        return TrackSlopes(np.concatenate([self.start, later]), first, last)


def lines(
    times: Floats, first: Floats, last: Floats, slopes: TrackSlopes, *, periodic: bool
) -> tuple[Track, TrackSlopes]:
    """Track of straight stretches, all of them as if values jumped between them, with its derivatives; one that does
    not repeat holds its last value, as in `linear_track`."""
    if not periodic:
        times, slopes_of_times = np.append(times, times[-1] + max(1.0, times[-1])), slopes.start
        first, last = np.append(first, last[-1]), np.append(last, last[-1])
        slopes = TrackSlopes(
            np.concatenate([slopes_of_times, slopes_of_times[-1:]]),
            np.concatenate([slopes.first, slopes.last[-1:]]), np.concatenate([slopes.last, slopes.last[-1:]]),
        )  # fmt: skip
    inner = np.zeros((len(first), 4))
    inner[:, 0], inner[:, 1] = np.where(first == last, first, 0.5 * first + 0.5 * last), 0.5 * (last - first)
    return Track(times, inner, None, 0.0, first, last, np.ones(len(first), dtype=bool), periodic), slopes


def horner(rows: Floats, xi: Floats) -> Floats:
    """Polynomials `rows` (Q, K) at `xi`, (Q,) or what (Q,) is broadcast to."""
    q = rows[:, -1]
    for k in range(rows.shape[1] - 2, -1, -1):
        q = q * xi + rows[:, k]
    return q


def _solve_monotone(rows: Floats, target: Floats) -> Floats:
    """Root in [-1, 1] of monotone polynomials `rows` (Q, K) = `target` (Q,): Newton kept inside a bracket."""
    c0, c1 = rows[:, 0], rows[:, 1]
    if not rows[:, 2:].any():
        return np.clip((target - c0) / c1, -1.0, 1.0)
    slopes = rows[:, 1:] * np.arange(1, rows.shape[1])
    low, high = np.full_like(target, -1.0), np.ones_like(target)
    rising = rows[:, 1::2].sum(axis=1) >= 0.0  # sign of q(1) - q(-1)
    x = np.clip((target - c0) / np.where(c1 == 0.0, np.inf, c1), -1.0, 1.0)
    for _ in range(200):
        miss = horner(rows, x) - target
        beyond = (miss > 0.0) == rising
        high = np.where(beyond | (miss == 0.0), x, high)
        low = np.where(beyond & (miss != 0.0), low, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = x - miss / horner(slopes, x)
        safe = (step > low) & (step < high)
        new = np.where(safe, step, 0.5 * (low + high))
        new = np.where(miss == 0.0, x, new)
        moved = np.abs(new - x)
        x = new
        if not (moved > 4e-16).any():
            break
    return x


def _check_count(stretches: float) -> None:
    if not stretches <= MOST_STRETCHES:
        raise InputError(
            f"the waveform rises and falls about {stretches:.3g} times, more than {MOST_STRETCHES}: "
            "shorten it or lower its frequency"
        )


def linear_track(
    start: ArrayLike, first: ArrayLike, last: ArrayLike, *, periodic: bool, hold: bool = False
) -> Track:
    """Track of straight stretches from `first` (S,) to `last` (S,) [V] between the times `start` (S+1,) [s].

    Stretches of no length, to rounding, are dropped. With `hold` a constant stretch at the last value
    follows, so that the corner at the end is a stretch's start like every other. Kinks are where value or
    slope differs from before.
    """
    t, v0, v1 = (np.asarray(a, dtype=np.float64) for a in (start, first, last))
    if hold:
        t, v0, v1 = np.append(t, t[-1] + max(1.0, t[-1])), np.append(v0, v1[-1]), np.append(v1, v1[-1])
    long = np.diff(t) > (1e-14 * t[-1] if periodic else 4.0 * np.spacing(t[1:]))
    if not long.all():
        t = np.concatenate([t[:-1][long], t[-1:]])
        t[0] = 0.0
        v0, v1 = v0[long], v1[long]
    _check_count(len(v0))
    slope = (v1 - v0) / np.diff(t)
    kink = v0 != np.roll(v1, 1)
    kink |= np.abs(slope - np.roll(slope, 1)) > 1e-12 * np.abs(slope).max()
    inner = np.zeros((len(v0), 4))
    inner[:, 0] = np.where(v0 == v1, v0, 0.5 * v0 + 0.5 * v1)
    inner[:, 1] = 0.5 * (v1 - v0)
    if not periodic:
        kink[0] = True
    return Track(t, inner, None, 0.0, v0, v1, kink, periodic)


def constant_track(volts: float) -> Track:
    """Track of one voltage held for ever."""
    return linear_track([0.0, 1.0], [volts], [volts], periodic=False)


def sine_track(amplitude: float, period: float, phase: float, offset: float) -> Track:
    """One period of offset + amplitude sin(2 pi t / period + phase), cut at its extremes."""
    if amplitude == 0.0:
        return constant_track(offset)
    begin, sign = _fold(phase)
    turn = (0.5 * np.pi - begin) / (2.0 * np.pi)
    start = period * np.array([0.0, turn, turn + 0.5, 1.0])
    psi0 = np.array([begin, -0.5 * np.pi, -0.5 * np.pi])
    psi1 = np.array([0.5 * np.pi, 0.5 * np.pi, begin])
    scale = sign * amplitude * np.array([1.0, -1.0, 1.0])
    keep = np.diff(start) > 1e-14 * period
    start = np.concatenate([start[:-1][keep], start[-1:]])
    inner = np.zeros((int(keep.sum()), 4))
    inner[:, 0] = 0.5 * (psi0 + psi1)[keep]
    inner[:, 1] = 0.5 * (psi1 - psi0)[keep]
    first = (offset + scale * np.sin(psi0))[keep]
    last = (offset + scale * np.sin(psi1))[keep]
    return Track(start, inner, scale[keep], offset, first, last, np.zeros(len(inner), dtype=bool), True)


def _fold(phase: float) -> tuple[float, float]:
    """(psi, sign) with sin(phase + s) = sign sin(psi + s) and psi in [-pi/2, pi/2)."""
    phase = float(np.remainder(phase + 0.5 * np.pi, 2.0 * np.pi) - 0.5 * np.pi)
    sign = 1.0
    if phase >= 0.5 * np.pi - 1e-12:
        phase, sign = phase - np.pi, -1.0
    if phase >= 0.5 * np.pi - 1e-12:
        phase, sign = phase - np.pi, -sign
    return max(phase, -0.5 * np.pi), sign


def swept_track(
    amplitude: float, start_frequency: float, stop_frequency: float, duration: float, offset: float
) -> Track:
    """offset + amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 duration))) until `duration`, then held."""
    if amplitude == 0.0:
        return constant_track(offset)
    rate = (stop_frequency - start_frequency) / duration
    cycles = 0.5 * (start_frequency + stop_frequency) * duration
    _check_count(2.0 * cycles + 2.0)
    turns = np.arange(0.25, cycles, 0.5)
    at = 2.0 * turns / (start_frequency + np.sqrt(np.maximum(start_frequency**2 + 2.0 * rate * turns, 0.0)))
    start = np.concatenate([[0.0], at[at < duration * (1.0 - 1e-14)], [duration]])
    count = len(start) - 1
    psi0, psi1 = np.full(count, -0.5 * np.pi), np.full(count, 0.5 * np.pi)
    psi0[0] = 0.0
    nearest = 0.5 * (count - 1)  # the cycle count, whole or half, around which the last stretch's sine is odd
    psi1[-1] = 2.0 * np.pi * (cycles - nearest)
    scale = amplitude * (1.0 - 2.0 * (np.arange(count) % 2))
    inner = np.zeros((count, 4))
    inner[:, 2] = np.pi * rate * (0.5 * np.diff(start)) ** 2
    inner[:, 1] = 0.5 * (psi1 - psi0)
    inner[:, 0] = 0.5 * (psi0 + psi1) - inner[:, 2]
    scale = np.asarray(scale, dtype=np.float64)
    first: Floats = offset + scale * np.sin(psi0)
    last: Floats = offset + scale * np.sin(psi1)
    kink = np.zeros(count, dtype=bool)
    kink[0] = True
    sweep = Track(start, inner, scale, offset, first, last, kink, False)
    return _held(sweep)


def _held(track: Track) -> Track:
    """The track followed by a constant stretch at its last value."""
    end, value = track.start[-1], track.last[-1]
    row = np.array([[float(value), 0.0, 0.0, 0.0]])
    amplitude = track.amplitude
    if amplitude is not None:
        angle = np.arcsin(np.clip((value - track.offset) / amplitude[-1], -1.0, 1.0))
        row[0, 0] = angle
        amplitude = np.append(amplitude, amplitude[-1])
    return Track(
        np.append(track.start, end + max(1.0, end)),
        np.concatenate([track.inner, row]),
        amplitude,
        track.offset,
        np.append(track.first, value),
        np.append(track.last, value),
        np.append(track.kink, True),
        track.periodic,
    )


def polyline_track(edges: ArrayLike, first: ArrayLike, last: ArrayLike, begin: float, period: float) -> Track:
    """One period of a periodic polyline given in cycles.

    Stretches run from `first` (S,) to `last` (S,) [V] between `edges` (S+1,) [cycles], which span one cycle;
    t = 0 is at `begin` [cycles].
    """
    u, v0, v1 = (np.asarray(a, dtype=np.float64) for a in (edges, first, last))
    begin = float(u[0] + np.remainder(begin - u[0], 1.0))
    near = u[np.abs(u - begin) < 1e-13]
    begin = float(near[-1]) if len(near) else begin  # no sliver of the stretch before
    begin = float(u[0]) if begin == u[-1] else begin
    k = min(int(np.searchsorted(u, begin, side="right")) - 1, len(v0) - 1)
    middle = v0[k] + (v1[k] - v0[k]) * ((begin - u[k]) / (u[k + 1] - u[k])) if u[k + 1] > u[k] else v0[k]
    around = np.concatenate([[0.0], u[k + 1 :] - begin, (u[1 : k + 1] - begin) + 1.0, [1.0]])
    return linear_track(
        period * np.clip(around, 0.0, 1.0),
        np.concatenate([[middle], v0[k + 1 :], v0[: k + 1]]),
        np.concatenate([v1[k:], v1[:k], [middle]]),
        periodic=True,
    )


def cubic_track(start: Floats, rows: Floats, samples: Floats) -> Track:
    """Track of C continuous cubics `rows` (C, 4) in xi between the times `start` (C+1,) [s], then held.

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
    inner = shifted(rows[owner], low, high)
    a = rows[owner]
    turning = ((a[:, 3] * low + a[:, 2]) * low + a[:, 1]) * low + a[:, 0]
    first = np.where(new, samples[owner], turning)
    last = np.append(np.where(new[1:], samples[owner[:-1] + 1], first[1:]), samples[-1])
    inner[first == last, 1:] = 0.0
    left, right = start[owner], start[owner + 1]
    times = np.append(np.where(new, left, left + 0.5 * (low + 1.0) * (right - left)), start[-1])
    return _held(Track(times, inner, None, 0.0, first, last, new, False))


def shifted(rows: Floats, low: Floats, high: Floats) -> Floats:
    """Polynomials (Q, K) in the coordinate that is -1 and 1 where xi of `rows` (Q, K) is `low` and `high`."""
    mid, half = 0.5 * (low + high), 0.5 * (high - low)
    q = rows.copy()
    top = max([k for k in range(rows.shape[1]) if rows[:, k].any()], default=0)
    for i in range(top):
        for j in range(top - 1, i - 1, -1):
            q[:, j] += mid * q[:, j + 1]
    return q * half[:, None] ** np.arange(rows.shape[1])
