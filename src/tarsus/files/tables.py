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
DEEPEST = 50
"""Deepest nesting of lists and tables: descriptions nest six deep, and Python follows some 300 of its own calls."""


class NotToml(InputError):
    """Text that breaks the rules of TOML."""


class FileKind(Enum):
    """What a file describes, and the verb that takes it."""

    SCENE = ("a scene", "`tarsus simulate`")
    SWEEP = ("a sweep", "`tarsus sweep`")
    CALIBRATION = ("a calibration", "`tarsus calibrate`")
    CAMPAIGN = ("a campaign", "`tarsus identify`")


def read_table(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The raw table of a TOML file; `InputError` where it cannot be read."""
    file = Path(path)
    try:
        text = text_of(file)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {(error.strerror or str(error)).lower()}") from None
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no text file (UTF-8)") from None
    return table_of(text, str(file))


def text_of(file: Path) -> str:
    """The text of a file; raises InputError where it is too large, and what `pathlib.Path.read_text` does."""
    with file.open("rb") as opened:  # no more than is allowed: a device such as /dev/zero has no end
        content = opened.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise InputError(
            f"{file}: is larger than the {MOST_BYTES >> 20} MiB of text that are read; samples of a signal go into a "
            "file of their own"
        )
    return content.decode("utf-8-sig")  # editors of Windows put a byte order mark first


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
    if "vary" in table or isinstance(table.get("scene"), str):
        return FileKind.SWEEP
    return FileKind.SCENE if "robot" in table else None


def expect(wanted: FileKind, table: Mapping[str, Any], label: str) -> None:
    """Raise InputError where a raw table clearly describes something else, with the verb that takes it."""
    found = kind_of_table(table)
    if found not in (None, wanted):
        is_, verb = found.value
        raise InputError(f"{label}: it is {is_}, not {wanted.value[0]}: {verb} takes it")
