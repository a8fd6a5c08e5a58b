"""A scene that is run again and again with other numbers, or stepped: what the engine made for it stays."""

from __future__ import annotations

import io
import json
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from typing import TYPE_CHECKING, Any, ClassVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import Hinted
from tarsus.base.spec import by_path
from tarsus.files.library import SceneLike, as_scene
from tarsus.files.toml import scene_text
from tarsus.model.scene import seconds_of
from tarsus.plan.slots import Place, slots
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import SINGLE_RUN, Accuracy
from tarsus.solve.results import Batch
from tarsus.solve.run import changed_run
from tarsus.solve.shared import Shared
from tarsus.solve.simulation import columns, simulate_batch

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.files.ledger import Ledger
    from tarsus.model.scene import Scene
    from tarsus.solve.run import Run
    from tarsus.solve.step_slopes import StepSlopes
    from tarsus.solve.stepping import State, SteppedRobots
    from tarsus.solve.trajectories import Trajectories

Floats = NDArray[np.float64]
Drawn = Callable[[np.random.Generator, int], Mapping[str, ArrayLike]]
"""What robots differ in, drawn at every reset: values (nr,) by path, of so many robots."""

FORMAT = "tarsus session 1"


class Session(Hinted):
    """Runs of one scene with some of its numbers changed, which share contact modes and step tables; and robots that
    are stepped.

    Runs that differ in numbers that are data of a plan (`slots`) share the plan and all tables: nothing is lowered for
    them. Others share tables with earlier runs of the same structure, of which the last 32 are kept. Every run is the
    one that `simulate` makes of the changed scene, to rounding of its drives. Safe between threads.

    Stepped, the robots wait where they are for the next command: `reset`, `step`, `fork`, `save`.
    """

    def __init__(
        self,
        scene: SceneLike,
        robots: int | None = None,
        vary: Mapping[str, Any] | Drawn | None = None,
        *,
        accuracy: Accuracy | None = None,
        account: bool = False,
        threads: Workers = None,
    ) -> None:
        """What is stepped is one robot, or so many.

        scene: a scene, or a device's name or a scene file's path. vary: slots (`slots`) in which robots differ, by
        path: a number or text with a unit, one for each (nr,), or a tuple of two, between which they are drawn at each
        reset; or a function of a generator and how many robots to draw for, which gives values (nr,) by path. accuracy:
        of steps, by default that of a single run, and of many robots that of a batch. account: whether to keep energies
        (`ledger`). threads: of steps, by default one for each processor.

        Raises InputError for fewer than one robot.
        """
        self.scene: Scene = as_scene(scene)
        if robots is not None and not (robots >= 1 and robots == int(robots)):
            raise InputError(f"robots: expected one or more, got {robots}")
        self.robots, self.vary = robots, vary or {}
        self.accuracy = accuracy or (SINGLE_RUN if robots is None else Accuracy())
        self.account, self.threads = account, threads
        self._shared = Shared(self.scene)
        self._rng = np.random.default_rng()
        self._now: SteppedRobots | None = None
        self._asked: tuple[float | str, float] = "1 ms", 1e-3  # the last text of a time, which is read once
        self._lock = threading.RLock()

    _guesses: ClassVar[Mapping[str, str]] = {
        "simulate": "'run'",
        "simulate_batch": "'batch'",
        "time": "state.time",
        "load": "'restore'",
    }

    def __repr__(self) -> str:
        many = "" if self.robots is None else f", robots={self.robots}"
        return f"Session({self.scene.name!r}{many})"

    @property
    def slots(self) -> Mapping[str, Place]:
        """The numbers that need no tables of their own, by path."""
        return slots(self.scene)

    def run(
        self,
        values: Mapping[str, Any] | None = None,
        duration: float | str | None = None,
        accuracy: Accuracy | None = None,
    ) -> Run:
        """One run with values in place of the scene's own, by path, as `tarsus.with_values` takes them.

        duration [s], accuracy: as for `simulate`. Raises InputError as these two do.
        """
        return changed_run(self.scene, values or {}, seconds_of(self.scene, duration), accuracy, self._shared)

    def batch(self, vary: Mapping[str, ArrayLike], duration: float | str | None = None, **options: Any) -> Batch:
        """Many runs, as `simulate_batch` makes them; options as there. Raises InputError as it does."""
        return simulate_batch(self.scene, vary, duration, shared=self._shared, **options)

    def trajectories(
        self, vary: Mapping[str, ArrayLike], longest: float | str, accuracy: Accuracy | None = None
    ) -> Trajectories:
        """Runs that go on as long as each is asked to, up to ``longest`` [s] or a text with a unit; vary: values (nr,)
        of slots by path, as `simulate_batch` takes them. Raises InputError as it and `Trajectories.of` do."""
        from tarsus.solve.trajectories import Trajectories

        values = by_path(self.scene, columns(self.scene, vary, grid=False))
        return Trajectories.of(
            self.scene, values, seconds_of(self.scene, longest), accuracy=accuracy, shared=self._shared
        )

    # robots that are stepped

    def reset(self, seed: int | None = None, *, robots: ArrayLike | None = None) -> State:
        """Put robots at their start, at time 0, under the scene's own signals.

        seed: of what is drawn from now on; without one it goes on as it did. robots: numbers, or (nr,) truths, of
        those that begin anew, by default all. Raises InputError where what varies does not fit the scene.
        """
        with self._lock:
            if seed is not None:
                self._rng = np.random.default_rng(seed)
            if robots is None or self._now is None:
                self._now = self._fresh(self.robots or 1)
            else:
                own, count = np.asarray(robots), self.robots or 1
                if (own.shape != (count,)) if own.dtype == bool else np.any(own >= count):
                    raise InputError(f"robots: expected numbers below {count}, or {count} truths, got {robots!r:.60}")
                chosen = np.flatnonzero(own) if own.dtype == bool else own.astype(np.intp).reshape(-1)
                if len(chosen):
                    self._now.renewed(chosen, self._fresh(self.robots or 1))
            return self._state(None)

    def _fresh(self, count: int) -> SteppedRobots:
        from tarsus.solve.stepping import SteppedRobots

        values = self.vary(self._rng, count) if callable(self.vary) else self._drawn(count)
        checked = {path: columns(self.scene, {path: of}, grid=False)[path] for path, of in values.items()}
        spread = {
            path: np.broadcast_to(one, (count,))
            for path, one in by_path(self.scene, checked).items()
            if len(one) in (1, count)
        }
        if wrong := sorted(path for path, one in checked.items() if len(one) not in (1, count)):
            raise InputError([f"{path}: expected one value or {count}, got {len(checked[path])}" for path in wrong])
        longest = seconds_of(self.scene, None)
        return SteppedRobots.at_start(
            self.scene, self._shared, spread, count, longest, self.accuracy, account=self.account
        )

    def _drawn(self, count: int) -> dict[str, ArrayLike]:
        """Values of what varies, those between two bounds drawn."""
        assert not callable(self.vary)
        out: dict[str, ArrayLike] = {}
        for path, of in self.vary.items():
            if isinstance(of, tuple):
                if len(of) != 2:
                    raise InputError(f"{path}: expected two bounds to draw between, got {len(of)}")
                low, high = columns(self.scene, {path: list(of)}, grid=False)[path]
                of = self._rng.uniform(min(low, high), max(low, high), count)
            out[path] = of
        return out

    @overload
    def step(
        self,
        drive: Mapping[str, Any] | float | str | None = None,
        dt: float | str = "1 ms",
        *,
        ramp: bool = False,
        gait: Mapping[str, Any] | None = None,
        gradients: None = None,
    ) -> State: ...
    @overload
    def step(
        self,
        drive: Mapping[str, Any] | float | str | None = None,
        dt: float | str = "1 ms",
        *,
        ramp: bool = False,
        gait: Mapping[str, Any] | None = None,
        gradients: Sequence[str],
    ) -> tuple[State, StepSlopes]: ...
    def step(
        self,
        drive: Mapping[str, Any] | float | str | None = None,
        dt: float | str = "1 ms",
        *,
        ramp: bool = False,
        gait: Mapping[str, Any] | None = None,
        gradients: Sequence[str] | None = None,
    ) -> State | tuple[State, StepSlopes]:
        """Go on for ``dt`` [s], exactly from event to event, under a command from now on.

        Parameters
        ----------
        drive
            By the drives' names: volts, which are held; with several robots one for all or one for each (nr,). Or a
            waveform, whose time begins now, or a waveform for each robot: a ramp, switching times (`OnOff`). Others go
            on as before, at first by the scene's own signals. A number or text alone is ``dt``: ``step(1e-3)``.
        dt
            How long; a text with a unit.
        ramp
            Volts are reached by a straight ramp at the end of the step, from those that were asked for before.
        gait
            Numbers of the scene's gait by their paths in it, for all robots or for each (nr,): phases, frequency,
            volts, duty, as if its clock had run on with them.
        gradients
            Paths of numbers of the scene by which the step is differentiated as well, besides the state that it begins
            with and the command; of one robot.

        Raises
        ------
        InputError
            Where nothing has been reset, for drives and numbers that are none, for a time that is none, and where a
            robot has stopped before; nothing has moved then.
        """
        if isinstance(drive, (int, float, str)) and dt == "1 ms":
            drive, dt = None, drive
        if not isinstance(drive, Mapping | None):
            name = next(iter(self.scene.robot.drives), "NAME")
            raise InputError(f"drive: expected volts by the drives' names, such as {{'{name}': 6}}, got {drive!r:.60}")
        with self._lock:
            now, seconds = self._robots(), self._seconds(dt)
            if not now.runs.done.all():
                robot = int(np.flatnonzero(~now.runs.done)[0])
                said = ResultCode.of(int(now.runs.code[robot]), makes_energy=self.scene.ground.makes_energy)
                which = "the robot" if self.robots is None else f"robot {robot}"
                raise InputError(f"{which} has stopped at {now.runs.time[robot]:.6g} s and waits for a reset: {said}")
            kept = now.gait
            try:
                commands = now.commanded(drive or {}, gait or {}, seconds, ramp=ramp) if drive or gait else now.commands
                slopes = None
                if gradients is not None:
                    from tarsus.solve.step_slopes import StepAsked, step_slopes

                    slopes = step_slopes(StepAsked(now, commands, drive or {}, seconds, ramp), gradients)
                began = now.runs.state[:, : now.runs.state.shape[1] // 2].copy()
                parts = now.advance(commands, seconds, self.threads)
            except InputError:
                now.gait = kept
                raise
            state = self._state(parts, began)
            return state if slopes is None else (state, slopes)

    def _robots(self) -> SteppedRobots:
        if self._now is None:
            raise InputError("there is no robot to step yet: call reset first")
        return self._now

    def _seconds(self, dt: float | str) -> float:
        if isinstance(dt, float) and 0.0 < dt < np.inf:
            return dt
        if dt == self._asked[0]:
            return self._asked[1]
        self._asked = dt, seconds_of(self.scene, dt, "dt")
        return self._asked[1]

    def _state(self, parts: Any, began: Floats | None = None) -> State:
        from tarsus.solve.stepping import state_of

        now = self._robots()
        n = now.runs.state.shape[1] // 2
        return state_of(now, now.runs.state[:, :n].copy() if began is None else began, parts, self.robots is None)

    @property
    def state(self) -> State:
        """Where robots are, without events. Raises InputError where nothing has been reset."""
        return self._state(None)

    @property
    def values(self) -> Mapping[str, Floats]:
        """What each robot (nr,) has instead of the scene's numbers, by path."""
        return dict(self._robots().values)

    def ledger(self, robot: int = 0) -> Ledger:
        """Where the energy of a robot went since its reset; the work of ground that moves is in ``work_in``.

        Raises InputError unless the session keeps an account.
        """
        if not self.account:
            raise InputError("there is no account: make the session with account=True")
        return self._robots().ledger(robot)

    def fork(self) -> Session:
        """Another session whose robots are where these are and go their own way; tables are shared."""
        with self._lock:
            out = Session(
                self.scene, self.robots, self.vary, accuracy=self.accuracy, account=self.account, threads=self.threads
            )
            out._shared = self._shared
            out._rng.bit_generator.state = self._rng.bit_generator.state
            out._now = None if self._now is None else self._now.copied()
            return out

    __copy__ = fork

    def __deepcopy__(self, memo: Any) -> Session:
        return self.fork()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write robots to a file, from which `restore` goes on to the last bit: numpy's .npz of arrays alone.

        `session` is JSON: version of the format, digest of the scene, number of robots, state of the random generator.
        `time` (nr,) [s], `state` (nr, 2n), `feet` (nr, m, 16) with the columns of `tarsus.solve.contacts.CARRIED`, and
        `code` (nr,) say where the robots are and how the last step ended. `start` (nr, 2n), `lost` (nr, 2) and `spent`
        (nr, .) belong to the account: state at the reset, energy lost in impacts, work [J]. `value/PATH` and
        `gait/PATH` (nr,) are what robots have instead of the scene's numbers. `drive/NAME/...` is the command of a
        drive: `begun` [s], `past` [V], `late` [N], and courses of voltage as stretches
        (`tarsus.model.drive.track.Track`)."""
        with open(path, "wb") as file:
            file.write(self._bytes())

    def restore(self, path: str | os.PathLike[str]) -> State:
        """Put robots where `save` left them. Raises InputError for a file that is none, or of another scene."""
        try:
            with open(path, "rb") as file:
                content = file.read()
        except OSError as error:
            raise InputError(f"{os.fspath(path)}: {error.strerror}") from None
        with self._lock:
            self._take(content, os.fspath(path))
            return self._state(None)

    def _bytes(self) -> bytes:
        with self._lock:
            said = {
                "format": FORMAT,
                "scene": self._digest(),
                "robots": self.robots,
                "generator": self._rng.bit_generator.state,
            }
            out = io.BytesIO()
            np.savez_compressed(out, session=json.dumps(said), **self._robots().arrays())
            return out.getvalue()

    def _take(self, content: bytes, name: str) -> None:
        from tarsus.solve.stepping import SteppedRobots

        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = dict(file)
            said = json.loads(str(arrays.pop("session")))
            known = said["format"] == FORMAT
        except (ValueError, KeyError, OSError, EOFError, TypeError) as error:
            raise InputError(f"{name}: no file of a session ({type(error).__name__})") from None
        if not known:
            raise InputError(f"{name}: written by another version ({said['format']})")
        if said["scene"] != self._digest() or said["robots"] != self.robots:
            raise InputError(f"{name}: of another scene, or of another number of robots")
        longest = seconds_of(self.scene, None)
        self._now = SteppedRobots.taken(arrays, self.scene, self._shared, longest, self.accuracy)
        self.account = "spent" in arrays
        self._rng.bit_generator.state = said["generator"]

    def _digest(self) -> str:
        return sha256(scene_text(self.scene).encode()).hexdigest()[:16]

    def __getstate__(self) -> dict[str, Any]:
        """In another process tables are made again; the robots are where they are."""
        with self._lock:
            out = {name: of for name, of in self.__dict__.items() if name not in ("_lock", "_now")}
            return out | {"_file": None if self._now is None else self._bytes()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        content = state.pop("_file")
        self.__dict__.update(state, _lock=threading.RLock(), _now=None)
        if content is not None:
            self._take(content, "a pickled session")
