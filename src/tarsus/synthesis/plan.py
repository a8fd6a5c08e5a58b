"""The recordings of a campaign.

The order is that of section 2.4 of the source: frequency responses in the air, slow voltage loops, ramped squares of
several lambda (adhesion, film), bounces, and signals that are kept for validation. A device whose foot has an
electrode is recorded close to the ground as well (section 3.4.3)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.model.drive.waveforms import RampedSquare, Sampled, Sine, Square, SweptSine, Waveform
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.records.purpose import IN_AIR, Purpose
from tarsus.solve import simulate
from tarsus.synthesis.recordings import Recording, placed
from tarsus.synthesis.sweep_level import sweep_level
from tarsus.synthesis.walks import planned_walks

SWEEPS = 6
"""Sweeps: three each way."""
_LOOP_SHARE = 20
"""Part of the rate at which slow loops are recorded: they have no motion faster than their ringing."""
CLOSE_GAPS = (1.5, 2.5, 4.0)
"""Gaps of the records close to the ground, in gaps of the device."""
CLOSE_HZ = (60.0, 150.0)
"""Frequencies of the records close to the ground: the film grows with the speed, the attraction does not."""
CLOSE_S = 0.12
"""Their duration [s]: seven periods of the slower one."""
_LEAST_SWEEP_S = 4.0
"""Strongly damped modes need no time to be resolved, but lines enough to average the noise over."""
RAMPS = ((5.0, 0.25, 3), (5.0, 0.5, 3), (5.0, 1.0, 3), (20.0, 0.5, 4), (20.0, 1.0, 4), (60.0, 1.0, 8), (100.0, 1.0, 10))
"""Ramped squares: frequency [Hz], lambda, periods."""
BOUNCE_HZ = (300.0, 200.0, 120.0)
"""Frequency of the bouncing experiment, section 2.4, and others to try."""
BOUNCE_S = (0.2, 1.0)
"""Its duration [s], and a longer one for devices that bounce seldom."""
_ENOUGH = 15
"""Bounces that a record should show."""
_SETS = 4
"""Sets of bounces at most."""
_FEW = 3
"""And those below which it is recorded for longer."""
_APART = 9.0
"""Samples between impacts that a bounce needs on both sides to be measured well."""


def planned(scene: Scene, rate: float, drive: str) -> list[Recording]:
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
    if isinstance(scene.robot.structure, Walker):
        return planned_walks(scene)
    recordings = in_air(scene, rate, drive)
    if _is_robot(scene):
        return recordings + _robot_plan(scene, rate, drive)
    for hz, duty, periods in RAMPS:
        wave = RampedSquare(amplitude=8.0, frequency=hz, duty=duty)
        recordings.append(Recording(f"ramps-{hz:g}hz-{100 * duty:g}", Purpose.RAMPS, wave, periods / hz))
    waves, seconds = _bouncing(scene, rate, drive, _squares())
    for wave in waves:
        level = f"{1000.0 * wave.amplitude:g}mv-{wave.frequency:g}hz"
        near, far = f"bounces-{level}", f"air-{level}"
        recordings.append(Recording(near, Purpose.BOUNCES, wave, seconds, air=far))
        recordings.append(Recording(far, Purpose.AIR, wave, seconds, gap=IN_AIR))
    recordings += _again(recordings)
    for volts in (6.0, 8.0):
        for hz in (5.0, 15.0, 50.0, 100.0):
            for kind, wave in (("square", Square), ("sine", Sine)):
                signal = wave(amplitude=volts, frequency=hz)
                name = f"held-out-{kind}-{volts:g}v-{hz:g}hz"
                recordings.append(
                    Recording(name, Purpose.VALIDATION, signal, 6.0 / hz if hz > 5.0 else 3.0 / hz, repeats=1)
                )
    return recordings


def _again(recordings: list[Recording]) -> list[Recording]:
    """The first set of each purpose once more, at the end of the session: what moves slowly through it is seen between
    the two."""
    firsts = {one.purpose: one for one in reversed(recordings)}.values()
    names = {one.name: f"{one.name}-again" for one in firsts}
    kept = sorted(firsts, key=recordings.index)
    return [replace(one, name=names[one.name], air=names.get(one.air or "")) for one in kept]


def in_air(scene: Scene, rate: float, drive: str) -> list[Recording]:
    """Sweeps and slow loops that no ground disturbs."""
    if not _is_robot(scene):
        turns = _staircase((-8.0, 8.0, -6.0, 6.0, -4.0, 4.0, 0.0))
        loops = Recording("loops", Purpose.LOOPS, turns, 3.0, share=_LOOP_SHARE)
        return [*_sweeps(scene, rate, drive), loops]
    top = _top(scene, drive)
    loops = Recording("loops", Purpose.LOOPS, _staircase((top, 0.0, top, 0.0)), 2.0, gap=IN_AIR, share=_LOOP_SHARE)
    return [*_robot_sweeps(scene, rate, top), loops]


def _is_robot(scene: Scene) -> bool:
    """Whether the height of a device can be set: its feet have electrodes then."""
    return any(foot.electrode is not None for foot in scene.robot.feet.values())


def _top(scene: Scene, drive: str) -> float:
    """Highest volts of a device's own signal."""
    return float(np.max(scene.signals[drive].volts(np.linspace(0.0, 0.1, 2001))))


def _robot_plan(scene: Scene, rate: float, drive: str) -> list[Recording]:
    """The experiments on a robot whose height can be set, as in section 3.4 of the source, on the ground: close to it
    without contact, and bouncing."""
    signal, top = scene.signals[drive], _top(scene, drive)
    recordings: list[Recording] = []
    own = min(foot.gap for foot in scene.robot.feet.values())
    attracts = any(law is not None for law in (scene.ground.acting.film, scene.ground.acting.electrostatic))
    for share in CLOSE_GAPS if attracts else ():
        for hz in CLOSE_HZ:
            gap = float(np.round(share * own, 8))  # as a stage is set, to 10 nm
            wave = _clear(scene, drive, gap, hz, top)
            name = f"close-{1e6 * gap:.4g}um-{hz:g}hz".replace(".", "p")
            recordings.append(Recording(name, Purpose.CLOSE, wave, CLOSE_S, gap=gap))
    waves, seconds = _bouncing(scene, rate, drive, _robot_squares(signal, top))
    for number, wave in enumerate(waves):
        near, far = f"bounces-{number + 1}", f"air-{number + 1}"
        recordings.append(Recording(near, Purpose.BOUNCES, wave, seconds, air=far))
        recordings.append(Recording(far, Purpose.AIR, wave, seconds, gap=IN_AIR))
    recordings += _again(recordings)
    for hz in (40.0, 90.0):
        for kind, wave in (("square", Square), ("sine", Sine)):
            held = wave(amplitude=0.5 * top, frequency=hz, offset=0.5 * top)
            recordings.append(Recording(f"held-out-{kind}-{hz:g}hz", Purpose.VALIDATION, held, 12.0 / hz, repeats=1))
    return recordings


def _robot_sweeps(scene: Scene, rate: float, top: float) -> list[Recording]:
    """Sweeps over all modes, long enough for the sharpest to be resolved and to ring down."""
    m = scene.robot.structure.matrices()
    squared, modes = eigh(m.stiffness, m.mass)
    omega = np.sqrt(squared)
    decay = 0.5 * np.einsum("ij,ik,kj->j", modes, m.damping, modes)
    low, high = 0.3 * omega.min() / (2.0 * np.pi), np.max(1.25 * omega + decay) / (2.0 * np.pi)
    share = max(int(0.45 * rate / high), 1)
    seconds, tail = max(5.0 * np.pi / decay.min(), _LEAST_SWEEP_S), 5.0 / decay.min()
    recordings = []
    for number in range(4):
        length = float(np.round(seconds * (1.0 + 0.1 * number), 2))
        last = 2.0 * np.floor(0.5 * (low + high) * length) / length - low
        ends = (low, last) if number % 2 == 0 else (last, low)
        wave = SweptSine(amplitude=0.1 * top, start_frequency=ends[0], stop_frequency=ends[1], duration=length)
        whole = float(np.round(1.3 * seconds + tail, 2))
        recordings.append(
            Recording(f"sweep-{number + 1}", Purpose.MODAL, wave, whole, gap=IN_AIR, repeats=1, share=share)
        )
    return recordings


def _clear(scene: Scene, drive: str, gap: float, hz: float, top: float) -> Sine:
    """The strongest sine from 0 V up that keeps the foot clear of the ground by a fifth of its gap."""
    for volts in np.round(0.5 * top * np.arange(3.0, 0.05, -0.1), 3).tolist():
        wave = Sine(amplitude=volts, frequency=hz, offset=volts)
        run = simulate(placed(scene, Recording("", Purpose.CLOSE, wave, CLOSE_S, gap=gap), drive), CLOSE_S)
        if not len(run.events) and float(run.states(np.linspace(0.0, CLOSE_S, 4001)).gap.min()) > 0.2 * gap:
            return wave
    raise InputError(f"no drive at {hz:g} Hz keeps the foot clear of the ground at a gap of {1e6 * gap:.3g} um")


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


def _sweeps(scene: Scene, rate: float, drive: str) -> list[Recording]:
    """Sweeps up and down of different lengths, so that the harmonics of a drive that is not quite linear meet the
    modes at other times in each, and average out. Each ends where the sine is zero."""
    level, offset = sweep_level(scene.robot.drives[drive])
    before = (offset + 2.0 * level,) if offset else ()
    recordings = []
    for number in range(SWEEPS):
        seconds = 1.0 + 0.1 * number
        low, high = 200.0, 0.45 * rate
        high = 2.0 * np.floor(0.5 * (low + high) * seconds) / seconds - low
        ends = (low, high) if number % 2 == 0 else (high, low)
        wave = SweptSine(
            amplitude=level, start_frequency=ends[0], stop_frequency=ends[1], duration=seconds, offset=offset
        )
        recordings.append(
            Recording(f"sweep-{number + 1}", Purpose.MODAL, wave, 1.8, gap=IN_AIR, repeats=1, before=before)
        )
    return recordings


def _staircase(turns: tuple[float, ...], slope: float = 28.0) -> Sampled:
    """Straight ramps [V/s] from 0 V to each turning point in order."""
    levels = [0.0, *turns]
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(levels)) / slope)])
    return Sampled(times=tuple(times.tolist()), levels=tuple(levels))


def _bouncing(scene: Scene, rate: float, drive: str, tried: list[list[Square]]) -> tuple[list[Square], float]:
    """The square waves whose bounces are measured best, and for how long [s]: most of those with samples enough around;
    two, and up to four that have some, for four sets of a purpose show what differs between sets.

    Of several sets of waves and durations, the first that has some.
    """
    found: list[tuple[int, Square]] = []
    seconds = 0.0
    for seconds in BOUNCE_S:
        found = []
        for waves in tried:
            for wave in waves:
                run = simulate(placed(scene, Recording("", Purpose.BOUNCES, wave, seconds), drive), seconds)
                found.append((_clear_bounces(run.events, wave, rate, seconds), wave))
            if _second(found) >= _ENOUGH:
                break
        if _second(found) >= _FEW:
            break
    best = sorted(found, key=lambda one: -one[0])
    return [wave for k, (count, wave) in enumerate(best[:_SETS]) if k < 2 or count >= _FEW], seconds


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
