"""One run: made of a scene, and what it answers: events, measures, energy ledger, and the series behind them."""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.base.messages import Hinted
from tarsus.base.spec import by_path, get_value, with_values
from tarsus.base.units import parse_quantity
from tarsus.base.verb import verb
from tarsus.files.summary import run_summary
from tarsus.measure.limits import model_range
from tarsus.measure.measure import Measure, Measures
from tarsus.measure.periods import scene_period
from tarsus.measure.walking import measures_of
from tarsus.model.structure.walker import TILTS
from tarsus.plan.lowering import lower_scene
from tarsus.plan.moving import refuse_jumps
from tarsus.plan.rows import Rows, marked_rows
from tarsus.plan.slots import Courses, Floats, rows_for, slot
from tarsus.solve.codes import CLOSED, ResultCode, event_rows, structured_events, structured_marks, without_marks
from tarsus.solve.engine import SINGLE_RUN, Accuracy, Engine, Log
from tarsus.solve.motion import RunLaws, RunMotion, electrical_energy, ledger_of_run
from tarsus.solve.shared import Shared

if TYPE_CHECKING:
    import xarray

    from tarsus.core.states import SampledStates
    from tarsus.files.ledger import Ledger
    from tarsus.files.series import Variables
    from tarsus.files.store import RunArrays
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.solve.outputs import Output
    from tarsus.solve.results import Batch
    from tarsus.solve.series import Series
    from tarsus.tables.table import Table


def increasing(times: npt.ArrayLike, end: float = np.inf) -> np.ndarray:
    """Times (nt,) as seconds, of numbers [s] or texts with a unit.

    Raises InputError where they are no row in order from 0 s on, which sampling a run needs, up to its end [s].
    """
    given = np.asarray(times)
    if given.dtype.kind == "U":
        given = np.reshape([parse_quantity(str(one), "s") for one in given.ravel()], given.shape)
    when = np.asarray(given, dtype=float)
    if when.ndim != 1:
        raise InputError(f"times: expected a row of times (nt,), got an array of {when.ndim} dimensions")
    if np.any(np.diff(when) < 0.0):
        raise InputError("times: expected times in order, each at or after the one before; sort them first")
    if len(when) and when[0] < 0.0:
        raise InputError(f"times: a run begins at 0 s, got {when[0]:g} s")
    if len(when) and when[-1] > end * (1.0 + SAME_EVENT):
        raise InputError(f"times: the run is one of {end:g} s, got {when[-1]:g} s")
    return when


SAME_EVENT = 1e-9
"""Times of events that differ by less than this part of the run's duration are the same: steps leave as much."""


@dataclass(frozen=True, repr=False)
class Run(Hinted):
    """A finished simulation over ``duration`` [s]: by `simulate`, one of a batch, or read from a folder.

    base, values: the scene described, and what this run has instead, by path; period [s]: drive period of the
    statistics; log: what the engine noted; wall_s: seconds it took. kept: its motion; a batch keeps none, and its runs
    are made once more, step for step, when they are asked for series or energies. ended_as: its code by the batch or
    folder that it is of. stored: what was read of it; its states at other times than those kept are of a run that is
    made once more.
    """

    base: Scene
    duration: float
    period: float
    log: Log
    values: Mapping[str, Any] = field(default_factory=dict)
    accuracy: Accuracy | None = None
    track: bool = True
    kept: RunMotion | None = None
    ended_as: ResultCode | None = None
    wall_s: float = math.nan
    stored: RunArrays | None = None

    figures: ClassVar[tuple[str, ...]] = ("motion", "impacts", "ledger")
    """Figures that are made of more than one of its series."""
    _guesses: ClassVar[Mapping[str, str]] = {
        "t": "'time'",
        "times": "'time'",
        "gaps": "'gap'",
        "x": "'states(times).x', or 'to_dataset()'",
        "energy": "'ledger'",
        "energies": "'ledger'",
        "save": "'write'",
        "to_csv": "'write', which writes all files",
        "to_dataframe": "to_dataset().to_dataframe()",
        "data": "'to_dataset'",
        "dataset": "'to_dataset'",
        "status": "'code'",
        "success": "'ok'",
        "done": "'ok'",
    }

    def _guessed(self) -> Mapping[str, str]:
        from tarsus.solve.channels import CHANNELS

        measures = {name: f"measures['{name}']" for name in self.offered(self.base, self.duration)}
        return {**measures, **{one.name: f"series['{one.name}']" for one in CHANNELS}, **self._guesses}

    @classmethod
    def of(cls, arrays: RunArrays) -> Run:
        """The run of which a folder holds these arrays: events, series, measures and energies are those that were kept.

        Raises InputError for a code by which no run ends.
        """
        scene, code = arrays.scene, ResultCode.__members__.get(arrays.code)
        if code is None:
            known = ", ".join(ResultCode.__members__)
            raise InputError(f"{scene.name}: no run ends as '{arrays.code}'; one of {known} is expected")
        end = np.array([[float(arrays.variables["time"].values[-1]), 0.0, 0.0]])
        rows = event_rows(arrays.events)
        log = Log(np.array([code.number]), end, rows, np.array([len(rows)]))
        period, accuracy = scene_period(scene, arrays.duration), arrays.accuracy
        return cls(
            scene,
            arrays.duration,
            period,
            log,
            accuracy=Accuracy(**accuracy) if accuracy else None,
            ended_as=code,
            stored=arrays,
        )

    @classmethod
    def offered(cls, scene: Scene, duration: float) -> dict[str, Measure]:
        """Every measure that runs of a scene over ``duration`` [s] have, by name, with unit and definition; the values
        mean nothing."""
        return dict(measures_of(cls(scene, duration, scene_period(scene, duration), Log.nothing(duration))))

    def arrays(self) -> RunArrays:
        """What a folder holds of the run, of which `of` makes it again."""
        from tarsus.files.store import RunArrays

        accuracy = {} if self.accuracy is None else vars(self.accuracy)
        return self.stored or RunArrays(
            self.scene,
            self.duration,
            self.code.name,
            self.code.value,
            self.events,
            self.variables(),
            self.ledger,
            self.measures.to_dict(),
            self.measures.warned,
            self.electrical_energy,
            accuracy,
        )

    def __getitem__(self, name: object) -> Any:
        raise TypeError(
            f"a run has no [{name!r}]: its series are to_dataset()[...], its measures measures[...], and gap has a row "
            f"for each foot ({', '.join(self.foot_names)})"
        )

    def __repr__(self) -> str:
        code = self.__dict__.get("code", self.ended)  # its energy account is not asked for
        return f"<Run '{self.scene.name}': {self.duration:g} s, {code.name}, {len(self.events)} events>"

    def citations(self) -> str:
        """What to cite for this run, as BibTeX: the library, and the sources of its scene and of its laws."""
        from tarsus.files.citations import bibtex

        return bibtex(self.scene)

    def _repr_html_(self) -> str:
        return self.table(ledger=False).html()

    def __str__(self) -> str:
        return self.table(ledger=False).text()

    def table(self, *, ledger: bool = True) -> Table:
        """The run and its measures; with `ledger` its energy account, which of a run of a batch takes another run."""
        return run_summary(self, ledger=ledger)

    def plot(self, name: str = "motion", **options: Any) -> Any:
        """Matplotlib axes with the ``"motion"``, ``"impacts"``, ``"ledger"``, or a series such as ``"gap"`` over time.

        By `tarsus.plot.motion`, `impacts`, `ledger` and `series`, which take the options. Raises InputError as they do.
        """
        if name in self.figures:
            return drawn(self, name, **options)
        return drawn(self, "series", name, **options)

    def write(self, folder: str | os.PathLike[str], *, mat: bool = False) -> Path:
        """Write the run into a folder, which is returned and which `tarsus.load_run` reads: scene, series, events,
        measures, provenance and what to cite.

        mat: write the series for MATLAB as well. Raises InputError where the folder cannot be written.
        """
        from tarsus.files.store import write_run

        write_run(self.arrays(), folder, mat)
        return Path(folder)

    def __getstate__(self) -> dict[str, Any]:
        return state_of(self, self.scene)

    @cached_property
    def scene(self) -> Scene:
        """The scene of this run."""
        return with_values(self.base, self.values) if self.values else self.base

    @cached_property
    def motion(self) -> RunMotion:
        """What the run knows of its motion.

        Raises InputError where a run that was read does not come out as it was: it was made elsewhere, or is chaotic.
        """
        if self.kept is not None:
            return self.kept
        made = motion_of(self.base, self.values, self.duration, self.accuracy, Shared(), track=self.track)
        if self.stored is not None and not self._is_of(made.log):
            raise InputError(
                f"{self.base.name}: made once more this run has other events than were kept, so that its states are "
                "known at the times of its series alone; tarsus.simulate(run.scene, run.duration) makes it anew"
            )
        return made

    def _is_of(self, log: Log) -> bool:
        """Whether events that were noted are those of the run."""
        again, own = without_marks(structured_events(log.events)), self.events
        near = SAME_EVENT * self.duration
        return all(np.array_equal(again[name], own[name]) for name in ("foot", "kind")) and bool(
            np.allclose(again["time"], own["time"], rtol=0.0, atol=near)
        )

    @property
    def plan(self) -> Plan:
        """The plan given to the engine, but for the run's own row of data (``motion.acting.rows``)."""
        return self.motion.acting.plan

    @cached_property
    def code(self) -> ResultCode:
        """How the run ended; its value is a sentence. Of a run that reached its end this asks for the ledger,
        which is noted as it runs. Of a run of a batch it is what `tarsus.solve.Batch.codes` says."""
        if self.ended_as is not None:
            return self.ended_as
        open_ = self.ended is ResultCode.DONE and not self.ledger.closure <= CLOSED  # NaN is open
        return ResultCode.LEDGER_OPEN if open_ else self.ended

    @property
    def ended(self) -> ResultCode:
        """How the run ended, its energy account aside, which is not asked for: for those who need the motion alone."""
        return ResultCode.of(int(self.log.codes[0]), makes_energy=self.base.ground.makes_energy)

    @property
    def ok(self) -> bool:
        """True when the run reached its end with its energy account closed, where that was asked for."""
        return self.code is ResultCode.DONE

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what the run left that its model assumes: feet in averaged contact, and the range in which the
        model holds; and on signals that are played otherwise than their files say."""
        return (*self._averaged(), *self._outside(), *self.scene.signal_remarks)

    def _averaged(self) -> tuple[str, ...]:
        """What is counted as contact though the foot bounces on, foot by foot."""
        found = self.events[self.events["kind"] == EventKind.AVERAGED_CONTACT]
        parts = {name: found[found["foot"] == i] for i, name in enumerate(self.foot_names)}
        return tuple(
            f"Foot '{name}' is in averaged contact ({len(own)} times, first at {own['time'][0]:.6g} s): pressed "
            "down, it bounces on with hardly any loss, but lower than any flight that matters (Accuracy.flight). The "
            "energy of these flights is counted as lost in the impacts."
            for name, own in parts.items()
            if len(own)
        )

    def _outside(self) -> tuple[str, ...]:
        """What is said where the motion leaves the model's range: by tilt in the whole run, by heave once settled."""
        limit = model_range(self.scene)
        if limit is None:
            return ()
        said = limit.left(self._tilt() if limit.measure == "tilt" else self.measures[limit.measure].value)
        return (f"The run {said}.",) if said else ()

    def _tilt(self) -> float:
        """Largest tilt [rad] of the body at the marks, NaN where none are known."""
        if self.marks is not None:
            seen = self.marks["body"]
        elif self.stored is not None and "body" in self.stored.variables:
            seen = self.stored.variables["body"].values.T
        else:
            return math.nan
        tilts = [name in TILTS for name in self.scene.robot.structure.body_coordinates]
        return float(np.abs(seen[:, tilts]).max())

    @property
    def end_time(self) -> float:
        """Time reached [s]; the duration unless the run stopped early."""
        return float(self.log.finish[0, 0])

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet, in the order of the events' foot numbers."""
        return tuple(self.base.robot.feet)

    @cached_property
    def _all_events(self) -> np.ndarray:
        return structured_events(self.log.events)

    @property  # measures ask a run for a plain attribute (`tarsus.measure.HasMeasures`)
    def all_events(self) -> np.ndarray:
        """Events with the period marks (kind 6) between them; apexes are those since a foot's last event or mark."""
        return self._all_events

    @cached_property
    def events(self) -> np.ndarray:
        """Events in time order, a structured array; see `tarsus.solve.codes.EVENT_TYPE` for fields and units."""
        return without_marks(self.all_events)

    @cached_property
    def marks(self) -> np.ndarray | None:
        """Of a walker: where it is at the start, at the end of every drive period and at the end; see
        `tarsus.solve.codes.structured_marks`. None for everything else."""
        marks = self.log.marks
        return None if marks is None else structured_marks(marks, len(self.foot_names))

    @cached_property
    def measures(self) -> Measures:
        """Measures by drive period after transients; each with definition, unit and spread."""
        if self.stored is not None:
            return Measures.of(self.stored.measures, self.stored.warnings)
        return measures_of(self)

    @cached_property
    def series(self) -> Series:
        """States and forces on an even time grid, with energies from the start."""
        from tarsus.solve.series import Series, grid

        return Series(self, grid(self))

    @property
    def time(self) -> np.ndarray:
        """Times (nt,) [s] of the series, on an even grid."""
        return self.series.time if self.stored is None else self.stored.variables["time"].values

    @property
    def gap(self) -> np.ndarray:
        """Gap (m, nt) [m] of every foot at these times."""
        return self.series.state.gap if self.stored is None else self.stored.variables["gap"].values

    @cached_property
    def ledger(self) -> Ledger:
        """Energy ledger of the whole run."""
        return ledger_of_run(self) if self.stored is None else self.stored.ledger

    @cached_property
    def laboratory_work(self) -> float:
        """Work [J] that moving ground does on the robot in the laboratory; ``ledger.ground`` is that in the ground's
        own frame. Raises InputError for a base that stays."""
        from tarsus.solve.ground_work import laboratory_work

        return laboratory_work(self)

    @cached_property
    def electrical_energy(self) -> float:
        """Energy [J] that the electrodes of all drives take in the run, the integral of V dq with the charge by motion;
        NaN where a drive's law has a memory, whose own charge no description says."""
        return electrical_energy(self) if self.stored is None else self.stored.electrical_energy

    def at(self, times: npt.ArrayLike) -> Series:
        """Series at the given times (nt,) [s] or ``["1 ms", "2 ms"]``, increasing: the engine's own solution, not an
        interpolation.

        Raises InputError where the times are not in order, or beyond the run's duration.
        """
        from tarsus.solve.series import Series

        return Series(self, increasing(times, self.duration))

    def states(self, times: npt.ArrayLike) -> SampledStates:
        """States and contact forces alone at the given times [s], increasing. At an event they are those after it."""
        return self.motion.states(increasing(times, self.duration))

    def outputs(self, outputs: Sequence[Output], times: npt.ArrayLike) -> np.ndarray:
        """What instruments see (nc, nt) at times (nt,) [s], increasing, in SI units.

        Displacement, velocity and acceleration of points, the body's places and angles, charges and currents of drives;
        see `tarsus.solve.outputs`.

        Raises InputError for outputs that the robot does not have, and where the times are not in order.
        """
        from tarsus.solve.outputs import output_rows

        when = increasing(times, self.duration)
        rows = output_rows(self.scene, outputs, when)
        if self.scene.slides and rows.tangent.any():
            found = self.at(when)
            return rows.values(found.state, found.friction)
        return rows.values(self.states(when), np.zeros((len(self.foot_names), len(when))))

    def variables(self, times: npt.ArrayLike | None = None) -> Variables:
        """The series as plain arrays by name; on an even grid unless ``times`` [s] are given."""
        from tarsus.solve.series import variables_of

        if times is None and self.stored is not None:
            return self.stored.variables
        return variables_of(self.series if times is None else self.at(times))

    def to_dataset(self, times: npt.ArrayLike | None = None) -> xarray.Dataset:
        """The run as an xarray Dataset, units as attributes; on an even grid unless ``times`` [s] are given."""
        from tarsus.files.series import dataset_of

        attrs = {"title": self.base.name, "result": self.code.value}
        return dataset_of(self.variables(times), attrs | {"duration_s": self.duration, "period_s": self.period})


def changed_run(
    scene: Scene,
    values: Mapping[str, Any],
    seconds: float,
    accuracy: Accuracy | None = None,
    shared: Shared | None = None,
) -> Run:
    """A run of a scene with values in place of its own, by path. Raises InputError as `simulate` and `with_values`."""
    start = time.perf_counter()
    motion = motion_of(scene, values, seconds, accuracy, shared or Shared())
    period = float(motion.acting.rows.periods[0])
    wall = time.perf_counter() - start
    return Run(scene, seconds, period, motion.log, values, accuracy, kept=motion, wall_s=wall)


def sampled_run(
    scene: Scene, seconds: float, times: Floats, shared: Shared
) -> tuple[ResultCode, npt.NDArray[np.void], SampledStates]:
    """How a run of a scene ends, its events and its states at times (nt,) [s], in order: one run, without an account of
    its energy. Raises InputError as `simulate`."""
    found, states = motion_of(scene, {}, seconds, None, shared).watched(times)
    ended = ResultCode.of(int(found.codes[0]), makes_energy=scene.ground.makes_energy)
    return ended, structured_events(found.events), states


def motion_of(
    scene: Scene,
    values: Mapping[str, Any],
    duration: float,
    accuracy: Accuracy | None,
    shared: Shared,
    *,
    track: bool = True,
) -> RunMotion:
    """One run of a scene that has some values instead of its own, with its motion and its energy account.

    Raises
    ------
    InputError
        As `tarsus.with_values` and `prepared` do.
    """
    values = by_path(scene, values)
    whole = with_values(scene, values) if values else scene
    given = {path: get_value(whole, path) for path in values}
    data = {path for path, one in given.items() if isinstance(one, float) and slot(scene, path) is not None}
    rest = {path: one for path, one in values.items() if path not in data}
    variant = with_values(scene, rest) if rest else scene
    engine, rows = prepared(
        variant, {path: np.array([given[path]]) for path in values if path in data}, duration, shared
    )
    return RunMotion(RunLaws(engine.plan, rows), engine, accuracy or SINGLE_RUN, track)


def prepared(
    scene: Scene,
    values: Mapping[str, Floats],
    duration: float,
    shared: Shared,
    count: int = 1,
    courses: Courses | None = None,
    changes: tuple[tuple[str, float], ...] = (),
) -> tuple[Engine, Rows]:
    """The engine for runs of a scene over ``duration`` [s], and the rows of runs that differ in slots.

    values (nr,) by path: each of a slot and within its bounds; without any there are ``count`` runs of the scene as it
    is. shared: what earlier engines have made; what this one makes is added. courses: as `tarsus.plan.slots.rows_for`
    takes them. changes: by which the scene differs from the resident one, where it is a variant of that.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled, and as `tarsus.plan.slots.rows_for` does.
    """

    def made() -> Engine:
        return Engine(lower_scene(scene, shared.drive), duration, shared)

    kept = bool(changes) or scene is shared.resident
    engine = shared.get(("resident", duration, changes), made) if kept else made()
    plan = engine.plan
    if not values:
        if scene.ground.motion is not None:
            refuse_jumps(scene, duration)
        return engine, marked_rows(plan, count, duration)
    return engine, rows_for(scene, plan, values, duration, courses=courses)


@verb
def load_run(folder: str | os.PathLike[str], laws: Mapping[str, Any] | None = None) -> Run:
    """Read a run that `Run.write` or ``tarsus simulate -o`` wrote; laws: the user's laws that its scene needs, by kind.

    Raises InputError if the folder holds no whole run, or one of another format.
    """
    from tarsus.files.store import read_run

    return Run.of(read_run(folder, laws))


def drawn(result: Run | Batch, how: str, *args: Any, **options: Any) -> Any:
    """A result drawn by `tarsus.plot`, which stands floors above and is found by its name when it is asked for."""
    return getattr(import_module("tarsus.report.plot"), how)(result, *args, **options)


def state_of(result: Any, scene: Scene) -> dict[str, Any]:
    """What is pickled of a run or batch: its fields, without what is found from them when asked.

    Raises InputError where the scene has a law whose class another process could not import.
    """
    lost = [
        f"ground.laws.{name}: the class {type(law).__name__} is in no module that another process can import, so that "
        "this cannot be pickled; put its file where Python finds modules, and import it"
        for name, law in scene.ground.laws.items()
        if not _importable(type(law))
    ]
    if lost:
        raise InputError(lost)
    return {one.name: result.__dict__[one.name] for one in fields(result)}


def _importable(kind: type) -> bool:
    """Whether another process finds a class by its name: not so one of a law file that was loaded by its path."""
    if "<locals>" in kind.__qualname__:
        return False
    # a script is run again by a process that it starts; what was typed is lost
    if kind.__module__ == "__main__":
        return hasattr(sys.modules["__main__"], "__file__")
    top = kind.__module__.partition(".")[0]
    return any(finder.find_spec(top, None) is not None for finder in sys.meta_path)
