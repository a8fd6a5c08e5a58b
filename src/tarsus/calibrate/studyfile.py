"""Calibration studies in TOML: read by name or path, and written again so that a folder explains itself."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping
from dataclasses import dataclass

from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.calibrate.description import Study
from tarsus.files.installed import study_path
from tarsus.files.library import scene_of_study
from tarsus.files.rows import TableRows, parse_rows
from tarsus.files.tables import FileKind, expect, read_table, read_text
from tarsus.files.toml import SCENE_FILE, STUDY_FILE
from tarsus.model.laws import Law

__all__ = ["SCENE_FILE", "STUDY_FILE", "TABLE_FILE", "Described", "frozen_texts", "load_study"]

TABLE_FILE = "table.csv"


@dataclass(frozen=True)
class Described:
    """A study and its table."""

    study: Study
    table: TableRows


def load_study(name: str | os.PathLike[str], laws: Mapping[str, type[Law]] | None = None) -> Described:
    """A packaged study by name, or a study file by path, with its table.

    Parameters
    ----------
    name
        A packaged study, or the path of a TOML file. Its device is a device's name or a scene file's path from the
        study's own folder; its table is a path from there.
    laws
        Classes of user laws by name (`tarsus.load_laws`), where the scene has them.

    Raises
    ------
    InputError
        With every problem of the file.
    """
    file = study_path(name, FileKind.CALIBRATION)
    raw = read_table(file)
    expect(FileKind.CALIBRATION, raw, str(file))
    named = raw.pop("table", None)
    problems: list[str] = []
    table = None
    if isinstance(named, str):
        try:
            table = parse_rows(read_text(file.parent / named), named)
        except InputError as error:
            problems += [f"table: {said}" for said in error.problems]
    else:
        problems.append("table: expected the path of the table (CSV), from the study's folder")
    try:
        raw["scene"] = scene_of_study(raw.pop("device", None), raw.pop("set", {}), file.parent, laws)
    except InputError as error:
        problems += [
            f"device: {said.said}" if said.path == "scene" else said for said in error.problems
        ]
        raw["scene"] = None
    try:
        study = validate(Study, {"name": file.stem, **raw})
    except InputError as error:
        others = [one for one in error.problems if raw["scene"] is not None or one.path.partition(".")[0] != "scene"]
        raise InputError([*problems, *others]) from None
    if problems or table is None:
        raise InputError(problems)
    return Described(study, table)


def frozen_texts(described: Described) -> dict[str, str]:
    """A study as the texts of three files by name, which `load_study` reads back to an equal one."""
    import tomlkit

    from tarsus.files.toml import scene_text

    table = described.study.model_dump(mode="json", exclude={"scene"}, exclude_defaults=True)
    head = {"name": table.pop("name"), "device": SCENE_FILE, "table": TABLE_FILE}
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(described.table.columns)
    writer.writerows([row[column] for column in described.table.columns] for row in described.table.rows)
    return {
        STUDY_FILE: tomlkit.dumps({**head, **table}),
        SCENE_FILE: scene_text(described.study.scene),
        TABLE_FILE: out.getvalue(),
    }
