"""By what windows are differentiated, scenes, start states and moments, and their perturbed copies, two by number."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.core import _native
from tarsus.plan.lowering import Plan, lower_scene, of_leg, resprung
from tarsus.plan.rows import Rows, rows_of
from tarsus.plan.slots import rows_for, slot
from tarsus.solve.differences import ROUNDED, STEP, Direction, Stencil, directions_of
from tarsus.solve.engine import Engine, Tables, structure_key
from tarsus.solve.slopes import Differenced, Lane, Wanted, weights_of
from tarsus.solve.window_run import Ran, WindowStarts, run_windows

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class ScenePair(NamedTuple):
    """Two scenes perturbed along a direction: how far each is (2,), its plan, None for that of the scene itself, and
    its row of data."""

    places: Floats
    copies: tuple[tuple[Plan | None, Rows], ...]


@dataclass(frozen=True)
class Entered:
    """What windows run on, and by which numbers of it they have derivatives.

    row: one row of data; names: of the numbers; perturbed: pairs by name, some, at a part of their numbers' size.
    """

    row: Rows
    names: tuple[str, ...]
    perturbed: Callable[[Sequence[str], float], Mapping[str, ScenePair]]
    _made: dict[tuple[str, float], ScenePair] = field(default_factory=dict, init=False, repr=False, compare=False)

    def pairs(self, names: Sequence[str], part: float) -> dict[str, ScenePair]:
        """Pairs by name, each made once."""
        lacking = [name for name in names if (name, part) not in self._made]
        if lacking:
            self._made.update({(name, part): one for name, one in self.perturbed(lacking, part).items()})
        return {name: self._made[name, part] for name in names}

    @classmethod
    def of(cls, scene: Scene, plan: Plan, paths: Sequence[str] | Mapping[str, Direction]) -> Entered:
        """By numbers of the scene of a plan at paths, or along directions by name; where it begins is a window's own.

        Raises InputError for what is not a number in the scene, or one that cannot vary.
        """
        directions = directions_of(scene, paths)
        moving = with_values(scene, {"initial.standing": None})
        free = replace(plan, stance=None)
        return cls(rows_of(plan), tuple(directions), partial(_pairs, moving, free, directions))


def _pairs(
    scene: Scene, plan: Plan, directions: Mapping[str, Direction], names: Sequence[str], part: float
) -> dict[str, ScenePair]:
    """Perturbed scenes: rows of the plan where all that moves are data, else plans of their own."""
    steps = {name: Stencil.of(scene, directions[name], part, plan) for name in names}
    rows = {name: one for name, one in steps.items() if all(slot(scene, path) for path in one.direction)}
    base = {path: value for one in rows.values() for path, value in one.base.items()}
    each = [base | one.values(place) for one in rows.values() for place in one.places]
    columns = {path: np.array([row[path] for row in each]) for path in base}
    made = rows_for(scene, plan, columns, 0.0, scaled=False, count=len(each)) if each else None
    out, first, own = dict[str, ScenePair](), 0, rows_of(plan)
    for name, one in steps.items():
        copies: list[tuple[Plan | None, Rows]]
        if name in rows:
            assert made is not None
            copies = [(None, made.taken(slice(k, k + 1))) for k in (first, first + 1)]
            first += 2
        elif all(of_leg(scene, path) for path in one.direction):
            copies = [(resprung(plan, scene, one.values(place)), own) for place in one.places.tolist()]
        else:
            copies = [_lowered(one.scene(scene, place), plan, name) for place in one.places.tolist()]
        out[name] = ScenePair(one.places, tuple(copies))
    return out


def _lowered(scene: Scene, plan: Plan, name: str) -> tuple[Plan, Rows]:
    """A scene next to that of a plan, with its scales; its row. Raises InputError where its structure is larger."""
    own = replace(lower_scene(scene), length=plan.length, force=plan.force, rate=plan.rate)
    if own.initial.shape != plan.initial.shape:
        raise InputError(f"{name}: there is no derivative by it, for the structure changes its size")
    return own, rows_of(own)


@dataclass(frozen=True)
class WindowGradients:
    """By what windows are differentiated.

    entered: what enters them, with derivatives by numbers of a scene, all by the same numbers; of windows that differ
    in their data several, of which each window names its own. state: by the start state, whose displacements and
    velocities are then ``state.0`` to ``state.{2n - 1}``, or by window along directions (2n, q) of it, ``state.0`` to
    ``state.{q - 1}``; t0: by the moment of the start, with the start state and the times of outputs as they are.
    Contacts and flights that begin with the window begin later with it. enough: part of slopes that their errors may be
    before a second pair of windows is made, in better steps.
    """

    entered: Sequence[Entered] = ()
    state: bool | Sequence[Floats] = True
    t0: bool = True
    enough: float = 1e-6

    @classmethod
    def of(
        cls,
        scene: Scene,
        plan: Plan,
        paths: Sequence[str] | Mapping[str, Direction],
        *,
        state: bool = True,
        t0: bool = True,
    ) -> WindowGradients:
        """By numbers of the scene of a plan at paths, or along directions by name. Raises InputError as `Entered.of`
        does."""
        return cls((Entered.of(scene, plan, paths),), state, t0)

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the numbers of a scene."""
        return self.entered[0].names if self.entered else ()

    def along(self, windows: int, coordinates: int) -> Floats:
        """Directions (nw, 2n, q) of the start states, of a structure of so many coordinates."""
        if isinstance(self.state, bool):
            own = np.eye(2 * coordinates)[:, : 2 * coordinates if self.state else 0]
            return np.broadcast_to(own, (windows, *own.shape))
        return np.array(self.state, dtype=float).reshape(windows, 2 * coordinates, -1)

    def names(self, along: Floats) -> tuple[str, ...]:
        """Names of all numbers, in the order of derivatives."""
        states = tuple(f"state.{i}" for i in range(along.shape[2]))
        return (*self.paths, *states, *(("t0",) if self.t0 else ()))


SEEN = 8
"""Moments of each window that are looked at besides those that are asked for: at one alone a slope may be small by
chance, and neither what it changes by nor the noise then says anything."""
FARTHEST = 1e3
"""Times the first step to which another may be lengthened, for a number that hardly matters: by a hundredth of it."""
AT_END = 1e-3
"""Last part of a window in which an event that another lacks is taken to come to that just beyond the end: over a step
events move by far less."""
OF_STATE = 10.0 * STEP
"""First step of a start state, as a part of the plan's length and of that at its rate: an impact that comes soon bends
what follows by as much, and the tolerance of steps is a millionth of it."""
OF_TIME = 100.0 * STEP
"""First step of the moment of a start, as a part of an oscillation of the plan's rate: that of time is rounded more."""
BOTH, AHEAD = np.array([-1.0, 1.0]), np.array([1.0, 2.0])
"""Places to both sides, and of what can only be larger."""


class _Filed(NamedTuple):
    """Where a part of one side of a lane is: its call, its number there, and places of its windows in the lane."""

    call: _Call
    part: int
    places: Integers


@dataclass
class _Call:
    """One call of the engine: a plan with its tables, rows of data, and windows in parts."""

    plan: Plan
    tables: Tables
    data: list[Rows]
    parts: list[WindowStarts] = field(default_factory=list)

    def added(self, starts: WindowStarts, places: Integers) -> _Filed:
        """With one part more, of windows at such places in their lane."""
        self.parts.append(starts)
        return _Filed(self, len(self.parts) - 1, places)

    def ran(self, settings: _native.Settings, forces: bool) -> list[Ran]:
        """What each part came to."""
        if not self.parts:
            return []
        starts = WindowStarts.joined(self.parts)
        every = run_windows(self.plan, self.tables, self.data, starts, settings, forces=forces)
        edges = np.cumsum([0, *map(len, self.parts)])
        return [every.taken(np.arange(a, b)) for a, b in pairwise(edges.tolist())]


class _Shift(NamedTuple):
    """How windows are moved along a number: places (2,) in steps, steps (nw,), zero of those that it does not move, the
    part (nw,) that is rounded off; pairs by data where it is one of a scene; directions (nw, 2n) of a start state; with
    neither their starts are later."""

    places: Floats
    steps: Floats
    rounded: Floats
    pairs: Sequence[ScenePair] = ()
    state: Floats | None = None


@dataclass(frozen=True)
class Copies:
    """Makes perturbed copies of a plan's windows, its ``starts``, which run on ``data``.

    tables: of the plan's structure; along (nw, 2n, q): directions of the start states; forces: as `run_windows`.
    """

    plan: Plan
    tables: Tables
    data: Sequence[Rows]
    starts: WindowStarts
    by: WindowGradients
    along: Floats
    settings: _native.Settings
    forces: bool = True

    def differenced(self, own: Ran, finer: Ran) -> Differenced:
        """Windows, and the same in other steps, with their perturbed copies."""
        starts, weights = self.starts, weights_of(self.plan)
        late, enough = starts.ends - AT_END * (starts.ends - starts.t0), self.by.enough
        return Differenced(own, finer, late, self.lanes, weights, enough, tries=1, farthest=FARTHEST)

    @property
    def moment(self) -> int:
        """Number of the moment of the start."""
        return len(self.by.paths) + self.along.shape[2]

    def lanes(self, wanted: Sequence[Wanted]) -> list[Lane]:
        """Lanes of numbers. Raises InputError for a number that cannot vary by the first step; by another it has
        none."""
        calls: dict[object, _Call] = {_BASE: _Call(self.plan, self.tables, list(self.data))}
        begun = []
        pairs = {factor: self._pairs(wanted, factor) for factor in dict.fromkeys(of for _, of, _ in wanted)}
        for number, factor, windows in wanted:
            shift = self._shift(number, factor, pairs[factor])
            moved = windows[shift.steps[windows] > 0.0] if shift is not None else windows[:0]
            if shift is not None and len(moved):
                filed = [self._filed(calls, shift, moved, side) for side in (0, 1)]
                begun.append((number, factor, moved, shift, filed))
        ran = {id(call): call.ran(self.settings, self.forces) for call in calls.values()}
        out = []
        for number, factor, windows, shift, filed in begun:
            sides = []
            for parts in filed:
                order = np.argsort(np.concatenate([one.places for one in parts]))
                sides.append(Ran.joined([ran[id(one.call)][one.part] for one in parts]).taken(order))
            steps, since = shift.steps[windows], None
            if self.by.t0 and number == self.moment:
                early, late = (self.starts.t0[windows] + place * steps for place in shift.places.tolist())
                since = early, late
            both, rounded = (sides[0], sides[1]), shift.rounded[windows]
            out.append(Lane(number, factor, windows, shift.places, steps, rounded, both, since))
        return out

    def _pairs(self, wanted: Sequence[Wanted], factor: float) -> list[Mapping[str, ScenePair]]:
        """Of the numbers of a scene that are wanted at a part of the first step, by data."""
        paths = self.by.paths
        names = [paths[k] for k, of, _ in wanted if of == factor and k < len(paths)]
        try:
            return [one.pairs(names, STEP * factor) for one in self.by.entered]
        except InputError:
            if factor == 1.0:
                raise
            return []

    def _shift(self, number: int, factor: float, pairs: Sequence[Mapping[str, ScenePair]]) -> _Shift | None:
        paths, states, starts = self.by.paths, self.along.shape[2], self.starts
        if number < len(paths):
            own = [one[paths[number]] for one in pairs]
            if not own:
                return None
            size = np.array([np.abs(one.places).min() for one in own])
            part = np.full(len(starts), ROUNDED / (STEP * factor))
            return _Shift(own[0].places / size[0], size[starts.sources[:, 0]], part, own)
        if number < len(paths) + states:
            state = self.along[:, :, number - len(paths)]
            size = self._moves(state)
            steps = np.divide(OF_STATE * factor, size, out=np.zeros_like(size), where=size > 0.0)
            moved = np.abs(steps[:, None] * state)
            part = np.divide(ROUNDED * np.abs(starts.state), moved, out=np.zeros_like(moved), where=moved > 0.0)
            return _Shift(BOTH, steps, part.max(axis=1), (), state)
        step = OF_TIME * factor / self.plan.rate
        early = bool(np.any(starts.t0 < step))
        return _Shift(AHEAD if early else BOTH, np.full(len(starts), step), ROUNDED * starts.ends / step)

    def _moves(self, along: Floats) -> Floats:
        """By how many lengths of the plan directions (nw, 2n) of a start move feet; by speeds at the plan's rate."""
        weight = weights_of(self.plan) / self.plan.length
        return np.abs(along * np.concatenate([weight, weight / self.plan.rate])).max(axis=1)

    def _filed(self, calls: dict[object, _Call], shift: _Shift, windows: Integers, side: int) -> list[_Filed]:
        """Put the windows of one side of a lane into calls."""
        starts, by = self.starts.taken(windows), shift.places[side] * shift.steps[windows]
        own = calls[_BASE]
        if not shift.pairs:
            moved = (
                starts.later(by)
                if shift.state is None
                else replace(starts, state=starts.state + by[:, None] * shift.state[windows])
            )
            return [own.added(moved, np.arange(len(windows)))]
        out = []
        for d, pair in enumerate(shift.pairs):
            at = np.flatnonzero(starts.sources[:, 0] == d)
            if not len(at):
                continue
            plan, row = pair.copies[side]
            call = own if plan is None else self._call(calls, plan)
            call.data.append(row)
            sources = np.tile([len(call.data) - 1, 0], (len(at), 1))
            out.append(call.added(replace(starts.taken(at), sources=sources), at))
        return out

    def _call(self, calls: dict[object, _Call], plan: Plan) -> _Call:
        """That of plans of this structure."""
        legs = () if plan.legs is None else tuple(np.asarray(one).tobytes() for one in plan.legs.body)
        key = structure_key(plan), legs
        if key not in calls:
            longest = float(np.asarray(self.tables.lengths)[0])
            calls[key] = _Call(plan, Engine(plan, longest).tables, [])
        return calls[key]


_BASE = ()
"""Which call is that of the plan itself."""
