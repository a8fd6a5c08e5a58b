"""What a landing design is asked for, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import float_paths, with_values
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.base.workers import Workers
from tarsus.design.over import Over, over_of
from tarsus.design.pulses import Levels, OwnStep, Step
from tarsus.design.risk import Nominal, Risk, Worst, risk_of
from tarsus.design.target import Objective
from tarsus.design.timer import in_ticks
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Constant, OnOff
from tarsus.model.robot import Drive
from tarsus.model.scene import Scene
from tarsus.solve.batch import simulate_batch

__all__ = ["Options", "Request", "Sensor", "levels_of", "members", "request_of"]

Floats = NDArray[np.float64]

MOST_PAIRS = 6
"""More pairs than this have more unknowns than a search of a minute can tell apart."""
SHORTEST = 10e-6
"""Shortest plateau [s] unless another is given: what a microcontroller and its output stage switch without effort."""


class Sensor(Enum):
    """What a learner is told of each step. The value is a word for it."""

    SPEED = "speed"
    """A scalar: the design's measure, how hard the step struck."""
    CONTACT = "contact"
    """One bit: whether the contact has closed by the instant at which it is planned to."""


WORDED: dict[str, type[Objective] | type[Sensor]] = {"objective": Objective, "sensor": Sensor}
"""Options that are told by a word."""


def members(given: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """What is meant by each of some `WORDED` options by name, given as itself or by its word; prefix: of their names in
    complaints. Raises InputError for other words."""
    problems, found = [], {}
    for name, one in given.items():
        kind = WORDED[name]
        words = [member.value for member in kind]
        if isinstance(one, kind) or one in words:
            found[name] = kind(one)
        else:
            problems.append(f"{prefix}{name}: expected {', '.join(words[:-1])} or {words[-1]}, got '{one}'")
    if problems:
        raise InputError(problems)
    return found


@dataclass(frozen=True)
class Options:
    """objective: what is minimised; drive: whose volts are designed, the only one when absent; tick [s] of the timer;
    shortest [s] of a plateau; ringing: greatest overshoot after release, as a share of the mean gap in the air;
    contact, lift: least shares of the plain step's that the design keeps; sensor: what a learner is told; free:
    paths of the switching times that alone may move, of a scene whose signal is on-off already; seed;
    threads; effort: factor on the length of the search."""

    objective: Objective = Objective.SPEED
    drive: str | None = None
    tick: float = 1e-6
    shortest: float = SHORTEST
    ringing: float | None = None
    contact: float = 0.8
    lift: float = 0.8
    sensor: Sensor = Sensor.SPEED
    free: tuple[str, ...] = ()
    seed: int = 0
    threads: Workers = None
    effort: float = 1.0

    def __post_init__(self) -> None:
        """Words for an objective or a sensor stand for it. Raises InputError for others."""
        for name, meant in members({name: getattr(self, name) for name in WORDED}).items():
            object.__setattr__(self, name, meant)


@dataclass(frozen=True)
class Request:
    """A scene, the foot, and everything that the search needs to know."""

    scene: Scene
    foot: str
    drive: str
    pairs: int
    step: Step
    over: Over | None
    risk: Risk
    options: Options

    @property
    def ticks(self) -> int:
        """Ticks in a period."""
        return in_ticks(self.step.period, self.options.tick)

    @property
    def actuator(self) -> Drive:
        return self.scene.robot.drives[self.drive]


def request_of(
    scene: Scene, foot: str, pairs: int, levels: Any, over: Any, risk: str | Risk | None, options: Options
) -> Request:
    """Check everything; raises InputError with every problem that can be told at once."""
    problems: list[str] = []

    def tried(made: Any) -> Any:
        try:
            return made()
        except InputError as error:
            problems.extend(error.problems)
            return None

    if foot not in scene.robot.feet:
        problems.append(f"foot: the robot has no foot '{foot}'{nearest(foot, scene.robot.feet)}")
    drive = tried(lambda: _drive(scene, options.drive))
    plateaus = tried(lambda: levels_of(levels, None if drive is None else scene.robot.drives[drive]))
    grounds = tried(lambda: over_of(scene, over))
    if grounds is not None and drive is not None:
        problems += [
            f"{path}: is designed, so it cannot be part of the ground" for path in grounds.paths
            if path.startswith(f"signals.{drive}.")
        ]  # fmt: skip
    chosen = tried(lambda: risk_of(risk)) if risk is not None else (Nominal() if grounds is None else Worst())
    if grounds is None and isinstance(chosen, Risk) and not isinstance(chosen, Nominal):
        problems.append(f"risk: '{chosen.name}' needs grounds to be judged on: give --over PATH=a:b")
    if not (isinstance(pairs, int) and 0 <= pairs <= MOST_PAIRS):
        problems.append(f"pairs: expected a whole number from 0 to {MOST_PAIRS}, got {pairs}")
    problems += _out_of_range(options)
    period = None if drive is None else tried(lambda: _period(scene, drive))
    moving = None
    if drive is not None and options.free:
        moving = tried(lambda: _moving(scene, drive, options.free))
    if period is not None:
        tried(lambda: in_ticks(period, options.tick))
    if problems or drive is None or plateaus is None or period is None or chosen is None:
        raise InputError(problems)
    support, lift = _held(scene, foot, drive, plateaus, period)
    supported = _supported(scene, drive, period, support, lift)
    room = 0.5 * min(supported, period - supported)
    if 2 * pairs * options.shortest > room:
        told, most = (format_quantity(float(f"{one:.4g}"), "s") for one in (options.shortest, room))
        raise InputError(
            f"shortest: {2 * pairs} plateaus of {told} do not fit into the {most} that an edge has, half of the time "
            "to the next one"
        )
    shared = (
        period, support, lift, supported, options.shortest,
        max(min(_slowest(scene), 0.25 * period), 2.0 * options.shortest), plateaus,
    )  # fmt: skip
    own = scene.waveforms[drive]
    if moving and isinstance(own, OnOff):
        return Request(scene, foot, drive, 1, OwnStep(*shared, own, moving), grounds, chosen, options)
    return Request(scene, foot, drive, pairs, Step(*shared), grounds, chosen, options)


def _out_of_range(options: Options) -> list[str]:
    """What is wrong with the numbers among the options."""
    found = [
        f"{name}: expected a share from 0 to 1, got {share:g}"
        for name, share in (("contact", options.contact), ("lift", options.lift))
        if not 0.0 <= share <= 1.0
    ]
    if not options.shortest > 0.0:
        found.append(f"shortest: expected a time above 0 s, got {options.shortest:g} s")
    if not options.effort > 0.0:
        found.append(f"effort: expected a factor above 0, got {options.effort:g}")
    if options.ringing is not None and not options.ringing >= 0.0:
        found.append(f"ringing: expected an overshoot of 0 or more, got {options.ringing:g}")
    if options.seed < 0:
        found.append(f"seed: expected 0 or more, got {options.seed}")
    return found


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
        raise InputError(
            f"drive: the robot has {len(drives)} drives; name the one to be designed, such as --drive NAME"
        )
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
    periods = 16
    batch = simulate_batch(still, {f"signals.{drive}.level": held}, periods * period)
    number = list(scene.robot.feet).index(foot)
    found = batch.measured(("contact_duration", "mean_height"), period=period, skip=periods - 4)
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
    volts = scene.waveforms[drive].volts(np.linspace(period, 2.0 * period, 4096, endpoint=False))
    nearer = np.abs(volts - support) < np.abs(volts - lift)
    return period * float(np.clip(np.round(np.mean(nearer), 3), 0.1, 0.9))


def _slowest(scene: Scene) -> float:
    """Period [s] of the slowest mode: a longer plateau is a hold, not a pulse."""
    matrices = scene.robot.structure.matrices()
    squares = np.linalg.eigvals(np.linalg.solve(matrices.mass, matrices.stiffness)).real
    swinging = squares[squares > 1e-9 * max(float(squares.max(initial=0.0)), 1e-300)]
    return 2.0 * np.pi / float(np.sqrt(swinging.min())) if len(swinging) else np.inf


def _moving(scene: Scene, drive: str, paths: Sequence[str]) -> tuple[int, ...]:
    """Numbers of the plateaus whose durations are at these paths. Raises InputError for paths that are no switching
    times of the drive, and where nothing is left to give way."""
    head = f"signals.{drive}.durations."
    known = [path for path in float_paths(scene) if path.startswith(head)]
    repeats = isinstance(scene.waveforms.get(drive), OnOff)
    told = f"those are {known[0]} to {known[-1]}" if known and repeats else "its signal is not on-off"
    problems = [
        f"{path}: is no switching time of drive '{drive}': {told}" for path in paths
        if path not in known or not repeats
    ]  # fmt: skip
    if not problems and len(set(paths)) >= len(known):
        problems.append(f"free: one switching time of '{drive}' must stay, to keep the period")
    if problems:
        raise InputError(problems)
    return tuple(sorted({int(path.removeprefix(head)) for path in paths}))
