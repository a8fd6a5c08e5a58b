"""Free flights of a structure near the ground, many at once: linear structure, drive force, and the film at the foot.

State z = (x, v). ``z' = flow z + inputs (F_drive(t), F_film)`` with ``F_film = -C g' / (g + g0)^3`` along the foot's
normal. A step is exact for forces that run straight between its ends; the film force at its end is found by two
corrections.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from tarsus.identify.foot import FootModel

__all__ = ["SUBSTEPS", "Film", "Flow"]

Floats = NDArray[np.float64]

SUBSTEPS = 3
"""Steps of the flow per sample."""

_CORRECTIONS = 2
_LEAST = 0.2
"""Part of the film's thickness that is left at least: trials of a fit may dip below the ground."""


@dataclass(frozen=True)
class Film:
    """Film coefficient C [N m^2 s] and thickness g0 [m], each a number or one for each flight (N,); beside it the
    electrostatic attraction ``-C_e V^2 / (g + g_e)^2``, by C_e [N m^2/V^2] and g_e [m] (3.25)."""

    coefficient: Floats | float
    thickness: Floats | float
    attraction: Floats | float = 0.0
    offset: Floats | float = 1.0

    def force(self, gap: Floats, rate: Floats, squares: Floats | None = None) -> Floats:
        """Force [N] along the normal at gaps [m], gap rates [m/s] and, where it is attracted, squared volts [V^2],
        each (N,)."""
        distance = np.maximum(gap + self.thickness, _LEAST * self.thickness)
        damped = -self.coefficient * rate / (distance * distance * distance)
        if squares is None:
            return damped
        away = np.maximum(gap + self.offset, _LEAST * self.offset)
        return damped - self.attraction * squares / (away * away)

    def along(
        self, neutral: Floats | float, squares: Floats | None
    ) -> Callable[[Floats, Floats, int], Floats]:
        """`force` of how far feet are from their neutral gaps, of their rates, each (N,), and the number of a row of
        the squared volts (steps, N); what stays from step to step is computed once."""
        if squares is not None:
            return lambda moved, rate, k: self.force(moved + neutral, rate, squares[k])
        rest, least, slowing = neutral + self.thickness, _LEAST * self.thickness, -self.coefficient

        def damped(moved: Floats, rate: Floats, k: int) -> Floats:
            distance = moved + rest
            np.maximum(distance, least, out=distance)
            force = slowing * rate
            force /= distance * distance * distance
            return force

        return damped


class Flow:
    """Steps of free flights of one model.

    Parameters
    ----------
    model
        Structure, load and foot.
    step
        Length of a step [s].
    """

    def __init__(self, model: FootModel, step: float) -> None:
        self.model, self.step = model, step
        size = len(model.flow)
        # exponential of the flow with inputs that run straight: z' = A z + B (w0 + w1 t)
        block = np.zeros((size + 4, size + 4))
        block[:size, :size] = model.flow * step
        block[:size, size : size + 2] = model.inputs * step
        block[size : size + 2, size + 2 :] = np.eye(2)
        whole = expm(block)
        self.free = whole[:size, :size]
        held, slope = whole[:size, size : size + 2], whole[:size, size + 2 :]
        self.first, self.last = held - slope, slope

    def gap(self, state: Floats, neutral: float) -> tuple[Floats, Floats]:
        """Gap [m] and its rate [m/s], each (N,), of states (2n, N)."""
        n = len(self.model.row)
        return neutral + self.model.row @ state[:n], self.model.row @ state[n:]

    def fly(
        self,
        state: Floats,
        drive: Floats,
        film: Film,
        neutral: Floats | float,
        every: int = SUBSTEPS,
        squares: Floats | None = None,
    ) -> Floats:
        """States after every ``every``-th step, the first one included.

        Parameters
        ----------
        state
            At the start (2n, N).
        drive
            Drive force [N] at the ends of the steps (steps + 1, N).
        film
            At the foot.
        neutral
            Gap of the foot where x = 0 [m], a number or one for each flight (N,).
        every
            Steps from one state that is returned to the next.
        squares
            Squared volts [V^2] at the ends of the steps (steps + 1, N), where the foot is attracted.

        Returns
        -------
        array
            (steps // every + 1, 2n, N).
        """
        steps = len(drive) - 1
        out = np.empty((steps // every + 1, *state.shape))
        out[0] = state
        size = state.shape[0] // 2
        last_film, row = self.last[:, 1:], self.model.row
        foot = np.zeros((2, 2 * size))
        foot[0, :size], foot[1, size:] = row, row
        by_film = foot @ last_film
        at = foot @ state
        felt = film.along(neutral, squares)
        force = felt(at[0], at[1], 0)
        last = self.last[:, :1]
        step = np.concatenate([self.free, self.first, last], axis=1)
        stacked = np.empty((step.shape[1], state.shape[1]))
        for k in range(steps):
            stacked[: 2 * size], stacked[2 * size], stacked[2 * size + 1] = state, drive[k], force
            stacked[2 * size + 2] = drive[k + 1]
            moved = step @ stacked
            base = foot @ moved
            for _ in range(_CORRECTIONS):
                at = base + by_film * force
                force = felt(at[0], at[1], k + 1)
            state = moved + last_film * force
            if (k + 1) % every == 0:
                out[(k + 1) // every] = state
        return out

    def short(
        self, state: Floats, drive: Callable[[Floats], Floats], film: Film, neutral: float, seconds: Floats
    ) -> Floats:
        """States (2n, N) a short time [s] (N,) later, which may be negative.

        ``drive`` gives the drive force (N,) [N] at times (N,) [s] after the start. Sixteen steps of the classical
        Runge-Kutta scheme; for times up to a few samples.
        """
        flow, inputs, n = self.model.flow, self.model.inputs, len(self.model.row)
        h = seconds / _SHORT

        def rate(z: Floats, force: Floats) -> Floats:
            gap, speed = neutral + self.model.row @ z[:n], self.model.row @ z[n:]
            return flow @ z + inputs[:, :1] * force + inputs[:, 1:] * film.force(gap, speed)

        late = drive(np.zeros_like(h))
        for k in range(_SHORT):
            early, middle, late = late, drive(h * (k + 0.5)), drive(h * (k + 1.0))
            a = rate(state, early)
            b = rate(state + 0.5 * h * a, middle)
            c = rate(state + 0.5 * h * b, middle)
            d = rate(state + h * c, late)
            state = state + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return state


_SHORT = 16
