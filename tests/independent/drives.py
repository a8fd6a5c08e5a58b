"""Forces of drives: waveforms, amplifiers and laws from volts to force, as smooth pieces of time."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

Function = Callable[[float], float]
LOOKS = 400  # points at which a piece is looked at for a turn; pieces are a cycle or less


@dataclass(frozen=True)
class Piece:
    """A smooth stretch of a signal."""

    start: float
    end: float
    value: Function
    slope: Function


class Signal:
    """A piecewise smooth function of time from 0 to an end."""

    def __init__(self, pieces: Iterable[Piece], end: float) -> None:
        self.pieces = [p for p in pieces if p.start < end and p.end > max(p.start, 0.0)]
        self.starts = [p.start for p in self.pieces]

    def at(self, time: float) -> Piece:
        """The piece that begins at or before a time."""
        return self.pieces[max(bisect_right(self.starts, time) - 1, 0)]


def line(start: float, end: float, first: float, last: float) -> Piece:
    slope = (last - first) / (end - start) if end - start < math.inf else 0.0
    return Piece(start, end, lambda t: first + slope * (t - start), lambda t: slope)


def cycles(wave: Any, end: float, places: Sequence[float], make: Callable[[float, float, float], Piece]) -> list[Piece]:
    """Pieces between the given places of every cycle; make(start, end, middle of the piece in its cycle)."""
    shift = wave.phase / (2.0 * math.pi)
    first = math.floor(shift) - 1
    turns = [n + place for n in range(first, math.ceil(end * wave.frequency + shift) + 2) for place in places]
    times = [(turn - shift) / wave.frequency for turn in sorted(turns)]
    return [
        make(a, b, (0.5 * (a + b) * wave.frequency + shift) % 1.0)
        for a, b in itertools.pairwise(times)
        if b > a and b > 0.0
    ]


def command(wave: Any, end: float) -> Signal:
    """What a waveform asks for."""
    kind = wave.kind
    pieces: list[Piece] = []
    if kind == "constant":
        pieces = [line(0.0, math.inf, wave.level, wave.level)]
    elif kind == "sine":
        w = 2.0 * math.pi * wave.frequency

        def swing(a: float, b: float, middle: float) -> Piece:
            return Piece(
                a,
                b,
                lambda t: wave.offset + wave.amplitude * math.sin(w * t + wave.phase),
                lambda t: wave.amplitude * w * math.cos(w * t + wave.phase),
            )

        pieces = cycles(wave, end, [0.25, 0.75], swing)
    elif kind == "square":

        def level(a: float, b: float, middle: float) -> Piece:
            volts = wave.offset + (wave.amplitude if middle < wave.duty else -wave.amplitude)
            return line(a, b, volts, volts)

        pieces = cycles(wave, end, [0.0, wave.duty], level)
    elif kind == "ramped_square":
        # ramps of a width of duty / 2 cycles about the edges of the square
        half = 0.25 * wave.duty

        def part(a: float, b: float, middle: float) -> Piece:
            high, low = wave.offset + wave.amplitude, wave.offset - wave.amplitude
            if min(middle, 1.0 - middle) < half:
                return line(a, b, low, high)
            if abs(middle - 0.5) < half:
                return line(a, b, high, low)
            volts = high if middle < 0.5 else low
            return line(a, b, volts, volts)

        pieces = cycles(wave, end, [half, 0.5 - half, 0.5 + half, 1.0 - half], part)
    elif kind == "ramp":
        pieces = [line(0.0, wave.duration, wave.start, wave.stop), line(wave.duration, math.inf, wave.stop, wave.stop)]
    elif kind == "poling":
        pieces = [line(0.0, wave.hold, wave.level, wave.level)]
        if wave.fall > 0.0:
            pieces.append(line(wave.hold, wave.hold + wave.fall, wave.level, 0.0))
        pieces.append(line(wave.hold + wave.fall, math.inf, 0.0, 0.0))
    elif kind == "on_off":
        turn, times = sum(wave.durations), [0.0, *itertools.accumulate(wave.durations)]
        count = math.ceil(end / turn) + 1 if wave.repeat else 1
        edges = [n * turn + time for n in range(count) for time in times[:-1]]
        levels = list(wave.levels) * count
        pieces = [line(a, b, v, v) for a, b, v in zip(edges, [*edges[1:], math.inf], levels, strict=True)]
    elif kind == "swept_sine":
        pieces = chirp(wave)
    elif kind == "sampled":
        pieces = samples(wave)
    else:
        raise NotImplementedError(kind)
    return Signal(pieces, end)


def chirp(wave: Any) -> list[Piece]:
    rate = (wave.stop_frequency - wave.start_frequency) / wave.duration

    def value(t: float) -> float:
        return wave.offset + wave.amplitude * math.sin(2.0 * math.pi * (wave.start_frequency + 0.5 * rate * t) * t)

    def slope(t: float) -> float:
        phase = 2.0 * math.pi * (wave.start_frequency + 0.5 * rate * t) * t
        return wave.amplitude * 2.0 * math.pi * (wave.start_frequency + rate * t) * math.cos(phase)

    edges = np.linspace(0.0, wave.duration, 17).tolist()
    last = value(wave.duration)
    swings = [Piece(a, b, value, slope) for a, b in itertools.pairwise(edges)]
    return [*swings, line(wave.duration, math.inf, last, last)]


def samples(wave: Any) -> list[Piece]:
    times, levels = list(wave.times), list(wave.levels)
    if wave.interpolation.value == "cubic":
        spline = CubicSpline(times, levels, bc_type="natural")
        slope = spline.derivative()
        inner = [
            Piece(a, b, lambda t: float(spline(t)), lambda t: float(slope(t))) for a, b in itertools.pairwise(times)
        ]
    else:
        inner = [line(a, b, u, v) for a, b, u, v in zip(times, times[1:], levels, levels[1:], strict=False)]
    before = [line(0.0, times[0], levels[0], levels[0])] if times[0] > 0.0 else []
    return [*before, *inner, line(times[-1], math.inf, levels[-1], levels[-1])]


def amplified(signal: Signal, amplifier: Any, start: float, end: float) -> Signal:
    """Output of an amplifier: lag dV/dt = u - V, its rate within the slew rate, its value between the rails."""
    lag = 0.0
    if amplifier.bandwidth is not None:
        lag = 1.0 / (2.0 * math.pi * amplifier.bandwidth)
    elif amplifier.rise_time is not None:
        lag = amplifier.rise_time / math.log(9.0)
    slew = math.inf if amplifier.slew_rate is None else amplifier.slew_rate
    low, high = amplifier.clip or (-math.inf, math.inf)
    if lag == 0.0 and slew == math.inf and amplifier.clip is None:
        return signal
    out: list[Piece] = []
    volts = start = min(max(start, low), high)  # poled beyond what it can give
    for piece in signal.pieces:
        time, stop = max(piece.start, 0.0), min(piece.end, end)
        while time < stop:
            made = (
                with_lag(piece, time, stop, volts, lag, slew, low, high)
                if lag > 0.0
                else (without_lag(piece, time, stop, volts if out else start, slew, low, high))
            )
            out.append(made)
            time, volts = made.end, made.value(made.end)
    return Signal(out, end)


def first_zero(f: Function, start: float, stop: float) -> float:
    """First time after ``start`` at which f, negative before, becomes positive; ``stop`` if it does not."""
    times = start + (stop - start) * np.linspace(0.0, 1.0, LOOKS + 1) ** 2
    for a, b in itertools.pairwise(times):
        if f(a) <= 0.0 < f(b):
            return brentq(f, a, b, xtol=1e-300, rtol=1e-14)
    return stop if f(times[1]) <= 0.0 else start + (stop - start) * 1e-12


def with_lag(
    p: Piece, time: float, stop: float, volts: float, lag: float, slew: float, low: float, high: float
) -> Piece:
    """The stretch from ``time`` in which the amplifier stays at a rail, slews, or follows with its lag."""
    wants = p.value(time) - volts
    margin = 1e-12 * (abs(volts) + abs(p.value(time)) + 1e-3)
    for rail, side in ((high, 1.0), (low, -1.0)):
        if (
            side * (volts - rail) >= -margin
            and side * (p.value(time) - rail) >= 0.0
            and rising(p, time, stop, rail, side)
        ):
            return line(time, first_zero(lambda t: side * (rail - p.value(t)), time, stop), rail, rail)  # noqa: B023
    if abs(wants) > slew * lag * (1.0 + 1e-12):
        sense = math.copysign(1.0, wants)
        ramp = line(time, stop, volts, volts + sense * slew * (stop - time))
        ends = [first_zero(lambda t: slew * lag - sense * (p.value(t) - ramp.value(t)), time, stop)]
        rail = high if sense > 0.0 else low
        if math.isfinite(rail):
            ends.append(max(time + abs(rail - volts) / slew, time + 1e-15 * stop))
        return Piece(time, min(*ends, stop), ramp.value, ramp.slope)

    def rate(t: float, v: Any) -> Any:
        return (p.value(t) - v) / lag

    found = solve_ivp(
        rate, (time, stop), [volts], method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True, max_step=lag
    )
    assert found.sol is not None
    follow: Function = lambda t: float(found.sol(t)[0])  # noqa: E731
    ends = [stop]
    if slew < math.inf:
        ends.append(first_zero(lambda t: abs(p.value(t) - follow(t)) - slew * lag * (1.0 + 1e-11), time, stop))
    if math.isfinite(high):
        ends.append(first_zero(lambda t: follow(t) - high * (1.0 + 1e-13), time, stop))
    if math.isfinite(low):
        ends.append(first_zero(lambda t: low * (1.0 + 1e-13) - follow(t), time, stop))
    return Piece(time, min(ends), follow, lambda t: (p.value(t) - follow(t)) / lag)


def rising(p: Piece, time: float, stop: float, rail: float, side: float) -> bool:
    """Whether the command goes on beyond a rail that it has reached."""
    soon = time + 1e-9 * (stop - time)
    return side * (p.value(soon) - rail) >= 0.0


def without_lag(p: Piece, time: float, stop: float, volts: float, slew: float, low: float, high: float) -> Piece:
    """The same of an amplifier without a lag: it is at the command between the rails, or slews towards it."""

    def wanted(t: float) -> float:
        return min(max(p.value(t), low), high)

    off = wanted(time) - volts
    inside = low < p.value(time + 1e-9 * (stop - time)) < high
    steep = inside and abs(p.slope(time + 1e-9 * (stop - time))) > slew
    small = 1e-10 * (abs(volts) + abs(wanted(time)) + 1e-3)
    if steep and abs(off) <= small:
        off = p.slope(time + 1e-9 * (stop - time))
    if (steep or abs(off) > small) and slew < math.inf:
        sense = math.copysign(1.0, off)
        ramp = line(time, stop, volts, volts + sense * slew * (stop - time))
        end = first_zero(lambda t: sense * (ramp.value(t) - wanted(t)), time, stop)
        return Piece(time, end, ramp.value, ramp.slope)
    if not inside:
        rail = high if p.value(time + 1e-9 * (stop - time)) >= high else low
        back = first_zero(lambda t: (rail - p.value(t)) * (1.0 if rail == high else -1.0), time, stop)
        return line(time, back, rail, rail)
    ends = [
        stop,
        first_zero(lambda t: p.value(t) - high, time, stop),
        first_zero(lambda t: low - p.value(t), time, stop),
    ]
    if slew < math.inf:
        ends.append(first_zero(lambda t: abs(p.slope(t)) - slew * (1.0 + 1e-13), time, stop))
    return Piece(time, min(ends), p.value, p.slope)


def force(signal: Signal, law: Any, history: Sequence[float], end: float) -> Signal:
    """Force [N] of a drive: a line, a cubic for each sense of the voltage's last change, or a cubic with plays, each
    max(V - r, min(V + r, what it was))."""
    if law.kind == "linear":
        return Signal(
            [
                Piece(
                    p.start,
                    p.end,
                    lambda t, p=p: law.offset + law.gain * p.value(t),
                    lambda t, p=p: law.gain * p.slope(t),
                )
                for p in signal.pieces
            ],
            end,
        )
    if law.kind == "two_branch":
        return Signal(branches(signal, law, history, end), end)
    if law.kind == "creeping":
        return Signal(creeping(signal, law, history, end), end)
    assert law.kind == "prandtl_ishlinskii"
    widths, weights = np.array(law.thresholds), np.array(law.weights)
    plays = np.zeros(len(widths))
    out: list[Piece] = []
    for volts in history:
        plays = moved(plays, widths, volts)
    for p in monotone(signal, end):
        plays = moved(plays, widths, p.value(p.start))
        for a, b in engaging(p, plays, widths):
            out.append(on_plays(p, a, b, law, plays, widths, weights))
        plays = moved(plays, widths, p.value(p.end))
    return Signal(out, end)


def branches(signal: Signal, law: Any, history: Sequence[float], end: float) -> list[Piece]:
    """A drive is born at 0 V on the falling branch; a change by rounding is none."""
    out: list[Piece] = []
    volts, up = 0.0, False

    def change(to: float) -> None:
        nonlocal volts, up
        if abs(to - volts) > 1e-12 * (abs(to) + abs(volts)):
            up = to > volts
        volts = to

    for one in history:
        change(one)
    for p in monotone(signal, end):
        change(p.value(p.start))
        change(p.value(p.end))
        c = law.rising if up else law.falling

        def value(t: float, p: Piece = p, c: Any = c) -> float:
            v = p.value(t)
            return c.constant + v * (c.linear + v * (c.quadratic + v * c.cubic))

        def slope(t: float, p: Piece = p, c: Any = c) -> float:
            v = p.value(t)
            return p.slope(t) * (c.linear + v * (2.0 * c.quadratic + 3.0 * v * c.cubic))

        out.append(Piece(p.start, p.end, value, slope))
    return out


def creeping(signal: Signal, law: Any, history: Sequence[float], end: float) -> list[Piece]:
    """What follows at once, and lags of plays: z(t) = z(a) exp(-(t - a)/T) + the integral of exp(-(t - s)/T) play(s)/T
    from a on, by Gauss's quadrature, in parts that are short against every lag, and a polynomial through each."""
    now, own = law.instant, len(law.instant.thresholds)
    widths = np.array([*now.thresholds, *law.thresholds])
    weights, lags = np.array(law.weights), np.array(law.times)
    places, shares = np.polynomial.legendre.leggauss(20)
    plays, out = np.zeros(len(widths)), []
    for volts in history:
        plays = moved(plays, widths, volts)
    late = plays[own:].copy()
    gain = 1.0 + law.per_kelvin * (law.temperature - law.reference)

    def part(p: Piece, a: float, b: float, plays: np.ndarray, late: np.ndarray) -> tuple[Piece, np.ndarray]:
        def states(t: float) -> np.ndarray:
            times = a + 0.5 * (t - a) * (places + 1.0)
            follow = np.array([moved(plays, widths, p.value(s))[own:] for s in times])
            kernel = np.exp(-(t - times)[:, None] / lags) / lags
            return late * np.exp(-(t - a) / lags) + 0.5 * (t - a) * (shares @ (kernel * follow))

        nodes = np.cos(np.pi * np.arange(17) / 16.0)
        at_nodes = [float(states(t) @ weights) for t in a + 0.5 * (nodes + 1.0) * (b - a)]
        drawn = np.polynomial.Chebyshev.fit(nodes, at_nodes, 16)

        def value(t: float) -> float:
            v = p.value(t)
            free = now.constant + v * (now.linear + v * (now.quadratic + v * now.cubic))
            plain = float(np.array(now.weights) @ moved(plays, widths, v)[:own])
            return gain * (free + plain + float(drawn(2.0 * (t - a) / (b - a) - 1.0)))

        return Piece(a, b, value, lambda t: 0.0), states(b)

    for p in monotone(signal, end):
        plays = moved(plays, widths, p.value(p.start))
        for a, b in engaging(p, plays, widths):
            edges = np.linspace(a, b, 1 + math.ceil((b - a) / float(lags.min())))
            for c, d in itertools.pairwise(edges):
                piece, late = part(p, float(c), float(d), plays, late)
                out.append(piece)
        plays = moved(plays, widths, p.value(p.end))
    return out


def moved(plays: np.ndarray, widths: np.ndarray, volts: float) -> np.ndarray:
    return np.maximum(volts - widths, np.minimum(volts + widths, plays))


def on_plays(
    p: Piece, a: float, b: float, law: Any, plays: np.ndarray, widths: np.ndarray, weights: np.ndarray
) -> Piece:
    plays = plays.copy()

    def value(t: float) -> float:
        v = p.value(t)
        return (
            law.constant
            + v * (law.linear + v * (law.quadratic + v * law.cubic))
            + float(weights @ moved(plays, widths, v))
        )

    return Piece(a, b, value, lambda t: 0.0)


def monotone(signal: Signal, end: float) -> list[Piece]:
    """Pieces between the turns of a signal."""
    out = []
    for p in signal.pieces:
        a, b = max(p.start, 0.0), min(p.end, end)
        edges, times = [a], np.linspace(a, b, LOOKS + 1)
        slopes = [p.slope(t) for t in times]
        for i in range(LOOKS):
            if slopes[i] * slopes[i + 1] < 0.0:
                edges.append(brentq(p.slope, times[i], times[i + 1], xtol=1e-300, rtol=1e-14))
        edges.append(b)
        out += [Piece(x, y, p.value, p.slope) for x, y in itertools.pairwise(edges) if y > x]
    return out


def engaging(p: Piece, plays: np.ndarray, widths: np.ndarray) -> list[tuple[float, float]]:
    """The piece cut where plays begin to follow."""
    edges = [p.start, p.end]
    first, last = p.value(p.start), p.value(p.end)
    for play, width in zip(plays, widths, strict=True):
        for level in (play + width, play - width):
            if min(first, last) < level < max(first, last):
                edges.append(brentq(lambda t: p.value(t) - level, p.start, p.end, xtol=1e-300, rtol=1e-14))  # noqa: B023
    edges.sort()
    return [(a, b) for a, b in itertools.pairwise(edges) if b > a]
