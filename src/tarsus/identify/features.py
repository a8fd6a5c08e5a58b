"""Features of a record instead of its trajectory: durations, peaks and counts by drive period, with their errors.

Motion with impacts forgets its start: two records of one device soon differ sample by sample, and so do a record and
its simulation. What stays are statistics over drive periods.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import Amount, Description, quantity
from tarsus.base.workers import Workers
from tarsus.measure import PER_WINDOW, Judged, Judgement, Moments, RunTable, by_period
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, simulate_batch

Floats = NDArray[np.float64]

FEATURES = ("contact_duration", "peak", "bounces", "impact_speed", "rebound")
"""Features that are taken unless others are asked for: those measures by drive period that a vibrometer sees, and
``rebound``, the highest flight of a period that began by a bounce."""

_UNITS = {"rebound": "m"}


class Resolution(Description):
    """What one drive period of a record resolves, and how far the model itself is trusted."""

    time: Amount = quantity("s", "standard error of a duration", default=5e-5, gt=0)
    length: Amount = quantity("m", "standard error of a height", default=1e-7, gt=0)
    speed: Amount = quantity("m/s", "standard error of a speed", default=1e-4, gt=0)
    count: Amount = quantity("1", "standard error of a count", default=0.5, gt=0)
    share: Amount = quantity(
        "1",
        "error of calibration and model as a share of any feature, which no repeat averages out",
        default=0.03,
        ge=0,
    )
    rebound: Amount = quantity("m", "height that a rebound must clear to be seen", default=1e-7, gt=0)

    def resolution(self, unit: str) -> float:
        """Standard error of a feature of a unit in one period."""
        return {"s": self.time, "m": self.length, "m/s": self.speed, "1": self.count}[unit]


@dataclass(frozen=True)
class Features:
    """Features of one record, nf of them.

    names; units [SI]; values (nf,): means over drive periods, NaN where there is none, such as an impact speed without
    impacts; spread (nf,): standard deviation from period to period; periods: how many were seen, in all repeats.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Floats
    spread: Floats
    periods: int

    def error(self, instrument: Resolution) -> Floats:
        """Standard error (nf,) of the values: spread and resolution over the periods, and what does not average out."""
        resolved = np.array([instrument.resolution(unit) for unit in self.units])
        random = (np.nan_to_num(self.spread) ** 2 + resolved**2) / self.periods
        return np.sqrt(random + (instrument.share * np.nan_to_num(self.values)) ** 2)


@dataclass(frozen=True)
class Batched:
    """Features of nr runs: values, spread (nr, nf), rows of NaN for runs that did not reach their end."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Floats
    spread: Floats
    periods: int

    def of(self, i: int) -> Features:
        """Features of run number i."""
        return Features(self.names, self.units, self.values[i], self.spread[i], self.periods)


def features_of(
    run: Judged, kinds: Sequence[str] = FEATURES, *, skip: int | None = None, resolution: float = 1e-7
) -> Features:
    """Features of one run, or of one run of a batch.

    Parameters
    ----------
    kinds
        Names of measures (see `tarsus.measure`), or ``rebound``. With several feet each foot has its own, such as
        ``peak.left``.
    skip
        Drive periods dropped as transient; by default a third.
    resolution
        Height [m] that a rebound must clear to be seen.

    Raises
    ------
    InputError
        For an unknown kind, with the nearest valid one.
    """
    found = _found(Judgement(RunTable.of(run), skip=skip, height=resolution), kinds)
    return found.of(0)


def simulated(
    scene: Scene,
    vary: Mapping[str, ArrayLike],
    duration: float,
    kinds: Sequence[str] = FEATURES,
    *,
    skip: int | None = None,
    resolution: float = 1e-7,
    threads: Workers = None,
    accuracy: Accuracy | None = None,
) -> Batched:
    """Features of many runs of a scene; arguments as for `tarsus.simulate_batch` and `features_of`."""
    batch = simulate_batch(scene, vary, duration, threads=threads, accuracy=accuracy)
    done = batch.done[:, None]
    tables = list(batch.tables())
    parts = [_found(Judgement(table, skip=skip, height=resolution), kinds) for _, table in tables]
    order = np.argsort(np.concatenate([members for members, _ in tables]))
    values, spread = (
        np.concatenate(rows)[order] for rows in zip(*((one.values, one.spread) for one in parts), strict=True)
    )
    return replace(
        parts[0], values=np.where(done, values, np.nan), spread=np.where(done, spread, np.nan),
        periods=min(one.periods for one in parts),
    )  # fmt: skip


def _found(judgement: Judgement, kinds: Sequence[str]) -> Batched:
    """Features of the runs of a table.

    Raises InputError for unknown kinds.
    """
    offered = [*PER_WINDOW, *_UNITS]
    wrong = [f"there is no feature '{kind}'{nearest(kind, offered)}" for kind in kinds if kind not in offered]
    if wrong:
        raise InputError(wrong)
    feet, runs = judgement.table.feet, len(judgement.table)
    measures = by_period(judgement, [kind for kind in kinds if kind in PER_WINDOW])
    units = [PER_WINDOW[kind].unit if kind in PER_WINDOW else _UNITS[kind] for kind in kinds]
    values, spread = np.full((2, runs, len(feet), len(kinds)), np.nan)
    for k, kind in enumerate(kinds):
        if kind not in measures:
            highest = _highest_rebounds(judgement)
            values[:, :, k], spread[:, :, k] = (
                one.reshape(runs, -1) for one in (highest.mean, highest.spread)
            )
        elif (each := measures[kind].per_foot) is not None:
            values[:, :, k], spread[:, :, k] = each, measures[kind].spread[:, None]
    names = tuple(kind if len(feet) == 1 else f"{kind}.{foot}" for foot in feet for kind in kinds)
    periods = int(judgement.windows.count.min())
    return Batched(
        names, tuple(units * len(feet)), values.reshape(runs, -1), spread.reshape(runs, -1), periods
    )


def _highest_rebounds(judgement: Judgement) -> Moments:
    """Moments of each foot's highest apex [m] in each period of the flights that began by a bounce and are seen."""
    seen, flights = judgement.seen, judgement.histories.flights
    rebounds = flights.rebounds(judgement.height)
    rows = seen.most(flights.own[rebounds], flights.start[rebounds], flights.apex[rebounds])
    return Moments.of(rows, seen.windows.own, len(seen.windows.count))
