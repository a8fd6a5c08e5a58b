"""What enters a run, and its derivatives by numbers of the scene.

Lowered arrays are differentiated by differences, runs never are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.core import _native
from tarsus.core.arrays import LANES
from tarsus.core.modes import LinearSystem, ModeBook, derived_mode
from tarsus.model.drive.pieces import TERMS
from tarsus.plan.channels import SlopedDrive, sloped_drives
from tarsus.plan.lowering import Plan, ahead_only, lower_legs, lower_scene, lower_system, pack
from tarsus.plan.slots import Rows, bears, rows_for, slot
from tarsus.solve.differences import Direction, Stencil, _slope_weights, directions_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

STEP = 1e-4
"""Step of a difference of data, of the number itself (where it is zero of one unit, of a length that moves a foot by
the plan's length). What is lowered is smooth in it, a polynomial as a rule: with the fourth-order stencil 1e-16 of it
remain, and 1e-12 of rounding."""
WIDTHS = tuple(10.0 ** -np.arange(2.0, 8.0))
"""Steps of a difference of a structure's arrays, of eighth order. That one is taken over which it agrees best with the
one of lower order: what is linear in its numbers needs a wide one, damping that follows from modes that nearly cancel
a narrow one."""
AGREED = 1e-12
"""Part of an array's largest derivative within which two orders need not be distinguished: rounding leaves as much."""


@dataclass(frozen=True)
class DataTangents:
    """Derivatives of one row of data by P numbers, last axis: as `tarsus.plan.slots.Rows`, and of its signals' pieces.

    coef (pieces, 12 or fewer terms, P), begin, end (pieces, P) [s]: at fixed numbers in the pieces; loops (channels, P)
    [s]; profile (., P): of uneven ground; since (m, P) [s]: begin of the contacts at the start; period (1, P) [s] of
    the marks; start (1, P) [s]: of the moment at which a window begins.
    """

    parameters: Floats
    initial: Floats
    sources: Floats
    since: Floats
    coef: Floats
    begin: Floats
    end: Floats
    loops: Floats
    profile: Floats
    period: Floats
    start: Floats

    @classmethod
    def none(cls, rows: Rows, count: int, terms: int = TERMS) -> DataTangents:
        """Of so many numbers that nothing depends on; terms: of pieces that may have derivatives."""
        signals = rows.signals
        pieces, m = len(np.asarray(signals.start)), rows.sources.shape[1] - 2
        shapes = (
            rows.parameters.shape[1:], rows.initial.shape[1:], rows.sources.shape[1:], (m,), (pieces, terms), (pieces,),
            (pieces,), (len(np.asarray(signals.loop)),), rows.profile.shape[1:], (1,), (1,),
        )  # fmt: skip
        return cls(*(np.zeros((*shape, count)) for shape in shapes))

    def lanes(self, first: int) -> DataTangents:
        """Eight of the numbers from ``first`` on, as the engine takes them; what is missing is zero."""

        def cut(array: Floats) -> Floats:
            part = array[..., first : first + LANES]
            pad = [(0, 0)] * (part.ndim - 1) + [(0, LANES - part.shape[-1])]
            if array is self.coef:
                pad[1] = (0, TERMS - part.shape[1])
            return np.ascontiguousarray(np.pad(part, pad))

        return DataTangents(*(cut(getattr(self, name)) for name in self.__dataclass_fields__))

    def with_start(self, states: int, moment: bool) -> DataTangents:
        """The same of a window: by its numbers with its start as it is, then by so many numbers of its start state, all
        or none, and by the moment of its start."""
        more = states + moment
        parts = {
            name: np.concatenate([one, np.zeros((*one.shape[:-1], more))], axis=-1)
            for name, one in ((name, getattr(self, name)) for name in self.__dataclass_fields__)
        }
        count = self.initial.shape[-1]
        parts["initial"][:] = 0.0
        parts["initial"][range(states), range(count, count + states)] = 1.0
        parts["start"][:, count + states :] = 1.0
        return DataTangents(**parts)


@dataclass(frozen=True)
class Entering:
    """What enters a run: its row of data, and derivatives of that along the directions ``paths``.

    structure: derivatives of the structure's arrays, by the number of a direction that changes it; perturbed: of a
    walker the plans of perturbed copies along such a direction, each with its weight in the difference.
    """

    paths: tuple[str, ...]
    row: Rows
    data: DataTangents
    structure: Mapping[int, LinearSystem] = field(default_factory=dict)
    perturbed: Mapping[int, tuple[tuple[Plan, float], ...]] = field(default_factory=dict)
    made: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "made": {}}

    def derived(self, number: int, book: ModeBook) -> Any:
        """The derivatives of a run's book by the structure along a direction, as the engine holds them."""
        if number not in self.made:
            change = self.structure[number]
            made = _native.DerivedBook(book.native, partial(derived_mode, book.system, change))
            return self.made.setdefault(number, made)  # of threads that make it at once the first one's stays
        return self.made[number]

    def some(self, numbers: Sequence[int]) -> Entering:
        """Along some of the directions alone."""
        if list(numbers) == list(range(len(self.paths))):
            return self
        parts = {name: getattr(self.data, name)[..., numbers] for name in self.data.__dataclass_fields__}
        kept = {k: self.structure[p] for k, p in enumerate(numbers) if p in self.structure}
        perturbed = {k: self.perturbed[p] for k, p in enumerate(numbers) if p in self.perturbed}
        return Entering(
            tuple(self.paths[p] for p in numbers), self.row, DataTangents(**parts), kept, perturbed
        )


NO_FRICTION = (
    "with friction along the ground there are no derivatives by numbers of the structure, and no orbits, but of a "
    "walker: leave out feet.NAME.along or ground.friction"
)
"""What of a robot by contact modes that slides is refused."""


def entering(
    scene: Scene, plan: Plan, gradients: Sequence[str] | Mapping[str, Direction], duration: float
) -> Entering:
    """What enters a run of a plan over ``duration`` [s], with derivatives along any directions of its scene.

    Raises InputError for a path that is none, a number that cannot vary, where a drive changes the number of its
    pieces, and for a number of the structure of a robot that slides and is no walker.
    """
    ahead_only(plan, "a run has derivatives")
    found = directions_of(scene, gradients)
    _check_ground(scene, {path for one in found.values() for path in one})
    names = list(scene.robot.drives)
    lines, rest = sloped_drives(scene, list(found.values()), [names[d] for d in plan.charged])
    parts = [_apart(scene, one) for one in rest]
    changed = {p: one for p, (_, one) in enumerate(parts) if one}
    if changed and plan.system.tangents is not None:
        raise InputError(NO_FRICTION)
    if plan.legs is None:
        structure = {p: _structure_slope(scene, plan, one) for p, one in changed.items()}
    own = [p for p, (moved, _) in enumerate(parts) if moved]
    steps, rows = _stepped(scene, plan, [parts[p][0] for p in own], duration)
    row = _driven_by(_one_row(rows), scene, plan, lines)
    used = np.asarray(rows.signals.coef).any(axis=0)
    terms = max(
        [1 + int(np.flatnonzero(used).max(initial=0)), *(one.force.coef.shape[1] for one in lines.values())]
    )
    data = DataTangents.none(row, len(found), terms)
    if own:
        by_data = _differences(rows, row, steps, [list(found)[p] for p in own], terms)
        for name in data.__dataclass_fields__:
            getattr(data, name)[..., own] = getattr(by_data, name)
    for name, one in lines.items():
        add_drive(data, row, plan, names.index(name), one)
        if one.period == float(rows.periods[0]):
            data.period[0] += one.by_period
    _drop_rounding(data, row)
    if scene.initial.standing is not None:
        for p, one in enumerate(found.values()):
            moved = {path: weight for path, weight in one.items() if path not in rest[p]}
            if any(bears(scene, path) for path in moved):
                (stencil,), stood = _stepped(scene, plan, [moved], duration)
                data.initial[..., p] += stencil.slope(plan.initial, list(stood.initial[1:]))
    if plan.legs is None:
        return Entering(tuple(found), row, data, structure)
    perturbed = {p: _walkers(scene, plan, one, data.initial[..., p]) for p, one in changed.items()}
    structure = {p: _slope_of(plan, copies) for p, copies in perturbed.items()}
    return Entering(tuple(found), row, data, structure, perturbed)


def _walkers(
    scene: Scene, plan: Plan, direction: Direction, initial: Floats
) -> tuple[tuple[Plan, float], ...]:
    """The plans of a walker's perturbed copies along a direction that changes its structure, with weights; where it
    begins standing, the derivative of its initial state (2n,) takes in that it stands otherwise."""
    stencil = Stencil.of(scene, direction, STEP)
    changed = [stencil.scene(scene, float(place)) for place in stencil.places]
    if scene.initial.standing is not None:
        initial += stencil.slope(plan.initial, [lower_scene(one).initial for one in changed])
    systems = [lower_system(one) for one in changed]
    plans = [
        replace(plan, system=system, legs=lower_legs(one, system))
        for one, system in zip(changed, systems, strict=True)
    ]
    return tuple(
        (one, float(weight))
        for one, weight in zip([plan, *plans], stencil.weights, strict=True)
        if weight != 0.0
    )


def _slope_of(plan: Plan, copies: Sequence[tuple[Plan, float]]) -> LinearSystem:
    """Derivatives of the arrays of a walker's structure, which are linear in the numbers of its legs, from perturbed
    copies with their weights; rest gaps and gravity are data."""
    slopes = {
        name: sum((weight * (one.system.arrays[name] - own) for one, weight in copies), np.zeros_like(own))
        for name, own in plan.system.arrays.items()
    }
    return replace(plan.system, rest_gap=np.zeros_like(plan.system.rest_gap), gravity=0.0, **slopes)


def _driven_by(row: Rows, scene: Scene, plan: Plan, lines: Mapping[str, SlopedDrive]) -> Rows:
    """A run with those drives in place of its own."""
    if not lines:
        return row
    pool, channels = list(row.pool), row.channels.copy()
    for name, one in lines.items():
        drive = list(scene.robot.drives).index(name)
        for c, channel in zip(plan.channels_of(drive), (one.force, one.volts), strict=False):
            assert channel is not None
            channels[0, c] = len(pool)
            pool.append(channel.pieces)
    return _one_row(replace(row, pool=tuple(pool), channels=channels))


def add_drive(data: DataTangents, row: Rows, plan: Plan, drive: int, of: SlopedDrive) -> None:
    """Add the derivatives of a drive."""
    for c, one in zip(plan.channels_of(drive), (of.force, of.volts), strict=False):
        assert one is not None
        channel = row.channels[0, c]
        first = int(np.asarray(row.signals.first)[channel])
        place = slice(first, first + len(one.begin))
        data.coef[place, : one.coef.shape[1]], data.begin[place], data.end[place] = (
            one.coef,
            one.begin,
            one.end,
        )
        data.loops[channel] = one.loop


ROUNDED = 1e-10
"""Part of the largest derivative of a piece's terms that rounding may leave of one."""


def _drop_rounding(data: DataTangents, row: Rows) -> None:
    """Leave nothing of derivatives of terms that a piece does not have, where they are rounding alone: they would grow
    with the powers of time where a step goes on beyond a piece."""
    terms = data.coef.shape[1]
    used = np.where(np.asarray(row.signals.coef)[:, :terms] != 0.0, np.arange(terms), 0).max(
        axis=1, initial=0
    )
    from_here = np.maximum.accumulate(np.abs(data.coef)[:, ::-1], axis=1)[
        :, ::-1
    ]  # most of a term and all above
    beyond = (np.arange(terms) > used[:, None])[..., None]
    data.coef[beyond & (from_here <= ROUNDED * from_here[:, :1])] = 0.0


def _stepped(
    scene: Scene, plan: Plan, directions: Sequence[Direction], duration: float
) -> tuple[list[Stencil], Rows]:
    """The stencils along directions of data, and rows of a run and of its perturbed copies, four for each direction."""
    steps = [Stencil.of(scene, one, STEP, plan) for one in directions]
    base = {path: value for one in steps for path, value in one.base.items()}
    columns = {path: np.full(1 + 4 * len(steps), value) for path, value in base.items()}
    for k, one in enumerate(steps):
        for path, w in one.direction.items():
            columns[path][1 + 4 * k : 5 + 4 * k] += w * one.places
    return steps, rows_for(scene, plan, columns, duration, scaled=False)


def _check_ground(scene: Scene, paths: Collection[str]) -> None:
    """Raise InputError for numbers by which a scene's ground has no derivative."""
    problems = [
        f"{path}: there is no derivative by it, for its whole part makes the ground"
        for path in paths
        if path.startswith("ground.profile.") and path.endswith(".seed")
    ]
    if scene.ground.profile is not None and scene.ground.profile.wide:
        places = {f"robot.structure.legs.{foot.point}.y" for foot in scene.robot.feet.values()}
        problems += [
            f"{path}: there is no derivative by it above ground that varies across the way: leave it out, or across"
            for path in places.intersection(paths)
        ]
    if problems:
        raise InputError(problems)


def _apart(scene: Scene, direction: Direction) -> tuple[Direction, Direction]:
    """What of a direction is data of a plan, and what changes its structure."""
    data = {path: w for path, w in direction.items() if slot(scene, path) is not None}
    return data, {path: w for path, w in direction.items() if path not in data}


def _one_row(rows: Rows) -> Rows:
    """The first of the runs by itself, with the channels that it has."""
    used, channels = np.unique(rows.channels[0], return_inverse=True)
    pool = tuple(rows.pool[c] for c in used)
    return replace(
        rows.taken(slice(1)), scales=rows.scales[:1].copy(), channels=channels.reshape(1, -1).astype(np.int64),
        pool=pool, signals=pack(pool),
    )  # fmt: skip


def _structure_slope(scene: Scene, plan: Plan, direction: Direction) -> LinearSystem:
    """Derivatives of the arrays of a plan's structure along a direction of its scene; rest gaps and gravity are data.

    Raises InputError where the structure changes its size.
    """
    own, best, least = plan.system.arrays, {}, np.inf
    for part in WIDTHS:
        try:
            stencil = Stencil.of(scene, direction, part, order=8)
        except InputError:
            if part == WIDTHS[-1]:
                raise
            continue
        there = [lower_system(stencil.scene(scene, place)).arrays for place in stencil.places]
        if any(one["mass"].shape != own["mass"].shape for one in there):
            path = next(iter(direction))
            raise InputError(f"{path}: there is no derivative by it, for the structure changes its size")
        inner = np.flatnonzero(np.abs(stencil.places) < 0.99 * np.abs(stencil.places).max())
        rough = replace(stencil, places=stencil.places[inner], weights=_slope_weights(stencil.places[inner]))
        found = {name: stencil.slope(array, [one[name] for one in there]) for name, array in own.items()}
        lesser = {name: rough.slope(array, [there[k][name] for k in inner]) for name, array in own.items()}
        size = {name: np.abs(array).max(initial=0.0) or 1.0 for name, array in found.items()}
        off = max(float(np.abs(found[name] - lesser[name]).max(initial=0.0)) / size[name] for name in own)
        if off < least:
            best, least = found, off
        if off <= AGREED:
            break
    return replace(plan.system, rest_gap=np.zeros_like(plan.system.rest_gap), gravity=np.zeros(2), **best)


def _differences(
    rows: Rows, row: Rows, stencils: Sequence[Stencil], paths: Sequence[str], terms: int
) -> DataTangents:
    """Derivatives of a row, the first of the rows, from its four perturbed copies for every path."""
    weights = np.array([one.weights[1:] for one in stencils])

    def slopes(values: Floats) -> Floats:
        """Of values (1 + 4 P, ...), as (..., P): exactly zero of those that stay as they are."""
        perturbed = (values[1:] - values[0]).reshape(*weights.shape, *values.shape[1:])
        return np.einsum("pk,pk...->...p", weights, perturbed)

    out = DataTangents.none(row, len(stencils), terms)
    signals, first, here = rows.signals, np.asarray(rows.signals.first), np.asarray(row.signals.first)
    parts = np.asarray(signals.coef)[:, :terms], np.asarray(signals.start), np.asarray(signals.end)
    for c in range(rows.channels.shape[1]):
        own = rows.channels[:, c]
        if np.all(own == own[0]):
            continue
        count = first[own + 1] - first[own]
        _check_shapes(count[:, None], paths)
        place = first[own][:, None] + np.arange(count[0])
        _check_shapes(np.asarray(signals.sharp)[place], paths)
        channel = row.channels[0, c]
        to_place = here[channel] + np.arange(count[0])
        for to, values in zip((out.coef, out.begin, out.end), parts, strict=True):
            to[to_place] = slopes(values[place])
        out.loops[channel] = slopes(np.asarray(signals.period)[own])
    marks = np.where(np.isfinite(rows.periods), rows.periods, 0.0)
    return replace(
        out, parameters=slopes(rows.parameters), initial=slopes(rows.initial), sources=slopes(rows.sources),
        profile=slopes(rows.profile), period=slopes(marks)[None],
    )  # fmt: skip


def _check_shapes(shapes: NDArray[np.generic], paths: Sequence[str]) -> None:
    """Raise InputError where a drive of a run (1 + 4 P, ...) is made otherwise than that of the first."""
    changed = np.flatnonzero((shapes != shapes[0]).any(axis=1))
    if len(changed):
        path = paths[(int(changed[0]) - 1) // 4]
        raise InputError(
            f"{path}: there is no derivative by it here, for the drive's voltage changes its pieces"
        )
