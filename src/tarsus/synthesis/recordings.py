"""A recording of a device: what a vibrometer with its noise would write down, repeat by repeat."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.scene import Scene
from tarsus.model.standing import rest_state
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.records.purpose import Purpose
from tarsus.solve import simulate
from tarsus.solve.codes import ResultCode

Floats = NDArray[np.float64]

REST = 0.01
"""Time [s] a record lasts before the drive begins."""
REPEATS = 3
"""Times each record is taken: the fewest with a scatter and an odd one out."""


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
class Recording:
    """One experiment: what is driven, how far the ground is at the neutral position [m] (None as in the device), for
    how long [s], at what share of the rate it is recorded, and how often it is repeated; air: name of the recording
    with the same drive in the air."""

    name: str
    purpose: Purpose
    signal: Waveform
    duration: float
    gap: float | None = None
    repeats: int = REPEATS
    share: int = 1
    air: str | None = None
    before: tuple[float, ...] = ()


def rest_of(recording: Recording) -> float:
    """Time [s] that a record lasts before the drive begins: none for sweeps, more for slow records."""
    return {Purpose.MODAL: 0.0, Purpose.LOOPS: 10.0 * REST}.get(recording.purpose, REST)


def recorded(
    scene: Scene, recording: Recording, instrument: Instrument, drive: str, seeds: Sequence[int]
) -> Iterator[Measurement]:
    """Records of an experiment that is repeated, each with the rest before it: of one motion, for the device does the
    same every time, with the instrument's noise of each seed.

    Displacements are relative to the rest before the drive begins, but for the wander of their zero.

    Raises
    ------
    InputError
        If the simulation does not reach its end.
    """
    rate = instrument.rate / recording.share
    times = np.arange(int(np.floor(recording.duration * rate * (1.0 + 1e-12)))) / rate
    motion = _motion(placed(scene, recording, drive), recording, times)
    volts = np.concatenate([np.zeros(round(rest_of(recording) * rate)), recording.signal.volts(times)])
    for seed in seeds:
        yield _record(motion, volts, recording, instrument, f"{drive} volts", seed)


@dataclass(frozen=True)
class _Motion:
    """How points move (np, nt): from the rest before the drive [m], and their velocity [m/s]."""

    points: tuple[str, ...]
    moved: Floats
    speed: Floats


def _motion(placed: Scene, recording: Recording, times: Floats) -> _Motion:
    run = simulate(placed, recording.duration)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"'{recording.name}' cannot be recorded: {run.ended}")
    structure = placed.robot.structure
    feet = (foot.point for foot in placed.robot.feet.values())
    points = tuple(dict.fromkeys((*feet, *structure.points)))
    rows = np.array([structure.row(name) for name in points])
    states = run.states(times)
    return _Motion(
        points, rows @ (states.x - np.array(placed.initial.displacement)[:, None]), rows @ states.v
    )


def _record(
    motion: _Motion, volts: Floats, recording: Recording, instrument: Instrument, driven: str, seed: int
) -> Measurement:
    random = np.random.default_rng([seed, 17])
    rate = instrument.rate / recording.share
    rest = len(volts) - motion.moved.shape[1]
    channels, signals = list[Channel](), list[Floats]()
    for name, speed in zip(motion.points, motion.speed, strict=True):
        channels.append(Channel(f"{name} velocity", Quantity.VELOCITY, point=name))
        signals.append(_noisy(speed, rest, instrument.snr_db, 0.0, random))
    if instrument.displacement and recording.purpose is not Purpose.MODAL:
        for name, moved in zip(motion.points, motion.moved, strict=True):
            channels.append(Channel(f"{name} displacement", Quantity.DISPLACEMENT, point=name))
            zero = instrument.wander * float(random.standard_normal())
            signals.append(_noisy(moved, rest, instrument.snr_db, zero, random))
    channels.append(Channel(driven, Quantity.VOLTAGE))
    signals.append(_rounded(volts, 20.0 / 2**16))
    return Measurement(
        tuple(channels),
        np.array(signals),
        1.0 / rate,
        start=-rest / rate,
        source=recording.name,
        drive=driven,
    )


def placed(scene: Scene, recording: Recording, drive: str) -> Scene:
    """The scene of a recording: its drive, its distance, begun at rest."""
    changes: dict[str, object] = {
        "signals": {drive: recording.signal},
        "initial.displacement": rest_state(scene),
    }
    if recording.before:
        history = (*scene.robot.drives[drive].history, *recording.before)
        changes |= {f"robot.drives.{drive}.history": history}
        settled = with_values(scene, {f"robot.drives.{drive}.history": history})
        changes |= {
            "initial.displacement": rest_state(settled, float(recording.signal.volts(np.zeros(1))[0]))
        }
    if recording.gap is not None:
        changes |= {f"robot.feet.{name}.gap": recording.gap for name in scene.robot.feet}
    return with_values(scene, changes)


def _noisy(values: Floats, rest: int, decibels: float, zero: float, random: np.random.Generator) -> Floats:
    level = float(np.sqrt(np.mean(values**2))) * 10.0 ** (-decibels / 20.0)
    whole = np.concatenate([np.zeros(rest), values])
    return whole + zero + level * random.standard_normal(len(whole))


def _rounded(values: Floats, step: float) -> Floats:
    return np.round(values / step) * step
