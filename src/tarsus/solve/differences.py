"""Derivatives by differences of whole runs: where the perturbed copies of a run stand, and what their values say.

A direction, any numbers of a scene that move together, becomes runs to both sides. Whatever these give is differenced,
so that every law, ground and drive has derivatives without a line of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, number_paths, with_values
from tarsus.plan.slots import bounded, check_bounds, rows_for, slot, unit_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Direction = Mapping[str, float]
"""How much each of some numbers of a scene moves, by path: one for a number itself."""

STEP = 1e-5
"""First step of a difference, of the number itself (where it is zero of one unit, of a length that moves a foot by the
plan's length): runs respond to it by 1e-5 of themselves as a rule, which they resolve to 1e-8, and bend by 1e-10."""
LEAST, MOST = 1e-3, 1e1
"""Parts of the first step to which another may be shortened, for late events that depend on a number a thousand
times as
much as early ones, and lengthened, for a number that hardly matters: by more, events would pass what is looked at."""
NEARBY = 3.0
"""A step within this factor of the best one is as good: its error is at most five times the least."""
BENT = 0.1
"""Part by which differences to both sides deviate from their mean where there is a kink: a smooth number bends so much
over no step that is taken, for its error would be a hundredth then."""
SURE = 10.0
"""Times the noise of runs, as two of them show it, from which a kink is none of its."""
ROUNDED = 4e-16
"""Part of a number that is rounded off."""
ROUNDING = 1e-13
"""Part of a number that the rounding of a run's steps, a thousand as a rule, may leave in it."""


def directions_of(scene: Scene, gradients: Sequence[str] | Mapping[str, Direction]) -> dict[str, Direction]:
    """Directions by name; a path, or short word, is that of its own numbers.

    Raises InputError for what is not a number in the scene.
    """
    if isinstance(gradients, str):
        gradients = (gradients,)
    given = gradients if isinstance(gradients, Mapping) else {name: {name: 1.0} for name in gradients}
    problems: list[str] = []
    found: dict[str, Direction] = {}
    for name, direction in given.items():
        try:
            found[name] = {path: w for one, w in direction.items() if w != 0.0 for path in number_paths(scene, one)}
        except InputError as error:
            problems += error.problems
            continue
        for path in found[name]:
            if path.startswith("ground.profile.") and path.endswith(".seed"):
                problems.append(f"{path}: there is no derivative by it, for its whole part makes the ground")
    if problems:
        raise InputError(problems)
    return found


_PLACES = np.array([[-1.0, 1.0], [1.0, 2.0], [-1.0, -2.0]])
"""Where two copies stand, in steps: to both sides, or to the one."""


@dataclass(frozen=True)
class Stencil:
    """Where two copies of a scene stand along a direction of it; part: of its number that a step is."""

    base: Mapping[str, float]
    direction: Direction
    part: float
    places: Floats
    _made: dict[float, Scene] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, scene: Scene, direction: Direction, part: float, plan: Plan | None = None) -> Stencil:
        """To both sides of a scene, or to the one where it may vary; steps are that part of the number that moves most
        for its size (where it is zero, of one unit, or of the length in a plan).

        Raises InputError where the scene may vary to no side.
        """
        base = {path: float(get_value(scene, path)) for path in direction}
        size = part * min(
            ((abs(base[path]) or unit_of(path, plan)) / abs(w) for path, w in direction.items()), default=1.0
        )
        problem = None
        for places in _PLACES:
            found = cls(base, direction, part, places * size)
            try:
                found.check(scene, plan)
            except InputError as error:
                problem = problem or error
                continue
            return found
        assert problem is not None
        raise problem

    def check(self, scene: Scene, plan: Plan | None) -> None:
        """Raise InputError unless the scene takes the outermost places, where no foot starts below uneven ground."""
        ends = np.array([self.places.min(), self.places.max()])
        if plan is not None and any(path.startswith("ground.profile.") for path in self.direction):
            columns = {path: self.base[path] + w * ends for path, w in self.direction.items()}
            if all(slot(scene, path) is not None for path in columns):
                rows_for(scene, plan, columns, 0.0)
        alone = [path for path in self.direction if bounded(scene, path)]
        for path in alone:
            check_bounds(scene, path, self.base[path] + self.direction[path] * ends)
        if len(alone) < len(self.direction):
            for end in ends:
                self.scene(scene, float(end))

    @property
    def step(self) -> float:
        """Distance of the nearest place."""
        return float(np.abs(self.places).min())

    def values(self, place: float) -> dict[str, float]:
        """The numbers by path at a place along the direction."""
        return {path: self.base[path] + float(place) * w for path, w in self.direction.items()}

    def scene(self, scene: Scene, place: float) -> Scene:
        """The scene at a place along the direction."""
        if place not in self._made:
            self._made[place] = with_values(scene, self.values(place))
        return self._made[place]

    def slope(self, own: Floats, copies: Sequence[Floats]) -> Floats:
        """Derivative of values; exactly zero of those that stay as they are."""
        return slope_by(copies[0] - own, copies[1] - own, self.places)


class Slopes(NamedTuple):
    """Derivatives of values, their possible errors, and where there is a kink or a jump."""

    value: Floats
    error: Floats
    kinked: NDArray[np.bool_]


def slope_by(one: Floats, two: Floats, places: Floats) -> Floats:
    """Slope of a value that moves by so much at two places."""
    x, y = places
    return (one * (y / x) - two * (x / y)) / (y - x)


def change_by(one: Floats, two: Floats, places: Floats) -> Floats:
    """Size of what such slopes change by over a step."""
    x, y = places
    return np.abs((one / x - two / y) / (x - y))


def cut_off(size: Floats, change: Floats, bent: Floats | float, places: Floats) -> Floats:
    """What a number of third order leaves in slopes: the square of what they change by over a step, of themselves or of
    the motion (bent), as long as it has one scale over which it varies; to one side as much again."""
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(size > 0.0, np.minimum(change / size, 1.0), 1.0)
    return np.asarray((1.0 if places[0] * places[1] < 0.0 else 2.0) * (part * change + bent**2 * size))


def slopes_of(
    places: Floats, step: float, bent: float, own: Floats, finer: Floats, copies: Sequence[Floats], scale: float = 0.0
) -> Slopes:
    """Derivatives of values of a run from those of its two copies at places in steps, and of the run in other steps.

    bent: by which part the slopes of the run's events change over a step. scale: a size of such values, where they may
    be zero.
    """
    one, two = (np.asarray(of - own, dtype=float) for of in copies)
    slope, change = slope_by(one, two, places) / step, change_by(one, two, places) / step
    size, same = np.abs(slope), (one == 0.0) & (two == 0.0)
    noise = (np.abs(finer - own) + ROUNDING * np.maximum(np.abs(own), scale)) / step
    # where a number is at its top its slope is none, and what it bends by is no kink
    smooth = SURE * np.maximum(noise, bent**2 * np.abs(own) / step)
    kinked = (change > np.maximum(BENT * size, smooth)) & ~same
    return Slopes(slope, np.where(same, 0.0, cut_off(size, change, bent, places) + noise), kinked)


def better_step(bent: float, noise: float) -> float:
    """By which part another step is better, from what the slopes change by over this one and what the noise of runs
    is, both parts of the slopes: the least of bent^2 s^2 + noise / s. One where this step is good enough."""
    if not (bent > 0.0 and noise > 0.0):
        return 1.0
    best = (noise / (2.0 * bent**2)) ** (1.0 / 3.0)
    return 1.0 if 1.0 / NEARBY <= best <= NEARBY else best


@dataclass(frozen=True)
class MotionValues:
    """Values of something of windows: of themselves, of one in other steps, of the two perturbed ones (c, k); which of
    these two count (2, k); first (nw + 1,): where those of each window begin; blocks: rows of one kind, weights (c,)
    with which they have one unit; of_events: whether they are those of events."""

    own: Floats
    finer: Floats
    perturbed: tuple[Floats, Floats]
    valid: Flags
    first: Integers
    blocks: Sequence[slice]
    weights: Floats
    of_events: bool = False

    def most(self, values: Floats) -> Floats:
        """Largest (blocks, nw) of weighted values (c, k) in every window; zero of none."""
        out = np.zeros((len(self.blocks), len(self.first) - 1))
        there = np.flatnonzero(np.diff(self.first))
        if len(there):
            rows = np.fmax.reduceat(np.nan_to_num(values), self.first[there], axis=1) * self.weights[:, None]
            out[:, there] = [rows[block].max(axis=0, initial=0.0) for block in self.blocks]
        return out

    def so_far(self, values: Floats) -> Floats:
        """Largest of values (c, k) in every window row by row up to each of them: what a motion errs by only grows."""
        if len(self.first) == 2:
            return np.asarray(np.maximum.accumulate(np.nan_to_num(values), axis=1))
        window, place, longest = self._places
        out = np.zeros((len(values), len(self.first) - 1, longest))
        out[:, window, place] = np.nan_to_num(values)
        return np.asarray(np.maximum.accumulate(out, axis=2)[:, window, place])

    @cached_property
    def _places(self) -> tuple[Integers, Integers, int]:
        """The window (k,) of each, its number there, and how many there are in one at most."""
        counts = np.diff(self.first)
        window = np.repeat(np.arange(len(counts)), counts)
        return window, np.arange(len(window)) - self.first[window], int(counts.max(initial=0))

    def each(self, values: Floats) -> Floats:
        """Values (nw,) of windows for all that is in them."""
        return np.repeat(values, np.diff(self.first), axis=-1)

    def rows(self, values: Floats) -> Floats:
        """Values (blocks, nw) for all that is in them, (c, k)."""
        return np.repeat(self.each(values), [block.stop - block.start for block in self.blocks], axis=0)


@dataclass(frozen=True)
class Differences:
    """Differences of values by steps: slopes (c, k), what they change by over one step, and the noise of runs."""

    values: MotionValues
    places: Floats

    @cached_property
    def _off(self) -> tuple[Floats, Floats]:
        one, two = (each - self.values.own for each in self.values.perturbed)
        return one, two

    @cached_property
    def slope(self) -> Floats:
        """To both sides, or to the one that counts, NaN where none does."""
        (one, two), (x, y), valid = self._off, self.places, self.values.valid
        out = slope_by(one, two, self.places)
        out[:, ~valid[1]] = (one / x)[:, ~valid[1]]
        out[:, ~valid[0]] = (two / y)[:, ~valid[0]]
        out[:, ~valid.any(axis=0)] = np.nan
        return out

    @cached_property
    def change(self) -> Floats:
        """Zero where one side alone counts."""
        return np.where(self.values.valid.all(axis=0), change_by(*self._off, self.places), 0.0)

    @cached_property
    def off(self) -> Floats:
        """How far values are from those in other steps, or were before."""
        own = self.values.own
        return self.values.so_far(np.abs(self.values.finer - own) + ROUNDING * np.abs(own))

    @cached_property
    def noise(self) -> Floats:
        """The most (blocks, nw) of it in a window."""
        return self.values.most(self.off)

    @cached_property
    def scale(self) -> Floats:
        """Largest slopes (blocks, nw) in a window."""
        return self.values.most(np.abs(self.slope))

    @cached_property
    def same(self) -> Flags:
        """Where no copy differs."""
        pairs = zip(self._off, self.values.valid, strict=True)
        return np.all([(off == 0.0) | ~ok for off, ok in pairs], axis=0)

    @cached_property
    def kinked(self) -> Flags:
        """Where slopes to both sides differ by a part of the largest that no curve leaves over a step: of a window's,
        and of events of the largest up to then, for the last of a long run respond by far more than the first."""
        if self.places[0] * self.places[1] > 0.0:
            return np.zeros(self.change.shape, dtype=bool)
        if self.values.of_events:
            size, noise = self.values.so_far(np.abs(self.slope)), self.off
        else:
            size, noise = (self.values.rows(one) / self.values.weights[:, None] for one in (self.scale, self.noise))
        return (self.change > np.maximum(BENT * size, SURE * noise)) & ~self.same

    @cached_property
    def bents(self) -> Floats:
        """By which part (blocks, nw) slopes change over a step, beyond noise; NaN where there are none."""
        return self._part(np.maximum(self.values.most(self.change) - 3.0 * self.noise, 0.0))

    @cached_property
    def noises(self) -> Floats:
        """Which part (blocks, nw) of slopes their noise is; NaN where there are none."""
        return self._part(self.noise)

    def _part(self, of: Floats) -> Floats:
        return np.divide(of, self.scale, out=np.full_like(of, np.nan), where=self.scale > 0.0)

    def error(self, bent: Floats) -> Floats:
        """Possible errors of slopes; bent (nw,): by which part those of motions change over a step, which is that of a
        difference to the one side that counts."""
        size, by = np.abs(self.slope), self.values.rows(np.fmax(self.bents, bent))
        both = cut_off(size, self.change, by, self.places)
        cut = np.where(self.values.valid.all(axis=0), both, by * size)
        return np.where(self.same & np.isfinite(size), 0.0, cut + self.off)
