"""What candidates are wanted for and held to: measures by name, with a direction, or with a bound.

A measure of feet may be that of one of them: ``hardest_impact.tip``.
"""

from __future__ import annotations

import re
from collections import ChainMap
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.units import parse_quantity
from tarsus.design.problems import listed
from tarsus.measure.limits import model_range
from tarsus.measure.measure import Definition, measure_name, no_measure
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.walking import OF_EPISODES, WALK
from tarsus.measure.whole import WHOLE_RUN
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.tables.numbers import amount

DEFINITIONS: Mapping[str, Definition] = ChainMap[str, Any](WALK, PER_WINDOW, WHOLE_RUN)
"""Measures of a run by name, those among them that were added."""
ENERGY, TRANSPORT = "electrical_energy", "cost_of_transport"
"""Measures that depend on the drives alone, or on their energy: made of their switchings here, not run by run."""
_WRITTEN = re.compile(r"\s*([\w\s.-]+?)\s*(<|>)=?\s*(.+?)\s*")


def parts_of(measure: str) -> tuple[str, str]:
    """Name of a measure, and the foot that it is of, else nothing."""
    name, _, foot = measure.partition(".")
    return name, foot


def definition_of(measure: str) -> Definition:
    """Unit and words of a measure."""
    return DEFINITIONS[parts_of(measure)[0]]


@dataclass(frozen=True)
class DesignObjective:
    """A measure with a direction. name: as typed; most: whether the largest is best."""

    name: str
    measure: str
    most: bool

    @property
    def unit(self) -> str:
        """Of its values."""
        return definition_of(self.measure).unit

    @property
    def doc(self) -> str:
        """What it is, in words."""
        return definition_of(self.measure).words

    @property
    def grounded(self) -> bool:
        """Whether it depends on the ground at all."""
        return self.measure != ENERGY

    @property
    def priced(self) -> bool:
        """Whether it needs the drives' energy."""
        return self.measure in (ENERGY, TRANSPORT)

    def cost(self, values: Floats) -> Floats:
        """Of values, so that the least is best; infinite where there is none."""
        return np.where(np.isnan(values), np.inf, -values if self.most else values)

    def value(self, costs: Floats) -> Floats:
        """Of costs."""
        return -costs if self.most else costs


OBJECTIVES = {
    one.name: one
    for one in (
        DesignObjective("speed", "mean_speed", True),
        DesignObjective("energy", ENERGY, False),
        DesignObjective("transport", TRANSPORT, False),
        DesignObjective("slip", "foot_slip", False),
        DesignObjective("contact", "contact_duration", True),
        DesignObjective("support", "duty_factor", True),
        DesignObjective("sway", "vertical_amplitude", False),
        DesignObjective("hold", "longest_hold", True),
    )
}
"""What has a word of its own; any measure goes by its name with a direction, as ``most duty_factor``."""


def objectives_of(given: str | DesignObjective | Sequence[str | DesignObjective]) -> tuple[DesignObjective, ...]:
    """Objectives of words, or of one text with commas; raises InputError for unknown, repeated and too many ones."""
    given = [given] if isinstance(given, DesignObjective) else listed(given)
    problems, found = list[str](), list[DesignObjective]()
    for word in given:
        try:
            found.append(word if isinstance(word, DesignObjective) else _objective(word))
        except InputError as error:
            problems += [f"objective: {one}" for one in error.problems]
    names = [one.name for one in found]
    problems += [f"objective: '{name}' is named twice" for name in dict.fromkeys(names) if names.count(name) > 1]
    if not 1 <= len(given) <= 3:
        problems.append(f"objective: expected one to three, got {len(given)}: a front of more cannot be looked through")
    if problems:
        raise InputError(problems)
    return tuple(found)


def _objective(word: str) -> DesignObjective:
    """One of `OBJECTIVES`, or one or a measure by name with a direction: most or least."""
    way, _, name = word.partition(" ")
    if way in ("most", "least"):
        if name in OBJECTIVES:
            return replace(OBJECTIVES[name], most=way == "most")
        measure = measure_of(name)
        return DesignObjective(measure.replace("_", " ").replace(".", " of "), measure, way == "most")
    if word in OBJECTIVES:
        return OBJECTIVES[word]
    if parts_of(measure_name(word))[0] in DEFINITIONS:
        raise InputError(f"'{word}' is a measure: say whether the most or the least is best, as most {word}")
    raise InputError(f"there is none called '{word}'{nearest(word, OBJECTIVES)}")


@dataclass(frozen=True)
class DesignLimit:
    """A bound on a measure. most: whether it is the most that is allowed, else the least; value in SI; reason: a
    sentence that says where it comes from, of those that nobody asked for."""

    measure: str
    most: bool
    value: float
    reason: str = ""

    @property
    def unit(self) -> str:
        """Of the measure."""
        return definition_of(self.measure).unit

    def beyond(self, values: Floats) -> Floats:
        """By how much values (n,) are beyond it, as a share of it (in its unit where it is 0), 0 where they are not;
        infinite where there is none."""
        over = np.where(self.most, values - self.value, self.value - values) / (abs(self.value) or 1.0)
        return np.where(np.isnan(values), np.inf, np.maximum(over, 0.0))

    def __str__(self) -> str:
        sign = "below" if self.most else "above"
        name = self.measure.replace("_", " ").replace(".", " of ")
        return f"{name} {sign} {amount(self.value, self.unit)}"


def measure_of(name: str) -> str:
    """A measure as typed or as printed, with its foot. Raises InputError for a name that is none."""
    measure, dot, foot = name.strip().partition(".")
    found = measure_name(measure)
    if found not in DEFINITIONS:
        raise InputError(no_measure(found, DEFINITIONS))
    return f"{found}{dot}{foot}"


def limits_of(scene: Scene, given: Any) -> tuple[DesignLimit, ...]:
    """Limits from a mapping of measures to ``("<", value)`` or ``"< 100 um"``, or from texts such as
    ``"heave_span < 100 um"``, one or several, with commas; with that of the model, unless they name its measure:
    ``"heave_span < inf"`` lifts it.

    Raises InputError for everything that is no limit: an unknown measure, another direction, a value of another unit.
    """
    problems, found = [], list[DesignLimit]()
    for text in _texts(given):
        try:
            found.append(text if isinstance(text, DesignLimit) else _limit(text))
        except InputError as error:
            problems += [f"limits: {one}" for one in error.problems]
    if problems:
        raise InputError(problems)
    own = model_range(scene)
    if own is not None and all(one.measure != own.measure for one in found):
        found.append(DesignLimit(own.measure, True, own.most, own.reason))
    return tuple(one for one in found if np.isfinite(one.value))


def _texts(given: Any) -> list[str | DesignLimit]:
    if isinstance(given, Mapping):
        return [f"{name} {one if isinstance(one, str) else ' '.join(map(str, one))}" for name, one in given.items()]
    return [word if isinstance(word, DesignLimit) else str(word) for word in listed(given or ())]


def _limit(text: str) -> DesignLimit:
    parts = _WRITTEN.fullmatch(text)
    if parts is None:
        raise InputError(f"expected a measure, < or >, and a value, such as heave_span<100um, got '{text}'")
    name = measure_of(parts[1])
    value = np.inf if parts[3] == "inf" else parse_quantity(_number(parts[3]), definition_of(name).unit)
    return DesignLimit(name, parts[2] == "<", value)


def _number(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def unmeasured(scene: Scene, measures: Collection[str], episodes: bool) -> list[str]:
    """Sentences on measures that runs of a scene do not have: of bodies that do not move so, of walkers alone, of feet
    that there are not, and of runs from their start where there are ``episodes`` alone."""
    structure, problems = scene.robot.structure, list[str]()
    moves = set(getattr(structure, "body_coordinates", ()))
    for full in dict.fromkeys(measures):
        name, foot = parts_of(full)
        if foot and foot not in scene.robot.feet:
            problems.append(f"{full}: the robot has no foot '{foot}'{nearest(foot, scene.robot.feet)}")
        if name == ENERGY:
            continue
        if name in WALK and not isinstance(structure, Walker):
            problems.append(f"{name}: is of a walker, and '{scene.name}' does not walk")
        elif name in WALK and not moves & set(WALK[name].moves):
            wanted = " or ".join(sorted(WALK[name].moves))
            problems.append(f"{name}: is of bodies with {wanted}, and this one has none")
        if not episodes and name in OF_EPISODES:
            problems.append(f"{name}: is of a run from its start; a settled motion has none, say from_rest")
    return problems
