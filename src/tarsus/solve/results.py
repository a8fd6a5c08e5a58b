"""Results of many runs: one event log, measures of all runs at once, and the runs one by one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import Hinted
from tarsus.base.spec import number_at, with_values
from tarsus.files.series import Variable, outcome_variable
from tarsus.measure.history import EventHistories
from tarsus.measure.measure import Measured, Measures, measure_name, measure_variables, no_measure
from tarsus.measure.table import Judgement, RunTable
from tarsus.measure.walking import measured, measures_of
from tarsus.plan.slots import Kind, slot
from tarsus.solve.codes import EVENT_TYPE, EventColumns, ResultCode, structured_events, structured_marks, without_marks
from tarsus.solve.engine import Accuracy, Log, end_to_end
from tarsus.solve.run import Run, drawn, state_of
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    import xarray

    from tarsus.model.scene import Scene

MOST_ROWS = 1 << 16
"""Events that measures look at together: about as many as a processor's cache holds columns of."""

Floats = NDArray[np.float64]


class Part(NamedTuple):
    """Some runs of a batch: their numbers there (k,), and what the engine noted of them."""

    members: NDArray[np.int64]
    log: Log

    @classmethod
    def of(cls, log: Log, members: NDArray[np.int64]) -> Part:
        """From all runs of a call of an engine; their steps and samples are not kept."""
        kept = Log(log.codes, log.finish, log.events, log.event_end, log.marks, log.mark_end)
        return cls(members, kept)


@dataclass(frozen=True, repr=False)
class Batch(Hinted):
    """Results of `simulate_batch`: nr runs in the order of the varied values.

    vary: the varied values (nr,) by path; axes: of a grid, the values of each axis by path, the last one running
    fastest; periods (nr,) [s]: drive period of the statistics; unclosed: numbers of the runs whose energy account is
    open, None where the batch kept none; accuracy, track: how the runs were made.
    """

    scene: Scene
    vary: Mapping[str, np.ndarray]
    duration: float
    periods: Floats
    parts: Sequence[Part]
    unclosed: frozenset[int] | None = None
    axes: Mapping[str, np.ndarray] = field(default_factory=dict)
    accuracy: Accuracy | None = field(default_factory=Accuracy)
    track: bool = True

    _guesses: ClassVar[Mapping[str, str]] = {
        "runs": "run(i)",
        "results": "'measured'",
        "to_dataframe": "to_dataset().to_dataframe()",
        "ok": "'done'",
        "code": "'codes'",
        "ledger": "run(i).ledger",
        "series": "run(i).series",
        "gap": "run(i).gap",
        "time": "run(i).time",
    }

    def __len__(self) -> int:
        return len(self.periods)

    def __getitem__(self, name: object) -> Any:
        raise TypeError(f"a batch has no [{name!r}]: its runs are run(i), its measures measures[...]")

    def _guessed(self) -> Mapping[str, str]:
        known = Run.offered(self.scene, self.duration)
        return {**{name: f"measures['{name}']" for name in known}, **self._guesses}

    def __repr__(self) -> str:
        over = f" over {', '.join(self.vary)}" if self.vary else ""
        ended = ", ".join(f"{count} {code}" for code, count in self.outcomes.items())
        return f"<Batch '{self.scene.name}': {_runs(self)}{over}; {ended}>"

    def _repr_html_(self) -> str:
        return self.table().html()

    def __str__(self) -> str:
        return self.table().text()

    def table(self) -> Table:
        """How the runs ended, and what varies in them."""
        rows = [(path, len(np.unique(v)), v.min(), v.max()) for path, v in self.vary.items()]
        ended = ", ".join(f"{count} {code}" for code, count in self.outcomes.items())
        columns = ("varied", "values", Column("least", ROW), Column("greatest", ROW))
        units = [number_at(self.scene, path).unit for path in self.vary]
        return Table(f"{self.scene.name}: {_runs(self)}; {ended}", columns, rows, units=units)

    def plot(self, measure: str, **options: Any) -> Any:
        """Matplotlib axes with a measure over what varies: `tarsus.plot.measure`, which takes the options."""
        return drawn(self, "measure", measure_name(measure), **options)

    def __getstate__(self) -> dict[str, Any]:
        return state_of(self, self.scene)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the results: that of the grid, or (nr,)."""
        return tuple(map(len, self.axes.values())) if self.axes else (len(self),)

    @cached_property
    def codes(self) -> list[ResultCode]:
        """How every run ended.

        A batch keeps no steps and so no energy account: `ResultCode.DONE` says here that the end was reached, and
        `ResultCode.LEDGER_OPEN` occurs only with ``simulate_batch(..., ledger=True)``. One run's account is that of
        ``simulate(batch.run(i).scene, batch.duration)``, and at the batch's accuracy ``batch.run(i).ledger``.
        """
        numbers = np.zeros(len(self), dtype=np.intp)
        for part in self.parts:
            numbers[part.members] = part.log.codes
        makes = self.scene.ground.makes_energy
        meaning = {int(one): ResultCode.of(int(one), makes_energy=makes) for one in np.unique(numbers)}
        found = [meaning[number] for number in numbers.tolist()]
        for i in self.unclosed or ():
            found[i] = ResultCode.LEDGER_OPEN
        return found

    @property
    def outcomes(self) -> dict[str, int]:
        """How many runs ended how, by the name of the code, the most frequent first."""
        return {code.name: count for code, count in Counter(self.codes).most_common()}

    @cached_property
    def done(self) -> NDArray[np.bool_]:
        """Which runs (nr,) reached their end."""
        return np.array([code is ResultCode.DONE for code in self.codes])

    @cached_property
    def _where(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Part and place there of every run (nr,)."""
        part, place = np.zeros((2, len(self)), dtype=np.intp)
        for number, one in enumerate(self.parts):
            part[one.members], place[one.members] = number, np.arange(len(one.members))
        return part, place

    def _number(self, i: int | tuple[int, ...]) -> int:
        return int(np.ravel_multi_index(i, self.shape)) if isinstance(i, tuple) else int(i)

    def _at(self, i: int | tuple[int, ...]) -> tuple[Part, int]:
        """Where a run is."""
        part, place = (int(one[self._number(i)]) for one in self._where)
        return self.parts[part], place

    def run(self, i: int | tuple[int, ...]) -> Run:
        """Run number ``i``, or at an index of the grid."""
        number = self._number(i)
        part, place = self._at(number)
        values = {path: float(column[number]) for path, column in self.vary.items()}
        return Run(
            self.scene,
            self.duration,
            float(self.periods[number]),
            part.log.alone(place),
            values,
            self.accuracy,
            self.track,
            ended_as=self.codes[number],
        )

    def events(self, i: int | tuple[int, ...]) -> np.ndarray:
        """Events of run number ``i``; see `tarsus.solve.codes.EVENT_TYPE`."""
        part, place = self._at(i)
        return without_marks(structured_events(part.log.of(place)))

    def all_events(self) -> tuple[np.ndarray, NDArray[np.intp]]:
        """Events (ne,) of all runs end to end, each run's as `events` has them; and where each one's begin, and the
        last ones end (nr + 1,)."""
        each = [self.events(i) for i in range(len(self))]
        return np.concatenate([np.zeros(0, EVENT_TYPE), *each]), np.cumsum([0, *map(len, each)])

    @property
    def measures(self) -> BatchMeasures:
        """Measures of all runs by name, as a run has them: ``batch.measures["peak"].value`` (nr,), ``.unit``. Those of
        run number ``i`` are ``batch.measures(i)``, or ``batch.run(i).measures``."""
        return BatchMeasures(self)

    def measure(self, name: str, **options: Any) -> Floats:
        """One measure of every run, computed alone, of the batch's shape; NaN for runs that did not reach their end.

        Options ``period``, ``skip``, ``height`` and ``dwell`` as for `tarsus.measure.period_statistics`.
        Raises InputError for a name that no measure has.
        """
        name = measure_name(name)
        return self.measured((name,), **options)[name].value.reshape(self.shape)

    def measured(self, names: Collection[str] | None = None, **options: Any) -> dict[str, Measured]:
        """Measures (nr,) of all runs with spread and feet: all that there are, or those of ``names``, in their order,
        at the cost of these alone. Runs that did not reach their end have NaN; options as for `measure`, and ``skip``
        one number for all runs or one for each (nr,).

        Raises InputError for names that no measure has.
        """
        joined: dict[str, Measured] = {}
        for members, table in self.tables():
            own = {name: _of(members, one) for name, one in options.items()}
            for name, one in measured(Judgement(table, **own), names).items():
                if name not in joined:
                    joined[name] = one.blank(len(self))
                joined[name].put(members, one, self.done[members])
        if names is not None and (wrong := [name for name in names if name not in joined]):
            known = measured(Judgement(next(self.tables())[1]))
            raise InputError([no_measure(name, known) for name in wrong])
        return joined if names is None else {name: joined[name] for name in names}

    def histories(self, feet: Sequence[int] | None = None) -> Iterator[tuple[NDArray[np.int64], EventHistories]]:
        """What feet did, all or those of these numbers, a number of runs at a time: their numbers, and histories."""
        m = len(self.scene.robot.feet)
        for members, table in self.tables():
            yield (
                members,
                EventHistories(table.events, table.first, table.ends, range(m) if feet is None else feet, m),
            )

    def tables(self) -> Iterator[tuple[NDArray[np.int64], RunTable]]:
        """The runs as measures see them, so many at a time that the work fits into a processor's cache: their numbers,
        and the table."""
        block: list[Part] = []
        rows = 0
        for part in self.parts:
            if block and rows + len(part.log.events) > MOST_ROWS:
                yield self._table(block)
                block, rows = [], 0
            block.append(part)
            rows += len(part.log.events)
        if block:
            yield self._table(block)

    def _table(self, parts: Sequence[Part]) -> tuple[NDArray[np.int64], RunTable]:
        members, logs = np.concatenate([part.members for part in parts]), [part.log for part in parts]
        feet = tuple(self.scene.robot.feet)
        marks = [one.marks for one in logs if one.marks is not None]
        events = end_to_end([np.diff(one.event_end, prepend=0) for one in logs])
        of_marks = [np.diff(one.mark_end, prepend=0) for one in logs if one.mark_end is not None]
        return members, RunTable(
            EventColumns([one.events for one in logs]),
            events,
            feet,
            np.concatenate([one.finish[:, 0] for one in logs]),
            self.periods[members],
            self._variants[0][members],
            self._variant,
            structured_marks(np.concatenate(marks), len(feet)) if marks else None,
            end_to_end(of_marks) if marks else None,
        )

    @cached_property
    def _variants(self) -> tuple[NDArray[np.intp], list[dict[str, float]]]:
        """Number (nr,) of the description that each run has, parameters of ground laws and start aside, and what each
        changes in the batch's scene."""
        places = {path: slot(self.scene, path) for path in self.vary}
        paths = [p for p, at in places.items() if at is None or at.kind not in (Kind.LAW, Kind.INITIAL)]
        if not paths:
            return np.zeros(len(self), dtype=np.intp), [{}]
        rows, number = np.unique(np.column_stack([self.vary[path] for path in paths]), axis=0, return_inverse=True)
        return number.ravel(), [dict(zip(paths, map(float, row), strict=True)) for row in rows]

    def _variant(self, number: int) -> Scene:
        values = self._variants[1][number]
        return with_values(self.scene, values) if values else self.scene

    def variables(self, names: Collection[str] | None = None, **options: Any) -> dict[str, Variable]:
        """Measures, all or those of ``names``, as plain arrays by name, see `to_dataset`."""
        return _variables(self, self.measured(names, **options))

    def to_dataset(self, names: Collection[str] | None = None, **options: Any) -> xarray.Dataset:
        """Measures, all or those of ``names``, as an xarray Dataset with units and definitions as attributes.

        Of a grid every path is a dimension; else the runs are the dimension ``run``, with the varied values as its
        coordinates. Each measure has its spread from period to period with it, of several feet the number of each,
        and ``code`` says how the run ended. Options as for `measure`.
        """
        from tarsus.files.series import dataset_of

        attrs = {"title": self.scene.name, "duration_s": self.duration}
        return dataset_of(self.variables(names, **options), attrs).set_coords([] if self.axes else list(self.vary))


class BatchMeasures(Mapping[str, Measured]):
    """Measures of all runs of a batch by name, as in Python or as printed; called, those of one run."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch

    def __call__(self, i: int | tuple[int, ...], **options: Any) -> Measures:
        """Measures of run number ``i``; options as for `tarsus.measure.measures_of`."""
        return measures_of(self._batch.run(i), **options)

    @cached_property
    def _all(self) -> dict[str, Measured]:
        return self._batch.measured()

    def __getitem__(self, name: str) -> Measured:
        if (found := self._all.get(measure_name(name))) is None:
            raise KeyError(no_measure(name, self._all))
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def __repr__(self) -> str:
        return f"<Measures of {_runs(self._batch)}: {', '.join(self)}>"


def _of(members: NDArray[np.int64], option: Any) -> Any:
    """Of an option that is one for each run, those of some."""
    return option[members] if isinstance(option, np.ndarray) else option


def _runs(batch: Batch) -> str:
    """How many runs a batch has, by axis of a grid, and how long each is."""
    return f"{' x '.join(map(str, batch.shape))} run{'' if len(batch) == 1 else 's'} of {batch.duration:g} s"


def _variables(batch: Batch, found: Mapping[str, Measured]) -> dict[str, Variable]:
    """Varied values, outcomes and measures of a batch by name."""
    dims, shape = tuple(batch.axes) or ("run",), batch.shape
    feet = list(batch.scene.robot.feet)
    out: dict[str, Variable] = {}
    for path, values in (batch.axes or batch.vary).items():
        about = number_at(batch.scene, path)
        notes = {"units": about.unit, "long_name": about.doc or path}
        out[path] = Variable((path,) if batch.axes else dims, values, notes)
    meanings = {code.name: code.value for code in ResultCode}
    number = {code: np.int8(i) for i, code in enumerate(ResultCode)}
    codes = np.array([number[code] for code in batch.codes]).reshape(shape)
    out["code"] = outcome_variable(codes, meanings, dims, {})
    for name, one in found.items():
        each = one.per_foot.reshape(*shape, len(feet)) if one.per_foot is not None and len(feet) > 1 else None
        out |= measure_variables(name, one, dims, one.value.reshape(shape), one.spread.reshape(shape), each, {})
    if any("foot" in variable.dims for variable in out.values()):
        out["foot"] = Variable(("foot",), np.array(feet), {})
    return out
