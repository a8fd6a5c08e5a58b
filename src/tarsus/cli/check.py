"""`tarsus check`: is this a device, a scene, a study, a calibration or a campaign that can be used?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.cli.options import Json, LawFiles

if TYPE_CHECKING:
    from tarsus.model.laws import Law
    from tarsus.model.scene import Scene


def check(
    name: str,
    /,
    *,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    """Check a device, a scene, a study, a calibration or a campaign with all its records; name all errors at once.

    Parameters
    ----------
    name
        a device or packaged study by name, a file (TOML), or the folder of a campaign.
    """
    from tarsus.cli import console
    from tarsus.cli.requests import laws_of

    what, contents, remarks = _checked(name, laws_of(law or ()))
    if json:
        console.print_json({"name": name, "is": what, "contents": contents, "remarks": remarks})
        return 0
    print(f"{name} is a good {what}: {contents}.")
    console.note(remarks)
    return 0


def _checked(name: str, laws: Mapping[str, type[Law]]) -> tuple[str, str, list[str]]:
    """What a name or file is, what it holds, and remarks on it; `InputError` with all that is wrong."""
    from tarsus.files.installed import calibration_names, study_names
    from tarsus.files.library import device_names, load_scene
    from tarsus.files.tables import Kind, kind_of_table, read_table
    from tarsus.files.toml import read_scene

    path = Path(name)
    if path.is_dir():
        if not (path / "campaign.toml").is_file():
            from tarsus.base.errors import InputError

            scene = f"; its scene is checked by `tarsus check {path / 'scene.toml'}`"
            raise InputError(
                f"'{path}' is no folder of a campaign: it holds no campaign.toml"
                + (scene if (path / "scene.toml").is_file() else "")
            )
        return _campaign(path)
    if not name.endswith(".toml") and name not in device_names() and not path.exists():
        if name in study_names():
            return _sweep(name, laws)
        if name in calibration_names():
            return _calibration(name, laws)
    if not path.is_file():
        return _scene("device", load_scene(name, laws=laws))
    match kind_of_table(read_table(path)):
        case Kind.CAMPAIGN:
            return _campaign(path)
        case Kind.CALIBRATION:
            return _calibration(name, laws)
        case Kind.SWEEP:
            return _sweep(name, laws)
    return _scene("scene", read_scene(path, laws))


def _scene(what: str, scene: Scene) -> tuple[str, str, list[str]]:
    from tarsus.base.plausible import remarks
    from tarsus.base.spec import float_paths

    counts = (
        _count(len(scene.robot.drives), "drive"),
        _count(len(scene.robot.feet), "foot", "feet"),
        _count(len(float_paths(scene)), "value"),
    )
    return what, f"{scene.name} ({', '.join(counts)})", remarks(scene)


def _sweep(name: str, laws: Mapping[str, type[Law]]) -> tuple[str, str, list[str]]:
    from tarsus.base.plausible import remarks
    from tarsus.study.studyfile import load_sweep

    study = load_sweep(name, laws)
    return "study", f"{study.name} ({_count(study.runs, 'run')} of {study.seconds:g} s)", remarks(study.scene)


def _calibration(name: str, laws: Mapping[str, type[Law]]) -> tuple[str, str, list[str]]:
    from tarsus.calibrate.studyfile import load_study

    described = load_study(name, laws)
    study: Any = described.study
    return "calibration", f"{_count(len(study.unknowns), 'unknown')}", []


def _campaign(path: Path) -> tuple[str, str, list[str]]:
    """A campaign is good when its file is, and every record can be read and has what its purpose needs."""
    from tarsus.base.errors import InputError
    from tarsus.identify.campaign import read_campaign
    from tarsus.identify.readiness import readiness_of

    opened = read_campaign(path)
    sets = opened.campaign.records
    found = readiness_of(opened)
    read = found.readings
    if found.problems:
        raise InputError(together([*found.problems, *found.remarks]))
    notes = [note for reading in read if reading.record is not None for note in reading.record.notes]
    notes += found.remarks
    counts = (_count(len(sets), "set") + " of records", _count(len(read), "file"))
    return "campaign", f"{opened.campaign.name} ({', '.join(counts)})", together(notes)


def together(sentences: Sequence[str]) -> list[str]:
    """Sentences `file: what`, with one for all files of which the same is said."""
    files: dict[str, list[str]] = {}
    for sentence in sentences:
        file, _, said = sentence.partition(": ")
        files.setdefault(said, []).append(file)
    return [
        f"{of[0]}{f' and {len(of) - 1} more' if len(of) > 1 else ''}: {said}" for said, of in files.items()
    ]


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"
