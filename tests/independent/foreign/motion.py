"""The motion of the device: exponential Runge-Kutta steps of its complex poles between marks, events of the foot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.signal import lfilter

from independent.foreign.drive import CHARGE_GAP, Drive, Wave
from independent.foreign.structure import Modes, Phase, held, modes_of, resting
from independent.foreign.world import Device, World

Floats = NDArray[np.float64]
REACH = 150e-6
"""Largest use of the first mode's spring [m at the foot], to which a stiffening refers."""
REFERENCE_SPEED = 0.05
"""Impact speed [m/s] at which restitution is the device's where it falls with speed."""
REFERENCE_GAP = 20e-6
"""Gap [m] at which films of all exponents damp alike."""
_NEAR = 40.0
"""Reaches of the adhesion within which steps are finer."""
_FINER = 64
"""Parts of such a step."""


@dataclass(frozen=True)
class Moved:
    """x, v (2, nt): displacements from the rest [m] and velocities [m/s] of tip and centre, so many times as often as
    sampled (``fine``); events: time [s] and kind ("bounce", "capture", "release"); turns [s]: of a drive that jumps."""

    x: Floats
    v: Floats
    events: list[tuple[float, str]]
    fine: int = 1
    turns: tuple[float, ...] = ()

    @property
    def breaks(self) -> Floats:
        """Times [s] at which velocities jump or bend."""
        return np.array([*(time for time, _ in self.events), *self.turns])


class _Stepper:
    """Steps of one phase by the scheme of Cox and Matthews, exact in the poles.

    force: of the film on the foot from gap and rate; spring: cubic constant of the first coordinate [N/m^3].
    """

    def __init__(self, phase: Phase, modes: Modes, gap: float, law: Callable | None, spring: float) -> None:
        self.phase, self.law, self.spring = phase, law, spring
        row, n = modes.points[0], len(modes.omega)
        self.gap_out = (row @ phase.out[:n]).tolist()
        self.rate_out = (row @ phase.out[n : 2 * n]).tolist()
        self.first_out = phase.out[0].tolist()
        self.gap_still, self.first_still = gap + float(row @ phase.still[:n]), float(phase.still[0])
        self.by_foot = (phase.inputs @ row).tolist()
        self.by_drive = (phase.inputs @ modes.participation).tolist()
        self.by_first = phase.inputs[:, 0].tolist()
        self.drag = 0.0
        self.charge = 0.0  # of the attraction, times the square of the volts, in the step under way
        self.reach, self.sticky = 0.0, 0.0  # of the adhesion of a foot that has left [m], [N]
        self.constant = phase.constant.tolist()
        # net force of the structure on its foot, still and by the poles and the drive
        (springs, dampers), fast = modes.springs, modes.relaxing
        share = row / float(row @ row)
        self.pull_row = np.concatenate([-share * springs * (1.0 + fast), -share * dampers])
        if fast:
            self.pull_row = np.concatenate([self.pull_row, share * springs * fast])
        self.pull_out = (self.pull_row @ phase.out).tolist()
        self.pull_still, self.pull_drive = (float(self.pull_row @ phase.still), float(share @ modes.participation))
        self.pull_first = -float(share[0]) * spring
        self.tables: dict[float, tuple] = {}

    def gap(self, z: list[complex]) -> float:
        return self.gap_still + sum((a * b).real for a, b in zip(self.gap_out, z, strict=True))

    def rate(self, z: list[complex]) -> float:
        return sum((a * b).real for a, b in zip(self.rate_out, z, strict=True))

    def pull(self, z: list[complex], drive: float) -> float:
        """Net force of the structure on its foot, but for the foot's own acceleration."""
        pull = self.pull_still + self.pull_drive * drive
        for a, b in zip(self.pull_out, z, strict=True):
            pull += a.real * b.real - a.imag * b.imag
        if self.spring:
            pull += self.pull_first * self.first(z) ** 3
        return pull

    def first(self, z: list[complex]) -> float:
        return self.first_still + sum((a * b).real for a, b in zip(self.first_out, z, strict=True))

    def _table(self, h: float) -> tuple:
        if h not in self.tables:
            p = self.phase.poles * h
            # integrals by Cauchy's formula over a circle, which rounds nowhere
            circle = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
            at = p[:, None] + circle
            e = np.exp(at)
            f1 = np.mean((-4.0 - at + e * (4.0 - 3.0 * at + at**2)) / at**3, axis=1)
            f2 = np.mean((2.0 + at + e * (at - 2.0)) / at**3, axis=1)
            f3 = np.mean((-4.0 - 3.0 * at - at**2 + e * (4.0 - at)) / at**3, axis=1)
            half = 0.5 * p[:, None] + circle
            g = np.mean(np.expm1(half) / half, axis=1)
            tables = np.exp(p), np.exp(0.5 * p), 0.5 * h * g, h * f1, 2.0 * h * f2, h * f3
            self.tables[h] = tuple(zip(*(t.tolist() for t in tables), strict=True))
            if len(self.tables) > 4000:
                self.tables.clear()
                return self._table(h)
        return self.tables[h]

    def pushed(self, z: list[complex], drive: float) -> list[complex]:
        """What forces add to z'."""
        if self.law is None:
            film = 0.0
        else:
            gap, rate = self.gap_still, 0.0
            for a, b, x in zip(self.gap_out, self.rate_out, z, strict=True):
                gap += a.real * x.real - a.imag * x.imag
                rate += b.real * x.real - b.imag * x.imag
            film = self.law(gap, rate) - self.drag * rate * abs(rate) - self.charge / (gap + CHARGE_GAP) ** 2
            if self.reach:
                film -= self.sticky * (self.reach / (max(gap, 0.0) + self.reach)) ** 2
        if self.spring:
            cubic = -self.spring * self.first(z) ** 3
            return [
                c + a * film + b * drive + d * cubic
                for c, a, b, d in zip(self.constant, self.by_foot, self.by_drive, self.by_first, strict=True)
            ]
        return [c + a * film + b * drive for c, a, b in zip(self.constant, self.by_foot, self.by_drive, strict=True)]

    def step(self, z: list[complex], h: float, fa: float, fm: float, fb: float) -> list[complex]:
        """z a time h later, for the drive's force at the beginning, in the middle and at the end."""
        t = self._table(h)
        n0 = self.pushed(z, fa)
        a = [one[1] * x + one[2] * n for one, x, n in zip(t, z, n0, strict=True)]
        n1 = self.pushed(a, fm)
        b = [one[1] * x + one[2] * n for one, x, n in zip(t, z, n1, strict=True)]
        n2 = self.pushed(b, fm)
        c = [one[1] * x + one[2] * (2.0 * m - n) for one, x, m, n in zip(t, a, n2, n0, strict=True)]
        n3 = self.pushed(c, fb)
        return [
            one[0] * x + one[3] * p + one[4] * (q + r) + one[5] * s
            for one, x, p, q, r, s in zip(t, z, n0, n1, n2, n3, strict=True)
        ]


class Motion:
    """A device in its world, ready to be driven.

    Parameters
    ----------
    device, world
        What it is.
    steps
        Of a sample.
    """

    def __init__(self, device: Device, world: World, steps: int = 2) -> None:
        self.device, self.world, self.steps = device, world, steps
        self.modes = modes_of(device, world)
        self.left: Floats | None = None
        self.random = np.random.default_rng(57)
        stiffness = self.modes.mass * self.modes.omega[0] ** 2
        reach = REACH / float(self.modes.points[0, 0])
        self.spring = world.stiffening * stiffness / reach**2

    def law(self) -> Callable[[float, float], float]:
        """Force of the film from gap and rate."""
        coefficient, thickness = self.device.film
        power = self.world.exponent
        coefficient = coefficient * (REFERENCE_GAP + thickness) ** (power - 3)
        if self.world.uneven:
            thin, thick = thickness * (1.0 - self.world.uneven), thickness * (1.0 + self.world.uneven)
            return lambda g, v: -0.5 * coefficient * v * ((g + thin) ** -3 + (g + thick) ** -3)
        if self.world.slip:  # of a wide plate, Burgdorf 1959
            free = 6.0 * self.world.slip
            return lambda g, v: -coefficient * v / ((g + thickness) ** 2 * (g + thickness + free))
        if power == 3:
            return lambda g, v: -coefficient * v / (g + thickness) ** 3
        return lambda g, v: -coefficient * v / (g + thickness) ** power

    def drive(self, wave: Wave, end: float) -> Drive:
        """The drive under a voltage, from where the last one left its plays if it is not poled in between."""
        out = Drive(self.device, self.world, wave, end, self.left)
        if self.world.unpoled:
            self.left = out.states[-1]
        return out

    def rest(self, drive: Drive) -> Floats:
        """Coordinates at rest in the air."""
        stiffness = self.modes.springs[0]
        q = self.modes.participation * drive.at_rest / stiffness
        for _ in range(60):
            q[0] = (self.modes.participation[0] * drive.at_rest - self.spring * q[0] ** 3) / stiffness[0]
        return q

    def swept(self, wave: Wave, rate: float, duration: float) -> Moved:
        """Motion in the air, far from any ground, sampled [Hz] and between: all at once, for there are no events."""
        fine = 8
        count = int(np.floor(duration * rate * (1.0 + 1e-12)))
        marks = np.arange(count * fine + 1) / (rate * fine)
        end = float(marks[-1])
        drive = self.drive(wave, end)
        stretch = np.clip(np.searchsorted(drive.turns, marks, side="right") - 1, 0, len(drive.turns) - 2)
        force = drive.force(marks, stretch)
        if self.world.held:  # a step between two marks of a parabola counts from the middle
            before = np.clip(np.searchsorted(drive.turns, marks, side="left") - 1, 0, len(drive.turns) - 2)
            force = 0.5 * (force + drive.force(marks, before, True))
        if drive.followers:
            force = np.array(drive.along(marks)[0])
            force = np.append(force, force[-1])
        phase, n = Phase(self.modes), len(self.modes.omega)
        rest = self.rest(drive)
        still = resting(self.modes, rest)
        start = phase.enter @ (still - phase.still)
        state = np.zeros((len(still), len(marks)))
        state[:n] = rest[:, None]
        for _ in range(4 if self.spring else 1):
            push = np.outer(phase.inputs @ self.modes.participation, force)
            push = push - np.outer(phase.inputs[:, 0], self.spring * state[0] ** 3)
            state = phase.state(
                np.array([filtered(*one, fine, rate) for one in zip(phase.poles, push, start, strict=True)])
            )
        state = state[:, : count * fine]
        seen = self.modes.seen
        return Moved(seen @ (state[:n] - rest[:, None]), seen @ state[n : 2 * n], [], fine)

    def driven(self, wave: Wave, rate: float, duration: float, gap: float) -> Moved:
        """Motion above a ground at a gap [m] from the neutral position, sampled [Hz], and its steps between."""
        count = int(np.floor(duration * rate * (1.0 + 1e-12)))
        drive = self.drive(wave, duration)
        samples = np.arange(count * self.steps + 1) / (rate * self.steps)
        extra = np.concatenate([drive.turns, drive.kinks()])
        far = np.abs(extra - np.round(extra * rate * self.steps) / (rate * self.steps)) > 1e-11
        marks = np.unique(np.concatenate([samples, extra[far & (extra < samples[-1])]]))
        sampled = np.searchsorted(marks, samples[:-1] - 1e-12)
        run = _Run(self, drive, marks, gap)
        states = run.whole()[:, sampled]
        n = len(self.modes.omega)
        rest = run.rest
        return Moved(
            self.modes.seen @ (states[:n] - rest[:, None]),
            self.modes.seen @ states[n : 2 * n],
            run.events,
            self.steps,
            tuple(drive.turns.tolist()),
        )


def filtered(
    pole: complex, push: NDArray[np.complex128], start: complex, fine: int, rate: float
) -> NDArray[np.complex128]:
    """z along marks, for what pushes it as a parabola through three marks."""
    h = 1.0 / (rate * fine)
    p = pole * h
    circle = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
    at = p + circle
    e = np.exp(at)
    i0, i1, i2 = (
        np.mean(f) for f in ((e - 1.0) / at, (e - 1.0 - at) / at**2, (2.0 * e - 2.0 - 2.0 * at - at**2) / at**3)
    )
    ahead = np.append(push[2:], push[-1])
    now, then = push[:-1], push[1:]
    slope, bend = then - now, 0.5 * (ahead - 2.0 * then + now)
    # push(s) = now + slope s + bend s (s - 1) over a step of length one
    added = h * (now * i0 + (slope - bend) * i1 + bend * i2)
    z = lfilter([1.0], [1.0, -np.exp(p)], np.concatenate([[start], added]))
    return np.asarray(z)


class _Run:
    """One record in the making."""

    def __init__(self, motion: Motion, drive: Drive, marks: Floats, gap: float) -> None:
        self.motion, self.marks = motion, marks
        modes, world = motion.modes, motion.world
        self.modes, self.world, self.device = modes, world, motion.device
        self.drive = drive.along(marks)
        self.rest = motion.rest(drive)
        self.events: list[tuple[float, str]] = []
        film = motion.law()
        rigid = np.isinf(world.ground)
        self.free = _Stepper(Phase(modes), modes, gap, film, motion.spring)
        self.tied = _Stepper(held(modes, gap, world.ground), modes, gap, None if rigid else film, motion.spring)
        row = modes.points[0]
        self.row, self.mobility = row, float(row @ row) / modes.mass
        self.since = 0.0
        self.free.drag = world.drag
        self.free.reach, self.free.sticky = world.reach, self.device.adhesion[0]
        volts = drive.wave.volts(0.5 * (marks[:-1] + marks[1:]))
        self.charge = (world.charge * volts**2).tolist()
        self.luck = 1.0

    def pull(self, z: list[complex], drive: float) -> float:
        """Net force on the adhesion of a foot in contact."""
        if np.isinf(self.world.ground):
            return self.tied.pull(z, drive) - self.free.charge / CHARGE_GAP**2
        return self.world.ground * self.tied.gap(z)  # a damper that held the foot would let go of it below ground

    def strength(self, age: float) -> float:
        first, rate = self.device.adhesion
        if np.isinf(self.world.ageing):
            return self.luck * (first + rate * age)
        return first - rate * self.world.ageing * np.expm1(-age / self.world.ageing)

    def restitution(self, speed: float) -> float:
        if not self.world.fading:
            return self.device.restitution
        return min(0.95, self.device.restitution * (speed / REFERENCE_SPEED) ** -self.world.fading)

    def whole(self) -> Floats:
        """States (2n, number of marks)."""
        still = resting(self.modes, self.rest)
        out = np.zeros((len(still), len(self.marks)))
        out[:, 0] = still
        phase, z = self.free, self.free.phase.begin(out[:, 0])
        first, middle, last = (one.tolist() for one in self.drive)
        marks = self.marks.tolist()
        stretches: list[tuple[_Stepper, int, list]] = [(phase, 1, [])]
        for k in range(len(marks) - 1):
            begin, end = marks[k], marks[k + 1]
            forces = first[k], middle[k], last[k]
            self.free.charge = self.charge[k]
            if self.world.reach and phase is self.free and phase.gap(z) < _NEAR * self.world.reach:
                phase, z = self._finely(phase, z, begin, end, forces)
                if phase is not stretches[-1][0]:
                    stretches.append((phase, k + 1, []))
                stretches[-1][2].append(z)
                continue
            after = phase.step(z, round(end - begin, 15), *forces)
            if self._quiet(phase, after, end, forces[2]):
                z = after
            else:
                phase, z = self._events(phase, z, begin, end, forces)
                if phase is not stretches[-1][0]:
                    stretches.append((phase, k + 1, []))
            stretches[-1][2].append(z)
        for one, start, states in stretches:
            if states:
                out[:, start : start + len(states)] = one.phase.state(np.array(states).T)
        return out

    def _finely(
        self, phase: _Stepper, z: list[complex], begin: float, end: float, forces: tuple[float, float, float]
    ) -> tuple[_Stepper, list[complex]]:
        """A step in `_FINER` parts, each with what happens in it."""
        fa, fm, fb = forces

        def drive(x: float) -> float:
            return fa + x * (4.0 * fm - 3.0 * fa - fb) + 2.0 * x * x * (fa + fb - 2.0 * fm)

        step = (end - begin) / _FINER
        for k in range(_FINER):
            own = tuple(drive((k + part) / _FINER) for part in (0.0, 0.5, 1.0))
            phase, z = self._events(phase, z, begin + k * step, begin + (k + 1) * step, own)
        return phase, z

    def _quiet(self, phase: _Stepper, z: list[complex], time: float, drive: float) -> bool:
        """Whether nothing happens up to there."""
        if phase is self.free:
            return phase.gap(z) > 0.0
        return self.pull(z, drive) <= self.strength(time - self.since)

    def _events(
        self, phase: _Stepper, z: list[complex], begin: float, end: float, forces: tuple[float, float, float]
    ) -> tuple[_Stepper, list[complex]]:
        """A step with events in it."""
        whole, time = end - begin, begin

        def drive(at: float) -> float:
            x = (at - begin) / whole
            fa, fm, fb = forces
            return fa + x * (4.0 * fm - 3.0 * fa - fb) + 2.0 * x * x * (fa + fb - 2.0 * fm)

        for _ in range(1000):
            stepper, start, past = phase, z, time

            def moved(
                h: float, stepper: _Stepper = stepper, start: list[complex] = start, past: float = past
            ) -> list[complex]:
                return stepper.step(start, h, drive(past), drive(past + 0.5 * h), drive(past + h)) if h > 0.0 else start

            def margin(h: float, stepper: _Stepper = stepper, moved: Callable = moved, past: float = past) -> float:
                after = moved(h)
                if stepper is self.free:
                    return stepper.gap(after)
                return self.strength(past + h - self.since) - self.pull(after, drive(past + h))

            left = end - time
            if left <= 0.0 or margin(left) > 0.0:
                return phase, moved(left) if left > 0.0 else z
            low = left
            while margin(low) <= 0.0 and low > 1e-9 * whole:
                low *= 0.5
            h = brentq(margin, low, left, xtol=1e-14, rtol=1e-14) if low > 1e-9 * whole else 0.0
            z, time = moved(h), time + h
            phase, z = self._happens(phase, z, time, drive(time))
        raise RuntimeError("a step has more than a thousand events")

    def _happens(self, phase: _Stepper, z: list[complex], time: float, drive: float) -> tuple[_Stepper, list[complex]]:
        state, n = phase.phase.state(z), len(self.modes.omega)
        if phase is self.tied:
            self.events.append((time, "release"))
            return self.free, self.free.phase.begin(state)
        speed = -float(self.row @ state[n : 2 * n])
        stopped = state.copy()
        stopped[n : 2 * n] += self.row / self.modes.mass / self.mobility * speed
        self.luck = 1.0 + self.world.scatter * float(self.motion.random.standard_normal())
        e = min(0.95, self.restitution(speed) * self.luck)
        # as a rigid ground feels it; the rule of the landing is the same on a soft one
        pull = self.free.pull(self.free.phase.begin(stopped), drive) - self.free.charge / CHARGE_GAP**2
        if pull <= self.strength(0.0) and (not self.world.slow or e * speed <= self.world.slow):
            self.events.append((time, "capture"))
            self.since = time
            return self.tied, self.tied.phase.begin(stopped)
        self.events.append((time, "bounce"))
        stopped[n : 2 * n] += self.row / self.modes.mass / self.mobility * e * speed
        return self.free, self.free.phase.begin(stopped)
