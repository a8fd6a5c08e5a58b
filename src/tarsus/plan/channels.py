"""What drives do in many runs at once: numbers of signals, gaits and drives that vary from run to run go the one way
that those of a single run go (`tarsus.model.drive.lower`)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats, Ints
from tarsus.base.errors import InputError
from tarsus.base.spec import Description, with_values
from tarsus.model.drive.lower import lower_track
from tarsus.model.drive.output import amplified
from tarsus.model.drive.pieces import Channels
from tarsus.model.drive.track import Track
from tarsus.model.drive.waveforms.constant import Constant
from tarsus.plan.lowering import distinct

if TYPE_CHECKING:
    from tarsus.model.drive.signal import Signal
    from tarsus.model.scene import Drive, Scene


@dataclass(frozen=True)
class DriveRuns:
    """What one drive does in nr runs. force, and volts where they are asked for: channels; track: their voltages;
    which (nr,): number of those of each run; periods (nr,) [s]: of its signal, NaN without one."""

    force: Channels
    volts: Channels | None
    track: Track
    which: Ints
    periods: Floats

    def of_runs(self, runs: Ints) -> DriveRuns:
        """What it does in some of the runs; the channels stay."""
        return replace(self, which=self.which[runs], periods=self.periods[runs])


def affects_motion(path: str) -> bool:
    """Whether a number of a drive or its signal has a part in the motion; its supply's energy account has none."""
    return not path.endswith((".capacitance", ".recovery"))


def drive_courses(scene: Scene, values: Mapping[str, Floats], charged: Collection[str]) -> dict[str, DriveRuns]:
    """What drives do, by name, of which numbers (nr,) vary from run to run, given by their paths in the scene;
    charged: those whose volts are asked for.

    Raises InputError for values that a signal, a gait or a drive refuses, and for a drive that cannot be lowered.
    """
    out, made = {}, dict[Any, DriveRuns]()
    for name, (wave, own, of_drive) in _varied(scene, values).items():
        drive = scene.robot.drives[name]
        columns = [(path, column.tobytes()) for path, column in (*own.items(), *of_drive.items())]
        key = (wave, drive.law, drive.history, drive.amplifier, *columns, name in charged)
        if key not in made:  # a gait moves many drives alike
            made[key] = _course(drive, wave, own, of_drive, name in charged)
        out[name] = made[key]
    return out


def _course(drive: Drive, wave: Signal, own: Columns, of_drive: Columns, charged: bool) -> DriveRuns:
    """What a drive does by the numbers (nr,) of its signal and its own."""
    rows, which = distinct(np.stack([*own.values(), *of_drive.values()], axis=1))
    signal = dict(zip(own, rows[:, : len(own)].T, strict=True))
    numbers = dict(zip(of_drive, rows[:, len(own) :].T, strict=True))
    wave = with_columns(wave, signal)
    track = _track(drive, wave, numbers, len(rows))
    force, volts = _lowered(drive, numbers, track, volts=charged)
    periods = np.broadcast_to(wave.periods(), len(rows))
    return DriveRuns(force, volts, track, which, periods[which])


Columns = Mapping[str, Any]


def _varied(scene: Scene, values: Mapping[str, Any]) -> dict[str, tuple[Signal, dict[str, Any], dict[str, Any]]]:
    """Of every drive that numbers have a part in: its signal, and the numbers of that and of the drive, by their
    paths in these. Those of a gait are numbers of the square waves that it gives to its drives."""
    gait = {path.removeprefix("gait."): of for path, of in values.items() if path.startswith("gait.")}
    waves = gait_waves(scene, gait) if gait else {}
    out = {}
    for name in scene.robot.drives:
        signal, drive = f"signals.{name}.", f"robot.drives.{name}."
        own = {path.removeprefix(signal): of for path, of in values.items() if path.startswith(signal)}
        of_drive = {
            path.removeprefix(drive): of
            for path, of in values.items()
            if path.startswith(drive) and affects_motion(path)
        }
        wave = scene.waveforms.get(name) or Constant(level=0.0)
        check_columns(f"signals.{name}", wave, own)
        check_columns(f"robot.drives.{name}", scene.robot.drives[name], of_drive)
        own |= waves.get(name, {})
        if own or of_drive:
            out[name] = (wave, own, of_drive)
    return out


def gait_waves(scene: Scene, gait: Columns) -> dict[str, dict[str, Any]]:
    """Numbers of the square waves of a gait, for every drive that it moves."""
    layout, own = scene.robot.layout(), scene.gait
    assert own is not None and layout is not None  # checked by Scene
    check_columns("gait", own, gait)
    many = with_columns(own, gait)
    faults = many.faults(layout)
    if faults:
        raise InputError([f"gait.{path}: {text}" if path else f"gait: {text}" for path, text in faults])
    like = next(iter(gait.values()))
    waves = {name: wave for name, wave in many.waveforms(layout).items() if name not in scene.signals}
    names = ("amplitude", "frequency", "phase", "offset", "duty")
    return {
        name: {key: of + 0.0 * like for key in names if np.ndim(of := getattr(wave, key)) or key == "amplitude"}
        for name, wave in waves.items()
    }


def with_columns(of: Any, columns: Columns) -> Any:
    """A description with some of its numbers, by their paths in it, one a run (nr,); as they are, for none of
    them is looked at."""
    if "" in columns:
        return columns[""]
    parts: dict[str, dict[str, Any]] = {}
    for path, column in columns.items():
        key, _, rest = path.partition(".")
        parts.setdefault(key, {})[rest] = column
    if not parts:
        return of
    if isinstance(of, Description):
        return of.model_copy(update={key: with_columns(getattr(of, key), rest) for key, rest in parts.items()})
    if isinstance(of, tuple):
        return tuple(with_columns(one, parts.get(str(k), {})) for k, one in enumerate(of))
    return type(of)({**of, **{key: with_columns(of[key], rest) for key, rest in parts.items()}})


def check_columns(where: str, of: Description, varied: Columns) -> None:
    """Raise InputError where a value is refused: bounds are intervals, so that the lowest and the highest suffice,
    and of numbers that must be in order the lowest ones are, and the highest."""
    for end in (np.min, np.max) if varied else ():
        try:
            with_values(of, {path: float(end(column)) for path, column in varied.items()})
        except InputError as error:
            raise InputError([f"{where}.{text}" for text in error.problems]) from None


def _track(drive: Drive, wave: Signal, varied: Columns, count: int) -> Track:
    """The voltages at the actuator."""
    track = wave.track()
    track = track if len(track.loops) == count else track.picked(np.zeros(count, dtype=np.intp))
    if _ideal(drive, varied):
        return track
    many = with_columns(drive, varied)
    return amplified(track, many.amplifier.stage(), many.history[-1] if many.history else 0.0)


def _lowered(drive: Drive, varied: Columns, track: Track, *, volts: bool) -> tuple[Channels, Channels | None]:
    """Force and volts of a drive along the voltages of many runs; a law that goes by the rate takes one after
    the other."""
    if not drive.law.by_rate:
        many = with_columns(drive, varied)
        return lower_track(track, many.law, many.history, volts=volts)
    found = []
    for i in range(len(track.loops)):
        own = with_values(drive, {path: float(column[i]) for path, column in varied.items()})
        found.append(lower_track(track.picked(np.array([i])), own.law, own.history, volts=volts))
    force, levels = zip(*found, strict=True)
    return Channels.joined(force), Channels.joined(levels) if volts else None


def _ideal(drive: Drive, varied: Collection[str]) -> bool:
    return drive.amplifier.ideal and not any(path.startswith("amplifier.") for path in varied)
