"""By which version of the code a result was made."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

from tarsus.core import _native

__all__ = ["SHOWING", "result_sources", "source_hash"]

SHOWING = ("cli", "cluster", "report")
"""Rooms that no result depends on: they ask for results and show them."""


def result_sources() -> list[Path]:
    """Files that results depend on: the engine, and all code of the package but what shows results."""
    package = Path(__file__).parents[1]
    code = [path for path in package.rglob("*") if path.name.endswith((".py", *EXTENSION_SUFFIXES))]
    needed = {path for path in code if path.relative_to(package).parts[0] not in SHOWING}
    return sorted(needed | {Path(_native.__file__)})


@lru_cache(maxsize=1)
def source_hash() -> str:
    """Hash of all that results depend on: what one version has made never goes on in another."""
    digest = hashlib.sha256()
    for path in result_sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
