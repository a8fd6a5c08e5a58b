"""A recording of a device: what a vibrometer with its noise would write down, repeat by repeat."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.gait import AnyGait
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.scene import Scene
from tarsus.model.standing import rest_state
from tarsus.model.structure.walker import TURNS
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.records.purpose import Purpose
from tarsus.solve import Output, ResultCode, simulate

REST = 0.01
"""Time [s] a record lasts before the drive begins."""
REPEATS = 3
"""Times each record is taken: the fewest with a scatter and an odd one out."""


@dataclass(frozen=True)
class Instrument:
    """A vibrometer with velocity and displacement outputs, recorded with the volts.

    rate [Hz]; snr_db: noise of each channel below the root mean square of its own motion; wander [m]: standard
    deviation of the zero of the displacement from record to record.
    """

    rate: float = 20e3
    snr_db: float = 40.0
    wander: float = 1e-6


@dataclass(frozen=True)
class Recording:
    """One experiment: what is driven, how far the ground is at the neutral position [m] (None as in the device), for
    how long [s], at what share of the rate it is recorded, and how often it is repeated; air: name of the recording
    with the same drive in the air; gait, signals: of a walk what all drives do, in place of a signal of one."""

    name: str
    purpose: Purpose
    signal: Waveform | None
    duration: float
    gap: float | None = None
    repeats: int = REPEATS
    share: int = 1
    air: str | None = None
    before: tuple[float, ...] = ()
    gait: AnyGait | None = None
    signals: Mapping[str, Waveform] = field(default_factory=dict, hash=False)


def rest_of(recording: Recording) -> float:
    """Time [s] that a record lasts before the drive begins: none for sweeps and walks, more for slow records."""
    return {Purpose.MODAL: 0.0, Purpose.WALKING: 0.0, Purpose.LOOPS: 10.0 * REST}.get(recording.purpose, REST)


def driven_by(recording: Recording, drive: str) -> str:
    """Name of the channel with the volts of a drive; of a walk it shows when that began, whichever drive it is."""
    return "trigger volts" if recording.purpose is Purpose.WALKING else f"{drive} volts"


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
    there = placed(scene, recording, drive)
    outputs = outputs_of(there, recording)
    run = simulate(there, recording.duration)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"'{recording.name}' cannot be recorded: {run.ended}")
    values = run.outputs(outputs, times)
    for one, row in zip(outputs, values, strict=True):
        if one.quantity in (Quantity.DISPLACEMENT, Quantity.ANGLE):
            row -= row[0]
    volts = _rounded(there.waveforms[drive].volts(times), 20.0 / 2**16)
    rest = round(rest_of(recording) * rate)
    channels = [Channel(one.name, one.quantity, point=one.at) for one in outputs]
    driven = driven_by(recording, drive)
    channels.append(Channel(driven, Quantity.VOLTAGE))
    for seed in seeds:
        noisy = _noisy(outputs, values, rest, instrument, np.random.default_rng([seed, 17]))
        signals = np.vstack([noisy, np.concatenate([np.zeros(rest), volts])])
        yield Measurement(tuple(channels), signals, 1.0 / rate, source=recording.name, drive=driven)


def outputs_of(scene: Scene, recording: Recording) -> list[Output]:
    """What is recorded: the motion of the feet and of all points; of a walk that of the body, and the motional currents
    of all drives behind a bridge."""
    robot, shown = scene.robot, recording.purpose is not Purpose.MODAL
    points = tuple(dict.fromkeys((*(foot.point for foot in robot.feet.values()), *robot.structure.points)))
    kinds = [Quantity.VELOCITY, Quantity.DISPLACEMENT][: 1 + shown]
    if recording.purpose is not Purpose.WALKING:
        return [Output(kind, point) for kind in kinds for point in points]
    turns = [name for name in robot.structure.body_coordinates if name in TURNS]
    angles = [Quantity.ANGULAR_VELOCITY, Quantity.ANGLE][: 1 + shown]
    out = [Output(kind, point) for kind in kinds for point in ("body_x", "body")]
    out += [Output(kind, name) for kind in angles for name in turns]
    return out + [Output(Quantity.CURRENT, name, motional=True) for name in robot.drives]


def placed(scene: Scene, recording: Recording, drive: str) -> Scene:
    """The scene of a recording: its drive, its distance, begun at rest, as the scene says where it gives all drives
    theirs. A foot's gap is that at rest, about which gravity moves no linear structure: it is left out."""
    if recording.signal is None:
        gaps = {f"robot.feet.{name}.gap": recording.gap for name in scene.robot.feet if recording.gap is not None}
        return with_values(scene, {"gait": recording.gait, "signals": dict(recording.signals)} | gaps)
    changes: dict[str, object] = {
        "signals": {drive: recording.signal},
        "initial.displacement": rest_state(scene),
        "ground.gravity": None,
    }
    if recording.before:
        history = (*scene.robot.drives[drive].history, *recording.before)
        changes |= {f"robot.drives.{drive}.history": history}
        settled = with_values(scene, {f"robot.drives.{drive}.history": history})
        changes |= {"initial.displacement": rest_state(settled, float(recording.signal.volts(np.zeros(1))[0]))}
    if recording.gap is not None:
        changes |= {f"robot.feet.{name}.gap": recording.gap for name in scene.robot.feet}
    return with_values(scene, changes)


def _noisy(
    outputs: Sequence[Output], values: Floats, rest: int, instrument: Instrument, random: np.random.Generator
) -> Floats:
    """The outputs behind a rest of so many samples, with noise and the zeros of displacements."""
    out = []
    for one, row in zip(outputs, values, strict=True):
        shifted = one.quantity is Quantity.DISPLACEMENT
        zero = instrument.wander * float(random.standard_normal()) if shifted else 0.0
        level = float(np.sqrt(np.mean(row**2))) * 10.0 ** (-instrument.snr_db / 20.0)
        whole = np.concatenate([np.zeros(rest), row])
        out.append(whole + zero + level * random.standard_normal(len(whole)))
    return np.array(out)


def _rounded(values: Floats, step: float) -> Floats:
    return np.round(values / step) * step
