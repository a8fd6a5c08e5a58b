"""Recorded steps of a run: their vectors, and the maps onto parts of them (numpy only); see `tarsus.core.replay`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from tarsus.core.arrays import T_CLASS, TRACE_HEAD
from tarsus.core.book import ModeBook
from tarsus.core.modes import ContactMode
from tarsus.core.nodes import LEFT, RIGHT, TAU, N

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]

RESOLVED = 1.0  # |T| h up to which Taylor polynomials and Gauss points resolve every mode
TERMS = 20  # Taylor terms: 1/20! = 4e-19
CHUNK = 4_000_000  # floats held at once
STEADY = 1e-8
"""Least ratio of the product of a block's rates to the square of its largest for which its place of rest counts as known:
below, in rigid-body modes, a force leads nowhere."""

# Inputs are kept as Legendre coefficients: an input that hardly changes is one coefficient, free of rounding.
_NODAL = legendre.legvander(2.0 * TAU - 1.0, N - 1)
_COEFFICIENT = np.linalg.inv(_NODAL)
_LEFT = np.triu(_COEFFICIENT @ LEFT @ _NODAL)
_RIGHT = np.triu(_COEFFICIENT @ RIGHT @ _NODAL)


def _monomials() -> Floats:
    """(8, 8): coefficient of s^c in the Legendre polynomial l on [0, 1]; whole numbers."""
    out = np.zeros((N, N))
    for degree in range(N):
        series = legendre.Legendre.basis(degree, domain=[0.0, 1.0]).convert(kind=np.polynomial.Polynomial)
        out[: degree + 1, degree] = np.round(series.coef)
    return out


_MONOMIAL = _monomials()


def chunks(count: int, width: int) -> list[slice]:
    step = max(CHUNK // width, 1)
    return [slice(first, first + step) for first in range(0, count, step)]


def started(mode: ContactMode, trace: Floats, rows: Rows) -> tuple[Floats, Floats]:
    """States (k, 2nb) at the start of recorded steps, and Legendre coefficients (k, ni, 8) of their inputs, `gathered`.

    A momentum of the ground may be counted from any value; recorded states are less all of it. Here it is counted from
    its value at the start of the step, so that the states are those of the motion, and what a foot does that hardly
    moves is no difference of two numbers of the size of the momentum.
    """
    ni, m = mode.feed.shape[1], len(mode.beta)
    nodal = trace[rows, trace.shape[1] - ni * N :].reshape(len(rows), ni, N)
    first = nodal[:, :m, :1].copy()
    nodal[:, :m] -= first
    state = trace[rows, TRACE_HEAD : TRACE_HEAD + 2 * len(mode.blocks)] + first[..., 0] @ mode.beta
    nodal[:, : 2 * m] = gathered(mode, nodal[:, : 2 * m])
    return state, _to_coefficients(nodal)


def gathered(mode: ContactMode, inputs: Floats) -> Floats:
    """Inputs (k, count m, 8) at the feet as the leading ones have to have them to move the structure, and to do work on
    it, as all do: of many feet on few modes only so many are left."""
    leading, m = mode.leading, len(mode.beta)
    on_ground = mode.on_ground
    if len(leading) == m - on_ground.sum():
        return inputs
    out = np.zeros_like(inputs)
    held = np.flatnonzero(np.tile(on_ground, inputs.shape[1] // m))
    out[:, held] = inputs[:, held]  # along the ground
    for first in range(0, inputs.shape[1], m):
        out[:, first + leading] = np.einsum("kij,il->klj", inputs[:, first : first + m], mode.spanned)
    return out


def _to_coefficients(nodal: Floats) -> Floats:
    start = nodal[..., :1]
    out = (nodal - start) @ _COEFFICIENT.T
    out[..., :1] += start
    return out


def _rate(mode: ContactMode) -> float:
    return float(np.linalg.norm(mode.blocks, ord=2, axis=(1, 2)).max()) if len(mode.blocks) else 0.0


def _steady(mode: ContactMode) -> NDArray[np.bool_]:
    """Entries (2nb,) of the state whose blocks have a place of rest under a constant force."""
    product = np.linalg.det(mode.blocks) if len(mode.blocks) else np.zeros(0)
    return np.tile(np.abs(product) > STEADY * (mode.blocks**2).sum(axis=(1, 2)), 2)


def _at_rest(mode: ContactMode, steady: NDArray[np.bool_], drive: Floats) -> Floats:
    """Places of rest (count, 2nb) under unit inputs of rates (count, 2nb), zero in entries that have none."""
    nb = len(mode.blocks)
    out = np.zeros_like(drive)
    for b in np.flatnonzero(steady[:nb]):
        out[:, [b, nb + b]] = -np.linalg.solve(mode.blocks[b], drive[:, [b, nb + b]].T).T
    return out


class Steps:
    """Vectors z = [state (2nb), input coefficients] of steps of one contact mode, and the maps onto half steps.

    Inputs that are zero throughout have no column, and constant ones a single one. Inputs beyond those of the mode
    act on nothing: they are carried along. The state is counted from where the means of the forces would hold it at
    rest: there it does not move, which for a stiff mode would else be a small difference of large numbers.
    """

    def __init__(self, book: ModeBook, q: int, inputs: Floats) -> None:
        self.mode: ContactMode = book.modes[q]
        self.book, self.q = book, q
        self.lengths: Floats = book.lengths
        self.rate = _rate(self.mode)
        self.nb = len(self.mode.blocks)
        self.count = inputs.shape[1]
        columns: list[tuple[int, int]] = []
        for i in range(self.count):
            degrees = np.flatnonzero(np.any(inputs[:, i] != 0.0, axis=0))
            columns += [(i, degree) for degree in range((degrees[-1] if len(degrees) else -1) + 1)]
        self.of_input = np.array([i for i, _ in columns], dtype=int)
        self.degree = np.array([degree for _, degree in columns], dtype=int)
        self.size = 2 * self.nb + len(columns)
        same = self.of_input[:, None] == self.of_input[None, :]
        self.left_inputs = np.where(same, _LEFT[self.degree[:, None], self.degree[None, :]], 0.0).T
        self.right_inputs = np.where(same, _RIGHT[self.degree[:, None], self.degree[None, :]], 0.0).T
        self.left = np.eye(self.size)
        self.left[2 * self.nb :, 2 * self.nb :] = self.left_inputs
        self._right: dict[int, Floats] = {}
        drive = np.zeros((self.count, 2 * self.nb))
        drive[: len(self.mode.inputs)] = self.mode.inputs
        self.forcing = _MONOMIAL[:, self.degree, None] * drive[self.of_input]
        means = (self.degree == 0) & (self.of_input >= len(self.mode.beta))
        steady = _steady(self.mode)
        self.moves = ~(means[:, None] & steady[None, :])  # columns that act on an entry of the state
        self.rest = np.where(self.moves, 0.0, _at_rest(self.mode, steady, drive)[self.of_input])
        self.forcing[0] *= self.moves
        # places change by velocities alone, not by forces: what blocks at rest show of them the others take back
        places = self.mode.to_physical[: len(self.mode.to_physical) // 2]
        self.drift = np.where(means[:, None], (drive[self.of_input] * self.moves) @ places.T, 0.0)
        self.left[2 * self.nb :, : 2 * self.nb] = self._shifted(self.left_inputs)

    def _shifted(self, to: Floats) -> Floats:
        """What is added to the state as its place of rest becomes that of the inputs that ``to`` makes of these."""
        change = np.eye(len(to)) - to
        change[self.degree == 0] = 0.0  # a mean stays what it is
        return change @ self.rest

    def vectors(self, state: Floats, inputs: Floats) -> Floats:
        columns = inputs[:, self.of_input, self.degree]
        return np.concatenate([state - columns @ self.rest, columns], axis=1)

    def right(self, k: int) -> Floats:
        """Map (size, size), acting on rows: z of a step to z of its second half, which is of class k."""
        if k not in self._right:
            nb = self.nb
            out = np.zeros((self.size, self.size))
            block, state_input = self.book.flow(self.q, k)
            r = np.arange(nb)
            for e, (to, source) in enumerate(((0, 0), (0, nb), (nb, 0), (nb, nb))):
                out[source + r, to + r] = block[e]
            response = np.einsum("ijr,jl->ilr", state_input, _NODAL)
            acts = self.of_input < len(response)
            push = np.zeros((len(self.of_input), 2 * nb))
            push[acts] = response[self.of_input[acts], self.degree[acts]]
            begun = self.left[2 * nb :, : 2 * nb]
            ended = self._shifted(self.right_inputs) - begun
            out[2 * nb :, : 2 * nb] = begun @ out[: 2 * nb, : 2 * nb] + self.left_inputs @ (push * self.moves) + ended
            out[2 * nb :, 2 * nb :] = self.right_inputs
            self._right[k] = out
        return self._right[k]

    def halve(
        self, z: Floats, level: Rows, along: Floats, passed: Callable[[int, Rows, Floats], None] | None = None
    ) -> None:
        """Halve steps, in place, until [0, along] of each resolves the fastest mode.

        ``passed(k, members, z)`` is told of every whole half step that lies behind.
        """
        if not len(z):
            return
        for k in range(int(level.min()), len(self.lengths) - 1):
            # the lower half of an unresolved reach is no shorter in time: only its step is
            live = np.flatnonzero((level == k) & (along * (self.lengths[k] * self.rate) > RESOLVED))
            if len(live):
                upper = along[live] >= 0.5
                below, above = live[~upper], live[upper]
                if len(below):
                    z[below] = z[below] @ self.left
                if len(above):
                    if passed is not None:
                        passed(k + 1, above, z[above] @ self.left)
                    z[above] = z[above] @ self.right(k + 1)
                along[live] = 2.0 * along[live] - upper
                level[live] = k + 1
            elif not np.any(level > k):
                return

    def series(self, z: Floats, length: Floats, along: Floats) -> Floats:
        """Taylor coefficients (TERMS + 1, k, 2nb) of the flowing state over [0, along] of steps, scaled to [0, 1]."""
        nb = self.nb
        out = np.empty((TERMS + 1, len(z), 2 * nb))
        out[0] = z[:, : 2 * nb]
        b = self.mode.blocks
        inputs = z[:, 2 * nb :]
        span = (along * length)[:, None]
        power = np.ones((len(z), 1))
        for c in range(TERMS):
            y1, y2 = out[c, :, :nb], out[c, :, nb:]
            grown = out[c + 1]
            grown[:, :nb] = b[:, 0, 0] * y1 + b[:, 0, 1] * y2
            grown[:, nb:] = b[:, 1, 0] * y1 + b[:, 1, 1] * y2
            if c < N and np.any(self.degree >= c):
                grown += power * (inputs @ self.forcing[c])
                power = power * along[:, None]
            grown *= span / (c + 1)
        return out

    def values(self, z: Floats, s: Floats, length: Floats) -> tuple[Floats, Floats]:
        """Inputs (k, count) and their rates of change at times s (k,) of steps."""
        value, slope = np.zeros((2, len(z), self.count))
        inputs = z[:, 2 * self.nb :]
        x = 2.0 * s - 1.0
        basis = legendre.legvander(x, N - 1)
        rate = np.zeros_like(basis)
        for degree in range(1, N):
            rate[:, degree] = legendre.legval(x, legendre.legder([0.0] * degree + [1.0]))
        rate *= (2.0 / length)[:, None]
        for c, (i, degree) in enumerate(zip(self.of_input, self.degree, strict=True)):
            value[:, i] += inputs[:, c] * basis[:, degree]
            if degree:
                slope[:, i] += inputs[:, c] * rate[:, degree]
        return value, slope


def states(book: ModeBook, q: int, trace: Floats, rows: Rows, along: Floats) -> tuple[Floats, Floats, Floats]:
    """Modal state y (k, 2nb), inputs (k, ni) and their rates at scaled times ``along`` of recorded steps."""
    mode = book.modes[q]
    distinct, place = np.unique(rows, return_inverse=True)
    state, inputs = started(mode, trace, distinct)
    steps = Steps(book, q, inputs)
    whole = steps.vectors(state, inputs)
    size = mode.feed.shape[1]
    y, value, slope = (
        np.zeros((len(rows), 2 * steps.nb)),
        np.zeros((len(rows), size)),
        np.zeros((len(rows), size)),
    )
    for part in chunks(len(rows), (TERMS + 1) * max(2 * steps.nb, 1)):
        z, s = whole[place[part]], along[part].copy()
        level = trace[rows[part], T_CLASS].astype(int)
        steps.halve(z, level, s)
        length = steps.lengths[level]
        value[part], slope[part] = steps.values(z, s, length)
        flowing = steps.series(z, length, s).sum(axis=0) + z[:, 2 * steps.nb :] @ steps.rest
        y[part] = flowing + value[part, : len(mode.beta)] @ mode.beta
    return y, value, slope
