"""Runs with first derivatives of all that they give: events, states at any time, measures, energies, series."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

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
from tarsus.solve.beside import NUMBERS, Alike, Beside, Parting
from tarsus.solve.codes import EVENT_TYPE, structured_marks
from tarsus.solve.differences import (
    LEAST,
    MOST,
    STEP,
    Direction,
    Slopes,
    Stencil,
    better_step,
    directions_of,
    slopes_of,
)
from tarsus.solve.engine import RECORDED, Accuracy, Engine
from tarsus.solve.results import Batch
from tarsus.solve.run import Run, increasing
from tarsus.solve.simulate import Shared, changed_run

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = npt.NDArray[np.float64]

FINER = 1e-2
"""Part of its tolerance with which a run is made once more, in other steps all along: how far the two differ is what
the first one is known to."""
TRIES, SHORTER = 3, 1e-2
"""Where copies have other events a step is shortened so often at most, and by so much, down to `LEAST` of the first:
what nobody could set is no side of a threshold. Elsewhere one more step does."""
_KINKED = "to both sides it changes otherwise: an event lies on an edge of a period or on a threshold of the measure"


@dataclass(frozen=True)
class Gradient(Mapping[str, float]):
    """Derivatives of one number of a run by path, SI units; NaN where there is none.

    error: what each may be off by, estimated from what the run itself is known to and from how its copies bend; flags:
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

    The runs beside it are made when the first derivative is asked for: two for each number, or four.
    """

    stencils: Mapping[str, Stencil] = field(kw_only=True)
    shared: Shared = field(kw_only=True)

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths, or names of directions, by which there are derivatives."""
        return tuple(self.stencils)

    @cached_property
    def _finer(self) -> tuple[Run, Alike]:
        """The same run in other steps, and its events as the run's."""
        own = self.accuracy or RECORDED
        other = replace(own, gap=FINER * own.gap, drive=FINER * own.drive)
        run = changed_run(self.base, self.values, self.duration, other, self.shared)
        return run, Alike.of(self, run)

    @cached_property
    def beside(self) -> Mapping[str, Beside]:
        """The run's copies by path, at the step that suits the number: 1e-5 of it unless runs respond otherwise."""
        found = last = self._copies(self.stencils)
        for _ in range(TRIES):
            others = {path: self._other(one) for path, one in last.items()}
            last = self._copies({path: one for path, one in others.items() if one is not None})
            found = found | {path: one for path, one in last.items() if one.rank >= found[path].rank}
        return MappingProxyType(found)

    def _copies(self, stencils: Mapping[str, Stencil]) -> dict[str, Beside]:
        """Copies of the run by path: those that differ in data of its plan in one call of the engine."""
        if not stencils:
            return {}
        rows = [one.values(place) for one in stencils.values() for place in one.places]
        data = [i for i, row in enumerate(rows) if all(slot(self.scene, path) is not None for path in row)]
        found = dict(zip(data, self._beside_in_one_plan([rows[i] for i in data]), strict=True))
        for i in set(range(len(rows))) - found.keys():
            found[i] = changed_run(self.scene, rows[i], self.duration, self.accuracy, self.shared)
        runs = iter([found[i] for i in range(len(rows))])
        return {
            path: Beside.of(self, self._finer, one, [next(runs) for _ in one.places])
            for path, one in stencils.items()
        }

    def _beside_in_one_plan(self, rows: Sequence[Mapping[str, float]]) -> list[Run]:
        """Runs with other data of the plan by path, in one call of the engine."""
        if not rows:
            return []
        scene = self.scene
        base = {path: float(get_value(scene, path)) for row in rows for path in row}
        values = {path: np.array([row.get(path, own) for row in rows]) for path, own in base.items()}
        data = rows_for(scene, self.plan, values, self.duration, count=len(rows))
        log = Engine(self.plan, self.duration, self.shared).run(data, self.accuracy, self.track)
        return [
            Run(
                scene,
                self.duration,
                float(data.periods[i]),
                log.alone(i),
                dict(row),
                self.accuracy,
                self.track,
            )
            for i, row in enumerate(rows)
        ]

    def _other(self, first: Beside) -> Stencil | None:
        """Where copies are better placed; None where they are well."""
        part = better_step(first.bent, first.noise)
        if first.parted or first.kink:
            part = SHORTER
        new = float(np.clip(part * first.stencil.part, LEAST * STEP, MOST * STEP))
        if new == first.stencil.part:
            return None
        try:
            return Stencil.of(self.scene, first.stencil.direction, new, self.plan, order=2)
        except InputError:  # it may not vary so far
            return None

    def _lost(self, path: str) -> dict[str, Parting]:
        """Sentences on why there is no derivative by a path, and from when on."""
        one, out = self.beside[path], dict[str, Parting]()
        for place, alike in zip(one.stencil.places, one.events, strict=True):
            if alike.parting is not None:
                side = "larger" if place > 0.0 else "smaller"
                out[
                    f"where it is a little {side}, {{foot}} touches or leaves the ground otherwise from {{time}} on"
                ] = alike.parting
        if one.kink is not None:
            out[
                "to both sides it moves what {foot} does at {time} otherwise: an edge or a threshold lies there"
            ] = one.kink
        if (parting := self._finer[1].parting) is not None:
            out["what {foot} does at {time} is within the error of a step"] = parting
        names = self.foot_names
        return {
            said.format(foot=f"foot '{names[at.foot]}'", time=f"{at.time:.6g} s"): at
            for said, at in out.items()
        }

    @cached_property
    def _all_lost(self) -> Mapping[str, Mapping[str, Parting]]:
        return {path: self._lost(path) for path in self.paths}

    def _since(self, path: str) -> float:
        """From when on [s] there is no derivative by a path; infinite where there is one to the end."""
        return min((at.time for at in self._all_lost[path].values()), default=np.inf)

    @property
    def flags(self) -> Mapping[str, tuple[str, ...]]:
        """Why derivatives by a path are not to be had of what comes after some moment, by path; none as a rule."""
        return MappingProxyType({path: tuple(said) for path, said in self._all_lost.items() if said})

    def _events(self, error: bool) -> Mapping[str, npt.NDArray[np.void]]:
        out = {}
        for path, one in self.beside.items():
            found = np.zeros(len(self.events), dtype=EVENT_TYPE)
            lost = self.events["time"] >= self._since(path)
            for name, row in zip(NUMBERS, one.slopes.error if error else one.slopes.value, strict=True):
                found[name] = np.where(lost, np.nan, row)
            found["foot"], found["kind"] = self.events["foot"], self.events["kind"]
            out[path] = found
        return MappingProxyType(out)

    @cached_property
    def event_gradients(self) -> Mapping[str, npt.NDArray[np.void]]:
        """Derivatives of every number of the events by path, fields as those of `events`; NaN from an event on at which
        there is none. ``foot`` and ``kind`` are those of the events."""
        return self._events(error=False)

    @cached_property
    def event_errors(self) -> Mapping[str, npt.NDArray[np.void]]:
        """What each number of `event_gradients` may be off by."""
        return self._events(error=True)

    def state_gradients(self, times: npt.ArrayLike) -> Mapping[str, SampledStates]:
        """Derivatives of the states and forces at times [s], in order, by path, as `states` has them; NaN from the
        time on from which there is none. At the very moment of an event they are those after it.

        Raises InputError where the times are not in order.
        """
        return MappingProxyType({path: found for path, (found, _) in self._states(times).items()})

    def state_errors(self, times: npt.ArrayLike) -> Mapping[str, SampledStates]:
        """What the derivatives of the states and forces at times [s] may be off by, by path, as `state_gradients` has
        them. Raises InputError where the times are not in order."""
        return MappingProxyType({path: error for path, (_, error) in self._states(times).items()})

    def _states(self, times: npt.ArrayLike) -> dict[str, tuple[SampledStates, SampledStates]]:
        when = increasing(times)
        own, finer, out = self.states(when), self._finer[0].states(when), {}
        names = [name for name in ("x", "v", *_OF_FEET) if getattr(own, name) is not None]
        mine = np.sort(self.events["time"])
        for path, one in self.beside.items():
            beside, lost = [run.states(when) for run in one.runs], when >= self._since(path)
            parts: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
            for name in names:
                each = [np.asarray(getattr(of, name), dtype=float) for of in (own, finer, *beside)]
                for part, found in zip(
                    parts, one.series(when, mine, each[0], each[1], each[2:]), strict=True
                ):
                    part[name] = np.where(lost, np.nan, found)
            out[path] = tuple(SampledStates(**part, held=own.held, contact=own.contact) for part in parts)
        return out

    def slopes(self, numbers: Callable[[Sequence[Run]], npt.ArrayLike], unit: str = "") -> Slopes:
        """Derivatives (P, ...) by path of whatever a function makes of runs, values (nr, ...) of so many in a unit,
        what they may be off by, and where there is a kink or a jump."""
        copies = list(self.beside.values())
        runs: list[Run] = [self, self._finer[0], *(run for one in copies for run in one.runs)]
        values = np.asarray(numbers(runs), dtype=float)
        first = np.cumsum([2, *(len(one.runs) for one in copies)])
        found = [
            slopes_of(
                one.stencil,
                one.bent,
                values[0],
                values[1],
                list(values[at : at + len(one.runs)]),
                self._scale(unit),
            )
            for one, at in zip(copies, first, strict=False)
        ]
        nothing = np.zeros((0, *values.shape[1:]))
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
                lambda run: run.ledger.laws[term] if term in run.ledger.laws else getattr(run.ledger, term),
                "J",
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

        unit: of its values, ``"m"``, ``"s"``, ``"m/s"``, ``"N"``, ``"J"`` or ``"W"``: what rounding leaves of zeros is
        told from a kink by it.
        """
        return self._gradient(lambda runs: [float(objective(run)) for run in runs], unit)

    @property
    def period_moves(self) -> bool:
        """Whether the drive period depends on a number at the paths."""
        return any(run.period != self.period for one in self.beside.values() for run in one.runs)

    def slopes_of(self, numbers: Callable[[RunTable], Floats]) -> Floats:
        """Derivatives (..., P) by path of several numbers of the events at once, which a function makes of many runs
        (nr, ...) as measures see them; NaN where there is none."""
        found = self.slopes(lambda runs: numbers(table_of(runs)))
        lost = np.array([bool(self._all_lost[path]) for path in self.paths])
        missing = found.kinked | lost.reshape(-1, *(1,) * (found.value.ndim - 1))
        return np.moveaxis(np.where(missing, np.nan, found.value), 0, -1)

    @cached_property
    def way_gradients(self) -> Mapping[str, npt.NDArray[np.void]]:
        """Derivatives of a walker's marks by path, fields as those of `marks`; NaN from the time on from which there is
        none."""
        own, out = self.log.marks, {}
        assert own is not None
        for path, one in self.beside.items():
            rows = np.full_like(own, np.nan)
            marks = (run.log.marks for run in (self._finer[0], *one.runs))
            each = [rows for rows in marks if rows is not None and rows.shape == own.shape]
            if len(each) == 1 + len(one.runs):
                rows = slopes_of(one.stencil, one.bent, own, each[0], each[1:]).value
            rows[own[:, 0] >= self._since(path)] = np.nan
            out[path] = structured_marks(rows, len(self.foot_names))
        return MappingProxyType(out)

    def _gradient(self, numbers: Callable[[Sequence[Run]], npt.ArrayLike], unit: str = "") -> Gradient:
        """The gradient of one number of each run (nr,)."""
        kept: list[Floats] = []

        def of(runs: Sequence[Run]) -> Floats:
            kept.append(np.asarray(numbers(runs), dtype=float))
            return kept[0]

        found, first = self.slopes(of, unit), 2
        plain, errors, flags, one_sided = {}, {}, {}, {}
        for p, (path, one) in enumerate(self.beside.items()):
            texts = (*self._all_lost[path], *[_KINKED] * bool(found.kinked[p]))
            plain[path], errors[path] = (
                np.nan if texts else float(of[p]) for of in (found.value, found.error)
            )
            side = one.side()
            if texts:
                flags[path] = texts
                if side is not None:
                    one_sided[path] = float((kept[0][first + side] - kept[0][0]) / one.stencil.places[side])
            first += len(one.runs)
        return Gradient(plain, errors, flags, one_sided)


_OF_FEET = ("gap", "rate", "resistive", "smooth", "pull", "friction")
_TERMS = ("work_in", "kinetic", "elastic", "damping", "friction", "impacts", "adhesion")


def table_of(runs: Sequence[Run]) -> RunTable:
    """Runs of one robot side by side, as measures see them."""
    events, ways = [run.all_events for run in runs], [run.marks for run in runs]
    marks = [one for one in ways if one is not None]
    return RunTable(
        np.concatenate(events), np.cumsum([0, *map(len, events)]), runs[0].foot_names,
        np.array([run.end_time for run in runs]), np.array([run.period for run in runs]), np.arange(len(runs)),
        lambda r: runs[r].scene, np.concatenate(marks) if marks else None,
        np.cumsum([0, *map(len, marks)]) if marks else None,
    )  # fmt: skip


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
    accuracy = accuracy or RECORDED
    run = changed_run(scene, {}, seconds, accuracy, shared)
    stencils, problems = dict[str, Stencil](), list[str]()
    for name, one in directions_of(scene, paths).items():
        try:
            stencils[name] = Stencil.of(scene, one, STEP, run.plan, order=2)
        except InputError as error:
            problems.append(
                f"{name}: there is no derivative by it, for it does not vary by itself; {error.problems[0]}"
            )
    if problems:
        raise InputError(problems)
    return GradientRun(
        scene, seconds, run.period, run.log, {}, accuracy, kept=run.motion, wall_s=time.perf_counter() - start,
        stencils=stencils, shared=shared,
    )  # fmt: skip
