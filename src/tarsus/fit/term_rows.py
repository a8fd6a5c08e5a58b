"""The terms of a fit resolved: names, feet and units, with every fault of them in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import by_path, float_paths, with_values
from tarsus.base.units import parse_quantity
from tarsus.fit.readers import OfEvents, OfMeasure, OfStates, Reader
from tarsus.fit.terms import Goal, Number, Reading, Samples, Term, Value
from tarsus.measure.measure import no_measure
from tarsus.model.scene import Scene
from tarsus.solve import Run


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
