"""Voltages, and the force of a drive with plays, at given times."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from independent.foreign.world import Device, World

Floats = NDArray[np.float64]
CREEP_S = 0.3
"""Time after which the late share of a creeping drive has followed."""
CHARGE_GAP = 20e-6
"""Gap [m] of an attraction by the volts while the foot stands on the ground."""
DECADES = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Times [s] in which equal shares of a drive that creeps in all decades follow; the first two are in its law."""
FULL_POWER = 100.0 * 8.0**2
"""Frequency times square of the volts at which an amplifier that sags has lost its stated share."""
_FAST = 2
_POINTS = 2_000_000
"""Places at which the voltage behind an amplifier of one pole is formed: 0.5 us apart at most."""


@dataclass(frozen=True)
class Wave:
    """A voltage: turns [s]: where it may turn, jump or bend; jumps: whether it jumps at the turns; monotone between
    them; amplitude [V], hz, duty and the like in ``parameters``, as the campaign file has them."""

    kind: str
    parameters: dict[str, float | list[float]]
    offset: float = 0.0

    def volts(self, time: Floats, before: bool = False) -> Floats:
        """Voltages [V] at times [s]; ``before``: the limit from the left at a jump."""
        return self._volts(time, before) + self.offset

    def _volts(self, time: Floats, before: bool) -> Floats:
        p = self.parameters
        t = np.asarray(time, dtype=float)
        if self.kind == "sampled":
            return np.interp(t, p["times"], p["levels"])
        if self.kind == "held":
            side = -1e-10 if before else 1e-10
            return p["levels"][np.clip(np.floor((t + side) * p["rate"]).astype(int), 0, len(p["levels"]) - 1)]
        if self.kind == "swept_sine":
            t = np.minimum(t, p["duration"])
            rate = (p["stop_frequency"] - p["start_frequency"]) / p["duration"]
            return p["amplitude"] * np.sin(2.0 * np.pi * ((p["start_frequency"] + 0.5 * rate * t) * t))
        turns = t * p["frequency"]
        if self.kind == "sine":
            return p["amplitude"] * np.sin(2.0 * np.pi * turns)
        near = -1e-9 if before else 1e-9  # of a cycle: which side of a jump a time that rounds to it belongs to
        place = np.remainder(turns + near, 1.0)
        if self.kind == "square":
            return p["amplitude"] * np.where(place < 0.5, 1.0, -1.0)
        half = 0.25 * p["duty"]
        return p["amplitude"] * np.interp(
            place, [0.0, half, 0.5 - half, 0.5 + half, 1.0 - half, 1.0], [0.0, 1.0, 1.0, -1.0, -1.0, 0.0]
        )

    def slewed(self, most: float, end: float) -> Wave:
        """The same behind an amplifier that slews so fast [V/s] at most: of squares, the others being slower."""
        if np.isinf(most) or self.kind != "square":
            return self
        p, turns = self.parameters, self.turns(end)
        times, levels, at = [0.0], [0.0], 0.0
        for begin in turns[:-1].tolist():
            to = p["amplitude"] * (1.0 if np.remainder(begin * p["frequency"] + 1e-9, 1.0) < 0.5 else -1.0)
            times += [begin, begin + abs(to - at) / most]
            levels += [at, to]
            at = to
        return Wave("sampled", dict(times=times[1:], levels=levels[1:]))

    def sagged(self, share: float) -> Wave:
        """The same behind an amplifier whose gain falls with the power that it gives, but for slow signals."""
        p = self.parameters
        if not share or self.kind == "sampled":
            return self
        hertz = p.get("frequency") or 0.5 * (p["start_frequency"] + p["stop_frequency"])
        power = hertz * p["amplitude"] ** 2 / FULL_POWER
        return replace(self, parameters={**p, "amplitude": p["amplitude"] * (1.0 - share * power)})

    def amplified(self, world: World, end: float) -> Wave:
        """What the drive gets of it: in samples that are held, behind an amplifier of one pole, off its zero."""
        wave = self.sagged(world.sag).slewed(world.slew, end)
        if world.held:
            ticks = np.arange(int(np.ceil(end * world.held)) + 1) / world.held
            wave = Wave("held", dict(rate=world.held, levels=wave.volts(ticks), times=ticks))
        if world.pole:
            wave = wave._behind(1.0 / (2.0 * np.pi * world.pole), end)
        return replace(wave, offset=world.offset)

    def _behind(self, lag: float, end: float) -> Wave:
        """Behind one pole: straight between many places, over each of which what goes in is straight as well."""
        time = np.linspace(0.0, end, _POINTS)
        step = time[1] / lag
        goes, came = self.volts(time[:-1]), self.volts(time[1:], before=True)
        rest = -np.expm1(-step)
        added = goes * rest + (came - goes) * (1.0 - rest / step)
        levels = np.concatenate([[0.0], lfilter([1.0], [1.0, rest - 1.0], added)])
        back = time[1:-1][np.diff(np.sign(np.diff(levels))) != 0.0]
        return Wave("sampled", dict(times=time, levels=levels, turns=np.append(back, self.turns(end))))

    def turns(self, end: float) -> Floats:
        """Times [s] from 0 to the end between which the voltage is smooth and monotone."""
        p = self.parameters
        if "turns" in p:
            inside = np.asarray(p["turns"])
        elif self.kind in ("sampled", "held"):
            inside = np.asarray(p["times"])
        elif self.kind == "swept_sine":
            rate = (p["stop_frequency"] - p["start_frequency"]) / p["duration"]
            last = 0.5 * (p["start_frequency"] + p["stop_frequency"]) * p["duration"]
            quarter = 0.25 + 0.5 * np.arange(int(2.0 * last) + 1)
            first = p["start_frequency"]
            inside = (np.sqrt(first**2 + 2.0 * rate * quarter) - first) / rate
            inside = np.append(inside[np.isfinite(inside)], p["duration"])
        else:
            half = 0.25 * p.get("duty", 1.0)
            places = {"sine": (0.25, 0.75), "square": (0.0, 0.5)}.get(
                self.kind, (half, 0.5 - half, 0.5 + half, 1.0 - half)
            )
            whole = np.arange(int(end * p["frequency"]) + 1)
            inside = (whole[:, None] + np.array(places)).ravel() / p["frequency"]
        inside = np.unique(inside[(inside > 1e-12) & (inside < end - 1e-12)])
        return np.concatenate([[0.0], inside, [end]])


class Drive:
    """The force of a device's drive under a voltage."""

    def __init__(self, device: Device, world: World, wave: Wave, end: float, left: Floats | None = None) -> None:
        wave = wave.amplified(world, end)
        self.device, self.wave = device, wave
        self.r = np.array(world.thresholds or device.thresholds)
        self.w = np.array(device.weights)
        self.followers = [(CREEP_S, world.creep)] if world.creep else []
        self.followers += [(late, world.creeping) for late in DECADES] if world.creeping else []
        self.instant = 1.0 - _FAST * world.creeping
        self.lagging = world.lagging
        if world.lagging:
            self.followers.append((world.lagging, 1.0))
        state = np.zeros(len(self.r))
        for level in device.history if left is None else ():
            state = _played(state, level, self.r)
        state = _played(state if left is None else left, wave.offset, self.r)
        self.turns = wave.turns(end)
        self.states = [state]  # at rest, then at the start and the end of every stretch
        for first, last in zip(self.turns[:-1], self.turns[1:], strict=True):
            start = _played(self.states[-1], float(wave.volts(first)), self.r)
            self.states += [start, _played(start, float(wave.volts(last, before=True)), self.r)]

    @property
    def at_rest(self) -> float:
        """Force [N] before the voltage begins."""
        rest = float(self._whole(np.full(1, self.wave.offset), self.states[0][None])[0])
        if self.lagging:
            return rest
        return rest * (self.instant + sum(share for _, share in self.followers))

    def _whole(self, volts: Floats, state: Floats) -> Floats:
        a, b, c, d = self.device.law
        return ((d * volts + c) * volts + b) * volts + a + state @ self.w

    def force(self, time: Floats, stretch: NDArray[np.intp], before: bool = False) -> Floats:
        """Force [N] without creep at times [s], each of a stretch between turns."""
        volts, state = self._engaged(time, stretch, before)
        return self._whole(volts, state)

    def _engaged(self, time: Floats, stretch: NDArray[np.intp], before: bool) -> tuple[Floats, Floats]:
        """Volts (nt,), and plays (nt, np), at times [s]."""
        volts = self.wave.volts(time, before)
        return volts, _played(np.array(self.states[1::2])[stretch], volts[:, None], self.r)

    def kinks(self) -> Floats:
        """Times [s] at which plays engage between turns."""
        out = []
        for k, (first, last) in enumerate(zip(self.turns[:-1], self.turns[1:], strict=True)):
            state = self.states[2 * k + 1]
            a, b = (float(self.wave.volts(t, side)) for t, side in ((first, False), (last, True)))
            if a == b:
                continue
            levels = state + np.sign(b - a) * self.r
            inside = (levels - a) * (levels - b) < 0.0
            for level in levels[inside & (self.w != 0.0)]:
                out.append(self._when(k, level))
        return np.array(out)

    def _when(self, stretch: int, level: float) -> float:
        from scipy.optimize import brentq

        ends = self.turns[stretch], self.turns[stretch + 1]
        inner = 1e-12 * (ends[1] - ends[0])
        return float(
            brentq(
                lambda t: float(self.wave.volts(t)) - level, ends[0] + inner, ends[1] - inner, xtol=1e-16, rtol=1e-14
            )
        )

    def along(self, marks: Floats) -> tuple[Floats, Floats, Floats]:
        """Forces [N] at the beginning, middle and end of steps between marks [s], no step across a turn."""
        first, last = marks[:-1], marks[1:]
        middle = 0.5 * (first + last)
        stretch = np.clip(np.searchsorted(self.turns, middle) - 1, 0, len(self.turns) - 2)
        fa, fm, fb = self.force(first, stretch), self.force(middle, stretch), self.force(last, stretch, True)
        if not self.followers:
            return fa, fm, fb
        direct, late = np.array([fa, fm, fb]), np.array([fa, fm, fb])
        if self.lagging:  # the plays alone follow, and nothing of them is at once
            times = (first, False), (middle, False), (last, True)
            late = np.array([self._engaged(at, stretch, side)[1] @ self.w for at, side in times])
            direct, rest = direct - late, float(self.states[0] @ self.w)
        else:
            rest = self.at_rest / (self.instant + sum(share for _, share in self.followers))
        out = self.instant * direct
        for lag, share in self.followers:
            out = out + share * _followed(late, last - first, lag, rest)
        return out[0], out[1], out[2]


def _followed(force: Floats, step: Floats, lag: float, rest: float) -> Floats:
    """What follows a force, given at beginning, middle and end of steps [s] (3, ns), behind one pole from a rest."""
    share, half = -np.expm1(-step / lag), -np.expm1(-0.5 * step / lag)
    mean = (force[0] + 4.0 * force[1] + force[2]) / 6.0
    late = [rest]
    for part, to in zip(share.tolist(), mean.tolist(), strict=True):
        late.append(late[-1] + part * (to - late[-1]))
    begin, end = np.array(late[:-1]), np.array(late[1:])
    return np.array([begin, begin + half * (0.5 * (force[0] + force[1]) - begin), end])


def _played(state: Floats, volts: Floats | float, r: Floats) -> Floats:
    """Plays after a monotone move to a voltage."""
    return np.minimum(np.maximum(state, volts - r), volts + r)
