"""One number with all that says what it means."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from tarsus.explain import nearest
from tarsus.measure.history import Floats

RENAMED = {"all_rebounds": "total_rebounds_any_height"}
"""Measures that had another name once."""


def no_measure(name: str, known: Iterable[str]) -> str:
    """A sentence for a name that no measure has: with its new name, the nearest valid one, or the valid ones."""
    names = list(known)
    renamed = RENAMED.get(name)
    hint = f"; did you mean '{renamed}', its present name?" if renamed in names else nearest(name, names)
    return f"there is no measure '{name}'{hint}"


class Scope(Enum):
    """Whose number a measure is. The value is a word for it."""

    ROBOT = "robot"
    FOOT = "one foot"
    MEAN = "mean over feet"
    WORST = "worst foot"

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True)
class Measure:
    """One number with its unit, its spread over ``n`` drive periods and its definition.

    scope: whose number ``value`` is; ``per_foot`` has that of each foot. ``spread`` is the standard deviation from
    period to period: of the worst foot, or the largest of the feet. height [m], dwell [s]: what a flight must clear,
    and how short the contact before it must be, to count, where the measure counts (see `Counting`).
    """

    value: float
    unit: str
    spread: float
    n: int
    definition: str
    per_foot: Mapping[str, float] = field(default_factory=dict)
    scope: Scope = Scope.ROBOT
    height: float | None = None
    dwell: float | None = None


class CautionKind(Enum):
    """What a number may mislead about."""

    HIGHEST_UNCOUNTED = "the highest flights are no bounces"
    COUNTED_LOW = "the bounces are low"
    FEW_PERIODS = "too few periods for a spread"


@dataclass(frozen=True)
class Caution:
    """A sentence to read beside the measures, and what it is about."""

    kind: CautionKind
    sentence: str

    def __str__(self) -> str:
        return self.sentence


class Measures(Mapping[str, Measure]):
    """Measures by name; also as attributes: ``run.measures.contact_duration``. warnings: what to know when reading
    them."""

    def __init__(self, values: Mapping[str, Measure], warnings: Sequence[Caution] = ()) -> None:
        self._values = dict(values)
        self.warnings = tuple(warnings)

    def __getitem__(self, name: str) -> Measure:
        if name not in self._values:
            raise KeyError(no_measure(name, self._values))
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, name: str) -> Measure:
        values: dict[str, Measure] = self.__dict__.get("_values", {})  # none yet while it is unpickled
        if name not in values:
            raise AttributeError(no_measure(name, values))
        return values[name]


def of_robot(row: Floats, unit: str, definition: str) -> Measure:
    """A measure of the robot from its values (np,) by period."""
    value = float(row.mean()) if row.size else math.nan
    spread = float(row.std(ddof=1)) if row.size > 1 else math.nan
    return Measure(value, unit, spread, row.size, definition)


@dataclass(frozen=True)
class Moments:
    """Of values by foot and period: how many there are of each foot, their mean and standard deviation (..., m)."""

    count: NDArray[np.intp]
    mean: Floats
    spread: Floats

    @classmethod
    def of(cls, rows: Floats) -> Moments:
        """Moments of rows (..., m, np), NaN where there is no value."""
        known = np.isfinite(rows)
        count = known.sum(axis=-1)
        mean = np.full(count.shape, np.nan)
        np.divide(np.where(known, rows, 0.0).sum(axis=-1), count, out=mean, where=count > 0)
        square = (np.where(known, rows - mean[..., None], 0.0) ** 2).sum(axis=-1)
        spread = np.full(count.shape, np.nan)
        np.divide(square, count - 1, out=spread, where=count > 1)
        return cls(count, mean, np.sqrt(spread))

    def __getitem__(self, key: int) -> Moments:
        return Moments(self.count[key], self.mean[key], self.spread[key])


def of_feet(
    rows: Floats | Moments,
    feet: Sequence[str],
    unit: str,
    definition: str,
    scope: Scope,
    *,
    height: float | None = None,
    dwell: float | None = None,
) -> Measure:
    """A measure of the feet from their values (m, np) by foot and period, NaN where there is none, or their moments.

    ``scope`` tells of several feet whether it is their mean or that of the worst foot, the one with the largest mean.
    """
    found = rows if isinstance(rows, Moments) else Moments.of(rows)
    count, mean, spread = found.count.tolist(), found.mean.tolist(), found.spread.tolist()
    met = [i for i, many in enumerate(count) if many > 0]
    value = deviation = math.nan
    seen = 0
    if met and scope is Scope.WORST:
        worst = max(met, key=mean.__getitem__)
        value, deviation, seen = mean[worst], spread[worst], count[worst]
    elif met:
        value, seen = math.fsum(mean[i] for i in met) / len(met), min(count)
        deviation = max((one for one in spread if one == one), default=math.nan)
    whose = Scope.FOOT if len(feet) == 1 else scope
    per_foot = dict(zip(feet, mean, strict=True))
    return Measure(value, unit, deviation, seen, definition, per_foot, whose, height, dwell)
