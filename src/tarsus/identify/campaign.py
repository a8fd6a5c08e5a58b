"""A campaign file: which records serve which step, what they hold, and what is known of the device beforehand."""

from __future__ import annotations

import filecmp
import os
import re
import shlex
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, field_validator, model_validator

from tarsus.base.errors import Fault, InputError, InputProblem
from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Amount, Description, FrozenDict, MaybeAmount, Named, quantity, scene_name, validate
from tarsus.files.kinds import folder_sentence, mark_of
from tarsus.files.library import load_scene
from tarsus.files.tables import FileKind, read_table
from tarsus.formats.freedoms import along_axis
from tarsus.identify.campaign_file import is_pattern, matching, spread
from tarsus.identify.drive_check import cut_short, drive_faults, fit_drive
from tarsus.identify.foot import FootModel
from tarsus.model.drive.gait import AnyGait
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.scene import Scene
from tarsus.plan.lowering import still_only
from tarsus.records.excluded import Excluded, excluded_of
from tarsus.records.measurement import Measurement
from tarsus.records.purpose import Purpose
from tarsus.records.readers import read_measurement
from tarsus.records.readers.choices import Choices

_WORDS = {
    Purpose.VALIDATION: ("held", "valid", "test"),
    Purpose.AIR: ("air",),
    Purpose.CLOSE: ("close", "near"),
    Purpose.MODAL: ("sweep", "chirp", "modal", "frf"),
    Purpose.LOOPS: ("loop", "static", "hyst", "stair"),
    Purpose.RAMPS: ("ramp", "pull", "adhesion"),
    Purpose.BOUNCES: ("bounc", "impact", "hop"),
    Purpose.WALKING: ("walk", "gait", "exercise", "trot"),
}
"""How words in the names of files begin that say what records are for; the first purpose that has one holds."""


def guessed_purpose(name: str) -> Purpose | None:
    """What the name of a file or set of records suggests that it is for."""
    words = re.findall(r"[a-z]+", name.lower())
    starts = ((purpose, any(w.startswith(_WORDS[purpose]) for w in words)) for purpose in _WORDS)
    return next((purpose for purpose, yes in starts if yes), None)


class Defaults(Choices):
    """What holds for all sets of records that do not say otherwise themselves (as `Choices`)."""

    rest: Amount = quantity("s", "time at rest before the drive begins", default=0.0, ge=0)


class RecordSet(Defaults):
    """Repeats of one experiment: files that are alike, and what they do not say themselves (as `Choices`)."""

    purpose: Purpose = Field(description="the step they serve")
    files: tuple[str, ...] = Field(
        description="one file a repeat, in the campaign's folder; a pattern, as ``ramps-*.mat``, is all that it matches"
    )
    like: str | None = Field(
        default=None,
        description="set of records whose settings hold where this one says nothing, but its files and air",
    )
    gap: MaybeAmount = quantity(
        "m", "gap of the foot at the neutral position, where it is not the device's", default=None, gt=0
    )
    signal: Waveform | None = Field(default=None, description="the drive as it was meant, from its beginning")
    air: str | None = Field(default=None, description="set of records with the same drive in the air")
    gait: AnyGait | None = Field(default=None, description="of a walk: the pattern of the legs")
    signals: Named[Waveform] = Field(
        default=FrozenDict(),
        description="of a walk: volts of single drives; without a gait those of the others are 0 V",
    )
    bridge: bool = Field(
        default=False, description="whether a bridge took the current of the capacitance off the recorded currents"
    )

    @property
    def walks(self) -> bool:
        """Whether a walker was recorded, walks that are left out among them."""
        unseen = self.purpose is Purpose.VALIDATION and bool(self.gait or self.signals)
        return unseen or self.purpose is Purpose.WALKING

    @field_validator("files", mode="before")
    @classmethod
    def _listed(cls, value: Any) -> Any:
        return (value,) if isinstance(value, str) else value

    @field_validator("files")
    @classmethod
    def _some(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value:
            raise PathErrors([("", "expected at least one file, got none")])
        return value


class Campaign(Description):
    """Records of one device."""

    name: str = Field(default="campaign", description="title of the report")
    device: str = Field(description="what is known beforehand: a device by name, or a scene file in the same folder")
    foot: str | None = Field(default=None, description="name of the foot; may be left out if there is one")
    drive: str | None = Field(default=None, description="name of the drive; may be left out if there is one")
    points: tuple[str, ...] = Field(default=(), description="points that were measured; all of the structure if empty")
    other_gap: MaybeAmount = quantity(
        "m", "of earlier versions, not used: the gap changes the constant of the drive's law alone", default=None, gt=0
    )
    ground_by_foot: bool = Field(
        default=False,
        description="of a walker: whether the ground is known to differ from foot to foot, which is tried otherwise",
    )
    even_film: bool = Field(
        default=False,
        description="whether the film is known to be one between flat faces, of exponent 3, which few records tell",
    )
    calibration: float = Field(
        default=0.0,
        ge=0,
        lt=0.5,
        description="standard error of the gain that all channels of motion share, as a share of it (of a certified "
        "vibrometer 0.005 to 0.01); the uncertainty of every number includes it",
    )
    defaults: Defaults | None = Field(default=None, description="what the sets do not say themselves")
    records: Named[RecordSet] = Field(description="sets of records by name")

    @model_validator(mode="before")
    @classmethod
    def _spread(cls, given: Any) -> Any:
        """Give every set that is read from a file the defaults and what it takes from another one; wrong defaults are
        reported once, where they stand."""
        sets = given.get("records") if isinstance(given, dict) else None
        if not isinstance(sets, dict):
            return given
        defaults = given.get("defaults", {})
        try:
            validate(Defaults, defaults)
        except InputError:
            return given
        return {**given, "records": spread(sets, defaults if isinstance(defaults, dict) else {})}


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
class RecordFile:
    """One file as read: the set it belongs to, its record, or None with what is wrong."""

    set: str
    file: str
    record: Measurement | None
    problems: tuple[Excluded, ...] = ()


def read_campaign(path: str | os.PathLike[str]) -> Opened:
    """Read a campaign file and the device it names.

    Raises
    ------
    InputError
        With every problem of the file: unknown keys, feet, drives and points that the device lacks, not one file of
        records there. Single files that are missing are reported by `read_records`.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "campaign.toml"
        if not file.exists():
            held = folder_sentence(file.parent, ()) if mark_of(file.parent) else ""
            raise InputError(
                f"{file}: no such file"
                + (held or f"; `tarsus new campaign {shlex.quote(str(path))}` writes one for its records")
            )
    elif file.is_file() and file.suffix != ".toml":
        raise InputError(f"{file}: is no campaign file (campaign.toml, or the folder that it is in)")
    table = read_table(file, FileKind.CAMPAIGN)
    try:
        campaign = validate(Campaign, table)
    except InputError as error:
        raise InputError([f"{file.name}: {said}" for said in error.problems]) from None
    folder = file.parent
    campaign = _with_files(campaign, folder)
    scene = _device(campaign, folder)
    still_only(scene, "robots are identified")
    problems = _missing(campaign, folder) + _unknown(campaign, scene)
    if problems:
        raise InputError([f"{file.name}: {said}" for said in problems])
    foot = campaign.foot or next(iter(scene.robot.feet))
    drive = campaign.drive or next(iter(scene.robot.drives))
    points = campaign.points or tuple(scene.robot.structure.points)
    return Opened(campaign, folder, FootModel(scene, foot, drive, points))


def _with_files(campaign: Campaign, folder: Path) -> Campaign:
    """A campaign whose patterns are the files that they match."""
    sets = {
        name: one.model_copy(update={"files": matching(folder, one.files)}) for name, one in campaign.records.items()
    }
    return campaign.model_copy(update={"records": FrozenDict(sets)})


def _device(campaign: Campaign, folder: Path) -> Scene:
    if not campaign.device.endswith(".toml"):
        return load_scene(campaign.device)
    file = folder / campaign.device
    try:
        return load_scene(file)
    except InputError as error:
        if not file.exists():
            raise InputError(
                f"{folder / 'campaign.toml'}: its device '{campaign.device}' is not there: name a scene or a device"
            ) from None
        problems = [said if str(file) in said else f"{campaign.device}: {said}" for said in error.problems]
        raise InputError(problems) from None


def _missing(campaign: Campaign, folder: Path) -> list[str]:
    """A sentence if there are no files at all; single ones are reported where they are read."""
    files = [file for one in campaign.records.values() for file in one.files]
    if not files:
        return ["records: expected at least one set of records"]
    if any((folder / file).is_file() for file in files):
        return []
    what = "no file matches" if is_pattern(files[0]) else "there is no file"
    return [f"records: none of the files that it names is there: {what} '{folder / files[0]}'"]


def _unknown(campaign: Campaign, scene: Scene) -> list[str]:
    said: list[str] = []
    walks = all(one.walks for one in campaign.records.values())
    for word, given, known in (
        ("foot", campaign.foot, tuple(scene.robot.feet)),
        ("drive", campaign.drive, tuple(scene.robot.drives)),
    ):
        if given is None and len(known) != 1 and not walks:
            said.append(f"{word}: the device has {', '.join(known) or 'none'}; name one")
        elif given is not None and given not in known:
            said.append(f"{word}: the device has no {word} '{given}'{nearest(given, known)}")
    points = scene.robot.structure.points
    looked_at = (*points, *scene.robot.structure.body_coordinates, *scene.robot.drives)
    said += [
        f"records.{name}.channels.{key}.point: the structure has no point '{choice.point}'"
        f"{nearest(choice.point, looked_at)}"
        for name, one in campaign.records.items()
        for key, choice in one.channels.items()
        if choice.point is not None and choice.point not in looked_at
    ]
    said += [
        f"points: the structure has no point '{p}'{nearest(p, points)}" for p in campaign.points if p not in points
    ]
    said += [
        f"records.{name}.air: there is no set of records '{one.air}'{nearest(one.air, campaign.records)}"
        for name, one in campaign.records.items()
        if one.air is not None and one.air not in campaign.records
    ]
    return said


def read_records(opened: Opened, name: str) -> list[RecordFile]:
    """Records of a set, each as read, with what is wrong with its file.

    Files that are missing, and files with the same content as an earlier one for the same purpose, have no record.
    """
    one = opened.campaign.records[name]
    earlier = _listed_before(opened, name)
    out: list[RecordFile] = []
    for file in one.files:
        path = opened.folder / file
        twin = next((known for known in earlier if _same(path, opened.folder / known)), None)
        if any(one.file == twin != file and one.record is None for one in out):
            twin = None  # what is wrong with both is worth more than that they are alike
        if not path.is_file():
            nothing = "no file matches it" if is_pattern(file) else "there is no such file"
            what = "is a folder" if path.is_dir() else f"is missing: {nothing}"
            out.append(RecordFile(name, file, None, (Excluded(file, "", what),)))
        elif twin is not None:
            again, said = _twice(file, twin)
            out.append(RecordFile(name, again, None, (Excluded(again, "", said),)))
        else:
            out.append(_read(opened, name, file, [r for r in out if r.record is not None]))
        earlier.append(file)
    return out


def _read(opened: Opened, name: str, file: str, others: Sequence[RecordFile]) -> RecordFile:
    """One file of a set, of which others were read before."""
    one = opened.campaign.records[name]
    choices: dict[str, Any] = {key: getattr(one, key) for key in Choices.model_fields}
    try:
        common = opened.campaign.defaults
        record = _measured(opened.folder / file, choices, set(common.channels) if common else set())
    except InputError as error:
        return RecordFile(name, file, None, tuple(_of_drive(file, said, one) for said in error.problems))
    record = at_points(record, opened.model.scene.robot.structure.points)
    for other in others:
        if other.record is not None and np.array_equal(other.record.values, record.values):
            return RecordFile(name, file, None, (Excluded(file, "", _twice(file, other.file)[1]),))
    problems, checked = checked_drive(record, one)
    problems = [replace(said, file=file) for said in (*_clipped(record, one), *problems)]
    return RecordFile(name, file, None if problems else checked, tuple(problems))


def at_points(record: Measurement, points: Collection[str]) -> Measurement:
    """The record with degrees of freedom, such as ``12-Z``, at the points that scenes name after them (``12_Z``), along
    the positive axis."""
    channels, values = list(record.channels), record.values.copy()
    for k, channel in enumerate(channels):
        along, sign = along_axis(channel.at)
        point = scene_name(along)
        if channel.at not in points and point in points:
            channels[k] = replace(channel, point=point)
            values[k] *= sign
    return replace(record, channels=tuple(channels), values=values)


def _measured(path: Path, choices: dict[str, Any], optional: set[str]) -> Measurement:
    """The record of a file; of channels that the defaults name, those that it has, or its own where it has none."""
    try:
        return read_measurement(path, **choices)
    except InputError as error:
        lacking = {said.channel for said in error.problems if said.fault is Fault.NO_CHANNEL} & optional
        channels = {key: one for key, one in choices["channels"].items() if key not in lacking}
        if not lacking:
            raise
    return read_measurement(path, **{**choices, "channels": channels})


def _listed_before(opened: Opened, name: str) -> list[str]:
    """Files of the sets for the same purpose that come before a set."""
    sets = [key for key, _ in opened.sets(opened.campaign.records[name].purpose)]
    return [file for key in sets[: sets.index(name)] for file in opened.campaign.records[key].files]


def _same(path: Path, other: Path) -> bool:
    """Whether two files are one, or have the same bytes."""
    if not (path.is_file() and other.is_file()):
        return False
    return path.samefile(other) or (
        path.stat().st_size == other.stat().st_size and filecmp.cmp(path, other, shallow=False)
    )


def _twice(file: str, other: str) -> tuple[str, str]:
    """Name under which a repeat that is none is reported, and a sentence on it."""
    if file == other:
        return f"{file} (again)", "is listed twice: it counts once"
    return file, f"holds the same record as {other}: it is no repeat, and {other} alone counts"


def _of_drive(file: str, said: InputProblem, one: RecordSet) -> Excluded:
    """What is wrong with a file, which says so if the drive's channel is missing."""
    names = {one.drive, *(key for key, choice in one.channels.items() if choice.name == one.drive)}
    if said.fault is Fault.NO_CHANNEL and said.channel in names:
        return Excluded(file, "", f"the drive is missing: there is no channel '{said.channel}'")
    return excluded_of(file, said)


def checked_drive(record: Measurement, one: RecordSet) -> tuple[list[Excluded], Measurement]:
    """What is wrong with a recorded drive that is missing or not the one that was meant; the record with the drive as
    it was before a recorder rounded it, where it was meant to the digit."""
    if record.drive is None:
        missing = "the drive is missing: no channel is known to be it; name it with drive"
        return [Excluded(record.source, "", missing)], record
    if one.signal is None:
        return [], record
    volts = record[record.drive]
    fit = fit_drive(volts, record.step, one.rest, one.signal)
    lasts = record.count * record.step
    short = cut_short(lasts * (1.0 if fit is None else fit.pace), one.rest, record.step, one.signal)
    faults = [] if short is None else [short]
    if fit is not None and short is None:
        faults = drive_faults(fit, record.step, lasts, one.rest, one.purpose is Purpose.MODAL)
        values = record.values.copy()
        values[record.index(record.drive)] = fit.unrounded(volts)
        record = replace(record, values=values)
    return [Excluded(record.source, str(record.drive), said) for said in faults], record


def _clipped(record: Measurement, one: RecordSet) -> list[Excluded]:
    """Channels that look clipped, but those that are accepted so."""
    accepted = {choice.name or key for key, choice in one.channels.items() if choice.accept_clipped}
    wanted = [name for name in record.names if name not in accepted]
    clipped = record.select(wanted).clipped() if wanted else ()
    return [Excluded(record.source, said.channel, said.said) for said in clipped]
