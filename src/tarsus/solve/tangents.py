"""What enters a run and its derivatives by numbers of the scene; derivatives of a recorded run from the engine.

Lowered arrays are differentiated by differences, runs never are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.core import _native, nodes
from tarsus.core.book import NODES
from tarsus.core.modes import LinearSystem
from tarsus.model.scene import Scene
from tarsus.plan.lowering import FootLaws, Plan, lower_scene, lower_system, program_of
from tarsus.plan.slots import Rows, rows_for, slot
from tarsus.solve.engine import Accuracy, SharedBook
from tarsus.solve.march import tables_of, walk_settings
from tarsus.solve.window import Contacts, Recorded

__all__ = ["DataTangents", "Entering", "Tangents", "WalkTangents", "entering", "tangents", "walk_tangents"]

Floats = NDArray[np.float64]

LOST = 4
"""Reason of a flag: the derivative could not be followed, as in native/tangent.hpp."""
LANES = 8
"""Derivatives that the engine carries at once."""
STEP = 1e-4
"""Step of a difference of data, of the number itself (of one unit where it is zero, of a gap the plan's length). What
is lowered is smooth in it, a polynomial as a rule: with the fourth-order stencil 1e-16 of it remain, and 1e-12 of
rounding."""
FIRST, TURN, CHANGE = 1e-6, 0.03, 1e-3
"""Steps of structures are such that no mode turns by more than `TURN` radians more or less in the longest step of the
run, and none changes its rate by more than `CHANGE` of it: the stencil leaves 3e-8 of what a step adds. The shorter
they are, the more of the rounding of the structure's modes remains. How rates change is seen at the first, smallest
step."""


@dataclass(frozen=True)
class Stencil:
    """Four steps beside a number, and the weights of what is there: of the number's own value, then of the four."""

    places: Floats
    weights: Floats

    @classmethod
    def of(cls, scene: Scene, path: str, part: float, unit: float = 1.0) -> Stencil:
        """To both sides of a number of a scene, or to the one where it may vary; steps are that part of it, or of a
        unit where it is zero."""
        value = float(get_value(scene, path))
        size = part * (abs(value) if value != 0.0 else unit)
        problem = None
        for places, weights in _STENCILS:
            try:
                for place in (places.min(), places.max()):
                    with_values(scene, {path: value + float(place) * size})
            except InputError as error:
                problem = problem or error
                continue
            return cls(places * size, weights / size)
        assert problem is not None
        raise problem

    def slope(self, own: Floats, beside: Sequence[Floats]) -> Floats:
        """Derivative of values; exactly zero of those that stay as they are."""
        return sum(
            (w * (one - own) for w, one in zip(self.weights[1:], beside, strict=True)), np.zeros_like(own)
        )


_STENCILS = (
    (np.array([-2.0, -1.0, 1.0, 2.0]), np.array([0.0, 1.0, -8.0, 8.0, -1.0]) / 12.0),
    (np.array([1.0, 2.0, 3.0, 4.0]), np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0),
    (np.array([-1.0, -2.0, -3.0, -4.0]), np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0),
)
"""Differences of fourth order."""


@dataclass(frozen=True)
class DataTangents:
    """Derivatives of one row of data by P numbers, last axis: as `tarsus.plan.slots.Rows`, and of its signals' pieces.

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

    @classmethod
    def none(cls, rows: Rows, count: int) -> DataTangents:
        """Of so many numbers that nothing depends on."""
        signals = rows.signals
        pieces, m = len(np.asarray(signals.start)), rows.sources.shape[1] - 1
        shapes = (
            rows.parameters.shape[1:], rows.initial.shape[1:], rows.sources.shape[1:], (m,), (pieces, 12), (pieces,),
            (pieces,), (len(np.asarray(signals.loop)),), rows.changes.shape[1:], (1,),
        )  # fmt: skip
        return cls(*(np.zeros((*shape, count)) for shape in shapes))

    def lanes(self, first: int) -> DataTangents:
        """Eight of the numbers from ``first`` on, as the engine takes them; what is missing is zero."""

        def cut(array: Floats) -> Floats:
            part = array[..., first : first + LANES]
            pad = [(0, 0)] * (part.ndim - 1) + [(0, LANES - part.shape[-1])]
            return np.ascontiguousarray(np.pad(part, pad))

        return DataTangents(*(cut(getattr(self, name)) for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Beside:
    """A structure beside the run's, its contact modes, and its weight in the difference that makes derivative number
    ``path``."""

    system: LinearSystem
    book: SharedBook
    weight: float
    path: int


@dataclass(frozen=True)
class Entering:
    """What enters a run: its row of data, derivatives of that by the numbers at ``paths``, and structures beside it."""

    paths: tuple[str, ...]
    row: Rows
    data: DataTangents
    beside: tuple[Beside, ...]


def entering(
    scene: Scene, plan: Plan, paths: Sequence[str], duration: float, longest: float | None = None
) -> Entering:
    """What enters a run of a plan over ``duration`` [s], with derivatives by any numbers of its scene; longest [s]:
    step of the run, the whole of it unless given.

    Raises InputError for a path that is none, a number that cannot vary, and where a drive changes the number of its
    pieces.
    """
    known = [slot(scene, path) is not None for path in paths]
    if plan.legs is not None and not all(known):
        raise InputError(
            [f"{path}: a walker's run has derivatives by laws, gaps, gravity, starts and drives, not by its structure"
             for path, is_slot in zip(paths, known, strict=True) if not is_slot]
        )  # fmt: skip
    longest = duration if longest is None else longest
    stencils = [
        Stencil.of(scene, path, STEP, plan.length if path.endswith(".gap") else 1.0)
        if is_slot
        else Stencil.of(scene, path, _structure_step(scene, plan, path, longest))
        for path, is_slot in zip(paths, known, strict=True)
    ]
    own = [p for p, is_slot in enumerate(known) if is_slot]
    base = np.array([float(get_value(scene, paths[p])) for p in own])
    columns = np.tile(base, (1 + 4 * len(own), 1))
    for k, p in enumerate(own):
        columns[1 + 4 * k : 5 + 4 * k, k] += stencils[p].places
    rows = rows_for(scene, plan, {paths[p]: columns[:, k] for k, p in enumerate(own)}, duration)
    row = _one_row(rows, 0)
    data = DataTangents.none(row, len(paths))
    if own:
        found = _differences(rows, [stencils[p] for p in own], [paths[p] for p in own])
        for name in data.__dataclass_fields__:
            getattr(data, name)[..., own] = getattr(found, name)
    beside: list[Beside] = []
    for p, is_slot in enumerate(known):
        if not is_slot:
            beside += _structures(scene, plan, paths[p], p, stencils[p], duration, data)
    return Entering(tuple(paths), row, data, tuple(beside))


def _one_row(rows: Rows, run: int) -> Rows:
    part = slice(run, run + 1)
    return replace(
        rows, parameters=rows.parameters[part], initial=rows.initial[part], sources=rows.sources[part],
        scales=rows.scales[part].copy(), channels=rows.channels[part], changes=rows.changes[part],
    )  # fmt: skip


def _structure_step(scene: Scene, plan: Plan, path: str, longest: float) -> float:
    """Step of a number of the structure, as part of it; longest [s]: of the run's steps."""
    stencil = Stencil.of(scene, path, FIRST)
    value, place = float(get_value(scene, path)), float(stencil.places[-1])
    other = lower_system(with_values(scene, {path: value + place}))
    if other.mass.shape != plan.system.mass.shape:
        raise InputError(f"{path}: there is no derivative by it, for the structure changes its size")
    before, after = _rates(plan.system), _rates(other)
    change = np.abs(after - before) / abs(place) * (FIRST * abs(value) or FIRST)
    turned = float(change.max(initial=0.0)) * longest
    parts = [TURN / turned] if turned > 0.0 else []
    moving = change > 1e-12 * np.abs(before).max(initial=0.0)
    parts += list(CHANGE * np.maximum(np.abs(before[moving]), 1.0 / longest) / change[moving])
    return FIRST * float(np.clip(min(parts, default=1e3), 1.0, 1e3))


def _rates(system: LinearSystem) -> NDArray[np.complexfloating]:
    """Eigenvalues [1/s] of a structure in the air, in order."""
    n = len(system.mass)
    flow = np.zeros((2 * n, 2 * n))
    flow[:n, n:] = np.eye(n)
    flow[n:] = -np.linalg.solve(system.mass, np.concatenate([system.stiffness, system.damping], axis=1))
    return np.sort_complex(np.linalg.eigvals(flow))


def _structures(
    scene: Scene, plan: Plan, path: str, number: int, stencil: Stencil, duration: float, data: DataTangents
) -> list[Beside]:
    """The structures beside a scene's that differ in one number, and the derivatives of the data that do.

    Rest gaps and gravity act through the structures.
    """
    value = float(get_value(scene, path))
    plans = [lower_scene(with_values(scene, {path: value + float(place)})) for place in stencil.places]
    data.initial[..., number] = stencil.slope(plan.initial, [one.initial for one in plans])
    data.parameters[..., number] = stencil.slope(plan.laws.parameters, [one.laws.parameters for one in plans])
    return [
        Beside(one.system, SharedBook(one, duration), float(weight), number)
        for one, weight in zip([plan, *plans], stencil.weights, strict=True)
        if weight != 0.0
    ]


def _differences(rows: Rows, stencils: Sequence[Stencil], paths: Sequence[str]) -> DataTangents:
    """Derivatives of the first row from the four beside it for every path."""

    def slopes(values: Floats) -> Floats:
        """Of values (1 + 4 P, ...), as (..., P)."""
        by_path = [
            one.slope(values[0], list(values[1 + 4 * p : 5 + 4 * p])) for p, one in enumerate(stencils)
        ]
        return np.stack(by_path, axis=-1)

    out = DataTangents.none(rows, len(stencils))
    signals, first = rows.signals, np.asarray(rows.signals.first)
    parts = np.asarray(signals.coef), np.asarray(signals.start), np.asarray(signals.end)
    for c in range(rows.channels.shape[1]):
        own = rows.channels[:, c]
        if np.all(own == own[0]):
            continue
        count = first[own + 1] - first[own]
        _check_shapes(count[:, None], paths)
        place = first[own][:, None] + np.arange(count[0])
        _check_shapes(np.asarray(signals.sharp)[place], paths)
        for to, values in zip((out.coef, out.begin, out.end), parts, strict=True):
            to[place[0]] = slopes(values[place])
        out.loops[own[0]] = slopes(np.asarray(signals.period)[own])
    changes, periods = rows.changes.copy(), np.asarray(signals.period)[rows.channels]
    # a phase beside a whole turn is lowered to a delay on either side of a period
    late = changes[:, :, 2] - changes[0, :, 2]
    turns = np.divide(late, periods, out=np.zeros_like(periods), where=periods > 0.0)
    changes[:, :, 2] -= np.round(turns) * periods
    marks = np.where(np.isfinite(rows.periods), rows.periods, 0.0)
    return replace(
        out, parameters=slopes(rows.parameters), initial=slopes(rows.initial), sources=slopes(rows.sources),
        changes=slopes(changes), period=slopes(marks)[None],
    )  # fmt: skip


def _check_shapes(shapes: NDArray[np.generic], paths: Sequence[str]) -> None:
    """Raise InputError where a drive of a run (1 + 4 P, ...) is made otherwise than that of the first."""
    changed = np.flatnonzero((shapes != shapes[0]).any(axis=1))
    if len(changed):
        path = paths[(int(changed[0]) - 1) // 4]
        raise InputError(
            f"{path}: there is no derivative by it here, for the drive's voltage changes its pieces"
        )


@dataclass(frozen=True)
class Tangents:
    """Derivatives of a recorded run by P numbers, last axis.

    events (ne, 12, P): of the event rows; samples (nt, 2n + 5m, P): of displacements, velocities, gaps, gap rates,
    resistive and smooth forces and pulls at sample times; steps (nr, width, P) where asked for: of the end of every
    step [s], its start state and its nodal inputs; flags (nf, 3): number of an event, reason, number of a path or -1
    for all.
    """

    events: Floats
    samples: Floats
    steps: Floats
    flags: NDArray[np.int64]


def tangents(
    plan: Plan,
    book: SharedBook,
    given: Entering,
    recorded: Recorded,
    settings: _native.Settings,
    *,
    start: float = 0.0,
    contacts: Contacts | None = None,
    times: Floats | None = None,
    steps: bool = False,
) -> Tangents:
    """Derivatives of a recorded run by what entered it: a march of the engine over its steps and events, eight numbers
    at a time."""
    laws = _by_programs(plan.laws)
    when = np.zeros(0) if times is None else np.ascontiguousarray(times, dtype=float)
    begin = (start, *(row[0] for row in (contacts or Contacts()).rows(plan.feet, start)))
    parts, flags = [], []
    for first in range(0, max(len(given.paths), 1), LANES):
        beside = [
            (one.book.book.native, np.ascontiguousarray(one.system.sources), one.weight, one.path - first)
            for one in given.beside
            if first <= one.path < first + LANES
        ]
        *found, flag = _native.tangents_modal(
            book.book.native, NODES, nodes, given.row.signals, laws, settings, given.row, begin,
            given.data.lanes(first), beside, recorded, when, steps,
        )  # fmt: skip
        parts.append(found)
        rows = np.asarray(flag).reshape(-1, 3).astype(np.int64)
        rows[rows[:, 2] >= 0, 2] += first
        flags.append(rows)

    n, inputs = len(plan.system.mass), 2 * plan.feet + plan.drives + 1
    width = 1 + 2 * _native.modal_stride(n) + 8 * inputs
    shapes = (
        (len(recorded.events), 12),
        (len(when), 2 * n + 5 * plan.feet),
        (len(recorded.trace) * steps, width),
    )
    event_slopes, samples, of_steps = [
        np.concatenate([np.asarray(one[k]).reshape(*shape, LANES) for one in parts], axis=2)[
            ..., : len(given.paths)
        ]
        for k, shape in enumerate(shapes)
    ]
    all_flags = np.concatenate(flags)
    return Tangents(event_slopes, samples, of_steps, all_flags[all_flags[:, 2] < len(given.paths)])


@dataclass(frozen=True)
class WalkTangents:
    """Derivatives of a walker's run by P numbers, last axis.

    events (ne, 12, P), marks (nm, 3 + nb + 2 m, P): of the rows of events and marks; samples (nt, 2n + 5m, P): of
    displacements, velocities, gaps, gap rates, resistive and smooth forces and pulls at sample times; since (m, P) [s]:
    of the begins of the contacts at the end; energies (5, P): as in samples of a run, where an account was asked for;
    flags (nf, 3): as in `Tangents`.
    """

    events: Floats
    marks: Floats
    samples: Floats
    since: Floats
    energies: Floats
    flags: NDArray[np.int64]

    def told_of(self, events: int, marks: int) -> WalkTangents:
        """Those of a run with so many events and marks. The engine cuts some steps of the run that it makes again:
        where that comes to other events, as it may in chaos, there are no derivatives."""
        if (len(self.events), len(self.marks)) == (events, marks):
            return self

        def fitted(rows: Floats, count: int) -> Floats:
            rest = np.full((max(count - len(rows), 0), *rows.shape[1:]), np.nan)
            return np.concatenate([rows[:count], rest])

        flags = np.append(self.flags, [[0, LOST, -1]], axis=0)
        return replace(self, events=fitted(self.events, events), marks=fitted(self.marks, marks), flags=flags)


def walk_tangents(
    plan: Plan,
    duration: float,
    given: Entering,
    *,
    tables: _native.LegTables | None = None,
    accuracy: Accuracy | None = None,
    account: bool = False,
    times: Floats | None = None,
    start: tuple[float, NDArray[np.uint8], NDArray[np.uint8], Floats] | None = None,
) -> WalkTangents:
    """Derivatives of a walker's run by what enters it: the engine makes the run again for every eight numbers, and
    these follow it. Other parameters as for `walk`."""
    assert plan.legs is not None
    tables = tables if tables is not None else tables_of(plan, duration)
    settings, when = (
        walk_settings(plan, duration, accuracy, True),
        np.zeros(0) if times is None else np.array(times, dtype=float),
    )
    nb, n, m = len(plan.legs.body.body_mass), len(plan.system.mass), plan.feet
    sizes = (12, 3 + nb + 2 * m, 2 * n + 5 * m, 1, 1)
    parts, flags = [], []
    for first in range(0, max(len(given.paths), 1), LANES):
        *found, flag = _native.tangents_legged(
            plan.legs.native, tables, NODES, given.row.signals, plan.laws.native, _by_programs(plan.laws), given.row,
            settings, when, account, start, given.data.lanes(first), min(LANES, len(given.paths) - first),
        )  # fmt: skip
        parts.append(
            [np.asarray(one).reshape(-1, size, LANES) for one, size in zip(found, sizes, strict=True)]
        )
        rows = np.asarray(flag).reshape(-1, 3).astype(np.int64)
        rows[rows[:, 2] >= 0, 2] += first
        flags.append(rows)
    joined = [np.concatenate(some, axis=2)[..., : len(given.paths)] for some in zip(*parts, strict=True)]
    events, marks, samples, since, energies = joined
    return WalkTangents(events, marks, samples, since[:, 0], energies[:, 0], np.concatenate(flags))


def _by_programs(laws: FootLaws) -> _native.Laws:
    """The laws as programs alone, which carry derivatives."""
    terms = [
        (_native.HOOKS.index(law.hook), -1, k, laws.columns[name])
        for k, (name, law) in enumerate(laws.acting.items())
    ]
    programs = [program_of(type(law)) for law in laws.acting.values()]
    return _native.Laws(laws.flags, laws.volts, laws.parameters.shape[1], terms, programs)
