"""What a gait can be designed for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest

__all__ = ["OBJECTIVES", "WalkObjective", "objectives_of"]

Floats = NDArray[np.float64]
Seen = Mapping[str, Floats]
"""Measures (nr,) of runs by name, with ``energy``, plain energy a drive period [J], and ``weight`` [N]."""


@dataclass(frozen=True)
class WalkObjective:
    """One number of a walk.

    name: as typed; unit: SI; most: whether the largest is best; measures: of the walk that it is made of; of: the
    number (nr,); grounded: whether it depends on the ground at all; priced: whether it needs the drives' energy.
    """

    name: str
    unit: str
    most: bool
    doc: str
    measures: tuple[str, ...]
    of: Callable[[Seen], Floats]
    grounded: bool = True
    priced: bool = False

    def cost(self, values: Floats) -> Floats:
        """Of values, so that the least is best; infinite where there is none."""
        return np.where(np.isnan(values), np.inf, -values if self.most else values)

    def value(self, costs: Floats) -> Floats:
        """Of costs."""
        return -costs if self.most else costs


def _transport(seen: Seen) -> Floats:
    way = np.abs(seen["stride"]) * seen["weight"]
    return np.divide(seen["energy"], way, out=np.full(len(way), np.inf), where=way > 0.0)


def _plain(name: str, unit: str, doc: str, *, most: bool, measure: str) -> WalkObjective:
    return WalkObjective(name, unit, most, doc, (measure,), lambda seen: seen[measure])


OBJECTIVES = {
    one.name: one
    for one in (
        _plain("speed", "m/s", "mean speed forward", most=True, measure="mean_speed"),
        WalkObjective(
            "energy", "J", False, "electrical energy that all drives draw in a drive period, one step of every leg",
            (), lambda seen: seen["energy"], grounded=False, priced=True,
        ),
        WalkObjective(
            "transport", "1", False, "cost of transport: energy of a drive period over weight times stride",
            ("stride",), _transport, priced=True,
        ),
        _plain("slip", "m", "path that a foot slides in contact in a drive period, mean of the feet", most=False,
               measure="foot_slip"),
        _plain("contact", "s", "time of a drive period that a foot is on the ground, mean of the feet (4.4.2)",
               most=True, measure="contact_duration"),
        _plain("support", "1", "share of the time that a foot is on the ground, mean of the feet", most=True,
               measure="duty_factor"),
        _plain("sway", "m", "highest minus lowest heave of the body in a drive period", most=False,
               measure="vertical_amplitude"),
    )
}  # fmt: skip
"""What a gait can be designed for, by name."""


def objectives_of(given: str | WalkObjective | Sequence[str | WalkObjective]) -> tuple[WalkObjective, ...]:
    """Objectives of names, or of one text with commas; raises InputError for unknown, repeated and too many ones."""
    given = (
        given.split(",") if isinstance(given, str) else [given] if isinstance(given, WalkObjective) else given
    )
    words = [word.strip() if isinstance(word, str) else word for word in given]
    names = [word if isinstance(word, str) else word.name for word in words]
    problems = [
        f"objective: there is none called '{name}'{nearest(name, OBJECTIVES)}"
        for name, word in zip(names, words, strict=True)
        if isinstance(word, str) and name not in OBJECTIVES
    ]
    problems += [
        f"objective: '{name}' is named twice" for name in dict.fromkeys(names) if names.count(name) > 1
    ]
    if not 1 <= len(words) <= 3:
        problems.append(
            f"objective: expected one to three, got {len(words)}: a front of more cannot be looked through"
        )
    if problems:
        raise InputError(problems)
    return tuple(OBJECTIVES[word] if isinstance(word, str) else word for word in words)
