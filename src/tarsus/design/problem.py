"""What a design is asked for, checked: a scene, what is free, objectives, limits, grounds, risk and motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.spec import MaybeAmount, quantity, with_values
from tarsus.base.workers import Workers
from tarsus.design.free import Free, free_of
from tarsus.design.grounds import Grounds, Over
from tarsus.design.judge import Risk
from tarsus.design.measures import ENERGY, TRANSPORT, DesignLimit, DesignObjective, limits_of, objectives_of, unmeasured
from tarsus.design.problems import Problems
from tarsus.design.request import OVER, RISK, SEED, Count, Seed, Settings, bearing, setting
from tarsus.design.runs import Runs
from tarsus.files.draws import SURE, Reliance
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.orbits.motion import Motion, SettledMotion, motion_asked
from tarsus.orbits.starts import Box
from tarsus.tables.numbers import amount

Floats = NDArray[np.float64]

FEWEST = 64
"""Candidates below which no search begins: a population of 24 and what it is chosen from."""
SCENE = "of a file alone: a device, or a scene file in its folder"
MOST, A_PAIR = 4000, 250
"""Candidates unless a number is given: so many at most, and of fewer than four unknowns so many times their number
squared: a single unknown is then tried at every 0.4 % of its range."""
TRIED = f"that are tried in all, {FEWEST} or more; unless given {MOST}, or {A_PAIR} times the unknowns squared if less"
FREE = 'paths of what may change, each with its range or "usual", a way to tie phases, or pulses of a signal'
RUNS = "of the runs that all that is shown comes from, 1 s or more; as long as 20 drive periods unless given"
STARTS = "of every run, spread over heights and speeds; a value on a ground is the mean of their settled motions"
REST = (
    "judge an episode of so long from the scene's own start, what is counted by drive period without the first third "
    "of them, and not the settled motion; of a robot that does not walk the scene's own duration unless anything else "
    "is asked for"
)
PERIODS = "judge the last of so many drive periods from the scene's own start; of pulses as many as they take to settle"
LOOK = 48
"""Grounds of an attack unless a number is given."""
SEARCHED = 0.3
"""Share of their duration that runs of a settled motion have in the search: 0.3 s of `millipede`, after which the mean
of five starts is wrong by 0.2 mm/s (root of the mean square of 40 gaits) of up to 4 mm/s."""


class SearchSettings(Settings):
    """What every design is given besides the scene."""

    free: Any = setting(..., FREE)
    objective: Any = setting(
        ...,
        "one to three measures with a direction, as most mean_speed or least hardest_impact.tip, or words: speed, "
        "energy, transport, slip, contact, support, sway, hold",
    )
    over: Any = setting(None, OVER)
    candidates: Annotated[int, Field(ge=FEWEST)] | None = setting(None, TRIED)
    starts: Annotated[int, Field(ge=1)] | None = setting(None, f"{STARTS}; 4 unless given")
    duration: MaybeAmount = quantity("s", RUNS, default=None, gt=0)
    from_rest: MaybeAmount = quantity("s", REST, default=None, gt=0)
    periods: Annotated[int, Field(ge=1)] | None = setting(None, PERIODS)
    seed: Seed = setting(0, SEED)


class DesignSettings(SearchSettings):
    """What a design is asked for besides the scene, see `tarsus.design`."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "objective": ("objective", "limits", "risk"),
        "search": ("candidates", "look", "seed"),
        "runs": ("starts", "duration", "from_rest", "periods"),
    }

    limits: Any = setting(
        None, "measures that every run keeps, as slip_ratio<0.2, with commas; heave_span<inf lifts that of the model"
    )
    risk: Any = setting(None, RISK)
    scene: str | None = setting(None, SCENE)
    look: Count = setting(LOOK, "grounds that an attack between rounds looks at before it climbs; the last at more")


@dataclass(frozen=True)
class LastPeriod:
    """The last of so many drive periods from the scene's own start; duration [s]: of all of them."""

    duration: float
    periods: int

    starts = 0
    """Of none but the scene's own."""

    def __str__(self) -> str:
        return f"the last of {self.periods} periods from the scene's own start, {amount(self.duration, 's')}"


@dataclass(frozen=True)
class DesignProblem:
    """A scene with what is free in it, objectives, grounds and risk, all of them checked."""

    scene: Scene
    free: Free
    objectives: tuple[DesignObjective, ...]
    over: Over | None
    risk: Risk
    options: SearchSettings
    motion: Motion | LastPeriod
    limits: tuple[DesignLimit, ...] = ()
    threads: Workers = None

    @property
    def reliance(self) -> Reliance:
        """How far its grounds can be relied on."""
        return self.over.reliance if isinstance(self.over, Grounds) else SURE

    @property
    def noun(self) -> str:
        """What a candidate is called."""
        return "gait" if isinstance(self.scene.robot.structure, Walker) else "design"

    @property
    def candidates(self) -> int:
        """That are tried in all."""
        few = int(np.clip(A_PAIR * len(self.free) ** 2, FEWEST, MOST))
        return few if self.options.candidates is None else self.options.candidates

    @property
    def duration(self) -> float:
        """Of the runs that all that is shown comes from [s]."""
        return self.motion.duration

    @cached_property
    def starts(self) -> Box | None:
        """Heights and speeds that runs start with; None for those from the scene's own start."""
        return Box.of(self.scene, None) if isinstance(self.motion, SettledMotion) else None

    def runs(self, share: float = 1.0) -> Runs:
        """Runs that are judged; of a settled motion for a share of their duration."""
        short = share if isinstance(self.motion, SettledMotion) else 1.0
        skip = self.motion.periods - 1 if isinstance(self.motion, LastPeriod) else None
        return Runs(self.free, self.objectives, short * self.duration, self.threads, self.starts, self.limits, skip)

    @property
    def text(self) -> str:
        """What runs and their order depend on besides the scene and `numbers`."""
        over = () if self.over is None else self.over.names
        own = self.options.model_dump(mode="json", exclude={"scene", "free", "objective", "over", "risk", "limits"})
        bounds = (f"{one}" for one in self.limits)
        names = (*self.free.paths, *(one.measure for one in self.objectives), *bounds, *over, self.risk.name)
        return f"{', '.join(names)}\n{own}, {self.motion!r}\n"

    @property
    def numbers(self) -> list[Floats]:
        """Numbers that runs depend on besides the scene: ranges and grounds."""
        free, over = self.free, self.over
        grounds = (
            []
            if over is None
            else [over.points(), over.weights]
            if isinstance(over, Grounds)
            else [over.low, over.high]
        )
        limits = np.array([one.value for one in self.limits])
        return [free.numbers.low, free.numbers.high, free.base, free.share, limits, *grounds]


def problem_of(scene: Scene, options: SearchSettings, risk: Any) -> DesignProblem:
    """Check everything; raises InputError with every problem that can be found at once."""
    problems = Problems()
    objectives = problems.tried(lambda: objectives_of(options.objective)) or ()
    free = problems.tried(lambda: free_of(scene, options.free))
    over, judged = bearing(problems, scene, options.over, risk, lambda path: free is not None and free.chooses(path))
    limits: tuple[DesignLimit, ...] = ()
    if isinstance(options, DesignSettings):
        limits = problems.tried(lambda given=options.limits: limits_of(scene, given)) or ()
    problems += _of_energy(scene, objectives, limits)
    motion = None if free is None else problems.tried(lambda: _motion(free, options))
    episodes = motion is not None and not isinstance(motion, SettledMotion)
    problems += unmeasured(scene, [one.measure for one in (*objectives, *limits)], episodes or motion is None)
    if problems or free is None or motion is None:
        raise InputError(problems)
    return DesignProblem(free.scene, free, objectives, over, judged, options, motion, limits)


def _motion(free: Free, options: SearchSettings) -> Motion | LastPeriod:
    """What runs are asked for: unless anything is, settled motions of walkers, and of others what a run of the scene
    shows. Raises InputError for runs that are too short: they are measured by whole drive periods, and a motion settles
    in some."""
    slowest = _slowest(free)
    given = {name: getattr(options, name) for name in ("starts", "duration", "from_rest")}
    named = [name for name, one in given.items() if one is not None]
    if options.periods is not None:
        if named:
            raise InputError(f"periods: the last period from one start; leave {' and '.join(named)} out")
        if not slowest > 0.0:
            raise InputError("periods: the scene has no drive with a period")
        return LastPeriod(options.periods * slowest, options.periods)
    if not named and free.pulses is not None:
        periods = free.pulses.settling(free.scene)
        return LastPeriod(periods * slowest, periods)
    if not named and not isinstance(free.scene.robot.structure, Walker):
        given["from_rest"] = free.scene.duration
    return motion_asked(slowest, **given)


def _slowest(free: Free) -> float:
    """The longest drive period [s] of any candidate: at the least of each frequency that is free."""
    lowest = dict(zip(free.paths, free.values(np.zeros((1, len(free))))[0].tolist(), strict=True))
    frequencies = {path: one for path, one in lowest.items() if path.rpartition(".")[2] == "frequency"}
    scene = with_values(free.scene, frequencies)
    return max((wave.period or 0.0 for wave in scene.waves.values()), default=0.0)


def _of_energy(scene: Scene, objectives: Sequence[DesignObjective], limits: Sequence[DesignLimit]) -> list[str]:
    asked = {one.measure: one.name for one in objectives} | {one.measure: one.measure for one in limits}
    priced = {measure: name for measure, name in asked.items() if measure in (ENERGY, TRANSPORT)}
    if not priced:
        return []
    layout = scene.robot.layout()
    moving = (
        list(scene.robot.drives) if layout is None else [name for name, reach in layout.drives.items() if reach.legs]
    )
    bare = [name for name in moving if scene.robot.drives[name].capacitance is None]
    names = " and ".join(priced.values())
    problems = [
        f"objective: {names} needs the capacitance of drive '{name}': set robot.drives.{name}.capacitance"
        for name in bare[:1]
    ]
    if scene.ground.gravity is None and TRANSPORT in priced:
        problems.append("objective: transport needs gravity, for the weight that is carried")
    return problems
