"""What every step of the identification chain returns: numbers by path, draws of them, residuals, what was used."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.verdict import LEVEL, Verdict
from tarsus.records.excluded import Excluded
from tarsus.records.purpose import Purpose

if TYPE_CHECKING:
    from tarsus.identify.influence import Influence

ASSUMED, PREFERRED, UNDECIDED = Verdict.ASSUMED.value, Verdict.PREFERRED.value, Verdict.UNDECIDED.value
"""What records say of a number or a law that they do not determine: nothing, so that it is taken as known beforehand;
that one of several answers is the more likely; that several remain."""


@dataclass(frozen=True)
class Used:
    """How many of something a step used, of how many there were, such as 37 of 40 impacts."""

    what: str
    used: int
    found: int

    def __str__(self) -> str:
        return f"{self.used} of {self.found} {self.what}"


@dataclass(frozen=True)
class Residual:
    """What one record, or one group of data, leaves unexplained.

    label; unit [SI] of rms; rms of measured less fitted; noise: rms that the instrument's noise alone would leave
    (NaN where it is not known); count of values.
    """

    label: str
    unit: str
    rms: float
    noise: float
    count: int

    @classmethod
    def of(cls, label: str, unit: str, left: Floats, noise: Floats | float) -> Residual:
        """Of what is left (n,), and the standard deviation of each of it by noise, or of all."""
        rms, by_noise = (float(np.sqrt(np.mean(np.square(one)))) for one in (left, noise))
        return cls(label, unit, rms, by_noise, left.size)


@dataclass(frozen=True)
class Curve:
    """One line or set of points for a figure: label, x and y (n,) in SI; joined: a line rather than points."""

    label: str
    x: Floats
    y: Floats
    joined: bool = True
    error: Floats | None = None


@dataclass(frozen=True)
class Panel:
    """Curves that share axes: a title, and what the axes show with their SI units ("m", "V", "N", "1", ...)."""

    title: str
    x_label: str
    x_unit: str
    y_label: str
    y_unit: str
    curves: tuple[Curve, ...]


def points_and_line(
    title: str,
    axes: tuple[str, str, str, str],
    names: tuple[str, str],
    points: tuple[Floats, Floats],
    line: tuple[float, float],
    error: Floats,
) -> Panel:
    """Points (n,) with their errors (n,), and a line (at zero, slope) through them."""
    x, y = points
    ends = np.array([0.0, float(x.max())])
    fitted = Curve(names[1], ends, line[0] + line[1] * ends)
    return Panel(title, *axes, (Curve(names[0], x, y, joined=False, error=error), fitted))


def measured_and_fitted(title: str, axes: tuple[str, str, str, str], x: Floats, fitted: Floats, left: Floats) -> Panel:
    """What was fitted (n,) as a line, and with what it leaves as points."""
    return Panel(title, *axes, (Curve("measured", x, fitted + left, joined=False), Curve("fitted", x, fitted)))


def over_noise(label: str, left: Floats) -> Residual:
    """What a fit leaves of a record, over its noise."""
    return Residual.of(f"{label}, over the noise", "1", left, 1.0)


@dataclass(frozen=True)
class Check:
    """Whether what was found predicts what it was not fitted to.

    name: what is compared; value and limit [unit]; least: whether the value must reach the limit rather than stay
    below it; paths: the numbers that a check which fails takes the word "determined" from; cause: what a failure means;
    record: what to record where it fails; far: by path, how far a number may be off where it fails [SI], of those of
    which that is known.
    """

    name: str
    value: float
    limit: float
    unit: str = "1"
    least: bool = False
    paths: tuple[str, ...] = ()
    cause: str = ""
    record: str = ""
    far: Mapping[str, float] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the value keeps to the limit; a value that is no number does not."""
        return self.value >= self.limit if self.least else self.value <= self.limit


def failures(checks: Iterable[Check]) -> list[str]:
    """Checks that have failed, in words: a sentence for every cause, with the figures by which it shows."""
    figures: dict[str, list[str]] = {}
    for one in checks:
        if not one.passed:
            bound = "least" if one.least else "most"
            figures.setdefault(one.cause, []).append(f"{one.name} {one.value:.3g}, {one.limit:.3g} at {bound}")
    return [f"{cause} ({'; '.join(said)})" for cause, said in figures.items()]


@dataclass(frozen=True)
class StepResult:
    """What one step found.

    name: of the step; paths: of the np parameters in the device, such as "ground.film.coefficient"; values (np,) in
    SI; samples (ns, np): draws of the estimate over repeats, with what earlier steps do not know propagated (draw i of
    every step of a chain belongs together); combinations: named functions of the parameters that the data determine
    better than each alone, as (value, draws (ns,), unit); residuals; used and left_out: the account of the data;
    panels: for figures; notes: sentences; taken: paths among them that these data do not tell, whose values only go
    with the others; files: of which something was used; bounds: by path, ends [SI] that physics sets a parameter and
    these data do not exclude, infinite where the data set the end; checks of what was found; about: a sentence on what
    is fitted to which data; records: these in a word; influence: how far parts of the data pull the parameters, where
    the step states it. Tables and pages show all of it as it stands here.

    Raises
    ------
    ValueError
        If the shapes do not belong together: a fault of the step.
    """

    name: str
    paths: tuple[str, ...]
    values: Floats
    samples: Floats
    combinations: Mapping[str, tuple[float, Floats, str]] = field(default_factory=dict)
    residuals: tuple[Residual, ...] = ()
    used: tuple[Used, ...] = ()
    left_out: tuple[Excluded, ...] = ()
    panels: tuple[Panel, ...] = ()
    notes: tuple[str, ...] = ()
    taken: tuple[str, ...] = ()
    files: frozenset[str] = frozenset()
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    about: str = ""
    records: str = ""
    influence: Influence | None = None

    def __post_init__(self) -> None:
        count = len(self.paths)
        if np.shape(self.values) != (count,) or np.ndim(self.samples) != 2 or self.samples.shape[1] != count:
            raise ValueError(
                f"step {self.name}: expected {count} values and draws of shape (draws, {count}), got "
                f"{np.shape(self.values)} and {np.shape(self.samples)}"
            )

    def value(self, path: str) -> float:
        """Estimate of one parameter [SI]."""
        return float(self.values[self.paths.index(path)])

    def draws(self, path: str) -> Floats:
        """Draws (ns,) of one parameter [SI]."""
        return self.samples[:, self.paths.index(path)]

    def interval(self, path: str) -> tuple[float, float]:
        """Ends of the middle 95 % of a parameter's draws [SI], or the bound that the data do not exclude; NaN without
        draws, with one that is not finite, or where the data do not tell it."""
        drawn = self.draws(path)
        if not len(drawn) or path in self.taken or not np.isfinite(drawn).all():
            return np.nan, np.nan
        ends = np.quantile(drawn, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0]).tolist()
        bounds = self.bounds.get(path, (-np.inf, np.inf))
        low, high = (b if np.isfinite(b) else end for end, b in zip(ends, bounds, strict=True))
        return low, high

    def unsound(self) -> list[str]:
        """Sentences on numbers that are none: not finite, without an interval, or outside of their own.

        A draw that ran away does all three: the fit does not settle, and nothing of it is an identified number.
        """
        problems: list[str] = []
        for path, value in zip(self.paths, self.values.tolist(), strict=True):
            if path in self.taken:
                continue
            low, high = self.interval(path)
            slack = 1e-9 * abs(value)  # rounding
            if not np.isfinite(value):
                problems.append(f"its {path} comes out as {value:g}: the data do not settle the fit")
            elif not np.isfinite([low, high]).all():
                problems.append(f"its {path} of {value:.3g} has no finite interval: the data do not settle the fit")
            elif not low - slack <= value <= high + slack:
                problems.append(
                    f"its {path} of {value:.3g} lies outside of its own interval, {low:.3g} to {high:.3g}: the data do "
                    "not settle the fit"
                )
        return problems

    @property
    def unused(self) -> int:
        """How much of what it counts the step left out, of all reasons together."""
        return sum(one.count for one in self.left_out)

    @property
    def std(self) -> Floats:
        """Standard deviations (np,) of the draws [SI]."""
        if len(self.samples) < 2:
            return np.full(len(self.paths), np.nan)
        return np.std(self.samples, axis=0, ddof=1)


UNSOLVED = (InputError, np.linalg.LinAlgError, FloatingPointError, OverflowError)
"""What data do to a step: a refusal, singular equations, numbers out of range. Any other exception is a fault of the
program, and is not caught."""


@dataclass(frozen=True)
class NotDone:
    """A step that found nothing, and why, one sentence each; purpose: of the records that it is for."""

    name: str
    reasons: tuple[str, ...]
    purpose: Purpose
