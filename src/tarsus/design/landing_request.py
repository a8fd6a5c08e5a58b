"""What a landing design is asked for, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import Amount, MaybeAmount, float_paths, get_value, quantity, with_values
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.base.workers import Workers
from tarsus.design.grounds import Over
from tarsus.design.headers import in_ticks
from tarsus.design.judge import NOMINAL, Risk
from tarsus.design.pulses import Levels, OwnStep, Step
from tarsus.design.request import OVER, SEED, Problems, Seed, Settings, setting
from tarsus.design.target import LandingObjective
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Constant, OnOff
from tarsus.model.robot import Drive
from tarsus.model.scene import Scene
from tarsus.plan.lowering import still_only
from tarsus.solve import simulate_batch

Floats = NDArray[np.float64]

MOST_PAIRS = 6
"""More pairs than this have more unknowns than a search of a minute can tell apart."""
SHORTEST = 10e-6
"""Shortest plateau [s] unless another is given: what a microcontroller and its output stage switch without effort."""
KEPT = 0.8
"""Least share of the plain step's contact and lift that a design keeps unless another is given: a foot that never lifts
would land softest."""
KNOWN = 0.01
"""Share to either side of a frequency that states no interval: structures of one drawing differ by that, and so does
one from day to day; a landing that is soft for 0.2 % to either side is soft on no bench."""
HELD_PERIODS, LOOKED_AT = 16, 4
"""Periods for which the foot is held on a level, and the last ones that tell whether it stands: a mode of damping ratio
1 % has forgotten its start by then."""
LEAST_SUPPORTED, SAMPLES = 0.1, 4096
"""Least share of the period that the foot is to stand, or to be lifted, and times at which the scene's own signal is
asked for it: a shorter step has no room for plateaus of a quarter of a millisecond at 50 Hz."""
SWINGS = 1e-9
"""Share of the largest squared frequency above which a motion swings at all: rounding leaves 1e-15 of it."""
SLOWEST_SHARE = 0.25
"""A plateau lasts a quarter of the period at most, however slow the slowest mode is: one at each edge fills half."""


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
    free: tuple[str, ...] = setting(
        (), "paths of the switching times that alone may move, of an on-off signal"
    )
    objective: LandingObjective = setting(LandingObjective.SPEED, "speed, impulse or touchdowns")
    over: Any = setting(None, f"{OVER}; the structure's frequencies within 1 % unless given")
    risk: Any = setting(None, "worst, cvar:q, mean, or nominal for the scene as it is")
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
    foot: str
    drive: str
    pairs: int
    step: Step
    over: Over | None
    risk: Risk
    options: LandingSettings
    threads: Workers = None

    @property
    def ticks(self) -> int:
        """Ticks in a period."""
        return in_ticks(self.step.period, self.options.tick)

    @property
    def actuator(self) -> Drive:
        return self.scene.robot.drives[self.drive]


def landing_request(scene: Scene, options: LandingSettings, threads: Workers = None) -> LandingRequest:
    """Check everything; raises InputError with every problem that can be told at once."""
    problems, foot = Problems(), options.foot
    problems.tried(lambda: still_only(scene, "feet land softly"))
    if foot not in scene.robot.feet:
        problems.append(f"foot: the robot has no foot '{foot}'{nearest(foot, scene.robot.feet)}")
    drive = problems.tried(lambda: _drive(scene, options.drive))
    actuator = None if drive is None else scene.robot.drives[drive]
    levels = problems.tried(lambda: levels_of(options.levels, actuator))
    over, risk = problems.bearing(
        scene, borne(scene, options), options.risk, lambda path: path.startswith(f"signals.{drive}.")
    )
    period, moving = None, None
    if drive is not None:
        period = problems.tried(lambda: _period(scene, drive))
        moving = problems.tried(lambda: _moving(scene, drive, options.free)) if options.free else None
    if period is not None:
        problems.tried(lambda: in_ticks(period, options.tick))
    if problems or drive is None or levels is None or period is None:
        raise InputError(problems)
    support, lift = _held(scene, foot, drive, levels, period)
    supported = _supported(scene, drive, period, support, lift)
    room = 0.5 * min(supported, period - supported)
    if 2 * options.pairs * options.shortest > room:
        shown, most = (format_quantity(float(f"{one:.4g}"), "s") for one in (options.shortest, room))
        raise InputError(
            f"shortest: {2 * options.pairs} plateaus of {shown} do not fit into the {most} that an edge has, half of "
            "the time to the next one"
        )
    longest = max(min(_slowest(scene), SLOWEST_SHARE * period), 2.0 * options.shortest)
    shared = (period, support, lift, supported, options.shortest, longest, levels)
    own = scene.waveforms[drive]
    step, pairs = Step(*shared), options.pairs
    if moving and isinstance(own, OnOff):
        step, pairs = OwnStep(*shared, own, moving), 1
    return LandingRequest(scene, foot, drive, pairs, step, over, risk, options, threads)


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
        for path, value in values.items() if value > 0.0
    } or None  # fmt: skip


def levels_of(given: Any, drive: Drive | None) -> Levels:
    """Levels from ``"-8 V, 8 V"``, ``"free=-8V:8V"``, a sequence of voltages, or `Levels`.

    Raises InputError for fewer than two, and for levels beyond the amplifier's rails or beyond every voltage that the
    drive's law was made for.
    """
    if isinstance(given, Levels):
        found = given
    else:
        free = isinstance(given, str) and given.strip().startswith("free=")
        words: Sequence[Any] = given if not isinstance(given, str) else (
            given.strip().removeprefix("free=").split(":") if free else given.split(",")
        )  # fmt: skip
        try:
            volts = tuple(
                parse_quantity(word.strip() if isinstance(word, str) else float(word), "V") for word in words
            )
        except InputError as error:
            raise InputError([f"levels: {one}" for one in error.problems]) from None
        if free and len(volts) != 2:
            raise InputError(f"levels: free levels are free=low:high, such as free=-8V:8V, got '{given}'")
        found = Levels(tuple(sorted(set(volts))), free)
    if len(found.listed) < 2:
        raise InputError(f"levels: expected at least two different voltages, got {len(found.listed)}")
    if drive is not None:
        _check_levels(found, drive)
    return found


def _check_levels(levels: Levels, drive: Drive) -> None:
    if drive.amplifier.clip is not None:
        low, high = drive.amplifier.clip
        if levels.low < low or levels.high > high:
            raise InputError(
                f"levels: {levels.low:g} V to {levels.high:g} V go beyond the amplifier, which gives {low:g} V to "
                f"{high:g} V"
            )
    known = max((abs(volts) for volts in drive.history), default=0.0)
    if not isinstance(drive.law, LinearForce) and known > 0.0 and max(-levels.low, levels.high) > known:
        raise InputError(
            f"levels: {levels.low:g} V to {levels.high:g} V go beyond the drive's law, which is known up to the "
            f"{known:g} V that the drive has been taken to (its history): a fitted curve says nothing beyond"
        )


def _drive(scene: Scene, name: str | None) -> str:
    drives = list(scene.robot.drives)
    if name is not None:
        if name not in drives:
            raise InputError(f"drive: the robot has no drive '{name}'{nearest(name, drives)}")
        return name
    if len(drives) != 1:
        raise InputError(f"drive: the robot has {len(drives)} drives; name the one to be designed")
    return drives[0]


def _period(scene: Scene, drive: str) -> float:
    wave = scene.waveforms.get(drive)
    if wave is None or wave.period is None:
        raise InputError(
            f"signals.{drive}: the signal to be designed needs a period; give the scene a periodic one"
        )
    return wave.period


def _held(scene: Scene, foot: str, drive: str, levels: Levels, period: float) -> tuple[float, float]:
    """The held levels: on which of the two extreme ones the foot stands, and on which it is lifted.

    Raises InputError where it stands on neither, and so never lands.
    """
    held = np.array([levels.low, levels.high])
    still = with_values(scene, {"signals": {**scene.signals, drive: Constant(level=float(held[0]))}})
    batch = simulate_batch(still, {f"signals.{drive}.level": held}, HELD_PERIODS * period)
    number = list(scene.robot.feet).index(foot)
    found = batch.measured(("contact_duration", "mean_height"), period=period, skip=HELD_PERIODS - LOOKED_AT)
    contact, height = (np.asarray(one.per_foot)[:, number] for one in found.values())
    if not np.any(contact > 0.0):
        raise InputError(
            f"foot '{foot}' never lands: neither {held[0]:g} V nor {held[1]:g} V holds it on the ground; "
            "give wider levels or a smaller gap"
        )
    order = np.lexsort((-height, contact))
    return float(held[order[1]]), float(held[order[0]])


def _supported(scene: Scene, drive: str, period: float, support: float, lift: float) -> float:
    """Time [s] between landing and release edge: that which the scene's own signal spends nearer to the support level,
    kept between a tenth and nine tenths."""
    volts = scene.waveforms[drive].volts(np.linspace(period, 2.0 * period, SAMPLES, endpoint=False))
    nearer = np.abs(volts - support) < np.abs(volts - lift)
    return period * float(np.clip(np.round(np.mean(nearer), 3), LEAST_SUPPORTED, 1.0 - LEAST_SUPPORTED))


def _slowest(scene: Scene) -> float:
    """Period [s] of the slowest mode: a longer plateau is a hold, not a pulse."""
    matrices = scene.robot.structure.matrices()
    squares = np.linalg.eigvals(np.linalg.solve(matrices.mass, matrices.stiffness)).real
    swinging = squares[squares > SWINGS * max(float(squares.max(initial=0.0)), 1e-300)]
    return 2.0 * np.pi / float(np.sqrt(swinging.min())) if len(swinging) else np.inf


def _moving(scene: Scene, drive: str, paths: Sequence[str]) -> tuple[int, ...]:
    """Numbers of the plateaus whose durations are at these paths. Raises InputError for paths that are no switching
    times of the drive, and where nothing is left to give way."""
    head = f"signals.{drive}.durations."
    known = [path for path in float_paths(scene) if path.startswith(head)]
    repeats = isinstance(scene.waveforms.get(drive), OnOff)
    known_as = f"those are {known[0]} to {known[-1]}" if known and repeats else "its signal is not on-off"
    problems = [
        f"{path}: is no switching time of drive '{drive}': {known_as}" for path in paths
        if path not in known or not repeats
    ]  # fmt: skip
    if not problems and len(set(paths)) >= len(known):
        problems.append(f"free: one switching time of '{drive}' must stay, to keep the period")
    if problems:
        raise InputError(problems)
    return tuple(sorted({int(path.removeprefix(head)) for path in paths}))
