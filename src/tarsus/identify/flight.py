"""Free flights of a structure near the ground, many at once: linear structure, drive force, and the film at the foot.

State z = (x, v). ``z' = flow z + inputs (F_drive(t), F_film)`` with ``F_film = -C g' / (g + g0)^3`` along the foot's
normal. A step is exact for forces that run straight between its ends; the film force at its end is found by two
corrections.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from tarsus.identify.foot import FootModel

__all__ = ["Film", "Flow", "Volts", "between_samples"]

Floats = NDArray[np.float64]

SUBSTEPS = 3
"""Steps of the flow per sample."""

_CORRECTIONS = 2
_LEAST = 0.2
"""Part of the film's thickness that is left at least: trials of a fit may dip below the ground."""


@dataclass(frozen=True)
class Film:
    """Film coefficient C [N m^2 s] and thickness g0 [m], each a number or one for each flight (N,)."""

    coefficient: Floats | float
    thickness: Floats | float

    def force(self, gap: Floats, rate: Floats) -> Floats:
        """Force [N] along the normal at gaps [m] and gap rates [m/s], each (N,)."""
        distance = np.maximum(gap + self.thickness, _LEAST * self.thickness)
        return -self.coefficient * rate / (distance * distance * distance)


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

    def fly(self, state: Floats, drive: Floats, film: Film, neutral: float, every: int = SUBSTEPS) -> Floats:
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
            Gap of the foot where x = 0 [m].

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
        force = film.force(at[0] + neutral, at[1])
        last = self.last[:, :1]
        step = np.concatenate([self.free, self.first, last], axis=1)
        stacked = np.empty((step.shape[1], state.shape[1]))
        for k in range(steps):
            stacked[: 2 * size], stacked[2 * size], stacked[2 * size + 1] = state, drive[k], force
            stacked[2 * size + 2] = drive[k + 1]
            moved = step @ stacked
            base = foot @ moved
            at = base + by_film * force
            for _ in range(_CORRECTIONS):
                force = film.force(at[0] + neutral, at[1])
                at = base + by_film * force
            state = moved + last_film * force
            if (k + 1) % every == 0:
                out[(k + 1) // every] = state
        return out

    def short(
        self,
        state: Floats,
        drive: Floats,
        slope: Floats,
        film: Film,
        neutral: float,
        seconds: Floats,
        bend: Floats | float = 0.0,
    ) -> Floats:
        """States (2n, N) a short time [s] (N,) later, which may be negative.

        The drive force is ``drive + slope t + bend t^2``, in N, N/s and N/s^2, each (N,), at a time t after the
        start. Sixteen steps of the classical Runge-Kutta scheme; for times up to a few samples."""
        flow, inputs, n = self.model.flow, self.model.inputs, len(self.model.row)
        h = seconds / _SHORT

        def rate(z: Floats, force: Floats) -> Floats:
            gap, speed = neutral + self.model.row @ z[:n], self.model.row @ z[n:]
            return flow @ z + inputs[:, :1] * force + inputs[:, 1:] * film.force(gap, speed)

        for k in range(_SHORT):
            early, middle, late = (
                drive + (slope + bend * h * (k + part)) * h * (k + part) for part in (0.0, 0.5, 1.0)
            )
            a = rate(state, early)
            b = rate(state + 0.5 * h * a, middle)
            c = rate(state + 0.5 * h * b, middle)
            d = rate(state + h * c, late)
            state = state + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return state


_SHORT = 16


@dataclass(frozen=True)
class Volts:
    """Volts of a record at its samples and between them, see `between_samples`, with the turning points among
    them."""

    fine: Floats
    turns: NDArray[np.intp]
    substeps: int

    @staticmethod
    def of(volts: Floats, substeps: int = SUBSTEPS) -> Volts:
        """From the samples (ns,)."""
        fine = between_samples(volts, substeps)
        moves = np.sign(np.diff(fine))
        moving = np.flatnonzero(moves)
        turned = moving[1:][moves[moving[1:]] != moves[moving[:-1]]]
        return Volts(fine, turned, substeps)

    def force(self, model: FootModel, first: int, count: int) -> Floats:
        """Drive force [N] from sample ``first`` on over ``count`` - 1 sampling steps, (substeps (count - 1) + 1,);
        held beyond the end of the record."""
        start = self.substeps * first
        part = self.fine[start : start + self.substeps * (count - 1) + 1]
        before = self.fine[self.turns[: int(np.searchsorted(self.turns, start))]]
        force = model.law.force(part, (*model.history, *before.tolist()))
        return np.concatenate([force, np.full(self.substeps * (count - 1) + 1 - len(force), force[-1])])


def between_samples(volts: Floats, substeps: int) -> Floats:
    """Volts at the samples and at ``substeps`` - 1 even places between any two of them.

    Stretches without a corner are monotone cubics, through samples that a
    running cubic over 11 of them has rid of most of their rounding. A corner that lies between two samples is where
    the lines through its neighbours meet. Volts that jump are joined by lines."""
    from scipy.interpolate import PchipInterpolator
    from scipy.signal import savgol_filter

    if np.max(np.abs(np.diff(volts)), initial=0.0) > _EDGE * float(np.ptp(volts)):
        return np.interp(np.arange(substeps * (len(volts) - 1) + 1) / substeps, np.arange(len(volts)), volts)
    place = np.arange(len(volts), dtype=float)
    bend = np.zeros(len(volts))
    bend[1:-1] = volts[2:] - 2.0 * volts[1:-1] + volts[:-2]
    size = np.abs(bend)
    around = np.array([np.roll(size, k) for k in (-4, -3, -2, 2, 3, 4)])
    corner = size > _CORNER * np.median(around, axis=0) + _LEAST_BEND * float(np.ptp(volts))
    breaks = [0.0, place[-1]]
    for i in np.flatnonzero(corner[:-1]):
        if corner[i + 1] and bend[i] * bend[i + 1] > 0.0 and 1 <= i < len(volts) - 2:
            left, right = volts[i] - volts[i - 1], volts[i + 2] - volts[i + 1]
            late = (volts[i + 1] - volts[i] - right) / (left - right)
            breaks.append(i + float(np.clip(late, 0.0, 1.0)))
        elif not (i and corner[i - 1]):
            breaks.append(float(i))
    at = np.arange(substeps * (len(volts) - 1) + 1) / substeps
    out = np.empty(len(at))
    edges = np.unique(breaks)
    for first, last in pairwise(edges):
        x = np.arange(int(np.ceil(first)), int(np.floor(last)) + 1)
        wanted = slice(int(np.searchsorted(at, first)), int(np.searchsorted(at, last, side="right")))
        y = volts[x]
        if len(x) >= _SMOOTHED:
            y = np.asarray(savgol_filter(y, _SMOOTHED, 3), dtype=np.float64)
        if len(x) < _FEWEST_NODES or np.ptp(y) == 0.0:
            near = slice(max(int(first), 0), int(np.ceil(last)) + 1)
            out[wanted] = np.interp(at[wanted], place[near], volts[near])
            continue
        out[wanted] = PchipInterpolator(x, y)(np.clip(at[wanted], x[0], x[-1]))
        out[wanted] += (y[1] - y[0]) * np.minimum(at[wanted] - x[0], 0.0)
        out[wanted] += (y[-1] - y[-2]) * np.maximum(at[wanted] - x[-1], 0.0)
    return out


_FEWEST_NODES = 5
_SMOOTHED = 11
_EDGE = 0.2
_CORNER = 6.0
_LEAST_BEND = 2e-4
