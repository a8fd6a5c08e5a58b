"""By which version of the code a result was made."""

from __future__ import annotations

import importlib.util
from functools import lru_cache
from hashlib import sha256
from importlib import metadata
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

SHOWING = ("cli", "cluster", "inspection", "report")
"""Rooms that no result depends on: they ask for results and show them."""

ENGINE = "tarsus.core._native"
"""The compiled engine: of its file the bytes count, and it is not loaded for them."""


def result_sources() -> list[Path]:
    """Files that results depend on: the engine, and all code of the package but what shows results."""
    package = Path(__file__).parents[1]
    code = [path for path in package.rglob("*") if path.name.endswith((".py", *EXTENSION_SUFFIXES))]
    needed = {path for path in code if path.relative_to(package).parts[0] not in SHOWING}
    engine = importlib.util.find_spec(ENGINE)  # an editable installation has it in another folder
    assert engine is not None and engine.origin is not None
    return sorted(needed | {Path(engine.origin)})


@lru_cache(maxsize=1)
def source_hash() -> str:
    """Hash of all that results depend on: what one version has made never goes on in another."""
    digest = sha256()
    for path in result_sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def versions() -> dict[str, str]:
    """What every result depends on: version of the package, hash of the engine and its sources."""
    return {"tarsus": package_version(), "engine": source_hash()}


def package_version() -> str:
    """Installed version of tarsus, or "unknown" when run from a bare source tree."""
    try:
        return metadata.version("tarsus")
    except metadata.PackageNotFoundError:
        return "unknown"
