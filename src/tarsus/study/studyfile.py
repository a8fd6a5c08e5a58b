"""Sweeps as study files, and as the texts that a folder keeps of them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from tarsus.base.spec import validate
from tarsus.files.installed import study_path
from tarsus.files.library import flat_values, scene_of_study
from tarsus.files.tables import FileKind, read_table
from tarsus.files.toml import LAW_FOLDER, SCENE_FILE, STUDY_FILE, scene_texts
from tarsus.model.laws import Law, load_laws
from tarsus.study.sweep import Sweep


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
    return read_sweep(study_path(name, FileKind.SWEEP), laws)


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
    table = read_table(file, FileKind.SWEEP)
    table["scene"] = scene_of_study(table.get("scene"), table.pop("set", {}), file.parent, laws)
    if isinstance(table.get("vary"), Mapping):
        table["vary"] = dict(flat_values(table["vary"]))
    if isinstance(drawn := table.get("draw"), list):
        table["draw"] = [str(file.parent / one) if str(one).endswith(".csv") else one for one in drawn]
    return validate(Sweep, {"name": file.stem, **table})


def frozen_texts(sweep: Sweep) -> dict[str, str]:
    """A sweep as the texts of two files by name, which `read_sweep` reads back to an equal sweep.

    Every setting is resolved and in SI: the study file holds what varies, the scene file the whole scene. Files of
    the user's laws are there as they are, in the folder `LAW_FOLDER`. What a map would draw is left out.
    """
    import tomlkit

    table = sweep.model_dump(mode="json", exclude={"scene", "draw"}, exclude_none=True)
    for axis in table["vary"].values():
        if not axis["paths"]:
            del axis["paths"]
    study = {"name": table.pop("name"), "scene": SCENE_FILE, **table}
    return {STUDY_FILE: tomlkit.dumps(study), **scene_texts(sweep.scene)}


def stored_texts(folder: Path) -> dict[str, str]:
    """The `frozen_texts` that lie in a folder, as they are."""
    laws = (f"{LAW_FOLDER}/{file.name}" for file in sorted((folder / LAW_FOLDER).glob("*.py")))
    names = (STUDY_FILE, SCENE_FILE, *laws)
    return {name: (folder / name).read_text(encoding="utf-8") for name in names if (folder / name).exists()}


def frozen_sweep(folder: Path) -> Sweep:
    """The sweep whose `frozen_texts` lie in a folder.

    Raises
    ------
    InputError
        With every problem of the files.
    """
    laws = {name: law for file in sorted((folder / LAW_FOLDER).glob("*.py")) for name, law in load_laws(file).items()}
    return read_sweep(folder / STUDY_FILE, laws)
