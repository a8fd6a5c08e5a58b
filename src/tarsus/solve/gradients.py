"""Runs with first derivatives of all that they give: events, states at any time, measures, energies, series."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.base.spec import get_value
from tarsus.core.states import SampledStates
from tarsus.measure.measure import no_measure
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.table import Judgement, RunTable
from tarsus.measure.walking import measured
from tarsus.measure.whole import WHOLE_RUN
from tarsus.plan.slots import rows_for, slot
from tarsus.solve.codes import EVENT_TYPE, event_rows, structured_marks
from tarsus.solve.differences import MOST, ROUNDED, STEP, Direction, Slopes, Stencil, directions_of, slopes_of
from tarsus.solve.engine import SINGLE_RUN, Accuracy, Engine
from tarsus.solve.results import Batch
from tarsus.solve.run import Run, changed_run, increasing
from tarsus.solve.shared import Shared
from tarsus.solve.slopes import Differenced, Lane, LaneSlopes, Wanted, as_states, no_states, weights_of
from tarsus.solve.window_run import Ran

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = npt.NDArray[np.float64]

FINER = 1e-2
"""Part of its tolerance with which a run is made once more, in other steps all along: how far the two differ is what
the first one is known to."""
TRIES = 3
"""Other steps at most: where copies have other events each is a hundredth of the one before, down to `LEAST` of the
first; elsewhere one more does."""
_KINKED = "to both sides it changes otherwise: an event lies on an edge of a period or on a threshold of the measure"


@dataclass(frozen=True)
class Gradient(Mapping[str, float]):
    """Derivatives of one number of a run by path, SI units; NaN where there is none.

    error: the error of each, estimated from what the run itself is known to and from how its copies bend; flags:
    sentences by path that say why there is none; one_sided: the derivative to one side, by path, where that alone is
    defined.
    """

    by_path: Mapping[str, float]
    error: Mapping[str, float]
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
    """A finished simulation with derivatives by numbers, or along directions of several.

    The perturbed runs are made when the first derivative is asked for: two for each number, or four.
    """

    stencils: Mapping[str, Stencil] = field(kw_only=True)
    shared: Shared = field(kw_only=True)

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths, or names of directions, by which there are derivatives."""
        return tuple(self.stencils)

    @cached_property
    def _finer(self) -> Run:
        """The same run in other steps."""
        own = self.accuracy or SINGLE_RUN
        other = replace(own, gap=FINER * own.gap, drive=FINER * own.drive)
        return changed_run(self.base, self.values, self.duration, other, self.shared)

    @cached_property
    def _best(self) -> Mapping[str, LaneSlopes]:
        """Derivatives of events by path, at the step that suits the number: 1e-5 of it unless runs respond otherwise.
        Where nothing touches, its motion at the end decides."""
        times = np.zeros(0) if len(self.events) else np.array([self.end_time])
        best = self._differenced(times).best(len(self.stencils))
        return MappingProxyType({path: best[k] for k, path in enumerate(self.stencils)})

    def _differenced(self, times: Floats) -> Differenced:
        """The run and its perturbed copies, sampled at times (nt,) [s]."""
        own, finer = ran_of(self, times), ran_of(self._finer, times)
        return Differenced(
            own,
            finer,
            np.full(1, np.inf),
            partial(self._lanes, times),
            weights_of(self.plan),
            enough=0.0,
            tries=TRIES,
            farthest=MOST,
        )

    def _lanes(self, times: Floats, wanted: Sequence[Wanted]) -> list[Lane]:
        """Perturbed copies of the run, sampled at times (nt,) [s]."""
        stencils, out = list[tuple[Wanted, Stencil]](), list[Lane]()
        for one in wanted:
            first = self.stencils[self.paths[one[0]]]
            try:
                part = STEP * one[1]
                new = first if one[1] == 1.0 else Stencil.of(self.scene, first.direction, part, self.plan)
            except InputError:  # it may not vary so far
                continue
            stencils.append((one, new))
        runs = self._runs_at([one for _, one in stencils])
        for ((number, factor, every), one), both in zip(stencils, runs, strict=True):
            steps, rounded = np.array([one.step]), np.array([ROUNDED / one.part])
            near, far = (ran_of(run, times) for run in both)
            out.append(Lane(number, factor, every, one.places / one.step, steps, rounded, (near, far), runs=both))
        return out

    def _runs_at(self, stencils: Sequence[Stencil]) -> list[tuple[Run, ...]]:
        """Copies of the run at the places of stencils: those that differ in data of its plan in one call of the
        engine."""
        rows = [one.values(place) for one in stencils for place in one.places]
        data = [i for i, row in enumerate(rows) if all(slot(self.scene, path) is not None for path in row)]
        found = dict(zip(data, self._copies_in_one_plan([rows[i] for i in data]), strict=True))
        for i in set(range(len(rows))) - found.keys():
            found[i] = changed_run(self.scene, rows[i], self.duration, self.accuracy, self.shared)
        runs = iter([found[i] for i in range(len(rows))])
        return [tuple(next(runs) for _ in one.places) for one in stencils]

    def _copies_in_one_plan(self, rows: Sequence[Mapping[str, float]]) -> list[Run]:
        """Runs with other data of the plan by path, in one call of the engine."""
        if not rows:
            return []
        scene = self.scene
        base = {path: float(get_value(scene, path)) for row in rows for path in row}
        values = {path: np.array([row.get(path, own) for row in rows]) for path, own in base.items()}
        data = rows_for(scene, self.plan, values, self.duration, count=len(rows))
        log = Engine(self.plan, self.duration, self.shared).run(data, self.accuracy, self.track)
        return [
            Run(scene, self.duration, float(data.periods[i]), log.alone(i), dict(row), self.accuracy, self.track)
            for i, row in enumerate(rows)
        ]

    def _since(self, path: str) -> float:
        """From when on [s] there is no derivative by a path; infinite where there is one to the end."""
        return float(self._best[path].lost.time[0])

    @property
    def flags(self) -> Mapping[str, tuple[str, ...]]:
        """Why derivatives by a path are not to be had of what comes after some moment, by path; none as a rule."""
        names = (*(f"foot '{name}'" for name in self.foot_names), "the robot")  # the last of no foot
        out = {}
        for path, best in self._best.items():
            lost = [one for one in best.reasons if np.isfinite(one.time[0])]
            said = [one.doubt[0].said(names[one.foot[0]], one.time[0]) for one in lost]
            out |= {path: tuple(dict.fromkeys(said))} if said else {}
        return MappingProxyType(out)

    def _events(self, part: int) -> Mapping[str, npt.NDArray[np.void]]:
        out = {}
        for path, one in self._best.items():
            found = np.zeros(len(self.events), dtype=EVENT_TYPE)
            for name, row in zip(EVENT_TYPE.names or (), one.rows[part], strict=True):
                found[name] = self.events[name] if name in ("foot", "kind") else row
            out[path] = found
        return MappingProxyType(out)

    @cached_property
    def event_gradients(self) -> Mapping[str, npt.NDArray[np.void]]:
        """Derivatives of every number of the events by path, fields as those of `events`; NaN from an event on at which
        there is none. ``foot`` and ``kind`` are those of the events."""
        return self._events(0)

    @cached_property
    def event_errors(self) -> Mapping[str, npt.NDArray[np.void]]:
        """The error of each number of `event_gradients`."""
        return self._events(1)

    def state_gradients(self, times: npt.ArrayLike) -> Mapping[str, SampledStates]:
        """Derivatives of the states and forces at times [s], in order, by path, as `states` has them; NaN from the
        time on from which there is none. At the very moment of an event they are those after it.

        Raises InputError where the times are not in order.
        """
        return MappingProxyType({path: found for path, (found, _) in self._states(times).items()})

    def state_errors(self, times: npt.ArrayLike) -> Mapping[str, SampledStates]:
        """Errors of the derivatives of the states and forces at times [s], by path, as `state_gradients` has
        them. Raises InputError where the times are not in order."""
        return MappingProxyType({path: error for path, (_, error) in self._states(times).items()})

    def _states(self, times: npt.ArrayLike) -> dict[str, tuple[SampledStates, SampledStates]]:
        when, out = increasing(times), {}
        differenced = self._differenced(when)
        for path, best in self._best.items():
            ran = tuple(ran_of(run, when) for run in best.lane.runs)
            found = differenced.found(best.lane._replace(ran=ran), best.bent).samples
            found[:, :, when >= self._since(path)] = np.nan
            out[path] = tuple(as_states(part, differenced.own.states) for part in found)
        return out

    def slopes(self, numbers: Callable[[Sequence[Run]], npt.ArrayLike], unit: str = "") -> Slopes:
        """Derivatives (P, ...) by path of whatever a function makes of runs, values (nr, ...) of so many in a unit,
        their errors, and where there is a kink or a jump."""
        best = list(self._best.values())
        runs: list[Run] = [self, self._finer, *(run for one in best for run in one.lane.runs)]
        own, finer, *copies = np.asarray(numbers(runs), dtype=float)
        found = [_slopes(one, own, finer, copies[2 * k : 2 * k + 2], self._scale(unit)) for k, one in enumerate(best)]
        nothing = np.zeros((0, *np.shape(own)))
        if not found:
            return Slopes(nothing, nothing, nothing.astype(bool))
        return Slopes(*(np.array(part) for part in zip(*found, strict=True)))

    def _scale(self, unit: str) -> float:
        """A size of numbers of this unit in this run, of which rounding leaves some where they are zero."""
        length, force, rate = self.plan.length, self.plan.force, self.plan.rate
        sizes = {
            "m": length,
            "m/s": length * rate,
            "s": 1.0 / rate,
            "N": force,
            "J": force * length,
            "W": force * length * rate,
        }
        return sizes.get(unit, 0.0)

    def gradient(self, name: str) -> Gradient:
        """Derivatives of a measure by path; of a term of the energy ledger [J] as ``ledger.work_in``, of a law's work
        there as ``ledger.film``.

        Raises InputError for a name that is neither.
        """
        term = name.removeprefix("ledger.")
        if term != name:
            known = [*_TERMS, *self.ledger.laws]
            if term not in known:
                listed = ", ".join(f"ledger.{one}" for one in known)
                raise InputError(f"{name}: the ledger has no such term; there are {listed}")
            return self.gradient_of_runs(
                lambda run: run.ledger.laws[term] if term in run.ledger.laws else getattr(run.ledger, term), "J"
            )
        if name not in PER_WINDOW and name not in WHOLE_RUN and name not in self.measures:
            raise InputError(no_measure(name, self.measures))
        unit = self.measures[name].unit
        return self._gradient(lambda runs: measured(Judgement(table_of(runs)), [name])[name].value, unit)

    def gradient_of(self, objective: Callable[[npt.NDArray[np.void]], float]) -> Gradient:
        """Derivatives by path of any function of the events (a structured array as `all_events`, with the period
        marks, at which apexes begin anew)."""
        return self.gradient_of_runs(lambda run: objective(run.all_events))

    def gradient_of_runs(self, objective: Callable[[Run], float], unit: str = "") -> Gradient:
        """Derivatives by path of any function of a run: of its events, states, series, measures, ledger or outputs.

        unit: of its values, ``"m"``, ``"s"``, ``"m/s"``, ``"N"``, ``"J"`` or ``"W"``: by it
        what rounding leaves of zeros is no kink.
        """
        return self._gradient(lambda runs: [float(objective(run)) for run in runs], unit)

    @cached_property
    def mark_gradients(self) -> Mapping[str, npt.NDArray[np.void]]:
        """Derivatives of a walker's marks by path, fields as those of `marks`; NaN from the time on from which there is
        none."""
        own, out = self.log.marks, {}
        assert own is not None
        for path, one in self._best.items():
            rows = np.full_like(own, np.nan)
            marks = (run.log.marks for run in (self._finer, *one.lane.runs))
            each = [rows for rows in marks if rows is not None and rows.shape == own.shape]
            if len(each) == 3:
                rows = _slopes(one, own, each[0], each[1:]).value
            rows[own[:, 0] >= self._since(path)] = np.nan
            out[path] = structured_marks(rows, len(self.foot_names))
        return MappingProxyType(out)

    def _gradient(self, numbers: Callable[[Sequence[Run]], npt.ArrayLike], unit: str = "") -> Gradient:
        """The gradient of one number of each run (nr,)."""
        kept: list[Floats] = []

        def of(runs: Sequence[Run]) -> Floats:
            kept.append(np.asarray(numbers(runs), dtype=float))
            return kept[0]

        found, said = self.slopes(of, unit), self.flags
        plain, errors, flags, one_sided = {}, {}, {}, {}
        for p, (path, one) in enumerate(self._best.items()):
            texts = (*said.get(path, ()), *[_KINKED] * bool(found.kinked[p]))
            plain[path], errors[path] = (np.nan if texts else float(of[p]) for of in (found.value, found.error))
            if not texts:
                continue
            flags[path] = texts
            whole = np.flatnonzero([np.isinf(side.time[0]) for side in one.reasons[:2]])
            if len(whole):  # ahead where both sides have all events
                side = int(whole[np.argmax(one.lane.places[whole])])
                off = float(one.lane.places[side] * one.lane.steps[0])
                one_sided[path] = float((kept[0][2 + 2 * p + side] - kept[0][0]) / off)
        return Gradient(plain, errors, flags, one_sided)


def _slopes(best: LaneSlopes, own: Floats, finer: Floats, copies: Sequence[Floats], scale: float = 0.0) -> Slopes:
    """Derivatives of what a run, the same in other steps, and its two perturbed copies came to."""
    lane = best.lane
    return slopes_of(lane.places, float(lane.steps[0]), float(best.bent[0]), own, finer, copies, scale)


def ran_of(run: Run, times: Floats) -> Ran:
    """A run as a window, sampled at times (nt,) [s]."""
    rows = event_rows(run.events)
    states = run.states(times) if len(times) else no_states(run.scene.robot.structure.size, len(run.foot_names))
    nothing = np.zeros((1, 0))
    return Ran(
        run.log.codes, rows, np.array([0, len(rows)]), states, times, np.array([0, len(times)]), nothing, nothing
    )


_TERMS = ("work_in", "ground", "kinetic", "elastic", "damping", "friction", "impacts", "adhesion")


def table_of(runs: Sequence[Run]) -> RunTable:
    """Runs of one robot side by side, as measures see them."""
    events, ways = [run.all_events for run in runs], [run.marks for run in runs]
    marks = [one for one in ways if one is not None]
    return RunTable(
        np.concatenate(events),
        np.cumsum([0, *map(len, events)]),
        runs[0].foot_names,
        np.array([run.end_time for run in runs]),
        np.array([run.period for run in runs]),
        np.arange(len(runs)),
        lambda r: runs[r].scene,
        np.concatenate(marks) if marks else None,
        np.cumsum([0, *map(len, marks)]) if marks else None,
    )


@dataclass(frozen=True, repr=False)
class GradientBatch(Batch):
    """A batch of runs with derivatives, in ``made``."""

    made: tuple[GradientRun, ...] = ()

    def gradient(self, name: str) -> Mapping[str, Floats]:
        """Derivatives of a measure or a term of the ledger of every run by path, in the batch's shape; NaN where
        there is none, see `Gradient` of the run in ``made``."""
        found = [run.gradient(name) for run in self.made]
        paths = self.made[0].paths if self.made else ()
        return MappingProxyType({path: np.array([one[path] for one in found]).reshape(self.shape) for path in paths})


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
    accuracy = accuracy or SINGLE_RUN
    run = changed_run(scene, {}, seconds, accuracy, shared)
    stencils, problems = dict[str, Stencil](), list[str]()
    for name, one in directions_of(scene, paths).items():
        try:
            stencils[name] = Stencil.of(scene, one, STEP, run.plan)
        except InputError as error:
            problems.append(
                f"{name}: there is no derivative by it, for it does not vary by itself; {error.problems[0]}"
            )
    if problems:
        raise InputError(problems)
    return GradientRun(
        scene,
        seconds,
        run.period,
        run.log,
        {},
        accuracy,
        kept=run.motion,
        wall_s=time.perf_counter() - start,
        stencils=stencils,
        shared=shared,
    )
