"""Least squares of records by windows of the engine: numbers of the scene and of the instruments, many records at once.

A record is cut into segments. Each is a window of the engine with a start of its own, which has nothing to do with
where the one before ended: what a motion forgets, and what no model says of it, ends there. WindowStarts are eliminated
(`tarsus.fit.normal_equations`); what is left are the numbers that segments share. A channel shows

    y(t) = gain * output(t - delay) + zero,

with white noise, and a discrepancy beside it: what the model is known to miss. Slopes by numbers of the scene and by
states of starts are differences of windows; by a delay the output's own rate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.normal_equations import Descent, Minimum, NormalEquations, descend
from tarsus.fit.unknowns import Prior
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan, lower_scene, slot
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

RATES = {
    Quantity.DISPLACEMENT: Quantity.VELOCITY,
    Quantity.VELOCITY: Quantity.ACCELERATION,
    Quantity.ANGLE: Quantity.ANGULAR_VELOCITY,
    Quantity.CHARGE: Quantity.CURRENT,
}
"""What a quantity's derivative by time is: what may be late by an unknown time."""
FAR = 0.5
"""Longest step of the logarithm of a number: beyond, windows between impacts are not linear in any."""

ENOUGH = 1e-3
"""Part of slopes that differences may be off by: a step of Gauss and Newton is off by as much, the next one by less."""
UNDER = "under "
"""How numbers of the ground under one foot begin, ``under L1: ground.friction.coefficient``: a factor of the ground's
own number there, one where the ground is the same under all feet."""


@dataclass(frozen=True)
class Seen:
    """A channel: what it shows, and what is known of its instrument.

    noise, discrepancy: standard deviations of a sample, in the output's unit; gain, zero, delay [s]: values, or names
    of unknown numbers, which channels and records may share.
    """

    output: Output
    noise: float
    discrepancy: float = 0.0
    gain: float | str = 1.0
    zero: float | str = 0.0
    delay: float | str = 0.0

    @property
    def sigma(self) -> float:
        """Standard deviation of what a right model leaves."""
        return float(np.hypot(self.noise, self.discrepancy))


@dataclass(frozen=True)
class SeenRecord:
    """A record: channels (nc), times (nt,) [s] in order, after the start of the drives, and values (nc, nt) in SI.

    Raises
    ------
    InputError
        If shapes do not fit each other, a noise is not positive, or a delay is asked of what has no known rate.
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
            if isinstance(one.delay, str) and one.output.quantity not in RATES:
                problems.append(f"{one.output.name}: its delay cannot be an unknown, for its rate is no output")
        if problems:
            raise InputError(problems)


FOLLOWED = 4.0
"""Mean square over the noise up to which a window is followed: twice the noise. Of twenty samples noise leaves less in
all windows but one of 10^8; a contact that is missing leaves hundreds."""


@dataclass(frozen=True)
class Segment:
    """A window on a record.

    record: number; begin [s]: when it starts, earlier than what its samples show; span [s]: samples that show what
    happened after the first and up to the second time are its own; state, spread (2n,): what is known of the start;
    contacts: what the feet do there. Feet that are held or just let go stay on the ground at the start, which takes
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
    before its minimum would still make; segments: with their starts as found; windows: there; left
    (nw, nc): mean squares over the noise by channel, NaN where there is none; settled: whether it would go no further;
    jumps: of tied segments, by how many of their ties' standard deviations starts are off the ends before.
    """

    values: Mapping[str, float]
    moved: Floats
    covariance: Floats
    ahead: Floats
    segments: tuple[Segment, ...]
    windows: WindowBatch
    left: Floats
    settled: bool
    jumps: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def followed(self) -> float:
        """Share of the windows that leave at most `FOLLOWED`: a fit that has lost some is wrong by far more than its
        covariance says."""
        return float(np.mean(np.nanmean(self.left, axis=1) <= FOLLOWED))


@dataclass(frozen=True)
class Flown:
    """Windows as simulated, at values of the numbers: where among the times of all each segment's channels are (nc
    arrays), and what they measured there; outputs and their rates (nc, times); scenes and plans of the records."""

    batch: WindowBatch
    places: list[list[NDArray[np.intp]]]
    measured: list[list[Floats]]
    outputs: Floats
    rates: Floats
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
    _made: dict[bytes, tuple[list[Scene], list[Plan]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _beside: dict[tuple[int, tuple[str, ...]], Entered] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _shared: Shared = field(default_factory=Shared, init=False, repr=False, compare=False)

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Numbers of the scene."""
        every = [one for record in self.records for one in record.channels]
        named = {name for one in every for name in (one.gain, one.zero, one.delay)}
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

    def solve(
        self,
        segments: Sequence[Segment],
        moved: Floats | None = None,
        *,
        weights: Floats | None = None,
        known: bool = False,
        rounds: int = 30,
    ) -> RecordFit:
        """Fit segments, from numbers (np,) standard deviations off what is known of them.

        weights (nw,): of the residuals of the segments, one unless given; known: numbers stay where they are, and every
        segment goes down by itself.
        """
        place = np.zeros(len(self.priors)) if moved is None else moved
        weight = np.ones(len(segments)) if weights is None else weights

        def equations(own: Floats, shared: Floats, part: NDArray[np.intp]) -> NormalEquations:
            chosen, there = [segments[int(w)] for w in part], place if known else shared
            return self.equations(chosen, own, there, weight[part], known=known)

        def costs(own: Floats, shared: Floats, part: NDArray[np.intp]) -> Floats:
            return self.costs([segments[int(w)] for w in part], own, place if known else shared, weight[part])

        found = descend(
            equations,
            np.zeros((len(segments), len(segments[0].state))),
            None if known else place,
            prior=None if known else (np.zeros(len(place)), np.eye(len(place))),
            costs=costs,
            how=Descent(rounds=rounds, far=np.inf if known else self.far),
        )
        return self.fitted(segments, found, found.own, place if known else found.shared)

    @cached_property
    def far(self) -> Floats:
        """Longest step of each number (np,), in standard deviations."""
        return np.array([np.inf if p.factor is None else FAR / np.log(p.factor) for p in self.priors.values()])

    def fitted(self, segments: Sequence[Segment], found: Minimum, own: Floats, place: Floats) -> RecordFit:
        """What a descent came to: starts (nw, q) and numbers (np,), known beforehand to their standard deviations."""
        information, score = (one.sum(axis=0) for one in found.equations.reduced())
        covariance = np.asarray(np.linalg.inv(information + np.eye(len(score))))
        ahead = covariance @ (score - place[: len(score)])
        settled = bool(found.settled.all())
        return self.ended(segments, self.flown(segments, own, place), place, covariance, ahead, settled)

    def ended(
        self,
        segments: Sequence[Segment],
        flown: Flown,
        place: Floats,
        covariance: Floats,
        ahead: Floats,
        settled: bool,
        jumps: Floats | None = None,
    ) -> RecordFit:
        """A fit whose windows are as flown at numbers (np,)."""
        left = [[float(r @ r) / r.size if r.size else np.nan for r in one] for one in self.left_of(segments, flown)]
        width = max(len(one) for one in left)
        pairs = zip(segments, flown.batch.starts, strict=True)
        return RecordFit(
            flown.values,
            place,
            covariance,
            ahead,
            tuple(replace(one, state=np.asarray(at.state, dtype=float), begin=at.t0) for one, at in pairs),
            flown.batch,
            np.array([[*one, *[np.nan] * (width - len(one))] for one in left]),
            settled,
            np.zeros(0) if jumps is None else jumps,
        )

    def residuals(self, segments: Sequence[Segment], own: Floats, moved: Floats) -> list[list[Floats]]:
        """What segments leave over the noise at starts (nw, q) and numbers (np,), by channel: model less measured."""
        return self.left_of(segments, self.flown(segments, own, moved))

    def costs(self, segments: Sequence[Segment], own: Floats, moved: Floats, weights: Floats) -> Floats:
        """Sums of squares (nw,) at starts (nw, q) and numbers (np,); infinite where a scene does not take the numbers,
        or a start is later than its samples."""
        try:
            residuals = self.residuals(segments, own, moved)
        except InputError:
            return np.full(len(segments), np.inf)
        squares = np.array([sum(float(one @ one) for one in each) for each in residuals])
        return squares * weights**2 + (own**2).sum(axis=1)

    def equations(
        self, segments: Sequence[Segment], own: Floats, moved: Floats, weights: Floats, *, known: bool = False
    ) -> NormalEquations:
        """Normal equations at starts (nw, q), with what is known of these, and numbers (np,), or at known numbers."""
        q, names = own.shape[1], () if known else tuple(self.priors)
        flown = self.flown(segments, own, moved, names)
        about = np.eye(q, q + len(names))
        residuals, rows = [], []
        pairs = zip(self.left_of(segments, flown), self.slopes_of(segments, flown, names), strict=True)
        for k, (parts, by) in enumerate(pairs):
            residuals.append(np.concatenate([*(weights[k] * one for one in parts), own[k]]))
            rows.append(np.vstack([weights[k] * by, about]))
        return NormalEquations.of(residuals, rows, q)

    def lowered(self, moved: Floats) -> tuple[list[Scene], list[Plan]]:
        """Scene and plan of every record at numbers (np,); those asked for last are kept."""
        key = moved.tobytes()
        if key not in self._made:
            values = self.values(moved)
            changes = {path: values[path] for path in self.paths if path not in self.directions}
            by = {path: values[name] * w for name, one in self.directions.items() for path, w in one.items()}
            each = {
                id(one): with_values(one, changes | {path: get_value(one, path) + by[path] for path in by})
                for one in self.scenes
            }
            plans = {one: lower_scene(scene, self._shared.drive) for one, scene in each.items()}
            self._made.clear()
            self._beside.clear()
            self._made[key] = [each[id(one)] for one in self.scenes], [plans[id(one)] for one in self.scenes]
        return self._made[key]

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
        scenes, plans = self.lowered(moved)
        data = {id(scenes[r]): r for r in dict.fromkeys(one.record for one in segments)}
        number = {r: list(data).index(id(scenes[r])) for r in dict.fromkeys(one.record for one in segments)}
        starts, first = list[WindowStart](), 0
        places, measured = list[list[NDArray[np.intp]]](), list[list[Floats]]()
        for segment, at in zip(segments, own, strict=True):
            shown, seen = _inside(self.records[segment.record], segment, values)
            when = np.unique(np.concatenate([*shown, [segment.span[1]]]))
            state = segment.state + free_of(plans[segment.record], segment) @ at
            starts.append(WindowStart(state, segment.begin, when, segment.contacts, number[segment.record]))
            places.append([first + np.searchsorted(when, one) for one in shown])
            measured.append(seen)
            first += len(when)
        entered = tuple(self._entered(scenes[r], plans[r], values, names) for r in data.values())
        by_start = names is not None and starts_too
        ways = [free_of(plans[one.record], one) for one in segments] if by_start else False
        by = WindowGradients(entered, ways, t0=False, enough=ENOUGH)
        batch = simulate_windows(plans[segments[0].record], starts, gradients=by)
        width = max(len(one.channels) for one in self.records)
        outputs, rates = np.zeros((2, width, first))
        for r, at in _parts(segments, batch):
            scene, channels = scenes[r], self.records[r].channels
            states, when = batch.states.part(at), batch.times[at]
            known: Any = {"system": plans[r].system, "drive": self._shared.drive}
            shown = [one.output for one in channels]
            outputs[: len(channels), at] = output_rows(scene, shown, when, **known).values(states)
            late = [c for c, one in enumerate(channels) if isinstance(one.delay, str)]
            wanted = [channels[c].output._replace(quantity=RATES[channels[c].output.quantity]) for c in late]
            if late:
                rates[np.array(late)[:, None], at] = output_rows(scene, wanted, when, **known).values(states)
        of = [one.record for one in segments]
        return Flown(batch, places, measured, outputs, rates, values, [scenes[r] for r in of], [plans[r] for r in of])

    def _entered(self, scene: Scene, plan: Plan, values: Mapping[str, float], names: Sequence[str] | None) -> Entered:
        """What enters windows of a scene, with what the ground is under single feet; made once for a scene."""
        key = id(scene), tuple(names or ())
        if key not in self._beside:
            self._beside[key] = self._entering(scene, plan, values, self.numbers(names))
        return self._beside[key]

    def _entering(self, scene: Scene, plan: Plan, values: Mapping[str, float], every: Sequence[str]) -> Entered:
        own = Entered.of(scene, plan, {name: self._along(name) for name in every if name not in self.feet})
        if not self.feet:
            return own
        ground = _UnderFeet(scene, {place: values[name] for name, place in self.feet.items()})

        def beside(wanted: Sequence[str], part: float) -> Mapping[str, ScenePair]:
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

        return Entered(ground.under(own.row), tuple(every), beside)

    def left_of(self, segments: Sequence[Segment], flown: Flown) -> list[list[Floats]]:
        """What segments leave over the noise, by channel."""
        out = []
        for segment, places, measured in zip(segments, flown.places, flown.measured, strict=True):
            channels, values = self.records[segment.record].channels, flown.values
            out.append(
                [
                    (_value(one.gain, values) * flown.outputs[c, at] + _value(one.zero, values) - measured[c])
                    / one.sigma
                    for c, (one, at) in enumerate(zip(channels, places, strict=True))
                ]
            )
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
                self._beside[id(flown.scenes[k]), tuple(names)],
                self._shared.drive,
            )
        by_output[~np.isfinite(by_output)] = 0.0
        column = {name: k for k, name in enumerate(names)}
        unit = [1.0 / float(self.priors[name].rates(np.array(flown.values[name]))) for name in names]
        out = []
        for segment, places in zip(segments, flown.places, strict=True):
            blocks = []
            for c, (one, at) in enumerate(zip(self.records[segment.record].channels, places, strict=True)):
                gain, there = _value(one.gain, flown.values), by_output[c, at]
                shared = np.zeros((len(at), len(names)))
                shared[:, [column[path] for path in paths]] = gain * there[:, : len(paths)]
                rates = ((one.gain, flown.outputs[c, at]), (one.zero, 1.0), (one.delay, -gain * flown.rates[c, at]))
                for name, by in rates:
                    if name in column:
                        shared[:, column[name]] += by
                blocks.append(np.hstack([gain * there[:, len(paths) :], shared * unit]) / one.sigma)
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


def _inside(record: SeenRecord, segment: Segment, values: Mapping[str, float]) -> tuple[list[Floats], list[Floats]]:
    """Of each channel the samples that show what happened in a segment: when that was, and what was measured. Those of
    a late channel come later."""
    times, measured = list[Floats](), list[Floats]()
    for row, one in zip(record.values, record.channels, strict=True):
        when = record.times - _value(one.delay, values)
        inside = (when > segment.span[0]) & (when <= segment.span[1])
        times.append(when[inside])
        measured.append(row[inside])
    return times, measured


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
