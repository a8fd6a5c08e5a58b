"""Counts and sums of events, as they are reported of a drive period or of a step: one definition of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS, EventKind

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class EventCount:
    """What is counted, of which kinds of events; or summed up of them, a field of the size that it has."""

    kinds: tuple[EventKind, ...]
    unit: str
    definition: str
    weight: str | None = None

    def of(self, events: NDArray[np.void], places: NDArray[np.intp], count: int) -> Floats:
        """Numbers (count,), one for each place; places (ne,): to which an event counts."""
        own = np.isin(events["kind"], self.kinds)
        weights = None if self.weight is None else np.abs(events[self.weight][own])
        return np.bincount(places[own], weights, count).astype(float)


COUNTS: Mapping[str, EventCount] = {
    "impacts": EventCount(IMPACTS, "1", "feet that reach the ground with speed"),
    "energy": EventCount(IMPACTS, "J", "kinetic energy lost in impacts", "energy"),
    "speed": EventCount(IMPACTS, "m/s", "sum of the approach speeds of the impacts", "speed_before"),
    "bounces": EventCount((EventKind.BOUNCE,), "1", "impacts after which the foot departs"),
    "captures": EventCount((EventKind.CAPTURE,), "1", "impacts after which the foot is held"),
    "rests": EventCount((EventKind.REST, EventKind.AVERAGED_CONTACT), "1", "feet whose bounces have died out"),
}
"""What is reported of every drive period of a run that settles, and of every step of a robot that is stepped."""
