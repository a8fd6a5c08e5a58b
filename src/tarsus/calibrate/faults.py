"""Faults of a study, collected until they are reported all at once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity


class Faults:
    """Sentences, none twice, in the order found."""

    def __init__(self) -> None:
        self._said: dict[str, None] = {}

    def add(self, *sentences: str) -> None:
        """More of them."""
        self._said |= dict.fromkeys(sentences)

    def stop(self) -> None:
        """Raise InputError with all of them, if there are any."""
        if self._said:
            raise InputError(self._said)

    @contextmanager
    def noted(self, where: str = "") -> Iterator[None]:
        """Sentences of an InputError are added, with where it was, and it is not raised."""
        try:
            yield
        except InputError as error:
            self.add(*(f"{where}: {said}" if where else said for said in error.problems))

    def quantity(self, value: float | str, unit: str, where: str) -> float:
        """SI value of a number or text in a unit; NaN where it is a fault."""
        with self.noted(where):
            return parse_quantity(value, unit)
        return math.nan
