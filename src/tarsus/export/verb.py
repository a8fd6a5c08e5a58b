"""The verb `tarsus.export`: a scene for another tool, in a folder, with what is lost."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.units import quantity_of
from tarsus.export.subject import Subject
from tarsus.files.library import SceneLike, as_scene, load_scene
from tarsus.files.whole import write_text
from tarsus.model.laws.userfile import laws_of
from tarsus.model.scene import Scene, seconds_of
from tarsus.tables.table import Table
from tarsus.tables.view import View


@dataclass(frozen=True)
class ExportTarget:
    """A tool: module and name of the function that makes its files, and all that it may write."""

    module: str
    files: tuple[str, ...]

    @property
    def made(self) -> Callable[[Subject, float | None], Exported]:
        """The function."""
        return import_module(f"tarsus.export.{self.module}").exported


TARGETS: Mapping[str, ExportTarget] = MappingProxyType(
    {
        "mjcf": ExportTarget(
            "mujoco_files", ("model.xml", "units.json", "drives.csv", "run_model.py", "loss.txt", "loss.json")
        ),
        "matlab": ExportTarget(
            "matlab", ("model.mat", "events.csv", "series.mat", "laws.m", "run_model.m", "lost.txt")
        ),
        "c": ExportTarget("c_headers", ("gait.h", "drives.h", "lost.txt")),
        "fmu": ExportTarget("fmu", ("robot.fmu", "lost.txt")),
    }
)
"""Tools by the name that `--to` has."""

FILES = tuple(name for target in TARGETS.values() for name in target.files)
"""Everything that an export may write."""


@dataclass(frozen=True)
class Exported:
    """Files of a target by name, texts or bytes; what has no counterpart, a sentence each; what was measured, where it
    was."""

    files: Mapping[str, str | bytes]
    lost: tuple[str, ...]
    measured: Table | None = None

    @classmethod
    def listed(cls, files: Mapping[str, str | bytes], lost: Sequence[str]) -> Exported:
        """Files and, as ``lost.txt``, the list."""
        return cls({**files, "lost.txt": "".join(f"- {one}\n" for one in lost)}, tuple(lost))


def export(
    scene: SceneLike,
    to: str,
    output: str | os.PathLike[str],
    *,
    duration: float | str | None = None,
    step: float | str | None = None,
    law: Sequence[str | os.PathLike[str]] = (),
) -> View:
    """Write a scene for another tool, with what is lost on the way.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path.
    to
        mjcf: a model of MuJoCo, which runs it after writing where it is installed, and states the loss in numbers;
        matlab: the state space of every set of held feet, events, series, and a script that makes the run again;
        c: the gait, or the drives' volts, as tables for a microcontroller;
        fmu: a unit of FMI 3.0 for co-simulation, whose inputs are the drives' volts.
    output
        The folder.
    duration
        How long the run is [s] that goes along; the scene's own by default.
    step
        Time step [s] of a model that has one; by default from the stiffness of its contacts, 1 us of a timer, or
        1 ms between the communication points of a unit.
    law
        Python files with laws of your own.

    Returns
    -------
    View
        The files, what has no counterpart, and the loss as a table where it was measured.

    Raises
    ------
    InputError
        For an unknown target, and for what the target cannot hold, in a sentence.
    """
    target = target_of(to)
    tick = None if step is None else quantity_of("step", step, "s")
    if tick is not None and not tick > 0.0:
        raise InputError(f"step: expected a time above 0 s, got {tick:g} s")
    made = scene if isinstance(scene, Scene) else load_scene(scene, laws=laws_of(law)) if law else as_scene(scene)
    folder = Path(output)
    found = target.made(Subject.of(made, seconds_of(made, duration)), tick)
    for name, content in found.files.items():
        if isinstance(content, bytes):
            folder.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        else:
            write_text(folder / name, content)
    return _view(folder, found)


def target_of(name: str) -> ExportTarget:
    """The target of a name. Raises InputError for one that is none."""
    if name not in TARGETS:
        raise InputError(f"to: expected one of {', '.join(TARGETS)}, got '{name}'")
    return TARGETS[name]


def _view(folder: Path, found: Exported) -> View:
    lost = Table("without a counterpart", ("what",), [(one,) for one in found.lost])
    data: dict[str, Any] = {"files": [str(folder / name) for name in found.files], "lost": list(found.lost)}
    if found.measured is None:
        return View(data, lost)
    measured = found.measured
    data["measured"] = measured.json()
    whole = Table(
        measured.title, measured.columns, measured.rows, measured.notes, [*measured.parts, lost], units=measured.units
    )
    return View(data, whole)
