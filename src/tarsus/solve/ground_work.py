"""The work of moving ground on a robot: what of all work in is not that of drives and weight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import counted
from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.model.motion import Base
from tarsus.plan.moving import shifts_of

if TYPE_CHECKING:
    from tarsus.model.drive.pieces import Pieces
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
TURN = 3.0
"""Angle [rad] that the fastest mode turns within a panel of 8 nodes: these integrate it to 1e-9 of itself."""
MOST = 50_000
"""Panels of a run, about: faster modes than these resolve have died out by then, or the split is as much less exact."""


def ground_work(run: Run, time: Floats, places: Floats, work: Floats) -> Floats:
    """Work [J] of the ground in its own frame, up to times (nt,) [s] at which the displacements are places (n, nt) and
    all work of drives, weight and ground is ``work`` (nt,).

    Of drives that hold their forces it is what is left of all work, exactly. Otherwise the power of the ground is
    integrated, and what is left is theirs: the account closes as it did.
    """
    if run.scene.ground.motion is None:
        return np.zeros_like(work)
    acting, drives = run.motion.acting, len(run.scene.robot.drives)
    channels = [acting.rows.pool[c] for c in acting.rows.channels[0, : acting.plan.drives]]
    if all(one.span == 0.0 for one in channels[:drives]):
        system = acting.plan.system.at(acting.rows.sources[0])
        n = len(system.mass)
        held = np.array([one.coef[0, 0] for one in channels[:drives]])
        force = system.constant + product(system.loads[:, :drives], held)
        return np.asarray(work - force @ (places - acting.rows.initial[0, :n, None]))
    return _integrated(run, time, channels[drives:])


def _integrated(run: Run, time: Floats, channels: list[Pieces]) -> Floats:
    """The integral of the ground's forces times the rates of what they act on, between events and pieces."""
    end, plan = run.end_time, run.motion.acting.plan
    ends = [np.array([0.0, end]), time, run.events["time"], *(_starts(one, end) for one in channels)]
    edges = np.unique(np.concatenate(ends))
    edges = edges[edges <= end]
    width = max(TURN / plan.rate, end / MOST)
    counts = np.ceil(np.diff(edges) / width).astype(np.intp)
    share = counted(counts) / np.repeat(counts, counts)
    step = np.repeat(np.diff(edges) / counts, counts)
    begin = np.repeat(edges[:-1], counts) + share * np.repeat(np.diff(edges), counts)
    nodes = (begin[:, None] + 0.5 * step[:, None] * (_NODES + 1.0)).ravel()
    forces = run.motion.acting.drives(nodes)[-len(channels) :]
    rates = plan.system.loads[:, -len(channels) :].T @ run.motion.states(nodes).v
    power = (forces * rates).sum(axis=0).reshape(-1, len(_NODES))
    done = np.concatenate([[0.0], np.cumsum(0.5 * step * (power @ _WEIGHTS))])
    return np.asarray(done[np.concatenate([[0], np.cumsum(counts)])[np.searchsorted(edges, time)]])


def _starts(pieces: Pieces, end: float) -> Floats:
    """Times [s] until an end at which pieces start, each time they come round."""
    if pieces.loop < 0:
        return pieces.start[pieces.start < end]
    own = pieces.start[pieces.loop :]
    rounds = np.arange(max(int(np.ceil((end - own[0]) / (own[-1] - own[0]))), 1))
    found = np.concatenate([pieces.start[: pieces.loop], (own[:-1] + rounds[:, None] * (own[-1] - own[0])).ravel()])
    return np.asarray(found[found < end])


def laboratory_work(run: Run) -> float:
    """Work [J] of moving ground on a robot in the laboratory, where all of it moves as fast as the ground besides.

    From the work in the ground's frame and the states at the ends alone. Raises InputError for a base that stays.
    """
    motion = run.scene.ground.motion
    if motion is None:
        return 0.0
    if motion.base is Base.STAYS:
        raise InputError(
            ["ground.motion.base: the work in the laboratory is known for a base that moves with the ground"]
        )
    acting = run.motion.acting
    system = acting.plan.system.at(acting.rows.sources[0])
    n, ends = len(system.mass), np.array([0.0, run.end_time])
    places, speeds = np.zeros((2, n)), np.zeros((2, n))
    for direction, shift in shifts_of(run.scene).items():
        way = run.scene.robot.structure.translation(direction)
        assert way is not None  # checked by Scene
        places += np.outer(shift.at(ends), way)
        speeds += np.outer(shift.at(ends, 1), way)
    own = np.array([acting.rows.initial[0, n:], run.motion.last[n:]])
    carried = [float(s @ system.mass @ (v + 0.5 * s)) for s, v in zip(speeds, own, strict=True)]
    lifted = float(system.constant @ (places[1] - places[0]))
    return run.ledger.ground + carried[1] - carried[0] - lifted
