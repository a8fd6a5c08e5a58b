"""Where to begin: switching times that bring a structure to rest on the ground, were there nothing but the structure.

A foot that touches down without speed is let go again if the structure behind it is not at rest. A step has to end
not only with the gap closed but with every mode where the held foot keeps it, and all velocities zero: 2 n conditions
on a structure of n modes, which the durations of the plateaus and the time of arrival have to meet. Rest-to-rest
transfers of linear systems by switching (Singer and Seering, J. Dyn. Syst. Meas. Control 112, 1990, and many since) are
found here by least squares from an even spread, thousands side by side, with the exact derivatives that a sum of modes
has; films are met by correcting the aim, adhesion and impacts are left to the search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.spec import with_values
from tarsus.design.pulses import Family, OwnStep, Step
from tarsus.design.trials import Trials
from tarsus.fit.unknowns import even_points
from tarsus.fit.valleys import apart
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene
from tarsus.plan.lowering import lower_system

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

STARTS, ROUNDS = 2048, 12
"""Transfers begun for every family, and steps of least squares; the nearest quarter goes on for twice as many."""
CORRECTIONS = 2
"""Times that a run of the scene corrects where transfers are aimed at; a third time finds hardly anything."""
GENTLE = 0.02
"""Speed with which they are to touch down, in parts of that of the plain step: at none at all they would graze."""
KEPT = 12
"""Of every family's, those that are best: others are no better than the scan's own points."""
LEVELS = 17
"""Voltages at which the drive's force is asked for; between them it is taken for a line."""
SEEN = 8
"""Times in a plateau at which the gap is looked at."""
REST = 1e-6
"""Share of the energy between the two held states that is next to none: a thousandth of the motion."""
LONG = 1e3
"""Periods after which a structure rests: a mode of damping ratio 1e-4 at one oscillation a period has forgotten."""
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
        pushed, landed = system.per_impulse[:, number], held.copy()
        landed[n:] = -speed * pushed / (normal @ pushed)
        size = np.zeros((2 * n, 2 * n))
        size[:n, :n] = np.linalg.cholesky(0.5 * system.stiffness).T
        size[n:, n:] = np.linalg.cholesky(0.5 * system.mass).T
        return cls(
            rates, shapes, np.linalg.inv(shapes).astype(complex), volts, rest, held, landed, size,
            float(system.rest_gap[number]), np.append(normal, np.zeros(n)),
        )  # fmt: skip

    def moves(self, start: Floats, volts: Floats, spans: Floats) -> tuple[Floats, Floats, Floats]:
        """States (n, 2n) at the end of plateaus, volts [V] and spans [s] (n, k), from states (n, 2n) or one (2n,)
        on, and their derivatives (n, 2n, k) by the spans and by the volts."""
        segment = np.clip(np.searchsorted(self.volts, volts) - 1, 0, len(self.volts) - 2)
        places, steps = self.rest @ self.inverse.T, np.diff(self.volts)
        slopes = np.diff(places, axis=0)[segment] / steps[segment][..., None]
        rest = places[segment] + slopes * (volts - self.volts[segment])[..., None]
        turned = np.exp(self.rates * spans[..., None])
        state = np.broadcast_to(start, (len(spans), len(self.held))) @ self.inverse.T
        of_spans, of_volts = np.empty_like(rest), np.empty_like(rest)
        for k in range(spans.shape[1]):
            swing = turned[:, k] * (state - rest[:, k])
            state = rest[:, k] + swing
            of_spans[:, :k] *= turned[:, k, None]
            of_volts[:, :k] *= turned[:, k, None]
            of_spans[:, k], of_volts[:, k] = self.rates * swing, (1.0 - turned[:, k]) * slopes[:, k]
        back = self.shapes.T
        by_spans, by_volts = (np.moveaxis((one @ back).real, 1, 2) for one in (of_spans, of_volts))
        return (state @ back).real, by_spans, by_volts

    def ends(self, start: Floats, volts: Floats, spans: Floats) -> Floats:
        """States (n, 2n) at the end of plateaus, as `moves` has them."""
        return self.moves(start, volts, spans)[0]

    def clear(self, start: Floats, volts: Floats, spans: Floats) -> NDArray[np.bool_]:
        """Whether (n,) the foot stays off the ground in all but the first of these plateaus, the very end aside."""
        state = self.ends(start, volts[:, :1], spans[:, :1])
        found = np.ones(len(spans), dtype=bool)
        for level, span in zip(volts[:, 1:].T[..., None], spans[:, 1:].T[..., None], strict=True):
            for part in np.arange(1, SEEN) / SEEN:
                found &= self.gap + self.ends(state, level, part * span) @ self.normal > 0.0
            state = self.ends(state, level, span)
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
    transfer: Transfer, step: Step, choices: Sequence[Family], trials: Trials, rng: np.random.Generator,
    starts: int = STARTS,
) -> tuple[NDArray[np.int64], Floats]:  # fmt: skip
    """Points (n, nu) of families, by number (n,), whose plateaus leave the structure least energy on the ground."""
    numbers, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, step.unknowns(choices[0].plateaus // 2)))]
    for number, family in enumerate(choices if not isinstance(step, OwnStep) else ()):
        if family.sizes[0] == 0:
            continue
        aim = _Aim(transfer, step, family)
        x = aim.solved(even_points(points[0].shape[1] + 1, starts, rng), ROUNDS)
        nearest = np.argsort((aim.left(x) ** 2).sum(axis=1), kind="stable")[: len(x) // 4]
        x = aim.best(aim.solved(x[nearest], 2 * ROUNDS))
        for _ in range(CORRECTIONS):
            aim.correct(trials, step.place(choices, np.full(len(x), number), x[:, 1:]), x)
            x = aim.solved(x, ROUNDS)
        numbers.append(np.full(len(x), number))
        points.append(x[:, 1:])
    return np.concatenate(numbers), np.concatenate(points)


class _Aim:
    """Transfers from the ground, over plateaus at the release and the landing edge, to the ground. Unknowns (n, 1 + nu)
    are the time to the arrival, as the root of its share of the longest plateau, and a point of the family's unit cube
    (`Step.place`); aims (n, 2n) are where they are to end."""

    def __init__(self, transfer: Transfer, step: Step, family: Family) -> None:
        self.transfer, self.step, self.family = transfer, step, family
        self.aims = transfer.landed[None]
        lift = transfer.ends(transfer.held, np.array([[step.lift]]), np.array([[LONG * step.period]]))
        self.stored = float((((lift - transfer.held) @ transfer.size.T) ** 2).sum())

    def signals(self, x: Floats) -> tuple[Floats, Floats]:
        """Volts and spans (n, k) of plateaus from the release edge on to the arrival: those of the release, the lift
        level, those of the landing, the support level."""
        (a, b), step = self.family.sizes, self.step
        spans = step.shortest + x[:, : 1 + a + b] ** 2 * (step.longest - step.shortest)
        arrival, landing, release = spans[:, :1], spans[:, 1 : 1 + a], spans[:, 1 + a :]
        lifted = np.maximum(step.period - step.supported - release.sum(axis=1, keepdims=True), 0.0)
        if step.levels.free:
            between = step.levels.low + x[:, 1 + a + b :] * (step.levels.high - step.levels.low)
        else:
            between = np.tile([*self.family.landing, *self.family.release], (len(x), 1))
        held = np.ones((len(x), 1))
        volts = [between[:, a:], step.lift * held, between[:, :a], step.support * held]
        return np.concatenate(volts, axis=1), np.concatenate([release, lifted, landing, arrival], axis=1)

    def left(self, x: Floats) -> Floats:
        """Square roots of the energy (n, 2n) that is left."""
        return (self.transfer.ends(self.transfer.held, *self.signals(x)) - self.aims) @ self.transfer.size.T

    def slopes(self, x: Floats) -> tuple[Floats, Floats]:
        """The same and its derivatives (n, 2n, 1 + nu)."""
        (a, b), step = self.family.sizes, self.step
        volts, spans = self.signals(x)
        state, of_spans, of_volts = self.transfer.moves(self.transfer.held, volts, spans)
        of_spans[:, :, :b] -= of_spans[:, :, b : b + 1] * (spans[:, b] > 0.0)[:, None, None]
        order = [a + b + 1, *range(b + 1, a + b + 1), *range(b)]
        parts = [of_spans[:, :, order] * (2.0 * x[:, None, : 1 + a + b] * (step.longest - step.shortest))]
        if step.levels.free:
            parts.append(of_volts[:, :, order[1:]] * (step.levels.high - step.levels.low))
        size = self.transfer.size
        return (state - self.aims) @ size.T, size @ np.concatenate(parts, axis=2)

    def solved(self, x: Floats, rounds: int) -> Floats:
        """Least squares (Levenberg 1944) of every row from x (n, 1 + nu) on.

        `tarsus.fit.descend` finds the same transfers and takes a fifth to a half longer: it judges of each row whether
        it has settled, which thousands of rows of a few unknowns that all stop after so many rounds do not need.
        """
        damp, nx = np.full(len(x), 1e-2), x.shape[1]
        for _ in range(rounds):
            error, slopes = self.slopes(x)
            square = slopes.transpose(0, 2, 1) @ slopes
            pull = (error[:, None] @ slopes)[:, 0]
            scale = np.maximum(np.einsum("njj->n", square) / nx, 1e-300)
            stiff = square + (damp * scale)[:, None, None] * np.eye(nx)
            tried = np.clip(x - np.linalg.solve(stiff, pull[:, :, None])[:, :, 0], 0.0, 1.0)
            better = (self.left(tried) ** 2).sum(axis=1) < (error**2).sum(axis=1)
            x = np.where(better[:, None], tried, x)
            damp = np.clip(np.where(better, damp / 4.0, damp * 4.0), 1e-9, 1e3)
        return x

    def best(self, x: Floats) -> Floats:
        """Those (n', 1 + nu) that stay off the ground on their way and leave least energy, of those that leave next to
        none the soonest, no two of them the same; their aims are their own from now on."""
        energy = (self.left(x) ** 2).sum(axis=1)
        (volts, spans), held = self.signals(x), self.family.sizes[1]
        late = spans[:, held + 1 :].sum(axis=1)
        edge = self.transfer.ends(self.transfer.held, volts[:, :held], spans[:, :held])
        free = self.transfer.clear(edge, volts[:, held:], spans[:, held:])
        order = np.lexsort((late, np.where(free, np.maximum(energy, REST * self.stored), np.inf)))
        chosen = apart(x, order, APART, KEPT)
        self.aims = np.repeat(self.aims, len(chosen), axis=0)
        return x[chosen]

    def correct(self, trials: Trials, signals: Floats, x: Floats) -> None:
        """Aim beside the ground by as much as the scene's own run misses what the structure alone would do: films and
        whatever else acts on the way. Runs that touch before their last edge keep their aim."""
        (volts, spans), held = self.signals(x), self.family.sizes[1]
        edges = spans[:, held + 1 : -1].sum(axis=1)
        for row, signal in enumerate(signals):
            time, state = trials.approach(signal, float(edges[row] + spans[row, -1]))
            if time > edges[row]:
                spans[row, -1] = time - edges[row]
                own = self.transfer.ends(self.transfer.held, volts[row : row + 1], spans[row : row + 1])
                self.aims[row] = self.transfer.landed - (state - own[0])
