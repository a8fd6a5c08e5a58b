"""Between the events: states at any time and energy integrals from the recorded steps of a run (numpy only).

A recorded step holds its start state and the nodal inputs the engine applied. Every step is cut into panels short
enough for its fastest mode, and each panel's Taylor polynomial is evaluated at Gauss points (energies) and sample
times (series). Nothing is interpolated: this is the engine's own solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.core.arrays import T_FRACTION, T_LENGTH, T_MODE, T_TIME, TRACE_HEAD
from tarsus.core.modes import ContactMode, LinearSystem
from tarsus.core.nodes import MONOMIAL, N

Floats = NDArray[np.float64]

PANEL = 2.0  # largest |T| h of a panel
TERMS = 26  # Taylor terms: 2^26/26! = 1.7e-19
CHUNK = 4_000_000  # floats of Taylor coefficients held at once

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_POINTS, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS
_BINOMIAL = np.array(
    [
        [
            float(np.prod(np.arange(c - k + 1, c + 1)) / np.prod(np.arange(1, k + 1))) if k <= c else 0.0
            for c in range(N)
        ]
        for k in range(N)
    ]
)


@dataclass(frozen=True)
class Sampled:
    """State of a run at sample times: x, v (n, nt); gap, rate, film, smooth, pull (m, nt); held (m, nt) bool.

    film, smooth [N]: resistive and smooth force on a free foot, as applied; pull [N]: structure's pull on a held foot.
    """

    x: Floats
    v: Floats
    gap: Floats
    rate: Floats
    film: Floats
    smooth: Floats
    pull: Floats
    held: NDArray[np.bool_]


@dataclass(frozen=True)
class Integrals:
    """Energies up to the end of each recorded step, cumulative [J]; time (nr,).

    drives, constant: work of drive forces and of constant ones (weight); damping: vᵀ C v dissipated;
    film, smooth: work of the ground's resistive and smooth forces on the structure; electrostatic: the part of
    ``smooth`` that the caller's split assigns to electrostatics.
    """

    time: Floats
    drives: Floats
    constant: Floats
    damping: Floats
    film: Floats
    smooth: Floats
    electrostatic: Floats


@dataclass(frozen=True)
class _Panels:
    """Panels of one contact mode: Taylor series (np, TERMS, 2nb) in the panel's scaled time, inputs (np, ni, 8)."""

    row: NDArray[np.int64]
    start: Floats
    length: Floats
    series: Floats
    power: Floats


def replay(
    system: LinearSystem,
    modes: list[ContactMode],
    trace: Floats,
    times: Floats,
    electrostatic: Callable[[Floats, Floats, Floats], Floats] | None = None,
) -> tuple[Sampled, Integrals]:
    """Series at the sorted ``times`` [s] and energy integrals of a recorded run.

    trace (nr, width): rows as the kernel records them. Times outside the run take its nearest recorded state.
    electrostatic(gap (k, m), rate (k, m), time (k,)) -> force (k, m) [N] splits the smooth forces.
    """
    n, m = system.normals.shape
    nt = len(times)
    sampled = Sampled(
        *(np.zeros((n, nt)) for _ in range(2)),
        *(np.zeros((m, nt)) for _ in range(5)),
        np.zeros((m, nt), dtype=bool),
    )
    work = np.zeros((6, len(trace)))
    owner = np.clip(np.searchsorted(trace[:, T_TIME], times, side="right") - 1, 0, len(trace) - 1)
    for q, mode in enumerate(modes):
        rows = np.flatnonzero(trace[:, T_MODE] == q)
        rate = float(np.linalg.norm(mode.blocks, ord=2, axis=(1, 2)).max()) if len(mode.blocks) else 0.0
        spans = trace[rows, T_LENGTH] * trace[rows, T_FRACTION]
        counts = np.maximum(np.ceil(spans * rate / PANEL), 1).astype(int)
        size = np.cumsum(counts) * TERMS * max(2 * len(mode.blocks), 1)
        for part in np.split(
            rows, np.searchsorted(size, np.arange(CHUNK, size[-1], CHUNK)) if len(size) else []
        ):
            if not len(part):
                continue
            panels = _expand(mode, trace, part, rate, n)
            work[:, part] += _integrate(system, mode, panels, part, len(trace), electrostatic)
            chosen = np.flatnonzero(np.isin(owner, part))
            if len(chosen):
                _sample(system, mode, panels, times, owner, chosen, sampled)
    return sampled, Integrals(
        trace[:, T_TIME] + trace[:, T_LENGTH] * trace[:, T_FRACTION], *np.cumsum(work, axis=1)
    )


def _expand(mode: ContactMode, trace: Floats, rows: NDArray[np.int64], rate: float, n: int) -> _Panels:
    nb = len(mode.blocks)
    ni = mode.feed.shape[1]
    length = trace[rows, T_LENGTH]
    span = length * trace[rows, T_FRACTION]
    counts = np.maximum(np.ceil(span * rate / PANEL), 1).astype(int)
    state = trace[rows, TRACE_HEAD : TRACE_HEAD + 2 * nb].copy()
    head = TRACE_HEAD + 2 * n
    power = trace[rows, head : head + ni * N].reshape(len(rows), ni, N) @ MONOMIAL.T
    parts: list[_Panels] = []
    for p in range(counts.max()):
        live = np.flatnonzero(counts > p)
        size = span[live] / counts[live]
        shift = p * size / length[live]
        # inputs about the panel's start, in its own scaled time
        powers = shift[:, None, None] ** np.maximum(np.arange(N)[None, :] - np.arange(N)[:, None], 0)
        moved = np.einsum("ric,kc,rkc->rik", power[live], _BINOMIAL, powers)
        moved *= (size / length[live])[:, None, None] ** np.arange(N)
        series = _taylor(mode, state[live], moved, size)
        state[live] = series.sum(axis=1)
        parts.append(_Panels(rows[live], trace[rows[live], T_TIME] + p * size, size, series, moved))
    joined = [
        np.concatenate([getattr(part, f) for part in parts])
        for f in ("row", "start", "length", "series", "power")
    ]
    order = np.lexsort((joined[1], joined[0]))
    return _Panels(*(x[order] for x in joined))


def _taylor(mode: ContactMode, state: Floats, power: Floats, size: Floats) -> Floats:
    nb = len(mode.blocks)
    series = np.zeros((len(state), TERMS, 2 * nb))
    series[:, 0] = state
    b = mode.blocks
    for c in range(TERMS - 1):
        y1, y2 = series[:, c, :nb], series[:, c, nb:]
        grown = np.concatenate([b[:, 0, 0] * y1 + b[:, 0, 1] * y2, b[:, 1, 0] * y1 + b[:, 1, 1] * y2], axis=1)
        if c < N:
            grown = grown + power[:, :, c] @ mode.inputs
        series[:, c + 1] = grown * (size / (c + 1))[:, None]
    return series


def _evaluate(
    mode: ContactMode, panels: _Panels, index: NDArray[np.int64], s: Floats
) -> tuple[Floats, Floats, Floats]:
    """Modal state y (k, 2nb), inputs (k, ni) and their time derivatives at scaled times s of panels ``index``."""
    w = panels.series[index, TERMS - 1]
    for c in range(TERMS - 2, -1, -1):
        w = w * s[:, None] + panels.series[index, c]
    value, slope = np.zeros((2, len(index), mode.feed.shape[1]))
    for c in range(N - 1, -1, -1):
        slope = slope * s[:, None] + value
        value = value * s[:, None] + panels.power[index, :, c]
    slope = slope / np.where(panels.length[index] > 0.0, panels.length[index], np.inf)[:, None]
    return w + value[:, : len(mode.beta)] @ mode.beta, value, slope


def _integrate(
    system: LinearSystem, mode: ContactMode, panels: _Panels, rows: NDArray[np.int64], total: int,
    electrostatic: Callable[[Floats, Floats, Floats], Floats] | None,
) -> Floats:  # fmt: skip
    n, m = system.normals.shape
    out = np.zeros((6, total))
    index = np.arange(len(panels.row))
    for s, weight in zip(_POINTS, _WEIGHTS, strict=True):
        y, value, slope = _evaluate(mode, panels, index, np.full(len(index), s))
        physical = y @ mode.to_physical.T + mode.offset
        v = physical[:, n:]
        rate = v @ system.normals
        scale = weight * panels.length
        power = [
            np.einsum("kd,kd->k", value[:, 2 * m : -1], v @ system.loads),
            v @ system.constant,
            np.einsum("ki,ij,kj->k", v, system.damping, v),
            np.einsum("kf,kf->k", slope[:, :m], rate),
            np.einsum("kf,kf->k", value[:, m : 2 * m], rate),
        ]
        if electrostatic is not None:
            gap = system.rest_gap + physical[:, :n] @ system.normals
            held = [i for i in range(m) if mode.mask >> i & 1]
            gap[:, held], rate[:, held] = 0.0, 0.0
            force = electrostatic(gap, rate, panels.start + s * panels.length)
            power.append(np.einsum("kf,kf->k", force, rate))
        for term, density in zip(out, power, strict=False):
            np.add.at(term, panels.row, scale * density)
    return out[:, rows]


def end_states(initial: Floats, modes: list[ContactMode], trace: Floats, n: int) -> tuple[Floats, Floats]:
    """Displacements and velocities (2n,) at the start and at the end of a recorded run."""
    if not len(trace):
        return initial, initial
    row = trace[-1:]
    mode = modes[int(row[0, T_MODE])]
    rate = float(np.linalg.norm(mode.blocks, ord=2, axis=(1, 2)).max()) if len(mode.blocks) else 0.0
    panels = _expand(mode, row, np.array([0]), rate, n)
    y, _, _ = _evaluate(mode, panels, np.array([len(panels.row) - 1]), np.ones(1))
    return initial, y[0] @ mode.to_physical.T + mode.offset


def _sample(
    system: LinearSystem, mode: ContactMode, panels: _Panels, times: Floats, owner: NDArray[np.int64],
    chosen: NDArray[np.int64], out: Sampled,
) -> None:  # fmt: skip
    n, m = system.normals.shape
    # panels are sorted by row, then time: find the last panel of the owning row that starts at or before the time
    first = np.searchsorted(panels.row, owner[chosen], side="left")
    count = np.searchsorted(panels.row, owner[chosen], side="right") - first
    size = panels.length[first]
    along = (times[chosen] - panels.start[first]) / np.where(size > 0.0, size, np.inf)
    step = np.clip(np.floor(along), 0, count - 1).astype(int)
    index = first + step
    s = np.clip(along - step, 0.0, 1.0)
    y, value, slope = _evaluate(mode, panels, index, s)
    physical = y @ mode.to_physical.T + mode.offset
    out.x[:, chosen], out.v[:, chosen] = physical[:, :n].T, physical[:, n:].T
    out.gap[:, chosen] = (system.rest_gap + physical[:, :n] @ system.normals).T
    out.rate[:, chosen] = (physical[:, n:] @ system.normals).T
    held = np.array([bool(mode.mask >> i & 1) for i in range(m)], dtype=bool)
    out.held[:, chosen] = held[:, None]
    out.gap[np.ix_(held, chosen)] = 0.0
    out.rate[np.ix_(held, chosen)] = 0.0
    out.film[:, chosen] = slope[:, :m].T
    out.smooth[:, chosen] = value[:, m : 2 * m].T
    w = y - value[:, :m] @ mode.beta
    pull = w @ mode.outputs[:m].T + value @ mode.feed[:m].T + slope @ mode.feed_rate[:m].T
    out.pull[:, chosen] = np.where(held[:, None], pull.T, 0.0)
