"""Between the events: states at any time and energy integrals from the recorded steps of a run (numpy only).

A recorded step holds its start state and the nodal inputs the engine applied; together they are its vector z. Every
energy over a whole step is a quadratic form of z. Its matrix is made once for every contact mode and step length, by
Gauss quadrature where the length resolves the fastest mode, and by doubling from there: a step is two steps of half
its length. So the cost of a step does not depend on how many oscillations or decays it spans. A step that ends early,
or a time inside it, is reached by halving likewise. Nothing is interpolated: this is the engine's own solution.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from tarsus.core import _native, nodes
from tarsus.core.arrays import T_CLASS, T_FRACTION, T_JUMPS, T_LENGTH, T_MODE, T_TIME
from tarsus.core.book import NODES, ModeBook
from tarsus.core.modes import ContactMode, LinearSystem
from tarsus.core.nodes import N
from tarsus.core.recorded import RESOLVED, TERMS, Steps, chunks, gathered, started, states

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]

SHORT = 16  # Gauss points on a step that ended early

_POINTS, _WEIGHTS = legendre.leggauss(10)
_POINTS, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS
_POWERS = np.vander(_POINTS, TERMS + 1, increasing=True).T


@dataclass(frozen=True)
class Sampled:
    """State of a run at sample times: x, v (n, nt); gap, rate, resistive, smooth, pull (m, nt); held (m, nt) bool.

    resistive, smooth [N]: force on a free foot, as applied; pull [N]: structure's pull on a held foot. Of feet that know
    their way along the ground also contact, friction (m, nt): state as in `tarsus.base.events.FootState`, and friction on
    the foot along the ground [N].
    """

    x: Floats
    v: Floats
    gap: Floats
    rate: Floats
    resistive: Floats
    smooth: Floats
    pull: Floats
    held: NDArray[np.bool_]
    contact: Floats | None = None
    friction: Floats | None = None


@dataclass(frozen=True)
class Part:
    """One of several laws that act together: ``value(gap (k, m), rate (k, m), time (k,)) -> (k, m)`` is its force [N],
    or where it is resistive the momentum [N s] whose rate of change is its force."""

    resistive: bool
    value: Callable[[Floats, Floats, Floats], Floats]


@dataclass(frozen=True)
class Integrals:
    """Energies up to the end of each recorded step, cumulative [J]; time (nr,).

    work: of drive forces and of constant ones (weight); damping: vᵀ C v dissipated; resistive, smooth, friction: work of
    the ground's forces on the structure; parts (np, nr): what of it single laws have done. swing (m,) [m]: between the lowest
    and the highest gap of each foot at the starts of the steps.
    """

    time: Floats
    work: Floats
    damping: Floats
    resistive: Floats
    smooth: Floats
    friction: Floats
    parts: Floats
    swing: Floats


WHOLE = 5  # energies that are of all laws, in the order of Integrals


def integrate(system: LinearSystem, book: ModeBook, trace: Floats, parts: Sequence[Part] = ()) -> Integrals:
    """Energy integrals of a recorded run.

    trace (nr, width): rows as the kernel records them; parts: laws whose work is told apart.
    """
    work = np.zeros((WHOLE + len(parts), len(trace)))
    gaps = np.zeros((len(trace), system.normals.shape[1]))
    for q, mode in enumerate(book.modes):
        found = np.flatnonzero(trace[:, T_MODE] == q)
        for rows in (found[part] for part in chunks(len(found), trace.shape[1])):
            state, inputs = started(mode, trace, rows)
            x = (state @ mode.to_physical.T + mode.offset)[:, : len(system.mass)] + mode.of_places(inputs[:, :, 0])
            gaps[rows] = system.rest_gap + x @ system.normals
            split = _Split(system, book, q, parts)
            whole = trace[rows, T_FRACTION] == 1.0
            if parts:
                told = np.zeros((len(rows), len(parts) * system.normals.shape[1], N))
                told[whole] = split.coefficients(trace, rows[whole])
                inputs = np.concatenate([inputs, gathered(mode, told)], axis=1)
            energies = _Energies(system, book, q, inputs, [part.resistive for part in parts])
            work[:, rows] = energies.of(trace, rows, state)
            if parts:
                work[WHOLE:, rows[~whole]] = split.work(trace, rows[~whole])
    _jumps(work, trace[:, T_JUMPS], parts)
    total = np.cumsum(work, axis=1)
    time = trace[:, T_TIME] + trace[:, T_LENGTH] * trace[:, T_FRACTION]
    return Integrals(
        time, *total[:WHOLE], total[WHOLE:], np.ptp(gaps, axis=0) if len(gaps) else np.zeros(gaps.shape[1])
    )


def _jumps(work: Floats, jumps: Floats, parts: Sequence[Part]) -> None:
    """Add to the works of resistive laws in each step (., nr) what they do as their momenta jump between steps (nr,), to
    those told apart by what they do in the step: a jump is dissipated again at once, by the same laws.

    A step's momenta are those of its gaps at its nodes, to rounding, and less so where it ends between them; the next
    step begins with that of the gap. The law's force is the rate of change of the momentum, jumps included: what the
    step before has not known of the gap acts as an impulse. Strong laws dissipate its energy within a step.
    """
    resistive = [WHOLE + p for p, part in enumerate(parts) if part.resistive]
    share = np.divide(work[resistive], work[2], out=np.zeros((len(resistive), len(jumps))), where=work[2] != 0.0)
    work[resistive] += share * jumps
    work[2] += jumps


def sample(system: LinearSystem, book: ModeBook, trace: Floats, times: Floats) -> Sampled:
    """States and forces at ``times`` [s] by the recorded steps; times outside the run take its nearest recorded state.

    system: with the rest gaps and the gravity of the run.
    """
    n, m = system.normals.shape
    given = (np.ascontiguousarray(one, dtype=float) for one in (system.sources, trace, times))
    rows = _native.sample_modal(book.native, NODES, nodes, *given).T
    x, v, feet = np.split(rows, [n, 2 * n])
    gap, rate, resistive, smooth, pull, contact, *friction = feet.reshape(-1, m, len(times))
    along = (contact, friction[0]) if friction else ()
    return Sampled(x, v, gap, rate, resistive, smooth, pull, contact > 0.0, *along)


@dataclass(frozen=True)
class _Split:
    """What single laws do, told apart at times inside the steps of contact mode q."""

    system: LinearSystem
    book: ModeBook
    q: int
    parts: Sequence[Part]

    def at(self, trace: Floats, rows: Rows, along: Floats) -> tuple[Floats, Floats]:
        """Values (np, k, m) of the parts, and gap rate (k, m), at scaled times (k,) of recorded steps; values are zero
        for held feet."""
        n, m = self.system.normals.shape
        mode = self.book.modes[self.q]
        y, values, _ = states(self.book, self.q, trace, rows, along)
        physical = y @ mode.to_physical.T + mode.offset
        physical[:, :n] += mode.of_places(values)
        # a law is promised to be finite on the ground and above; below is rounding
        gap = np.maximum(self.system.rest_gap + physical[:, :n] @ self.system.normals, 0.0)
        rate = physical[:, n:] @ self.system.normals
        time = trace[rows, T_TIME] + along * trace[rows, T_LENGTH]
        values = np.array([part.value(gap, rate, time) for part in self.parts])
        values[:, :, [i for i in range(m) if mode.mask >> i & 1]] = 0.0
        return values, rate

    def coefficients(self, trace: Floats, rows: Rows) -> Floats:
        """Legendre coefficients (k, np m, 8) over whole steps; volts switch at their ends, so only the inside counts."""
        x, _ = legendre.leggauss(N)
        inside = [self.at(trace, rows, np.full(len(rows), 0.5 * (s + 1.0)))[0] for s in x]
        found = np.stack(inside, axis=-1) @ np.linalg.inv(legendre.legvander(x, N - 1)).T
        return np.moveaxis(found, 0, 1).reshape(len(rows), found.shape[0] * found.shape[2], N)

    def work(self, trace: Floats, rows: Rows) -> Floats:
        """Work (np, k) over steps that ended early; those are short."""
        x, weights = legendre.leggauss(SHORT)
        reach = trace[rows, T_FRACTION]
        inside = [self.at(trace, rows, 0.5 * (s + 1.0) * reach) for s in x]
        values = np.stack([value for value, _ in inside], axis=-1)  # (np, k, m, nodes)
        rate = np.stack([rate for _, rate in inside], axis=-1)
        basis = legendre.legvander(x, SHORT - 1)
        slope = np.stack([legendre.legval(x, legendre.legder(row)) for row in np.eye(SHORT)], axis=1)
        span = 0.5 * trace[rows, T_LENGTH] * reach
        out = np.zeros((len(self.parts), len(rows)))
        for p, part in enumerate(self.parts):
            if part.resistive:
                out[p] = (values[p] @ (slope @ np.linalg.inv(basis)).T * rate).sum(axis=1) @ weights
            else:
                out[p] = (values[p] * rate).sum(axis=1) @ weights * span
        return out


class _Energies:
    """Energy integrals of the steps of one contact mode, as quadratic forms of their vectors."""

    def __init__(
        self, system: LinearSystem, book: ModeBook, q: int, inputs: Floats, resistive: Sequence[bool]
    ) -> None:
        """resistive (np,): whether each part told apart is; its m inputs follow those of the mode."""
        self.resistive = resistive
        self.count = WHOLE + len(resistive)
        self.system = system
        self.inputs = inputs
        self.steps = Steps(book, q, inputs)
        n, m = system.normals.shape
        mode = self.steps.mode
        self.velocity = mode.to_physical[n:].T
        self.loads = np.column_stack([system.loads, system.constant])
        self.drives = slice(2 * m, mode.feed.shape[1])
        used = set(self.steps.of_input.tolist())
        self.free = np.flatnonzero(~mode.on_ground)
        self.sliding = np.flatnonzero(mode.on_ground & ~mode.sticking)
        present = (
            any(i in used for i in range(2 * m, mode.feed.shape[1])) and bool(self.loads.any()),
            bool(system.damping.any()),
            any(i in used for i in range(m)),
            any(m + i in used for i in self.free),
            any(m + i in used for i in self.sliding),
            *(any(i in used for i in self.share(mode, p)) for p in range(len(resistive))),
        )
        self.present = [f for f in range(self.count) if present[f]]
        self._forms: dict[int, Floats] = {}

    def share(self, mode: ContactMode, p: int) -> range:
        """Inputs of part p."""
        m = self.system.normals.shape[1]
        first = mode.feed.shape[1] + p * m
        return range(first, first + m)

    def of(self, trace: Floats, rows: Rows, state: Floats) -> Floats:
        """Energies (count, k) of recorded steps."""
        steps = self.steps
        out = np.zeros((self.count, len(rows)))
        z = steps.vectors(state, self.inputs)
        level = trace[rows, T_CLASS].astype(int)
        whole = trace[rows, T_FRACTION] == 1.0
        for k in set(level[whole].tolist()):
            members = np.flatnonzero(whole & (level == k))
            out[:, members] = self.apply(k, z[members])
        ended = np.flatnonzero(~whole)
        for part in chunks(len(ended), (TERMS + 1) * max(2 * steps.nb, 1)):
            members = ended[part]
            out[:, members] = self.partial(z[members], level[members], trace[rows[members], T_FRACTION])
        return out

    def apply(self, k: int, z: Floats) -> Floats:
        """Energies (count, k) of whole steps of class k."""
        out = np.zeros((self.count, len(z)))
        for f, form in zip(self.present, self.forms(k), strict=True):
            out[f] = np.einsum("ra,ra->r", z @ form, z)
        return out

    def partial(self, z: Floats, level: Rows, along: Floats) -> Floats:
        """Energies (count, k) of steps up to their scaled times ``along``."""
        out = np.zeros((self.count, len(z)))
        along = along.copy()

        def passed(k: int, members: Rows, half: Floats) -> None:
            out[:, members] += self.apply(k, half)

        self.steps.halve(z, level, along, passed)
        for f, (a, b, weight) in self.factors(z, self.steps.lengths[level], along).items():
            out[f] += weight * np.einsum("gri,gri,g->r", a, b, _WEIGHTS)
        return out

    def factors(self, z: Floats, length: Floats, along: Floats) -> dict[int, tuple[Floats, Floats, Floats]]:
        """Power of each energy at Gauss points of [0, along], as two factors (10, k, ·), and the span [s] (k,)."""
        steps, m = self.steps, self.system.normals.shape[1]
        series = steps.series(z, length, along) @ self.velocity
        shape = (len(_POINTS), len(z))
        v = (_POWERS.T @ series.reshape(TERMS + 1, -1)).reshape(*shape, -1) + z[:, 2 * steps.nb :] @ steps.drift
        value, slope = np.zeros((2, *shape, steps.count))
        for g, s in enumerate(_POINTS):
            value[g], slope[g] = steps.values(z, s * along, length)
        beta = steps.mode.beta @ self.velocity
        if 2 in self.present:
            v += value[:, :, :m] @ beta
        rate = v @ self.system.normals
        span = along * length
        pairs = {
            0: lambda: (value[:, :, self.drives], v @ self.loads),
            1: lambda: (v @ self.system.damping, v),
            2: lambda: (slope[:, :, :m], rate),
            3: lambda: (value[:, :, m + self.free], rate[:, :, self.free]),
            4: lambda: (value[:, :, m + self.sliding], v @ self.system.constraints[:, m + self.sliding]),
        }
        out = {f: (*pairs[f](), span) for f in self.present if f < WHOLE}
        for f in self.present[len(out) :]:
            of = slope if self.resistive[f - WHOLE] else value
            out[f] = (of[:, :, self.share(steps.mode, f - WHOLE)], rate, span)
        return out

    def forms(self, k: int) -> Floats:
        """Matrices (present, size, size) of the energies over a whole step of class k."""
        steps = self.steps
        first = k
        while (
            first not in self._forms
            and steps.lengths[first] * steps.rate > RESOLVED
            and first < len(steps.lengths) - 1
        ):
            first += 1
        if first not in self._forms:
            self._forms[first] = self.quadrature(float(steps.lengths[first]))
        for c in range(first, k, -1):
            right, half = steps.right(c), self._forms[c]
            self._forms[c - 1] = steps.left @ half @ steps.left.T + right @ half @ right.T
        return self._forms[k]

    def quadrature(self, length: float) -> Floats:
        """The forms of a step length that resolves every mode."""
        size = self.steps.size
        factors = self.factors(np.eye(size), np.full(size, length), np.ones(size))
        out = np.zeros((len(self.present), size, size))
        for p, (a, b, weight) in enumerate(factors.values()):
            out[p] = np.einsum("gai,gbi,g->ab", a, b, _WEIGHTS, optimize=True) * weight[0]
        return out
