"""A run on disk: one folder that anyone can open without this package.

`write_run` writes scene, series, events, measures, provenance, citations and a summary; `read_run` reads them
back as the same `RunArrays`, of which `tarsus.solve.Run.of` makes a run. Files are written next to their destination
and moved into place, the summary last: a folder with a `summary.json` holds one whole run.
"""

from __future__ import annotations

import contextlib
import csv
import io
import math
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.events import EVENT_WORDS
from tarsus.files.jsontext import json_text, read_json
from tarsus.files.kinds import SUMMARY_FILE, folder_sentence
from tarsus.files.ledger import Ledger, read_number
from tarsus.files.series import Variables, matlab_content, read_netcdf, variables_of, write_netcdf
from tarsus.files.toml import SCENE_FILE, read_scene, write_scene
from tarsus.files.version import package_version
from tarsus.files.whole import reason_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

FORMAT = 2
"""Version of the folder's layout, stored in `summary.json`."""

DONE = "DONE"
"""Name of the code of a run that reached its end."""

SERIES_FILE = "series.nc"
MATLAB_FILE = "series.mat"
EVENTS_FILE = "events.csv"
MEASURES_FILE = "measures.json"
PROVENANCE_FILE = "provenance.json"
CITATIONS_FILE = "citations.txt"
REPORT_FILE = "report.html"

RUN_FILES = (
    SCENE_FILE,
    SERIES_FILE,
    MATLAB_FILE,
    EVENTS_FILE,
    MEASURES_FILE,
    PROVENANCE_FILE,
    CITATIONS_FILE,
    SUMMARY_FILE,
    REPORT_FILE,
)
"""Everything that a run's folder may hold of the run."""

EVENT_UNITS: dict[str, str] = {
    "time": "s",
    "speed_before": "m/s",
    "speed_after": "m/s",
    "pull": "N",
    "strength": "N",
    "energy": "J",
    "adhesion_energy": "J",
    "apex": "m",
    "apex_time": "s",
    "gap_integral": "m s",
}
"""Unit of every dimensional column of the event table."""

_CITE_TARSUS = "The Tarsus developers: Tarsus, contact dynamics of legged piezoelectric micro-robots"


@dataclass(frozen=True)
class RunArrays:
    """What a folder holds of a run over ``duration`` [s], in SI units.

    code: name of its `tarsus.solve.ResultCode`, and that sentence; events: the run's structured array; variables: its
    series; measures, warnings: plain data, as `tarsus.measure.Measures.to_dict` and `warned` give them;
    electrical_energy [J]: NaN where it was not kept; accuracy: fields of the run's `tarsus.solve.Accuracy`, none where
    it had none of its own.
    """

    scene: Scene
    duration: float
    code: str
    sentence: str
    events: np.ndarray
    variables: Variables
    ledger: Ledger
    measures: Mapping[str, Mapping[str, Any]]
    warnings: Sequence[Mapping[str, str]]
    electrical_energy: float = math.nan
    accuracy: Mapping[str, Any] = field(default_factory=dict)

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet, in the order of the events' foot numbers."""
        return tuple(self.scene.robot.feet)


def write_run(run: RunArrays, directory: str | os.PathLike[str], mat: bool = False) -> list[Path]:
    """Write a run into `directory` (made if missing) and return the files written.

    Files of an earlier run in the same folder are replaced, its report and `.mat` removed, everything else
    in it is left alone. `mat` adds `series.mat` (MATLAB v5). Raises InputError if `directory` is a file or
    cannot be written.
    """
    folder = Path(directory)
    with _staging(folder) as stage:
        write_scene(run.scene, stage / SCENE_FILE)
        _write_netcdf(run, stage / SERIES_FILE)
        if mat:
            write_matlab(run.events, run.variables, stage / MATLAB_FILE)
        (stage / EVENTS_FILE).write_text(events_csv(run.events, run.foot_names), encoding="utf-8")
        _write_json(stage / MEASURES_FILE, _measured(run))
        _write_json(stage / PROVENANCE_FILE, provenance_table(run.scene))
        (stage / CITATIONS_FILE).write_text(_citations(run.scene), encoding="utf-8")
        _write_json(stage / SUMMARY_FILE, _summary(run))
        return _move_into(stage, folder)


def read_run(directory: str | os.PathLike[str], laws: Mapping[str, Any] | None = None) -> RunArrays:
    """Read a folder made by `write_run`; `laws` are the user's laws its scene needs, by kind.

    Raises InputError if the folder holds no whole run, or one of another format.
    """
    folder = Path(directory)
    if not folder.is_dir():
        raise InputError(f"there is no folder '{folder}': name one that run.write or `tarsus simulate -o` wrote")
    missing = [name for name in (SUMMARY_FILE, MEASURES_FILE) if not (folder / name).is_file()]
    if missing:
        raise InputError(f"{folder} holds no whole run: it has no {missing[0]}{folder_sentence(folder)}")
    summary = read_json(folder / SUMMARY_FILE)
    if summary.get("format") != FORMAT:
        found = summary.get("format")
        raise InputError([f"{folder} holds a run of format {found!r}; this version reads format {FORMAT}"])
    table = read_json(folder / MEASURES_FILE)
    try:
        return RunArrays(
            scene=read_scene(folder / SCENE_FILE, laws),
            duration=read_number(summary["duration_s"]),
            code=summary["code"],
            sentence=summary["sentence"],
            events=_read_events(folder / EVENTS_FILE, summary["feet"], summary["events"]),
            ledger=Ledger.of(table["ledger"]),
            measures=table["measures"],
            warnings=table.get("warnings", ()),
            electrical_energy=read_number(table.get("electrical_energy")),
            accuracy=summary.get("accuracy", {}),
            variables=variables_of(read_netcdf(folder / SERIES_FILE)),  # last: the longest to read
        )
    except KeyError as error:
        raise InputError([f"{folder} holds no whole run: {SUMMARY_FILE} or {MEASURES_FILE} lacks {error}"]) from error


def _measured(run: RunArrays) -> dict[str, Any]:
    return {
        "measures": run.measures,
        "warnings": run.warnings,
        "ledger": run.ledger.to_dict(),
        "electrical_energy": run.electrical_energy,
    }


def provenance_table(scene: Any) -> dict[str, dict[str, Any]]:
    """Provenance by path: source, note, and the value with its SI unit if it is one number."""
    from tarsus.base.spec import float_paths

    values = float_paths(scene)
    table: dict[str, dict[str, Any]] = {}
    for path, origin in scene.provenance.items():
        entry: dict[str, Any] = {"source": origin.source.value, "note": origin.note}
        if path in values:
            entry |= {"value": float(values[path].value), "unit": values[path].unit}
        table[path] = entry
    return table


def events_csv(events: np.ndarray, foot_names: Sequence[str]) -> str:
    """Event table as CSV text: full precision, units in the header, empty where not applicable."""
    names = [name for name in events.dtype.names or () if name not in ("time", "foot", "kind")]
    header = ["time [s]", "foot", "kind", *(f"{n} [{EVENT_UNITS[n]}]" if n in EVENT_UNITS else n for n in names)]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    columns = [events[name].tolist() for name in names]
    feet = [foot_names[index] for index in events["foot"].tolist()]
    kinds = [EVENT_WORDS[kind] for kind in events["kind"].tolist()]
    for time, foot, kind, *values in zip(events["time"].tolist(), feet, kinds, *columns, strict=True):
        writer.writerow([repr(time), foot, kind, *("" if math.isnan(v) else repr(v) for v in values)])
    return out.getvalue()


def _write_netcdf(run: RunArrays, path: Path) -> None:
    attrs = {
        "title": str(run.scene.name),
        "source": f"tarsus {package_version()}",
        "result_code": run.code,
        "result": run.sentence,
    }
    write_netcdf(run.variables, attrs, path)


def write_matlab(events: np.ndarray, variables: Variables, path: Path) -> None:
    """Series and events as MATLAB variables (`.mat`, version 5); units in structures, names in cell arrays."""
    from scipy.io import savemat

    content = matlab_content(variables)
    content["events"] = {name: events[name].astype(float) for name in events.dtype.names or ()}
    content["event_units"] = EVENT_UNITS
    content["event_kinds"] = np.array([EVENT_WORDS[k] for k in sorted(EVENT_WORDS)], dtype=object)
    savemat(path, content, format="5", long_field_names=True, oned_as="column")


def _summary(run: RunArrays) -> dict[str, Any]:
    """What was run and how it ended; nothing of the machine, so that equal runs give equal files."""
    versions = {name: metadata.version(name) for name in ("numpy", "scipy")}
    return {
        "format": FORMAT,
        "tarsus": package_version(),
        "scene": str(run.scene.name),
        "code": run.code,
        "sentence": run.sentence,
        "ok": run.code == DONE,
        "duration_s": float(run.duration),
        "accuracy": dict(run.accuracy),
        "feet": list(run.foot_names),
        "events": len(run.events),
        "samples": len(run.variables["time"].values),
        "ledger_closure": float(run.ledger.closure),
        "measures": {name: {key: m[key] for key in ("value", "unit")} for name, m in run.measures.items()},
        "versions": versions,
    }


def _citations(scene: Any) -> str:
    own = f"{_CITE_TARSUS}, version {package_version()}."
    return "\n\n".join(["If you use these results, please cite:", *scene.citations, own]) + "\n"


def _read_events(path: Path, foot_names: Sequence[str], count: int) -> np.ndarray:
    """The events of a file; InputError unless they are as many as the run had, each whole."""
    with _readable(path):
        text = path.read_text(encoding="utf-8")
    header, *rows = list(csv.reader(io.StringIO(text))) or [[]]
    if len(rows) != count or not text.endswith("\n"):
        raise InputError([f"{path} is damaged: it has {len(rows)} whole or cut rows, and the run had {count} events"])
    try:
        return _events_of(header, rows, foot_names)
    except (IndexError, KeyError, ValueError) as error:
        raise InputError([f"{path} is damaged: a row of it is no event ({error})"]) from error


def _events_of(header: list[str], rows: list[list[str]], foot_names: Sequence[str]) -> np.ndarray:
    names = [column.split(" [")[0] for column in header]
    kinds = {word: number for number, word in EVENT_WORDS.items()}
    types = {"foot": "i8", "kind": "i1"}
    events = np.zeros(len(rows), dtype=[(name, types.get(name, "f8")) for name in names])
    for column, name in enumerate(names):
        cells = [row[column] for row in rows]
        if name == "foot":
            events[name] = [foot_names.index(cell) for cell in cells]
        elif name == "kind":
            events[name] = [kinds[cell] for cell in cells]
        else:
            events[name] = [float(cell) if cell else math.nan for cell in cells]
    return events


def _write_json(path: Path, content: Any) -> None:
    path.write_text(json_text(content) + "\n", encoding="utf-8")


@contextlib.contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError([f"{path.parent} holds no whole run: cannot read {path.name}, {reason_of(error)}"]) from error


@contextlib.contextmanager
def _staging(folder: Path) -> Iterator[Path]:
    """A temporary folder inside `folder`, always removed; `folder` too if made here and left empty."""
    if folder.exists() and not folder.is_dir():
        raise InputError([f"cannot write a run into {folder}: it is a file, a folder is needed"])
    made = not folder.exists()
    stage: Path | None = None
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            stage = Path(tempfile.mkdtemp(prefix=".tarsus-", dir=folder))
            yield stage
        except OSError as error:
            raise InputError([f"cannot write a run into {folder}: {reason_of(error)}"]) from error
    finally:
        if stage is not None:
            shutil.rmtree(stage, ignore_errors=True)
        if made:
            with contextlib.suppress(OSError):
                folder.rmdir()


def _move_into(stage: Path, folder: Path) -> list[Path]:
    """Move staged files into place, the summary last, after removing what an earlier run left."""
    for name in (SUMMARY_FILE, MATLAB_FILE, REPORT_FILE):
        (folder / name).unlink(missing_ok=True)
    staged = sorted(stage.iterdir(), key=lambda path: (path.name == SUMMARY_FILE, path.name))
    written: list[Path] = []
    for path in staged:
        os.replace(path, folder / path.name)
        written.append(folder / path.name)
    return written
