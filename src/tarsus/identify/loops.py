"""Static records: the drive's force behind a slow motion, in the air and on the ground.

At rest ``x = by_drive F + by_contact N``: displacements of the points from the drive's force F and the ground's
force N on the foot. In the air N = 0; on the ground two points tell both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.identify.foot import FootModel, response
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts
from tarsus.impacts.detection import STILL
from tarsus.model.drive.laws import LinearForce, PrandtlIshlinskii, VoltageLaw

SETTLING = 0.08
"""Time [s] after a contact is made or broken in which a static record is not used."""
AWAY = 10.0
"""Own gaps of the device from which on the ground counts as away: a film damps a thousandth of what it does there."""


@dataclass(frozen=True)
class Block:
    """One straight run of the voltage in one record: its samples that are used, and which of them are in the air.

    source: the trace; index (n,) of its samples; free (n,) bool.
    """

    source: Trace
    index: NDArray[np.intp]
    free: NDArray[np.bool_]


def blocks_of(trace: Trace, foot: str, level: float | None) -> tuple[list[Block], int]:
    """A static record cut at the turning points of its voltage, and how many of its samples are not used.

    Parameters
    ----------
    trace
        The record.
    foot
        Name of the foot's point.
    level
        Displacement of the foot in contact [m], None if it never touches.
    """
    k = trace.point(foot)
    free = np.ones(len(trace.time), dtype=bool)
    used = np.ones(len(trace.time), dtype=bool)
    if level is not None:
        free = trace.x[k] > level + STILL * trace.noise_x[k]
        # one sample alone does not make or break a contact
        free[1:-1] = (free[1:-1] & (free[:-2] | free[2:])) | (free[:-2] & free[2:])
        count = round(SETTLING / trace.step)
        for change in np.flatnonzero(free[1:] != free[:-1]):
            used[max(change - 1, 0) : change + count] = False
    moves = np.sign(np.round(np.diff(trace.volts, prepend=trace.volts[0]) / 1e-3))
    turns = np.flatnonzero(moves[1:] != moves[:-1]) + 1
    edges = np.unique(np.concatenate([[0], turns, [len(moves)]]))
    edges = edges[np.concatenate([[True], np.diff(edges) > 3])]
    edges[-1] = len(moves)
    out = []
    for first, last in pairwise(edges):
        index = np.arange(first, last)
        index = index[used[first:last]]
        if len(index):
            out.append(Block(trace, index, free[index]))
    return out, int(np.count_nonzero(~used))


def law_names(law: VoltageLaw) -> tuple[str, ...]:
    """The parameters of a law in which its force is linear, its constant first.

    Raises
    ------
    InputError
        For a law of another kind.
    """
    if isinstance(law, PrandtlIshlinskii):
        weights = (f"weights.{i}" for i in range(len(law.weights)))
        return ("constant", "linear", "quadratic", "cubic", *weights)
    if isinstance(law, LinearForce):
        return "offset", "gain"
    raise InputError("the drive's law can be identified as linear or as a Prandtl-Ishlinskii operator only")


def basis_of(law: VoltageLaw, volts: Floats, history: tuple[float, ...]) -> Floats:
    """Force (ns, p) per unit of each parameter of `law_names` at the samples (ns,) of a record [V]."""
    names, along = law_names(law), Volts.of(volts, 1)
    units = (with_values(law, dict.fromkeys(names, 0.0) | {name: 1.0}) for name in names)
    return np.column_stack([along.force(unit, history) for unit in units])


def moments(rows: Floats, block: NDArray[np.intp], trace: NDArray[np.intp], count: int) -> Floats:
    """Second moments (count, r, r) by block of samples (n, r) about the means of their records, whose zeros then no
    longer matter; block, trace (n,): numbers of the block and of the record each sample is of."""
    rows = rows.copy()
    for number in np.unique(trace):
        rows[trace == number] -= rows[trace == number].mean(axis=0)
    return np.array([rows[block == k].T @ rows[block == k] for k in range(count)])


def across(vector: Floats) -> Floats:
    """Orthonormal rows (n - 1, n) across a vector (n,)."""
    return np.linalg.svd(vector[None, :])[2][1:]


def calmed(model: FootModel, trace: Trace) -> Trace:
    """A record without its ringing (displacements less what they are beyond ``by_drive F``), by the model's structure
    and drive; as it is where the ground is near, whose film and contacts end the ringing.

    Every corner of a slow voltage, where its slope changes by dV', sets each mode ringing by ``dV' / omega`` volts. The
    mode rings for about ``1 / (zeta omega)``: with a soft robot as long as a straight run of its loops, and a mean over
    few such runs does not average it out."""
    if trace.gap is None or trace.gap < AWAY * model.gap:
        return trace
    volts = trace.between
    force = volts.force(model.law, model.history)
    force = force - force[0]
    moved = response(model.flow, np.outer(model.inputs[:, 0], force), trace.step / volts.substeps)
    still = np.outer(model.by_drive, force)
    return replace(trace, x=trace.x - (model.rows @ moved[: len(model.row)] - still)[:, :: volts.substeps])
