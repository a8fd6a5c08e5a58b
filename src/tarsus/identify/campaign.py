"""A campaign file: which records serve which step, what they hold, and what is known of the device beforehand."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.drive.waveforms import Waveform
from tarsus.errors import InputError
from tarsus.experiment.synthesis import Purpose
from tarsus.explain import nearest
from tarsus.files.library import load_scene
from tarsus.files.readers import read_measurement
from tarsus.files.readers.choices import Choices
from tarsus.identify.foot import FootModel
from tarsus.measurement import Measurement
from tarsus.scene import Scene
from tarsus.spec import Description, Named, quantity, validate

__all__ = ["Campaign", "Opened", "Reading", "RecordSet", "read_campaign", "read_records", "signal_problems"]

Floats = NDArray[np.float64]


class RecordSet(Choices):
    """Repeats of one experiment: files that are alike, and what they do not say themselves (as `Choices`)."""

    purpose: Purpose = Field(description="the step they serve")
    files: tuple[str, ...] = Field(min_length=1, description="one file a repeat, beside the campaign file")
    rest: float = quantity("s", "time at rest before the drive begins", default=0.0, ge=0)
    gap: float | None = quantity(
        "m", "gap of the foot at the neutral position, where it is not the device's", default=None, gt=0
    )
    signal: Waveform | None = Field(default=None, description="the drive as it was meant, from its beginning")
    air: str | None = Field(default=None, description="set of records with the same drive in the air")


class Campaign(Description):
    """Records of one device."""

    name: str = Field(default="campaign", description="title of the report")
    device: str = Field(
        description="what is known beforehand: a device by name, or a scene file beside this one"
    )
    foot: str | None = Field(default=None, description="name of the foot; may be left out if there is one")
    drive: str | None = Field(default=None, description="name of the drive; may be left out if there is one")
    points: tuple[str, ...] = Field(
        default=(), description="points that were measured; all of the structure if empty"
    )
    other_gap: float | None = quantity(
        "m", "a second gap at the neutral position, to see how the result depends on it", default=None, gt=0
    )
    records: Named[RecordSet] = Field(description="sets of records by name")


@dataclass(frozen=True)
class Opened:
    """A campaign with its folder and the device as known beforehand."""

    campaign: Campaign
    folder: Path
    model: FootModel

    def sets(self, purpose: Purpose) -> Iterator[tuple[str, RecordSet]]:
        """Sets of records for a purpose, by name."""
        return ((name, one) for name, one in self.campaign.records.items() if one.purpose is purpose)


@dataclass(frozen=True)
class Reading:
    """One file as read: the set it belongs to, its record, or None with the sentences that say why not."""

    set: str
    file: str
    record: Measurement | None
    problems: tuple[str, ...] = ()


def read_campaign(path: str | os.PathLike[str]) -> Opened:
    """Read a campaign file and the device it names.

    Raises
    ------
    InputError
        With every problem of the file: unknown keys, missing files, feet, drives and points that the device lacks.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "campaign.toml"
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{file}: not valid TOML: {error}") from None
    try:
        campaign = validate(Campaign, table)
    except InputError as error:
        raise InputError([f"{file.name}: {said}" for said in error.problems]) from None
    folder = file.parent
    scene = _device(campaign, folder)
    problems = _missing(campaign, folder) + _unknown(campaign, scene)
    if problems:
        raise InputError([f"{file.name}: {said}" for said in problems])
    foot = campaign.foot or next(iter(scene.robot.feet))
    drive = campaign.drive or next(iter(scene.robot.drives))
    points = campaign.points or tuple(scene.robot.structure.points)
    return Opened(campaign, folder, FootModel(scene, foot, drive, points))


def _device(campaign: Campaign, folder: Path) -> Scene:
    beside = folder / campaign.device
    return load_scene(beside if campaign.device.endswith(".toml") else campaign.device)


def _missing(campaign: Campaign, folder: Path) -> list[str]:
    return [
        f"records.{name}.files: there is no file '{file}'"
        for name, one in campaign.records.items()
        for file in one.files
        if not (folder / file).is_file()
    ]


def _unknown(campaign: Campaign, scene: Scene) -> list[str]:
    said: list[str] = []
    for word, given, known in (
        ("foot", campaign.foot, tuple(scene.robot.feet)),
        ("drive", campaign.drive, tuple(scene.robot.drives)),
    ):
        if given is None and len(known) != 1:
            said.append(f"{word}: the device has {', '.join(known) or 'none'}; name one")
        elif given is not None and given not in known:
            said.append(f"{word}: the device has no {word} '{given}'{nearest(given, known)}")
    points = scene.robot.structure.points
    said += [
        f"points: the structure has no point '{p}'{nearest(p, points)}"
        for p in campaign.points
        if p not in points
    ]
    said += [
        f"records.{name}.air: there is no set of records '{one.air}'{nearest(one.air, campaign.records)}"
        for name, one in campaign.records.items()
        if one.air is not None and one.air not in campaign.records
    ]
    return said


def read_records(opened: Opened, name: str) -> list[Reading]:
    """Records of a set, each as read; what is wrong with a file is told beside it."""
    one = opened.campaign.records[name]
    choices: dict[str, Any] = {key: getattr(one, key) for key in Choices.model_fields}
    out = []
    for file in one.files:
        try:
            record = read_measurement(opened.folder / file, **choices)
            problems = signal_problems(record, one)
        except InputError as error:
            out.append(Reading(name, file, None, tuple(_of_drive(said, one) for said in error.problems)))
            continue
        out.append(Reading(name, file, None if problems else record, tuple(problems)))
    return out


def _of_drive(said: str, one: RecordSet) -> str:
    """A sentence on a missing channel, which says so if the channel is the drive's."""
    names = {one.drive, *(key for key, choice in one.channels.items() if choice.name == one.drive)}
    missing = any(f"has no channel '{name}'" in said for name in names)
    return said.replace(" has no channel", ": the drive is missing: there is no channel") if missing else said


_OFF = 0.25
"""Part of a drive that may differ from the one meant: a square wave that begins a sample late differs by some of
it."""
_CROSSINGS = 40
_UNEVEN = 0.01


def signal_problems(record: Measurement, one: RecordSet) -> list[str]:
    """Sentences on a recorded drive that is not the one that was meant: missing, of another rate, size or kind."""
    if record.drive is None:
        return [f"{record.source}: the drive is missing: no channel is known to be it; name it with drive"]
    if one.signal is None:
        return []
    where = f"{record.source}, channel '{record.drive}'"
    time = record.step * np.arange(record.count, dtype=np.float64) - one.rest
    volts = record[record.drive]
    meant = _meant(one, time)
    size = float(np.sqrt(np.mean(meant**2)))
    off = _miss(volts, meant)
    if off <= _OFF * size or size == 0.0:
        return []
    gain = float(volts @ meant / (meant @ meant))
    if abs(gain) > 0.01 and _miss(volts, gain * meant) < _OFF * size * abs(gain):
        return [f"{where}: the drive is {gain:.3g} times the one that the campaign states"]
    scale = _stretch(time, volts, one)
    if scale is not None and abs(scale - 1.0) > 0.005:
        return [
            f"{where}: the sampling rate of {record.rate:g} Hz is wrong: the drive runs {scale:.4g} times "
            "as fast as the "
            f"campaign states, as it would at {record.rate / scale:.4g} Hz"
        ]
    return [
        f"{where}: the drive is not the one that the campaign states ({100.0 * off / size:.0f} % of it is off)"
    ]


def _meant(one: RecordSet, time: Floats) -> Floats:
    """Volts that were meant at times [s] from the beginning of the drive."""
    assert one.signal is not None
    return np.where(time < 0.0, 0.0, one.signal.volts(np.maximum(time, 0.0)))


def _stretch(time: Floats, volts: Floats, one: RecordSet) -> float | None:
    """How many times as fast the drive runs as was meant, from the places where it changes sign; None if they differ
    in more than pace."""
    seen = _crossings(time, volts)
    fine = np.linspace(0.0, float(time[-1]) * 2.5, 16 * len(time))
    meant = _crossings(fine, _meant(one, fine))
    count = min(len(seen), len(meant), _CROSSINGS)
    if count < 3:
        return None
    a, b = seen[:count] - seen[0], meant[:count] - meant[0]
    scale = float(a @ b / (a @ a))
    return scale if np.max(np.abs(scale * a - b)) < _UNEVEN * b[-1] else None


def _crossings(time: Floats, volts: Floats) -> Floats:
    """Times [s] at which the volts change sign, by lines between the samples."""
    moving = np.flatnonzero(np.abs(volts) > 1e-3 * np.max(np.abs(volts), initial=1e-12))
    v, t = volts[moving], time[moving]
    k = np.flatnonzero(v[1:] * v[:-1] < 0.0)
    return t[k] + (t[k + 1] - t[k]) * v[k] / (v[k] - v[k + 1])


def _miss(a: Floats, b: Floats) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)))
