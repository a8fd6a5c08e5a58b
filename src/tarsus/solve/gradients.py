"""Runs with exact first derivatives: of events, of states at any time, of measures and of energies."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.core.arrays import E_APEX, E_TIME
from tarsus.core.replay import SampledStates
from tarsus.measure.measure import no_measure
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.table import RunTable
from tarsus.measure.whole import WHOLE_RUN
from tarsus.solve.acting import Acting
from tarsus.solve.codes import EVENT_TYPE, event_places, structured_events, structured_marks
from tarsus.solve.contacts import Contacts
from tarsus.solve.directional import EventDerivatives, Ways, directional_slopes, measure_slopes, table_of
from tarsus.solve.engine import RECORDED, Accuracy, RawRuns, execute, settings_of
from tarsus.solve.lanes import Doubt, Tangents, doubted, tangents, walk_tangents
from tarsus.solve.motion import Replayed
from tarsus.solve.results import Batch
from tarsus.solve.run import Run, increasing
from tarsus.solve.simulate import Shared, kept, prepared
from tarsus.solve.tangents import Direction, Entering, directions_of, entering

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = npt.NDArray[np.float64]

_ONE_SIDED = {Doubt.AT_THRESHOLD, Doubt.EDGE_AT_START}
"""Where the derivative to the run's own side is the one reported."""
_KINKED = (
    "an event lies on the edge of a period or on a threshold of the measure, which has a kink or a jump there"
)


@dataclass(frozen=True)
class Gradient(Mapping[str, float]):
    """Derivatives of one number of a run by path, SI units; NaN where there is none.

    flags: sentences by path that say why; one_sided: the derivative to one side, by path, where that alone is defined.
    """

    by_path: Mapping[str, float]
    flags: Mapping[str, tuple[str, ...]]
    one_sided: Mapping[str, float]

    def __getitem__(self, path: str) -> float:
        return self.by_path[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_path)

    def __len__(self) -> int:
        return len(self.by_path)


@dataclass(frozen=True, repr=False)
class GradientRun(Run):
    """A finished simulation with derivatives by numbers, or along directions of several; nothing is
    computed before it is asked for."""

    entered: Entering = field(kw_only=True)
    directions: tuple[Direction, ...] = field(kw_only=True)

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths, or names of directions, by which there are derivatives."""
        return self.entered.paths

    @property
    def raw(self) -> RawRuns:
        """What the engine left of the run."""
        assert isinstance(self.log, RawRuns)
        return self.log

    def _tangents(self, times: Floats | None = None, *, energies: bool = False) -> Tangents:
        """Derivatives with samples at times [s], and with energies."""
        if self.plan.legs is not None:
            found = walk_tangents(
                self.plan, self.duration, self.entered, accuracy=self.accuracy, account=energies, times=times
            )
            return found.of_run(
                len(self.log.events), len(self.log.marks if self.log.marks is not None else ())
            )
        settings = settings_of(self.plan, self.duration, self.accuracy or RECORDED, record=True)
        return tangents(
            self.plan, self.raw.book, self.entered, self.raw, settings, times=times, energies=energies
        )

    def sampled(self, times: Floats) -> Floats:
        """Derivatives of samples at times [s], in order, as `Tangents` has them."""
        return self._tangents(times).samples

    @cached_property
    def _derived(self) -> Tangents:
        return self._tangents()

    def _reasons(self, path: int, *, energy: bool = False) -> list[tuple[int, int]]:
        """Event and reason of every flag of a path."""
        return [
            (int(event), int(reason))
            for event, reason, of in self._derived.flags
            if of in (-1, path) and (energy or reason != Doubt.APART)
        ]

    def _sentence(self, event: int, reason: int) -> str:
        rows = self.log.events
        if event >= len(rows):
            return doubted(reason, "a foot", self.end_time)
        return doubted(reason, f"foot '{self.foot_names[int(rows[event, 1])]}'", rows[event, 0])

    @property
    def flags(self) -> Mapping[str, tuple[str, ...]]:
        """Why derivatives by a path are not to be had of what comes after some moment, by path; none as a rule."""
        found = {
            path: tuple(self._sentence(*one) for one in self._reasons(p)) for p, path in enumerate(self.paths)
        }
        return MappingProxyType({path: tuple(dict.fromkeys(texts)) for path, texts in found.items() if texts})

    @cached_property
    def event_gradients(self) -> Mapping[str, npt.NDArray[np.void]]:
        """Derivatives of every number of the events by path, fields as those of `events`; NaN from an event on at which
        there is none. ``foot`` and ``kind`` are those of the events."""
        out = {}
        places = event_places(self.log.events)
        for p, path in enumerate(self.paths):
            rows = self._derived.events[..., p].copy()
            for event, _ in self._reasons(p):
                rows[event:] = np.nan
            found = np.zeros(len(places["kind"]), dtype=EVENT_TYPE)
            for column, (name, place) in enumerate(places.items()):
                found[name] = (
                    self.log.events[place, column] if name in ("foot", "kind") else rows[place, column]
                )
            for name in ("apex", "apex_time"):  # seen before the event from which on there is none
                found[name][np.isnan(rows[places["kind"], E_APEX])] = np.nan
            out[path] = found
        return MappingProxyType(out)

    def state_gradients(self, times: npt.ArrayLike) -> Mapping[str, SampledStates]:
        """Derivatives of the states and forces at times [s], in order, by path, as `states` has them; NaN from the
        time on from which there is none. At the very moment of an event they are those after it.

        Raises InputError where the times are not in order.
        """
        when = increasing(times)
        samples = self._tangents(when).samples
        n, m = self.plan.system.normals.shape
        held = self.states(when).held
        out = {}
        for p, path in enumerate(self.paths):
            rows = samples[..., p].T.copy()
            for event, _ in self._reasons(p):
                start = self.log.events[event, 0] if event < len(self.log.events) else self.end_time
                rows[:, when >= start] = np.nan
            motion, feet = np.split(rows, [2 * n])
            gap, rate, resistive, smooth, pull = feet.reshape(5, m, len(when))
            out[path] = SampledStates(motion[:n], motion[n:], gap, rate, resistive, smooth, pull, held)
        return MappingProxyType(out)

    def gradient(self, name: str) -> Gradient:
        """Derivatives of a measure by path; of a term of the energy ledger [J] as ``ledger.work_in``, of a law's work
        there as ``ledger.film``.

        Raises InputError for a name that is neither, and for the work of a law that acts together with others of its
        kind.
        """
        term = name.removeprefix("ledger.")
        if term != name:
            if term not in self._energies:
                known = ", ".join(f"ledger.{one}" for one in self._energies)
                raise InputError(
                    f"{name}: the ledger has no such term, or laws that act together do that work; there are {known}"
                )
            return self._gradient(self._energies[term], np.zeros(len(self.paths), dtype=bool), energy=True)
        if name not in PER_WINDOW and name not in WHOLE_RUN and name not in self.measures:
            raise InputError(no_measure(name, self.measures))
        return self._gradient(*measure_slopes(self._log, self.foot_names, name))

    def gradient_of(self, objective: Callable[[npt.NDArray[np.void]], float]) -> Gradient:
        """Derivatives by path of any function of the events (a structured array as `all_events`, with the period
        marks, at which apexes begin anew)."""

        def values(rows: Floats, periods: Floats, along: Floats) -> Floats:
            return np.array([float(objective(structured_events(np.ascontiguousarray(one)))) for one in rows])

        return self._gradient(*directional_slopes(self._log, values))

    def gradient_along(
        self, slopes: Callable[[EventDerivatives], tuple[Floats, npt.NDArray[np.bool_]]]
    ) -> Gradient:
        """Derivatives by path of a number from what a function finds along those of the events."""
        return self._gradient(*slopes(self._log))

    def along(self, numbers: Sequence[int]) -> GradientRun:
        """The same run with derivatives by some of its paths, by their numbers."""
        return replace(self, entered=self.entered.some(numbers))

    @property
    def period_moves(self) -> bool:
        """Whether the drive period depends on a number at the paths."""
        return bool(self.entered.data.period.any())

    def slopes_of(self, numbers: Callable[[RunTable], Floats]) -> Floats:
        """Derivatives (..., P) by path of several numbers of the events at once, which a function makes of many runs
        (nr, ...) as measures see them; NaN where there is none."""

        def values(rows: Floats, periods: Floats, along: Floats) -> Floats:
            return numbers(table_of(self._log, self.foot_names, rows, periods, along))

        slopes, kinked = directional_slopes(self._log, values)
        lost = np.array([bool(self._reasons(p)) for p in range(len(self.paths))])
        missing = kinked | lost.reshape(-1, *(1,) * (slopes.ndim - 1))
        return np.moveaxis(np.where(missing, np.nan, slopes), 0, -1)

    @cached_property
    def way_gradients(self) -> Mapping[str, npt.NDArray[np.void]]:
        """Derivatives of a walker's marks by path, fields as those of `marks`; NaN from the time on from which there is
        none."""
        derived, out = self._derived, {}
        assert self.log.marks is not None
        for p, path in enumerate(self.paths):
            rows = derived.marks[..., p].copy()
            for event, _ in self._reasons(p):
                start = self.log.events[event, E_TIME] if event < len(self.log.events) else self.end_time
                rows[self.log.marks[:, 0] >= start] = np.nan
            out[path] = structured_marks(rows, len(self.foot_names))
        return MappingProxyType(out)

    @property
    def _log(self) -> EventDerivatives:
        derived, marks = self._derived, self.log.marks
        ways = None if marks is None else Ways(marks, derived.marks, self.scene, self.directions)
        return EventDerivatives(
            self.log.events, derived.events, self.end_time, self.period, self.entered.data.period[0], ways
        )

    def _gradient(self, values: Floats, kinked: npt.NDArray[np.bool_], *, energy: bool = False) -> Gradient:
        return self.gradient_from(
            values, kinked, [self._reasons(p, energy=energy) for p in range(len(self.paths))]
        )

    def gradient_from(
        self, values: Floats, kinked: npt.NDArray[np.bool_], doubts: Sequence[Sequence[tuple[int, int]]]
    ) -> Gradient:
        """The gradient of a number from its derivatives (P,), where it has a kink (P,), and event and reason of the
        flags of each path."""
        plain, flags, one_sided = {}, {}, {}
        for p, (path, reasons) in enumerate(zip(self.paths, doubts, strict=True)):
            texts = [self._sentence(*one) for one in reasons] + [_KINKED] * bool(kinked[p])
            plain[path] = float("nan") if texts else float(values[p])
            if texts:
                flags[path] = tuple(dict.fromkeys(texts))
                if not kinked[p] and all(reason in _ONE_SIDED for _, reason in reasons):
                    one_sided[path] = float(values[p])
        return Gradient(plain, flags, one_sided)

    @cached_property
    def _energies(self) -> Mapping[str, Floats]:
        from tarsus.solve.energy_slopes import energy_slopes

        return energy_slopes(self, self.entered, self._tangents(np.array([self.end_time]), energies=True))


@dataclass(frozen=True, repr=False)
class GradientBatch(Batch):
    """A batch of runs with derivatives, in ``made``."""

    made: tuple[GradientRun, ...] = ()

    def gradient(self, name: str) -> Mapping[str, Floats]:
        """Derivatives of a measure or a term of the ledger of every run by path, in the batch's shape; NaN where
        there is none, see `Gradient` of the run in ``made``."""
        found = [run.gradient(name) for run in self.made]
        paths = self.made[0].paths if self.made else ()
        return MappingProxyType(
            {path: np.array([one[path] for one in found]).reshape(self.shape) for path in paths}
        )


def gradient_run(
    scene: Scene,
    paths: Sequence[str] | Mapping[str, Direction],
    seconds: float,
    accuracy: Accuracy | None,
    shared: Shared,
) -> GradientRun:
    """A run with derivatives by the numbers at paths, or along directions by name.

    Raises InputError as `tarsus.simulate` does.
    """
    start = time.perf_counter()
    engine, rows = prepared(scene, {}, seconds, shared)
    plan, accuracy, period = engine.plan, accuracy or RECORDED, float(rows.periods[0])
    given = entering(scene, plan, paths, seconds)
    given.row.scales[:, 2] = period
    moving = {"entered": given, "directions": tuple(directions_of(scene, paths).values())}
    if plan.legs is not None:
        motion = kept(engine, given.row, accuracy)
    else:
        begin = Contacts().begin(plan.feet, 0.0)
        log = execute(plan, seconds, rows=given.row, accuracy=accuracy, record=True, start=begin)
        motion = Replayed(Acting(plan, given.row), log)
    spent = time.perf_counter() - start
    return GradientRun(scene, seconds, period, motion.log, {}, accuracy, kept=motion, wall_s=spent, **moving)
