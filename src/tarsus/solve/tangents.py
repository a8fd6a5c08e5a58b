"""What enters a run, and its derivatives by numbers of the scene: differences of the lowered arrays, not of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.plan.lowering import Plan
from tarsus.model.scene import Scene
from tarsus.plan.slots import Rows, rows_for
from tarsus.base.spec import get_value

Floats = NDArray[np.float64]

LANES = 8
"""Derivatives that the engine carries at once."""
_STENCIL = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
_PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
STEP = 1e-4
"""Step of a difference, of the number itself (of one unit where it is zero). What is lowered is smooth in it, a polynomial
as a rule: with the fourth-order stencil 1e-16 of it remain beyond rounding, which is 1e-12."""


@dataclass(frozen=True)
class DataTangents:
    """Derivatives of one row of data by P numbers, last axis: as `tarsus.slots.Rows`, and of the pieces of its signals.

    coef (pieces, 12, P), begin, end (pieces, P) [s]: at fixed numbers in the pieces; loops (channels, P) [s]; changes
    (driven channels, 3, P); since (m, P) [s]: begin of the contacts at the start; period (1, P) [s] of the marks.
    """

    parameters: Floats
    initial: Floats
    sources: Floats
    since: Floats
    coef: Floats
    begin: Floats
    end: Floats
    loops: Floats
    changes: Floats
    period: Floats

    def lanes(self, first: int) -> DataTangents:
        """Eight of the numbers from ``first`` on, as the engine takes them; what is missing is zero."""
        def cut(array: Floats) -> Floats:
            part = array[..., first : first + LANES]
            pad = [(0, 0)] * (part.ndim - 1) + [(0, LANES - part.shape[-1])]
            return np.ascontiguousarray(np.pad(part, pad))

        return DataTangents(**{name: cut(getattr(self, name)) for name in self.__dataclass_fields__})


def one_row(rows: Rows, run: int) -> Rows:
    """The data of one run."""
    part = slice(run, run + 1)
    return replace(
        rows, parameters=rows.parameters[part], initial=rows.initial[part], sources=rows.sources[part],
        scales=rows.scales[part], channels=rows.channels[part], changes=rows.changes[part],
    )  # fmt: skip


def data_tangents(scene: Scene, plan: Plan, paths: Sequence[str], duration: float) -> tuple[Rows, DataTangents]:
    """The row of a scene's data, and its derivatives by the numbers at ``paths``, all of them slots.

    Raises InputError where a number cannot vary on either side, or a drive changes its shape there.
    """
    base = np.array([float(get_value(scene, path)) for path in paths])
    size = np.where(base != 0.0, STEP * np.abs(base), STEP)
    columns = np.tile(base, (1 + 4 * len(paths), 1))
    for p in range(len(paths)):
        columns[1 + 4 * p : 5 + 4 * p, p] += _PLACES * size[p]
    values: Mapping[str, Floats] = {path: columns[:, p] for p, path in enumerate(paths)}
    rows = rows_for(scene, plan, values, duration)
    return one_row(rows, 0), _differences(rows, size, paths, plan)


def _differences(rows: Rows, size: Floats, paths: Sequence[str], plan: Plan) -> DataTangents:
    """Derivatives of the first row from the four beside it for every path."""
    weights = _STENCIL[:, None] / size

    def slopes(values: Floats) -> Floats:
        """Of values (1 + 4 P, ...), as (..., P)."""
        by_path = values[1:].reshape(len(size), 4, *values.shape[1:])
        return np.einsum("pk...,kp->...p", by_path, weights)

    first, signals = np.asarray(rows.signals.first), rows.signals
    shape = (len(np.asarray(signals.start)), len(size))
    coef, begin, end = np.zeros((shape[0], 12, shape[1])), np.zeros(shape), np.zeros(shape)
    loops = np.zeros((len(first) - 1, len(size)))
    parts = np.asarray(signals.coef), np.asarray(signals.start), np.asarray(signals.end)
    for c in range(rows.channels.shape[1]):
        own = rows.channels[:, c]
        if np.all(own == own[0]):
            continue
        count = first[own + 1] - first[own]
        changed = np.flatnonzero(count != count[0])
        if len(changed):
            raise InputError([_no_shape(paths[(int(changed[0]) - 1) // 4])])
        place = first[own][:, None] + np.arange(count[0])
        here = place[0]
        sharp = np.asarray(signals.sharp)[place]
        changed = np.flatnonzero((sharp != sharp[0]).any(axis=1))
        if len(changed):
            raise InputError([_no_shape(paths[(int(changed[0]) - 1) // 4])])
        for to, values in zip((coef, begin, end), parts, strict=True):
            to[here] = slopes(values[place])
        loops[own[0]] = slopes(np.asarray(signals.period)[own])
    changes = rows.changes.copy()
    periods = np.asarray(signals.period)[rows.channels]
    turns = np.divide(
        changes[:, :, 2] - changes[0, :, 2], periods, out=np.zeros_like(periods), where=periods > 0.0
    )  # a phase beside a whole turn is lowered to a delay on either side of a period
    changes[:, :, 2] -= np.round(turns) * periods
    return DataTangents(
        slopes(rows.parameters), slopes(rows.initial), slopes(rows.sources), np.zeros((plan.feet, len(size))), coef,
        begin, end, loops, slopes(changes), slopes(np.where(np.isfinite(rows.periods), rows.periods, 0.0))[None],
    )  # fmt: skip


def _no_shape(path: str) -> str:
    return f"{path}: there is no derivative by it here, for the drive's voltage changes its number of pieces"
