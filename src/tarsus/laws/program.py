"""A law's plain Python as a program that the engine runs."""

from __future__ import annotations

from typing import Any

from tarsus.laws.base import Law


def program_of(law: type[Law]) -> Any:
    """The program of a law's function."""
    return None
