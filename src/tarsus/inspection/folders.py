"""What folders and files of results hold: one sentence what it is and how it was made, and its numbers as tables."""

from __future__ import annotations

import shlex
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.calibrate.results import calibration_table
from tarsus.cluster.status import status_lines, status_of
from tarsus.files.draws import read_draws
from tarsus.files.jsontext import read_json
from tarsus.files.kinds import kind_of_path, mark_of, plan_of
from tarsus.files.runstore import COLLECTED_FILE
from tarsus.files.series import is_text, read_netcdf, variables_of
from tarsus.files.tables import FileKind
from tarsus.files.toml import STUDY_FILE
from tarsus.tables.data import data_tables
from tarsus.tables.numbers import how_many
from tarsus.tables.table import ROW, Column, Table
from tarsus.tables.view import View

PAGES = ("report.html", "reproduction.html", "index.html")

KEYS = {
    FileKind.YIELD: ("scene", "robots", "measures", "outcomes", "by_dead", "matters_most", "cost_of_a_dead_leg"),
    FileKind.IDENTIFICATION: ("campaign", "files", "steps", "not_done", "validation"),
    FileKind.ATTRACTORS: ("scene", "starts", "over", "attractors", "others", "edges"),
    FileKind.LANDING: (
        "scene",
        "foot",
        "drive",
        "risk",
        "objective",
        "speed",
        "touchdowns",
        "worst",
        "pairs",
        "period",
        "energy",
        "energy_recovered",
        "regime",
        "plain",
        "nominal",
        "front",
    ),
    FileKind.DESIGN: ("scene", "risk", "free", "objectives", "candidates", "duration", "front"),
    FileKind.GAITS: ("scene", "risk", "free", "objectives", "candidates", "duration", "front"),
}
"""What of a result is shown, by its kind, in this order; of others everything that is no long list."""


def result_view(kind: FileKind, path: Path) -> View:
    """A result of a verb, in its folder or as the file that shows what the folder holds."""
    folder = path if path.is_dir() else path.parent
    match kind:
        case FileKind.SERIES:
            return _series_view(path)
        case FileKind.DRAWS:
            return _draws_view(path)
        case FileKind.FOLDERS:
            return _folders_view(path)
        case FileKind.UNFINISHED | FileKind.SWEEP_RUNS:
            return _plan_view(kind, folder)
    data = read_json(path / mark if (mark := mark_of(path)) else path)
    lines, tables = _page(folder), []
    if kind is FileKind.FITTED:
        with suppress(KeyError, TypeError, ValueError, IndexError):  # of another version
            tables = [calibration_table(data)]
    if not tables:
        lines = [*lines, "Numbers without a unit are in SI."]
        tables = data_tables(data, KEYS.get(kind, ()))
    title = _title(kind, path, data.get("version") or data.get("tarsus"))
    return View(data | {"is": kind.word}, Table(title, (), (), lines, tables))


def _title(kind: FileKind, path: Path, version: Any = None) -> str:
    """What it is and how it was made, in one sentence."""
    return f"{path}: {kind.sentence}" + (f", version {version}" if isinstance(version, str) else "")


def _page(folder: Path) -> list[str]:
    """How to open the page of a folder that has one, and what else there is to run."""
    scenes = [
        file.name
        for file in (
            folder / "identified.toml",
            *sorted(folder.glob("branch-*.toml")),
            *sorted(folder.glob("attractor-*.toml")),
        )
        if file.is_file()
    ]
    said = [f"device files: {', '.join(scenes)}"] if scenes else []
    pages = [name for name in PAGES if (folder / name).is_file()]
    return [*said, *(f"its page, {name}: `tarsus report {shlex.quote(str(folder))}`" for name in pages[:1])]


def _plan_view(kind: FileKind, folder: Path) -> View:
    """How a sweep goes; of other work that was interrupted, how much is kept."""
    if kind is FileKind.SWEEP_RUNS:
        try:
            status = status_of(folder)
        except ValueError as error:
            raise InputError(str(error)) from None
        lines = [*status_lines(status), *_page(folder)]
        data, parts = _collected(folder) if status.finished else ({}, [])
        return View(vars(status) | {"is": kind.word, **data}, Table("", (), (), lines, parts))
    made = plan_of(folder).get("made", {})
    units = sum(1 for _ in folder.glob("units/*/*.npz"))
    data = {"is": kind.word, "units": units, **made}
    return View(data, Table(_title(kind, folder), (), (), parts=data_tables({"units kept": units, **made})))


def _collected(folder: Path) -> tuple[dict[str, Any], list[Table]]:
    """The measures of a collected sweep, as its page has them; none of a folder without its study."""
    if not (folder / STUDY_FILE).is_file():
        return {}, []
    from tarsus.study.studyfile import frozen_sweep
    from tarsus.study.summary import read_scored, summary, summary_table, units_of_axes

    sweep = frozen_sweep(folder)
    data = summary(sweep, read_scored(sweep, folder / COLLECTED_FILE))
    return {"measures": data}, [summary_table(data, units_of_axes(sweep))]


def _folders_view(folder: Path) -> View:
    """The results below a folder, a row for each."""
    below = {one.name: kind_of_path(one) for one in sorted(folder.iterdir()) if one.is_dir()}
    rows = [(name, kind.value[1], kind.value[2]) for name, kind in below.items() if kind is not None]
    data = {"is": FileKind.FOLDERS.word, "folders": {name: kind.word for name, kind in below.items() if kind}}
    title = f"{folder}: {how_many(len(rows), 'folder')} of results"
    return View(data, Table(title, ("folder", "what it is", "whose"), rows, _page(folder)))


def _series_view(file: Path) -> View:
    """Every series of a NetCDF file with its unit, size and range."""
    dataset = read_netcdf(file)
    rows: list[tuple[Any, ...]] = []
    units = []
    for name, (dims, values, attrs) in variables_of(dataset).items():
        numbers = () if is_text(values) or values.dtype == bool else values[np.isfinite(values)]
        ends = (float(np.min(numbers)), float(np.max(numbers))) if len(numbers) else (None, None)
        size = " x ".join(f"{dim} {n}" for dim, n in zip(dims, values.shape, strict=True))
        rows.append((name, str(attrs.get("units", "")), size, *ends, str(attrs.get("long_name", ""))))
        units.append(str(attrs.get("units", "1")))
    said = {key: value for key, value in dataset.attrs.items() if isinstance(value, str | int | float)}
    columns = ("series", "unit", "size", Column("smallest", ROW), Column("largest", ROW), "what")
    title = f"{file}: {FileKind.SERIES.sentence}"
    parts = data_tables({key: one if isinstance(one, str) else float(one) for key, one in said.items()})
    names = ("name", "unit", "size", "smallest", "largest", "what")
    data = {"is": FileKind.SERIES.word, **said, "series": [dict(zip(names, row, strict=True)) for row in rows]}
    return View(data, Table(title, columns, rows, parts=parts, units=units))


def _draws_view(file: Path) -> View:
    """Middle and 95 % interval of every number of which a file holds draws."""
    draws = read_draws(file)
    rows = [(path, *np.quantile(values, (0.5, 0.025, 0.975)).tolist()) for path, values in draws.items()]
    count = len(next(iter(draws.values()), ()))
    numbers = {path: {"median": middle, "interval": [low, high]} for path, middle, low, high in rows}
    shown = [(path, middle, (low, high)) for path, middle, low, high in rows]
    title = f"{file}: {count} {FileKind.DRAWS.sentence}"
    data = {"is": FileKind.DRAWS.word, "draws": count, "numbers": numbers}
    return View(data, Table(title, ("number", "median", "95 % interval"), shown, ["Numbers are SI."]))
