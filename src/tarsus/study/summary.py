"""What a collected sweep says: its measures by run, the ends of each and where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from tarsus.base.spec import float_paths
from tarsus.solve import Run
from tarsus.study.sweep import Sweep
from tarsus.tables.numbers import amount, path_end, spaced
from tarsus.tables.table import ROW, Column, Table

FEW = 40
"""An axis of at most so many different values has a line through the median runs at each, and a map of two."""


@dataclass(frozen=True)
class SweepValues:
    """Runs (nr,): their values by axis, measures by name [SI], and outcomes; `every` so manieth run of the sweep. Of
    settled motions also the standard deviations between starts by measure, and the shares of starts that repeat; maps:
    of a grid of two swept values with few levels the measures over both, the first one across."""

    points: Mapping[str, np.ndarray]
    values: Mapping[str, np.ndarray]
    code: np.ndarray
    every: int
    between: Mapping[str, np.ndarray]
    settled: np.ndarray | None
    maps: Mapping[str, xarray.DataArray]

    @property
    def repeating(self) -> float | None:
        """Share of all starts that repeat; None of episodes."""
        return None if self.settled is None else float(np.nanmean(self.settled))


def read_scored(sweep: Sweep, file: Path, every: int = 1) -> SweepValues:
    """A collected sweep, or so manieth of its runs."""
    with xarray.open_dataset(file, engine="h5netcdf") as stored:

        def thin(name: str) -> np.ndarray:
            return stored[name].values.reshape(-1)[::every]

        lasting, sizes = "settled" in stored, stored["code"].shape
        few = len(sizes) == 2 and min(sizes) > 1 and max(sizes) <= FEW
        return SweepValues(
            points={name: one[::every] for name, one in sweep.points().items()},
            values={name: thin(name) for name in sweep.measures},
            code=thin("code"),
            every=every,
            between={name: thin(f"{name}_over_starts") for name in sweep.measures if lasting},
            settled=thin("settled") if lasting else None,
            maps={name: stored[name].transpose().load() for name in sweep.measures if few},
        )


def summary(sweep: Sweep, found: SweepValues) -> dict[str, dict[str, Any]]:
    """By measure its unit, how many runs gave a number, the least, median and most of them [SI], and where the ends
    are; of settled motions also the median deviation between starts."""
    kinds, data = Run.offered(sweep.scene, sweep.seconds), {}
    for name, values in found.values.items():
        known = np.flatnonzero(np.isfinite(values))
        data[name] = {"unit": kinds[name].unit, "runs": len(known)}
        if not len(known):
            continue
        low, high = known[np.argsort(values[known], kind="stable")][[0, -1]].tolist()
        data[name] |= {
            "least": float(values[low]),
            "median": float(np.median(values[known])),
            "most": float(values[high]),
            "least_at": {axis: float(one[low]) for axis, one in found.points.items()},
            "most_at": {axis: float(one[high]) for axis, one in found.points.items()},
        }
        if found.between:
            data[name]["between"] = float(np.nanmedian(found.between[name]))
    return data


def summary_table(data: Mapping[str, Mapping[str, Any]], units: Mapping[str, str]) -> Table:
    """The same in rows; units: of the axes."""

    def where(place: Mapping[str, float] | None) -> str:
        return ", ".join(f"{path_end(name)} {amount(value, units[name])}" for name, value in (place or {}).items())

    between = any("between" in one for one in data.values())
    numbers = ("least", "median", "most", *(("between",) if between else ()))
    rows = [
        (spaced(name), one["runs"], *map(one.get, numbers), *(where(one.get(key)) for key in ("least_at", "most_at")))
        for name, one in data.items()
    ]
    columns = (
        "measure",
        "runs",
        *(Column(one, ROW) for one in ("least", "median", "largest")),
        *((Column("between starts, median", ROW, 2),) if between else ()),
        "least at",
        "largest at",
    )
    return Table("", columns, rows, units=[one["unit"] for one in data.values()])


def units_of_axes(sweep: Sweep) -> dict[str, str]:
    """Units of the swept values."""
    known = float_paths(sweep.scene)
    return {name: known[sweep.paths(name)[0]].unit for name in sweep.vary}
