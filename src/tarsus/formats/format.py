"""What a file of this folder says of its format: how a file of it begins, and how it is read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tarsus.formats.raw import RawFile


@dataclass(frozen=True)
class Format:
    """A format of files.

    name: as its users say it; begins: whether a file whose first `HEAD` bytes these are is of the format; read: series
    of a file from its path and its content, or InputError; suffixes: of its files, in small letters with the dot;
    unsigned: whether a file with such a suffix may begin in any way.
    """

    name: str
    begins: Callable[[bytes], bool]
    read: Callable[[Path, bytes], RawFile]
    suffixes: tuple[str, ...] = ()
    unsigned: bool = False


HEAD = 4096
"""Bytes that show the format: headers name it at their beginning."""
