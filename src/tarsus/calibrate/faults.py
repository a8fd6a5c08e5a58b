"""Faults of a study, collected until they are reported all at once."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import FloatInfo, get_value, with_values
from tarsus.base.units import parse_quantity
from tarsus.model.scene import Scene

_UNIT = re.compile(r"^\s*[-+0-9.eE]+\s+(.+)$")


class Faults:
    """Sentences, none twice, in the order found."""

    def __init__(self) -> None:
        self._said: dict[str, None] = {}

    def __bool__(self) -> bool:
        return bool(self._said)

    def add(self, *sentences: str) -> None:
        """More of them."""
        self._said |= dict.fromkeys(sentences)

    def stop(self) -> None:
        """Raise InputError with all of them, if there are any."""
        if self._said:
            raise InputError(self._said)

    def constant(self, value: float | str, where: str) -> float:
        """SI value of a number or text of any unit."""
        found = _UNIT.match(value) if isinstance(value, str) else None
        return self.quantity(value, found[1] if found else "1", where)

    def quantity(self, value: float | str, unit: str, where: str) -> float:
        """SI value of a number or text in a unit; NaN where it is a fault."""
        try:
            return parse_quantity(value, unit)
        except InputError as error:
            self.add(*(f"{where}: {said}" for said in error.problems))
            return math.nan

    def scene(self, scene: Scene, values: Mapping[str, Any], where: str) -> Scene:
        """A scene with values; the scene itself where they are a fault."""
        if not values:
            return scene
        try:
            return with_values(scene, values)
        except InputError as error:
            self.add(*(f"{where}: {said}" for said in error.problems))
            return scene

    def paths(self, scene: Scene, known: Mapping[str, FloatInfo], paths: Iterable[str], where: str) -> None:
        """Every path is a number of the scene."""
        for path in paths:
            if path in known:
                continue
            try:
                get_value(scene, path)
            except InputError as error:
                self.add(*(f"{where}: {said}" for said in error.problems))
            else:
                self.add(f"{where}: '{path}' is no single number of the scene")
