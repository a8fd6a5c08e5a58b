"""A sweep on disk: its frozen plan, one file a finished unit of work, and one NetCDF of them all.

Every file is written beside its destination and moved into place, so that what bears its final name is whole whenever
the process dies. A unit is done when its file is there and bears the digest of the plan.
"""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.files.output import MANIFEST
from tarsus.files.series import Variables, write_netcdf

__all__ = ["COLLECTED_FILE", "PLAN_FILE", "SWEEP_FILES", "SweepStore"]

FORMAT = 1
"""Version of the folder's layout, kept in `plan.json`."""

PLAN_FILE = "plan.json"
UNIT_FOLDER = "units"
COLLECTED_FILE = "sweep.nc"

_PART = ".part"
_DIGEST = "plan"

SWEEP_FILES = tuple(
    f"{name}{part}"
    for name in ("study.toml", "scene.toml", PLAN_FILE, COLLECTED_FILE, f"{UNIT_FOLDER}/{6 * '[0-9]'}.npz")
    for part in ("", _PART)
)
"""Everything that a sweep's folder may hold of the sweep, as glob patterns."""


@dataclass(frozen=True)
class SweepStore:
    """A folder that holds the finished units of one plan.

    folder: where; digest: of the plan; units: number of units of the whole plan; what: a word for it. Safe between
    threads that write different units.
    """

    folder: Path
    digest: str
    units: int
    what: str = "sweep"

    @classmethod
    def open(
        cls,
        folder: Path,
        digest: str,
        units: int,
        texts: Mapping[str, str],
        *,
        resume: bool = False,
        what: str = "sweep",
    ) -> SweepStore:
        """The store of a plan: a new one, or with `resume` the one that is there.

        Parameters
        ----------
        folder
            Where; made if it is not there.
        digest
            Of everything that results depend on.
        units
            Number of units of the plan.
        texts
            Texts of the files that describe the plan, by name.
        resume
            Continue a store that is there.
        what
            What it is the store of, for sentences.

        Raises
        ------
        InputError
            If the folder holds a sweep that is not to be continued, or is to be continued and holds another plan or no
            sweep.
        """
        store = cls(folder, digest, units, what)
        present = {path.name for path in folder.iterdir()} - {MANIFEST} if folder.is_dir() else set()
        if present & {*texts, PLAN_FILE, UNIT_FOLDER, COLLECTED_FILE} and not resume:
            raise InputError(
                f"'{folder}' holds a {what}; continue it there with --resume, or give another folder with -o"
            )
        if PLAN_FILE in present:
            store._compare(texts)
        else:
            foreign = sorted(name for name in present if name.removesuffix(_PART) not in {*texts, PLAN_FILE})
            if foreign and resume:
                raise InputError(
                    f"'{folder}' holds no {what} to continue: it has {foreign[0]} but no {PLAN_FILE}"
                )
            folder.mkdir(parents=True, exist_ok=True)
            for name, text in texts.items():
                _write(folder / name, text.encode())
            plan = {"format": FORMAT, "plan": digest, "units": units}
            _write(folder / PLAN_FILE, (json.dumps(plan, indent=2) + "\n").encode())
        (folder / UNIT_FOLDER).mkdir(exist_ok=True)
        return store

    def _compare(self, texts: Mapping[str, str]) -> None:
        """Raise InputError unless the plan that is there is this one."""
        try:
            plan = json.loads((self.folder / PLAN_FILE).read_text(encoding="utf-8"))
            there = {name: (self.folder / name).read_text(encoding="utf-8") for name in texts}
            same = (plan["format"], plan["plan"], plan["units"]) == (FORMAT, self.digest, self.units)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"'{self.folder}' holds no whole plan of a {self.what}: {error}") from None
        if same:
            return
        changed = [name for name, text in texts.items() if there[name] != text]
        why = (
            f"its {changed[0]} differs" if changed else "it was made by another version of tarsus or of a law"
        )
        raise InputError(f"'{self.folder}' holds another {self.what} ({why}); give another folder with -o")

    def _file(self, unit: int) -> Path:
        return self.folder / UNIT_FOLDER / f"{unit:06d}.npz"

    def read(self, unit: int) -> dict[str, np.ndarray] | None:
        """Arrays of a unit by name; None if it is not done."""
        try:
            with np.load(self._file(unit), allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile):
            return None
        return arrays if str(arrays.pop(_DIGEST, "")) == self.digest else None

    def write(self, unit: int, arrays: Mapping[str, np.ndarray]) -> None:
        """Keep the arrays of a finished unit."""

        def save(stream: IO[bytes]) -> None:
            np.savez(stream, allow_pickle=False, **{_DIGEST: np.array(self.digest)}, **arrays)

        _write(self._file(unit), save)

    def pending(self) -> list[int]:
        """Numbers of the units that are not done."""
        try:
            present = {entry.name for entry in os.scandir(self.folder / UNIT_FOLDER)}
        except FileNotFoundError:
            present = set()
        return [
            unit
            for unit in range(self.units)
            if self._file(unit).name not in present or self.read(unit) is None
        ]

    def collect(self) -> dict[str, np.ndarray]:
        """Arrays of all units end to end, by name.

        Raises
        ------
        InputError
            If a unit is not done.
        """
        parts = []
        for unit in range(self.units):
            part = self.read(unit)
            if part is None:
                raise InputError(f"unit {unit} of '{self.folder}' is not done; run the sweep with --resume")
            parts.append(part)
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def finish(self, variables: Variables, attrs: Mapping[str, Any]) -> Path:
        """Write the collected file and clear away what killed processes left; the collected file's path."""
        target = self.folder / COLLECTED_FILE
        part = _part_of(target)
        write_netcdf(variables, attrs, part)
        os.replace(part, target)
        for place in (self.folder, self.folder / UNIT_FOLDER):
            for left in place.glob(f"*{_PART}"):
                left.unlink(missing_ok=True)
        return target


def _part_of(target: Path) -> Path:
    return target.with_name(f"{target.name}{_PART}")


def _write(target: Path, content: Any) -> None:
    """A file from bytes, or from a function that fills a stream; whole or not at all, also when power fails."""
    part = _part_of(target)
    with part.open("wb") as stream:
        if isinstance(content, bytes):
            stream.write(content)
        else:
            content(stream)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(part, target)
