"""Numbers that are searched: their bounds, their scales, and what is known of them beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Description, float_paths
from tarsus.base.units import parse_quantity
from tarsus.model.scene import Scene

Value = float | str
"""A number in SI, or a text with a unit."""


class Scale(StrEnum):
    """What a step of a search is."""

    LINEAR = "linear"
    """A difference."""
    LOG = "log"
    """A factor."""


class Prior(Description):
    """What is known of an unknown beforehand: normal (median, sd) or log-normal (median, factor)."""

    median: Value
    sd: Value | None = Field(default=None, description="standard deviation of a normal prior")
    factor: float | None = Field(default=None, gt=1.0, description="one standard deviation, as a factor")

    def __init__(self, median: Value | None = None, sd: Value | None = None, factor: float | None = None) -> None:
        super().__init__(**_given(median=median, sd=sd, factor=factor))

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @model_validator(mode="after")
    def _one_kind(self) -> Prior:
        if (self.sd is None) == (self.factor is None):
            raise PathErrors([("", "expected one of sd (normal) and factor (log-normal)")])
        return self

    def in_si(self, unit: str) -> Prior:
        """The same as plain numbers; raises InputError where a text has another unit, or the spread is not above 0."""
        median = parse_quantity(self.median, unit)
        sd = None if self.sd is None else parse_quantity(self.sd, unit)
        if (sd is not None and not sd > 0.0) or (self.factor is not None and not median > 0.0):
            raise InputError("prior: expected a positive spread, and positive values for a factor")
        return Prior(median, sd, self.factor)

    def offsets(self, values: Floats) -> Floats:
        """Distances of SI values from the median, in standard deviations."""
        if self.factor is not None:
            return np.log(values / float(self.median)) / np.log(self.factor)
        return (values - float(self.median)) / float(self.sd or 1.0)

    def placed(self, offset: float) -> float:
        """Value in SI so many standard deviations from the median."""
        if self.factor is not None:
            return float(self.median) * float(self.factor**offset)
        return float(self.median) + offset * float(self.sd or 1.0)

    def rates(self, values: Floats) -> Floats:
        """Derivatives of the `offsets` by the values."""
        if self.factor is not None:
            return 1.0 / (values * np.log(self.factor))
        return np.full(np.shape(values), 1.0 / float(self.sd or 1.0))


class Unknown(Description):
    """A number that is searched between bounds.

    Parameters
    ----------
    path
        Number of the scene that it is; none where `paths` are given, or where it serves expressions only.
    low, high
        Bounds: SI, or texts with a unit.
    scale
        Whether a step is a difference ("linear") or a factor ("log").
    """

    path: str = ""
    low: Value
    high: Value
    scale: Scale = Scale.LINEAR
    circular: bool = Field(default=False, description="its upper bound is its lower one, such as a phase's")
    unit: str | None = Field(default=None, description="of an unknown without paths; else that of its paths")
    paths: tuple[str, ...] = Field(default=(), description="numbers of the scene that take it, instead of one")
    name: str = Field(default="", description="what it is called; its path when absent")
    prior: Prior | None = None
    size: Value | None = Field(
        default=None,
        description="of an unknown that may be zero or of either sign: what a change of it is compared with to judge "
        "whether it is determined; the unknown itself when absent",
    )
    meaning: str = ""

    def __init__(
        self,
        path: str = "",
        low: Value | None = None,
        high: Value | None = None,
        scale: Scale | str | None = None,
        **more: Any,
    ) -> None:
        super().__init__(**_given(path=path, low=low, high=high, scale=scale), **more)

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @property
    def targets(self) -> tuple[str, ...]:
        """Numbers of the scene that take it."""
        return self.paths or ((self.path,) if self.path else ())

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or self.path


Ranges = Mapping[str, tuple[Value, Value]]
"""Unknowns as bounds by path or short word: ``{"robot.feet.tip.gap": ("60 um", "80 um")}``."""


def listed(unknowns: Sequence[Unknown] | Ranges) -> tuple[Unknown, ...]:
    """Unknowns given one by one, or as bounds by path.

    Raises InputError where there are none, and with each that is neither.
    """
    if isinstance(unknowns, Unknown):
        return (unknowns,)
    found: list[Unknown] = []
    problems: list[str] = []
    if isinstance(unknowns, Mapping):
        for path, bounds in unknowns.items():
            try:
                low, high, *scale = bounds
                if isinstance(bounds, str) or len(scale) > 1:
                    raise ValueError
                found.append(Unknown(path, low, high, *scale))
            except InputError as error:
                problems += [f"{path}: {text}" for text in error.problems]
            except (TypeError, ValueError):
                problems.append(f"{path}: expected (low, high), got {bounds!r:.60}")
    else:
        for one in unknowns:
            if isinstance(one, Unknown):
                found.append(one)
            else:
                example = 'tarsus.Unknown("robot.feet.tip.gap", "60 um", "80 um")'
                expected = f"expected each as {example}, or all as {{path: (low, high)}}"
                problems.append(f"unknowns: {expected}, got {one!r:.60}")
    if not found and not problems:
        problems.append("unknowns: expected at least one")
    if problems:
        raise InputError(problems)
    return tuple(found)


def _given(**values: Any) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True)
class Unknowns:
    """nu numbers that are searched.

    names; units; bounds (nu,) [SI]; log (nu,): whether on a logarithmic scale; priors in SI; and by keyword sizes [SI]
    that changes of those are compared with that may be of either sign (None: the number itself), circular (nu,): whose
    range closes on itself, targets: the numbers of a scene that take each.

    Searches move in the *cube*: x = 0 is the lower bound and 1 the upper one, linearly or by the logarithm.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: Floats
    high: Floats
    log: NDArray[np.bool_]
    priors: tuple[Prior | None, ...]
    sizes: tuple[float | None, ...] = field(default=(), kw_only=True)
    circular: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool), kw_only=True)
    targets: tuple[tuple[str, ...], ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        if not self.sizes:
            object.__setattr__(self, "sizes", (None,) * len(self.names))
        if not len(self.circular):
            object.__setattr__(self, "circular", np.zeros(len(self.names), dtype=bool))
        if not self.targets:
            object.__setattr__(self, "targets", ((),) * len(self.names))

    @classmethod
    def of(cls, scene: Scene, unknowns: Sequence[Unknown] | Ranges) -> Unknowns:
        """The unknowns of a scene in SI; short words stand for all of their numbers.

        Raises
        ------
        InputError
            With every path that the scene does not have or that is named twice, every unit and every bound that does
            not fit.
        """
        known = float_paths(scene)
        words = scene.short_words()
        problems: list[str] = []
        try:
            asked = listed(unknowns)
        except InputError as error:
            asked = ()
            problems.extend(error.problems)
        columns, every_path = [], []
        for one in asked:
            if not one.label:
                problems.append("unknowns: one has neither a path nor a name")
            targets = tuple(path for name in one.targets for path in words.get(name, (name,)))
            every_path += targets
            for path in targets:
                if path not in known:
                    hint = nearest(path, [*words, *known])
                    problems.append(f"{one.label}: the scene has no number '{path}'{hint}")
            unit = next((known[path].unit for path in targets if path in known), one.unit or "1")
            if targets and known.keys().isdisjoint(targets):
                continue  # what its bounds should be is not known either
            if one.unit not in (None, unit):
                problems.append(f"{one.label}: its numbers are in {unit}; write '50 {one.unit}' in place of `unit`")
            try:
                columns.append((one.label, unit, *_in_si(one, unit), one.circular, targets))
            except InputError as error:
                problems += [f"{one.label}: {text}" for text in error.problems]
        for what, every in (
            ("is unknown twice", every_path),
            ("is the name of two unknowns", [one.label for one in asked]),
        ):
            problems += [f"{each}: {what}" for each in dict.fromkeys(every) if every.count(each) > 1]
        if problems:
            raise InputError(dict.fromkeys(problems))
        names, units, low, high, log, priors, sizes, circular, targets = zip(*columns, strict=True)
        return cls(
            names,
            units,
            np.array(low),
            np.array(high),
            np.array(log),
            priors,
            sizes=sizes,
            circular=np.array(circular),
            targets=targets,
        )

    def __len__(self) -> int:
        return len(self.names)

    def values(self, cube: Floats) -> Floats:
        """SI values of points (..., nu) of the cube; those outside are taken to its side, or around it."""
        x = np.clip(np.where(self.circular & ((cube < 0.0) | (cube > 1.0)), np.remainder(cube, 1.0), cube), 0.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(self.log, self.high / np.where(self.log, self.low, 1.0), 1.0)
        factors = np.where(self.log, self.low, 1.0) * ratio**x
        return np.where(self.log, factors, self.low + (self.high - self.low) * x)

    def by_name(self, cube: Floats) -> dict[str, float]:
        """SI values by name at a point (nu,) of the cube."""
        return dict(zip(self.names, self.values(cube).tolist(), strict=True))

    def by_path(self, values: Floats) -> dict[str, float]:
        """Numbers of the scene by path, of SI values (nu,)."""
        return {path: value for own, value in zip(self.targets, values.tolist(), strict=True) for path in own}

    def cube(self, values: Floats) -> Floats:
        """Points (..., nu) of the cube of SI values."""
        with np.errstate(divide="ignore", invalid="ignore"):
            log = np.log(values / self.low) / np.log(self.high / self.low)
        return np.where(self.log, log, (values - self.low) / (self.high - self.low))

    def slopes(self, cube: Floats) -> Floats:
        """Derivatives (..., nu) of the SI values by the cube's coordinates."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(self.log, np.log(self.high / self.low), 0.0)
        return np.where(self.log, rate * self.values(cube), self.high - self.low)

    def draws(self, count: int, seed: int | np.random.Generator = 0) -> Floats:
        """``count`` points (count, nu) spread evenly over the cube: the beginning of a scrambled Sobol sequence."""
        return even_points(len(self), count, seed)

    def precision(self, cube: Floats) -> Floats:
        """What is known of each unknown (nu,) beforehand, at a point (nu,): one over the variance in the cube of its
        bounds, and of its prior."""
        return 12.0 + self.prior_slopes(cube) ** 2

    def prior_residuals(self, cube: Floats) -> Floats:
        """Distances (..., nu) from the priors' medians in their deviations; zero where there is none."""
        values = self.values(cube)
        out = np.zeros(values.shape)
        for i, prior in enumerate(self.priors):
            if prior is not None:
                out[..., i] = prior.offsets(values[..., i])
        return out

    def prior_slopes(self, cube: Floats) -> Floats:
        """Derivatives (..., nu) of `prior_residuals` by their own coordinate of the cube."""
        values, rates = self.values(cube), self.slopes(cube)
        out = np.zeros(values.shape)
        for i, prior in enumerate(self.priors):
            if prior is not None:
                out[..., i] = prior.rates(values[..., i]) * rates[..., i]
        return out


def _in_si(one: Unknown, unit: str) -> tuple[float, float, bool, Prior | None, float | None]:
    """Bounds, whether logarithmic, prior and size of an unknown."""
    low, high = parse_quantity(one.low, unit), parse_quantity(one.high, unit)
    problems = [] if low < high else [f"the range from {one.low} to {one.high} is empty"]
    log = one.scale is Scale.LOG
    if log and low <= 0.0:
        problems.append(f"expected a lower bound above 0 on a logarithmic scale, got {one.low}")
    prior = None
    if one.prior is not None:
        prior = one.prior.in_si(unit)
        if prior.factor is not None and low <= 0.0:
            problems.append(f"prior: a factor needs a lower bound above 0, got {one.low}")
        if low < high and not low <= float(prior.median) <= high:
            problems.append(f"prior: expected a median between the bounds, got {one.prior.median}")
    size = None if one.size is None else parse_quantity(one.size, unit)
    if size is not None and size <= 0.0:
        problems.append(f"size: expected a value above 0, got {one.size}")
    if problems:
        raise InputError(problems)
    return low, high, log, prior, size


def even_points(unknowns: int, count: int, seed: int | np.random.Generator = 0) -> Floats:
    """Points (count, nu) of the unit cube, spread evenly: the beginning of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # takes longer to load than all searches

    # scipy draws other points of a whole number by its newer name, rng
    sobol = qmc.Sobol(unknowns, seed=seed)  # pyright: ignore[reportCallIssue]
    return sobol.random_base2(int(np.ceil(np.log2(max(count, 1)))))[:count]


def inside(points: Floats, circular: NDArray[np.bool_] | bool = False) -> Floats:
    """Points (..., nu) moved out of the unit cube, back in it: reflected at its sides, or around where the range of an
    unknown closes on itself."""
    low = np.abs(points)
    reflected = np.clip(np.where(low > 1.0, 2.0 - low, low), 0.0, 1.0)
    return np.where(circular, np.remainder(points, 1.0), reflected)
