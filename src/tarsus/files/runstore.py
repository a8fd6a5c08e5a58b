"""Runs that are kept: a folder with its frozen plan and one file a finished unit of work, or the memory of a process.

Sweeps and yields number the units of their plan. Searches, whose questions depend on the answers, ask a `Memo`, whose
units are batches of points.

Many processes of many machines may work in one folder. Every file is written next to its destination under a name that
no other writer has (node, process, chance) and moved into place, so that what bears its final name is whole whenever
a process dies, and a unit that two write is written twice, not spoilt. A unit is done when its file is listed; what it
holds (number, plan) is looked at when it is read.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import json
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO

import numpy as np

from tarsus.base.errors import InputError
from tarsus.files.kinds import PLAN_FILE
from tarsus.files.memo import Arrays, Function, Memo
from tarsus.files.output import MANIFEST
from tarsus.files.version import versions
from tarsus.files.whole import PART, claim, put

FORMAT = 2
"""Version of the folder's layout, kept in `plan.json`. In layout 1 all units lay in one folder."""

UNIT_FOLDER = "units"
WORKER_FOLDER = "workers"
COLLECTED_FILE = "sweep.nc"

PER_FOLDER = 1000
"""Units in a folder: file systems of clusters slow down at some ten thousand files in one."""

MOST_UNITS = 1_000_000
"""Units are numbered with six digits; more files than that make every listing slow."""

ABANDONED = 600.0
"""Seconds without a write after which a large file that is being written is taken as left behind by a process that was
killed: its writer writes all the time, and one that was stopped for so long finds the file of another in its place."""

_DIGEST, _LABEL = "plan", "unit"

UNIT_FILES = tuple(
    f"{UNIT_FOLDER}/{folder * letter}/{name * letter}.npz{end}"
    for folder, name, letter in ((3, 6, "[0-9]"), (2, 16, "[0-9a-f]"))
    for end in ("", f".*{PART}", ".damaged")
)
"""Files of units, by number and by batch, as glob patterns."""

SWEEP_FILES = (
    *(
        f"{name}{end}"
        for name in ("study.toml", "scene.toml", PLAN_FILE, COLLECTED_FILE, "report.html")
        for end in ("", f".*{PART}")
    ),
    *(f"laws/*.py{end}" for end in ("", f".*{PART}")),
    *UNIT_FILES,
    f"{WORKER_FOLDER}/*.json",
    f"{WORKER_FOLDER}/*{PART}",
    *(f"array/*.{end}" for end in ("units", "sh", "json", "out")),
)
"""Everything that a sweep's folder may hold of the sweep, as glob patterns."""


@dataclass(frozen=True)
class RunStore:
    """Finished units of one plan, in a folder; ``RunStore()`` has none and keeps nothing but what its memos remember.

    folder: where; digest: of the plan; runs: number of runs of the plan, in units of `chunk` runs, both 0 where it has
    no such number; what: a word for it. Safe between threads, processes and machines.
    """

    folder: Path | None = None
    digest: str = ""
    runs: int = 0
    chunk: int = 0
    what: str = "sweep"
    _memos: dict[str, Memo] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def open(
        cls,
        folder: str | os.PathLike[str] | None,
        texts: Mapping[str, str],
        *,
        resume: bool = False,
        what: str = "sweep",
        values: Iterable[np.ndarray] = (),
        runs: int = 0,
        chunk: int = 0,
    ) -> RunStore:
        """The store of a plan: a new one, or with `resume` the one that is there.

        Of processes that begin at the same time the first one writes the plan, and the others verify it.

        Parameters
        ----------
        folder
            Where; made if it is not there. None: in memory.
        texts
            Texts of the files that describe the plan, by name: `tarsus.files.toml.scene_texts` of its scene, and
            everything else that results depend on. They are written into the folder.
        resume
            Continue a store that is there.
        what
            What it is the store of, for sentences.
        values
            Numbers that results depend on and that the texts do not fix, such as points of a library's design.
        runs
            Number of runs of the plan, where it has one.
        chunk
            Runs in a unit; where the plan is there already its own counts.

        Raises
        ------
        InputError
            If the folder holds a sweep that is not to be continued, or is to be continued and holds another plan or no
            sweep; where it cannot be written.
        """
        digest = digest_of(texts, values)
        if folder is None:
            return cls(None, digest, runs, chunk, what)
        folder, made = Path(folder), versions()
        store = cls(folder, digest, runs, chunk, what)
        try:
            present = {path.name for path in folder.iterdir()} - {MANIFEST} if folder.is_dir() else set()
            tops = {Path(name).parts[0] for name in texts}
            if (taken := present & {*tops, PLAN_FILE, UNIT_FOLDER, COLLECTED_FILE}) and not resume:
                if PLAN_FILE not in taken:
                    raise InputError(f"'{folder}' holds {min(taken)}, but no {what}; give another folder with -o")
                one = "an atlas" if what == "atlas" else f"a {what}"
                raise InputError(
                    f"'{folder}' holds {one}; continue it there with --resume, or give another folder with -o"
                )
            if PLAN_FILE not in present:
                foreign = sorted(name for name in present if not _own(name, {*tops, PLAN_FILE}))
                if foreign and resume:
                    raise InputError(f"'{folder}' holds no {what} to continue: it has {foreign[0]} but no {PLAN_FILE}")
                folder.mkdir(parents=True, exist_ok=True)
                plan = {"format": FORMAT, "plan": digest, "units": store.units, "chunk": chunk, "runs": runs}
                plan["made"] = {"node": socket.gethostname(), **made}
                claim(folder / PLAN_FILE, (json.dumps(plan, indent=2) + "\n").encode())
            found = store._compared(texts, made)
            for name, text in texts.items():
                if not (folder / name).exists():
                    (folder / name).parent.mkdir(exist_ok=True)
                    put(folder / name, text.encode())
            (folder / UNIT_FOLDER).mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(store_sentence(error, folder)) from error
        return found

    @property
    def units(self) -> int:
        """Number of units."""
        return -(-self.runs // self.chunk) if self.chunk else 0

    def part(self, unit: int) -> slice:
        """The runs of unit ``unit``."""
        return slice(unit * self.chunk, min((unit + 1) * self.chunk, self.runs))

    def size(self, unit: int) -> int:
        """Number of runs of a unit."""
        part = self.part(unit)
        return part.stop - part.start

    @property
    def place(self) -> Path:
        """The folder, of a store that has one."""
        assert self.folder is not None
        return self.folder

    def memo(self, name: str = "") -> Memo:
        """What is known of a function: `Memo`, the same one whenever it is asked for by its name."""
        return self._memos.setdefault(name, Memo(self.read, self.write, name))

    def evaluate(
        self,
        points: np.ndarray,
        function: Function,
        *,
        name: str = "",
        chunk: int | None = None,
        threads: int | None = 1,
        progress: Callable[[int, int], None] | None = None,
    ) -> Arrays:
        """Values of a function at points: those that are kept are read, the others computed and kept.

        As `Memo.evaluate` of the memo of this name.
        """
        return self.memo(name).evaluate(points, function, chunk=chunk, threads=threads, progress=progress)

    def _compared(self, texts: Mapping[str, str], made: Mapping[str, str]) -> RunStore:
        """This store with the numbers of the plan that is there; InputError unless that is this plan."""
        try:
            plan = json.loads((self.place / PLAN_FILE).read_text(encoding="utf-8"))
            layout, digest, units = int(plan["format"]), str(plan["plan"]), int(plan["units"])
            chunk, by = int(plan["chunk"]), dict(plan["made"])
            found = replace(self, digest=digest, chunk=max(chunk, 0))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"'{self.folder}' holds no whole plan of a {self.what}: {error}") from None
        if layout != FORMAT:
            raise InputError(
                f"'{self.folder}' was written by {'an earlier' if layout < FORMAT else 'a later'} version of tarsus "
                f"(layout {layout}, and this one is {FORMAT}): continue with that version, or begin in another folder"
            )
        if digest == self.digest:
            if found.units != units or units > MOST_UNITS:
                raise InputError(f"'{self.folder}' holds no whole plan of a {self.what}: {units} units of {chunk} runs")
            return found
        why, remedy = self._why(texts, made, by)
        raise InputError(f"'{self.folder}' holds another {self.what} ({why}); {remedy}")

    def _why(self, texts: Mapping[str, str], made: Mapping[str, str], by: Mapping[str, str]) -> tuple[str, str]:
        """Why the plan that is there, made by `by`, is another one, and what can be done."""
        for name, text in texts.items():
            there = _text(self.place / name)
            if there is not None and there != text:
                return f"its {name} differs", "give another folder with -o"
        mine = {"node": socket.gethostname(), **made}
        differing = [key for key in mine if key != "node" and by.get(key) != mine[key]]
        if not differing:
            return "it was made by another version of tarsus or of a law", "give another folder with -o"
        there, here = (", ".join(f"{key} {one.get(key, '?')}" for key in differing) for one in (by, mine))
        return (
            f"begun on {by.get('node', '?')} with {there}, and {mine['node']} has {here}",
            "all nodes need the same version",
        )

    def _file(self, unit: int | str) -> Path:
        folder, name = (unit[:2], unit) if isinstance(unit, str) else (f"{unit // PER_FOLDER:03d}", f"{unit:06d}")
        return self.place / UNIT_FOLDER / folder / f"{name}.npz"

    def _label(self, unit: int | str) -> list[str]:
        """What a unit's file says of itself besides the digest of its plan."""
        return [unit] if isinstance(unit, str) else [str(unit), str(self.units)]

    def read(self, unit: int | str) -> Arrays | None:
        """Arrays of a unit by name; None if it is not done: not there, not whole, of another number or plan.

        unit: its number, or the key of a batch.

        Raises
        ------
        InputError
            Where the disk does not give the file out: what it holds is not known, and it may be whole.
        """
        if self.folder is None:
            return None
        try:
            content = self._file(unit).read_bytes()
        except (FileNotFoundError, IsADirectoryError):
            return None
        except OSError as error:
            raise InputError(store_sentence(error, self.folder)) from error
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        except Exception:  # there is no end to what zipfile and numpy say of a damaged file
            return None
        own = str(arrays.pop(_DIGEST, "")) == self.digest
        return arrays if own and arrays.pop(_LABEL, np.array([])).tolist() == self._label(unit) else None

    def write(self, unit: int | str, arrays: Mapping[str, np.ndarray]) -> None:
        """Keep the arrays of a finished unit; harmless where another has kept them already.

        Raises
        ------
        InputError
            When the disk is full, the folder cannot be written or is gone.
        """

        def save(stream: IO[bytes]) -> None:
            own = {_DIGEST: np.array(self.digest), _LABEL: np.array(self._label(unit))}
            np.savez(stream, allow_pickle=False, **own, **arrays)

        if self.folder is None:
            return
        target = self._file(unit)
        try:
            try:
                put(target, save)
            except FileNotFoundError:
                if not (self.place / PLAN_FILE).exists():
                    raise
                # the first of its folder, or what it wrote was cleared away by one that collected meanwhile
                target.parent.mkdir(parents=True, exist_ok=True)
                put(target, save)
        except OSError as error:
            raise InputError(store_sentence(error, self.folder)) from error

    def has(self, unit: int) -> bool:
        """Whether a unit is done."""
        return self._file(unit).exists()

    def done(self) -> Iterator[int]:
        """Numbers of the units that are done, in no order: those that are listed."""
        for folder in _entries(self.place / UNIT_FOLDER):
            if len(folder) == 3 and folder.isdecimal():
                for name in _entries(self.place / UNIT_FOLDER / folder):
                    if len(name) == 10 and name.endswith(".npz") and name[:6].isdecimal():
                        yield int(name[:6])

    def pending(self) -> list[int]:
        """Numbers of the units that are not done."""
        done = set(self.done())
        return [unit for unit in range(self.units) if unit not in done]

    def parts(self) -> Iterator[dict[str, np.ndarray]]:
        """Arrays of every unit, by name, in their order.

        Raises
        ------
        InputError
            If a unit is not done. One that is there and damaged is put aside, so that it is done again.
        """
        for unit in range(self.units):
            part = self.read(unit)
            if part is None:
                self._put_aside(unit)
                raise InputError(f"unit {unit} of '{self.folder}' is not done; run the {self.what} with --resume")
            yield part

    def _put_aside(self, unit: int) -> None:
        file = self._file(unit)
        with contextlib.suppress(FileNotFoundError):  # not there, or another process put it aside
            os.replace(file, file.with_name(f"{file.name}.damaged"))

    def check(self) -> list[int]:
        """Units that are listed and cannot be used; they are put aside, so that they are done again."""
        bad = [unit for unit in sorted(self.done()) if unit < self.units and self.read(unit) is None]
        for unit in bad:
            self._put_aside(unit)
        return bad

    def clear_abandoned(self, part: Path) -> None:
        """Make room: of the files that were to become the one that `part` is to become, those that nobody has written
        to for `ABANDONED` seconds by the clock of the disk go."""
        part.touch()
        now, name = part.stat().st_mtime, part.name.partition(f".{socket.gethostname()}-")[0]
        for one in _entries(self.place):
            if one.startswith(f"{name}.") and one.endswith(PART) and one != part.name:
                with contextlib.suppress(OSError):
                    if now - (self.place / one).stat().st_mtime > ABANDONED:
                        (self.place / one).unlink()

    def clear(self) -> None:
        """Clear away what killed processes left, and what is of use only while units are missing."""
        folders = [self.place, self.place / "laws", self.place / WORKER_FOLDER]
        folders += [self.place / UNIT_FOLDER / name for name in _entries(self.place / UNIT_FOLDER)]
        for place in folders:
            for name in _entries(place):
                left = name.endswith((PART, ".damaged")) or place.name == WORKER_FOLDER
                if left:
                    with contextlib.suppress(OSError):  # another process was faster, or holds it open
                        (place / name).unlink()
        with contextlib.suppress(OSError):
            (self.place / WORKER_FOLDER).rmdir()


def digest_of(texts: Mapping[str, str], values: Iterable[np.ndarray] = ()) -> str:
    """Digest of everything that results depend on: texts, version of the package, engine and its sources, values."""
    digest = hashlib.sha256()
    for text in (*texts.values(), *versions().values()):
        digest.update(text.encode() + b"\0")
    for array in values:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def store_sentence(error: OSError, folder: Path) -> str:
    """Why a store cannot be written, and what becomes of it."""
    kept = "finished parts are kept, continue with --resume"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"the disk that holds '{folder}' is full: make room; {kept}"
    if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
        return f"'{folder}' cannot be written ({os.strerror(error.errno).lower()}); {kept}"
    if error.errno in (errno.ENOENT, errno.ESTALE, errno.ENOTDIR, errno.ENODEV, errno.ENOTCONN):
        return f"'{folder}' is gone, removed or with its disk; begin again, or go on with --resume once it is back"
    why = (error.strerror or str(error)).lower()
    return f"'{folder}' cannot be used ({why}); {kept}"


def _entries(folder: Path) -> list[str]:
    """Names in a folder; none where it is not there."""
    try:
        return os.listdir(folder)
    except (FileNotFoundError, NotADirectoryError):
        return []


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return None


def _own(name: str, names: Iterable[str]) -> bool:
    """Whether a file is one of these, or what a writer of one of these left."""
    return any(name == one or (name.startswith(f"{one}.") and name.endswith(PART)) for one in names)
