"""Robots that are stepped: where they are, their drives' commands, and what a step did."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import FootState
from tarsus.base.messages import nearest
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value
from tarsus.core.arrays import E_ADHESION, E_ENERGY, ENERGIES, EVENT_WIDTH
from tarsus.measure.counts import COUNTS
from tarsus.model.drive.pieces import Channels
from tarsus.model.drive.waveforms.constant import Constant
from tarsus.model.profile import gaps_above
from tarsus.model.structure import Walker
from tarsus.plan.channels import gait_waves, with_columns
from tarsus.plan.lowering import lines_below
from tarsus.plan.rows import BY_RUN, Rows, pack
from tarsus.solve.codes import ResultCode, structured_events, without_marks
from tarsus.solve.commands import Command, asked_of, held, row_of
from tarsus.solve.contacts import CARRIED
from tarsus.solve.engine import Accuracy, Advanced
from tarsus.solve.motion import RunLaws, account_of, ledger_of
from tarsus.solve.outputs import Output, Readings
from tarsus.solve.shared import Shared
from tarsus.solve.trajectories import Trajectories

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.core.modes import LinearSystem
    from tarsus.files.ledger import Ledger
    from tarsus.model.robot import Drive
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]
_OWN = tuple(name for name in BY_RUN if name not in ("initial", "channels"))
"""What of rows of data robots have of their own, but for their drives."""


@dataclass
class SteppedRobots:
    """Robots of one scene on their way, that differ in slots.

    values (nr,) by path: what each has instead of the scene's; runs: where they are; commands: those of drives, by
    name; gait (nr,) by path in it: its numbers where they have been changed; start (nr, 2n): states at the last reset;
    spent: energies since then, where an account is kept, and lost (nr, 2) [J]: in impacts and of them to adhesion.
    """

    scene: Scene
    shared: Shared
    values: dict[str, Floats]
    runs: Trajectories
    commands: dict[str, Command]
    gait: dict[str, Floats]
    start: Floats
    spent: Floats | None
    lost: Floats
    _rows: Rows | None = field(default=None, repr=False)

    @classmethod
    def at_start(
        cls,
        scene: Scene,
        shared: Shared,
        values: Mapping[str, Floats],
        count: int,
        longest: float,
        accuracy: Accuracy,
        *,
        account: bool,
    ) -> SteppedRobots:
        """As they start; values (nr,) by path. Raises InputError as `Trajectories.of` does."""
        runs = Trajectories.of(scene, values, longest, accuracy=accuracy, shared=shared, count=count)
        out = cls(
            scene,
            shared,
            dict(values),
            runs,
            {},
            {},
            runs.state.copy(),
            np.zeros((count, 0)) if account else None,
            np.zeros((count, 2)),
        )
        out.commands = out._own_commands()
        return out

    def __len__(self) -> int:
        return len(self.runs)

    def copied(self) -> SteppedRobots:
        """Another of the same, which goes its own way: nothing of what changes is shared."""
        out = copy(self)
        out.runs = self.runs.of_runs(np.arange(len(self)))
        out.commands, out.gait = dict(self.commands), dict(self.gait)
        return out

    def renewed(self, robots: NDArray[np.intp], fresh: SteppedRobots) -> None:
        """Let some robots begin anew as all of ``fresh`` do."""
        for name in ("time", "state", "feet", "code"):
            getattr(self.runs, name)[robots] = getattr(fresh.runs, name)[robots]
        for path, values in fresh.values.items():
            self.values[path] = self.values[path].copy()
            self.values[path][robots] = values[robots]
        rows, other = self.runs.rows, fresh.runs.rows
        moved = {name: getattr(rows, name).copy() for name in _OWN}
        for name, array in moved.items():
            array[robots] = getattr(other, name)[robots]
        self.runs.rows, self._rows = replace(rows, **moved), None
        for name in self.commands:
            self.commands[name] = self.commands[name].with_runs(fresh.commands[name], robots)
        for path in self.gait:
            self.gait[path] = self.gait[path].copy()
            self.gait[path][robots] = get_value(self.scene, f"gait.{path}")
        self.start, self.lost = self.start.copy(), self.lost.copy()
        self.start[robots], self.lost[robots] = fresh.start[robots], 0.0
        if self.spent is not None:
            self.spent = self.spent.copy()
            self.spent[robots] = 0.0

    def commanded(
        self, drive: Mapping[str, Any], gait: Mapping[str, Any], seconds: float, *, ramp: bool
    ) -> dict[str, Command]:
        """Commands of all drives where some get others now. Raises InputError for drives and numbers that are none."""
        drives, time, count = self.scene.robot.drives, self.runs.time, len(self)
        problems = [f"drive: there is no drive '{name}'{nearest(name, drives)}" for name in drive if name not in drives]
        if problems:
            raise InputError(problems)
        out = dict(self.commands)
        for name, wave in (self._gait_waves(gait) if gait else {}).items():
            track = wave.track()
            asked = track if len(track.loops) == count else track.picked(np.zeros(count, dtype=np.intp))
            out[name] = self.commands[name].changed(self.drive(name), asked, time)
        return out | {name: self.command(name, wave, seconds, ramp=ramp) for name, wave in drive.items()}

    def command(self, name: str, wave: Any, seconds: float, *, ramp: bool) -> Command:
        """That of a drive which gets a voltage or a waveform now."""
        before, time = self.commands[name], self.runs.time
        since = before.volts(time, asked=True) if ramp else time
        return before.changed(self.drive(name), asked_of(name, wave, len(self), since, seconds, ramp), time)

    def _gait_waves(self, gait: Mapping[str, Any]) -> dict[str, Any]:
        """Square waves of the gait's drives from now on, by name, with the numbers that it is given."""
        own, count = self.scene.gait, len(self)
        if own is None:
            raise InputError("gait: the scene has none; give its drives volts")
        for path, value in gait.items():
            place = get_value(self.scene, f"gait.{path}")
            given = None if isinstance(place, bool) or not isinstance(place, float) else row_of(value, count)
            if given is None or not np.isfinite(given).all():
                raise InputError(f"gait.{path}: expected one or {count} finite numbers, got {value!r:.60}")
            self.gait = {**self.gait, path: given}
        out = {}
        for name, numbers in gait_waves(self.scene, {**self._of("gait."), **self.gait}).items():
            wave = with_columns(self.scene.waveforms[name], numbers)
            turned = 2.0 * np.pi * np.fmod(wave.frequency * self.runs.time, 1.0)
            out[name] = with_columns(wave, {"phase": np.fmod(wave.phase + turned, 2.0 * np.pi)})
        return out

    def drive(self, name: str) -> Drive:
        """A drive, with the numbers of all robots where they differ."""
        own = self.scene.robot.drives[name]
        return with_columns(own, self._of(f"robot.drives.{name}.")) if self.values else own

    def _of(self, head: str) -> dict[str, Floats]:
        return {path.removeprefix(head): of for path, of in self.values.items() if path.startswith(head)}

    def _own_commands(self) -> dict[str, Command]:
        """What the drives do by the scene.

        Raises InputError for numbers of a drive with a law that goes by the rate which differ from robot to robot.
        """
        scene, count, out = self.scene, len(self), {}
        gait = self._of("gait.")
        waves = gait_waves(scene, gait) if gait else {}
        for name in scene.robot.drives:
            own = {**self._of(f"signals.{name}."), **waves.get(name, {})}
            wave = with_columns(scene.waveforms.get(name) or Constant(level=0.0), own)
            moved = bool(own or self._of(f"robot.drives.{name}."))
            if scene.robot.drives[name].law.by_rate and self._of(f"robot.drives.{name}."):
                raise InputError(f"robot.drives.{name}: a drive that creeps has the same numbers in all robots")
            out[name] = Command.own(self.drive(name), wave, count, moved)
        return out

    def advance(self, commands: dict[str, Command], seconds: float, threads: Workers) -> Advanced:
        """Go on for so many seconds under these commands; what happened."""
        before = self.runs.time.copy()
        if self._rows is None or commands is not self.commands:
            self._rows = self._driven(commands)
        self.commands = commands
        parts = self.runs.go_on(before + seconds, self._rows, account=self.spent is not None, threads=threads)
        rows, ends = parts.events, parts.event_end
        if len(rows):
            run = np.repeat(np.arange(len(self)), np.diff(ends, prepend=0))
            lost = [np.bincount(run, rows[:, column], len(self)) for column in (E_ENERGY, E_ADHESION)]
            self.lost = self.lost + np.stack(lost, axis=1)
        if self.spent is not None:
            self.spent = parts.energies + (self.spent if self.spent.size else 0.0)
        return parts

    def _driven(self, commands: Mapping[str, Command]) -> Rows:
        """The robots' rows of data with what their drives do."""
        plan, rows = self.runs.plan, self.runs.rows
        each = {name: getattr(rows, name)[self.runs.data] for name in _OWN}
        driven = [(of, self.drive(name), d in plan.charged) for d, (name, of) in enumerate(commands.items())]
        varied = any(path.startswith("robot.drives.") for path in self.values)
        shaken = range(len(driven), plan.drives)  # channels of ground that moves
        if driven and not shaken and (at_once := held(driven, len(self), varied)) is not None:
            return replace(rows, pool=at_once[0], signals=pack(at_once[0]), channels=at_once[1], **each)
        channels = np.zeros((len(self), len(plan.channels)), dtype=np.int64)
        pool: list[Channels] = []
        for d, (command, drive, charged) in enumerate(driven):
            places = plan.channels_of(d)
            force, volts = command.lowered(drive, charged)
            for place, made in zip(places, (force, volts), strict=False):
                assert made is not None
                channels[:, place] = sum(map(len, pool)) + command.which
                pool.append(made)
        if shaken:
            channels[:, shaken] = sum(map(len, pool)) + rows.channels[self.runs.data][:, shaken]
            pool.append(Channels.of(rows.pool))
        joined = Channels.joined(pool) if pool else Channels.of(())
        return replace(rows, pool=joined, signals=pack(joined), channels=channels, **each)

    def row(self, robot: int) -> Rows:
        """The row of data of one robot, at its place now."""
        return self.driven_row(self.commands, robot)

    def driven_row(self, commands: Mapping[str, Command], robot: int = 0) -> Rows:
        """That under some commands."""
        known = commands is self.commands and self._rows is not None
        rows = self._rows if known else self._driven(commands)
        assert rows is not None
        one = slice(robot, robot + 1)
        return replace(rows.taken(one), initial=self.runs.state[one])

    def ledger(self, robot: int) -> Ledger:
        """Where the energy of a robot went since its reset."""
        assert self.spent is not None
        own = self.row(robot)
        acting = RunLaws(self.runs.plan, own)
        shares = sum(max(len(acting.on(hook)) - 1, 0) for hook in ("momentum", "force"))
        energy = self.spent[robot] if self.spent.size else np.zeros(ENERGIES + shares)
        account = account_of(acting, energy)
        return ledger_of(
            self.runs.plan.system, own.scales[0], self.start[robot], self.runs.state[robot], account, self.lost[robot]
        )

    # what is kept in a file

    def arrays(self) -> dict[str, Any]:
        """All that robots are, by name, from which `taken` makes them again."""
        runs = self.runs
        out = {"time": runs.time, "state": runs.state, "feet": runs.feet, "code": runs.code, "start": self.start}
        out |= {"lost": self.lost} | ({} if self.spent is None else {"spent": self.spent})
        out |= {f"value/{path}": one for path, one in self.values.items()}
        out |= {f"gait/{path}": one for path, one in self.gait.items()}
        for name, command in self.commands.items():
            out |= {f"drive/{name}/{key}": one for key, one in command.arrays().items()}
        return out

    @classmethod
    def taken(
        cls, arrays: Mapping[str, Any], scene: Scene, shared: Shared, longest: float, accuracy: Accuracy
    ) -> SteppedRobots:
        """Those of the arrays."""

        def group(head: str) -> dict[str, Any]:
            return {key.removeprefix(head): one for key, one in arrays.items() if key.startswith(head)}

        count = len(arrays["time"])
        out = cls.at_start(scene, shared, group("value/"), count, longest, accuracy, account="spent" in arrays)
        for name in ("time", "state", "feet", "code"):
            setattr(out.runs, name, np.array(arrays[name]))
        out.start, out.lost, out.spent = arrays["start"], arrays["lost"], arrays.get("spent")
        out.gait = group("gait/")
        out.commands = {name: Command.of(group(f"drive/{name}/")) for name in scene.robot.drives}
        return out


@dataclass(frozen=True, repr=False)
class State:
    """Where robots are after a step, or a reset; of a session of one robot, arrays are without their first axis.

    time (nr,) [s]; x, v (nr, n): displacements and velocities in the structure's coordinates [m, rad; m/s, rad/s]; feet
    (nr, m, k): what the feet carry on (`tarsus.solve.contacts.CARRIED`); volts (nr, nd) [V] at the actuators now;
    began (nr, n): displacements as the step began; rows, ends: event rows of the step, and where those of each robot
    end; codes: how each robot's step ended.
    """

    scene: Scene
    system: LinearSystem
    sources: Floats
    ground: Sequence[tuple[Floats, bool, NDArray[np.intp]]]
    _time: Floats
    _x: Floats
    _v: Floats
    _feet: Floats
    _volts: Callable[[], Floats]
    _began: Floats
    _rows: Floats
    _ends: NDArray[np.int64]
    _codes: NDArray[np.int64]
    _one: bool

    def __repr__(self) -> str:
        many = "" if self._one else f"{len(self._time)} robots, "
        return f"<State '{self.scene.name}': {many}t = {self._time.max():.6g} s>"

    def _shown(self, of: Any) -> Any:
        return of[0] if self._one else of

    @property
    def time(self) -> Any:
        return self._shown(self._time)

    @property
    def x(self) -> Any:
        return self._shown(self._x)

    @property
    def v(self) -> Any:
        return self._shown(self._v)

    @cached_property
    def gaps(self) -> Any:
        """Gaps (nr, m) [m] of the feet, along the normals of the facets below them where the ground is uneven."""
        normals = self.system.normals
        height = self.sources[:, : normals.shape[1]] + self._x @ normals
        if not self.ground:
            return self._shown(height)
        walker = self.scene.robot.structure
        assert isinstance(walker, Walker)  # checked by Scene
        at = [walker.leg_coordinate(foot.point) for foot in self.scene.robot.feet.values()]
        place = self._x[:, at] + [walker.legs[foot.point].x for foot in self.scene.robot.feet.values()]
        facets, gaps = self._feet[..., CARRIED.index("facet")], np.zeros_like(height)
        for points, repeats, feet in self.ground:
            own = zip(points, facets[:, feet], place[:, feet], height[:, feet], strict=True)
            gaps[:, feet] = [gaps_above(*one, repeats) for one in own]
        return self._shown(np.where(self._contacts == FootState.AIR, gaps, 0.0))

    @cached_property
    def contacts(self) -> Any:
        """What feet (nr, m) do: `tarsus.base.events.FootState`."""
        return self._shown(self._contacts)

    @property
    def _contacts(self) -> NDArray[np.intp]:
        return self._feet[..., CARRIED.index("contact")].astype(np.intp)

    @property
    def feet(self) -> Any:
        return self._shown(self._feet)

    @cached_property
    def volts(self) -> Any:
        return self._shown(self._volts())

    @cached_property
    def body(self) -> Mapping[str, Any]:
        """Of a walker the coordinates (nr,) of its body by name: lengths [m] and angles [rad]."""
        names = self.scene.robot.structure.body_coordinates
        return {name: self._shown(self._x[:, i]) for i, name in enumerate(names)}

    def seen(self, outputs: Sequence[Output]) -> Floats:
        """What instruments see (nr, nc) of robots now that feel no ground, under volts that do not change. Raises
        InputError for what there is not."""
        under = dict(zip(self.scene.robot.drives, np.atleast_2d(self._volts()).T, strict=True))
        rows = Readings(self.scene, self._time, under, self.system).rows(outputs)
        return rows.free(self._x.T, self._v.T).T

    def displacement(self, point: str) -> Any:
        """Displacement (nr,) [m] of a named point of the structure. Raises InputError where there is none."""
        return self._shown(self.seen([Output(Quantity.DISPLACEMENT, point)])[:, 0])

    def velocity(self, point: str) -> Any:
        """Its velocity (nr,) [m/s]."""
        return self._shown(self.seen([Output(Quantity.VELOCITY, point)])[:, 0])

    @cached_property
    def currents(self) -> Any:
        """Currents (nr, nd) [A] into the actuators by motion alone, the gain of a small signal about the present volts
        times the rate of what the drive acts on (`tarsus.solve.outputs`)."""
        drives = self.scene.robot.drives
        return self._shown(self.seen([Output(Quantity.CURRENT, name, motional=True) for name in drives]))

    @cached_property
    def all_events(self) -> NDArray[np.void]:
        """Events of the step, robot by robot, each in time order; fields as those of a run's."""
        return structured_events(self._rows)

    @cached_property
    def robots(self) -> NDArray[np.intp]:
        """Of which robot each of `all_events` is."""
        return np.repeat(np.arange(len(self._time)), np.diff(self._ends, prepend=0))

    def events_of(self, robot: int) -> NDArray[np.void]:
        """Events of the step of one robot."""
        return without_marks(self.all_events[self.robots == robot])

    @property
    def events(self) -> NDArray[np.void]:
        """Events of the step: of the one robot, or of all (`robots` says of which each is)."""
        return self.all_events

    @property
    def codes(self) -> list[ResultCode]:
        """How the step of each robot ended."""
        energy = self.scene.ground.makes_energy
        return [ResultCode.of(int(code), makes_energy=energy) for code in self._codes]

    @property
    def code(self) -> ResultCode:
        """How the step ended, of many robots that of the first that did not reach its end."""
        return next((code for code in self.codes if code is not ResultCode.DONE), ResultCode.DONE)

    @property
    def ok(self) -> Any:
        """Whether robots (nr,) have come as far as they were asked to."""
        return self._shown(self._codes == ResultCode.DONE.number)

    @cached_property
    def measures(self) -> Mapping[str, Any]:
        """What the step came to (nr,), by name: `tarsus.measure.counts.COUNTS`, and of a walker ``progress`` [m], the
        way of its body in the step."""
        count = len(self._time)
        out = {name: one.of(self.all_events, self.robots, count) for name, one in COUNTS.items()}
        if self.scene.robot.structure.body_coordinates:
            out["progress"] = self._x[:, 0] - self._began[:, 0]
        return {name: self._shown(one) for name, one in out.items()}


def state_of(robots: SteppedRobots, began: Floats, parts: Advanced | None, one: bool) -> State:
    """Where robots are, after what happened in a step that began with displacements (nr, n)."""
    runs, system = robots.runs, robots.runs.plan.system
    n = len(system.mass)
    commands, time = robots.commands, runs.time.copy()

    def volts() -> Floats:
        return np.stack([of.volts(time) for of in commands.values()], axis=1) if commands else np.zeros((len(time), 0))

    rows = np.zeros((0, EVENT_WIDTH)) if parts is None else parts.events
    ends = np.zeros(len(runs), dtype=np.int64) if parts is None else parts.event_end
    legs, profile = runs.plan.legs, runs.rows.profile[runs.data]
    ground = () if legs is None else tuple(lines_below(legs.body, profile))
    return State(
        robots.scene,
        system,
        runs.rows.sources[runs.data],
        ground,
        time,
        runs.state[:, :n].copy(),
        runs.state[:, n:].copy(),
        runs.feet.copy(),
        volts,
        began,
        rows,
        ends,
        runs.code.copy(),
        one,
    )
