"""A campaign to begin with: the records of a folder in sets, with what the files say and what is left to say."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError, InputProblem
from tarsus.base.quantities import Quantity
from tarsus.base.spec import scene_name
from tarsus.base.units import format_quantity
from tarsus.files.kinds import folder_sentence, mark_of
from tarsus.files.library import load_scene
from tarsus.identify.campaign import guessed_purpose
from tarsus.identify.campaign_file import pattern_of
from tarsus.records.measurement import Channel, Measurement
from tarsus.records.readers import read_measurement

RECORDS = {".uff", ".unv", ".mat", ".h5", ".hdf5", ".nc", ".tdms", ".lvm", ".csv", ".txt", ".asc", ".dat"}
"""Names of files that a campaign takes for records."""

SIGNALS = {
    "modal": '{ kind = "swept_sine", amplitude = "0.2 V", start_frequency = "200 Hz", stop_frequency = "9 kHz", '
    'duration = "1 s" }',
    "ramps": '{ kind = "ramped_square", amplitude = "8 V", frequency = "5 Hz", duty = 0.25 }',
    "bounces": '{ kind = "square", amplitude = "2 V", frequency = "300 Hz" }',
    "air": '{ kind = "square", amplitude = "2 V", frequency = "300 Hz" }',
    "validation": '{ kind = "sine", amplitude = "6 V", frequency = "50 Hz" }',
}
"""What drove the records, to be filled in, by purpose."""

UNITS = {"v": "mm/s", "vel": "mm/s", "velocity": "mm/s", "x": "um", "disp": "um", "displacement": "um", "pos": "um"}
"""Units of a vibrometer's outputs by the last word of a channel's name; volts for words that name a drive."""

BEGUN = 0.02
"""Share of a drive's range by which it has left its first level: more than any recorder's noise, and soon reached."""

FEWEST_AT_REST = 8
"""Samples at rest from which a zero is known."""

BLOCKS, PACE = 8, 0.1
"""Parts of a record in which the drive's changes of sign are counted, and the share by which they may differ between
repeats: clocks differ by far less, sweeps of another speed or direction by more."""

SAME = 0.01
"""Share by which durations of repeats may differ."""


@dataclass(frozen=True)
class _Seen:
    """What there is to say of a record: its channels, its duration [s], the channel of its drive, how long that stays
    at its first level [s], and how often it changes sign in each block."""

    channels: tuple[Channel, ...]
    duration: float
    drive: str | None
    rest: float | None
    turns: Floats | None

    @classmethod
    def of(cls, record: Measurement) -> _Seen:
        volts = [one.name for one in record.channels if one.quantity is Quantity.VOLTAGE]
        drive = record.drive or (volts[0] if len(volts) == 1 else None)
        duration = record.count * record.step
        if drive is None:
            return cls(record.channels, duration, None, None, None)
        values = record.values[record.index(drive)]
        moved = np.abs(values - np.median(values[:FEWEST_AT_REST]))
        still = int(np.argmax(moved > BEGUN * moved.max())) if moved.max() > 0.0 else 0
        signs = np.sign(values[still:] - np.median(values[still:]))
        turns = [float(np.count_nonzero(np.diff(one))) for one in np.array_split(signs, BLOCKS)]
        rest = _floor(still * record.step) if still >= FEWEST_AT_REST else None
        return cls(record.channels, duration, drive, rest, np.array(turns))

    def repeats(self, other: _Seen) -> bool:
        """Whether two records may be of one experiment."""
        if abs(self.duration - other.duration) > SAME * self.duration:
            return False
        if self.turns is None or other.turns is None:
            return True
        return bool(np.all(np.abs(self.turns - other.turns) <= PACE * np.maximum(self.turns, other.turns) + 2.0))


def campaign_text(folder: Path, device: str | None) -> tuple[str, list[str]]:
    """A campaign file for the records in a folder, and remarks on those that do not say enough.

    Raises InputError for what is no folder, and one without records.
    """
    if not folder.is_dir():
        raise InputError(f"'{folder}' is no folder: a campaign begins with the folder of its records")
    if mark_of(folder):
        raise InputError(f"'{folder}' is no folder of records{folder_sentence(folder, ())}")
    names = sorted(file.name for file in folder.iterdir() if file.suffix.lower() in RECORDS and file.is_file())
    if not names:
        raise InputError(f"'{folder}' holds no records ({', '.join(sorted(RECORDS))})")
    seen: dict[str, _Seen] = {}
    faults: dict[str, list[InputProblem]] = {}
    for name in names:
        try:
            seen[name] = _Seen.of(read_measurement(folder / name))
        except InputError as error:
            faults[name] = error.problems
    points = _points(folder, device)
    drives = {one.drive for one in seen.values() if one.drive is not None}
    common = drives.pop() if len(drives) == 1 else None
    sets: list[str] = []
    nameless: dict[str, None] = {}
    for name, files in _sets(names, seen).items():
        sets += ["", f"[records.{name}]", *_purpose(name, sets)]
        sets.append(f"files = {json.dumps(pattern_of(files, names), ensure_ascii=False)}")
        if files[0] in seen:
            sets += _of_file(name, seen[files[0]], common, points)
            continue
        nameless |= {name: None for said in faults[files[0]] for name in said.channels}
        other = [said for said in faults[files[0]] if not said.channels]
        sets += ["# the file does not say enough, add it here:"] * bool(other)
        sets += [f"#   {problem}" for problem in other]
    lines = [
        '# Which record serves which step; see the page "Identification" of the documentation.',
        f'name = "{folder.resolve().name}"',
        "# What is known beforehand: a device, or a scene file, named from this folder.",
        f'device = "{_from(folder, device)}"',
        "# even_film = true            # faces of foot and ground are flat: the squeeze film has exponent 3",
        "",
        "# What holds for all sets of records that say nothing else. Take away a # where a line is right.",
        "[defaults]",
        '# rest = "10 ms"             # at rest before the drive begins: eight samples at least',
        '# drive = "the channel that recorded the volts"' if common is None else f"drive = {json.dumps(common)}",
        *_nameless(list(nameless), points),
        "",
        "# purpose: modal (sweeps in the air), loops, ramps (adhesion), bounces, air, close or validation.",
        "# Put sets in the order in which they were recorded. Four sets of each purpose, and the first again at the",
        "# end of the session, show what differs between sets and what moves slowly.",
    ]
    return "\n".join([*lines, *sets]) + "\n", [said for name in names for said in faults.get(name, ())]


def _sets(names: list[str], seen: Mapping[str, _Seen]) -> dict[str, list[str]]:
    """Files by set: those whose names differ in a last number only are repeats of one experiment, unless their drives
    or durations differ."""
    alike: dict[str, list[str]] = {}
    for name in names:
        stem = re.sub(r"[-_ ]*\d+$", "", Path(name).stem) or Path(name).stem
        alike.setdefault(_key(stem), []).append(name)
    sets: dict[str, list[str]] = {}
    for key, files in alike.items():
        groups: list[list[str]] = []
        for name in files:
            own = seen.get(name)
            near = (one for one in groups if own is None or one[0] not in seen or own.repeats(seen[one[0]]))
            group = next(near, None)
            groups.append([name]) if group is None else group.append(name)
        for group in groups:
            sets[key if len(groups) == 1 else _key(Path(group[0]).stem)] = group
    return sets


def _key(stem: str) -> str:
    return scene_name(stem).strip("_-") or "records"


def _of_file(name: str, seen: _Seen, common: str | None, points: tuple[str, ...]) -> list[str]:
    """Lines of a set on what its first file says: its rest, its drive, and where its channels look."""
    lines = (
        [] if seen.rest is None else [f'rest = "{format_quantity(seen.rest, "s")}"'.ljust(28) + " # as the volts show"]
    )
    if seen.drive is not None and seen.drive != common:
        lines.append(f"drive = {json.dumps(seen.drive, ensure_ascii=False)}")
    looking = [one for one in seen.channels if one.name != seen.drive]
    if all(one.at in points for one in looking):
        return lines
    lines.append(f"# [records.{name}.channels]   # the point that each looks at")
    for one in looking:
        point = one.at if one.at in points else _guess(one.name, points)
        lines.append(
            f'# {_toml_key(one.name)} = {{ point = "{point}" }}'.ljust(40) + f" # a {one.quantity.name.lower()}"
        )
    if seen.drive is not None:  # channels that are not named are not read
        lines.append(f"# {_toml_key(seen.drive)} = {{}}".ljust(40) + " # the drive")
    return lines


def _floor(value: float) -> float:
    """A time to two digits, not above it."""
    power = math.floor(math.log10(value)) - 1
    return float(f"{math.floor(value / 10.0**power * (1.0 + 1e-9)) * 10.0**power:.2g}")


def _purpose(name: str, before: list[str]) -> list[str]:
    """The purpose that the name of a set suggests, and the first time a signal to be filled in."""
    guess = guessed_purpose(name)
    word = "validation" if guess is None else guess.value
    why = "say what for" if guess is None else "guessed from the name"
    lines = [f'purpose = "{word}"'.ljust(28) + f" # {why}"]
    if not any(one.startswith(f'purpose = "{word}"') for one in before):
        lines += [f"# signal = {SIGNALS[word]}"] if word in SIGNALS else []
        lines += ['# gap = "3 cm"               # of the foot in the air'] if word in ("modal", "air") else []
    return lines


def _nameless(names: list[str], points: tuple[str, ...]) -> list[str]:
    """Lines that say what channels measure, with what their names suggest, each to be uncommented."""
    if not names:
        return []
    lines = [
        "# Files do not say what these channels measure; a file that lacks one is read without it.",
        "# [defaults.channels]",
    ]
    for name in names:
        words = re.findall(r"[a-z]+", name.lower())
        volts = re.search(r"volt|drive|amp|pzt", name.lower())
        unit = "V" if volts else UNITS.get(words[-1] if words else "", "?")
        said = '"V"' if unit == "V" else f'{{ unit = "{unit}", point = "{_guess(name, points)}" }}'
        lines.append(f"# {_toml_key(name)} = {said}")
    return lines


def _guess(name: str, points: tuple[str, ...]) -> str:
    """The point that a channel's name holds; "?" where it holds none."""
    return next((one for one in points if one.lower() in name.lower()), "?")


def _toml_key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _points(folder: Path, device: str | None) -> tuple[str, ...]:
    """Points of the device, by name, or of its file as named from here or from the folder, where it can be read
    already."""
    there = folder / (device or "device.toml")
    try:
        return tuple(load_scene(there if there.is_file() else device or there).robot.structure.points)
    except InputError:  # the campaign file comes first, and its check says so
        return ()


def _from(folder: Path, device: str | None) -> str:
    """A device by name, or its file as named from the folder of the campaign."""
    if device is None or not Path(device).is_file():
        return device or "device.toml"
    return Path(os.path.relpath(device, folder)).as_posix()
