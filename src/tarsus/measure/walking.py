"""Measures of a walk: where the body gets to, what its feet slide, and what it costs."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.core import _native
from tarsus.measure.history import RESOLUTION
from tarsus.measure.measure import Definition, Measured, Measures, Moments, Scope, of_feet, of_robot
from tarsus.measure.periods import by_period, cautions_of
from tarsus.measure.segments import Floats, Rows
from tarsus.measure.switching import charging_energy
from tarsus.measure.table import HasMeasures, Judgement, RunTable
from tarsus.measure.together import Stays
from tarsus.measure.whole import WHOLE_RUN, in_whole_run
from tarsus.model.structure import Walker
from tarsus.model.structure.walker import TILTS

STANDSTILL: float = _native.STANDSTILL
"""Stride [m] below which a walker stands: ratios to its stride have no value there."""


def measures_of(
    run: HasMeasures,
    period: float | None = None,
    skip: int | None = None,
    height: float = RESOLUTION,
    dwell: float | None = None,
    names: Collection[str] | None = None,
) -> Measures:
    """Every measure of a run: those of its walk, where it walks, then those of its feet by drive period and in the
    whole run; see `walk_statistics`, `period_statistics` and `whole_run_statistics`. Or, without warnings, those of
    ``names`` that it has, at the cost of these alone."""
    judgement = Judgement(RunTable.of(run), period, skip, height, dwell)
    found = {name: one.of(0) for name, one in measured(judgement, names).items()}
    warnings = () if names is not None else cautions_of(judgement, found)
    return Measures(found, warnings)


def measured(judgement: Judgement, names: Collection[str] | None = None) -> dict[str, Measured]:
    """Every measure of many runs of one kind of structure, as `measures_of` has them, or those of ``names``."""
    return {**in_the_walk(judgement, names), **by_period(judgement, names), **in_whole_run(judgement, names)}


def walk_statistics(run: HasMeasures, period: float | None = None, skip: int | None = None) -> Measures:
    """Measures of a walk by drive period; none for a structure that is no `Walker`.

    Parameters
    ----------
    period
        Drive period [s], a whole multiple of the run's own, which is the default.
    skip
        Periods dropped as transient at the start; by default a third of the whole ones (none of a single one).

    Raises
    ------
    InputError
        If ``period`` is no multiple of the run's own, at whose ends alone the way is known.
    """
    found = in_the_walk(Judgement(RunTable.of(run), period, skip))
    return Measures({name: one.of(0) for name, one in found.items()})


def in_the_walk(judgement: Judgement, names: Collection[str] | None = None) -> dict[str, Measured]:
    """The measures of `walk_statistics` of many runs: all, or those of ``names`` at the cost of these alone."""
    wanted = [name for name in WALK if names is None or name in names]
    if not wanted:
        return {}
    table = judgement.table
    structure = _structure(table.scene(int(table.variant[0]))) if len(table) else None
    if not isinstance(structure, Walker):
        return {}
    walks, moves = _Walks(judgement), set(structure.body_coordinates)
    return {name: WALK[name].of(walks, WALK[name]) for name in wanted if moves.intersection(WALK[name].moves)}


def _structure(scene: Any) -> Any:
    return None if scene is None else scene.robot.structure


@dataclass(frozen=True)
class _Walks:
    """Walks by drive period after transients; the periods of all runs are numbered one after the other."""

    judgement: Judgement

    @property
    def table(self) -> RunTable:
        """The runs."""
        return self.judgement.table

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates of the body, which every mark holds."""
        return _structure(self.table.scene(int(self.table.variant[0]))).body_coordinates

    @cached_property
    def mark_first(self) -> Rows:
        """Where each run's marks begin (nr + 1,)."""
        given = self.table.mark_first
        return np.zeros(len(self.table) + 1, dtype=np.intp) if given is None else given

    @cached_property
    def marks(self) -> np.ndarray:
        """Marks of all runs."""
        if self.table.marks is not None:
            return self.table.marks
        m, of_body = len(self.table.feet), len(self.coordinates)
        kind = [
            ("time", "f8"),
            ("body", "f8", (of_body,)),
            ("slipped", "f8", (m,)),
            ("lowest", "f8"),
            ("highest", "f8"),
        ]
        return np.zeros(0, dtype=kind)

    @cached_property
    def native(self) -> Any:
        """Periods of all runs by their marks. Raises InputError for a period that is no multiple of the run's own."""
        judgement, marks = self.judgement, self.marks
        own, span = judgement.table.period, judgement.spans
        each = np.round(span / own)
        odd = np.flatnonzero((each < 1) | (np.abs(span / own - each) > 1e-6 * each))
        if len(odd):
            raise InputError(
                f"period: expected a multiple of {own[odd[0]]:g} s, at which the way is known, got {span[odd[0]]:g} s"
            )
        columns = [marks["time"], marks["body"][:, 0], marks["lowest"], marks["highest"], marks["slipped"]]
        columns = [np.ascontiguousarray(one, dtype=float) for one in columns]
        marked, asked = (np.ascontiguousarray(one, dtype=float) for one in (own, span))
        dropped, count = judgement.used
        return _native.Walks(columns, len(self.table.feet), self.mark_first, marked, asked, dropped, count)

    @cached_property
    def _edges(self) -> tuple[Rows, Rows, Rows]:
        """Numbers of the marks at the start and at the end of every period, and the period's run."""
        return self.native.edges()

    @property
    def own(self) -> Rows:
        """Run of every period."""
        return self._edges[2]

    @cached_property
    def stride(self) -> Floats:
        """Surge of the body [m] over every period."""
        return self.native.stride()

    @cached_property
    def yaw(self) -> Floats:
        """Yaw [rad] of a body that turns at every mark."""
        return self.marks["body"][:, self.coordinates.index("yaw")]

    @cached_property
    def turn_rate(self) -> Floats:
        """Yaw over every period per time [rad/s]."""
        begin, end, _ = self._edges
        return (self.yaw[end] - self.yaw[begin]) / (self.marks["time"][end] - self.marks["time"][begin])

    @property
    def heading(self) -> Floats:
        """Yaw (nr,) [rad] at the last mark of every run, NaN for a run without."""
        last = self.mark_first[1:] - 1
        known = last >= self.mark_first[:-1]
        return np.where(known, self.yaw[last], np.nan) if len(self.yaw) else np.full(len(last), np.nan)

    @property
    def heave_span(self) -> Floats:
        """Highest minus lowest heave (nr,) [m] in all periods of every run, NaN for a run without."""
        begin, end, own = self._edges
        found = np.full(len(self.table), np.nan)
        runs, first = np.unique(own, return_index=True)
        if len(runs):
            last = np.append(first[1:], len(own)) - 1
            cuts = np.stack([begin[first] + 1, end[last] + 1], axis=1).ravel()  # a mark is of what came before it
            high, low = np.append(self.marks["highest"], -np.inf), np.append(self.marks["lowest"], np.inf)
            found[runs] = (np.maximum.reduceat(high, cuts) - np.minimum.reduceat(low, cuts))[::2]
        return found

    @cached_property
    def tilt(self) -> Floats:
        """Largest roll or pitch without sign [rad] at the ends of every period."""
        turns = [i for i, name in enumerate(self.coordinates) if name in TILTS]
        begin, end, _ = self._edges
        seen = np.abs(self.marks["body"][:, turns]).max(axis=1, initial=0.0)
        return np.maximum(seen[begin], seen[end])

    def _stays(self, robots: Rows, times: Floats) -> Stays:
        judgement = self.judgement
        return Stays.of(judgement.histories, len(self.table.feet), judgement.height, robots, times)

    @property
    def all_feet_up(self) -> Floats:
        """Share of every period in which no foot is on the ground."""
        begin, end, own = self._edges
        edges = self.marks["time"][np.concatenate([begin, end])]
        first, last = np.split(self._stays(np.tile(own, 2), edges).all_up(), 2)
        return np.divide(last - first, np.diff(edges.reshape(2, -1), axis=0)[0])

    @property
    def longest_hold(self) -> Floats:
        """Longest time (nr,) [s] of every run in which one foot at least is on the ground."""
        return self._stays(np.zeros(0, dtype=np.intp), np.zeros(0)).longest(len(self.table))

    @cached_property
    def strides(self) -> Moments:
        """Moments of the stride, run by run."""
        return Moments.of(self.stride, self.own, len(self.table))

    def robot(self, values: Floats, about: Definition) -> Measured:
        """A measure of the robot from its values by period."""
        return of_robot(values, self.own, len(self.table), about)

    def feet(self, values: Floats, about: Definition) -> Measured:
        """A measure of the feet from their values (np, m) by period."""
        feet, runs = self.table.feet, len(self.table)
        own = (self.own[:, None] * len(feet) + np.arange(len(feet))).ravel()
        return of_feet(Moments.of(values.ravel(), own, runs * len(feet)), runs, feet, about)

    def described(self, of: Callable[[Any], float]) -> Floats:
        """A number (nr,) that the scene of every run has."""
        variant = self.table.variant
        found, back = np.unique(variant, return_inverse=True)
        return np.array([of(self.table.scene(int(one))) for one in found])[back]

    @cached_property
    def energy(self) -> Floats:
        """Electrical energy [J] that all drives draw in every period, NaN where it is not known."""
        begin, end, own = self._edges
        time, out = self.marks["time"], np.zeros(len(own))
        known: dict[tuple[int, bytes], Floats] = {}
        runs, first = np.unique(own, return_index=True)
        for run, (a, b) in zip(runs.tolist(), pairwise([*first.tolist(), len(own)]), strict=True):
            edges = np.append(time[begin[a:b]], time[end[b - 1]])
            key = int(self.table.variant[run]), edges.tobytes()
            if key not in known:
                known[key] = _drawn(self.table.scene(key[0]), edges)
            out[a:b] = known[key]
        return out


def _drawn(scene: Any, edges: Floats) -> Floats:
    signals = scene.actuator_volts
    energy = np.zeros(len(edges) - 1)
    for name, drive in scene.robot.drives.items():
        energy += charging_energy(drive, signals[name], edges)
    return energy


def _per_length(walks: _Walks, about: Definition) -> Measured:
    length = walks.described(lambda scene: float(scene.robot.structure.length))
    return walks.robot(walks.native.body_lengths_per_second(length), about)


def _weight(scene: Any) -> float:
    gravity = scene.ground.gravity
    return 0.0 if gravity is None else scene.robot.structure.total_mass * gravity.acceleration


def _transport(walks: _Walks, about: Definition) -> Measured:
    drawn, weight = walks.robot(walks.energy, about), walks.described(_weight)
    numbers = (np.ascontiguousarray(one, dtype=float) for one in (weight, walks.strides.mean, walks.strides.spread))
    found: Any = _native.transports(drawn.value, np.asarray(drawn.n, dtype=np.int64), *numbers)
    return Measured(found[:, 0], found[:, 1], found[:, 2].astype(np.intp), about)


def _once(values: Floats, about: Definition) -> Measured:
    known = np.isfinite(values)
    none = np.full(len(values), np.nan)
    return Measured(np.where(known, values, np.nan), none, known.astype(np.intp), about)


@dataclass(frozen=True)
class _OfWalk(Definition):
    """A measure of walks, of bodies that have one of the coordinates ``moves``."""

    of: Callable[[_Walks, Definition], Measured]
    moves: Collection[str] = frozenset(("surge",))


WALK = {
    "stride": _OfWalk(
        "m", Scope.ROBOT, "surge of the body per drive period", lambda walks, about: walks.robot(walks.stride, about)
    ),
    "mean_speed": _OfWalk(
        "m/s",
        Scope.ROBOT,
        "stride over drive period",
        lambda walks, about: walks.robot(walks.native.mean_speed(), about),
    ),
    "body_lengths_per_second": _OfWalk(
        "1/s",
        Scope.ROBOT,
        "mean speed over the length of the body: that of its description, else from its first hip to its last; none "
        "where all hips are side by side",
        _per_length,
    ),
    "vertical_amplitude": _OfWalk(
        "m",
        Scope.ROBOT,
        "highest minus lowest heave of the body in a drive period",
        lambda walks, about: walks.robot(walks.native.vertical_amplitude(), about),
    ),
    "heave_span": _OfWalk(
        "m",
        Scope.ROBOT,
        "highest minus lowest heave of the body in all drive periods after the transient ones",
        lambda walks, about: _once(walks.heave_span, about),
    ),
    "tilt": _OfWalk(
        "rad",
        Scope.ROBOT,
        "largest roll or pitch of the body, without sign, at the ends of a drive period",
        lambda walks, about: walks.robot(walks.tilt, about),
        frozenset(TILTS),
    ),
    "all_feet_up": _OfWalk(
        "1",
        Scope.ROBOT,
        "share of a drive period in which no foot is on the ground, flights below the resolution of "
        "the source's vibrometer included as contact",
        lambda walks, about: walks.robot(walks.all_feet_up, about),
    ),
    "foot_slip": _OfWalk(
        "m",
        Scope.MEAN,
        "path that a foot slides in contact per drive period",
        lambda walks, about: walks.feet(walks.native.foot_slip(), about),
    ),
    "slip_ratio": _OfWalk(
        "1",
        Scope.MEAN,
        "foot slip over the sum of foot slip and stride, both without sign: 0 if the foot never slides, 1 if it slides "
        f"and the body gets nowhere; none where neither exceeds {STANDSTILL * 1e9:g} nm",
        lambda walks, about: walks.feet(walks.native.slip_ratio(), about),
    ),
    "electrical_energy": _OfWalk(
        "J",
        Scope.ROBOT,
        "electrical energy that all drives draw per drive period, one step of every leg: C dV^2 for every rise of a "
        "voltage by dV, less the share of the charge that is recovered; none where a capacitance is not given",
        lambda walks, about: walks.robot(walks.energy, about),
    ),
    "cost_of_transport": _OfWalk(
        "1",
        Scope.ROBOT,
        "electrical energy per drive period over the weight of the walker times the mean stride without its sign, its "
        "spread that of the stride in proportion; none without gravity or where the stride is below "
        f"{STANDSTILL * 1e9:g} nm",
        _transport,
    ),
    "max_heave": _OfWalk(
        "m",
        Scope.ROBOT,
        "largest heave of the body in the whole run, transients included",
        lambda walks, about: _once(walks.native.max_heave(), about),
    ),
    "max_surge": _OfWalk(
        "m",
        Scope.ROBOT,
        "farthest that the body gets from its start in the whole run, without sign, seen at the ends of drive periods",
        lambda walks, about: _once(walks.native.max_surge(), about),
    ),
    "longest_hold": _OfWalk(
        "s",
        Scope.ROBOT,
        "longest time in the whole run in which one foot at least is on the ground",
        lambda walks, about: _once(walks.longest_hold, about),
    ),
    "turn_rate": _OfWalk(
        "rad/s",
        Scope.ROBOT,
        "yaw of the body per drive period over drive period, positive to the left",
        lambda walks, about: walks.robot(walks.turn_rate, about),
        {"yaw"},
    ),
    "heading": _OfWalk(
        "rad",
        Scope.ROBOT,
        "yaw of the body at the end of the run, positive to the left",
        lambda walks, about: _once(walks.heading, about),
        {"yaw"},
    ),
}
"""Measures of walks by name: by drive period, and what the source plots of the body in a whole run from its start,
transients included (Figs. 4.8-4.11)."""

OF_EPISODES = frozenset(("max_heave", "max_surge", "longest_hold", "heading", *WHOLE_RUN))
"""Measures of a whole run from its start: a settled motion has none of them."""
