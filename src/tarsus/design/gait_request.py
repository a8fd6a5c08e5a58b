"""What a gait's design is asked for, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.spec import Amount, MaybeAmount, quantity
from tarsus.base.workers import Workers
from tarsus.design.gait_unknowns import GaitUnknowns, Symmetry, gait_unknowns
from tarsus.design.grounds import Grounds, Over
from tarsus.design.judge import Risk
from tarsus.design.limits import WalkLimit, limits_of
from tarsus.design.request import OVER, RISK, SEED, Count, Problems, Seed, Settings, setting
from tarsus.design.walks import ENERGY, TRANSPORT, WalkObjective, Walks, objectives_of, without_legs
from tarsus.measure.walking import OF_EPISODES
from tarsus.measure.walking import WALK as OF_WALKS
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.orbits.motion import Motion, SettledMotion, motion_asked
from tarsus.orbits.starts import Box

Floats = NDArray[np.float64]

FEWEST = 64
"""Candidates below which no search begins: a population of 24 and what it is chosen from."""
FREE = 'paths of the gait and of signals that may change, each with its range or "usual"'
TIED = "of free phases: none, mirror, pairs or wave"
WALK = "of the walks that all that is shown comes from, 1 s or more; as long as 20 drive periods unless given"
STARTS = (
    "of every walk, spread over heights and speeds; a value on a ground is the mean of their settled motions"
)
REST = (
    "judge an episode of so long from the scene's own start, transients and all, and not the settled motion"
)
SEARCHED = 0.3
"""Share of their duration that walks of a settled motion have in the search: 0.3 s of `millipede`, after which the mean
of five starts is off by 0.2 mm/s (root of the mean square of 40 gaits) of up to 4 mm/s."""


class Sense(Enum):
    """What a robot can sense of its own walk."""

    NOTHING = "nothing"
    """Nothing: one gait for all grounds."""
    CHARGE = "charge"
    """The charge of its actuators, which tells when a foot meets and leaves the ground: the share of the time on
    the ground, and touchdowns a step."""
    SLIP = "slip"
    """Its way over the ground: path that the feet slide, and stride."""


class WalkSettings(Settings):
    """What every design of gaits is given beside the scene."""

    free: Any = setting(..., FREE)
    symmetry: Symmetry = setting(Symmetry.NONE, TIED)
    dead: tuple[str, ...] = setting((), "legs that do not move")
    over: Any = setting(None, OVER)
    candidates: Annotated[int, Field(ge=FEWEST)] = setting(4000, f"gaits that are tried in all, {FEWEST} or more")
    starts: Count = setting(4, STARTS)
    duration: MaybeAmount = quantity("s", WALK, default=None, gt=0)
    from_rest: MaybeAmount = quantity("s", REST, default=None, gt=0)
    seed: Seed = setting(0, SEED)


class GaitSettings(WalkSettings):
    """What a gait is designed for beside the scene, see `tarsus.design.gait` and `tarsus.design.adapt`."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "objective": ("objective", "limits", "risk"),
        "search": ("candidates", "look", "seed"),
        "walks": ("starts", "duration", "from_rest"),
    }

    objective: Any = setting(
        "speed,energy",
        "one to three of speed, energy, transport, slip, contact, support, sway and hold, or of measures: most "
        "duty_factor",
    )
    limits: Any = setting(
        None,
        "measures that every walk keeps, as slip_ratio<0.2, with commas; heave_span<inf lifts that of the model",
    )
    risk: Any = setting(None, RISK)
    look: Count = setting(
        48, "grounds that an attack between rounds looks at before it climbs; the last at more"
    )


class AdaptSettings(WalkSettings):
    """What an adaptive gait is designed for beside the scene, see `tarsus.design.adapt`."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "objective": ("objective", "gaits", "hidden"),
        "search": ("candidates", "training", "seed"),
        "walks": ("starts", "duration", "from_rest"),
        "sense": ("sense", "steps", "noise"),
    }

    objective: Any = setting("speed", "one of speed, transport, slip, contact, support, sway and hold")
    gaits: Count = setting(10, "how many gaits at most")
    hidden: Annotated[int, Field(ge=2)] = setting(200, "hidden grounds that the choice is judged on")
    training: Annotated[int, Field(ge=2)] = setting(256, "grounds that the table is of")
    sense: tuple[Sense, ...] = setting((Sense.CHARGE,), "charge, slip, both, or nothing")
    steps: Annotated[int, Field(ge=2)] = setting(20, "walked with up to four gaits before one is chosen")
    noise: Amount = quantity(
        "1", "standard deviation of what is sensed, as a share of it", default=0.02, ge=0, lt=1
    )


@dataclass(frozen=True)
class GaitRequest:
    """A scene with its unknowns, objectives, grounds and risk, all of them checked."""

    scene: Scene
    unknowns: GaitUnknowns
    objectives: tuple[WalkObjective, ...]
    over: Over | None
    risk: Risk
    options: GaitSettings | AdaptSettings
    motion: Motion
    limits: tuple[WalkLimit, ...] = ()
    threads: Workers = None

    @property
    def duration(self) -> float:
        """Of the walks that all that is shown comes from [s]."""
        return self.motion.duration

    @cached_property
    def starts(self) -> Box | None:
        """Heights and speeds that walks start with; None for episodes from the scene's own start."""
        return Box.of(self.scene, None) if isinstance(self.motion, SettledMotion) else None

    def walks(self, share: float = 1.0) -> Walks:
        """Walks that are judged; of a settled motion for a share of their duration."""
        short = share if isinstance(self.motion, SettledMotion) else 1.0
        return Walks(
            self.scene,
            self.unknowns,
            self.objectives,
            short * self.duration,
            self.threads,
            self.starts,
            self.limits,
        )

    @property
    def text(self) -> str:
        """What walks and their order depend on beside the scene and `numbers`."""
        over = () if self.over is None else self.over.names
        own = self.options.model_dump(mode="json", exclude={"free", "objective", "over", "risk", "limits"})
        bounds = (f"{one}" for one in self.limits)
        names = (*self.unknowns.paths, *(one.name for one in self.objectives), *bounds, *over, self.risk.name)
        return f"{', '.join(names)}\n{own}, {self.motion!r}\n"

    @property
    def numbers(self) -> list[Floats]:
        """Numbers that walks depend on beside the scene: ranges and grounds."""
        free, over = self.unknowns, self.over
        grounds = (
            []
            if over is None
            else [over.points(), over.weights]
            if isinstance(over, Grounds)
            else [over.low, over.high]
        )
        limits = np.array([one.value for one in self.limits])
        return [free.numbers.low, free.numbers.high, free.base, free.share, limits, *grounds]


def gait_request(
    scene: Scene, options: GaitSettings | AdaptSettings, risk: str | Risk | None, threads: Workers = None
) -> GaitRequest:
    """Check everything; raises InputError with every problem that can be told at once."""
    if not isinstance(scene.robot.structure, Walker):
        raise InputError(
            f"'{scene.name}' does not walk: only a scene whose structure is a walker has a gait to design"
        )
    problems = Problems()
    scene = problems.tried(lambda: without_legs(scene, options.dead)) or scene
    objectives = problems.tried(lambda: objectives_of(options.objective)) or ()
    made = problems.tried(lambda: gait_unknowns(scene, options.free, options.symmetry))
    over, judged = problems.bearing(
        scene, options.over, risk, lambda path: made is not None and path in made[1].paths
    )
    limits: tuple[WalkLimit, ...] = ()
    if isinstance(options, GaitSettings):
        limits = problems.tried(lambda given=options.limits: limits_of(scene, given)) or ()
    problems += _of_energy(scene, objectives, limits)
    motion = None if made is None else problems.tried(lambda: _motion(*made, options))
    problems += _unseen(scene, [one.measure for one in (*objectives, *limits)], motion)
    if problems or made is None or motion is None:
        raise InputError(problems)
    return GaitRequest(*made, objectives, over, judged, options, motion, limits, threads)


def _unseen(scene: Scene, measures: Sequence[str], motion: Motion | None) -> list[str]:
    """Measures that walks do not have: of a body that does not turn so, and of episodes where motions settle."""
    moves = set(getattr(scene.robot.structure, "body_coordinates", ()))
    problems = [
        f"{name}: is of bodies with {' or '.join(sorted(OF_WALKS[name].moves))}, and this one has none"
        for name in dict.fromkeys(measures) if name in OF_WALKS and not moves & set(OF_WALKS[name].moves)
    ]  # fmt: skip
    if isinstance(motion, SettledMotion):
        problems += [
            f"{name}: is of a run from its start; a settled motion has none, say from_rest"
            for name in dict.fromkeys(measures) if name in OF_EPISODES
        ]  # fmt: skip
    return problems


def _motion(scene: Scene, unknowns: GaitUnknowns, options: WalkSettings) -> Motion:
    """What walks are asked for. Raises InputError for walks that are too short: they are measured by whole drive
    periods, and a motion settles in some."""
    lowest = unknowns.changes(np.zeros((1, len(unknowns)))).get("gait.frequency")
    periods = (
        [wave.period or 0.0 for wave in scene.waves.values()]
        if lowest is None
        else [1.0 / float(lowest[0])]
    )
    slowest = max(periods, default=0.0)
    starts = options.starts if options.from_rest is None else None
    return motion_asked(slowest, starts, options.duration, options.from_rest)


def _of_energy(scene: Scene, objectives: Sequence[WalkObjective], limits: Sequence[WalkLimit]) -> list[str]:
    asked = {one.measure: one.name for one in objectives} | {one.measure: one.measure for one in limits}
    priced = {measure: name for measure, name in asked.items() if measure in (ENERGY, TRANSPORT)}
    if not priced:
        return []
    layout = scene.robot.layout()
    moving = [] if layout is None else [name for name, reach in layout.drives.items() if reach.legs]
    bare = [name for name in moving if scene.robot.drives[name].capacitance is None]
    names = " and ".join(priced.values())
    problems = [f"objective: {names} needs the capacitance of drive '{name}': set robot.drives.{name}.capacitance"
                for name in bare[:1]]  # fmt: skip
    if scene.ground.gravity is None and TRANSPORT in priced:
        problems.append("objective: transport needs gravity, for the weight that is carried")
    return problems
