"""TOML files as raw tables; what is no TOML, too large or another kind of file is said in a sentence."""

from __future__ import annotations

import os
import sys
import tomllib
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError

MOST_BYTES = 1 << 24
"""Largest file that is read as text: a signal of a million samples as text; packaged descriptions have up to 23 kB."""
MOST_NAMES = 100_000
"""Most assignments in a file: fifty times those of a walker of a hundred legs; more are another program's data."""
PYTHON = ".py"
"""Ending of the study of a table; all other descriptions are TOML."""
DEEPEST = 50
"""Deepest nesting of lists and tables: descriptions nest six deep, and Python follows some 300 of its own calls."""


class NotToml(InputError):
    """Text that breaks the rules of TOML."""


class FileKind(Enum):
    """What a name, a file or a folder holds: a word for it, what it is, and the verb that takes it or wrote it."""

    DEVICE = ("device", "a device", "`tarsus simulate` takes it")
    SCENE = ("scene", "a scene", "`tarsus simulate` takes it")
    SWEEP = ("study", "a sweep", "`tarsus sweep` takes it")
    CALIBRATION = ("calibration", "a calibration", "`tarsus calibrate` takes it")
    CAMPAIGN = ("campaign", "a campaign", "`tarsus identify` takes it")
    REQUEST = ("design file", "a design to be searched", "`tarsus design` takes it")
    RECORD = ("record", "a record", "`tarsus identify` takes it in a campaign")
    SERIES = ("series", "a NetCDF file of tarsus", "`tarsus plot` draws that of a run, a batch or a sweep")
    DRAWS = ("draws", "draws of an identification", "`tarsus design --over` takes them")
    RUN = ("run", "a run", "`tarsus simulate` wrote it")
    SWEEP_RUNS = ("sweep", "the runs of a sweep", "`tarsus sweep` wrote them")
    YIELD = ("yield", "a yield", "`tarsus yield` wrote it")
    BRANCH = ("branch", "a branch of periodic motions", "`tarsus branch` wrote it")
    ATTRACTORS = ("set of attractors", "attractors of a robot", "`tarsus attractors` wrote them")
    MODES = ("set of modes", "modes of a structure", "`tarsus modes` wrote them")
    ATLAS = ("atlas", "an atlas of a robot", "`tarsus atlas` wrote it")
    FITTED = ("fitted calibration", "a fitted calibration", "`tarsus calibrate` wrote it")
    IDENTIFICATION = ("identification", "an identification", "`tarsus identify` wrote it")
    TRACKING = ("series of identifications", "a series of identifications", "`tarsus identify --track` wrote it")
    LANDING = ("landing design", "a soft landing", "`tarsus design landing` wrote it")
    DESIGN = ("design", "a front of designs", "`tarsus design` wrote it")
    GAITS = ("gait design", "a front of gaits", "`tarsus design gait` wrote it")
    ADAPTIVE = ("adaptive gait", "an adaptive gait", "`tarsus design adapt` wrote it")
    REPRODUCTION = ("reproduction", "a reproduction", "`tarsus reproduce` wrote it")
    EXPERIMENT = ("experiment", "a published experiment", "`tarsus validate` takes it")
    VALIDATION = ("validation", "a validation", "`tarsus validate` wrote it")
    UNFINISHED = ("unfinished work", "work that was not finished", "the verb that began it continues it with --resume")
    FOLDERS = ("folder of results", "a folder of results", "verbs wrote them")

    @property
    def word(self) -> str:
        """Its name, as in "a good scene"."""
        return self.value[0]

    @property
    def sentence(self) -> str:
        """What it is and whose."""
        return f"{self.value[1]}; {self.value[2]}"


def read_table(path: str | os.PathLike[str], wanted: FileKind | None = None) -> dict[str, Any]:
    """The raw table of a TOML file; `InputError` where it cannot be read, and where a file that should be of a kind
    clearly describes something else, with the verb that takes it."""
    file = Path(path)
    table = None if file.suffix == PYTHON and file.is_file() else table_of(read_text(path), str(path))
    found = FileKind.CALIBRATION if table is None else kind_of_table(table)
    if wanted and found not in (None, wanted):
        raise InputError(f"{path}: it is {found.value[1]}, not {wanted.value[1]}: {found.value[2]}")
    if table is None:
        raise InputError(f"{path}: it is {FileKind.CALIBRATION.sentence}; expected a TOML file")
    return table


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file that users write; `InputError` where it cannot be read, is too large or no text."""
    file = Path(path)
    try:
        with file.open("rb") as opened:  # no more than is allowed: a device such as /dev/zero has no end
            content = opened.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {(error.strerror or str(error)).lower()}") from None
    if len(content) > MOST_BYTES:
        raise InputError(
            f"{file}: is larger than the {MOST_BYTES >> 20} MiB of text that are read; samples of a signal go into a "
            "file of their own"
        )
    try:
        return content.decode("utf-8-sig")  # editors of Windows put a byte order mark first
    except UnicodeDecodeError as error:
        raise InputError(f"{file}: is no text file (UTF-8): byte {error.start} cannot be read") from None


def table_of(text: str, label: str) -> dict[str, Any]:
    """The raw table of TOML text; label: its name in errors. Raises InputError where it is none."""
    if text.count("=") > MOST_NAMES:
        raise InputError(f"{label}: assigns more than {MOST_NAMES} names; a description has some hundreds")
    try:
        table = tomllib.loads(text.removeprefix("\N{BYTE ORDER MARK}"))
    except tomllib.TOMLDecodeError as error:
        raise NotToml(f"{label}: not valid TOML: {error}") from None
    except RecursionError:
        table = None
    except ValueError:  # Python refuses to read longer ones, which takes time as the square of their digits
        digits = sys.get_int_max_str_digits()
        raise InputError(f"{label}: holds a whole number of more than {digits} digits") from None
    if table is None or _deeper(table, DEEPEST):
        raise InputError(f"{label}: lists or tables are nested more than {DEEPEST} deep")
    return table


def _deeper(table: Mapping[str, Any], most: int) -> bool:
    """Whether lists and tables are nested deeper than so many times."""
    level: list[Any] = [table]
    for _ in range(most):
        level = [
            child
            for one in level
            for child in (one.values() if isinstance(one, Mapping) else one)
            if isinstance(child, (Mapping, list))
        ]
        if not level:
            return False
    return True


def kind_of_table(table: Mapping[str, Any]) -> FileKind | None:
    """What a raw table describes, by the names that only such files have; None where it has none of them."""
    if "records" in table:
        return FileKind.CAMPAIGN
    if "table" in table:
        return FileKind.CALIBRATION
    if "free" in table or "objective" in table:
        return FileKind.REQUEST
    if "vary" in table or isinstance(table.get("scene"), str):
        return FileKind.SWEEP
    return FileKind.SCENE if "robot" in table else None
