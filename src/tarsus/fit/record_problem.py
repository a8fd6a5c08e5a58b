"""Least squares of records by windows of the engine: numbers of the scene and of the instruments, many records at once.

A record is cut into segments. Each is a window of the engine with a start of its own; where starts are tied to the ends
before is a matter of `tarsus.fit.record_ties`. A channel shows

    y(t) = gain * output(t) + zero,

with white noise. Slopes by numbers of the scene and by states of starts are differences of windows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.fit.normal_equations import NormalEquations
from tarsus.fit.unknowns import Prior
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan, lower_scene, renumbered, slot
from tarsus.plan.rows import Rows
from tarsus.solve import (
    Contacts,
    Entered,
    Output,
    ScenePair,
    Shared,
    WindowBatch,
    WindowGradients,
    WindowStart,
    output_rows,
    output_slopes,
    simulate_windows,
)

FAR = 0.5
"""Longest step of the logarithm of a number: beyond, windows between impacts are not linear in any."""

ENOUGH = 1e-3
"""Part of slopes by which differences may err: a step of Gauss and Newton errs by as much, the next one by less."""
UNDER = "under "
"""How numbers of the ground under one foot begin, ``under L1: ground.friction.coefficient``: a factor of the ground's
own number there, one where the ground is the same under all feet."""


@dataclass(frozen=True)
class Seen:
    """A channel: what it shows, and what is known of its instrument.

    noise: standard deviation of a sample, in the output's unit; gain, zero: values, or names of unknown numbers, which
    channels and records may share.
    """

    output: Output
    noise: float
    gain: float | str = 1.0
    zero: float | str = 0.0


@dataclass(frozen=True)
class SeenRecord:
    """A record: channels (nc), times (nt,) [s] in order, after the start of the drives, and values (nc, nt) in SI.

    Raises
    ------
    InputError
        If shapes do not fit each other, or a noise is not positive.
    """

    channels: tuple[Seen, ...]
    times: Floats
    values: Floats

    def __post_init__(self) -> None:
        shape = len(self.channels), len(self.times)
        problems = []
        if self.values.shape != shape:
            problems.append(f"expected values of shape {shape}, got {self.values.shape}")
        for one in self.channels:
            if not one.noise > 0.0:
                problems.append(f"{one.output.name}: expected a noise above 0")
        if problems:
            raise InputError(problems)


@dataclass(frozen=True)
class Segment:
    """A window on a record.

    record: number; begin [s]: when it starts, earlier than what its samples show; span [s]: samples that show what
    happened after the first and up to the second time are its own; state, spread (2n,): what is known of the start;
    contacts: what the feet do there. Feet that are held or just released stay on the ground at the start, which takes
    their displacement and velocity from what may move.
    """

    record: int
    begin: float
    span: tuple[float, float]
    state: Floats
    spread: Floats
    contacts: Contacts = field(default_factory=Contacts)


@dataclass(frozen=True)
class RecordFit:
    """Where a fit ended.

    values: of the numbers, by name; moved (np,): the same in standard deviations of what was known beforehand;
    covariance (np, np): in these, what was known included; ahead (np,): the undamped step that a descent which ended
    before its minimum would still make; segments: with their starts as found; left (nw,): mean squares over the noise,
    NaN of a window without samples; farthest (nw,): how far one sample of each is off at most, over its noise; settled:
    whether it would go no further; jumps: of tied segments, by how many of their ties' standard deviations starts are
    off the ends before; cost: sum of squares of all that is left, of ties, and of what was known beforehand.
    """

    values: Mapping[str, float]
    moved: Floats
    covariance: Floats
    ahead: Floats
    segments: tuple[Segment, ...]
    left: Floats
    farthest: Floats
    settled: bool
    jumps: Floats
    cost: float


@dataclass(frozen=True)
class Flown:
    """Windows as simulated, at values of the numbers: where among the times of all each segment's samples are, and
    what channels (nc, k) measured there; outputs (nc, times); scenes and plans of the records."""

    batch: WindowBatch
    places: list[NDArray[np.intp]]
    measured: list[Floats]
    outputs: Floats
    values: dict[str, float]
    scenes: list[Scene]
    plans: list[Plan]


@dataclass(frozen=True)
class RecordProblem:
    """Records of one robot, each with its scene, and the numbers (np) that are sought, by path of the scene or by the
    name that channels call them, with what is known of each; of one with a factor the logarithm is sought. Scenes
    differ in what enters a run (signals, numbers of laws), not in the structure. directions: of numbers with a name of
    their own how far each number of the scene moves for one of it, as for legs that are alike."""

    scenes: tuple[Scene, ...]
    records: tuple[SeenRecord, ...]
    priors: Mapping[str, Prior]
    directions: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    _made: dict[bytes, dict[int, tuple[Scene, Plan]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _first: dict[int, Plan] = field(default_factory=dict, init=False, repr=False, compare=False)
    _entered_by: dict[tuple[int, tuple[str, ...]], Entered] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _shared: Shared = field(default_factory=Shared, init=False, repr=False, compare=False)

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Numbers of the scene."""
        every = [one for record in self.records for one in record.channels]
        named = {name for one in every for name in (one.gain, one.zero)}
        return tuple(name for name in self.priors if name not in named and name not in self.feet)

    @cached_property
    def feet(self) -> dict[str, tuple[int, str]]:
        """Numbers of single feet by name: which foot, and the path of the ground that they are a factor of."""
        names = list(self.scenes[0].robot.feet)
        parts = {name: name.removeprefix(UNDER).partition(": ") for name in self.priors if name.startswith(UNDER)}
        return {name: (names.index(foot), path) for name, (foot, _, path) in parts.items()}

    def numbers(self, names: Sequence[str] | None) -> tuple[str, ...]:
        """Those of some names by which windows have derivatives: of the scene, then of single feet."""
        return tuple(name for name in (*self.paths, *self.feet) if name in (names or ()))

    def _along(self, name: str) -> Mapping[str, float]:
        """How far numbers of the scene move for one of a number."""
        return self.directions.get(name, {name: 1.0})

    def values(self, moved: Floats) -> dict[str, float]:
        """Numbers by name at (np,), standard deviations from what is known."""
        pairs = zip(self.priors.items(), moved.tolist(), strict=True)
        return {name: prior.placed(by) for (name, prior), by in pairs}

    @cached_property
    def far(self) -> Floats:
        """Longest step of each number (np,), in standard deviations."""
        return np.array([np.inf if p.factor is None else FAR / np.log(p.factor) for p in self.priors.values()])

    def residuals(self, segments: Sequence[Segment], own: Floats, moved: Floats) -> list[Floats]:
        """What channels of segments (nc, k) leave over the noise at starts (nw, q) and numbers (np,): model less
        measured."""
        return self.left_of(segments, self.flown(segments, own, moved))

    def equations(self, segments: Sequence[Segment], own: Floats, moved: Floats) -> NormalEquations:
        """Normal equations at starts (nw, q), with what is known of these, and numbers (np,)."""
        q, names = own.shape[1], tuple(self.priors)
        flown = self.flown(segments, own, moved, names)
        about, left = np.eye(q, q + len(names)), self.left_of(segments, flown)
        residuals = [np.append(one, start) for one, start in zip(left, own, strict=True)]
        rows = [np.vstack([by, about]) for by in self.slopes_of(segments, flown, names)]
        return NormalEquations.of(residuals, rows, q)

    def lowered(self, moved: Floats, record: int) -> tuple[Scene, Plan]:
        """Scene and plan of a record at numbers (np,); those at the numbers asked for last are kept."""
        key, one = moved.tobytes(), self.scenes[record]
        if key not in self._made:
            self._made.clear()
            self._entered_by.clear()
            self._made[key] = {}
        made = self._made[key]
        if id(one) not in made:
            scene = self._changed(one, self.values(moved), made)
            first = self._first.get(id(one))
            plan = None if first is None else renumbered(first, scene, self._sought)
            made[id(one)] = scene, plan or lower_scene(scene, self._shared.drive)
            self._first.setdefault(id(one), made[id(one)][1])
        return made[id(one)]

    @cached_property
    def _sought(self) -> tuple[str, ...]:
        """Paths of all numbers that move."""
        along = (path for one in self.directions.values() for path in one)
        return (*(path for path in self.paths if path not in self.directions), *along)

    def _changed(self, one: Scene, values: Mapping[str, float], made: Mapping[int, tuple[Scene, Plan]]) -> Scene:
        """A scene with values of the numbers; what they are of is that of another of the same robot and ground, where
        one is made."""
        if all(path.startswith(("robot.", "ground.", "grounds.")) for path in self._sought):
            for other in self.scenes:
                same = other.robot is one.robot and other.ground is one.ground and other.grounds == one.grounds
                if same and id(other) in made:
                    like = made[id(other)][0]
                    return one.model_copy(update={"robot": like.robot, "ground": like.ground, "grounds": like.grounds})
        changes = {path: values[path] for path in self._sought if path in values}
        by = {path: values[name] * w for name, along in self.directions.items() for path, w in along.items()}
        return with_values(one, changes | {path: get_value(one, path) + by[path] for path in by})

    @cached_property
    def _forces(self) -> bool:
        """Whether any channel shows forces of the ground."""
        pairs = zip(self.scenes, self.records, strict=True)
        return any(output_rows(a, [c.output for c in b.channels], b.times[:1]).pressed for a, b in pairs)

    def flown(
        self,
        segments: Sequence[Segment],
        own: Floats,
        moved: Floats,
        names: Sequence[str] | None = None,
        *,
        starts_too: bool = True,
    ) -> Flown:
        """Windows with derivatives by starts, unless they are left out, and by numbers of these names; without any
        unless given."""
        values = self.values(moved)
        lowered = {r: self.lowered(moved, r) for r in dict.fromkeys(one.record for one in segments)}
        scenes = {r: scene for r, (scene, _) in lowered.items()}
        plans = {r: plan for r, (_, plan) in lowered.items()}
        data = {id(scene): r for r, scene in scenes.items()}
        number = {r: list(data).index(id(scene)) for r, scene in scenes.items()}
        starts, first = list[WindowStart](), 0
        places, measured = list[NDArray[np.intp]](), list[Floats]()
        for segment, at in zip(segments, own, strict=True):
            record = self.records[segment.record]
            inside = (record.times > segment.span[0]) & (record.times <= segment.span[1])
            when = np.union1d(record.times[inside], segment.span[1])
            state = segment.state + free_of(plans[segment.record], segment) @ at
            starts.append(WindowStart(state, segment.begin, when, segment.contacts, number[segment.record]))
            places.append(first + np.arange(np.count_nonzero(inside)))
            measured.append(record.values[:, inside])
            first += len(when)
        entered = tuple(self._entered(scenes[r], plans[r], values, names) for r in data.values())
        by_start = names is not None and starts_too
        ways = [free_of(plans[one.record], one) for one in segments] if by_start else False
        by = WindowGradients(entered, ways, t0=False, enough=ENOUGH)
        batch = simulate_windows(plans[segments[0].record], starts, gradients=by, forces=self._forces)
        width = max(len(one.channels) for one in self.records)
        outputs = np.zeros((width, first))
        for r, at in _parts(segments, batch):
            shown, states = [one.output for one in self.records[r].channels], batch.states.part(at)
            rows = output_rows(scenes[r], shown, batch.times[at], system=plans[r].system, drive=self._shared.drive)
            outputs[: len(shown), at] = rows.values(states)
        of = [one.record for one in segments]
        return Flown(batch, places, measured, outputs, values, [scenes[r] for r in of], [plans[r] for r in of])

    def _entered(self, scene: Scene, plan: Plan, values: Mapping[str, float], names: Sequence[str] | None) -> Entered:
        """What enters windows of a scene, with what the ground is under single feet; made once for a scene."""
        key = id(scene), tuple(names or ())
        if key not in self._entered_by:
            self._entered_by[key] = self._entering(scene, plan, values, self.numbers(names))
        return self._entered_by[key]

    def _entering(self, scene: Scene, plan: Plan, values: Mapping[str, float], every: Sequence[str]) -> Entered:
        own = Entered.of(scene, plan, {name: self._along(name) for name in every if name not in self.feet})
        if not self.feet:
            return own
        ground = _UnderFeet(scene, {place: values[name] for name, place in self.feet.items()})

        def perturbed(wanted: Sequence[str], part: float) -> Mapping[str, ScenePair]:
            found = own.pairs([name for name in wanted if name not in self.feet], part)
            out = {
                name: ScenePair(one.places, tuple((plan, ground.under(row)) for plan, row in one.copies))
                for name, one in found.items()
            }
            steps = {name: values[name] * np.array([-part, part]) for name in wanted if name in self.feet}
            return out | {
                name: ScenePair(by, tuple((None, ground.moved(self.feet[name], step).under(own.row)) for step in by))
                for name, by in steps.items()
            }

        return Entered(ground.under(own.row), tuple(every), perturbed)

    def left_of(self, segments: Sequence[Segment], flown: Flown) -> list[Floats]:
        """What channels of segments (nc, k) leave over the noise."""
        out = []
        for segment, at, measured in zip(segments, flown.places, flown.measured, strict=True):
            channels = self.records[segment.record].channels
            numbers = [(_value(one.gain, flown.values), _value(one.zero, flown.values), one.noise) for one in channels]
            gain, zero, noise = np.array(numbers).T[:, :, None]
            out.append((gain * flown.outputs[: len(channels), at] + zero - measured) / noise)
        return out

    def slopes_of(self, segments: Sequence[Segment], flown: Flown, names: Sequence[str]) -> list[Floats]:
        """Slopes (residuals, q + np) of what segments leave over the noise by their starts and by the numbers of these
        names, in standard deviations; zero where the motion has none, as behind a foot that only just touches."""
        batch = flown.batch
        assert batch.slopes is not None
        paths = self.numbers(names)
        by_output = np.zeros((*flown.outputs.shape, len(batch.slopes.names)))
        for r, at in _parts(segments, batch):
            k = next(k for k, one in enumerate(segments) if one.record == r)
            own = replace(batch.slopes, states=batch.slopes.states.part(at))
            channels = [one.output for one in self.records[r].channels]
            by_output[: len(channels), at] = output_slopes(
                flown.scenes[k],
                channels,
                batch.times[at],
                batch.states.part(at),
                own,
                {path: self._along(path) for path in paths if path not in self.feet},
                flown.plans[k],
                self._entered_by[id(flown.scenes[k]), tuple(names)],
                self._shared.drive,
            )
        by_output[~np.isfinite(by_output)] = 0.0
        column = {name: k for k, name in enumerate(names)}
        unit = [1.0 / float(self.priors[name].rates(np.array(flown.values[name]))) for name in names]
        out = []
        for segment, at in zip(segments, flown.places, strict=True):
            blocks = []
            for c, one in enumerate(self.records[segment.record].channels):
                gain, there = _value(one.gain, flown.values), by_output[c, at]
                shared = np.zeros((len(at), len(names)))
                shared[:, [column[path] for path in paths]] = gain * there[:, : len(paths)]
                for name, by in ((one.gain, flown.outputs[c, at]), (one.zero, 1.0)):
                    if name in column:
                        shared[:, column[name]] += by
                blocks.append(np.hstack([gain * there[:, len(paths) :], shared * unit]) / one.noise)
            out.append(np.vstack(blocks))
        return out

    def end_slopes(
        self, segments: Sequence[Segment], flown: Flown, k: int, names: Sequence[str]
    ) -> tuple[Floats, Floats]:
        """Slopes of the state at a segment's end by its start (2n, 2n) and by the numbers (2n, np), in standard
        deviations; zero where there are none."""
        batch, paths = flown.batch, self.numbers(names)
        assert batch.slopes is not None
        states, at, size = batch.slopes.states, batch.first[k + 1] - 1, len(segments[k].state)
        end = np.concatenate([states.x[:, at], states.v[:, at]])
        end[~np.isfinite(end)] = 0.0
        by_numbers = np.zeros((size, len(names)))
        for j, path in enumerate(paths):
            rate = float(self.priors[path].rates(np.array(flown.values[path])))
            by_numbers[:, names.index(path)] = end[:, j] / rate
        return np.asarray(end[:, len(paths) : len(paths) + size], dtype=np.float64), by_numbers


@dataclass(frozen=True)
class _UnderFeet:
    """Factors of a scene's ground under single feet, by foot and path."""

    scene: Scene
    factors: Mapping[tuple[int, str], float]

    def moved(self, at: tuple[int, str], by: float) -> _UnderFeet:
        """With one of them otherwise."""
        return replace(self, factors={**self.factors, at: self.factors[at] + by})

    def under(self, row: Rows) -> Rows:
        """A row of data with these."""
        parameters = row.parameters.copy()
        for (foot, path), factor in self.factors.items():
            place = slot(self.scene, path)
            assert place is not None
            parameters[:, foot, place.at] *= factor
        return replace(row, parameters=parameters)


def _parts(segments: Sequence[Segment], batch: WindowBatch) -> list[tuple[int, NDArray[np.intp]]]:
    """Records with segments, and which of a batch's times are on them."""
    of = np.repeat([one.record for one in segments], np.diff(batch.first))
    return [(int(r), np.flatnonzero(of == r)) for r in np.unique(of)]


def _value(one: float | str, values: Mapping[str, float]) -> float:
    return values[one] if isinstance(one, str) else one


def free_of(plan: Plan, segment: Segment) -> Floats:
    """Changes (2n, 2n) of a start by its standard deviations, without what feet on the ground leave no choice."""
    feet, n = [*segment.contacts.held, *segment.contacts.leaving], len(plan.system.mass)
    out = np.diag(segment.spread)
    if not feet:
        return out
    for part in (slice(0, n), slice(n, 2 * n)):
        onto = plan.system.normals[:, feet].T * segment.spread[part]
        out[part, part] -= (segment.spread[part, None] * np.linalg.pinv(onto)) @ onto
    return out
