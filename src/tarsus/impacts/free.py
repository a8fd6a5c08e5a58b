"""The free response of a structure between impacts, fitted to a record of velocities on both sides of one impact.

Between impacts the difference of a record near the ground and one in the air obeys the linear structure without any
drive. Its state on both sides of an impact is then a linear least-squares problem with known noise; the displacement is
the same on both sides, and that determines the instant of the impact to a fraction of a sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import expm

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.linear import modes_of
from tarsus.base.messages import nearest
from tarsus.model.structure.base import Structure

_ROUNDS = 8
"""Gauss-Newton rounds for the instant of an impact at most; three are enough for a strong one."""

_RANK = 1e-9
"""Directions of the state that weigh less than this in the samples are taken as not seen."""


class FreeResponse:
    """Velocities of points of a structure that moves freely, at half-sample times around an instant.

    Parameters
    ----------
    structure
        Linear structure of n coordinates; any damping.
    points
        Names of the np points whose velocities are recorded.
    noise
        Standard deviation of a sample of each point (np,) [m/s].
    step
        Sampling step [s].

    Attributes
    ----------
    flow : (2n, 2n)
        ``d state / dt = flow @ state``. The state is that of the undamped modes, displacements times their angular
        frequencies, so that all of it is a velocity [m/s].
    rows : (np, 2n)
        Velocities of the points from the state.
    highest : float
        Highest natural frequency [Hz].

    Raises
    ------
    InputError
        For a point that the structure does not have, or a structure that does not vibrate.
    """

    def __init__(self, structure: Structure, points: Sequence[str], noise: Floats, step: float) -> None:
        m = structure.matrices()
        shapes = point_rows(structure, points)
        squared, modes = modes_of(m.mass, m.stiffness)
        omega = np.sqrt(squared.clip(0.0))
        self.highest = float(omega.max()) / (2.0 * np.pi)
        if self.highest <= 0.0:
            raise InputError("the structure has no vibration: every frequency is zero")
        scale = omega.clip(1e-3 * omega.max())
        n = self.modes = len(omega)
        self.flow = np.zeros((2 * n, 2 * n))
        self.flow[:n, n:] = np.diag(scale)
        self.flow[n:, :n] = -(modes.T @ m.stiffness @ modes) / scale
        self.flow[n:, n:] = -(modes.T @ m.damping @ modes)
        self.rows = np.zeros((len(points), 2 * n))
        self.rows[:, n:] = shapes @ modes
        self.step, self.noise = step, noise
        self.side = cache(self._side)

    def moved(self, time: float) -> Floats:
        """Map (2n, 2n) of the state over a time [s], either direction."""
        return np.asarray(expm(self.flow * time), dtype=np.float64)

    def _side(self, count: int, skipped: int = 0) -> Side:
        """What ``count`` samples after the instant (before it, for a negative count) say about the state there.

        Of those after it the first ``skipped`` do not count.
        """
        direction = 1.0 if count > 0 else -1.0
        onward = expm(self.flow * (direction * self.step))
        row = self.rows @ expm(self.flow * (0.5 * direction * self.step)) / self.noise[:, None]
        response = []
        for _ in range(abs(count)):
            response.append(row if len(response) >= skipped else np.zeros_like(row))
            row = row @ onward
        if count < 0:
            response.reverse()
        left, values, right = np.linalg.svd(np.concatenate(response), full_matrices=False)
        kept = values > _RANK * values[0]
        return Side(left[:, kept], values[kept, None] * right[kept])


@dataclass(frozen=True)
class Side:
    """Samples on one side of an instant, in units of their noise: ``basis.T @ samples = state_map @ state + noise``.

    basis (k np, r), orthonormal: all that the samples can say about the state; state_map (r, 2n).
    """

    basis: Floats
    state_map: Floats


def point_rows(structure: Structure, points: Sequence[str]) -> Floats:
    """Rows (np, n) that give the displacements of points from a structure's coordinates.

    Raises
    ------
    InputError
        For a point that the structure does not have, with the nearest name.
    """
    unknown = [name for name in points if name not in structure.points]
    if unknown:
        raise InputError([f"the structure has no point '{name}'{nearest(name, structure.points)}" for name in unknown])
    return np.array([structure.row(name) for name in points]).reshape(len(points), structure.size)


@dataclass(frozen=True)
class ImpactFit:
    """Free motion fitted on both sides of an impact.

    late [s]: the impact after the middle between its two neighbouring samples; before (np,) velocities [m/s] of the
    points just before it; change (np,) their changes [m/s]; weights (2 np + 1, k, np): how the errors of before,
    change and late depend on the errors of the k samples; misfit: chi-squared; freedom: its degrees of freedom.
    """

    late: float
    before: Floats
    change: Floats
    weights: Floats
    misfit: float
    freedom: int


def fit_impact(free: FreeResponse, samples: Floats, earlier: int, smeared: int = 0) -> ImpactFit | None:
    """Fit the free motion before and after an impact that lies between two samples.

    The unknowns are the state before (2n), the change of the velocities (n) and the instant; the problem is linear but
    for the instant, which is found by Gauss-Newton. Its steps are those of a pseudo-inverse: fewer points than modes
    leave directions of the state unseen, which normal equations, that square the condition, would take for seen.

    Parameters
    ----------
    free
        Free response at the recorded points.
    samples
        Velocities (k, np) [m/s] around the impact.
    earlier
        How many of the k samples are earlier than the impact.
    smeared
        How many samples after the impact are left out.

    Returns
    -------
    ImpactFit or None
        None where the samples do not determine the velocities on both sides. Where they do not determine the instant,
        and the velocities do not depend on it, it stays in the middle.
    """
    n, (count, points) = free.modes, samples.shape
    sides = free.side(-earlier), free.side(count - earlier, smeared)
    white = samples / free.noise
    parts = white[:earlier].ravel(), white[earlier:].ravel()
    target = np.concatenate([side.basis.T @ part for side, part in zip(sides, parts, strict=True)])
    split = len(sides[0].state_map)
    design = np.zeros((len(target), 3 * n + 1))
    design[:split, : 2 * n], design[split:, : 2 * n] = sides[0].state_map, sides[1].state_map
    late, previous, theta, inverse = 0.0, 0.0, np.zeros(3 * n + 1), np.zeros((0, 0))
    for turn in range(_ROUNDS):
        earlier_velocity = free.moved(-late)[:, n:]
        design[split:, 2 * n : 3 * n] = sides[1].state_map @ earlier_velocity
        design[split:, -1] = sides[1].state_map @ (-free.flow @ earlier_velocity @ theta[2 * n : 3 * n])
        solved = design if turn else design[:, :-1]
        inverse = np.linalg.pinv(solved, rcond=_RANK)
        theta = inverse @ (target + design[:, -1] * late)
        if not turn:
            theta = np.append(theta, 0.0)
            continue
        previous, late = late, float(np.clip(theta[-1], -free.step, free.step))
        if abs(late - previous) < 1e-4 * free.step:
            break
    flow = free.moved(late)
    wanted = np.zeros((2 * points + 1, 3 * n + 1))
    wanted[:points, : 2 * n] = free.rows @ flow
    wanted[:points, -1] = free.rows @ flow @ free.flow @ theta[: 2 * n]
    wanted[points:-1, 2 * n : 3 * n] = free.rows[:, n:]
    wanted[-1, -1] = 1.0
    seen = wanted @ inverse @ design
    rank = int(np.linalg.matrix_rank(design, tol=_RANK * np.linalg.norm(design, 2)))
    freedom = samples.size - smeared * points - rank
    lost = np.linalg.norm(seen - wanted, axis=1) > 1e-3 * np.linalg.norm(wanted, axis=1)
    if freedom < 1 or lost[:-1].any():
        return None
    left = target - design[:, :-1] @ theta[:-1] - design[:, -1] * (theta[-1] - previous)
    squares = float(np.sum(parts[0] ** 2) + np.sum(parts[1][smeared * points :] ** 2))
    misfit = squares - float(target @ target) + float(left @ left)
    wanted[-1] *= not lost[-1]
    reduced = wanted @ inverse
    whole = [reduced[:, :split] @ sides[0].basis.T, reduced[:, split:] @ sides[1].basis.T]
    weights = np.concatenate(whole, axis=1).reshape(-1, count, points) / free.noise
    state, jump = theta[: 2 * n], theta[2 * n : 3 * n]
    return ImpactFit(late, free.rows @ flow @ state, free.rows[:, n:] @ jump, weights, misfit, freedom)
