"""What files and folders hold: one table of their kinds, which every verb asks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.files.jsontext import read_json
from tarsus.files.series import is_ours
from tarsus.files.tables import FileKind, kind_of_table, read_table

PLAN_FILE, SUMMARY_FILE = "plan.json", "summary.json"
"""What is to be run in a folder, and what one run came to."""

MARKS = {
    SUMMARY_FILE: FileKind.RUN,
    "calibration.json": FileKind.FITTED,
    "yield.json": FileKind.YIELD,
    "branch.json": FileKind.BRANCH,
    "attractors.json": FileKind.ATTRACTORS,
    "atlas.json": FileKind.ATLAS,
    "modes.json": FileKind.MODES,
    "identification.json": FileKind.IDENTIFICATION,
    "track.json": FileKind.TRACKING,
    "landing.json": FileKind.LANDING,
    "gaits.json": FileKind.GAITS,
    "designs.json": FileKind.DESIGN,
    "adapt.json": FileKind.ADAPTIVE,
    "reproduction.json": FileKind.REPRODUCTION,
    "validation.json": FileKind.VALIDATION,
    "claims.toml": FileKind.EXPERIMENT,
    "campaign.toml": FileKind.CAMPAIGN,
    PLAN_FILE: FileKind.SWEEP_RUNS,
}
"""The file of a folder that shows what it holds; the first one that is there counts: many keep their runs by a plan."""

SCENES, STUDIES = ("scene.toml", "identified.toml"), ("study.toml", "study.py")
"""Files of such folders that a verb takes where a device or a study is wanted."""


def kind_of_path(path: Path) -> FileKind | None:
    """The kind of a file or folder; None of a folder that holds nothing of tarsus, and of a file that is not there.

    Raises InputError for a TOML file that cannot be read, and for a page or data that stand for no whole result.
    """
    if path.is_dir():
        return _kind_of_folder(path)
    if path.suffix == ".toml" and path.is_file():
        return kind_of_table(read_table(path)) or FileKind.SCENE
    if not path.exists():
        return None
    if path.suffix == ".py":
        return FileKind.CALIBRATION
    if path.suffix == ".npz":
        return FileKind.DRAWS
    if path.suffix == ".nc" and is_ours(path):
        return FileKind.SERIES
    if path.suffix == ".html":
        raise InputError(f"'{path}' is a page: open it in a browser, or give the folder of its result")
    if path.suffix == ".json" and path.name not in MARKS:
        raise InputError(f"'{path}' is a part of a result at most: give its folder")
    return MARKS.get(path.name, FileKind.RECORD)


def _kind_of_folder(folder: Path) -> FileKind | None:
    """The kind of what a folder holds: a result, a campaign, or folders of such."""
    mark = mark_of(folder)
    if mark is None:
        within = any(one.is_dir() and mark_of(one) for one in folder.iterdir())
        return FileKind.FOLDERS if within else None
    if mark == PLAN_FILE and not plan_of(folder).get("runs"):
        return FileKind.UNFINISHED
    return MARKS[mark]


def plan_of(folder: Path) -> dict[str, Any]:
    """The plan of a folder that keeps runs; nothing where it is damaged."""
    try:
        return read_json(folder / PLAN_FILE)
    except InputError:
        return {}


def mark_of(folder: Path) -> str | None:
    """The file that shows what a folder holds; None where none does."""
    return next((name for name in MARKS if (folder / name).is_file()), None)


def folder_sentence(folder: Path, wanted: Sequence[str] = (*SCENES, *STUDIES)) -> str:
    """What a folder holds instead of what was asked for, and the first of the wanted descriptions that is in it."""
    kind = _kind_of_folder(folder)
    inside = next((name for name in wanted if (folder / name).is_file()), None)
    said = "" if kind is None else f"; it holds {kind.value[1]} ({kind.value[2]})"
    return said + (f"; it holds {inside}: give '{folder / inside}'" if inside else "")
