"""Octave's text format, by hand as Octave writes it (it is read back by no library of Python)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from record_case import Case, Held

STEP = 5e-5
N = np.arange(60)
TIP = np.round(2.0 * np.cos(0.3 * N), 6)
DRIVE = np.round(5.0 * np.sin(0.3 * N), 6)
HEAD = "# Created by Octave 8.4.0, Thu Jan 01 10:00:00 2026 UTC <lab@host>"
CHOICES = {"channels": {"tip": "mm/s", "drive": "V"}}


def _matrix(name: str, values: np.ndarray, kind: str = "matrix") -> list[str]:
    rows = [" " + " ".join(f"{one:.12g}" for one in row) for row in np.atleast_2d(values)]
    size = [f"# rows: {len(rows)}", f"# columns: {values.shape[-1]}"]
    return [f"# name: {name}", f"# type: {kind}", *size, *rows, "", ""]


def _file(*parts: list[str], names: tuple[str, str] = ("tip", "drive")) -> Callable[[Path], Held]:
    def write(path: Path) -> Held:
        path.write_text("\n".join([HEAD, *(line for part in parts for line in part)]) + "\n", encoding="utf-8")
        return Held({names[0]: ("m/s", 1e-3 * TIP), names[1]: ("V", DRIVE)}, STEP)

    return write


COLUMNS = _matrix("tip", TIP[:, None]), _matrix("drive", DRIVE[:, None])
RANGE = ["# name: t", "# type: double_range", "# base, limit, increment", f"0 {STEP * 59:.12g} {STEP:.12g}", "", ""]
FLAT = ["# name: t", "# type: matrix", "# ndims: 3", " 1 1 60", *[f" {STEP * n:.12g}" for n in N], "", ""]
TEXT = ["# name: who", "# type: sq_string", "# elements: 1", "# length: 3", "lab", "", ""]
UNITS = [
    "# name: units",
    "# type: scalar struct",
    "# ndims: 2",
    " 1 1",
    "# length: 2",
    "# name: tip",
    "# type: string",
    "# elements: 1",
    "# length: 4",
    "mm/s",
    "",
    "# name: drive",
    "# type: string",
    "# elements: 1",
    "# length: 1",
    "V",
    "",
    "",
]
CELL = [
    "# name: all",
    "# type: cell",
    "# rows: 1",
    "# columns: 2",
    *_matrix("<cell-element>", TIP),
    *_matrix("<cell-element>", DRIVE),
    "",
    "",
]
IN_CELL = {"channels": {"all/1": {"unit": "mm/s", "name": "tip"}, "all/2": {"unit": "V", "name": "drive"}}}

CASES = [
    Case("columns.mat", _file(_matrix("t", STEP * N[:, None]), *COLUMNS), CHOICES),
    Case("rows.txt", _file(_matrix("t", STEP * N), _matrix("tip", TIP, "float matrix"), COLUMNS[1]), CHOICES),
    Case("range.mat", _file(RANGE, TEXT, *COLUMNS), CHOICES),
    Case("rate.mat", _file(["# name: fs", "# type: scalar", "20000", "", ""], *COLUMNS), CHOICES),
    Case("dimensions.mat", _file(FLAT, *COLUMNS), CHOICES),
    Case("units.mat", _file(RANGE, *COLUMNS, UNITS)),
    Case("cells.mat", _file(RANGE, CELL), IN_CELL),
]
