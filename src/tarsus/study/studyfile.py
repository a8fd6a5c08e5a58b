"""Studies in TOML, and those of installed packages by name."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.files.installed import STUDIES, file_names, named_file
from tarsus.files.library import load_scene
from tarsus.files.tables import Kind, expect, kind_of_table, read_table
from tarsus.files.toml import scene_texts
from tarsus.model.laws import Law, load_laws
from tarsus.model.scene import Scene, override
from tarsus.study.axes import Sobol, keep_powers, sobol_powers
from tarsus.study.manufacture import Scattered
from tarsus.study.sweep import Sweep

__all__ = [
    "SCENE_FILE",
    "STUDY_FILE",
    "calibration_names",
    "flat_values",
    "frozen_sweep",
    "frozen_texts",
    "load_sweep",
    "read_sweep",
    "scene_of_study",
    "stored_texts",
    "study_names",
    "study_path",
]

STUDY_FILE = "study.toml"
SCENE_FILE = "scene.toml"
LAWS = "laws"
SOBOL_FILE = "sobol.json"
"""What a Sobol sequence is made of, so that who continues need not find it again."""

_SHORT = ("volts", "hz", "wave")
_AXIS_FIELDS = {"kind", "paths", "values", "start", "stop", "count"}


def study_names() -> list[str]:
    """Names of the sweeps among the studies of installed packages."""
    return [name for name in file_names(STUDIES) if _kind(name) is not Kind.CALIBRATION]


def calibration_names() -> list[str]:
    """Names of the calibrations among the studies of installed packages."""
    return [name for name in file_names(STUDIES) if _kind(name) is Kind.CALIBRATION]


def _kind(name: str) -> Kind | None:
    return kind_of_table(read_table(study_path(name)))


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
    return read_sweep(study_path(name), laws)


def study_path(name: str | os.PathLike[str]) -> Path:
    """File of an installed study by name, or the path itself; `InputError` for an unknown name."""
    text = os.fspath(name)
    if text.endswith(".toml") or os.sep in text:
        return Path(text)
    return named_file(STUDIES, text, "study")


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
    table = read_table(file)
    expect(Kind.SWEEP, table, str(file))
    table["scene"] = scene_of_study(table.get("scene"), table.pop("set", {}), file.parent, laws)
    if isinstance(table.get("vary"), Mapping):
        table["vary"] = dict(flat_values(table["vary"]))
    return validate(Sweep, {"name": file.stem, **table})


def scene_of_study(named: Any, settings: Any, folder: Path, laws: Mapping[str, type[Law]] | None) -> Scene:
    """The scene that a study names (a device, or a file from the study's folder) with its settings."""
    if not isinstance(named, str):
        raise InputError(f"scene: expected the name of a device or the path of a scene file, got {named!r}")
    if not isinstance(settings, Mapping):
        raise InputError(f"set: expected a table of paths and values, got {settings!r}")
    is_file = named.endswith(".toml") or os.sep in named
    values = dict(flat_values(settings))
    short = {key: values.pop(key) for key in _SHORT if key in values}
    try:
        scene = load_scene(folder / named if is_file else named, laws=laws, **short)
    except InputError as error:
        raise InputError([f"scene: {problem}" for problem in error.problems]) from None
    try:
        return override(scene, values, by="a study") if values else scene
    except InputError as error:
        raise InputError([f"set.{problem}" for problem in error.problems]) from None


def flat_values(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values by path, whether its names were written as one quoted key or as nested tables."""
    for key, value in table.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping) and value and "." not in key and not _AXIS_FIELDS & set(value):
            yield from flat_values(value, f"{path}.")
        else:
            yield path, value


def frozen_texts(sweep: Sweep) -> dict[str, str]:
    """A sweep as the texts of two files by name, which `read_sweep` reads back to an equal sweep.

    Every setting is resolved and in SI: the study file holds what varies, the scene file the whole scene. Files of
    the user's laws are there as they are, in the folder `LAWS`.
    """

    import tomlkit


    table = sweep.model_dump(mode="json", exclude={"scene"}, exclude_none=True)
    for axis in table["vary"].values():
        if not axis["paths"]:
            del axis["paths"]
    study = {"name": table.pop("name"), "scene": SCENE_FILE, **table}
    texts = {STUDY_FILE: tomlkit.dumps(study), **scene_texts(sweep.scene)}
    if isinstance(sweep.design, Sobol | Scattered):
        dimensions, seed = sweep.design.dimensions(sweep.vary), sweep.design.seed
        powers = sobol_powers(dimensions, seed, sweep.runs).tolist()
        texts[SOBOL_FILE] = json.dumps({"dimensions": dimensions, "seed": seed, "powers": powers}) + "\n"
    return texts


def stored_texts(folder: Path) -> dict[str, str]:
    """The `frozen_texts` that lie in a folder, as they are."""
    laws = (f"{LAWS}/{file.name}" for file in sorted((folder / LAWS).glob("*.py")))
    names = (STUDY_FILE, SCENE_FILE, *laws, SOBOL_FILE)
    return {name: (folder / name).read_text(encoding="utf-8") for name in names if (folder / name).exists()}


def frozen_sweep(folder: Path) -> Sweep:
    """The sweep whose `frozen_texts` lie in a folder.

    Raises
    ------
    InputError
        With every problem of the files.
    """
    sobol = folder / SOBOL_FILE
    if sobol.exists():
        try:
            found = json.loads(sobol.read_text(encoding="utf-8"))
            keep_powers(found["dimensions"], found["seed"], np.array(found["powers"], dtype=np.int64))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"'{sobol}' cannot be read: {error}") from None
    laws = {
        name: law for file in sorted((folder / LAWS).glob("*.py")) for name, law in load_laws(file).items()
    }
    return read_sweep(folder / STUDY_FILE, laws)
