"""The study of a table: a Python file that names a device, a table and its unknowns, with one function of a row."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from types import ModuleType
from typing import Any

from tarsus.base.errors import InputError, InputProblem
from tarsus.base.messages import nearest
from tarsus.base.spec import validate
from tarsus.calibrate.description import Study
from tarsus.files.installed import is_path, study_path
from tarsus.files.jsontext import json_text, read_json
from tarsus.files.library import load_scene
from tarsus.files.rowfunction import RowFunction
from tarsus.files.rows import TableRows, parse_rows
from tarsus.files.tables import FileKind, read_table, read_text
from tarsus.files.toml import SCENE_FILE, scene_text
from tarsus.model.laws import Law

STUDY_FILE, ASKED_FILE, TABLE_FILE = "study.py", "study.json", "table.csv"
"""Files of a calibration's folder: the study as it was given, what of it was asked for, and its table."""
FUNCTION = "changes"
CLOSE = 0.8
"""Likeness (`difflib`) of a misspelt setting: one letter of five is wrong, or two of ten."""


@dataclass(frozen=True)
class Described:
    """A study, its table, and its function ``changes(unknowns, row)``: changes of the scene by path."""

    study: Study
    table: TableRows
    defined: RowFunction


def load_study(name: str | os.PathLike[str], laws: Mapping[str, type[Law]] | None = None) -> Described:
    """A packaged study by name, or a study file by path, with its table.

    Parameters
    ----------
    name
        A packaged study, or the path of a Python file. Its device is a device's name or a scene file's path from the
        study's own folder; its table is a path from there. In the folder of a calibration: what was asked there.
    laws
        Classes of user laws by name (`tarsus.load_laws`), where the scene has them.

    Raises
    ------
    InputError
        With every problem of the file.
    """
    file = study_path(name, FileKind.CALIBRATION)
    if file.suffix == ".toml":
        read_table(file, FileKind.CALIBRATION)
        raise InputError(
            f"{file}: the study of a table is a Python file that defines {FUNCTION}(unknowns, row); "
            "docs/calibrate.md shows how one is written"
        )
    defined = RowFunction.read(file, FUNCTION, "unknowns, row")
    kept = file.parent / ASKED_FILE
    raw = read_json(kept) if kept.is_file() else _settings(defined.module)
    problems: list[InputProblem | str] = []
    scene, table = raw.pop("device", None), raw.pop("table", None)
    if not isinstance(table, str):
        problems.append("table: expected the path of the table (CSV), from the study's folder")
    else:
        try:
            table = parse_rows(read_text(file.parent / table), table)
        except InputError as error:
            problems += [f"table: {said}" for said in error.problems]
    if not isinstance(scene, str):
        problems.append("device: expected the name of a device, or the path of a scene file")
    else:
        try:
            scene = load_scene(file.parent / scene if is_path(scene) else scene, laws=laws)
        except InputError as error:
            problems += [f"device: {said}" for said in error.problems]
    whole = not isinstance(scene, str | None)
    try:
        study = validate(Study, {"name": file.stem, **raw, "scene": scene if whole else None})
    except InputError as error:
        problems += [one for one in error.problems if whole or one.path.partition(".")[0] != "scene"]
        raise InputError(problems) from None
    if problems or not isinstance(table, TableRows):
        raise InputError(problems)
    return Described(study, table, defined)


def _settings(module: ModuleType) -> dict[str, Any]:
    """What a file says of its study, by name. Raises InputError for names that look like one of these."""
    fields = ("device", "table", *(name for name in Study.model_fields if name != "scene"))
    plain = {
        name: value
        for name, value in vars(module).items()
        if not name.startswith("_") and isinstance(value, str | int | float | list | tuple | dict)
    }
    problems = [
        f"there is no setting '{name}'{nearest(name, fields)}"
        for name in plain
        if name not in fields and get_close_matches(name, fields, 1, CLOSE)
    ]
    if problems:
        raise InputError(problems)
    return {name: value for name, value in plain.items() if name in fields}


def frozen_texts(described: Described) -> dict[str, str]:
    """A study as the texts of four files by name, which `load_study` reads back to an equal one."""
    asked = described.study.model_dump(mode="json", exclude={"scene"}, exclude_defaults=True)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(described.table.columns)
    writer.writerows([row[column] for column in described.table.columns] for row in described.table.rows)
    return {
        STUDY_FILE: described.defined.source.decode("utf-8"),
        ASKED_FILE: json_text({"device": SCENE_FILE, "table": TABLE_FILE, **asked}, indent=1) + "\n",
        SCENE_FILE: scene_text(described.study.scene),
        TABLE_FILE: out.getvalue(),
    }
