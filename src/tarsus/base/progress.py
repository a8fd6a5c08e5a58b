"""How far a long piece of work has come, to whoever asked for it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]
"""Called as ``progress(done, total, what)``."""


def silent(done: int, total: int, what: str) -> None:
    """Say nothing."""
