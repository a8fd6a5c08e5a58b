"""Machine code kept on disk: is it there, and clearing away what older sources left."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Any

_LINE = re.compile(r"-\d+\.(py\d+)")


def is_compiled(dispatcher: Any) -> bool:
    """Whether calling a dispatcher finds machine code: in this process, or on disk for these very sources and this
    processor. True also where the compiler is off. Nothing is compiled or loaded to find out.
    """
    if not hasattr(dispatcher, "py_func") or dispatcher.signatures:
        return True
    index = _index(dispatcher) or {}
    own = _own_key(dispatcher)
    return any(key[1:] == own and (_folder(dispatcher) / name).exists() for key, name in index.items())


def drop_stale(dispatcher: Any) -> list[Path]:
    """Remove machine code of older sources of this function, and return the files removed.

    Code for these sources made on other processors that share the folder stays, an index that cannot be read goes.
    Another process that misses a file removed here compiles anew.
    """
    if not hasattr(dispatcher, "py_func"):
        return []
    folder, base = _folder(dispatcher), dispatcher._cache._impl.filename_base
    hashes = _own_key(dispatcher)[1]
    index = _index(dispatcher)
    current = {key: name for key, name in (index or {}).items() if key[2] == hashes}
    keep = {*current.values(), *([] if index is None else [f"{base}.nbi"])}
    stem, version = _LINE.split(base)[0], _LINE.search(base)
    removed = []
    for file in folder.glob(f"{stem}-*.nb[ci]"):
        found = _LINE.search(file.name)
        if file.name in keep or found is None or version is None or found[1] != version[1]:
            continue
        with contextlib.suppress(OSError):
            file.unlink()
            removed.append(file)
    if index and len(current) < len(index):
        with contextlib.suppress(OSError):
            dispatcher._cache._cache_file._save_index(current)
    return removed


def _folder(dispatcher: Any) -> Path:
    return Path(dispatcher._cache.cache_path)


def _index(dispatcher: Any) -> dict[Any, str] | None:
    """Entries of the disk cache for the present text of the function's file: key -> data file; None: unreadable."""
    try:
        return dispatcher._cache._cache_file._load_index()
    except Exception:  # whatever unpickling a broken file raises
        return None


def _own_key(dispatcher: Any) -> tuple[Any, ...]:
    """Processor, and hashes of the function and of what it closes over, as numba keys its cache."""
    codegen = dispatcher.targetctx.codegen()
    return tuple(dispatcher._cache._index_key((), codegen)[1:])
