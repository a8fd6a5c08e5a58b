"""A synthetic campaign: the records that a laboratory would make of a device to identify it, and the truth behind
them.

The order is that of section 2.4 of the source: frequency responses in the air, slow voltage loops, ramped squares of
several lambda (adhesion, film), bounces, and signals that are kept for validation. A device whose foot has an
electrode is recorded close to the ground as well (section 3.4.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.base.spec import float_paths, with_values
from tarsus.model.drive.waveforms import RampedSquare, Sampled, Sine, Square, SweptSine, Waveform
from tarsus.model.scene import Scene
from tarsus.model.standing import rest_state
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.records.purpose import IN_AIR, Purpose
from tarsus.solve import simulate
from tarsus.solve.codes import ResultCode
from tarsus.synthesis.sweep_level import sweep_level

__all__ = [
    "Instrument",
    "Take",
    "identified_paths",
    "perturbed",
    "planned",
    "recordings",
    "rest_of",
]

Floats = NDArray[np.float64]

REST = 0.01
"""Time [s] a record lasts before the drive begins."""

REPEATS = 3
"""Times each record is taken: the fewest with a scatter and an odd one out."""
SWEEPS = 6
"""Sweeps: three each way."""
_LOOP_SHARE = 20
"""Part of the rate at which slow loops are recorded: they have no motion faster than their ringing."""
_TRIES = 200
"""Draws of a device before it is given up."""
_CLEARANCE = 0.1
"""Share of the neutral distance that the poled foot must be above the ground for the device to be used."""


@dataclass(frozen=True)
class Instrument:
    """A vibrometer with velocity and displacement outputs and the volts beside it.

    rate [Hz]; snr_db: noise of each channel below the root mean square of its own motion; displacement: whether there
    are displacement outputs; wander [m]: standard deviation of the zero of the displacement from record to record.
    """

    rate: float = 20e3
    snr_db: float = 40.0
    displacement: bool = True
    wander: float = 1e-6


@dataclass(frozen=True)
class Take:
    """One experiment: what is driven, how far the ground is at the neutral position [m] (None as in the device), for
    how long [s], at what share of the rate it is recorded, and how often it is repeated; air: name of the take with
    the same drive in the air."""

    name: str
    purpose: Purpose
    signal: Waveform
    duration: float
    gap: float | None = None
    repeats: int = REPEATS
    share: int = 1
    air: str | None = None
    before: tuple[float, ...] = ()


def rest_of(take: Take) -> float:
    """Time [s] that a record lasts before the drive begins: none for sweeps, more for slow records."""
    return {Purpose.MODAL: 0.0, Purpose.LOOPS: 10.0 * REST}.get(take.purpose, REST)


def perturbed(scene: Scene, spread: float, seed: int, fixed: tuple[str, ...] = ()) -> Scene:
    """A device like another, every number that a campaign identifies multiplied by 1 - spread to 1 + spread.

    Parameters
    ----------
    scene
        The device; its geometry, masses, gaps and signals stay.
    spread
        From 0 to below 1.
    seed
        Of the draw.
    fixed
        Paths that stay as well.

    Raises
    ------
    InputError
        For a spread outside 0 to 1, or when no draw of many gives a device whose poled foot is clear of the ground.
    """
    if not 0.0 <= spread < 1.0:
        raise InputError(f"expected a perturbation from 0 to below 1, got {spread:g}")
    paths = [path for path in identified_paths(scene) if path not in fixed]
    before = float_paths(scene)
    random = np.random.default_rng([seed, 5])
    refused: list[str] = []
    for _ in range(_TRIES):
        factors = 1.0 + spread * random.uniform(-1.0, 1.0, len(paths))
        values = {path: before[path].value * float(f) for path, f in zip(paths, factors, strict=True)}
        if (e := "ground.restitution.coefficient") in values:
            values[e] = min(values[e], 0.95)
        try:
            drawn = with_values(scene, values)
            with_values(drawn, {"initial.displacement": rest_state(drawn)})
            if _rests_clear(drawn):
                return drawn
        except InputError as error:
            refused += error.problems
    why = f": {len(refused)} of {_TRIES} draws are refused, the first since {refused[0]}" if refused else ""
    raise InputError(
        f"no device within {spread:g} of '{scene.name}' rests clear of the ground after poling{why}"
    )


def identified_paths(scene: Scene) -> list[str]:
    """Paths of the numbers that a campaign identifies.

    The participation of the first coordinate stays: it is the unit of the drive's force.
    """
    kept: list[str] = []
    laws = ("restitution", "film", "adhesion", "electrostatic")
    wanted = (
        "robot.structure.frequencies.",
        "robot.structure.damping_ratios.",
        *(f"ground.{n}." for n in laws),
    )
    for path in float_paths(scene):
        parts = path.split(".")
        drive = parts[:2] == ["robot", "drives"] and len(parts) > 4
        if drive and parts[3:5] == ["load", "participation"] and parts[5] != "0":
            kept.append(path)
        if path.startswith(wanted) or (drive and parts[3] == "law" and parts[4] != "thresholds"):
            kept.append(path)
    return kept


def _rests_clear(scene: Scene) -> bool:
    x = np.array(rest_state(scene))
    row, feet = scene.robot.structure.row, scene.robot.feet.values()
    return all(foot.gap + foot.normal * float(row(foot.point) @ x) >= _CLEARANCE * foot.gap for foot in feet)


def recordings(
    scene: Scene, take: Take, instrument: Instrument, drive: str, seeds: Sequence[int]
) -> Iterator[Measurement]:
    """Records of an experiment that is repeated, each with the rest before it: of one motion, for the device does the
    same every time, with the instrument's noise of each seed.

    Displacements are relative to the rest before the drive begins, but for the wander of their zero.

    Raises
    ------
    InputError
        If the simulation does not reach its end.
    """
    rate = instrument.rate / take.share
    times = np.arange(int(np.floor(take.duration * rate * (1.0 + 1e-12)))) / rate
    motion = _motion(_placed(scene, take, drive), take, times)
    volts = np.concatenate([np.zeros(round(rest_of(take) * rate)), take.signal.volts(times)])
    for seed in seeds:
        yield _record(motion, volts, take, instrument, f"{drive} volts", seed)


@dataclass(frozen=True)
class _Motion:
    """How points move (np, nt): from the rest before the drive [m], and their velocity [m/s]."""

    points: tuple[str, ...]
    moved: Floats
    speed: Floats


def _motion(placed: Scene, take: Take, times: Floats) -> _Motion:
    run = simulate(placed, take.duration)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"'{take.name}' cannot be recorded: {run.ended}")
    structure = placed.robot.structure
    feet = (foot.point for foot in placed.robot.feet.values())
    points = tuple(dict.fromkeys((*feet, *structure.points)))
    rows = np.array([structure.row(name) for name in points])
    states = run.states(times)
    return _Motion(
        points, rows @ (states.x - np.array(placed.initial.displacement)[:, None]), rows @ states.v
    )


def _record(
    motion: _Motion, volts: Floats, take: Take, instrument: Instrument, driven: str, seed: int
) -> Measurement:
    random = np.random.default_rng([seed, 17])
    rate = instrument.rate / take.share
    rest = len(volts) - motion.moved.shape[1]
    channels, signals = list[Channel](), list[Floats]()
    for name, speed in zip(motion.points, motion.speed, strict=True):
        channels.append(Channel(f"{name} velocity", Quantity.VELOCITY, point=name))
        signals.append(_noisy(speed, rest, instrument.snr_db, 0.0, random))
    if instrument.displacement and take.purpose is not Purpose.MODAL:
        for name, moved in zip(motion.points, motion.moved, strict=True):
            channels.append(Channel(f"{name} displacement", Quantity.DISPLACEMENT, point=name))
            zero = instrument.wander * float(random.standard_normal())
            signals.append(_noisy(moved, rest, instrument.snr_db, zero, random))
    channels.append(Channel(driven, Quantity.VOLTAGE))
    signals.append(_rounded(volts, 20.0 / 2**16))
    return Measurement(
        tuple(channels), np.array(signals), 1.0 / rate, start=-rest / rate, source=take.name, drive=driven
    )


def planned(scene: Scene, rate: float, drive: str) -> list[Take]:
    """The experiments of a campaign on a device with hysteresis and adhesion, as in sections 2.3 to 2.5 of the
    source.

    Parameters
    ----------
    scene
        The device. As a laboratory would, it is tried first, to find drives that make it bounce.
    rate
        Samples per second of the vibrometer [Hz].
    drive
        Name of the drive.
    """
    if any(foot.electrode is not None for foot in scene.robot.feet.values()):
        return _robot_plan(scene, rate, drive)
    takes = _sweeps(scene, rate, drive)
    takes.append(
        Take(
            "loops", Purpose.LOOPS, _staircase((-8.0, 8.0, -6.0, 6.0, -4.0, 4.0, 0.0)), 3.0, share=_LOOP_SHARE
        )
    )
    for hz, duty, periods in RAMPS:
        wave = RampedSquare(amplitude=8.0, frequency=hz, duty=duty)
        takes.append(Take(f"ramps-{hz:g}hz-{100 * duty:g}", Purpose.RAMPS, wave, periods / hz))
    waves, seconds = _bouncing(scene, rate, drive, _squares())
    for wave in waves:
        level = f"{1000.0 * wave.amplitude:g}mv-{wave.frequency:g}hz"
        near, far = f"bounces-{level}", f"air-{level}"
        takes.append(Take(near, Purpose.BOUNCES, wave, seconds, air=far))
        takes.append(Take(far, Purpose.AIR, wave, seconds, gap=IN_AIR))
    for volts in (6.0, 8.0):
        for hz in (5.0, 15.0, 50.0, 100.0):
            for kind, wave in (("square", Square), ("sine", Sine)):
                signal = wave(amplitude=volts, frequency=hz)
                name = f"held-out-{kind}-{volts:g}v-{hz:g}hz"
                takes.append(
                    Take(name, Purpose.VALIDATION, signal, 6.0 / hz if hz > 5.0 else 3.0 / hz, repeats=1)
                )
    return takes


def _robot_plan(scene: Scene, rate: float, drive: str) -> list[Take]:
    """The experiments on a robot whose height can be set, as in section 3.4 of the source: in the air, close to the
    ground without contact, and bouncing."""
    signal = scene.signals[drive]
    top = float(np.max(signal.volts(np.linspace(0.0, 0.1, 2001))))
    takes = _robot_sweeps(scene, rate, top)
    takes.append(
        Take("loops", Purpose.LOOPS, _staircase((top, 0.0, top, 0.0)), 2.0, gap=IN_AIR, share=_LOOP_SHARE)
    )
    own = min(foot.gap for foot in scene.robot.feet.values())
    attracts = any(law is not None for law in (scene.ground.acting.film, scene.ground.acting.electrostatic))
    for share in CLOSE_GAPS if attracts else ():
        for hz in CLOSE_HZ:
            gap = float(np.round(share * own, 8))  # as a stage is set, to 10 nm
            wave = _clear(scene, drive, gap, hz, top)
            name = f"close-{1e6 * gap:.4g}um-{hz:g}hz".replace(".", "p")
            takes.append(Take(name, Purpose.CLOSE, wave, CLOSE_S, gap=gap))
    waves, seconds = _bouncing(scene, rate, drive, _robot_squares(signal, top))
    for number, wave in enumerate(waves):
        near, far = f"bounces-{number + 1}", f"air-{number + 1}"
        takes.append(Take(near, Purpose.BOUNCES, wave, seconds, air=far))
        takes.append(Take(far, Purpose.AIR, wave, seconds, gap=IN_AIR))
    for hz in (40.0, 90.0):
        for kind, wave in (("square", Square), ("sine", Sine)):
            held = wave(amplitude=0.5 * top, frequency=hz, offset=0.5 * top)
            takes.append(Take(f"held-out-{kind}-{hz:g}hz", Purpose.VALIDATION, held, 12.0 / hz, repeats=1))
    return takes


CLOSE_GAPS = (1.5, 2.5, 4.0)
"""Gaps of the records close to the ground, in gaps of the device."""

CLOSE_HZ = (60.0, 150.0)
"""Frequencies of the records close to the ground: the film grows with the speed, the attraction does not."""
CLOSE_S = 0.12
"""Their duration [s]: seven periods of the slower one."""


def _robot_sweeps(scene: Scene, rate: float, top: float) -> list[Take]:
    """Sweeps over all modes, long enough for the sharpest to be resolved and to ring down."""
    m = scene.robot.structure.matrices()
    squared, modes = eigh(m.stiffness, m.mass)
    omega = np.sqrt(squared)
    decay = 0.5 * np.einsum("ij,ik,kj->j", modes, m.damping, modes)
    low, high = 0.3 * omega.min() / (2.0 * np.pi), np.max(1.25 * omega + decay) / (2.0 * np.pi)
    share = max(int(0.45 * rate / high), 1)
    seconds, tail = max(5.0 * np.pi / decay.min(), _LEAST_SWEEP_S), 5.0 / decay.min()
    takes = []
    for number in range(4):
        length = float(np.round(seconds * (1.0 + 0.1 * number), 2))
        last = 2.0 * np.floor(0.5 * (low + high) * length) / length - low
        ends = (low, last) if number % 2 == 0 else (last, low)
        wave = SweptSine(
            amplitude=0.1 * top, start_frequency=ends[0], stop_frequency=ends[1], duration=length
        )
        whole = float(np.round(1.3 * seconds + tail, 2))
        takes.append(
            Take(f"sweep-{number + 1}", Purpose.MODAL, wave, whole, gap=IN_AIR, repeats=1, share=share)
        )
    return takes


_LEAST_SWEEP_S = 4.0
"""Strongly damped modes need no time to be resolved, but lines enough to average the noise over."""


def _clear(scene: Scene, drive: str, gap: float, hz: float, top: float) -> Sine:
    """The strongest sine from 0 V up that keeps the foot clear of the ground by a fifth of its gap."""
    for volts in np.round(0.5 * top * np.arange(3.0, 0.05, -0.1), 3).tolist():
        wave = Sine(amplitude=volts, frequency=hz, offset=volts)
        run = simulate(_placed(scene, Take("", Purpose.CLOSE, wave, CLOSE_S, gap=gap), drive), CLOSE_S)
        if not len(run.events) and float(run.states(np.linspace(0.0, CLOSE_S, 4001)).gap.min()) > 0.2 * gap:
            return wave
    raise InputError(
        f"no drive at {hz:g} Hz keeps the foot clear of the ground at a gap of {1e6 * gap:.3g} um"
    )


def _robot_squares(signal: Waveform, top: float) -> list[list[Square]]:
    """Square waves from 0 V up, at the frequency of a robot's own drive and below it."""
    own = 1.0 / (signal.period or 1.0 / BOUNCE_HZ[0])
    return [
        [
            Square(amplitude=volts, frequency=hz, offset=volts)
            for volts in np.round(0.5 * top * np.arange(0.6, 3.01, 0.2), 3).tolist()
        ]
        for hz in (own, 0.4 * own, 0.15 * own)
    ]


RAMPS = (
    (5.0, 0.25, 3),
    (5.0, 0.5, 3),
    (5.0, 1.0, 3),
    (20.0, 0.5, 4),
    (20.0, 1.0, 4),
    (60.0, 1.0, 8),
    (100.0, 1.0, 10),
)
"""Ramped squares: frequency [Hz], lambda, periods."""

BOUNCE_HZ = (300.0, 200.0, 120.0)
"""Frequency of the bouncing experiment, section 2.4, and others to try."""

BOUNCE_S = (0.2, 1.0)
"""Its duration [s], and a longer one for devices that bounce seldom."""


def _sweeps(scene: Scene, rate: float, drive: str) -> list[Take]:
    """Sweeps up and down of different lengths, so that the harmonics of a drive that is not quite linear meet the
    modes at other times in each, and average out. Each ends where the sine is zero."""
    level, offset = sweep_level(scene.robot.drives[drive])
    before = (offset + 2.0 * level,) if offset else ()
    takes = []
    for number in range(SWEEPS):
        seconds = 1.0 + 0.1 * number
        low, high = 200.0, 0.45 * rate
        high = 2.0 * np.floor(0.5 * (low + high) * seconds) / seconds - low
        ends = (low, high) if number % 2 == 0 else (high, low)
        wave = SweptSine(
            amplitude=level, start_frequency=ends[0], stop_frequency=ends[1], duration=seconds, offset=offset
        )
        takes.append(
            Take(f"sweep-{number + 1}", Purpose.MODAL, wave, 1.8, gap=IN_AIR, repeats=1, before=before)
        )
    return takes


def _staircase(turns: tuple[float, ...], slope: float = 28.0) -> Sampled:
    """Straight ramps [V/s] from 0 V to each turning point in order."""
    levels = [0.0, *turns]
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(levels)) / slope)])
    return Sampled(times=tuple(times.tolist()), levels=tuple(levels))


def _bouncing(scene: Scene, rate: float, drive: str, tried: list[list[Square]]) -> tuple[list[Square], float]:
    """The two square waves whose bounces are told best, and for how long [s]: most of those with samples enough around.

    Of several sets of waves and durations, the first that has some.
    """
    found: list[tuple[int, Square]] = []
    seconds = 0.0
    for seconds in BOUNCE_S:
        found = []
        for waves in tried:
            for wave in waves:
                run = simulate(_placed(scene, Take("", Purpose.BOUNCES, wave, seconds), drive), seconds)
                found.append((_clear_bounces(run.events, wave, rate, seconds), wave))
            if _second(found) >= _ENOUGH:
                break
        if _second(found) >= _FEW:
            break
    return [wave for _, wave in sorted(found, key=lambda one: -one[0])[:2]], seconds


def _second(found: list[tuple[int, Square]]) -> int:
    """Bounces of the second best of some waves."""
    return sorted(count for count, _ in found)[-2]


def _squares() -> list[list[Square]]:
    """Square waves about 0 V, at the frequency of section 2.4 and below it."""
    volts = np.arange(0.5, 8.01, 0.25)
    return [[Square(amplitude=float(level), frequency=hz) for level in volts] for hz in BOUNCE_HZ]


def _clear_bounces(events: np.ndarray, wave: Square, rate: float, seconds: float) -> int:
    """Bounces with samples enough between them and the touches and jumps of the drive on both sides."""
    touch = events[events["kind"] != EventKind.RELEASE]
    jumps = 0.5 / wave.frequency * np.arange(round(2.0 * seconds * wave.frequency) + 1)
    ends = np.sort(np.concatenate([touch["time"], jumps]))
    bounces = touch["time"][touch["kind"] == EventKind.BOUNCE]
    place = np.searchsorted(ends, bounces)
    inside = (place > 0) & (place < len(ends) - 1)
    before = bounces[inside] - ends[place[inside] - 1]
    after = ends[place[inside] + 1] - bounces[inside]
    return int(np.count_nonzero(np.minimum(before, after) * rate > _APART))


_ENOUGH = 15
"""Bounces that a record should show."""
_FEW = 3
"""And those below which it is recorded for longer."""
_APART = 9.0
"""Samples between impacts that a bounce needs on both sides to be told well."""


def _placed(scene: Scene, take: Take, drive: str) -> Scene:
    """The scene of a take: its drive, its distance, begun at rest."""
    changes: dict[str, object] = {"signals": {drive: take.signal}, "initial.displacement": rest_state(scene)}
    if take.before:
        history = (*scene.robot.drives[drive].history, *take.before)
        changes |= {f"robot.drives.{drive}.history": history}
        settled = with_values(scene, {f"robot.drives.{drive}.history": history})
        changes |= {"initial.displacement": rest_state(settled, float(take.signal.volts(np.zeros(1))[0]))}
    if take.gap is not None:
        changes |= {f"robot.feet.{name}.gap": take.gap for name in scene.robot.feet}
    return with_values(scene, changes)


def _noisy(values: Floats, rest: int, decibels: float, zero: float, random: np.random.Generator) -> Floats:
    level = float(np.sqrt(np.mean(values**2))) * 10.0 ** (-decibels / 20.0)
    whole = np.concatenate([np.zeros(rest), values])
    return whole + zero + level * random.standard_normal(len(whole))


def _rounded(values: Floats, step: float) -> Floats:
    return np.round(values / step) * step
