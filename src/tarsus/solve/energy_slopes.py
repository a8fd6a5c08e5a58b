"""Derivatives of the terms of a run's energy ledger: what the engine has summed up, impacts, and what is stored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.core.arrays import E_ADHESION, E_ENERGY

if TYPE_CHECKING:
    from tarsus.solve.gradients import GradientRun
    from tarsus.solve.lanes import Tangents
    from tarsus.solve.tangents import Entering

__all__ = ["energy_slopes"]

Floats = NDArray[np.float64]


def energy_slopes(run: GradientRun, given: Entering, found: Tangents) -> Mapping[str, Floats]:
    """Derivatives (P,) of the ledger's terms by name, and of the work of laws that act alone of their kind.

    found: with a sample at the run's end, and with energies.
    """
    work, damping, resistive, smooth, *rubbed = found.energies
    if run.plan.legs is not None:
<<<<<<< HEAD
        resistive = -resistive
    friction = rubbed[0] if rubbed else np.zeros(len(given.paths))
=======
        work, damping, film, smooth, friction = found.energies
        resistive = -film
    else:
        count = len(given.paths)
        of = [_by_structure if p in given.structure else _integrals for p in range(count)]
        totals = np.array([one(run, given, found, p) for p, one in enumerate(of)]).reshape(count, KINDS).T
        work, damping, resistive, smooth, rubbed = totals + _jumps(run, found)
        friction = -rubbed
>>>>>>> slide
    losses = found.events[:, E_ENERGY], found.events[:, E_ADHESION]
    impacts, adhesion = (one.sum(axis=0) if len(one) else np.zeros(len(work)) for one in losses)
    kinetic, elastic = _stored(run, given, found)
    out = {
        "work_in": work, "damping": damping, "friction": friction, "kinetic": kinetic,
        "elastic": elastic, "impacts": impacts - adhesion, "adhesion": adhesion,
    }  # fmt: skip
    for hook, total in (("momentum", resistive), ("force", smooth)):
        names = list(run.scene.ground.acting_on(hook))
        if len(names) == 1:
            out[names[0]] = total
    return out


<<<<<<< HEAD
=======
KINDS = 5
"""Energies of recorded steps: work, damping, and the work of resistive forces, of smooth ones and of friction."""


def _energies(system: LinearSystem, book: ModeBook, trace: Floats) -> Floats:
    """Those (KINDS,) of recorded steps."""
    done = integrate(system, book, trace)
    kinds = (done.work, done.damping, done.resistive, done.smooth, done.friction)
    return np.array([one[-1] if len(one) else 0.0 for one in kinds])


def _integrals(run: GradientRun, given: Entering, found: Tangents, p: int) -> Floats:
    """Derivatives (KINDS,) of the energies of all steps, the moments at which they end as they are."""
    system, book, trace = run.plan.system, run.raw.book.book, run.raw.trace
    moved = _as_recorded(run, found.steps[..., p])
    body = slice(TRACE_HEAD, None)
    largest = np.abs(moved[:, body]).max(initial=0.0)
    sources = given.data.sources[:, p]
    out = np.zeros(KINDS)
    if largest > 0.0 or sources.any():
        size = np.abs(trace[:, TRACE_HEAD : TRACE_HEAD + 2 * len(system.mass)]).max(initial=0.0)
        part = size / largest if largest > 0.0 and size > 0.0 else 1.0
        sides = []
        for sign in (1.0, -1.0):
            beside = replace(
                system, rest_gap=system.rest_gap + sign * part * sources[:-1],
                gravity=system.gravity + sign * part * float(sources[-1]),
            )  # fmt: skip
            rows = trace.copy()
            rows[:, body] += sign * part * moved[:, body]
            sides.append(_energies(beside, ModeBook(beside, book.lengths, shared=book), rows))
        out += (sides[0] - sides[1]) / (2.0 * part)
    return out


POINTS, TURN = 12, 4.0
"""Gauss points of a part of a step in which no mode turns or decays by more than `TURN`: of products 1e-13 are left."""
AT_ONCE = 20_000
"""Samples at a time, of some kilobytes each."""


def _by_structure(run: GradientRun, given: Entering, found: Tangents, p: int) -> Floats:
    """The same along a direction that changes the structure, by Gauss quadrature of how the powers change; such a robot
    does not slide."""
    system, book, trace = run.plan.system, run.raw.book.book, run.raw.trace
    change, m, moved = given.structure[p], run.plan.feet, _as_recorded(run, found.steps[..., p])
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    rates = np.array([np.abs(mode.blocks).sum(axis=(1, 2)).max(initial=0.0) for mode in book.modes])
    spans = trace[:, T_LENGTH] * trace[:, T_FRACTION]
    parts = np.maximum(np.ceil(rates[trace[:, T_MODE].astype(int)] * spans / TURN), 1.0).astype(int)
    step = np.repeat(np.arange(len(trace)), parts)
    piece = np.arange(len(step)) - np.repeat(np.cumsum(parts) - parts, parts)
    along = (piece[:, None] + 0.5 * (points + 1.0)) * (trace[step, T_FRACTION] / parts[step])[:, None]
    share = (0.5 * weights * (spans / parts)[step, None]).ravel()
    step, along = np.repeat(step, POINTS), along.ravel()
    out = np.zeros(KINDS)
    for first in range(0, len(step), AT_ONCE):
        rows, s = step[first : first + AT_ONCE], along[first : first + AT_ONCE]
        times = trace[rows, T_TIME] + s * trace[rows, T_LENGTH]
        at = sample(system.sources, book, trace, times)
        slopes = run.sampled(times)[..., p].T
        v, (dv, _, drate, dresistive, dsmooth, _) = at.v, _parts(slopes, len(system.mass), m)
        own, more = (_drives(run, one[rows], s) for one in (trace, moved))
        force = system.loads @ own + system.constant[:, None]
        pushed = system.loads @ more + change.loads @ own
        pushed += (given.data.sources[-1, p] * system.weight + system.gravity * change.weight)[:, None]
        lost = system.damping @ v
        powers = (
            pushed * v + force * dv,
            dv * (lost + system.damping.T @ v) + v * (change.damping @ v),
            ~at.held * (dresistive * at.rate + at.resistive * drate),
            ~at.held * (dsmooth * at.rate + at.smooth * drate),
        )
        out[: len(powers)] += [one.sum(axis=0) @ share[first : first + AT_ONCE] for one in powers]
    return out


def _parts(rows: Floats, n: int, m: int) -> list[Floats]:
    """Derivatives of velocities, gaps, rates, resistive and smooth forces and pulls, of samples (2n + 5m, k)."""
    return np.split(rows[n:], [n, *(n + m * np.arange(1, 5))])


def _drives(run: GradientRun, rows: Floats, along: Floats) -> Floats:
    """Forces (nd, k) of the drives at scaled times (k,) of recorded steps."""
    first = TRACE_HEAD + 2 * len(run.plan.system.mass) + 2 * run.plan.feet * N
    nodal = rows[:, first : first + run.plan.drives * N].reshape(len(rows), run.plan.drives, N)
    return np.einsum("kdj,kj->dk", nodal, interpolation(along))


def _as_recorded(run: GradientRun, steps: Floats) -> Floats:
    """Derivatives of steps as the engine tells them, in the places of recorded ones."""
    trace, n = run.raw.trace, len(run.plan.system.mass)
    inputs = N * (2 * run.plan.feet + run.plan.drives + 1)
    stride = (steps.shape[1] - 1 - inputs) // 2
    out = np.zeros_like(trace)
    out[:, TRACE_HEAD + 2 * n :] = steps[:, 1 + 2 * stride :]
    for q, mode in enumerate(run.raw.book.book.modes):
        rows, nb = np.flatnonzero(trace[:, T_MODE] == q), len(mode.blocks)
        out[rows, TRACE_HEAD : TRACE_HEAD + nb] = steps[rows, 1 : 1 + nb]
        out[rows, TRACE_HEAD + nb : TRACE_HEAD + 2 * nb] = steps[rows, 1 + stride : 1 + stride + nb]
    return out


def _jumps(run: GradientRun, found: Tangents) -> Floats:
    """What moving ends of steps add (KINDS, P): the powers just before them less those just after, times how they move."""
    trace, moved = run.raw.trace, found.steps[:, 0]
    out = np.zeros((KINDS, moved.shape[1]))
    for r in np.flatnonzero(np.abs(moved).max(axis=1, initial=0.0) > 0.0):
        before = _powers(run, trace[r], np.inf)
        after = _powers(run, trace[r + 1], -np.inf) if r + 1 < len(trace) else np.zeros(KINDS)
        out += (before - after)[:, None] * moved[r]
    return out


def _powers(run: GradientRun, row: Floats, time: float) -> Floats:
    """Power (KINDS,) of each energy at the start or end of a recorded step."""
    system, m = run.plan.system, run.plan.feet
    at = sample(system.sources, run.raw.book.book, row[None], np.array([time]))
    values = row[TRACE_HEAD + 2 * len(system.mass) :].reshape(-1, N) @ interpolation(
        np.array([row[T_FRACTION] if time > 0.0 else 0.0])
    ).T  # fmt: skip
    v, free = at.v[:, 0], ~at.held[:, 0]
    force = system.loads @ values[2 * m : 2 * m + run.plan.drives, 0] + system.constant
    return np.array(
        [
            force @ v, v @ system.damping @ v, (at.resistive[:, 0] * at.rate[:, 0])[free].sum(),
            (at.smooth[:, 0] * at.rate[:, 0])[free].sum(),
            0.0 if system.tangents is None or at.friction is None else at.friction[:, 0] @ (system.tangents.T @ v),
        ]
    )  # fmt: skip


>>>>>>> slide
def _stored(run: GradientRun, given: Entering, found: Tangents) -> tuple[Floats, Floats]:
    """Derivatives (P,) of the changes of kinetic and elastic energy."""

    system, n = run.plan.system, len(run.plan.system.mass)
    first, last = run.plan.initial, run.motion.last
    starts, ends = given.data.initial, found.samples[0, : 2 * n]
    kinetic = last[n:] @ system.mass @ ends[n:] - first[n:] @ system.mass @ starts[n:]
    elastic = last[:n] @ system.stiffness @ ends[:n] - first[:n] @ system.stiffness @ starts[:n]
    for p, change in given.structure.items():
        for sign, z in ((0.5, last), (-0.5, first)):
            kinetic[p] += sign * z[n:] @ change.mass @ z[n:]
            elastic[p] += sign * z[:n] @ change.stiffness @ z[:n]
    return kinetic, elastic
