"""What is wrong with a request, collected, so that all of it is said at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from tarsus.base.errors import InputError

T = TypeVar("T")


class Problems(list[str]):
    """Sentences on a request."""

    def tried(self, made: Callable[[], T]) -> T | None:
        """What is made, or None where that raises `InputError`, whose sentences join."""
        try:
            return made()
        except InputError as error:
            self += [one for one in error.problems if one not in self]
            return None
