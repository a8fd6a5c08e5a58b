"""What a fit asks of runs: readings and samples that were measured, goals, and limits; and how each is read of a run,
with derivatives by numbers of its scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import by_path, float_paths, with_values
from tarsus.base.units import parse_quantity
from tarsus.measure.measure import no_measure
from tarsus.model.scene import Scene
from tarsus.solve import Run

if TYPE_CHECKING:
    from tarsus.solve import GradientRun

Number = str | Callable[[NDArray[np.void]], float]
"""A number of a run: a measure by name, or a function of its events with the period marks
(`tarsus.solve.GradientRun.gradient_of`), smooth in their numbers."""
Value = float | str
"""SI, or a text with a unit; of a function of the events always SI."""
Under = Mapping[str, Value]
"""What differs from the scene in the run that is meant, by path."""


@dataclass(frozen=True)
class Reading:
    """A number that was measured, with one standard deviation: residual (number - value) / error."""

    of: Number
    value: Value
    error: Value
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class Samples:
    """A record of a foot's gap [m], or of its rate [m/s]: values (nt,) at times (nt,) [s] in order, with one standard
    deviation; nt residuals (gap - value) / error."""

    foot: str
    times: ArrayLike
    values: ArrayLike
    error: Value
    rate: bool = False
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class Goal:
    """A number that shall be small, in units of ``scale``; large where that is negative."""

    of: Number
    scale: Value
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class Limit:
    """A number that stays between bounds; beyond them it costs as a residual of (excess / softness)."""

    of: Number
    softness: Value
    low: Value | None = None
    high: Value | None = None
    under: Under = field(default_factory=dict)


Term = Reading | Samples | Goal | Limit


ReadSlopes = tuple[Floats, Mapping[str, tuple[str, ...]]]
"""Derivatives (k, nu) of k numbers of a run by the unknowns, NaN where there is none, and sentences that say why, by
unknown."""


@dataclass(frozen=True)
class OfMeasure:
    """A measure by name, whose value batches have."""

    name: str
    count: int = 1

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """Derivatives of it."""
        found = run.gradient(self.name)
        return np.array([list(found.values())]), found.flags


@dataclass(frozen=True)
class OfEvents:
    """A function of the events, the period marks among them."""

    function: Callable[[NDArray[np.void]], float]
    count: int = 1

    def numbers(self, run: Run) -> Floats:
        """Numbers (k,) of a run."""
        return np.array([float(self.function(run.all_events))])

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """Derivatives of it."""
        found = run.gradient_of(self.function)
        return np.array([list(found.values())]), found.flags


@dataclass(frozen=True)
class OfStates:
    """Gap [m] of foot number ``foot``, or its rate [m/s], at times (k,) [s]."""

    foot: int
    times: Floats
    rate: bool

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.times)

    def numbers(self, run: Run) -> Floats:
        """Numbers (k,) of a run."""
        states = run.states(self.times)
        return np.asarray((states.rate if self.rate else states.gap)[self.foot])

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """Their derivatives."""
        found = run.state_gradients(self.times)
        rows = [(one.rate if self.rate else one.gap)[self.foot] for one in found.values()]
        return np.array(rows).reshape(len(run.paths), self.count).T, run.flags


Reader = OfMeasure | OfEvents | OfStates


class TermRole(Enum):
    """What a number is for."""

    RESIDUAL = "residual"
    GOAL = "goal"
    LIMIT = "limit"


@dataclass(frozen=True)
class TermRows:
    """One term: how its k numbers are read, in the run under ``under`` [SI], and what is made of them: rows
    ``sign * (number - level) / scale``, one for each of the levels (k,), or of a limit for each of its ends."""

    role: TermRole
    reader: Reader
    under: Mapping[str, float]
    level: Floats
    scale: Floats

    def rows(self, numbers: Floats) -> Floats:
        """Rows (..., kr) of numbers (..., k)."""
        return (numbers - self.level) / self.scale

    def slopes(self, slopes: Floats) -> Floats:
        """Derivatives (kr, nu) of the rows, of the numbers' (k, nu)."""
        return slopes / self.scale[:, None]


def term_rows_of(scene: Scene, terms: Sequence[Term], seconds: float) -> list[TermRows]:
    """Terms of runs of a scene over so many seconds.

    Raises
    ------
    InputError
        With everything that does not fit: measures, feet, paths, units, signs.
    """
    units = {name: one.unit for name, one in Run.offered(scene, seconds).items()}
    problems: list[str] = []
    if not terms:
        problems.append("terms: expected at least one reading, record of samples or goal")
    out = []
    for n, term in enumerate(terms, start=1):
        try:
            out.append(_one(scene, term, units, seconds))
        except InputError as error:
            problems += [f"term {n} ({type(term).__name__}): {text}" for text in error.problems]
    if problems:
        raise InputError(problems)
    return out


def _one(scene: Scene, term: Term, units: Mapping[str, str], seconds: float) -> TermRows:
    under = _under(scene, term.under)
    if isinstance(term, Samples):
        return _samples(scene, term, under, seconds)
    reader, unit = _reader(term.of, units)
    if isinstance(term, Reading):
        level, scale = parse_quantity(term.value, unit), parse_quantity(term.error, unit)
        _positive("error", scale)
        return TermRows(TermRole.RESIDUAL, reader, under, np.array([level]), np.array([scale]))
    if isinstance(term, Goal):
        scale = parse_quantity(term.scale, unit)
        if scale == 0.0 or not np.isfinite(scale):
            raise InputError("scale: expected a number that is not zero")
        return TermRows(TermRole.GOAL, reader, under, np.zeros(1), np.array([scale]))
    softness = parse_quantity(term.softness, unit)
    _positive("softness", softness)
    ends = [(sign, parse_quantity(end, unit)) for sign, end in ((-1.0, term.low), (1.0, term.high)) if end is not None]
    if not ends:
        raise InputError("expected a lower or an upper bound, low or high")
    if len(ends) == 2 and not ends[0][1] < ends[1][1]:
        raise InputError(f"expected low below high, got {term.low} and {term.high}")
    signs, level = np.array(ends).T
    return TermRows(TermRole.LIMIT, reader, under, level, signs * softness)


def _samples(scene: Scene, term: Samples, under: Mapping[str, float], seconds: float) -> TermRows:
    feet = list(scene.robot.feet)
    times, values = (np.asarray(one, dtype=float) for one in (term.times, term.values))
    problems = []
    if term.foot not in feet:
        problems.append(f"there is no foot '{term.foot}'{nearest(term.foot, feet)}")
    if times.ndim != 1 or not len(times) or values.shape != times.shape:
        problems.append("expected a row of times (nt,) and a value for each")
    elif not np.isfinite(values).all() or np.any(np.diff(times) < 0.0):
        problems.append("expected times in order and finite values")
    elif times[0] < 0.0 or times[-1] > seconds:
        problems.append(f"times: expected times within the run, 0 to {seconds:g} s")
    if problems:
        raise InputError(problems)
    error = parse_quantity(term.error, "m/s" if term.rate else "m")
    _positive("error", error)
    reader = OfStates(feet.index(term.foot), times, term.rate)
    return TermRows(TermRole.RESIDUAL, reader, under, values, np.full(len(values), error))


def _reader(of: Number, units: Mapping[str, str]) -> tuple[Reader, str]:
    if not isinstance(of, str):
        return OfEvents(of), "1"
    if of not in units:
        raise InputError(no_measure(of, units))
    return OfMeasure(of), units[of]


def _positive(name: str, value: float) -> None:
    if not 0.0 < value < np.inf:
        raise InputError(f"{name}: expected a number above 0, got {value:g}")


def _under(scene: Scene, given: Mapping[str, Value]) -> dict[str, float]:
    known, given = float_paths(scene), by_path(scene, given)
    with_values(scene, given)  # an unknown path or a refused value has a sentence of its own
    if other := [path for path in given if path not in known]:
        raise InputError([f"under: {path} is not a number in this scene" for path in other])
    return {path: parse_quantity(value, known[path].unit) for path, value in given.items()}
