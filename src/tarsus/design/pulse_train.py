"""Pulses of an on-off signal as what a design may change: which step they are about, and what a timer makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import float_paths, with_values
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.design.headers import in_ticks, neighbours
from tarsus.design.problems import Problems, listed
from tarsus.design.pulses import Family, Levels, OwnStep, Step, families
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Constant, OnOff
from tarsus.model.robot import Drive
from tarsus.model.scene import Scene
from tarsus.solve import simulate_batch

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHORTEST = 10e-6
"""Shortest plateau [s] unless another is given: what a microcontroller and its output stage switch without effort."""
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


FORGOTTEN, PERIODS = 1e-4, (4, 32)
"""What is left of the start of a run in the period that is judged, by the decay of the slowest mode: a unit of the four
digits shown; and of how many periods a run is, at least and at most."""


@dataclass(frozen=True)
class Pulses:
    """Switchings at the two edges of a step: a kind of what a design may change, of ``signals.DRIVE``.

    foot: that the step puts down; pairs: of switchings; levels: listed voltages, of which the lowest and the highest
    are held, or any between two, as ``{"from": "-8 V", "to": "8 V"}``; moving: paths of the switching times that alone
    may move, of a signal that is on-off already; shortest [s]: plateau; tick [s]: of the timer.
    """

    foot: str
    pairs: int = 2
    levels: Any = field(default_factory=lambda: {"from": "-8 V", "to": "8 V"})
    moving: tuple[str, ...] = ()
    shortest: float = SHORTEST
    tick: float = 1e-6


def pulses_of(table: Mapping[str, Any]) -> Pulses:
    """Pulses from a table of a file; raises InputError for words that it does not know."""
    known = [one.name for one in fields(Pulses)]
    problems = [f"{name}: is no setting of pulses{nearest(name, known)}" for name in table if name not in known]
    if problems:
        raise InputError(problems)
    found = dict(table)
    for name in ("shortest", "tick"):
        if isinstance(found.get(name), str):
            found[name] = parse_quantity(found[name], "s")
    return Pulses(**found)


@dataclass(frozen=True)
class PulseTrain:
    """Signals of a drive with pulses. step: that they are about; families: sequences of plateaus; ticks: of a timer in
    a period."""

    drive: str
    foot: str
    step: Step
    pairs: int
    families: tuple[Family, ...]
    ticks: int

    @property
    def unknowns(self) -> int:
        """Numbers that place a signal of one family."""
        return self.step.unknowns(self.pairs)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the unknowns."""
        return tuple(f"{self.drive} pulse {i + 1}" for i in range(self.unknowns))

    @property
    def paths(self) -> tuple[str, ...]:
        """Of the levels, then of the durations, of a signal's plateaus."""
        count = self.plain().shape[1] // 2
        return tuple(f"signals.{self.drive}.{name}.{i}" for name in ("levels", "durations") for i in range(count))

    def place(self, number: Ints, cube: Floats) -> Floats:
        """Signals (n, 2S) of points (n, nu) of the unit cube, each of a family of its own."""
        return self.step.place(self.families, number, cube)

    def plain(self) -> Floats:
        """The step without pulses, as a signal (1, 2S): the lift level is held in as many parts as pulses have
        plateaus."""
        if isinstance(self.step, OwnStep):
            return self.step.plain()
        levels, durations = np.split(self.step.plain(), 2, axis=1)
        parts = np.array([1, 2 * self.pairs + 1])
        return np.concatenate([np.repeat(levels, parts, axis=1), np.repeat(durations / parts, parts, axis=1)], axis=1)

    def settling(self, scene: Scene) -> int:
        """Periods of a run whose last one has forgotten how the run began."""
        parts = scene.robot.structure.matrices()
        rates = -np.linalg.solve(parts.mass, np.hstack([parts.stiffness, parts.damping]))
        size = len(parts.mass)
        decay = -float(np.linalg.eigvals(np.vstack([np.eye(size, 2 * size, size), rates])).real.max())
        wanted = 1.0 - np.log(FORGOTTEN) / max(decay * self.step.period, 1e-9)
        return int(np.clip(np.ceil(wanted), *PERIODS))

    def carried_by(self, scene: Scene) -> Scene:
        """A scene with a signal of so many plateaus."""
        plain = self.step.waveform(self.plain()[0])
        return with_values(scene, {"signals": {**scene.signals, self.drive: plain}})

    def rounded(self, signal: Floats, rng: np.random.Generator) -> Floats:
        """Signals (n, 2S) in whole ticks and whole millivolts about one (2S,)."""
        levels, durations = np.split(signal, 2)
        ticks = neighbours(durations, self.ticks, rng)
        spans = np.asarray(ticks * (self.step.period / self.ticks), dtype=np.float64)
        return np.concatenate([np.tile(np.round(levels, 3), (len(ticks), 1)), spans], axis=1)


def pulse_train(scene: Scene, path: str, asked: Pulses) -> PulseTrain:
    """The signals that pulses of ``signals.DRIVE`` make; raises InputError with every problem that can be found at
    once."""
    problems, foot, drive = Problems(), asked.foot, path.removeprefix("signals.")
    if foot not in scene.robot.feet:
        problems.append(f"foot: the robot has no foot '{foot}'{nearest(foot, scene.robot.feet)}")
    known = drive in scene.robot.drives and path != drive
    if not known:
        drives = [f"signals.{name}" for name in scene.robot.drives]
        problems.append(f"{path}: pulses are of the signal of a drive{nearest(path, drives)}")
    levels = problems.tried(lambda: levels_of(asked.levels, scene.robot.drives.get(drive)))
    period = problems.tried(lambda: _period(scene, drive)) if known else None
    moving, ticks = None, 0
    if period is not None:
        ticks = problems.tried(lambda: in_ticks(period, asked.tick))
        moving = problems.tried(lambda: _moving(scene, drive, asked.moving)) if asked.moving else ()
    if problems or levels is None or period is None or moving is None or ticks is None:
        raise InputError(problems)
    support, lift = _held(scene, foot, drive, levels, period)
    supported = _supported(scene, drive, period, support, lift)
    room = 0.5 * min(supported, period - supported)
    if 2 * asked.pairs * asked.shortest > room:
        shown, most = (format_quantity(float(f"{one:.4g}"), "s") for one in (asked.shortest, room))
        raise InputError(
            f"shortest: {2 * asked.pairs} plateaus of {shown} do not fit into the {most} that an edge has, half of "
            "the time to the next one"
        )
    longest = max(min(_slowest(scene), SLOWEST_SHARE * period), 2.0 * asked.shortest)
    shared = (period, support, lift, supported, asked.shortest, longest, levels)
    own = scene.waveforms[drive]
    step: Step = OwnStep(*shared, own, moving) if moving and isinstance(own, OnOff) else Step(*shared)
    return PulseTrain(drive, foot, step, asked.pairs, tuple(families(step, asked.pairs)), ticks)


def levels_of(given: Any, drive: Drive | None) -> Levels:
    """Levels from ``{"from": low, "to": high}`` or ``"free=-8V:8V"``, any between; from a sequence of voltages or
    ``"-8 V, 8 V"``, these alone; or `Levels`.

    Raises InputError for fewer than two, and for levels beyond the amplifier's rails or beyond every voltage that the
    drive's law was made for.
    """
    if isinstance(given, Mapping):
        if set(given) != {"from", "to"}:
            raise InputError(f"levels: expected {{from = low, to = high}}, got {given}")
        given = f"free={given['from']}:{given['to']}"
    if isinstance(given, Levels):
        found = given
    else:
        free = isinstance(given, str) and given.strip().startswith("free=")
        words = listed(given.strip().removeprefix("free=").replace(":", ",") if free else given)
        try:
            volts = tuple(parse_quantity(word if isinstance(word, str) else float(word), "V") for word in words)
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


def _period(scene: Scene, drive: str) -> float:
    wave = scene.waveforms.get(drive)
    if wave is None or wave.period is None:
        raise InputError(f"signals.{drive}: the signal to be designed needs a period; give the scene a periodic one")
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
        f"{path}: is no switching time of drive '{drive}': {known_as}"
        for path in paths
        if path not in known or not repeats
    ]
    if not problems and len(set(paths)) >= len(known):
        problems.append(f"free: one switching time of '{drive}' must stay, to keep the period")
    if problems:
        raise InputError(problems)
    return tuple(sorted({int(path.removeprefix(head)) for path in paths}))
