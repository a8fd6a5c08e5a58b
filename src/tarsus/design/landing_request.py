"""What a landing design is asked for, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import Amount, MaybeAmount, float_paths, get_value, quantity
from tarsus.base.workers import Workers
from tarsus.design.grounds import Over
from tarsus.design.judge import NOMINAL, Risk
from tarsus.design.problems import Problems
from tarsus.design.pulse_train import SHORTEST, Pulses, PulseTrain, pulse_train
from tarsus.design.pulses import OwnStep, Step
from tarsus.design.request import OVER, SEED, Seed, Settings, bearing, setting
from tarsus.design.target import LandingObjective
from tarsus.model.robot import Drive
from tarsus.model.scene import Scene
from tarsus.plan.lowering import still_only

Floats = NDArray[np.float64]

MOST_PAIRS = 6
"""More pairs than this have more unknowns than a search of a minute can tell apart."""
KEPT = 0.8
"""Least share of the plain step's contact and lift that a design keeps unless another is given: a foot that never lifts
would land softest."""
KNOWN = 0.01
"""Share to either side of a frequency that states no interval: structures of one drawing differ by that, and so does
one from day to day; a landing that is soft for 0.2 % to either side is soft on no bench."""


class Sensor(Enum):
    """What a learner measures of each step. The value is a word for it."""

    SPEED = "speed"
    """A scalar: the design's measure, how hard the step's impact was."""
    CONTACT = "contact"
    """One bit: whether the contact has closed by the instant at which it is planned to."""


class LandingSettings(Settings):
    """What a landing is designed for beside the scene, see `tarsus.design.landing`."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "objective": ("objective", "risk", "contact", "lift", "ringing"),
        "search": ("effort", "seed"),
        "timer": ("tick", "shortest"),
        "learning": ("learn", "sensor"),
    }

    foot: str = setting(..., "name of the foot")
    drive: str | None = setting(None, "whose volts are designed; the only one unless given")
    pairs: Annotated[int, Field(ge=0, le=MOST_PAIRS)] = setting(
        2, "pairs of switchings at the step's two edges, at most"
    )
    levels: Any = setting(
        "free=-8V:8V",
        "any voltages between two, or listed ones as -8 V, 8 V, whatever the scene's own signal has; the lowest and "
        "the highest are held",
    )
    free: tuple[str, ...] = setting((), "paths of the switching times that alone may move, of an on-off signal")
    objective: LandingObjective = setting(LandingObjective.SPEED, "speed, impulse or touchdowns")
    over: Any = setting(None, f"{OVER}; the structure's frequencies within 1 % unless given")
    risk: Any = setting(None, "worst, mean, {cvar = q}, or nominal for the scene as it is")
    contact: Amount = quantity("1", "least share of the plain step's contact", default=KEPT, ge=0, le=1)
    lift: Amount = quantity("1", "least share of its mean height in the air", default=KEPT, ge=0, le=1)
    ringing: MaybeAmount = quantity(
        "1", "greatest overshoot after release over the mean gap in the air", default=None, ge=0
    )
    effort: Amount = quantity("1", "factor on the length of the search", default=1.0, gt=0)
    seed: Seed = setting(0, SEED)
    tick: Amount = quantity("s", "of the timer that edges are rounded to", default=1e-6, gt=0)
    shortest: Amount = quantity("s", "time that a level lasts at least", default=SHORTEST, gt=0)
    learn: Annotated[int, Field(ge=0)] = setting(0, "steps in which the landing is learned on hidden grounds")
    sensor: Sensor = setting(Sensor.SPEED, "what a learner measures: speed (a scalar) or contact (one bit)")


@dataclass(frozen=True)
class LandingRequest:
    """A scene, the foot, and everything that the search needs to know."""

    scene: Scene
    train: PulseTrain
    pairs: int
    over: Over | None
    risk: Risk
    options: LandingSettings
    threads: Workers = None

    @property
    def foot(self) -> str:
        """That lands."""
        return self.train.foot

    @property
    def drive(self) -> str:
        """Whose volts are designed."""
        return self.train.drive

    @property
    def step(self) -> Step:
        """What all signals of the design share."""
        return self.train.step

    @property
    def ticks(self) -> int:
        """Ticks in a period."""
        return self.train.ticks

    @property
    def actuator(self) -> Drive:
        return self.scene.robot.drives[self.drive]


def landing_request(scene: Scene, options: LandingSettings, threads: Workers = None) -> LandingRequest:
    """Check everything; raises InputError with every problem that can be told at once."""
    problems = Problems()
    problems.tried(lambda: still_only(scene, "feet land softly"))
    drive = problems.tried(lambda: _drive(scene, options.drive))
    over, risk = bearing(
        problems, scene, borne(scene, options), options.risk, lambda path: path.startswith(f"signals.{drive}.")
    )
    asked = Pulses(options.foot, options.pairs, options.levels, options.free, options.shortest, options.tick)
    train = None
    if drive is not None:
        train = problems.tried(lambda: pulse_train(scene, f"signals.{drive}", asked))
    if problems or train is None:
        raise InputError(problems)
    pairs = 1 if isinstance(train.step, OwnStep) else options.pairs
    return LandingRequest(scene, train, pairs, over, risk, options, threads)


def borne(scene: Scene, options: LandingSettings) -> Any:
    """What a design has to bear: what is asked for; or, unless the risk is nominal, the frequencies of the structure,
    each within its own interval, or within `KNOWN` where it states none."""
    empty = isinstance(options.over, Mapping) and not options.over  # a file's section without a number
    if not (options.over is None or empty) or options.risk in ("nominal", NOMINAL):
        return options.over
    paths = [path for path in float_paths(scene) if path.startswith("robot.structure.frequencies.")]
    values = {path: float(get_value(scene, path)) for path in paths}
    return {
        path: scene.interval(path) or ((1.0 - KNOWN) * value, (1.0 + KNOWN) * value)
        for path, value in values.items()
        if value > 0.0
    } or None


def _drive(scene: Scene, name: str | None) -> str:
    drives = list(scene.robot.drives)
    if name is not None:
        if name not in drives:
            raise InputError(f"drive: the robot has no drive '{name}'{nearest(name, drives)}")
        return name
    if len(drives) != 1:
        raise InputError(f"drive: the robot has {len(drives)} drives; name the one to be designed")
    return drives[0]
