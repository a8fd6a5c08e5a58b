"""What a fit asks of runs: readings and samples that were measured, limits, and functions; and how each is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

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

Number = str | Callable[[NDArray[np.void]], float]
"""A number of a run: a measure by name, or a function of its events with the period marks (`Run.all_events`)."""
Value = float | str
"""SI, or a text with a unit; of a function of the events always SI."""
Under = Mapping[str, Value]
"""What differs from the scene in the run that is meant, by path."""
RunFunction = Callable[[Run], ArrayLike]
"""Residuals (nr,) of a run in units of their errors."""


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
class Limit:
    """A number that stays between bounds; beyond them it costs as a residual of (excess / softness)."""

    of: Number
    softness: Value
    low: Value | None = None
    high: Value | None = None
    under: Under = field(default_factory=dict)


Term = Reading | Samples | Limit | RunFunction


@dataclass(frozen=True)
class TermRows:
    """One term: the measure or the function that gives its k numbers in the run under ``under`` [SI], and the rows that
    are made of them: (number - level) / scale, or the numbers themselves without levels.

    limit: rows count above zero only; ordered: they are in order of time.
    """

    read: str | RunFunction
    under: Mapping[str, float]
    level: Floats | None = None
    scale: Floats | float = 1.0
    limit: bool = False
    ordered: bool = False

    def rows(self, numbers: Floats) -> Floats:
        """Rows (n, kr) of numbers (n, k)."""
        rows = numbers if self.level is None else (numbers - self.level) / self.scale
        return np.maximum(rows, 0.0) if self.limit else rows


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
        problems.append("terms: expected at least one reading, record of samples, limit or function of a run")
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
    if callable(term):
        return TermRows(term, {}, ordered=True)
    if not isinstance(term, Reading | Samples | Limit):
        raise InputError(f"expected a reading, samples, a limit or a function of a run, got {term!r:.60}")
    under = _under(scene, term.under)
    if isinstance(term, Samples):
        return _samples(scene, term, under, seconds)
    read, unit = _read(term.of, units)
    if isinstance(term, Reading):
        scale = _positive("error", term.error, unit)
        return TermRows(read, under, np.array([parse_quantity(term.value, unit)]), np.array([scale]))
    softness = _positive("softness", term.softness, unit)
    ends = [(sign, parse_quantity(end, unit)) for sign, end in ((-1.0, term.low), (1.0, term.high)) if end is not None]
    if not ends:
        raise InputError("expected a lower or an upper bound, low or high")
    if len(ends) == 2 and not ends[0][1] < ends[1][1]:
        raise InputError(f"expected low below high, got {term.low} and {term.high}")
    signs, level = np.array(ends).T
    return TermRows(read, under, level, signs * softness, limit=True)


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
    error = _positive("error", term.error, "m/s" if term.rate else "m")
    foot, what = feet.index(term.foot), "rate" if term.rate else "gap"

    def read(run: Run) -> Floats:
        return np.asarray(getattr(run.states(times), what)[foot])

    return TermRows(read, under, values, np.full(len(values), error), ordered=True)


def _read(of: Number, units: Mapping[str, str]) -> tuple[str | RunFunction, str]:
    """How a number is read of a run, and its unit."""
    if not isinstance(of, str):
        return lambda run: of(run.all_events), "1"
    if of not in units:
        raise InputError(no_measure(of, units))
    return of, units[of]


def _positive(name: str, given: Value, unit: str) -> float:
    value = parse_quantity(given, unit)
    if not 0.0 < value < np.inf:
        raise InputError(f"{name}: expected a number above 0, got {value:g}")
    return value


def _under(scene: Scene, given: Mapping[str, Value]) -> dict[str, float]:
    known, given = float_paths(scene), by_path(scene, given)
    with_values(scene, given)  # an unknown path or a refused value has a sentence of its own
    if other := [path for path in given if path not in known]:
        raise InputError([f"under: {path} is not a number in this scene" for path in other])
    return {path: parse_quantity(value, known[path].unit) for path, value in given.items()}
