"""The verbs that look at what a name stands for: `tarsus.show` and `tarsus.check`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tarsus.base.arguments import Values
from tarsus.base.errors import InputError
from tarsus.base.messages import together
from tarsus.base.verb import verb
from tarsus.files.installed import kind_of
from tarsus.files.library import load_scene
from tarsus.files.tables import FileKind
from tarsus.inspection import comparison, records, studies
from tarsus.inspection.runs import run_data
from tarsus.inspection.scenes import scene_view
from tarsus.model.laws.userfile import laws_of
from tarsus.tables.numbers import how_many
from tarsus.tables.table import Table
from tarsus.tables.view import View

Name = str | os.PathLike[str]


@verb
def show(
    name: Name,
    other: Name | None = None,
    *,
    drive: str | None = None,
    read: Values | None = None,
    law: Sequence[Name] = (),
) -> View:
    """Show what a device, study, file or folder holds; of two runs, devices or scene files, how they differ.

    Parameters
    ----------
    name
        A device or packaged study, a file (TOML), a folder or file that a verb wrote, a campaign, or a record: UFF
        55/58, MATLAB, HDF5, NetCDF, TDMS, LVM, CSV or ASCII.
    other
        What it is compared with: runs with runs, devices or scene files with such.
    drive
        Of a record: channel that recorded the drive, where the file does not say it.
    read
        Of a record, what the file does not say: units of channels by name, such as Ch1 in m/s, a name alone, and
        choices of `tarsus.read_measurement`: step, frequency_step, axis, axis_unit, input_unit, record.
    law
        Python files with laws of your own.

    Returns
    -------
    View
        With `table()` and `to_dict()`.

    Raises
    ------
    InputError
        Where nothing of that name can be read, or the two are not of one kind.
    """
    name, laws = os.fspath(name), laws_of(law)
    if other is not None:
        return _compared(name, os.fspath(other), laws)
    kind = kind_of(name)
    if kind is not FileKind.RECORD and (given := [f"{one}: is of a record" for one in _named(drive=drive, read=read)]):
        raise InputError([f"{one}, and '{name}' is {kind.value[1]}" for one in given])
    match kind:
        case FileKind.DEVICE | FileKind.SCENE:
            return scene_view(load_scene(name, laws=laws))
        case FileKind.RECORD:
            return records.record_view(Path(name), {**(read or {}), **({} if drive is None else {"drive": drive})})
        case FileKind.RUN:
            from tarsus.solve import load_run

            run = load_run(name, laws)
            return View(run_data(run), run.table())
        case FileKind.SWEEP:
            from tarsus.study.studyfile import load_sweep

            return studies.study_view(load_sweep(name, laws))
        case FileKind.CALIBRATION:
            from tarsus.calibrate.studyfile import load_study

            return studies.calibration_view(load_study(name, laws))
        case FileKind.REQUEST:
            return studies.design_view(name, laws)
        case FileKind.CAMPAIGN:
            from tarsus.identify.campaign import read_campaign

            return studies.campaign_view(read_campaign(name))
        case FileKind.EXPERIMENT:
            from tarsus.validation import load_experiment

            return studies.experiment_view(load_experiment(name))
    from tarsus.inspection.folders import result_view  # which loads every verb's results

    return result_view(kind, Path(name))


def _named(**options: Any) -> list[str]:
    return [name for name, value in options.items() if value]


def _compared(first: str, second: str, laws: dict[str, Any]) -> View:
    kinds = [kind_of(name) for name in (first, second)]
    if all(kind is FileKind.RUN for kind in kinds):
        from tarsus.solve import load_run

        return comparison.of_runs((first, second), load_run(first, laws), load_run(second, laws))
    for name, kind in zip((first, second), kinds, strict=True):
        if kind is FileKind.DEVICE:
            load_scene(name, laws=laws)
    problems = [
        f"'{name}' is {kind.value[1]}: compare two runs, or two devices or scene files"
        for name, kind in zip((first, second), kinds, strict=True)
        if kind not in (FileKind.DEVICE, FileKind.SCENE)
    ]
    if problems:
        raise InputError(problems)
    return comparison.of_scenes((first, second), load_scene(first, laws=laws), load_scene(second, laws=laws))


@verb
def check(name: Name, *, law: Sequence[Name] = ()) -> View:
    """Check a device, a scene, a study, a design, a calibration or a campaign; name all errors at once, of records too.

    Parameters
    ----------
    name
        A device or packaged study, a file (TOML), a folder or file that a verb wrote, a campaign, or a record.
    law
        Python files with laws of your own.

    Returns
    -------
    View
        What it is, what it holds, and remarks on it.

    Raises
    ------
    InputError
        With every problem.
    """
    name = os.fspath(name)
    kind = kind_of(name)
    noted: Sequence[str] = ()
    match kind:
        case FileKind.CAMPAIGN:
            contents, noted = _campaign(name)
        case FileKind.UNFINISHED:
            raise InputError(f"'{name}' holds {kind.sentence}")
        case _:
            found = show(name, law=law)
            if found.to_dict().get("kind") == records.SERIES:
                raise InputError(list(found.remarks))
            contents, noted = found.shown.text().splitlines()[0].removeprefix(f"{name}: "), found.remarks
    data = {"name": name, "is": kind.word, "contents": contents, "remarks": list(noted)}
    return View(data, Table(f"{name} is a good {kind.word}: {contents.rstrip('.')}.", (), ()), tuple(noted))


def _campaign(name: str) -> tuple[str, list[str]]:
    """A campaign is good when its file is, and every record can be read and has what its purpose needs."""
    from tarsus.identify.campaign import read_campaign
    from tarsus.identify.readiness import readiness_of

    opened = read_campaign(name)
    found = readiness_of(opened)
    if found.problems:
        raise InputError(together([*found.problems, *found.remarks]))
    notes = [note for one in found.readings if one.record is not None for note in one.record.notes]
    sets, files = how_many(len(opened.campaign.records), "set"), how_many(len(found.readings), "file")
    return f"{opened.campaign.name} ({sets} of records, {files})", together([*notes, *found.remarks])
