"""Studies in TOML, and those of installed packages by name."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tarsus.errors import InputError
from tarsus.files.installed import STUDIES, file_names, named_file
from tarsus.files.library import load_scene
from tarsus.laws import Law
from tarsus.scene import Scene, override
from tarsus.spec import validate
from tarsus.study.sweep import Sweep

__all__ = ["SCENE_FILE", "STUDY_FILE", "frozen_texts", "load_sweep", "read_sweep", "study_names"]

STUDY_FILE = "study.toml"
SCENE_FILE = "scene.toml"

_SHORT = ("volts", "hz", "wave")
_AXIS_FIELDS = {"kind", "paths", "values", "start", "stop", "count"}


def study_names() -> list[str]:
    """Names of the studies of installed packages."""
    return file_names(STUDIES)


def load_sweep(name: str | os.PathLike[str], laws: Mapping[str, type[Law]] | None = None) -> Sweep:
    """A packaged study by name, or a study file by path.

    Parameters
    ----------
    name
        One of `study_names`, or the path of a TOML file.
    laws
        Classes of user laws by name (`tarsus.load_laws`), where the scene has them.

    Raises
    ------
    InputError
        For an unknown name, and with every problem of the file.
    """
    text = os.fspath(name)
    is_path = text.endswith(".toml") or os.sep in text
    return read_sweep(text if is_path else named_file(STUDIES, text, "study"), laws)


def read_sweep(path: str | os.PathLike[str], laws: Mapping[str, type[Law]] | None = None) -> Sweep:
    """Read a study from a TOML file.

    Parameters
    ----------
    path
        The file. Its scene is a device's name, or a scene file's path from the study's own folder.
    laws
        Classes of user laws by name (`tarsus.load_laws`), where the scene has them.

    Raises
    ------
    InputError
        With every problem of the file: path, what was expected, nearest valid name.
    """
    file = Path(path)
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no text file (UTF-8)") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {(error.strerror or str(error)).lower()}") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{file}: not valid TOML: {error}") from None
    table["scene"] = _scene(table.get("scene"), table.pop("set", {}), file.parent, laws)
    if isinstance(table.get("vary"), Mapping):
        table["vary"] = dict(_flat(table["vary"]))
    return validate(Sweep, {"name": file.stem, **table})


def _scene(named: Any, settings: Any, folder: Path, laws: Mapping[str, type[Law]] | None) -> Scene:
    if not isinstance(named, str):
        raise InputError(f"scene: expected the name of a device or the path of a scene file, got {named!r}")
    if not isinstance(settings, Mapping):
        raise InputError(f"set: expected a table of paths and values, got {settings!r}")
    is_file = named.endswith(".toml") or os.sep in named
    values = dict(_flat(settings))
    short = {key: values.pop(key) for key in _SHORT if key in values}
    try:
        scene = load_scene(folder / named if is_file else named, laws=laws, **short)
    except InputError as error:
        raise InputError([f"scene: {problem}" for problem in error.problems]) from None
    try:
        return override(scene, values, by="a study") if values else scene
    except InputError as error:
        raise InputError([f"set.{problem}" for problem in error.problems]) from None


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values by path, whether its names were written as one quoted key or as nested tables."""
    for key, value in table.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping) and value and "." not in key and not _AXIS_FIELDS & set(value):
            yield from _flat(value, f"{path}.")
        else:
            yield path, value


def frozen_texts(sweep: Sweep) -> dict[str, str]:
    """A sweep as the texts of two files by name, which `read_sweep` reads back to an equal sweep.

    Every setting is resolved and in SI: the study file holds what varies, the scene file the whole scene.
    """
    import tomlkit

    from tarsus.files.toml import scene_text

    table = sweep.model_dump(mode="json", exclude={"scene"}, exclude_none=True)
    for axis in table["vary"].values():
        if not axis["paths"]:
            del axis["paths"]
    study = {"name": table.pop("name"), "scene": SCENE_FILE, **table}
    return {STUDY_FILE: tomlkit.dumps(study), SCENE_FILE: scene_text(sweep.scene)}
