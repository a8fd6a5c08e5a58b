"""What a file holds, by the one format among the files of this folder that it is of."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from tarsus.base.discover import modules_of
from tarsus.base.errors import InputError
from tarsus.formats.format import HEAD, Format
from tarsus.formats.raw import RawFile, read_bytes
from tarsus.formats.text import read_text

_POLYTEC = "a binary file of the Polytec software; export it there as Universal File Format (UFF 58) or as ASCII"
_SPREADSHEET = "a spreadsheet; save the sheet as CSV"
_ELSEWHERE: Mapping[str, str] = {
    ".svd": _POLYTEC,
    ".pvd": _POLYTEC,
    ".xls": _SPREADSHEET,
    ".xlsx": _SPREADSHEET,
    ".ods": _SPREADSHEET,
    ".npy": "an array of numpy, without names and units; write it with scipy.io.savemat or as HDF5",
    ".tdm": "the header of a TDM/TDX pair; save it as TDMS",
    ".tdx": "the numbers of a TDM/TDX pair; save it as TDMS",
}


@cache
def formats() -> tuple[Format, ...]:
    """Formats that the files of this folder define as ``FORMATS``, in the order of the files. Raises InputError where
    that is anything else."""
    found: list[Format] = []
    for module in modules_of(__package__ or ""):
        given = getattr(module, "FORMATS", ())
        if not isinstance(given, tuple) or not all(isinstance(one, Format) for one in given):
            raise InputError(f"{module.__file__}: FORMATS: expected a tuple of Format(...), got {given!r}")
        found += given
    return tuple(found)


def _format_of(path: Path, head: bytes) -> Format | None:
    """The format of a file: one that begins so, first those of its suffix; else one whose files begin in any way.

    Raises InputError where the suffix names a format that it does not begin like.
    """
    suffix = path.suffix.lower()
    begun = sorted((one for one in formats() if one.begins(head)), key=lambda one: suffix not in one.suffixes)
    named = [one for one in formats() if suffix in one.suffixes]
    if begun or not named:
        return begun[0] if begun else None
    for one in named:
        if one.unsigned:
            return one
    raise InputError(f"{path.name} is not what its name says: its content is damaged or truncated at the start")


def content_of(path: Path) -> RawFile:
    """Series of a file, by the format that its first bytes show. Raises InputError where it cannot be read."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it")
    if path.suffix == ".toml" and path.is_file():
        raise InputError(f"{path.name} is a description (TOML), no record")
    content = read_bytes(path)
    head = content[:HEAD]
    if not content:
        raise InputError(f"{path.name} is empty")
    if found := _format_of(path, head):
        return found.read(path, content)
    if instead := _ELSEWHERE.get(path.suffix.lower()):
        raise InputError(f"{path.name} is {instead}")
    if b"\0" in head and not head.startswith((b"\xff\xfe", b"\xfe\xff")):
        known = ", ".join(one.name for one in reversed(formats()))
        raise InputError(f"{path.name} is a binary file of no known format; export it as one of: {known}, CSV or ASCII")
    return read_text(path, content)
