"""The same numbers over a series of campaigns on one device: which of them moved, since when, and how fast."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.progress import Progress
from tarsus.base.spec import float_paths
from tarsus.files.jsontext import json_text
from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.identify.campaign import Opened, read_campaign
from tarsus.identify.chain import Identification, identify
from tarsus.tables.numbers import amount
from tarsus.tables.table import ROW, Column, Table, Tabled

FALSE_ALARMS = 0.01
"""Probability that a series of a device which does not change raises any alarm: one series in a hundred."""

TRACK_FILES = ("track.json", "track.csv", "report.html")
"""Everything that a series leaves in its folder, with its report."""

_WIDE = float(ndtri(0.975))
"""Standard errors in half of a 95 % interval."""


@dataclass(frozen=True)
class Drift:
    """One number over the series.

    path; unit [SI]; values and errors (n,): estimates and their standard errors, NaN where a campaign does not
    determine it; since: place in the series at which it first lies apart from all before, or at which its trend first
    stands out, None without alarm; rate: trend [unit per campaign] and its standard error.
    """

    path: str
    unit: str
    values: Floats
    errors: Floats
    since: int | None
    rate: tuple[float, float]

    @property
    def change(self) -> float:
        """Last estimate less the first one [unit]; NaN with fewer than two."""
        known = self.values[np.isfinite(self.values)]
        return float(known[-1] - known[0]) if len(known) > 1 else float("nan")


@dataclass(frozen=True, repr=False)
class Tracking(Tabled):
    """Identifications of one device in the order in which they were recorded: names (n,), results, drifts by number."""

    names: tuple[str, ...]
    found: tuple[Identification, ...]
    drifts: tuple[Drift, ...]

    @property
    def alarms(self) -> list[str]:
        """A sentence on every number that moved."""
        return [
            f"{one.path} moved since '{self.names[one.since]}': {amount(one.values[first_of(one)], one.unit)} in "
            f"'{self.names[first_of(one)]}', {amount(one.values[one.since], one.unit)} there"
            for one in self.drifts
            if one.since is not None
        ]

    def table(self) -> Table:
        """Every number in every campaign, what it changed by and whether its intervals allow that; those that moved
        first."""
        columns = ["parameter", *(Column(name, ROW, 5) for name in self.names)]
        rows, drifts = [], sorted(self.drifts, key=lambda one: one.since is None)
        for one in drifts:
            ends = [
                (v - _WIDE * e, v + _WIDE * e) if np.isfinite(e) else None
                for v, e in zip(one.values.tolist(), one.errors.tolist(), strict=True)
            ]
            first = one.values[first_of(one)]
            moved = "steady" if one.since is None else f"moved since {self.names[one.since]}"
            rows.append((one.path, *ends, one.change / first if first else None, moved))
        columns += [Column("change", "%", 2, note="last estimate less the first"), "verdict"]
        return Table(
            f"{len(self.names)} campaigns on one device: {len(self.alarms)} of {len(drifts)} numbers moved",
            columns,
            rows,
            self.alarms,
            units=[one.unit for one in drifts],
            flagged=[(i, len(columns) - 1) for i, one in enumerate(drifts) if one.since is not None],
        )

    def to_dict(self) -> dict[str, object]:
        """Plain data, for JSON."""
        return {
            "campaigns": list(self.names),
            "false_alarms": FALSE_ALARMS,
            "numbers": {
                one.path: {
                    "unit": one.unit,
                    "values": one.values.tolist(),
                    "errors": one.errors.tolist(),
                    "moved_since": None if one.since is None else self.names[one.since],
                    "rate": one.rate[0],
                    "rate_error": one.rate[1],
                }
                for one in self.drifts
            },
            "alarms": self.alarms,
        }

    def __repr__(self) -> str:
        return f"<Tracking of {len(self.names)} campaigns: {len(self.alarms)} numbers moved>"


def first_of(one: Drift) -> int:
    """Place of the first campaign that determines a number."""
    return int(np.flatnonzero(np.isfinite(one.values))[0])


def track(
    campaigns: Sequence[Opened | str | os.PathLike[str]], seed: int = 1, progress: Progress | None = None
) -> Tracking:
    """Identify a device from several campaigns, in the order in which they were recorded, and find what drifts.

    Parameters
    ----------
    campaigns
        At least two, as `identify` takes them.
    seed
        Of the draws.
    progress
        Called as ``progress(done, total, what)``, of each campaign.

    Returns
    -------
    Tracking
        Every number over the series, with an alarm where it moves by more than its intervals allow: a steady device
        raises one in a hundred series (`FALSE_ALARMS`).

    Raises
    ------
    InputError
        For fewer than two campaigns, and as `identify` does.
    """
    if len(campaigns) < 2:
        raise InputError(f"a series needs at least two campaigns, got {len(campaigns)}")
    opened = [one if isinstance(one, Opened) else read_campaign(one) for one in campaigns]
    found = [identify(one, seed, progress) for one in opened]
    paths = list(dict.fromkeys(path for one in found for step in one.steps.values() for path in step.paths))
    units = {key: one.unit for result in found for key, one in float_paths(result.model.scene).items()}
    estimates = {path: np.array([_estimate(one, path) for one in found]) for path in paths}
    several = {path: both for path, both in estimates.items() if np.isfinite(both[:, 1]).sum() > 1}
    tests = sum(2 * (int(np.isfinite(both[:, 1]).sum()) - 1) for both in several.values())
    drifts = []
    for path, (values, errors) in ((path, both.T) for path, both in several.items()):
        since, rate = drift_of(values, errors, tests)
        drifts.append(Drift(path, units[path], values, errors, since, rate))
    return Tracking(_names(opened), tuple(found), tuple(drifts))


def write_track(series: Tracking, folder: Path) -> list[Path]:
    """Write track.json and track.csv into a folder, and return their paths; InputError if it cannot be written."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers, rows = folder / "track.json", folder / "track.csv"
    write_text(numbers, json_text(series.to_dict() | {"tarsus": package_version()}) + "\n")
    write_text(rows, series.table().csv())
    return [numbers, rows]


def _names(opened: Sequence[Opened]) -> tuple[str, ...]:
    """The campaigns' folders, by their names; with their places where two have one name."""
    names = [one.folder.resolve().name for one in opened]
    same = len(set(names)) < len(names)
    return tuple(f"{n + 1}: {name}" if same else name for n, name in enumerate(names))


def _estimate(found: Identification, path: str) -> tuple[float, float]:
    """A number as a campaign determines it, with half of its 95 % interval as so many standard errors."""
    for step in found.steps.values():
        if path in step.paths:
            low, high = step.interval(path)
            value, error = step.value(path), 0.5 * (high - low) / _WIDE
            if np.isfinite(error) and error > 0.0:
                return value, error
    return float("nan"), float("nan")


def drift_of(values: ArrayLike, errors: ArrayLike, tests: int) -> tuple[int | None, tuple[float, float]]:
    """Where a series first moves, and its trend.

    Each estimate is compared with the weighted mean of all before it, which finds a jump, and the weighted slope up to
    it with zero, which finds a slow drift. Both are normal with known errors while nothing changes, and the limit is
    that of `FALSE_ALARMS` over all tests of the series together.

    Parameters
    ----------
    values, errors
        (n,): estimates and standard errors, NaN where there is none.
    tests
        Comparisons made in the whole series, of all its numbers.
    """
    value, error = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
    limit = -float(ndtri(0.5 * FALSE_ALARMS / max(tests, 1)))
    known = np.flatnonzero(np.isfinite(value) & np.isfinite(error))
    since, rate = None, (float("nan"), float("nan"))
    for end in range(1, len(known)):
        before, now = known[:end], known[end]
        weight = 1.0 / error[before] ** 2
        mean = float(weight @ value[before] / weight.sum())
        apart = abs(value[now] - mean) / np.hypot(error[now], weight.sum() ** -0.5)
        so_far = known[: end + 1]
        line, covariance = np.polyfit(so_far, value[so_far], 1, w=1.0 / error[so_far], cov="unscaled")
        rate = float(line[0]), float(covariance[0, 0] ** 0.5)
        if since is None and (apart > limit or abs(rate[0]) > limit * rate[1]):
            since = int(now)
    return since, rate
