"""What a device, or a weighted ensemble of devices, forecasts for a number of a table: median and 80 % interval.

A number of a table was read from some drive periods or a short window, and a bouncing foot does something else in each.
A forecast is therefore a distribution: over the periods or windows of a run, over random initial states, and over the
devices that fit, each with its weight; and over what the model misses, for an ensemble that knows it from rows that
were excluded (`tarsus.calibrate.prediction`: the same numbers and the same function).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.calibrate.prediction import Miss, median_and_interval
from tarsus.files.library import load_scene
from tarsus.model.scene import Scene, Source

CALIBRATED, PREDICTED = "calibrated on", "predicted"
"""Roles of a row: the device was fitted to it, or never saw it."""


@dataclass(frozen=True)
class Member:
    """One device of an ensemble: scene as described, weight [1] relative to the others'."""

    scene: Scene
    weight: float = 1.0

    @property
    def calibrated(self) -> bool:
        """Whether any of its numbers was calibrated."""
        return any(origin.source is Source.CALIBRATED for origin in self.scene.provenance.values())


def members_of(device: str | Sequence[Member]) -> tuple[Member, ...]:
    """A device by name or file as an ensemble of one, or the members of an ensemble with weights that sum to 1.

    Raises InputError for an unknown device, an empty ensemble and a weight that is not above 0.
    """
    members = [Member(load_scene(device))] if isinstance(device, str) else list(device)
    if not members:
        raise InputError("an ensemble of devices needs at least one")
    problems = [
        f"{one.scene.name}: the weight of a device in an ensemble is above 0, got {one.weight:g}"
        for one in members
        if not (one.weight > 0.0 and math.isfinite(one.weight))
    ]
    if problems:
        raise InputError(problems)
    total = math.fsum(one.weight for one in members)
    return tuple(Member(one.scene, one.weight / total) for one in members)


def role_of(members: Sequence[Member], packaged: bool, measured: bool) -> str:
    """Whether a row was calibrated on or is predicted: packaged rows with a measurement are what devices with
    calibrated numbers were fitted to; rows of a file never are."""
    return CALIBRATED if packaged and measured and any(one.calibrated for one in members) else PREDICTED


@dataclass(frozen=True)
class RowReadings:
    """What is read of the runs of a scene: values (n,) [SI] by measure, of each drive period or window; how many runs
    reached their end, and sentences of those that did not."""

    values: Mapping[str, Floats]
    runs: int
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class WeightedValues:
    """Values (n,) of one number by period or window, with the weight (n,) of each; NaN where it has none."""

    values: Floats
    weights: Floats

    @classmethod
    def joined(cls, parts: Sequence[tuple[float, Floats]]) -> WeightedValues:
        """Of several members: weight of each, spread evenly over its values."""
        return cls(
            np.concatenate([values for _, values in parts]),
            np.concatenate([np.full(len(values), weight / max(len(values), 1)) for weight, values in parts]),
        )

    def share(self, least: float, miss: Miss | None = None) -> float | None:
        """Probability that there is so much: share of the weight, mixed where the model is known to be wrong; None
        without values."""
        known = np.isfinite(self.values)
        total = float(self.weights[known].sum())
        if total <= 0.0:
            return None
        plain = float(self.weights[known & (self.values >= least)].sum() / total)
        return plain if miss is None else miss.chance(plain)


@dataclass(frozen=True)
class Forecast:
    """Median and ends of the 80 % interval; NaN where nothing is forecast."""

    median: float
    low: float
    high: float

    def scaled(self, factor: float) -> Forecast:
        """In another unit."""
        return Forecast(self.median * factor, self.low * factor, self.high * factor)

    def to_dict(self) -> dict[str, float | None]:
        """Plain data; None for NaN."""
        return {
            name: value if math.isfinite(value := getattr(self, name)) else None
            for name in ("median", "low", "high")
        }


def medians(forecasts: Mapping[str, Forecast]) -> dict[str, float | None]:
    """What is compared with a table, None where nothing is forecast."""
    return {key: one.to_dict()["median"] for key, one in forecasts.items()}


def forecast(samples: WeightedValues, miss: Miss | None = None) -> Forecast:
    """Median and 80 % interval of weighted values [SI], with what the model misses where that is known."""
    known = np.isfinite(samples.values) & (samples.weights > 0.0)
    values, weights = samples.values[known], samples.weights[known]
    return Forecast(
        *median_and_interval(*((values, weights) if miss is None else miss.widened(values, weights)))
    )
