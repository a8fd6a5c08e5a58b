"""Simulation: one run, or thousands at once. Names are listed in `__init__.pyi`, and loaded when first used."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any


def _homes(stub: str) -> dict[str, str]:
    """Modules of names, by the lines of a stub that import each under its own name."""
    lines = (line.replace(",", "").split() for line in stub.splitlines() if line.startswith("from "))
    return {name: module for _, module, _, *words in lines for name in words[::3]}


_PUBLIC, _, _ROOMS = Path(__file__).with_name("__init__.pyi").read_text(encoding="utf-8").partition("# What the rooms")
_HOMES = _homes(_PUBLIC + _ROOMS)
__all__ = sorted(_homes(_PUBLIC))  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'tarsus.solve' has no attribute '{name}'")
    found = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return found
