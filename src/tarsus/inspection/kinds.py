"""What a name stands for: a device, a study, or a file or folder of one of the kinds that Tarsus reads and writes."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.files.installed import calibration_names, study_names
from tarsus.files.library import device_names
from tarsus.files.runstore import PLAN_FILE
from tarsus.files.store import SUMMARY_FILE
from tarsus.files.tables import FileKind, kind_of_table, read_table


class Holding(Enum):
    """Kinds of what a name stands for, in words."""

    DEVICE = "device"
    SCENE = "scene"
    STUDY = "study"
    CALIBRATION = "calibration"
    CAMPAIGN = "campaign"
    RUN = "run"
    SWEEP = "sweep"
    RECORD = "record"


_OF_TABLES = {
    FileKind.CAMPAIGN: Holding.CAMPAIGN,
    FileKind.CALIBRATION: Holding.CALIBRATION,
    FileKind.SWEEP: Holding.STUDY,
}
_OF_FOLDERS = {SUMMARY_FILE: Holding.RUN, PLAN_FILE: Holding.SWEEP, "campaign.toml": Holding.CAMPAIGN}


def holding_of(name: str) -> Holding:
    """The kind of what a name stands for; `DEVICE` where it stands for nothing, which reading it will say.

    Raises InputError for a folder that holds none of them.
    """
    path = Path(name)
    if path.is_dir():
        return _of_folder(path)
    if name.endswith(".toml"):
        kind = kind_of_table(read_table(path)) if path.is_file() else None
        if kind is None:
            return Holding.SCENE if path.is_file() else Holding.DEVICE
        return _OF_TABLES.get(kind, Holding.SCENE)
    if name in device_names():
        return Holding.DEVICE
    if path.exists() or path.suffix:
        return Holding.RECORD
    if name in study_names():
        return Holding.STUDY
    return Holding.CALIBRATION if name in calibration_names() else Holding.DEVICE


def _of_folder(path: Path) -> Holding:
    for file, kind in _OF_FOLDERS.items():
        if (path / file).is_file():
            return kind
    scene = f"; it holds scene.toml: give '{path / 'scene.toml'}'" if (path / "scene.toml").is_file() else ""
    raise InputError(f"'{path}' is a folder that holds no run, sweep or campaign{scene}")
