"""The engine for pages: where it lies, and how it is compiled where it does not yet.

A wheel brings it. From a checkout it is compiled once, into the user's cache, named by the digest of its sources, so
that an update of Tarsus never runs an engine of other sources.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.core.page import compiling

DIGITS = 16
"""Hexadecimal digits of the digest in a file's name."""


def engine_bytes() -> bytes | None:
    """The engine for pages; None where it is to be compiled yet."""
    wanted = compiling.digest()
    packaged = files("tarsus.core.page").joinpath("engine.wasm")
    if packaged.is_file():
        module = packaged.read_bytes()
        if wanted is None or compiling.sources_of(module) == wanted:
            return module
    return _kept(wanted) if wanted else None


def compiled_engine() -> bytes:
    """The engine for pages, compiled now where nobody has yet, which takes a minute or two.

    Raises InputError with the command to type where it cannot be compiled. A cache that cannot be written is left
    alone; processes that compile at once each put the same file into its place.
    """
    found = engine_bytes()
    if found is not None:
        return found
    with tempfile.TemporaryDirectory(prefix="tarsus-") as folder:
        made = Path(folder, "engine.wasm")
        try:
            compiling.build(made, quiet=True)
        except compiling.CannotCompile as error:
            raise InputError(str(error)) from None
        module = made.read_bytes()
    with contextlib.suppress(OSError, RuntimeError):
        file = _file(compiling.sources_of(module) or "")
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_name(f"{file.name}.{os.getpid()}.part")
        part.write_bytes(module)
        part.replace(file)
    return module


def _kept(digest: str) -> bytes | None:
    try:
        module = _file(digest).read_bytes()
    except (OSError, RuntimeError):  # no such file, or a user without a home
        return None
    return module if compiling.sources_of(module) == digest else None


def _file(digest: str) -> Path:
    return cache_folder() / f"page-engine-{digest[:DIGITS]}.wasm"


def cache_folder() -> Path:
    """The user's cache of Tarsus, by the system's rules; XDG_CACHE_HOME says another place."""
    if said := os.environ.get("XDG_CACHE_HOME"):
        return Path(said) / "tarsus"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "tarsus"
    return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "tarsus"
