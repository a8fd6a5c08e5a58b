"""What is wrong with a request, collected, so that all of it is said at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from tarsus.base.errors import InputError

T = TypeVar("T")


def listed(given: str | Iterable[T]) -> list[T | str]:
    """What is given one by one: of a text its words between commas, else as it is."""
    return [word for one in given.split(",") if (word := one.strip())] if isinstance(given, str) else list(given)


class Problems(list[str]):
    """Sentences on a request."""

    def tried(self, made: Callable[[], T]) -> T | None:
        """What is made, or None where that raises `InputError`, whose sentences join."""
        try:
            return made()
        except InputError as error:
            self += [one for one in error.problems if one not in self]
            return None
