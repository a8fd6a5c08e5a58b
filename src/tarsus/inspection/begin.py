"""The verb that begins: a device, a law, a study, or the campaign of a folder of records, as a file to be completed."""

from __future__ import annotations

import json as text_of
import os
import re
from importlib.resources import files as packaged
from pathlib import Path
from typing import Literal, get_args

from tarsus.base.errors import InputError
from tarsus.base.messages import together
from tarsus.base.spec import scene_name
from tarsus.files.library import load_scene
from tarsus.files.toml import scene_text
from tarsus.files.whole import write_text
from tarsus.identify.campaign import guessed_purpose
from tarsus.identify.campaign_file import pattern_of
from tarsus.records.readers import read_measurement
from tarsus.tables.table import Table
from tarsus.tables.view import View

Beginning = Literal["device", "law", "study", "campaign"]
"""What can be begun."""

TEMPLATES = {"device": "device.toml", "law": "law.py", "study": "study.toml"}
RECORDS = {".uff", ".unv", ".mat", ".h5", ".hdf5", ".nc", ".tdms", ".lvm", ".csv", ".txt", ".asc", ".dat"}
"""Names of files that a campaign takes for records."""


def new(kind: Beginning, path: str | os.PathLike[str], *, device: str | None = None) -> View:
    """Write a file to begin with: a device, a law of the ground, a study, or the campaign of a folder of records.

    Parameters
    ----------
    kind
        device and study are scene and study files (TOML), law a Python file, campaign a campaign.toml for the records
        that lie in a folder.
    path
        The file to write, which is never replaced; for a campaign the folder of its records.
    device
        What to begin with: of a device a packaged one to copy, of a study its scene, of a campaign what is known
        beforehand.

    Returns
    -------
    View
        The file that was written, what to do with it, and remarks on the records.

    Raises
    ------
    InputError
        Where there is such a file already, or no records, or a device that cannot be read.
    """
    if kind not in get_args(Beginning):
        raise InputError(f"kind: expected one of {', '.join(get_args(Beginning))}, got '{kind}'")
    target = Path(path) / "campaign.toml" if kind == "campaign" else Path(path)
    wanted = Path(TEMPLATES.get(kind, "campaign.toml")).suffix
    if target.suffix != wanted:
        raise InputError(f"'{target}': a {kind} is a {wanted} file")
    if target.exists():
        raise InputError(f"'{target}' is there already, and stays as it is; give another name")
    text, remarks = _campaign(Path(path), device) if kind == "campaign" else (_text(kind, device), [])
    write_text(target, text)
    data = {"file": str(target), "remarks": remarks}
    return View(data, Table(f"wrote {target}; {_next(kind, target)}", (), ()), tuple(together(remarks)))


def _text(kind: str, device: str | None) -> str:
    """The template of a kind, about a device where one is named."""
    if device is not None:
        scene = load_scene(device)
        if kind == "device":
            return scene_text(scene)
        if kind == "law":
            raise InputError("--device: a law belongs to no device")
    text = (packaged("tarsus.inspection") / "templates" / TEMPLATES[kind]).read_text(encoding="utf-8")
    return text if device is None else text.replace('scene = "cantilever"', f'scene = "{device}"', 1)


def _campaign(folder: Path, device: str | None) -> tuple[str, list[str]]:
    """A campaign of the records in a folder, with what each file says of itself, and what is left to say."""
    if not folder.is_dir():
        raise InputError(f"'{folder}' is no folder: a campaign begins with the folder of its records")
    names = sorted(
        file.name for file in folder.iterdir() if file.suffix.lower() in RECORDS and file.is_file()
    )
    if not names:
        raise InputError(f"'{folder}' holds no records ({', '.join(sorted(RECORDS))})")
    remarks: list[str] = []
    nameless: dict[str, None] = {}
    sets: list[str] = []
    drives: set[str] = set()
    shown: list[str] = []
    for name, files in _repeats(names).items():
        sets += [
            "",
            f"[records.{name}]",
            *_purpose(name, sets),
            f"files = {text_of.dumps(pattern_of(files, names), ensure_ascii=False)}",
        ]
        try:
            record = read_measurement(folder / files[0])
        except InputError as error:
            found = [re.search(r"what channel '([^']*)' measures", said) for said in error.problems]
            nameless |= {one[1]: None for one in found if one is not None}
            other = [said for said, one in zip(error.problems, found, strict=True) if one is None]
            remarks += error.problems
            sets += ["# the file does not tell enough, say it here:"] * bool(other)
            sets += [f"#   {problem}" for problem in other]
            continue
        drives |= {record.drive} if record.drive else set()
        channels = [
            f'# channel "{one.name}" [{one.quantity.unit}] looks at point "{one.at}"'
            for one in record.channels
        ]
        sets += [] if channels == shown else channels
        shown = channels
    lines = [
        '# Which record serves which step; see the page "Identification" of the documentation.',
        f'name = "{folder.resolve().name}"',
        "# What is known beforehand: a device, or a scene file, named from this folder.",
        f'device = "{_from(folder, device)}"',
        "",
        "# What holds for all sets of records that say nothing else. Take away a # where a line is right.",
        "[defaults]",
        'rest = "0 s"                 # at rest before the drive begins',
        f'drive = "{drives.pop()}"'
        if len(drives) == 1
        else '# drive = "the channel that recorded the volts"',
        *_channels(list(nameless), _points(folder, device)),
        "",
        "# purpose: modal (sweeps in the air), loops, ramps (adhesion), bounces, air, close or validation.",
    ]
    return "\n".join([*lines, *sets]) + "\n", remarks


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


SIGNALS = {
    "modal": '{ kind = "swept_sine", amplitude = "0.2 V", start_frequency = "200 Hz", stop_frequency = "9 kHz", '
    'duration = "1 s" }',
    "ramps": '{ kind = "ramped_square", amplitude = "8 V", frequency = "5 Hz", duty = 0.25 }',
    "bounces": '{ kind = "square", amplitude = "2 V", frequency = "300 Hz" }',
    "air": '{ kind = "square", amplitude = "2 V", frequency = "300 Hz" }',
    "validation": '{ kind = "sine", amplitude = "6 V", frequency = "50 Hz" }',
}
"""What drove the records, to be filled in, by purpose."""
UNITS = {
    "v": "mm/s",
    "vel": "mm/s",
    "velocity": "mm/s",
    "x": "um",
    "disp": "um",
    "displacement": "um",
    "pos": "um",
}
"""Units of a vibrometer's outputs by the last word of a channel's name; volts for words that name a drive."""


def _channels(names: list[str], points: tuple[str, ...]) -> list[str]:
    """Lines that say what channels measure, with what their names suggest, each to be uncommented."""
    if not names:
        return ["# [defaults.channels]", '# "name in the file" = { unit = "mm/s", point = "tip" }']
    lines = [
        "# Files do not say what these channels measure; a file that lacks one is read without it.",
        "# [defaults.channels]",
    ]
    for name in names:
        words = re.findall(r"[a-z]+", name.lower())
        unit = (
            "V"
            if re.search(r"volt|drive|amp|pzt", name.lower())
            else UNITS.get(words[-1] if words else "", "?")
        )
        point = next((one for one in points if one.lower() in name.lower()), "?")
        key = name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else text_of.dumps(name)
        said = '"V"' if unit == "V" else f'{{ unit = "{unit}", point = "{point}" }}'
        lines.append(f"# {key} = {said}")
    return lines


def _points(folder: Path, device: str | None) -> tuple[str, ...]:
    """Points of the device, where it can be read already."""
    try:
        return tuple(load_scene(device or folder / "device.toml").robot.structure.points)
    except InputError:  # the campaign file comes first, and its check tells
        return ()


def _from(folder: Path, device: str | None) -> str:
    """A device by name, or its file as named from the folder of the campaign."""
    if device is None or not Path(device).is_file():
        return device or "device.toml"
    return Path(os.path.relpath(device, folder)).as_posix()


def _repeats(names: list[str]) -> dict[str, list[str]]:
    """Files by set: those whose names differ in a last number only are repeats of one experiment."""
    sets: dict[str, list[str]] = {}
    for name in names:
        stem = re.sub(r"[-_ ]*\d+$", "", Path(name).stem) or Path(name).stem
        key = scene_name(stem).strip("_-") or "records"
        sets.setdefault(key, []).append(name)
    return sets


def _next(kind: str, target: Path) -> str:
    """What to do with it."""
    if kind == "law":
        return f"try it with `tarsus simulate cantilever --law {target}`"
    if kind == "study":
        return f"run it with `tarsus sweep {target} -o FOLDER`"
    if kind == "campaign":
        return f"say what each set is for, then `tarsus check {target}` and `tarsus identify {target}`"
    return f"run it with `tarsus simulate {target} -o FOLDER`"
