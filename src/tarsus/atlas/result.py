"""A finished map: classes over two numbers of a scene, measures of every run, and its files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.atlas.axis import MapAxis
from tarsus.atlas.cells import MEASURES
from tarsus.atlas.classes import words
from tarsus.atlas.overlays import Overlay, branches_over, overlays_of
from tarsus.atlas.quadtree import Quadtree
from tarsus.base.workers import Workers
from tarsus.files.jsontext import json_text
from tarsus.files.series import Variable, write_netcdf
from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.model.scene import Scene
from tarsus.tables.numbers import spaced
from tarsus.tables.table import Column, Table, Tabled

Floats = NDArray[np.float64]

ATLAS_FILES = ("atlas.json", "atlas.nc", "cells.csv")


@dataclass(frozen=True, repr=False)
class Atlas(Tabled):
    """A map of a scene over two of its numbers.

    grid: classes on (2^depth + 1)^2 points, by x and y, and which run each is from; code (nr,) of every run, codes
    (nr, starts) of each of its starts; measures (nr,) [SI] by name; overlays: what is drawn over it.
    """

    scene: Scene
    x: MapAxis
    y: MapAxis
    starts: int
    grid: Quadtree
    code: NDArray[np.int16]
    codes: NDArray[np.int16]
    measures: dict[str, Floats]
    overlays: Sequence[Overlay] = field(default=())

    def __repr__(self) -> str:
        return f"<Atlas of {self.scene.name!r} over {self.x.path} and {self.y.path}: {len(self.code)} cells run>"

    @property
    def size(self) -> int:
        """Points of the grid each way."""
        return len(self.grid.code)

    @cached_property
    def places(self) -> Floats:
        """Values (nr, 2) [SI] of both numbers in every run."""
        share = self.grid.points / (self.size - 1)
        return np.column_stack([self.x.at(share[:, 0]), self.y.at(share[:, 1])])

    @cached_property
    def classes(self) -> list[int]:
        """Classes on the map, the most frequent first."""
        codes, counts = np.unique(self.grid.code, return_counts=True)
        return [int(codes[i]) for i in np.lexsort([codes, -counts])]

    def share(self, code: int) -> float:
        """Part of the map that is of a class."""
        return float((self.grid.code == code).mean())

    def basin(self, code: int) -> Floats:
        """Part of the starts of every run (nr,) that lead to a class."""
        return (self.codes == code).mean(axis=1)

    def class_at(self, x: float, y: float) -> str:
        """Class at the point of the grid next to values [SI], in words."""
        i, j = (round(float(a.share(v)) * (self.size - 1)) for a, v in ((self.x, x), (self.y, y)))
        return words(int(self.grid.code[i, j]))

    def overlaid(
        self, *what: str | os.PathLike[str] | Overlay, branch: int | None = None, threads: Workers = None
    ) -> Atlas:
        """This map with more drawn over it: overlays, a .csv of two columns [SI], a study whose cuts are lines; and
        what `tarsus.branch` finds along so many lines. Raises InputError for others."""
        more = [one for w in what for one in ([w] if isinstance(w, Overlay) else overlays_of(self, w))]
        found = [] if branch is None else branches_over(self, branch, threads)
        return replace(self, overlays=(*self.overlays, *more, *found))

    def table(self) -> Table:
        """Classes with their shares of the map, and ranges of the measures in each."""
        several = self.starts > 1
        columns = (
            "class",
            Column("of the map", "%", 3),
            *([Column("of all starts", "%", 3)] if several else []),
            "runs",
        )
        rows: list[tuple[Any, ...]] = []
        for code in self.classes:
            basin = [float((self.codes == code).mean())] if several else []
            rows.append((words(code), self.share(code), *basin, int((self.code == code).sum())))
        ranges = [
            (name, *np.nanpercentile(values, (0.0, 50.0, 100.0)).tolist(), MEASURES[name][1])
            for name, values in self.measures.items()
            if np.isfinite(values).any()
        ]
        units = [MEASURES[name][0] for name, *_ in ranges]
        ends = (Column(n, "row") for n in ("least", "median", "most"))
        rows_of = [(spaced(name), *rest) for name, *rest in ranges]
        part = Table("Measures of the runs", ("measure", *ends, "what it is"), rows_of, units=units)
        run = len(self.code) / self.size**2
        notes = [
            f"{len(self.code)} of {self.size} x {self.size} points were run ({run:.1%}), {self.starts} "
            f"start{'s' * (self.starts > 1)} each; the others have the class of their square"
        ]
        title = f"Atlas of {self.scene.name} over {self.x.path} and {self.y.path}"
        return Table(title, columns, rows, notes, [part])

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI; of single runs `cells.csv` and `atlas.nc` tell."""
        return {
            "scene": self.scene.name,
            "x": self.x.to_dict(),
            "y": self.y.to_dict(),
            "points": [self.size, self.size],
            "starts": self.starts,
            "runs": len(self.code),
            "classes": [
                {
                    "class": words(code),
                    "share": self.share(code),
                    "runs": int((self.code == code).sum()),
                    "starts": float((self.codes == code).mean()),
                }
                for code in self.classes
            ],
            "tarsus": package_version(),
        }

    def cells(self) -> Table:
        """Every run: both numbers, its class, shares of its starts, measures."""
        columns = [Column(self.x.path, self.x.unit), Column(self.y.path, self.y.unit), Column("class")]
        columns += [Column(name, MEASURES[name][0]) for name in self.measures]
        values = [self.places[:, 0], self.places[:, 1], [words(int(code)) for code in self.code]]
        values += list(self.measures.values())
        if self.starts > 1:
            kinds = np.unique(self.codes).tolist()
            columns += [Column(f"share of {words(code)}") for code in kinds]
            values += [self.basin(code) for code in kinds]
        return Table("", columns, zip(*values, strict=True))

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write atlas.json, atlas.nc and cells.csv into a folder, which is made if it is not there, and returned."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / "cells.csv", self.cells().csv())
        share = np.linspace(0.0, 1.0, self.size)
        along = {axis.path: Variable((axis.path,), axis.at(share), {"units": axis.unit}) for axis in (self.x, self.y)}
        dims = (self.x.path, self.y.path)
        kinds = ", ".join(f"{code} {words(code)}" for code in self.classes)
        runs = {
            name: Variable(("run",), values, {"units": MEASURES[name][0], "long_name": MEASURES[name][1]})
            for name, values in self.measures.items()
        }
        variables = along | {
            "class": Variable(dims, self.grid.code, {"units": "1", "meanings": kinds}),
            "source": Variable(dims, self.grid.source, {"units": "1", "long_name": "number of the run"}),
            "place": Variable(("run", "axis"), self.grid.points, {"units": "1", "long_name": "grid point"}),
            "class_of_start": Variable(("run", "start"), self.codes, {"units": "1"}),
        }
        attrs = {"title": self.scene.name, "source": f"tarsus {package_version()}"}
        write_netcdf(variables | runs, attrs, folder / "atlas.nc")
        write_text(folder / "atlas.json", json_text(self.to_dict()) + "\n")
        return folder
