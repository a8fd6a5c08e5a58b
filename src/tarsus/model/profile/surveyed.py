"""A ground that was surveyed: a file of places and heights, or a row of a height map."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, MaybeAmount, quantity
from tarsus.model.profile.base import Floats, Profile


class SurveyedGround(Profile):
    """Heights of a text file: two columns, places and heights; or with ``spacing`` one row of a map of heights.

    With ``across`` each foot has the line of the map at its own place: rows are as far apart as points of one, ``row``
    lies below the robot's middle and those after it to the left; between two rows heights are interpolated.

    Columns are separated by commas, semicolons or blanks; lines that begin with # are left out. A relative file is
    looked for next to the scene file, then in the current folder.
    """

    kind: Literal["file"] = "file"
    file: str
    spacing: MaybeAmount = quantity("m", "distance between points: the file is a map of heights", default=None, gt=0)
    row: int = Field(default=0, ge=0, description="row of the map")
    unit: Amount = quantity("m", "length that the file's numbers are in", default=1.0, gt=0)
    periodic: bool = False
    across: bool = Field(
        default=False, description="whether feet have the map's line at their own place, or all have its row"
    )

    @field_validator("file")
    @classmethod
    def _resolve(cls, value: str, info: ValidationInfo) -> str:
        folder = (info.context or {}).get("folder")
        if folder is None or Path(value).is_absolute() or not (there := Path(folder) / value).exists():
            return value
        return str(there.resolve())

    def points(self) -> Floats:
        table = _table(self.file)
        if self.spacing is None:
            if table.shape[1] != 2:
                text = f"expected two columns, places and heights, got {table.shape[1]}"
                raise PathErrors([("file", f"{text}: a map of heights needs its spacing")])
            return self.unit * table
        if self.row >= len(table):
            raise PathErrors([("row", f"the map has {len(table)} rows, counted from 0")])
        return self._along(float(self.row))

    def side_by_side(self, places: Sequence[float]) -> list[Floats]:
        return [self._along(self._row(y)) for y in places]

    def faults(self, feet: Mapping[str, float]) -> list[tuple[str, str]]:
        if not self.across:
            return []
        if self.spacing is None:
            return [("across", "two columns are one line: a map of heights needs its spacing")]
        last = len(_table(self.file)) - 1
        return [
            ("across", f"foot '{name}' would go along row {self._row(y):.6g} of a map of rows 0 to {last}")
            for name, y in feet.items()
            if not 0.0 <= self._row(y) <= last
        ]

    def _row(self, y: float) -> float:
        """Place among the rows at a place [m] to the left of the robot's middle."""
        assert self.spacing is not None  # checked by `faults`
        return self.row + y / self.spacing

    def _along(self, row: float) -> Floats:
        """Points along a row of the map, or between two."""
        assert self.spacing is not None
        table = _table(self.file)
        low = min(int(row), len(table) - 1)
        high = min(low + 1, len(table) - 1)
        heights = table[low] if row == low else table[low] + (row - low) * (table[high] - table[low])
        return np.stack([self.spacing * np.arange(table.shape[1]), self.unit * heights], axis=1)

    @property
    def wide(self) -> bool:
        return self.across

    @property
    def repeats(self) -> bool:
        return self.periodic


@lru_cache(maxsize=16)
def _table(file: str) -> Floats:
    try:
        lines = Path(file).read_text(encoding="utf-8").replace(";", " ").replace(",", " ").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise PathErrors([("file", f"cannot be read: {error}")]) from None
    try:
        rows = [[float(word) for word in line.split()] for line in lines if line.strip() and line[0] != "#"]
        table = np.array(rows, dtype=float)
    except ValueError:
        raise PathErrors([("file", f"'{file}' is no table of numbers")]) from None
    if table.ndim != 2 or not np.isfinite(table).all():
        raise PathErrors([("file", f"'{file}' is no table of numbers")])
    return table
