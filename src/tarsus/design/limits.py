"""Limits of a walk: a measure by name, a direction and a value; and those of the model that it is simulated by."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity
from tarsus.measure.measure import Definition, measure_name, no_measure
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.walking import WALK
from tarsus.measure.whole import WHOLE_RUN
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.model.structure.walker import SMALL, TILTS
from tarsus.tables.numbers import amount

DEFINITIONS: Mapping[str, Definition] = {**WALK, **PER_WINDOW, **WHOLE_RUN}
"""Measures of a walk by name."""
_WRITTEN = re.compile(r"\s*([\w\s-]+?)\s*(<|>)=?\s*(.+?)\s*")


@dataclass(frozen=True)
class WalkLimit:
    """A bound on a measure. most: whether it is the most that is allowed, else the least; value in SI; reason: a
    sentence that says where it comes from, of those that nobody asked for."""

    measure: str
    most: bool
    value: float
    reason: str = ""

    @property
    def unit(self) -> str:
        """Of the measure."""
        return DEFINITIONS[self.measure].unit

    def beyond(self, values: Floats) -> Floats:
        """By how much values (n,) are beyond it, as a share of it (in its unit where it is 0), 0 where they are not;
        infinite where there is none."""
        over = np.where(self.most, values - self.value, self.value - values) / (abs(self.value) or 1.0)
        return np.where(np.isnan(values), np.inf, np.maximum(over, 0.0))

    def __str__(self) -> str:
        sign = "below" if self.most else "above"
        return f"{self.measure.replace('_', ' ')} {sign} {amount(self.value, self.unit)}"


def measure_of(name: str) -> str:
    """A measure of a walk as typed or as printed. Raises InputError for a name that is none."""
    found = measure_name(name)
    if found not in DEFINITIONS:
        raise InputError(no_measure(found, DEFINITIONS))
    return found


def limits_of(scene: Scene, given: Any) -> tuple[WalkLimit, ...]:
    """Limits from a mapping of measures to ``("<", value)`` or ``"< 100 um"``, or from texts such as
    ``"heave_span < 100 um"``, one or several, with commas; with that of the model, unless they name its measure:
    ``"heave_span < inf"`` lifts it.

    Raises InputError for everything that is no limit: an unknown measure, another direction, a value of another unit.
    """
    problems, found = [], list[WalkLimit]()
    for text in _texts(given):
        try:
            found.append(_limit(text))
        except InputError as error:
            problems += [f"limits: {one}" for one in error.problems]
    if problems:
        raise InputError(problems)
    own = model_limit(scene)
    if own is not None and all(one.measure != own.measure for one in found):
        found.append(own)
    return tuple(one for one in found if np.isfinite(one.value))


def _texts(given: Any) -> list[str]:
    if isinstance(given, Mapping):
        return [
            f"{name} {one if isinstance(one, str) else ' '.join(map(str, one))}"
            for name, one in given.items()
        ]
    words = given.split(",") if isinstance(given, str) else given if isinstance(given, Sequence) else ()
    return [str(word) for word in words if str(word).strip()]


def _limit(text: str) -> WalkLimit:
    parts = _WRITTEN.fullmatch(text)
    if parts is None:
        raise InputError(f"expected a measure, < or >, and a value, such as heave_span<100um, got '{text}'")
    name = measure_of(parts[1])
    endless = parts[3] == "inf"
    value = np.inf if endless else parse_quantity(_number(parts[3]), DEFINITIONS[name].unit)
    return WalkLimit(name, parts[2] == "<", value)


def _number(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def model_limit(scene: Scene) -> WalkLimit | None:
    """The bound of the model that a walker is simulated by, with its reason; None of a robot that has none.

    A walker is linear in small angles. Where its body tilts the angle is bounded. Where it cannot, hips that rise one
    after the other by a height h would turn it by h over the distance between them, and that is bounded by the height.
    """
    structure = scene.robot.structure
    if not isinstance(structure, Walker):
        return None
    moves, legs = structure.body_coordinates, structure.legs.values()
    if set(TILTS) & set(moves):
        return WalkLimit("tilt", True, SMALL, f"a walker is linear in small angles, up to {SMALL:g} rad")
    wide = max(np.ptp([leg.x for leg in legs]), np.ptp([leg.y for leg in legs]))
    if not wide > 0.0:
        return None
    return WalkLimit(
        "heave_span", True, float(SMALL * wide),
        f"hips {amount(float(wide), 'm')} apart that rise one after the other would turn the body by {SMALL:g} rad, "
        "and here it cannot turn",
    )  # fmt: skip
