"""Where to begin: switching times that bring a structure to rest on the ground, were there nothing but the structure.

A foot that touches down without speed is let go again if the structure behind it is not at rest. A step has to end
not only with the gap closed but with every mode where the held foot keeps it, and all velocities zero: 2 n conditions
on a structure of n modes, which the durations of the plateaus and the time of arrival have to meet. Rest-to-rest
transfers of linear systems by switching (Singer and Seering, J. Dyn. Syst. Meas. Control 112, 1990, and many since) are
found here by least squares from an even spread, a thousand side by side; films are met by correcting the aim, adhesion
and impacts are left to the search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.spec import with_values
from tarsus.design.over import even_points
from tarsus.design.pulses import Family, OwnStep, Step
from tarsus.design.trials import Trials
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene
from tarsus.plan.lowering import lower_system

__all__ = ["Transfer", "transfers"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

SPREAD, ROUNDS = 10, 14
"""Transfers begun for every family, as a power of two, and steps of least squares; the nearest quarter goes on for
twice as many."""
CORRECTIONS = 2
"""Times that a run of the scene corrects where transfers are aimed at; a third time finds hardly anything."""
GENTLE = 0.02
"""Speed with which they are to touch down, in parts of that of the plain step: at none at all they would graze."""
KEPT = 12
"""Of every family's, those that are best: others are no better than the scan's own points."""
LEVELS = 17
"""Voltages at which the drive's force is asked for; between them it is taken for a line."""
BESIDE = 1e-6
"""Step of the differences of states by unknowns of size 1."""
SEEN = 8
"""Times in a plateau at which the gap is looked at."""
REST = 1e-6
"""Share of the energy between the two held states that is next to none: a thousandth of the motion."""
APART = 0.01
"""Transfers nearer than this to a better one in all unknowns are the same."""
WORST_MODES = 1e8
"""Condition of the modes' shapes beyond which they do not tell the motion: a structure on the verge of damping."""


@dataclass(frozen=True)
class Transfer:
    """A structure of n coordinates between voltages, feet off the ground.

    rates (2n,) [1/s], shapes (2n, 2n), inverse: of its motions, and the shapes' inverse; volts (nv,) [V] and rest (nv,
    2n): where it rests on them; held (2n,): at rest, the foot on the ground under the support level; landed (2n,): the
    moment before a gentle touchdown that ends there; size (2n, 2n): square root of the energy of a deviation, E = |size
    e|^2 [J]; gap [m], normal (2n,): of the foot at the state 0, and by the state.
    """

    rates: Complex
    shapes: Complex
    inverse: Complex
    volts: Floats
    rest: Floats
    held: Floats
    landed: Floats
    size: Floats
    gap: float
    normal: Floats

    @classmethod
    def of(cls, scene: Scene, drive: str, foot: str, step: Step, speed: float) -> Transfer | None:
        """Of a foot's step that is to strike at a speed [m/s]; None for a structure that does not rest by itself, or
        whose motions are no modes."""
        system = lower_system(scene)
        n = len(system.mass)
        if np.linalg.matrix_rank(system.stiffness) < n:
            return None
        flow = np.zeros((2 * n, 2 * n))
        flow[:n, n:] = np.eye(n)
        flow[n:] = -np.linalg.solve(system.mass, np.concatenate([system.stiffness, system.damping], axis=1))
        rates, shapes = np.linalg.eig(flow)
        if not np.linalg.cond(shapes) < WORST_MODES:
            return None
        volts = np.linspace(step.levels.low, step.levels.high, LEVELS)
        loads = np.array([_loads(scene, drive, step.lift, float(one)) for one in volts])
        forces = loads @ system.loads.T + system.constant
        rest = np.zeros((LEVELS, 2 * n))
        rest[:, :n] = np.linalg.solve(system.stiffness, forces.T).T
        number = list(scene.robot.feet).index(foot)
        normal = system.normals[:, number]
        per_force = np.linalg.solve(system.stiffness, normal)
        free = rest[np.argmin(np.abs(volts - step.support))]
        held = free.copy()
        gap = system.rest_gap[number] + normal @ free[:n]
        held[:n] -= per_force * gap / (normal @ per_force)
        blow, landed = system.per_impulse[:, number], held.copy()
        landed[n:] = -speed * blow / (normal @ blow)
        size = np.zeros((2 * n, 2 * n))
        size[:n, :n] = np.linalg.cholesky(0.5 * system.stiffness).T
        size[n:, n:] = np.linalg.cholesky(0.5 * system.mass).T
        return cls(
            rates, shapes, np.linalg.inv(shapes).astype(complex), volts, rest, held, landed, size,
            float(system.rest_gap[number]), np.append(normal, np.zeros(n)),
        )  # fmt: skip

    def resting(self, volts: Floats) -> Floats:
        """Where it rests (n, 2n) under voltages (n,)."""
        return np.stack([np.interp(volts, self.volts, column) for column in self.rest.T], axis=1)

    def ends(self, start: Floats, levels: Floats, spans: Floats) -> Floats:
        """States (n, 2n) at the end of plateaus, levels [V] (k,) and spans [s] (n, k), from states (n, 2n) or one (2n,)
        on."""
        state = np.broadcast_to(start, (len(spans), len(self.held)))
        for volts, span in zip(levels, spans.T, strict=True):
            rest = np.array([np.interp(volts, self.volts, column) for column in self.rest.T])
            modes = (state - rest) @ self.inverse.T * np.exp(self.rates * span[:, None])
            state = rest + (modes @ self.shapes.T).real
        return state

    def clear(self, start: Floats, levels: Floats, spans: Floats) -> NDArray[np.bool_]:
        """Whether (n,) the foot stays off the ground in all but the first of these plateaus, the very end aside."""
        state = self.ends(start, levels[:1], spans[:, :1])
        found = np.ones(len(spans), dtype=bool)
        for volts, span in zip(levels[1:], spans.T[1:], strict=True):
            for part in np.arange(1, SEEN) / SEEN:
                there = self.ends(state, np.array([volts]), part * span[:, None])
                found &= self.gap + there @ self.normal > 0.0
            state = self.ends(state, np.array([volts]), span[:, None])
        return found


def _loads(scene: Scene, drive: str, lift: float, level: float) -> Floats:
    """Forces (nd,) of all drives, the designed one's under a level [V] that it comes to from the lift level."""
    own = OnOff(levels=(lift, level), durations=(1.0, 1.0), repeat=True)
    signals = with_values(scene, {"signals": {**scene.signals, drive: own}}).actuator_volts
    return np.array(
        [
            float(evaluate(lower(signals[name], one.law, one.history)[0], 3.5))
            for name, one in scene.robot.drives.items()
        ]
    )


def transfers(
    transfer: Transfer, step: Step, choices: Sequence[Family], trials: Trials, rng: np.random.Generator
) -> tuple[NDArray[np.int64], Floats]:
    """Points (n, nu) of families, by number (n,), whose landing plateaus leave the structure least energy on the
    ground; release plateaus are as short as can be. Levels that are free alternate between the two held ones."""
    numbers, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, step.unknowns(choices[0].plateaus // 2)))]
    for number, family in enumerate(choices if not isinstance(step, OwnStep) else ()):
        (a, b), m = family.sizes, family.plateaus
        if a == 0:
            continue
        landing = family.landing or (step.support, step.lift) * (a // 2) + (step.support,) * (a % 2)
        release = family.release or (step.lift, step.support) * (b // 2) + (step.lift,) * (b % 2)
        share = (np.array([*landing, *release]) - step.levels.low) / (step.levels.high - step.levels.low)

        def placed(x: Floats, m: int = m, share: Floats = share) -> Floats:
            return np.column_stack([x[:, :m], np.tile(share, (len(x), 1))]) if step.levels.free else x[:, :m]

        aim = _Aim(transfer, step, landing, release)
        x = aim.solved(even_points(m + 1, 2**SPREAD, rng), ROUNDS)
        nearest = np.argsort((aim.left(x) ** 2).sum(axis=1), kind="stable")[: len(x) // 4]
        x = aim.best(aim.solved(x[nearest], 2 * ROUNDS))
        for _ in range(CORRECTIONS):
            aim.correct(trials, step.place(choices, np.full(len(x), number), placed(x)), x)
            x = aim.solved(x, ROUNDS)
        numbers.append(np.full(len(x), number))
        points.append(placed(x))
    return np.concatenate(numbers), np.concatenate(points)


class _Aim:
    """Transfers from the ground, over levels [V] at the release and the landing edge, to the ground. Unknowns (n, k)
    are the spans of the landing plateaus, of those of the release and of the time to the arrival, as square roots of
    shares of the longest; aims (n, 2n) are where they are to end."""

    def __init__(
        self, transfer: Transfer, step: Step, landing: Sequence[float], release: Sequence[float]
    ) -> None:
        self.transfer, self.step, self.sizes = transfer, step, (len(landing), len(release))
        self.volts = np.array([*release, step.lift, *landing, step.support])
        self.aims = transfer.landed[None]
        lift = np.array([np.interp(step.lift, transfer.volts, column) for column in transfer.rest.T])
        self.stored = float((((lift - transfer.held) @ transfer.size.T) ** 2).sum())

    def spans(self, x: Floats) -> Floats:
        """Spans (n, k) [s] of unknowns."""
        return self.step.shortest + x**2 * (self.step.longest - self.step.shortest)

    def every(self, spans: Floats) -> tuple[Floats, Floats]:
        """Spans (n, k') up to the lift level's end, and of all plateaus from then on."""
        a, b = self.sizes
        release = spans[:, a : a + b]
        lifted = np.maximum(self.step.period - self.step.supported - release.sum(axis=1), 0.0)
        return np.column_stack([release, lifted]), np.column_stack([spans[:, :a], spans[:, -1]])

    def ends(self, spans: Floats) -> Floats:
        """States (n, 2n) at the arrival."""
        return self.transfer.ends(self.transfer.held, self.volts, np.column_stack(self.every(spans)))

    def left(self, x: Floats) -> Floats:
        """Square roots of the energy (n, 2n) that is left."""
        return (self.ends(self.spans(x)) - self.aims) @ self.transfer.size.T

    def solved(self, x: Floats, rounds: int) -> Floats:
        """Least squares (Levenberg 1944) of every row from x (n, k) on."""
        error, damp, nx = self.left(x), np.full(len(x), 1e-2), x.shape[1]
        for _ in range(rounds):
            slopes = np.stack([(self.left(x + BESIDE * one) - error) / BESIDE for one in np.eye(nx)], axis=2)
            square = np.einsum("nij,nik->njk", slopes, slopes)
            pull = np.einsum("nij,ni->nj", slopes, error)
            scale = np.maximum(np.einsum("njj->n", square) / nx, 1e-300)
            stiff = square + (damp * scale)[:, None, None] * np.eye(nx)
            tried = np.clip(x - np.linalg.solve(stiff, pull[:, :, None])[:, :, 0], 0.0, 1.0)
            after = self.left(tried)
            better = ((after**2).sum(axis=1) < (error**2).sum(axis=1))[:, None]
            x, error = np.where(better, tried, x), np.where(better, after, error)
            damp = np.clip(np.where(better[:, 0], damp / 4.0, damp * 4.0), 1e-9, 1e3)
        return x

    def best(self, x: Floats) -> Floats:
        """Those (n', k) that stay off the ground on their way and leave least energy, of those that leave next to none
        the soonest, no two of them the same; their aims are their own from now on."""
        energy = (self.left(x) ** 2).sum(axis=1)
        spans = self.spans(x)
        before, after = self.every(spans)
        held, late = self.sizes[1], after.sum(axis=1)
        edge = self.transfer.ends(self.transfer.held, self.volts[:held], before[:, :held])
        free = self.transfer.clear(edge, self.volts[held:], np.column_stack([before[:, held:], after]))
        chosen: list[int] = []
        for row in np.lexsort((late, np.where(free, np.maximum(energy, REST * self.stored), np.inf))):
            if all(np.abs(x[row] - x[one]).max() > APART for one in chosen):
                chosen.append(int(row))
            if len(chosen) == KEPT:
                break
        self.aims = np.repeat(self.aims, len(chosen), axis=0)
        return x[chosen]

    def correct(self, trials: Trials, signals: tuple[Floats, Floats], x: Floats) -> None:
        """Aim beside the ground by as much as the scene's own run misses what the structure alone would do: films and
        whatever else acts on the way. Runs that touch before their last edge keep their aim."""
        spans, a = self.spans(x), self.sizes[0]
        edges = spans[:, :a].sum(axis=1)
        for row, (levels, durations) in enumerate(zip(*signals, strict=True)):
            time, state = trials.approach(levels, durations, float(edges[row] + spans[row, -1]))
            if time > edges[row]:
                own = np.append(spans[row, :-1], time - edges[row])
                self.aims[row] = self.transfer.landed - (state - self.ends(own[None])[0])
