"""Devices and studies by name: the library's own files, and what installed packages add to Tarsus by entry points.

An entry point of a group is the path of one file, called as the entry point, or of a folder of them, each called as its
file. Devices and sweeps are TOML; the study of a table is a Python file.
"""

from __future__ import annotations

import os
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.files import kinds
from tarsus.files.kinds import folder_sentence, kind_of_path
from tarsus.files.tables import PYTHON, FileKind, kind_of_table, read_table

DEVICES, STUDIES = "tarsus.devices", "tarsus.studies"
"""Entry point groups of files."""

_DATA = Path(__file__).parents[1] / "data"
_OWN = {DEVICES: _DATA / "devices", STUDIES: _DATA / "studies"}
"""Folders of the library's own files, by group: machines of other sources than any package's."""

_WORDS = {
    DEVICES: ("device", "scene", ".toml", kinds.SCENES),
    STUDIES: ("study", "study", ".toml", kinds.STUDIES),
    FileKind.CALIBRATION: ("calibration", "study", PYTHON, kinds.STUDIES),
}
"""What one of a group is called, a file of the kind that is not packaged and its ending, and such files in folders."""


def device_names() -> list[str]:
    """Names of all devices: the library's own and those of installed packages.

    Returns
    -------
    list[str]
        In alphabetical order; each is a name for `load_scene`.
    """
    return list(_files(DEVICES))


def study_names() -> list[str]:
    """Names of the sweeps among the studies, the library's own and those of installed packages."""
    return [name for name in _files(STUDIES) if _kind(name) is not FileKind.CALIBRATION]


def calibration_names() -> list[str]:
    """Names of the calibrations among the studies of installed packages."""
    return [name for name in _files(STUDIES) if _kind(name) is FileKind.CALIBRATION]


def device_path(name: str) -> Path:
    """File of a device by name; `InputError` for an unknown name, and where its package cannot be loaded."""
    return _named(DEVICES, name)


def device_title(name: str) -> str:
    """What a device or scene file is, in its own words: its first line, where that is a comment; else ""."""
    with (Path(name) if is_path(name) else device_path(name)).open(encoding="utf-8") as file:
        first = file.readline()
    return first.lstrip("# ").strip() if first.startswith("#") else ""


def study_path(name: str | os.PathLike[str], kind: FileKind) -> Path:
    """File of an installed study of a kind by name, or the path itself; `InputError` as `device_path`."""
    text = os.fspath(name)
    if is_path(text):
        return Path(text)
    if text in _files(STUDIES) or Path(text).exists():
        return _named(STUDIES, text, _WORDS.get(kind))
    known = [one for one in _files(STUDIES) if (_kind(one) is FileKind.CALIBRATION) is (kind is FileKind.CALIBRATION)]
    device = ", which is a device" * (text in _files(DEVICES))
    ending = _WORDS.get(kind, _WORDS[STUDIES])[2]
    raise InputError(
        f"no {kind.word} is called '{text}'{device}{nearest(text, known)} (a file of your own ends in {ending})"
    )


def is_path(text: str) -> bool:
    """Whether a word is the path of a file, and no name; a folder is neither."""
    return text.endswith((".toml", PYTHON)) or (os.sep in text and not os.path.isdir(text))


def kind_of(name: str) -> FileKind:
    """The kind of what a name stands for; `DEVICE` where it stands for nothing, which reading it will say.

    Raises InputError for a folder that holds nothing of tarsus, and as `kind_of_path`.
    """
    path = Path(name)
    found = None if name in device_names() and not path.is_dir() else kind_of_path(path)
    if path.is_dir() and found is None:
        raise InputError(f"'{path}' is a folder that holds no result of tarsus and no campaign{folder_sentence(path)}")
    if found is not None or name in device_names() or name.endswith(".toml"):
        return found or FileKind.DEVICE
    if path.suffix:
        return FileKind.RECORD
    if name in study_names():
        return FileKind.SWEEP
    return FileKind.CALIBRATION if name in calibration_names() else FileKind.DEVICE


def _kind(name: str) -> FileKind | None:
    file = _named(STUDIES, name)
    return FileKind.CALIBRATION if file.suffix == PYTHON else kind_of_table(read_table(file))


@lru_cache(maxsize=8)
def _files(group: str) -> dict[str, Path | InputError]:
    """Files of a group by name; what cannot be loaded is there with the reason."""
    found: dict[str, Path | InputError] = _inside(_OWN[group])
    for entry in sorted(entry_points(group=group), key=lambda entry: entry.name):
        loaded = _loaded(entry)
        if isinstance(loaded, Path) and loaded.is_dir():
            # the first package that has a name keeps it
            found = {**_inside(loaded), **found}
        else:
            found.setdefault(entry.name, loaded)
    return dict(sorted(found.items()))


def _inside(folder: Path) -> dict[str, Path | InputError]:
    """Files of a folder by name."""
    return {file.stem: file for file in sorted(folder.iterdir()) if file.suffix in (".toml", PYTHON)}


def _loaded(entry: EntryPoint) -> Path | InputError:
    try:
        return Path(entry.load())
    except Exception as error:
        return InputError(f"'{entry.name}' of package {entry.value} cannot be loaded: {error}")


def _named(group: str, name: str, words: tuple[str, str, str, tuple[str, ...]] | None = None) -> Path:
    files, (what, kind, ending, inside) = _files(group), words or _WORDS[group]
    found = files.get(name)
    if isinstance(found, InputError):
        raise InputError([f"{what} {problem}" for problem in found.problems])
    if found is not None:
        return found
    path = Path(name)
    if name and path.exists():
        is_ = "a folder" if path.is_dir() else f"a file whose name does not end in {ending}"
        hint = folder_sentence(path, inside) if path.is_dir() else ""
        raise InputError(f"'{name}' is {is_}: expected a {what} by name, or a {kind} file ({ending}){hint}")
    raise InputError(
        f"no {what} is called '{name}'{nearest(name, files)} (a {kind} file is given by its path, ending in .toml)"
    )
