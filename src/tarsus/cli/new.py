"""`tarsus new`: a file to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from tarsus.cli.options import Json

TEMPLATES = {"device": "device.toml", "law": "law.py", "study": "study.toml"}
RECORDS = {".uff", ".unv", ".mat", ".h5", ".hdf5", ".nc", ".tdms", ".lvm", ".csv", ".txt", ".asc", ".dat"}
"""Names of files that a campaign takes for records."""


def new(
    kind: Literal["device", "law", "study", "campaign"],
    path: Path,
    /,
    *,
    device: str | None = None,
    json: Json = False,
) -> int:
    """Write a file to begin with: a device, a law of the ground, a study, or the campaign of a folder of records.

    Parameters
    ----------
    kind
        device and study are scene and study files (TOML), law a Python file, campaign a campaign.toml for the records
        that lie in a folder.
    path
        the file to write; for a campaign the folder of its records.
    device
        what to begin with: of a device a packaged one to copy, of a study its scene, of a campaign what is known
        beforehand.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console
    from tarsus.cli.check import together
    from tarsus.files.store import write_text

    target = path / "campaign.toml" if kind == "campaign" else path
    wanted = Path(TEMPLATES.get(kind, "campaign.toml")).suffix
    if target.suffix != wanted:
        raise InputError(f"'{target}': a {kind} is a {wanted} file")
    if target.exists():
        raise InputError(f"'{target}' is there already, and stays as it is; give another name")
    remarks: list[str] = []
    if kind == "campaign":
        text, remarks = _campaign(path, device)
    else:
        text = _text(kind, device)
    write_text(target, text)
    if json:
        console.print_json({"file": str(target), "remarks": remarks})
        return 0
    console.note(together(remarks))
    print(f"wrote {target}; {_next(kind, target)}")
    return 0


def _text(kind: str, device: str | None) -> str:
    """The template of a kind, about a device where one is named."""
    from importlib.resources import files

    from tarsus.base.errors import InputError
    from tarsus.files.library import load_scene
    from tarsus.files.toml import scene_text

    if device is not None:
        scene = load_scene(device)
        if kind == "device":
            return scene_text(scene)
        if kind == "law":
            raise InputError("--device: a law belongs to no device")
    text = (files("tarsus.cli") / "templates" / TEMPLATES[kind]).read_text(encoding="utf-8")
    return text if device is None else text.replace('scene = "cantilever"', f'scene = "{device}"', 1)


def _campaign(folder: Path, device: str | None) -> tuple[str, list[str]]:
    """A campaign of the records in a folder, with what each file says of itself, and what is left to say."""
    from tarsus.base.errors import InputError
    from tarsus.records.readers import read_measurement

    if not folder.is_dir():
        raise InputError(f"'{folder}' is no folder: a campaign begins with the folder of its records")
    names = sorted(
        file.name for file in folder.iterdir() if file.suffix.lower() in RECORDS and file.is_file()
    )
    if not names:
        raise InputError(f"'{folder}' holds no records ({', '.join(sorted(RECORDS))})")
    lines = [
        '# Which record serves which step; see the page "Identification" of the documentation.',
        f'name = "{folder.resolve().name}"',
        "# What is known beforehand: a device, or a scene file, named from this folder.",
        f'device = "{_from(folder, device)}"',
        "",
        "# purpose: modal (sweeps in the air), loops, ramps (adhesion), bounces, air, close or validation.",
    ]
    remarks = []
    for name, files in _repeats(names).items():
        lines += [
            "",
            f"[records.{name}]",
            'purpose = "validation"       # say what for',
            f"files = {_list(files)}",
        ]
        lines += ['rest = "0 s"                 # at rest before the drive begins']
        try:
            record = read_measurement(folder / files[0])
        except InputError as error:
            remarks += error.problems
            lines += [
                "# channels: the file does not tell enough, say it here:",
                "# [records." + name + ".channels]",
            ]
            lines += [f"#   {problem}" for problem in error.problems]
            continue
        lines += [
            f'drive = "{record.drive}"' if record.drive else '# drive = "the channel that recorded the volts"'
        ]
        if not any(line.startswith("# signal = ") for line in lines):
            lines += [
                "# what drove it, of modal, loops, ramps and bounces, such as",
                '# signal = { kind = "ramped_square", amplitude = "8 V", frequency = "5 Hz", duty = 0.25 }',
            ]
        lines += [
            f'# channel "{one.name}" [{one.quantity.unit}] looks at point "{one.at}"'
            for one in record.channels
        ]
    return "\n".join(lines) + "\n", remarks


def _from(folder: Path, device: str | None) -> str:
    """A device by name, or its file as named from the folder of the campaign."""
    import os

    if device is None or not Path(device).is_file():
        return device or "device.toml"
    return Path(os.path.relpath(device, folder)).as_posix()


def _repeats(names: list[str]) -> dict[str, list[str]]:
    """Files by set: those whose names differ in a last number only are repeats of one experiment."""
    import re

    sets: dict[str, list[str]] = {}
    for name in names:
        stem = re.sub(r"[-_ ]*\d+$", "", Path(name).stem) or Path(name).stem
        key = re.sub(r"[^A-Za-z0-9_-]+", "-", stem).strip("-") or "records"
        sets.setdefault(key, []).append(name)
    return sets


def _list(names: list[str]) -> str:
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"


def _next(kind: str, target: Path) -> str:
    """What to do with it."""
    if kind == "law":
        return f"try it with `tarsus simulate cantilever --law {target}`"
    if kind == "study":
        return f"run it with `tarsus sweep {target} -o FOLDER`"
    if kind == "campaign":
        return f"say what each set is for, then `tarsus check {target}` and `tarsus identify {target}`"
    return f"run it with `tarsus simulate {target} -o FOLDER`"
