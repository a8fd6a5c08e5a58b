"""TOML files by name: the library's own, and what installed packages add to Tarsus by entry points.

An entry point of a group of files is the path of one TOML file, called as the entry point, or of a folder of them, each
called as its file.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest

__all__ = ["DEVICES", "STUDIES", "file_names", "named_file"]

DEVICES, STUDIES = "tarsus.devices", "tarsus.studies"
"""Entry point groups of files."""

_OWN = {DEVICES: Path(__file__).parents[1] / "data" / "devices"}
"""Folders of the library's own files, by group: machines of other sources than any package's."""


@lru_cache(maxsize=8)
def _files(group: str) -> dict[str, Path | InputError]:
    """Files of a group by name; what cannot be loaded is there with the reason."""
    found: dict[str, Path | InputError] = {}
    if group in _OWN:
        found = {file.stem: file for file in sorted(_OWN[group].glob("*.toml"))}
    for entry in sorted(entry_points(group=group), key=lambda entry: entry.name):
        loaded = _loaded(entry)
        if isinstance(loaded, Path) and loaded.is_dir():
            # the first package that has a name keeps it
            found = {**{file.stem: file for file in sorted(loaded.glob("*.toml"))}, **found}
        else:
            found.setdefault(entry.name, loaded)
    return dict(sorted(found.items()))


def _loaded(entry: EntryPoint) -> Path | InputError:
    try:
        return Path(entry.load())
    except Exception as error:
        return InputError(f"'{entry.name}' of package {entry.value} cannot be loaded: {error}")


def file_names(group: str) -> list[str]:
    """Names of all files of a group, sorted."""
    return list(_files(group))


def named_file(group: str, name: str, what: str) -> Path:
    """The file of a group by its name; `what` it is, for the sentences: 'device'.

    Raises
    ------
    InputError
        For an unknown name, and for a file whose package cannot be loaded.
    """
    files = _files(group)
    if name not in files:
        path = Path(name)
        if name and path.exists():
            is_ = "a folder" if path.is_dir() else "a file whose name does not end in .toml"
            inside = next((one for one in _INSIDE[what] if (path / one).is_file()), None)
            hint = f"; it holds {inside}: give '{path / inside}'" if inside else ""
            raise InputError(f"'{name}' is {is_}: expected a {what} by name, or a {_FILE[what]} file (TOML){hint}")
        hint = nearest(name, files)
        raise InputError(
            f"no {what} is called '{name}'{hint} (a {_FILE[what]} file is given by its path, ending in .toml)"
        )
    found = files[name]
    if isinstance(found, InputError):
        raise InputError([f"{what} {problem}" for problem in found.problems])
    return found


_FILE = {"device": "scene", "study": "study"}
"""What a file of the kind is called where it is not packaged."""

_INSIDE = {"device": ("scene.toml", "identified.toml"), "study": ("study.toml",)}
"""Where such a file lies in folders that verbs write."""
